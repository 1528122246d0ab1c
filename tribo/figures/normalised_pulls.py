"""Fig. 3 of Berardo et al. (2019): one pull of each sample, normalised by its own static peak."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tribo.comparison import study_lookup
from tribo.figures import style
from tribo.figures.thinning import thin_trace
from tribo.records import Pull, Study, Test, Trace

COLUMNS = ["sample_number", "sample", "test_id", "normal_load_N", "mark", "time_s", "T_over_peak"]


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
    levels = study_lookup.load_levels(np.array([t.normal_load_N for t in tests]))
    distinct = np.unique(levels)
    middle = distinct[len(distinct) // 2]
    pulls = study.ingested.pulls
    candidates = [t for t, level in zip(tests, levels, strict=True) if level == middle]
    peak = float(np.median([pulls[t.test_id].static_N for t in candidates]))
    return min(
        candidates,
        key=lambda t: (len(pulls[t.test_id].flags), abs(pulls[t.test_id].static_N - peak), t.test_id),
    )


def numbers(study: Study) -> pd.DataFrame:
    """Force over static peak against time (s, as recorded) of the example pulls, with peak and window."""
    order = study_lookup.sample_numbers(study)
    examples = sorted(example_tests(study).items(), key=lambda item: order[item[0]])
    frames = [
        _one_pull(order[sample], test, study.ingested.traces[test.test_id], study.ingested.pulls[test.test_id])
        for sample, test in examples
    ]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=COLUMNS)


def _one_pull(number: int, test: Test, trace: Trace, pull: Pull) -> pd.DataFrame:
    time, force = thin_trace(trace.time_s, trace.force_N - pull.zero_N)
    sliding = pull.sliding_N / pull.static_N
    marks = [("trace", t, f) for t, f in zip(time, force / pull.static_N, strict=True)]
    marks += [
        ("peak", pull.peak_s, 1.0),
        ("window", pull.window_s[0], sliding),
        ("window", pull.window_s[1], sliding),
    ]
    frame = pd.DataFrame(marks, columns=["mark", "time_s", "T_over_peak"])
    frame.insert(0, "sample_number", number)
    frame.insert(1, "sample", test.sample)
    frame.insert(2, "test_id", test.test_id)
    frame.insert(3, "normal_load_N", test.normal_load_N)
    return frame


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """One panel per sample: trace, static peak, sliding window with its mean."""
    groups = style.by_sample(numbers)
    figure, axes = style.panel_grid(len(groups), 42, sharey=True)
    for ax, (_, pull) in zip(axes, groups, strict=True):
        trace, peak, window = (pull[pull["mark"] == m] for m in ("trace", "peak", "window"))
        ax.plot(trace["time_s"], trace["T_over_peak"], color=style.BLUE, lw=0.7)
        ax.axvspan(*window["time_s"], color=style.GREEN, alpha=0.15, lw=0)
        ax.plot(window["time_s"], window["T_over_peak"], color=style.GREEN, lw=1.4)
        ax.plot(peak["time_s"], peak["T_over_peak"], "v", color=style.VERMILLION, ms=5, clip_on=False)
        first = pull.iloc[0]
        style.panel_title(ax, first["sample"], f"N = {first['normal_load_N']:.3g} N, test {first['test_id']}")
        ax.set_xlabel("Time (s)")
    for ax in axes:
        if style.is_leftmost(ax):
            ax.set_ylabel("T / static peak")
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
