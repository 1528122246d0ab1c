"""A driven damped oscillator in closed form, the first root of a function, and where sliding becomes stick-slip."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
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
class DampedOscillation:
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
            # a start at zero has reached nothing: rounding of its slope is told from a fall by where it rises to
            if not function(bottom) < (touches[i] or -_ROUNDING * abs(values[i + 1])):
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


def critical_stiffness_N_per_m(
    normal_load_N: float,
    a: float,
    b: float | Sequence[float],
    Dc_m: float | Sequence[float],
    mass_kg: float = 0.0,
    speed_m_s: float = 0.0,
) -> float:
    """Stiffness of the machine below which steady sliding under rate-and-state friction is unstable.

    For one state it is k_c = N (b - a) / Dc (1 + m v^2 / (N a Dc)), the same for the ageing and the slip law (Ruina
    1983; with inertia, Rice and Ruina, J. Appl. Mech. 50 (1983) 343, equation 22). For several states it follows from
    the same linear stability: k_c = m v^2 z + N sum_i b_i Dc_i z / (1 + Dc_i^2 z) with a = sum_i b_i / (1 + Dc_i^2 z).

    Parameters
    ----------
    normal_load_N
        Normal load in N.
    a, b, Dc_m
        Direct effect, effect of the state and its slip in m; lists of b and Dc for several states.
    mass_kg, speed_m_s
        Mass of the slider and speed of steady sliding; without them inertia is left out.

    Returns
    -------
    float
        In N/m; 0 where steady sliding is stable at every stiffness (a >= sum of b).

    Examples
    --------
    >>> from tribo.slider import critical_stiffness_N_per_m
    >>> round(critical_stiffness_N_per_m(10.0, 0.010, 0.015, 10e-6), 6)
    5000.0
    """
    from scipy.optimize import brentq

    effects, slips = np.atleast_1d(np.asarray(b, float)), np.atleast_1d(np.asarray(Dc_m, float))
    if effects.sum() <= a:
        return 0.0

    def direct(log_z: float) -> float:
        return float((effects / (1.0 + slips**2 * math.exp(log_z))).sum()) - a

    middle = -2.0 * math.log(float(slips.mean()))
    z = math.exp(brentq(direct, middle - 60.0, middle + 60.0, xtol=1e-14, rtol=1e-15))
    held = float((effects * slips * z / (1.0 + slips**2 * z)).sum())
    return normal_load_N * held + mass_kg * speed_m_s**2 * z


def critical_speed_m_s(
    stiffness_N_per_m: float, normal_load_N: float, a: float, b: float, Dc_m: float, mass_kg: float
) -> float:
    """Speed above which inertia makes steady sliding under rate-and-state friction unstable, in m/s.

    It solves k = k_c(v) of :func:`critical_stiffness_N_per_m` for one state: v_c = sqrt(a N Dc / m (k Dc / (N (b - a))
    - 1)). Zero where the machine is softer than N (b - a) / Dc, infinite for a >= b. Source: Rice and Ruina (1983).

    Parameters
    ----------
    stiffness_N_per_m, normal_load_N, mass_kg
        Of the machine and the slider, in N/m, N and kg.
    a, b, Dc_m
        Direct effect, effect of the state, and its slip in m.

    Examples
    --------
    >>> from tribo.slider import critical_speed_m_s
    >>> round(critical_speed_m_s(10_000.0, 10.0, 0.010, 0.015, 10e-6, 0.1), 6)
    0.003162
    """
    if b <= a:
        return math.inf
    excess = stiffness_N_per_m * Dc_m / (normal_load_N * (b - a)) - 1.0
    return math.sqrt(max(excess, 0.0) * a * normal_load_N * Dc_m / mass_kg)


def steady_sliding_speed_m_s(
    mass_kg: float, stiffness_N_per_m: float, damping_N_s_per_m: float, static_minus_sliding_N: float
) -> float:
    """Speed of the drive above which a slider with Coulomb friction does not stick again, in m/s.

    A slider that starts from rest overshoots; with damping, the second swing of its speed relative to the drive is
    smaller. At this speed that swing brings it just to rest. The damping is the sum of that of the machine and the
    viscous friction of the contact. For little damping it is (F_s - F_d) / sqrt(4 pi zeta k m) with zeta = c / (2
    sqrt(k m)) (Derjaguin, Push and Tolstoi, Proc. Conf. Lubrication and Wear, IMechE London (1957) 257); here the
    damped oscillator is solved exactly.

    Parameters
    ----------
    mass_kg, stiffness_N_per_m, damping_N_s_per_m
        Of slider and machine, in kg, N/m and N s/m.
    static_minus_sliding_N
        Static minus sliding friction force, in N.

    Returns
    -------
    float
        In m/s; infinite without damping, 0 at critical damping or beyond, and where static is not above sliding
        friction.

    Examples
    --------
    >>> from tribo.slider import steady_sliding_speed_m_s
    >>> round(steady_sliding_speed_m_s(0.03, 170.0, 0.0452, 0.02), 5)
    0.02465
    """
    from scipy.optimize import brentq

    natural = math.sqrt(stiffness_N_per_m / mass_kg)
    zeta = damping_N_s_per_m / (2.0 * mass_kg * natural)
    if static_minus_sliding_N <= 0.0 or zeta >= 1.0:
        return 0.0
    if zeta <= 0.0:
        return math.inf
    # in units of 1/natural for time and F / sqrt(k m) for speed
    rate = complex(-zeta, math.sqrt(1.0 - zeta**2))

    def slowest(log_speed: float) -> float:
        """Speed of the slider at the trough of its second swing, as a share of that of the drive."""
        speed = math.exp(log_speed)
        swing = complex(-speed, -(1.0 - zeta * speed) / rate.imag)
        trough = (1.5 * math.pi - cmath.phase(swing * rate)) / rate.imag
        return 1.0 + (swing * cmath.exp(rate * trough)).real / speed

    high = math.log(10.0 / math.sqrt(4.0 * math.pi * zeta))
    low = high - 60.0
    scale = static_minus_sliding_N / math.sqrt(stiffness_N_per_m * mass_kg)
    return scale * math.exp(brentq(slowest, low, high, xtol=1e-15, rtol=1e-15))
