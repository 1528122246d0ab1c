"""The diagnosis of a campaign: whether the model fails beyond chance, and which mechanism explains it.

A :class:`Diagnosis` holds the verdict with everything that it rests on, for figures and tables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnostics.candidates import (
    LIKELY,
    NO_CHANGE,
    Named,
    best_beyond_chance,
    name_causes,
    weigh,
    weights_of,
    with_errors_of_patterns_anew,
)
from tribo.diagnostics.conclusion import conclude, exclusions, never_weighed
from tribo.diagnostics.contrasts import Progress, Screen, all_contrasts, allowed_wrong_form, screen, screen_left
from tribo.diagnostics.direct_evidence import Evidence, certain_evidence, direct_evidence
from tribo.diagnostics.effect_sizes import percent
from tribo.diagnostics.fit import ModelFit, fit, residual_on_flat
from tribo.diagnostics.model import SPECIMEN_DRIFT, Setup, effect_of, setup
from tribo.diagnostics.observations import enough, observe, session_of
from tribo.diagnostics.predictor import Predictor, tabled_predictor
from tribo.diagnostics.scatter import held_still
from tribo.diagnostics.score_statistics import StartEffects, start_effects
from tribo.diagnostics.verdict import Excluded, Verdict
from tribo.display import displayed
from tribo.records import REGIMES, FloatArray, Ingested

if TYPE_CHECKING:
    import pandas as pd

    from tribo.lawsearch.search import Discovery

Screened = tuple[StartEffects, Screen, list[Excluded]]
REPLICATES = 120
REPLICATES_LEFT = 60


@displayed()
@dataclass(frozen=True)
class DiagnosisWithoutModel:
    """A verdict without the spring-block model: what friction varies with beside the law of each sample."""

    verdict: Verdict


@displayed(lambda d: d.verdict.verdict)
@dataclass(frozen=True)
class Diagnosis:
    """A verdict with what it rests on, for figures and tables.

    Where the extended model was run in the simulator itself, ``simulated_log_force`` (n, 2) is ln T of every test by it
    and ``extended_runs`` has one row a pair of runs. ``laws`` is the search for the laws of what the causes leave,
    where something was left. ``share_of_level`` is that of the level of a misfit at which the verdict was made: less
    than one where days and drift are certain beside the causes.
    """

    verdict: Verdict
    baseline: ModelFit
    screened: Screen
    named: Named | None
    simulated_log_force: FloatArray | None = None
    extended_runs: pd.DataFrame | None = None
    laws: Discovery | None = None
    share_of_level: float = 1.0

    def without_columns(self) -> Diagnosis:
        """The same without the columns of the contrasts, which nothing needs once the verdict stands."""
        named = self.named and replace(self.named, left=self.named.left.without_columns())
        return replace(self, screened=self.screened.without_columns(), named=named)


def examine(
    ingested: Ingested,
    *,
    seed: int = 0,
    level: float = 0.01,
    predictor: Predictor | None = None,
    progress: Progress | None = None,
    replicates: tuple[int, int] = (REPLICATES, REPLICATES_LEFT),
) -> Diagnosis:
    """Find out whether the calibrated model fails on a campaign beyond chance, and which mechanism explains it.

    Laws of what no mechanism explains are searched afterwards (:mod:`tribo.lawsearch`).

    Parameters
    ----------
    ingested : Ingested
        A campaign with its exports read.
    seed : int
        Of the simulated campaigns that stand for chance.
    level : float
        Chance of seeing a misfit where nothing is hidden.
    predictor : Predictor, optional
        Shares of the flat law per sample; those tabulated from simulations by default.
    progress : callable, optional
        Called with a stage, the steps done and the steps there are.
    replicates : (int, int)
        Simulated campaigns at most: for the baseline, and for what a cause leaves.

    Returns
    -------
    Diagnosis
        The verdict with the fitted models and screens that it rests on.

    Raises
    ------
    FitError
        Fewer than twelve usable tests.
    """
    rng = np.random.default_rng(seed)
    observations = enough(observe(ingested))
    s = setup(observations, predictor or tabled_predictor(observations.patterns))
    evidence = direct_evidence(observations)
    exam = _Examination(evidence, level, replicates, rng, progress)
    effects, screened, barred = exam.screened(s)
    moving = is_certain_to_move(effects.model)
    strongest = screened.contrasts[int(np.argmax(screened.strength))].column
    exam = replace(exam, strict=moving and strongest != "time of day")  # what comes back every day is no drift
    if screened.p.min() >= exam.level_beside(effects.model) and not moving:
        screened = with_errors_of_patterns_anew(screened, effects, never_weighed(barred))
    first = effects, screened, barred
    (effects, screened, barred), named = exam.instead_of_drift(s, first, exam.named(*first))
    share = exam.share_beside(effects.model if named is None else named.model)
    levels = share * level, level
    verdict = conclude(effects, screened, certain_evidence(evidence), barred, named, levels, rng)
    return Diagnosis(verdict, effects.model, screened, named, share_of_level=share)


@dataclass(frozen=True)
class _Examination:
    """How a campaign is examined: with the ``evidence`` of its traces, at which ``level`` of a misfit, and against how
    many simulated campaigns. ``strict`` is whether a misfit has to be rarer beside certain days and drift."""

    evidence: Mapping[str, Evidence]
    level: float
    replicates: tuple[int, int]
    rng: np.random.Generator
    progress: Progress | None
    strict: bool = False

    def screened(self, s: Setup, start: ModelFit | None = None) -> Screened:
        """Every contrast of a campaign, and the mechanisms that are not weighed."""
        effects = start_effects(fit(s, start.acting if start else (), start=start))
        contrasts = all_contrasts(s, effects.model.law, effects.acting, effects.courses)
        found = screen(effects.model, contrasts, replicates=self.replicates[0], rng=self.rng, progress=self.progress)
        return effects, found, exclusions(s.observations.conditions, self.evidence, effects.absorbed)

    def share_beside(self, model: ModelFit) -> float:
        """Of the level of a misfit; causes may explain what looked like days and drift without them."""
        return BESIDE_DRIFT if self.strict and (not model.acting or is_certain_to_move(model)) else 1.0

    def level_beside(self, model: ModelFit) -> float:
        """That of a misfit beside the causes of a model."""
        return self.share_beside(model) * self.level

    def named(self, effects: StartEffects, screened: Screen, barred: Sequence[Excluded]) -> Named | None:
        """The causes of what is beyond chance; None where nothing is."""
        never = never_weighed(barred)

        def screen_of(model: ModelFit) -> Screen:
            left = screen_left(model, replicates=self.replicates[1], rng=self.rng, progress=self.progress)
            if left.p.min() < self.level_beside(model) or is_certain_to_move(model):
                return left
            return with_errors_of_patterns_anew(left, start_effects(allowed_wrong_form(model)), never)

        if screened.p.min() >= self.level_beside(effects.model):
            return None
        return name_causes(effects, screened, never, self.level_beside, screen_of)

    def instead_of_drift(self, s: Setup, first: Screened, named: Named | None) -> tuple[Screened, Named | None]:
        """The same, or the causes that are named without days and drift where one more of them explains what these
        would explain, and better."""
        fitted, left = (first[0].model, first[1]) if named is None else (named.model, named.left)
        level = self.level_beside(fitted)
        if left.p.min() < level or (named is not None and (named.remainders or not is_certain_to_move(fitted))):
            return first, named
        still, offset = held_still(s, s.group >= SPECIMEN_DRIFT)
        beside = self.screened(still, fitted)
        if beside[1].p.min() >= level or not _a_cause_instead(fitted, beside, offset, level):
            return first, named
        without = beside if named is None else self.screened(still)
        again = self.named(*without)
        if again is None or (named is not None and len(again.causes) <= len(named.causes)):
            return first, named
        return without, again


def is_certain_to_move(f: ModelFit) -> bool:
    """Whether days and drift are certain beside the causes of a model."""
    still, offset = held_still(f.setup, f.setup.group >= SPECIMEN_DRIFT)
    return f.score - (fit(still, f.acting, start=f).score + offset) > LIKELY


# Share of the level of a misfit that remains where days and drift are certain: their shapes are those of the model in
# part only, and what they leave looks like a cause.
BESIDE_DRIFT = 0.1


def _a_cause_instead(moving: ModelFit, still: Screened, offset: float, level: float) -> bool:
    """Whether one more mechanism, without any days and drift, explains what these would explain, and better, and leaves
    nothing to them. What is the same within every session cannot be told from days.

    ``offset`` raises the score of the fits without days and drift.
    """
    effects, screened, barred = still
    best = best_beyond_chance(weigh(effects, never_weighed(barred)), screened, level)
    if best is None:
        return False
    by_drift = moving.score - (effects.model.score + offset)
    if best.gain - by_drift <= min(-math.log(level), max(by_drift, 0.0)):
        return False
    session = session_of(moving.setup.observations.conditions)
    change = effect_of(best.fit.setup, best.fit.law, best.acting, best.values)
    if session.max() > 0 and all(np.ptp(change[session == k], axis=0).max() < NO_CHANGE for k in np.unique(session)):
        return False
    return fit(moving.setup, best.fit.acting, start=moving).score <= best.fit.score + offset + LIKELY


def residual_table(d: Diagnosis) -> pd.DataFrame:
    """One row a test and regime: the measurement, the models, and their differences.

    Columns: test_id, sample, specimen, regime, normal_load_N, run_order, specimen_run, temperature_C,
    humidity_pct, speed_m_s, hold_s, measured_N, baseline_N, calibrated_N, extended_N, residual_percent,
    residual_calibrated_percent and residual_extended_percent: 100 (measured / modelled - 1). The baseline is fitted to
    all samples, calibrated_N is the model calibrated on the flat sample alone. Without a named mechanism the extended
    columns repeat the baseline. Where the extended model was run in the simulator itself, simulated_N is what it says.
    """
    import pandas as pd

    o = d.baseline.setup.observations
    c = o.conditions
    extended = d.named.model if d.named is not None and d.named.causes else d.baseline
    on_flat = residual_on_flat(d.baseline)
    parts = []
    for k, regime in enumerate(REGIMES):
        measured, before, after = o.log_force[:, k], d.baseline.predicted[:, k], extended.predicted[:, k]
        of_runs = d.simulated_log_force
        simulated = {} if of_runs is None else {"simulated_N": np.exp(of_runs[:, k])}
        parts.append(
            pd.DataFrame(
                {
                    "test_id": o.test_ids, "sample": c.sample, "specimen": c.specimen, "regime": regime,
                    "normal_load_N": c.normal_load_N, "run_order": c.run_order, "specimen_run": c.specimen_run,
                    "temperature_C": c.recorded("temperature_C"), "humidity_pct": c.recorded("humidity_pct"),
                    "speed_m_s": c.recorded("speed_m_s"), "hold_s": c.recorded("hold_s"),
                    "measured_N": np.exp(measured), "baseline_N": np.exp(before),
                    "calibrated_N": np.exp(measured - on_flat[:, k]), "extended_N": np.exp(after),
                    "residual_percent": percent(measured - before),
                    "residual_calibrated_percent": percent(on_flat[:, k]),
                    "residual_extended_percent": percent(measured - after),
                }
                | simulated
            )
        )  # fmt: skip
    return pd.concat(parts, ignore_index=True)


def misfit_map(d: Diagnosis) -> pd.DataFrame:
    """Sample by load by regime: mean residual in percent, its standard error and the number of tests."""
    import pandas as pd

    rows = residual_table(d)
    rows["load"] = rows["normal_load_N"].round(5)
    groups = rows.groupby(["regime", "sample", "load"])
    cells = [
        {
            "regime": regime, "sample": sample, "normal_load_N": load, "n_tests": len(cell),
            "residual_percent": cell["residual_percent"].mean(),
            "residual_u_percent": cell["residual_percent"].std(ddof=1) / np.sqrt(len(cell)),
            "residual_extended_percent": cell["residual_extended_percent"].mean(),
        }
        for (regime, sample, load), cell in groups
    ]  # fmt: skip
    return pd.DataFrame(cells)


def contrast_table(d: Diagnosis) -> pd.DataFrame:
    """Every contrast at the baseline: its strength in standard deviations, adjusted p and peak-to-peak size."""
    import pandas as pd

    s = d.screened
    rows = [
        {
            "kind": c.kind, "observable": c.observable, "covariate": c.title, "sample": c.sample,
            "choice": c.acting.choice if c.acting else "", "strength": strength,
            "p_adjusted": s.p_adjusted(float(strength)), "peak_to_peak_percent": float(percent(min(size, 5.0))),
        }
        for c, strength, size in zip(s.contrasts, s.strength, s.size, strict=True)
    ]  # fmt: skip
    return pd.DataFrame(rows).sort_values("strength", ascending=False, ignore_index=True)


def weighing_table(d: Diagnosis) -> pd.DataFrame:
    """Every mechanism that was weighed for the first cause: log likelihood gained, share, amplitude."""
    import pandas as pd

    if d.named is None or not d.named.weighed:
        return pd.DataFrame(columns=["mechanism", "choice", "gain", "weight", "parameter", "value", "unit"])
    weighed = d.named.weighed
    rows = [
        {
            "mechanism": c.name, "choice": c.acting.choice, "gain": c.gain, "weight": weight,
            "parameter": c.acting.mechanism.amplitude.name, "value": float(c.values[0]),
            "unit": c.acting.mechanism.amplitude.unit,
        }
        for c, weight in zip(weighed, weights_of(weighed), strict=True)
    ]  # fmt: skip
    return pd.DataFrame(rows)
