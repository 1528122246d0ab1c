"""The picture of the card: measured over modelled friction against what the finding follows, static beside sliding."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tribo.diagnostics.effect_sizes import percent
from tribo.figures import style
from tribo.figures.covariates import Covariate, covariate
from tribo.figures.residuals import WEIGHTS, added_by_causes, summaries
from tribo.records import REGIMES

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis

COLUMNS = ["regime", "axis", "mark", "sample", "test_id", "x", "x_name", "y", "y_low", "y_high"]
BY_SAMPLE = ("area_fraction", "rim_per_m", "elongation", "clip_N", "sample", "tau0")
RECORDED = {"speed_m_s": "speed_mm_s", "elapsed_s": "started_at"}
WIDTH_MM, HEIGHT_MM = 130.0, 66.0


def numbers(d: Diagnosis) -> pd.DataFrame:
    """100 (measured / model - 1) of every test, against the column that the finding follows.

    The model is the one calibrated on the flat sample alone. ``mark`` is test; mean, of a value of the column, with
    twice its standard error; band, two standard deviations of such a mean by the fitted noise; curve, what the named
    causes add. The column is that of the cause that acts most, else that of the first misfit, else the sample.
    """
    from tribo.diagnostics.fit import residual_on_flat

    o = d.baseline.setup.observations
    column = _column(d)
    here = np.isfinite(column.values)
    residual = residual_on_flat(d.baseline)
    rows: list[dict[str, Any]] = []
    for regime in REGIMES:
        weight = np.array(WEIGHTS[regime])
        y = percent(residual @ weight)
        common = {"regime": regime, "axis": _axis_name(column)}
        rows += [
            common
            | {"mark": "test", "sample": o.conditions.sample[i], "test_id": o.test_ids[i], "x": column.values[i],
               "x_name": column.names[round(column.values[i])] if column.names else "", "y": y[i]}
            for i in np.flatnonzero(here)
        ]  # fmt: skip
        rows += [common | row for row in summaries(d, column, here, y, weight, added_by_causes(d, residual, weight))]
    return pd.DataFrame(rows, columns=COLUMNS)


def _column(d: Diagnosis) -> Covariate:
    for name in _names(d):
        try:
            return covariate(d.baseline.setup, name)
        except KeyError:
            continue
    return covariate(d.baseline.setup, "sample")


def _names(d: Diagnosis) -> list[str]:
    """Columns that the finding may follow, the best first."""
    if d.named is not None and d.named.causes and d.verdict.verdict != "unknown":
        layers = [layer for layer in d.verdict.layers if layer.kind == "cause"]
        sizes = {layer.name: abs(layer.effect_percent) for layer in layers}
        acting = max((alike[0] for alike in d.named.causes), key=lambda c: sizes.get(c.name, 0.0)).acting
        followed = acting.mechanism.column(acting.choice).split(", ")
    else:
        followed = [m.covariate for m in d.verdict.misfits[:1]]
    if any(name in BY_SAMPLE for name in followed):
        return ["sample"]
    return [RECORDED.get(name, name) for name in followed]


def _axis_name(column: Covariate) -> str:
    return {"sample": "Sample", "specimen": "Specimen"}.get(column.name, column.axis)


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """Static at the left, sliding at the right, one scale; on the line at zero the model is right."""
    regimes = [r for r in REGIMES if (numbers["regime"] == r).any()]
    size = (WIDTH_MM / style.MM_PER_INCH, HEIGHT_MM / style.MM_PER_INCH)
    figure = Figure(figsize=size, layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, len(regimes), sharey=True))
    for ax, regime in zip(axes, regimes, strict=True):
        _draw_panel(ax, numbers[numbers["regime"] == regime])
        style.panel_title(ax, f"{regime.capitalize()} friction")
    axes[0].set_ylabel("measured / model − 1 (%)")
    ends = numbers[["y", "y_low", "y_high"]].to_numpy(float)[(numbers["mark"] != "test").to_numpy()]
    tests = numbers.loc[numbers["mark"] == "test", "y"]
    low, high = min(np.nanmin(ends), tests.quantile(0.01), 0.0), max(np.nanmax(ends), tests.quantile(0.99), 0.0)
    room = 0.06 * (high - low)
    axes[0].set_ylim(low - room, high + room)
    style.legend_below(figure, _legend(numbers), columns=4)
    return figure


def _draw_panel(ax: Axes, part: pd.DataFrame) -> None:
    tests, mean = part[part["mark"] == "test"], part[part["mark"] == "mean"]
    named = bool(tests["x_name"].any())
    band, curve = (part[part["mark"] == mark].sort_values("x").astype({"x": float}) for mark in ("band", "curve"))
    if named:
        ax.bar(band["x"], band["y_high"] - band["y_low"], 0.8, band["y_low"], color="0.75", alpha=0.45, lw=0)
        ax.hlines(curve["y"], curve["x"] - 0.4, curve["x"] + 0.4, color=style.VERMILLION, lw=1.8, zorder=4)
    else:
        ax.fill_between(band["x"], band["y_low"], band["y_high"], color="0.75", alpha=0.45, lw=0)
        ax.plot(curve["x"], curve["y"], "-", color=style.VERMILLION, lw=1.8, zorder=4)
        ax.plot(tests["x"], tests["y"], "o", color="0.5", ms=1.6, alpha=0.5, mew=0)
    bars = np.abs(mean[["y_low", "y_high"]].to_numpy(float) - mean[["y"]].to_numpy(float)).T
    ax.errorbar(mean["x"], mean["y"], bars, fmt="o", ms=3.6, color="black", elinewidth=1.0, zorder=5)
    ax.axhline(0, color="0.4", lw=0.8)
    _axis(ax, part, named)


def _axis(ax: Axes, part: pd.DataFrame, named: bool) -> None:
    axis = str(part["axis"].iloc[0])
    ax.set_xlabel(axis)
    tests = part[part["mark"] == "test"]
    if named:
        names = tests.drop_duplicates("x").sort_values("x")
        ax.set_xticks(names["x"], names["x_name"])
        if names["x_name"].str.len().sum() > 20:
            for label in ax.get_xticklabels():
                label.set(rotation=90, fontsize=6)
        ax.set_xlim(-0.6, float(names["x"].max()) + 0.6)
    elif axis.split(" (")[0] in ("Normal load N", "Speed", "Hold"):
        ax.set_xscale("log")
        style.plain_log_axis(ax.xaxis, tests["x"])
        ax.tick_params(axis="x", labelsize=6.5)


def _legend(numbers: pd.DataFrame) -> list[Any]:
    handles: list[Any] = [
        Line2D([], [], color="black", marker="o", lw=1.0, ms=3.6, label="mean ± 2 SE"),
        Patch(color="0.75", alpha=0.6, lw=0, label="expected if the model is right"),
    ]
    if (numbers["mark"] == "curve").any():
        handles.append(Line2D([], [], color=style.VERMILLION, lw=1.8, label="named cause"))
    return handles
