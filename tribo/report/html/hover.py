"""Positions of the points of a drawn figure, so that the page can show their values on hovering."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tribo.records import FloatArray

POINTS_PER_INCH = 72.0
MOST_POINTS = 60  # of a line without marks: it is read off by eye, not point by point
MARKS = frozenset("os^DvPX<>*hpd.")  # the caps of error bars are marks too, but no points


@dataclass(frozen=True)
class Series:
    """Points of one kind in one panel: (n, 2) on the page in points from the top left, and (n, 2) in their units."""

    name: str
    x: str
    y: str
    place: FloatArray
    value: FloatArray


def series_of(figure: Figure) -> list[Series]:
    """The points of every line and scatter of a settled figure."""
    height = figure.get_size_inches()[1] * POINTS_PER_INCH
    scale = POINTS_PER_INCH / figure.dpi
    labels: dict[str, str] = {}
    found = []
    for ax in figure.axes:
        x, y = ax.get_xlabel() or labels.get("x", "x"), ax.get_ylabel() or labels.get("y", "y")
        labels |= {"x": x, "y": y}
        for name, xy, transform in _points(ax):
            finite = np.isfinite(xy).all(axis=1)
            if finite.any():
                place = transform.transform(xy[finite]) * scale
                place[:, 1] = height - place[:, 1]
                found.append(Series(_joined(ax, name), x, y, place, xy[finite]))
    return found


def _joined(ax: Axes, name: str) -> str:
    parts = (ax.get_title(loc="left"), "" if name.startswith("_") else name)
    return ", ".join(part for part in parts if part)


def _points(ax: Axes) -> Iterator[tuple[str, FloatArray, Any]]:
    for line in ax.lines:
        xy = np.asarray(line.get_xydata(), float)
        marked = str(line.get_marker()) in MARKS
        if len(xy) and (marked or (line.get_linestyle() == "-" and len(xy) > 2)):
            step = 1 if marked else max(1, len(xy) // MOST_POINTS)
            yield str(line.get_label()), xy[::step], line.get_transform()
    for scatter in ax.collections:
        offsets: FloatArray = np.ma.filled(np.ma.asarray(scatter.get_offsets(), float), np.nan)
        if len(offsets) > 1:
            yield str(scatter.get_label()), offsets, scatter.get_offset_transform()
