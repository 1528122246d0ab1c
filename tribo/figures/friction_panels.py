"""Figures of a report without the model: T/N against its conditions and along records, oscillations, restarts."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from tribo.figures import style

LINE_POINTS = 8.5  # from one formula to the next
_OPEN = {"static": True, "sliding": False}


@style.in_house_style
def draw_dependence(numbers: pd.DataFrame) -> Figure:
    """One panel per recorded variable; filled marks sliding, open marks static friction."""
    variables = list(dict.fromkeys(numbers["variable"]))
    figure, axes = style.panel_grid(len(variables), 52, columns=min(len(variables), 2))
    for ax, variable in zip(axes, variables, strict=True):
        part = numbers[numbers["variable"] == variable]
        for (number, regime), points in part.groupby(["sample_number", "regime"]):
            mark = style.sample_mark(int(str(number)))
            face = "none" if _OPEN[str(regime)] else mark.colour
            ax.errorbar(
                points["value"], points["T_over_N"], points["T_over_N_u"].fillna(0.0), fmt=mark.marker, ms=3,
                color=mark.colour, mfc=face, elinewidth=0.6,
            )  # fmt: skip
        ax.set_xlabel(_sentence(str(part["label"].iloc[0])))
        ax.set_ylabel("T / N")
        _spread(ax, part["value"])
    style.legend_below(figure, [*_samples(numbers), *_regimes(numbers)], columns=8)
    return figure


@style.in_house_style
def draw_forces(numbers: pd.DataFrame) -> Figure:
    """One panel per regime: measured forces as marks, the law of each sample as a line."""
    regimes = list(dict.fromkeys(numbers["regime"]))
    figure, axes = style.panel_grid(len(regimes), 70, columns=len(regimes))
    for ax, regime in zip(axes, regimes, strict=True):
        part = numbers[numbers["regime"] == regime]
        for number, points in style.by_sample(part):
            mark = style.sample_mark(number)
            measured = points[points["mark"] == "measured"]
            load, force = measured["normal_load_N"], measured["T_N"]
            ax.plot(load, force, mark.marker, ms=3, color=mark.colour, mfc="none", mew=0.6)
            for formula, line in points[points["mark"] != "measured"].groupby("mark"):
                ax.plot(line["normal_load_N"], line["T_N"], color=mark.colour, lw=1.1)
                below = -LINE_POINTS * (len(ax.texts) + 1)
                ax.annotate(str(formula), (0.02, 1.0), (0.0, below), xycoords="axes fraction",
                            textcoords="offset points", color=mark.colour, fontsize=7)  # fmt: skip
        style.panel_title(ax, _sentence(f"{regime} friction"))
        ax.set_xlabel("Normal load N (N)")
        ax.set_ylabel("Friction force T (N)")
        if _over_a_decade(part["T_N"]):
            _spread(ax, part["normal_load_N"])
            ax.set_yscale("log")
            style.plain_log_axis(ax.yaxis, part["T_N"])
        else:  # from zero, so that what does not depend on the load is seen
            ax.set(xlim=(0.0, None), ylim=(0.0, None))
    style.legend_below(figure, _samples(numbers), columns=8)
    return figure


@style.in_house_style
def draw_records(numbers: pd.DataFrame) -> Figure:
    """One panel per sample, one line per record."""
    groups = style.by_sample(numbers)
    figure, axes = style.panel_grid(len(groups), 50)
    for ax, (_, sample) in zip(axes, groups, strict=True):
        for number, (_, record) in enumerate(sample.groupby("test_id", sort=False)):
            ax.plot(record["value"], record["T_over_N"], lw=0.7, color=style.sample_mark(number).colour)
        first = sample.iloc[0]
        style.panel_title(ax, first["sample"], f"{sample['test_id'].nunique()} records")
        ax.set_xlabel(_sentence(str(first["way"])))
        if style.is_leftmost(ax):
            ax.set_ylabel("T / N")
    return figure


@style.in_house_style
def draw_oscillations(numbers: pd.DataFrame) -> Figure:
    """Drop and period side by side; marks by regime."""
    quantities = list(dict.fromkeys(numbers["quantity"]))
    figure, axes = style.panel_grid(len(quantities), 60, columns=2)
    marks = {"stick-slip": ("o", style.BLUE), "inertial oscillation": ("^", style.ORANGE), "irregular": ("x", "0.4")}
    for ax, quantity in zip(axes, quantities, strict=True):
        part = numbers[numbers["quantity"] == quantity]
        for regime, points in part.groupby("regime"):
            marker, colour = marks[str(regime)]
            ax.errorbar(points["value"], points["y"], points["y_u"].fillna(0.0), fmt=marker, color=colour, ms=4)
        ax.set_xlabel(_sentence(str(part["label"].iloc[0])))
        ax.set_ylabel(_sentence(quantity))
        _spread(ax, part["value"])
        ax.set_ylim(bottom=0)
    handles = [
        Line2D([], [], marker=m, color=c, ls="", label=name)
        for name, (m, c) in marks.items()
        if (numbers["regime"] == name).any()
    ]
    style.legend_below(figure, handles)
    return figure


@style.in_house_style
def draw_restarts(numbers: pd.DataFrame) -> Figure:
    """Static force over load against the time of the hold."""
    figure, (ax,) = style.panel_grid(1, 70)
    for number, points in style.by_sample(numbers):
        mark = style.sample_mark(number)
        x, y, u = points["hold_s"], points["T_over_N"], points["T_over_N_u"]
        ax.errorbar(x, y, u, fmt=mark.marker, color=mark.colour, ms=4)
    ax.set_xlabel("Time of the hold (s)")
    ax.set_ylabel("Static T / N at the restart")
    _spread(ax, numbers["hold_s"])
    style.legend_below(figure, _samples(numbers), columns=8)
    return figure


def _over_a_decade(values: pd.Series) -> bool:
    return float(values.min()) > 0 and float(values.max()) > 10 * float(values.min())


def _spread(ax: Axes, values: pd.Series) -> None:
    """A logarithmic axis for positive values over more than a decade."""
    if _over_a_decade(values):
        ax.set_xscale("log")
        style.plain_log_axis(ax.xaxis, values)
    else:
        ax.xaxis.set_major_locator(MaxNLocator(5))


def _sentence(label: str) -> str:
    return label[:1].upper() + label[1:]


def _samples(numbers: pd.DataFrame) -> list[Line2D]:
    found = numbers.drop_duplicates("sample_number").sort_values("sample_number")
    marks = [(style.sample_mark(int(n)), s) for n, s in zip(found["sample_number"], found["sample"], strict=True)]
    return [Line2D([], [], color=m.colour, marker=m.marker, ls="", label=str(s)) for m, s in marks]


def _regimes(numbers: pd.DataFrame) -> list[Line2D]:
    return [
        Line2D([], [], color="0.3", marker="o", mfc="none" if is_open else "0.3", ls="", label=name)
        for name, is_open in _OPEN.items()
        if (numbers["regime"] == name).any()
    ]
