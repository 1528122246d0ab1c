"""Fig. 8 of Berardo et al. (2019): mu and tau0 against the contact area fraction AF."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Transform

from tribo.comparison import study_lookup
from tribo.figures import style
from tribo.records import REGIMES, LawFit, Regime, Study

COLUMNS = ["regime", "parameter", "mark", "sample_number", "sample", "area_fraction", "value", "value_u"]
PARAMETERS = {"mu": ("mu", 1.0), "tau0_kPa": ("tau0_Pa", 1e-3)}  # column -> parameter of the fit, factor
LABELS = {"mu": "μ", "tau0_kPa": "τ₀ (kPa)"}
DODGE_POINTS = 4.0
COLOURS = {"measured": style.VERMILLION, "simulated": style.GREEN, "AF prediction": style.ORANGE}


def numbers(study: Study) -> pd.DataFrame:
    """mu and tau0 (kPa) of every sample with standard uncertainties, their line in AF, the AF prediction."""
    order = study_lookup.sample_numbers(study)
    simulated = study.comparison.simulated if study.comparison is not None else ()
    fractions = {study.ingested.campaign.area_fraction(s) for s in order if s in study.ingested.campaign.samples}
    if study.comparison is None and (len(fractions) < 2 or not study.ingested.campaign.has_area):
        return pd.DataFrame(columns=COLUMNS)
    frames = []
    for regime in REGIMES:
        for parameter in PARAMETERS:
            measured = _points(study, study.combined or study.fits, regime, parameter, "measured", order)
            model = _points(study, simulated, regime, parameter, "simulated", order)
            flat = study_lookup.fit_of(study.fits, study_lookup.flat_sample(study), regime)
            frames += [measured, model, _line(measured), _prediction(flat, measured, parameter)]
            frames[-2:] = [f.assign(regime=regime, parameter=parameter) for f in frames[-2:]]
    filled = [f for f in frames if not f.empty]
    return pd.concat(filled, ignore_index=True).reindex(columns=COLUMNS) if filled else pd.DataFrame(columns=COLUMNS)


def _points(
    study: Study, fits: tuple[LawFit, ...], regime: Regime, parameter: str, mark: str, order: dict[str, int]
) -> pd.DataFrame:
    name, factor = PARAMETERS[parameter]
    rows = [
        {
            "regime": regime,
            "parameter": parameter,
            "mark": mark,
            "sample_number": order[fit.sample],
            "sample": fit.sample,
            "area_fraction": _area_fraction(study, fit.sample, mark),
            "value": factor * fit.value(name),
            "value_u": factor * fit.standard_uncertainty(name),
        }
        for fit in fits
        if fit.regime == regime and fit.sample in order and name in fit.parameters
    ]
    return pd.DataFrame(rows, columns=COLUMNS).sort_values("sample_number")


def _area_fraction(study: Study, sample: str, mark: str) -> float:
    """The model's own area fraction where its runs say it, else that of the sample."""
    if mark == "simulated":
        for run in study.example_runs:
            if run.sample == sample and "area_fraction" in run.parameters:
                return float(run.parameters["area_fraction"])
    pattern = study.ingested.campaign.samples.get(sample)
    return pattern.area_fraction if pattern is not None else float("nan")


def _line(points: pd.DataFrame) -> pd.DataFrame:
    """Straight line through the points, all with the same weight.

    Weights from the uncertainties would make the line arbitrary: with three specimens they are known to a factor
    of two at best, and the point with the smallest would dominate the fit.
    """
    if points.empty:
        return points
    usable = points[np.isfinite(points["area_fraction"]) & np.isfinite(points["value"])]
    if usable["area_fraction"].nunique() < 2:
        return pd.DataFrame(columns=COLUMNS)
    af, value = usable["area_fraction"].to_numpy(float), usable["value"].to_numpy(float)
    slope, intercept = np.polyfit(af, value, 1)
    ends = np.array([af.min(), af.max()])
    return pd.DataFrame({"mark": "fit", "area_fraction": ends, "value": intercept + slope * ends})


def _prediction(flat: LawFit | None, points: pd.DataFrame, parameter: str) -> pd.DataFrame:
    if flat is None or points.empty:
        return pd.DataFrame(columns=COLUMNS)
    name, factor = PARAMETERS[parameter]
    ends = np.array([points["area_fraction"].min(), 1.0])
    return pd.DataFrame({"mark": "AF prediction", "area_fraction": ends, "value": factor * flat.value(name) * ends})


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """Four panels: mu and tau0, static above sliding; filled marks are measured, open ones simulated."""
    figure, axes = style.panel_grid(4, 60, columns=2, sharex=True)
    panels = [(regime, parameter) for regime in REGIMES for parameter in PARAMETERS]
    for ax, (regime, parameter) in zip(axes, panels, strict=True):
        _panel(ax, numbers[(numbers["regime"] == regime) & (numbers["parameter"] == parameter)])
        ax.set_ylabel(f"{regime.capitalize()} {LABELS[parameter]}")
        ax.set_xlabel("Contact area fraction AF")
        ax.tick_params(labelbottom=True)
        low, high = ax.get_ylim()
        ax.set_ylim(min(low, 0.0), high)
        ax.margins(x=0.06)
    style.legend_below(figure, _handles(numbers), columns=5)
    return figure


def _panel(ax: Axes, part: pd.DataFrame) -> None:
    fit, area = part[part["mark"] == "fit"], part[part["mark"] == "AF prediction"]
    ax.plot(fit["area_fraction"], fit["value"], color=style.VERMILLION)
    ax.plot(area["area_fraction"], area["value"], color=style.ORANGE, ls=":", lw=1.4)
    for mark, side in (("simulated", 1), ("measured", -1)):
        points = part[part["mark"] == mark]
        shared = points.groupby("area_fraction").cumcount()
        style.cover(ax, points["area_fraction"], *_ends(points))
        for (_, point), place in zip(points.iterrows(), shared, strict=True):
            _point(ax, point, style.moved_aside(ax, side * (0.5 + place) * DODGE_POINTS))


def _ends(points: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
    bar = points["value_u"].fillna(0.0)
    return points["value"] - bar, points["value"] + bar


def _point(ax: Axes, point: pd.Series, aside: Transform) -> None:
    """One value with its error bar, moved aside on paper (not in its numbers) so that none hides another."""
    measured = point["mark"] == "measured"
    ax.errorbar(
        point["area_fraction"], point["value"], point["value_u"] if np.isfinite(point["value_u"]) else 0.0,
        fmt=style.sample_mark(int(point["sample_number"])).marker, color=COLOURS[point["mark"]],
        mfc=COLOURS[point["mark"]] if measured else "white", elinewidth=0.8, transform=aside,
        ms=4.5, mew=0.9, zorder=3 if measured else 2.5,
    )  # fmt: skip


def _handles(numbers: pd.DataFrame) -> list[Line2D]:
    points = numbers.dropna(subset="sample_number").drop_duplicates("sample_number").sort_values("sample_number")
    samples = [
        Line2D([], [], color="0.35", marker=style.sample_mark(int(number)).marker, ls="", label=name)
        for number, name in zip(points["sample_number"], points["sample"], strict=True)
    ]
    return [
        *samples,
        Line2D([], [], color=style.VERMILLION, marker="o", label="measured, with straight line in AF"),
        Line2D([], [], color=style.GREEN, marker="o", mfc="white", ls="", label="spring-block model"),
        Line2D([], [], color=style.ORANGE, ls=":", lw=1.4, label="flat value · AF"),
    ]
