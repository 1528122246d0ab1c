"""Measured over simulated friction force at each load: the ratios of :mod:`tribo.comparison.agreement`, drawn."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

from tribo.figures import style
from tribo.records import REGIMES

RATIO_TICKS = (
    (0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4),
    (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0),
    (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0),
    (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e12),
)
REGIME_STYLE = {"static": (style.BLUE, "o", -1), "sliding": (style.VERMILLION, "s", 1)}
DODGE_POINTS = 1.8
MOST_BAR = 3.0  # an error bar beyond this factor runs off the panel, so that the others can be read


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """One panel per sample, static beside sliding at each load; the line at 1 is perfect agreement."""
    groups = style.by_sample(numbers)
    figure, axes = style.panel_grid(len(groups), 45, sharex=True, sharey=True)
    for ax, (_, sample) in zip(axes, groups, strict=True):
        ax.axhline(1, color="0.4", lw=0.8)
        for regime, part in sample.groupby("regime"):
            colour, marker, side = REGIME_STYLE[str(regime)]
            aside = style.moved_aside(ax, side * DODGE_POINTS)
            bars = np.abs(part[["ratio_low", "ratio_high"]].to_numpy(float) - part[["ratio"]].to_numpy(float)).T
            style.cover(ax, part["normal_load_N"], part["ratio"], part["ratio"])
            ax.errorbar(
                part["normal_load_N"], part["ratio"], bars, fmt=marker, color=colour, elinewidth=0.8,
                ms=3.5, transform=aside,
            )  # fmt: skip
        ax.set_xscale("log" if _spread(numbers) > 5 else "linear")
        style.panel_title(ax, str(sample["sample"].iloc[0]))
        ax.set_xlabel("Normal load N (N)")
        ax.tick_params(labelbottom=True)
        if style.is_leftmost(ax):
            ax.set_ylabel("Measured T / simulated T")
    _ratio_axis(axes, numbers)
    style.legend_below(
        figure,
        [
            Line2D(
                [],
                [],
                color=REGIME_STYLE[r][0],
                marker=REGIME_STYLE[r][1],
                lw=0.8,
                ms=3.5,
                label=f"{r} friction, 95 %",
            )
            for r in REGIMES
        ],
    )
    return figure


def _spread(numbers: pd.DataFrame) -> float:
    lowest = float(numbers["normal_load_N"].min())
    return float(numbers["normal_load_N"].max()) / lowest if lowest > 0 else 1.0


def _ratio_axis(axes: list[Axes], numbers: pd.DataFrame) -> None:
    """A logarithmic axis on which twice and half lie equally far from 1."""
    lowest, highest = numbers["ratio"].min(), numbers["ratio"].max()
    low = np.nanmin([0.85, 0.95 * lowest, 0.97 * max(numbers["ratio_low"].min(), lowest / MOST_BAR)])
    high = np.nanmax([1.18, 1.05 * highest, 1.03 * min(numbers["ratio_high"].max(), highest * MOST_BAR)])
    ticks = np.array(next(t for t in RATIO_TICKS if high / low < t[-1] / t[0]))
    for ax in axes:
        ax.set_yscale("log")
        ax.set_ylim(low, high)
        ax.yaxis.set_major_locator(FixedLocator(ticks[(ticks >= low) & (ticks <= high)]))
        ax.yaxis.set_minor_locator(NullLocator())
        ax.yaxis.set_major_formatter(FuncFormatter(_plain))
        if ax.get_xscale() == "log":
            ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            ax.xaxis.set_minor_locator(NullLocator())
            ax.xaxis.set_major_formatter(FuncFormatter(_plain))
        else:
            ax.set_xlim(left=0)


def _plain(value: float, _: int) -> str:
    return f"{value:g}"
