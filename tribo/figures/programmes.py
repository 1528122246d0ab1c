"""Figures of records that are programmes: friction against speed, cycles, running-in."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tribo.comparison.findings import sample_numbers, shown
from tribo.figures import style
from tribo.records import Reading, Study
from tribo.vocabulary import label_with_unit
from tribo.wording.numerals import sentence_case

LEVEL_COLUMNS = ["sample_number", "sample", "record", "way", "label", "value", "T_over_N", "low", "high"]
CYCLE_COLUMNS = ["sample_number", "sample", "record", "quantity", "cycle", "value", "low", "high"]
RUNNING_IN_COLUMNS = ["sample_number", "sample", "record", "mark", "label", "along", "value"]
_FEWEST_LEVELS = 3
_FEWEST_CYCLES = 3
_MOST_PANELS = 8
_POINTS = 120
_OF_CYCLES = {"coefficient": "T / N", "energy_J": "Energy per cycle (J)"}


def _records(study: Study, name: str) -> dict[str, list[Reading]]:
    """The readings of a name by the record that they are of."""
    found: dict[str, list[Reading]] = {}
    for reading in study.ingested.readings if shown(study) else ():
        if reading.name == name:
            found.setdefault(reading.test_id.partition("#")[0], []).append(reading)
    return found


def _samples(study: Study) -> dict[str, tuple[int, str]]:
    """Number and name of the sample of each test, and of the record that it is a piece of."""
    order = sample_numbers(study)
    found = {test.test_id: (order[test.sample], test.sample) for test in study.ingested.campaign.tests}
    return found | {test_id.partition("#")[0]: sample for test_id, sample in found.items()}


def level_points(study: Study) -> pd.DataFrame:
    """T/N of every plateau of a ladder against its Hersey number, else its speed, else its load."""
    samples, rows = _samples(study), []
    for record, readings in _records(study, "plateau").items():
        there = [r for r in readings if "coefficient" in r.values and r.way]
        if len(there) < _FEWEST_LEVELS:
            continue
        changes = any(abs(b.speed_m_s / a.speed_m_s - 1.0) > 0.05 for a, b in pairwise(there) if a.speed_m_s)
        hersey = changes and all("hersey_per_m" in r.values for r in there)
        label = "Hersey number (1/m)" if hersey else label_with_unit("speed_m_s" if changes else "normal_load_N")
        for r in there:
            value = r.values["hersey_per_m"][0] if hersey else r.speed_m_s if changes else r.normal_load_N
            rows.append([*samples[r.test_id], record, r.way, label, value, *r.values["coefficient"]])
    return pd.DataFrame(rows, columns=LEVEL_COLUMNS)


def cycle_points(study: Study) -> pd.DataFrame:
    """T/N and energy of every cycle of strokes."""
    samples = _samples(study)
    rows = [
        [*samples[r.test_id], record, said, r.cycle, *r.values[name]]
        for record, readings in _records(study, "cycle").items()
        if len(readings) >= _FEWEST_CYCLES
        for name, said in _OF_CYCLES.items()
        for r in readings
        if name in r.values
    ]
    return pd.DataFrame(rows, columns=CYCLE_COLUMNS)


def running_in_points(study: Study) -> pd.DataFrame:
    """T/N along the first records that run in, as block means, and the interval of where running-in is over."""
    samples, rows = _samples(study), []
    for record, (reading, *_) in list(_records(study, "running-in").items())[:_MOST_PANELS]:
        trace, pull = study.ingested.traces[reading.test_id], study.ingested.pulls[reading.test_id]
        if not reading.normal_load_N > 0:
            continue
        first, last = np.searchsorted(trace.time_s, (reading.start_s, reading.end_s))
        count = max((last - first) // _POINTS, 1)
        blocks = (last - first) // count
        part = slice(first, first + blocks * count)
        time, force = (v[part].reshape(blocks, count).mean(axis=1) for v in (trace.time_s, trace.force_N - pull.zero_N))
        by_way = np.isfinite(reading.speed_m_s)
        scale, label = (reading.speed_m_s, "distance (m)") if by_way else (1.0, "time (s)")
        about = [*samples[reading.test_id], record]
        for along, value in zip((time - reading.start_s) * scale, force / reading.normal_load_N, strict=True):
            rows.append([*about, "measured", label, along, value])
        steady = reading.values.get("force_N", (np.nan,) * 3)[0] / reading.normal_load_N
        for end in reading.values.get("run_in_s", ()):
            rows.append([*about, reading.state, label, end * scale, steady])
        if "run_in_s" not in reading.values:
            rows.append([*about, reading.state, label, np.nan, np.nan])
    return pd.DataFrame(rows, columns=RUNNING_IN_COLUMNS)


@style.in_house_style
def draw_levels(numbers: pd.DataFrame) -> Figure:
    """One panel a variable; filled marks on the way up, open ones on the way down."""
    labels = list(dict.fromkeys(numbers["label"]))
    figure, axes = style.panel_grid(len(labels), 70, columns=min(len(labels), 2))
    for ax, label in zip(axes, labels, strict=True):
        part = numbers[numbers["label"] == label]
        for (number, _, way), points in part.groupby(["sample_number", "record", "way"], sort=False):
            colour, marker = style.sample_mark(int(str(number)))
            bars = style.error_bars(points, "T_over_N", "low", "high")
            points = points.assign(below=bars[0], above=bars[1]).sort_values("value")
            ax.errorbar(
                points["value"], points["T_over_N"], points[["below", "above"]].to_numpy().T, fmt=f"{marker}-",
                ms=3.5, lw=0.6, elinewidth=0.6, color=colour, mfc=colour if way == "up" else "none",
            )  # fmt: skip
        ax.set_xlabel(sentence_case(str(label)))
        ax.set_ylabel("T / N")
        if part["value"].min() > 0 and part["value"].max() > 10 * part["value"].min():
            ax.set_xscale("log")
            style.plain_log_axis(ax.xaxis, part["value"])
    ways = [
        Line2D([], [], color="0.3", marker="o", mfc="0.3" if way == "up" else "none", ls="", label=way)
        for way in ("up", "down")
        if (numbers["way"] == way).any()
    ]
    style.legend_below(figure, [*style.sample_handles(numbers, ls=""), *ways], columns=8)
    return figure


@style.in_house_style
def draw_cycles(numbers: pd.DataFrame) -> Figure:
    """One panel a quantity, a line a record."""
    quantities = list(dict.fromkeys(numbers["quantity"]))
    figure, axes = style.panel_grid(len(quantities), 60, columns=len(quantities))
    for ax, quantity in zip(axes, quantities, strict=True):
        for (number, _), points in numbers[numbers["quantity"] == quantity].groupby(
            ["sample_number", "record"], sort=False
        ):
            colour, _ = style.sample_mark(int(str(number)))
            ax.plot(points["cycle"], points["value"], "o-", ms=2, lw=0.6, color=colour)
            ax.fill_between(points["cycle"], points["low"], points["high"], color=colour, alpha=0.2, lw=0)
        ax.set_xlabel("Cycle")
        ax.set_ylabel(str(quantity))
    style.legend_below(figure, style.sample_handles(numbers, ls=""), columns=8)
    return figure


@style.in_house_style
def draw_running_in(numbers: pd.DataFrame) -> Figure:
    """One panel a record: its force over the load, the steady level, and where it is reached."""
    records = list(dict.fromkeys(numbers["record"]))
    figure, axes = style.panel_grid(len(records), 50)
    for ax, record in zip(axes, records, strict=True):
        part = numbers[numbers["record"] == record]
        colour, _ = style.sample_mark(int(part["sample_number"].iloc[0]))
        curve, over = part[part["mark"] == "measured"], part[part["mark"] != "measured"]
        ax.plot(curve["along"], curve["value"], lw=0.8, color=colour)
        state = str(over["mark"].iloc[0])
        if np.isfinite(over["along"]).all():
            at, low, high = over["along"]
            ax.axvspan(low, high, color="0.85", lw=0)
            ax.axvline(at, color="0.4", lw=0.8)
            ax.axhline(float(over["value"].iloc[0]), color="0.4", lw=0.6, ls="--")
        style.panel_title(ax, str(record), state)
        ax.set_xlabel(sentence_case(str(part["label"].iloc[0])))
        if style.is_leftmost(ax):
            ax.set_ylabel("T / N")
    return figure


LEVELS = style.StudyFigure(
    "levels",
    "T/N at the levels of each record",
    "Mean T/N of every plateau of a ladder with its 95 % interval, against the Hersey number where a viscosity is "
    "stated, else against speed, else load. Filled marks were reached on the way up, open ones on the way down.",
    level_points,
    draw_levels,
)
CYCLES = style.StudyFigure(
    "cycles",
    "Friction of each cycle",
    "T/N over the middle of both strokes of a cycle, and the friction work of the cycle; bands are 95 % intervals.",
    cycle_points,
    draw_cycles,
)
RUNNING_IN = style.StudyFigure(
    "running_in",
    "Running-in",
    "T/N along records that slide on and on. The vertical line is where a tenth of the whole change is left, the grey "
    "band its 95 % interval, the dashed line the steady level. Neither is drawn where the force still drifts, or where "
    "noise hides whether it does.",
    running_in_points,
    draw_running_in,
)
