"""Where the calibrated model fails: percent by sample and recorded column, with significant deviations marked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm, to_rgb
from matplotlib.figure import Figure

from tribo.diagnostics.effect_sizes import bend_percent, change_percent, mean_percent, percent
from tribo.figures import style
from tribo.records import FloatArray
from tribo.vocabulary import axis_label, short_label
from tribo.wording.numerals import signed

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis
    from tribo.diagnostics.fit import ModelFit
    from tribo.diagnostics.model import Setup
    from tribo.diagnostics.verdict import Layer


BEND = "bend"  # the square of ln N: whether T(N) bends
LOGARITHMIC = ("normal_load_N", "speed_mm_s", "hold_s")
LOGARITHMIC_AXES = tuple(map(axis_label, LOGARITHMIC))
MOST_LABEL = 16


@dataclass(frozen=True)
class Covariate:
    """A recorded column. ``values`` (n,) are numbers, or places in ``names`` where the column is text."""

    name: str
    values: FloatArray
    names: tuple[str, ...] = ()

    @property
    def score(self) -> FloatArray:
        """What a residual is regressed on: the logarithm of loads, speeds and holds, else the values."""
        if self.name == BEND:
            logs = np.log(self.values)
            return np.asarray((logs - 0.5 * (logs.min() + logs.max())) ** 2)
        return np.log(self.values) if self.name in LOGARITHMIC else self.values

    @property
    def label(self) -> str:
        """A short name for a table."""
        text = short_label(self.name)
        return text if len(text) <= MOST_LABEL else f"{text[: MOST_LABEL - 1]}…"

    @property
    def axis(self) -> str:
        """A name with unit for an axis."""
        return axis_label(self.name)


def mechanism_label(name: str) -> str:
    """The plain name of a mechanism without its article; of one that follows any column, that column."""
    from tribo.wording.part_sentences import name_in_words

    column = name.partition(":")[2]
    plain = f"dependence on {short_label(column)}" if column else name_in_words(name)
    return plain.removeprefix("a ").removeprefix("an ")


def covariates(s: Setup) -> list[Covariate]:
    """The mean, the load and the bend with it, and every recorded column that varies; of text those of two names."""
    from tribo.diagnostics.contrasts import numeric_covariates

    c, n = s.observations.conditions, s.observations.n
    found = [Covariate("mean", np.ones(n)), Covariate("normal_load_N", c.normal_load_N)]
    found.append(Covariate(BEND, c.normal_load_N))
    found += [covariate(s, name) for name in numeric_covariates(s)]
    for name, column in c.columns.items():
        names = np.unique(column)
        if len(names) == 2 and name not in {f.name for f in found}:
            found.append(covariate(s, name))
    return found


def covariate(s: Setup, name: str) -> Covariate:
    """One column by the name that the diagnosis gives it; text columns as places in their names."""
    o, c = s.observations, s.observations.conditions
    known = {
        "normal_load_N": c.normal_load_N, "specimen_run": c.specimen_run, "run_order": c.run_order,
        "started_at": c.elapsed_s / 3600.0, "time of day": o.clock_h, "temperature_C": c.recorded("temperature_C"),
        "humidity_pct": c.recorded("humidity_pct"), "speed_mm_s": c.recorded("speed_m_s") * 1e3,
        "hold_s": c.recorded("hold_s"),
    }  # fmt: skip
    if name in known:
        return Covariate(name, known[name])
    column = {"sample": c.sample, "specimen": c.specimen, **c.columns}[name]
    try:
        return Covariate(name, np.asarray(column, float))
    except ValueError:
        names = sorted(set(map(str, column)), key=lambda text: (name == "sample" and text != o.flat, text))
        places = {text: float(place) for place, text in enumerate(names)}
        return Covariate(name, np.array([places[str(text)] for text in column]), tuple(names))


COLUMNS = ["observable", "row", "covariate", "label", "effect_percent", "strength", "p_adjusted", "mark"]
ALL = "all samples"
REGIMES = {"both": (0.5, 0.5), "static": (1.0, 0.0), "sliding": (0.0, 1.0), "drop": (1.0, -1.0)}
PATTERNS = {**REGIMES, "both": (1.0, 1.0)}  # what a contrast would follow in the two regimes
TITLES = {
    "both": "Static and sliding together", "static": "Static friction", "sliding": "Sliding friction",
    "drop": "Drop from static to sliding", "trace": "Other features of the traces",
}  # fmt: skip
MARKS = ((0.01, "**"), (0.05, "*"))  # adjusted p below which a cell is marked
LEAST_PERCENT, MOST_PERCENT = 10.0, 60.0  # ends of the colour scale
STRONGEST = 0.55  # opacity at the ends of the scale: numbers in black and in white are read on it
DIVERGING = LinearSegmentedColormap.from_list(
    "misfit",
    [(0.0, (*to_rgb(style.BLUE), STRONGEST)), (0.5, (*to_rgb(style.BLUE), 0.0)),
     (0.5, (*to_rgb(style.VERMILLION), 0.0)), (1.0, (*to_rgb(style.VERMILLION), STRONGEST))], N=40,
)  # fmt: skip
CELL_MM, HEAD_MM, FOOT_MM = 4.3, 7.0, 20.0
MARGINS_MM, LEAST_CELL_MM = 32.0, 9.0
FAINT = 0.35  # how strongly a cell is coloured that chance explains


def misfit_numbers(d: Diagnosis) -> pd.DataFrame:
    """Change of measured / modelled T from the low to the high end of each covariate, for each sample and observable.

    The model is the one calibrated on the flat sample alone. The column "mean" is the geometric mean over a sample of
    measured over modelled T, less one, in percent; the flat sample has neither a mean nor a change with load, since the
    calibration absorbs both, but where the verdict tells of its mean beside a cause.
    ``strength`` is the signed score in standard deviations once the flat law, the model's own error of a sample
    and the specimens are taken out; ``p_adjusted`` sets it against the strongest contrast of simulated campaigns. The
    size and the p of a mean are those of the verdict where the patterned samples differ from the model by more than its
    stated error, or where it is a misfit beside the causes; of both regimes together the geometric mean and the
    larger p.
    Tests without a value of a covariate do not count in its cells. The observable "trace" has the change of the zero
    (of the median sliding force), of the slope of the rise and of the stick-slip amplitude, with the p value of a rank
    correlation, adjusted for the number of cells.
    """
    from tribo.diagnostics.fit import residual_on_flat

    columns = covariates(d.baseline.setup)
    residual = residual_on_flat(d.baseline)
    rows = [_cells(d, columns, observable, residual @ np.array(weight)) for observable, weight in REGIMES.items()]
    return pd.DataFrame([*(cell for part in rows for cell in part), *_trace_cells(d, columns)], columns=COLUMNS)


def _cells(d: Diagnosis, columns: list[Covariate], observable: str, residual: FloatArray) -> list[dict[str, Any]]:
    f, flat = d.baseline, d.baseline.setup.observations.flat
    sample = f.setup.observations.conditions.sample
    samples = sorted(set(sample.tolist()), key=lambda s: (s != flat, s))
    taken_up = {ALL: ("mean",), flat: ("mean", "normal_load_N")}  # by the flat law and the model's error of a sample
    told = _told_means(d)
    cells, shapes = [], []
    for row in (*samples, ALL):
        of_row = np.ones(len(sample), bool) if row == ALL else sample == row
        for column in columns:
            here = of_row & np.isfinite(column.score)
            if column.name in taken_up.get(row, ()) and not (column.name == "mean" and (row, observable) in told):
                continue
            shape = _shape(column, here)
            if np.ptp(shape) <= 1e-9:
                continue
            cells.append((row, column, _end_to_end(column, residual[here], here)))
            shapes.append(shape)
    strength = _strengths(f, np.column_stack(shapes), observable)
    found = []
    for (row, column, effect), z in zip(cells, strength, strict=True):
        p = d.screened.p_adjusted(abs(float(z)))
        if column.name == "mean" and observable != "drop":
            about = [r for r in ("static", "sliding") if observable in (r, "both")]
            known = [told[row, r] for r in about if (row, r) in told]
            if len(known) == len(about):
                p = max(chance for chance, _ in known)
                effect = float(percent(np.mean([np.log1p(size / 100.0) for _, size in known])))
        found.append(_cell(observable, row, column, effect, float(z), p))
    return found


def _told_means(d: Diagnosis) -> dict[tuple[str, str], tuple[float, float]]:
    """The p value and the size of the mean difference of a sample and regime, where the verdict tells them: as one of
    the patterned samples, or as a misfit that is left beside the causes."""
    of_misfits = {
        (m.sample, m.observable): (m.p_adjusted, m.effect_percent)
        for m in d.verdict.misfits if m.covariate == "sample" and m.observable in ("static", "sliding")
    }  # fmt: skip
    of_patterns = {(c.name, r): (c.p_adjusted, c.effect_percent) for c in pattern_differences(d) for r in c.regimes}
    return of_misfits | of_patterns


def pattern_differences(d: Diagnosis) -> list[Layer]:
    """The mean difference of every patterned sample and regime from the model, where the verdict says that these differ
    by more than the error that is stated for the model; else none."""
    excess = getattr(d.verdict.shows, "excess", None)
    return [c for c in d.verdict.layers if c.kind == "pattern_correction"] if excess is not None else []


def _shape(column: Covariate, here: np.ndarray) -> FloatArray:
    """What the residuals of the tests ``here`` would follow, without their mean, and zero elsewhere."""
    score = column.score
    if column.name == "mean":
        return here.astype(float)
    ground = [np.ones(here.sum())]
    if column.name == BEND:
        ground.append(np.log(column.values[here]))
    span = np.column_stack(ground)
    shape = np.zeros(len(score))
    shape[here] = score[here] - span @ np.linalg.lstsq(span, score[here], rcond=None)[0]
    return shape


def _end_to_end(column: Covariate, residual: FloatArray, here: np.ndarray) -> float:
    """The mean of a sample; or by how much a straight line rises from the 5 % to the 95 % quantile; in percent."""
    if column.name == "mean":
        return mean_percent(residual)
    x = column.score[here]
    if column.name == BEND:  # beside a straight line in ln N: how far the ends lie above the middle
        return bend_percent(x, np.log(column.values[here]), residual)
    return change_percent(x, residual)


def _strengths(f: ModelFit, shapes: FloatArray, observable: str) -> FloatArray:
    """Signed score of every shape (n, k) in one observable, as the diagnosis itself judges its contrasts."""
    stacked = shapes[:, None, :] * np.array(PATTERNS[observable])[None, :, None]
    left, target = f.cleared(stacked)
    length = np.sqrt(np.sum(left**2, axis=0))
    return np.asarray(left.T @ target / np.maximum(length, 1e-9))


def _cell(observable: str, row: str, column: Covariate, effect: float, strength: float, p: float) -> dict[str, Any]:
    mark = next((mark for level, mark in MARKS if p < level), "")
    return {
        "observable": observable, "row": row, "covariate": column.name, "label": column.label,
        "effect_percent": effect, "strength": strength, "p_adjusted": p, "mark": mark,
    }  # fmt: skip


def _trace_cells(d: Diagnosis, columns: list[Covariate]) -> list[dict[str, Any]]:
    """Changes of what the traces show besides the forces, each with the p value of its rank correlation."""
    from scipy.stats import spearmanr

    found = []
    for name, values in _trace_observables(d).items():
        for column in columns:
            good = np.isfinite(values) & np.isfinite(column.score)
            x = column.score[good]
            if column.name in ("mean", "normal_load_N", BEND) or good.sum() < 12:
                continue
            if min(np.ptp(x), np.ptp(values[good])) <= 1e-9:
                continue
            rho, p = spearmanr(x, values[good])
            slope = np.polyfit(x, values[good], 1)[0]
            change = float(slope * (np.quantile(x, 0.95) - np.quantile(x, 0.05)))
            effect = 100.0 * change if name == "zero" else float(percent(change))  # the others are logarithms
            found.append((name, column, effect, float(rho) * np.sqrt(good.sum() - 1), float(p)))
    return [_cell("trace", name, c, effect, z, min(1.0, p * len(found))) for name, c, effect, z, p in found]


def _trace_observables(d: Diagnosis) -> dict[str, FloatArray]:
    """Per test, as a share: zero of the median sliding force; rise and stick-slip of their median at that load."""
    o = d.baseline.setup.observations
    groups = [f"{s} {n:.4g}" for s, n in zip(o.conditions.sample, o.conditions.normal_load_N, strict=True)]

    def centred(values: FloatArray) -> FloatArray:
        logs = pd.Series(np.log(np.where(values > 0, values, np.nan)))
        return np.asarray(logs - logs.groupby(groups).transform("median"))

    sliding = float(np.exp(np.median(o.log_force[:, 1])))
    return {"zero": o.zero_N / sliding, "rise": centred(o.rise_N_per_m), "stick-slip": centred(o.stick_slip_N)}


@style.in_house_style
def draw_misfit(numbers: pd.DataFrame) -> Figure:
    """One panel an observable, rows the samples, columns the covariates, one colour scale."""
    panels = [(name, part) for name in TITLES if len(part := numbers[numbers["observable"] == name])]
    of_most = numbers.groupby(["observable", "row"])["covariate"].transform("size")  # the flat sample has no mean
    labels = (
        numbers.iloc[np.argsort(-of_most, kind="stable")].drop_duplicates("covariate").set_index("covariate")["label"]
    )
    heights = [part["row"].nunique() for _, part in panels]
    # a page that is too narrow for all columns has them in blocks, one below the other
    narrow = style.page_mm() < style.PAGE_MM
    side_by_side = max(1, int((style.page_mm() - MARGINS_MM) // LEAST_CELL_MM)) if narrow else len(labels)
    blocks = np.array_split(np.arange(len(labels)), -(-len(labels) // side_by_side))
    block_mm = CELL_MM * sum(heights) + HEAD_MM * len(panels) + FOOT_MM
    figure = style.page_figure(block_mm * len(blocks))
    every = np.atleast_1d(figure.subplots(len(panels) * len(blocks), 1, height_ratios=heights * len(blocks)))
    reach = float(np.clip(numbers["effect_percent"].abs().quantile(0.98), LEAST_PERCENT, MOST_PERCENT))
    norm = TwoSlopeNorm(0.0, -reach, reach)
    for axes, block in zip(np.split(every, len(blocks)), blocks, strict=True):
        shown = labels.iloc[block]
        for ax, (name, part) in zip(axes, panels, strict=True):
            _draw_panel(ax, part, list(shown.index), norm)
            style.panel_title(ax, TITLES[name])
        for ax in axes[:-1]:
            ax.tick_params(labelbottom=False)
        axes[-1].set_xticks(np.arange(len(shown)) + 0.5, list(shown), rotation=25, ha="right", rotation_mode="anchor")
    scale = ScalarMappable(norm, DIVERGING)
    bar = figure.colorbar(scale, ax=list(every), shrink=0.6, pad=0.015, aspect=35, extend="both")
    bar.set_label("100 (measured / model − 1), or its change (%)")
    bar.outline.set_visible(False)
    return figure


def _draw_panel(ax: Axes, part: pd.DataFrame, covariates: list[str], norm: TwoSlopeNorm) -> None:
    """Cells that chance explains are faint, so that the eye goes to the others; paper shows through all of them."""
    rows = list(dict.fromkeys(part["row"]))
    cells, colours = [], []
    for cell in part[part["covariate"].isin(covariates)].to_dict("records"):
        i, j, percent = rows.index(cell["row"]), covariates.index(cell["covariate"]), float(cell["effect_percent"])
        strong = bool(cell["mark"])
        ax.text(
            j + 0.5, i + 0.5, f"{_signed(percent)}{cell['mark']}", ha="center", va="center", fontsize=6.5,
            fontweight="bold" if strong else "normal", color="black" if strong else "0.35",
        )  # fmt: skip
        cells.append([(j, i), (j + 1, i), (j + 1, i + 1), (j, i + 1)])
        *colour, opacity = DIVERGING(norm(percent)) if np.isfinite(percent) else (0.5, 0.5, 0.5, 0.0)
        colours.append((*colour, opacity if strong else FAINT * opacity))
    ax.add_collection(PolyCollection(cells, facecolors=colours, edgecolors="0.85", linewidths=0.4))
    ax.set_yticks(np.arange(len(rows)) + 0.5, rows)
    ax.set_xticks([])
    ax.set_xlim(0, len(covariates))
    ax.set_ylim(len(rows), 0)
    style.as_table(ax)


def _signed(percent: float) -> str:
    return signed(percent) if abs(percent) >= 0.5 else "0"


MISFIT = style.FigureOf(
    "misfit",
    "Where the calibrated model fails",
    "Change of measured over modelled friction, in percent, from the low to the high end of each recorded "
    "variable (5 to 95 % of its range), for each sample. Column “mean”: difference of the sample from the model, as a "
    "geometric mean. Column “bend with load”: height of the ends of the load range above "
    "its middle. Strong colours and asterisks (** p < 0.01, * p < 0.05) mark statistically significant deviations. "
    "The p values "
    "are adjusted for all comparisons: each is compared with the strongest deviation in simulated campaigns "
    "of the calibrated model; where the patterned samples differ from the model by more than its stated error, "
    "that of a mean is the p value of this difference, and the other columns are judged beside it. Pale cells are "
    "not significant. Last rows: change of the zero of the force (in "
    "percent of the median sliding force), of the slope of the rise and of the stick-slip amplitude; their p "
    "values are those of rank correlations.",
    misfit_numbers,
    draw_misfit,
)
