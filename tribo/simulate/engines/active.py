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
from tribo.simulate.engines.strips import CAVITY, CONTACT, LANES, Planes, Sums, forces, glides, slides
from tribo.simulate.friction import static_threshold


class Active(NamedTuple):
    """The blocks of a run, their strips, and what the loops say of each strip."""

    planes: Planes
    sums: Sums
    layout: Layout
    lists: Lists
    starts: NDArray[np.bool_]  # (strips,) a block at rest gives way
    calm: NDArray[np.bool_]  # (strips,) all cavity blocks may rest
    moving: NDArray[np.int64]  # (strips,) contact blocks that move


def active_of(planes: Planes, layout: Layout, numerics: Numerics) -> Active:
    """Lists of a lattice whose blocks move where ``planes.pace`` says so."""
    n = len(planes.place)
    lanes = planes.place[:, None] + np.arange(LANES)
    lists = lists_of(planes.kind[lanes] == CAVITY, numerics)
    for strip in np.flatnonzero((planes.pace[lanes] != 0.0).any(axis=1)):
        here = lanes[strip]
        planes.hold[here[planes.kind[here] == CAVITY]] = np.inf
        leave(int(strip), lists)
        join(int(strip), SLIDING, lists)
        set_reach(int(strip), WEST | MIDDLE | EAST, lists)
    lists.strips[PENDING, :n] = np.arange(n)
    lists.members[PENDING] = n
    starts, calm = np.zeros((2, n), np.bool_)
    return Active(planes, Sums(*np.zeros((3, LANES))), layout, lists, starts, calm, np.zeros(n, np.int64))


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
def start_all(s: State, a: Active, c: Numerics) -> None:
    """Find forces of the strips that listen, glide or slide, and start those of their blocks that give way."""
    copied_into_callers()
    lists = a.lists
    t = c.start + s.counts[STEP] * c.dt
    for status in range(3):
        forces(a.planes, lists.strips, status, lists.members[status], a.starts, c, t)
    for status in range(3):  # strips that begin to listen now join a list that has been seen
        m = lists.members[status] - 1
        while m >= 0:  # from the end: one that leaves is replaced by one that has been seen or has just joined
            strip = lists.strips[status, m]
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
    m = lists.members[GLIDING] - 1
    while m >= 0:
        strip = lists.strips[GLIDING, m]
        m -= 1
        if a.calm[strip]:
            hold_cavities(strip, 2.0 * c.rest_force, a.planes)
            leave(strip, lists)
            rest(strip, lists)
            set_reach(strip, 0, lists)
    m = lists.members[SLIDING] - 1
    while m >= 0:
        strip = lists.strips[SLIDING, m]
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
    forces(a.planes, lists.strips, PENDING, n, a.starts, c, 0.0)
    for m in range(n):
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
    found = 0.0
    for value in values:
        found += value
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
        if lists.members[GLIDING] + lists.members[SLIDING] == 0:
            wait = steps_to_next_failure(s.counts[STEP], until_step - s.counts[STEP], lists.head)
            if wait > 0:
                observe(wait, 0, s, out, c)
                continue
        admit_due(s.counts[STEP], lists)
        start_all(s, a, c)
        s.counts[ACTIVE_STEPS] += LANES * (lists.members[GLIDING] + lists.members[SLIDING])
        glides(a.planes, lists.strips, lists.members[GLIDING], a.calm, c, a.sums)
        slides(a.planes, lists.strips, lists.members[SLIDING], a.moving, c, s.counts[STEP], a.sums)
        if c.periodic:
            for plane in (a.planes.q_x, a.planes.q_y, a.planes.q_sum, a.planes.q_gap):
                wrap(plane, a.layout, c.nx, c.ny)
        moving = 0
        if (s.counts[STEP] + 1) % c.stride == 0:
            for m in range(lists.members[SLIDING]):
                moving += a.moving[lists.strips[SLIDING, m]]
        rest_all(a, c)
        s.totals[ALONG] = along + way * total(a.sums.along)
        observe(1, moving, s, out, c)
    s.totals[FRICTION_WORK] = friction + way * total(a.sums.work)
    s.totals[VISCOUS_WORK] = viscous + way * c.damping * c.dt * total(a.sums.squares)
