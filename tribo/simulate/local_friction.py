"""Parameters of the friction of single blocks: the laws themselves are in :mod:`tribo.simulate.friction`."""

from __future__ import annotations

from dataclasses import dataclass

from tribo.display import displayed


@displayed()
@dataclass(frozen=True)
class LocalFriction:
    """Friction of single blocks: Gaussian coefficients and adhesion per area (Berardo 2019, Model parameters).

    A block of normal force F_n holds up to mu_s F_n + F_as and slides against mu_d F_n + F_ad; the adhesion
    tractions here are F_as / l2 and F_ad / l2 in Pa. Coefficients drawn below zero are set to zero.
    """

    mu_s: float = 5.5
    mu_s_sd: float = 0.195
    mu_d: float = 2.9
    mu_d_sd: float = 0.15
    static_adhesion_Pa: float = 23.45e3
    sliding_adhesion_Pa: float = 11.60e3


PAPER = LocalFriction()
"""The local friction of Berardo 2019, fitted there to the flat sample."""


@displayed()
@dataclass(frozen=True)
class FrictionTerms:
    """Local friction that changes during a run; amplitudes of zero, the default, leave the baseline unchanged.

    The laws are in :mod:`tribo.simulate.friction`.

    Parameters
    ----------
    ageing_b, ageing_t0_s
        Static friction grows by ``b ln(1 + t / t0)`` with the time t at rest (Dieterich-Ruina), b >= 0.
    hold_s
        Time at rest before the pull starts.
    speed_a, speed_v0_m_s
        Sliding friction changes by ``a ln(1 + v / v0)`` with the slip speed v of a block.
    """

    ageing_b: float = 0.0
    ageing_t0_s: float = 1e-3
    hold_s: float = 0.0
    speed_a: float = 0.0
    speed_v0_m_s: float = 2e-4

    @property
    def active(self) -> bool:
        return self.ageing_b != 0.0 or self.speed_a != 0.0


NO_TERMS = FrictionTerms()
