"""How the blocks of a lattice lie in memory: one array ("plane") a quantity, row after row, with a frame.

Rows begin at cache lines and lie between rows and columns of places where no block is. These never move or, with
periodic edges, repeat the opposite side, so that a loop over a row needs no branches at its ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.simulate.engines.jit import inner
from tribo.simulate.engines.lattice import INNER, Lattice

LINE, PAGE = 8, 512  # numbers in a cache line, and in the bytes after which cache sets repeat


class Layout(NamedTuple):
    """Where the blocks lie: block (x, y) at ``first + y width + x`` of every plane."""

    width: int
    first: int
    last: int  # end of the stretch that is worked on, a whole number of vectors
    places: int


def layout_of(nx: int, ny: int) -> Layout:
    """Rows and first blocks begin at cache lines; equal places of two planes never share a cache set."""
    width = -(-(nx + 2) // LINE) * LINE
    first = LINE + width
    last = first + -(-ny * width // (4 * LINE)) * 4 * LINE
    least = last + width + LINE
    return Layout(width, first, last, least + (PAGE // 7 // LINE * LINE - least) % PAGE)


def interleaved(nx: int, ny: int, planes: int) -> tuple[Layout, list[FloatArray]]:
    """As many planes in one array, row by row, so that what belongs to a block lies in few pages of memory.

    Each plane is a view of the array from its own beginning on. The last eight places of a row belong to no strip.
    """
    row = (-(-nx // LINE) + 1) * LINE
    width = planes * row
    layout = Layout(width, width + LINE, width + LINE + ny * width, (ny + 3) * width)
    whole = aligned(1, layout.places)[0]
    return layout, [whole[k * row : (ny + 2) * width + k * row] for k in range(planes)]


def aligned(rows: int, places: int) -> FloatArray:
    """Zeros that begin at a cache line."""
    room = np.zeros(rows * places + LINE)
    skip = -room.ctypes.data % (8 * LINE) // 8
    return room[skip : skip + rows * places].reshape(rows, places)


def places_of(layout: Layout, nx: int, ny: int) -> NDArray[np.int64]:
    """The place of every block, in the order of the blocks."""
    y, x = np.divmod(np.arange(nx * ny), nx)
    return np.asarray(layout.first + y * layout.width + x)


def spare_stiffness(lattice: Lattice) -> FloatArray:
    """Own stiffness (xx, yy, xy) per K_int that each block lacks against an inner one; (n, 3), zero inside."""
    spare = np.add(INNER, (lattice.shear, lattice.shear, 0.0)) - lattice.own[:-1]
    spare[np.abs(spare).max(axis=1) <= 1e-9] = 0.0
    return spare


@inner
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
