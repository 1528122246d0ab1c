"""The motion of a slider from event to event: the drive pulls, it sticks, starts to slide, slides, and comes to rest.

While it slides, friction that depends on slip alone makes the motion a chain of damped oscillators in closed form
(:func:`slide_exactly`). Friction that depends on speed is integrated by scipy (:func:`slide_integrated`), which is also
the readable twin of the closed forms. Everything else is common to both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tribo.display import displayed
from tribo.errors import Problem, SimulationError
from tribo.records import FloatArray
from tribo.slider.contact_laws import SlipContact, SpeedContact
from tribo.slider.oscillator import EXACT, DampedOscillation, first_crossing, first_fall


@displayed(lambda drive: drive.label)
@dataclass(frozen=True)
class Drive:
    """The position of a drive: straight pieces between knots, and a sinusoid on top of them.

    Parameters
    ----------
    label : str
        What it does, in words.
    knots_s : tuple of float
        Times at which a piece begins, in s; the first is 0.
    speeds_m_s : tuple of float
        Speed from each knot to the next, and from the last one on, in m/s.
    amplitude_m, frequency_Hz : float
        The sinusoid ``amplitude_m sin(2 pi frequency_Hz t)``.
    starts_m : array, shape (n,)
        Position of the straight part at the knots, in m; follows from the rest.

    Examples
    --------
    >>> from tribo.slider import speed_steps
    >>> drive = speed_steps([0.0, 10.0], [1e-6, 10e-6])
    >>> round(float(drive.position_m(12.0)), 9)
    3e-05
    """

    label: str
    knots_s: tuple[float, ...]
    speeds_m_s: tuple[float, ...]
    amplitude_m: float = 0.0
    frequency_Hz: float = 0.0
    starts_m: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # positions at the knots, computed once: a record of a drive has a knot at each of its samples
        steps = np.diff(self.knots_s) * np.asarray(self.speeds_m_s[:-1])
        object.__setattr__(self, "starts_m", np.concatenate([[0.0], np.cumsum(steps)]))
        object.__setattr__(self, "_knots", np.asarray(self.knots_s, float))
        object.__setattr__(self, "_speeds", np.asarray(self.speeds_m_s, float))

    def piece(self, time_s: Any) -> Any:
        """Index of the piece at a time, that which begins there at a knot."""
        knots: FloatArray = self._knots  # type: ignore[attr-defined]
        return np.maximum(np.searchsorted(knots, time_s, side="right") - 1, 0)

    def position_m(self, time_s: Any) -> Any:
        """Position of the drive in m, 0 at the start."""
        k = self.piece(time_s)
        straight = self.starts_m[k] + self._speeds[k] * (time_s - self._knots[k])  # type: ignore[attr-defined]
        return straight + self.amplitude_m * np.sin(2 * math.pi * self.frequency_Hz * np.asarray(time_s))

    def speed_m_s(self, time_s: Any) -> Any:
        """Speed of the drive in m/s, at a knot that after it."""
        omega = 2 * math.pi * self.frequency_Hz
        straight = self._speeds[self.piece(time_s)]  # type: ignore[attr-defined]
        return straight + omega * self.amplitude_m * np.cos(omega * np.asarray(time_s))


def constant_speed(speed_m_s: float) -> Drive:
    """A drive that moves at ``speed_m_s`` from the start on."""
    return Drive(f"constant speed {speed_m_s:g} m/s", (0.0,), (float(speed_m_s),))


def speed_steps(times_s: Sequence[float], speeds_m_s: Sequence[float]) -> Drive:
    """A drive that changes its speed: to ``speeds_m_s[i]`` at ``times_s[i]``, shape (n,); the first time is 0.

    Raises
    ------
    SimulationError
        Times that do not rise from 0, or as many as there are no speeds.
    """
    rising = all(low < high for low, high in pairwise(times_s))
    finite = all(map(math.isfinite, (*times_s, *speeds_m_s)))
    if len(times_s) != len(speeds_m_s) or not times_s or times_s[0] != 0.0 or not rising or not finite:
        found = f"times {list(times_s)}, speeds {list(speeds_m_s)}"
        what = "steps of speed need times that rise from 0, and a speed for each"
        raise SimulationError(Problem("wrong_drive", what, column="steps", found=found))
    return Drive(f"{len(times_s) - 1} steps of speed", tuple(map(float, times_s)), tuple(map(float, speeds_m_s)))


def slide_hold_slide(speed_m_s: float, slide_s: float, holds_s: Sequence[float]) -> Drive:
    """A drive at ``speed_m_s`` that slides for ``slide_s`` before and after each hold of ``holds_s``, shape (n,)."""
    times, speeds = [0.0], [speed_m_s]
    for hold in holds_s:
        stop = times[-1] + slide_s
        times += [stop, stop + hold]
        speeds += [0.0, speed_m_s]
    drive = speed_steps(times, speeds)
    return Drive(f"{len(holds_s)} holds at {speed_m_s:g} m/s", drive.knots_s, drive.speeds_m_s)


def sinusoid(amplitude_m: float, frequency_Hz: float) -> Drive:
    """A drive at ``amplitude_m sin(2 pi frequency_Hz t)``."""
    label = f"sinusoid of {amplitude_m:g} m at {frequency_Hz:g} Hz"
    return Drive(label, (0.0,), (0.0,), float(amplitude_m), float(frequency_Hz))


def recorded_displacement(time_s: FloatArray, displacement_m: FloatArray) -> Drive:
    """A drive that follows a record of its displacement, shape (n,), in straight lines between its samples.

    Time and displacement are counted from the first sample. After the last one the drive stands still.

    Raises
    ------
    SimulationError
        Fewer than two samples, gaps, or times that do not rise.
    """
    time, place = np.asarray(time_s, float), np.asarray(displacement_m, float)
    if time.size < 2 or not np.isfinite(time).all() or not np.isfinite(place).all() or not (np.diff(time) > 0).all():
        what = "a recorded displacement needs two samples or more without gaps, and times that rise"
        raise SimulationError(Problem("wrong_drive", what, column="displacement", found=f"{time.size} samples"))
    speeds = np.diff(place) / np.diff(time)
    knots = (time - time[0]).tolist()
    return Drive(f"recorded displacement of {time.size} samples", tuple(knots), (*speeds.tolist(), 0.0))


_MOST_IDLE = 100  # events in a row at one moment
_PER_SWING = 64  # points of a grid per swing of a sinusoidal drive while the slider is stuck
_TOLERANCE = 1e-11  # relative, of scipy's integrator
_STEPS_PER_SWING = 20


@dataclass(frozen=True)
class SliderMachine:
    """Between drive and slider: a spring with a gap, and a damper beside it; and the mass that it pulls."""

    mass_kg: float
    stiffness_N_per_m: float
    damping_N_s_per_m: float
    backlash_m: float

    def spring_N(self, stretch_m: Any) -> Any:
        """Force of the spring at a stretch X - x; none inside the gap."""
        half = 0.5 * self.backlash_m
        return self.stiffness_N_per_m * (stretch_m - np.clip(stretch_m, -half, half))


@dataclass(frozen=True)
class Moving:
    """A slider that slides in one direction, and where: ``origin_m`` is where it last stuck.

    ``piece`` counts the points of the law that it has passed, ``side`` tells where the spring is: 1 pulls, 0 inside the
    gap, -1 pushes.
    """

    x_m: float
    v_m_s: float
    direction: int
    origin_m: float
    piece: int
    side: int


@dataclass(frozen=True)
class Path:
    """Motion of a slider at the given times, and the times at which it began to slide and came to rest, in s."""

    position_m: FloatArray
    velocity_m_s: FloatArray
    stuck: np.ndarray
    starts_s: tuple[float, ...]
    stops_s: tuple[float, ...]


Resting = SlipContact | SpeedContact
"""Contacts that can be at rest."""
Fill = Callable[[FloatArray], tuple[Any, Any]]
Slide = Callable[[SliderMachine, Any, Drive, float, float, Moving], tuple[float, str, Moving, Fill]]
"""From a time, at most to another, on one piece of the drive: when something happens, what, the slider then, and its
position and speed at times between."""


def path_of(
    machine: SliderMachine, contact: Resting, drive: Drive, times_s: FloatArray, sliding: bool, slide: Slide
) -> Path:
    """The motion from the start to the last of ``times_s``; from rest, or from steady sliding with the drive."""
    end = float(times_s[-1])
    position, velocity = np.zeros(times_s.size), np.zeros(times_s.size)
    stuck = np.zeros(times_s.size, bool)
    starts: list[float] = []
    stops: list[float] = []
    t, x, stuck_since = 0.0, 0.0, 0.0
    moving = _steady(machine, contact, drive) if sliding else None
    x = moving.x_m if moving else 0.0
    done, last_t, idle = 0, -1.0, 0
    while t < end:
        idle = idle + 1 if t == last_t else 0
        last_t = t
        if idle > _MOST_IDLE:
            what = "the slider starts and stops without end"
            raise SimulationError(Problem("too_many_events", what, column="time", found=f"{t:.9g} s"))
        k = int(drive.piece(t))
        until = min(end, drive.knots_s[k + 1] if k + 1 < len(drive.knots_s) else end)
        if moving is None:
            leaves = _start_of_slip(machine, contact, drive, t, until, x, t - stuck_since)
            t = min(leaves, until)
            filled = done + int(np.searchsorted(times_s[done:], t, side="right" if t >= end else "left"))
            position[done:filled], stuck[done:filled] = x, True
            if leaves <= until:
                moving = _released(machine, contact, drive, t, x)
                starts.append(t)
        else:
            t_before = t
            t, what, moving, fill = slide(machine, contact, drive, t, until, moving)
            filled = done + int(np.searchsorted(times_s[done:], t, side="right" if t >= end else "left"))
            position[done:filled], velocity[done:filled] = fill(times_s[done:filled] - t_before)
            if what == "rest":
                x = moving.x_m
                stops.append(t)
                pull = _pull(machine, drive, t, x, k)
                if abs(pull) > contact.threshold_N(0.0):
                    moving = _released(machine, contact, drive, t, x)
                    starts.append(t)
                else:
                    moving, stuck_since = None, t
        done = filled
    return Path(position, velocity, stuck, tuple(starts), tuple(stops))


def _pull(machine: SliderMachine, drive: Drive, t: float, x: float, piece: int | None = None) -> float:
    """Force of the machine on a slider at rest."""
    speed = drive.speed_m_s(t) if piece is None else _local(drive, piece, t)[1]
    return float(machine.spring_N(drive.position_m(t) - x) + machine.damping_N_s_per_m * speed)


def _local(drive: Drive, piece: int, t: float) -> tuple[float, float]:
    """Position and speed of the drive on a given piece: at a knot, the piece before it is asked for as well."""
    start = drive.starts_m[piece] + drive.speeds_m_s[piece] * (t - drive.knots_s[piece])
    omega = 2.0 * math.pi * drive.frequency_Hz
    return (
        start + drive.amplitude_m * math.sin(omega * t),
        drive.speeds_m_s[piece] + omega * drive.amplitude_m * math.cos(omega * t),
    )


def _side(machine: SliderMachine, stretch_m: float, rate_m_s: float) -> int:
    """Where the spring is; at an edge of the gap, where it goes."""
    half = 0.5 * machine.backlash_m
    if half == 0.0:
        return 1
    if abs(stretch_m) == half:
        return int(np.sign(stretch_m)) if stretch_m * rate_m_s > 0.0 else 0
    return int(np.sign(stretch_m)) if abs(stretch_m) > half else 0


def _released(machine: SliderMachine, contact: Resting, drive: Drive, t: float, x: float) -> Moving:
    pull = _pull(machine, drive, t, x) or float(drive.speed_m_s(t))  # without friction it follows the drive at once
    direction = 1 if pull > 0.0 else -1
    return Moving(x, 0.0, direction, x, 0, _side(machine, float(drive.position_m(t)) - x, float(drive.speed_m_s(t))))


def _steady(machine: SliderMachine, contact: Resting, drive: Drive) -> Moving | None:
    """Steady sliding with the drive, friction at its last value; from rest where the drive stands."""
    speed = float(drive.speed_m_s(0.0))
    if speed == 0.0:
        return None
    direction = 1 if speed > 0.0 else -1
    last = len(contact.slip_m) - 1
    slip = contact.slip_m[-1]
    friction = float(contact.friction_N(slip, abs(speed)))
    stretch = direction * (friction / machine.stiffness_N_per_m + 0.5 * machine.backlash_m)
    return Moving(-stretch, speed, direction, -stretch - direction * slip, last, direction)


def _start_of_slip(
    machine: SliderMachine, contact: Resting, drive: Drive, t: float, until: float, x: float, stuck_s: float
) -> float:
    """When the pull on a stuck slider first exceeds its threshold; infinity where it does not before ``until``.

    On a straight piece of the drive the reserve is a concave function of time: it falls below zero at most once.
    """
    k = int(drive.piece(t))

    def reserve(after: Any) -> Any:
        place, speed = _places(drive, k, t, after)
        pull = machine.spring_N(place - x) + machine.damping_N_s_per_m * speed
        return contact.threshold_N(stuck_s + after) - np.abs(pull)

    span = until - t
    if reserve(0.0) < 0.0:
        return t
    if not drive.amplitude_m:
        return math.inf if reserve(span) >= 0.0 else t + float(brentq(reserve, 0.0, span, **EXACT))

    omega = 2.0 * math.pi * drive.frequency_Hz

    def slope(after: Any) -> Any:
        place, speed = _places(drive, k, t, after)
        bend = -(omega**2) * drive.amplitude_m * np.sin(omega * (t + after))
        engaged = np.abs(place - x) > 0.5 * machine.backlash_m
        pull = machine.spring_N(place - x) + machine.damping_N_s_per_m * speed
        rate = machine.stiffness_N_per_m * engaged * speed + machine.damping_N_s_per_m * bend
        return contact.threshold_rate_N_per_s(stuck_s + after) - np.sign(pull) * rate

    grid = np.linspace(0.0, span, 2 + int(span * drive.frequency_Hz * _PER_SWING))
    return t + first_fall(reserve, slope, grid)


def _places(drive: Drive, k: int, t: float, after: Any) -> tuple[Any, Any]:
    """Position and speed of the drive at times after t on one of its pieces."""
    omega = 2.0 * math.pi * drive.frequency_Hz
    base = drive.starts_m[k] + drive.speeds_m_s[k] * (t - drive.knots_s[k])
    if not drive.amplitude_m:
        return base + drive.speeds_m_s[k] * after, drive.speeds_m_s[k] + 0.0 * after
    angle = omega * (t + after)
    return (
        base + drive.speeds_m_s[k] * after + drive.amplitude_m * np.sin(angle),
        drive.speeds_m_s[k] + omega * drive.amplitude_m * np.cos(angle),
    )


def slide_exactly(
    machine: SliderMachine, contact: SlipContact, drive: Drive, t: float, until: float, moving: Moving
) -> tuple[float, str, Moving, Fill]:
    """One piece of sliding in closed form: a damped oscillator under the force of the drive."""
    k = int(drive.piece(t))
    d, j = moving.direction, moving.piece
    slips, sliding = contact.slip_m, contact.sliding_N
    last = j + 1 >= len(slips)
    slope = 0.0 if last else (sliding[j + 1] - sliding[j]) / (slips[j + 1] - slips[j])
    stiffness = machine.stiffness_N_per_m if moving.side else 0.0
    base, speed = _straight(drive, k, t)
    omega = 2.0 * math.pi * drive.frequency_Hz
    c = machine.damping_N_s_per_m
    # in the frame of the slider's own start: no digits are lost to a long travel
    held = stiffness * (base - moving.x_m - 0.5 * moving.side * machine.backlash_m) + c * speed
    friction = d * (sliding[j] + slope * (d * (moving.x_m - moving.origin_m) - slips[j]))
    motion = DampedOscillation(
        machine.mass_kg, c + contact.viscous_N_s_per_m, stiffness + slope,
        stiffness + abs(slope), held - friction, stiffness * speed,
        drive.amplitude_m * math.hypot(stiffness, c * omega), omega,
        math.atan2(c * omega, stiffness) + omega * t, 0.0, moving.v_m_s,
    )  # fmt: skip
    span = until - t
    grid = motion.grid(span)
    happens = {"drive": span, "rest": first_fall(lambda s: d * motion.at(s)[1], lambda s: d * motion.at(s)[2], grid)}
    if not last:
        to_next = slips[j + 1] - d * (moving.x_m - moving.origin_m)
        if to_next <= 0.0:
            happens["point"] = 0.0
        else:
            happens["point"] = first_crossing(
                lambda s: d * motion.at(s)[0] - to_next, lambda s: d * motion.at(s)[1], grid
            )
    if machine.backlash_m:
        happens |= _leaving(machine, drive, k, t, moving, motion, grid)
    after, what = min((when, name) for name, when in happens.items())
    x, v, _ = motion.at(after)
    x = float(moving.x_m + x)
    now = t + after if what != "drive" else until
    if what == "rest":
        after_it = Moving(x, 0.0, d, moving.origin_m, j, moving.side)
    else:
        side = int(what[4:]) if what.startswith("side") else moving.side
        after_it = Moving(x, float(v), d, moving.origin_m, j + (what == "point"), side)

    def fill(times: FloatArray) -> tuple[Any, Any]:
        path, pace, _ = motion.at(times)
        return moving.x_m + path, pace

    return now, what, after_it, fill


def _straight(drive: Drive, k: int, t: float) -> tuple[float, float]:
    """Position and speed of the straight part of the drive."""
    speed = drive.speeds_m_s[k]
    return drive.starts_m[k] + speed * (t - drive.knots_s[k]), speed


def _leaving(
    machine: SliderMachine, drive: Drive, k: int, t: float, moving: Moving, motion: DampedOscillation, grid: FloatArray
) -> dict[str, float]:
    """When the stretch of the spring next passes an edge of the gap, by the side it passes to."""
    half = 0.5 * machine.backlash_m

    def stretch(after: Any) -> Any:
        return _places(drive, k, t, after)[0] - moving.x_m - motion.at(after)[0]

    def rate(after: Any) -> Any:
        return _places(drive, k, t, after)[1] - motion.at(after)[1]

    if moving.side:
        s = moving.side
        return {"side0": first_fall(lambda u: s * stretch(u) - half, lambda u: s * rate(u), grid)}
    return {
        "side1": first_crossing(lambda u: stretch(u) - half, rate, grid),
        "side-1": first_fall(lambda u: stretch(u) + half, rate, grid),
    }


def slide_integrated(
    machine: SliderMachine, contact: Resting, drive: Drive, t: float, until: float, moving: Moving
) -> tuple[float, str, Moving, Fill]:
    """One piece of sliding by scipy's DOP853 with events, to relative 1e-11."""
    from scipy.integrate import solve_ivp

    k, d, j = int(drive.piece(t)), moving.direction, moving.piece
    half, c = 0.5 * machine.backlash_m, machine.damping_N_s_per_m
    last = j + 1 >= len(contact.slip_m)

    def rates(after: float, state: FloatArray) -> list[float]:
        place, speed = _places(drive, k, t, after)
        x, v = moving.x_m + state[0], state[1]
        slip = min(d * (x - moving.origin_m), math.inf if last else contact.slip_m[j + 1])
        spring = machine.stiffness_N_per_m * (place - x - moving.side * half) if moving.side else 0.0
        return [v, (spring + c * (speed - v) - d * float(contact.friction_N(slip, d * v))) / machine.mass_kg]

    def stretch(after: float, state: FloatArray) -> float:
        return float(_places(drive, k, t, after)[0]) - moving.x_m - float(state[0])

    watched: dict[str, tuple[Callable[[float, FloatArray], float], int]] = {"rest": (lambda _, s: d * s[1], -1)}
    if not last:
        passed = contact.slip_m[j + 1] - d * (moving.x_m - moving.origin_m)
        watched["point"] = (lambda _, s: d * s[0] - passed, 1)
    if machine.backlash_m and moving.side:
        watched["side0"] = (lambda u, s: moving.side * stretch(u, s) - half, -1)
    elif machine.backlash_m:
        watched |= {"side1": (lambda u, s: stretch(u, s) - half, 1), "side-1": (lambda u, s: stretch(u, s) + half, -1)}
    events = []
    for function, sense in watched.values():
        event: Any = lambda u, s, function=function: function(u, s)  # noqa: E731
        event.terminal, event.direction = True, sense
        events.append(event)
    swing = 2.0 * math.pi * math.sqrt(machine.mass_kg / machine.stiffness_N_per_m)
    force = max(contact.threshold_N(0.0), float(contact.friction_N(contact.slip_m[-1], 0.0)), 1e-12)
    scale = force / machine.stiffness_N_per_m
    solved = solve_ivp(
        rates, (0.0, until - t), [0.0, moving.v_m_s], "DOP853", dense_output=True, events=events, rtol=_TOLERANCE,
        atol=[1e-13 * scale, 1e-12 * scale * 2.0 * math.pi / swing], max_step=swing / _STEPS_PER_SWING,
    )  # fmt: skip
    if not solved.success:
        raise SimulationError(Problem("not_integrated", f"the motion cannot be integrated: {solved.message}"))
    what = next((name for name, found in zip(watched, solved.t_events, strict=True) if found.size), "drive")
    x, v = moving.x_m + float(solved.y[0, -1]), float(solved.y[1, -1])
    side = int(what[4:]) if what.startswith("side") else moving.side
    after = Moving(x, 0.0 if what == "rest" else v, d, moving.origin_m, j + (what == "point"), side)

    def fill(times: FloatArray) -> tuple[Any, Any]:
        path, pace = solved.sol(times) if times.size else np.zeros((2, 0))
        return moving.x_m + path, pace

    return until if what == "drive" else t + float(solved.t[-1]), what, after, fill
