"""Figs. 6 and 7 of Berardo et al. (2019): friction force against load, experiment and model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tribo.comparison import study_lookup
from tribo.figures import style
from tribo.records import FloatArray, LawFit, Regime, Study

COLUMNS = [
    "sample_number",
    "sample",
    "regime",
    "area_fraction",
    "mark",
    "normal_load_N",
    "T_N",
    "T_low_N",
    "T_high_N",
    "specimen",
    "specimen_number",
]
LINE_POINTS = 25
SPECIMEN_COLOURS = (style.BLUE, style.PURPLE, style.SKY, style.BLACK)
SPECIMEN_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
ASIDE_POINTS = 1.9  # between the marks of two specimens at one load
MOST_NAMED = 7  # specimens of one sample in the legend
WIDEST_BAND = 3.0  # times the highest value drawn otherwise; a wider band is cut, and its end is written there


def numbers(regime: Regime) -> Callable[[Study], pd.DataFrame]:
    """The ``numbers`` of Fig. 6 (static) or Fig. 7 (sliding): loads and forces in newton."""

    def of_study(study: Study) -> pd.DataFrame:
        table = study.ingested.table()
        if table.empty:
            return pd.DataFrame(columns=COLUMNS)
        frames = [
            _one_sample(study, sample, regime, table[table["sample"] == sample]).assign(
                sample_number=number,
                sample=sample,
                regime=regime,
                area_fraction=_area_fraction(study, sample),
            )
            for sample, number in study_lookup.sample_numbers(study).items()
        ]
        return pd.concat(frames, ignore_index=True).reindex(columns=COLUMNS)

    return of_study


def _area_fraction(study: Study, sample: str) -> float:
    pattern = study.ingested.campaign.samples.get(sample)
    return pattern.area_fraction if pattern is not None else float("nan")


def _one_sample(study: Study, sample: str, regime: Regime, pulls: pd.DataFrame) -> pd.DataFrame:
    pulls = pulls[np.isfinite(pulls[f"{regime}_N"])]
    loads = pulls["normal_load_N"].to_numpy(float)
    points = pd.DataFrame({
        "mark": "measured", "normal_load_N": loads, "T_N": pulls[f"{regime}_N"].to_numpy(float),
        "specimen": pulls["specimen"].to_numpy(), "specimen_number": pd.factorize(pulls["specimen"], sort=True)[0],
    })  # fmt: skip
    if not len(loads):
        return points
    line = np.linspace(0.0, 1.05 * loads.max(), LINE_POINTS)
    simulated = study.comparison.simulated if study.comparison is not None else ()
    frames = [points, *_fit_line("fit", study_lookup.fit_of(study.fits, sample, regime), line, band=True)]
    frames += _fit_line("simulated", study_lookup.fit_of(simulated, sample, regime), line)
    flat = study_lookup.fit_of(study.fits, study_lookup.flat_sample(study), regime)
    if flat is not None:
        forces = flat.force_N(line) * _area_fraction(study, sample)
        frames.append(pd.DataFrame({"mark": "AF prediction", "normal_load_N": line, "T_N": forces}))
    return pd.concat(frames, ignore_index=True)


def _fit_line(mark: str, fit: LawFit | None, loads_N: FloatArray, band: bool = False) -> list[pd.DataFrame]:
    from scipy.stats import t

    if fit is None:
        return []
    force = fit.force_N(loads_N)
    frame = pd.DataFrame({"mark": mark, "normal_load_N": loads_N, "T_N": force})
    if band:
        half = t.ppf(0.975, fit.dof) * fit.force_u_N(loads_N)
        frame = frame.assign(T_low_N=force - half, T_high_N=force + half)
    return [frame]


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """One panel per sample, all on the same axes, so that samples can be compared by eye."""
    groups = style.by_sample(numbers)
    figure, axes = style.panel_grid(len(groups), 52, sharex=True, sharey=True)
    for ax, (_, sample) in zip(axes, groups, strict=True):
        _panel(ax, sample)
        first = sample.iloc[0]
        style.panel_title(ax, first["sample"], f"AF = {first['area_fraction']:.2f}")
    low, high = _limits(numbers)
    axes[0].set_ylim(low, high)
    for ax, (_, sample) in zip(axes, groups, strict=True):
        _say_cut_band(ax, sample, low, high)
    axes[0].set_xlim(left=0)
    regime = str(numbers["regime"].iloc[0]).capitalize()
    for ax in axes:
        if style.is_leftmost(ax):
            ax.set_ylabel(f"{regime} friction force T (N)")
        ax.set_xlabel("Normal load N (N)")
        ax.tick_params(labelbottom=True)
    style.legend_below(figure, _handles(numbers), columns=4)
    return figure


def _panel(ax: Axes, sample: pd.DataFrame) -> None:
    by_mark = dict(list(sample.groupby("mark")))
    if "fit" in by_mark:
        fit = by_mark["fit"]
        ax.fill_between(fit["normal_load_N"], fit["T_low_N"], fit["T_high_N"], color=style.VERMILLION, alpha=0.15, lw=0)
        ax.plot(fit["normal_load_N"], fit["T_N"], color=style.VERMILLION)
    if "simulated" in by_mark:
        ax.plot(by_mark["simulated"]["normal_load_N"], by_mark["simulated"]["T_N"], color=style.GREEN, ls="--")
    if "AF prediction" in by_mark:
        area = by_mark["AF prediction"]
        ax.plot(area["normal_load_N"], area["T_N"], color=style.ORANGE, ls=":", lw=1.4)
    if "measured" in by_mark:
        _points(ax, by_mark["measured"])


def _points(ax: Axes, pulls: pd.DataFrame) -> None:
    """Every pull with the mark of its specimen, specimens side by side on paper."""
    last = int(pulls["specimen_number"].max())
    for number, part in pulls.groupby("specimen_number"):
        place = int(str(number).split(".")[0])
        style.cover(ax, part["normal_load_N"], part["T_N"], part["T_N"])
        ax.plot(
            part["normal_load_N"], part["T_N"], ls="", ms=2.8, mew=0.6, mfc="none",
            transform=style.moved_aside(ax, (place - last / 2) * ASIDE_POINTS),
            label=f"specimen {part['specimen'].iloc[0]}", **_specimen_look(place),
        )  # fmt: skip


def _specimen_look(number: int) -> dict[str, Any]:
    return {
        "marker": SPECIMEN_MARKERS[number % len(SPECIMEN_MARKERS)],
        "color": SPECIMEN_COLOURS[number % len(SPECIMEN_COLOURS)],
    }


def _limits(numbers: pd.DataFrame) -> tuple[float, float]:
    """Ends of the force axis: everything drawn, and bands as far as they leave the points readable."""
    values = numbers["T_N"]
    measured = values[numbers["mark"] == "measured"]
    top = float(min(values.max(), 2.5 * (measured.max() if len(measured) else values.max())))
    low, high = float(min(numbers["T_low_N"].min(), 0.0)), float(max(numbers["T_high_N"].max(), top))
    return max(np.nan_to_num(low), -0.5 * top), 1.03 * min(np.nan_to_num(high, nan=top), WIDEST_BAND * top)


def _say_cut_band(ax: Axes, sample: pd.DataFrame, low: float, high: float) -> None:
    """Where a band leaves the panel, how far it reaches."""
    lowest, highest = float(sample["T_low_N"].min()), float(sample["T_high_N"].max())
    if highest > high or lowest < low:
        text = f"95 % band from {lowest:.3g} to {highest:.3g} N".replace("-", "−")
        ax.text(0.03, 0.97, text, transform=ax.transAxes, va="top", fontsize=6.5, color=style.VERMILLION)


def _handles(numbers: pd.DataFrame) -> list[Line2D]:
    specimens = numbers["specimen_number"].dropna().astype(int)
    several = specimens.nunique() > 1
    shown = sorted(specimens.unique())[:MOST_NAMED]
    points = [
        Line2D([], [], mfc="none", ls="", ms=3.5, label=f"pulls of specimen {number + 1}" if several else "pulls",
               **_specimen_look(number))
        for number in shown
    ]  # fmt: skip
    lines = {
        "fit": Line2D([], [], color=style.VERMILLION, label="fit T = μN + τ₀A, 95 % band"),
        "simulated": Line2D([], [], color=style.GREEN, ls="--", label="spring-block model"),
        "AF prediction": Line2D([], [], color=style.ORANGE, ls=":", lw=1.4, label="T = T(flat) · AF"),
    }
    return [*points, *(line for mark, line in lines.items() if (numbers["mark"] == mark).any())]
