"""The diagnosis of a campaign: whether the model fails beyond chance, and which mechanism explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tribo.diagnose.diagnosis_record import Diagnosis
from tribo.diagnose.next_test import first_test_of, next_test, widening_test
from tribo.diagnose.search.looks import all_looks
from tribo.diagnose.search.naming import Named, name_causes, weights_of
from tribo.diagnose.search.screen import Progress, Screen, screen
from tribo.diagnose.search.weigh import Candidate, unseen
from tribo.diagnose.sentences import (
    cause_of,
    causes_from_evidence,
    exclusions,
    misfits_of,
    patterns_apart,
    smallest_effects,
    summary,
)
from tribo.diagnose.statistics.direct_evidence import (
    Evidence,
    certain_evidence,
    direct_evidence,
    stated_evidence,
)
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.gain import gain, gain_of_zero
from tribo.diagnose.statistics.model import ModelFit, setup
from tribo.diagnose.statistics.observations import Observations, observe
from tribo.diagnose.statistics.predictor import Predictor, tabled_predictor
from tribo.diagnose.verdict import Cause, Excluded, Gain, Misfit, NextTest, Outcome, Verdict
from tribo.records import Ingested

REPLICATES = 120
REPLICATES_LEFT = 60
FEWEST_TESTS = 12


def diagnose(
    ingested: Ingested,
    *,
    seed: int = 0,
    level: float = 0.01,
    predictor: Predictor | None = None,
    progress: Progress | None = None,
) -> Verdict:
    """Find out whether the calibrated model fails on a campaign beyond chance, and which mechanism explains it.

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

    Returns
    -------
    Verdict
        The record behind verdict.json.
    """
    return examine(ingested, seed=seed, level=level, predictor=predictor, progress=progress).verdict


def examine(
    ingested: Ingested,
    *,
    seed: int = 0,
    level: float = 0.01,
    predictor: Predictor | None = None,
    progress: Progress | None = None,
    replicates: tuple[int, int] = (REPLICATES, REPLICATES_LEFT),
) -> Diagnosis:
    """:func:`diagnose`, with the fitted models and screens kept. Raises FitError below twelve usable tests."""
    rng = np.random.default_rng(seed)
    observations = observe(ingested)
    _enough(observations)
    s = setup(observations, predictor or tabled_predictor(observations.patterns))
    baseline = fit(s)
    screened = screen(baseline, all_looks(baseline), replicates=replicates[0], rng=rng, progress=progress)
    evidence = direct_evidence(observations)
    barred = _barred(baseline, evidence)
    named = None
    if screened.p_adjusted() < level:
        named = name_causes(
            baseline, screened, [e.mechanism for e in barred],
            level=level, replicates=replicates[1], rng=rng, progress=progress,
        )  # fmt: skip
    verdict = _verdict(baseline, screened, named, evidence, barred, level, rng)
    return Diagnosis(verdict, baseline, screened, named)


def _enough(o: Observations) -> None:
    from tribo.errors import FitError, Problem

    if o.n < FEWEST_TESTS or len(np.unique(o.conditions.normal_load_N)) < 2:
        raise FitError(
            Problem(
                "too_few_tests", "too few usable tests to diagnose anything",
                found=f"{o.n} tests at {len(np.unique(o.conditions.normal_load_N))} loads",
                allowed=f"at least {FEWEST_TESTS} tests at two loads",
            )
        )  # fmt: skip


def _barred(baseline: ModelFit, evidence: dict[str, Evidence]) -> list[Excluded]:
    """Mechanisms that are not weighed, because direct evidence decides them or the design cannot show them."""
    return exclusions(baseline, evidence, unseen(baseline))


def _verdict(
    baseline: ModelFit,
    screened: Screen,
    named: Named | None,
    evidence: dict[str, Evidence],
    barred: list[Excluded],
    level: float,
    rng: np.random.Generator,
) -> Verdict:
    flat = baseline.setup.observations.flat
    direct = causes_from_evidence(evidence)
    misfits = [m for _, m in direct] + misfits_of(screened, level, flat)
    outcome = _outcome(named, bool(direct), level)
    causes = [c for c, _ in direct] + (_causes(named, baseline) if outcome in ("named", "undetermined") else [])
    rest = named is not None and named.causes and outcome == "unknown" and not patterns_apart(misfits)
    left = misfits_of(named.left, level, flat) if named is not None and rest else []
    smallest = smallest_effects(baseline, screened, level, {e.mechanism for e in barred})
    return Verdict(
        verdict=outcome,
        misfits=_once([*left, *misfits]),
        causes=tuple(causes),
        equivalent=_equivalent(named) if outcome == "named" else (),
        excluded=tuple(_excluded(named, barred, causes)),
        gain=_gain(baseline, named, outcome, evidence, rng),
        set_aside=baseline.setup.observations.set_aside,
        next_test=_next_test(baseline, named, outcome, [*left, *misfits]),
        text=summary(outcome, causes, _equivalent(named), [*left, *misfits], smallest),
        smallest_effects=smallest,
    )


def _once(misfits: Sequence[Misfit]) -> tuple[Misfit, ...]:
    """Each column of each observable and sample once: the first of its misfits."""
    first = {(m.observable, m.sample, m.covariate): m for m in reversed(misfits)}
    return tuple(m for m in misfits if first[m.observable, m.sample, m.covariate] is m)


def _outcome(named: Named | None, direct: bool, level: float) -> Outcome:
    if named is None:
        return "named" if direct else "no_misfit"
    if not named.causes or named.p_left < level:
        return "unknown"
    return "undetermined" if named.rivals else "named"


def _causes(named: Named | None, baseline: ModelFit) -> list[Cause]:
    if named is None:
        return []
    found = []
    for k, alike in enumerate(named.causes):
        shown = [*alike, *(named.rivals if k == len(named.causes) - 1 else ())]
        found += [cause_of(c, float(w), baseline) for c, w in zip(shown, weights_of(shown), strict=True)]
    return sorted(found, key=lambda c: -c.weight)


def _equivalent(named: Named | None) -> tuple[tuple[str, ...], ...]:
    if named is None:
        return ()
    return tuple(tuple(c.name for c in alike) for alike in named.causes if len(alike) > 1)


def _gain(
    baseline: ModelFit, named: Named | None, outcome: Outcome, evidence: dict[str, Evidence], rng: np.random.Generator
) -> Gain | None:
    """Of the extended model where a mechanism was weighed, else of what direct evidence shows."""
    if named is not None and named.causes and outcome != "unknown":
        return gain(baseline, named.model, rng)
    quantities = [stated_evidence()[name].quantity for name in certain_evidence(evidence)]
    zeros = [quantity for quantity in quantities if quantity != "rise"]
    if outcome == "named" and zeros:
        return gain_of_zero(baseline.setup.observations, zeros[0] == "zero drift", rng)
    return None


def _next_test(
    baseline: ModelFit, named: Named | None, outcome: Outcome, misfits: Sequence[Misfit]
) -> NextTest | None:
    """A test that distinguishes tied mechanisms, confirms a cause against the next best, or narrows or widens the
    search."""
    if outcome == "unknown":
        return first_test_of(misfits[0].covariate) if misfits else None
    if named is None or not named.causes:
        return widening_test(baseline.setup.observations.conditions) if outcome == "no_misfit" else None
    for alike in named.causes:
        if len(alike) > 1:
            return next_test(alike)
    best = named.causes[-1][0]
    others = [*named.rivals, *(c for c in named.weighed if c.name != best.name and len(named.causes) == 1)]
    return next_test([best, *others])


def _excluded(named: Named | None, barred: list[Excluded], causes: list[Cause]) -> list[Excluded]:
    """What was not weighed, and what explains the campaign less well than the causes."""
    shown = {c.mechanism for c in causes}
    found = [e for e in barred if e.mechanism not in shown]
    if named is None or not named.weighed or not causes:
        return found
    best = named.weighed[0].gain
    for c in named.weighed:
        if c.name not in shown and c.name not in {e.mechanism for e in found}:
            found.append(Excluded(c.name, _lost(c, best)))
    return found


def _lost(c: Candidate, best: float) -> str:
    """Why a weighed mechanism is not among the causes."""
    m = c.acting.mechanism
    if c.values[0] == m.amplitude.zero and m.amplitude.zero in (m.amplitude.low, m.amplitude.high):
        return "wrong sign: it can change friction in one direction only, and the misfit has the opposite sign"
    return f"explains the campaign less well: log likelihood lower by {best - c.gain:.1f}"


__all__ = ["Diagnosis", "Misfit", "diagnose", "examine"]
