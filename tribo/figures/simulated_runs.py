"""Fig. 5 of Berardo et al. (2019): the model and its patterns, and its friction coefficient against time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tribo.comparison import study_lookup
from tribo.figures import model_drawing, style
from tribo.figures.thinning import thin_trace
from tribo.records import Run, Study

COLUMNS = [
    "sample_number", "sample", "pressure_kPa", "angle_deg", "seed", "mark", "time_ms", "T_over_N",
    *model_drawing.PATTERN_COLUMNS,
]  # fmt: skip
MODEL_MM, PATTERN_MM, TRACES_MM, HEAD_MM, FOOT_MM, LEGEND_ROW_MM = 31.0, 36.5, 80.0, 8.5, 12.0, 4.4
PATTERNS_ACROSS, SIDE_MM, LEGEND_COLUMNS = 6, 27.0, 6


def numbers(study: Study) -> pd.DataFrame:
    """T/N against time (ms) of the example runs, thinned for the page, with peak, sliding window and pattern."""
    order = study_lookup.sample_numbers(study)
    first_runs = {run.sample: run for run in reversed(study.example_runs)}
    known = sorted(first_runs, key=lambda s: order.get(s, len(order)))
    frames = [of_one_run(first_runs[s], order.get(s, len(order) + k)) for k, s in enumerate(known)]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=COLUMNS)


def of_one_run(run: Run, number: int = 0) -> pd.DataFrame:
    """The numbers of one run, drawn as sample ``number`` of the campaign."""
    time_s, ratio = thin_trace(run.time_s, run.force_N / run.normal_load_N)
    marks: list[dict[str, Any]] = [{"mark": "pattern", **model_drawing.pattern_row(run)}]
    points = [("trace", t, f) for t, f in zip(time_s, ratio, strict=True)]
    points.append(("peak", run.peak_s, run.static_friction))
    points += [("window", t, run.sliding_friction) for t in run.window_s]
    marks += [{"mark": mark, "time_ms": t * 1e3, "T_over_N": f} for mark, t, f in points]
    about = {"pressure_kPa": run.pressure_Pa / 1e3, "angle_deg": run.angle_deg, "seed": run.seed}
    return pd.DataFrame(marks).assign(sample_number=number, sample=run.sample, **about)[COLUMNS]


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """The model, the patterns, and all samples in one panel: peak and sliding mean carry the sample's marker."""
    runs = style.by_sample(numbers)
    rows, legend_rows = -(-len(runs) // PATTERNS_ACROSS), -(-len(runs) // LEGEND_COLUMNS)
    height = MODEL_MM + rows * PATTERN_MM + TRACES_MM + FOOT_MM + LEGEND_ROW_MM * legend_rows
    figure = style.page_figure(height, fixed=True)
    model_drawing.draw_mesh(_axes(figure, 0, 5, 84, MODEL_MM - 6))
    model_drawing.draw_side_view(_axes(figure, 88, 5, 102, MODEL_MM - 6))
    for k, (_, run) in enumerate(runs):
        row, column = divmod(k, PATTERNS_ACROSS)
        pattern = run[run["mark"] == "pattern"].iloc[0]
        left, top = 9.0 + 30.3 * column, MODEL_MM + row * PATTERN_MM + HEAD_MM
        ax = _axes(figure, left, top, SIDE_MM, SIDE_MM)
        model_drawing.draw_pattern(ax, pattern, str(pattern["sample"]), float(pattern["angle_deg"]))
        if k == 0 and np.isfinite(pattern["domain_x_um"]):
            ax.set_ylabel(f"{pattern['domain_y_um']:.4g} µm", fontsize=7)
    traces = _axes(figure, 13, MODEL_MM + rows * PATTERN_MM + HEAD_MM, 175, TRACES_MM - HEAD_MM)
    handles = _draw_traces(traces, runs, numbers)
    figure.legend(handles=handles, loc="lower center", ncols=LEGEND_COLUMNS)
    return figure


def _axes(figure: Figure, left_mm: float, top_mm: float, width_mm: float, height_mm: float) -> Axes:
    """Axes at a place on paper, counted from the top left."""
    width, height = figure.get_size_inches() * style.MM_PER_INCH
    return figure.add_axes(
        (left_mm / width, 1 - (top_mm + height_mm) / height, width_mm / width, height_mm / height)
    )


def _draw_traces(ax: Axes, runs: list[tuple[int, pd.DataFrame]], numbers: pd.DataFrame) -> list[Any]:
    handles = []
    for number, run in runs:
        mark = style.sample_mark(number)
        trace, peak, window = (run[run["mark"] == m] for m in ("trace", "peak", "window"))
        ax.plot(trace["time_ms"], trace["T_over_N"], color=mark.colour, lw=0.8, label=f"{run['sample'].iloc[0]}")
        ax.plot(peak["time_ms"], peak["T_over_N"], mark.marker, color=mark.colour, ms=5)
        handles += ax.plot(
            window["time_ms"], window["T_over_N"], ls=":", marker=mark.marker, mfc="white", color=mark.colour,
            label=f"{run['sample'].iloc[0]} ({_angle(run['angle_deg'].iloc[0])})",
        )  # fmt: skip
    pressures = " and ".join(f"{p:.3g}" for p in sorted(numbers["pressure_kPa"].unique()))
    style.panel_title(ax, "Simulated friction", f"p = {pressures} kPa, pull angle in the legend")
    ax.set_xlabel("Time (ms)")
    ax.set_ylabel("Simulated T / N")
    ax.set_ylim(bottom=0)
    ax.set_xlim(left=0)
    return handles


def _angle(angle_deg: float) -> str:
    return f"{angle_deg:.3g}°".replace("-", "−")
