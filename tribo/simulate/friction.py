"""Terms of the local friction law that act while a run goes on, each a function of its own.

A term takes a threshold and returns the changed one; with an amplitude of zero it returns the identical number.
:func:`static_threshold` and :func:`sliding_threshold` combine the terms; the loops call only these two. A new term
is its function, its parameters in :class:`tribo.simulate.config.FrictionTerms` and in :func:`packed`, and its place in
a chain. What depends only on the position of a block (its pressure, neighbouring cavities) needs no term: it is part
of the thresholds of the blocks.
"""

from __future__ import annotations

import math

import numpy as np

from tribo.records import FloatArray
from tribo.simulate.engines.jit import inner
from tribo.simulate.local_friction import FrictionTerms

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
