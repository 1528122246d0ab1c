"""Fig. 4 of Berardo et al. (2019): T/N against nominal pressure, with the fit T/N = mu + tau0/p."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tribo.comparison import study_lookup
from tribo.figures import style
from tribo.records import REGIMES, Regime, Study

COLUMNS = [
    "sample_number",
    "sample",
    "regime",
    "group",
    "mark",
    "pressure_kPa",
    "T_over_N",
    "T_over_N_u",
    "n_pulls",
]
CURVE_POINTS = 80


def numbers(study: Study) -> pd.DataFrame:
    """Mean T/N and its standard deviation of the mean at each pressure (kPa), and the fitted curves."""
    table = study.ingested.table()
    if table.empty or not study.ingested.campaign.has_area:
        return pd.DataFrame(columns=COLUMNS)
    frames = []
    for sample, number in study_lookup.sample_numbers(study).items():
        pulls = table[table["sample"] == sample]
        pattern = study.ingested.campaign.samples.get(sample)
        group = "anisotropic" if pattern is not None and study_lookup.is_anisotropic(pattern) else "isotropic"
        for regime in REGIMES:
            points = _means(pulls, regime, study.ingested.campaign.nominal_area_m2)
            part = pd.concat([points, _curve(study, sample, regime, points)], ignore_index=True)
            frames.append(part.assign(sample_number=number, sample=sample, regime=regime, group=group))
    return pd.concat(frames, ignore_index=True)[COLUMNS]


def _means(pulls: pd.DataFrame, regime: Regime, area_m2: float) -> pd.DataFrame:
    pulls = pulls[np.isfinite(pulls[f"{regime}_N"])]
    level_N = study_lookup.load_levels(pulls["normal_load_N"].to_numpy(float))
    ratio = pulls[f"{regime}_N"] / pulls["normal_load_N"]
    cells = ratio.groupby(level_N / area_m2 / 1e3).agg(["mean", "sem", "count"])
    cells = cells.rename_axis("pressure_kPa").reset_index()
    cells.columns = pd.Index(["pressure_kPa", "T_over_N", "T_over_N_u", "n_pulls"])
    return cells.assign(mark="mean")


def _curve(study: Study, sample: str, regime: Regime, points: pd.DataFrame) -> pd.DataFrame:
    fit = study_lookup.fit_of(study.fits, sample, regime)
    if fit is None or points.empty:
        return pd.DataFrame(columns=points.columns)
    p_kPa = np.geomspace(0.9 * points["pressure_kPa"].min(), 1.05 * points["pressure_kPa"].max(), CURVE_POINTS)
    ratio = fit.force_N(p_kPa * 1e3 * fit.nominal_area_m2) / (p_kPa * 1e3 * fit.nominal_area_m2)
    empty = {"T_over_N_u": np.nan, "n_pulls": pd.NA}
    return pd.DataFrame({"mark": "fit", "pressure_kPa": p_kPa, "T_over_N": ratio, **empty})


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """Static and sliding side by side; anisotropic samples in a second row where there are any."""
    groups = [g for g in ("isotropic", "anisotropic") if (numbers["group"] == g).any()]
    figure, axes = style.panel_grid(2 * len(groups), 62, columns=2)
    panels = [(group, regime) for group in groups for regime in REGIMES]
    for ax, (group, regime) in zip(axes, panels, strict=True):
        part = numbers[(numbers["group"] == group) & (numbers["regime"] == regime)]
        _panel(ax, part)
        kind = "" if len(groups) == 1 else f", {group} samples"
        style.panel_title(ax, f"{regime.capitalize()} friction{kind}")
        ax.set_xlabel("Nominal pressure p (kPa)")
        ax.set_ylabel(f"{regime.capitalize()} T / N")
    samples = numbers.drop_duplicates("sample_number")
    handles = [
        _sample_handle(number, name) for number, name in zip(samples["sample_number"], samples["sample"], strict=True)
    ]
    style.legend_below(figure, [*handles, Line2D([], [], color="0.4", label="fit T/N = μ + τ₀/p")], columns=8)
    return figure


def _panel(ax: Axes, part: pd.DataFrame) -> None:
    for number, sample in style.by_sample(part):
        mark = style.sample_mark(number)
        mean, curve = sample[sample["mark"] == "mean"], sample[sample["mark"] == "fit"]
        ax.plot(curve["pressure_kPa"], curve["T_over_N"], color=mark.colour, lw=0.9)
        ax.errorbar(
            mean["pressure_kPa"], mean["T_over_N"], mean["T_over_N_u"].fillna(0.0),
            fmt=mark.marker, color=mark.colour, elinewidth=0.8,
        )  # fmt: skip
    ax.set_ylim(bottom=0)
    ax.set_xlim(left=0)


def _sample_handle(number: int, name: str) -> Line2D:
    mark = style.sample_mark(number)
    return Line2D([], [], color=mark.colour, marker=mark.marker, lw=0.9, label=name)
