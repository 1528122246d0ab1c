"""Curves and surfaces that a campaign speaks for: the fast sums against the plain ones, and a law of few samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from blind.tribometer import Design
from scipy.stats import multivariate_normal

from tribo.diagnostics.contrasts import share_beyond
from tribo.diagnostics.fit import ModelFit, whitened
from tribo.diagnostics.model import Setup, log_forces
from tribo.diagnostics.replicates import drawn_residuals, standardised
from tribo.lawsearch import free_curves, free_search, model_choice, search
from tribo.lawsearch.free_curves import Trees, at_knots, fitted_curve, knots_of, likeliest_products, on_either_side
from tribo.lawsearch.free_search import FreeSearch, free_columns, free_scopes, likeliest, without_outliers
from tribo.lawsearch.grammar import ADHESION_TERM, ALL, BOTH, Shape, T, WrittenLaw, column_values
from tribo.lawsearch.model_choice import CLOSE, Background, Form, FoundLaw
from tribo.lawsearch.scoring import Grammar
from tribo.lawsearch.search import TAIL_OF_EVIDENCE
from tribo.records import REGIMES
from tribo.wording.law_sentences import law_sentence

from .known import LAW, baseline, made

SIZE = 0.1


def on_one_sample(s: Setup) -> np.ndarray:
    """Friction of one sample is higher where it is warm and humid, or cold and dry."""
    c = s.observations.conditions
    both = np.sign(c.temperature_C - 23.0) * np.sign(c.humidity_pct - 49.0)
    return (0.2 * (c.sample == "A") * both)[:, None] * np.ones(2)


@cache
def campaign(repeats: int = 3) -> ModelFit:
    return baseline(made(on_one_sample, seed=3, design=Design(samples=("F", "A", "B", "Sx"), repeats=repeats)))


def searched(model: ModelFit, columns: list[tuple[str, ...]]) -> FreeSearch:
    return FreeSearch(model, *free_scopes(model.setup.observations.conditions), columns)


def test_the_evidence_is_the_marginal_likelihood_of_a_surface_over_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(free_search, "NOISES", np.ones(1))
    monkeypatch.setattr(free_search, "SIZES", np.full(1, SIZE))
    monkeypatch.setattr(free_search, "LOOKED_INTO", 0)
    model, pair = campaign(1), ("temperature_C", "humidity_pct")
    search = searched(model, [pair])
    n = model.setup.observations.n
    alone = np.linalg.inv(np.einsum("nji,njk->nik", model.factor, model.factor))
    covariance = np.zeros((n, 2, n, 2))
    covariance[np.arange(n), :, np.arange(n)] = alone
    random = model.setup.dense.reshape(2 * n, -1)
    covariance = covariance.reshape(2 * n, 2 * n) + random @ np.diag(1.0 / model.precision) @ random.T
    inverse, law = np.linalg.inv(covariance), model.jacobian.reshape(2 * n, -1)
    rest = inverse - inverse @ law @ np.linalg.solve(law.T @ inverse @ law, law.T @ inverse)
    z = without_outliers(model).residual.ravel()
    white = np.zeros((2 * n, 2 * n))
    for k in range(n):
        white[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = model.factor[k]
    not_absorbed = np.linalg.inv(white).T @ rest @ np.linalg.inv(white)
    left = not_absorbed @ (white @ z)
    noise = float(np.sum(left**2) / np.trace(not_absorbed))
    for g, scope in enumerate(search.scopes):
        if (scope.acts_on, scope.where) != (T, ALL):
            continue
        regimes = np.array([scope.regime in (BOTH, regime) for regime in REGIMES])
        likely = []
        for courses in search.courses[0]:
            course = SIZE * (courses[:, None, :] * regimes[:, None]).reshape(2 * n, -1)
            within = np.eye(course.shape[1]) + course.T @ rest @ course
            pull = course.T @ rest @ z
            likely.append(0.5 * (pull @ np.linalg.solve(within, pull) / noise - np.linalg.slogdet(within)[1]))
        # the noise of both numbers of a test as it is, or that of one number in the direction in which the law acts
        towards = np.zeros((2 * n, n))
        for k in range(n):
            moved = model.factor[k] @ regimes.astype(float)
            towards[2 * k : 2 * k + 2, k] = moved / np.linalg.norm(moved)
        covariance, along = towards.T @ not_absorbed @ towards, towards.T @ left
        numbers = np.linalg.matrix_rank(covariance, tol=1e-6)
        ratio = along @ np.linalg.pinv(covariance, rcond=1e-6) @ along / numbers / noise
        unlikely = np.exp(-0.5 * numbers * (ratio - 1.0 - np.log(ratio)))
        # short lengths and long ones, a third of it: the others are those of products and trees, which say nothing here
        expected = np.log(np.mean([1.0, unlikely]) * np.mean(np.exp(likely)) / 3.0)
        found = search.measured[0, g] + search.cost[0, g]
        assert found == pytest.approx(expected, rel=1e-6)


def test_the_evidence_of_a_product_of_two_curves_is_its_marginal_likelihood_over_none() -> None:
    """Laplace's approximation, of the likelier half: the same product with both signs turned is as likely."""
    rng, size = np.random.default_rng(1), 0.5
    courses = rng.normal(size=(200, 6))
    measured = courses @ np.outer([1.0, 0.4], [0.6, -0.8, 0.3]).ravel() + rng.normal(size=200)
    information, pull = (courses.T @ courses).reshape(2, 3, 2, 3), (courses.T @ measured).reshape(2, 3)
    (found,) = likeliest_products(information, pull, np.array([size])).evidence
    first, second = rng.normal(size=(1_000_000, 2)), rng.normal(size=(1_000_000, 3))
    products = size * (first[:, :, None] * second[:, None]).reshape(-1, 6)
    likely = products @ pull.ravel() - 0.5 * np.sum((products @ (courses.T @ courses)) * products, axis=1)
    expected = np.logaddexp.reduce(likely) - np.log(len(likely))
    assert expected > 40.0
    assert found + np.log(2.0) == pytest.approx(expected, abs=0.25)


def test_the_evidence_of_a_tree_is_the_marginal_likelihood_of_its_four_leaves_over_none() -> None:
    rng, size, noise = np.random.default_rng(2), 0.4, 1.5
    knots = np.zeros((60, 3, 4))
    knots[np.arange(60), rng.integers(0, 3, 60), rng.integers(0, 4, 60)] = 1.0
    courses, measured = knots.reshape(60, 12), np.sqrt(noise) * rng.normal(size=60)
    trees = Trees((courses.T @ courses).reshape(3, 4, 3, 4))
    pulls = trees.pulls((courses.T @ measured).reshape(3, 4))
    found = trees.evidence(pulls, np.array([size]), np.array([noise]))[:, 0]
    assert len(found) == 2 * 3**2 + 3 * 2**2  # the first split of either column, two of the other
    for k in range(len(found)):
        leaves = courses @ trees.leaves(k)
        assert np.array_equal(leaves.sum(axis=1), np.ones(60))
        alone, together = noise * np.eye(60), noise * np.eye(60) + size**2 * leaves @ leaves.T
        likely = [multivariate_normal(cov=each).logpdf(measured) for each in (together, alone)]
        assert found[k] == pytest.approx(likely[0] - likely[1], abs=1e-9)


def product_of_two_curves(s: Setup) -> np.ndarray:
    """A wave and a half of the temperature times one of the humidity."""
    c = s.observations.conditions
    along = [np.sin(3.0 * np.pi * (x - x.min()) / np.ptp(x) + 0.5) for x in (c.temperature_C, c.humidity_pct)]
    return 0.1 * (along[0] * along[1])[:, None] * np.ones(2)


def tree(s: Setup) -> np.ndarray:
    """Higher where it is warm and damp, and lower where it is cold and not quite dry."""
    c = s.observations.conditions
    warm = c.temperature_C > 23.4
    damp = c.humidity_pct > np.where(warm, 52.0, 46.0)
    return np.select([warm & damp, ~warm & damp], [0.2, -0.12], 0.0)[:, None] * np.ones(2)


HIDDEN = {"products": product_of_two_curves, "trees": tree}


@cache
def with_surface(kind: str) -> tuple[ModelFit, WrittenLaw]:
    """A campaign with a surface of a few numbers, and the law of all samples that has it."""
    model = baseline(made(HIDDEN[kind], seed=5, design=Design(samples=("F", "A", "B", "Sx"), repeats=2)))
    c = model.setup.observations.conditions
    shapes = tuple(shape for name in ("temperature_C", "humidity_pct") if (shape := knots_of(name, c)) is not None)
    return model, WrittenLaw(shapes)


@pytest.mark.parametrize("kind", HIDDEN)
def test_products_and_trees_are_likelier_than_surfaces_of_any_form(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model, _ = with_surface(kind)
    ((evidence, *_),) = likeliest(searched(model, [("temperature_C", "humidity_pct")]), 2)
    monkeypatch.setattr(free_search, "LOOKED_INTO", 0)
    ((of_surface, *_),) = likeliest(searched(model, [("temperature_C", "humidity_pct")]), 2)
    assert evidence > of_surface + CLOSE


@pytest.mark.parametrize(("kind", "nearer"), [("products", 0.8), ("trees", 0.9)])
def test_a_surface_that_is_a_product_or_a_tree_lies_nearer_to_it_than_one_of_any_form(
    kind: str, nearer: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps lie between the knots of a surface, so that a tree gains less."""
    model, law = with_surface(kind)
    effects = np.ones((model.setup.observations.n, 2))
    hidden = HIDDEN[kind](model.setup)[:, 0]

    def off() -> float:
        curve = fitted_curve(model, (law, effects), 1.0)
        told = curve.columns[:, 0] @ curve.heights
        return float(np.sqrt(np.mean((told - hidden + hidden.mean() - told.mean()) ** 2)))

    with_kind = off()
    of_kind = getattr(free_curves, f"_members_of_{kind}")

    def unlikely(*given: Any) -> list[Any]:
        return [replace(m, evidence=m.evidence - 100.0) for m in of_kind(*given)]

    monkeypatch.setattr(free_curves, f"_members_of_{kind}", unlikely)
    assert with_kind < nearer * off()


def test_a_jump_lies_anywhere_between_two_knots() -> None:
    """Drawn again and again, it is before or after a test as often as the test's place says."""
    model, law = with_surface("trees")
    c = model.setup.observations.conditions
    interpolated = at_knots(law.shapes, c)
    one, other = np.indices([len(shape.values) for shape in law.shapes]).reshape(2, -1)
    heights = 0.3 * (one > 4) - 0.2 * (one > 4) * (other > 7)
    rng, drawn = np.random.default_rng(8), []
    x, y = (np.array(column_values(c, name)) for name in law.columns)
    first, second = (np.array(shape.values) for shape in law.shapes)
    for _ in range(4000):
        beyond = x > rng.uniform(first[4], first[5])
        drawn.append(0.3 * beyond - 0.2 * beyond * (y > rng.uniform(second[7], second[8])))
    assert np.allclose(interpolated @ heights, np.mean(drawn, axis=0), atol=0.01)
    assert np.allclose(on_either_side(interpolated, heights), np.var(drawn, axis=0), atol=0.001)


@pytest.mark.parametrize("kind", HIDDEN)
def test_only_a_surface_that_jumps_is_uncertain_between_its_knots(kind: str) -> None:
    model, law = with_surface(kind)
    curve = fitted_curve(model, (law, np.ones((model.setup.observations.n, 2))), 1.0)
    course = at_knots(law.shapes, model.setup.observations.conditions)
    if kind == "trees":
        assert curve.between.max() == pytest.approx(on_either_side(course, curve.heights).max(), rel=0.2)
    else:
        assert curve.between.max() < 0.05 * on_either_side(course, curve.heights).max()


def sliding_alone(s: Setup) -> np.ndarray:
    """A wave of the temperature, as large as the noise, in the sliding force alone."""
    x = s.observations.conditions.temperature_C
    return (0.08 * np.sin(3.0 * np.pi * (x - x.min()) / np.ptp(x)))[:, None] * np.array([0.0, 1.0])


def test_a_law_of_the_sliding_force_is_judged_at_the_noise_that_it_leaves_in_the_sliding_force(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = baseline(made(sliding_alone, seed=5, design=Design(samples=("F", "A", "B", "Sx"), repeats=2)))
    ((evidence, _, scope),) = likeliest(searched(model, [("temperature_C",)]), 1)
    assert scope.regime == "sliding"
    price = free_search._price_of_noise
    monkeypatch.setattr(free_search, "_price_of_noise", lambda *given: price(*given)[:1])
    ((at_noise_of_both, *_),) = likeliest(searched(model, [("temperature_C",)]), 1)
    assert evidence > at_noise_of_both + CLOSE


def test_a_law_of_one_sample_is_judged_at_the_noise_that_it_leaves_there() -> None:
    model = campaign()
    search = searched(model, free_columns(model.setup.observations.conditions))
    ((evidence, columns, scope),) = likeliest(search, 2)
    assert set(columns) == {"temperature_C", "humidity_pct"}
    assert (scope.regime, scope.where) == (BOTH, "sample A")
    assert evidence > 6 * CLOSE  # at the noise of all samples it would be 10.6


def test_nothing_hidden_speaks_for_a_curve_or_surface_by_odds_of_20_to_1_in_few_campaigns() -> None:
    model = campaign()
    search = searched(model, free_columns(model.setup.observations.conditions))
    drawn = drawn_residuals(search.model, np.random.default_rng(4), 60).transpose(0, 2, 1)
    assert (search.evidence(drawn).max(axis=(1, 2)) > CLOSE).mean() < 0.1


def test_the_chance_of_an_evidence_beyond_all_that_were_counted_is_that_of_a_tail_with_odds_as_long_as_the_evidence():
    """However narrow the counted ones are: a likelihood ratio of k has a chance of at most 1 / k."""
    counted = np.linspace(-0.6, 0.2, 60)
    narrow, tail = (share_beyond(counted, 6.0, scale) for scale in (1e-3, TAIL_OF_EVIDENCE))
    assert narrow < 1e-9
    assert tail == pytest.approx(1 - np.exp(-np.exp(-(6.0 + 0.2) - np.euler_gamma)), rel=1e-9)


def damp_tests_lifted(s: Setup) -> np.ndarray:
    """The four dampest tests show a quarter more friction."""
    humidity = s.observations.conditions.humidity_pct
    return (0.25 * (humidity >= np.sort(humidity)[-4]))[:, None] * np.ones(2)


def test_a_curve_from_which_the_fit_gains_nothing_is_no_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search counts tests that lie far off more than the fit does."""
    model = baseline(made(damp_tests_lifted, seed=3, design=Design(samples=("F", "A", "B", "Sx"), repeats=1)))
    monkeypatch.setattr(search, "_law_of_a_formula", lambda *given: None)

    def found() -> tuple[FoundLaw, ...]:
        return search.discover_laws(model, level=0.003, replicates=20, rng=np.random.default_rng(1)).laws

    assert [law.law.columns for law in found()] == [("humidity_pct",)]
    chosen = search.choose_free
    monkeypatch.setattr(search, "choose_free", lambda *given: replace(chosen(*given), model=model))
    assert found() == ()


@pytest.mark.parametrize(
    ("column", "expected"), [("specimen_run", 0.0005), ("run_order", 0.0005), ("date", 0.0005), ("hold_s", 0.005)]
)
def test_beside_certain_days_and_drift_a_law_of_the_series_has_to_be_rarer_and_others_not(
    column: str, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    levels: list[float] = []
    best = WrittenLaw((Shape("linear", column, 1.0, 9.0),))
    monkeypatch.setattr(search, "_scored", lambda *given: [(best, 25.0, 20.0)])
    monkeypatch.setattr(search, "_worth_counting", lambda *given: None)
    monkeypatch.setattr(search, "_law_of_a_formula", lambda *given: levels.append(given[-2]))
    search.discover_laws(campaign(), level=0.005, of_series=0.1)
    assert levels == pytest.approx([expected])


@pytest.mark.parametrize(("of_a_curve", "first"), [(21.0, "curve"), (19.0, "formula")])
def test_the_more_telling_of_formula_and_curve_is_told(
    of_a_curve: float, first: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A formula of another column may follow a little of what a curve explains."""
    tried: list[str] = []

    def way(name: str) -> Any:
        return lambda *given: tried.append(name)

    monkeypatch.setattr(search, "_scored", lambda *given: [(WrittenLaw(()), 25.0, 20.0)])
    monkeypatch.setattr(search, "_worth_counting", lambda *given: SimpleNamespace(measured=np.array([3.0, of_a_curve])))
    monkeypatch.setattr(search, "_law_of_a_formula", way("formula"))
    monkeypatch.setattr(search, "_law_of_no_formula", way("curve"))
    search.discover_laws(campaign())
    assert tried[0] == first
    assert len(tried) == 2


@pytest.mark.parametrize(
    ("beyond_one_column", "left_out", "told"),
    [(2.1, 0.5, True), (1.9, 0.5, False), (2.1, -2.0, True), (2.1, -2.3, False), (30.0, -2.3, False)],
)
def test_a_second_column_is_told_at_odds_of_7_to_1_unless_tests_left_out_contradict_it(
    beyond_one_column: float, left_out: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Contradicted is what fares worse once in twenty times where it is true, of five folds."""
    model, scope = campaign(), WrittenLaw(())
    of_both = (10.0 + beyond_one_column, ("temperature_C", "humidity_pct"), scope)
    of_one = (10.0, ("temperature_C",), scope)
    monkeypatch.setattr(model_choice, "FreeSearch", lambda *given: None)
    monkeypatch.setattr(model_choice, "likeliest", lambda _, *numbers: [[of_one, of_both][k - 1] for k in numbers])
    monkeypatch.setattr(model_choice, "_surface", lambda *given: "surface")
    monkeypatch.setattr(model_choice, "_settled_surface", lambda _, surface, __: surface)
    monkeypatch.setattr(model_choice, "better_left_out", lambda *given: left_out > given[3])
    x = model.setup.observations.conditions.temperature_C
    alone = WrittenLaw((Shape("linear", "temperature_C", float(x.min()), float(x.max())),))
    found = model_choice._likelier_surface(model, Background(model, alone), alone, ())
    assert found == ("surface" if told else None)


def adhesion_of_two_samples(s: Setup) -> np.ndarray:
    """The adhesion of two samples is higher by a half where it is warm, and lower by as much where it is cold."""
    c = s.observations.conditions
    base = s.base(LAW)
    share = np.exp(log_forces(base.forces(np.zeros(s.observations.n))) - log_forces(base.forces(c.normal_load_N)))
    course = 0.5 * np.tanh((c.temperature_C - 23.0) / 0.3) * np.isin(c.sample, ["A", "Sx"])
    return np.log1p(share * np.expm1(course)[:, None])


@cache
def with_law_of_the_adhesion() -> tuple[ModelFit, FoundLaw]:
    """The campaign without the law, and the law."""
    design = Design(samples=("F", "A", "B", "Sx"), repeats=2)
    model = baseline(made(adhesion_of_two_samples, seed=2, design=design))
    (law,) = search.discover_laws(model, level=0.003, replicates=20).laws
    return model, law


def test_a_law_of_the_adhesion_of_two_samples_is_told_as_that() -> None:
    _, law = with_law_of_the_adhesion()
    assert (law.law.columns, law.law.acts_on, law.law.where) == (("temperature_C",), ADHESION_TERM, "samples A + Sx")
    assert law_sentence(law).startswith("The adhesion term of friction of samples A, Sx is higher ")


def test_without_a_law_of_the_adhesion_the_flat_law_takes_up_all_of_a_constant() -> None:
    model, law = with_law_of_the_adhesion()
    at = Background(model, law.law)
    constant = at.effects(WrittenLaw((), ADHESION_TERM))[0][:, :, None]
    left = at.without.cleared(constant)[0]
    assert np.linalg.norm(left) < 1e-3 * np.linalg.norm(whitened(at.without.factor, constant))


def test_outliers_of_a_campaign_are_no_further_off_in_those_that_it_makes_itself() -> None:
    """A test far off has little weight in a campaign; drawn into another one, it would have all of it."""
    model = baseline(made(lambda s: outliers(s.observations.n), seed=3, design=Design(samples=("F", "A", "B", "Sx"))))
    near = without_outliers(model)
    furthest = [np.sqrt(np.sum(standardised(f) ** 2, axis=1)).max() for f in (model, near)]
    assert furthest[0] > 10.0
    assert furthest[1] < 6.0


def outliers(n: int) -> np.ndarray:
    """Three tests that lie far off."""
    return np.where(np.arange(n) % (n // 3) == 1, 1.5, 0.0)[:, None] * np.ones(2)


def test_the_form_that_is_told_is_the_one_that_was_fitted_also_where_the_best_is_out_of_reach(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model, calls = campaign(1), 0

    def without_the_best(*given: Any) -> list[Form]:
        nonlocal calls
        calls += 1
        forms = of_all(*given)
        return forms[1:] if calls == 3 else forms

    of_all = model_choice._forms_at
    monkeypatch.setattr(model_choice, "ROUNDS", 1)
    monkeypatch.setattr(model_choice, "_forms_at", without_the_best)
    background, forms = model_choice.forms_in_reach(model, Grammar(model))
    assert calls == 3
    assert background.law == forms[0].best
