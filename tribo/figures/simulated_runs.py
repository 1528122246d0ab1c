"""Fig. 5 (4) of Berardo et al. (2019): the model's friction coefficient against time, one run a sample."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from tribo.comparison import study_lookup
from tribo.figures import style
from tribo.figures.thinning import thin_trace
from tribo.records import Run, Study

COLUMNS = ["sample_number", "sample", "pressure_kPa", "angle_deg", "seed", "mark", "time_ms", "T_over_N"]


def numbers(study: Study) -> pd.DataFrame:
    """T/N against time (ms) of the example runs, thinned for the page, with peak and sliding window."""
    order = study_lookup.sample_numbers(study)
    first_runs = {run.sample: run for run in reversed(study.example_runs)}
    known = sorted(first_runs, key=lambda s: order.get(s, len(order)))
    frames = [of_one_run(first_runs[s], order.get(s, len(order) + k)) for k, s in enumerate(known)]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=COLUMNS)


def of_one_run(run: Run, number: int = 0) -> pd.DataFrame:
    """The numbers of one run, drawn as sample ``number`` of the campaign."""
    time_s, ratio = thin_trace(run.time_s, run.force_N / run.normal_load_N)
    marks = [("trace", t * 1e3, f) for t, f in zip(time_s, ratio, strict=True)]
    marks.append(("peak", run.peak_s * 1e3, run.static_friction))
    marks += [("window", t * 1e3, run.sliding_friction) for t in run.window_s]
    frame = pd.DataFrame(marks, columns=["mark", "time_ms", "T_over_N"])
    about = {"pressure_kPa": run.pressure_Pa / 1e3, "angle_deg": run.angle_deg, "seed": run.seed}
    return frame.assign(sample_number=number, sample=run.sample, **about)[COLUMNS]


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """All samples in one panel; the peak and the mean over the sliding window carry the sample's marker."""
    figure, (ax,) = style.panel_grid(1, 85)
    handles = []
    for number, run in style.by_sample(numbers):
        mark = style.sample_mark(number)
        trace, peak, window = (run[run["mark"] == m] for m in ("trace", "peak", "window"))
        ax.plot(trace["time_ms"], trace["T_over_N"], color=mark.colour, lw=0.8)
        ax.plot(peak["time_ms"], peak["T_over_N"], mark.marker, color=mark.colour, ms=5)
        first = run.iloc[0]
        handles += ax.plot(
            window["time_ms"], window["T_over_N"], ls=":", marker=mark.marker, mfc="white", color=mark.colour,
            label=f"{first['sample']} ({_angle(first['angle_deg'])})",
        )  # fmt: skip
    pressures = " and ".join(f"{p:.3g}" for p in sorted(numbers["pressure_kPa"].unique()))
    style.panel_title(ax, "", f"p = {pressures} kPa, pull angle in the legend")
    ax.set_xlabel("Time (ms)")
    ax.set_ylabel("Simulated T / N")
    ax.set_ylim(bottom=0)
    ax.set_xlim(left=0)
    style.legend_below(figure, handles, columns=8)
    return figure


def _angle(angle_deg: float) -> str:
    return f"{angle_deg:.0f}°".replace("-", "−")
