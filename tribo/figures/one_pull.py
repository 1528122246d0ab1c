"""Pulls: one at full size, or one of each sample normalised by its static peak (Fig. 3 of Berardo et al., 2019)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tribo.comparison import findings
from tribo.figures import style
from tribo.records import FloatArray, Pull, Study, Test, Trace
from tribo.user_text import plain

_STRIP = 0.06  # share of the height of a panel that names the phases
_LETTER = 0.012  # share of the width of a panel that a small letter takes
PAGE_POINTS = 1200  # a page is 190 mm wide: more points along a line cannot be seen


def thin_trace(time: FloatArray, force: FloatArray, points: int = PAGE_POINTS) -> tuple[FloatArray, FloatArray]:
    """At most about ``points`` samples that look the same: lowest and highest of each stretch, in order.

    No spike or dip is lost, as it would be by taking every n-th sample.
    """
    n = len(force)
    if n <= points:
        return np.asarray(time), np.asarray(force)
    stretch = -(-n // (points // 2))
    padded = np.full(-(-n // stretch) * stretch, np.nan)
    padded[:n] = force
    rows = padded.reshape(-1, stretch)
    starts = np.arange(len(rows)) * stretch
    lowest = starts + np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    highest = starts + np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    index = np.unique(np.concatenate([[0, n - 1], lowest, highest]))
    return np.asarray(time)[index], np.asarray(force)[index]


EXAMPLE_COLUMNS = ["sample_number", "sample", "test_id", "normal_load_N", "mark", "time_s", "T_over_peak"]


def example_tests(study: Study) -> dict[str, Test]:
    """One pull per sample: at the middle load, without flags if there is one, its peak nearest the median."""
    ingested = study.ingested
    usable = [
        t
        for t in ingested.campaign.tests
        if t.test_id in ingested.traces
        and (pull := ingested.pulls.get(t.test_id)) is not None
        and np.isfinite(pull.static_N)
        and pull.static_N > 0
    ]
    by_sample: dict[str, list[Test]] = {}
    for test in usable:
        by_sample.setdefault(test.sample, []).append(test)
    return {sample: _typical(tests, study) for sample, tests in by_sample.items()}


def _typical(tests: list[Test], study: Study) -> Test:
    levels = findings.load_levels(np.array([t.normal_load_N for t in tests]))
    distinct = np.unique(levels)
    middle = distinct[len(distinct) // 2]
    return study.ingested.typical([t for t, level in zip(tests, levels, strict=True) if level == middle])


def example_numbers(study: Study) -> pd.DataFrame:
    """Force over static peak against time (s, as recorded) of the example pulls, with peak and window."""
    order = findings.sample_numbers(study)
    examples = sorted(example_tests(study).items(), key=lambda item: order[item[0]])
    frames = []
    for sample, test in examples:
        pull = study.ingested.pulls[test.test_id]
        numbers = pull_numbers(study.ingested.traces[test.test_id], pull)
        numbers = numbers.assign(
            sample_number=order[sample],
            sample=sample,
            normal_load_N=test.normal_load_N,
            T_over_peak=numbers["force_N"] / pull.static_N,
        )
        frames.append(numbers[EXAMPLE_COLUMNS])
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=EXAMPLE_COLUMNS)


@style.in_house_style
def draw_examples(numbers: pd.DataFrame) -> Figure:
    """One panel per sample: trace, static peak, sliding window with its mean."""
    figure, panels = style.sample_panels(numbers, 42, "Time (s)", "T / static peak", sharey=True)
    for ax, pull in panels:
        trace, peak, window = (pull[pull["mark"] == m] for m in ("trace", "peak", "window"))
        ax.plot(trace["time_s"], trace["T_over_peak"], color=style.BLUE, lw=0.7)
        ax.axvspan(*window["time_s"], color=style.GREEN, alpha=0.15, lw=0)
        ax.plot(window["time_s"], window["T_over_peak"], color=style.GREEN, lw=1.4)
        ax.plot(peak["time_s"], peak["T_over_peak"], "v", color=style.VERMILLION, ms=5, clip_on=False)
        first = pull.iloc[0]
        style.panel_title(ax, first["sample"], f"N = {plain(first['normal_load_N'])} N, test {first['test_id']}")
    style.legend_below(
        figure,
        [
            Line2D([], [], color=style.BLUE, lw=0.9, label="friction force, zero subtracted"),
            Line2D([], [], color=style.VERMILLION, marker="v", ls="", label="static peak"),
            Patch(color=style.GREEN, alpha=0.3, lw=0, label="sliding window"),
            Line2D([], [], color=style.GREEN, lw=1.4, label="sliding mean"),
        ],
    )
    return figure


def pull_numbers(trace: Trace, pull: Pull) -> pd.DataFrame:
    """Force (N, zero subtracted) against time (s, as recorded), with the peak, the ends of the window and the slips."""
    time, force = thin_trace(trace.time_s, trace.force_N - pull.zero_N)
    marks = [("trace", t, f) for t, f in zip(time, force, strict=True)]
    marks.append(("peak", pull.peak_s, pull.static_N))
    marks += [("window", t, pull.sliding_N) for t in pull.window_s]
    marks += [(f"phase: {phase.name}", t, np.nan) for phase in pull.phases for t in (phase.start_s, phase.end_s)]
    marks += [("slip", t, f) for s in pull.slips for t, f in ((s.fail_s, s.peak_N), (s.end_s, s.trough_N))]
    frame = pd.DataFrame(marks, columns=["mark", "time_s", "force_N"])
    frame.insert(0, "test_id", pull.test_id)
    return frame


def _draw_phases(ax: Axes, phases: pd.DataFrame) -> None:
    """A strip along the foot of a panel: one field a phase, with its name where there is room for it."""
    low, high = ax.get_xlim()
    times = phases["time_s"].to_numpy().reshape(-1, 2)
    for k, (name, (start, end)) in enumerate(zip(phases["mark"][::2], times, strict=True)):
        shade = style.BLACK if k % 2 else style.BLUE
        ax.axvspan(start, end, ymin=0.0, ymax=_STRIP, color=shade, alpha=0.2, lw=0)
        text = name.removeprefix("phase: ")
        if (end - start) / (high - low) > _LETTER * len(text):
            ax.text(start + (end - start) / 2.0, _STRIP / 2.0, text, transform=ax.get_xaxis_transform(), ha="center",
                    va="center", fontsize="xx-small")  # fmt: skip


@style.in_house_style
def draw_pull(numbers: pd.DataFrame) -> Figure:
    """The trace with its readings and slips, and under it the phases of the record."""
    figure, (ax,) = style.panel_grid(1, 75)
    trace, peak, window = (numbers[numbers["mark"] == m] for m in ("trace", "peak", "window"))
    ax.plot(trace["time_s"], trace["force_N"], color=style.BLUE, lw=0.8, label="friction force, zero subtracted")
    ax.axvspan(*window["time_s"], color=style.GREEN, alpha=0.15, lw=0)
    ax.plot(window["time_s"], window["force_N"], color=style.GREEN, lw=1.6, label="sliding window and mean")
    ax.plot(peak["time_s"], peak["force_N"], "v", color=style.VERMILLION, ms=6, label="static peak", clip_on=False)
    style.panel_title(ax, str(numbers["test_id"].iloc[0]))
    slips = numbers[numbers["mark"] == "slip"]
    if len(slips):
        ends = slips[["time_s", "force_N"]].to_numpy(float).reshape(-1, 2, 2)
        ax.add_collection(LineCollection(list(ends), colors=style.ORANGE, linewidths=1.2, label="slips"), autolim=False)
    _draw_phases(ax, numbers[numbers["mark"].str.startswith("phase: ")])
    ax.set_xlabel("Time (s)")
    ax.set_ylabel("Friction force T (N)")
    style.legend_below(figure, ax.get_legend_handles_labels()[0])
    return figure


EXAMPLE_PULLS = style.StudyFigure(
    "fig3",
    "Example pulls",
    "Friction force against time in one pull of each sample at a middle load, after subtraction of the "
    "zero, divided by the static peak. The static peak and the window over which the sliding force "
    "is averaged are marked.",
    example_numbers,
    draw_examples,
)
