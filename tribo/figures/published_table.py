"""A published table and the model: T at loads, and the evidence for each mechanism under each interpretation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tribo.figures import style
from tribo.figures.misfit import mechanism_label
from tribo.records import REGIMES
from tribo.wording.numerals import true_minus

if TYPE_CHECKING:
    from tribo.berardo2019.table_diagnosis import PublishedDiagnosis, TableReading

RATIO_COLUMNS = [
    "sample", "regime", "pressure_kPa", "measured_over_model", "low", "high", "low_independent", "high_independent",
    "recalibrated_over_model", "extended_over_model",
]  # fmt: skip
READING_COLUMNS = [
    "reading", "model", "correlation", "specimens", "outcome", "p_misfit", "p_left", "mechanism", "guess", "gain",
    "parameter", "value", "low", "high", "unit",
]  # fmt: skip
NORMAL_90 = 1.645
BEST_SHOWN = 20.0


def ratio_numbers(d: PublishedDiagnosis) -> pd.DataFrame:
    """T measured over T of the calibrated model at loads (kPa), with 90 % intervals of the measurement.

    ``low`` to ``high`` take the correlation of mu and tau0 of the main reading, ``*_independent`` none.
    ``recalibrated`` is the same model with its flat law fitted to the whole table, ``extended`` with the best
    mechanism on top.
    """
    from tribo.berardo2019.table_model import friction_at

    main = d.main
    table, best = main.baseline.table, main.weighed[0]
    flat = table.values.reshape(-1, 4)[table.samples.index("F")]
    model = friction_at(table, flat)
    measured = table.friction(table.values)
    correlated, independent = _relative_u(main, None), _relative_u(main, 0.0)
    again = friction_at(table, main.baseline.law) / model
    extended = friction_at(table, best.law, best.acting, best.parameters) / model
    rows = []
    for i, sample in enumerate(table.samples):
        for r, regime in enumerate(REGIMES):
            ratio = measured[i, r] / model[i, r]
            for k, pressure in enumerate(table.pressures_kPa):
                a, b = NORMAL_90 * correlated[i, r, k], NORMAL_90 * independent[i, r, k]
                spread = [ratio[k] * np.exp(x) for x in (-a, a, -b, b)]
                rows.append((sample, regime, pressure, ratio[k], *spread, again[i, r, k], extended[i, r, k]))
    return pd.DataFrame(rows, columns=RATIO_COLUMNS)


def _relative_u(result: TableReading, correlation: float | None) -> np.ndarray:
    """Standard uncertainty of measured T over T, (samples, regimes, loads); ``correlation`` None as in the reading."""
    table = result.baseline.table
    blocks = table.data_covariance.reshape(len(table.samples) * 2, 2, -1, 2)
    cov = np.array([blocks[k, :, k, :] for k in range(len(blocks))])
    if correlation is not None:
        cov = cov * np.eye(2) + correlation * np.sqrt(cov[:, :1, :1] * cov[:, 1:, 1:]) * (1 - np.eye(2))
    at = np.stack([np.ones_like(table.pressures_kPa), 1 / table.pressures_kPa])
    variance = np.einsum("kij,ip,jp->kp", cov, at, at)
    return np.asarray(np.sqrt(variance).reshape(len(table.samples), 2, -1) / table.friction(table.values))


@style.in_house_style
def draw_ratio(numbers: pd.DataFrame) -> Figure:
    """One column per sample, static above sliding; on the line at 1 the paper's model is right."""
    samples = list(dict.fromkeys(numbers["sample"]))
    figure, axes = style.panel_grid(2 * len(samples), 42, columns=len(samples), sharex=True, sharey=True)
    for k, sample in enumerate(samples):
        for row, regime in enumerate(REGIMES):
            ax = axes[row * len(samples) + k]
            _ratio_panel(ax, numbers[(numbers["sample"] == sample) & (numbers["regime"] == regime)])
            if row == 0:
                style.panel_title(ax, sample)
            else:
                ax.set_xlabel("p (kPa)")
            if k == 0:
                ax.set_ylabel(f"{regime} friction:\nmeasured / modelled")
    style.plain_log_axis(axes[0].yaxis, [0.25, 0.5, 1.0, 2.0])
    axes[0].set_ylim(0.22, 2.6)
    handles: list[Any] = [
        Line2D([], [], color="black", lw=1.4, label="Table 2, measured"),
        Patch(color=style.BLUE, alpha=0.25, lw=0, label="90 %, mu and tau0 correlated"),
        Line2D([], [], color=style.BLUE, lw=0.7, ls=":", label="90 %, mu and tau0 independent"),
        Line2D([], [], color="0.45", lw=1.0, ls="--", label="model, law of flat sample refitted"),
        Line2D([], [], color=style.VERMILLION, lw=1.3, label="best extended model"),
    ]
    style.legend_below(figure, handles, columns=3)
    return figure


def _ratio_panel(ax: Axes, part: pd.DataFrame) -> None:
    p = part["pressure_kPa"].to_numpy(float)
    ax.set_yscale("log")
    ax.axhline(1, color="0.4", lw=0.8)
    ax.fill_between(p, part["low"], part["high"], color=style.BLUE, alpha=0.25, lw=0)
    for edge in ("low_independent", "high_independent"):
        ax.plot(p, part[edge], ":", color=style.BLUE, lw=0.7)
    ax.plot(p, part["recalibrated_over_model"], "--", color="0.45", lw=1.0)
    ax.plot(p, part["extended_over_model"], color=style.VERMILLION, lw=1.3)
    ax.plot(p, part["measured_over_model"], color="black", lw=1.4)
    ax.set_xlim(0, p.max() * 1.04)


def reading_numbers(d: PublishedDiagnosis) -> pd.DataFrame:
    """One row per reading and mechanism: log likelihood gained, amplitude with its 90 % interval, the guess it is."""
    from tribo.berardo2019.table_model import estimate_of

    rows = []
    for k, o in enumerate(d.results):
        for w in o.weighed:
            name, e = next(iter(estimate_of(w).items()))
            known = (k, o.model, o.correlation, o.specimens, o.outcome, o.p_misfit, o.p_left)
            guess = w.mechanism.in_table.guess
            rows.append((*known, w.name, guess, w.gain, name, e.value, e.low, e.high, e.unit))
    return pd.DataFrame(rows, columns=READING_COLUMNS)


@style.in_house_style
def draw_readings(numbers: pd.DataFrame) -> Figure:
    """Rows: ways to read the table. Columns: mechanisms, the authors' guesses first. Colour: what each earns."""
    readings = numbers.drop_duplicates("reading")
    order = numbers.assign(other=numbers["guess"] == "").groupby("mechanism").agg({"other": "first", "gain": "max"})
    mechanisms = list(order.sort_values(["other", "gain"], ascending=[True, False]).index)
    grid = numbers.pivot_table(index="reading", columns="mechanism", values="gain").loc[readings["reading"], mechanisms]
    height_mm = 5.2 * len(readings) + 48
    figure = style.page_figure(height_mm)
    ax = figure.subplots()
    colours = LinearSegmentedColormap.from_list("gain", ["#FFFFFF", style.BLUE])
    values = grid.to_numpy(float)
    mesh = ax.pcolormesh(values, cmap=colours, vmin=0, vmax=BEST_SHOWN, edgecolors="white", linewidth=0.8)
    for i, j in np.ndindex(values.shape):
        gain = max(float(values[i, j]), 0.0)
        ax.text(j + 0.5, i + 0.5, f"{gain:.1f}" if gain >= 0.05 else "0", ha="center", va="center", fontsize=6.5,
                color="white" if gain > 0.6 * BEST_SHOWN else "0.2")  # fmt: skip
    _readings_axes(ax, readings, mechanisms, int((~order.loc[mechanisms, "other"]).sum()))
    bar = figure.colorbar(mesh, ax=ax, shrink=0.6, aspect=30, pad=0.015, extend="max")
    bar.set_label("increase in log likelihood over the calibrated model")
    bar.outline.set_visible(False)
    return figure


def _readings_axes(ax: Axes, readings: pd.DataFrame, mechanisms: list[str], n_guesses: int) -> None:
    labels = [
        true_minus(f"{'paper' if r['model'] == 'paper' else 'tribo'}, ρ = {r['correlation']:.2f}")
        + (", SD of 3" if r["specimens"] == 3 else "")
        + f"   {str(r['outcome']).replace('_', ' ')}"
        for r in readings.to_dict("records")
    ]
    ax.set_yticks(np.arange(len(labels)) + 0.5, labels, fontsize=6.5)
    words = [mechanism_label(m) for m in mechanisms]
    ax.set_xticks(np.arange(len(words)) + 0.5, words, rotation=30, ha="right", rotation_mode="anchor", fontsize=6.5)
    for label in ax.get_xticklabels()[:n_guesses]:
        label.set_fontweight("bold")
    ax.axvline(n_guesses, color="black", lw=0.8)
    ax.set_ylim(len(labels), 0)
    style.as_table(ax)


PUBLISHED = style.FigureOf(
    "published",
    "Published table compared with the model of the paper",
    "Ratio of measured to simulated friction force against pressure, from mu and tau0 in Table 2 of Berardo "
    "et al. (2019). Band: 90 % interval of the measurement, with the correlation of mu and tau0 that results "
    "from loads spread evenly over 3 to 25 kPa. Dotted: the same interval for independent mu and tau0. Dashed: "
    "the same model with the law of the flat sample fitted to the whole table. Red: this model extended by the "
    "best mechanism.",
    ratio_numbers,
    draw_ratio,
)
PUBLISHED_READINGS = style.FigureOf(
    "published-readings",
    "Evidence for each mechanism under each interpretation of the table",
    "Increase in log likelihood over the calibrated model for each mechanism. Left of the line: the three "
    "explanations suggested by the authors. Each row is one interpretation of the table: the simulation used "
    "as the model, the correlation of mu and tau0, whether the printed standard deviations are those of a "
    "mean or of three specimens, and the outcome.",
    reading_numbers,
    draw_readings,
)
