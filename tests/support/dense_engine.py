"""The same time step on all blocks at once, laid out so that the processor's vector units can be used.

The lattice lies row by row in one array, between rows and columns of blocks that never move (or, with periodic edges,
repeat the opposite side), so that one loop without branches runs over all rows. Displacements and velocities are the
true ones here, not counted from the quasi-static motion: the slider then pulls every block with the same force.
A velocity is stored as m v / dt, the force in N that would stop the block within one step.

It makes nothing that the fast engine does not make faster; importing it adds "dense" to the table of engines, against
which tests and benchmarks hold the fast one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock.config import SimConfig
from tribo.springblock.engine_speed import Timing, timed_run
from tribo.springblock.engines import ENGINES, Engine, state as k
from tribo.springblock.engines.fast import at_rest, in_chunks, refuse_thresholds, trajectory_of
from tribo.springblock.engines.jit import compiled, copied_into_callers, inner, inner_vectorised, widest_vectors
from tribo.springblock.engines.state import (
    CODE,
    DENSE_STEPS,
    RUNNING,
    STEP,
    Numerics,
    Samples,
    State,
    Thresholds,
    Trajectory,
    drive_of,
    first_failure_s,
    longest_rise_s,
    observe,
    sliding_threshold,
    static_threshold,
)
from tribo.springblock.engines.strips import LINE, aligned, places_of, spare_stiffness, wrap
from tribo.springblock.lattice import INNER, NEIGHBOURHOOD, Lattice

# rows of Field.planes: m v / dt and its amount (zero at rest), thresholds (static now, sliding), time of the last
# stop, static threshold after a slip
PX, PY, PACE, FS, FD, SINCE, FA, PLANES = range(8)


PAGE = 512  # numbers in the bytes after which cache sets repeat
ENGINES["dense"] = Engine(__name__, finite_rotation=True, friction_terms=True)


def integrate(config: SimConfig, lattice: Lattice, thresholds: Thresholds, threads: int = 1) -> Trajectory:
    """One run on all blocks at once; as :func:`tribo.springblock.engines.fast.integrate`."""
    refuse_thresholds(thresholds, lattice)
    drive = drive_of(config, lattice)
    failure = first_failure_s(lattice, thresholds, drive, config.stiffness_N_m)
    state, numerics = at_rest(config, lattice, thresholds, drive, failure - 1.5 * config.dt_s)
    kept: list[Samples] = []
    longest = longest_rise_s(config, lattice, thresholds, drive)
    for samples, step in in_chunks(config, longest, state, numerics, kept):
        advance_dense(state, samples, numerics, step, lattice, drive.follow)
    return trajectory_of(kept, state, numerics, drive, failure)


class Layout(NamedTuple):
    """Where the blocks lie: block (x, y) at ``first + y width + x`` of every plane."""

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
    weakens: int | None  # None if a block that has slipped holds as much as before


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
    inside = places_of(layout.first, layout.width, lattice.nx, lattice.ny)
    now = numerics.start + int(state.counts[STEP]) * numerics.dt
    cells = state.cells
    positions, planes = aligned(4, layout.places), aligned(PLANES, layout.places)
    positions[:2, inside] = (cells[:, k.QX : k.QY + 1] + follow * now).T
    planes[PX : PY + 1, inside] = (cells[:, k.VX : k.VY + 1] + follow).T * (numerics.mass / numerics.dt)
    planes[PACE] = np.hypot(planes[PX], planes[PY])
    planes[FS] = np.inf
    planes[FA] = np.inf
    for row, column in ((FS, k.FS), (FD, k.FD), (SINCE, k.SINCE), (FA, k.FA)):
        planes[row, inside] = cells[:, column]
    spare = numerics.stiffness * spare_stiffness(lattice)
    edge = np.flatnonzero(spare.any(axis=1))
    spare = np.ascontiguousarray(spare[edge].T)
    there = aligned(1, layout.places)[0]
    there[inside] = 1.0
    if lattice.periodic:
        wrap(there, layout.first, layout.width, lattice.nx, lattice.ny)
    direction = np.array([numerics.direction_x, numerics.direction_y])
    pull = numerics.shear_stiffness * numerics.speed * direction
    along = numerics.dt * float((follow @ direction).sum())
    weakens = None if np.array_equal(cells[:, k.FA], cells[:, k.FS]) else 1
    pull_x, pull_y = map(float, pull)
    return Field(layout, positions, planes, inside[edge], spare, there, along, pull_x, pull_y, weakens)


def advance_dense(
    state: State, out: Samples, numerics: Numerics, until_step: int, lattice: Lattice, follow: FloatArray
) -> None:
    """Integrate all blocks of a state to a step, or to the end of the run."""
    field = field_of(state, numerics, lattice, follow)
    swapped = steps_of_all(field, state, out, numerics, until_step)
    inside = places_of(field.layout.first, field.layout.width, lattice.nx, lattice.ny)
    cells = state.cells
    now = numerics.start + int(state.counts[STEP]) * numerics.dt
    with np.errstate(over="ignore", invalid="ignore"):  # the caller refuses a run that met such a number
        newest = field.positions[2:] if swapped else field.positions[:2]
        cells[:, k.QX : k.QY + 1] = newest[:, inside].T - follow * now
        cells[:, k.VX : k.VY + 1] = field.planes[PX : PY + 1, inside].T * (numerics.dt / numerics.mass) - follow
    cells[:, k.SINCE] = field.planes[SINCE, inside]
    cells[:, k.FS] = field.planes[FS, inside]


@compiled
def steps_of_all(f: Field, s: State, out: Samples, c: Numerics, until_step: int) -> bool:
    """Steps of all blocks up to ``until_step``; true if the newest positions are the second two rows."""
    widest_vectors()
    swapped = False
    first, last, width = f.layout.first, f.layout.last, f.layout.width
    p_x, p_y, pace = f.planes[PX, first:last], f.planes[PY, first:last], f.planes[PACE, first:last]
    fs, fd, since = f.planes[FS, first:last], f.planes[FD, first:last], f.planes[SINCE, first:last]
    again = None if f.weakens is None else f.planes[FA, first:last]
    own = 4.0 * INNER[0] + 4.0 * c.shear_stiffness / c.stiffness
    way = c.dt * c.dt / c.mass
    while s.counts[STEP] < until_step and s.counts[CODE] == RUNNING:
        before, after = (2, 0) if swapped else (0, 2)
        x, y = f.positions[before], f.positions[before + 1]
        if c.periodic:
            wrap(x, f.layout.first, f.layout.width, c.nx, c.ny)
            wrap(y, f.layout.first, f.layout.width, c.nx, c.ny)
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
        moving = 0
        if (s.counts[STEP] + 1) % c.stride == 0:
            moving = count_moving(pace, fs)
        observe(1, moving, s, out, c)
    return swapped


@inner
def pushed_apart(f: Field, x: FloatArray, y: FloatArray, c: Numerics, t: float) -> None:
    """As :func:`pushed` and :func:`free_edges`, with springs that turn with their ends (the full r_ij of the paper)."""
    keep = 1.0 - c.damping * c.dt
    for i in range(f.layout.first, f.layout.last):
        force_x = f.pull_x * t - c.shear_stiffness * x[i]
        force_y = f.pull_y * t - c.shear_stiffness * y[i]
        for column, row, share in NEIGHBOURHOOD:
            j = i + row * f.layout.width + column
            rest = c.spacing * math.sqrt(float(column * column + row * row))
            r_x = c.spacing * column + x[j] - x[i]
            r_y = c.spacing * row + y[j] - y[i]
            r = math.sqrt(r_x * r_x + r_y * r_y)
            pull = f.there[j] * c.stiffness * share * (r - rest) / r
            force_x += pull * r_x
            force_y += pull * r_y
        f.planes[PX, i] = keep * f.planes[PX, i] + f.there[i] * force_x
        f.planes[PY, i] = keep * f.planes[PY, i] + f.there[i] * force_y


@inner
def free_edges(f: Field, x: FloatArray, y: FloatArray) -> None:
    """Take back what :func:`pushed` has of springs that are not there."""
    p_x, p_y = f.planes[PX], f.planes[PY]
    own_x, own_y, across = f.spare[0], f.spare[1], f.spare[2]
    for m in range(len(f.edge)):
        i = np.uint64(f.edge[m])  # spares the check for indices that count from the end
        p_x[i] += own_x[m] * x[i] + across[m] * y[i]
        p_y[i] += across[m] * x[i] + own_y[m] * y[i]


@inner_vectorised
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


@inner_vectorised
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
    """Friction and displacement of all blocks: :func:`tribo.springblock.engines.strips.slides` on planes of their own.

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
        part = 0.125 * middle * middle if stops else part  # strips.last_stretch
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


@inner_vectorised
def count_moving(pace: FloatArray, fs: FloatArray) -> int:
    """Contact blocks that move."""
    widest_vectors()
    copied_into_callers()
    contacts = 0
    for i in range(len(pace)):
        contacts += 1 if (fs[i] > 0.0) & (pace[i] > 0.0) else 0
    return contacts


def dense_rate() -> Iterator[Timing]:
    """Block updates a second of the dense step on one core, in float64: a long run less a short one, best of three."""
    config = SimConfig(engine="dense")
    (short_s, short), (long_s, long) = (
        min((timed_run(config.with_(duration_s=end)) for _ in range(3)), key=lambda timed: timed[0])
        for end in (3.0e-3, 4.5e-3)
    )
    steps, seconds = long.dense_steps - short.dense_steps, long_s - short_s
    rate = steps * config.blocks[0] * config.blocks[1] / seconds
    yield Timing("dense step", rate, "block updates/s", 2.5e8, note=f"{steps} steps in {seconds:.2f} s")
