"""The model as printed by Berardo et al. (2019), on all blocks at every step: the reference for the other engines.

Springs of the full r_ij (or linearised, for comparison), fourth-order Runge-Kutta, 1e-8 s in the paper. Where
the text gives no details, these choices were made:

- The shear force is K_s (v t + r0 - r); the paper prints it without K_s.
- Stick or slip is decided at the start of a step and holds for its four stages. A block at rest starts to slide
  when its driving force exceeds its static threshold; else it stays where it is.
- Friction opposes the velocity a block has at the start of a step (its driving force where that is zero), and
  keeps that direction for the four stages. Taken anew at each stage it flips within the last step of a slip,
  averages out, and blocks hover instead of stopping; the energy balance then fails by a factor.
- A sliding block comes to rest when a step turns its velocity by more than a right angle. Its position stays
  that of the step; its velocity becomes zero. Other rules (``sticking``) replace this one on request.
- Cavity blocks feel no friction and never stick.
- Where contact is elastic, a block at rest is bound to the track by a spring and moves with it. The spring yields at
  the static threshold; a block that comes to rest is bound again by a spring that holds it with its sliding friction.
- A run starts at a given share of the first failure, the contact blocks unmoved and the cavities at their
  quasi-static displacement and velocity; what finite rotation adds to that dies out within microseconds.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock.config import SimConfig
from tribo.springblock.engines.jit import compiled
from tribo.springblock.engines.state import (
    DAMPER,
    INERTIA,
    LOSS,
    PACE,
    SLIDER,
    SPEED,
    SPRING,
    Samples,
    Thresholds,
    Trajectory,
    drive_of,
    first_failure_s,
    longest_rise_s,
    machine_of,
    not_finite,
    once,
    time_of,
)
from tribo.springblock.lattice import NEIGHBOURHOOD, NEIGHBOURS, Lattice

START_SHARE = 0.98  # of the first failure


class Model(NamedTuple):
    """A run in SI units: its constants, and every block now, which each step changes in place; arrays over n blocks."""

    neighbours: NDArray[np.int64]  # (n + 1, NEIGHBOURS), n where there is none
    rest: FloatArray  # (NEIGHBOURS, 3): rest vector to each neighbour and its length
    springs: FloatArray  # (NEIGHBOURS,): k_ij
    static: FloatArray  # (n,) lowered to ``again`` when a block slips
    sliding: FloatArray
    contact: NDArray[np.bool_]
    shear: FloatArray  # (n,) stiffness of the spring between each block and the slider
    mass: float
    damping: float
    velocity: FloatArray  # (2,) of the slider
    finite: bool
    again: FloatArray  # (n,): static threshold of a block that has slipped
    rule: int  # when a sliding block comes to rest: TURNED, SLOW or NEVER
    slow: float  # m/s, for SLOW
    test_every: int  # steps between two tests for rest
    elastic: bool
    bond: FloatArray  # (n,) stiffness of contact, zero on cavities and where it is rigid
    anchor: FloatArray  # (n, 2) displacement at which the spring of a bound block is free of force
    start: float  # s
    dt: float
    stride: int  # steps from one sample to the next
    machine: FloatArray  # places as in engines.state; empty where the slider is not on a machine
    stop_at_peaks: float  # the run ends once the time exceeds so many peak times
    u: FloatArray  # (n, 2) displacement
    v: FloatArray  # (n, 2) velocity
    resting: NDArray[np.bool_]  # (n,)
    failed: NDArray[np.int64]  # the first blocks that slipped
    out: Samples
    sums: FloatArray  # running sums exact to the order of the trapezoid; see the names below


RULES = ("turned", "slow", "never")
TURNED, SLOW, NEVER = range(len(RULES))


FORCE, IMPULSE, PEAK, PEAK_TIME, FRICTION_WORK, VISCOUS_WORK, N_FAILED, N_SUMS = range(8)


@compiled
def driving_force(u: FloatArray, t: float, m: Model, out: FloatArray) -> None:
    """F_mot = F_int + F_s of every block, from displacements ``u`` (n, 2) at time ``t`` of the slider."""
    for i in range(len(u)):
        fx = m.shear[i] * (m.velocity[0] * t - u[i, 0])
        fy = m.shear[i] * (m.velocity[1] * t - u[i, 1])
        for k in range(NEIGHBOURS):
            j = m.neighbours[i, k]
            if j == len(u):
                continue
            dx = u[j, 0] - u[i, 0]
            dy = u[j, 1] - u[i, 1]
            if m.finite:
                rx = m.rest[k, 0] + dx
                ry = m.rest[k, 1] + dy
                r = math.sqrt(rx * rx + ry * ry)
                pull = m.springs[k] * (r - m.rest[k, 2]) / r
                fx += pull * rx
                fy += pull * ry
            else:
                nx = m.rest[k, 0] / m.rest[k, 2]
                ny = m.rest[k, 1] / m.rest[k, 2]
                pull = m.springs[k] * (nx * dx + ny * dy)
                fx += pull * nx
                fy += pull * ny
        out[i, 0] = fx
        out[i, 1] = fy


@compiled
def oppose(v: FloatArray, driving: FloatArray, m: Model, friction: FloatArray) -> None:
    """Sliding friction of every block against its velocity, or against its driving force where it has none."""
    for i in range(len(v)):
        along = v[i] if v[i, 0] != 0.0 or v[i, 1] != 0.0 else driving[i]
        amount = math.sqrt(along[0] * along[0] + along[1] * along[1])
        for d in range(2):
            friction[i, d] = -m.sliding[i] * (along[d] / amount if amount > 0.0 else 0.0)


@compiled
def acceleration(
    u: FloatArray, v: FloatArray, t: float, resting: NDArray[np.bool_], friction: FloatArray, m: Model, a: FloatArray
) -> None:
    """m a = F_mot + F_d + F_fr of every block; blocks at rest have none, or hang on the spring of their contact."""
    driving_force(u, t, m, a)
    if m.rule == NEVER:
        oppose(v, a, m, friction)
    for i in range(len(u)):
        for d in range(2):
            held = -m.bond[i] * (u[i, d] - m.anchor[i, d]) if resting[i] else friction[i, d]
            moves = m.elastic or not resting[i]
            a[i, d] = (a[i, d] + held) / m.mass - m.damping * v[i, d] if moves else 0.0


@compiled
def decide_friction(m: Model, t: float, friction: FloatArray) -> None:
    """Release blocks beyond their static threshold, and set the friction force of this step on those that slide."""
    u, v, resting = m.u, m.v, m.resting
    driving_force(u, m.machine[SLIDER] if len(m.machine) > 0 else t, m, friction)
    for i in range(len(u)):
        driving = math.sqrt(friction[i, 0] * friction[i, 0] + friction[i, 1] * friction[i, 1])
        held = driving
        if m.elastic:
            held = m.bond[i] * math.hypot(u[i, 0] - m.anchor[i, 0], u[i, 1] - m.anchor[i, 1])
        if resting[i] and held > m.static[i]:
            resting[i] = False
            if m.elastic:
                m.sums[FRICTION_WORK] += 0.5 * (held * held - m.sliding[i] * m.sliding[i]) / m.bond[i]
            m.static[i] = m.again[i]
            n = int(m.sums[N_FAILED])
            if n < len(m.failed):
                m.failed[n] = i
                m.sums[N_FAILED] += 1.0
        speed = math.sqrt(v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1])
        for d in range(2):
            direction = v[i, d] / speed if speed > 0.0 else (friction[i, d] / driving if driving > 0.0 else 0.0)
            friction[i, d] = -m.sliding[i] * direction


@compiled
def slider_force(u: FloatArray, t: float, m: Model) -> float:
    """Force of the slider on the blocks along the pull, at time ``t`` of the slider."""
    force_x = 0.0
    force_y = 0.0
    for i in range(len(u)):
        force_x += m.shear[i] * (m.velocity[0] * t - u[i, 0])
        force_y += m.shear[i] * (m.velocity[1] * t - u[i, 1])
    speed = math.sqrt(m.velocity[0] * m.velocity[0] + m.velocity[1] * m.velocity[1])
    return (force_x * m.velocity[0] + force_y * m.velocity[1]) / speed


@compiled
def gain_of_pace(u: FloatArray, t: float, slider: float, pace: float, m: Model) -> float:
    """Acceleration of the slider over the speed of the drive; ``slider`` is its time and ``pace`` its rate."""
    drive = m.machine[SPRING] * (t - slider) + m.machine[DAMPER] * (1.0 - pace)
    return (drive - slider_force(u, slider, m)) / m.machine[INERTIA]


@compiled
def shifted(base: FloatArray, slope: FloatArray, h: float, out: FloatArray) -> None:
    for i in range(len(base)):
        out[i, 0] = base[i, 0] + h * slope[i, 0]
        out[i, 1] = base[i, 1] + h * slope[i, 1]


@compiled
def runge_kutta(
    u: FloatArray, v: FloatArray, t: float, dt: float, resting: NDArray[np.bool_], m: Model, w: FloatArray
) -> None:
    """One classical fourth-order step of u' = v, v' = a, and of the slider on its machine.

    ``w`` is work space (10, n, 2): ``w[9]`` holds the friction of the step, ``w[8]`` receives the new velocity.
    """
    a1, a2, a3, a4, v2, v3, v4, p, new_v = w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8]
    on_machine = len(m.machine) > 0
    s1, s2, s3, s4 = t, t + 0.5 * dt, t + 0.5 * dt, t + dt  # time of the slider at each stage
    d1 = d2 = d3 = d4 = g1 = g2 = g3 = g4 = 0.0
    if on_machine:
        s1, d1 = m.machine[SLIDER], m.machine[PACE]
        g1 = gain_of_pace(u, t, s1, d1, m)
    acceleration(u, v, s1, resting, w[9], m, a1)
    shifted(v, a1, 0.5 * dt, v2)
    shifted(u, v, 0.5 * dt, p)
    if on_machine:
        s2, d2 = s1 + 0.5 * dt * d1, d1 + 0.5 * dt * g1
        g2 = gain_of_pace(p, t + 0.5 * dt, s2, d2, m)
    acceleration(p, v2, s2, resting, w[9], m, a2)
    shifted(v, a2, 0.5 * dt, v3)
    shifted(u, v2, 0.5 * dt, p)
    if on_machine:
        s3, d3 = s1 + 0.5 * dt * d2, d1 + 0.5 * dt * g2
        g3 = gain_of_pace(p, t + 0.5 * dt, s3, d3, m)
    acceleration(p, v3, s3, resting, w[9], m, a3)
    shifted(v, a3, dt, v4)
    shifted(u, v3, dt, p)
    if on_machine:
        s4, d4 = s1 + dt * d3, d1 + dt * g3
        g4 = gain_of_pace(p, t + dt, s4, d4, m)
        m.machine[SLIDER] += dt / 6.0 * (d1 + 2.0 * d2 + 2.0 * d3 + d4)
        m.machine[PACE] += dt / 6.0 * (g1 + 2.0 * g2 + 2.0 * g3 + g4)
        lost = (1.0 - d1) ** 2 + (1.0 - m.machine[PACE]) ** 2
        m.machine[LOSS] += 0.5 * dt * m.machine[DAMPER] * m.machine[SPEED] * lost
    acceleration(p, v4, s4, resting, w[9], m, a4)
    for i in range(len(u)):
        for d in range(2):
            new_v[i, d] = v[i, d] + dt / 6.0 * (a1[i, d] + 2.0 * a2[i, d] + 2.0 * a3[i, d] + a4[i, d])
            u[i, d] += dt / 6.0 * (v[i, d] + 2.0 * v2[i, d] + 2.0 * v3[i, d] + v4[i, d])


@compiled
def comes_to_rest(v: FloatArray, new_v: FloatArray, m: Model) -> bool:
    """Whether a block of velocity v before and new_v after a step stops, by the rule of the run."""
    if m.rule == NEVER:
        return False
    if m.rule == SLOW:
        return new_v[0] * new_v[0] + new_v[1] * new_v[1] < m.slow * m.slow
    return v[0] * new_v[0] + v[1] * new_v[1] < 0.0


@compiled
def finish_step(m: Model, t: float, new_v: FloatArray, tested: bool) -> None:
    """Stop blocks where ``tested``, and add up force, friction work and viscous work of the step."""
    u, v, resting, dt = m.u, m.v, m.resting, m.dt
    for i in range(len(u)):
        if m.elastic or not resting[i]:
            before = math.sqrt(v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1])
            rubs = not resting[i]
            if rubs and tested and m.contact[i] and comes_to_rest(v[i], new_v[i], m):
                resting[i] = True
                if m.elastic:
                    stretch = min(m.sliding[i], m.static[i]) / (m.bond[i] * max(before, 1e-300))
                    for d in range(2):
                        m.anchor[i, d] = u[i, d] - stretch * v[i, d]
                new_v[i, 0] = 0.0
                new_v[i, 1] = 0.0
            after = math.sqrt(new_v[i, 0] * new_v[i, 0] + new_v[i, 1] * new_v[i, 1])
            if rubs:
                m.sums[FRICTION_WORK] += 0.5 * dt * m.sliding[i] * (before + after)
            m.sums[VISCOUS_WORK] += 0.5 * dt * m.mass * m.damping * (before * before + after * after)
            v[i, 0] = new_v[i, 0]
            v[i, 1] = new_v[i, 1]
    if len(m.machine) > 0:
        force = m.machine[SPRING] * (t + dt - m.machine[SLIDER]) + m.machine[DAMPER] * (1.0 - m.machine[PACE])
    else:
        force = slider_force(u, t + dt, m)
    m.sums[IMPULSE] += 0.5 * dt * (m.sums[FORCE] + force)
    m.sums[FORCE] = force
    if force > m.sums[PEAK]:
        m.sums[PEAK] = force
        m.sums[PEAK_TIME] = t + dt


@compiled
def integrate_all(m: Model, steps: int, w: FloatArray) -> int:
    """Take so many steps, or fewer where the run ends early; returns the number of samples taken."""
    samples = 0
    dt = m.dt
    for step in range(steps):
        t = m.start + step * dt
        decide_friction(m, t, w[9])
        runge_kutta(m.u, m.v, t, dt, m.resting, m, w)
        finish_step(m, t, w[8], (step + 1) % m.test_every == 0)
        if (step + 1) % m.stride == 0:
            m.out.time[samples] = t + dt
            m.out.force[samples] = m.sums[FORCE]
            m.out.impulse[samples] = m.sums[IMPULSE]
            m.out.moving[samples] = np.sum(m.contact & ~m.resting)
            samples += 1
            if not math.isfinite(m.sums[FORCE]) or t > m.stop_at_peaks * m.sums[PEAK_TIME]:
                break
    return samples


def reference_model(
    config: SimConfig, lattice: Lattice, thresholds: Thresholds, start_s: float, stride: int, samples: int
) -> Model:
    """A run at its start, at a time of the slider on the quasi-static motion, with room for so many samples."""
    offsets, stiffness = np.split(np.array(NEIGHBOURHOOD), [2], axis=1)
    lengths = np.hypot(*offsets.T)
    drive = drive_of(config, lattice)
    sums = np.zeros(N_SUMS)
    machine = machine_of(config, drive, start_s)
    sums[FORCE] = drive.force_rate * start_s
    time_s = time_of(machine, start_s, float(sums[FORCE]))
    sums[IMPULSE] = 0.5 * sums[FORCE] * time_s
    return Model(
        neighbours=lattice.neighbours,
        rest=config.spacing_m * np.column_stack([offsets, lengths]),
        springs=config.stiffness_N_m * stiffness[:, 0],
        static=thresholds.static_N.copy(),
        sliding=thresholds.sliding_N,
        contact=lattice.contact,
        shear=config.stiffness_N_m * lattice.slider
        if lattice.pulled is not None
        else np.full(lattice.contact.size, config.shear_stiffness_N_m),
        mass=config.mass_kg,
        damping=config.damping_per_s,
        velocity=drive.velocity,
        finite=config.rotation == "finite",
        again=thresholds.static_N if thresholds.again_N is None else thresholds.again_N,
        rule=RULES.index(config.sticking),
        slow=config.stick_speed_m_s,
        test_every=max(1, round((config.stick_interval_s or 0.0) / config.dt_s)),
        elastic=lattice.bond is not None,
        bond=np.zeros(lattice.contact.size) if lattice.bond is None else config.stiffness_N_m * lattice.bond,
        anchor=np.zeros((lattice.contact.size, 2)),
        start=time_s,
        dt=config.dt_s,
        stride=stride,
        machine=np.zeros(0) if machine is None else machine,
        stop_at_peaks=np.inf if config.duration_s else config.duration_peaks,
        u=drive.follow * start_s + drive.lag,
        v=drive.pace * drive.follow,
        resting=lattice.contact.copy(),
        failed=np.full(64, -1, np.int64),
        out=Samples(np.zeros(samples), np.zeros(samples), np.zeros(samples), np.zeros(samples, np.int64)),
        sums=sums,
    )


def integrate(
    config: SimConfig, lattice: Lattice, thresholds: Thresholds, threads: int = 1, start_share: float = START_SHARE
) -> Trajectory:
    """One run on the reference engine, on one thread, from ``start_share`` of the first failure on.

    Raises
    ------
    SimulationError
        A force became non-finite; the message names the block and the time.
    """
    drive = drive_of(config, lattice)
    failure = first_failure_s(lattice, thresholds, drive, config.stiffness_N_m)
    slider_s = start_share * failure
    start = slider_s
    if config.machine_stiffness_N_per_m is not None:
        start, failure = (time_of(machine_of(config, drive, s), s, drive.force_rate * s) for s in (slider_s, failure))
    end = config.duration_s or 2.0 * config.duration_peaks * longest_rise_s(config, lattice, thresholds, drive)
    steps = max(1, int(np.ceil((end - start) / config.dt_s)))
    stride = min(max(1, round(config.sample_interval_s / config.dt_s)), steps)
    run = reference_model(config, lattice, thresholds, slider_s, stride, steps // stride)
    kept = integrate_all(run, steps, np.zeros((10, *run.u.shape)))
    out, sums = run.out, run.sums
    if not np.isfinite(sums[FORCE]):
        raise not_finite(run.u, lattice.nx, float(out.time[kept - 1]))
    return Trajectory(
        time_s=np.concatenate([(0.0, start), out.time[:kept]]),
        force_N=np.concatenate([(0.0, drive.force_rate * slider_s), out.force[:kept]]),
        impulse_Ns=np.concatenate([(0.0, 0.5 * drive.force_rate * (slider_s * start)), out.impulse[:kept]]),
        moving=np.concatenate([np.zeros(2, np.int64), out.moving[:kept]]),
        peak_N=float(sums[PEAK]),
        peak_s=float(sums[PEAK_TIME]),
        first_peak_N=float(sums[PEAK]),
        first_peak_s=float(sums[PEAK_TIME]),
        first_failure_s=failure,
        failed=once(run.failed[: int(sums[N_FAILED])]),
        end_s=float(out.time[kept - 1]),
        end_impulse_Ns=float(sums[IMPULSE]),
        displacement_m=run.u,
        velocity_m_s=run.v,
        friction_work_J=float(sums[FRICTION_WORK]),
        viscous_work_J=float(sums[VISCOUS_WORK]),
        bond_energy_J=_bond_energy(run),
        slider_m=config.speed_m_s * float(run.machine[SLIDER] if run.machine.size else out.time[kept - 1]),
        slider_m_s=config.speed_m_s * float(run.machine[PACE] if run.machine.size else 1.0),
        damper_work_J=float(run.machine[LOSS]) if run.machine.size else 0.0,
    )


def _bond_energy(m: Model) -> float:
    """Energy in the springs of contact; that of a sliding block is stretched by its friction."""
    stretch = m.bond * np.hypot(*(m.u - m.anchor).T)
    force = np.where(m.resting, stretch, m.sliding)[m.bond > 0.0]
    return float(0.5 * (force**2 / m.bond[m.bond > 0.0]).sum())
