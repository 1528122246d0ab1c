"""A driven damped oscillator in closed form, and the first root of a function whose slope is known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tribo.records import FloatArray

_DOUBLE_ROOT = 1e-13  # share of gamma^2 below which the two decay rates count as equal
_NO_STIFFNESS = 1e-13  # share of the stiffnesses in it below which their sum counts as zero
_LARGEST_EXPONENT = 600.0
_PER_SWING = 8  # points of a grid per swing: at most one minimum or maximum lies between two of them
_PER_WAY = 160  # points of a grid where nothing swings, in steps of equal ratio
_ROUNDING = 1e-12  # share of the largest value so far below which a minimum only touches zero

EXACT: dict[str, Any] = {"xtol": 1e-300, "rtol": 4 * np.finfo(float).eps, "maxiter": 500}


@dataclass(frozen=True)
class Oscillation:
    """m x'' + c x' + K x = p0 + p1 t + P sin(w t + q) from x0 and v0 at t = 0; K may be negative or zero.

    Parameters
    ----------
    mass_kg, damping, stiffness
        m, c and K in SI units. ``stiffness_scale`` is the size of what K is the sum of.
    p0_N, p1_N_per_s, wave_N, omega_per_s, phase
        The forcing.
    x0_m, v0_m_s
        The start.
    """

    mass_kg: float
    damping: float
    stiffness: float
    stiffness_scale: float
    p0_N: float
    p1_N_per_s: float
    wave_N: float
    omega_per_s: float
    phase: float
    x0_m: float
    v0_m_s: float

    def __post_init__(self) -> None:
        m, c, K = self.mass_kg, self.damping, self.stiffness
        if abs(K) <= _NO_STIFFNESS * self.stiffness_scale:
            K = 0.0
        set_ = object.__setattr__
        response = complex(K - m * self.omega_per_s**2, c * self.omega_per_s)
        wave = self.wave_N / response if self.wave_N else 0.0
        set_(self, "_wave", wave * complex(math.cos(self.phase), math.sin(self.phase)) if self.wave_N else 0j)
        if K != 0.0:
            slope = self.p1_N_per_s / K
            particular = ((self.p0_N - c * slope) / K, slope, 0.0, 0.0)
        elif c > 0.0:
            half = self.p1_N_per_s / (2.0 * c)
            particular = (0.0, (self.p0_N - 2.0 * m * half) / c, half, 0.0)
        else:
            particular = (0.0, 0.0, self.p0_N / (2.0 * m), self.p1_N_per_s / (6.0 * m))
        set_(self, "_polynomial", particular)
        wave_x, wave_v, _ = self._wave_at(0.0)
        set_(self, "_gamma", c / (2.0 * m))
        set_(self, "_square", (c / (2.0 * m)) ** 2 - K / m)
        set_(self, "_stiffness", K)
        set_(self, "_y0", self.x0_m - particular[0] - wave_x)
        set_(self, "_w0", self.v0_m_s - particular[1] - wave_v)

    def _wave_at(self, t: Any) -> tuple[Any, Any, Any]:
        """The steady swing with its speed and acceleration."""
        if not self.wave_N:
            return 0.0, 0.0, 0.0
        turned = self._wave * np.exp(1j * self.omega_per_s * t)  # type: ignore[attr-defined]
        return turned.imag, self.omega_per_s * turned.real, -(self.omega_per_s**2) * turned.imag

    def at(self, t: Any) -> tuple[Any, Any, Any]:
        """Position, speed and acceleration at times t from the start, of the shape of t."""
        gamma, square, y0, w0 = self._gamma, self._square, self._y0, self._w0  # type: ignore[attr-defined]
        K, m = self._stiffness, self.mass_kg  # type: ignore[attr-defined]
        if K == 0.0 and gamma == 0.0:
            y, w, a = y0 + w0 * t, w0 + 0.0 * t, 0.0 * t
        elif square < -_DOUBLE_ROOT * gamma**2:
            omega = math.sqrt(-square)
            fade, cosine, sine = np.exp(-gamma * t), np.cos(omega * t), np.sin(omega * t)
            y = fade * (y0 * cosine + (w0 + gamma * y0) / omega * sine)
            w = fade * (w0 * cosine - (gamma * w0 + K / m * y0) / omega * sine)
            a = -2.0 * gamma * w - K / m * y
        elif square > _DOUBLE_ROOT * gamma**2:
            root = math.sqrt(square)
            fast = -gamma - root
            slow = (K / m) / fast  # the product of the roots: their difference would lose digits
            A, B = (w0 - fast * y0) / (2.0 * root), (slow * y0 - w0) / (2.0 * root)
            first = A * np.exp(np.minimum(slow * t, _LARGEST_EXPONENT))
            second = B * np.exp(fast * t)
            y, w, a = first + second, slow * first + fast * second, slow**2 * first + fast**2 * second
        else:
            fade, slope = np.exp(-gamma * t), w0 + gamma * y0
            y = fade * (y0 + slope * t)
            w = fade * (w0 - gamma * slope * t)
            a = -2.0 * gamma * w - K / m * y
        c0, c1, c2, c3 = self._polynomial  # type: ignore[attr-defined]
        wave_x, wave_v, wave_a = self._wave_at(t)
        return (
            y + c0 + t * (c1 + t * (c2 + t * c3)) + wave_x,
            w + c1 + t * (2.0 * c2 + 3.0 * t * c3) + wave_v,
            a + 2.0 * c2 + 6.0 * t * c3 + wave_a,
        )

    def grid(self, end_s: float) -> FloatArray:
        """Times from 0 to ``end_s`` so close that position, speed and acceleration turn at most once between two."""
        square, gamma = self._square, self._gamma  # type: ignore[attr-defined]
        swings = [math.sqrt(-square)] if square < 0.0 else []
        swings += [self.omega_per_s] if self.wave_N else []
        if swings:
            step = 2.0 * math.pi / max(swings) / _PER_SWING
            return np.linspace(0.0, end_s, 2 + int(end_s / step))
        root = math.sqrt(max(square, 0.0))
        fastest = gamma + root
        last = min(end_s, _LARGEST_EXPONENT / (root - gamma)) if root > gamma else end_s
        first = min(0.1 / fastest if fastest > 0.0 else 1e-6 * last, 0.5 * last)
        return np.concatenate([[0.0], np.geomspace(first, last, _PER_WAY)])


Function = Callable[[Any], Any]


def first_fall(function: Function, slope: Function, grid: FloatArray) -> float:
    """Where a function that begins at zero or above first falls below zero, to machine precision; infinity if nowhere.

    Between two points of the grid it has at most one minimum or maximum. A minimum that only touches zero is no fall.
    """
    values, slopes = np.asarray(function(grid), float), np.asarray(slope(grid), float)
    touches = -_ROUNDING * np.maximum.accumulate(np.abs(values))  # by what was reached so far: unstable motion explodes
    falls = values[1:] < touches[:-1]
    dips = (slopes[:-1] < 0.0) & (slopes[1:] > 0.0) & ~falls
    for i in np.flatnonzero(falls | dips):
        low, high = float(grid[i]), float(grid[i + 1])
        if dips[i]:
            bottom = brentq(slope, low, high, **EXACT)
            if not function(bottom) < touches[i]:
                continue
            high = bottom
        elif not function(low) > 0.0:
            if not slopes[i] > 0.0 or not slopes[i + 1] < 0.0:
                return low
            low = brentq(slope, low, high, **EXACT)
        return float(brentq(function, low, high, **EXACT))
    return math.inf


def first_crossing(function: Function, slope: Function, grid: FloatArray) -> float:
    """As :func:`first_fall` for a function that begins below zero and rises above it."""
    return first_fall(lambda t: -function(t), lambda t: -slope(t), grid)
