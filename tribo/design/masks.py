"""The shapes of a pattern as polygons, and its mask as SVG, PNG and GDSII."""

from __future__ import annotations

import io
from importlib import import_module
from importlib.util import find_spec

import numpy as np

from tribo.files import bytes_of
from tribo.records import FloatArray, Pattern
from tribo.springblock.shapes import touching_share
from tribo.temporary import temporary_folder

CORNERS = 96  # of a circle: its area is within 0.1 % of the true one
PNG_PIXELS = 800
_UM = 1e-6


def repeat_um(pattern: Pattern) -> tuple[float, float]:
    """Width and height of one repeat, two rows of a staggered lattice."""
    assert pattern.pitch_m is not None
    px, py = pattern.pitch_m
    return px / _UM, (2 if pattern.staggered else 1) * py / _UM


def polygons_um(pattern: Pattern) -> list[FloatArray]:
    """The shapes of one repeat, each (corners, 2); those of a staggered row may reach beyond its side."""
    assert pattern.size_m is not None
    assert pattern.pitch_m is not None
    (a, b), (px, py) = 0.5 * np.array(pattern.size_m) / _UM, np.array(pattern.pitch_m) / _UM
    if pattern.cavity == "ridge":
        return [np.array([(px / 2 - a, 0), (px / 2 + a, 0), (px / 2 + a, py), (px / 2 - a, py)])]
    if pattern.cavity == "chevron":
        tips = [(2 * b, 0.0), (0.0, py / 2), (2 * b, py)]
        return [np.array([(px / 2 - a + x, y) for x, y in tips] + [(px / 2 + a + x, y) for x, y in tips[::-1]])]
    if pattern.cavity in ("circle", "ellipse"):
        turn = 2 * np.pi * (np.arange(CORNERS) + 0.5) / CORNERS
        one = np.column_stack([a * np.cos(turn), b * np.sin(turn)])
    else:
        one = np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    centres = [(px / 2, py / 2), (px, 1.5 * py)][: 2 if pattern.staggered else 1]
    return [one + centre for centre in centres]


def svg(pattern: Pattern, side_um: float = 400.0) -> str:
    """A square of the mask in um; black shapes are cavities, or what touches where the feature is a pillar."""
    width, height = repeat_um(pattern)
    paths = " ".join(
        "M" + " L".join(f"{x:.4f} {y:.4f}" for x, y in shape) + " Z"
        for polygon in polygons_um(pattern)
        for shape in (polygon, polygon - [width, 0])
        if shape[:, 0].max() > 0
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{side_um:g}um" height="{side_um:g}um" '
        f'viewBox="0 0 {side_um:g} {side_um:g}"><defs><pattern id="p" width="{width:.6f}" height="{height:.6f}" '
        f'patternUnits="userSpaceOnUse"><path d="{paths}"/></pattern></defs>'
        f'<rect width="{side_um:g}" height="{side_um:g}" fill="url(#p)"/></svg>\n'
    )


def png(pattern: Pattern, side_um: float = 200.0) -> bytes:
    """A square of the mask, black and white; white touches."""
    from matplotlib.image import imsave

    share = touching_share(pattern, (PNG_PIXELS, PNG_PIXELS), side_um * _UM / PNG_PIXELS, (0, 0))
    data = io.BytesIO()
    imsave(data, share >= 0.5, cmap="gray", vmin=0, vmax=1, format="png", origin="lower")
    return data.getvalue()


def gds(pattern: Pattern, side_mm: float) -> bytes | None:
    """The whole mask as GDSII in um, layer 1 the shapes; None without the optional gdstk."""
    if find_spec("gdstk") is None:
        return None
    gdstk = import_module("gdstk")
    width, height = repeat_um(pattern)
    library = gdstk.Library(unit=1e-6, precision=1e-9)
    cell, top = library.new_cell("REPEAT"), library.new_cell("MASK")
    for polygon in polygons_um(pattern):
        cell.add(gdstk.Polygon([tuple(corner) for corner in polygon], layer=1))
    across, along = (max(1, int(1e3 * side_mm / length)) for length in (width, height))
    top.add(gdstk.Reference(cell, columns=across, rows=along, spacing=(width, height)))
    with temporary_folder() as folder:
        library.write_gds(folder / "mask.gds")
        return bytes_of(folder / "mask.gds")
