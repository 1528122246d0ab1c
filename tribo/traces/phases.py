"""The phases of a record, by its channels and its force.

:func:`course_of` tells when the bodies touch, when the drive moves, stops and goes on; :func:`phases_of` names every
part of the record.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tribo.errors import TraceError
from tribo.records import FloatArray, Phase, Trace
from tribo.traces.cuts import reversals
from tribo.traces.drive import (
    FEWEST_AT_REST,
    DriveMotion,
    Range,
    began_by,
    drive_of,
    drive_stops,
    level_cuts,
    level_of,
    levels_of,
    load_as_set,
    quiet_end,
    relaxes_from,
    speed_cuts,
    standstills,
    stroke_end,
)
from tribo.traces.loading import loading_of, starting_level
from tribo.traces.signal import (
    MINIMUM_SAMPLES,
    Signal,
    correlated_noise,
    line,
    median_of_three,
    noise_of,
    running_mean,
    runs_of,
    sample_noise,
    signal_of,
    turning_points,
    wander,
)
from tribo.traces.sliding import transient_end

_FLAT_START = 0.02  # share of a record that shows the load before contact, if there is such a part
_LEVEL = 0.1  # share of the swing of a load within which it counts as level, and above which the bodies touch
_UNLOADED = 0.2  # an unloaded level lies below this share of the load later on
TURNING = ("pin_on_disc", "ball_on_disc", "rotary")  # contacts that slide on and on, whose records seldom begin at rest
_FALLEN = 0.5  # share of the sliding force below which a force has fallen, where nothing but the force tells of a stop
_AT_BOTTOM = 0.35  # share of the depth of a fall near its lowest force, in which a stop spends most of its time
_SHORTEST_STOP = 0.005  # share of a record that a stop lasts at least, where nothing but the force tells of it
_MOST_STOPS = 50
_AS_STEEP = 0.4  # a restart is at least this share as steep as the first rise
_SLOW_FALL = 3.0  # a force relaxes while the drive stands still for at least this many times the time of the next rise
_DWELLS = 0.05  # share of the samples of a fall that lie at a level at which the force dwells
_RESTART = 0.05  # share of the force by which it rises at a restart
_TELLING = 200  # samples of a stop that tell when it began
_SWINGS = 8.0  # times noise that is correlated over which it does not swing by itself
_RETURNS = 0.02  # share of the later part of a record that lies below the force it begins with if it began in motion
_UNPULLED = 0.3  # share of the usual force below which a record begins with nothing pulled
_PULLED = 0.5  # the same where nothing tells of the drive
_QUARTER, _THREE_QUARTERS = 0.25, 0.75  # share of its climb
_ALIKE = 0.5  # correlation of neighbours above which noise is that of a contact,
_FEWEST_ALIKE = 200  # samples from which on chance does not give it,
_AS_ROUGH = 0.5  # and share of the noise of the later force, over that force, from which on a level slides
_CLIMBS = 4.0  # times its noise by which a force climbs that begins at rest
_NEAR = 0.1  # share of its swing below the lowest later force from which on a record begins at rest
_FELT = 12.0  # a friction force is at least this many times the noise
_NONE = 0.01  # share of the swing of a load up to which there is none
_LOADED = 0.99  # share of its level that a load has reached, or less by its noise
_AT_BEGINNING = 0.1  # share of a record up to which sliding that is stated begins with the record
BY_HAND = "stated by hand"
_OF_DRIVE = ("hold", "end of the drive", "stroke", "reversal")  # phases that a channel of the drive tells of
_GAP = 10.0  # usual steps of the time between two samples from which on rows are missing
_LATE = 0.01  # share of a stroke by which the force may tell late that its drive has stopped
_WAITS = 0.1  # share of a stroke for which a drive stands still at its end that does more than turn
_LEFT = 0.2  # share of the way to the other level from which on a force has left the old one
_DRIFTS = 0.02  # share of the later force by which the force before it differs at the least where it still runs in,
_CLEARLY_DRIFTS = 4.0  # and this many times the uncertainty of the difference


@dataclass(frozen=True)
class Course:
    """How a record runs, as indices of its samples.

    ``contact`` is the range in which the bodies touch, ``stops`` the (stop, restart) of the drive within it, ``end``
    where the drive stops for good or contact ends. ``rests`` are the ranges in which nothing pulls: the drive stands
    still, or the bodies are apart. ``starts_sliding`` says that the record has no start from rest.
    """

    contact: Range
    end: int
    stops: tuple[Range, ...]
    rests: tuple[Range, ...]
    starts_sliding: bool

    @property
    def begins_before_contact(self) -> bool:
        """Whether the record begins before contact, by its load."""
        return self.contact[0] > 0

    @property
    def pieces(self) -> tuple[Range, ...]:
        """The ranges of motion: from contact or a stop to the next stop or the end."""
        starts = (self.contact[0], *(stop for stop, _ in self.stops))
        ends = (*(stop for stop, _ in self.stops), self.end)
        return tuple(zip(starts, ends, strict=True))


def course_of(trace: Trace, signal: Signal, contact_kind: str = "") -> Course:
    """The course of a record by its load, its speed or displacement, and its force.

    ``contact_kind`` is the contact that campaign.toml states. A disc or ring that turns slides from its first sample,
    unless the drive or the force shows that it began at rest.
    """
    samples = signal.time_s.size
    contact = _contact(trace.columns.get("normal_force_N"), samples)
    if contact[0] > 0 and _slides_under(trace.columns["normal_force_N"], signal, contact):
        contact = 0, contact[1]
    drive = drive_of(trace)
    moving = drive.moving if drive is not None and not drive.turns else None
    begins_at_rest = moving is None or not moving[: FEWEST_AT_REST * 2].all()
    even = _over_load(trace, signal, contact) if moving is None or not (begins_at_rest or contact[0]) else signal
    turns_at = reversals(signal.force_N) if moving is None else []
    rests: list[Range] = []
    stops: list[Range] = []
    end = contact[1]
    if moving is not None:
        stops, end, rests = drive_stops(moving, contact)
    touching = contact[0], stops[0][0] if stops else end
    if contact[0] > 0 and moving is not None:
        at_once = bool(moving[max(contact[0] - 2, 0) : contact[0] + 2].all())
    elif moving is None or not begins_at_rest:
        turns = contact_kind in TURNING or (drive is not None and drive.channel in ("speed", "rotation speed"))
        at_once = _returns(even, touching)
        at_once = at_once or _begins_high(even, touching, turns=turns, told=turns and moving is not None)
    else:
        at_once = False
    told = None
    if drive is None and not turns_at:
        told = standstills(even.force_N[contact[0] : contact[1]])
    if told is not None:
        stops, end = [(contact[0] + a, contact[0] + b) for a, b in told[0]], contact[0] + told[1]
        if stops:  # shorter ones than the roughness tells fall as low
            ends = [(even.force_N[max(a - _TELLING, 0) : a], even.force_N[a:b]) for a, b in stops]
            slid, held = (float(np.median([np.median(part) for part in parts])) for parts in zip(*ends, strict=True))
            stops += [
                (a, b)
                for a, b in force_stops(even, (contact[0], end), in_motion=at_once)
                if all(b <= stop or a >= restart for stop, restart in stops)
                and float(np.median(even.force_N[(a + b) // 2 : b])) < (slid + held) / 2.0
            ]
            stops.sort()
    elif moving is None:
        stops, end = force_stops(even, contact, in_motion=at_once), contact[1]
        if drive is not None and drive.moving.any():
            end = min(end, int(np.flatnonzero(drive.moving)[-1]) + 1)
        else:
            last = max(turns_at, default=0)
            end = min(end, last + quiet_end(signal.force_N[last:]))
        end = max(end, stops[-1][1] + 1) if stops else end
    if drive is None and not turns_at:
        last = stops[-1][1] if stops else contact[0]
        force = even.force_N[last:end]
        for _ in range(2):  # the drive stops, and later the load is taken off
            force = force[: relaxes_from(force, clearly=True)]
        end = last + force.size
    rests += [(a, b) for a, b in ((0, contact[0]), (contact[1], samples)) if b - a >= FEWEST_AT_REST]
    return Course(contact, end, tuple(stops), tuple(sorted(rests)), at_once)


def course_of_piece(trace: Trace, signal: Signal, *, starts_sliding: bool) -> Course:
    """The course of a piece that was cut from a record: it ends where its drive stops."""
    whole, end = (0, signal.time_s.size), stroke_end(trace)
    if end is None:
        held = _before_it_turns(signal.calm_N)
        end = stands_from(signal.force_N[:held])
        end = max(end - int(_LATE * held), 1) if end < held else whole[1]
    return Course(whole, end, (), (), starts_sliding)


def stands_from(force_N: FloatArray) -> int:
    """The sample of one stroke from which its drive stands still until the end, by its force; its size without one."""
    return min(relaxes_from(force_N), quiet_end(force_N))


def _before_it_turns(force_N: FloatArray) -> int:
    """The end of a stroke before its force goes over to the other direction."""
    level = float(np.median(force_N[force_N.size // 2 :]))
    held = np.flatnonzero(force_N * np.sign(level) >= (1.0 - _LEFT) * abs(level))
    return int(held[-1]) + 1 if held.size else force_N.size


def as_stated(course: Course, signal: Signal, phases: Sequence[Phase]) -> Course:
    """A course with what a person stated of its phases: where sliding begins and ends, and whether from rest."""
    if not phases:
        return course
    time = signal.time_s
    slides = [p for p in phases if p.name in ("running-in", "steady sliding")]
    ends = [p.start_s for p in phases if p.name in ("end of the drive", "unloading", "lift-off")]
    from_rest = any(p.name in ("rest", "rise") for p in phases)
    end = int(np.searchsorted(time, min(ends))) if ends else course.end
    first = min((p.start_s for p in slides), default=math.inf)
    begin = float(time[course.contact[0]])
    if slides and not from_rest and first <= begin + _AT_BEGINNING * (float(time[-1]) - begin):
        return Course((int(np.searchsorted(time, first)), course.contact[1]), end, (), course.rests, True)
    stops = tuple(stop for stop in course.stops if stop[1] < end)
    return replace(course, end=end, stops=stops, starts_sliding=course.starts_sliding and not from_rest)


def _contact(load: FloatArray | None, samples: int) -> Range:
    """Range in which the bodies touch, by a load that is level and low before it; else the whole record."""
    whole = (0, samples)
    first = max(int(samples * _FLAT_START), FEWEST_AT_REST)
    if load is None or first * 4 > samples or not np.isfinite(load).all():
        return whole
    low, high = np.percentile(load, (5.0, 95.0))
    load = median_of_three(load if abs(high) >= abs(low) else -load)
    before, high = float(np.median(load[:first])), float(np.percentile(load, 95))
    swing = high - before
    if (
        swing <= 0
        or before > _UNLOADED * high
        or float(np.ptp(np.percentile(load[:first], (5.0, 95.0)))) > _LEVEL * swing
    ):
        return whole
    height = (running_mean(load, FEWEST_AT_REST) - before) / swing
    touching = np.flatnonzero(height > _LEVEL)
    if touching.size == 0:
        return whole
    none = max(3.0 * sample_noise(load) / swing, _NONE)
    free = np.flatnonzero(height[: touching[0]] <= none)
    begin, end = int(free[-1]) + FEWEST_AT_REST // 2 if free.size else int(touching[0]), int(touching[-1]) + 1
    free = np.flatnonzero(height[end:] <= none)
    end += int(free[0]) - FEWEST_AT_REST // 2 + 1 if free.size else 0
    return min(begin, int(touching[0]) + FEWEST_AT_REST // 2), end if samples - end >= FEWEST_AT_REST else samples


def _over_load(trace: Trace, signal: Signal, contact: Range) -> Signal:
    """A signal whose force is that over the load where that goes from one level to another within a contact."""
    load = trace.columns.get("normal_force_N")
    part = slice(*contact)
    if load is None or not np.isfinite(load).all() or not level_cuts(load_as_set(load[part], trace.force_N[part])):
        return signal
    usual = float(np.median(np.abs(load[contact[0] : contact[1]])))
    share = usual / np.maximum(median_of_three(np.abs(load)), 0.1 * usual) if usual > 0 else 1.0
    return replace(signal, force_N=signal.force_N * share, smooth_N=signal.smooth_N * share)


def _slides_under(load: FloatArray, signal: Signal, contact: Range) -> bool:
    """Whether what looks like an approach is the lowest level of a ladder of loads: friction follows the load there."""
    first, last = contact[0], min(contact[0] + max(contact[0], FEWEST_AT_REST), contact[1])
    if min(first, last - first) < 4 * FEWEST_AT_REST:
        return False
    early, late = slice(first - first // 3, max(first - FEWEST_AT_REST, 1)), slice(last - (last - first) // 3, last)
    (low, high), (little, much) = (
        [float(np.median(np.abs(values[part]))) for part in (early, late)] for values in (load, signal.force_N)
    )
    follows = low > _NONE * high and 0.5 * little * high < much * low < 2.0 * little * high
    return follows and little > _FELT * signal.noise_N / math.sqrt(max(first // 3, 1))


def force_stops(signal: Signal, contact: Range, *, in_motion: bool) -> list[Range]:
    """Stops that only the force shows: it falls and stays low, or relaxes slowly, and then rises as at a start.

    A slip is none of them: after it the force rises for most of the time. A record that begins ``in_motion`` shows no
    first rise to compare with; only a fall to a low level is a stop there.
    """
    first, last = contact
    force = signal.smooth_N[first:last]
    height = force if in_motion else force - starting_level(force)
    if height.size < 20 * FEWEST_AT_REST or float(height.max()) < _FELT * signal.noise_N:
        return []
    top = float(np.percentile(height, 90))
    dips = [
        (int(a), int(b)) for a, b in zip(*runs_of(height < _FALLEN * top), strict=True) if a > 0 and b < height.size
    ]
    stops = [stop for dip in dips if (stop := _stop_in(height, dip))]
    if not stops and not in_motion:
        stops = _relaxations(signal.time_s[first:last], height, top, signal.noise_N)
    return [(first + int(a), first + int(b)) for a, b in stops] if len(stops) <= _MOST_STOPS else []


def _stop_in(height: FloatArray, dip: Range) -> Range | None:
    """A dip of the force as a stop, up to its rise, if the force spends most of the dip near its bottom; else None."""
    inside = height[dip[0] : dip[1]]
    edge, bottom = float(max(inside[0], inside[-1])), float(np.percentile(inside, 5))
    near = np.flatnonzero(inside <= bottom + _AT_BOTTOM * (edge - bottom))
    if inside.size < max(2 * FEWEST_AT_REST, _SHORTEST_STOP * height.size) or near.size <= inside.size / 2:
        return None
    low = np.flatnonzero(inside <= bottom + _AT_BOTTOM / 2 * (edge - bottom))
    return dip[0], dip[0] + int(low[-1]) + 1


def _relaxations(time_s: FloatArray, height: FloatArray, top: float, noise: float) -> list[Range]:
    """Slow falls of the force, each followed by a rise about as steep as the first one."""
    rough, _ = correlated_noise(height, height > _FALLEN * top)
    peaks, troughs = turning_points(height, max(_RESTART * top, _FELT * noise, _SWINGS * rough))
    if peaks.size < 2 or troughs.size == 0:
        return []
    first_pace, first_lasts = _pace(time_s, height, 0, int(peaks[0]))
    found = []
    for peak, lowest, after in zip(peaks, troughs, peaks[1:], strict=False):
        near = height[lowest] + _AT_BOTTOM / 2 * (height[after] - height[lowest])
        trough = lowest + int(np.flatnonzero(height[lowest:after] <= near)[-1])
        rise_s, fall_s = float(time_s[after] - time_s[trough]), float(time_s[trough] - time_s[peak])
        pace, lasts = _pace(time_s, height, trough, int(after))
        at_once = pace > _AS_STEEP * first_pace or lasts <= first_lasts
        if at_once and fall_s > _SLOW_FALL * rise_s:
            stop = _relaxes_from(height, int(peak), trough, noise)
            half = (float(np.median(height[peak : stop + 1])) + height[lowest]) / 2.0
            fallen = int(peak) + int(np.flatnonzero(height[peak:trough] > half)[-1]) + 1
            began = began_by(height, int(peak), fallen, min(trough, fallen + _TELLING))
            stop = began if began < fallen else stop
            found += [(stop, trough)] if trough > stop else []
    return found


def _pace(time_s: FloatArray, height: FloatArray, start: int, end: int) -> tuple[float, int]:
    """Slope of the middle half of a rise, and how many samples it lasts, one at the least."""
    low = height[start] + 0.25 * (height[end] - height[start])
    high = height[start] + 0.75 * (height[end] - height[start])
    part = height[start : end + 1]
    a = start + int(np.flatnonzero(part <= low)[-1]) if (part <= low).any() else start
    b = max(start + int(np.argmax(part >= high)), a + 1)
    return line(time_s[a : b + 1], height[a : b + 1])[0], b - a


def _relaxes_from(height: FloatArray, peak: int, trough: int, noise: float) -> int:
    """Index at which the slide after a peak ends and the force relaxes: the last at the highest level it dwells at."""
    fall = running_mean(height[peak:trough], FEWEST_AT_REST)
    width = max(3.0 * noise, 0.005 * float(np.ptp(fall)), 1e-300)
    bins = np.floor((fall - fall.min()) / width).astype(int)
    share = np.bincount(bins) / bins.size
    dwells = np.flatnonzero(share > _DWELLS)
    if dwells.size == 0:
        return max(trough - 1, peak + 1)
    level = float(np.median(fall[bins == dwells[-1]]))
    return peak + int(np.flatnonzero(fall >= level - width)[-1]) + 1


def _first_and_later(signal: Signal, span: Range) -> tuple[float, FloatArray]:
    """The force that a range begins with, and the later three quarters of it, a last fall left out; both positive."""
    force = signal.smooth_N[span[0] : span[1]]
    begin = signal.force_N[span[0] : span[0] + FEWEST_AT_REST]
    start = min(float(np.median(begin)), float(np.median(begin[:3])), key=abs)
    later = force[force.size // 4 :]
    if np.median(later) < 0:
        later, start = -later, -start
    high = np.flatnonzero(later > _FALLEN * float(np.median(later)))
    return start, later[: int(high[-1]) + 1] if high.size else later


def _returns(signal: Signal, span: Range) -> bool:
    """Whether a record begins at a force that it comes back to, or falls from: it then slides from its first sample."""
    if span[1] - span[0] < 4 * FEWEST_AT_REST:
        return False
    start, later = _first_and_later(signal, span)
    felt = float(np.median(later)) > _FELT * max(signal.noise_N, noise_of(later))
    low, high = np.quantile(later, (_RETURNS, 1.0 - _RETURNS))
    in_range = start >= low - _NEAR * (high - low) - 2.0 * signal.noise_N
    return bool(felt and in_range and start > _UNPULLED * float(np.median(later)))


def _begins_high(signal: Signal, span: Range, *, turns: bool, told: bool) -> bool:
    """Whether a record begins with a large part of its later force, so that its bodies slide, and the force drifts up.

    Where a channel ``told`` that the drive moves, this is enough. Else a force that keeps level before it climbs began
    at rest, above a large zero. ``turns`` is a disc, a ring or a spindle.
    """
    if span[1] - span[0] < 4 * FEWEST_AT_REST:
        return False
    start, later = _first_and_later(signal, span)
    level = float(np.median(later))
    if level <= _FELT * signal.noise_N or start <= (_UNPULLED if turns else _PULLED) * level:
        return False
    if told or level - start < _CLIMBS * max(signal.noise_N, noise_of(later)):
        return True
    height = (np.abs(signal.smooth_N[span[0] : span[1]]) - start) / (level - start)
    quarter, most = int(np.argmax(height > _QUARTER)), int(np.argmax(height > _THREE_QUARTERS))
    return quarter - (most - quarter) / 2.0 < FEWEST_AT_REST or _as_rough(signal.force_N[span[0] : span[1]], quarter)


def _as_rough(force: FloatArray, until: int) -> bool:
    """Whether a level is rough as bodies that slide are: with noise that is correlated, and as large for its force.

    The noise of a recorder is as large at rest, but hardly correlated.
    """
    if until < _FEWEST_ALIKE:
        return False
    (first_N, alike), (later_N, _) = (
        correlated_noise(part, np.ones(part.size, bool)) for part in (force[:until], force[until:])
    )
    share = abs(float(np.median(force[:until]))) / max(abs(float(np.median(force[until:]))), 1e-300)
    return alike > _ALIKE and first_N > _AS_ROUGH * share * later_N > 0.0


def phases_of(
    trace: Trace,
    contact: str = "",
    *,
    signal: Signal | None = None,
    course: Course | None = None,
    starts_s: Sequence[tuple[float, float]] | None = None,
    stated: Sequence[Phase] = (),
) -> tuple[Phase, ...]:
    """Every part of a record by what the rig did, in order of time, without gaps and overlaps.

    Parameters
    ----------
    trace : Trace
        The record.
    contact : str
        As stated in campaign.toml: sled, pin_on_disc, ball_on_disc, ring_shear, reciprocating or rotary.
    signal, course : optional
        The same of the record, where they are at hand.
    starts_s : sequence of (onset, peak), optional
        Times at which the force begins to rise from rest and at which it has its static peak, for every start that is
        known; else they are looked for.
    stated : sequence of Phase
        What a person stated: it stands in place of what was found there.

    Raises
    ------
    TraceError
        The record holds no signal that can be read.
    """
    signal = signal or signal_of(trace)
    course = course or course_of(trace, signal, contact)
    drive, samples = drive_of(trace), signal.time_s.size
    spans: list[_Span] = []
    if course.begins_before_contact:
        spans.append(_Span("approach", 0, course.contact[0], "the load is level and low"))
    begin, end = _under_load(trace, course)
    if begin > course.contact[0]:
        spans.append(_Span("loading", course.contact[0], begin, "the load rises"))
    strokes = _strokes(signal, drive, (begin, end))
    if strokes:
        spans += strokes
    else:
        for k, (first, last) in enumerate(course.pieces):
            if k:
                told = "the drive stands still" if drive else "the force falls and stays low, or relaxes"
                spans.append(_Span("hold", first, course.stops[k - 1][1], told))
                first = course.stops[k - 1][1]
            first, last = max(first, begin), min(last, end)
            if last > first:
                from_rest = k > 0 or not course.starts_sliding
                spans += _motion(trace, signal, drive, (first, last), k, from_rest, starts_s)
    touching = course.contact[1]
    falls = _falls_from(trace, course, max(end, begin))
    if end < falls:
        told = "the drive stands still" if drive else "the force relaxes and is no longer rough"
        spans.append(_Span("end of the drive", end, falls, told))
    spans.append(_Span("unloading", falls, touching, "the load falls"))
    if touching < samples:
        spans.append(_Span("lift-off", touching, samples, "the load has fallen back"))
    for phase in stated:
        first, last = (int(k) for k in np.searchsorted(signal.time_s, (phase.start_s, phase.end_s)))
        spans = [*_without(spans, first, last), _Span(phase.name, first, last, BY_HAND)]
    gaps = _gaps(signal.time_s)
    return tuple(_phase(trace, signal, drive, gaps, span) for span in _one_after_another(spans, samples))


def _one_after_another(spans: Sequence[_Span], samples: int) -> Iterator[_Span]:
    """Spans in their order, each from the end of the one before: strokes shorter than their reversals overlap."""
    ordered = sorted((span for span in spans if span.last > span.first), key=lambda span: span.first)
    begin = 0
    for span, after in zip(ordered, [*ordered[1:], None], strict=True):
        last = samples if after is None else after.first
        if last > begin and begin < samples - 1:
            yield replace(span, first=begin, last=last)
            begin = last


def _without(spans: Sequence[_Span], first: int, last: int) -> Iterator[_Span]:
    """Spans, or what is left of them, outside of a range."""
    for span in spans:
        yield replace(span, last=min(span.last, first))
        yield replace(span, first=max(span.first, last))


def _under_load(trace: Trace, course: Course) -> Range:
    """The samples from which on the load has reached its first level, and at which motion or the last level ends."""
    first, last = course.contact[0], course.end
    load = trace.columns.get("normal_force_N")
    if load is None or not course.begins_before_contact or not np.isfinite(load).all():
        return first, last
    load = median_of_three(np.abs(load[first : course.contact[1]]))
    levels = levels_of(load)
    if not levels:
        return first, last
    begin = first + int(np.argmax(load >= _reached(load, levels[0][2])))
    begin = begin if first + FEWEST_AT_REST // 2 < begin < last else first
    return begin, min(last, _falls_from(trace, course, begin))


def under_load_s(trace: Trace, contact: str = "") -> tuple[float, float]:
    """The times between which the bodies touch under load and the drive has not stopped for good."""
    course = course_of(trace, signal_of(trace), contact)
    begin, end = _under_load(trace, course)
    return float(trace.time_s[begin]), float(trace.time_s[min(end, trace.time_s.size - 1)])


def _reached(load: FloatArray, level: float) -> float:
    """The load from which on a level counts as reached."""
    return min(_LOADED * level, level - 2.0 * sample_noise(load))


def _falls_from(trace: Trace, course: Course, start: int) -> int:
    """The sample after ``start`` from which the load falls to nothing; the end of contact where it does not fall."""
    touching, load = course.contact[1], trace.columns.get("normal_force_N")
    if load is None or touching == load.size or touching - start < 2 * FEWEST_AT_REST:
        return touching
    levels = levels_of(median_of_three(np.abs(load[course.contact[0] : touching])))
    if not levels:
        return touching
    load, level = median_of_three(np.abs(load[start:touching])), levels[-1][2]
    kept = np.flatnonzero(load >= _reached(load, level))
    falls = start + int(kept[-1]) + 1 if kept.size else touching
    return falls if touching - falls > FEWEST_AT_REST // 2 else touching


@dataclass(frozen=True)
class _Span:
    """A phase as a range of samples."""

    name: str
    first: int
    last: int
    evidence: str = ""
    doubt: str = ""
    cycle: int = 0


def _start_from_rest(
    signal: Signal, span: Range, starts_s: Sequence[tuple[float, float]] | None
) -> tuple[int, int] | None:
    """Samples of the onset and of the static peak of a motion from rest; None where no rise was seen."""
    first, last = span
    time = signal.time_s
    if starts_s is not None:
        for onset_s, peak_s in starts_s:
            if time[first] <= peak_s <= time[last - 1]:
                return max(int(np.searchsorted(time, onset_s)), first), int(np.searchsorted(time, peak_s))
        if not any(peak_s > time[last - 1] for _, peak_s in starts_s):
            return None
    part = slice(first, last)
    try:
        loading = loading_of(
            replace(
                signal, time_s=time[part], force_N=signal.force_N[part], calm_N=signal.calm_N[part],
                smooth_N=signal.smooth_N[part], recorder_fault=None,
            )
        )  # fmt: skip
    except TraceError:
        return None
    return first + int(np.searchsorted(time[part], loading.onset_s)), first + loading.top


def _strokes(signal: Signal, drive: DriveMotion | None, span: Range) -> list[_Span]:
    """The strokes of a motion to and fro, by the turns of the drive, else by the reversals of the force."""
    begin, end = span
    if end - begin < MINIMUM_SAMPLES:
        return []
    told = drive is not None and bool(drive.turns)
    turns = [turn for turn in drive.turns if begin < turn < end] if drive and told else []
    if not told:
        turns = [begin + k for k in reversals(signal.force_N[begin:end])]
        turns = turns if len(turns) > 1 else []  # a pull that begins below zero passes it once
    found: list[_Span] = []
    cycle = 1
    for k, (a, b) in enumerate(pairwise([begin, *turns, end] if turns else [])):
        first, last = a, b
        if drive is not None and told:
            moving = np.flatnonzero(drive.moving[a:b])
            first, last = (a + int(moving[0]), a + int(moving[-1]) + 1) if moving.size else (a, b)
            found += _between_strokes(found, first, last - first, "the drive")
        else:
            first = _reversal(signal, (begin, end), a)[1] if k else a
            turns_at = _reversal(signal, (begin, end), b)[0] if b < end else b
            last = min(first + stands_from(signal.force_N[first:turns_at]), turns_at)
            found += _between_strokes(found, first, last - first, "the force")
        found.append(_Span("stroke", first, last, "the drive moves" if told else "the force", cycle=cycle))
        if not told and b < end and turns_at - last >= FEWEST_AT_REST:
            found.append(_Span("hold", last, turns_at, "the force relaxes and is no longer rough"))
        cycle += k % 2
    if found and found[-1].last < end:
        found.append(_Span("end of the drive", found[-1].last, end, "the drive stands still"))
    if found and found[0].first > begin:
        found.insert(0, _Span("rest", begin, found[0].first, "the drive stands still"))
    return found


def _between_strokes(found: Sequence[_Span], first: int, stroke: int, teller: str) -> Iterator[_Span]:
    """The reversal from the last stroke to the next; a hold where the drive stands still for some time."""
    if not found or found[-1].last >= first:
        return
    waits = first - found[-1].last >= max(FEWEST_AT_REST, _WAITS * stroke) and teller == "the drive"
    evidence = f"{teller} stands still" if waits else f"{teller} turns"
    yield _Span("hold" if waits else "reversal", found[-1].last, first, evidence)


def _motion(
    trace: Trace,
    signal: Signal,
    drive: DriveMotion | None,
    span: Range,
    number: int,
    from_rest: bool,
    starts_s: Sequence[tuple[float, float]] | None,
) -> Iterator[_Span]:
    """The phases of one motion of the drive, from its start to its stop."""
    first, last = span
    cuts, load = [], trace.columns.get("normal_force_N")
    moving = first + int(np.argmax(drive.moving[first:last])) if drive is not None and last > first else first
    if load is not None and np.isfinite(load[moving:last]).all():
        levels = level_cuts(load_as_set(load[moving:last], trace.force_N[moving:last]))
        cuts += [(moving + a, moving + b, "step of load") for a, b in levels]
    if drive is not None and np.isfinite(drive.pace[moving:last]).all():
        cuts += [(a, max(b, a + 1), "step of speed") for a, b in speed_cuts(trace, drive, (moving, last))]
    cuts.sort()
    cuts = [cut for k, cut in enumerate(cuts) if k == 0 or cut[0] >= cuts[k - 1][1]]
    start = _start_from_rest(signal, (first, cuts[0][0] if cuts else last), starts_s) if from_rest else None
    if start is not None:
        onset, peak = start
        if number == 0:
            yield _Span("rest", first, onset, "the force before the first rise")
            yield _Span("rise", onset, peak, "the force climbs")
        else:
            yield _Span("rise", first, peak, "the force climbs after the stop")
        first = peak
    begin, evidence = first, "the force after the peak" if start else "the drive moves"
    for k, (a, b, name) in enumerate([*cuts, (last, last, "")]):
        yield from _slide(signal, begin, a, evidence, after_peak=k == 0 and start is not None)
        yield _Span(name, a, b, "the load" if name == "step of load" else "the speed")
        begin, evidence = b, f"after the {name}"


def _reversal(signal: Signal, span: Range, at: int) -> Range:
    """The samples in which the force passes from one level to the other around a reversal."""
    force = signal.calm_N
    reach = max(MINIMUM_SAMPLES, (span[1] - span[0]) // 100)
    low, high = max(at - reach, span[0]), min(at + reach, span[1])
    old, new = float(np.median(force[low:at])), float(np.median(force[at:high]))
    share = (force[low:high] - old) / (new - old) if new != old else np.zeros(high - low)
    leaves, arrives = np.flatnonzero(share[: at - low] < _LEFT), np.flatnonzero(share[at - low :] > 1.0 - _LEFT)
    first = low + int(leaves[-1]) + 1 if leaves.size else low
    return first, max(at + int(arrives[0]) if arrives.size else high, first + 1)


def _slide(signal: Signal, first: int, last: int, evidence: str, *, after_peak: bool) -> Iterator[_Span]:
    """The slip after a peak, the running-in and the steady part of a slide at one speed under one load."""
    smooth = signal.smooth_N[first:last]
    if after_peak and smooth.size:
        fallen = first + int(np.argmax(smooth <= np.median(smooth)))
        yield _Span("slip", first, fallen, evidence)
        first, evidence = fallen, "the force has come down to its later level"
    force = signal.force_N[first:last]
    if force.size >= 4 * MINIMUM_SAMPLES:
        settled = transient_end(force)
        early, late = force[: max(settled, 1)], force[settled:]
        away = abs(float(early.mean() - late.mean()))
        u = math.hypot(wander(early, 1.0)[0], wander(late, 1.0)[0]) if settled >= MINIMUM_SAMPLES else math.inf
        if away > max(_CLEARLY_DRIFTS * u, _DRIFTS * abs(float(late.mean()))):
            yield _Span("running-in", first, first + settled, evidence)
            first, evidence = first + settled, "the force has stabilised"
    yield _Span("steady sliding", first, last, evidence)


def _gaps(time_s: FloatArray) -> NDArray[np.int64]:
    """The samples before which rows are missing: the time to the one before is many times the usual step."""
    step_s = np.diff(time_s)
    return np.flatnonzero(step_s > _GAP * float(np.median(step_s))) + 1


def _phase(trace: Trace, signal: Signal, drive: DriveMotion | None, gaps: NDArray[np.int64], span: _Span) -> Phase:
    """A phase with the means of its channels and what is doubtful about it."""
    part = slice(span.first, span.last)
    time, force = signal.time_s, signal.force_N[part]
    speed, load = trace.columns.get("speed_m_s"), trace.columns.get("normal_force_N")
    if speed is None and drive is not None and drive.channel in ("displacement", "position"):
        speed = drive.pace
    force_u = wander(force, float(time[span.last - 1] - time[span.first]))[0] if force.size > 1 else math.nan
    end = float(time[min(span.last, time.size - 1)])
    doubts = [span.doubt] if span.doubt else []
    if drive is None and span.name in _OF_DRIVE and span.evidence != BY_HAND:
        doubts.append("only the force tells of it")
    if (missing := gaps[(gaps > span.first) & (gaps < span.last)]).size:
        longest = float((time[missing] - time[missing - 1]).max())
        doubts.append(f"rows are missing in it, for up to {longest:.4g} s")
    return Phase(
        span.name, float(time[span.first]), end,
        math.nan if speed is None else abs(level_of(speed[part])),
        math.nan if load is None else abs(level_of(load[part])),
        span.cycle, float(force.mean()), force_u, span.evidence, "; ".join(doubts),
    )  # fmt: skip
