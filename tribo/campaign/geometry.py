"""Patterns as they are made: pictures and random masks, and what a technique of making cannot make.

A picture is kept as text, ``WIDTHxHEIGHT:HEX``, one bit a pixel and row after row from y = 0 on; 1 touches the
counterface. It repeats over the sample.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribo.input_files import read_input
from tribo.records import Pattern, picture_mask

MOST_PIXELS = 1024  # a side
LARGEST_PICTURE_BYTES = 20_000_000
PIXELS_PER_CORRELATION = 8
CORRELATIONS_PER_TILE = 24
_UM = 1e-6


@dataclass(frozen=True)
class Making:
    """The smallest cavity or pillar and the smallest wall that can be made, and the grid of the mask, in m."""

    smallest_feature_m: float = 0.0
    smallest_wall_m: float = 0.0
    mask_grid_m: float = 0.0


def picture_text(mask: NDArray[np.bool_]) -> str:
    """A mask (height, width) as a pattern keeps it."""
    return f"{mask.shape[1]}x{mask.shape[0]}:{np.packbits(mask).tobytes().hex()}"


def picture_from(path: Path) -> str:
    """A black-and-white picture (PNG: white touches) or an array (NPY: 1 touches); ValueError says what is wrong."""
    data = read_input(path, LARGEST_PICTURE_BYTES)
    suffix = path.suffix.lower()
    if suffix == ".png":
        values = _png(path, data)
    elif suffix == ".npy":
        import io

        values = np.load(io.BytesIO(data), allow_pickle=False)
    else:
        raise ValueError(f"a mask must be a PNG or NPY file, not {path.suffix or 'a file without ending'}")
    return picture_text(black_and_white(values, str(path.name)))


def black_and_white(values: NDArray[Any], name: str) -> NDArray[np.bool_]:
    """The mask in an array of two values; ValueError with the place of the first other one."""
    if values.ndim != 2 or min(values.shape, default=0) < 1 or max(values.shape) > MOST_PIXELS:
        shape = " x ".join(map(str, values.shape[::-1]))
        raise ValueError(f"{name}: a mask has 1 to {MOST_PIXELS} pixels a side, one channel; found {shape or 'none'}")
    numbers = values.astype(float)
    high = 1.0 if numbers.max() <= 1.0 else 255.0
    grey = np.argwhere((numbers != 0.0) & (numbers != high))
    if grey.size:
        y, x = grey[0]
        share = 100 * len(grey) / numbers.size
        raise ValueError(
            f"{name}: a mask is black and white; pixel x = {x}, y = {y} has {numbers[y, x]:g}, which is neither 0 nor "
            f"{high:g} ({share:.2g} % of the pixels are grey)"
        )
    mask = numbers == high
    if not mask.any():
        raise ValueError(f"{name}: nothing touches the counterface: every pixel is black")
    return np.asarray(mask)


def _png(path: Path, data: bytes) -> NDArray[Any]:
    import io

    from matplotlib.image import imread

    try:
        values = np.asarray(imread(io.BytesIO(data), format="png"), float)
    except Exception as why:  # the reader raises what its library raises
        raise ValueError(f"{path.name}: cannot be read as PNG: {why}") from why
    if values.ndim == 3:
        colours = values[..., :3]
        apart = np.argwhere(np.ptp(colours, axis=2) > 0)
        if apart.size:
            y, x = apart[0]
            raise ValueError(f"{path.name}: a mask is black and white; pixel x = {x}, y = {y} has a colour")
        values = colours[..., 0]
    return values[::-1]  # a picture begins at the top, y = 0 lies at the bottom


def random_picture(fraction: float, correlation_m: float, seed: int) -> tuple[str, float]:
    """Cavities and islands at random, touching on exactly this share (of pixels); the picture and its pixel in m.

    A field of normal numbers, smoothed over the correlation length, cut at a height; it repeats without seams.
    """
    from scipy.ndimage import gaussian_filter

    n = PIXELS_PER_CORRELATION * CORRELATIONS_PER_TILE
    noise = np.random.default_rng(seed).standard_normal((n, n))
    # exp(-r2 / c2) is the correlation of white noise under a Gaussian of standard deviation c / 2
    field = gaussian_filter(noise, PIXELS_PER_CORRELATION / 2, mode="wrap")
    order = np.argsort(field, axis=None)
    mask = np.zeros(n * n, bool)
    mask[order[: round(fraction * n * n)]] = True
    return picture_text(mask.reshape(n, n)), correlation_m / PIXELS_PER_CORRELATION


def mean_chords_m(mask: NDArray[np.bool_], pixel_m: float) -> tuple[float, float]:
    """Mean length of cavities along x and y."""
    cavity = ~mask
    chords = []
    for axis in (1, 0):
        starts = int((cavity & ~np.roll(cavity, 1, axis)).sum())
        chords.append(pixel_m * cavity.sum() / starts if starts else pixel_m * mask.shape[axis])
    return float(chords[0]), float(chords[1])


def faults_of_making(pattern: Pattern, making: Making) -> Iterator[str]:
    """What cannot be made, each with its place and the limit."""
    if pattern.is_flat or pattern.size_m is None or pattern.pitch_m is None:
        return
    if pattern.picture is not None and pattern.pixel_m is not None:
        yield from _thin_places(picture_mask(pattern.picture), pattern.pixel_m, making)
        return
    feature, wall = smallest_feature_m(pattern), smallest_wall_m(pattern)
    what, between = ("pillar", "gap") if pattern.feature == "pillar" else ("cavity", "wall")
    if wall <= 0.0:
        yield f"the {what} of {_um(feature)} touches the next one: the {between} between them is {_um(wall)}"
    elif wall < making.smallest_wall_m * (1 - 1e-9):
        limit = _um(making.smallest_wall_m)
        yield f"the {between} between two neighbours is {_um(wall)}; the smallest that can be made is {limit}"
    if feature < making.smallest_feature_m * (1 - 1e-9):
        limit = _um(making.smallest_feature_m)
        yield f"the {what} is {_um(feature)} wide; the smallest that can be made is {limit}"
    if making.mask_grid_m:
        for name, pair in (("size", pattern.size_m), ("pitch", pattern.pitch_m)):
            for axis, length in zip("xy", pair, strict=True):
                if pattern.lattice == "hexagonal" and name == "pitch" and axis == "y":
                    continue  # no grid holds both; the mask rounds the rows
                steps = length / making.mask_grid_m
                if abs(steps - round(steps)) > 1e-6:
                    yield f"{name} along {axis} is {_um(length)}, off the grid of {_um(making.mask_grid_m)}"


def _um(length_m: float) -> str:
    return f"{1e6 * length_m:.6g} um"


def smallest_feature_m(pattern: Pattern) -> float:
    """Smallest width of a cavity or pillar."""
    assert pattern.size_m is not None
    assert pattern.pitch_m is not None
    if pattern.cavity == "ridge":
        return pattern.size_m[0]
    if pattern.cavity == "chevron":
        return pattern.size_m[0] * _thinner(pattern)
    return min(pattern.size_m)


def smallest_wall_m(pattern: Pattern) -> float:
    """Smallest distance between two cavities or pillars."""
    assert pattern.size_m is not None
    assert pattern.pitch_m is not None
    (a, b), (px, py) = pattern.size_m, pattern.pitch_m
    if pattern.cavity == "ridge":
        return px - a
    if pattern.cavity == "chevron":
        return (px - a) * _thinner(pattern)
    straight = [px - a, (2 * py if pattern.staggered else py) - b]
    if not pattern.staggered:
        return min(straight)
    if pattern.cavity == "circle":
        return min(*straight, math.hypot(px / 2, py) - a)
    if pattern.cavity == "ellipse":  # half a diagonal, and the reach of both ellipses along it
        way = math.hypot(px / 2, py)
        return min(*straight, way - way / math.hypot(px / 2 / a, py / b))
    gap = (max(px / 2 - a, 0.0), max(py - b, 0.0))
    return min(*straight, math.hypot(*gap) if px / 2 > a or py > b else -1e-9)


def _thinner(pattern: Pattern) -> float:
    """Width of a chevron's arm across it over its width along x."""
    assert pattern.size_m is not None
    assert pattern.pitch_m is not None
    return 1.0 / math.hypot(1.0, 2 * pattern.size_m[1] / pattern.pitch_m[1])


def _thin_places(mask: NDArray[np.bool_], pixel_m: float, making: Making) -> Iterator[str]:
    """Where a cavity or a wall of a picture is thinner than can be made: an opening by a square removes it."""
    from scipy.ndimage import binary_opening

    for what, part, smallest in (
        ("cavity", ~mask, making.smallest_feature_m), ("wall", mask, making.smallest_wall_m)
    ):  # fmt: skip
        n = math.ceil(smallest / pixel_m - 1e-9)
        if n < 2:
            continue
        around = np.pad(part, n, mode="wrap")
        left = around & ~binary_opening(around, np.ones((n, n), bool))
        lost = np.argwhere(left[n:-n, n:-n])
        if lost.size:
            y, x = lost[0]
            yield (
                f"a {what} at x = {1e6 * x * pixel_m:.4g} um, y = {1e6 * y * pixel_m:.4g} um is thinner than "
                f"{1e6 * smallest:.4g} um, the smallest that can be made"
            )
