"""The lattice: which blocks touch the counterface, their neighbourhood, and the springs between them.

A shape of a pattern is a signed distance, negative inside. Blocks are sampled at points; beside an edge, the share of
the area around a point follows from its distance, so that areas are exact to second order.

Another part solves what cavities do while everything around them sticks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray, Pattern, picture_mask

BoolArray = NDArray[np.bool_]
UM = 1e-6

PAPER_PATTERNS: dict[str, Pattern] = {
    "F": Pattern("F"),
    "A": Pattern("A", "circle", (5 * UM, 5 * UM), (20 * UM, 20 * UM)),
    "B": Pattern("B", "circle", (10 * UM, 10 * UM), (15 * UM, 15 * UM)),
    "C": Pattern("C", "circle", (15 * UM, 15 * UM), (20 * UM, 20 * UM)),
    "S": Pattern("S", "rectangle", (200 * UM, 40 * UM), (220 * UM, 120 * UM), staggered=True),
}
"""The patterns of Berardo et al. 2019, Table 1 (S with the pitch of the table, not of the text)."""

# (size, pitch) in blocks -> first cavity, where the reference lattice does not centre the pattern
_REFERENCE_FIRST = {((40.0, 8.0), (44.0, 24.0)): (4, 11)}


def pattern_of(sample: str) -> Pattern | None:
    """The paper's pattern of a sample name: "Sx" and "Sy" are S; None where the paper has no such sample."""
    return PAPER_PATTERNS.get(sample) or PAPER_PATTERNS.get(sample[:-1] if sample[-1:] in "xy" else sample)


def contact_mask(
    pattern: Pattern,
    blocks: tuple[int, int],
    spacing_m: float,
    first: tuple[int, int] | None = None,
    shape: str = "square",
) -> BoolArray:
    """True where a block touches the counterface.

    Parameters
    ----------
    pattern : Pattern
        Cavity geometry. With ``shape="square"`` circles become squares of the same width (Berardo 2019);
        ``"round"`` keeps them round, which needs a spacing well below the diameter.
    blocks : (int, int)
        Blocks along x and y.
    first : (int, int), optional
        Index of the first block of the first cavity in x and y. By default the pattern is centred over as many
        whole cavities as fit; sample S keeps the reference position (4, 11).

    Returns
    -------
    array of bool, shape (ny, nx)
    """
    nx, ny = blocks
    if pattern.cavity == "none" or pattern.size_m is None or pattern.pitch_m is None:
        return np.ones((ny, nx), bool)
    size = _in_blocks(pattern.size_m, spacing_m)
    pitch = _in_blocks(pattern.pitch_m, spacing_m)
    x0, y0 = first if first is not None else first_cavity(blocks, size, pitch)
    # Half a block off the corner is the centre; the small shift keeps whole numbers clear of rounding.
    y = np.arange(ny) - y0 + 1e-6
    row = np.floor(y / pitch[1])
    shift = np.where(row % 2 == 1, pitch[0] / 2, 0.0) if pattern.staggered else np.zeros(ny)
    x = np.arange(nx)[None, :] - x0 + 1e-6 - np.floor(shift)[:, None]
    in_x, in_y = x % pitch[0], np.broadcast_to((y % pitch[1])[:, None], (ny, nx))
    if shape == "round" and pattern.cavity == "circle":
        a, b = size[0] / 2, size[1] / 2
        return np.asarray(((in_x + 0.5 - a) / a) ** 2 + ((in_y + 0.5 - b) / b) ** 2 > 1.0)
    return np.asarray(~((in_x < size[0]) & (in_y < size[1])))


def first_cavity(
    blocks: tuple[int, int], size: tuple[float, float], pitch: tuple[float, float]
) -> tuple[int, int]:
    """First block of the first cavity, such that as many whole ones as fit lie centred."""
    reference = _REFERENCE_FIRST.get((size, pitch))
    if reference is not None:
        return reference
    starts = []
    for n, s, p in zip(blocks, size, pitch, strict=True):
        repeats = max(np.floor((n - 2 - s) / p), 0.0)
        starts.append(int(np.floor((n - repeats * p - s) / 2)))
    return starts[0], starts[1]


def _in_blocks(lengths_m: tuple[float, float], spacing_m: float) -> tuple[float, float]:
    x, y = (round(length / spacing_m, 6) for length in lengths_m)
    return x, y


NEIGHBOURHOOD = (
    (1, 0, 1.0), (-1, 0, 1.0), (0, 1, 1.0), (0, -1, 1.0), (1, 1, 0.5), (-1, -1, 0.5), (-1, 1, 0.5), (1, -1, 0.5),
)  # fmt: skip
"""Blocks that springs join with one at the origin: offsets along x and y, and the stiffness of the spring over K_int.

All else follows from this, but for the loop over strips (:func:`tribo.springblock.engines.strips.forces`), which is
written out for the vector units.
"""
OFFSETS = tuple((x, y) for x, y, _ in NEIGHBOURHOOD)
NEIGHBOURS = len(NEIGHBOURHOOD)
SIDES = [k for k, (x, y) in enumerate(OFFSETS) if 0 in (x, y)]  # neighbours that share a side with the block
# k n nT of each spring in units of K_int: (xx, yy, xy)
SPRINGS = tuple((x * x * k / (x * x + y * y), y * y * k / (x * x + y * y), x * y * k / (x * x + y * y))
                for x, y, k in NEIGHBOURHOOD)  # fmt: skip
INNER = tuple(sum(parts) for parts in zip(*SPRINGS, strict=True))  # of a block within the lattice
# largest stiffness, per K_int, of a mode that turns from each block to the next along x, along y or along both
STIFFEST = max(
    sum(2.0 * spring[axis] for (x, y), spring in zip(OFFSETS, SPRINGS, strict=True) if (x * turn_x + y * turn_y) % 2)
    for axis in (0, 1)
    for turn_x, turn_y in ((1, 0), (0, 1), (1, 1))
)


@dataclass(frozen=True)
class Lattice:
    """Geometry of a lattice with unit K_int; block i = y nx + x. ``neighbours`` is n where a spring is missing.

    ``own`` holds the stiffness (xx, yy, xy) of each block against the fixed rest, shear spring included;
    ``follow[i]`` the 2 x 2 matrix that turns the velocity of the slider into that of a block that moves while all
    contact blocks stick: a cavity, or any block where contact is elastic; ``lag[i]`` turns it into the displacement by
    which unit drag per velocity holds it back. ``bond`` is the stiffness of contact, None where it is rigid.
    """

    nx: int
    ny: int
    periodic: bool
    shear: float
    contact: NDArray[np.bool_]  # (n,)
    neighbours: NDArray[np.int64]  # (n + 1, NEIGHBOURS)
    own: FloatArray  # (n + 1, 3)
    follow: FloatArray  # (n + 1, 2, 2)
    lag: FloatArray  # (n + 1, 2, 2)
    bond: FloatArray | None = None  # (n,) zero on cavities
    pulled: NDArray[np.int64] | None = None  # blocks that the slider pulls; None where it pulls all
    touching: FloatArray | None = None  # (n,) share of each block that touches; None where it is all or nothing

    @property
    def area_fraction(self) -> float:
        return float(self.contact.mean() if self.touching is None else self.touching.mean())

    @property
    def slider(self) -> FloatArray:
        """Stiffness of the spring between each block and the slider, zero where none is; (n,)."""
        return _slider(self.contact.size, self.shear, self.pulled)

    def spring_forces(self, displacement: FloatArray) -> FloatArray:
        """Elastic force on every block per unit K_int, springs to neighbours and own stiffness; (n, 2)."""
        q = np.concatenate([displacement, np.zeros((1, 2))])
        force = np.zeros_like(q)
        for k, (xx, yy, xy) in enumerate(SPRINGS):
            near = q[self.neighbours[:, k]]
            force[:, 0] += xx * near[:, 0] + xy * near[:, 1]
            force[:, 1] += xy * near[:, 0] + yy * near[:, 1]
        own_xx, own_yy, own_xy = self.own.T
        force[:, 0] -= own_xx * q[:, 0] + own_xy * q[:, 1]
        force[:, 1] -= own_xy * q[:, 0] + own_yy * q[:, 1]
        return np.asarray(force[:-1])


def make_lattice(
    mask: BoolArray | FloatArray,
    shear: float,
    periodic: bool,
    bond: float | None = None,
    pulled_side: tuple[int, int] | None = None,
) -> Lattice:
    """Lattice of a contact mask (ny, nx), or of the share of each block that touches.

    ``shear`` is K_s / K_int, ``bond`` the stiffness of contact, None if rigid; ``pulled_side`` the axis and end of the
    row that alone is pulled. One factorisation a mask is kept.
    """
    shares = b"" if mask.dtype == bool else mask.tobytes()
    packed = np.packbits(mask > 0).tobytes()
    return _make_lattice(packed, mask.shape, shear, periodic, bond, shares, pulled_side)


@lru_cache(maxsize=16)
def _make_lattice(
    packed: bytes,
    shape: tuple[int, int],
    shear: float,
    periodic: bool,
    stiffness: float | None,
    shares: bytes,
    pulled_side: tuple[int, int] | None,
) -> Lattice:
    ny, nx = shape
    n = nx * ny
    contact = np.unpackbits(np.frombuffer(packed, np.uint8), count=n).astype(bool)
    neighbours = _neighbours(nx, ny, periodic)
    own = np.zeros((n + 1, 3))
    for k, spring in enumerate(SPRINGS):
        own[:n] += np.where(neighbours[:n, k, None] < n, spring, 0.0)
    numbers = np.arange(n).reshape(ny, nx)
    pulled = None if pulled_side is None else np.take(numbers, pulled_side[1], axis=1 - pulled_side[0])
    slider = _slider(n, shear, pulled)
    own[:n, :2] += slider[:, None]
    touching = np.frombuffer(shares) if shares else None
    bond = None if stiffness is None else np.where(contact, stiffness, 0.0) * (1.0 if touching is None else touching)
    if bond is None:
        follow, lag = _condense(np.flatnonzero(~contact), neighbours, own, slider)
    else:
        held = own.copy()
        held[:n, :2] += bond[:, None]
        follow, lag = _condense(np.arange(n), neighbours, held, slider)
    return Lattice(nx, ny, periodic, shear, contact, neighbours, own, follow, lag, bond, pulled, touching)


def _slider(n: int, shear: float, pulled: NDArray[np.int64] | None) -> FloatArray:
    stiffness = np.full(n, shear if pulled is None else 0.0)
    if pulled is not None:
        stiffness[pulled] = shear
    return stiffness


def _neighbours(nx: int, ny: int, periodic: bool) -> NDArray[np.int64]:
    y, x = np.divmod(np.arange(nx * ny), nx)
    table = np.full((nx * ny + 1, NEIGHBOURS), nx * ny, np.int64)
    for k, (dx, dy) in enumerate(OFFSETS):
        near_x, near_y = x + dx, y + dy
        if periodic:
            near_x, near_y = near_x % nx, near_y % ny
        inside = (near_x >= 0) & (near_x < nx) & (near_y >= 0) & (near_y < ny)
        table[:-1, k][inside] = (near_y * nx + near_x)[inside]
    return table


def _condense(
    moving: NDArray[np.intp], neighbours: NDArray[np.int64], own: FloatArray, slider: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """K w = K_s V and K z = w over the blocks that move: velocities, and lag per drag, for unit V along x and y."""
    follow, lag = np.zeros((len(own), 2, 2)), np.zeros((len(own), 2, 2))
    if moving.size == 0:
        return follow, lag
    solve = _factorise(moving, neighbours, own)
    m = moving.size
    drive = np.zeros((2 * m, 2))
    drive[:m, 0] = drive[m:, 1] = slider[moving]
    w = solve(drive)
    z = solve(w)
    for axis in range(2):
        rows = slice(axis * m, (axis + 1) * m)
        follow[moving, axis], lag[moving, axis] = w[rows], z[rows]
    return follow, lag


def _factorise(moving: NDArray[np.intp], neighbours: NDArray[np.int64], own: FloatArray) -> Any:
    """Solver of the stiffness matrix of the blocks that move, x components first."""
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import splu

    m = moving.size
    number = np.full(len(own), -1)
    number[moving] = np.arange(m)
    rows, columns, values = [], [], []

    def add(row: Any, column: Any, xx: Any, yy: Any, xy: Any) -> None:
        for a, b, value in ((0, 0, xx), (1, 1, yy), (0, 1, xy), (1, 0, xy)):
            rows.append(row + a * m)
            columns.append(column + b * m)
            values.append(np.broadcast_to(value, np.shape(row)))

    add(np.arange(m), np.arange(m), *own[moving].T)
    for k, (xx, yy, xy) in enumerate(SPRINGS):
        near = number[neighbours[moving, k]]
        linked = near >= 0
        add(np.flatnonzero(linked), near[linked], -xx, -yy, -xy)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return splu(coo_array(entries, shape=(2 * m, 2 * m)).tocsc()).solve


FEWEST_POINTS, FINEST_M = 8, 0.25e-6  # along each side of a block: at least so many, or so close
LEAST = 1e-3  # share below which a block does not touch
Distance = Callable[[FloatArray, FloatArray], FloatArray]


@lru_cache(maxsize=64)
def touching_share(
    pattern: Pattern, blocks: tuple[int, int], spacing_m: float, first: tuple[int, int] | None = None
) -> FloatArray:
    """Share of every block that touches, shape (ny, nx).

    Parameters
    ----------
    pattern : Pattern
        Any pattern; a corner of a cell of its lattice lies at ``first``, by default such that cells are centred.
    blocks : (int, int)
        Blocks along x and y.
    spacing_m : float
        Side of a block.
    """
    nx, ny = blocks
    assert pattern.pitch_m is not None
    pitch = pattern.pitch_m
    cells = [max(1, round(n * spacing_m / p)) for n, p in zip(blocks, pitch, strict=True)]
    corner = [(n * spacing_m - k * p) / 2 for n, k, p in zip(blocks, cells, pitch, strict=True)]
    x0, y0 = corner if first is None else [k * spacing_m for k in first]
    if pattern.picture is not None and pattern.pixel_m is not None:
        mask = picture_mask(pattern.picture).astype(float)
        across = overlaps(nx, spacing_m, -x0, mask.shape[1], pattern.pixel_m)
        along = overlaps(ny, spacing_m, -y0, mask.shape[0], pattern.pixel_m)
        share = along @ mask @ across.T
    else:
        inside = covered(pattern, nx, ny, spacing_m, x0, y0)
        share = inside if pattern.feature == "pillar" else 1.0 - inside
    share = np.where(share < LEAST, 0.0, np.where(share > 1.0 - LEAST, 1.0, share))
    share.setflags(write=False)
    return share


def overlaps(n: int, spacing: float, start: float, pixels: int, pixel: float) -> FloatArray:
    """Share of block i that lies on pixel j of a row that repeats, shape (n, pixels)."""
    edges = start + spacing * np.arange(n + 1, dtype=float)
    period = pixels * pixel

    def upto(x: FloatArray) -> FloatArray:
        """Length of each pixel, over all repeats, that lies below x; (len(x), pixels)."""
        whole = np.floor(x / period)
        rest = (x - whole * period)[:, None] - pixel * np.arange(pixels)
        return whole[:, None] * pixel + np.clip(rest, 0.0, pixel)

    return np.asarray(np.diff(upto(edges), axis=0) / spacing)


def covered(pattern: Pattern, nx: int, ny: int, spacing: float, x0: float, y0: float) -> FloatArray:
    """Share of every block within the shapes of a pattern, row by row."""
    distance = distance_of(pattern)
    n = max(FEWEST_POINTS, math.ceil(spacing / FINEST_M))
    step = spacing / n
    x = (np.arange(nx * n, dtype=float) + 0.5) * step - x0
    share = np.empty((ny, nx))
    for row in range(ny):
        y = (row * n + np.arange(n, dtype=float) + 0.5) * step - y0
        points = np.clip(0.5 - distance(x[None, :], y[:, None]) / step, 0.0, 1.0)
        share[row] = points.reshape(n, nx, n).mean(axis=(0, 2))
    return share


def distance_of(pattern: Pattern) -> Distance:
    """Signed distance from the nearest shape of a lattice."""
    assert pattern.size_m is not None
    assert pattern.pitch_m is not None
    (a, b), (px, py) = (0.5 * np.array(pattern.size_m)), pattern.pitch_m
    if pattern.cavity == "ridge":
        return lambda x, y: np.abs(x % px - px / 2) - a + 0.0 * y
    if pattern.cavity == "chevron":
        slope = 4.0 * b / py
        thin = 1.0 / np.hypot(1.0, slope)
        return lambda x, y: thin * (np.abs((x - slope * np.abs(y % py - py / 2)) % px - px / 2) - a)

    def one(x: FloatArray, y: FloatArray) -> FloatArray:
        if pattern.cavity in ("circle", "ellipse"):
            level = np.sqrt((x / a) ** 2 + (y / b) ** 2)
            steep = np.sqrt((x / a**2) ** 2 + (y / b**2) ** 2)
            centre = steep == 0.0
            return np.asarray(np.where(centre, -min(a, b), (level - 1.0) * level / np.where(centre, 1.0, steep)))
        return np.asarray(np.maximum(np.abs(x) - a, np.abs(y) - b))

    def nearest(x: FloatArray, y: FloatArray) -> FloatArray:
        row = np.floor(y / py)
        found = np.full(np.broadcast_shapes(x.shape, y.shape), np.inf)
        for k in (-1, 0, 1):
            shift = np.where((row + k) % 2 == 1, px / 2, 0.0) if pattern.staggered else np.zeros_like(row)
            found = np.minimum(found, one((x - shift) % px - px / 2, y - (row + k + 0.5) * py))
        return found

    return nearest
