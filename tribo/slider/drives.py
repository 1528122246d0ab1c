"""What the machine does: the position of its drive over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, SimulationError
from tribo.records import FloatArray


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
