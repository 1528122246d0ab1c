"""The compiled loop of the fast engine: only blocks that move, and those they touch, cost time.

Every displacement here is counted from the quasi-static one: a cavity block follows the slider at a known
velocity w while all contact blocks stick, and q is what it does beyond w t. In these coordinates the in-plane
force of any block is G + R t with R constant in time and zero on cavities, and G changes only when a
neighbour moves. So a sticking block outside the reach of moving ones fails at a time that is known beforehand.

States of a block: asleep (waiting in a queue of failure times), rim (asleep, but a neighbour moves, so it is
looked at every step) and active (integrated). Where most blocks move, :mod:`tribo.simulate.engines.dense` takes over.
Times are steps of dt from ``numerics.start``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.simulate.engines.jit import compiled
from tribo.simulate.friction import sliding_threshold, static_threshold

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# columns of State.cells: force G, its rate R, displacement q, velocity, thresholds (static now, sliding, static
# after a slip), own stiffness, time of the last stop, whether it stops in this step
GX, GY, RX, RY, QX, QY, VX, VY, FS, FD, KXX, KYY, KXY, SINCE, STOPS, FA, WIDTH = range(17)
# columns of State.links: contact block or cavity, state, number of active neighbours, position in its list,
# and the failure queue (bucket, the blocks before and after it there)
CONTACT, STATUS, TOUCHED, PLACE, BUCKET, BEFORE, AFTER, LINKS = range(8)
ASLEEP, ACTIVE, RIM, NOBODY = range(4)
# State.counts
N_ACTIVE, N_RIM, STEP, N_SAMPLES, N_FAILED, CODE, DENSE_STEPS, ACTIVE_STEPS, N_COUNTS = range(9)
# State.totals
ALONG, INTEGRAL, FORCE, PEAK, PEAK_TIME, FIRST, FIRST_TIME, FIRST_FOUND = range(8)
FRICTION_WORK, VISCOUS_WORK, N_TOTALS = range(8, 11)
RUNNING, FINISHED, NOT_FINITE, CROWDED = range(4)


class State(NamedTuple):
    """Everything that changes during a run; one block more than the lattice stands for missing neighbours."""

    cells: FloatArray  # (n + 1, WIDTH)
    links: IntArray  # (n + 1, LINKS)
    neighbours: IntArray  # (n + 1, 8): E, W, N, S, NE, SW, NW, SE
    lists: IntArray  # (2, n + 1): active blocks, rim blocks
    head: IntArray  # failure queue: first block of each bucket, one bucket per step, used as a ring
    failed: IntArray  # (2, m): the first m failures, block and step
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
    rest_force: float  # a cavity block below this force and the matching velocity sleeps
    stride: int
    stop_at_peaks: float  # stop once the time exceeds this multiple of the peak time
    peak_drop: float  # the first peak is found once the force has fallen by this share
    dense_above: int  # active blocks above which all blocks are integrated
    law: FloatArray | None  # parameters of the friction terms; None compiles to a loop without them
    weakens: int | None  # None if a block that has slipped holds as much as before


@compiled
def enqueue(i: int, s: State, c: Numerics) -> None:
    """Put a sticking contact block into the bucket of the step in which it will fail.

    |G + R t| = F_s is a quadratic in t. Failures beyond the ring wait in its last bucket and are looked at again.
    """
    cells = s.cells
    t_now = c.start + s.counts[STEP] * c.dt
    limit = static_threshold(cells[i, FS], t_now - cells[i, SINCE], c.law)
    a = cells[i, RX] * cells[i, RX] + cells[i, RY] * cells[i, RY]
    b = cells[i, GX] * cells[i, RX] + cells[i, GY] * cells[i, RY]
    excess = cells[i, GX] * cells[i, GX] + cells[i, GY] * cells[i, GY] - limit * limit
    ring = len(s.head)
    wait = float(ring)
    if a > 0.0:
        root = b * b - a * excess
        t_fail = (math.sqrt(root) - b) / a if root > 0.0 else t_now
        wait = math.ceil((t_fail - c.start) / c.dt) - s.counts[STEP]
    steps = int(min(max(wait, 1.0), ring - 1.0))
    k = (s.counts[STEP] + steps) % ring
    first = s.head[k]
    s.links[i, AFTER] = first
    s.links[i, BEFORE] = -1
    if first >= 0:
        s.links[first, BEFORE] = i
    s.head[k] = i
    s.links[i, BUCKET] = k


@compiled
def dequeue(i: int, s: State) -> None:
    """Take a block out of its bucket."""
    k = s.links[i, BUCKET]
    if k < 0:
        return
    before, after = s.links[i, BEFORE], s.links[i, AFTER]
    if before >= 0:
        s.links[before, AFTER] = after
    else:
        s.head[k] = after
    if after >= 0:
        s.links[after, BEFORE] = before
    s.links[i, BUCKET] = -1


@compiled
def join_rim(i: int, s: State) -> None:
    s.links[i, STATUS] = RIM
    s.links[i, PLACE] = s.counts[N_RIM]
    s.lists[1, s.counts[N_RIM]] = i
    s.counts[N_RIM] += 1


@compiled
def leave_rim(i: int, s: State) -> None:
    s.counts[N_RIM] -= 1
    last = s.lists[1, s.counts[N_RIM]]
    s.lists[1, s.links[i, PLACE]] = last
    s.links[last, PLACE] = s.links[i, PLACE]


@compiled
def activate(i: int, s: State) -> None:
    """Start to integrate a block; its sleeping neighbours join the rim."""
    if s.links[i, STATUS] == RIM:
        leave_rim(i, s)
    else:
        dequeue(i, s)
    s.links[i, STATUS] = ACTIVE
    s.links[i, PLACE] = s.counts[N_ACTIVE]
    s.lists[0, s.counts[N_ACTIVE]] = i
    s.counts[N_ACTIVE] += 1
    s.cells[i, FS] = s.cells[i, FA]
    if s.links[i, CONTACT] and s.counts[N_FAILED] < s.failed.shape[1]:
        s.failed[0, s.counts[N_FAILED]] = i
        s.failed[1, s.counts[N_FAILED]] = s.counts[STEP]
        s.counts[N_FAILED] += 1
    for e in range(8):
        j = s.neighbours[i, e]
        if s.links[j, STATUS] == NOBODY:
            continue
        s.links[j, TOUCHED] += 1
        if s.links[j, STATUS] == ASLEEP:
            dequeue(j, s)
            join_rim(j, s)


@compiled
def settle(i: int, s: State, c: Numerics) -> None:
    """Put a block that no longer moves back to sleep, and with it neighbours nothing touches any more."""
    s.counts[N_ACTIVE] -= 1
    last = s.lists[0, s.counts[N_ACTIVE]]
    s.lists[0, s.links[i, PLACE]] = last
    s.links[last, PLACE] = s.links[i, PLACE]
    s.cells[i, VX] = 0.0
    s.cells[i, VY] = 0.0
    s.cells[i, SINCE] = c.start + s.counts[STEP] * c.dt
    for e in range(8):
        j = s.neighbours[i, e]
        if s.links[j, STATUS] == NOBODY:
            continue
        s.links[j, TOUCHED] -= 1
        if s.links[j, TOUCHED] == 0 and s.links[j, STATUS] == RIM:
            leave_rim(j, s)
            sleep(j, s, c)
    if s.links[i, TOUCHED] > 0:
        join_rim(i, s)
    else:
        sleep(i, s, c)


@compiled
def sleep(i: int, s: State, c: Numerics) -> None:
    s.links[i, STATUS] = ASLEEP
    if s.links[i, CONTACT] == 1:
        enqueue(i, s, c)


@compiled
def wake_due(s: State, c: Numerics) -> None:
    """Activate the blocks whose failure is due in this step, in the queue and on the rim.

    A contact block fails beyond its static threshold, a resting cavity block wakes at twice its rest force.
    """
    cells, links, counts = s.cells, s.links, s.counts
    t = c.start + counts[STEP] * c.dt
    due = counts[STEP] % len(s.head)
    while s.head[due] >= 0:  # what is queued again lands in another bucket, what is activated leaves this one
        i = s.head[due]
        dequeue(i, s)
        fx = cells[i, GX] + cells[i, RX] * t
        fy = cells[i, GY] + cells[i, RY] * t
        limit = static_threshold(cells[i, FS], t - cells[i, SINCE], c.law)
        if fx * fx + fy * fy > limit * limit:
            activate(i, s)
        else:
            enqueue(i, s, c)
    k = 0
    while k < counts[N_RIM]:
        i = s.lists[1, k]
        fx = cells[i, GX] + cells[i, RX] * t
        fy = cells[i, GY] + cells[i, RY] * t
        limit = 2.0 * c.rest_force
        if links[i, CONTACT] == 1:
            limit = static_threshold(cells[i, FS], t - cells[i, SINCE], c.law)
        if fx * fx + fy * fy > limit * limit:
            activate(i, s)  # the last of the rim takes its place
        else:
            k += 1


@compiled
def last_stretch(speed: float, drive: float, sliding: float) -> float:
    """Share of ``drive`` that takes a block, within one step, from where it is to where it comes to rest.

    Its speed falls evenly from ``speed`` half a step ago to ``drive - sliding`` < 0 half a step ahead, so it still
    has v2 / 2a to go. Without this every slip would end short, by an amount of order dt squared.
    """
    if drive == 0.0:
        return 0.0
    middle = speed + drive - sliding
    return 0.125 * middle * middle / ((speed + sliding - drive) * drive)


@compiled
def kick(s: State, c: Numerics) -> None:
    """New velocities of the active blocks: driving force and damping, then friction as an impulse.

    Friction can stop a block within a step but never turn it round. A block at rest meets its static threshold,
    and its first kick is half a step long: velocities belong to the middle of the steps.
    """
    cells = s.cells
    t = c.start + s.counts[STEP] * c.dt
    gain = c.dt / c.mass
    keep = 1.0 - c.damping * c.dt
    lists = s.lists
    for k in range(s.counts[N_ACTIVE]):
        i = lists[0, k]
        speed = math.sqrt(cells[i, VX] * cells[i, VX] + cells[i, VY] * cells[i, VY])
        vx = keep * cells[i, VX] + gain * (cells[i, GX] + cells[i, RX] * t)
        vy = keep * cells[i, VY] + gain * (cells[i, GY] + cells[i, RY] * t)
        if s.links[i, CONTACT] == 1:
            drive = math.sqrt(vx * vx + vy * vy)
            sliding = gain * sliding_threshold(cells[i, FD], speed, c.law)
            share = 1.0 - sliding / drive if drive > sliding else 0.0
            cells[i, STOPS] = 0.0
            if share == 0.0 and speed > 0.0:
                share = last_stretch(speed, drive, sliding)
                cells[i, STOPS] = 1.0
            if speed == 0.0:
                holding = gain * static_threshold(cells[i, FS], t - cells[i, SINCE], c.law)
                share = 0.5 * share if drive > holding else 0.0
            vx *= share
            vy *= share
        cells[i, VX] = vx
        cells[i, VY] = vy


@compiled
def move(s: State, c: Numerics) -> None:
    """Displace the active blocks and hand the change of force to them and their neighbours; rest the stopped."""
    cells = s.cells
    quarter = 0.25 * c.stiffness
    rest_speed = c.rest_force / math.sqrt(c.stiffness * c.mass)
    along = 0.0
    friction = 0.0
    viscous = 0.0
    k = s.counts[N_ACTIVE] - 1
    while k >= 0:  # from the end, so that the block that fills a gap has been seen
        i = s.lists[0, k]
        if cells[i, VX] == 0.0 and cells[i, VY] == 0.0 and s.links[i, CONTACT] == 1:
            settle(i, s, c)
            k -= 1
            continue
        dx = cells[i, VX] * c.dt
        dy = cells[i, VY] * c.dt
        way2 = dx * dx + dy * dy
        viscous += way2
        if s.links[i, CONTACT] == 1:
            way = math.sqrt(way2)
            friction += way * sliding_threshold(cells[i, FD], way / c.dt, c.law)
        cells[i, QX] += dx
        cells[i, QY] += dy
        along += dx * c.direction_x + dy * c.direction_y
        cells[i, GX] -= cells[i, KXX] * dx + cells[i, KXY] * dy
        cells[i, GY] -= cells[i, KXY] * dx + cells[i, KYY] * dy
        near = s.neighbours
        ax = c.stiffness * dx
        ay = c.stiffness * dy
        rising = quarter * (dx + dy)
        falling = quarter * (dx - dy)
        cells[near[i, 0], GX] += ax
        cells[near[i, 1], GX] += ax
        cells[near[i, 2], GY] += ay
        cells[near[i, 3], GY] += ay
        cells[near[i, 4], GX] += rising
        cells[near[i, 4], GY] += rising
        cells[near[i, 5], GX] += rising
        cells[near[i, 5], GY] += rising
        cells[near[i, 6], GX] += falling
        cells[near[i, 6], GY] -= falling
        cells[near[i, 7], GX] += falling
        cells[near[i, 7], GY] -= falling
        if s.links[i, CONTACT] == 0:
            still = cells[i, VX] * cells[i, VX] + cells[i, VY] * cells[i, VY] < rest_speed * rest_speed
            if still and cells[i, GX] * cells[i, GX] + cells[i, GY] * cells[i, GY] < c.rest_force * c.rest_force:
                settle(i, s, c)
        elif cells[i, STOPS] == 1.0:
            settle(i, s, c)
        k -= 1
    s.totals[ALONG] += along
    s.totals[FRICTION_WORK] += friction
    s.totals[VISCOUS_WORK] += viscous * c.mass * c.damping / c.dt


@compiled
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


@compiled
def steps_to_next_failure(s: State, limit: int) -> int:
    """Steps from now to the next bucket that holds a block, at most ``limit``."""
    ring = len(s.head)
    for wait in range(min(limit, ring)):
        if s.head[(s.counts[STEP] + wait) % ring] >= 0:
            return wait
    return min(limit, ring - 1)


@compiled
def moving_contacts(s: State) -> int:
    n = 0
    for k in range(s.counts[N_ACTIVE]):
        if s.links[s.lists[0, k], CONTACT] == 1:
            n += 1
    return n


@compiled
def advance(s: State, out: Samples, c: Numerics, until_step: int) -> None:
    """Integrate to ``until_step``, or until ``counts[CODE]`` says finished, not finite, or too many blocks move."""
    while s.counts[STEP] < until_step and s.counts[CODE] == RUNNING:
        if s.counts[N_ACTIVE] == 0:
            wait = steps_to_next_failure(s, until_step - s.counts[STEP])
            if wait > 0:
                observe(wait, 0, s, out, c)
                continue
        if s.counts[N_ACTIVE] > c.dense_above:
            s.counts[CODE] = CROWDED
            break
        wake_due(s, c)
        s.counts[ACTIVE_STEPS] += s.counts[N_ACTIVE]
        kick(s, c)
        move(s, c)
        moving = 0
        if (s.counts[STEP] + 1) % c.stride == 0:
            moving = moving_contacts(s)
        observe(1, moving, s, out, c)


@compiled
def start_lists(s: State, c: Numerics) -> None:
    """Sort all blocks into active, rim and queue from their velocities; the lists are rebuilt from nothing."""
    s.counts[N_ACTIVE] = 0
    s.counts[N_RIM] = 0
    s.head[:] = -1
    s.links[:, BUCKET] = -1
    n = len(s.links) - 1
    s.links[:n, STATUS] = ASLEEP
    s.links[:, TOUCHED] = 0
    known = s.counts[N_FAILED]
    s.counts[N_FAILED] = s.failed.shape[1]
    for i in range(n):
        if s.cells[i, VX] != 0.0 or s.cells[i, VY] != 0.0:
            activate(i, s)
    s.counts[N_FAILED] = known
    for i in range(n):
        if s.links[i, STATUS] == ASLEEP and s.links[i, CONTACT] == 1:
            enqueue(i, s, c)
