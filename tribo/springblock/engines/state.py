"""What every compiled engine shares: terms of the friction law, state and constants of a run, samples of the force.

A term of the friction law takes a threshold and returns the changed one; with an amplitude of zero it returns the
identical number. :func:`static_threshold` and :func:`sliding_threshold` combine the terms; the loops call only these
two. A new term is its function, its parameters in :class:`tribo.springblock.config.FrictionTerms` and in
:func:`packed`, and its place in a chain. What depends only on the position of a block needs no term: it is part of the
thresholds of the blocks.

Displacements in a :class:`State` are counted from the quasi-static ones: a cavity block follows the slider at a known
velocity w while all contact blocks stick, and q is what a block does beyond w t. In these coordinates the in-plane
force on a block is G + R t with R constant in time and zero on cavities, and G changes only when a neighbour moves.
Times are steps of dt from ``Numerics.start``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock.config import FrictionTerms
from tribo.springblock.engines.jit import inner

# places in the parameter array
AGEING_B, AGEING_T0, SPEED_A, SPEED_V0, N_PARAMETERS = range(5)


def packed(terms: FrictionTerms) -> FloatArray | None:
    """The parameters as the loops take them; None without terms: the loops are then compiled without them."""
    if not terms.active:
        return None
    law = np.zeros(N_PARAMETERS)
    law[AGEING_B], law[AGEING_T0] = terms.ageing_b, terms.ageing_t0_s
    law[SPEED_A], law[SPEED_V0] = terms.speed_a, terms.speed_v0_m_s
    return law


@inner
def aged(threshold_N: float, held_s: float, law: FloatArray | None) -> float:
    """F (1 + b ln(1 + t / t0)): contacts strengthen with the time at rest t in s (never negative)."""
    if law is None:
        return threshold_N
    if law[AGEING_B] == 0.0:
        return threshold_N
    return threshold_N * (1.0 + law[AGEING_B] * math.log1p(max(held_s, 0.0) / law[AGEING_T0]))


@inner
def at_speed(threshold_N: float, speed_m_s: float, law: FloatArray | None) -> float:
    """F (1 + a ln(1 + v / v0)): sliding friction depends on the slip speed v in m/s; never below zero."""
    if law is None:
        return threshold_N
    if law[SPEED_A] == 0.0:
        return threshold_N
    return max(threshold_N * (1.0 + law[SPEED_A] * math.log1p(speed_m_s / law[SPEED_V0])), 0.0)


@inner
def static_threshold(base_N: float, held_s: float, law: FloatArray | None) -> float:
    """Largest friction force (N) of a block at rest; ``base_N`` is mu_s F_n + F_as (Amontons-Coulomb, adhesion)."""
    return aged(base_N, held_s, law)


@inner
def sliding_threshold(base_N: float, speed_m_s: float, law: FloatArray | None) -> float:
    """Friction force (N) of a sliding block; ``base_N`` is mu_d F_n + F_ad."""
    return at_speed(base_N, speed_m_s, law)


# columns of State.cells: displacement q, velocity beyond w, thresholds (static now, sliding, static after a slip),
# time of the last stop
QX, QY, VX, VY, FS, FD, FA, SINCE, WIDTH = range(9)
# State.counts
STEP, N_SAMPLES, N_FAILED, CODE, DENSE_STEPS, ACTIVE_STEPS, N_COUNTS = range(7)
# State.totals
ALONG, INTEGRAL, FORCE, PEAK, PEAK_TIME, FIRST, FIRST_TIME, FIRST_FOUND = range(8)
FRICTION_WORK, VISCOUS_WORK, N_TOTALS = range(8, 11)
RUNNING, FINISHED, NOT_FINITE = range(3)


class State(NamedTuple):
    """The blocks of a run, and its counters and sums."""

    cells: FloatArray  # (n, WIDTH); an engine keeps its own copy while it integrates
    failed: NDArray[np.int64]  # (2, m): the first m failures, block and step
    counts: NDArray[np.int64]
    totals: FloatArray


class Samples(NamedTuple):
    """What is kept of a run: one entry every ``numerics.stride`` steps. ``impulse`` is the integral of force."""

    time: FloatArray
    force: FloatArray
    impulse: FloatArray
    moving: NDArray[np.int64]


class Numerics(NamedTuple):
    """Constants of one run, SI units."""

    nx: int
    ny: int
    periodic: bool
    spacing: float  # l for springs of finite rotation, 0 for linear ones
    start: float  # time of step 0
    dt: float
    stiffness: float  # K_int
    shear_stiffness: float  # K_s
    mass: float
    damping: float  # gamma, 1/s
    speed: float  # of the slider
    direction_x: float
    direction_y: float
    force_rate: float  # slider force per time while everything sticks
    rest_force: float  # cavity blocks below this force and the matching velocity come to rest
    stride: int
    stop_at_peaks: float  # stop once the time exceeds this multiple of the peak time
    peak_drop: float  # the first peak is found once the force has fallen by this share
    law: FloatArray | None  # parameters of the friction terms; None compiles to loops without them
    elastic: bool | None = None  # True where contact is elastic; None compiles to loops of rigid contact


@inner
def observe(steps: int, moving: int, s: State, out: Samples, c: Numerics) -> None:
    """Advance the clock by ``steps`` within which the slider force is affine, and keep samples and peaks."""
    from_step = s.counts[STEP]
    to_step = from_step + steps
    t = c.start + to_step * c.dt
    before = s.totals[FORCE]
    force = c.force_rate * t - c.shear_stiffness * s.totals[ALONG]
    due = (from_step // c.stride + 1) * c.stride
    while due <= to_step:
        share = (due - from_step) / steps
        here = before + share * (force - before)
        n = s.counts[N_SAMPLES]
        out.time[n] = c.start + due * c.dt
        out.force[n] = here
        out.impulse[n] = s.totals[INTEGRAL] + 0.5 * (before + here) * (due - from_step) * c.dt
        out.moving[n] = moving if due == to_step else 0
        s.counts[N_SAMPLES] += 1
        due += c.stride
    s.totals[INTEGRAL] += 0.5 * (before + force) * steps * c.dt
    s.totals[FORCE] = force
    s.counts[STEP] = to_step
    if force > s.totals[PEAK]:
        s.totals[PEAK] = force
        s.totals[PEAK_TIME] = t
    elif s.totals[FIRST_FOUND] == 0.0 and force < (1.0 - c.peak_drop) * s.totals[PEAK]:
        s.totals[FIRST] = s.totals[PEAK]
        s.totals[FIRST_TIME] = s.totals[PEAK_TIME]
        s.totals[FIRST_FOUND] = 1.0
    if not math.isfinite(force):
        s.counts[CODE] = NOT_FINITE
    elif t > c.stop_at_peaks * s.totals[PEAK_TIME]:
        s.counts[CODE] = FINISHED
