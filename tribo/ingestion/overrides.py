"""overrides.csv: decisions made by hand about single pulls, checked against the campaign and applied."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from tribo.campaign.table import Table, TestRow, read_table
from tribo.errors import CampaignError, Problem, system_problem
from tribo.files import LEADS_OUT, leads_out
from tribo.ingestion.exports import read_row, stated_columns
from tribo.input_files import hashes_of_reads
from tribo.records import ByHand, Ingested, Override, SetAside, Trace
from tribo.user_text import did_you_mean

TIMES = ("window_start_s", "window_end_s", "peak_s")
COLUMNS = ("test_id", "action", "reason", *TIMES)
ACTIONS = ("exclude", "move")
FEWEST_IN_WINDOW = 10
OVERRIDES = "--overrides"  # among the inputs of a campaign; no file of a campaign has this name


def apply_overrides(ingested: Ingested, path: Path, rule: str) -> Ingested:
    """The campaign with overrides.csv applied: pulls excluded, static peaks and windows moved.

    Columns: test_id, action (``exclude`` or ``move``), reason, window_start_s, window_end_s, peak_s; times on the
    clock of the trace. A pull excluded is set aside with its reason; a moved one is read again from its export by the
    same rule, with the given peak or window. The automatic results of both are kept in ``by_hand``.

    Raises
    ------
    CampaignError
        All errors of the table at once, with row and column; or no test is left.
    """
    with hashes_of_reads() as hashes:
        overrides = read_overrides(path, ingested)
    known = [o for o in overrides if o.test_id in ingested.pulls]  # what is set aside already stays so
    by_hand = {
        o.test_id: ByHand(o, ingested.traces[o.test_id], ingested.pulls[o.test_id])
        for o in known
        if o.test_id in ingested.traces
    }
    left_out = tuple(
        SetAside(o.test_id, f"excluded by hand in {path.name}: {o.reason}") for o in known if o.action == "exclude"
    )
    gone = {s.test_id for s in left_out}
    pulls = {i: p for i, p in ingested.pulls.items() if i not in gone}
    if not pulls:
        raise CampaignError(Problem("no_usable_test", "all tests are excluded", file=path.name))
    tests = {t.test_id: t for t in ingested.campaign.tests}
    columns = stated_columns(ingested.campaign)
    problems: list[Problem] = []
    for o in known:
        if o.action == "move":
            ((_, outcome),), _ = read_row(ingested.campaign.root, columns, rule, tests[o.test_id], o)
            if isinstance(outcome, SetAside):
                problems += outcome.problems
            else:
                pulls[o.test_id] = outcome[1]
    if problems:
        raise CampaignError(problems)
    traces = {i: t for i, t in ingested.traces.items() if i not in gone}
    inputs = {**ingested.campaign.inputs, **dict.fromkeys([OVERRIDES], *hashes.values())}
    return replace(
        ingested, campaign=replace(ingested.campaign, inputs=inputs), traces=traces, pulls=pulls,
        set_aside=(*ingested.set_aside, *left_out), by_hand=by_hand,
    )  # fmt: skip


def read_overrides(path: Path, ingested: Ingested) -> tuple[Override, ...]:
    """The rows of overrides.csv, checked against the tests and traces of a campaign.

    Raises
    ------
    CampaignError
        With every fault at once: an unknown test, action or column, a number that is none, a time outside the trace.
        Or the file is a link that leads out of its folder.
    """
    file = path.name
    if leads_out(path.parent, path):
        raise CampaignError(Problem("link", LEADS_OUT, file=file))
    try:
        table = read_table(path, file)
    except FileNotFoundError:
        raise CampaignError(Problem("missing_file", "this file does not exist", file=str(path))) from None
    except OSError as why:
        raise CampaignError(system_problem(why, str(path))) from None
    if table is None:
        raise CampaignError(Problem("empty", "the file has no header", file=file, allowed=",".join(COLUMNS)))
    if faults := list(_header_faults(table, file)):
        raise CampaignError(faults)
    traces: dict[str, Trace | None] = dict.fromkeys([s.test_id for s in ingested.set_aside])
    traces |= {t.test_id: ingested.traces.get(t.test_id) for t in ingested.campaign.tests}
    elsewhere = ingested.pulls.keys() - ingested.traces.keys()
    first: dict[str, int] = {}
    problems: list[Problem] = []
    overrides = []
    for row in table.rows:
        if row.test_id in first:
            what = f"this test already occurs in row {first[row.test_id]}"
            found = Problem("duplicate_row", what, file, row.row, "test_id", row.test_id, "one row per test")
            problems.append(found)
        first.setdefault(row.test_id, row.row)
        times, faults = _times(row, file)
        faults += _row_faults(row, file, traces, elsewhere, None if faults else times)
        faults = [row.fault] if row.fault else faults
        problems += faults
        if not faults:
            window = (times["window_start_s"], times["window_end_s"]) if "window_start_s" in times else None
            action: Literal["exclude", "move"] = "exclude" if row.cells["action"] == "exclude" else "move"
            reason = row.cells.get("reason", "")
            overrides.append(Override(row.cells["test_id"], action, reason, window, times.get("peak_s"), row.row))
    if problems:
        raise CampaignError(problems)
    return tuple(overrides)


def _header_faults(table: Table, file: str) -> Iterator[Problem]:
    for name in COLUMNS[:2]:
        if name not in table.names:
            yield Problem("missing_column", "this required column is missing", file, table.header_row, name,
                          ", ".join(table.names))  # fmt: skip
    for name in dict.fromkeys(table.names):
        if name not in COLUMNS:
            yield Problem("unknown_column", "unknown column", file, table.header_row, name, name,
                          did_you_mean(name, COLUMNS) or ", ".join(COLUMNS))  # fmt: skip
        elif table.names.count(name) > 1:
            yield Problem("duplicate_column", "this column occurs twice", file, table.header_row, name)


def _times(row: TestRow, file: str) -> tuple[dict[str, float], list[Problem]]:
    """The times given, in seconds, and the cells that hold none."""
    found, problems = {}, []
    for column in TIMES:
        cell = row.cells.get(column, "")
        try:
            value = float(cell.replace(",", ".") if row.decimal_comma else cell) if cell else math.nan
            if cell and ("_" in cell or not math.isfinite(value)):
                raise ValueError(cell)
        except ValueError:
            problems.append(Problem("not_a_number", "not a time", file, row.row, column, cell, "a number of seconds"))
            continue
        if cell:
            found[column] = value
    return found, problems


def _row_faults(
    row: TestRow,
    file: str,
    traces: Mapping[str, Trace | None],
    elsewhere: Collection[str],
    times: Mapping[str, float] | None,
) -> Iterator[Problem]:
    """Faults of a row; ``times`` are None where one of them is none, ``elsewhere`` the tests evaluated elsewhere."""
    test_id, action = row.cells.get("test_id", ""), row.cells.get("action", "")
    if test_id not in traces:
        hint = "; ".join(filter(None, ("a test of this campaign", did_you_mean(test_id, traces, 0.5))))
        yield Problem("unknown_test", "no test has this test_id", file, row.row, "test_id", test_id, hint)
    if action not in ACTIONS:
        hint = did_you_mean(action, ACTIONS) or " or ".join(ACTIONS)
        yield Problem("unknown_action", "unknown action", file, row.row, "action", action, hint)
    if action == "exclude":
        if not row.cells.get("reason"):
            yield Problem("no_reason", "an excluded test needs a reason", file, row.row, "reason", "", "a short text")
        for column in TIMES:
            if cell := row.cells.get(column):
                what = "an excluded test cannot have a peak or window"
                yield Problem("unused_cell", what, file, row.row, column, cell, "an empty cell")
    elif action == "move" and test_id in elsewhere:
        what = "the forces of this test were evaluated elsewhere, so it has no peak and no window to move"
        yield Problem("no_trace", what, file, row.row, "action", action, "exclude")
    elif action == "move" and times is not None:
        yield from _move_faults(row, file, times, traces.get(test_id))


def _move_faults(row: TestRow, file: str, times: Mapping[str, float], trace: Trace | None) -> Iterator[Problem]:
    start, end = times.get("window_start_s"), times.get("window_end_s")
    if not times:
        what = "neither a peak nor a window is given"
        yield Problem("nothing_moved", what, file, row.row, None, None, "window_start_s and window_end_s, or peak_s")
    if (start is None) != (end is None):
        column = "window_start_s" if start is None else "window_end_s"
        yield Problem("half_a_window", "a window needs start and end", file, row.row, column, "", "seconds")
    if start is not None and end is not None and not start < end:
        found = row.cells["window_end_s"]
        yield Problem("window_reversed", "the window must end after its start", file, row.row, "window_end_s", found,
                      f"more than {start:g}")  # fmt: skip
        return
    if trace is None:
        return
    first, last = float(trace.time_s[0]), float(trace.time_s[-1])
    for column, value in times.items():
        if not first <= value <= last:
            what = "this time is outside the recorded trace"
            yield Problem("outside_trace", what, file, row.row, column, row.cells[column], f"{first:g} to {last:g}")
    if start is not None and end is not None:
        inside = np.count_nonzero((trace.time_s >= start) & (trace.time_s <= end))
        if inside < FEWEST_IN_WINDOW:
            yield Problem("window_short", "too few data points in this window", file, row.row, "window_end_s",
                          f"{inside} data points", f"at least {FEWEST_IN_WINDOW}")  # fmt: skip
