"""Which strips of the lattice are worked on: only those where blocks move, and those their springs reach.

A strip is asleep (nothing in its reach moves; it waits in a queue for the step in which its first contact block will
fail), listening (blocks in its reach move, so its forces are looked at in every step), gliding (cavity blocks move) or
sliding (contact blocks too). A strip asleep fails at a time that is known beforehand: in the coordinates of
:mod:`tribo.springblock.engines.state` its forces are G + R t until something in its reach moves.

First the lists of strips in each state and the queue, then one time step and the loop over steps (:func:`advance`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock.engines.bonds import bond_force, bound_forces, bound_glides, bound_slides
from tribo.springblock.engines.jit import compiled, copied_into_callers, inner
from tribo.springblock.engines.state import (
    ACTIVE_STEPS,
    ALONG,
    CARRIED,
    CODE,
    FRICTION_WORK,
    N_FAILED,
    RUNNING,
    SLIDER,
    STEP,
    VISCOUS_WORK,
    Numerics,
    Samples,
    State,
    accelerate_slider,
    drag_rate,
    move_slider,
    observe,
    slider_time,
    static_threshold,
)
from tribo.springblock.engines.strips import (
    CAVITY,
    CONTACT,
    LANES,
    NOTHING,
    IntArray,
    Planes,
    Sums,
    forces,
    glides,
    slides,
    wrap,
)
from tribo.springblock.engines.team import (
    END,
    FORCES,
    MOTION,
    done,
    give,
    next_order,
    orders_for,
    shares_of,
    team_size,
    wait_for_all,
)
from tribo.springblock.lattice import OFFSETS

LISTENING, GLIDING, SLIDING, ASLEEP = range(4)  # states of a strip
PENDING = -1  # row of Lists.strips and .members: strips that fell asleep and are not in the queue yet
# columns of Lists.links: state, number of moving strips that reach it, which neighbours it reaches itself (a bit each)
# and would with its cavities alone, place in its list, share of the lattice, bucket of the queue, the strips before and
# after it there, and the strips AROUND it, -1 where there is none
STATUS, TOUCHED, REACH, OWN_REACH, PLACE, SHARE, BUCKET, BEFORE, AFTER, NEAR = range(10)
# the strips that springs of a strip reach, a bit of REACH each; which of them its first, any and its last block reaches
AROUND = tuple(sorted({(x, dy) for dx, dy in OFFSETS for x in (0, dx)} - {(0, 0)}))
N_AROUND = len(AROUND)
LINKS = NEAR + N_AROUND
WEST, MIDDLE, EAST = (sum(1 << bit for bit, (x, _) in enumerate(AROUND) if x == side) for side in (-1, 0, 1))
RING = 1 << 15  # steps the queue looks ahead


class Lists(NamedTuple):
    """Every strip is in the list of its state and share or, asleep, in the queue.

    The list of a state and a share is row ``shares * state + share`` of ``strips``; the last row is for PENDING.
    """

    links: NDArray[np.int64]  # (strips, LINKS)
    strips: NDArray[np.int64]  # (rows, 2 strips)
    members: NDArray[np.int64]  # (rows,) how many are in each list
    shares: int
    head: NDArray[np.int64]  # the queue: first strip of each bucket, one bucket per step, used as a ring


def lists_of(cavity: NDArray[np.bool_], c: Numerics, shares: int) -> Lists:
    """All strips asleep, in so many shares. ``cavity`` (strips, lanes) tells the blocks that move without slipping."""
    n, lanes = cavity.shape
    across = -(-c.nx // lanes)
    y, x = np.divmod(np.arange(n), across)
    last = np.where(x < across - 1, lanes - 1, (c.nx - 1) % lanes)
    reach = np.where(cavity[:, 0], WEST, 0) | np.where(cavity[np.arange(n), last], EAST, 0)
    links = np.full((n, LINKS), -1, np.int64)
    links[:, TOUCHED] = links[:, REACH] = 0
    links[:, STATUS] = ASLEEP
    links[:, OWN_REACH] = np.where(cavity.any(axis=1), MIDDLE | reach, 0)
    for bit, (dx, dy) in enumerate(AROUND):
        to_x, to_y = x + dx, y + dy
        if c.periodic:
            to_x, to_y = to_x % across, to_y % c.ny
        inside = (to_x >= 0) & (to_x < across) & (to_y >= 0) & (to_y < c.ny)
        links[inside, NEAR + bit] = (to_y * across + to_x)[inside]
    links[:, SHARE] = shares * np.arange(n) // n
    rows = shares * ASLEEP + 1
    strips, members = np.zeros((rows, 2 * n), np.int64), np.zeros(rows, np.int64)
    return Lists(links, strips, members, shares, np.full(RING, -1, np.int64))


@inner
def listed(status: int, lists: Lists) -> int:
    """Number of strips of this state and those after it, without those asleep."""
    found = 0
    for row in range(lists.shares * status, lists.shares * ASLEEP):
        found += lists.members[row]
    return found


@inner
def join(strip: int, status: int, lists: Lists) -> None:
    """Put a strip into the list of a state."""
    row = lists.shares * status + lists.links[strip, SHARE]
    lists.links[strip, STATUS] = status
    lists.links[strip, PLACE] = lists.members[row]
    lists.strips[row, lists.members[row]] = strip
    lists.members[row] += 1


@inner
def leave(strip: int, lists: Lists) -> None:
    """Take a strip out of the list of its state, or out of the queue; the last of the list takes its place."""
    links = lists.links
    status = links[strip, STATUS]
    if status != ASLEEP:
        row = lists.shares * status + links[strip, SHARE]
        lists.members[row] -= 1
        last = lists.strips[row, lists.members[row]]
        lists.strips[row, links[strip, PLACE]] = last
        links[last, PLACE] = links[strip, PLACE]
        return
    bucket = links[strip, BUCKET]
    if bucket < 0:
        return
    before, after = links[strip, BEFORE], links[strip, AFTER]
    if before >= 0:
        links[before, AFTER] = after
    else:
        lists.head[bucket] = after
    if after >= 0:
        links[after, BEFORE] = before
    links[strip, BUCKET] = -1


@inner
def rest(strip: int, lists: Lists) -> None:
    """A strip within which nothing moves listens if something in its reach does; else its failure is to be found."""
    if lists.links[strip, TOUCHED] > 0:
        join(strip, LISTENING, lists)
    else:
        lists.links[strip, STATUS] = ASLEEP
        lists.strips[PENDING, lists.members[PENDING]] = strip
        lists.members[PENDING] += 1


@inner
def set_reach(strip: int, reach: int, lists: Lists) -> None:
    """The blocks that move in a strip reach these neighbours from now on, and no others."""
    links = lists.links
    changed = reach ^ links[strip, REACH]
    links[strip, REACH] = reach
    for bit in range(N_AROUND):
        other = links[strip, NEAR + bit]
        if (changed >> bit) & 1 == 0 or other < 0:
            continue
        if (reach >> bit) & 1:
            links[other, TOUCHED] += 1
            if links[other, STATUS] == ASLEEP:
                leave(other, lists)
                join(other, LISTENING, lists)
        else:
            links[other, TOUCHED] -= 1
            if links[other, TOUCHED] == 0 and links[other, STATUS] == LISTENING:
                leave(other, lists)
                rest(other, lists)


@inner
def enqueue(strip: int, now: int, due: float, lists: Lists) -> None:
    """Put a strip into the bucket of a step; steps beyond the ring wait in its last bucket and are looked at again."""
    links = lists.links
    if links[strip, BUCKET] >= 0:
        return
    ring = len(lists.head)
    bucket = (now + int(min(max(due - now, 0.0), ring - 1.0))) % ring
    first = lists.head[bucket]
    links[strip, AFTER] = first
    links[strip, BEFORE] = -1
    if first >= 0:
        links[first, BEFORE] = strip
    lists.head[bucket] = strip
    links[strip, BUCKET] = bucket


@inner
def steps_to_next_failure(now: int, limit: int, head: NDArray[np.int64]) -> int:
    """Steps from now to the next bucket that holds a strip, at most ``limit``."""
    ring = len(head)
    for wait in range(min(limit, ring)):
        if head[(now + wait) % ring] >= 0:
            return wait
    return min(limit, ring - 1)


MANY = 64  # strips; an order costs about as much as the forces of 20 strips in the cache


class Active(NamedTuple):
    """The blocks of a run, their strips, and what the loops say of each strip."""

    planes: Planes
    sums: Sums  # a row each share
    lists: Lists
    starts: NDArray[np.bool_]  # (strips,) a block at rest gives way
    calm: NDArray[np.bool_]  # (strips,) all cavity blocks may rest
    moving: NDArray[np.int64]  # (strips,) contact blocks that move
    orders: NDArray[np.int64]  # what the leader of the team asks the other threads for, and what they have done


def active_of(planes: Planes, numerics: Numerics, threads: int = 1) -> Active:
    """Lists of a lattice whose blocks move where ``planes.pace`` says so; a large one has up to ``threads`` threads."""
    n = len(planes.place)
    shares = shares_of(numerics.nx * numerics.ny)
    lanes = planes.place[:, None] + np.arange(LANES)
    free = planes.kind[lanes] == CAVITY if numerics.elastic is None else planes.kind[lanes] != NOTHING
    lists = lists_of(free, numerics, shares)
    for strip in np.flatnonzero((planes.pace[lanes] != 0.0).any(axis=1)):
        here = lanes[strip]
        planes.hold[here[planes.kind[here] == CAVITY]] = np.inf
        leave(int(strip), lists)
        join(int(strip), SLIDING, lists)
        set_reach(int(strip), WEST | MIDDLE | EAST, lists)
    lists.strips[PENDING, :n] = np.arange(n)
    lists.members[PENDING] = n
    starts, calm = np.zeros((2, n), np.bool_)
    sums = Sums(*np.zeros((3, shares, LANES)))
    return Active(planes, sums, lists, starts, calm, np.zeros(n, np.int64), orders_for(threads, shares))


@inner
def hold_cavities(strip: int, hold: float, p: Planes, elastic: bool | None) -> None:
    """The cavity blocks of a strip, and bound ones, rest up to a force, which is infinite while they move."""
    copied_into_callers()
    first = p.place[strip]
    for i in range(first, first + LANES):
        if elastic is None:
            if p.kind[i] == CAVITY:
                p.hold[i] = hold
                if hold < np.inf:
                    p.p_x[i] = 0.0
                    p.p_y[i] = 0.0
        elif p.kind[i] != NOTHING:
            p.wake[i] = hold
            if hold < np.inf:
                p.p_x[i] = 0.0
                p.p_y[i] = 0.0


@inner
def load_on(i: int, t: float, p: Planes, c: Numerics, elastic: bool | None) -> tuple[float, float]:
    """What a contact block has to hold: the force on it, or that of its bond at time t of the slider."""
    copied_into_callers()
    if elastic is None:
        return p.f_x[i], p.f_y[i]
    elapsed = t * c.dt / c.mass
    return (
        bond_force(p.bond[i], p.frame_x[i], p.q_x[i], p.anchor_x[i], elapsed),
        bond_force(p.bond[i], p.frame_y[i], p.q_y[i], p.anchor_y[i], elapsed),
    )


@inner
def load_rate(i: int, p: Planes, c: Numerics, elastic: bool | None) -> tuple[float, float]:
    """N/s by which that grows with the time of the slider while nothing moves beyond the quasi-static motion."""
    copied_into_callers()
    if elastic is None:
        return p.pull_x[i], p.pull_y[i]
    rate = p.bond[i] * c.dt / c.mass
    return rate * p.frame_x[i], rate * p.frame_y[i]


@inner
def any_forces(
    p: Planes, strips: IntArray, starts: NDArray[np.bool_], c: Numerics, t: float, elastic: bool | None
) -> None:
    """Forces of these strips, with rigid or with elastic contact."""
    copied_into_callers()
    if elastic is None:
        forces(p, strips, starts, c, t)
    else:
        bound_forces(p, strips, starts, c, t)


@inner
def any_motion(
    gliding: IntArray, sliding: IntArray, a: Active, c: Numerics, step: int, sums: Sums, elastic: bool | None
) -> None:
    """Move these strips, with rigid or with elastic contact."""
    copied_into_callers()
    if elastic is None:
        glides(a.planes, gliding, a.calm, c, sums)
        slides(a.planes, sliding, a.moving, c, step, sums)
    else:
        bound_glides(a.planes, gliding, a.calm, c, sums)
        bound_slides(a.planes, sliding, a.moving, c, step, sums)


@inner
def slipping(strip: int, s: State, p: Planes, c: Numerics) -> int:
    """Reach of the contact blocks of a strip whose force exceeds what they hold, 0 without any; they are counted."""
    copied_into_callers()
    first = p.place[strip]
    t = c.start + s.counts[STEP] * c.dt
    reach = 0
    for i in range(first, first + LANES):
        hold = static_threshold(p.hold[i], t - p.since[i], c.law)
        f_x, f_y = load_on(i, slider_time(t, c.machine), p, c, c.elastic)
        if p.kind[i] != CONTACT or f_x * f_x + f_y * f_y <= hold * hold:
            continue
        y, x = divmod(i - p.first, p.width)
        reach |= MIDDLE | (WEST if i == first else 0) | (EAST if i == first + LANES - 1 or x == c.nx - 1 else 0)
        n = s.counts[N_FAILED]
        if n < s.failed.shape[1]:
            s.failed[0, n] = y * c.nx + x
            s.failed[1, n] = s.counts[STEP]
            s.counts[N_FAILED] += 1
    return reach


@inner
def threads_for(strips: int, orders: NDArray[np.int64]) -> int:
    """The whole team where many strips are worked on, else the leader alone."""
    return team_size(orders) if strips >= MANY else 1


@inner
def find_forces(thread: int, threads: int, s: State, a: Active, c: Numerics) -> None:
    """Forces of the strips that listen, glide or slide, in the shares of one of so many threads."""
    copied_into_callers()
    lists = a.lists
    t = c.start + s.counts[STEP] * c.dt
    for row in range(lists.shares * ASLEEP):
        if row % threads == thread:
            any_forces(a.planes, lists.strips[row, : lists.members[row]], a.starts, c, t, c.elastic)


@inner
def move(thread: int, threads: int, s: State, a: Active, c: Numerics) -> None:
    """Move the strips that glide or slide, in the shares of one of so many threads."""
    copied_into_callers()
    lists = a.lists
    for share in range(thread, lists.shares, threads):
        row, further = lists.shares * GLIDING + share, lists.shares * SLIDING + share
        sums = Sums(a.sums.along[share], a.sums.squares[share], a.sums.work[share])
        gliding, sliding = lists.strips[row, : lists.members[row]], lists.strips[further, : lists.members[further]]
        any_motion(gliding, sliding, a, c, s.counts[STEP], sums, c.elastic)


@compiled
def assist(a: Active, s: State, c: Numerics, thread: int) -> None:
    """What another thread of the team than the leader does, until the leader has no more orders."""
    kind = next_order(thread, a.orders)
    while kind != END:
        if kind == FORCES:
            find_forces(thread, team_size(a.orders), s, a, c)
        else:
            move(thread, team_size(a.orders), s, a, c)
        done(thread, a.orders)
        kind = next_order(thread, a.orders)


@inner
def start_all(s: State, a: Active, c: Numerics) -> None:
    """Find forces of the strips that listen, glide or slide, and start those of their blocks that give way."""
    copied_into_callers()
    lists = a.lists
    threads = threads_for(listed(LISTENING, lists), a.orders)
    if threads > 1:
        give(FORCES, a.orders)
    find_forces(0, threads, s, a, c)
    if threads > 1:
        wait_for_all(a.orders)
    for row in range(lists.shares * ASLEEP):  # strips that begin to listen now join a list that has been seen
        status = row // lists.shares
        m = lists.members[row] - 1
        while m >= 0:  # from the end: one that leaves is replaced by one that has been seen or has just joined
            strip = lists.strips[row, m]
            m -= 1
            if not a.starts[strip]:
                continue
            a.starts[strip] = False
            reach = slipping(strip, s, a.planes, c)
            to = SLIDING if reach != 0 or status == SLIDING else GLIDING
            if to != status:
                leave(strip, lists)
                join(strip, to, lists)
                hold_cavities(strip, np.inf, a.planes, c.elastic)
            set_reach(strip, reach | lists.links[strip, REACH] | lists.links[strip, OWN_REACH], lists)


@inner
def rest_all(a: Active, c: Numerics) -> None:
    """Gliding strips rest once they are calm; sliding ones in which all contact blocks stopped glide on, or rest."""
    copied_into_callers()
    lists = a.lists
    for row in range(lists.shares * GLIDING, lists.shares * SLIDING):
        m = lists.members[row] - 1
        while m >= 0:
            strip = lists.strips[row, m]
            m -= 1
            if a.calm[strip]:
                hold_cavities(strip, 2.0 * c.rest_force, a.planes, c.elastic)
                leave(strip, lists)
                rest(strip, lists)
                set_reach(strip, 0, lists)
    for row in range(lists.shares * SLIDING, lists.shares * ASLEEP):
        m = lists.members[row] - 1
        while m >= 0:
            strip = lists.strips[row, m]
            m -= 1
            if a.moving[strip] == 0:
                leave(strip, lists)
                if lists.links[strip, OWN_REACH] != 0:
                    join(strip, GLIDING, lists)
                else:
                    rest(strip, lists)
                set_reach(strip, lists.links[strip, OWN_REACH], lists)


@inner
def queue_pending(s: State, a: Active, c: Numerics) -> None:
    """Put strips that fell asleep into the queue for the step in which one of their blocks will fail."""
    copied_into_callers()
    lists = a.lists
    n = 0
    for m in range(lists.members[PENDING]):
        strip = lists.strips[PENDING, m]
        if lists.links[strip, STATUS] == LISTENING and lists.links[strip, TOUCHED] == 0:  # was due, and did not fail
            leave(strip, lists)
            lists.links[strip, STATUS] = ASLEEP
        if lists.links[strip, STATUS] == ASLEEP and lists.links[strip, BUCKET] < 0:
            lists.strips[PENDING, n] = strip
            n += 1
    lists.members[PENDING] = 0
    any_forces(a.planes, lists.strips[PENDING, :n], a.starts, c, 0.0, c.elastic)
    for m in range(n):
        a.starts[lists.strips[PENDING, m]] = False  # the comparison with the force at t = 0 means nothing
        t_fail = first_failure(lists.strips[PENDING, m], s, a.planes, c)
        if t_fail < np.inf:
            enqueue(lists.strips[PENDING, m], s.counts[STEP], math.ceil((t_fail - c.start) / c.dt), lists)


@inner
def first_failure(strip: int, s: State, p: Planes, c: Numerics) -> float:
    """Time at which the first contact block of a strip fails, its forces at t = 0 being known.

    |G + R t| = F_s is a quadratic in t.
    """
    copied_into_callers()
    t_now = c.start + s.counts[STEP] * c.dt
    earliest = np.inf
    first = p.place[strip]
    for i in range(first, first + LANES):
        if p.kind[i] != CONTACT:
            continue
        limit = static_threshold(p.hold[i], t_now - p.since[i], c.law)
        pull_x, pull_y = load_rate(i, p, c, c.elastic)
        f_x, f_y = load_on(i, 0.0, p, c, c.elastic)
        a = pull_x * pull_x + pull_y * pull_y
        b = f_x * pull_x + f_y * pull_y
        excess = f_x * f_x + f_y * f_y - limit * limit
        if a > 0.0:
            root = b * b - a * excess
            earliest = min(earliest, (math.sqrt(root) - b) / a if root > 0.0 else t_now)
    return earliest


@inner
def admit_due(step: int, lists: Lists) -> None:
    """The strips whose first failure is due in this step listen in it."""
    due = step % len(lists.head)
    while lists.head[due] >= 0:
        strip = lists.head[due]
        leave(strip, lists)
        join(strip, LISTENING, lists)
        lists.strips[PENDING, lists.members[PENDING]] = strip
        lists.members[PENDING] += 1


@inner
def await_failures(s: State, a: Active, c: Numerics, machine: FloatArray | None) -> None:
    """Put strips that fell asleep into the queue; where the slider moves by itself, they listen instead."""
    copied_into_callers()
    lists = a.lists
    if lists.members[PENDING] == 0:
        return
    if machine is None:
        queue_pending(s, a, c)
        return
    for m in range(lists.members[PENDING]):
        join(lists.strips[PENDING, m], LISTENING, lists)
    lists.members[PENDING] = 0


@inner
def jump(until_step: int, s: State, a: Active, out: Samples, c: Numerics, machine: FloatArray | None) -> bool:
    """Skip the steps to the next failure in the queue where nothing moves; whether there were any."""
    copied_into_callers()
    lists = a.lists
    if machine is not None or listed(GLIDING, lists) > 0:
        return False
    wait = steps_to_next_failure(s.counts[STEP], until_step - s.counts[STEP], lists.head)
    if wait > 0:
        observe(wait, 0, s, out, c)
    return wait > 0


@inner
def slack(a: Active, c: Numerics, t: float, machine: FloatArray) -> tuple[float, float]:
    """Times of the slider between which every block holds, their forces being known; |F + R (s - now)| < F_s."""
    copied_into_callers()
    p, now = a.planes, machine[SLIDER]
    back, ahead = -np.inf, np.inf
    for strip in range(len(p.place)):
        for i in range(p.place[strip], p.place[strip] + LANES):
            if p.kind[i] != CONTACT:
                continue
            limit = static_threshold(p.hold[i], t - p.since[i], c.law)
            r_x, r_y = load_rate(i, p, c, c.elastic)
            f_x, f_y = load_on(i, now, p, c, c.elastic)
            square = r_x * r_x + r_y * r_y
            b = f_x * r_x + f_y * r_y
            root = math.sqrt(max(b * b - square * (f_x * f_x + f_y * f_y - limit * limit), 0.0))
            if square > 0.0:
                back = max(back, (-root - b) / square)
                ahead = min(ahead, (root - b) / square)
    return now + back, now + ahead


@inner
def drift(until_step: int, s: State, a: Active, out: Samples, c: Numerics, machine: FloatArray | None) -> bool:
    """Where nothing moves, move the slider alone until a block might; at least by a step. Whether nothing moved."""
    copied_into_callers()
    if machine is None or listed(GLIDING, a.lists) > 0:
        return False
    calm = machine[CARRIED] * abs(drag_rate(c.damping, machine)) < 0.5 * c.rest_force
    back, ahead = slack(a, c, c.start + s.counts[STEP] * c.dt, machine) if calm else (0.0, 0.0)
    while True:
        move_slider(c.dt, machine)
        observe(1, 0, s, out, c)
        if s.counts[STEP] >= until_step or s.counts[CODE] != RUNNING or not back < machine[SLIDER] < ahead:
            return True
        accelerate_slider(c.start + s.counts[STEP] * c.dt, s.totals[ALONG], c, machine)
        if machine[CARRIED] * abs(drag_rate(c.damping, machine)) >= 0.5 * c.rest_force:
            return True


@inner
def moved_along(along: float, way: float, a: Active, c: Numerics) -> float:
    """Displacement along the pull beyond the quasi-static one, summed over the blocks that the slider pulls."""
    copied_into_callers()
    if len(c.pulled) == 0:
        return along + way * total(a.sums.along)
    found, p = 0.0, a.planes
    for block in c.pulled:
        y, x = divmod(block, c.nx)
        i = p.first + y * p.width + x
        found += p.q_x[i] * c.direction_x + p.q_y[i] * c.direction_y
    return found


@inner
def total(values: FloatArray) -> float:
    """The sum over all shares and lanes."""
    found = 0.0
    for share in range(values.shape[0]):
        for lane in range(LANES):
            found += values[share, lane]
    return found


@compiled
def advance(a: Active, s: State, out: Samples, c: Numerics, until_step: int) -> None:
    """Integrate to ``until_step``, or until ``counts[CODE]`` says finished or not finite."""
    lists = a.lists
    way = c.dt * c.dt / c.mass
    along = s.totals[ALONG] - way * total(a.sums.along)
    friction = s.totals[FRICTION_WORK] - way * total(a.sums.work)
    viscous = s.totals[VISCOUS_WORK] - way * c.damping * c.dt * total(a.sums.squares)
    while s.counts[STEP] < until_step and s.counts[CODE] == RUNNING:
        await_failures(s, a, c, c.machine)
        if jump(until_step, s, a, out, c, c.machine):
            continue
        admit_due(s.counts[STEP], lists)
        accelerate_slider(c.start + s.counts[STEP] * c.dt, s.totals[ALONG], c, c.machine)
        start_all(s, a, c)
        if drift(until_step, s, a, out, c, c.machine):
            continue
        active = listed(GLIDING, lists)
        s.counts[ACTIVE_STEPS] += LANES * active
        threads = threads_for(active, a.orders)
        if threads > 1:
            give(MOTION, a.orders)
        move(0, threads, s, a, c)
        if threads > 1:
            wait_for_all(a.orders)
        if c.periodic:
            for plane in (a.planes.q_x, a.planes.q_y, a.planes.q_sum, a.planes.q_gap):
                wrap(plane, a.planes.first, a.planes.width, c.nx, c.ny)
        moving = 0
        if (s.counts[STEP] + 1) % c.stride == 0:
            for row in range(lists.shares * SLIDING, lists.shares * ASLEEP):
                for strip in lists.strips[row, : lists.members[row]]:
                    moving += a.moving[strip]
        rest_all(a, c)
        s.totals[ALONG] = moved_along(along, way, a, c)
        move_slider(c.dt, c.machine)
        observe(1, moving, s, out, c)
    s.totals[FRICTION_WORK] = friction + way * total(a.sums.work)
    s.totals[VISCOUS_WORK] = viscous + way * c.damping * c.dt * total(a.sums.squares)
