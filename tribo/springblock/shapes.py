"""Shapes on the lattice as they are: the share of every block that touches the counterface.

A shape is a signed distance, negative inside. Blocks are sampled at points; beside an edge, the share of the area
around a point follows from its distance, so that areas are exact to second order.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from tribo.records import FloatArray, Pattern, picture_mask

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
