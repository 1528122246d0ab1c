"""Exports under the wrong test: the numbers of one test given twice, or a header that names another test.

The exports of a campaign, read one by one or on several processes, each into traces and their pulls.

Every usable test of a campaign as a trace and a pull; what cannot be used is set aside with its reason.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tribo.campaign.rows import Columns, columns_of
from tribo.campaign.table import is_chosen, names_pulls, split_choice
from tribo.errors import CampaignError, Problem, TraceError, TriboError, unexpected
from tribo.forked import each, may_fork
from tribo.input_files import LARGEST_LOAD_N, SMALLEST_LOAD_N, hashes_of_reads
from tribo.records import Campaign, Correction, Ingested, Pull, SetAside, Test, Trace
from tribo.traces.evaluation import evaluated_pull

if TYPE_CHECKING:
    from tribo.readers import Inspection


_LABELLED = 0.9  # share of exports that name their own test from which on a header that names another one counts
_FEWEST = 5
_WORD = re.compile(r"[\w.+-]+")


def under_the_wrong_test(traces: Mapping[str, Trace], test_ids: Collection[str]) -> dict[str, Problem]:
    """The problem of each test whose trace belongs to another one; ``test_ids`` are all tests of the campaign.

    ``other_test``: its header names another test, where the headers of a campaign name their own. ``same_numbers``: its
    data are those of another test, and no header states to which test they belong; then none of them is used.
    """
    ids = frozenset(test_ids)
    named = {test_id: ids.intersection(_words(trace)) for test_id, trace in traces.items()}
    own = [test_id for test_id, words in named.items() if test_id in words]
    labelled = len(own) >= max(_FEWEST, _LABELLED * len(traces))
    found = {
        test_id: _other_test(test_id, traces[test_id], words)
        for test_id, words in named.items()
        if labelled and words and test_id not in words
    }
    for group in _same_samples(traces):
        doubtful = [test_id for test_id in group if test_id not in found]
        if len(doubtful) > 1:
            found |= {test_id: _same_numbers(test_id, traces[test_id], group) for test_id in doubtful}
    return found


def _words(trace: Trace) -> set[str]:
    return {word for pair in trace.metadata.items() for text in pair for word in _WORD.findall(text)}


def _same_samples(traces: Mapping[str, Trace]) -> list[list[str]]:
    """Tests that share every sample of time and force, in groups of two or more."""
    groups: dict[bytes, list[str]] = {}
    for test_id, trace in traces.items():
        samples = np.ascontiguousarray(np.concatenate((trace.time_s, trace.force_N)))
        groups.setdefault(hashlib.blake2b(samples.tobytes(), digest_size=16).digest(), []).append(test_id)
    return [group for group in groups.values() if len(group) > 1]


def _other_test(test_id: str, trace: Trace, words: Collection[str]) -> Problem:
    what = "the header of this export names a different test"
    return Problem("other_test", what, trace.file, found=", ".join(sorted(words)), allowed=test_id, test_id=test_id)


def _same_numbers(test_id: str, trace: Trace, group: Collection[str]) -> Problem:
    others = ", ".join(other for other in group if other != test_id)
    what = f"the data are identical to those of {others}; the correct test is not known, so none of them is used"
    return Problem("same_numbers", what, trace.file, allowed="one measurement per test", test_id=test_id)


FEWEST_FOR_PROCESSES = 100  # below, starting processes costs more than it gains
CHUNK = 16
_OFF_LOAD = 0.02  # share by which the recorded load may differ from that of the test
_OFF_SPEED = 0.2  # share by which the travel while sliding may differ from the speed of the test times the time
_UNLOADED = 0.05  # share of the largest load of an export below which a piece of it carries none

Outcome = tuple[Trace | None, Pull] | SetAside
ColumnsFor = Callable[[str], Columns]  # the columns stated for an export, by its path in the campaign
Outcomes = tuple[tuple[Test, Outcome], ...]


@dataclass(frozen=True)
class RowRead:
    """The tests of a row of tests.csv with their outcomes, and the SHA-256 of every file read for them."""

    outcomes: Outcomes
    hashes: Mapping[str, str]


def read_hashed(root: Path, columns: ColumnsFor, rule: str, test: Test) -> RowRead:
    """:func:`read_row` with the hashes of the bytes that were read, by their path in the campaign."""
    with hashes_of_reads() as found:
        outcomes = read_row(root, columns, rule, test)
    return RowRead(outcomes, {Path(p).relative_to(root).as_posix(): digest for p, digest in found.items()})


def read_row(root: Path, columns: ColumnsFor, rule: str, test: Test) -> Outcomes:
    """The tests of a row of tests.csv: usually one, or one per pull if the row selects pulls of its export.

    ``PATH#2/3`` is the third pull of the second table, ``PATH#2/*`` every pull of it, ``PATH#*`` every pull of every
    table; if a row selects several, each becomes a separate test called ``ID#2/3``. A row without a load uses
    the normal force recorded in the export.
    """
    given = evaluated_pull(test)
    if given is not None:
        return ((test, (None, given)),)
    try:
        if names_pulls(split_choice(test.file)[1]):
            return _chosen_pulls(root, columns, rule, test)
        return (_whole(root, columns, rule, test),)
    except TriboError as why:
        return ((test, _set_aside(test, why.problems)),)
    except Exception as why:  # one export must not cost the others
        return ((test, _set_aside(test, [unexpected(why, "this export cannot be evaluated", test.file)])),)


def inspect_file(path: Path, columns: Columns | None = None, correction: Correction | None = None) -> Inspection:
    """Description of an export with its pulls, each by the text that selects it in tests.csv."""
    from tribo.readers import inspect_export, read_blocks

    seen = inspect_export(path, columns=columns, correction=correction)
    if seen.refused or any(doubt.kind == "only_beginning" for doubt in seen.doubts):
        return seen
    try:
        return replace(seen, pulls=_pulls_in_words(read_blocks(path, columns=columns, correction=correction)))
    except TriboError:
        return seen


def _pulls_in_words(tables: Sequence[Trace]) -> tuple[str, ...]:
    """One line per pull; nothing where no table holds more than one."""
    from tribo.traces import load_of, split_pulls

    pieces = {f"#{t}/{p}": piece for t, table in enumerate(tables, 1) for p, piece in enumerate(split_pulls(table), 1)}
    if len(pieces) == len(tables):
        return ()
    found = []
    for choice, piece in pieces.items():
        load = load_of(piece)[0]
        under = "" if math.isnan(load) else f" under {load:.4g} N"
        middle = piece.force_N[piece.force_N.size // 4 : 3 * piece.force_N.size // 4]
        found.append(f"{choice}: {piece.time_s[0]:.6g} to {piece.time_s[-1]:.6g} s{under}, force {middle.mean():.4g} N")
    return tuple(found)


def _set_aside(test: Test, found: Sequence[Problem]) -> SetAside:
    problems = tuple(replace(p, file=test.file, test_id=test.test_id) for p in found)
    return SetAside(test.test_id, "; ".join(str(p) for p in problems), problems)


def _whole(root: Path, columns: ColumnsFor, rule: str, test: Test) -> tuple[Test, Outcome]:
    """An export, or one table of it, as one pull."""
    from tribo.readers import read_export
    from tribo.traces import read_record

    trace = read_export(
        root / test.file, columns=columns(test.file), correction=test.correction, name=test.test_id, file=test.file
    )
    pull = _without_rates(trace, read_record(trace, rule=rule, test=test))
    test = _with_load(test, pull.recorded_load_N)
    doubts = [d for d in (_several_pulls(trace), _off_speed(trace, pull, test), _other_load(pull, test)) if d]
    if doubts:
        flags, problems = (*trace.flags, *(d.kind for d in doubts)), (*trace.problems, *doubts)
        trace = replace(trace, flags=flags, problems=problems)
    return test, (trace, replace(pull, flags=tuple(dict.fromkeys((*trace.flags, *pull.flags)))))


def _without_rates(trace: Trace, pull: Pull) -> Pull:
    """The pull without what is counted per second, where path stands for time in its trace."""
    if "no_time" not in trace.flags:
        return pull
    return replace(pull, rise_N_per_s=math.nan, stick_slip_period_s=math.nan, drift_N_per_s=math.nan)


def _several_pulls(trace: Trace) -> Problem | None:
    """A doubt if a trace read as one pull holds several, recognised by steps of load or speed or by reversals."""
    from tribo.traces import split_pulls

    pieces = split_pulls(trace)
    loaded = [] if len(pieces) == 1 else [k for k, there in enumerate(_carry_load(pieces)) if there]
    if len(loaded) < 2:
        return None
    export, choice = split_choice(trace.file)
    table = choice or "1"
    what = f"this trace contains {len(loaded)} pulls but was read as one"
    allowed = f"{export}#{table}/{loaded[0] + 1} (and so on) for a single pull, {export}#{table}/* for all"
    return Problem("several_pulls", what, trace.file, allowed=allowed)


def _off_speed(trace: Trace, pull: Pull, test: Test) -> Problem | None:
    """A doubt if the displacement recorded while sliding does not match the speed given in the campaign."""
    if trace.displacement_m is None or not test.speed_m_s or math.isnan(pull.window_s[0]):
        return None
    start, end = np.searchsorted(trace.time_s, pull.window_s)
    time_s = float(trace.time_s[end] - trace.time_s[start])
    travel_m = abs(float(trace.displacement_m[end] - trace.displacement_m[start]))
    if time_s <= 0 or abs(travel_m / time_s / test.speed_m_s - 1.0) < _OFF_SPEED:
        return None
    what, found = "the displacement does not match the speed of the test", f"{travel_m / time_s * 1e3:.4g} mm/s"
    stated = f"{test.speed_m_s * 1e3:.4g} mm/s"
    slip = _unit_of_speed(test.speed_m_s * time_s / travel_m) if travel_m > 0 else ""
    allowed = f"{stated}; {slip}" if slip else stated
    return Problem("off_speed", what, trace.file, None, "displacement", found, allowed)


def _unit_of_speed(factor: float) -> str:
    """The unit that the stated speed may be in, as a question; ``factor`` is stated over recorded."""
    units = {60.0: "mm/min: divide by 60", 1e3: "um/s: divide by 1000", 1e-3: "m/s: multiply by 1000"}
    found = [words for times, words in units.items() if abs(factor / times - 1.0) < _OFF_SPEED]
    return f"does speed_mm_s hold {found[0]}?" if found else ""


def _carry_load(pieces: Sequence[Trace]) -> list[bool]:
    """Which pieces carry a load; all of them where none was recorded."""
    from tribo.traces import load_of

    loads = np.nan_to_num(np.abs([load_of(piece)[0] for piece in pieces]))
    return [bool(load >= _UNLOADED * loads.max()) for load in loads]


def _other_load(pull: Pull, test: Test) -> Problem | None:
    """A doubt if the load recorded while sliding is not the one that tests.csv gives."""
    recorded, given = pull.recorded_load_N, test.normal_load_N
    if math.isnan(recorded) or not given > 0 or abs(recorded / given - 1.0) < _OFF_LOAD:
        return None
    what, found = "the normal load recorded while sliding differs from that of the test", f"{recorded:.4g} N"
    return Problem("off_load", what, test.file, None, "normal force", found, f"about {given:.4g} N, which is used")


def _with_load(test: Test, load: float) -> Test:
    """The test with the ``load`` of its trace where tests.csv gives none.

    Raises
    ------
    TraceError
        ``no_load``: neither gives it.
    """
    if not math.isnan(test.normal_load_N):
        return test
    if not SMALLEST_LOAD_N <= load <= LARGEST_LOAD_N:
        found = None if math.isnan(load) else f"{load:.4g} N"
        what, allowed = "neither tests.csv nor the export gives the normal load", "normal_load_N in tests.csv"
        raise TraceError(Problem("no_load", what, found=found, allowed=allowed))
    return replace(test, normal_load_N=load)


def _chosen_pulls(root: Path, columns: ColumnsFor, rule: str, test: Test) -> tuple[tuple[Test, Outcome], ...]:
    """Every pull that the choice of a test means, as a test of its own; all strokes of an export share one zero."""
    from tribo.readers import read_blocks
    from tribo.traces import orient_strokes, split_pulls
    from tribo.traces.evaluation import read_pieces

    export, choice = split_choice(test.file)
    tables = read_blocks(
        root / export, columns=columns(test.file), correction=test.correction, name=test.test_id, file=test.file
    )
    pieces = {f"{t}/{p}": piece for t, table in enumerate(tables, 1) for p, piece in enumerate(split_pulls(table), 1)}
    strokes = orient_strokes(list(pieces.values()))
    loaded = dict(zip(pieces, _carry_load(strokes.traces), strict=True))
    chosen = [address for address in pieces if is_chosen(address, choice) and (loaded[address] or "*" not in choice)]
    if not chosen:
        what, allowed = f"no such pull; the export has {len(pieces)}", f"{export}#*, or {', '.join(pieces)} after the #"
        raise TraceError(Problem("no_such_pull", what, found=choice, allowed=allowed))
    zero = 0.0 if math.isnan(strokes.zero_N) else strokes.zero_N
    found = []
    read = read_pieces(strokes, rule=rule, test=test)
    for address, piece, sign, pull in zip(pieces, strokes.traces, strokes.directions, read, strict=True):
        if address in chosen:
            name = f"{test.test_id}#{address}" if "*" in choice else test.test_id
            one = replace(test, test_id=name, file=f"{export}#{address}")
            found.append(_one_of_several(one, piece, sign * zero, pull))
    left_out = [address for address in pieces if is_chosen(address, choice) and not loaded[address]]
    return _with_note(tuple(found), left_out if "*" in choice else [])


def _one_of_several(test: Test, piece: Trace, zero_N: float, pull: Pull | TraceError) -> tuple[Test, Outcome]:
    """One pull of an export; the trace keeps its zero, as one that was read alone does."""
    if isinstance(pull, TraceError):
        return test, _set_aside(test, pull.problems)
    from tribo.traces import load_of

    try:
        test = _with_load(test, load_of(piece)[0])
    except TraceError as why:
        return test, _set_aside(test, why.problems)
    trace = replace(piece, name=test.test_id, file=test.file, force_N=piece.force_N + zero_N)
    flags = tuple(dict.fromkeys((*trace.flags, *pull.flags)))
    pull = _without_rates(trace, pull)
    return test, (trace, replace(pull, test_id=test.test_id, zero_N=zero_N or pull.zero_N, flags=flags))


def _with_note(found: tuple[tuple[Test, Outcome], ...], left_out: Sequence[str]) -> tuple[tuple[Test, Outcome], ...]:
    """The pulls of an export, the first with a doubt that names the pieces left out because they carry no load."""
    first = next((k for k, (_, outcome) in enumerate(found) if not isinstance(outcome, SetAside)), None)
    if not left_out or first is None:
        return found
    test, outcome = found[first]
    assert not isinstance(outcome, SetAside)
    trace, pull = outcome
    assert trace is not None
    doubt = Problem("unloaded", f"parts without normal load left out: {', '.join(left_out)}", test.file)
    trace = replace(trace, problems=(*trace.problems, doubt))
    return *found[:first], (test, (trace, pull)), *found[first + 1 :]


def read_all(campaign: Campaign, rule: str, jobs: int = 1) -> Iterator[RowRead]:
    """The tests of every row with their outcomes, in the order of the campaign."""
    columns = partial(columns_of, general=campaign.columns, by_file=campaign.columns_by_file)
    read = partial(read_hashed, campaign.root, columns, rule)
    if jobs == 1 or len(campaign.tests) < FEWEST_FOR_PROCESSES or not may_fork():
        yield from map(read, campaign.tests)
        return
    read(campaign.tests[0])  # what it imports is then in every process
    yield from each(read, campaign.tests, jobs, CHUNK)


Progress = Callable[[str, int, int], None]


def ingest_campaign(campaign: Campaign, rule: str, jobs: int, progress: Progress) -> Ingested:
    """Read every usable test of a campaign on ``jobs`` processes where that pays; the result does not depend on them.

    Raises
    ------
    CampaignError
        No test could be read.
    """

    traces: dict[str, Trace] = {}
    pulls: dict[str, Pull] = {}
    set_aside = list(campaign.set_aside)
    tests: list[Test] = []
    inputs = dict(campaign.inputs)
    for done, row in enumerate(read_all(campaign, rule, jobs), start=1):
        inputs |= row.hashes
        for test, outcome in row.outcomes:
            tests.append(test)
            if isinstance(outcome, SetAside):
                set_aside.append(outcome)
            else:
                trace, pulls[test.test_id] = outcome
                if trace is not None:
                    traces[test.test_id] = trace
        progress("reading exports", done, len(campaign.tests))
    ids = {test.test_id for test in tests} | {fault.test_id for fault in set_aside}
    for test_id, problem in under_the_wrong_test(traces, ids).items():
        del traces[test_id], pulls[test_id]
        set_aside.append(SetAside(test_id, str(problem), (problem,)))
    if not pulls:
        raise CampaignError(
            [p for fault in set_aside for p in fault.problems]
            or [Problem("no_usable_test", "no test of this campaign is usable", file=str(campaign.root))]
        )
    return Ingested(replace(campaign, tests=tuple(tests), inputs=inputs), traces, pulls, tuple(set_aside))
