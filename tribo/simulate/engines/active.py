"""Which strips of the lattice are worked on: only those where blocks move, and those their springs reach.

A strip is asleep (nothing in its reach moves; it waits in a queue for the step in which its first contact block will
fail), listening (blocks in its reach move, so its forces are looked at in every step), gliding (cavity blocks move) or
sliding (contact blocks too). A strip asleep fails at a time that is known beforehand: in the coordinates of
:mod:`tribo.simulate.engines.state` its forces are G + R t until something in its reach moves.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.simulate.engines.jit import compiled, copied_into_callers, inner
from tribo.simulate.engines.lists import (
    ASLEEP,
    BUCKET,
    EAST,
    GLIDING,
    LISTENING,
    MIDDLE,
    OWN_REACH,
    PENDING,
    REACH,
    SLIDING,
    STATUS,
    TOUCHED,
    WEST,
    Lists,
    enqueue,
    join,
    leave,
    listed,
    lists_of,
    rest,
    set_reach,
    steps_to_next_failure,
)
from tribo.simulate.engines.planes import Layout, wrap
from tribo.simulate.engines.state import (
    ACTIVE_STEPS,
    ALONG,
    CODE,
    FRICTION_WORK,
    N_FAILED,
    RUNNING,
    STEP,
    VISCOUS_WORK,
    Numerics,
    Samples,
    State,
    observe,
)
from tribo.simulate.engines.strips import (
    CAVITY,
    CONTACT,
    LANES,
    Planes,
    Sums,
    forces,
    glides,
    slides,
)
from tribo.simulate.engines.team import (
    END,
    FORCES,
    MOTION,
    Team,
    done,
    give,
    next_order,
    shares_of,
    team_of,
    wait_for_all,
)
from tribo.simulate.friction import static_threshold

MANY = 64  # strips; an order costs about as much as the forces of 20 strips in the cache


class Active(NamedTuple):
    """The blocks of a run, their strips, and what the loops say of each strip."""

    planes: Planes
    sums: Sums  # a row each share
    layout: Layout
    lists: Lists
    starts: NDArray[np.bool_]  # (strips,) a block at rest gives way
    calm: NDArray[np.bool_]  # (strips,) all cavity blocks may rest
    moving: NDArray[np.int64]  # (strips,) contact blocks that move
    team: Team


def active_of(planes: Planes, layout: Layout, numerics: Numerics, threads: int = 1) -> Active:
    """Lists of a lattice whose blocks move where ``planes.pace`` says so; a large one has up to ``threads`` threads."""
    n = len(planes.place)
    shares = shares_of(numerics.nx * numerics.ny)
    lanes = planes.place[:, None] + np.arange(LANES)
    lists = lists_of(planes.kind[lanes] == CAVITY, numerics, shares)
    for strip in np.flatnonzero((planes.pace[lanes] != 0.0).any(axis=1)):
        here = lanes[strip]
        planes.hold[here[planes.kind[here] == CAVITY]] = np.inf
        leave(int(strip), lists)
        join(int(strip), SLIDING, lists)
        set_reach(int(strip), WEST | MIDDLE | EAST, lists)
    lists.strips[PENDING, :n] = np.arange(n)
    lists.members[PENDING] = n
    starts, calm = np.zeros((2, n), np.bool_)
    team, sums = team_of(threads, shares), Sums(*np.zeros((3, shares, LANES)))
    return Active(planes, sums, layout, lists, starts, calm, np.zeros(n, np.int64), team)


@inner
def hold_cavities(strip: int, hold: float, p: Planes) -> None:
    """The cavity blocks of a strip rest up to a force, which is infinite while they move."""
    copied_into_callers()
    first = p.place[strip]
    for i in range(first, first + LANES):
        if p.kind[i] == CAVITY:
            p.hold[i] = hold
            if hold < np.inf:
                p.p_x[i] = 0.0
                p.p_y[i] = 0.0


@inner
def slipping(strip: int, s: State, p: Planes, layout: Layout, c: Numerics) -> int:
    """Reach of the contact blocks of a strip whose force exceeds what they hold, 0 without any; they are counted."""
    copied_into_callers()
    first = p.place[strip]
    t = c.start + s.counts[STEP] * c.dt
    reach = 0
    for i in range(first, first + LANES):
        hold = static_threshold(p.hold[i], t - p.since[i], c.law)
        if p.kind[i] != CONTACT or p.f_x[i] * p.f_x[i] + p.f_y[i] * p.f_y[i] <= hold * hold:
            continue
        y, x = divmod(i - layout.first, layout.width)
        reach |= MIDDLE | (WEST if i == first else 0) | (EAST if i == first + LANES - 1 or x == c.nx - 1 else 0)
        n = s.counts[N_FAILED]
        if n < s.failed.shape[1]:
            s.failed[0, n] = y * c.nx + x
            s.failed[1, n] = s.counts[STEP]
            s.counts[N_FAILED] += 1
    return reach


@inner
def threads_for(strips: int, team: Team) -> int:
    """The whole team where many strips are worked on, else the leader alone."""
    return team.threads if strips >= MANY else 1


@inner
def find_forces(thread: int, threads: int, s: State, a: Active, c: Numerics) -> None:
    """Forces of the strips that listen, glide or slide, in the shares of one of so many threads."""
    copied_into_callers()
    lists = a.lists
    t = c.start + s.counts[STEP] * c.dt
    for row in range(lists.shares * ASLEEP):
        if row % threads == thread:
            forces(a.planes, lists.strips[row, : lists.members[row]], a.starts, c, t)


@inner
def move(thread: int, threads: int, s: State, a: Active, c: Numerics) -> None:
    """Move the strips that glide or slide, in the shares of one of so many threads."""
    copied_into_callers()
    lists = a.lists
    for share in range(thread, lists.shares, threads):
        row = lists.shares * GLIDING + share
        sums = Sums(a.sums.along[share], a.sums.squares[share], a.sums.work[share])
        glides(a.planes, lists.strips[row, : lists.members[row]], a.calm, c, sums)
        row = lists.shares * SLIDING + share
        slides(a.planes, lists.strips[row, : lists.members[row]], a.moving, c, s.counts[STEP], sums)


@compiled
def assist(a: Active, s: State, c: Numerics, thread: int) -> None:
    """What another thread of the team than the leader does, until the leader has no more orders."""
    kind = next_order(thread, a.team)
    while kind != END:
        if kind == FORCES:
            find_forces(thread, a.team.threads, s, a, c)
        else:
            move(thread, a.team.threads, s, a, c)
        done(thread, a.team)
        kind = next_order(thread, a.team)


@inner
def start_all(s: State, a: Active, c: Numerics) -> None:
    """Find forces of the strips that listen, glide or slide, and start those of their blocks that give way."""
    copied_into_callers()
    lists = a.lists
    threads = threads_for(listed(LISTENING, lists), a.team)
    if threads > 1:
        give(FORCES, a.team)
    find_forces(0, threads, s, a, c)
    if threads > 1:
        wait_for_all(a.team)
    for row in range(lists.shares * ASLEEP):  # strips that begin to listen now join a list that has been seen
        status = row // lists.shares
        m = lists.members[row] - 1
        while m >= 0:  # from the end: one that leaves is replaced by one that has been seen or has just joined
            strip = lists.strips[row, m]
            m -= 1
            if not a.starts[strip]:
                continue
            a.starts[strip] = False
            reach = slipping(strip, s, a.planes, a.layout, c)
            to = SLIDING if reach != 0 or status == SLIDING else GLIDING
            if to != status:
                leave(strip, lists)
                join(strip, to, lists)
                hold_cavities(strip, np.inf, a.planes)
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
                hold_cavities(strip, 2.0 * c.rest_force, a.planes)
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
    forces(a.planes, lists.strips[PENDING, :n], a.starts, c, 0.0)
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
        a = p.pull_x[i] * p.pull_x[i] + p.pull_y[i] * p.pull_y[i]
        b = p.f_x[i] * p.pull_x[i] + p.f_y[i] * p.pull_y[i]
        excess = p.f_x[i] * p.f_x[i] + p.f_y[i] * p.f_y[i] - limit * limit
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
        if lists.members[PENDING] > 0:
            queue_pending(s, a, c)
        if listed(GLIDING, lists) == 0:
            wait = steps_to_next_failure(s.counts[STEP], until_step - s.counts[STEP], lists.head)
            if wait > 0:
                observe(wait, 0, s, out, c)
                continue
        admit_due(s.counts[STEP], lists)
        start_all(s, a, c)
        active = listed(GLIDING, lists)
        s.counts[ACTIVE_STEPS] += LANES * active
        threads = threads_for(active, a.team)
        if threads > 1:
            give(MOTION, a.team)
        move(0, threads, s, a, c)
        if threads > 1:
            wait_for_all(a.team)
        if c.periodic:
            for plane in (a.planes.q_x, a.planes.q_y, a.planes.q_sum, a.planes.q_gap):
                wrap(plane, a.layout, c.nx, c.ny)
        moving = 0
        if (s.counts[STEP] + 1) % c.stride == 0:
            for row in range(lists.shares * SLIDING, lists.shares * ASLEEP):
                for strip in lists.strips[row, : lists.members[row]]:
                    moving += a.moving[strip]
        rest_all(a, c)
        s.totals[ALONG] = along + way * total(a.sums.along)
        observe(1, moving, s, out, c)
    s.totals[FRICTION_WORK] = friction + way * total(a.sums.work)
    s.totals[VISCOUS_WORK] = viscous + way * c.damping * c.dt * total(a.sums.squares)
