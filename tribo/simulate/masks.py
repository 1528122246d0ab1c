"""Which blocks of the lattice touch the counterface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribo.records import Pattern

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
