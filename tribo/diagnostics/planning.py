"""Before anything is measured: which mechanisms a design would find, from which size, and which it confuses.

Which further test best distinguishes mechanisms that explain a campaign about equally, per hour at the bench.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from tribo.diagnostics.candidates import ALIKE, CauseCandidate, Named
from tribo.diagnostics.fit import Linear, ModelFit, scored, state_at
from tribo.diagnostics.model import Acting, Setup, Target, added, effect_of, predict, setup
from tribo.diagnostics.normal_equations import model_columns
from tribo.diagnostics.observations import NO_FLAT, Observations, conditions_of
from tribo.diagnostics.predictor import Predictor, tabled_predictor
from tribo.diagnostics.scatter import Noise
from tribo.diagnostics.score_statistics import StartEffects, start_effects
from tribo.diagnostics.verdict import Misfit, NextKind, NextTest, Outcome
from tribo.display import displayed
from tribo.mechanisms.record import Conditions
from tribo.mechanisms.table import MECHANISMS
from tribo.records import Campaign, FloatArray

PAPER_LAW = np.array([4.78, 23.44, 2.879, 11.89])  # mu and tau0 in kPa of the flat sample, Berardo 2019, Table 2
TYPICAL = Noise(repeat=np.diag([0.09**2, 0.07**2]), specimen=np.array([0.05, 0.05]))
FOUND = 3.6  # strength that chance reaches in one campaign of a hundred, over all contrasts
NINE_IN_TEN = FOUND + 1.28


@dataclass(frozen=True)
class Finding:
    """What a design would show of one mechanism.

    ``amplitude`` (in ``unit``) and ``effect_percent`` (change of T, peak to peak, that the calibration on the flat
    sample does not absorb) are found nine times in ten; both are NaN where the design cannot show it, and ``why``
    says so. ``confused_with`` lists mechanisms with the same effect in this design.
    """

    mechanism: str
    amplitude: float
    unit: str
    effect_percent: float
    confused_with: tuple[str, ...]
    why: Literal["", "absorbed", "not varied", "in the trace"]
    separates: str


@displayed()
@dataclass(frozen=True)
class Plan:
    """What a design can show of each mechanism, the easiest first."""

    n_tests: int
    findings: tuple[Finding, ...]

    @property
    def tied(self) -> tuple[tuple[str, ...], ...]:
        """Sets of mechanisms that this design cannot distinguish."""
        sets = {tuple(sorted((f.mechanism, *f.confused_with))) for f in self.findings if f.confused_with}
        return tuple(sorted(sets))


def plan_design(
    campaign: Campaign, *, noise: Noise = TYPICAL, law: FloatArray = PAPER_LAW, predictor: Predictor | None = None
) -> Plan:
    """Sensitivity of a design to every mechanism, from tests.csv alone: no export has to exist.

    Parameters
    ----------
    campaign : Campaign
        The planned tests with the conditions under which they will be made.
    noise : Noise
        Expected standard deviations of ln T: repeats (2, 2), gains and slopes of specimens (2,).
    law : array (4,)
        Expected flat law: mu and tau0 in kPa, static then sliding.
    """
    f = expected_fit(campaign, noise, law, predictor)
    effects = start_effects(f)
    first = _one_each(effects)
    acting = [effects.acting[k] for k in first]
    columns = np.concatenate([added(effects.changes.courses[k]) for k in first], axis=2)
    left = f.linear.cleared(columns)[0]
    size = np.sqrt(np.sum(left**2, axis=0))
    cosine = (left.T @ left) / np.maximum(size[:, None] * size[None, :], 1e-12)
    shown = f.linear.beyond_law(columns)
    order = np.argsort(-size / np.maximum(np.ptp(shown, axis=(0, 1)), 1e-12))
    found = [_finding(k, acting, shown, size, cosine, effects.absorbed) for k in order]
    return Plan(f.setup.observations.n, (*found, *_not_applying(f.setup)))


def expected_fit(campaign: Campaign, noise: Noise, law: FloatArray, predictor: Predictor | None) -> ModelFit:
    """The model as it would be fitted if the campaign came out exactly as expected."""
    tests = list(campaign.tests)
    n, patterns = len(tests), dict(campaign.samples)
    nothing = np.full(n, np.nan)
    hours = np.array([8.0 + 0.1 * (k % 80) for k in range(n)])
    o = Observations(
        test_ids=np.array([t.test_id for t in tests], str), conditions=conditions_of(campaign, tests),
        patterns=patterns, log_force=np.zeros((n, 2)), reading=np.full((n, 2), 0.005), zero_N=nothing,
        zero_u_N=nothing, zero_slope_N_per_s=nothing, rise_N_per_m=nothing, stick_slip_N=nothing,
        noise_N=nothing, clock_h=hours, day=np.array([t.started_at[:10] for t in tests], str),
        flat=campaign.flat_sample or NO_FLAT,
    )  # fmt: skip
    s = setup(o, predictor or tabled_predictor(patterns))
    s = replace(s, observations=replace(o, log_force=predict(s, law, (), ())))
    state = state_at(s, law, np.zeros(s.random_effects.count), np.zeros((n, 2)), noise)
    jacobian = Target(s, ()).jacobian(law, s.observations.log_force - state.residual)
    score, weight = scored(s, state)
    linear = Linear(jacobian, s.random_effects, state.residual, state.factor, state.precision, weight)
    return ModelFit(s, (), law, (), noise, state.effects, state.residual, score, linear.inverse, linear)


def _one_each(effects: StartEffects) -> list[int]:
    """The first choice of every mechanism, and every column."""
    seen: dict[str, int] = {}
    for k, a in enumerate(effects.acting):
        seen.setdefault(a.name, k)
    return list(seen.values())


def _finding(
    k: int,
    acting: list[Acting],
    columns: FloatArray,
    size: FloatArray,
    cosine: FloatArray,
    hidden: frozenset[str],
) -> Finding:
    a = acting[k]
    m = a.mechanism
    if a.name in hidden:
        return Finding(a.name, float("nan"), m.amplitude.unit, float("nan"), (), "absorbed", m.separates)
    times = NINE_IN_TEN / max(float(size[k]), 1e-12)
    alike = [
        acting[j].name for j in np.flatnonzero(np.abs(cosine[k]) >= ALIKE) if j != k and acting[j].name not in hidden
    ]
    percent = 100.0 * float(np.expm1(min(times * float(np.ptp(columns[:, :, k])), 5.0)))
    return Finding(a.name, times * m.amplitude.start, m.amplitude.unit, percent, tuple(alike), "", m.separates)


def _not_applying(s: Setup) -> list[Finding]:
    """Mechanisms whose columns this design does not vary, or that do not show in the friction forces."""
    found = []
    for m in MECHANISMS.values():
        varied = m.applies(s.observations.conditions)
        if varied and m.changes_forces:
            continue
        why: Literal["in the trace", "not varied"] = "in the trace" if varied else "not varied"
        found.append(Finding(m.name, float("nan"), m.amplitude.unit, float("nan"), (), why, m.separates))
    return found


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


def next_test(tied: Sequence[CauseCandidate]) -> NextTest | None:
    """The test with the most expected bits per hour between the two best of ``tied``; None for fewer than two."""
    if len(tied) < 2:
        return None
    first, second = tied[0], tied[1]
    options = [*_direct(first, second), *_without(first, second), *_loads(first, second)]
    best = max(options, key=lambda option: option.expected_bits / float(option.design["hours"]))
    return best


def first_test_of(covariate: str) -> NextTest:
    """For a misfit that follows a column but no law: vary that column alone."""
    design = {"covariate": covariate, "pulls": PULLS, "hours": PULLS * HOURS_PER_PULL}
    return NextTest("vary one column", (covariate,), design)


def widening_test(conditions: Conditions) -> NextTest | None:
    """For a campaign without misfit: vary what was held fixed, so that further mechanisms can be tested."""
    fixed = {
        name: m.variation for name, m in MECHANISMS.items() if m.variation is not None and not m.applies(conditions)
    }
    if not fixed:
        return None
    design: dict[str, Any] = {v.column: list(v.values) for v in fixed.values()}
    return NextTest("vary what was fixed", tuple(fixed), design | {"pulls": PULLS, "hours": 3 * PULLS * HOURS_PER_PULL})


def bits(distance2: float) -> float:
    """Expected information of one test between two equally likely laws whose predictions differ.

    ``distance2`` is the squared difference in units of its noise; 0 gives 0 bits, much gives 1.
    """
    nodes, node_weights = np.polynomial.hermite_e.hermegauss(41)
    half = 0.5 * distance2 + np.sqrt(distance2) * nodes
    lost = node_weights @ np.logaddexp(0.0, -half) / node_weights.sum() / np.log(2)
    return float(np.clip(1.0 - lost, 0.0, 1.0))


def _direct(first: CauseCandidate, second: CauseCandidate) -> list[NextTest]:
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
            found.append(_named("measure", first, second, design, information))
    return found


def _without(first: CauseCandidate, second: CauseCandidate) -> list[NextTest]:
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
        design = {"without": m.name, "sample": strongest, "repeat_tests": _test_ids(f, rows), "pulls": len(rows)}
        design["hours"] = 1.0 + len(rows) * HOURS_PER_PULL
        found.append(_named("remove", first, second, design, bits(_distance2(f, change[rows], rows))))
    return found


def _test_ids(f: ModelFit, rows: np.ndarray) -> list[str]:
    return [str(name) for name in f.setup.observations.test_ids[rows]]


def _loads(first: CauseCandidate, second: CauseCandidate) -> list[NextTest]:
    """More pulls of one sample at one load, also half the lowest and twice the highest measured."""
    conditions = first.fit.setup.observations.conditions
    loads = np.unique(np.round(conditions.normal_load_N, 5))
    found = []
    for sample in np.unique(conditions.sample):
        rows = np.resize(np.flatnonzero(conditions.sample == sample), PULLS)
        for load in (loads[0] / 2, loads[0], loads[-1], loads[-1] * 2):
            difference = _predicted_at(first.fit, rows, load) - _predicted_at(second.fit, rows, load)
            design = {"sample": str(sample), "normal_load_N": float(load), "pulls": PULLS}
            design["hours"] = PULLS * HOURS_PER_PULL
            found.append(
                _named("pull further", first, second, design, bits(_distance2(first.fit, difference, rows)))
            )
    return found


def _named(
    kind: NextKind, first: CauseCandidate, second: CauseCandidate, design: Mapping[str, Any], information: float
) -> NextTest:
    return NextTest(kind, (first.name, second.name), design, information)


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
