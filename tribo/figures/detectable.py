"""Detectable effects: the strongest deviation compared with chance, and the size at which each effect is detected."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from tribo.figures import style
from tribo.figures.covariates import mechanism_label

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis

COLUMNS = ["mark", "name", "strength", "found_10_percent", "found_50_percent", "found_90_percent"]
LEVEL = 0.01  # chance of a misfit where nothing is hidden, as the diagnosis takes it by default
TENTH = 1.2816  # standard normal deviate exceeded one time in ten
SHOWN = 16
ROW_MM, FRAME_MM = 4.4, 26.0


def numbers(d: Diagnosis, level: float = LEVEL) -> pd.DataFrame:
    """Chance: the strongest deviation in each simulated campaign without effect. Observed: the strongest in this one.

    Then one row per mechanism: the effect on T, in percent over the range of the variable, that is detected with 10, 50
    and 90 % probability. The strength of a deviation is proportional to the effect and has a standard deviation of 1.
    """
    chance = [("chance", "", float(z), *[float("nan")] * 3) for z in d.screened.chance]
    best = int(np.argmax(d.screened.strength))
    need = float(np.quantile(d.screened.chance, 1 - level)) if len(chance) else 3.7
    contrast = d.screened.contrasts[best]
    seen, nothing = float(d.screened.strength[best]), [float("nan")] * 3
    rows = [*chance, ("need", f"level {level:g}", need, *nothing)]
    rows.append(("observed", f"{contrast.observable}, {contrast.covariate}", seen, *nothing))
    for name, percent in sorted(d.verdict.smallest_effects.items(), key=lambda item: item[1])[:SHOWN]:
        low, high = (percent * (need + s * TENTH) / need for s in (-1, 1))
        rows.append(("mechanism", name, float("nan"), low, percent, high))
    return pd.DataFrame(rows, columns=COLUMNS)


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """Left the size of what was seen, right the power for what may be hidden."""
    rows = numbers[numbers["mark"] == "mechanism"].reset_index(drop=True)
    height_mm = max(ROW_MM * len(rows), 34.0) + FRAME_MM
    figure = style.page_figure(height_mm)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.5))
    _chance(left, numbers)
    _sizes(right, rows)
    style.legend_below(
        figure,
        [
            Patch(color="0.75", label="simulated campaigns without any effect"),
            Line2D([], [], color="black", ls="--", lw=0.9, label="threshold of a misfit"),
            Line2D([], [], color=style.VERMILLION, lw=1.6, label="this campaign"),
            Line2D([], [], color=style.BLUE, lw=3, alpha=0.45, marker="o", ms=4, label="detected in 10, 50, 90 %"),
        ],
    )
    return figure


def _chance(ax: Axes, numbers: pd.DataFrame) -> None:
    chance = numbers.loc[numbers["mark"] == "chance", "strength"].to_numpy(float)
    observed = float(numbers.loc[numbers["mark"] == "observed", "strength"].iloc[0])
    need = float(numbers.loc[numbers["mark"] == "need", "strength"].iloc[0])
    if len(chance):
        edges = np.arange(np.floor(4 * chance.min()) / 4, chance.max() + 0.25, 0.25)
        ax.hist(chance, bins=edges.tolist(), color="0.75")
    ax.axvline(need, color="black", ls="--", lw=0.9)
    ax.axvline(observed, color=style.VERMILLION, lw=1.6)
    style.panel_title(ax, "Is there a misfit?", "yes" if observed > need else "no")
    ax.set_xlabel("Strongest deviation (standard deviations)")
    ax.set_ylabel("Campaigns")


def _sizes(ax: Axes, rows: pd.DataFrame) -> None:
    places = np.arange(len(rows))
    ax.hlines(places, rows["found_10_percent"], rows["found_90_percent"], color=style.BLUE, lw=3, alpha=0.45)
    ax.plot(rows["found_50_percent"], places, "o", color=style.BLUE, ms=4)
    ax.set_yticks(places, [mechanism_label(str(name)) for name in rows["name"]])
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)
    if rows.empty:
        style.panel_title(ax, "Detectable effects", "none that this design can test")
        return
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    style.panel_title(ax, "Detectable effects")
    ax.set_xlabel("Change of T over the range of the variable (%)")
