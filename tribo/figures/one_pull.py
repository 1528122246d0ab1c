"""One pull at full size: its trace, zero subtracted, with static peak and sliding window."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from tribo.figures import style
from tribo.figures.thinning import thin_trace
from tribo.records import Pull, Trace


def numbers(trace: Trace, pull: Pull) -> pd.DataFrame:
    """Force (N, zero subtracted) against time (s, as recorded), with the peak and the ends of the window."""
    time, force = thin_trace(trace.time_s, trace.force_N - pull.zero_N)
    marks = [("trace", t, f) for t, f in zip(time, force, strict=True)]
    marks.append(("peak", pull.peak_s, pull.static_N))
    marks += [("window", t, pull.sliding_N) for t in pull.window_s]
    frame = pd.DataFrame(marks, columns=["mark", "time_s", "force_N"])
    frame.insert(0, "test_id", pull.test_id)
    return frame


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """The trace with its readings."""
    figure, (ax,) = style.panel_grid(1, 75)
    trace, peak, window = (numbers[numbers["mark"] == m] for m in ("trace", "peak", "window"))
    ax.plot(trace["time_s"], trace["force_N"], color=style.BLUE, lw=0.8, label="friction force, zero subtracted")
    ax.axvspan(*window["time_s"], color=style.GREEN, alpha=0.15, lw=0)
    ax.plot(window["time_s"], window["force_N"], color=style.GREEN, lw=1.6, label="sliding window and mean")
    ax.plot(peak["time_s"], peak["force_N"], "v", color=style.VERMILLION, ms=6, label="static peak", clip_on=False)
    style.panel_title(ax, str(numbers["test_id"].iloc[0]))
    ax.set_xlabel("Time (s)")
    ax.set_ylabel("Friction force T (N)")
    style.legend_below(figure, ax.get_legend_handles_labels()[0])
    return figure
