"""The exports of a campaign, each into tests with their traces and pulls; what cannot be used is set aside.

A row of tests.csv is read on its own, one by one or on several processes. An export that stands under the wrong test,
because its numbers are given twice or its header names another test, is set aside at the end.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tribo.campaign.rows import Columns, columns_of
from tribo.campaign.table import WHOLE, is_chosen, names_pulls, split_choice
from tribo.errors import CampaignError, Problem, TraceError, TriboError, unexpected
from tribo.forked import each, may_fork
from tribo.input_files import LARGEST_LOAD_N, SMALLEST_LOAD_N, hashes_of_reads
from tribo.records import UNCORRECTED, Campaign, Correction, Ingested, Override, Pull, SetAside, Test, Trace

if TYPE_CHECKING:
    from tribo.readers import Inspection
    from tribo.traces import PullOptions

FEWEST_FOR_PROCESSES = 100  # below, starting processes costs more than it gains
CHUNK = 16
_DISTURBED = 0.03  # share by which load and speed differ at the most, and of a record, where a slide was only disturbed
_LABELLED = 0.9  # share of exports that name their own test from which on a header that names another one counts
_FEWEST = 5
_LEVELS_DIFFER = 0.2  # share by which the highest level of a speed or load exceeds the lowest where they make a ladder
_WORD = re.compile(r"[\w.+-]+")

Progress = Callable[[str, int, int], None]
ColumnsFor = Callable[[str], Columns]  # the columns stated for an export, by its path in the campaign
Outcome = tuple[Trace | None, Pull] | SetAside
Outcomes = tuple[tuple[Test, Outcome], ...]


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
    read = partial(read_row, campaign.root, stated_columns(campaign), options_of(campaign, rule))
    rows: Iterator[tuple[Outcomes, dict[str, str]]] = map(read, campaign.tests)
    if jobs > 1 and len(campaign.tests) >= FEWEST_FOR_PROCESSES and may_fork():
        read(campaign.tests[0])  # what it imports is then in every process
        rows = each(read, campaign.tests, jobs, CHUNK)
    for done, (outcomes, hashes) in enumerate(rows, start=1):
        inputs |= hashes
        for test, outcome in outcomes:
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


def with_readings(ingested: Ingested) -> Ingested:
    """A campaign with the readings of each of its records and the features of each trace, from its pulls as they stand.

    The tests that come from one table of an export are the parts of one record.
    """
    from tribo.traces.features import features_of
    from tribo.traces.readings import Part, readings_of

    features = {}
    records: dict[tuple[str, str], list[Part]] = {}
    for test in ingested.campaign.tests:
        trace, pull = ingested.traces.get(test.test_id), ingested.pulls.get(test.test_id)
        if trace is not None and pull is not None:
            export, choice = split_choice(test.file)
            records.setdefault((export, choice.partition("/")[0]), []).append(Part(test, trace, pull))
            features[test.test_id] = features_of(trace, pull, test.speed_m_s)
    found = [
        reading
        for parts in records.values()
        for reading in readings_of(parts, _viscosity_Pa_s(parts[0].test, ingested.campaign))
    ]
    return replace(ingested, readings=tuple(found), features=features)


def _viscosity_Pa_s(test: Test, campaign: Campaign) -> float:
    """Viscosity of the lubricant, by the row of a test, else by campaign.toml; NaN where neither states one."""
    try:
        return 1e-3 * float(test.covariates["viscosity_mPa_s"])
    except (KeyError, ValueError):
        return math.nan if campaign.viscosity_Pa_s is None else campaign.viscosity_Pa_s


def stated_columns(campaign: Campaign) -> ColumnsFor:
    """The columns that a campaign states for each of its exports."""
    return partial(columns_of, general=campaign.columns, by_file=campaign.columns_by_file)


def options_of(campaign: Campaign, rule: str) -> PullOptions:
    """How every trace of a campaign is read."""
    from tribo.traces import PullOptions

    return PullOptions(rule, contact=campaign.contact)


def read_row(
    root: Path, columns: ColumnsFor, options: PullOptions, test: Test, by_hand: Override | None = None
) -> tuple[Outcomes, dict[str, str]]:
    """The tests of a row of tests.csv with their outcomes, and the SHA-256 of every file read for them, by its path.

    Usually a row is one test, or one per pull if it selects pulls of its export: ``PATH#2/3`` is the third pull of the
    second table, ``PATH#2/*`` every pull of it, ``PATH#*`` every pull of every table; if it selects several, each
    becomes a separate test called ``ID#2/3``. A row without a load uses the normal force recorded in the export. A test
    that cannot be read is set aside with its problems.
    """
    from tribo.traces import evaluate

    options = replace(options, test=test)
    if by_hand is not None:
        options = replace(
            options, peak_s=by_hand.peak_s, window_s=by_hand.window_s, phases=by_hand.phases, slips=by_hand.slips
        )
    outcomes: list[tuple[Test, Outcome]] = []
    measured: list[tuple[Trace | None, PullOptions]] = [(None, options)]
    with hashes_of_reads() as read:
        try:
            export, choice = split_choice(test.file)
            if names_pulls(choice):
                measured = [*_chosen(root / export, choice, columns(test.file), test, options).values()]
            elif test.evaluated is None:
                trace = _whole(root / test.file, columns(test.file), test.correction, test.test_id, test.file)
                measured = _levels(trace, options) or [(trace, options)]
            for one, own in measured:
                this = own.test or test
                try:
                    pull = evaluate(one, own)
                    outcomes.append((this if one is None else _with_load(this, pull.recorded_load_N), (one, pull)))
                except TraceError as why:  # strokes that were read as one pull may be why
                    several = [p for p in (one.problems if one else ()) if p.kind == "several_pulls"]
                    outcomes.append((this, _set_aside(this, [*why.problems, *several])))
        except TriboError as why:
            outcomes = [(test, _set_aside(test, why.problems))]
        except Exception as why:  # one export must not cost the others
            outcomes = [(test, _set_aside(test, [unexpected(why, "this export cannot be evaluated", test.file)]))]
    return tuple(outcomes), {Path(p).relative_to(root).as_posix(): digest for p, digest in read.items()}


def read_pull(
    source: Trace | Path | str,
    *,
    rule: str = "first_peak",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
    zero: tuple[float, float] | None = None,
    peak_s: float | None = None,
    window_s: tuple[float, float] | None = None,
    columns: Columns | None = None,
) -> Pull:
    """Static and sliding friction of one export or trace, on the road that every test of a campaign takes.

    Parameters
    ----------
    source : Trace, Path or str
        A trace, or an export: ``"raw/a.csv"``, or ``"raw/a.csv#1/2"`` for the second pull of its first table.
    rule : str
        How static and sliding friction are defined: an entry of ``tribo.traces.RULES``.
    test : Test, optional
        Gives the pull its id, and states speed, load, stiffness and zeros.
    parameters : Mapping[str, float], optional
        Replace those of the rule: ``length_m``, ``skip_m``, ``share``, ``start_s``.
    zero : (float, float), optional
        Zero of the force and its standard uncertainty (N), where they are known otherwise than from the record.
    peak_s, window_s : float and (float, float), optional
        A static peak and a sliding window chosen by hand, on the clock of the record (s). The peak is then searched for
        within two data points of ``peak_s``; the flags state what was chosen by hand.
    columns : mapping, optional
        What the columns of the export are, as for :func:`tribo.read_export`.

    Returns
    -------
    Pull
        Forces in N above the zero. The standard uncertainties (k = 1) include the scatter of the signal with its
        correlation, that of the zero, and the drift since the zero was measured, estimated from the drift while
        sliding; that of the static peak also the difference between a sharp and a rounded peak where the data do not
        tell. NaN where the record does not determine a number.

    Raises
    ------
    ReadError
        The export cannot be read.
    TraceError
        The rule is unknown, no single pull is chosen, or the record holds no friction force; every problem is listed.

    Examples
    --------
    >>> import tribo
    >>> pull = tribo.read_pull(tribo.data_dir() / "example" / "raw" / "T001.csv")
    >>> pull.rule, pull.flags
    ('first_peak', ())
    """
    from tribo.traces import PullOptions, evaluate
    from tribo.traces.loading import Zero

    known = Zero(*zero, "known otherwise") if zero is not None else None
    options = PullOptions(rule, parameters, test, known, peak_s=peak_s, window_s=window_s)
    if isinstance(source, Trace):
        return evaluate(source, options)
    path, choice = split_choice(str(source))
    if not names_pulls(choice):
        return evaluate(_whole(source, columns), options)
    pulls = _chosen(Path(path), choice, columns, test, options)
    if len(pulls) > 1:
        what = "several pulls are chosen, and read_pull reads one"
        raise TraceError(Problem("several_pulls", what, path, found=choice, allowed=f"one of {', '.join(pulls)}"))
    ((trace, own),) = pulls.values()
    return evaluate(trace, own)


def _whole(
    path: Path | str,
    columns: Columns | None,
    correction: Correction = UNCORRECTED,
    name: str | None = None,
    file: str | None = None,
) -> Trace:
    """An export, or one table of it, as one record; with a doubt if it holds several pulls.

    They are recognised by steps of load or speed, or by reversals.
    """
    from tribo.readers import read_export
    from tribo.traces import carry_load, split_pulls

    named, choice = split_choice(str(path))
    table = choice.removesuffix(WHOLE).removesuffix("/")
    whole = Path(f"{named}#{table}" if table else named)
    trace = read_export(whole, columns=columns, correction=correction, name=name, file=file)
    if choice.endswith(WHOLE):
        return trace
    pieces = split_pulls(trace)
    loaded = [] if len(pieces) == 1 else [k for k, there in enumerate(carry_load(pieces)) if there]
    loaded = [k for n, k in enumerate(loaded) if not n or not _goes_on(trace, pieces[loaded[n - 1]], pieces[k])]
    if len(loaded) < 2:
        return trace
    export, choice = split_choice(trace.file)
    table = choice or "1"
    what = f"this trace contains {len(loaded)} pulls but was read as one"
    allowed = f"{export}#{table}/{loaded[0] + 1} (and so on) for a single pull, {export}#{table}/* for all"
    doubt = Problem("several_pulls", what, trace.file, allowed=allowed)
    return replace(trace, flags=(*trace.flags, doubt.kind), problems=(*trace.problems, doubt))


def _levels(trace: Trace, options: PullOptions) -> list[tuple[Trace | None, PullOptions]]:
    """The tests of a record that slides at several levels of speed or load, one a level; none of any other record.

    Each has the speed and load of its level, how long it lasts, and whether it was reached on the way ``up`` or
    ``down``.
    """
    from tribo.traces import carry_load, load_of, pieces_of
    from tribo.traces.drive import rotation_level_rev_per_s, speed_level_m_s
    from tribo.traces.phases import under_load_s

    test = options.test
    if "several_pulls" not in trace.flags or test is None:
        return []
    plain = replace(trace, flags=tuple(flag for flag in trace.flags if flag != "several_pulls"))
    plain = replace(plain, problems=tuple(p for p in trace.problems if p.kind != "several_pulls"))
    pieces = pieces_of(plain, options)
    if any(own.begins == "reversal" for _, own in pieces.values()):
        return []  # strokes
    loaded = dict(zip(pieces, carry_load([piece for piece, _ in pieces.values()]), strict=True))
    pieces = {address: found for address, found in pieces.items() if loaded[address]}
    begin_s, end_s = under_load_s(plain, options.contact)  # neither an approach nor a rest after the slide is a level
    pieces = {a: found for a, found in pieces.items() if begin_s <= float(np.median(found[0].time_s)) <= end_s}
    if len(pieces) < 2:
        return []
    speeds, turns, loads = (
        [of(piece) for piece, _ in pieces.values()]
        for of in (speed_level_m_s, rotation_level_rev_per_s, lambda piece: load_of(piece)[0])
    )
    apart = 1.0 + _LEVELS_DIFFER
    varies = next((values for values in (speeds, turns, loads) if max(values) > apart * min(values)), None)
    if varies is None:
        return []
    export, table = split_choice(trace.file)
    found: list[tuple[Trace | None, PullOptions]] = []
    for k, (address, (piece, own)) in enumerate(pieces.items()):
        name = f"{test.test_id}#{table or 1}/{address.partition('/')[2]}"
        file = f"{export}#{table or 1}/{address.partition('/')[2]}"
        up = varies[max(k, 1)] > varies[max(k, 1) - 1]
        about = {"ladder": "up" if up else "down", "duration_s": f"{piece.time_s[-1] - piece.time_s[0]:.4g}"}
        level = replace(test, test_id=name, file=file, covariates={**test.covariates, **about})
        if math.isfinite(speeds[k]):
            level = replace(level, speed_m_s=speeds[k])
        elif math.isfinite(turns[k]):  # without a radius there is no sliding speed
            level = replace(level, covariates={**level.covariates, "speed_rps": f"{turns[k]:.4g}"})
        if varies is loads:
            level = replace(level, normal_load_N=math.nan)
        found.append((replace(piece, name=name, file=file), replace(own, test=level)))
    return found


def _chosen(
    path: Path, choice: str, columns: Columns | None, test: Test | None, options: PullOptions
) -> dict[str, tuple[Trace, PullOptions]]:
    """Every pull of an export that a choice means, by address; all strokes of the export share one zero.

    Where all pulls are chosen, those without a load are left out, and a doubt of the first one names them.
    """
    from tribo.readers import read_blocks
    from tribo.traces import carry_load, pieces_of

    name, export = (test.test_id, split_choice(test.file)[0]) if test else (None, str(path))
    correction = test.correction if test else UNCORRECTED
    tables = read_blocks(path, columns=columns, correction=correction, name=name, file=test.file if test else None)
    pieces = pieces_of(tables, options)
    every = "*" in choice
    loaded = dict(zip(pieces, carry_load([piece for piece, _ in pieces.values()]), strict=True))
    meant = [address for address in pieces if is_chosen(address, choice)]
    chosen = [address for address in meant if loaded[address] or not every]
    if not chosen:
        what, allowed = f"no such pull; the export has {len(pieces)}", f"{export}#*, or {', '.join(pieces)} after the #"
        raise TraceError(Problem("no_such_pull", what, found=choice, allowed=allowed))
    found = {}
    for address in chosen:
        piece, own = pieces[address]
        file = f"{export}#{address}"
        if test:
            test_id = f"{test.test_id}#{address}" if every else test.test_id
            own = replace(own, test=replace(test, test_id=test_id, file=file))
            piece = replace(piece, name=test_id)
        piece = replace(piece, file=file)
        if address == chosen[0] and len(chosen) < len(meant):
            left_out = ", ".join(address for address in meant if not loaded[address])
            doubt = Problem("unloaded", f"parts without normal load left out: {left_out}", file)
            piece = replace(piece, problems=(*piece.problems, doubt))
        found[address] = piece, own
    return found


def _goes_on(trace: Trace, before: Trace, piece: Trace) -> bool:
    """Whether a piece goes on as the one before it did, after a short disturbance of load or speed."""
    from tribo.traces.drive import speed_level_m_s

    time = trace.time_s
    if piece.time_s[0] - before.time_s[-1] > _DISTURBED * (time[-1] - time[0]):
        return False
    there = {"normal_force_N", "speed_m_s", "rotation_rev_per_s"} & set(trace.columns)
    pairs = [(float(np.median(before.columns[c])), float(np.median(piece.columns[c]))) for c in there]
    one, other = (float(np.median(part.force_N)) for part in (before, piece))
    if there <= {"normal_force_N"}:  # the displacement tells the speed
        speeds = speed_level_m_s(before), speed_level_m_s(piece)
        pairs += [speeds] if any(map(math.isfinite, speeds)) else []
    return bool(pairs) and one * other > 0 and all(abs(b - a) <= _DISTURBED * abs(a) for a, b in pairs)


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


def _set_aside(test: Test, found: Sequence[Problem]) -> SetAside:
    problems = tuple(replace(p, file=test.file, test_id=test.test_id) for p in found)
    return SetAside(test.test_id, "; ".join(str(p) for p in problems), problems)


def inspect_file(path: Path, columns: Columns | None = None, correction: Correction | None = None) -> Inspection:
    """Description of an export with its pulls, each by the text that selects it in tests.csv."""
    from tribo.readers import inspect_export, read_blocks
    from tribo.traces import load_of, split_pulls

    seen = inspect_export(path, columns=columns, correction=correction)
    if seen.refused or any(doubt.kind == "only_beginning" for doubt in seen.doubts):
        return seen
    try:
        tables = read_blocks(path, columns=columns, correction=correction)
    except TriboError:
        return seen
    pieces = {f"#{t}/{p}": piece for t, table in enumerate(tables, 1) for p, piece in enumerate(split_pulls(table), 1)}
    if len(pieces) == len(tables):  # no table holds more than one
        return seen
    lines = []
    for choice, piece in pieces.items():
        load = load_of(piece)[0]
        under = "" if math.isnan(load) else f" under {load:.4g} N"
        middle = piece.force_N[piece.force_N.size // 4 : 3 * piece.force_N.size // 4]
        lines.append(f"{choice}: {piece.time_s[0]:.6g} to {piece.time_s[-1]:.6g} s{under}, force {middle.mean():.4g} N")
    return replace(seen, pulls=tuple(lines))


def under_the_wrong_test(traces: Mapping[str, Trace], test_ids: Collection[str]) -> dict[str, Problem]:
    """The problem of each test whose trace belongs to another one; ``test_ids`` are all tests of the campaign.

    ``other_test``: its header names another test, where the headers of a campaign name their own. ``same_numbers``: its
    data are those of another test, and no header states to which test they belong; then none of them is used.
    """
    ids = frozenset(test_ids)
    named: dict[str, set[str]] = {}
    groups: dict[bytes, list[str]] = {}  # tests that share every sample of force, on whatever clock
    for test_id, trace in traces.items():
        words = {word for pair in trace.metadata.items() for text in pair for word in _WORD.findall(text)}
        named[test_id] = words & ids
        noisy = trace.force_N.size > 0 and float(np.ptp(trace.force_N)) > 0
        samples = np.ascontiguousarray(trace.force_N if noisy else np.concatenate((trace.time_s, trace.force_N)))
        groups.setdefault(hashlib.blake2b(samples.tobytes(), digest_size=16).digest(), []).append(test_id)
    labelled = sum(test_id in words for test_id, words in named.items()) >= max(_FEWEST, _LABELLED * len(traces))
    found: dict[str, Problem] = {}
    for test_id, words in named.items():
        if labelled and words and test_id not in words:
            what, other = "the header of this export names a different test", ", ".join(sorted(words))
            file = traces[test_id].file
            found[test_id] = Problem("other_test", what, file, found=other, allowed=test_id, test_id=test_id)
    for group in groups.values():
        doubtful = [test_id for test_id in group if test_id not in found]
        for test_id in doubtful if len(doubtful) > 1 else ():
            others = ", ".join(other for other in group if other != test_id)
            what = (
                f"the data are identical to those of {others}; the correct test is not known, so none of them is used"
            )
            file, allowed = traces[test_id].file, "one measurement per test"
            found[test_id] = Problem("same_numbers", what, file, allowed=allowed, test_id=test_id)
    return found
