"""Residuals of the calibrated model against recorded columns: the strongest deviations, and the picture of the card."""

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
from tribo.figures.misfit import (
    LOGARITHMIC,
    LOGARITHMIC_AXES,
    REGIMES as WEIGHTS,
    Covariate,
    covariate,
    pattern_differences,
)
from tribo.records import REGIMES, FloatArray
from tribo.user_text import plain
from tribo.vocabulary import described

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis
    from tribo.diagnostics.contrasts import Contrast


RESIDUAL_COLUMNS = [
    "panel", "title", "detail", "axis", "y_axis", "mark", "sample_number", "sample", "test_id", "x", "x_name", "y",
    "y_low", "y_high",
]  # fmt: skip
MOST_PANELS = 6
MOST_POINTS_OF_CURVE = 12
BAND = 2.0  # standard deviations
NAMES = {
    "static": "Static friction", "sliding": "Sliding friction", "both": "Static and sliding friction",
    "drop": "Static / sliding friction",
}  # fmt: skip


def residual_numbers(d: Diagnosis) -> pd.DataFrame:
    """Residuals, 100 (measured / model - 1), of the strongest contrasts, one panel each.

    The model is the one calibrated on the flat sample alone.

    ``mark`` is test; mean and band, the mean of a bin and two standard deviations of such a mean by the fitted noise
    (repeats, specimens, the model's own error of a sample); curve, what the named model adds there.
    """
    from tribo.diagnostics.fit import residual_on_flat

    residual = residual_on_flat(d.baseline)
    frames = [_rows(d, k, panel, residual) for k, panel in enumerate(_panels(d))]
    return pd.DataFrame([row for rows in frames for row in rows], columns=RESIDUAL_COLUMNS)


Panel = tuple[str, str, Covariate, np.ndarray, float]  # observable, title, covariate, tests it is about, p


def _panels(d: Diagnosis) -> list[Panel]:
    """The samples, if they differ from the model by more than its stated error; then the strongest contrast with each
    covariate and sample that is significant, or the three that come closest where nothing is."""
    s, conditions = d.screened, d.baseline.setup.observations.conditions
    found: dict[tuple[str, str], Panel] = {}
    for k in np.argsort(-s.strength):
        contrast = s.contrasts[k]
        about = _tests_and_covariate(d, contrast)
        if about is not None and not contrast.is_taken_up(d.baseline.setup.observations.flat):
            column, here = about
            key = (column.name, contrast.sample if contrast.kind == "sample" else "")
            p = s.p_adjusted(float(s.strength[k]))
            found.setdefault(key, (_observable(contrast), _title(contrast), column, here, p))
        if len(found) == MOST_PANELS:
            break
    strongest = [panel for panel in found.values() if panel[-1] < 0.05]
    if not pattern_differences(d):
        return strongest or list(found.values())[:3]
    every = np.ones(len(conditions.sample), bool)
    by_sample = covariate(d.baseline.setup, "sample")
    means: Panel = ("both", "Means of the samples", by_sample, every, d.verdict.shows.excess[1])
    return [means, *strongest[: MOST_PANELS - 1]]


def _tests_and_covariate(d: Diagnosis, contrast: Contrast) -> tuple[Covariate, np.ndarray] | None:
    c = d.baseline.setup.observations.conditions
    here = np.ones(len(c.sample), bool)
    name = contrast.covariate
    if contrast.acting is not None:
        acting, needs = contrast.acting, contrast.acting.mechanism.needs
        needed = needs[0] if needs else "normal_load_N"
        name = acting.mechanism.column(acting.choice) if acting.choice else RECORDED.get(needed, needed)
    of_pattern = ("area_fraction", "rim_per_m", "elongation", "tau0", "clip_N")
    if contrast.kind in ("sample", "specimen") or name in of_pattern:
        name = "normal_load_N"
    if contrast.kind == "sample":
        here = c.sample == contrast.sample
    if contrast.kind == "specimen":
        here = c.specimen == contrast.covariate.removeprefix("specimen ")
    if contrast.kind == "block":
        return None
    try:
        return covariate(d.baseline.setup, name), here
    except KeyError:
        return None


def _rows(d: Diagnosis, k: int, panel: Panel, residual: FloatArray) -> list[dict[str, Any]]:
    observable, title, column, here, p = panel
    o = d.baseline.setup.observations
    weight = np.array(WEIGHTS[observable])
    samples = o.samples
    places = {s: i for i, s in enumerate(samples)}
    x, y, p_text = column.values, percent(residual @ weight), "< 0.001" if p < 1e-3 else f"= {p:.2g}"
    added = added_by_causes(d, residual, weight)
    common = {
        "panel": k, "title": title, "detail": f"p {p_text}", "axis": _axis_name(column),
        "y_axis": f"{NAMES[observable]}:\nmeasured / model − 1 (%)",
    }  # fmt: skip
    tests = [
        {
            "mark": "test", "sample_number": places[o.conditions.sample[i]], "sample": o.conditions.sample[i],
            "test_id": o.test_ids[i], "x": x[i], "x_name": _name(column, x[i]), "y": y[i],
        }
        for i in np.flatnonzero(here)
    ]  # fmt: skip
    return [common | row for row in (*tests, *summaries(d, column, here, y, weight, added))]


def added_by_causes(d: Diagnosis, residual: FloatArray, weight: FloatArray) -> FloatArray | None:
    """What the named model predicts beyond the calibrated one, in percent (n,); None where none is named."""
    if d.named is None or not d.named.causes or d.verdict.verdict == "unknown":
        return None
    calibrated = d.baseline.setup.observations.log_force - residual
    return percent((d.named.model.predicted - calibrated) @ weight)


def summaries(
    d: Diagnosis, column: Covariate, here: np.ndarray, y: FloatArray, weight: FloatArray, added: FloatArray | None
) -> list[dict[str, Any]]:
    """Mean of ``y`` (n,) with its error, noise band and what the named mechanism adds, bin by bin of a column."""
    x = column.values
    logarithmic = column.name in LOGARITHMIC and bool((x > 0).all())
    found: list[dict[str, Any]] = []
    for rows in _bins(x, here, column):
        centre = float(np.exp(np.log(x[rows]).mean())) if logarithmic else float(x[rows].mean())
        at = {"x": centre, "x_name": _name(column, centre)}
        ratio = np.log1p(y[rows] / 100.0)  # geometric means, as the sentences of the verdict
        error = float(ratio.std(ddof=1) / np.sqrt(len(rows))) if len(rows) > 1 else float("nan")
        mean, mean_low, mean_high = percent(ratio.mean() + BAND * error * np.array([0.0, -1.0, 1.0]))
        variance = variance_of_mean(d, weight, rows, stated=column.name == "sample")
        low, high = percent(np.array([-BAND, BAND]) * np.sqrt(variance))
        found.append(at | {"mark": "mean", "y": float(mean), "y_low": float(mean_low), "y_high": float(mean_high)})
        found.append(at | {"mark": "band", "y": 0.0, "y_low": float(low), "y_high": float(high)})
        if added is not None:
            found.append(at | {"mark": "curve", "y": float(percent(np.log1p(added[rows] / 100.0).mean()))})
    return found


def variance_of_mean(d: Diagnosis, weight: FloatArray, rows: np.ndarray, *, stated: bool) -> float:
    """Variance of the mean residual of ``rows`` by the fitted noise: repeats, reading, specimens, error of the sample.

    The tests of a specimen, or of a sample, share its deviation, so that more of them do not reduce it. The error of
    the model for the patterns counts with the size that is ``stated`` for it, as the means of the samples are judged,
    or with that which the campaign shows, as all else is.
    """
    f = d.baseline
    sizes = f.noise.sizes[np.maximum(f.setup.group, 0)]
    over = np.where(f.setup.of_patterns & stated, np.maximum(sizes, 1.0), 1.0)
    repeats = np.einsum("i,nij,j->n", weight, f.noise.per_test(f.setup)[rows], weight)
    repeats += f.setup.observations.reading[rows] ** 2 @ weight**2
    shared = f.setup.take(rows).summed(weight) / len(rows)
    return float(repeats.sum() / len(rows) ** 2 + shared**2 @ (1.0 / (over**2 * f.precision)))


def _bins(x: FloatArray, here: np.ndarray, column: Covariate) -> list[np.ndarray]:
    """Rows by value where there are few, else by quantile."""
    rows = np.flatnonzero(here & np.isfinite(x))
    rounded = np.array([float(f"{v:.3g}") for v in x[rows]])
    distinct = np.unique(rounded)
    if len(distinct) <= MOST_POINTS_OF_CURVE or column.names:
        return [rows[rounded == value] for value in distinct]
    edges = np.quantile(x[rows], np.linspace(0, 1, MOST_POINTS_OF_CURVE + 1)[1:-1])
    codes = np.searchsorted(edges, x[rows], side="right")
    return [rows[codes == code] for code in np.unique(codes)]


def _name(column: Covariate, value: float) -> str:
    return column.names[round(value)] if column.names else ""


def _observable(contrast: Contrast) -> str:
    """What a contrast is about; a mechanism that acts in one regime is shown there."""
    if contrast.acting is not None and len(contrast.acting.mechanism.regimes) == 1:
        return contrast.acting.mechanism.regimes[0]
    return contrast.observable


def _title(contrast: Contrast) -> str:
    if contrast.kind == "specimen":
        return f"{contrast.title} ({contrast.sample})"
    return f"Sample {contrast.sample}" if contrast.sample else "All samples"


@style.in_house_style
def draw_residuals(numbers: pd.DataFrame) -> Figure:
    """Grey band: 95 % of the means if nothing were hidden. Bars: mean of a bin with twice its standard error."""
    groups = [part for _, part in numbers.groupby("panel")]
    narrow = style.page_mm() < style.PAGE_MM
    columns, height_mm = (1, 50.0) if narrow else (min(len(groups), 3), 56.0)
    figure, axes = style.panel_grid(len(groups), height_mm, columns=columns)
    for ax, part in zip(axes, groups, strict=True):
        _residual_panel(ax, part)
    style.legend_below(figure, _residual_legend(numbers), columns=12)
    return figure


def _residual_panel(ax: Axes, part: pd.DataFrame) -> None:
    tests = part[part["mark"] == "test"]
    band = part[part["mark"] == "band"].sort_values("x")
    names = tests.drop_duplicates("x")[["x", "x_name"]].sort_values("x") if tests["x_name"].any() else None
    spread = 2.0 * np.mod(np.arange(len(tests)) * 0.618034, 1.0) - 1.0  # evenly, by the golden ratio, in no order
    shifted = tests["x"] + (0.22 * spread if names is not None else 0.0)
    for number, points in tests.groupby("sample_number"):
        colour, marker = style.sample_mark(int(float(str(number))))
        ax.plot(shifted[points.index], points["y"], marker, color=colour, ms=2.0, alpha=0.45, mew=0)
    mean = part[part["mark"] == "mean"]
    bars = np.abs(mean[["y_low", "y_high"]].to_numpy(float) - mean[["y"]].to_numpy(float)).T
    ax.errorbar(mean["x"], mean["y"], bars, fmt="o", ms=3.4, color="black", elinewidth=0.9, zorder=5)
    if names is not None:
        ax.bar(band["x"], band["y_high"] - band["y_low"], 0.8, band["y_low"], color="0.75", alpha=0.35, lw=0)
    elif len(band) > 1:
        ax.fill_between(band["x"].astype(float), band["y_low"], band["y_high"], color="0.75", alpha=0.35, lw=0)
    curve = part[part["mark"] == "curve"].sort_values("x")
    step: dict[str, Any] = {"drawstyle": "steps-mid"} if names is not None else {}
    ax.plot(curve["x"], curve["y"], "-", color=style.VERMILLION, lw=1.6, zorder=6, **step)
    ax.axhline(0, color="0.4", lw=0.8)
    _residual_axis(ax, part, names)


def _residual_axis(ax: Axes, part: pd.DataFrame, names: pd.DataFrame | None) -> None:
    first = part.iloc[0]
    tests = part[part["mark"] == "test"]
    style.panel_title(ax, str(first["title"]), str(first["detail"]))
    ax.set_xlabel(str(first["axis"]))
    ax.set_ylabel(str(first["y_axis"]))
    reach = 1.15 * float(np.quantile(np.abs(tests["y"]), 0.99))
    ax.set_ylim(-reach, reach)
    if names is not None:
        ax.set_xticks(names["x"], names["x_name"])
        if names["x_name"].str.len().sum() > 24:
            for label in ax.get_xticklabels():
                label.set(rotation=40, ha="right", rotation_mode="anchor", fontsize=6.5)
        ax.set_xlim(-0.6, float(names["x"].max()) + 0.6)
    elif str(first["axis"]) in LOGARITHMIC_AXES:
        ax.set_xscale("log")
        style.plain_log_axis(ax.xaxis, tests["x"])


def _residual_legend(numbers: pd.DataFrame) -> list[Any]:
    tests = numbers[numbers["mark"] == "test"]
    shown = tests.drop_duplicates("sample_number").sort_values("sample_number")
    marks = [(str(row["sample"]), style.sample_mark(int(row["sample_number"]))) for row in shown.to_dict("records")]
    handles: list[Any] = [
        Line2D([], [], color=colour, marker=marker, lw=0, ms=3.5, label=name) for name, (colour, marker) in marks
    ]
    handles.append(Line2D([], [], color="black", marker="o", lw=0.9, ms=3.4, label="mean ± 2 SE"))
    handles.append(Patch(color="0.75", alpha=0.5, lw=0, label="± 2 SD of a mean, expected"))
    if (numbers["mark"] == "curve").any():
        handles.append(Line2D([], [], color=style.VERMILLION, lw=1.6, label="contribution of the named mechanism"))
    return handles


FINDING_COLUMNS = ["regime", "axis", "group", "mark", "sample", "test_id", "x", "x_name", "y", "y_low", "y_high"]
BY_SAMPLE = ("area_fraction", "rim_per_m", "elongation", "clip_N", "sample", "tau0")
RECORDED = {
    "speed_m_s": "speed_mm_s", "elapsed_s": "started_at", "clock_h": "time of day", "pressure_Pa": "normal_load_N",
    "contact_pressure_Pa": "normal_load_N",
}  # fmt: skip
WIDTH_MM, HEIGHT_MM = 130.0, 66.0
MOST_GROUPS = 4
LETTERS_ACROSS = 20  # of names below a panel, above which they are turned


def finding_numbers(d: Diagnosis) -> pd.DataFrame:
    """100 (measured / model - 1) of every test, against the column that the finding follows.

    The model is the one calibrated on the flat sample alone. ``mark`` is test; mean, of a value of the column, with
    twice its standard error; band, two standard deviations of such a mean by the fitted noise; curve, what the named
    causes add. The column is that of the cause that acts most, else that of the first law or misfit, else the sample.
    A law of two columns is shown against the first, ``group`` being the lowest and the highest third of the second.
    """
    from tribo.diagnostics.fit import residual_on_flat

    o = d.baseline.setup.observations
    column = _column(d)
    here = np.isfinite(column.values)
    residual = residual_on_flat(d.baseline)
    groups = _thirds(d)
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
        added = added_by_causes(d, residual, weight)
        for group, tests in groups.items():
            rows += [common | {"group": group} | row for row in summaries(d, column, here & tests, y, weight, added)]
    return pd.DataFrame(rows, columns=FINDING_COLUMNS).fillna({"group": ""})


def _thirds(d: Diagnosis) -> dict[str, np.ndarray]:
    """The tests at the lowest and at the highest third of the second column of the law that was found; all tests where
    the finding is of one column."""
    every = np.ones(d.baseline.setup.observations.n, bool)
    columns = _law_columns(d)
    if len(columns) < 2 or d.verdict.verdict != "unknown":
        return {"": every}
    second = covariate(d.baseline.setup, RECORDED.get(columns[1], columns[1]))
    words, x = described(second.name), second.values
    name = words.short or second.name
    if second.names:
        return {f"{name} {value}": x == place for place, value in enumerate(second.names[:MOST_GROUPS])}
    low, high = np.nanquantile(x, (1 / 3, 2 / 3))
    ends = x[x <= low].max(), x[x >= high].min()
    return {
        f"{name} up to {plain(ends[0])} {words.unit}".rstrip(): x <= low,
        f"{name} from {plain(ends[1])} {words.unit}".rstrip(): x >= high,
    }


def _law_columns(d: Diagnosis) -> tuple[str, ...]:
    """The columns of the first law that was found."""
    found = (getattr(layer.shows, "law", None) for layer in d.verdict.layers if layer.kind == "law")
    return next((tuple(law.columns) for law in found if law is not None), ())


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
        m = acting.mechanism
        followed = [m.column(acting.choice)] if acting.choice or m.choosing.column else list(m.needs)
    else:
        followed = [*_law_columns(d)[:1]] or [m.covariate for m in d.verdict.misfits[:1]]
    if any(name in BY_SAMPLE for name in followed):
        return ["sample"]
    return [RECORDED.get(name, name) for name in followed]


def _axis_name(column: Covariate) -> str:
    return {"sample": "Sample", "specimen": "Specimen"}.get(column.name, column.axis)


@style.in_house_style
def draw_finding(numbers: pd.DataFrame) -> Figure:
    """Static at the left, sliding at the right, one scale; on the line at zero the model is right."""
    regimes = [r for r in REGIMES if (numbers["regime"] == r).any()]
    figure = style.page_figure(HEIGHT_MM)
    figure.set_figwidth(min(WIDTH_MM, style.page_mm()) / style.MM_PER_INCH)
    axes = np.atleast_1d(figure.subplots(1, len(regimes), sharey=True))
    for ax, regime in zip(axes, regimes, strict=True):
        _finding_panel(ax, numbers[numbers["regime"] == regime])
        style.panel_title(ax, f"{regime.capitalize()} friction")
    axes[0].set_ylabel("measured / model − 1 (%)")
    ends = numbers[["y", "y_low", "y_high"]].to_numpy(float)[(numbers["mark"] != "test").to_numpy()]
    tests = numbers.loc[numbers["mark"] == "test", "y"]
    low, high = min(np.nanmin(ends), tests.quantile(0.01), 0.0), max(np.nanmax(ends), tests.quantile(0.99), 0.0)
    room = 0.06 * (high - low)
    axes[0].set_ylim(low - room, high + room)
    style.legend_below(figure, _finding_legend(numbers), columns=4)
    return figure


def _finding_panel(ax: Axes, part: pd.DataFrame) -> None:
    tests, mean = part[part["mark"] == "test"], part[part["mark"] == "mean"]
    named = bool(tests["x_name"].any())
    groups = list(dict.fromkeys(mean["group"]))
    band, curve = (part[part["mark"] == mark].sort_values("x").astype({"x": float}) for mark in ("band", "curve"))
    if named:
        ax.bar(band["x"], band["y_high"] - band["y_low"], 0.8, band["y_low"], color="0.75", alpha=0.45, lw=0)
        ax.hlines(curve["y"], curve["x"] - 0.4, curve["x"] + 0.4, color=style.VERMILLION, lw=1.8, zorder=4)
    else:
        ax.fill_between(band["x"], band["y_low"], band["y_high"], color="0.75", alpha=0.45, lw=0)
        ax.plot(curve["x"], curve["y"], "-", color=style.VERMILLION, lw=1.8, zorder=4)
        ax.plot(tests["x"], tests["y"], "o", color="0.5", ms=1.6, alpha=0.5, mew=0)
    for number, group in enumerate(groups):
        own = mean[mean["group"] == group]
        bars = np.abs(own[["y_low", "y_high"]].to_numpy(float) - own[["y"]].to_numpy(float)).T
        colour = _colour(number, len(groups))
        ax.errorbar(own["x"], own["y"], bars, fmt="o", ms=3.6, color=colour, elinewidth=1.0, zorder=5)
    ax.axhline(0, color="0.4", lw=0.8)
    _finding_axis(ax, part, named)


def _finding_axis(ax: Axes, part: pd.DataFrame, named: bool) -> None:
    axis = str(part["axis"].iloc[0])
    ax.set_xlabel(axis)
    tests = part[part["mark"] == "test"]
    if named:
        names = tests.drop_duplicates("x").sort_values("x")
        ax.set_xticks(names["x"], names["x_name"])
        if names["x_name"].str.len().sum() > LETTERS_ACROSS * min(style.page_mm() / WIDTH_MM, 1.0):
            for label in ax.get_xticklabels():
                label.set(rotation=90, fontsize=6)
        ax.set_xlim(-0.6, float(names["x"].max()) + 0.6)
    elif axis in LOGARITHMIC_AXES:
        ax.set_xscale("log")
        style.plain_log_axis(ax.xaxis, tests["x"])
        ax.tick_params(axis="x", labelsize=6.5)


def _colour(number: int, groups: int) -> str:
    return "black" if groups == 1 else (style.BLUE, style.VERMILLION, "black", "0.5")[number]


def _finding_legend(numbers: pd.DataFrame) -> list[Any]:
    groups = list(dict.fromkeys(numbers.loc[numbers["mark"] == "mean", "group"]))
    handles: list[Any] = [
        Line2D([], [], color=_colour(k, len(groups)), marker="o", lw=1.0, ms=3.6, label=group or "mean ± 2 SE")
        for k, group in enumerate(groups)
    ]
    handles.append(Patch(color="0.75", alpha=0.6, lw=0, label="expected if the model is right"))
    if (numbers["mark"] == "curve").any():
        handles.append(Line2D([], [], color=style.VERMILLION, lw=1.8, label="named cause"))
    return handles


FINDING = style.FigureOf(
    "finding",
    "What was found",
    "Difference of measured from modelled friction, in percent, against the quantity that it follows. The model is "
    "calibrated on the flat sample. Points "
    "with bars: geometric means with twice their standard error. Band: range of 95 % of such means if the model were "
    "right. Thick line, if a cause is named: what it adds. Small points, if shown: tests. A law of two quantities is "
    "shown at the lowest and the highest third of the second.",
    finding_numbers,
    draw_finding,
)
RESIDUALS = style.FigureOf(
    "residuals",
    "The strongest deviations",
    "Difference of measured from modelled friction, in percent, against the recorded variable with which it varies "
    "most strongly; if no deviation is significant, against the three variables that come closest. Small points: "
    "tests; points with bars: geometric means with twice their standard error. Band: range of 95 % of such means if "
    "the model were right, given the scatter of repeats and specimens and the error of the model: the stated one for "
    "the means of the samples, else that which the samples of this campaign show. Thick line: contribution of the "
    "identified mechanism.",
    residual_numbers,
    draw_residuals,
)
