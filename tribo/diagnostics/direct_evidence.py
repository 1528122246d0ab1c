"""What records show by themselves: the force before contact, the rise, what each pull shows of the machine, running-in,
an offset of strokes.

Running-in is a difference of friction at the beginning of a slide from that of its second half. Strokes in both
directions show the offset of the force, which no friction makes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import erfc
from scipy.stats import t as t_distribution

from tribo.diagnostics.observations import Observations
from tribo.diagnostics.verdict import Estimate, Layer
from tribo.display import displayed
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import STROKES_APART, Quantity, TraceEvidence
from tribo.records import CLOSED_TRACK_M, MEDIAN_TO_SD, FloatArray, Ingested, Pull, Test, Trace

CERTAIN = 5.0  # standard errors
NOISE_SHARE = 0.5  # an offset below half the noise of one reading does not matter to any result
RISE_PER_FOLD = 0.02
MOST_IN_PAIRS = 1500  # values whose slope is the median over all pairs, which a million of them fill
LEAST_P = 1e-12  # no estimate has a tail that is known further out


@displayed()
@dataclass(frozen=True)
class Evidence:
    """An estimate with its standard error, and whether it is certain and large enough to matter.

    ``estimates`` is the number of estimates from which this one was chosen. ``tolerance`` is what an instrument within
    its tolerance may add to the value, half the width of a rectangular distribution (GUM 4.3.7).
    """

    value: float
    standard_error: float
    certain: bool
    unit: str
    change: float = 0.0  # over the whole series, N or relative
    estimates: int = 1
    tolerance: float = 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """Ninety percent."""
        half = 1.645 * float(np.hypot(self.standard_error, self.tolerance / np.sqrt(3.0)))
        return self.value - half, self.value + half

    def p_adjusted(self, estimates: int) -> float:
        """Two-sided p value of the estimate over its standard error (normal), Bonferroni over ``estimates``."""
        p = float(erfc(abs(self.value) / max(self.standard_error, 1e-300) / np.sqrt(2.0)))
        return min(max(estimates * p, LEAST_P), 1.0)


def direct_evidence(o: Observations) -> dict[str, Evidence]:
    """What the traces show of every mechanism that states an evidence in them, by name."""
    each = {
        name: of_each_pull(o, name) if stated.quantity == "each pull" else ESTIMATES[stated.quantity](o)
        for name, stated in stated_evidence().items()
    }
    return {name: e for name, e in each.items() if e is not None}


def stated_evidence() -> dict[str, TraceEvidence]:
    """The evidence that mechanisms state, by name."""
    return {name: m.evidence for name, m in MECHANISMS.items() if m.evidence is not None}


def certain_evidence(evidence: Mapping[str, Evidence]) -> dict[str, tuple[Evidence, float]]:
    """What is certain, without evidence that another one includes (a drift includes the offset that it leaves), each
    with its p value, adjusted for every estimate that was made."""
    made = sum(e.estimates for e in evidence.values())
    certain = {name: e for name, e in evidence.items() if e.certain}
    included = {other for name in certain for other in stated_evidence()[name].contains}
    return {name: (e, e.p_adjusted(made)) for name, e in certain.items() if name not in included}


def zero_offset(o: Observations) -> Evidence | None:
    """The typical force before contact, N; None where no trace shows it."""
    zero = o.zero_N[np.isfinite(o.zero_N)]
    if len(zero) < 3:
        return None
    centre, error = _centre(zero)
    return Evidence(centre, error, abs(centre) > CERTAIN * error and abs(centre) > _matters_N(o), "N", centre)


def zero_drift(o: Observations) -> Evidence | None:
    """Slope of the force before contact over the series, N/h; within the traces where the series has no clock."""
    elapsed_s = o.conditions.elapsed_s
    order = np.argsort(elapsed_s)
    gaps = np.diff(elapsed_s[order], prepend=elapsed_s[order[0]])
    at_bench = np.empty_like(elapsed_s)  # hours with no pause counted for more than five times the usual one
    at_bench[order] = np.cumsum(np.minimum(gaps, 5.0 * np.median(gaps))) / 3600.0
    across = [e for e in (_drift_along(o, hours) for hours in (elapsed_s / 3600.0, at_bench)) if e is not None]
    within = _drift_within(o)
    best = max(across, key=lambda e: abs(e.value) / e.standard_error, default=None)
    both = [e for e in (best, within) if e is not None]
    chosen = next((e for e in both if e.certain), both[0] if both else None)
    return chosen and replace(chosen, estimates=len(across) + (within is not None))


def _drift_along(o: Observations, hours: FloatArray) -> Evidence | None:
    """By the median slope of all pairs; of many tests, of the medians of MOST_IN_PAIRS stretches of the series."""
    from scipy.stats import theilslopes

    good = np.isfinite(o.zero_N) & np.isfinite(hours)
    if good.sum() < 10 or np.ptp(hours[good]) <= 0:
        return None
    values, at = o.zero_N[good], hours[good]
    if len(values) > MOST_IN_PAIRS:
        stretches = np.array_split(np.argsort(at, kind="stable"), MOST_IN_PAIRS)
        values, at = (np.array([np.median(x[s]) for s in stretches]) for x in (values, at))
    slope, _, low, high = theilslopes(values, at, 0.90)
    error = max((high - low) / 3.29, 1e-15)
    change = float(slope * np.ptp(hours[good]))
    certain = abs(slope) > CERTAIN * error and abs(change) > _matters_N(o)
    return Evidence(float(slope), float(error), bool(certain), "N/h", change)


def _drift_within(o: Observations) -> Evidence | None:
    slopes = o.zero_slope_N_per_s[np.isfinite(o.zero_slope_N_per_s)]
    if len(slopes) < 10:
        return None
    centre, error = _centre(slopes)
    change = centre * 20.0  # a pull lasts some twenty seconds
    certain = abs(centre) > CERTAIN * error and abs(change) > _matters_N(o)
    return Evidence(centre * 3600.0, error * 3600.0, bool(certain), "N/h", change)


def rise_stiffening(o: Observations) -> Evidence | None:
    """Relative stiffening of the rise per e-fold of speed; None at one speed."""
    speed = np.log(o.conditions.speed_m_s)
    good = np.isfinite(o.rise_N_per_m) & (o.rise_N_per_m > 0) & np.isfinite(speed)
    if good.sum() < 10 or np.ptp(speed[good]) < 0.1:
        return None
    x, y = speed[good] - speed[good].mean(), np.log(o.rise_N_per_m[good])
    slope = float(x @ (y - np.median(y)) / (x @ x))
    left = y - np.median(y) - slope * x
    error = float(MEDIAN_TO_SD * np.median(np.abs(left)) / np.sqrt(x @ x))
    certain = abs(slope) > CERTAIN * error and abs(slope) > RISE_PER_FOLD
    return Evidence(slope, error, bool(certain), "", slope * float(np.ptp(x)))


def of_each_pull(o: Observations, name: str) -> Evidence | None:
    """The typical amplitude of a mechanism by every pull; certain where it is also large enough, and possible."""
    stated, amplitude = stated_evidence()[name], MECHANISMS[name].amplitude
    if stated.of_each is None or stated.change is None or not set(stated.reads) <= set(o.marks):
        return None
    values = stated.of_each(o.marks)
    shown = np.isfinite(values)
    if shown.sum() < _FEWEST:
        return None
    centre, error = _centre(values[shown])
    changes = stated.change(o.marks, np.full(o.n, centre))[shown]
    change = float(np.median(changes[np.isfinite(changes)]))
    certain = abs(centre) > CERTAIN * error and abs(change) > stated.least and amplitude.low <= centre <= amplitude.high
    within = stated.least * abs(centre / change) if change else 0.0
    return Evidence(centre, error, bool(certain), amplitude.unit, change, tolerance=within)


def _centre(values: FloatArray) -> tuple[float, float]:
    """Median and its standard error."""
    centre = float(np.median(values))
    spread = MEDIAN_TO_SD * float(np.median(np.abs(values - centre)))
    return centre, max(1.2533 * spread / np.sqrt(len(values)), 1e-15)


def _matters_N(o: Observations) -> float:
    """Half the noise of one reading; where the noise is unknown, half a percent of a weak pull."""
    noise = o.noise_N[np.isfinite(o.noise_N)]
    if len(noise):
        return NOISE_SHARE * float(np.median(noise))
    return 0.005 * float(np.exp(np.quantile(o.log_force, 0.05)))


OF_ZERO = ("zero", "zero drift")
ESTIMATES: dict[Quantity, Callable[[Observations], Evidence | None]] = {
    "zero": zero_offset,
    "zero drift": zero_drift,
    "rise": rise_stiffening,
}


BLOCKS = 20  # of equal distance; the first is compared with those of the second half
_FEWEST_IN_BLOCK = 5
_FEWEST = 3  # pairs of strokes, or pulls
OFFSET = next(m.name for m in MECHANISMS.values() if STROKES_APART in m.without_model)


@dataclass(frozen=True)
class RunningIn:
    """One record: force of the first twentieth of the distance over the mean of the second half, less one, in percent.

    ``p`` is two-sided and adjusted over the records of the campaign (Holm). ``distance_m`` is that of the first block.
    """

    test_id: str
    sample: str
    first_percent: float
    p: float
    distance_m: float
    whole_m: float


def running_in(ingested: Ingested) -> tuple[RunningIn, ...]:
    """Every record that slides over more than ten metres."""
    found = []
    for test in ingested.campaign.tests:
        trace, pull = ingested.traces.get(test.test_id), ingested.pulls.get(test.test_id)
        if trace is not None and pull is not None and (one := _of_record(test, trace, pull)) is not None:
            found.append(one)
    order = sorted(range(len(found)), key=lambda k: found[k].p)
    adjusted, so_far = [0.0] * len(found), 0.0
    for rank, k in enumerate(order):
        so_far = max(so_far, min(found[k].p * (len(found) - rank), 1.0))
        adjusted[k] = so_far
    return tuple(
        RunningIn(f.test_id, f.sample, f.first_percent, p, f.distance_m, f.whole_m)
        for f, p in zip(found, adjusted, strict=True)
    )


def _of_record(test: Test, trace: Trace, pull: Pull) -> RunningIn | None:
    """The first block lies as far from the blocks of the second half as p says (Student's t); None for short slides."""
    travel = _travel(test, trace)
    if travel is None or not np.isfinite(pull.sliding_N):
        return None
    start = pull.peak_s if np.isfinite(pull.peak_s) else float(trace.time_s[0])
    inside = (trace.time_s > start) & (trace.time_s <= pull.window_s[1])
    if inside.sum() < BLOCKS * _FEWEST_IN_BLOCK:
        return None
    path, force = travel[inside] - travel[inside][0], trace.force_N[inside] - pull.zero_N
    if path[-1] < CLOSED_TRACK_M:
        return None
    block = np.minimum((path / path[-1] * BLOCKS).astype(int), BLOCKS - 1)
    counts = np.bincount(block, minlength=BLOCKS)
    means = np.bincount(block, force, minlength=BLOCKS) / np.maximum(counts, 1)
    late = means[BLOCKS // 2 :][counts[BLOCKS // 2 :] > 0]
    if not counts[0] or len(late) < BLOCKS // 4 or late.mean() <= 0:
        return None
    away = means[0] - late.mean()
    spread = float(np.std(late, ddof=1) * np.sqrt(1.0 + 1.0 / len(late)))
    p = float(2.0 * t_distribution.sf(abs(away) / max(spread, 1e-12), len(late) - 1))
    first = float(path[block == 0].max())
    return RunningIn(test.test_id, test.sample, float(100.0 * away / late.mean()), p, first, float(path[-1]))


def _travel(test: Test, trace: Trace) -> FloatArray | None:
    """Distance slid since the start of the record, m; from the speed where no displacement was recorded."""
    speed = trace.columns.get("speed_m_s")
    if speed is not None and np.isfinite(speed).all():
        steps = np.diff(trace.time_s, prepend=trace.time_s[:1])
        return np.asarray(np.cumsum(np.abs(speed) * steps))
    if test.speed_m_s:
        return np.asarray(test.speed_m_s * (trace.time_s - trace.time_s[0]))
    return None


def stroke_offset(ingested: Ingested) -> Layer | None:
    """The offset of the force over all pairs of strokes, half of what separates the two directions, in N and in percent
    of the mean sliding force; it shows how many strokes are forward and how many backward.

    None where it is not certain, without strokes in both directions, or with fewer than three pairs.
    """
    pulls = list(ingested.pulls.values())
    forward = [p for p in pulls if "forward" in p.flags]
    backward = [p for p in pulls if "backward" in p.flags]
    zeros = np.array([p.zero_N for p in forward if np.isfinite(p.zero_N)])
    if len(zeros) < _FEWEST or not backward:
        return None
    mean, se = float(zeros.mean()), max(float(zeros.std(ddof=1) / np.sqrt(len(zeros))), 1e-12)
    if np.ptp(zeros) <= 1e-9 * abs(mean):  # strokes of one record share their zero
        se = float(np.median([p.zero_u_N for p in forward]))
    if abs(mean) <= CERTAIN * se:
        return None
    half = float(t_distribution.ppf(0.95, len(zeros) - 1)) * se
    force = float(np.mean([p.sliding_N for p in (*forward, *backward)]))
    p = float(2.0 * t_distribution.sf(abs(mean) / se, len(zeros) - 1))
    low, high = mean - half, mean + half
    return Layer(
        kind="cause", name=OFFSET, samples=(), regimes=(), p_adjusted=p, effect_percent=100 * mean / force,
        low=100 * low / force, high=100 * high / force, parameters={"F0": Estimate(mean, low, high, "N")},
        shows=(len(forward), len(backward)),
    )  # fmt: skip
