"""Energy balance: work of the slider, elastic and kinetic energy, friction and viscous damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray
from tribo.springblock.config import SimConfig
from tribo.springblock.engines.state import Trajectory, drive_of
from tribo.springblock.lattice import NEIGHBOURHOOD, Lattice


@dataclass(frozen=True)
class EnergyBalance:
    """Energies of one run in joule, from rest at t = 0 to its end."""

    work_J: float  # of the drive: the integral of force times speed, and what the slider has where the run begins
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
    driven = config.speed_m_s * trajectory.end_s
    way = trajectory.slider_m if config.machine_stiffness_N_per_m else driven
    slider = way * np.array([np.cos(angle), np.sin(angle)])
    u, v = trajectory.displacement_m, trajectory.velocity_m_s
    pulled = u if lattice.pulled is None else u[lattice.pulled]
    shear = 0.5 * config.shear_stiffness_N_m * float(((slider - pulled) ** 2).sum())
    machine = 0.5 * (config.machine_stiffness_N_per_m or 0.0) * (driven - way) ** 2
    mass = config.moved_mass_kg if config.machine_stiffness_N_per_m else 0.0
    work = config.speed_m_s * trajectory.end_impulse_Ns
    if config.machine_stiffness_N_per_m is not None:
        work = _of_the_start(config, lattice, trajectory) + config.speed_m_s * (
            trajectory.end_impulse_Ns - trajectory.impulse_Ns[1]
        )
    return EnergyBalance(
        work_J=work,
        elastic_J=machine + shear + _spring_energy(config, lattice, u) + trajectory.bond_energy_J,
        kinetic_J=0.5 * (config.mass_kg * float((v**2).sum()) + mass * trajectory.slider_m_s**2),
        friction_J=trajectory.friction_work_J,
        viscous_J=trajectory.viscous_work_J + trajectory.damper_work_J,
    )


def _of_the_start(config: SimConfig, lattice: Lattice, trajectory: Trajectory) -> float:
    """Energy in the springs and the slider where a run on a machine begins, on its quasi-static rise."""
    stiffness, damping = config.machine_stiffness_N_per_m or 0.0, config.machine_damping_N_s_per_m or 0.0
    pace, force = drive_of(config, lattice).pace, float(trajectory.force_N[1])
    stretch = (force - damping * config.speed_m_s * (1.0 - pace)) / stiffness
    way = config.speed_m_s * float(trajectory.time_s[1]) - stretch
    moving = 0.5 * config.moved_mass_kg * (pace * config.speed_m_s) ** 2
    return 0.5 * stiffness * stretch**2 + 0.5 * force * way + moving


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
