"""Days, drift of the series and drift of specimens are found as what they are, with their sizes, and are no cause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pandas as pd
import pytest
from blind.bench import Bench, Design
from blind.direct import ingested
from blind.tribometer import hide
from support import first_quick

from tribo.diagnostics import diagnosis, inference
from tribo.diagnostics.diagnosis import Diagnosis, examine
from tribo.diagnostics.fit import precision_of
from tribo.diagnostics.model import FIXED
from tribo.diagnostics.observations import observe, place_in_series, session_of, walks
from tribo.diagnostics.scatter import prior_sd
from tribo.wording.verdict_sentences import worded

SIZE = 0.06  # of ln T, root mean square
Course = Callable[[Bench, np.random.Generator], np.ndarray]


def of_one_size(change: np.ndarray) -> np.ndarray:
    centred = change - change.mean()
    return SIZE * centred / np.sqrt(np.mean(centred**2))


def days(b: Bench, rng: np.random.Generator) -> np.ndarray:
    day = b.tests["started_at"].str[:10].factorize()[0]
    return of_one_size(rng.normal(size=day.max() + 1)[day])


def drift(b: Bench, rng: np.random.Generator) -> np.ndarray:
    return of_one_size(np.cumsum(rng.standard_t(4, size=len(b.tests))))


def specimen_drift(b: Bench, rng: np.random.Generator, in_common: float = 0.0) -> np.ndarray:
    rates = {name: in_common + rng.normal() for name in sorted(set(b.tests["specimen"]))}
    run = b.tests["specimen_run"] - b.tests.groupby("specimen")["specimen_run"].transform("mean")
    return of_one_size(run.to_numpy() * b.tests["specimen"].map(rates).to_numpy())


def specimen_steps(b: Bench, rng: np.random.Generator) -> np.ndarray:
    specimen, run = b.tests["specimen"], b.tests["specimen_run"]
    steps = {name: rng.choice([-1.0, 1.0]) for name in sorted(set(specimen))}
    late = run > run.groupby(specimen).transform("median")
    change = (late * specimen.map(steps)).to_numpy()
    return of_one_size(change - pd.Series(change).groupby(specimen.to_numpy()).transform("mean").to_numpy())


specimen_drift_in_common = partial(specimen_drift, in_common=0.8)
WHOLE, SMALL = Design(repeats=2), Design(samples=("F", "B"), repeats=3)


@cache
def diagnosed(
    seed: int, course: Course | None, effects: tuple[tuple[str, float], ...] = (), small: bool = False
) -> Diagnosis:
    b = hide(seed, list(effects), SMALL if small else WHOLE)
    if course is not None:
        b.scale(np.exp(course(b, np.random.default_rng([seed, 31]))))
    return examine(ingested(b, seed), replicates=(40, 20) if small else (60, 40))


KINDS: dict[str, Course] = {"days": days, "drift": drift, "specimen_drift": specimen_drift}


SEEDS = (1, 3, 4)


CASES = [(1, "days", True), (1, "drift", False), (1, "specimen_drift", True)]
CASES += [(seed, name, False) for seed in SEEDS for name in KINDS if (seed, name) != (1, "drift")]


@pytest.mark.parametrize(("seed", "name", "small"), first_quick(CASES, len(KINDS)))
def test_what_moves_is_told_with_its_size_and_is_no_cause(seed: int, name: str, small: bool) -> None:
    v = diagnosed(seed, KINDS[name], small=small).verdict
    assert v.verdict == "no_misfit"
    assert not v.causes
    (layer,) = [layer for layer in v.layers if layer.kind == "nuisance"]
    assert layer.name == name
    assert layer.effect_percent == pytest.approx(100 * SIZE, rel=0.25)


def test_effects_that_are_drawn_have_the_mean_and_the_scatter_of_the_fit_where_their_sizes_are_known() -> None:
    fitted = diagnosed(1, days, small=True).baseline
    s = fitted.setup
    sd = prior_sd(s, fitted.noise.sizes)
    known = replace(fitted, setup=replace(s, unit=sd, group=np.full(s.n_effects, FIXED)), precision=sd**-2)
    drawn = inference.drawn_effects(known, np.random.default_rng(4))
    share = inference.informed_share(fitted.noise)
    columns = known.columns
    precision = precision_of(known.factor, known.weight) * share
    weighted, prior = columns.weighted(precision), columns.prior(known.precision[None])
    exact = weighted.normal.with_prior(*columns.sides(prior)).inverse()
    right = weighted.with_residual(known.residual.T[None])
    mean = columns.vector(*exact.solution(*right))[0, columns.parameters :]
    spread = np.sqrt(columns.vector(*exact.variances)[0, columns.parameters :])
    off = (drawn.mean(axis=0) - mean) / spread * np.sqrt(len(drawn))
    assert np.abs(off).max() < 5.0
    np.testing.assert_allclose(drawn.std(axis=0) / spread, 1.0, atol=0.12)


def test_what_the_sizes_may_be_widens_the_interval_of_days(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted = diagnosed(1, days, small=True).baseline
    (told,) = inference.nuisance_layers(fitted, 0.01)
    monkeypatch.setattr(inference, "SIZE_PRIORS", [])  # no size is drawn: all stay those of the fit
    (alone,) = inference.nuisance_layers(fitted, 0.01)
    assert told.high - told.low > 1.05 * (alone.high - alone.low)


def test_what_the_rates_of_all_specimens_have_in_common_counts_as_their_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted = diagnosed(6, specimen_drift_in_common, small=True).baseline
    (told,) = inference.nuisance_layers(fitted, 0.01)
    monkeypatch.setattr(inference, "_drifting_in_common", lambda f: f)
    (alone,) = inference.nuisance_layers(fitted, 0.01)
    assert told.low < 100 * SIZE < told.high
    assert alone.effect_percent < told.effect_percent < 100 * SIZE


def test_the_interval_of_specimens_that_step_reaches_beyond_the_size_of_their_lines() -> None:
    (told,) = inference.nuisance_layers(diagnosed(7, specimen_steps, small=True).baseline, 0.01)
    assert told.name == "specimen_drift"
    assert told.effect_percent < told.high * 3**0.5 / 2 < 100 * SIZE < told.high


@pytest.mark.slow
def test_of_nine_sizes_six_at_least_lie_within_their_intervals() -> None:
    """Nine in ten should; docs/results/laboratories.md counts them."""
    layers = [layer for name in KINDS for seed in SEEDS
              for layer in diagnosed(seed, KINDS[name]).verdict.layers if layer.kind == "nuisance"]  # fmt: skip
    assert sum(layer.low <= 100 * SIZE <= layer.high for layer in layers) >= 6


def test_the_level_is_a_tenth_only_beside_certain_days_and_drift() -> None:
    assert diagnosed(1, drift, small=False).share_of_level == 0.1
    assert diagnosed(1, None, small=True).share_of_level == 1.0


def test_what_a_cause_explains_of_days_and_drift_makes_the_level_no_stricter_beside_it() -> None:
    d = diagnosed(1, None, (("run_in", 2.0),), small=True)
    assert diagnosis.is_certain_to_move(d.baseline)
    assert [c.mechanism for c in d.verdict.causes] == ["run_in"]
    assert d.share_of_level == 1.0


def test_days_beside_a_cause_keep_the_level_strict() -> None:
    d = diagnosed(1, days, (("run_in", 2.0),), small=True)
    assert [c.mechanism for c in d.verdict.causes] == ["run_in"]
    assert d.share_of_level == 0.1


def test_a_run_in_beside_another_cause_is_not_taken_for_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    both = (("covariate:operator", 3.0), ("run_in", 1.2))
    assert {c.mechanism for c in diagnosed(2, None, both, small=True).verdict.causes} == {name for name, _ in both}
    monkeypatch.setattr(diagnosis, "_a_cause_instead", lambda *_: False)
    as_drift = diagnosed.__wrapped__(2, None, both, small=True).verdict
    assert [c.mechanism for c in as_drift.causes] == ["covariate:operator"]


@pytest.mark.parametrize(("seed", "course"), first_quick([(11, specimen_drift), (12, drift), (13, specimen_steps)]))
def test_drift_beside_a_cause_is_no_run_in(seed: int, course: Course) -> None:
    v = diagnosed(seed, course, (("covariate:operator", 3.0),), small=True).verdict
    assert [c.mechanism for c in v.causes] == ["covariate:operator"]


def test_the_finding_tells_the_drift() -> None:
    assert "The series drifts by 6 % (root mean square; " in worded(diagnosed(1, drift, small=False).verdict).sentence


@pytest.mark.parametrize(("seed", "small"), first_quick([(1, True), *((seed, False) for seed in SEEDS)]))
def test_without_days_and_drift_none_are_told(seed: int, small: bool) -> None:
    assert not [x for x in diagnosed(seed, None, small=small).verdict.layers if x.kind == "nuisance"]


@pytest.mark.slow
def test_a_cause_beside_days_is_found_with_them() -> None:
    v = diagnosed(4, days, (("suction", 1.2),)).verdict
    assert {c.mechanism for c in v.causes} <= {"suction", "normal_load_error"}
    assert v.causes
    assert "days" in {layer.name for layer in v.layers if layer.kind == "nuisance"}


@pytest.mark.slow
def test_a_run_in_is_not_taken_for_drift() -> None:
    assert [c.mechanism for c in diagnosed(4, None, (("run_in", 1.5),)).verdict.causes] == ["run_in"]


def test_a_session_ends_where_no_pull_is_made_for_hours() -> None:
    c = observe(ingested(hide(1, [], Design(repeats=2)), 1)).conditions
    date = np.unique(c.columns["date"], return_inverse=True)[1]
    assert (session_of(c) == date).all()


def test_the_courses_of_a_walk_add_up_to_one() -> None:
    c = observe(ingested(hide(1, [], Design(repeats=2)), 1)).conditions
    variance = sum(sd**2 * course**2 for course, sd in walks(c))
    assert np.mean(variance) == pytest.approx(1.0, rel=1e-2)
    assert variance[np.argmin(place_in_series(c))] > np.median(variance)
