"""A virtual tribometer that runs a programme: it knows its phases, its friction and what every level truly is.

It shares no code, number or formula with the reading of records. A slider hangs on a spring; the drive follows a list
of segments; the force is that of the spring. Noise has the sizes that records of real rigs have: a force that is rough
by 1 to 5 % while it slides, correlated over a few samples, and hardly at rest; a tachometer that is off by 0.05 % to
30 %.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Segment:
    """A part of a programme: the class of its phase, its duration, and the speed and load at its end (m/s, N)."""

    what: str
    lasts_s: float
    speed: float
    load: float
    ramp: bool = False  # whether speed and load go there along a line


@dataclass(frozen=True)
class Contact:
    """A pair of bodies and their spring."""

    sliding: float = 0.3
    excess: float = 0.3  # of static over sliding friction, as a share
    healing: float = 0.0  # growth of that excess for each tenfold hold above one second
    slope: float = 0.0  # change of sliding friction for each tenfold speed, as a share
    direct: float = 0.0  # change at once for each e-fold speed, as a share
    length_m: float = 1e-4  # over which friction evolves
    stiffness: float = 2e4  # N/m
    relaxes: float = 0.1  # share of the force that is lost at rest
    relaxes_s: float = 0.5
    runs_in: float = 0.0  # share by which friction is higher in the beginning
    runs_in_m: float = 1.0
    per_m: float = 0.0  # drift of friction with the distance, as a share
    round_m: float = 0.0  # circumference of the track
    round_share: float = 0.0


@dataclass(frozen=True)
class Noise:
    """What recorder and contact add: shares of the sliding force, of the speed and of the load."""

    rough: float = 0.02
    correlated: float = 3.0  # samples
    recorder_N: float = 0.003
    tachometer: float = 0.002
    tachometer_m_s: float = 0.0
    load: float = 0.002
    position_m: float = 1e-6
    rough_rise: float = 0.0  # as rough, while the spring is drawn


@dataclass
class Record:
    """What was recorded, and what was so."""

    kind: str
    time_s: np.ndarray
    channels: dict[str, np.ndarray]  # by the title of their columns
    clean_N: np.ndarray  # force without noise and offset
    slides: np.ndarray  # where the bodies slide
    moves: np.ndarray  # where the drive moves
    speed: np.ndarray
    load: np.ndarray
    parts: list[tuple[str, float, float]]  # class, start and end of every phase
    truth: dict[str, float] = field(default_factory=dict)
    from_rest: bool = True
    statics: list[tuple[float, float]] = field(default_factory=list)  # time and force of every start of sliding
    told: bool = True  # whether what was recorded tells of every boundary
    rate_Hz: float = 50.0


def course(segments: Sequence[Segment], rate_Hz: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[int]]:
    """Time, speed and load of a programme, and the first sample of each segment."""
    counts = [max(round(s.lasts_s * rate_Hz), 1) for s in segments]
    firsts = [0, *np.cumsum(counts).tolist()]
    speed, load = np.empty(firsts[-1]), np.empty(firsts[-1])
    v = n = 0.0
    for segment, first, count in zip(segments, firsts[:-1], counts, strict=True):
        way = (np.arange(count) + 1.0) / count if segment.ramp else np.ones(count)
        speed[first : first + count] = v + (segment.speed - v) * way
        load[first : first + count] = n + (segment.load - n) * way
        v, n = segment.speed, segment.load
    return np.arange(firsts[-1]) / rate_Hz, speed, load, firsts


def force_of(
    speed: np.ndarray, load: np.ndarray, rate_Hz: float, contact: Contact, sliding_already: bool
) -> tuple[np.ndarray, np.ndarray, list[tuple[float, float]]]:
    """Force on the spring (n,), where the bodies slide, and time and force of every start of sliding."""
    step = 1.0 / rate_Hz
    force, slides = np.zeros(speed.size), np.zeros(speed.size, bool)
    slipping, way, f, away, held_s, at_stop, distance = sliding_already, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    fastest = float(np.abs(speed).max())
    before = 0.0
    statics: list[tuple[float, float]] = []

    def friction(v: float) -> float:
        run_in = contact.runs_in * math.exp(-distance / contact.runs_in_m) + contact.per_m * distance
        return contact.sliding * (1.0 + contact.slope * math.log10(abs(v) / fastest) + run_in)

    for k in range(speed.size):
        v, n = float(speed[k]), float(load[k])
        if n <= 0.0:
            f, slipping, away, held_s = 0.0, False, 0.0, 1.0
        elif abs(v) < 1e-12:
            if slipping or held_s == 0.0:
                slipping, at_stop, held_s = False, f, 0.0
            held_s += step
            lost = contact.relaxes * (1.0 - math.exp(-held_s / contact.relaxes_s))
            f = at_stop * (1.0 - lost) if at_stop else f
        else:
            if slipping and v * way < 0:
                slipping, held_s = False, 1.0
            if not slipping:
                f += contact.stiffness * v * step
                grown = contact.excess + contact.healing * max(math.log10(max(held_s, 1e-3)), 0.0)
                static = n * friction(v) * (1.0 + grown)
                if abs(f) >= static and f * v > 0:
                    slipping, way, before = True, math.copysign(1.0, v), v
                    slid_s = min((abs(f) - static) / (contact.stiffness * abs(v)), step)  # since it slipped
                    away = (static - n * friction(v)) * math.exp(-abs(v) * slid_s / contact.length_m)
                    statics.append((k * step - slid_s, static))
            if slipping:
                if before and abs(v - before) > 1e-9 * fastest:
                    at_once = contact.sliding * contact.direct * math.log(v / before)
                    away += n * (friction(before) - friction(v) + at_once)
                before = v
                f = way * (n * friction(v) + away)
                away *= math.exp(-abs(v) * step / contact.length_m)
                distance += abs(v) * step
                at_stop = 0.0
        force[k], slides[k] = f, slipping
    return force, slides, statics


def rough(n: int, correlated: float, rng: np.random.Generator) -> np.ndarray:
    """Noise of unit size that forgets over so many samples."""
    kept = math.exp(-1.0 / correlated) if correlated > 0 else 0.0
    found, now = np.empty(n), float(rng.normal())
    for k, shock in enumerate(rng.normal(size=n) * math.sqrt(1.0 - kept * kept)):
        now = kept * now + float(shock)
        found[k] = now
    return found


def recorded(
    kind: str,
    segments: Sequence[Segment],
    contact: Contact,
    noise: Noise,
    channels: str,
    rng: np.random.Generator,
    *,
    rate_Hz: float = 50.0,
    sliding_already: bool = False,
    offset_N: float = 0.0,
    rpm_at_m: float = 0.0,
    sign_of_speed: bool = True,
    lost: bool = False,
) -> Record:
    """A record of a programme. ``channels`` names what is recorded beside time and force: S, P, L, R for speed,
    position, load and rotation."""
    time, speed, load, firsts = course(segments, rate_Hz)
    clean, slides, statics = force_of(speed, load, rate_Hz, contact, sliding_already)
    n = time.size
    travel = np.cumsum(speed) / rate_Hz
    sizes = np.where(slides, noise.rough, noise.rough_rise * (np.abs(speed) > 0))
    shaken = clean * (1.0 + sizes * rough(n, noise.correlated, rng))
    if contact.round_m:
        shaken = shaken * (1.0 + slides * contact.round_share * np.sin(2 * np.pi * travel / contact.round_m))
    told: dict[str, np.ndarray] = {
        "time (s)": time, "friction force (N)": shaken + offset_N + noise.recorder_N * rng.normal(size=n),
    }  # fmt: skip
    drive = (speed if sign_of_speed else np.abs(speed)) * (1.0 + noise.tachometer * rng.normal(size=n))
    drive = drive + noise.tachometer_m_s * rng.normal(size=n)
    if "S" in channels:
        told["speed (mm/s)"] = drive * 1e3
    if "R" in channels:
        told["rotation speed (rpm)"] = drive / (2 * np.pi * rpm_at_m) * 60
    if "P" in channels:
        told["displacement (mm)"] = (travel + noise.position_m * rng.normal(size=n)) * 1e3
    if "L" in channels:
        told["normal force (N)"] = load * (1.0 + noise.load * rng.normal(size=n)) + 0.002 * rng.normal(size=n)
    parts = [
        (s.what, float(time[a]), float(time[min(b, n - 1)]))
        for s, a, b in zip(segments, firsts[:-1], firsts[1:], strict=True)
    ]
    found = Record(
        kind, time, told, clean, slides, np.abs(speed) > 0, speed, load, parts, statics=statics, rate_Hz=rate_Hz
    )
    if lost:
        _lose(found, rng)
    return found


def _lose(record: Record, rng: np.random.Generator) -> None:
    """Rows that a recorder did not write: a few single ones, and a stretch of 2 % within the longest phase."""
    n = record.time_s.size
    _, start, end = max(record.parts, key=lambda part: part[2] - part[1])
    kept = rng.random(n) > 0.002
    at = start + rng.uniform(0.3, 0.6) * (end - start)
    kept &= (record.time_s < at) | (record.time_s > at + 0.02 * record.time_s[-1])
    kept[[0, -1]] = True
    record.channels = {name: values[kept] for name, values in record.channels.items()}


def ranges(mask: np.ndarray) -> Iterator[tuple[int, int]]:
    """First and last sample (exclusive) of every stretch in which a mask holds."""
    begin = None
    for k, there in enumerate([*mask.tolist(), False]):
        if there and begin is None:
            begin = k
        elif not there and begin is not None:
            yield begin, k
            begin = None
