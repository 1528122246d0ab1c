"""Which further test best distinguishes mechanisms that explain a campaign about equally, per hour at the bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tribo.diagnose.search.naming import Named
from tribo.diagnose.search.weighing import Candidate
from tribo.diagnose.statistics.bordered import model_columns
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import effect_of, predict
from tribo.diagnose.terms import in_words
from tribo.diagnose.verdict import Misfit, NextTest, Outcome
from tribo.mechanisms.record import Conditions
from tribo.mechanisms.table import MECHANISMS
from tribo.records import FloatArray

HOURS_PER_PULL = 7.0 / 60.0
PULLS = 18


def next_test_of(
    named: Named | None, outcome: Outcome, misfits: Sequence[Misfit], conditions: Conditions
) -> NextTest | None:
    """A test that distinguishes tied mechanisms, confirms a cause against the next best, or narrows or widens the
    search."""
    if outcome == "unknown":
        return first_test_of(misfits[0].covariate) if misfits else None
    if named is None or not named.causes:
        return widening_test(conditions) if outcome == "no_misfit" else None
    for alike in named.causes:
        if len(alike) > 1:
            return next_test(alike)
    best = named.causes[-1][0]
    others = [*named.rivals, *(c for c in named.weighed if c.name != best.name and len(named.causes) == 1)]
    return next_test([best, *others])


def next_test(tied: Sequence[Candidate]) -> NextTest | None:
    """The test with the most expected bits per hour between the two best of ``tied``; None for fewer than two."""
    if len(tied) < 2:
        return None
    first, second = tied[0], tied[1]
    options = [*_direct(first, second), *_without(first, second), *_loads(first, second)]
    best = max(options, key=lambda option: option.expected_bits / float(option.design["hours"]))
    return best


ALONE = {
    "normal_load_N": "Pull one specimen at nine loads over the range, first upwards, then downwards",
    "sample": "Pull one fresh specimen of every sample in turn, at one load and within one day",
    "date": "Pull the same specimens of one sample at one load again on several days",
}


def first_test_of(covariate: str) -> NextTest:
    """For a misfit that follows a column but no law: vary that column alone."""
    how = ALONE.get(covariate, f"Vary {in_words(covariate)} alone, in random order, on one sample at one load")
    text = f"{how}: {PULLS} pulls."
    design = {"covariate": covariate, "pulls": PULLS, "hours": PULLS * HOURS_PER_PULL}
    return NextTest(text, (covariate,), design, float("nan"))


def widening_test(conditions: Conditions) -> NextTest | None:
    """For a campaign without misfit: vary what was held fixed, so that further mechanisms can be tested."""
    fixed = {
        name: m.variation for name, m in MECHANISMS.items() if m.variation is not None and not m.applies(conditions)
    }
    if not fixed:
        return None
    text = f"Vary {' and '.join(v.text for v in fixed.values())} in random order: {PULLS} pulls of the flat sample."
    design: dict[str, Any] = {v.column: list(v.values) for v in fixed.values()}
    return NextTest(text, tuple(fixed), design | {"pulls": PULLS, "hours": 3 * PULLS * HOURS_PER_PULL}, float("nan"))


def bits(distance2: float) -> float:
    """Expected information of one test between two equally likely laws whose predictions differ.

    ``distance2`` is the squared difference in units of its noise; 0 gives 0 bits, much gives 1.
    """
    nodes, node_weights = np.polynomial.hermite_e.hermegauss(41)
    half = 0.5 * distance2 + np.sqrt(distance2) * nodes
    lost = node_weights @ np.logaddexp(0.0, -half) / node_weights.sum() / np.log(2)
    return float(np.clip(1.0 - lost, 0.0, 1.0))


def _direct(first: Candidate, second: Candidate) -> list[NextTest]:
    """Measuring the amplitude of one of the two: it is there, or it is not."""
    found = []
    for candidate in (first, second):
        m = candidate.acting.mechanism.measurement
        if m is not None and candidate.acting.measured is None:
            acting, size = candidate.acting, candidate.acting.mechanism.amplitude
            information = bits(float(((candidate.values[0] - size.zero) / m.uncertainty) ** 2))
            measured = ":".join(filter(None, (acting.mechanism.name, acting.choice)))
            design = {"measure": measured, "parameter": size.name, "unit": size.unit, "uncertainty": m.uncertainty}
            design["hours"] = m.hours
            found.append(_named(first, second, m.text, design, information))
    return found


def _without(first: Candidate, second: Candidate) -> list[NextTest]:
    """Repeating pulls of the most affected sample with one of the two removed (cavities vented, wire lowered)."""
    found = []
    for candidate in (first, second):
        m, f = candidate.acting.mechanism, candidate.fit
        if not m.removed_by:
            continue
        change = effect_of(f.setup, f.law, candidate.acting, candidate.values)
        conditions = f.setup.observations.conditions
        strongest = max(set(conditions.sample.tolist()), key=lambda n: np.abs(change[conditions.sample == n]).mean())
        rows = np.flatnonzero(conditions.sample == strongest)
        rows = rows[np.argsort(-np.abs(change[rows]).sum(axis=1))][:PULLS]
        text = f"{m.removed_by[0].upper()}{m.removed_by[1:]}: {len(rows)} pulls of {strongest}."
        design = {"without": m.name, "sample": strongest, "repeat_tests": _test_ids(f, rows), "pulls": len(rows)}
        design["hours"] = 1.0 + len(rows) * HOURS_PER_PULL
        found.append(_named(first, second, text, design, bits(_distance2(f, change[rows], rows))))
    return found


def _test_ids(f: ModelFit, rows: np.ndarray) -> list[str]:
    return [str(name) for name in f.setup.observations.test_ids[rows]]


def _loads(first: Candidate, second: Candidate) -> list[NextTest]:
    """More pulls of one sample at one load, also half the lowest and twice the highest measured."""
    conditions = first.fit.setup.observations.conditions
    loads = np.unique(np.round(conditions.normal_load_N, 5))
    found = []
    for sample in np.unique(conditions.sample):
        rows = np.resize(np.flatnonzero(conditions.sample == sample), PULLS)
        for load in (loads[0] / 2, loads[0], loads[-1], loads[-1] * 2):
            difference = _predicted_at(first.fit, rows, load) - _predicted_at(second.fit, rows, load)
            text = f"{PULLS} further pulls of {sample} at {load:.3g} N."
            design = {"sample": str(sample), "normal_load_N": float(load), "pulls": PULLS}
            design["hours"] = PULLS * HOURS_PER_PULL
            found.append(_named(first, second, text, design, bits(_distance2(first.fit, difference, rows))))
    return found


def _named(first: Candidate, second: Candidate, text: str, design: Mapping[str, Any], information: float) -> NextTest:
    return NextTest(text, (first.name, second.name), design, information)


def _predicted_at(f: ModelFit, rows: np.ndarray, load_N: float) -> FloatArray:
    """ln T of the tests ``rows`` had they been made under another load."""
    s = f.setup
    observations = s.observations.take(rows)
    conditions = replace(observations.conditions, normal_load_N=np.full(len(rows), load_N))
    moved = replace(s, observations=replace(observations, conditions=conditions), shares=s.shares[rows])
    return predict(moved, f.law, f.acting, f.values)


def _distance2(f: ModelFit, difference: FloatArray, rows: np.ndarray) -> float:
    """Squared difference of two predictions in units of the noise of further pulls on the same specimens."""
    from scipy.linalg import block_diag

    s = f.setup
    noise = block_diag(*f.noise.per_test(s)[rows])
    effects = s.random_effects.take(rows)
    without_law = np.zeros((len(rows), 2, f.linear.columns.parameters))
    total = noise + f.inverse.between(model_columns(without_law, effects), effects.specimen)
    vector = difference.ravel()
    return float(vector @ np.linalg.solve(total, vector))
