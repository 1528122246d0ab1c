"""What explains a screened campaign: what a mechanism earns, which are told apart, what chance gives, what is named."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tribo.diagnostics import candidates as naming, candidates as rivals, candidates as weighing, examine
from tribo.diagnostics.candidates import (
    CHOICES_FITTED,
    CLOSE,
    IN_COMMON,
    LIKELY,
    PER_PARAMETER,
    TIED,
    CauseCandidate,
    Named,
    best_beyond_chance,
    judged,
    refitted,
    sort_rivals,
    weigh,
    weights_of,
)
from tribo.diagnostics.contrasts import FEWEST, Screen, _strongest as strongest, decided, deviate
from tribo.diagnostics.diagnosis import Diagnosis
from tribo.diagnostics.model import Acting, Setup, effect_of
from tribo.diagnostics.score_statistics import start_effects
from tribo.mechanisms import MECHANISMS
from tribo.records import FloatArray
from tribo.wording.verdict_sentences import worded

from .known import LAW, acting, baseline, made


def candidate(gain: float, raw: float | None = None, name: str = "suction") -> CauseCandidate:
    fit: Any = None
    return CauseCandidate(Acting(MECHANISMS[name]), fit, gain, gain if raw is None else raw)


def screened(chance: list[float], library: list[float]) -> Screen:
    return Screen((), np.array([2.0, 5.0]), np.zeros(2), (), np.array(chance), np.array(library), np.zeros(2))


def fitted(score: float, name: str, *values: float) -> Any:
    return SimpleNamespace(score=score, acting=(Acting(MECHANISMS[name], "x"),), values=[np.array(values)])


def test_a_fit_earns_its_score_less_one_for_every_further_parameter_and_the_logarithm_of_its_choices() -> None:
    start: Any = SimpleNamespace(score=-100.0)
    one = judged(start, fitted(-90.0, "suction", 5e3), choosing=0.0)
    assert (one.raw, one.gain) == (10.0, 10.0)
    three = judged(start, fitted(-90.0, "cavity_collapse", 0.5, 1e4, 0.3), choosing=np.log(7.0))
    assert three.raw == 10.0 - 2 * PER_PARAMETER
    assert three.gain == pytest.approx(8.0 - np.log(7.0))
    assert three.values.tolist() == [0.5, 1e4, 0.3]


def test_a_wrong_label_pays_for_being_less_or_more_than_whole() -> None:
    """Two standard deviations, of 0.15, from the whole effect cost two units of log likelihood."""
    start: Any = SimpleNamespace(score=-100.0)
    for share in (0.7, 1.3):
        found = judged(start, fitted(-90.0, "mislabelled_specimen", share), choosing=0.0)
        assert found.raw == pytest.approx(10.0 - 2.0)
    assert judged(start, fitted(-90.0, "mislabelled_specimen", 1.0), choosing=0.0).raw == 10.0


def test_the_strength_of_a_candidate_is_that_of_a_normal_deviate_before_choices_are_paid_for() -> None:
    assert candidate(gain=1.0, raw=8.0).strength == 4.0
    assert candidate(gain=-9.0, raw=-8.0).strength == 0.0


def test_the_first_that_chance_does_not_make_as_strong_is_the_best() -> None:
    seen = screened([], [k / 50 for k in range(200)])  # chance reaches 3.98
    weak, fair, strong = (candidate(g, raw=r) for g, r in ((20.0, 2.0), (15.0, 40.0), (10.0, 60.0)))
    assert best_beyond_chance([weak, fair, strong], seen, 0.01) is fair
    assert best_beyond_chance([weak], seen, 0.01) is None
    assert best_beyond_chance([], seen, 0.01) is None


def test_what_is_not_likely_once_its_choices_are_paid_for_explains_no_misfit() -> None:
    """Odds of 100 to 1 are 4.6 of log likelihood; one wrong label of 300 pays 5.7 for being chosen."""
    seen = screened([], [k / 50 for k in range(200)])
    assert best_beyond_chance([candidate(4.5, raw=40.0)], seen, 0.01) is None
    assert best_beyond_chance([candidate(4.7, raw=40.0)], seen, 0.01) is not None


def ranked_by(start_left: np.ndarray, target: np.ndarray, name: str) -> list[str]:
    acting = tuple(Acting(MECHANISMS[name], str(k)) for k in range(start_left.shape[1]))
    pull, length = start_left.T @ target, np.sqrt(np.sum(start_left**2, axis=0))
    start: Any = SimpleNamespace(acting=acting, pull=pull, length=length)
    return [a.choice for a in weighing._most_promising(start, list(range(len(acting))))]


def test_of_many_choices_those_with_the_strongest_score_are_fitted_whatever_their_sign() -> None:
    """The score of a column is its product with the residual over its own length."""
    target = np.array([6.0, -5.0, 4.0, 0.5, 3.0, 0.1])
    assert CHOICES_FITTED == 4
    assert ranked_by(np.diag([1.0, 10.0, 1.0, 100.0, 1.0, 1.0]), target, "covariate") == ["0", "1", "2", "4"]
    assert ranked_by(np.eye(6)[:, :4], target, "covariate") == ["0", "1", "2", "3"]  # few: all, in their order


def test_of_wrong_labels_those_whose_whole_effect_explains_most_are_fitted() -> None:
    """Log likelihood of the whole effect: product with the residual less half its squared length; 5.5, -17.5, ..."""
    target = np.array([6.0, -5.0, 4.0, 0.5, 3.0, 0.1])
    lengths = np.array([1.0, 5.0, 1.0, 1.0, 6.0, 1.0])
    # whole effects: 5.5, -37.5, 3.5, 0, 0, -0.4
    assert ranked_by(np.diag(lengths), target, "mislabelled_specimen")[:2] == ["0", "2"]
    assert set(ranked_by(np.diag(lengths), target, "mislabelled_specimen")) == {"0", "2", "3", "4"}


def sorted_by(
    monkeypatch: pytest.MonkeyPatch, best: CauseCandidate, others: dict[float, CauseCandidate]
) -> tuple[list[CauseCandidate], list[CauseCandidate]]:
    """Those alike and the rivals, where each other candidate has a cosine with the best."""
    cosines = {id(c): cosine for cosine, c in others.items()}
    monkeypatch.setattr(rivals, "_likeness", lambda start, b, near: np.array([cosines[id(c)] for c in near]))
    start: Any = None
    alike, distinct = sort_rivals(start, best, [best, *others.values()])
    assert alike[0] is best
    return list(alike[1:]), list(distinct)


def test_a_mechanism_is_told_apart_by_its_difference_or_by_having_little_in_common(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a gain of 20, twice the tie of 3 must lie outside what is in common: a squared cosine below 0.7."""
    assert TIED == (3.0, 0.08)
    assert IN_COMMON == 0.5
    best = candidate(20.0)
    near, far = candidate(18.0), candidate(18.5)
    assert sorted_by(monkeypatch, best, {0.84: near, 0.83: far}) == ([near], [far])  # 0.7056 and 0.6889
    weak = candidate(9.0)  # the tie is never reached: only what is in common counts
    half, less = candidate(8.0), candidate(8.5)
    assert sorted_by(monkeypatch, weak, {0.71: half, 0.70: less}) == ([half], [less])
    assert sorted_by(monkeypatch, weak, {-0.99: half}) == ([], [half])  # opposite effects have nothing in common


def test_what_explains_less_by_the_tie_is_neither_alike_nor_a_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    best = candidate(20.0)
    just, no = candidate(17.1), candidate(16.9)
    assert sorted_by(monkeypatch, best, {0.99: just, 0.98: no}) == ([just], [])
    assert sorted_by(monkeypatch, best, {0.3: just, 0.2: no}) == ([], [just])
    strong = candidate(100.0)  # the tie grows to 8, what explains about equally stays within 3
    tied, beyond, rival, none = (candidate(g) for g in (92.5, 91.5, 97.5, 96.5))
    found = sorted_by(monkeypatch, strong, {0.99: tied, 0.98: beyond, 0.3: rival, 0.2: none})
    assert found == ([tied], [rival])
    assert CLOSE == 3.0


def test_a_rival_explains_as_much_whether_or_not_choices_are_paid_for(monkeypatch: pytest.MonkeyPatch) -> None:
    best = candidate(20.0, raw=25.0)
    many = candidate(19.0, raw=21.9)
    assert sorted_by(monkeypatch, best, {0.3: many}) == ([], [])
    few = candidate(19.0, raw=22.1)
    assert sorted_by(monkeypatch, best, {0.3: few}) == ([], [few])


def test_shares_go_by_likelihood_and_are_never_sharper_than_a_tie_is_wide() -> None:
    assert weights_of([candidate(10.0), candidate(9.0)]) == pytest.approx([1 / (1 + np.exp(-1)), 1 / (1 + np.exp(1))])
    strong = weights_of([candidate(300.0), candidate(292.0)])  # 8 % of 300 over the 3 that are close: units of 8
    assert strong[0] / strong[1] == pytest.approx(np.e)


def test_chance_is_the_share_of_replicates_as_strong_counting_the_campaign_itself() -> None:
    seen = screened([1.0, 2.0, 3.0, 4.0] * 10, [0.0] * 30 + [6.0] * 10)
    assert seen.p_adjusted(3.0) == pytest.approx(21 / 41)
    assert seen.p_adjusted(0.5) == 1.0
    assert seen.p_library(5.0) == pytest.approx(11 / 41)
    assert np.isnan(screened([], []).p_adjusted())


def test_far_beyond_the_replicates_chance_falls_as_a_gumbel_tail_of_their_mean_and_spread() -> None:
    chance = np.random.default_rng(0).gumbel(3.0, 0.4, size=50)
    few = [float(v) for v in chance]
    scale = np.std(few) * np.sqrt(6) / np.pi
    mode = np.mean(few) - np.euler_gamma * scale
    assert screened(few, []).p_adjusted(8.0) == pytest.approx(-np.expm1(-np.exp(-(8.0 - mode) / scale)), rel=1e-9)
    assert screened(few, []).p_adjusted() == screened(few, []).p_adjusted(5.0)  # of the strongest contrast
    assert screened([2.0] * 50, []).p_adjusted(50.0) == 1e-12
    assert screened(few, []).p_adjusted(max(few) + 0.01) <= 1 / 51


def test_replicates_end_once_ten_are_as_strong_or_the_campaign_is_ten_deviations_beyond() -> None:
    ramp = np.linspace(1.0, 3.0, FEWEST)
    assert decided(ramp, float(ramp[-10]))
    assert not decided(ramp, float(ramp[-9]))
    beyond = float(ramp.mean() + 10 * ramp.std())
    assert decided(ramp, beyond + 0.01)
    assert not decided(ramp, beyond - 0.01)
    assert not decided(ramp[:-1], 1.0)  # never on fewer


def test_the_strongest_of_a_replicate_is_taken_over_all_contrasts_and_over_the_mechanisms() -> None:
    strengths = np.array([[1.0, 5.0, 2.0], [4.0, 3.0, 0.0]])
    assert strongest(strengths, np.array([True, False, True])).tolist() == [[5.0, 2.0], [4.0, 4.0]]
    assert strongest(strengths, np.zeros(3, bool)).tolist() == [[5.0, -np.inf], [4.0, -np.inf]]


def test_a_chi_squared_value_beyond_the_numbers_is_a_deviate_by_its_root() -> None:
    found = deviate(np.array([4000.0, 4000.0, -1.0, 0.0]), np.array([1, 5, 1, 4]))
    assert found[0] == pytest.approx(np.sqrt(4000.0))
    assert found[1] == pytest.approx(np.sqrt(4000.0) - 0.5 * 2.0)
    assert found[2:].tolist() == [0.0, 0.0]


def layered(*names: str) -> Any:
    """Layers of one cause each, on a model that is the tuple of what acts in it."""
    causes = tuple((candidate(10.0, name=name),) for name in names)
    left: Any = SimpleNamespace(p=np.array([0.001]))
    return Named(tuple(names), left, causes)  # type: ignore[arg-type]


def picked_again(monkeypatch: pytest.MonkeyPatch, *found: str | None) -> tuple[Named, list[tuple[str, ...]]]:
    """Suction, run-in and humidity picked again, where beside the others ``found`` is best or, None, nothing likely;
    and the models beside which they were weighed, the formulas of whose causes are open."""
    beside: list[tuple[str, ...]] = []

    def opened(model: Any) -> tuple[str, ...]:
        beside.append(model)
        return beside[-1]

    def weighed(before: Any, barred: Any) -> list[CauseCandidate]:
        name = found[len(beside) - 1]
        return [candidate(4.0, raw=12.0) if name is None else candidate(12.0, name=name)]

    monkeypatch.setattr(naming, "refitted", lambda model, acting: tuple(a.mechanism.name for a in acting))
    monkeypatch.setattr(naming, "allowed_wrong_form", opened)
    monkeypatch.setattr(naming, "start_effects", lambda model: SimpleNamespace(model=model))
    monkeypatch.setattr(naming, "weigh", weighed)
    monkeypatch.setattr(naming, "sort_rivals", lambda model, best, ranked: ((best,), ()))
    monkeypatch.setattr(naming, "_on_top_of", lambda model, each: each)
    seen = screened([], [k / 50 for k in range(200)])
    return naming._picked_again(layered("suction", "run_in", "humidity"), (), seen, 0.01), beside


def test_each_cause_but_the_last_is_picked_again_beside_all_others(monkeypatch: pytest.MonkeyPatch) -> None:
    found, beside = picked_again(monkeypatch, "tilt", "temperature")
    assert [[c.acting.name for c in alike] for alike in found.causes] == [["tilt"], ["temperature"], ["humidity"]]
    assert beside == [("run_in", "humidity"), ("tilt", "humidity")]


def test_a_cause_in_whose_place_nothing_is_likely_beside_others_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    found, beside = picked_again(monkeypatch, None, "temperature")
    assert [[c.acting.name for c in alike] for alike in found.causes] == [["temperature"], ["humidity"]]
    assert beside == [("run_in", "humidity"), ("humidity",)]


@pytest.mark.parametrize(("by_an_open_form", "earned"), [(15.0, 15.0), (7.0, 10.0)])
def test_a_cause_earns_beside_the_open_forms_of_the_others_what_its_formula_does_or_one_that_is_off(
    monkeypatch: pytest.MonkeyPatch, by_an_open_form: float, earned: float
) -> None:
    opened: list[tuple[int, int]] = []

    def refitted(model: Any, acting: list[Acting]) -> Any:
        return SimpleNamespace(score=10.0 * len(acting) - 20.0, acting=tuple(acting), values=[np.ones(1)] * len(acting))

    def allowed(model: Any, known: int = 0) -> Any:
        opened.append((len(model.acting), known))
        return model if known == 0 else SimpleNamespace(**{**vars(model), "score": by_an_open_form - 10.0})

    monkeypatch.setattr(naming, "refitted", refitted)
    monkeypatch.setattr(naming, "allowed_wrong_form", allowed)
    suction, humidity = Acting(MECHANISMS["suction"]), Acting(MECHANISMS["humidity"])
    model: Any = SimpleNamespace(acting=(suction, humidity))
    assert naming.beside_others(model, suction).raw == earned
    assert opened == [(1, 0), (2, 1)]  # the others, then the cause itself beside them


def test_of_several_causes_the_newest_is_left_out_where_its_own_column_is_still_wrong(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    start: Any = SimpleNamespace(model=SimpleNamespace(setup=None))
    one, two = layered("suction"), layered("suction", "run_in")
    offered: list[set[str]] = []

    def grown(layers: Any, *_: Any) -> Any:
        offered.append(set(layers.wrong_in_form))
        return {0: one, 1: None if layers.wrong_in_form else two}[len(layers.causes)]

    left: Any = SimpleNamespace(p=np.array([0.001]))
    monkeypatch.setattr(naming, "weigh", lambda *_: [])
    monkeypatch.setattr(naming, "allowed_wrong_form", lambda model: model)
    monkeypatch.setattr(naming, "start_effects", lambda model: SimpleNamespace(model=model))
    monkeypatch.setattr(naming, "_grown", grown)
    monkeypatch.setattr(naming, "_misfit_in_own_column", lambda cause, *_: cause.acting.name == "run_in")
    monkeypatch.setattr(naming, "_picked_again", lambda layers, *_: layers)
    monkeypatch.setattr(naming, "_standing", lambda layers, *_: layers)
    found = naming.name_causes(start, left, (), lambda model: 0.01, lambda model: left)
    assert [[c.acting.name for c in alike] for alike in found.causes] == [["suction"]]
    assert offered == [set(), set(), {"run_in"}]
    assert found.wrong_in_form == ("run_in",)


def named_at(
    monkeypatch: pytest.MonkeyPatch, beside_one: float, picked: str = "suction"
) -> tuple[list[str], list[Any]]:
    """The causes that are named where each layer leaves a misfit of 0.005 until there are three, and the models that
    were screened. The level is 0.001 without causes and ``beside_one`` with some; ``picked`` is what is picked again in
    place of suction."""
    start: Any = SimpleNamespace(model=SimpleNamespace(setup=None))
    names, screened_models = ("suction", "run_in", "humidity"), []

    def left_by(model: Any) -> Any:
        screened_models.append(model)
        return SimpleNamespace(p=np.array([0.005 if len(model) < 3 else 0.5]))

    def picked_again(found: Named, *_: Any) -> Named:
        return found if picked == "suction" else layered(picked, *[a.name for a in found.acting[1:]])

    monkeypatch.setattr(naming, "weigh", lambda *_: [])
    monkeypatch.setattr(naming, "allowed_wrong_form", lambda model: model)
    monkeypatch.setattr(naming, "start_effects", lambda model: SimpleNamespace(model=model))
    monkeypatch.setattr(naming, "_grown", lambda found, *_: layered(*names[: len(found.causes) + 1]))
    monkeypatch.setattr(naming, "_misfit_in_own_column", lambda *_: False)
    monkeypatch.setattr(naming, "_picked_again", picked_again)
    monkeypatch.setattr(naming, "_standing", lambda found, *_: found)
    first: Any = SimpleNamespace(p=np.array([0.0005]))
    level_of: Any = lambda model: 0.001 if model is start.model else beside_one  # noqa: E731
    found = naming.name_causes(start, first, (), level_of, left_by)
    return [a.name for a in found.acting], screened_models


def test_a_further_cause_is_looked_for_at_the_level_beside_those_that_are_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert named_at(monkeypatch, 0.001)[0] == ["suction"]
    assert named_at(monkeypatch, 0.01)[0] == ["suction", "run_in", "humidity"]


def test_what_is_left_is_screened_again_only_where_other_causes_were_picked(monkeypatch: pytest.MonkeyPatch) -> None:
    every = [("suction",), ("suction", "run_in"), ("suction", "run_in", "humidity")]
    assert named_at(monkeypatch, 0.01)[1] == every
    assert named_at(monkeypatch, 0.01, "tilt")[1] == [*every, ("tilt", "run_in", "humidity")]


def screen_of(contrasts: list[Any], strength: list[float], p: list[float]) -> Screen:
    """A screen of these contrasts without replicates; sizes are a tenth of the strengths."""
    size, none = np.array(strength) / 10, np.zeros(0)
    each = tuple(np.zeros(1) for _ in contrasts)
    return Screen(tuple(contrasts), np.array(strength), size, each, none, none, np.array(p))


def chosen_of(monkeypatch: pytest.MonkeyPatch, best: CauseCandidate | None, strength: float | None) -> str:
    """Which layer is added where a mechanism and a free course of a column, of this strength, are beyond chance."""
    contrast: Any = SimpleNamespace(columns=np.ones((4, 2)))
    other = None if strength is None else screen_of([contrast], [strength], [0.001])
    monkeypatch.setattr(naming, "best_beyond_chance", lambda *_: best)
    monkeypatch.setattr(naming, "strongest_beside_mechanisms", lambda *_: other)
    monkeypatch.setattr(naming, "sort_rivals", lambda model, best, ranked: ((best,), ()))
    monkeypatch.setattr(naming, "_on_top_of", lambda model, found: found)
    monkeypatch.setattr(naming, "with_free_columns", lambda *_: None)
    monkeypatch.setattr(naming, "fit", lambda *_, **__: None)
    setup: Any = SimpleNamespace(observations=SimpleNamespace(flat="F"))
    model: Any = SimpleNamespace(setup=setup, acting=())
    seen: Any = None
    grown = naming._grown(Named(model, seen), model, [], 0.01)
    if grown is None:
        return "neither"
    assert len(grown.causes) + len(grown.remainders) == 1
    return "mechanism" if grown.causes else "column"


def test_a_free_course_of_a_column_goes_first_only_where_it_explains_more_by_what_counts_as_equal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A course of strength z explains z^2 / 2, here 12.5; what lies within 3 of it explains about equally."""
    assert CLOSE == 3.0
    assert chosen_of(monkeypatch, candidate(9.6), 5.0) == "mechanism"
    assert chosen_of(monkeypatch, candidate(9.4), 5.0) == "column"
    assert chosen_of(monkeypatch, candidate(0.1), None) == "mechanism"
    assert chosen_of(monkeypatch, None, 5.0) == "column"
    assert chosen_of(monkeypatch, None, None) == "neither"


def contrast_of(kind: str, taken_up: bool = False) -> Any:
    return SimpleNamespace(kind=kind, is_taken_up=lambda flat: taken_up and flat == "F")


def test_what_is_left_beside_mechanisms_is_the_strongest_contrast_beyond_chance_that_no_law_takes_up() -> None:
    bend = contrast_of("bend", taken_up=True)
    contrasts = (contrast_of("column"), contrast_of("mechanism"), bend, contrast_of("column"))
    seen = screen_of([*contrasts], [3.0, 6.0, 5.0, 4.0], [0.004, 0.001, 0.002, 0.003])
    found = naming.strongest_beside_mechanisms(seen, 0.01, "F")
    assert found is not None
    assert found.contrasts == (contrasts[3],)
    assert (*found.strength, *found.p, *found.size) == (4.0, 0.003, 0.4)
    other = naming.strongest_beside_mechanisms(seen, 0.01, "B")
    assert other is not None
    assert other.contrasts[0] is contrasts[2]
    assert naming.strongest_beside_mechanisms(seen, 0.003, "F") is None  # at the level itself: within chance


def test_what_explains_as_much_only_before_choices_are_paid_for_is_no_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    best = candidate(100.0, raw=100.0)
    many, few = candidate(96.5, raw=99.5), candidate(97.5, raw=99.5)
    assert sorted_by(monkeypatch, best, {0.3: many, 0.2: few}) == ([], [few])


FEW = (60, 25)  # simulated campaigns that stand for chance


def steps(s: Setup) -> np.ndarray:
    """Sixteen percent up for twelve tests, as much down for the next twelve, and so on: no mechanism does it, and drift
    does not either."""
    there = np.sin(2 * np.pi * s.observations.conditions.run_order / 24) > 0
    return np.where(there, 0.16, -0.16)[:, None] * np.ones(2)


def half_and_half(s: Setup) -> np.ndarray:
    """A little of the temperature and a little tilt of the specimens: either alone leaves no misfit beyond chance."""
    return acting("temperature", 0.0245)(s) + acting("tilt", 0.0117)(s)


def suction_that_varies(s: Setup) -> np.ndarray:
    """Suction whose effect is an eighth smaller or larger from one pattern to the next than its law says."""
    whole, sample = acting("suction", 25e3)(s), s.observations.conditions.sample
    for name, share in (("A", -0.12), ("B", 0.12), ("C", -0.12)):
        whole[sample == name] *= 1 + share
    return whole


@pytest.mark.slow
def test_what_chance_would_give_a_mechanism_is_no_cause_however_certain_the_misfit() -> None:
    found = examine(made(steps, seed=0), replicates=FEW)
    assert found.verdict.verdict == "unknown"
    assert found.screened.p_adjusted() < 0.01
    assert found.named is not None
    assert found.named.causes == ()


@pytest.mark.slow
def test_a_mechanism_whose_own_column_is_still_wrong_is_left_out_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(naming, "_misfit_in_own_column", lambda cause, *_: cause.name == "humidity")
    verdict = examine(made(acting("humidity", 0.03), seed=0), replicates=FEW).verdict
    assert "humidity" not in [cause.mechanism for cause in verdict.causes]
    assert "Tried and left out: humidity." in worded(verdict).text


@pytest.mark.parametrize("label", ["B2 of B behaves as F", "A1 of A swapped with B3 of B"])
@pytest.mark.parametrize("whole", [True, False])
def test_a_specimen_of_a_wrong_label_lies_apart_and_one_that_only_follows_the_load_otherwise_has_none(
    label: str, whole: bool
) -> None:
    """Half of them change by all that the label says, half by twice what it says beside a factor on each specimen."""
    wrong = Acting(MECHANISMS["mislabelled_specimen"], label)

    def change(s: Setup) -> FloatArray:
        changed = effect_of(s, LAW, wrong, np.ones(1))
        for k in np.unique(s.specimen[changed[:, 0] != 0.0]) if not whole else ():
            changed[s.specimen == k] = 2.0 * (changed[s.specimen == k] - changed[s.specimen == k].mean(axis=0))
        return changed

    start = baseline(made(change, seed=0, repeat_sd=(0.04, 0.03)))
    assert naming._specimens_lie_apart(start, judged(start, refitted(start, (wrong,)), 0.0)) == whole


def test_every_cause_that_is_likely_has_to_be_possible(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that is far behind the best: where that is not possible, it would be the first."""
    start = start_effects(baseline(made(acting("suction", 8e3), seed=0)))
    asked: list[str] = []

    def none_possible(start: Any, c: CauseCandidate) -> bool:
        asked.append(c.name)
        return False

    gains = {c.name: c.gain for c in weigh(start)}
    assert any(LIKELY < gain < 0.5 * max(gains.values()) - 3.0 for gain in gains.values())
    monkeypatch.setattr(naming, "_is_possible", none_possible)
    left = weigh(start)
    assert {name for name, gain in gains.items() if gain > LIKELY} <= set(asked)
    assert all(c.gain <= LIKELY for c in left)


@cache
def of_two_halves() -> Diagnosis:
    """The diagnosis of a campaign in which two mechanisms act by halves."""
    return examine(made(half_and_half, seed=2), replicates=FEW)


@pytest.mark.slow
def test_of_the_mechanisms_weighed_only_one_beyond_chance_can_be_the_cause() -> None:
    """A swap among hundreds is stronger than chance makes any; pressure has no choices to pay for, but is within it."""
    found = of_two_halves()
    assert found.named is not None
    candidate, chance = found.named.weighed[0], replace(found.screened, chance_library=np.linspace(2.0, 3.5, 100))
    pressure, swap = replace(candidate, gain=5.3, raw=5.3), replace(candidate, gain=5.2, raw=10.9)
    assert best_beyond_chance([pressure, swap], chance, 0.01) is swap
    assert best_beyond_chance([pressure], chance, 0.01) is None


@pytest.mark.slow
def test_mechanisms_that_the_design_tells_apart_are_rivals_not_equivalent() -> None:
    """Two laws of different shape explain the campaign about equally well: the verdict stays open between them."""
    verdict = of_two_halves().verdict
    assert verdict.verdict == "undetermined"
    assert {c.mechanism for c in verdict.causes} == {"temperature", "tilt"}
    assert not verdict.equivalent


@pytest.mark.slow
def test_a_law_that_is_an_eighth_off_from_sample_to_sample_needs_no_second_cause() -> None:
    found = examine(made(suction_that_varies, seed=0, repeat_sd=(0.07, 0.05)), replicates=FEW)
    assert found.verdict.verdict == "named"
    assert found.named is not None
    assert len(found.named.causes) == 1
    assert "suction" in {c.name for c in found.named.causes[0]}


def test_a_further_parameter_has_to_earn_one_unit_of_log_likelihood() -> None:
    """Akaike 1974: what a parameter without any meaning earns on average is one unit."""
    start = baseline(made(lambda s: np.zeros((s.observations.n, 2)), seed=0))
    names = ("run_in", "edge_adhesion", "suction", "humidity")
    weighed = {c.name: c for c in weigh(start_effects(start)) if c.name in names}
    paid = {name: c.fit.score - start.score - c.raw for name, c in weighed.items()}
    further = {name: len(c.acting.mechanism.parameters) - 1 for name, c in weighed.items()}
    assert max(further.values()) >= 1
    assert min(further.values()) == 0
    assert paid == pytest.approx({name: float(k) for name, k in further.items()}, abs=1e-9)
