"""What single records show without a model: running-in along a long slide, and an offset between strokes.

Running-in is a difference of friction at the beginning of a slide from that of its second half. Strokes in both
directions show the offset of the force, which no friction makes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as t_distribution

from tribo.diagnostics.verdict import Estimate, Layer
from tribo.mechanisms.record import STROKES_APART
from tribo.mechanisms.table import MECHANISMS
from tribo.records import CLOSED_TRACK_M, FloatArray, Ingested, Pull, Test, Trace

BLOCKS = 20  # of equal distance; the first is compared with those of the second half
_FEWEST_IN_BLOCK = 5
CERTAIN = 5.0  # standard errors, as for other evidence from traces
_FEWEST = 3  # pairs of strokes
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
