"""Friction against load, pressure and area fraction: Figs. 4, 6, 7 and 8 of Berardo et al. (2019), and agreement.

The ratio of measured to simulated force at each load is that of :mod:`tribo.comparison.findings`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Transform

from tribo.comparison import findings
from tribo.comparison.findings import ratios_of
from tribo.errors import Problem, TriboError
from tribo.figures import style
from tribo.records import REGIMES, FloatArray, LawFit, Regime, Study
from tribo.wording.numerals import true_minus

RATIO_COLUMNS = [
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
LOAD = "Normal load N (N)"


def ratio_numbers(study: Study) -> pd.DataFrame:
    """Mean T/N and its standard deviation of the mean at each pressure (kPa), and the fitted curves."""
    table = study.ingested.table()
    if table.empty or not study.ingested.campaign.has_area:
        return pd.DataFrame(columns=RATIO_COLUMNS)
    frames = []
    for sample, number in findings.sample_numbers(study).items():
        pulls = table[table["sample"] == sample]
        pattern = study.ingested.campaign.samples.get(sample)
        group = "anisotropic" if pattern is not None and findings.is_anisotropic(pattern) else "isotropic"
        for regime in REGIMES:
            points = _means(pulls, regime, study.ingested.campaign.area_m2)
            part = pd.concat([points, _curve(study, sample, regime, points)], ignore_index=True)
            frames.append(part.assign(sample_number=number, sample=sample, regime=regime, group=group))
    return pd.concat(frames, ignore_index=True)[RATIO_COLUMNS]


def _means(pulls: pd.DataFrame, regime: Regime, area_m2: float) -> pd.DataFrame:
    pulls = pulls[np.isfinite(pulls[f"{regime}_N"])]
    level_N = findings.load_levels(pulls["normal_load_N"].to_numpy(float))
    ratio = pulls[f"{regime}_N"] / pulls["normal_load_N"]
    cells = ratio.groupby(level_N / area_m2 / 1e3).agg(["mean", "sem", "count"])
    cells = cells.rename_axis("pressure_kPa").reset_index()
    cells.columns = pd.Index(["pressure_kPa", "T_over_N", "T_over_N_u", "n_pulls"])
    return cells.assign(mark="mean")


def _curve(study: Study, sample: str, regime: Regime, points: pd.DataFrame) -> pd.DataFrame:
    fit = study.fits.of(sample, regime)
    if fit is None or points.empty:
        return pd.DataFrame(columns=points.columns)
    p_kPa = np.geomspace(0.9 * points["pressure_kPa"].min(), 1.05 * points["pressure_kPa"].max(), CURVE_POINTS)
    area_m2 = study.ingested.campaign.area_m2
    ratio = fit.force_N(p_kPa * 1e3 * area_m2) / (p_kPa * 1e3 * area_m2)
    empty = {"T_over_N_u": np.nan, "n_pulls": pd.NA}
    return pd.DataFrame({"mark": "fit", "pressure_kPa": p_kPa, "T_over_N": ratio, **empty})


@style.in_house_style
def draw_ratio(numbers: pd.DataFrame) -> Figure:
    """Static and sliding side by side; anisotropic samples in a second row where there are any."""
    groups = [g for g in ("isotropic", "anisotropic") if (numbers["group"] == g).any()]
    columns = 2 if style.page_mm() >= style.PAGE_MM else 1  # titles are long
    figure, axes = style.panel_grid(2 * len(groups), 62, columns=columns)
    panels = [(group, regime) for group in groups for regime in REGIMES]
    for ax, (group, regime) in zip(axes, panels, strict=True):
        part = numbers[(numbers["group"] == group) & (numbers["regime"] == regime)]
        _ratio_panel(ax, part)
        kind = "" if len(groups) == 1 else f", {group} samples"
        style.panel_title(ax, f"{regime.capitalize()} friction{kind}")
        ax.set_xlabel("Nominal pressure p (kPa)")
        ax.set_ylabel(f"{regime.capitalize()} T / N")
    law = Line2D([], [], color="0.4", label="fit T/N = μ + τ₀/p")
    style.legend_below(figure, [*style.sample_handles(numbers, lw=0.9), law], columns=8)
    return figure


def _ratio_panel(ax: Axes, part: pd.DataFrame) -> None:
    for number, sample in style.by_sample(part):
        colour, marker = style.sample_mark(number)
        mean, curve = sample[sample["mark"] == "mean"], sample[sample["mark"] == "fit"]
        ax.plot(curve["pressure_kPa"], curve["T_over_N"], color=colour, lw=0.9)
        ax.errorbar(
            mean["pressure_kPa"], mean["T_over_N"], mean["T_over_N_u"].fillna(0.0),
            fmt=marker, color=colour, elinewidth=0.8,
        )  # fmt: skip
    ax.set_ylim(bottom=0)
    ax.set_xlim(left=0)


FORCE_COLUMNS = [
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


def force_numbers(regime: Regime) -> Callable[[Study], pd.DataFrame]:
    """The ``numbers`` of Fig. 6 (static) or Fig. 7 (sliding): loads and forces in newton."""

    def of_study(study: Study) -> pd.DataFrame:
        table = study.ingested.table()
        if table.empty:
            return pd.DataFrame(columns=FORCE_COLUMNS)
        frames = [
            _one_sample(study, sample, regime, table[table["sample"] == sample]).assign(
                sample_number=number,
                sample=sample,
                regime=regime,
                area_fraction=_area_fraction(study, sample),
            )
            for sample, number in findings.sample_numbers(study).items()
        ]
        return pd.concat(frames, ignore_index=True).reindex(columns=FORCE_COLUMNS)

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
    frames = [points, *_fit_line("fit", study.fits.of(sample, regime), line, band=True)]
    frames += _fit_line("simulated", findings.fit_of(simulated, sample, regime), line)
    flat = study.fits.of(findings.flat_sample(study), regime)
    if flat is not None:
        forces = flat.force_N(line) * _area_fraction(study, sample)
        frames.append(pd.DataFrame({"mark": "AF prediction", "normal_load_N": line, "T_N": forces}))
    return pd.concat(frames, ignore_index=True)


def _fit_line(mark: str, fit: LawFit | None, loads_N: FloatArray, band: bool = False) -> list[pd.DataFrame]:
    if fit is None:
        return []
    force = fit.force_N(loads_N)
    frame = pd.DataFrame({"mark": mark, "normal_load_N": loads_N, "T_N": force})
    if band:
        half = fit.force_half_width_N(loads_N)
        frame = frame.assign(T_low_N=force - half, T_high_N=force + half)
    return [frame]


@style.in_house_style
def draw_force(numbers: pd.DataFrame) -> Figure:
    """One panel per sample, all on the same axes, so that samples can be compared by eye."""
    force = f"{str(numbers['regime'].iloc[0]).capitalize()} friction force T (N)"
    figure, panels = style.sample_panels(numbers, 52, LOAD, force, sharex=True, sharey=True)
    low, high = _force_limits(numbers)
    for ax, sample in panels:
        _force_panel(ax, sample)
        first = sample.iloc[0]
        style.panel_title(ax, first["sample"], f"AF = {first['area_fraction']:.2f}")
        lowest, highest = float(sample["T_low_N"].min()), float(sample["T_high_N"].max())
        if highest > high or lowest < low:  # where a band leaves the panel, how far it reaches
            text = true_minus(f"95 % band from {lowest:.3g} to {highest:.3g} N")
            ax.text(0.03, 0.97, text, transform=ax.transAxes, va="top", fontsize=6.5, color=style.VERMILLION)
    panels[0][0].set(xlim=(0, None), ylim=(low, high))
    style.legend_below(figure, _force_legend(numbers), columns=4)
    return figure


def _force_panel(ax: Axes, sample: pd.DataFrame) -> None:
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
        _draw_pulls(ax, by_mark["measured"])


def _draw_pulls(ax: Axes, pulls: pd.DataFrame) -> None:
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


def _force_limits(numbers: pd.DataFrame) -> tuple[float, float]:
    """Ends of the force axis: everything drawn, and bands as far as they leave the points readable."""
    values = numbers["T_N"]
    measured = values[numbers["mark"] == "measured"]
    top = float(min(values.max(), 2.5 * (measured.max() if len(measured) else values.max())))
    low, high = float(min(numbers["T_low_N"].min(), 0.0)), float(max(numbers["T_high_N"].max(), top))
    return max(np.nan_to_num(low), -0.5 * top), 1.03 * min(np.nan_to_num(high, nan=top), WIDEST_BAND * top)


def _force_legend(numbers: pd.DataFrame) -> list[Line2D]:
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


AREA_COLUMNS = ["regime", "parameter", "mark", "sample_number", "sample", "area_fraction", "value", "value_u"]
PARAMETERS = {"mu": ("mu", 1.0), "tau0_kPa": ("tau0_Pa", 1e-3)}  # column -> parameter of the fit, factor
LABELS = {"mu": "μ", "tau0_kPa": "τ₀ (kPa)"}
AREA_DODGE_POINTS = 4.0
COLOURS = {"measured": style.VERMILLION, "simulated": style.GREEN, "AF prediction": style.ORANGE}


def area_numbers(study: Study) -> pd.DataFrame:
    """mu and tau0 (kPa) of every sample with standard uncertainties, their line in AF, the AF prediction."""
    order = findings.sample_numbers(study)
    simulated = study.comparison.simulated if study.comparison is not None else ()
    fractions = {study.ingested.campaign.area_fraction(s) for s in order if s in study.ingested.campaign.samples}
    if study.comparison is None and (len(fractions) < 2 or not study.ingested.campaign.has_area):
        return pd.DataFrame(columns=AREA_COLUMNS)
    frames = []
    for regime in REGIMES:
        for parameter in PARAMETERS:
            measured = _area_points(study, study.fits, regime, parameter, "measured", order)
            model = _area_points(study, simulated, regime, parameter, "simulated", order)
            flat = study.fits.of(findings.flat_sample(study), regime)
            frames += [measured, model, _line(measured), _prediction(flat, measured, parameter)]
            frames[-2:] = [f.assign(regime=regime, parameter=parameter) for f in frames[-2:]]
    filled = [f for f in frames if not f.empty]
    table = pd.concat(filled, ignore_index=True) if filled else pd.DataFrame()
    return table.reindex(columns=AREA_COLUMNS)


def _area_points(
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
            "area_fraction": _drawn_at(study, fit.sample, mark),
            "value": factor * fit.value(name),
            "value_u": factor * fit.standard_uncertainty(name),
        }
        for fit in fits
        if fit.regime == regime and fit.sample in order and name in fit.parameters
    ]
    return pd.DataFrame(rows, columns=AREA_COLUMNS).sort_values("sample_number")


def _drawn_at(study: Study, sample: str, mark: str) -> float:
    """The model's own area fraction where its runs say it, else that of the sample."""
    if mark == "simulated":
        for run in study.example_runs:
            if run.sample == sample and "area_fraction" in run.parameters:
                return float(run.parameters["area_fraction"])
    return _area_fraction(study, sample)


def _line(points: pd.DataFrame) -> pd.DataFrame:
    """Straight line through the points, all with the same weight.

    Weights from the uncertainties would make the line arbitrary: with three specimens they are known to a factor
    of two at best, and the point with the smallest would dominate the fit.
    """
    if points.empty:
        return points
    usable = points[np.isfinite(points["area_fraction"]) & np.isfinite(points["value"])]
    if usable["area_fraction"].nunique() < 2:
        return pd.DataFrame(columns=AREA_COLUMNS)
    af, value = usable["area_fraction"].to_numpy(float), usable["value"].to_numpy(float)
    slope, intercept = np.polyfit(af, value, 1)
    ends = np.array([af.min(), af.max()])
    return pd.DataFrame({"mark": "fit", "area_fraction": ends, "value": intercept + slope * ends})


def _prediction(flat: LawFit | None, points: pd.DataFrame, parameter: str) -> pd.DataFrame:
    if flat is None or points.empty:
        return pd.DataFrame(columns=AREA_COLUMNS)
    name, factor = PARAMETERS[parameter]
    ends = np.array([points["area_fraction"].min(), 1.0])
    return pd.DataFrame({"mark": "AF prediction", "area_fraction": ends, "value": factor * flat.value(name) * ends})


@style.in_house_style
def draw_area(numbers: pd.DataFrame) -> Figure:
    """Four panels: mu and tau0, static above sliding; filled marks are measured, open ones simulated."""
    figure, axes = style.panel_grid(4, 60, columns=2, sharex=True)
    panels = [(regime, parameter) for regime in REGIMES for parameter in PARAMETERS]
    for ax, (regime, parameter) in zip(axes, panels, strict=True):
        _area_panel(ax, numbers[(numbers["regime"] == regime) & (numbers["parameter"] == parameter)])
        ax.set_ylabel(f"{regime.capitalize()} {LABELS[parameter]}")
        ax.set_xlabel("Contact area fraction AF")
        ax.tick_params(labelbottom=True)
        low, high = ax.get_ylim()
        ax.set_ylim(min(low, 0.0), high)
        ax.margins(x=0.06)
    style.legend_below(figure, _area_legend(numbers), columns=5)
    return figure


def _area_panel(ax: Axes, part: pd.DataFrame) -> None:
    fit, area = part[part["mark"] == "fit"], part[part["mark"] == "AF prediction"]
    ax.plot(fit["area_fraction"], fit["value"], color=style.VERMILLION)
    ax.plot(area["area_fraction"], area["value"], color=style.ORANGE, ls=":", lw=1.4)
    for mark, side in (("simulated", 1), ("measured", -1)):
        points = part[part["mark"] == mark]
        shared = points.groupby("area_fraction").cumcount()
        style.cover(ax, points["area_fraction"], *_ends(points))
        for (_, point), place in zip(points.iterrows(), shared, strict=True):
            _point(ax, point, style.moved_aside(ax, side * (0.5 + place) * AREA_DODGE_POINTS))


def _ends(points: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
    bar = points["value_u"].fillna(0.0)
    return points["value"] - bar, points["value"] + bar


def _point(ax: Axes, point: pd.Series, aside: Transform) -> None:
    """One value with its error bar, moved aside on paper (not in its numbers) so that none hides another."""
    measured = point["mark"] == "measured"
    ax.errorbar(
        point["area_fraction"], point["value"], point["value_u"] if np.isfinite(point["value_u"]) else 0.0,
        fmt=style.sample_mark(int(point["sample_number"]))[1], color=COLOURS[point["mark"]],
        mfc=COLOURS[point["mark"]] if measured else "white", elinewidth=0.8, transform=aside,
        ms=4.5, mew=0.9, zorder=3 if measured else 2.5,
    )  # fmt: skip


def _area_legend(numbers: pd.DataFrame) -> list[Line2D]:
    return [
        *style.sample_handles(numbers, color="0.35", ls=""),
        Line2D([], [], color=style.VERMILLION, marker="o", label="measured, with straight line in AF"),
        Line2D([], [], color=style.GREEN, marker="o", mfc="white", ls="", label="spring-block model"),
        Line2D([], [], color=style.ORANGE, ls=":", lw=1.4, label="flat value · AF"),
    ]


RATIO_TICKS = (
    (0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4),
    (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0),
    (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0),
    (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e12),
)
REGIME_STYLE = {"static": (style.BLUE, "o", -1), "sliding": (style.VERMILLION, "s", 1)}
AGREEMENT_DODGE_POINTS = 1.8
MOST_BAR = 3.0  # an error bar beyond this factor runs off the panel, so that the others can be read


@style.in_house_style
def draw_agreement(numbers: pd.DataFrame) -> Figure:
    """One panel per sample, static beside sliding at each load; the line at 1 is perfect agreement."""
    figure, panels = style.sample_panels(numbers, 45, LOAD, "Measured T / simulated T", sharex=True, sharey=True)
    lowest, highest = float(numbers["normal_load_N"].min()), float(numbers["normal_load_N"].max())
    for ax, sample in panels:
        ax.axhline(1, color="0.4", lw=0.8)
        for part, aside, look in _regimes_beside(ax, sample, "ratio"):
            bars = style.error_bars(part, "ratio", "ratio_low", "ratio_high")
            ax.errorbar(part["normal_load_N"], part["ratio"], bars, elinewidth=0.8, ms=3.5, transform=aside, **look)
        ax.set_xscale("log" if lowest > 0 and highest / lowest > 5 else "linear")
        style.panel_title(ax, str(sample["sample"].iloc[0]))
    _ratio_axis([ax for ax, _ in panels], numbers)
    style.legend_below(figure, [
        Line2D([], [], color=colour, marker=marker, lw=0.8, ms=3.5, label=f"{regime} friction, 95 %")
        for regime, (colour, marker, _) in REGIME_STYLE.items()
    ])  # fmt: skip
    return figure


def _regimes_beside(
    ax: Axes, sample: pd.DataFrame, y: str
) -> Iterator[tuple[pd.DataFrame, Transform, dict[str, Any]]]:
    """The points of each regime of a sample, shifted on paper so that none hides another, with their look."""
    for regime, part in sample.groupby("regime"):
        colour, marker, side = REGIME_STYLE[str(regime)]
        style.cover(ax, part["normal_load_N"], part[y], part[y])
        yield part, style.moved_aside(ax, side * AGREEMENT_DODGE_POINTS), {"fmt": marker, "color": colour}


def _ratio_axis(axes: Iterable[Axes], numbers: pd.DataFrame) -> None:
    """A logarithmic axis on which twice and half lie equally far from 1."""
    lowest, highest = numbers["ratio"].min(), numbers["ratio"].max()
    low = np.nanmin([0.85, 0.95 * lowest, 0.97 * max(numbers["ratio_low"].min(), lowest / MOST_BAR)])
    high = np.nanmax([1.18, 1.05 * highest, 1.03 * min(numbers["ratio_high"].max(), highest * MOST_BAR)])
    ticks = np.array(next(t for t in RATIO_TICKS if high / low < t[-1] / t[0]))
    for ax in axes:
        ax.set_yscale("log")
        ax.set_ylim(low, high)
        style.plain_ticks(ax.yaxis, ticks[(ticks >= low) & (ticks <= high)])
        if ax.get_xscale() == "log":
            style.plain_ticks(ax.xaxis)
        else:
            ax.set_xlim(left=0)


def residuals_of_fits(study: Study) -> pd.DataFrame:
    """100 (measured / fitted - 1) of every test by the fitted law of its sample, against the normal load in N."""
    table = study.residuals()
    if table.empty:
        raise TriboError(Problem("nothing_to_draw", "the study holds no fits, so there are no residuals"))
    numbers = table["sample"].map(findings.sample_numbers(study))
    columns = ["sample_number", "sample", "regime", "test_id", "specimen", "normal_load_N", "residual_percent"]
    return table.assign(sample_number=numbers)[columns]


@style.in_house_style
def draw_residuals_of_fits(numbers: pd.DataFrame) -> Figure:
    """One panel per sample, static beside sliding at each load; on the line at zero the fit is right."""
    residual = "measured / fitted − 1 (%)"
    figure, panels = style.sample_panels(numbers, 45, LOAD, residual, sharex=True, sharey=True)
    for ax, sample in panels:
        ax.axhline(0, color="0.4", lw=0.8)
        for part, aside, look in _regimes_beside(ax, sample, "residual_percent"):
            points = part["normal_load_N"], part["residual_percent"]
            ax.errorbar(*points, ms=2.8, mew=0.6, mfc="none", transform=aside, **look)
        style.panel_title(ax, str(sample["sample"].iloc[0]))
    panels[0][0].set_xlim(left=0)
    style.legend_below(figure, [
        Line2D([], [], color=colour, marker=marker, mfc="none", ls="", ms=3.5, label=f"{regime} friction")
        for regime, (colour, marker, _) in REGIME_STYLE.items()
        if (numbers["regime"] == regime).any()
    ])  # fmt: skip
    return figure


AGREEMENT = style.StudyFigure(
    "agreement",
    "Ratio of measured to simulated friction force",
    "Ratio of the measured to the simulated friction force at each normal load, with its 95 % "
    "interval. At a ratio of 1 the model is exact; below 1 it predicts too much friction. The model "
    "was calibrated on the flat sample, so agreement there does not test the model.",
    ratios_of,
    draw_agreement,
)
RATIO = style.StudyFigure(
    "fig4",
    "T/N against pressure",
    "Mean of T/N over all pulls at each nominal pressure. Error bars: standard deviation of "
    "the mean over these pulls, as in the paper. Unlike the uncertainties of the fits, they do not "
    "account for differences between specimens. Curves: T/N = μ + τ₀/p with the fitted μ and τ₀.",
    ratio_numbers,
    draw_ratio,
)
STATIC_FORCE = style.StudyFigure(
    "fig6",
    "Static friction force against load",
    "Static friction force of every pull, the fitted line T = μN + τ₀A with its 95 % band, the "
    "spring-block model calibrated on the flat sample alone, and the force expected if friction were "
    "proportional to the contact area fraction AF.",
    force_numbers("static"),
    draw_force,
)
SLIDING_FORCE = style.StudyFigure(
    "fig7",
    "Sliding friction force against load",
    "As in the previous figure, for the mean sliding friction force.",
    force_numbers("sliding"),
    draw_force,
)
LAWS_AGAINST_AREA = style.StudyFigure(
    "fig8",
    "μ and τ₀ against contact area fraction",
    "Fitted μ and τ₀ with their combined standard uncertainties, and a straight line in AF through the "
    "measured values (equal weights). Points that would overlap are shifted slightly. Simulated points are "
    "plotted at the area fraction of the model lattice. μ and τ₀ of a fit are correlated: judge the "
    "model by the force at a load, not by μ or τ₀ alone.",
    area_numbers,
    draw_area,
)
