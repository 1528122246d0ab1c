"""Before and after: the residuals of every sample under the calibrated model and under the extended one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tribo.comparison import study_lookup
from tribo.diagnostics.effect_sizes import percent, rms_percent
from tribo.figures import style
from tribo.records import REGIMES

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis

COLUMNS = [
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


def numbers(d: Diagnosis) -> pd.DataFrame:
    """Mean residual, 100 (measured / model - 1), of each sample, regime and load, before and after.

    ``low`` to ``high`` are two standard errors of the mean over tests; ``rms_percent`` is the root mean square over
    all tests of the panel. "simulated" is the spring-block model itself with the mechanism in it, where it was run.
    Empty where no mechanism extends the model.
    """
    if d.named is None or not d.named.causes or d.verdict.verdict == "unknown":
        return pd.DataFrame(columns=COLUMNS)
    f = d.baseline
    o = f.setup.observations
    residuals = {"before": f.residual, "after": d.named.model.residual}
    if d.simulated is not None:
        residuals["simulated"] = o.log_force - d.simulated.log_force
    levels = study_lookup.load_levels(o.conditions.normal_load_N)
    samples = sorted(set(o.conditions.sample.tolist()), key=lambda s: (s != o.flat, s))
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
    return pd.DataFrame(rows, columns=COLUMNS)


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
def draw(numbers: pd.DataFrame) -> Figure:
    """Static above sliding for every sample, a few samples to a row; on the line at zero the model is right."""
    samples = style.by_sample(numbers)
    across = len(samples) if len(samples) <= 4 else 3 if len(samples) <= 6 else 4
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
            _draw_panel(ax, cell)
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


def _draw_panel(ax: Axes, cell: pd.DataFrame) -> None:
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
