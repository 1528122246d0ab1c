"""The curves of docs/blind.md, drawn from the rows of a run.

    python benchmarks/blind_figure.py docs/data/blind.jsonl docs/figures/blind-curves.svg
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
from blind_tables import COUNTED, Row, Test, blamed, curve_rows, seen, wilson
from matplotlib.axes import Axes
from matplotlib.figure import Figure

LABELS = {
    "pattern_error": "pattern error / assumed error", "specimen_slope": "specimen slope per e-fold of load",
    "noise": "noise law", "pattern_draw": "pattern error drawn as",
}  # fmt: skip
COLOURS = {"right": "#0072b2", "wrong": "#d55e00", "tied": "#e69f00", "unknown": "#7f7f7f", "not seen": "#56b4e9"}


def draw_curves(rows: list[Row], path: Path) -> None:
    """Upper row: clean campaigns. Lower row: campaigns with one effect at three times its half-found size."""
    by_axis = curve_rows(rows)
    axes_drawn = [axis for axis in LABELS if axis in by_axis]
    if not axes_drawn:
        return
    with mpl.rc_context({"svg.hashsalt": "blind", "svg.fonttype": "none", "font.size": 8}):
        figure = Figure(figsize=(2.4 * len(axes_drawn), 4.6), layout="constrained")
        grid = figure.subplots(2, len(axes_drawn), squeeze=False, sharey="row")
        for column, axis in enumerate(axes_drawn):
            _clean(grid[0, column], by_axis[axis])
            _effects(grid[1, column], by_axis[axis])
            grid[1, column].set_xlabel(LABELS[axis])
        grid[0, 0].set_ylabel("clean campaigns, %")
        grid[1, 0].set_ylabel("campaigns with one effect, %")
        grid[0, -1].legend(frameon=False)
        grid[1, -1].legend(frameon=False)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Date": None})


def _clean(ax: Axes, by_value: dict[str, dict[str, list[Row]]]) -> None:
    groups = {value: g["clean"] for value, g in by_value.items() if "clean" in g}
    _line(ax, groups, seen, "misfit reported", "#7f7f7f")
    _line(ax, groups, blamed, "cause named", "#d55e00")


def _effects(ax: Axes, by_value: dict[str, dict[str, list[Row]]]) -> None:
    groups = {
        value: [r for name, rows in g.items() if name != "clean" for r in rows] for value, g in by_value.items()
    }
    for label, test in COUNTED.items():
        _line(ax, groups, test, label, COLOURS[label])
    ax.set_ylim(-3, 103)


def _line(ax: Axes, groups: dict[str, list[Row]], test: Test, label: str, colour: str) -> None:
    """Shares in percent with their 90 % intervals, over numbers or over names."""
    values = sorted((v for v, g in groups.items() if g), key=lambda v: float(v) if v[0].isdigit() else 0.0)
    x: list[Any] = [float(v) if v[0].isdigit() else v for v in values]
    counts = [(sum(map(test, groups[v])), len(groups[v])) for v in values]
    y = [100 * k / n for k, n in counts]
    ends = [wilson(k, n) for k, n in counts]
    below = [a - 100 * low for a, (low, _) in zip(y, ends, strict=True)]
    above = [100 * high - a for a, (_, high) in zip(y, ends, strict=True)]
    if not all(isinstance(v, float) for v in x):
        ax.margins(x=0.2)
    style = "o-" if all(isinstance(v, float) for v in x) else "o"
    ax.errorbar(x, y, [below, above], fmt=style, ms=3, lw=1, elinewidth=0.6, label=label, color=colour)


if __name__ == "__main__":
    lines = Path(sys.argv[1]).read_text().splitlines()
    draw_curves([json.loads(line) for line in lines], Path(sys.argv[2]))
