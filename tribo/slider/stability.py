"""Where steady sliding gives way to stick-slip: closed forms with their sources."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np


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
