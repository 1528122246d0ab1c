"""Before anything is measured: which mechanisms a design would find, from which size, and which it confuses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tribo.diagnose.search.rivals import ALIKE
from tribo.diagnose.statistics.courses import added
from tribo.diagnose.statistics.linearisation import Linear, ModelFit, begin, scored
from tribo.diagnose.statistics.model import Acting, Setup, Target, predict, setup
from tribo.diagnose.statistics.observations import NO_FLAT, Observations, conditions_of
from tribo.diagnose.statistics.predictor import Predictor, tabled_predictor
from tribo.diagnose.statistics.scatter import Noise
from tribo.diagnose.statistics.start_effects import StartEffects, start_effects
from tribo.diagnose.terms import ABSORBED, not_varied
from tribo.display import displayed
from tribo.mechanisms.table import MECHANISMS
from tribo.records import Campaign, FloatArray

PAPER_LAW = np.array([4.78, 23.44, 2.879, 11.89])  # mu and tau0 in kPa of the flat sample, Berardo 2019, Table 2
TYPICAL = Noise(repeat=np.diag([0.09**2, 0.07**2]), specimen=np.array([0.05, 0.05]))
FOUND = 3.6  # strength that chance reaches in one campaign of a hundred, over all looks
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
    why: str
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
    state = begin(s, law, np.zeros((n, 2)), noise)
    jacobian = Target(s, ()).jacobian(law, s.observations.log_force - state.residual)
    score, weight = scored(s, state)
    linear = Linear(jacobian, s.random_effects, state.residual, state.at.factor, state.at.precision, weight)
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
        why = ABSORBED
        return Finding(a.name, float("nan"), m.amplitude.unit, float("nan"), (), why, m.separates)
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
        in_shape = "it changes the shape of the trace, not the friction forces"
        why = in_shape if varied else not_varied(m)
        found.append(Finding(m.name, float("nan"), m.amplitude.unit, float("nan"), (), why, m.separates))
    return found
