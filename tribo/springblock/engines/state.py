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
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.errors import Problem, SimulationError
from tribo.records import FloatArray
from tribo.springblock.config import FrictionTerms, SimConfig, mask_of
from tribo.springblock.engines.jit import inner
from tribo.springblock.lattice import Lattice, make_lattice

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


# the slider on a machine that is not rigid, places in Numerics.machine. Its time is its way over the speed of the
# drive; PACE, the rate of that time, belongs to the middle of the steps, as velocities do; GAIN is the rate of PACE,
# CARRIED, the largest momentum of a block that follows at a pace of 1
SLIDER, PACE, GAIN, SPRING, DAMPER, INERTIA, SPEED, LOSS, BEGAN, CARRIED, N_MACHINE = range(11)


@inner
def slider_time(t: float, machine: FloatArray | None) -> float:
    """Time of the slider at time t: t itself where the machine is rigid."""
    if machine is None:
        return t
    return machine[SLIDER]


@inner
def drag_rate(damping: float, machine: FloatArray | None) -> float:
    """Drag and inertia of a block of mass 1 that follows the slider with velocity 1 a unit of its time."""
    if machine is None:
        return damping
    return damping * machine[PACE] + machine[GAIN]


@inner
def drag_weight(damping: float, machine: FloatArray | None) -> float:
    """What multiplies the drag of a cavity block that follows; that of a rigid machine is the same at all times."""
    if machine is None:
        return 1.0
    return drag_rate(damping, machine)


@inner
def pace_before(machine: FloatArray | None) -> float:
    """Speed of the slider over that of the drive half a step ago."""
    if machine is None:
        return 1.0
    return machine[PACE]


@inner
def pace_after(dt: float, machine: FloatArray | None) -> float:
    """The same half a step ahead."""
    if machine is None:
        return 1.0
    return machine[PACE] + machine[GAIN] * dt


@inner
def drive_force(t: float, machine: FloatArray) -> float:
    """Force of spring and damper between the drive and the slider."""
    return machine[SPRING] * (t - machine[SLIDER]) + machine[DAMPER] * (1.0 - machine[PACE])


@inner
def force_on_drive(t: float, on_slider: float, machine: FloatArray | None) -> float:
    """The force that a run records: that of the machine, or where it is rigid that of the slider."""
    if machine is None:
        return on_slider
    return drive_force(t, machine)


@inner
def accelerate_slider(t: float, along: float, c: Numerics, machine: FloatArray | None) -> None:
    """Find how fast the pace of the slider changes in the step that begins."""
    if machine is None:
        return
    held = c.force_rate * machine[SLIDER] - c.shear_stiffness * along
    machine[GAIN] = (drive_force(t, machine) - held) / machine[INERTIA]


@inner
def move_slider(dt: float, machine: FloatArray | None) -> None:
    """Move the slider by a step."""
    if machine is None:
        return
    machine[PACE] += machine[GAIN] * dt
    machine[SLIDER] += machine[PACE] * dt
    machine[LOSS] += machine[DAMPER] * machine[SPEED] * (1.0 - machine[PACE]) ** 2 * dt


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
    inner_shear: float  # K_s on blocks within the lattice: zero where only an edge is pulled
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
    pulled: NDArray[np.int64]  # blocks that the slider pulls; empty where it pulls all
    law: FloatArray | None  # parameters of the friction terms; None compiles to loops without them
    elastic: bool | None = None  # True where contact is elastic; None compiles to loops of rigid contact
    machine: FloatArray | None = None  # the slider, which the loops move; None compiles to loops of a rigid machine


@inner
def observe(steps: int, moving: int, s: State, out: Samples, c: Numerics) -> None:
    """Advance the clock by ``steps`` within which the slider force is affine, and keep samples and peaks."""
    from_step = s.counts[STEP]
    to_step = from_step + steps
    t = c.start + to_step * c.dt
    before = s.totals[FORCE]
    force = force_on_drive(t, c.force_rate * t - c.shear_stiffness * s.totals[ALONG], c.machine)
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


def not_finite(blocks: FloatArray, nx: int, t: float) -> SimulationError:
    """The error of a run in which a force became no number, with the first block (n, ...) and the time in s."""
    bad = np.flatnonzero(~np.isfinite(blocks).all(axis=1))
    y, x = divmod(int(bad[0]), nx) if bad.size else (-1, -1)
    return SimulationError(
        Problem(
            "not_finite", f"the force is no longer finite at t = {t:.9g} s",
            found=f"{bad.size} blocks, the first at x = {x}, y = {y}", allowed="a smaller dt_s",
        )
    )


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
    """Forces while everything sticks: on block i it is ``rate[i] * t``, the cavities moving at ``follow``.

    Here and in the engines t is the time of the slider, its way over the speed of the drive; where the machine is not
    rigid, the slider moves at the share ``pace`` of that speed while everything sticks, and behind its time.
    """

    velocity: FloatArray  # (2,) of the slider
    follow: FloatArray  # (n, 2) quasi-static velocity of cavity blocks, zero on rigid contact
    rate: FloatArray  # (n, 2) N/s, zero on cavities
    lag: FloatArray  # (n, 2) m, displacement of the blocks that follow under their steady drag
    force_rate: float  # N/s of the slider force along the pull
    pace: float = 1.0  # speed of the slider over that of the drive


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
    slider_m: float = 0.0  # way of the slider at the end
    slider_m_s: float = 0.0  # and its speed
    damper_work_J: float = 0.0  # lost in the damper of the machine


def lattice_of(config: SimConfig) -> Lattice:
    """The lattice of a configuration."""
    shear = config.shear_stiffness_N_m / config.stiffness_N_m
    kappa = config.contact_stiffness_Pa_per_m
    bond = None if kappa is None else kappa * config.spacing_m**2 / config.stiffness_N_m
    return make_lattice(mask_of(config), shear, config.edges == "periodic", bond, config.pulled_side)


def thresholds_of(config: SimConfig, lattice: Lattice) -> Thresholds:
    """Draw the local friction: mu F_n + F_a on contact blocks, none on cavities."""
    nx, ny = config.blocks
    rng = np.random.default_rng(config.seed)
    side = 1 if config.friction_patch_m is None else round(config.friction_patch_m / config.spacing_m)
    drawn = rng.standard_normal((2, -(-ny // side), -(-nx // side)))
    static, sliding = drawn.repeat(side, axis=1).repeat(side, axis=2)[:, :ny, :nx].reshape(2, nx * ny)
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
        rate = config.stiffness_N_m * (lattice.spring_forces(follow) + lattice.slider[:, None] * velocity)
        rate[~lattice.contact] = 0.0
    else:
        rate = config.stiffness_N_m * lattice.bond[:, None] * follow
    lag = -config.mass_kg * config.damping_per_s / config.stiffness_N_m * (lattice.lag[:-1] @ velocity)
    pulls = slice(None) if lattice.pulled is None else lattice.pulled
    followed = follow[pulls]
    pulled = len(followed) * config.speed_m_s - float((followed @ direction).sum())
    force_rate = config.shear_stiffness_N_m * pulled
    if config.machine_stiffness_N_per_m is None:
        return SliderDrive(velocity, follow, rate, lag, force_rate)
    machine_rate = config.machine_stiffness_N_per_m * config.speed_m_s
    pace = machine_rate / (machine_rate + force_rate)
    return SliderDrive(velocity, follow, rate, pace * lag, force_rate, pace)


def force_at(config: SimConfig, lattice: Lattice, drive: SliderDrive, slider_s: float) -> float:
    """Force of the slider while everything sticks, at a time of the slider."""
    pulls = slice(None) if lattice.pulled is None else lattice.pulled
    along = float((drive.lag[pulls] @ drive.velocity).sum() / config.speed_m_s)
    return drive.force_rate * slider_s - config.shear_stiffness_N_m * along


def machine_of(config: SimConfig, drive: SliderDrive, slider_s: float) -> FloatArray | None:
    """The slider on its machine as the loops take it, while everything sticks; None where the machine is rigid."""
    if config.machine_stiffness_N_per_m is None:
        return None
    machine = np.zeros(N_MACHINE)
    machine[SLIDER] = machine[BEGAN] = slider_s
    machine[CARRIED] = config.mass_kg * float(np.hypot(*drive.follow.T).max())
    machine[PACE], machine[SPEED] = drive.pace, config.speed_m_s
    machine[SPRING] = config.machine_stiffness_N_per_m * config.speed_m_s
    machine[DAMPER] = (config.machine_damping_N_s_per_m or 0.0) * config.speed_m_s
    machine[INERTIA] = config.moved_mass_kg * config.speed_m_s
    return machine


def time_of(machine: FloatArray | None, slider_s: float, force_N: float) -> float:
    """Time at which the slider is where its own time is ``slider_s``, while everything sticks."""
    if machine is None:
        return slider_s
    return float(slider_s + (force_N - machine[DAMPER] * (1.0 - machine[PACE])) / machine[SPRING])


def longest_rise_s(config: SimConfig, lattice: Lattice, thresholds: Thresholds, drive: SliderDrive) -> float:
    """A time within which the force has reached all that the blocks can hold together."""
    compliance = 1.0 / drive.force_rate
    if lattice.pulled is not None:
        across, along = len(lattice.pulled), lattice.contact.size // len(lattice.pulled)
        compliance += along / (config.stiffness_N_m * across * config.speed_m_s)
    if config.machine_stiffness_N_per_m is not None:
        compliance += 1.0 / (config.machine_stiffness_N_per_m * config.speed_m_s)
    return float(thresholds.static_N.sum()) * compliance


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
