"""The fast engine: exact jump to the first failure, then the compiled loop over what moves, in chunks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.errors import Problem, SimulationError
from tribo.records import FloatArray
from tribo.springblock.config import SimConfig, mask_of
from tribo.springblock.engines import state as k
from tribo.springblock.engines.active import Active, active_of, advance, assist
from tribo.springblock.engines.dense import advance_dense
from tribo.springblock.engines.jit import uncollected
from tribo.springblock.engines.state import packed
from tribo.springblock.engines.strips import places_of, planes_of
from tribo.springblock.engines.team import helped
from tribo.springblock.lattice import Lattice, make_lattice

_CHUNK = 4096  # samples between two returns from the compiled loop


@dataclass(frozen=True)
class Thresholds:
    """Largest static and sliding friction force of every block in N; zero on cavities. Shape (n,).

    ``again_N`` is the static threshold of a block that has slipped before; None where it is ``static_N``.
    """

    static_N: FloatArray
    sliding_N: FloatArray
    again_N: FloatArray | None = None


@dataclass(frozen=True)
class Drive:
    """Forces while everything sticks: on block i it is ``rate[i] * t``, the cavities moving at ``follow``."""

    velocity: FloatArray  # (2,) of the slider
    follow: FloatArray  # (n, 2) quasi-static velocity of cavity blocks, zero on contact
    rate: FloatArray  # (n, 2) N/s, zero on cavities
    lag: FloatArray  # (n, 2) m, displacement of cavity blocks under their steady drag
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


def lattice_of(config: SimConfig) -> Lattice:
    """The lattice of a configuration."""
    shear = config.shear_stiffness_N_m / config.stiffness_N_m
    return make_lattice(mask_of(config), shear, config.edges == "periodic")


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
        return np.where(lattice.contact, np.maximum(total, 0.0), 0.0)

    holding = force(f.mu_s, f.mu_s_sd, static, f.static_adhesion_Pa)
    rubbing = force(f.mu_d, f.mu_d_sd, sliding, f.sliding_adhesion_Pa)
    if config.restrengthening == 1.0:
        return Thresholds(holding, rubbing)
    return Thresholds(holding, rubbing, rubbing + config.restrengthening * np.maximum(holding - rubbing, 0.0))


def drive_of(config: SimConfig, lattice: Lattice) -> Drive:
    """Force rates under the slider's velocity, the cavities condensed quasi-statically."""
    angle = np.deg2rad(config.angle_deg)
    direction = np.array([np.cos(angle), np.sin(angle)])
    velocity = config.speed_m_s * direction
    follow = lattice.follow[:-1] @ velocity
    rate = config.stiffness_N_m * (lattice.spring_forces(follow) + lattice.shear * velocity)
    rate[~lattice.contact] = 0.0
    lag = -config.mass_kg * config.damping_per_s / config.stiffness_N_m * (lattice.lag[:-1] @ velocity)
    pulled = lattice.contact.size * config.speed_m_s - float((follow @ direction).sum())
    return Drive(velocity, follow, rate, lag, config.shear_stiffness_N_m * pulled)


def first_failure_s(lattice: Lattice, thresholds: Thresholds, drive: Drive, stiffness_N_m: float) -> float:
    """Time at which the first contact block reaches its static threshold, exact for small rotations."""
    force = stiffness_N_m * lattice.spring_forces(drive.lag)[lattice.contact]
    rate = drive.rate[lattice.contact]
    limit = thresholds.static_N[lattice.contact]
    a = (rate**2).sum(1)
    b = (force * rate).sum(1)
    excess = (force**2).sum(1) - limit**2
    with np.errstate(divide="ignore", invalid="ignore"):
        times = (np.sqrt(np.maximum(b**2 - a * excess, 0.0)) - b) / a
    return float(np.nanmin(np.where(a > 0, times, np.nan)))


def run_fast(config: SimConfig, lattice: Lattice, thresholds: Thresholds, threads: int = 1) -> Trajectory:
    """One run on the fast engine (or on its dense step alone, for ``engine="dense"``).

    The fast engine uses up to ``threads`` threads for a large lattice. The result does not depend on their number.

    Raises
    ------
    SimulationError
        A force became non-finite; the message names the block and the time.
    """
    _refuse_thresholds(thresholds, lattice)
    drive = drive_of(config, lattice)
    failure = first_failure_s(lattice, thresholds, drive, config.stiffness_N_m)
    # half a step off, so that no rounding decides in which step the first block fails
    numerics = _numerics(config, lattice, thresholds, drive, failure - 1.5 * config.dt_s)
    state = _initial_state(config, lattice, thresholds, drive, numerics)
    until = _last_step(config, thresholds, numerics)
    if config.engine == "dense":
        chunks = _in_chunks(
            state, numerics, until, lambda out, step: advance_dense(state, out, numerics, step, lattice, drive.follow)
        )
    else:
        active = active_set(state, numerics, lattice, drive, config, threads)
        with uncollected(advance), helped(active.team, lambda k: assist(active, state, numerics, k)):
            chunks = _in_chunks(state, numerics, until, lambda out, step: advance(active, state, out, numerics, step))
        put_back(active, state, numerics)
    _refuse_not_finite(state, numerics)
    return _trajectory(chunks, state, numerics, drive, failure)


def _in_chunks(
    state: k.State, numerics: k.Numerics, until: int, advance_to: Callable[[k.Samples, int], None]
) -> list[k.Samples]:
    """Integrate to a step, or until the run has finished, and return what was kept."""
    chunks: list[k.Samples] = []
    while state.counts[k.CODE] == k.RUNNING and state.counts[k.STEP] < until:
        samples = k.Samples(
            np.zeros(_CHUNK + 1), np.zeros(_CHUNK + 1), np.zeros(_CHUNK + 1), np.zeros(_CHUNK + 1, np.int64)
        )
        state.counts[k.N_SAMPLES] = 0
        advance_to(samples, min(int(state.counts[k.STEP]) + _CHUNK * numerics.stride, until))
        chunks.append(_first(samples, int(state.counts[k.N_SAMPLES])))
    return chunks


def active_set(
    state: k.State, numerics: k.Numerics, lattice: Lattice, drive: Drive, config: SimConfig, threads: int = 1
) -> Active:
    """What the compiled loop of the fast engine works on."""
    drag = -config.mass_kg * config.damping_per_s * drive.follow
    pull = np.where(lattice.contact[:, None], drive.rate, drag)
    return active_of(*planes_of(state, numerics, lattice, pull), numerics, threads)


def put_back(active: Active, state: k.State, numerics: k.Numerics) -> None:
    """Write the displacements and velocities of the active set into the state."""
    inside = places_of(active.layout, numerics.nx, numerics.ny)
    p = active.planes
    state.cells[:, k.QX], state.cells[:, k.QY] = p.q_x[inside], p.q_y[inside]
    with np.errstate(over="ignore", invalid="ignore"):  # the caller refuses a run that met such a number
        state.cells[:, k.VX] = p.p_x[inside] * (numerics.dt / numerics.mass)
        state.cells[:, k.VY] = p.p_y[inside] * (numerics.dt / numerics.mass)


def once(blocks: NDArray[np.int64]) -> NDArray[np.int64]:
    """The blocks in their order, each where it appears first."""
    return blocks[np.sort(np.unique(blocks, return_index=True)[1])]


def _first(samples: k.Samples, n: int) -> k.Samples:
    return k.Samples(samples.time[:n], samples.force[:n], samples.impulse[:n], samples.moving[:n])


def _numerics(
    config: SimConfig, lattice: Lattice, thresholds: Thresholds, drive: Drive, start: float
) -> k.Numerics:
    direction = drive.velocity / config.speed_m_s
    return k.Numerics(
        nx=lattice.nx,
        ny=lattice.ny,
        periodic=lattice.periodic,
        spacing=config.spacing_m if config.rotation == "finite" else 0.0,
        start=start,
        dt=config.dt_s,
        stiffness=config.stiffness_N_m,
        shear_stiffness=config.shear_stiffness_N_m,
        mass=config.mass_kg,
        damping=config.damping_per_s,
        speed=config.speed_m_s,
        direction_x=float(direction[0]),
        direction_y=float(direction[1]),
        force_rate=drive.force_rate,
        rest_force=config.rest_tolerance * float(thresholds.sliding_N[lattice.contact].mean()),
        stride=max(1, round(config.sample_interval_s / config.dt_s)),
        stop_at_peaks=np.inf if config.duration_s is not None else config.duration_peaks,
        peak_drop=config.peak_drop,
        law=packed(config.terms),
    )


def _initial_state(
    config: SimConfig, lattice: Lattice, thresholds: Thresholds, drive: Drive, numerics: k.Numerics
) -> k.State:
    """Everything at rest shortly before the first failure."""
    n = lattice.contact.size
    cells = np.zeros((n, k.WIDTH))
    cells[:, k.QX : k.QY + 1] = drive.lag
    cells[:, k.FS], cells[:, k.FD] = thresholds.static_N, thresholds.sliding_N
    cells[:, k.FA] = thresholds.static_N if thresholds.again_N is None else thresholds.again_N
    cells[:, k.SINCE] = -config.terms.hold_s
    state = k.State(
        cells=cells,
        failed=np.full((2, min(n, 64)), -1, np.int64),
        counts=np.zeros(k.N_COUNTS, np.int64),
        totals=np.zeros(k.N_TOTALS),
    )
    along = float((drive.lag @ drive.velocity).sum() / config.speed_m_s)
    state.totals[k.ALONG] = along
    state.totals[k.FORCE] = drive.force_rate * numerics.start - config.shear_stiffness_N_m * along
    state.totals[k.PEAK] = state.totals[k.FORCE]
    state.totals[k.PEAK_TIME] = numerics.start
    state.totals[k.INTEGRAL] = 0.5 * state.totals[k.FORCE] * numerics.start
    return state


def _last_step(config: SimConfig, thresholds: Thresholds, numerics: k.Numerics) -> int:
    """End of the run in steps; without a given duration a bound that no peak can pass."""
    end = config.duration_s
    if end is None:
        end = 2.0 * config.duration_peaks * float(thresholds.static_N.sum()) / numerics.force_rate
    return max(1, int(np.ceil((end - numerics.start) / config.dt_s)))


def _refuse_thresholds(thresholds: Thresholds, lattice: Lattice) -> None:
    fine = [np.isfinite(values) & (values >= 0.0) for values in (thresholds.static_N, thresholds.sliding_N)]
    bad = np.flatnonzero(~(fine[0] & fine[1]))
    if bad.size:
        y, x = divmod(int(bad[0]), lattice.nx)
        raise SimulationError(
            Problem(
                "threshold", "the friction of a block is not a finite number >= 0",
                found=f"{bad.size} blocks, the first at x = {x}, y = {y}", allowed="finite forces in N, >= 0",
            )
        )


def _refuse_not_finite(state: k.State, numerics: k.Numerics) -> None:
    if state.counts[k.CODE] != k.NOT_FINITE:
        return
    bad = np.flatnonzero(~np.isfinite(state.cells[:, k.QX : k.VY + 1]).all(axis=1))
    y, x = divmod(int(bad[0]), numerics.nx) if bad.size else (-1, -1)
    t = numerics.start + state.counts[k.STEP] * numerics.dt
    raise SimulationError(
        Problem(
            "not_finite", f"the force is no longer finite at t = {t:.9g} s",
            found=f"{bad.size} blocks, the first at x = {x}, y = {y}", allowed="a smaller dt_s",
        )
    )


def _trajectory(
    chunks: list[k.Samples], state: k.State, numerics: k.Numerics, drive: Drive, failure: float
) -> Trajectory:
    time, force, impulse, moving = (np.concatenate(part) for part in zip(*chunks, strict=True))
    totals = state.totals
    start = (0.0, numerics.start)
    now = numerics.start + int(state.counts[k.STEP]) * numerics.dt
    at_start = numerics.force_rate * numerics.start
    found = totals[k.FIRST_FOUND] > 0
    blocks, steps = state.failed[:, : state.counts[k.N_FAILED]]
    return Trajectory(
        time_s=np.concatenate([start, time]),
        force_N=np.concatenate([(0.0, at_start), force]),
        impulse_Ns=np.concatenate([(0.0, 0.5 * at_start * numerics.start), impulse]),
        moving=np.concatenate([np.zeros(2, np.int64), moving]),
        peak_N=float(totals[k.PEAK]),
        peak_s=float(totals[k.PEAK_TIME]),
        first_peak_N=float(totals[k.FIRST if found else k.PEAK]),
        first_peak_s=float(totals[k.FIRST_TIME if found else k.PEAK_TIME]),
        first_failure_s=failure,
        failed=once(blocks[np.lexsort((blocks, steps))]),
        end_s=now,
        end_impulse_Ns=float(totals[k.INTEGRAL]),
        displacement_m=state.cells[:, k.QX : k.QY + 1] + drive.follow * now,
        velocity_m_s=state.cells[:, k.VX : k.VY + 1] + drive.follow,
        friction_work_J=float(totals[k.FRICTION_WORK]),
        viscous_work_J=float(totals[k.VISCOUS_WORK]),
        dense_steps=int(state.counts[k.DENSE_STEPS]),
        active_block_steps=int(state.counts[k.ACTIVE_STEPS]),
    )
