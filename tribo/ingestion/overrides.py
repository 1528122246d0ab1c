"""overrides.csv: decisions made by hand about single pulls, checked against the campaign and applied."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from tribo.campaign.table import TestRow, read_table
from tribo.errors import CampaignError, Problem, system_problem
from tribo.files import LEADS_OUT, leads_out
from tribo.ingestion.exports import options_of, read_row, stated_columns
from tribo.input_files import hashes_of_reads
from tribo.records import PHASES, Ingested, Override, Phase, Pull, SetAside, Trace
from tribo.traces.evaluation import unread
from tribo.user_text import did_you_mean

TIMES = ("window_start_s", "window_end_s", "peak_s")
OF_PHASE = ("start_s", "end_s")
OF_EVENT = ("fail_s", "end_s")
COLUMNS = ("test_id", "action", "reason", *TIMES, "phase", *OF_PHASE, "event", "fail_s")
ACTIONS: tuple[Literal["exclude", "move", "phase", "event"], ...] = ("exclude", "move", "phase", "event")
LEFT_ASIDE = {"same_numbers", "other_test"}  # an export that belongs to another test; no decision changes that
FEWEST_IN_WINDOW = 10
OVERRIDES = "--overrides"  # among the inputs of a campaign; no file of a campaign has this name


def apply_overrides(ingested: Ingested, path: Path, rule: str) -> Ingested:
    """The campaign with overrides.csv applied: pulls excluded, static peaks and windows moved.

    Columns: test_id, action (``exclude``, ``move``, ``phase`` or ``event``), reason, window_start_s, window_end_s,
    peak_s, for a phase its name, start_s and end_s, and for a slip its number in events.csv and the times fail_s and
    end_s; times on the clock of the trace. A pull excluded is set aside with its reason; a moved one, or one with
    phases or slips stated, is read again from its export by the same rule, also where it had been set
    aside. The automatic results are kept in ``by_hand``.

    Raises
    ------
    CampaignError
        All errors of the table at once, with row and column; or no test is left.
    """
    with hashes_of_reads() as hashes:
        overrides = read_overrides(path, ingested)
    excluded = {o.test_id: o.reason for o in overrides if o.action == "exclude"}
    left_out = tuple(SetAside(i, f"excluded by hand in {path.name}: {reason}") for i, reason in excluded.items())
    pulls = {i: p for i, p in ingested.pulls.items() if i not in excluded}
    if not pulls:
        raise CampaignError(Problem("no_usable_test", "all tests are excluded", file=path.name))
    tests = {t.test_id: t for t in ingested.campaign.tests}
    columns, options = stated_columns(ingested.campaign), options_of(ingested.campaign, rule)
    problems: list[Problem] = []
    traces = {i: t for i, t in ingested.traces.items() if i not in excluded}
    read: dict[str, Override] = {}
    for o in overrides:
        if o.action == "exclude":
            continue
        outcomes, _ = read_row(ingested.campaign.root, columns, options, tests[o.test_id], o)
        for test, outcome in outcomes:
            if isinstance(outcome, SetAside):
                problems += outcome.problems
                continue
            trace, pulls[test.test_id] = outcome
            if trace is not None:
                traces[test.test_id] = trace
            read[o.test_id] = replace(o, trace=trace)
    if problems:
        raise CampaignError(problems)
    by_hand = {o.test_id: o for o in (read.get(o.test_id, o) for o in overrides) if o.trace is not None}
    aside = tuple(s for s in ingested.set_aside if s.test_id not in pulls)
    inputs = {**ingested.campaign.inputs, **dict.fromkeys([OVERRIDES], *hashes.values())}
    return replace(
        ingested, campaign=replace(ingested.campaign, inputs=inputs), traces=traces, pulls=pulls,
        set_aside=(*aside, *left_out), by_hand=by_hand,
    )  # fmt: skip


def read_overrides(path: Path, ingested: Ingested) -> tuple[Override, ...]:
    """The rows of overrides.csv, checked against the tests and traces of a campaign; what is set aside stays so.

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
        names, header_row, rows = read_table(path, file)
    except FileNotFoundError:
        raise CampaignError(Problem("missing_file", "this file does not exist", file=str(path))) from None
    except OSError as why:
        raise CampaignError(system_problem(why, str(path))) from None
    if not names:
        raise CampaignError(Problem("empty", "the file has no header", file=file, allowed=",".join(COLUMNS)))
    place, listed = (file, header_row), ", ".join(names)
    problems = [
        Problem("missing_column", "this required column is missing", *place, name, listed)
        for name in COLUMNS[:2]
        if name not in names
    ]
    for name in dict.fromkeys(names):
        if name not in COLUMNS:
            hint = did_you_mean(name, COLUMNS) or ", ".join(COLUMNS)
            problems.append(Problem("unknown_column", "unknown column", *place, name, name, hint))
        elif names.count(name) > 1:
            problems.append(Problem("duplicate_column", "this column occurs twice", *place, name))
    if problems:
        raise CampaignError(problems)
    traces: dict[str, Trace | None] = dict.fromkeys([s.test_id for s in ingested.set_aside])
    traces |= {t.test_id: ingested.traces.get(t.test_id) for t in ingested.campaign.tests}
    read_again = {s.test_id for s in ingested.set_aside if not {p.kind for p in s.problems} & LEFT_ASIDE and s.problems}
    read_again &= {t.test_id for t in ingested.campaign.tests}
    first: dict[str, TestRow] = {}
    stated: dict[str, list[str]] = {}  # the actions of the rows of a test so far
    found: dict[str, Override] = {}
    for row in rows:
        test_id, action = row.test_id, row.cells.get("action", "")
        before = stated.setdefault(test_id, [])
        others = {*before, action}
        beside_slips = "exclude" not in others and (action == "event" or set(before) == {"event"})
        again = bool(before) and others != {"phase"} and not beside_slips
        before.append(action)
        if again:
            what = f"this test already occurs in row {first[test_id].row}"
            allowed = "one row per test, or one per phase, and one per event"
            problems.append(Problem("duplicate_row", what, file, row.row, "test_id", test_id, allowed))
        first.setdefault(test_id, row)
        times, faults = _times(row)
        faults += _row_faults(row, traces, ingested, None if faults else times)
        faults = [row.fault] if row.fault else faults
        problems += faults
        if faults or again or not (test_id in ingested.pulls or (test_id in read_again and action != "exclude")):
            continue
        reason = row.cells.get("reason", "")
        made = found.get(test_id)
        if made is None:
            automatic = ingested.pulls.get(test_id) or unread(test_id)
            made = Override(test_id, "event", automatic, traces[test_id], reason)
        elif reason not in made.reason:
            made = replace(made, reason=f"{made.reason}; {reason}".removeprefix("; "))
        if action != "event":
            window = (times["window_start_s"], times["window_end_s"]) if "window_start_s" in times else None
            made = replace(
                made, action=next(a for a in ACTIONS if a == action), window_s=window, peak_s=times.get("peak_s")
            )
        if action == "phase":
            phase = Phase(row.cells["phase"], times["start_s"], times["end_s"])
            made = replace(made, phases=(*made.phases, phase))
        if action == "event":
            fail, end = (times.get(column, math.nan) for column in OF_EVENT)
            made = replace(made, slips=(*made.slips, (int(row.cells.get("event") or 0), fail, end)))
        found[test_id] = made
    if problems:
        raise CampaignError(problems)
    return tuple(found.values())


def _times(row: TestRow) -> tuple[dict[str, float], list[Problem]]:
    """The times given, in seconds, and the cells that hold none."""
    found, problems = {}, []
    for column in (*TIMES, *OF_PHASE, "fail_s"):
        cell = row.cells.get(column, "")
        try:
            value = float(cell.replace(",", ".") if row.decimal_comma else cell) if cell else math.nan
            if cell and ("_" in cell or not math.isfinite(value)):
                raise ValueError(cell)
        except ValueError:
            place = (row.file, row.row, column, cell)
            problems.append(Problem("not_a_number", "not a time", *place, "a number of seconds"))
            continue
        if cell:
            found[column] = value
    return found, problems


def _row_faults(
    row: TestRow, traces: Mapping[str, Trace | None], ingested: Ingested, times: Mapping[str, float] | None
) -> Iterator[Problem]:
    """Faults of a row; ``times`` are None where one of them is none."""
    test_id, action, place = row.cells.get("test_id", ""), row.cells.get("action", ""), (row.file, row.row)
    if test_id not in traces:
        hint = "; ".join(filter(None, ("a test of this campaign", did_you_mean(test_id, traces, 0.5))))
        yield Problem("unknown_test", "no test has this test_id", *place, "test_id", test_id, hint)
    if action not in ACTIONS:
        hint = did_you_mean(action, ACTIONS) or " or ".join(ACTIONS)
        yield Problem("unknown_action", "unknown action", *place, "action", action, hint)
    if action == "exclude":
        if not row.cells.get("reason"):
            yield Problem("no_reason", "an excluded test needs a reason", *place, "reason", "", "a short text")
        for column in TIMES:
            if cell := row.cells.get(column):
                what = "an excluded test cannot have a peak or window"
                yield Problem("unused_cell", what, *place, column, cell, "an empty cell")
    elif action in ("move", "phase", "event") and test_id in ingested.pulls and test_id not in ingested.traces:
        what = "the forces of this test were evaluated elsewhere, so it has no peak and no window to move"
        yield Problem("no_trace", what, *place, "action", action, "exclude")
    elif action == "move" and times is not None:
        yield from _move_faults(row, times, traces.get(test_id))
    elif action == "phase" and times is not None:
        yield from _phase_faults(row, times, traces.get(test_id))
    elif action == "event" and times is not None:
        yield from _event_faults(row, times, traces.get(test_id), ingested.pulls.get(test_id))


def _phase_faults(row: TestRow, times: Mapping[str, float], trace: Trace | None) -> Iterator[Problem]:
    place, name = (row.file, row.row), row.cells.get("phase", "")
    if name not in PHASES:
        hint = did_you_mean(name, PHASES) or ", ".join(PHASES)
        yield Problem("unknown_phase", "no such phase", *place, "phase", name, hint)
    if missing := [column for column in OF_PHASE if column not in times]:
        yield Problem("half_a_window", "a phase needs start and end", *place, missing[0], "", "seconds")
        return
    if not times["start_s"] < times["end_s"]:
        found, allowed = row.cells["end_s"], f"more than {times['start_s']:g}"
        yield Problem("window_reversed", "the phase must end after its start", *place, "end_s", found, allowed)
    yield from _outside(row, {column: times[column] for column in OF_PHASE}, trace)


def _event_faults(
    row: TestRow, times: Mapping[str, float], trace: Trace | None, pull: Pull | None
) -> Iterator[Problem]:
    """A number alone removes a slip, two times alone add one, all three move it."""
    place, cell = (row.file, row.row), row.cells.get("event", "")
    count = len(pull.slips) if pull else 0
    if cell and not (cell.isdecimal() and 1 <= int(cell) <= count):
        allowed = f"1 to {count}, as in events.csv" if count else "no number: this test has no slips"
        yield Problem("unknown_event", "the test has no slip of this number", *place, "event", cell, allowed)
    given = [column for column in OF_EVENT if column in times]
    if len(given) == 1 or not (given or cell):
        missing = next(column for column in OF_EVENT if column not in times)
        yield Problem(
            "half_a_slip", "a slip needs the times of its failure and its end", *place, missing, "", "seconds"
        )
    if not row.cells.get("reason"):
        yield Problem("no_reason", "a slip changed by hand needs a reason", *place, "reason", "", "a short text")
    if len(given) == 2:
        if not times["fail_s"] < times["end_s"]:
            found, allowed = row.cells["end_s"], f"more than {times['fail_s']:g}"
            yield Problem("window_reversed", "the slip must end after its failure", *place, "end_s", found, allowed)
            return
        yield from _outside(row, {column: times[column] for column in OF_EVENT}, trace)


def _move_faults(row: TestRow, times: Mapping[str, float], trace: Trace | None) -> Iterator[Problem]:
    place = row.file, row.row
    start, end = times.get("window_start_s"), times.get("window_end_s")
    if not times:
        what = "neither a peak nor a window is given"
        yield Problem("nothing_moved", what, *place, None, None, "window_start_s and window_end_s, or peak_s")
    if (start is None) != (end is None):
        column = "window_start_s" if start is None else "window_end_s"
        yield Problem("half_a_window", "a window needs start and end", *place, column, "", "seconds")
    if start is not None and end is not None and not start < end:
        found, allowed = row.cells["window_end_s"], f"more than {start:g}"
        yield Problem("window_reversed", "the window must end after its start", *place, "window_end_s", found, allowed)
        return
    yield from _outside(row, {column: times[column] for column in TIMES if column in times}, trace)
    if trace is not None and start is not None and end is not None:
        inside = np.count_nonzero((trace.time_s >= start) & (trace.time_s <= end))
        if inside < FEWEST_IN_WINDOW:
            found, allowed = f"{inside} data points", f"at least {FEWEST_IN_WINDOW}"
            yield Problem("window_short", "too few data points in this window", *place, "window_end_s", found, allowed)


def _outside(row: TestRow, times: Mapping[str, float], trace: Trace | None) -> Iterator[Problem]:
    """Times that lie outside of a trace; none where it could not be read so far."""
    if trace is None:
        return
    first, last = float(trace.time_s[0]), float(trace.time_s[-1])
    for column, value in times.items():
        if not first <= value <= last:
            what = "this time is outside the recorded trace"
            allowed = f"{first:g} to {last:g}"
            yield Problem("outside_trace", what, row.file, row.row, column, row.cells[column], allowed)
