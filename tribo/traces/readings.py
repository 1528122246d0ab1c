"""What a record tells beyond one pull: plateaus, steps, cycles, running-in and holds, each with a 95 % interval.

Noise and drift of a level are told apart by its cosine coefficients, as in :func:`tribo.traces.signal.mean_of_level`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from tribo.records import CLOSED_TRACK_M, FloatArray, Interval, Phase, Pull, Reading, Test, Trace
from tribo.traces.signal import NORMAL_95, condense, line, mean_of_level, median_of_three, of_student, variance_of_slow
from tribo.traces.sliding import transient_end

_COSINES_OF_ALL = 20  # coefficients that tell the noise of a whole slide
_COSINES_OF_STEP = 8  # that of a change at once
_COSINES_OF_STROKE = 4  # the same of a stroke, whose neighbours tell of its noise as well
_FEWEST = 12  # samples from which on a mean has an interval
_MIDDLE = 0.4  # share of a stroke, around its middle, whose force is that of the stroke
_STROKES_DIFFER = 0.1  # probability by chance below which strokes of one way differ by more than their noise
_FEWEST_APART = 4  # differences between strokes of one way from which on they tell of the noise of a stroke
_DIFFER = 0.05  # share by which speeds or loads of two plateaus differ that make a step
_BLOCKS = 240  # means along a slide by which its running-in is told
_LATE = 0.2  # share of a slide at its end that is to be level
_STEADY = 0.01  # share of the force by which it changes at most over that part where it is steady
_STEADY_STRAIGHT = 0.006  # by which the straight part of this change is at most
_STEADY_ANYWAY = 0.001  # however clearly it changes
_SHORTEST_TAU = 0.01  # share of a slide that the time constant of a running-in takes at the least,
_LONGEST_TAU = 0.3  # share of a slide and of one that is over at the most
_ARRIVED = 0.1  # share of the whole change that is left where running-in counts as over
_SURE = 0.975  # probability on either side with which a drift is told
_FEWEST_HOLDS = 3
_RESOLVED = 5  # samples in which a change at once comes half-way down at the least, so that its size is told
_BELOW = 3.0  # times the scatter about it by which a sample of the rise lies below the course of the fall
_SETTLED_BY = 0.6  # share of a level after which it counts as steady at the latest where a step is read
_ABOVE_NOISE = 1.5  # times the largest departure of the later half by which a force goes beyond both levels at a step


@dataclass(frozen=True)
class Part:
    """A record, or a piece cut from one, as it was read."""

    test: Test
    trace: Trace
    pull: Pull

    @property
    def direction(self) -> int:
        """The way of a stroke that is a piece: 1, -1 where its force was turned; 0 for anything else."""
        return 1 if "forward" in self.pull.flags else -1 if "backward" in self.pull.flags else 0

    def between(self, start_s: float, end_s: float) -> slice:
        """The samples from one time to before another; up to the last one where that is the end of the trace."""
        first, last = (int(k) for k in np.searchsorted(self.trace.time_s, (start_s, end_s)))
        return slice(first, last + int(last == self.trace.time_s.size - 1))


@dataclass(frozen=True)
class _Level:
    """A slide at one speed under one load: the steady part, and where what came before it began."""

    part: Part
    phase: Phase
    begin_s: float
    mean: Interval  # above the zero of the pull, without the uncertainty of that zero
    late: Interval  # the same where nothing is left of a change, from which steps are counted

    @property
    def runs_in(self) -> bool:
        """Whether a clear running-in comes before the steady part."""
        return any(p.name == "running-in" and p.start_s == self.begin_s for p in self.part.pull.phases)

    @property
    def speed_m_s(self) -> float:
        return self.phase.speed_m_s if math.isfinite(self.phase.speed_m_s) else self.part.test.speed_m_s or math.nan

    @property
    def load_N(self) -> float:
        """That of the test; of several loads within one test, the one recorded at this level."""
        recorded = [p.normal_load_N for p in self.part.pull.phases if p.name == "steady sliding"]
        stated = self.part.test.normal_load_N
        several = any(_differ(a, b) for a, b in pairwise(recorded))
        return self.phase.normal_load_N if several or math.isnan(stated) else stated


def readings_of(parts: Sequence[Part], viscosity_Pa_s: float = math.nan) -> tuple[Reading, ...]:
    """The readings of one record, whose parts are in order of time; none where it is one pull from rest.

    Parameters
    ----------
    parts : sequence of Part
        The record as a whole, or the pieces that were cut from it.
    viscosity_Pa_s : float
        Of the lubricant in Pa s, for the Hersey number.
    """
    strokes = _strokes(parts)
    if len(strokes) > 1:
        return tuple(_cycles(strokes))
    levels = [level for part in parts for level in _levels(part)]
    found: list[Reading] = []
    if levels and _slides_long(levels[0]) and (len(levels) == 1 or levels[0].runs_in):
        found += _running_in(levels[0])
    if found or len(levels) > 1:
        ways = _ways(levels)
        found += [_plateau(level, way, viscosity_Pa_s) for level, way in zip(levels, ways, strict=True)]
        found += [step for one, other in pairwise(levels) for step in _step(one, other)]
    for part in parts:
        found += _holds(part)
    return tuple(sorted(found, key=lambda reading: reading.start_s))


def _half(interval: Interval) -> float:
    return (interval[2] - interval[1]) / 2.0


def _about(value: float, *halves: float) -> Interval:
    """A value with the half widths of independent intervals together."""
    half = math.hypot(*halves)
    return value, value - half, value + half


def _of_zero(part: Part) -> float:
    """Half width of the 95 % interval of a zero."""
    u = part.pull.zero_u_N
    return NORMAL_95 * u if math.isfinite(u) else 0.0


def _levels(part: Part) -> Iterator[_Level]:
    """Every slide of a part at one speed under one load, from when its force has stabilised."""
    before: Phase | None = None
    for phase in part.pull.phases:
        if phase.name == "steady sliding":
            samples = part.between(phase.start_s, phase.end_s)
            force = part.trace.force_N[samples] - part.pull.zero_N
            settled = transient_end(force)
            if force.size - settled >= _FEWEST:
                began = before.start_s if before and before.name in ("running-in", "slip") else phase.start_s
                level = replace(phase, start_s=float(part.trace.time_s[samples.start + settled]))
                late = min(2 * settled, max(settled, int(_SETTLED_BY * force.size)))
                yield _Level(part, level, began, mean_of_level(force[settled:]), mean_of_level(force[late:]))
        before = phase


def _ways(levels: Sequence[_Level]) -> list[str]:
    """Whether each level was reached on the way "up" or "down" in speed, else in load; empty where neither changes."""
    if len(levels) < 2:
        return [""] * len(levels)
    of_speed, of_load = [level.speed_m_s for level in levels], [level.load_N for level in levels]
    values = of_speed if any(_differ(a, b) for a, b in pairwise(of_speed)) else of_load
    rises = [other > one if _differ(one, other) else None for one, other in pairwise(values)]
    return [{True: "up", False: "down", None: ""}[rise] for rise in (rises[0], *rises)]


def _differ(one: float, other: float) -> bool:
    return abs(other - one) > _DIFFER * min(abs(one), abs(other))


def _plateau(level: _Level, way: str, viscosity_Pa_s: float) -> Reading:
    force = _about(level.mean[0], _half(level.mean), _of_zero(level.part))
    values: dict[str, Interval] = {"force_N": force}
    load, speed = level.load_N, level.speed_m_s
    if load > 0:
        u = level.part.pull.recorded_load_u_N
        of_load = NORMAL_95 * u / load if math.isfinite(u) and not level.part.test.load_from else 0.0
        ratio = force[0] / load
        values["coefficient"] = _about(ratio, _half(force) / load, ratio * of_load)
        hersey = viscosity_Pa_s * speed / load
        values |= {"hersey_per_m": (hersey, hersey, hersey)} if math.isfinite(hersey) else {}
    phase = level.phase
    return Reading(level.part.test.test_id, "plateau", phase.start_s, phase.end_s, speed, load, way=way, values=values)


def _step(one: _Level, other: _Level) -> Iterator[Reading]:
    """The change of force from one plateau to the next: at once, and to the new steady state."""
    of_speed = _differ(one.speed_m_s, other.speed_m_s)
    if not (of_speed or _differ(one.load_N, other.load_N)):
        return
    total = _about(other.late[0] - one.late[0], _half(one.late), _half(other.late))
    values = {"force_N": _about(other.late[0], _half(other.late), _of_zero(other.part)), "total_change_N": total}
    direct = _direct(one, other) if of_speed else None
    if direct is not None:
        values["direct_change_N"] = direct
    up = other.speed_m_s > one.speed_m_s if of_speed else other.load_N > one.load_N
    yield Reading(
        other.part.test.test_id, "step of speed" if of_speed else "step of load", one.phase.end_s, other.begin_s,
        other.speed_m_s, other.load_N, way="up" if up else "down", values=values,
    )  # fmt: skip


def _direct(one: _Level, other: _Level) -> Interval | None:
    """How far the force goes at once after a step of speed before it turns to its steady state; None if it does not.

    By an exponential through the force from its extreme on, over six times the time in which it comes half-way down.
    """
    samples = other.part.between(one.phase.end_s, other.phase.end_s)
    force = other.part.trace.force_N[samples] - other.part.pull.zero_N
    old, new = one.late[0], other.late[0]
    calm = median_of_three(force[: force.size // 2]) if force.size >= 4 * _FEWEST else force[:0]
    if not calm.size:
        return None
    beyond = max(old, new) - calm, calm - min(old, new)
    below = float(beyond[0].min()), float(beyond[1].min())
    upward = below[0] < below[1]
    height = (calm - new) if upward else (new - calm)
    at = max(int(np.argmax(height)) - 1, 0)
    at += int(np.argmax(force[at : at + 3] if upward else -force[at : at + 3]))  # the median is blind to an end
    late = median_of_three(force[force.size // 2 :])
    if -min(below) < _ABOVE_NOISE * float(np.abs(late - np.median(late)).max()) or height[at] <= 0:
        return None
    lower = np.flatnonzero(height[at:] < 0.5 * height[at])
    half = int(lower[0]) if lower.size else 0
    part = force[at : at + 6 * half]
    if half < _RESOLVED or part.size < 2 * _FEWEST:
        return None
    along, mean, fits = np.arange(part.size, dtype=float), float(part.mean()), []
    for tau in np.geomspace(0.3 * half, 6.0 * half, 60):
        decay = np.exp(-along / tau)
        centre, away = float(decay.mean()), decay - decay.mean()
        spread = float(away @ away)
        change = float(away @ part) / spread
        rest = part - mean - change * away
        squares = float(rest @ rest)
        # the extreme lies where the rise has met the course of the fall, after the last sample that is clearly below it
        before = mean + change * (np.exp((at - np.arange(at + 1.0)) / tau) - centre)
        below_it = (before - force[: at + 1]) if upward else (force[: at + 1] - before)
        clearly = np.flatnonzero(below_it[:at] > _BELOW * math.sqrt(squares / part.size))
        top = float(before[int(clearly[-1]) + 1 if clearly.size else 0])
        fits.append((squares, top, 1.0 / part.size + (1.0 - centre) ** 2 / spread, rest))
    squares, top, leverage, rest = min(fits, key=lambda fit: fit[0])
    variance = max(variance_of_slow(rest, 3, _COSINES_OF_STEP)[0], squares / (part.size - 3))
    near = [value for other, value, *_ in fits if other <= squares + 4.0 * variance]
    placed = squares / (part.size - 3)  # the noise of a sample says which one is the extreme
    u = math.sqrt(variance * leverage + ((max(near) - min(near)) / 4.0) ** 2 + placed)
    return _about(top - old, 2.2 * u, _half(one.late))


@dataclass(frozen=True)
class _Stroke:
    part: Part
    phase: Phase
    middle: Interval  # as recorded, signed
    speed_m_s: float


def _strokes(parts: Sequence[Part]) -> list[_Stroke]:
    """The strokes of a record: its pieces where it was cut at its reversals, else its phases."""
    from scipy.special import fdtrc

    found = []
    for part in parts:
        phases = [p for p in part.pull.phases if p.name == "stroke"]
        if part.direction:
            moved = [p for p in part.pull.phases if p.name in ("slip", "running-in", "steady sliding")]
            phases = [replace(moved[0], end_s=moved[-1].end_s)] if moved else []
        for phase in phases:
            margin = (1.0 - _MIDDLE) / 2.0 * (phase.end_s - phase.start_s)
            samples = part.between(phase.start_s + margin, phase.end_s - margin)
            force = part.trace.force_N[samples] * (part.direction or 1)
            if force.size >= _FEWEST:
                found.append((part, phase, force))
    if not found:
        return []
    noise = [variance_of_slow(_without_line(force), 2, _COSINES_OF_STROKE) for _, _, force in found]
    means = np.array([float(force.mean()) for _, _, force in found])
    squares = float(np.mean([share / force.size for (share, _), (_, _, force) in zip(noise, found, strict=True)]))
    dof = sum(cosines for _, cosines in noise)
    side = means > (means.max() + means.min()) / 2.0
    apart = np.concatenate([np.diff(means[side]), np.diff(means[~side])])
    if apart.size >= _FEWEST_APART:  # from stroke to stroke of one way
        between, count = float(apart @ apart) / apart.size / 2.0, int(apart.size)
        if squares == 0.0 or fdtrc(count, dof, between / squares) < _STROKES_DIFFER:
            squares, dof = between, count
        else:
            squares, dof = (dof * squares + count * between) / (dof + count), dof + count
    half = of_student(dof) * math.sqrt(squares)
    return [
        _Stroke(part, phase, _about(float(mean), half), phase.speed_m_s)
        for (part, phase, _), mean in zip(found, means, strict=True)
    ]


def _without_line(force: FloatArray) -> FloatArray:
    along = np.arange(force.size, dtype=float)
    slope, x0, y0 = line(along, force)
    return force - y0 - slope * (along - x0)


def _cycles(strokes: Sequence[_Stroke]) -> Iterator[Reading]:
    """Two strokes in opposite directions each: mean of both, asymmetry, energy."""
    number, k = 0, 0
    while k + 1 < len(strokes):
        one, other = strokes[k], strokes[k + 1]
        k += 1
        if (
            one.middle[0] * other.middle[0] >= 0
            and (one.middle[0] - one.part.pull.zero_N) * (other.middle[0] - other.part.pull.zero_N) > 0
        ):
            continue
        k, number = k + 1, number + 1
        half = _half(one.middle) / 2.0, _half(other.middle) / 2.0
        force = _about(abs(one.middle[0] - other.middle[0]) / 2.0, *half)
        from_strokes = one.part.pull.zero_rule == "strokes in both directions" or not one.part.direction
        zero = 0.0 if from_strokes else one.part.pull.zero_N * one.part.direction
        values = {"force_N": force, "asymmetry_N": _about((one.middle[0] + other.middle[0]) / 2.0 - zero, *half)}
        loads = [s.phase.normal_load_N for s in (one, other)]
        load = sum(loads) / 2.0 if math.isfinite(sum(loads)) else one.part.test.normal_load_N
        if load > 0:
            values["coefficient"] = tuple(v / load for v in force)  # type: ignore[assignment]
        energies = [_energy(stroke) for stroke in (one, other)]
        if all(energies):
            work, ways = (sum(pair) for pair in zip(*(e for e in energies if e), strict=True))
            values["energy_J"] = _about(work, _half(force) * ways)
        record = one.part.test.test_id.partition("#")[0]
        yield Reading(
            record, "cycle", one.phase.start_s, other.phase.end_s, one.speed_m_s, load, cycle=number, values=values
        )


def _energy(stroke: _Stroke) -> tuple[float, float] | None:
    """Work of a stroke in J and its length in m, by the displacement, else by the speed; None without either."""
    part, samples = stroke.part, stroke.part.between(stroke.phase.start_s, stroke.phase.end_s)
    force, x = part.trace.force_N[samples], part.trace.displacement_m
    if x is not None and np.ptp(x[samples]) > 0:
        steps = np.diff(x[samples])
    elif "speed_m_s" in part.trace.columns:
        speed = part.trace.columns["speed_m_s"][samples]
        steps = (speed[1:] + speed[:-1]) / 2.0 * np.diff(part.trace.time_s[samples])
    else:
        return None
    zero = part.pull.zero_N if part.direction else 0.0
    middle = (force[1:] + force[:-1]) / 2.0 - zero
    return abs(float(middle @ steps)), abs(float(steps.sum()))


def _slides_long(level: _Level) -> bool:
    """Whether a slide is one whose running-in is asked for: from the first sample, or over its own track."""
    way = level.speed_m_s * (level.phase.end_s - level.begin_s)
    return "no_static" in level.part.pull.flags or way > CLOSED_TRACK_M


def _running_in(level: _Level) -> Iterator[Reading]:
    """Time and distance to the steady level of a slide by an exponential, or that it still drifts.

    It counts as steady where the change over its last fifth is shown to be small and none is seen, or a very small one,
    and the exponential leaves as little. Where noise is too large to show it, ``state`` is "cannot tell".
    """
    part = level.part
    samples = part.between(level.begin_s, level.phase.end_s)
    size = max(1, (samples.stop - samples.start) // _BLOCKS)
    time = condense(part.trace.time_s[samples], size)
    force = condense(part.trace.force_N[samples] - part.pull.zero_N, size)
    if time.size < 4 * _FEWEST:
        return
    state = _state(time, force)
    fitted = _exponential(time - level.begin_s, force)
    values: dict[str, Interval] = {}
    if fitted is not None:
        steady, took_s, left = fitted
        if state == "steady" and left > _STEADY * abs(steady[0]):
            state = "cannot tell"
        if state == "steady":
            values = {"force_N": _about(steady[0], _half(steady), _of_zero(part)), "run_in_s": took_s}
            if math.isfinite(level.speed_m_s):
                values["run_in_m"] = tuple(level.speed_m_s * t for t in took_s)  # type: ignore[assignment]
    elif state == "steady":
        values = {"force_N": _about(level.mean[0], _half(level.mean), _of_zero(part)), "run_in_s": (0.0, 0.0, 0.0)}
    yield Reading(
        part.test.test_id, "running-in", level.begin_s, level.phase.end_s, level.speed_m_s, level.load_N, state=state,
        values=values,
    )  # fmt: skip


def _state(time_s: FloatArray, force: FloatArray) -> Literal["steady", "still drifts", "cannot tell"]:
    """What a slide says of its drift: the change over its last fifth by an exponential and a straight line together.

    Every time constant that fits about as well as the best one has its say. A straight line that stands out is drift,
    however little it changes the force.
    """
    from scipy.stats import t

    n = time_s.size
    along = (time_s - time_s[0]) / float(time_s[-1] - time_s[0])
    late = 1.0 - _LATE
    found = []
    for tau in np.geomspace(_SHORTEST_TAU, _LONGEST_TAU, 200):
        design = np.column_stack((np.ones(n), along, np.exp(-along / tau)))
        inverse = np.linalg.pinv(design.T @ design)
        best = inverse @ (design.T @ force)
        over = np.array((0.0, _LATE, math.exp(-1.0 / tau) - math.exp(-late / tau)))
        straight = np.array((0.0, _LATE, 0.0))
        rest = force - design @ best
        changes = [(abs(float(w @ best)), float(w @ inverse @ w)) for w in (over, straight)]
        found.append((float(rest @ rest), changes, rest))
    squares, _, rest = min(found, key=lambda one: one[0])
    variance, dof = variance_of_slow(rest, 3, _COSINES_OF_ALL)
    variance = max(variance, squares / n)
    near = [changes for other, changes, _ in found if other <= squares + 4.0 * variance]
    level = abs(float(force[int(late * n) :].mean()))
    factor = float(t.ppf(_SURE, dof)) * math.sqrt(variance)
    most, straight_most = (max(changes[k][0] + factor * math.sqrt(changes[k][1]) for changes in near) for k in (0, 1))
    drifts, straight_drifts = (
        min(changes[k][0] - factor * math.sqrt(changes[k][1]) for changes in near) > 0 for k in (0, 1)
    )
    small = most < _STEADY * level and straight_most < _STEADY_STRAIGHT * level
    if (small and not straight_drifts) or max(most, straight_most) < _STEADY_ANYWAY * level:
        return "steady"
    return "still drifts" if drifts else "cannot tell"


def _exponential(time_s: FloatArray, force: FloatArray) -> tuple[Interval, Interval, float] | None:
    """Steady level, time until a tenth of the change is left, and the largest change left at the end; None without one.

    Least squares over the level, the change and its time constant; the noise is that of the residuals, correlation
    counted, and the interval of the time that of the profile.
    """
    from scipy.stats import f as f_distribution

    n, end = time_s.size, float(time_s[-1])
    low, high = max(float(time_s[1] - time_s[0]), end / n) / 2.0, 10.0 * end
    for _ in range(3):  # each time over the range that fits
        taus = np.geomspace(low, high, 160)
        decay = np.exp(-time_s[None, :] / taus[:, None])
        centred = decay - decay.mean(axis=1, keepdims=True)
        change = centred @ (force - force.mean()) / np.maximum((centred**2).sum(axis=1), 1e-300)
        level = force.mean() - change * decay.mean(axis=1)
        squares = ((force - level[:, None] - change[:, None] * decay) ** 2).sum(axis=1)
        best = int(np.argmin(squares))
        rest = force - level[best] - change[best] * decay[best]
        along = time_s / taus[best]
        design = np.column_stack((np.ones(n), decay[best], along * decay[best]))
        variance, dof = variance_of_slow(rest, 3, _COSINES_OF_ALL, design)
        uneven = _unevenness(design, rest)
        bound = variance * uneven * float(f_distribution.ppf(0.95, 1, dof))
        near = np.flatnonzero(squares <= squares[best] + bound)
        low, high = float(taus[max(near[0] - 1, 0)]), float(taus[min(near[-1] + 1, taus.size - 1)])
    if float(((force - force.mean()) ** 2).sum() - squares[best]) < 3.0 * bound:
        return None
    took = -math.log(_ARRIVED)
    left = max(abs(change[k]) * math.exp(-end / taus[k]) for k in near)
    u = math.sqrt(variance / n) * of_student(dof)
    steady = float(level[best]), float(level[near].min()) - u, float(level[near].max()) + u
    return steady, (took * float(taus[best]), took * float(taus[near[0]]), took * float(taus[near[-1]])), float(left)


def _unevenness(design: FloatArray, rest: FloatArray) -> float:
    """How much more the noise weighs on a time constant than even noise of its size: it is larger where the force is.

    The ratio of the variances of the last parameter of ``design`` (n, parameters) by the residuals where they are, each
    as if its sample had not been fitted (MacKinnon and White 1985, J. Econometrics 29, 305), and by their mean square;
    one at the least.
    """
    weights = np.linalg.pinv(design)
    free = rest / (1.0 - np.einsum("ij,ji->i", design, weights))
    return max(float(weights[2] ** 2 @ free**2) / float(weights[2] @ weights[2]) / float(rest @ rest) * rest.size, 1.0)


def _holds(part: Part) -> list[Reading]:
    """One reading a restart, and one of the healing of all: the static force over that of sliding, by log10 of hold."""
    pull = part.pull
    found, gained = [], []
    for restart in pull.restarts:
        force = _about(restart.static_N, NORMAL_95 * restart.static_u_N)
        load = part.test.normal_load_N
        values: dict[str, Interval] = {"force_N": force}
        if load > 0:
            values["coefficient"] = tuple(v / load for v in force)  # type: ignore[assignment]
        about = {"normal_load_N": load, "hold_s": restart.hold_s, "values": values}
        found.append(Reading(part.test.test_id, "hold", restart.stop_s, restart.peak_s, **about))  # type: ignore[arg-type]
        if math.isfinite(restart.static_N + pull.sliding_N) and restart.hold_s > 0:
            gained.append((math.log10(restart.hold_s), restart.static_N - pull.sliding_N))
    log_s, gain_N = np.array(gained).reshape(-1, 2).T
    if log_s.size >= _FEWEST_HOLDS and np.ptp(log_s) > math.log10(2.0):
        # by the scatter about the line: most of what each static force leaves open is common to all of them
        slope, x0, y0 = line(log_s, gain_N)
        rest, away = gain_N - y0 - slope * (log_s - x0), log_s - x0
        half = of_student(log_s.size - 2) * math.sqrt(float(rest @ rest) / (log_s.size - 2) / float(away @ away))
        healing = {"healing_N_per_decade": _about(slope, half)}
        about = {"normal_load_N": part.test.normal_load_N, "values": healing}
        found.append(Reading(part.test.test_id, "healing", found[0].start_s, found[-1].end_s, **about))  # type: ignore[arg-type]
    return found
