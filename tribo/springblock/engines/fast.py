"""The fast engine: exact jump to the first failure, then the compiled loop over what moves, in chunks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.springblock.config import SimConfig
from tribo.springblock.engines import state as k
from tribo.springblock.engines.active import Active, active_of, advance, assist
from tribo.springblock.engines.bonds import energy_of_bonds
from tribo.springblock.engines.jit import uncollected
from tribo.springblock.engines.state import (
    SliderDrive,
    Thresholds,
    Trajectory,
    drive_of,
    first_failure_s,
    force_at,
    longest_rise_s,
    machine_of,
    once,
    packed,
    time_of,
)
from tribo.springblock.engines.strips import places_of, planes_of
from tribo.springblock.engines.team import helped
from tribo.springblock.lattice import Lattice

_CHUNK = 4096  # samples between two returns from the compiled loop


def integrate(config: SimConfig, lattice: Lattice, thresholds: Thresholds, threads: int = 1) -> Trajectory:
    """One run on the fast engine, with up to ``threads`` threads for a large lattice; their number changes no result.

    Raises
    ------
    SimulationError
        A force became non-finite; the message names the block and the time.
    """
    refuse_thresholds(thresholds, lattice)
    drive = drive_of(config, lattice)
    failure = first_failure_s(lattice, thresholds, drive, config.stiffness_N_m)
    state, numerics = at_rest(config, lattice, thresholds, drive, failure - 1.5 * config.dt_s)
    active = active_set(state, numerics, lattice, drive, config, threads)
    longest = longest_rise_s(config, lattice, thresholds, drive)
    kept: list[k.Samples] = []
    with uncollected(advance), helped(active.orders, lambda thread: assist(active, state, numerics, thread)):
        for samples, step in in_chunks(config, longest, state, numerics, kept):
            advance(active, state, samples, numerics, step)
    put_back(active, state, numerics)
    if numerics.machine is not None:
        failure = numerics.start + 1.5 * config.dt_s / drive.pace
    trajectory = trajectory_of(kept, state, numerics, drive, failure)
    if lattice.bond is None:
        return trajectory
    inside = places_of(active.planes.first, active.planes.width, numerics.nx, numerics.ny)
    elapsed = k.slider_time(trajectory.end_s, numerics.machine) * numerics.dt / numerics.mass
    return replace(trajectory, bond_energy_J=energy_of_bonds(active.planes, inside, elapsed))


def in_chunks(
    config: SimConfig, longest_rise: float, state: k.State, numerics: k.Numerics, kept: list[k.Samples]
) -> Iterator[tuple[k.Samples, int]]:
    """Room for samples and the step to integrate to, until the run has ended; what was sampled goes to ``kept``.

    Without a given duration the run ends where the loop finds its end, or long after the longest rise in s.
    """
    end = config.duration_s
    if end is None:
        end = 2.0 * config.duration_peaks * longest_rise
    until = max(1, int(np.ceil((end - numerics.start) / config.dt_s)))
    while state.counts[k.CODE] == k.RUNNING and state.counts[k.STEP] < until:
        time, force, impulse = (np.zeros(_CHUNK + 1) for _ in range(3))
        moving = np.zeros(_CHUNK + 1, np.int64)
        state.counts[k.N_SAMPLES] = 0
        yield (
            k.Samples(time, force, impulse, moving),
            min(int(state.counts[k.STEP]) + _CHUNK * numerics.stride, until),
        )
        n = int(state.counts[k.N_SAMPLES])
        kept.append(k.Samples(time[:n], force[:n], impulse[:n], moving[:n]))


def active_set(
    state: k.State, numerics: k.Numerics, lattice: Lattice, drive: SliderDrive, config: SimConfig, threads: int = 1
) -> Active:
    """What the compiled loop of the fast engine works on."""
    drag = -config.mass_kg * (config.damping_per_s if numerics.machine is None else 1.0) * drive.follow
    pull = np.where(lattice.contact[:, None], drive.rate, drag)
    return active_of(planes_of(state, numerics, lattice, pull, drive.follow), numerics, threads)


def put_back(active: Active, state: k.State, numerics: k.Numerics) -> None:
    """Write the displacements and velocities of the active set into the state."""
    inside = places_of(active.planes.first, active.planes.width, numerics.nx, numerics.ny)
    p = active.planes
    state.cells[:, k.QX], state.cells[:, k.QY] = p.q_x[inside], p.q_y[inside]
    with np.errstate(over="ignore", invalid="ignore"):  # the caller refuses a run that met such a number
        state.cells[:, k.VX] = p.p_x[inside] * (numerics.dt / numerics.mass)
        state.cells[:, k.VY] = p.p_y[inside] * (numerics.dt / numerics.mass)


def at_rest(
    config: SimConfig, lattice: Lattice, thresholds: Thresholds, drive: SliderDrive, start_s: float
) -> tuple[k.State, k.Numerics]:
    """Everything at rest at a time of the slider shortly before the first failure, and the constants of the run.

    Engines start half a step off, so that no rounding decides in which step the first block fails.
    """
    direction = drive.velocity / config.speed_m_s
    machine, force = machine_of(config, drive, start_s), force_at(config, lattice, drive, start_s)
    start_time = time_of(machine, start_s, force)
    numerics = k.Numerics(
        nx=lattice.nx,
        ny=lattice.ny,
        periodic=lattice.periodic,
        spacing=config.spacing_m if config.rotation == "finite" else 0.0,
        start=start_time,
        dt=config.dt_s,
        stiffness=config.stiffness_N_m,
        shear_stiffness=config.shear_stiffness_N_m,
        inner_shear=config.shear_stiffness_N_m if lattice.pulled is None else 0.0,
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
        elastic=None if lattice.bond is None else True,
        machine=machine,
        pulled=np.array([] if lattice.pulled is None else lattice.pulled, np.int64),  # one type: compiled once
    )
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
    pulls = slice(None) if lattice.pulled is None else lattice.pulled
    state.totals[k.ALONG] = float((drive.lag[pulls] @ drive.velocity).sum() / config.speed_m_s)
    state.totals[k.FORCE] = force
    state.totals[k.PEAK] = state.totals[k.FORCE]
    state.totals[k.PEAK_TIME] = numerics.start
    state.totals[k.INTEGRAL] = 0.5 * state.totals[k.FORCE] * numerics.start
    return state, numerics


def refuse_thresholds(thresholds: Thresholds, lattice: Lattice) -> None:
    """Raise SimulationError where the friction of a block is not a number that a force can have."""
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


def refuse_not_finite(state: k.State, numerics: k.Numerics) -> None:
    """Raise SimulationError with the block and the time where a force became no number."""
    if state.counts[k.CODE] != k.NOT_FINITE:
        return
    raise k.not_finite(
        state.cells[:, k.QX : k.VY + 1], numerics.nx, numerics.start + state.counts[k.STEP] * numerics.dt
    )


def trajectory_of(
    chunks: list[k.Samples], state: k.State, numerics: k.Numerics, drive: SliderDrive, failure: float
) -> Trajectory:
    """The run as an engine returns it; SimulationError where it met a number that is not finite."""
    refuse_not_finite(state, numerics)
    time, force, impulse, moving = (np.concatenate(part) for part in zip(*chunks, strict=True))
    totals = state.totals
    start = (0.0, numerics.start)
    now = numerics.start + int(state.counts[k.STEP]) * numerics.dt
    machine, slider_s = numerics.machine, k.slider_time(now, numerics.machine)
    at_start = numerics.force_rate * (numerics.start if machine is None else float(machine[k.BEGAN]))
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
        displacement_m=state.cells[:, k.QX : k.QY + 1] + drive.follow * slider_s,
        velocity_m_s=state.cells[:, k.VX : k.VY + 1] + drive.follow * k.pace_before(machine),
        friction_work_J=float(totals[k.FRICTION_WORK]),
        viscous_work_J=float(totals[k.VISCOUS_WORK]),
        dense_steps=int(state.counts[k.DENSE_STEPS]),
        active_block_steps=int(state.counts[k.ACTIVE_STEPS]),
        slider_m=slider_s * numerics.speed,
        slider_m_s=k.pace_before(machine) * numerics.speed,
        damper_work_J=0.0 if machine is None else float(machine[k.LOSS]),
    )
