"""What to measure: which mechanisms a design would find, from which size, and which it confuses; and which further test
best distinguishes mechanisms that explain a campaign about equally, per hour at the bench.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.linalg import block_diag

from tribo.diagnostics.candidates import ALIKE, CauseCandidate, Named, refitted
from tribo.diagnostics.fit import ModelFit, scored, solved, state_at
from tribo.diagnostics.inference import with_open_form
from tribo.diagnostics.model import Target, added, effect_of, predict, setup
from tribo.diagnostics.normal_equations import model_columns
from tribo.diagnostics.observations import BREAK_S, NO_FLAT, Observations, conditions_of
from tribo.diagnostics.predictor import Predictor, tabled_predictor
from tribo.diagnostics.scatter import SIZE_PRIORS, Noise
from tribo.diagnostics.score_statistics import start_effects
from tribo.diagnostics.verdict import Misfit, NextTest, Outcome, TooLittle
from tribo.display import displayed
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Conditions, Mechanism
from tribo.records import REGIMES, Campaign, FloatArray

PAPER_LAW = np.array([4.78, 23.44, 2.879, 11.89])  # mu and tau0 in kPa of the flat sample, Berardo 2019, Table 2
TYPICAL = Noise(np.diag([0.09**2, 0.07**2]), SIZE_PRIORS[:, 0])
FOUND = 3.6  # strength that chance reaches in one campaign of a hundred, over all contrasts
NINE_IN_TEN = FOUND + 1.28
HOURS_PER_PULL = 7.0 / 60.0
PULLS = 18
NARROWER = 0.8  # of the width of an interval: what further pulls leave of it
MOST_PULLS = 72  # one long day
PLACES = {1: np.array([-1.0, 0.0, 1.0]), 2: np.array([-1.0, 1.0])}  # of a column varied alone, of two together
CHOSEN: dict[str, Literal["ratio", "interval"]] = {  # conditions that can be set, with their scale
    "speed_m_s": "ratio", "hold_s": "ratio", "temperature_C": "interval", "humidity_pct": "interval",
}  # fmt: skip


WhyNot = Literal["", "absorbed", "hidden", "not varied", "in the trace"]


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
    why: WhyNot
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
        Expected scatter of ln T: the covariance of repeats (2, 2), static first, and the standard deviations of gains
        and slopes of specimens (2,).
    law : array (4,)
        Expected law of the flat sample: mu and tau0 in kPa, static then sliding.
    predictor : Predictor, optional
        Shares of the flat law per sample; those tabulated from simulations by default.

    Returns
    -------
    Plan
        ``findings``, one a mechanism, the easiest to find first, and ``tied``, the sets that the design confuses.

    Raises
    ------
    KeyError
        ``predictor`` lacks a sample of the campaign.

    Examples
    --------
    >>> plan = tribo.plan_design(tribo.load_campaign("data/example"))
    >>> easiest = plan.findings[0]
    >>> easiest.effect_percent < 20  # change of T that is found nine times in ten
    True
    """
    f = expected_fit(campaign, noise, law, predictor)
    effects = start_effects(f)
    first: dict[str, int] = {}  # choice of every mechanism, and every column
    for k, a in enumerate(effects.acting):
        first.setdefault(a.name, k)
    acting = [effects.acting[k] for k in first.values()]
    columns = np.concatenate([added(effects.courses[k]) for k in first.values()], axis=2)
    left = f.cleared(columns)[0]
    length = np.sqrt(np.sum(left**2, axis=0))
    cosine = (left.T @ left) / np.maximum(length[:, None] * length[None, :], 1e-12)
    size = np.ptp(f.beyond_law(columns), axis=(0, 1))
    findings = []
    for k in np.argsort(-length / np.maximum(size, 1e-12)):
        name, m = acting[k].name, acting[k].mechanism
        if name in effects.absorbed:
            findings.append(_not_found(name, m, effects.absorbed[name]))
            continue
        times = NINE_IN_TEN / max(float(length[k]), 1e-12)
        alike = [acting[j].name for j in np.flatnonzero(np.abs(cosine[k]) >= ALIKE) if j != k]
        alike = [other for other in alike if other not in effects.absorbed]
        percent = 100.0 * float(np.expm1(min(times * float(size[k]), 5.0)))
        amplitude = times * m.amplitude.start
        findings.append(Finding(name, amplitude, m.amplitude.unit, percent, tuple(alike), "", m.separates))
    for m in MECHANISMS.values():
        if not m.applies(f.setup.observations.conditions):
            findings.append(_not_found(m.name, m, "not varied"))
        elif not m.changes_forces:
            findings.append(_not_found(m.name, m, "in the trace"))
    return Plan(f.setup.observations.n, tuple(findings))


def _not_found(name: str, m: Mechanism, why: WhyNot) -> Finding:
    return Finding(name, math.nan, m.amplitude.unit, math.nan, (), why, m.separates)


def expected_fit(campaign: Campaign, noise: Noise, law: FloatArray, predictor: Predictor | None) -> ModelFit:
    """The model as it would be fitted if the campaign came out exactly as expected."""
    tests = list(campaign.tests)
    n, patterns = len(tests), dict(campaign.samples)
    nothing = np.full(n, np.nan)
    hours = np.array([8.0 + 0.1 * (k % 80) for k in range(n)])
    o = Observations(
        test_ids=np.array([t.test_id for t in tests], str), conditions=conditions_of(campaign, tests),
        patterns=patterns, log_force=np.zeros((n, 2)), reading=np.full((n, 2), 0.005), zero_N=nothing,
        zero_slope_N_per_s=nothing, rise_N_per_m=nothing, stick_slip_N=nothing, noise_N=nothing, clock_h=hours,
        flat=campaign.flat_sample or NO_FLAT,
    )  # fmt: skip
    s = setup(o, predictor or tabled_predictor(patterns))
    s = replace(s, observations=replace(o, log_force=predict(s, law, (), ())))
    state = state_at(s, law, np.zeros(s.n_effects), np.zeros((n, 2)), noise)
    target = Target(s, ())
    jacobian = target.jacobian(law, s.observations.log_force - state.residual)
    score, weight = scored(s, state)
    inverse, _ = solved(state, model_columns(jacobian, s), weight, target.bounds)
    return ModelFit(
        s, (), law, (), noise, state.effects, state.residual, score, inverse, jacobian, state.factor, state.precision,
        weight,
    )  # fmt: skip


def next_test_of(
    named: Named | None, outcome: Outcome, misfits: Sequence[Misfit], model: ModelFit, hidden: Collection[str]
) -> NextTest | None:
    """A test that distinguishes tied mechanisms, confirms a cause against the next best, or narrows or widens the
    search; ``hidden`` are the mechanisms that the errors of the model for the patterns hide.

    Samples that differ for no known reason were measured already: what can tell more is what the campaign could not
    test, on the sample that differs most.
    """
    conditions = model.setup.observations.conditions
    if outcome == "unknown" and misfits and misfits[0].covariate == "sample":
        return widening_test(conditions, misfits[0].sample, hidden) or first_test_of(model, "sample")
    if outcome == "unknown":
        return first_test_of(model, misfits[0].covariate, sample=misfits[0].sample) if misfits else None
    if named is None or not named.causes:
        return widening_test(conditions) if outcome == "no_misfit" else None
    for alike in named.causes:
        if len(alike) > 1:
            return next_test(alike)
    if named.rivals:
        return next_test([named.causes[-1][0], *named.rivals])
    return settling_test(_acting_most(named))


def _acting_most(named: Named) -> CauseCandidate:
    """The cause that changes friction most, which a finding tells first, fitted as the last of all causes."""
    model = named.model
    changes = {a.name: float(np.abs(np.expm1(effect_of(model.setup, model.law, a, v))).max())
               for a, v in zip(model.acting, model.values, strict=True)}  # fmt: skip
    most = max((alike[0] for alike in named.causes), key=lambda cause: changes.get(cause.name, 0.0))
    if most is named.causes[-1][0]:
        return most
    others = [a for a in model.acting if a.name != most.name]
    return replace(most, fit=refitted(model, [*others, most.acting]))


def settling_test(cause: CauseCandidate) -> NextTest | None:
    """For a cause that is named alone, a test of the cause itself: values of its column that were not measured, its
    amplitude measured directly, pulls without it, its column varied alone, or pulls that narrow its size."""
    own = (cause.name,)
    column = cause.acting.mechanism.column(cause.acting.choice)
    tests = confirming_test(cause), _measuring(cause, own), _removing(cause, own)
    if (test := next(filter(None, tests), None)) is not None:
        return test
    if column in ("specimen_run", *cause.fit.setup.observations.conditions.columns):
        others = [a for a in cause.fit.acting if a.name != cause.name]
        return first_test_of(refitted(cause.fit, others), column)
    return narrowing_test(cause)


def next_test(tied: Sequence[CauseCandidate]) -> NextTest | None:
    """The test with the most expected bits per hour between the two best of ``tied``; None for fewer than two.

    Options: the amplitude of one of the two is measured; pulls of the most affected sample are repeated with one of
    the two removed (cavities vented, wire lowered); more pulls are made of one sample at one load, also half the lowest
    and twice the highest measured.
    """
    if len(tied) < 2:
        return None
    first, second = tied[0], tied[1]
    separates = first.name, second.name
    options = [test for make in (_measuring, _removing) for c in (first, second) if (test := make(c, separates))]
    conditions = first.fit.setup.observations.conditions
    loads = np.unique(np.round(conditions.normal_load_N, 5))
    for name in np.unique(conditions.sample):
        rows = np.resize(np.flatnonzero(conditions.sample == name), PULLS)
        for load in (loads[0] / 2, loads[0], loads[-1], loads[-1] * 2):
            loaded = np.full(PULLS, load)
            difference = _predicted(first.fit, rows, normal_load_N=loaded)
            difference = difference - _predicted(second.fit, rows, normal_load_N=loaded)
            design = {"sample": str(name), "normal_load_N": float(load), "pulls": PULLS}
            design["hours"] = PULLS * HOURS_PER_PULL
            options.append(
                NextTest("pull further", separates, design, bits(_distance2(first.fit, difference, rows)))
            )
    return max(options, key=lambda option: option.expected_bits / float(option.design["hours"]))


def narrowing_test(cause: CauseCandidate) -> NextTest:
    """Further pulls that narrow the interval of a cause's size: of one sample or of all, at an end of the measured
    loads or at both, also at half the lowest and twice the highest; the best of these, of PULLS or, where these do not
    leave at most NARROWER of the width, of more.

    Where not even MOST_PULLS do, since the error of the model for the patterns or the specimens limit the size, what
    was held fixed is varied, if anything was, on the sample that the cause changes most.
    """
    c = cause.fit.setup.observations.conditions
    loads = np.unique(c.normal_load_N)
    every = tuple(map(str, np.unique(c.sample)))
    low, high = float(loads[0]), float(loads[-1])
    places = [(samples, chosen) for samples in (*((name,) for name in every), every)
              for chosen in ((low,), (high,), (low, high), (low / 2, high * 2))]  # fmt: skip
    samples, chosen = min(places, key=lambda place: _size_error(cause, place[0], place[1], PULLS))
    for pulls in range(PULLS, MOST_PULLS + 1, PULLS):
        left = width_left(cause, samples, chosen, pulls)
        if left <= NARROWER:
            break
    strongest, flat = most_changed(cause), cause.fit.setup.observations.flat
    if left > NARROWER and (wider := widening_test(c, strongest if strongest != flat else "")) is not None:
        design = {**wider.design, "share_of_width": left}
        return replace(wider, separates=(cause.name, *wider.separates), design=design)
    design = {"samples": list(samples), "normal_loads_N": list(chosen), "pulls": pulls, "hours": pulls * HOURS_PER_PULL,
              "share_of_width": left}  # fmt: skip
    return NextTest("pull more", (cause.name,), design)


def most_changed(cause: CauseCandidate) -> str:
    """The sample whose ln T a cause changes most on average."""
    sample = cause.fit.setup.observations.conditions.sample
    change = np.abs(effect_of(cause.fit.setup, cause.fit.law, cause.acting, cause.values))
    return max(np.unique(sample).tolist(), key=lambda name: float(change[sample == name].mean()))


def width_left(cause: CauseCandidate, samples: Sequence[str], loads: Sequence[float], pulls: int) -> float:
    """Which share of the standard error of a cause's size is left once so many further pulls were made, in a session of
    their own, at these loads in turn on the specimens of these samples."""
    before, after = (_size_error(cause, samples, loads, number) for number in (0, pulls))
    return after / before if before > 0 else 1.0


def _size_error(cause: CauseCandidate, samples: Sequence[str], loads: Sequence[float], pulls: int) -> float:
    """The standard error of a cause's size with so many further pulls that come out as expected."""
    f = cause.fit
    o = f.setup.observations
    there = np.flatnonzero(np.isin(o.conditions.sample, list(samples)))
    spread = there[np.linspace(0, len(there) - 1, pulls).astype(int)]
    both = o.take(np.concatenate([np.arange(o.n), spread]))
    c = both.conditions
    load, new = c.normal_load_N.copy(), np.arange(o.n, o.n + pulls)
    load[new] = np.resize(np.array(loads), pulls)
    later = {name: getattr(c, name).copy() for name in ("specimen_run", "run_order", "elapsed_s")}
    for name, step in (("specimen_run", 1.0), ("run_order", 1.0), ("elapsed_s", 3600.0 * HOURS_PER_PULL)):
        first = np.max(later[name][: o.n]) + (BREAK_S if name == "elapsed_s" else 0.0)
        later[name][new] = first + step * np.arange(1, pulls + 1)
    both = replace(both, conditions=replace(c, normal_load_N=load, **later))
    s = setup(both, f.setup.predictor)
    target, x = Target(s, f.acting), np.concatenate([f.law, *f.values])
    expected = target.predict(x)
    s = replace(s, observations=replace(both, log_force=expected))
    state = state_at(s, x, np.zeros(s.n_effects), np.zeros_like(expected), f.noise)
    columns = model_columns(target.jacobian(x, expected), s)
    inverse, _ = solved(state, columns, np.ones(len(expected)), target.bounds)
    size = columns.parameters - len(cause.values)
    return float(np.sqrt(inverse.border[0, size, size]))


def _measuring(candidate: CauseCandidate, separates: tuple[str, ...]) -> NextTest | None:
    """The amplitude of a candidate measured directly; None where it was, or where nothing measures it."""
    acting, m = candidate.acting, candidate.acting.mechanism.measurement
    if m is None or acting.measured is not None:
        return None
    size = acting.mechanism.amplitude
    measured = ":".join(filter(None, (acting.mechanism.name, acting.choice)))
    design: dict[str, Any] = {"measure": measured, "parameter": size.name, "unit": size.unit}
    design |= {"uncertainty": m.uncertainty, "hours": m.hours}
    distance2 = float(((candidate.values[0] - size.zero) / m.uncertainty) ** 2)
    return NextTest("measure", separates, design, bits(distance2))


def _removing(candidate: CauseCandidate, separates: tuple[str, ...]) -> NextTest | None:
    """Pulls of the most affected sample repeated without a candidate; None where it cannot be removed."""
    f = candidate.fit
    if not candidate.acting.mechanism.removed_by:
        return None
    change = effect_of(f.setup, f.law, candidate.acting, candidate.values)
    strongest = most_changed(candidate)
    rows = np.flatnonzero(f.setup.observations.conditions.sample == strongest)
    rows = rows[np.argsort(-np.abs(change[rows]).sum(axis=1))][:PULLS]
    test_ids = [str(name) for name in f.setup.observations.test_ids[rows]]
    design: dict[str, Any] = {"without": candidate.acting.mechanism.name, "sample": strongest, "repeat_tests": test_ids}
    design |= {"pulls": len(rows), "hours": 1.0 + len(rows) * HOURS_PER_PULL}
    return NextTest("remove", separates, design, bits(_distance2(f, change[rows], rows)))


def confirming_test(cause: CauseCandidate) -> NextTest | None:
    """For a cause without a rival that follows a recorded column: pulls at values that were not measured, below,
    between and above those that were; None for any other cause.

    The bits part an effect that goes on as its formula says from one that ends where the measured values end.
    """
    f, acting = cause.fit, cause.acting
    c = f.setup.observations.conditions
    column = next((name for name in acting.mechanism.needs if name in CHOSEN), "")
    if not column:
        return None
    change = np.abs(effect_of(f.setup, f.law, acting, cause.values))
    sample = most_changed(cause)
    rows = np.resize(np.flatnonzero(c.sample == sample), PULLS)
    recorded = np.unique(c.recorded(column))
    recorded = recorded[np.isfinite(recorded)]
    further = _further_values(recorded, CHOSEN[column])
    values = np.resize(further, PULLS)
    beyond = _predicted(f, rows, **{column: values})
    ended = _predicted(f, rows, **{column: np.clip(values, recorded[0], recorded[-1])})
    told = np.array([e.value for e in with_open_form(f, len(f.acting) - 1).values()])
    as_told = replace(f, values=(*f.values[:-1], told))
    low, high = (_predicted(as_told, rows, **{column: np.full(PULLS, end)}) for end in (further[0], further[-1]))
    regime = int(np.argmax(change.mean(axis=0)))
    percent = 100.0 * float(np.expm1((high - low)[:, regime].mean()))
    design = {
        "covariate": column, "values": further.tolist(), "sample": sample, "regime": REGIMES[regime],
        "expected_percent": percent, "pulls": PULLS, "hours": PULLS * HOURS_PER_PULL,
    }  # fmt: skip
    return NextTest("confirm", (cause.name,), design, bits(_distance2(f, beyond - ended, rows)))


def _further_values(recorded: FloatArray, scale: Literal["ratio", "interval"]) -> FloatArray:
    """Three values to measure next: below the recorded ones, in the widest gap between them, and above.

    On a scale of ratios half the lowest and twice the highest; else a quarter of the range beyond its ends.
    """
    x = np.log(np.maximum(recorded, 1e-9)) if scale == "ratio" else recorded
    aside = np.log(2.0) if scale == "ratio" else np.ptp(x) / 4
    widest = int(np.argmax(np.diff(x)))
    further = np.array([x[0] - aside, (x[widest] + x[widest + 1]) / 2, x[-1] + aside])
    return np.array([float(f"{value:.2g}") for value in (np.exp(further) if scale == "ratio" else further)])


def first_test_of(f: ModelFit, *covariates: str, sample: str = "") -> NextTest:
    """For a misfit that follows a column, or two together, and no mechanism: vary that alone, or every pair of ends, on
    the ``sample`` it is about, if it is about one; so many pulls that its size is known more closely than before.
    The fit holds nothing that follows these columns."""
    pulls = narrowing_pulls(f, covariates, sample)
    design: dict[str, Any] = {"pulls": pulls, "hours": pulls * HOURS_PER_PULL}
    if sample:
        design["sample"] = sample
    if len(covariates) > 1:
        return NextTest("factorial", covariates, design | {"vary": list(covariates)})
    return NextTest("vary one column", covariates, design | {"covariate": covariates[0]})


def narrowing_pulls(f: ModelFit, columns: Sequence[str], sample: str = "") -> int:
    """How many pulls of one sample, equally shared between the ends (and the middle) of the range of one or two
    columns, narrow the interval of an effect of these columns to NARROWER of its width.

    The information of the campaign is that of a straight line over the range, all that is fitted beside it taken out;
    that of the further pulls rests on their scatter alone, their mean being that of another day.
    """
    c = f.setup.observations.conditions
    course = np.prod([_over_range(c, name) for name in columns], axis=0)
    known = float(np.sum(f.cleared(np.repeat(course[:, None], 2, axis=1)[:, :, None])[0] ** 2))
    rows = np.isin(c.sample, [sample]) if sample in c.sample else np.ones(len(c.sample), bool)
    repeat = f.noise.per_test(f.setup)[rows].mean(axis=0)
    each = float(np.linalg.inv(repeat).sum()) * float(np.mean(PLACES[min(len(columns), 2)] ** 2))
    needed = known * (NARROWER**-2 - 1.0) / each
    return int(np.clip(6 * np.ceil(needed / 6), PULLS, MOST_PULLS))


def _over_range(c: Conditions, name: str) -> FloatArray:
    """A column from -1 at its lowest to 1 at its highest value, 0 where it is not recorded; of names, 1 for the first
    and -1 for all others."""
    cells = c.columns[name] if name in c.columns else getattr(c, name, np.zeros(0))
    if len(cells) != len(c.sample):
        return np.zeros(len(c.sample))
    x = np.asarray(pd.to_numeric(pd.Series(cells), errors="coerce"), float)
    if not np.isfinite(x).any():
        return np.where(cells == np.unique(cells)[0], 1.0, -1.0)
    low, high = np.nanmin(x), np.nanmax(x)
    return np.asarray(np.nan_to_num((2.0 * x - low - high) / max(high - low, 1e-300)))


def more_tests(lack: TooLittle) -> NextTest:
    """The fewest tests, loads and samples that can be tested."""
    design = {"pulls": lack.fewest_tests, "loads": lack.fewest_loads, "samples": lack.fewest_samples}
    return NextTest("measure more", (), design)


def widening_test(conditions: Conditions, sample: str = "", hidden: Collection[str] = ()) -> NextTest | None:
    """Vary what was held fixed, so that further mechanisms can be tested: on the flat sample, and on ``sample``, which
    is pulled again without those of the ``hidden`` mechanisms that can be removed."""
    fixed = {
        name: m.variation for name, m in MECHANISMS.items() if m.variation is not None and not m.applies(conditions)
    }
    removed = [name for name in hidden if sample and MECHANISMS[name].removed_by]
    if not fixed and not removed:
        return None
    design: dict[str, Any] = {v.column: list(v.values) for v in fixed.values()}
    pulls = PULLS // 2 * (2 * bool(fixed) + len(removed))
    if sample:
        design |= {"sample": sample, "without": removed}
    design |= {"pulls": pulls, "hours": 3 * pulls * HOURS_PER_PULL}
    return NextTest("vary what was fixed", (*fixed, *removed), design)


def bits(distance2: float) -> float:
    """Expected information of one test between two equally likely laws whose predictions differ.

    ``distance2`` is the squared difference in units of its noise; 0 gives 0 bits, much gives 1.
    """
    nodes, node_weights = np.polynomial.hermite_e.hermegauss(41)
    half = 0.5 * distance2 + np.sqrt(distance2) * nodes
    lost = node_weights @ np.logaddexp(0.0, -half) / node_weights.sum() / np.log(2)
    return float(np.clip(1.0 - lost, 0.0, 1.0))


def _predicted(f: ModelFit, rows: np.ndarray, **changed: Any) -> FloatArray:
    """ln T of the tests ``rows`` had they been made under other conditions, each an array of shape (rows,)."""
    s = f.setup
    observations = s.observations.take(rows)
    conditions = replace(observations.conditions, **changed)
    moved = replace(s, observations=replace(observations, conditions=conditions), shares=s.shares[rows])
    return predict(moved, f.law, f.acting, f.values)


def _distance2(f: ModelFit, difference: FloatArray, rows: np.ndarray) -> float:
    """Squared difference of two predictions in units of the noise of further pulls on the same specimens."""
    s = f.setup
    noise = block_diag(*f.noise.per_test(s)[rows])
    without_law = np.zeros((len(rows), 2, f.columns.parameters))
    total = noise + f.inverse.between(model_columns(without_law, s.take(rows)), s.specimen[rows])
    vector = difference.ravel()
    return float(vector @ np.linalg.solve(total, vector))
