"""The same time step on all blocks at once, laid out so that the processor's vector units can be used.

The lattice lies row by row in one array, between rows and columns of blocks that never move (or, with periodic edges,
repeat the opposite side), so that one loop without branches runs over all rows. Displacements and velocities are the
true ones here, not counted from the quasi-static motion: the slider then pulls every block with the same force.
A velocity is stored as m v / dt, the force in N that would stop the block within one step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.simulate.engines import kernels as k
from tribo.simulate.engines.jit import compiled, copied_into_callers, vectorised, widest_vectors
from tribo.simulate.engines.kernels import CODE, DENSE_STEPS, RUNNING, STEP, Numerics, Samples, State, observe
from tribo.simulate.engines.lattice import INNER, OFFSETS, Lattice
from tribo.simulate.friction import sliding_threshold, static_threshold

# rows of Field.planes: m v / dt and its amount (zero at rest), thresholds (static now, sliding), time of the last
# stop, static threshold after a slip
PX, PY, PACE, FS, FD, SINCE, FA, PLANES = range(8)


LINE, PAGE = 8, 512  # numbers in a cache line, and in the bytes after which cache sets repeat


class Layout(NamedTuple):
    """Where the blocks lie: block (x, y) at ``first + y width + x``."""

    width: int
    first: int
    last: int  # end of the stretch that is worked on, a whole number of vectors
    places: int


class Field(NamedTuple):
    """All blocks of a run, one place a block and some between the rows for the frame; N and m."""

    layout: Layout
    positions: FloatArray  # (4, places): x and y displacement before and after a step, in turns
    planes: FloatArray  # (PLANES, places)
    edge: NDArray[np.int64]  # (m,) places of the blocks at free edges
    spare: FloatArray  # (3, m) N/m: own stiffness (xx, yy, xy) that these lack against an inner block
    there: FloatArray  # (places,) 1 where a spring may end: on blocks and, with periodic edges, on their copies
    follow: float  # m a step: what the quasi-static motion adds to the sum of displacements along the pull
    pull_x: float  # N/s: rate of the slider's pull on every block
    pull_y: float


def layout_of(nx: int, ny: int) -> Layout:
    """Rows and first blocks begin at cache lines; equal places of two planes never share a cache set."""
    width = -(-(nx + 2) // LINE) * LINE
    first = LINE + width
    last = first + -(-ny * width // (4 * LINE)) * 4 * LINE
    least = last + width + LINE
    return Layout(width, first, last, least + (PAGE // 7 // LINE * LINE - least) % PAGE)


def field_of(state: State, numerics: Numerics, lattice: Lattice, follow: FloatArray) -> Field:
    """The blocks of a state; ``follow`` (n, 2) is the quasi-static velocity of the cavities in m/s."""
    layout = layout_of(lattice.nx, lattice.ny)
    inside = _places(layout, lattice)
    now = numerics.start + int(state.counts[STEP]) * numerics.dt
    cells = state.cells[:-1]
    positions, planes = _aligned(4, layout.places), _aligned(PLANES, layout.places)
    positions[:2, inside] = (cells[:, k.QX : k.QY + 1] + follow * now).T
    planes[PX : PY + 1, inside] = (cells[:, k.VX : k.VY + 1] + follow).T * (numerics.mass / numerics.dt)
    planes[PACE] = np.hypot(planes[PX], planes[PY])
    planes[FS] = np.inf
    planes[FA] = np.inf
    for row, column in ((FS, k.FS), (FD, k.FD), (SINCE, k.SINCE), (FA, k.FA)):
        planes[row, inside] = cells[:, column]
    inner = numerics.stiffness * np.add(INNER, (lattice.shear, lattice.shear, 0.0))
    spare = inner - cells[:, k.KXX : k.KXY + 1]
    edge = np.flatnonzero(np.abs(spare).max(axis=1) > 1e-9 * numerics.stiffness)
    spare = np.ascontiguousarray(spare[edge].T)
    there = _aligned(1, layout.places)[0]
    there[inside] = 1.0
    if lattice.periodic:
        wrap(there, layout, lattice.nx, lattice.ny)
    direction = np.array([numerics.direction_x, numerics.direction_y])
    pull = numerics.shear_stiffness * numerics.speed * direction
    along = numerics.dt * float((follow @ direction).sum())
    return Field(layout, positions, planes, inside[edge], spare, there, along, *map(float, pull))


def _aligned(rows: int, places: int) -> FloatArray:
    """Zeros that begin at a cache line."""
    room = np.zeros(rows * places + LINE)
    skip = -room.ctypes.data % (8 * LINE) // 8
    return room[skip : skip + rows * places].reshape(rows, places)


def _places(layout: Layout, lattice: Lattice) -> NDArray[np.int64]:
    y, x = np.divmod(np.arange(lattice.nx * lattice.ny), lattice.nx)
    return np.asarray(layout.first + y * layout.width + x)


def advance_dense(
    state: State, out: Samples, numerics: Numerics, until_step: int, lattice: Lattice, follow: FloatArray
) -> None:
    """Integrate all blocks until few enough move, then return them to the active set."""
    field = field_of(state, numerics, lattice, follow)
    state.counts[CODE] = RUNNING
    swapped = integrate(field, state, out, numerics, until_step)
    put_back(field, swapped, state, numerics, lattice, follow)
    k.start_lists(state, numerics)


def put_back(
    field: Field, swapped: bool, state: State, numerics: Numerics, lattice: Lattice, follow: FloatArray
) -> None:
    """Write displacements, velocities and forces into the state; calm cavity blocks come to rest."""
    inside = _places(field.layout, lattice)
    cells, contact = state.cells[:-1], lattice.contact
    now = numerics.start + int(state.counts[STEP]) * numerics.dt
    with np.errstate(over="ignore", invalid="ignore"):  # the caller refuses a run that met such a number
        newest = field.positions[2:] if swapped else field.positions[:2]
        cells[:, k.QX : k.QY + 1] = newest[:, inside].T - follow * now
        cells[:, k.VX : k.VY + 1] = field.planes[PX : PY + 1, inside].T * (numerics.dt / numerics.mass) - follow
        cells[:, k.SINCE] = field.planes[SINCE, inside]
        cells[:, k.FS] = field.planes[FS, inside]
        drag = -numerics.mass * numerics.damping * follow
        force = numerics.stiffness * lattice.spring_forces(cells[:, k.QX : k.QY + 1]) + drag
        cells[:, k.GX : k.GY + 1] = force
        speed = np.hypot(*cells[:, k.VX : k.VY + 1].T)
        rest_speed = numerics.rest_force / math.sqrt(numerics.stiffness * numerics.mass)
        calm = ~contact & (speed < rest_speed) & (np.hypot(*force.T) < numerics.rest_force)
    cells[calm, k.VX : k.VY + 1] = 0.0


@compiled
def integrate(f: Field, s: State, out: Samples, c: Numerics, until_step: int) -> bool:
    """Steps of all blocks up to ``until_step``, or fewer once the active set would be faster.

    True if the newest positions are the second two rows.
    """
    widest_vectors()
    swapped = False
    first, last, width = f.layout.first, f.layout.last, f.layout.width
    p_x, p_y, pace = f.planes[PX, first:last], f.planes[PY, first:last], f.planes[PACE, first:last]
    fs, fd, since = f.planes[FS, first:last], f.planes[FD, first:last], f.planes[SINCE, first:last]
    again = None if c.weakens is None else f.planes[FA, first:last]
    own = 12.0 + 4.0 * c.shear_stiffness / c.stiffness
    way = c.dt * c.dt / c.mass
    rest = c.rest_force * math.sqrt(c.mass / c.stiffness) / c.dt
    while s.counts[STEP] < until_step and s.counts[CODE] == RUNNING:
        before, after = (2, 0) if swapped else (0, 2)
        x, y = f.positions[before], f.positions[before + 1]
        if c.periodic:
            wrap(x, f.layout, c.nx, c.ny)
            wrap(y, f.layout, c.nx, c.ny)
        t = c.start + s.counts[STEP] * c.dt
        if c.spacing > 0.0:
            pushed_apart(f, x, y, c, t)
        else:
            pushed(
                x[first + width - 1 :], x[first - 1 : last + 1], x[first - width - 1 : last - width + 1],
                y[first + width - 1 :], y[first - 1 : last + 1], y[first - width - 1 : last - width + 1],
                p_x, p_y, 0.25 * c.stiffness, own, 1.0 - c.damping * c.dt, f.pull_x * t, f.pull_y * t,
            )  # fmt: skip
            free_edges(f, x, y)
        sum_x, sum_y, squares, work = rubbed(
            x[first:last], y[first:last], f.positions[after, first:last], f.positions[after + 1, first:last],
            p_x, p_y, pace, fs, fd, since, t, way, c.dt / c.mass, c.law, again,
        )  # fmt: skip
        swapped = not swapped
        s.totals[k.ALONG] += way * (sum_x * c.direction_x + sum_y * c.direction_y) - f.follow
        s.totals[k.FRICTION_WORK] += way * work
        s.totals[k.VISCOUS_WORK] += way * squares * c.damping * c.dt
        s.counts[DENSE_STEPS] += 1
        moving, active = 0, c.nx * c.ny
        check = (s.counts[STEP] + 1) % 16 == 0
        if check or (s.counts[STEP] + 1) % c.stride == 0:
            moving, active = count_moving(pace, fs, rest)
        observe(1, moving, s, out, c)
        if check and active < c.dense_above // 2:
            break
    return swapped


@compiled
def pushed_apart(f: Field, x: FloatArray, y: FloatArray, c: Numerics, t: float) -> None:
    """As :func:`pushed` and :func:`free_edges`, with springs that turn with their ends (the full r_ij of the paper)."""
    keep = 1.0 - c.damping * c.dt
    for i in range(f.layout.first, f.layout.last):
        force_x = f.pull_x * t - c.shear_stiffness * x[i]
        force_y = f.pull_y * t - c.shear_stiffness * y[i]
        for column, row in OFFSETS:
            j = i + row * f.layout.width + column
            long = column * row != 0
            rest = c.spacing * (math.sqrt(2.0) if long else 1.0)
            r_x = c.spacing * column + x[j] - x[i]
            r_y = c.spacing * row + y[j] - y[i]
            r = math.sqrt(r_x * r_x + r_y * r_y)
            pull = f.there[j] * c.stiffness * (0.5 if long else 1.0) * (r - rest) / r
            force_x += pull * r_x
            force_y += pull * r_y
        f.planes[PX, i] = keep * f.planes[PX, i] + f.there[i] * force_x
        f.planes[PY, i] = keep * f.planes[PY, i] + f.there[i] * force_y


@compiled
def free_edges(f: Field, x: FloatArray, y: FloatArray) -> None:
    """Take back what :func:`pushed` has of springs that are not there."""
    p_x, p_y = f.planes[PX], f.planes[PY]
    own_x, own_y, across = f.spare[0], f.spare[1], f.spare[2]
    for m in range(len(f.edge)):
        i = np.uint64(f.edge[m])  # spares the check for indices that count from the end
        p_x[i] += own_x[m] * x[i] + across[m] * y[i]
        p_y[i] += across[m] * x[i] + own_y[m] * y[i]


@compiled
def wrap(a: FloatArray, layout: Layout, nx: int, ny: int) -> None:
    """Put a copy of each side beyond the opposite one."""
    top = layout.first + (ny - 1) * layout.width
    below, above = layout.first - layout.width, top + layout.width
    for x in range(nx):
        a[below + x] = a[top + x]
        a[above + x] = a[layout.first + x]
    for row in range(below, above + 1, layout.width):
        a[row - 1] = a[row + nx - 1]
        a[row + nx] = a[row]


@vectorised
def pushed(
    x_up: FloatArray,
    x_row: FloatArray,
    x_down: FloatArray,
    y_up: FloatArray,
    y_row: FloatArray,
    y_down: FloatArray,
    p_x: FloatArray,
    p_y: FloatArray,
    quarter: float,
    own: float,
    keep: float,
    pull_x: float,
    pull_y: float,
) -> None:
    """m v / dt after damping, springs and slider, before friction, as if all blocks had eight neighbours.

    Positions reach one place further on both sides than ``p_x``. ``quarter`` is K_int / 4, ``own`` the stiffness of a
    block against all its springs in units of that.
    """
    widest_vectors()
    copied_into_callers()
    for i in range(len(p_x)):
        rising = x_up[i + 2] + y_up[i + 2] + x_down[i] + y_down[i]
        falling = x_up[i] - y_up[i] + x_down[i + 2] - y_down[i + 2]
        bent_x = 4.0 * (x_row[i + 2] + x_row[i]) + rising + falling - own * x_row[i + 1]
        bent_y = 4.0 * (y_up[i + 1] + y_down[i + 1]) + rising - falling - own * y_row[i + 1]
        p_x[i] = keep * p_x[i] + quarter * bent_x + pull_x
        p_y[i] = keep * p_y[i] + quarter * bent_y + pull_y


@vectorised
def rubbed(
    x: FloatArray,
    y: FloatArray,
    new_x: FloatArray,
    new_y: FloatArray,
    p_x: FloatArray,
    p_y: FloatArray,
    pace: FloatArray,
    fs: FloatArray,
    fd: FloatArray,
    since: FloatArray,
    t: float,
    way: float,
    speed_of: float,
    law: FloatArray | None,
    again: FloatArray | None,
) -> tuple[float, float, float, float]:
    """Friction and displacement of all blocks: :func:`tribo.simulate.engines.kernels.kick` in N, without a branch.

    ``pace`` is |p| after the last step, zero at rest; ``way`` turns p into the displacement of a step, ``speed_of``
    into a speed. Returns the sums of p_x, p_y, p2 and |p| times friction.
    """
    widest_vectors()
    copied_into_callers()
    sum_x = 0.0
    sum_y = 0.0
    squares = 0.0
    work = 0.0
    for i in range(len(p_x)):
        a = p_x[i]
        b = p_y[i]
        drive = math.sqrt(a * a + b * b)
        was = pace[i]
        sliding = sliding_threshold(fd[i], speed_of * was, law)
        holding = static_threshold(fs[i], t - since[i], law)
        excess = drive - sliding
        rubs = fs[i] > 0.0
        stops = rubs & (was > 0.0) & (excess <= 0.0)
        rests = rubs & (was == 0.0)
        begins = 0.5 if drive > holding else 0.0  # the first kick of a slip is half a step long
        part = (begins if rests else 1.0) * max(excess, 0.0)
        middle = was + excess
        part = 0.125 * middle * middle if stops else part  # kernels.last_stretch
        whole = drive * (was - excess if stops else 1.0)
        share = part / (whole if whole > 0.0 else 1.0)
        length = share * drive
        a *= share
        b *= share
        new_x[i] = x[i] + way * a
        new_y[i] = y[i] + way * b
        sum_x += a
        sum_y += b
        squares += length * length
        work += length * sliding
        pace[i] = 0.0 if stops else length
        p_x[i] = 0.0 if stops else a
        p_y[i] = 0.0 if stops else b
        if law is not None:
            since[i] = t if stops else since[i]
        if again is not None:
            fs[i] = again[i] if rubs & (length > 0.0) else fs[i]
    return sum_x, sum_y, squares, work


@vectorised
def count_moving(pace: FloatArray, fs: FloatArray, rest: float) -> tuple[int, int]:
    """Contact blocks that move, and with them the cavity blocks faster than ``rest``."""
    widest_vectors()
    copied_into_callers()
    contacts = 0
    active = 0
    for i in range(len(pace)):
        rubs = fs[i] > 0.0
        contacts += 1 if rubs & (pace[i] > 0.0) else 0
        active += 1 if pace[i] > (0.0 if rubs else rest) else 0
    return contacts, active
