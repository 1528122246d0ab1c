"""The virtual laboratories themselves: sizes are what is stated, seeds repeat, nothing hidden is nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from .campaign import Made, bare_bench, both, make, stream
from .handed_over import handed_over
from .laboratory import Laboratory, day_of, drawn_laboratory
from .levels import COLUMNS as LEVEL_COLUMNS, MOST, OF_NUMBERS, hide_levels, level_laboratory, shape_at
from .nuisance import DAYS, DAYS_APART, DRIFT, FORMS, KINDS, SPECIMEN_DRIFT, Nuisance, course_of, draw_nuisance, mixture
from .observer import Observer
from .odd_shapes import odd_course, pattern_deviations, repeat_deviations, specimen_deviations
from .one_value import SIZES, STRENGTH, hide_one_value

SMALL = Laboratory(samples=("F", "A", "B"), days=6)
STILL = replace(SMALL, repeat_sd=(0.0, 0.0), specimen_sd=0.0, specimen_slope=0.0, specimens_are="plain")
EACH = [(kind, form) for kind in KINDS for form in FORMS[kind]]


def rms(change: np.ndarray) -> float:
    return float(np.sqrt(np.mean((change - change.mean(axis=0)) ** 2)))


@pytest.mark.parametrize(("kind", "form"), EACH)
def test_a_nuisance_has_the_size_that_is_stated(kind: str, form: str) -> None:
    made = make(3, STILL, [Nuisance(kind, form, 0.07)])
    assert rms(np.log(both(made.bench)) - np.log(both(bare_bench(3, STILL)))) == pytest.approx(0.07, rel=1e-9)
    assert made.truth["nuisance"][kind] == pytest.approx(7.0)


def test_two_kinds_of_days_are_told_as_one_size() -> None:
    made = make(3, STILL, [Nuisance(DAYS, "normal", 0.05), Nuisance(DAYS_APART, "heavy", 0.03)])
    assert made.truth["nuisance"]["all days"] == pytest.approx(
        100 * rms(made.nuisance[DAYS] + made.nuisance[DAYS_APART]), rel=1e-3
    )


@pytest.mark.parametrize("form", FORMS[DAYS])
def test_days_move_all_pulls_of_a_day_alike_and_apart_moves_the_regimes_apart(form: str) -> None:
    tests = bare_bench(4, SMALL).tests
    correlations = []
    for seed in range(12):
        days, apart = (course_of(Nuisance(k, form, 0.05), tests, stream(seed, 90)) for k in (DAYS, DAYS_APART))
        for course in (days, apart):
            for day in np.unique(day_of(tests)):
                assert np.ptp(course[day_of(tests) == day], axis=0) == pytest.approx(0.0, abs=1e-12)
        assert days[:, 0] == pytest.approx(days[:, 1])
        correlations.append(np.corrcoef(apart.T)[0, 1])
    assert min(correlations) < 0.2


@pytest.mark.parametrize("form", FORMS[SPECIMEN_DRIFT])
def test_drift_of_specimens_has_no_mean_in_any_of_them(form: str) -> None:
    tests = bare_bench(5, SMALL).tests
    course = course_of(Nuisance(SPECIMEN_DRIFT, form, 0.05, heavy=True, shared=0.5), tests, stream(5, 90))
    means = [course[rows].mean() for rows in tests.groupby("specimen").indices.values()]
    assert means == pytest.approx(np.zeros(len(means)), abs=1e-12)


def test_drift_along_the_series_is_slow() -> None:
    tests = bare_bench(5, SMALL).tests
    for form in FORMS[DRIFT]:
        course = course_of(Nuisance(DRIFT, form, 0.05), tests, stream(5, 90))[:, 0]
        assert np.median(np.abs(np.diff(course))) < 0.02


def test_sizes_are_drawn_between_2_and_10_percent_or_add_to_the_whole() -> None:
    rng = np.random.default_rng(2)
    drawn = [one.rms for _ in range(200) for one in draw_nuisance(KINDS, rng)]
    assert 0.02 <= min(drawn) < 0.025
    assert 0.095 < max(drawn) <= 0.10
    assert np.linalg.norm([one.rms for one in draw_nuisance(KINDS, rng, 0.05)]) == pytest.approx(0.05)


def test_a_mixture_has_one_kind_or_more_and_all_kinds_alike() -> None:
    rng = np.random.default_rng(2)
    drawn = [mixture(rng) for _ in range(500)]
    numbers = np.bincount([len(kinds) for kinds in drawn], minlength=5) / len(drawn)
    assert numbers == pytest.approx([0, 0.4, 0.4, 0.1, 0.1], abs=0.06)
    shares = [np.mean([kind in kinds for kinds in drawn]) for kind in KINDS]
    assert np.ptp(shares) < 0.1


def test_nothing_hidden_leaves_flat_law_and_patterns_alone() -> None:
    made = make(6, replace(STILL, pattern_rms=0.0, patterns_are="plain"))
    flat = made.bench.column("sample") == "F"
    mu, tau_kPa = made.bench.law[:2]
    assert made.bench.static[flat] == pytest.approx(mu * made.bench.column("N")[flat] + tau_kPa * 55e-3)
    assert not made.change.any()


def arrays(made: Made) -> list[np.ndarray]:
    return [both(made.bench), made.change, made.bench.tests.to_numpy().astype(str)]


def test_the_same_seed_gives_the_same_campaign_and_another_seed_another() -> None:
    def at(seed: int) -> Made:
        laboratory = drawn_laboratory(seed, samples=("F", "A", "B"))
        nuisance = draw_nuisance(KINDS, np.random.default_rng(seed))
        return make(seed, laboratory, nuisance, hide_one_value(seed, laboratory, "operator"))

    first, again, other = arrays(at(7)), arrays(at(7)), arrays(at(8))
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert first[0].shape != other[0].shape or not np.allclose(first[0], other[0])


def test_what_is_hidden_changes_nothing_else_that_is_drawn() -> None:
    nuisance = [Nuisance(DRIFT, "walk", 0.05)]
    plain = make(9, SMALL, nuisance)
    changed = make(9, SMALL, nuisance, hide_one_value(9, SMALL, "recipe"))
    assert plain.bench.tests.equals(changed.bench.tests)
    assert np.log(both(changed.bench)) == pytest.approx(np.log(both(plain.bench)) + changed.change)


@pytest.mark.parametrize("order", ["random", "in order"])
@pytest.mark.parametrize("days", [6, 20])
def test_a_campaign_has_its_days_its_order_and_a_room(order: str, days: int) -> None:
    tests = bare_bench(11, drawn_laboratory(11, order=order, days=days)).tests
    assert len(np.unique(day_of(tests))) == days
    assert tests["started_at"].is_monotonic_increasing
    ascending = tests.groupby(["sample", "specimen"])["mass_g"].apply(lambda m: m.is_monotonic_increasing)
    assert ascending.all() == (order == "in order")
    hours = tests["started_at"].str[11:13].astype(int)
    assert hours.between(7, 22).all()
    warm = tests["temperature_C"].groupby(day_of(tests))
    assert warm.mean().std() > 0.2
    assert warm.std().mean() < 2.5
    assert tests["humidity_pct"].between(8, 95).all()
    assert tests["operator"].nunique() >= 2


def test_patterns_deviate_by_lines_of_the_stated_size_and_by_odd_curves_of_theirs() -> None:
    plain = Laboratory(pattern_rms=0.05, patterns_are="plain")
    load = (np.array(plain.masses_g) + 1.5) * 1e-3 * 9.80665
    lines = pattern_deviations(plain, np.random.default_rng(1))
    assert np.sqrt(np.mean([d(load) ** 2 for d in lines.values()])) == pytest.approx(0.05)
    odd = replace(plain, pattern_rms=0.0, patterns_are="odd", pattern_curve=0.01)
    along = np.exp(np.linspace(np.log(load[0]), np.log(load[-1]), 201))
    curves = [d(along) for s in range(40) for d in pattern_deviations(odd, np.random.default_rng(s)).values()]
    assert np.sqrt(np.mean(np.square(curves))) == pytest.approx(0.01, rel=0.1)


def test_no_parabola_follows_an_odd_course() -> None:
    x = np.linspace(-3, 1, 201)
    left = []
    for seed in range(40):
        y = odd_course(np.random.default_rng(seed), -3, 1)(x)
        assert y.mean() == pytest.approx(0.0, abs=1e-9)
        assert y.std() == pytest.approx(1.0)
        left.append(np.std(y - np.polyval(np.polyfit(x, y, 2), x)))
    assert np.median(left) > 0.3


def test_specimens_and_repeats_scatter_as_stated() -> None:
    laboratory = Laboratory(samples=("F",), specimens=300, specimen_sd=0.04, specimen_slope=0.0,
                            specimens_are="plain", repeat_sd=(0.08, 0.06), noise_of={"F": 1.5})  # fmt: skip
    tests = bare_bench(12, laboratory).tests
    own = specimen_deviations(laboratory, tests, np.random.default_rng(1))
    assert own.std(axis=0) == pytest.approx([0.04, 0.04], rel=0.15)
    for tails in ("normal", "heavy"):
        noise = repeat_deviations(replace(laboratory, tails=tails), tests, np.random.default_rng(1))
        assert noise.std(axis=0) == pytest.approx([0.12, 0.09], rel=0.1)


def test_the_observer_sees_a_change_of_half_of_all_specimens_as_least_squares_would() -> None:
    """Without specimens and with free laws, the error of a change of half of the pulls follows from their number."""
    laboratory = replace(STILL, samples=("F",), specimens=20, repeat_sd=(0.08, 0.08))
    bench = bare_bench(13, laboratory)
    half = (bench.column("repeat") == 1)[:, None] * np.array([0.05, 0.0])
    expected = 0.05 / (0.08 * np.sqrt(4 / len(half)) * np.sqrt(1 - 0.5**2))
    assert Observer(bench, laboratory, draws=2).strength(half) == pytest.approx(expected, rel=0.01)


def test_the_observer_sees_less_under_nuisance() -> None:
    bench = bare_bench(14, SMALL)
    first = (day_of(bench.tests) == day_of(bench.tests)[0])[:, None] * np.array([0.1, 0.1])
    free = Observer(bench, SMALL, draws=100).strength(first)
    each = [[Nuisance(k, FORMS[k][0], 0.05)] for k in KINDS]
    under = [Observer(bench, SMALL, one, draws=100).strength(first) for one in each]
    assert all(x < free for x in under)
    assert under[0] < free / 2
    assert under[1] < free / 2


@pytest.mark.parametrize("kind", SIZES)
def test_a_cause_of_one_value_acts_on_that_value_alone_and_is_clear(kind: str) -> None:
    laboratory = replace(SMALL, pattern_rms=0.15)
    made = make(15, laboratory, hide=hide_one_value(15, laboratory, kind))
    column, value = made.truth["column"], made.truth["value"]
    values = day_of(made.bench.tests) if column == "date" else made.bench.column(column).astype(str)
    assert np.array_equal((made.change != 0).any(axis=1), values == value)
    assert made.truth["strength"] >= STRENGTH or abs(made.truth["size"]) == pytest.approx(SIZES[kind][2])
    assert abs(made.truth["size"]) <= SIZES[kind][2]


def test_one_operator_changes_both_forces_by_the_stated_share() -> None:
    made = make(16, SMALL, hide=hide_one_value(16, SMALL, "operator"))
    here = made.bench.column("operator") == made.truth["value"]
    assert np.expm1(made.change[here]) == pytest.approx(np.full((here.sum(), 2), made.truth["size"]), abs=1e-5)


@pytest.mark.parametrize("column", LEVEL_COLUMNS)
def test_levels_act_by_their_stated_values(column: str) -> None:
    number = MOST.get(column, 6)
    laboratory = level_laboratory(17, column, number)
    made = make(17, laboratory, hide=hide_levels(17, laboratory, column, "any"))
    levels = dict(made.truth["levels"])
    assert len(levels) == number
    assert sum(levels.values()) == pytest.approx(0.0, abs=1e-5)
    here = np.isin(made.bench.column("sample"), made.truth["samples"])
    expected = np.array([levels[str(v)] for v in made.bench.column(column)])
    for k in (0, 1):
        assert made.change[here, k] == pytest.approx(expected[here] * made.truth["regimes"][k], abs=1e-5)
    assert not made.change[~here].any()


@pytest.mark.parametrize("shape", OF_NUMBERS)
def test_a_shape_of_levels_is_what_its_name_says(shape: str) -> None:
    x = np.array([0.1, 0.2, 0.5, 1.0, 3.0])
    y = shape_at(x.tolist(), shape, np.random.default_rng(3))
    assert np.sqrt(np.mean(y**2)) == pytest.approx(1.0)
    degree = {"line": (x, 1), "line of ln": (np.log(x), 1), "parabola of ln": (np.log(x), 2)}
    if shape in degree:
        along, order = degree[shape]
        assert np.polyval(np.polyfit(along, y, order), along) == pytest.approx(y)
    if shape in ("step", "one apart"):
        assert len(np.unique(y.round(9))) == 2
    if shape == "rising":
        assert len(set(np.sign(np.diff(y)))) == 1


def test_a_campaign_is_handed_over_with_its_columns_and_its_gaps() -> None:
    made = make(18, SMALL)
    n = len(made.bench.tests)
    cells = {
        "temperature_C": np.array([None, *made.bench.column("temperature_C")[1:]], object),
        "film_um": np.array(["<5", *made.bench.column("film_um")[1:]], object),
        "speed_mm_s": np.array([None] * n, object),
    }
    whole = handed_over(made.bench, 18, ("film_um", "lot"), np.arange(n) < 20, cells)
    first, second = whole.campaign.tests[:2]
    assert len(whole.campaign.tests) == 20
    assert first.temperature_C is None
    assert second.temperature_C == made.bench.column("temperature_C")[1]
    assert first.covariates == {"film_um": "<5", "lot": made.bench.tests["lot"][0]}
    assert second.speed_m_s is None
    assert second.operator == made.bench.tests["operator"][1]
