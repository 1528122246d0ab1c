"""Energy balance: work of the slider, elastic and kinetic energy, friction and viscous damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray
from tribo.springblock.config import SimConfig
from tribo.springblock.engines.state import Trajectory
from tribo.springblock.lattice import NEIGHBOURHOOD, Lattice


@dataclass(frozen=True)
class EnergyBalance:
    """Energies of one run in joule, from rest at t = 0 to its end."""

    work_J: float  # of the slider: the integral of force times speed
    elastic_J: float
    kinetic_J: float
    friction_J: float
    viscous_J: float

    @property
    def residual(self) -> float:
        """What is missing, as a share of the work."""
        spent = self.elastic_J + self.kinetic_J + self.friction_J + self.viscous_J
        return (self.work_J - spent) / self.work_J


def energy_balance(config: SimConfig, lattice: Lattice, trajectory: Trajectory) -> EnergyBalance:
    """Balance of a run."""
    angle = np.deg2rad(config.angle_deg)
    slider = config.speed_m_s * trajectory.end_s * np.array([np.cos(angle), np.sin(angle)])
    u, v = trajectory.displacement_m, trajectory.velocity_m_s
    shear = 0.5 * config.shear_stiffness_N_m * float(((slider - u) ** 2).sum())
    return EnergyBalance(
        work_J=config.speed_m_s * trajectory.end_impulse_Ns,
        elastic_J=shear + _spring_energy(config, lattice, u) + trajectory.bond_energy_J,
        kinetic_J=0.5 * config.mass_kg * float((v**2).sum()),
        friction_J=trajectory.friction_work_J,
        viscous_J=trajectory.viscous_work_J,
    )


def _spring_energy(config: SimConfig, lattice: Lattice, u: FloatArray) -> float:
    """Sum of k (r - l)2 / 2 over all springs, or of its linearisation."""
    n = len(u)
    padded = np.concatenate([u, np.zeros((1, 2))])
    energy = 0.0
    for k, (*offset, share) in enumerate(NEIGHBOURHOOD):
        near = lattice.neighbours[:n, k]
        rest = config.spacing_m * np.array(offset, float)
        length = float(np.hypot(*rest))
        stretch = (padded[near] - u)[near < n]
        change = np.hypot(*(rest + stretch).T) - length if config.rotation == "finite" else stretch @ rest / length
        # each spring is met from both its ends
        energy += 0.25 * config.stiffness_N_m * share * float((change**2).sum())
    return energy
