"""The loops of the fast engine over strips: eight blocks side by side, which the vector units take at once.

Blocks lie in one array ("plane") a quantity, row after row. Rows begin at cache lines and lie between rows and columns
of places where no block is; these never move or, with periodic edges, repeat the opposite side, so that a loop over a
row needs no branches at its ends.

``forces`` finds the force on every block of the strips it is given, and whether one of them starts to move.
``glides`` moves the cavity blocks of strips in which no contact block slides, ``slides`` all blocks of the others.
Which strips these are is kept in :mod:`tribo.springblock.engines.active`. A velocity is stored as m v / dt, the force
in N that would stop the block within one step.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock.engines import state as k
from tribo.springblock.engines.jit import copied_into_callers, inner, inner_vectorised, widest_vectors
from tribo.springblock.engines.state import (
    Numerics,
    State,
    drag_weight,
    pace_after,
    slider_time,
    sliding_threshold,
    static_threshold,
)
from tribo.springblock.lattice import INNER, Lattice

LINE = 8  # numbers in a cache line


def interleaved(nx: int, ny: int, planes: int) -> tuple[int, int, list[FloatArray]]:
    """As many planes in one array, row by row, so that what belongs to a block lies in few pages of memory.

    Each plane is a view of the array from its own beginning on, with block (x, y) at ``first + y width + x``; returns
    first, width and the planes. The last eight places of a row belong to no strip.
    """
    row = (-(-nx // LINE) + 1) * LINE
    width = planes * row
    whole = aligned(1, (ny + 3) * width)[0]
    return width + LINE, width, [whole[k * row : (ny + 2) * width + k * row] for k in range(planes)]


def aligned(rows: int, places: int) -> FloatArray:
    """Zeros that begin at a cache line."""
    room = np.zeros(rows * places + LINE)
    skip = -room.ctypes.data % (8 * LINE) // 8
    return room[skip : skip + rows * places].reshape(rows, places)


def places_of(first: int, width: int, nx: int, ny: int) -> NDArray[np.int64]:
    """The place of every block, in the order of the blocks."""
    y, x = np.divmod(np.arange(nx * ny), nx)
    return np.asarray(first + y * width + x)


def spare_stiffness(lattice: Lattice) -> FloatArray:
    """Own stiffness (xx, yy, xy) per K_int that each block lacks against an inner one; (n, 3), zero inside."""
    inner_shear = lattice.shear if lattice.pulled is None else 0.0
    spare = np.add(INNER, (inner_shear, inner_shear, 0.0)) - lattice.own[:-1]
    spare[np.abs(spare).max(axis=1) <= 1e-9] = 0.0
    return spare


@inner
def wrap(a: FloatArray, first: int, width: int, nx: int, ny: int) -> None:
    """Put a copy of each side beyond the opposite one."""
    top = first + (ny - 1) * width
    below, above = first - width, top + width
    for x in range(nx):
        a[below + x] = a[top + x]
        a[above + x] = a[first + x]
    for row in range(below, above + 1, width):
        a[row - 1] = a[row + nx - 1]
        a[row + nx] = a[row]


LANES = LINE  # blocks in a strip
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
NOTHING, CONTACT, CAVITY = 0.0, 1.0, 2.0  # Planes.kind


class Planes(NamedTuple):
    """All blocks row by row, block (x, y) at ``first + y width + x``, and where the strips lie; N and m."""

    q_x: FloatArray
    q_y: FloatArray
    q_sum: FloatArray  # q_x + q_y and q_x - q_y, which the diagonal springs stretch with
    q_gap: FloatArray
    p_x: FloatArray  # m v / dt
    p_y: FloatArray
    f_x: FloatArray  # force but for friction, of the last time it was asked for
    f_y: FloatArray
    pull_x: FloatArray  # N/s on contact blocks; N, the drag of the quasi-static motion, on cavity blocks
    pull_y: FloatArray
    kind: FloatArray
    hold: FloatArray  # force beyond which a block at rest moves; infinite while it does, and where no block is
    again: FloatArray  # what a block that stops holds from then on
    sliding: FloatArray
    pace: FloatArray  # amount of m v / dt of contact blocks, zero at rest
    since: FloatArray  # time of the last stop; infinite on cavities, which do not age
    bond: FloatArray  # N/m: stiffness of contact; empty, as the next five, where contact is rigid
    anchor_x: FloatArray  # displacement at which the bond of a block is free of force
    anchor_y: FloatArray
    frame_x: FloatArray  # m w / dt of the quasi-static motion
    frame_y: FloatArray
    wake: FloatArray  # force beyond which a block moves in a strip at rest; infinite in others, and where no block is
    place: NDArray[np.int64]  # (strips,) where each begins
    edge: NDArray[np.int64]  # (strips,) where its blocks begin in ``spare``, -1 for strips without free edges
    spare_xx: FloatArray  # N/m: own stiffness that blocks at free edges lack against an inner one
    spare_yy: FloatArray
    spare_xy: FloatArray
    first: int
    width: int


class Sums(NamedTuple):
    """Sums over all steps, one a lane: m v / dt along the pull, its square, and its amount times friction."""

    along: FloatArray
    squares: FloatArray
    work: FloatArray


def planes_of(
    state: State, numerics: Numerics, lattice: Lattice, pull: FloatArray, follow: FloatArray | None = None
) -> Planes:
    """The blocks of a state as the loops take them.

    ``pull`` (n, 2): N/s on contact blocks, N on cavity blocks (N s where the machine is not rigid); ``follow`` (n, 2),
    their quasi-static velocity, stands in its place where contact is elastic.
    """
    nx, ny = lattice.nx, lattice.ny
    bound = lattice.bond is not None
    framed = bound or numerics.machine is not None
    first, width, planes = interleaved(nx, ny, 22 if framed else 16)
    planes += [] if framed else [np.zeros(0)] * 6
    inside = places_of(first, width, nx, ny)
    cells, contact = state.cells, lattice.contact
    q_x, q_y, q_sum, q_gap, p_x, p_y, _, _, pull_x, pull_y, kind, hold, again, sliding, pace, since = planes[:16]
    q_x[inside], q_y[inside] = cells[:, k.QX], cells[:, k.QY]
    q_sum[inside], q_gap[inside] = q_x[inside] + q_y[inside], q_x[inside] - q_y[inside]
    if numerics.periodic:
        for plane in (q_x, q_y, q_sum, q_gap):
            wrap(plane, first, width, nx, ny)
    p_x[inside], p_y[inside] = cells[:, k.VX : k.VY + 1].T * (numerics.mass / numerics.dt)
    pace[inside] = np.hypot(p_x[inside], p_y[inside])
    pull_x[inside], pull_y[inside] = pull.T
    kind[inside] = np.where(contact, CONTACT, CAVITY)
    moves = pace[inside] != 0.0
    across = -(-nx // LANES)
    row, column = np.divmod(np.arange(across * ny), across)
    place = first + row * width + LANES * column
    lanes = place[:, None] + np.arange(LANES)
    hold[lanes] = since[lanes] = np.inf
    hold[inside] = np.where(moves, np.inf, np.where(contact, cells[:, k.FS], 2.0 * numerics.rest_force))
    again[inside], sliding[inside] = cells[:, k.FA], cells[:, k.FD]
    since[inside] = np.where(contact, cells[:, k.SINCE], np.inf)
    bond, _, _, frame_x, frame_y, wake = planes[16:]
    if framed and follow is not None:
        frame_x[inside], frame_y[inside] = follow.T * (numerics.mass / numerics.dt)
    if lattice.bond is not None:
        bond[inside] = numerics.stiffness * lattice.bond
        wake[lanes] = hold[lanes]
        wake[inside] = 2.0 * numerics.rest_force
        hold[inside[~contact]] = np.inf
    edge, spare = _spare(lattice, numerics.stiffness)
    rows: Any = [*planes, place, edge, *spare, first, width]
    return Planes(*rows)


def _spare(lattice: Lattice, stiffness: float) -> tuple[NDArray[np.int64], FloatArray]:
    """``Planes.edge``, and the spare stiffness of the blocks of these strips; (3, 8 strips at free edges)."""
    nx, ny = lattice.nx, lattice.ny
    rows = np.zeros((ny, -(-nx // LANES) * LANES, 3))
    rows[:, :nx] = stiffness * spare_stiffness(lattice).reshape(ny, nx, 3)
    by_strip = rows.reshape(-1, LANES, 3)
    lacking = by_strip.any(axis=(1, 2))
    edge = np.where(lacking, LANES * (np.cumsum(lacking) - 1), -1)
    spare = aligned(3, max(1, int(lacking.sum())) * LANES)
    spare[:, : LANES * int(lacking.sum())] = by_strip[lacking].reshape(-1, 3).T
    return edge, spare


@inner_vectorised
def forces(p: Planes, strips: IntArray, starts: BoolArray, c: Numerics, t: float) -> None:
    """Force on all blocks of these strips at time t; ``starts`` becomes true where one that rests gives way."""
    widest_vectors()
    copied_into_callers()
    one, width = np.uint64(1), np.uint64(p.width)
    quarter = 0.25 * c.stiffness
    own = 4.0 * INNER[0] + 4.0 * c.inner_shear / c.stiffness
    load, drag = slider_time(t, c.machine), drag_weight(c.damping, c.machine)
    for m in range(len(strips)):
        first = np.uint64(p.place[strips[m]])  # unsigned, so that no index counts from the end
        beyond = False
        for lane in range(LANES):
            i = first + np.uint64(lane)
            up, down = i - width, i + width
            rising = p.q_sum[down + one] + p.q_sum[up - one]
            falling = p.q_gap[down - one] + p.q_gap[up + one]
            bent_x = 4.0 * (p.q_x[i + one] + p.q_x[i - one]) + rising + falling - own * p.q_x[i]
            bent_y = 4.0 * (p.q_y[up] + p.q_y[down]) + rising - falling - own * p.q_y[i]
            weight = load if p.kind[i] == CONTACT else drag
            f_x = quarter * bent_x + weight * p.pull_x[i]
            f_y = quarter * bent_y + weight * p.pull_y[i]
            p.f_x[i] = f_x
            p.f_y[i] = f_y
            hold = static_threshold(p.hold[i], t - p.since[i], c.law)
            beyond |= f_x * f_x + f_y * f_y > hold * hold
        if p.edge[strips[m]] >= 0:
            near = np.uint64(p.edge[strips[m]])
            beyond = False
            for lane in range(LANES):
                i, j = first + np.uint64(lane), near + np.uint64(lane)
                f_x = p.f_x[i] + p.spare_xx[j] * p.q_x[i] + p.spare_xy[j] * p.q_y[i]
                f_y = p.f_y[i] + p.spare_xy[j] * p.q_x[i] + p.spare_yy[j] * p.q_y[i]
                p.f_x[i] = f_x
                p.f_y[i] = f_y
                hold = static_threshold(p.hold[i], t - p.since[i], c.law)
                beyond |= f_x * f_x + f_y * f_y > hold * hold
        if beyond:  # written only where it changes: other threads use what lies beside it
            starts[strips[m]] = True


@inner
def carried(a: float, b: float, w_x: float, w_y: float, dt: float, machine: FloatArray | None) -> float:
    """What the quasi-static motion adds to the square of m v / dt; left out where the slider is never fast."""
    copied_into_callers()
    if machine is None:
        return 0.0
    pace = pace_after(dt, machine)
    return pace * (2.0 * (a * w_x + b * w_y) + pace * (w_x * w_x + w_y * w_y))


@inner
def frame_of(frame: FloatArray, i: Any, machine: FloatArray | None) -> float:
    """m w / dt of a block, where it is kept."""
    copied_into_callers()
    if machine is None:
        return 0.0
    return frame[i]


@inner_vectorised
def glides(p: Planes, strips: IntArray, calm: BoolArray, c: Numerics, sums: Sums) -> None:
    """Move the cavity blocks of these gliding strips; ``calm`` of a strip, whether all of them may rest."""
    widest_vectors()
    copied_into_callers()
    keep = 1.0 - c.damping * c.dt
    way = c.dt * c.dt / c.mass
    quiet = c.rest_force * c.rest_force
    slow = quiet * c.mass / (c.stiffness * c.dt * c.dt)
    for m in range(len(strips)):
        first = np.uint64(p.place[strips[m]])
        loud = False
        for lane in range(LANES):
            i = first + np.uint64(lane)
            free = 1.0 if p.kind[i] == CAVITY else 0.0
            f_x, f_y = free * p.f_x[i], free * p.f_y[i]
            a = keep * p.p_x[i] + f_x
            b = keep * p.p_y[i] + f_y
            squares = a * a + b * b
            loud |= (squares >= slow) | (f_x * f_x + f_y * f_y >= quiet)
            p.p_x[i] = a
            p.p_y[i] = b
            x = p.q_x[i] + way * a
            y = p.q_y[i] + way * b
            p.q_x[i] = x
            p.q_y[i] = y
            p.q_sum[i] = x + y
            p.q_gap[i] = x - y
            sums.along[lane] += a * c.direction_x + b * c.direction_y
            w_x, w_y = frame_of(p.frame_x, i, c.machine), frame_of(p.frame_y, i, c.machine)
            sums.squares[lane] += squares + carried(a, b, w_x, w_y, c.dt, c.machine)
        if calm[strips[m]] == loud:
            calm[strips[m]] = not loud


@inner_vectorised
def slides(p: Planes, strips: IntArray, moving: IntArray, c: Numerics, step: int, sums: Sums) -> None:
    """Friction and displacement of all blocks of these sliding strips; ``moving`` contact blocks of each.

    Driving force and damping change the velocity, then friction takes an impulse from it, which can stop a block within
    a step but never turn it round. A block at rest meets its static threshold, and its first kick is half a step long:
    velocities belong to the middle of the steps. How far a block still goes that stops: :func:`last_stretch`.
    """
    widest_vectors()
    copied_into_callers()
    t = c.start + step * c.dt
    keep = 1.0 - c.damping * c.dt
    way = c.dt * c.dt / c.mass
    for m in range(len(strips)):
        first = np.uint64(p.place[strips[m]])
        on_the_way = 0
        for lane in range(LANES):
            i = first + np.uint64(lane)
            rubs = p.kind[i] == CONTACT
            a = keep * p.p_x[i] + p.f_x[i]
            b = keep * p.p_y[i] + p.f_y[i]
            drive = math.sqrt(a * a + b * b)
            was = p.pace[i]
            sliding = sliding_threshold(p.sliding[i], c.dt / c.mass * was, c.law)
            holding = static_threshold(p.hold[i], t - p.since[i], c.law)
            excess = drive - sliding
            rests = rubs & (was == 0.0)
            stops = rubs & (was > 0.0) & (excess <= 0.0)
            begins = 0.5 if drive > holding else 0.0
            part = (begins if rests else 1.0) * max(excess, 0.0)
            middle = was + excess
            part = 0.125 * middle * middle if stops else part
            part = part if p.kind[i] != NOTHING else 0.0
            whole = drive * (was - excess if stops else 1.0)
            share = part / (whole if whole > 0.0 else 1.0)
            length = share * drive
            a *= share
            b *= share
            x = p.q_x[i] + way * a
            y = p.q_y[i] + way * b
            p.q_x[i] = x
            p.q_y[i] = y
            p.q_sum[i] = x + y
            p.q_gap[i] = x - y
            sums.along[lane] += a * c.direction_x + b * c.direction_y
            w_x, w_y = frame_of(p.frame_x, i, c.machine), frame_of(p.frame_y, i, c.machine)
            sums.squares[lane] += length * length + carried(a, b, w_x, w_y, c.dt, c.machine)
            sums.work[lane] += length * sliding
            p.p_x[i] = 0.0 if stops else a
            p.p_y[i] = 0.0 if stops else b
            p.pace[i] = 0.0 if stops else length
            slips = length > 0.0
            rested = p.again[i] if stops else p.hold[i]
            p.hold[i] = np.inf if rubs & slips & (not stops) else rested
            if c.law is not None:
                p.since[i] = t if stops else p.since[i]
            on_the_way += 1 if rubs & slips & (not stops) else 0
        if moving[strips[m]] != on_the_way:
            moving[strips[m]] = on_the_way


@inner
def last_stretch(speed: float, drive: float, sliding: float) -> float:
    """Share of ``drive`` that takes a block, within one step, from where it is to where it comes to rest.

    Its speed falls evenly from ``speed`` half a step ago to ``drive - sliding`` < 0 half a step ahead, so it still
    has v2 / 2a to go. Without this every slip would end short, by an amount of order dt squared.
    """
    if drive == 0.0:
        return 0.0
    middle = speed + drive - sliding
    return 0.125 * middle * middle / ((speed + sliding - drive) * drive)
