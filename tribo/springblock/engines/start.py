"""What every engine starts from and returns: thresholds, the motion up to the first failure, and a trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock.config import SimConfig, mask_of
from tribo.springblock.lattice import Lattice, make_lattice


@dataclass(frozen=True)
class Thresholds:
    """Largest static and sliding friction force of every block in N; zero on cavities. Shape (n,).

    ``again_N`` is the static threshold of a block that has slipped before; None where it is ``static_N``.
    """

    static_N: FloatArray
    sliding_N: FloatArray
    again_N: FloatArray | None = None


@dataclass(frozen=True)
class SliderDrive:
    """Forces while everything sticks: on block i it is ``rate[i] * t``, the cavities moving at ``follow``."""

    velocity: FloatArray  # (2,) of the slider
    follow: FloatArray  # (n, 2) quasi-static velocity of cavity blocks, zero on rigid contact
    rate: FloatArray  # (n, 2) N/s, zero on cavities
    lag: FloatArray  # (n, 2) m, displacement of the blocks that follow under their steady drag
    force_rate: float  # N/s of the slider force along the pull


@dataclass(frozen=True)
class Trajectory:
    """What an engine returns: samples of the slider force, its running integral, and the peaks."""

    time_s: FloatArray
    force_N: FloatArray
    impulse_Ns: FloatArray
    moving: NDArray[np.int64]
    peak_N: float
    peak_s: float
    first_peak_N: float
    first_peak_s: float
    first_failure_s: float
    failed: NDArray[np.int64]  # blocks in the order of their first failures, by number within one step
    end_s: float  # may lie beyond the last sample
    end_impulse_Ns: float
    displacement_m: FloatArray  # (n, 2) at the end
    velocity_m_s: FloatArray  # (n, 2) at the end
    friction_work_J: float
    viscous_work_J: float
    dense_steps: int = 0
    active_block_steps: int = 0
    bond_energy_J: float = 0.0  # in elastic contacts at the end; sliding blocks stretch theirs by friction


def lattice_of(config: SimConfig) -> Lattice:
    """The lattice of a configuration."""
    shear = config.shear_stiffness_N_m / config.stiffness_N_m
    kappa = config.contact_stiffness_Pa_per_m
    bond = None if kappa is None else kappa * config.spacing_m**2 / config.stiffness_N_m
    return make_lattice(mask_of(config), shear, config.edges == "periodic", bond)


def thresholds_of(config: SimConfig, lattice: Lattice) -> Thresholds:
    """Draw the local friction: mu F_n + F_a on contact blocks, none on cavities."""
    n = lattice.contact.size
    rng = np.random.default_rng(config.seed)
    static, sliding = rng.standard_normal((2, n))
    f = config.friction
    share = lattice.area_fraction if config.normal_force == "redistributed" else 1.0
    area = config.spacing_m**2
    normal = config.pressure_Pa * area / share

    def force(mean: float, sd: float, draw: FloatArray, adhesion_Pa: float) -> FloatArray:
        total = np.maximum(mean + sd * draw, 0.0) * normal + adhesion_Pa * area
        total = total if lattice.touching is None else total * lattice.touching
        return np.where(lattice.contact, np.maximum(total, 0.0), 0.0)

    holding = force(f.mu_s, f.mu_s_sd, static, f.static_adhesion_Pa)
    rubbing = force(f.mu_d, f.mu_d_sd, sliding, f.sliding_adhesion_Pa)
    if config.restrengthening == 1.0:
        return Thresholds(holding, rubbing)
    return Thresholds(holding, rubbing, rubbing + config.restrengthening * np.maximum(holding - rubbing, 0.0))


def drive_of(config: SimConfig, lattice: Lattice) -> SliderDrive:
    """Force rates under the slider's velocity, the cavities condensed quasi-statically."""
    angle = np.deg2rad(config.angle_deg)
    direction = np.array([np.cos(angle), np.sin(angle)])
    velocity = config.speed_m_s * direction
    follow = lattice.follow[:-1] @ velocity
    if lattice.bond is None:
        rate = config.stiffness_N_m * (lattice.spring_forces(follow) + lattice.shear * velocity)
        rate[~lattice.contact] = 0.0
    else:
        rate = config.stiffness_N_m * lattice.bond[:, None] * follow
    lag = -config.mass_kg * config.damping_per_s / config.stiffness_N_m * (lattice.lag[:-1] @ velocity)
    pulled = lattice.contact.size * config.speed_m_s - float((follow @ direction).sum())
    return SliderDrive(velocity, follow, rate, lag, config.shear_stiffness_N_m * pulled)


def first_failure_s(lattice: Lattice, thresholds: Thresholds, drive: SliderDrive, stiffness_N_m: float) -> float:
    """Time at which the first contact block reaches its static threshold, exact for small rotations."""
    load = lattice.spring_forces(drive.lag) if lattice.bond is None else lattice.bond[:, None] * drive.lag
    force = stiffness_N_m * load[lattice.contact]
    rate = drive.rate[lattice.contact]
    limit = thresholds.static_N[lattice.contact]
    a = (rate**2).sum(1)
    b = (force * rate).sum(1)
    excess = (force**2).sum(1) - limit**2
    with np.errstate(divide="ignore", invalid="ignore"):
        times = (np.sqrt(np.maximum(b**2 - a * excess, 0.0)) - b) / a
    return float(np.nanmin(np.where(a > 0, times, np.nan)))


def once(blocks: NDArray[np.int64]) -> NDArray[np.int64]:
    """The blocks in their order, each where it appears first."""
    return blocks[np.sort(np.unique(blocks, return_index=True)[1])]
