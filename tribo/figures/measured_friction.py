"""Figures of a report without the model: T/N against its conditions and along records, oscillations, restarts."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from tribo.comparison.findings import sample_numbers, shown
from tribo.figures import style
from tribo.fitting.alternatives import SPEED, force_N, measured_points, test_values, variables_of
from tribo.fitting.linear import meant_to_be_one
from tribo.records import REGIMES, Study
from tribo.vocabulary import label_with_unit
from tribo.wording.numerals import sentence_case

POINTS_COLUMNS = [
    "sample_number", "sample", "regime", "test_id", "variable", "label", "value", "T_over_N", "T_over_N_u",
]  # fmt: skip
RECORD_COLUMNS = ["sample_number", "sample", "test_id", "normal_load_N", "way", "value", "T_over_N"]
OSCILLATION_COLUMNS = [
    "sample_number", "sample", "test_id", "regime", "variable", "label", "value", "quantity", "y", "y_u",
]  # fmt: skip
RESTART_COLUMNS = ["sample_number", "sample", "test_id", "hold_s", "T_over_N", "T_over_N_u"]
FORCE_COLUMNS = ["sample_number", "sample", "regime", "mark", "normal_load_N", "T_N"]
_LAW_POINTS = 80
_MOST_VARIABLES = 8
_RECORD_POINTS = 80
_MOST_RECORDS = 60
METRES_FROM, WAYS = 1.0, ("distance (mm)", "distance (m)")


def dependence_points(study: Study) -> pd.DataFrame:
    """T/N of every test against every recorded variable that varies, one row per point."""
    points = measured_points(study.ingested) if shown(study) else pd.DataFrame()
    order = sample_numbers(study)
    frames = [
        points.assign(variable=name, label=label_with_unit(name), value=points[name])
        for name in (variables_of(points)[:_MOST_VARIABLES] if len(points) else ())
    ]
    if not frames:
        return pd.DataFrame(columns=POINTS_COLUMNS)
    table = pd.concat(frames, ignore_index=True)
    table = table[np.isfinite(table["value"])]
    return table.assign(sample_number=table["sample"].map(order))[POINTS_COLUMNS]


def law_points(study: Study) -> pd.DataFrame:
    """T of every test against its load, and the law chosen for each sample and regime; nothing at a single load."""
    order, laws = sample_numbers(study), study.laws
    frames: list[pd.DataFrame] = []
    table = study.ingested.table()
    several = shown(study) and not meant_to_be_one(table["normal_load_N"].to_numpy(float))
    for (sample, number), regime in product(order.items(), REGIMES) if several else ():
        part = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"]) & (table["normal_load_N"] > 0)]
        said = {"sample_number": number, "sample": sample, "regime": regime}
        load = part["normal_load_N"].to_numpy(float)
        frames.append(pd.DataFrame({**said, "mark": "measured", "normal_load_N": load, "T_N": part[f"{regime}_N"]}))
        own = None if laws is None else laws[(laws["sample"] == sample) & (laws["regime"] == regime) & laws["chosen"]]
        if own is not None and len(own) and len(load):
            law = own.iloc[0]
            grid = np.geomspace(load.min(), load.max(), _LAW_POINTS)
            force = force_N(str(law["law"]), float(law["a"]), float(law["b"]), grid)
            frames.append(pd.DataFrame({**said, "mark": str(law["formula"]), "normal_load_N": grid, "T_N": force}))
    there = [frame for frame in frames if len(frame)]
    return pd.concat(there, ignore_index=True) if there else pd.DataFrame(columns=FORCE_COLUMNS)


def within_records(study: Study) -> pd.DataFrame:
    """T/N along each record against the distance slid, or the time where no speed is known; block means."""
    frames: list[pd.DataFrame] = []
    order = sample_numbers(study)
    for test in study.ingested.campaign.tests if shown(study) else ():
        trace, pull = study.ingested.traces.get(test.test_id), study.ingested.pulls.get(test.test_id)
        if trace is None or pull is None or not test.normal_load_N > 0 or len(frames) >= _MOST_RECORDS:
            continue
        size = max(1, trace.time_s.size // _RECORD_POINTS)
        count = trace.time_s.size // size
        time, force = (np.asarray(v)[: count * size].reshape(count, size).mean(axis=1)
                       for v in (trace.time_s - trace.time_s[0], trace.force_N - pull.zero_N))  # fmt: skip
        slid = test.speed_m_s is not None
        way_m = time * (test.speed_m_s or 0.0)
        far = bool(way_m[-1] >= METRES_FROM)
        frames.append(pd.DataFrame({
            "sample_number": order[test.sample], "sample": test.sample, "test_id": test.test_id,
            "normal_load_N": test.normal_load_N, "way": WAYS[far] if slid else "time (s)",
            "value": way_m * (1.0 if far else 1e3) if slid else time, "T_over_N": force / test.normal_load_N,
        }))  # fmt: skip
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=RECORD_COLUMNS)


def oscillation_points(study: Study) -> pd.DataFrame:
    """Drop over load and period of every test that oscillates while sliding, against speed, or load without speeds."""
    rows = []
    order = sample_numbers(study)
    speeds = {t.speed_m_s for t in study.ingested.campaign.tests if t.speed_m_s}
    variable = SPEED if len(speeds) > 1 else "normal_load_N"
    for test in study.ingested.campaign.tests if shown(study) else ():
        pull = study.ingested.pulls.get(test.test_id)
        found = pull.oscillation if pull is not None else None
        value = test_values(test).get(variable)
        if found is None or not found.cycles or found.regime == "steady" or not value or not test.normal_load_N > 0:
            continue
        said = {"sample_number": order[test.sample], "sample": test.sample, "test_id": test.test_id,
                "regime": found.regime, "variable": variable, "label": label_with_unit(variable),
                "value": value}  # fmt: skip
        load = test.normal_load_N
        rows.append({**said, "quantity": "drop / N", "y": found.drop_N / load, "y_u": found.drop_u_N / load})
        rows.append({**said, "quantity": "period (s)", "y": found.period_s, "y_u": found.period_u_s})
    return pd.DataFrame(rows, columns=OSCILLATION_COLUMNS)


def restart_points(study: Study) -> pd.DataFrame:
    """Static force over load of every restart, against the time the drive stood still."""
    order = sample_numbers(study)
    rows = [
        {"sample_number": order[test.sample], "sample": test.sample, "test_id": test.test_id, "hold_s": restart.hold_s,
         "T_over_N": restart.static_N / test.normal_load_N, "T_over_N_u": restart.static_u_N / test.normal_load_N}
        for test in (study.ingested.used_tests if shown(study) else ())
        if test.normal_load_N > 0
        for restart in study.ingested.pulls[test.test_id].restarts
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=RESTART_COLUMNS)


LINE_POINTS = 8.5  # from one formula to the next
_OPEN = {"static": True, "sliding": False}


@style.in_house_style
def draw_dependence(numbers: pd.DataFrame) -> Figure:
    """One panel per recorded variable; filled marks sliding, open marks static friction."""
    variables = list(dict.fromkeys(numbers["variable"]))
    figure, axes = style.panel_grid(len(variables), 52, columns=min(len(variables), 2))
    for ax, variable in zip(axes, variables, strict=True):
        part = numbers[numbers["variable"] == variable]
        for (number, regime), points in part.groupby(["sample_number", "regime"]):
            colour, marker = style.sample_mark(int(str(number)))
            face = "none" if _OPEN[str(regime)] else colour
            ax.errorbar(
                points["value"], points["T_over_N"], points["T_over_N_u"].fillna(0.0), fmt=marker, ms=3,
                color=colour, mfc=face, elinewidth=0.6,
            )  # fmt: skip
        ax.set_xlabel(sentence_case(str(part["label"].iloc[0])))
        ax.set_ylabel("T / N")
        _spread(ax, part["value"])
    style.legend_below(figure, [*style.sample_handles(numbers, ls=""), *_regimes(numbers)], columns=8)
    return figure


@style.in_house_style
def draw_forces(numbers: pd.DataFrame) -> Figure:
    """One panel per regime: measured forces as marks, the law of each sample as a line."""
    regimes = list(dict.fromkeys(numbers["regime"]))
    figure, axes = style.panel_grid(len(regimes), 70, columns=len(regimes))
    for ax, regime in zip(axes, regimes, strict=True):
        part = numbers[numbers["regime"] == regime]
        colours: dict[str, list[str]] = {}
        for number, points in style.by_sample(part):
            colour, marker = style.sample_mark(number)
            measured = points[points["mark"] == "measured"]
            load, force = measured["normal_load_N"], measured["T_N"]
            ax.plot(load, force, marker, ms=3, color=colour, mfc="none", mew=0.6)
            for formula, line in points[points["mark"] != "measured"].groupby("mark"):
                ax.plot(line["normal_load_N"], line["T_N"], color=colour, lw=1.1)
                colours.setdefault(str(formula), []).append(colour)
        for place, (formula, of) in enumerate(colours.items(), start=1):  # one law of several samples once, in black
            ax.annotate(
                formula, (0.02, 1.0), (0.0, -LINE_POINTS * place), xycoords="axes fraction",
                textcoords="offset points", color=of[0] if len(of) == 1 else "black", fontsize=7,
            )  # fmt: skip
        style.panel_title(ax, sentence_case(f"{regime} friction"))
        ax.set_xlabel("Normal load N (N)")
        ax.set_ylabel("Friction force T (N)")
        if _over_a_decade(part["T_N"]):
            _spread(ax, part["normal_load_N"])
            ax.set_yscale("log")
            style.plain_log_axis(ax.yaxis, part["T_N"])
        else:  # from zero, so that what does not depend on the load is seen
            ax.set(xlim=(0.0, None), ylim=(0.0, None))
    style.legend_below(figure, style.sample_handles(numbers, ls=""), columns=8)
    return figure


@style.in_house_style
def draw_records(numbers: pd.DataFrame) -> Figure:
    """One panel per sample, one line per record."""
    groups = style.by_sample(numbers)
    figure, axes = style.panel_grid(len(groups), 50)
    for ax, (_, sample) in zip(axes, groups, strict=True):
        for number, (_, record) in enumerate(sample.groupby("test_id", sort=False)):
            ax.plot(record["value"], record["T_over_N"], lw=0.7, color=style.sample_mark(number)[0])
        first = sample.iloc[0]
        n = sample["test_id"].nunique()
        style.panel_title(ax, first["sample"], f"{n} record{'s' * (n > 1)}")
        ax.set_xlabel(sentence_case(str(first["way"])))
        if style.is_leftmost(ax):
            ax.set_ylabel("T / N")
    return figure


@style.in_house_style
def draw_oscillations(numbers: pd.DataFrame) -> Figure:
    """Drop and period side by side; marks by regime."""
    quantities = list(dict.fromkeys(numbers["quantity"]))
    figure, axes = style.panel_grid(len(quantities), 60, columns=2)
    marks = {"stick-slip": ("o", style.BLUE), "inertial oscillation": ("^", style.ORANGE), "irregular": ("x", "0.4")}
    for ax, quantity in zip(axes, quantities, strict=True):
        part = numbers[numbers["quantity"] == quantity]
        for regime, points in part.groupby("regime"):
            marker, colour = marks[str(regime)]
            ax.errorbar(points["value"], points["y"], points["y_u"].fillna(0.0), fmt=marker, color=colour, ms=4)
        ax.set_xlabel(sentence_case(str(part["label"].iloc[0])))
        ax.set_ylabel(sentence_case(quantity))
        _spread(ax, part["value"])
        ax.set_ylim(bottom=0)
    handles = [
        Line2D([], [], marker=m, color=c, ls="", label=name)
        for name, (m, c) in marks.items()
        if (numbers["regime"] == name).any()
    ]
    style.legend_below(figure, handles)
    return figure


@style.in_house_style
def draw_restarts(numbers: pd.DataFrame) -> Figure:
    """Static force over load against the time of the hold."""
    figure, (ax,) = style.panel_grid(1, 70)
    for number, points in style.by_sample(numbers):
        colour, marker = style.sample_mark(number)
        x, y, u = points["hold_s"], points["T_over_N"], points["T_over_N_u"]
        ax.errorbar(x, y, u, fmt=marker, color=colour, ms=4)
    ax.set_xlabel("Time of the hold (s)")
    ax.set_ylabel("Static T / N at the restart")
    _spread(ax, numbers["hold_s"])
    style.legend_below(figure, style.sample_handles(numbers, ls=""), columns=8)
    return figure


def _over_a_decade(values: pd.Series) -> bool:
    return float(values.min()) > 0 and float(values.max()) > 10 * float(values.min())


def _spread(ax: Axes, values: pd.Series) -> None:
    """A logarithmic axis for positive values over more than a decade."""
    if _over_a_decade(values):
        ax.set_xscale("log")
        style.plain_log_axis(ax.xaxis, values)
    else:
        ax.xaxis.set_major_locator(MaxNLocator(5, integer=bool((values % 1 == 0).all())))


def _regimes(numbers: pd.DataFrame) -> list[Line2D]:
    return [
        Line2D([], [], color="0.3", marker="o", mfc="none" if is_open else "0.3", ls="", label=name)
        for name, is_open in _OPEN.items()
        if (numbers["regime"] == name).any()
    ]


FORCES = style.StudyFigure(
    "forces",
    "Friction force against load",
    "Friction force of every test and the law chosen for each sample by loads left out of the fit. Where "
    "forces span more than a decade, both axes are logarithmic, and a power law is a straight line.",
    law_points,
    draw_forces,
)
DEPENDENCE = style.StudyFigure(
    "dependence",
    "T/N against recorded variables",
    "T/N of every test against each recorded variable that varies, with the standard uncertainty of the "
    "reading. Variables that vary together cannot be separated by looking at one panel.",
    dependence_points,
    draw_dependence,
)
RECORDS = style.StudyFigure(
    "records",
    "T/N along each record",
    "T/N against the distance slid, or against time where no speed is known: means of equal parts of each "
    "record, zero subtracted. Running-in shows as a change along the record.",
    within_records,
    draw_records,
)
OSCILLATIONS = style.StudyFigure(
    "oscillations",
    "Stick-slip and oscillation",
    "Force lost in a slip over the normal load, and period, of every test whose sliding force oscillates: "
    "medians over its cycles with standard uncertainties.",
    oscillation_points,
    draw_oscillations,
)
RESTARTS = style.StudyFigure(
    "restarts",
    "Static friction against the time of the hold",
    "Peak after each stop of the drive over the normal load, against the time the drive stood still.",
    restart_points,
    draw_restarts,
)
