"""What is left once the model is extended: by the named mechanism, and by the laws that were found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tribo.comparison import findings
from tribo.diagnostics.effect_sizes import percent, rms_percent
from tribo.diagnostics.model import effect_of
from tribo.figures import style
from tribo.lawsearch.grammar import LOAD_TERM, UNITS, WrittenLaw, column_values
from tribo.lawsearch.model_choice import centred
from tribo.lawsearch.scoring import terms_of
from tribo.records import REGIMES
from tribo.vocabulary import in_words

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis
    from tribo.lawsearch.model_choice import FoundLaw
    from tribo.lawsearch.search import Discovery


EXTENDED_COLUMNS = [
    "sample_number", "sample", "regime", "normal_load_N", "model", "residual_percent", "low_percent", "high_percent",
    "rms_percent", "n_tests",
]  # fmt: skip
MODELS = {"before": "calibrated model", "after": "extended model", "simulated": "extended model, simulation"}
LOOKS: dict[str, dict[str, Any]] = {
    "before": {"marker": "o", "mfc": "white", "color": "0.45", "ls": ":"},
    "after": {"marker": "s", "color": style.BLUE, "ls": "-"},
    "simulated": {"marker": "D", "color": style.VERMILLION, "ls": ""},
}
SHIFT_POINTS = {"before": -2.0, "after": 0.0, "simulated": 2.0}


def extended_numbers(d: Diagnosis) -> pd.DataFrame:
    """Mean residual, 100 (measured / model - 1), of each sample, regime and load, before and after.

    ``low`` to ``high`` are two standard errors of the mean over tests; ``rms_percent`` is the root mean square over
    all tests of the panel. "simulated" is the spring-block model itself with the mechanism in it, where it was run.
    Empty where no mechanism extends the model.
    """
    if d.named is None or not d.named.causes or d.verdict.verdict == "unknown":
        return pd.DataFrame(columns=EXTENDED_COLUMNS)
    f = d.baseline
    o = f.setup.observations
    residuals = {"before": f.residual, "after": d.named.model.residual}
    if d.simulated_log_force is not None:
        residuals["simulated"] = o.log_force - d.simulated_log_force
    levels = findings.load_levels(o.conditions.normal_load_N)
    samples = o.samples
    rows = [
        {
            "sample_number": number, "sample": sample, "regime": regime, "normal_load_N": float(load), "model": model,
            **_spread(residual[here & (levels == load), k], residual[here, k]),
        }
        for k, regime in enumerate(REGIMES)
        for number, sample in enumerate(samples)
        for here in [o.conditions.sample == sample]
        for load in np.unique(levels[here])
        for model, residual in residuals.items()
    ]
    return pd.DataFrame(rows, columns=EXTENDED_COLUMNS)


def _spread(at_load: np.ndarray, panel: np.ndarray) -> dict[str, Any]:
    """Mean of the residuals at a load with twice its standard error, and the root mean square of those of a panel."""
    values = percent(at_load)
    values = values[np.isfinite(values)]
    mean = float(values.mean()) if len(values) else float("nan")
    error = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")
    return {
        "residual_percent": mean, "low_percent": mean - 2 * error, "high_percent": mean + 2 * error,
        "rms_percent": rms_percent(panel), "n_tests": len(values),
    }  # fmt: skip


@style.in_house_style
def draw_extended(numbers: pd.DataFrame) -> Figure:
    """Static above sliding for every sample, a few samples to a row; on the line at zero the model is right."""
    samples = style.by_sample(numbers)
    across = style.across(len(samples) if len(samples) <= 4 else 3 if len(samples) <= 6 else 4)
    deep = -(-len(samples) // across)
    figure, axes = style.panel_grid(2 * deep * across, 40, columns=across, sharex=True, sharey=True)
    for k in range(deep * across):
        row, column = divmod(k, across)
        pair = [axes[(2 * row + below) * across + column] for below in range(len(REGIMES))]
        for ax, regime in zip(pair, REGIMES, strict=True):
            if k >= len(samples):
                ax.remove()
                continue
            part = samples[k][1]
            cell = part[part["regime"] == regime]
            _extended_panel(ax, cell)
            style.panel_title(ax, str(part["sample"].iloc[0]) if ax is pair[0] else "", _rms(cell))
            style.plain_log_axis(ax.xaxis, numbers["normal_load_N"])
            ax.tick_params(axis="x", labelsize=6, rotation=90, labelbottom=ax is pair[-1])
            ax.set_xlabel("Load N (N)" if ax is pair[-1] else "")
            if style.is_leftmost(ax):
                ax.set_ylabel(f"{regime} friction")
    figure.supylabel("measured / model − 1 (%)", fontsize=8)
    shown = [m for m in MODELS if (numbers["model"] == m).any()]
    handles: list[Any] = [Line2D([], [], ms=3.2, lw=0.9, label=f"{MODELS[m]}, ± 2 SE", **LOOKS[m]) for m in shown]
    style.legend_below(figure, handles)
    return figure


def _extended_panel(ax: Axes, cell: pd.DataFrame) -> None:
    ax.set_xscale("log")
    ax.axhline(0, color="0.4", lw=0.8)
    for model, part in cell.groupby("model"):
        bars = np.abs(part[["low_percent", "high_percent"]].to_numpy() - part[["residual_percent"]].to_numpy()).T
        style.cover(ax, part["normal_load_N"], part["low_percent"], part["high_percent"])
        ax.errorbar(
            part["normal_load_N"], part["residual_percent"], bars, ms=3.0, lw=0.9, elinewidth=0.7, capsize=1.2,
            transform=style.moved_aside(ax, SHIFT_POINTS[str(model)]), **LOOKS[str(model)],
        )  # fmt: skip


def _rms(cell: pd.DataFrame) -> str:
    """Root mean square before and after."""
    rms = cell.groupby("model")["rms_percent"].first()
    return "rms " + " → ".join(f"{rms[m]:.0f}" for m in MODELS if m in rms.index) + " %"


LAW_COLUMNS = [
    "law_number", "formula", "regime", "sample", "covariate", "x", "x_name", "partial_percent", "law_percent",
    "low_percent", "high_percent",
]  # fmt: skip
STRETCHES = 24  # of the column, whose means are drawn


def law_numbers(d: Diagnosis) -> pd.DataFrame:
    """The laws of a diagnosis as :func:`law_numbers_of`; empty where it has none."""
    return law_numbers_of(d.laws) if d.laws is not None else pd.DataFrame(columns=LAW_COLUMNS)


def law_numbers_of(found: Discovery) -> pd.DataFrame:
    """One row per law, regime and test that the law acts on and whose columns were recorded, in percent of T.

    ``partial_percent`` is what the model without the law leaves of a test, ``law_percent`` the law, both about the mean
    of the law over these tests. The 90 % band is that of what friction does there, which a formula may leave.
    ``x`` is the column of the law, or the product of its two shapes; ``x_name`` the name in a column of names.
    """
    parts = [_of_law(number, law) for number, law in enumerate(found.laws, start=1)]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=LAW_COLUMNS)


def _of_law(number: int, found: FoundLaw) -> pd.DataFrame:
    s, law = found.model.setup, found.law
    c = s.observations.conditions
    left = found.model.left
    change = effect_of(s, found.model.law, found.model.acting[-1], found.model.values[-1])
    _, low, high = found.band - centred(change, c, terms_of(found.model)[LOAD_TERM])
    x, names = _abscissa(found)
    acts = law.weight(c) != 0
    for name in law.columns:
        acts = acts & ~c.not_recorded(name)
    parts = []
    for k in (k for k, regime in enumerate(REGIMES) if law.regime in (regime, "both")):
        course = change[acts, k] - change[acts, k].mean()
        part = {
            "law_number": number, "formula": law.formula(), "regime": REGIMES[k], "sample": c.sample[acts],
            "covariate": _label(law), "x": x[acts], "x_name": names[acts],
            "partial_percent": percent(left[acts, k] + course), "law_percent": percent(course),
            "low_percent": percent(course + low[acts, k]), "high_percent": percent(course + high[acts, k]),
        }  # fmt: skip
        parts.append(pd.DataFrame(part))
    return pd.concat(parts, ignore_index=True)[LAW_COLUMNS]


def _abscissa(found: FoundLaw) -> tuple[np.ndarray, np.ndarray]:
    """Numbers to draw a law over, (n,), and their names where the column holds names."""
    law, c = found.law, found.model.setup.observations.conditions
    nameless = np.full(len(c.sample), "")
    if len(law.shapes) > 1:
        return law.course(c)[:, 0], nameless
    if law.shapes[0].level or isinstance((law.shapes[0].values or (0.0,))[0], str):
        names = c.columns[law.columns[0]]
        return np.unique(names, return_inverse=True)[1].astype(float), names
    return column_values(c, law.columns[0]), nameless


def _label(law: WrittenLaw) -> str:
    if law.shapes[0].kind == "surface":
        return f"surface of {' and '.join(_name(column).lower() for column in law.columns)} (from lowest to highest)"
    if len(law.shapes) > 1:
        return f"{' × '.join(map(_name, law.columns))} (1: both at their highest)"
    unit = UNITS.get(law.columns[0], "")
    return _name(law.columns[0]) + (f" ({unit})" if unit else "")


def _name(column: str) -> str:
    return in_words(column).removeprefix("the ").capitalize() if in_words(column) != column else column


@style.in_house_style
def draw_law(numbers: pd.DataFrame) -> Figure:
    """One panel per law and regime: tests, means over stretches of the column, the law and its band."""
    panels = list(numbers.groupby(["law_number", "regime"], sort=False))
    figure, axes = style.panel_grid(len(panels), 62, columns=min(len(panels), 2))
    for ax, ((number, regime), part) in zip(axes, panels, strict=True):
        _law_panel(ax, part)
        style.panel_title(ax, f"Law {number}", f"{regime} friction")
        ax.set_ylabel("change of T (%)")
        ax.set_xlabel(str(part["covariate"].iloc[0]))
    handles = [
        Line2D([], [], ls="", marker=".", color="0.6", label="tests"),
        Line2D([], [], ls="", marker="o", color=style.BLACK, ms=3.2, label="means with 2 SE"),
        Line2D([], [], color=style.VERMILLION, lw=1.2, label="law"),
        Patch(color=style.VERMILLION, alpha=0.25, lw=0, label="90 % band"),
    ]
    style.legend_below(figure, handles)
    return figure


def _law_panel(ax: Axes, part: pd.DataFrame) -> None:
    part = part.dropna(subset=["x"]).sort_values("x")
    ax.axhline(0, color="0.4", lw=0.8)
    ax.plot(part["x"], part["partial_percent"], ".", color="0.6", ms=2.0, zorder=1)
    means = part.groupby(_stretches(part["x"].to_numpy()))[["x", "partial_percent"]].agg(["mean", "std", "count"])
    error = 2.0 * means["partial_percent", "std"] / np.sqrt(means["partial_percent", "count"])
    ax.errorbar(
        means["x", "mean"], means["partial_percent", "mean"], error, fmt="o", color=style.BLACK, ms=3.2, elinewidth=0.8,
        zorder=3,
    )  # fmt: skip
    law = part.groupby("x")[["law_percent", "low_percent", "high_percent"]].mean()
    ax.fill_between(law.index, law["low_percent"], law["high_percent"], color=style.VERMILLION, alpha=0.25, lw=0)
    ax.plot(law.index, law["law_percent"], color=style.VERMILLION, lw=1.2, zorder=2)
    if (part["x_name"] != "").any():
        named = part.groupby("x")["x_name"].first()
        ax.set_xticks(list(named.index), list(named))


def _stretches(x: np.ndarray) -> np.ndarray:
    """The stretch of every value: each distinct value, or stretches with alike many tests."""
    if len(np.unique(x)) <= STRETCHES:
        return np.unique(x, return_inverse=True)[1]
    return np.searchsorted(np.quantile(x, np.arange(1, STRETCHES) / STRETCHES), x)


EXTENDED = style.FigureOf(
    "extended",
    "Model before and after its extension",
    "Mean of 100 (measured / model − 1) at each load, for the model "
    "calibrated on the flat sample and for the model extended by the identified mechanism, both fitted in the "
    "same way; where available, also for a spring-block simulation that includes the mechanism. Above each "
    "panel: root mean square over all its tests. The verdict states the improvement on tests not used in the "
    "fit.",
    extended_numbers,
    draw_extended,
)
LAW = style.FigureOf(
    "law",
    "Laws that the remaining misfit follows",
    "Change of T over the column of each law that was found. Small points: what the model without the law "
    "leaves of each test; points with bars: means over stretches of the column with twice their standard "
    "error. Line: the law with its 90 % band, which is averaged over all forms in proportion to their "
    "evidence. Both are about the mean of the law. Of a product of two columns, the horizontal axis is the "
    "product of its two shapes.",
    law_numbers,
    draw_law,
)
