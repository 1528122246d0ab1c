"""What follows from the columns of a table and from what was stated, and damage that shows in their numbers.

The one place where a recorded force is changed: force from a torque, sign and gain. Everything after it sees the
corrected one. Damage is a time that decreases or has gaps, and values off by a factor of ten.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tribo.errors import Problem, ReadError
from tribo.input_files import LARGEST_NUMBER, SMALLEST_NUMBER
from tribo.readers.columns import FORCES_OF_NO_KIND, Column, force_follows
from tribo.records import Correction, FloatArray
from tribo.units import plain_name

NO_TIME = "no_time"
_PATH_FOR_TIME_M_S = 1e-3  # 1 mm of path counts as 1 s where neither time nor speed is known
_STROKES = {"stroke", "hub", "course", "corsa", "curso", "amplitude", "行程", "ストローク", "ход"}
STROKE = "it is the stroke of an oscillation, no displacement"
_SAYS_FREQUENCY = re.compile(r"\bfreq|frequenz|frecuencia|czestotliwosc|频率|周波数|частота")
_SHORTEST_TURN_M = 5e-4  # the track of a pin on a disc is longer
_SHARE_OF_PATH = 0.01  # of speed times time
GAP_STEPS = 5.0  # a time step this many median steps long is a gap
_WORTH_A_LOOK = 1.5  # mean steps: where no step is this long, none is a gap
_TEN_TIMES = (9.0, 11.0)  # a decimal mark slipped by one place, noise allowed for
_LEAST_SHARE = 0.3  # of the range: smaller jumps are noise or stick-slip
_MOST_STEPS = 40  # large steps, above which they are what the signal does
_MOST_TRIED = 10  # large steps that may begin a scaled rest of the record
_FEWEST_ROWS, _ROWS_BESIDE = 10, 100  # looked at on either side of a jump
_LEVEL_ROWS = (1, 10, 100)  # rows beside a jump by which the levels are compared; all are tried, as the force may swing
_SURE = 3.0  # standard uncertainties
_SAME_RATIO = 0.02  # share: numbers of two digits are rounded by up to 1 %
_TIMES_IN_WORDS = {1: "ten", 2: "a hundred", 3: "a thousand"}

Arrays = dict[str, FloatArray]  # by quantity, SI units
RowOf = Callable[[int], int]  # line of the file of a sample


def complete(
    arrays: Arrays, columns: Sequence[Column], correction: Correction, file: str
) -> tuple[Arrays, tuple[Column, ...], list[Problem]]:
    """Arrays that hold time and friction force, the columns they came from, and a doubt where time is missing.

    Raises
    ------
    ReadError
        no_radius, load_is_friction or force_may_be_load.
    """
    columns, doubts = list(columns), []
    arrays, columns = _forces(arrays, columns, correction, file)
    lever = correction.lever_arm_m
    if "rotation speed" in arrays and "speed" not in arrays and (lever is not None or "radius" in arrays):
        turns = next(c for c in columns if c.quantity == "rotation speed")
        arm = "the recorded radius" if lever is None else f"the lever arm of {lever * 1e3:g} mm, as given"
        radius = arrays["radius"] if lever is None else lever
        arrays = {**arrays, "speed": 2.0 * np.pi * radius * arrays["rotation speed"]}
        columns.append(Column("speed", -1, turns.label, 1.0, 0.0, f"rotation speed times 2 pi times {arm}"))
    factor = correction.sign * correction.gain
    if factor != 1.0:
        said = [f"gain {correction.gain:g}"] if correction.gain != 1.0 else []
        said += ["sign reversed"] if correction.sign < 0 else []
        arrays = {**arrays, "friction force": arrays["friction force"] * factor}
        given = f"; {', '.join(said)}, as given"
        columns = [replace(c, reason=c.reason + given) if c.quantity == "friction force" else c for c in columns]
    if "time" not in arrays:
        time, label, reason = _time(arrays, correction)
        arrays = {**arrays, "time": time}
        columns.append(Column("time", -1, label, 1.0, 0.0, reason))
        if correction.sampling_rate_Hz is None and correction.speed_m_s is None:
            what = (
                "neither time nor speed is known: the path stands for the time, 1 mm for 1 s; forces and their "
                "dependence on the path hold, while durations, rates, periods and drift per second are not determined"
            )
            doubts.append(Problem(NO_TIME, what, file, allowed="speed_mm_s, sampling_rate_Hz, or a column of the time"))
    return arrays, tuple(columns), doubts


def _forces(arrays: Arrays, columns: list[Column], stated: Correction, file: str) -> tuple[Arrays, list[Column]]:
    """Arrays and columns with the friction force, and the normal force where it follows from others.

    Raises
    ------
    ReadError
        load_is_friction: the load follows the friction coefficient, so that it may be the friction force.
        force_may_be_load: the force does not follow it, so that it may be the normal load.
    """
    label = {c.quantity: c.label for c in columns}
    arrays = dict(arrays)

    def add(quantity: str, values: FloatArray, of: str, reason: str) -> None:
        arrays[quantity] = values
        columns.append(Column(quantity, -1, label[of], 1.0, 0.0, reason))

    if "normal stress" in arrays and "normal force" not in arrays and stated.area_m2 is not None:
        reason = f"normal stress times the nominal area of {stated.area_m2 * 1e6:g} mm2"
        add("normal force", arrays["normal stress"] * stated.area_m2, "normal stress", reason)
    mu, load = arrays.get("friction coefficient"), arrays.get("normal force")
    if "friction force" in arrays:
        if mu is not None and load is None:
            _refuse_a_force_that_may_be_the_load(arrays["friction force"], mu, columns, file)
        if mu is not None and load is None and (constant := _constant_ratio(arrays["friction force"], mu)):
            reason = "friction force over friction coefficient, the same in all rows"
            add("normal force", np.full(mu.size, constant), "friction coefficient", reason)
        return arrays, columns
    how = force_follows(arrays, stated)
    if how == "torque over lever arm":
        reason = f"torque over the lever arm of {(stated.lever_arm_m or 0.0) * 1e3:g} mm, as given"
        add("friction force", arrays["torque"] / (stated.lever_arm_m or 1.0), "torque", reason)
    elif how == "shear stress times area":
        reason = f"shear stress times the nominal area of {(stated.area_m2 or 0.0) * 1e6:g} mm2"
        add("friction force", arrays["shear stress"] * float(stated.area_m2 or 0.0), "shear stress", reason)
    elif how == "torque over recorded radius":
        if not np.all(arrays["radius"] > 0):
            what, allowed = "a torque needs a radius above zero in every row", "lever_arm_mm = 2.5, or radius = none"
            raise ReadError(Problem("no_radius", what, file, None, label["radius"], allowed=allowed))
        add("friction force", arrays["torque"] / arrays["radius"], "torque", "torque over the recorded radius")
    elif mu is not None and load is not None:
        by_name = any(c.quantity == "normal force" and c.reason.startswith("named") for c in columns)
        if by_name and _constant_ratio(load, mu, float(np.ptp(load) / np.abs(load).max()) / 10.0):
            what = "the load is the friction coefficient times a constant, so it may be the friction force"
            name = label["normal force"]
            allowed = f'friction_force = "{name}" in columns; or normal_force = "{name}" if it is the normal load'
            raise ReadError(Problem("load_is_friction", what, file, None, name, allowed=allowed))
        reason = f"friction coefficient times {label.get('normal force', label.get('normal stress', ''))}"
        add("friction force", mu * np.abs(load), "friction coefficient", reason)
    elif mu is not None:
        reason = f"friction coefficient times the load of {stated.load_N:g} N, as given"
        add("friction force", mu * float(stated.load_N or 0.0), "friction coefficient", reason)
    return arrays, columns


def _refuse_a_force_that_may_be_the_load(
    force: FloatArray, mu: FloatArray, columns: Sequence[Column], file: str
) -> None:
    """A force of no particular name beside a friction coefficient is friction only where it varies with it.

    Raises
    ------
    ReadError
        force_may_be_load.
    """
    column = next(c for c in columns if c.quantity == "friction force")
    if not column.reason.startswith("named") or plain_name(column.label) not in FORCES_OF_NO_KIND:
        return
    large = np.abs(mu) > 0.3 * np.abs(mu).max()
    if large.sum() < _FEWEST_ROWS or not np.all(force[large]):
        return
    log_force = np.log(np.abs(force[large]))
    if np.std(log_force - np.log(np.abs(mu[large]))) > 0.5 * np.std(log_force):
        what = "a force that does not follow the friction coefficient beside it, so it may be the normal load"
        name = column.label
        allowed = f'normal_force = "{name}" in columns; or friction_force = "{name}" if it is the friction'
        raise ReadError(Problem("force_may_be_load", what, file, None, name, allowed=allowed))


def _constant_ratio(over: FloatArray, under: FloatArray, spread: float = _SAME_RATIO) -> float | None:
    """The ratio of two columns where it is one number in nearly all rows, within a share; None where it varies."""
    large = np.abs(under) > 0.3 * np.abs(under).max()
    if large.sum() < _FEWEST_ROWS or not np.ptp(under):
        return None
    ratio = np.abs(over[large] / under[large])
    low, middle, high = np.quantile(ratio, (0.05, 0.5, 0.95))
    return float(middle) if high - low < min(spread, _SAME_RATIO) * middle else None


def _time(arrays: Arrays, correction: Correction) -> tuple[FloatArray, str, str]:
    """The time of each sample from the sampling rate or the path, what it stands on, and why."""
    if correction.sampling_rate_Hz is not None:
        n = arrays["friction force"].size
        reason = f"row number over the sampling rate of {correction.sampling_rate_Hz:g} Hz, as given"
        return np.arange(n) / correction.sampling_rate_Hz, "sampling rate", reason
    path = np.abs(np.diff(arrays["displacement"], prepend=arrays["displacement"][:1])).cumsum()
    speed = correction.speed_m_s or _PATH_FOR_TIME_M_S
    reason = f"path over the speed of {speed * 1e3:g} mm/s" + (", as given" if correction.speed_m_s else "")
    return path / speed, "path", reason


def beyond_measurement(
    arrays: Mapping[str, FloatArray], file: str, labels: Mapping[str, str], row_of: RowOf
) -> list[Problem]:
    """Columns (SI units) with numbers that no instrument gives: too large for any, or a force or time too small."""
    problems = []
    for quantity, values in arrays.items():
        largest = float(max(values.max(), -values.min())) if values.size else 0.0
        column = labels.get(quantity, quantity)
        if largest > LARGEST_NUMBER:
            k = int(np.argmax(np.abs(values) > LARGEST_NUMBER))
            place = (file, row_of(k), column, f"{values[k]:.6g}", f"at most {LARGEST_NUMBER:g} in SI units")
            problems.append(Problem("impossible_number", "not a possible value", *place))
        elif quantity in ("time", "friction force") and 0 < largest < SMALLEST_NUMBER:
            found, allowed = f"at most {largest:.3g}", f"values of at least {SMALLEST_NUMBER:g} in SI units"
            what = "no value of this column is large enough to have been measured"
            problems.append(Problem("impossible_number", what, file, None, column, found, allowed))
    return problems


def why_no_path(arrays: Mapping[str, FloatArray], columns: Sequence[Column], names: Sequence[str]) -> str:
    """Why a column that is named as a displacement is none; "" where it may be one, or was asked for.

    Machines that oscillate write their stroke, its amplitude, beside the frequency; discs that turn write the wear of
    a pin as a displacement, which is shorter than any track of so many turns.
    """
    it = next((c for c in columns if c.quantity == "displacement"), None)
    time_follows = any(c.quantity == "time" and c.index < 0 for c in columns)  # from the path itself
    if it is None or not it.reason.startswith("named") or time_follows:
        return ""
    path, time = arrays["displacement"], arrays["time"]
    oscillates = "frequency" in arrays or any(map(_SAYS_FREQUENCY.search, map(plain_name, names)))
    if oscillates and plain_name(it.label) in _STROKES and np.quantile(np.abs(path), 0.1) > 0.5 * np.abs(path).max():
        return STROKE
    moved, steps = float(np.abs(np.diff(path)).sum()), np.abs(np.diff(time))
    for quantity, least_m in (("rotation speed", _SHORTEST_TURN_M), ("speed", _SHARE_OF_PATH)):
        if quantity in arrays and moved < least_m * float((np.abs(arrays[quantity][1:]) * steps).sum()):
            return f"it is far shorter than the path by the {quantity}, so it is no displacement along it"
    return ""


def spread_over_ticks(time: FloatArray, file: str, column: str, row_of: RowOf) -> tuple[FloatArray, list[Problem]]:
    """The time (s) of each row where the clock ticks slower than rows come: the rows of a tick evenly over it.

    A time base of which less than half the rows repeat the time of the row before is left as it is, to the bit. Returns
    the time and, where it was changed, a doubt that says so.
    """
    step = np.diff(time)
    if step.size < 2 or step.min() < 0 or np.median(step) > 0 or not step.any():
        return time, []
    first = np.concatenate([[0], np.flatnonzero(step > 0) + 1])
    ticks, rows = time[first], np.diff([*first, time.size])
    last = ticks[-1] + float(np.median(np.diff(ticks))) * rows[-1] / np.median(rows)
    spread = np.interp(np.arange(time.size), [*first, time.size], [*ticks, last])
    what = "most rows repeat the time of the row before: the rows of each time were spread evenly up to the next one"
    found = f"{rows.max()} rows at {ticks[np.argmax(rows)]:.6g} s"
    return spread, [Problem("coarse_clock", what, file, row_of(int(first[0]) + 1), column, found, "a finer clock")]


def check_time(time: FloatArray, file: str, column: str, row_of: RowOf) -> list[Problem]:
    """Faults of a time base: decreasing, repeated or missing times. ``row_of(k)`` is the line of sample k."""
    if time.size < 2:
        return []
    step = np.diff(time)
    least, largest = float(step.min()), float(step.max())
    found = []
    if least < 0:
        k = int(np.argmax(step < 0)) + 1
        what = f"the time decreases from {time[k - 1]:.6g} s"
        place = (file, row_of(k), column, f"{time[k]:.6g} s", "a time that never decreases")
        found.append(Problem("time_goes_back", what, *place))
    elif least == 0:
        k = int(np.argmax(step == 0)) + 1
        what = f"{int((step == 0).sum())} times occur twice; this is the first"
        found.append(Problem("time_repeats", what, file, row_of(k), column))
    if largest > _WORTH_A_LOOK * float(time[-1] - time[0]) / step.size:
        median = float(np.median(step))
        if median > 0 and largest > GAP_STEPS * median:
            k = int(np.argmax(step)) + 1
            what = f"{int((step > GAP_STEPS * median).sum())} gaps in time; the longest ends here"
            place = (file, row_of(k), column, f"{largest:.4g} s", f"steps of about {median:.4g} s")
            found.append(Problem("time_gap", what, *place))
    return found


def check_scale(values: FloatArray, file: str, column: str, row_of: RowOf) -> list[Problem]:
    """Rows ten times larger or smaller than what is beside them: a slipped decimal mark, or another unit.

    Two rows or more between neighbours that agree; or all rows from one to the end (ten, a hundred or a thousand
    times), if what changes from row to row is off by as much as the values are: a force that falls does not do that.
    """
    if values.size < 4:
        return []
    step = np.diff(values)
    least = _LEAST_SHARE * float(values.max() - values.min())
    if step.max() <= least and step.min() >= -least:
        return []
    large = np.flatnonzero(np.abs(step) > least)
    found = _there_and_back(values, large) if large.size <= _MOST_STEPS else None
    found = found or _to_the_end(values, step, large[:_MOST_TRIED])
    if found is None:
        return []
    first, n, times = found
    beside = "the rows before" if first + n == values.size else "their neighbours"
    way = "above" if times > 1 else "below"
    what = f"{n} rows {_TIMES_IN_WORDS[round(abs(math.log10(times)))]} times {way} {beside}; this is the first"
    place = (file, row_of(first), column, f"{values[first]:.6g}", f"about {values[first - 1]:.6g}")
    return [Problem("scale_jump", what, *place)]


def _there_and_back(values: FloatArray, large: NDArray[np.int64]) -> tuple[int, int, float] | None:
    """(first row, rows, factor) of a stretch ten times off, between two of the large steps, or None."""
    if large.size < 2:
        return None
    before, after = values[large], values[large + 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = after / before
    up = (ratio > _TEN_TIMES[0]) & (ratio < _TEN_TIMES[1])
    down = (ratio > 1 / _TEN_TIMES[1]) & (ratio < 1 / _TEN_TIMES[0])
    for i in range(large.size - 1):
        first, n = int(large[i]) + 1, int(large[i + 1] - large[i])
        there_and_back = (up[i] and down[i + 1]) or (down[i] and up[i + 1])
        if n > 1 and there_and_back and not (_is_impulse(values, large[i]) or _is_impulse(values, large[i + 1] + 1)):
            times = 10.0 if up[i] else 0.1
            if not _only_alike(values[:first], values[first : first + n], times):
                return first, n, times
    return None


def _is_impulse(values: FloatArray, k: int) -> bool:
    """Whether the values on both sides of one are alike, and it is not: then it is no level to compare with."""
    beside = values[[max(k - 1, 0), min(k + 1, values.size - 1)]]
    return bool(np.ptp(beside) < 0.5 * np.abs(values[k] - beside).min())


def _to_the_end(values: FloatArray, step: FloatArray, large: NDArray[np.int64]) -> tuple[int, int, float] | None:
    """(first row, rows, factor) of rows off by a power of ten from one on, or None."""
    passing = set((large + 1).tolist())  # a row between two large steps is on its way, as in a reversal: no level
    for k in (int(at) for at in large):
        if min(k, step.size - k - 1) < _FEWEST_ROWS or k in passing:
            continue
        change = _typical(np.abs(step[max(k - _ROWS_BESIDE, 0) : k])), _typical(np.abs(step[k + 1 :][:_ROWS_BESIDE]))
        for rows in _LEVEL_ROWS:
            before, after = _typical(values[max(k + 1 - rows, 0) : k + 1]), _typical(values[k + 1 :][:rows])
            ratio = after / before if before else 0.0
            power = round(math.log10(ratio)) if 0.0 < ratio < math.inf else 0
            near = 1 <= abs(power) <= 3 and _TEN_TIMES[0] / 10 < ratio / 10.0**power < _TEN_TIMES[1] / 10
            if (
                near
                and _scaled_as(10.0**power, *change)
                and not _only_alike(values[: k + 1], values[k + 1 :], 10.0**power)
            ):
                return k + 1, values.size - k - 1, 10.0**power
    return None


def _only_alike(before: FloatArray, after: FloatArray, times: float) -> bool:
    """Whether what follows a steady level is no scaled copy of it, as a slide after a rest or a rest after a slide.

    A slipped mark multiplies level and noise by the same power of ten, to within what so many rows tell; rows that
    were divided are written with too few digits to tell of their noise.
    """
    before, after = before[-_ROWS_BESIDE:], after[:_ROWS_BESIDE]
    if min(before.size, after.size) < _FEWEST_ROWS:
        return False
    level, level_u, trend = _level(before)
    if abs(trend) > 2.0 * _SURE * min(level_u, _typical(np.abs(np.diff(before)))):
        return False  # it was rising: no level to compare with
    other, other_u, _ = _level(after)
    if abs(other - times * level) > _SURE * math.hypot(other_u, times * level_u) + _SAME_RATIO * abs(other):
        return True
    if times < 1:
        return False
    changes = [_typical(np.abs(np.diff(part))) for part in (before, after)]
    rows = min(before.size, after.size)
    return bool(min(changes) > 0 and abs(math.log(changes[1] / changes[0] / times)) > _SURE * math.sqrt(4.0 / rows))


def _level(values: FloatArray) -> tuple[float, float, float]:
    """Mean, its standard uncertainty by means of tenths, and how far the mean of the later half is from the earlier."""
    means = np.array([part.mean() for part in np.array_split(values, min(_ROWS_BESIDE // 10, values.size))])
    u = float(means.std(ddof=1)) / math.sqrt(means.size)
    half = values.size // 2
    return float(values.mean()), u, float(values[half:].mean() - values[:half].mean())


def _typical(values: FloatArray) -> float:
    return float(np.median(values))


def _scaled_as(times: float, before: float, after: float) -> bool:
    """Whether changes from row to row scaled rather as the values did than not at all; shrinking may leave nothing."""
    if not before:
        return False
    if not after:
        return times < 1
    scaled = after / before / times
    return 0.0 < scaled < math.inf and abs(math.log10(scaled)) < abs(math.log10(times)) / 2
