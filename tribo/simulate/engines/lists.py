"""The lists of strips in each state, the neighbours that moving strips reach, and the queue of those asleep."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.simulate.engines.jit import inner
from tribo.simulate.engines.state import Numerics

LISTENING, GLIDING, SLIDING, ASLEEP = range(4)  # states of a strip
PENDING = -1  # row of Lists.strips and .members: strips that fell asleep and are not in the queue yet
# columns of Lists.links: state, number of moving strips that reach it, which neighbours it reaches itself (a bit each)
# and would with its cavities alone, place in its list, share of the lattice, bucket of the queue, the strips before and
# after it there, and the eight neighbours, -1 where there is none
STATUS, TOUCHED, REACH, OWN_REACH, PLACE, SHARE, BUCKET, BEFORE, AFTER, NEAR = range(10)
LINKS = NEAR + 8
AROUND = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))  # a bit of REACH each
WEST, MIDDLE, EAST = 0b00000111, 0b00011000, 0b11100000
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
    """All strips asleep, in so many shares. ``cavity`` (strips, lanes) tells the cavity blocks."""
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
    for bit in range(8):
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
