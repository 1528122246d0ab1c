"""A campaign drafted from the exports at hand: what their names, headers and columns say, and what they do not.

Its campaign.toml and tests.csv are written where nothing is replaced.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import shutil
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from tribo.campaign.rows import Columns
from tribo.campaign.table import EVALUATED, KNOWN, LOADS, RAW, TABLES, TOML, read_table
from tribo.drafting.file_names import (
    as_column,
    columns_in_name,
    listed,
    name_expression,
    not_used,
    parts_in_words,
    proposed_patterns,
    question,
    radii_in_name,
    where_it_stops,
)
from tribo.errors import CampaignError, Problem, ReadError, TriboError
from tribo.files import found_below, write_new
from tribo.records import UNCORRECTED, Correction, FloatArray, Test, Trace
from tribo.units import match_quantity, unit_factor

_NOT_LOOKED_AT = (".", "~$", "Thumbs.db")
_NAMES_OR_UNITS = {
    "missing_column", "missing_unit", "unknown_unit", "ambiguous_unit", "ambiguous_mark", "names_do_not_fit",
    "time_of_day", "missing_load", "missing_area", "missing_lever",
}  # fmt: skip
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_CLOCK = r"(?P<clock>\d{1,2}:\d\d(?::\d\d)?)"
_DATES = (
    re.compile(rf"{_CLOCK} on (?P<y>\d{{4}})-(?P<m>\d\d)-(?P<d>\d\d)"),
    re.compile(rf"{_CLOCK}(?:\.\d+)? (?P<d>\d{{1,2}}) (?P<month>[A-Za-z]{{3}})[a-z]* (?P<y>\d{{4}})"),
    re.compile(rf"(?P<y>\d{{4}})-(?P<m>\d\d)-(?P<d>\d\d)(?:[T ]+{_CLOCK})?"),
    re.compile(rf"(?P<d>\d{{1,2}})\.(?P<m>\d{{1,2}})\.(?P<y>\d{{4}})(?:[T ]+{_CLOCK})?"),
    re.compile(rf"(?P<d>\d{{1,2}})[ -](?P<month>[A-Za-z]{{3}})[a-z]*[ -](?P<y>\d{{4}})(?:[T ]+{_CLOCK})?"),
)
_STARTED = re.compile(r"start|date|datum|begin|zeit|time|acquisition|created", re.I)
_NUMBER_AND_UNIT = re.compile(r"([-+]?\d+(?:[.,]\d+)?)\s*([A-Za-zµ][\w/µ]*)")
_HEADERS = (  # words of a header, quantity, column of tests.csv, its unit in SI units
    (re.compile(r"(?:set |applied |nominal )?(?:normal )?(?:load|force)|normalkraft|last|charge", re.I), "normal force",
     "normal_load_N", 1.0),
    (re.compile(r"(?:test|sliding|pull(?:ing)?|crosshead|linear)? ?(?:speed|velocity)|(?:prüf)?geschwindigkeit|vitesse",
     re.I), "speed", "speed_mm_s", 1e3),
)  # fmt: skip
_FEWEST_ROWS = 8
_SIZES = {  # fault of exports that say no size: key of campaign.toml, and what stands in for it
    "missing_load": ("", ""),
    "missing_area": ("nominal_area_mm2", "a stress is recorded in place of a force; forces are those on 1 mm2"),
    "missing_lever": ("lever_arm_mm", "a torque is recorded; friction forces are those on an arm of 1 mm"),
}
_BLOCKS = 200  # of a record, whose median speeds are those of the drive without the noise of its tachometer
_FEWEST_REVERSALS = 3
_BOTH_SIGNS = 0.2  # share of the larger side from which a force takes both signs, above noise and a small offset


@dataclass
class Draft:
    """Rows of tests.csv by column, and what was found and not found while drafting them."""

    rows: list[dict[str, str]] = field(default_factory=list)
    found: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    not_read: list[str] = field(default_factory=list)
    not_used: list[str] = field(default_factory=list)  # texts of the names of files that differ and that no column has
    negative: bool = False  # the friction force is negative in every record
    zero: str = ""  # of the force, where the exports show which is meant
    stands_in: dict[str, float] = field(default_factory=dict)  # for what the exports do not say, by key
    of_exports: bool = True  # not of a table of evaluated forces

    @property
    def samples(self) -> list[str]:
        """Samples in the order of the rows."""
        return list(dict.fromkeys(row["sample"] for row in self.rows))


def exports_in(raw: Path) -> dict[str, Path]:
    """Exports below a folder (or the one file) by the name they get in raw/: entries of a .zip as ZIP/ENTRY."""
    from tribo.readers.source import archive_of, entries_of

    if (archive := archive_of(raw)) is not None:
        return {f"{archive.name}/{raw.relative_to(archive).as_posix()}": raw}
    base = raw if raw.is_dir() else raw.parent
    files = [p for p in found_below(raw) if p.is_file()] if raw.is_dir() else [raw]
    found = {}
    for path in files:
        if path.name.startswith(_NOT_LOOKED_AT):
            continue
        name, entries = path.relative_to(base).as_posix(), entries_of(path)
        if len(entries) < 2:
            found[name] = path
        else:
            found |= {f"{name}/{entry}": path / entry for entry in entries}
    if not found:
        raise CampaignError(Problem("no_exports", "no files were found", file=str(raw), allowed="a folder of exports"))
    return found


def draft_campaign(
    raw: Path,
    *,
    patterns: Sequence[str] = (),
    records: str = "",
    columns: Columns | None = None,
    correction: Correction = UNCORRECTED,
    filled: Mapping[str, str] | None = None,
) -> Draft:
    """The rows of tests.csv that the exports of a folder give.

    ``patterns`` are those of names of files, ``records`` that of the heads of records; ``columns`` and ``correction``
    are stated for all exports, ``filled`` holds columns of tests.csv with one value for all tests.

    Raises
    ------
    CampaignError
        The folder holds no files, or none that could be an export; or a pattern of names is none.
    """
    from tribo.readers import read_blocks

    for pattern in (*patterns, *([records] if records else [])):
        name_expression(pattern)
    readable: dict[str, tuple[Trace, ...]] = {}
    refused: dict[str, tuple[Problem, ...]] = {}
    stands_in: set[str] = set()
    for name, path in exports_in(raw).items():
        try:
            try:
                blocks = read_blocks(path, columns=columns, correction=correction, name=name, file=name)
            except ReadError as why:
                if {p.kind for p in why.problems} - set(_SIZES):
                    raise
                # what friction is does not depend on the load, area or lever arm; one that stands for it is filled in
                stands_in |= {p.kind for p in why.problems} & {"missing_area", "missing_lever"}
                blocks = read_blocks(path, columns=columns, correction=_with_sizes(correction), name=name, file=name)
                blocks = tuple(replace(r, columns=_without_speed_of_turns(r)) for r in blocks)
        except TriboError as why:
            refused[name] = why.problems
            continue
        if found := tuple(r for r in blocks if r.time_s.size >= _FEWEST_ROWS):
            readable[name] = found
        else:
            refused[name] = (Problem("short", "no record of more than a few rows", name),)
    used = dict(readable)
    if not used:  # a draft says how to read those that lack names or units
        used = {name: () for name, problems in refused.items() if all(p.kind in _NAMES_OR_UNITS for p in problems)}
    if not used:
        raise CampaignError([problems[0] for problems in refused.values() if problems[0].kind != "short"])
    draft = Draft(not_read=[f"{name}: {problems[0].what}" for name, problems in refused.items() if name not in used])
    for kind in sorted(stands_in):
        key, what = _SIZES[kind]
        draft.stands_in[key] = 1.0
        draft.missing.append(f"{key} in campaign.toml, for which 1 was written: {what}")
    named = _named(used, patterns, draft)
    for name, found in used.items():
        for row in _at_radius(list(_rows_of(name, found, named.get(name, {}), records)), name, draft):
            draft.rows.append(row | {c: value for c, value in (filled or {}).items() if not row.get(c)})
    recorded = {f"raw/{name}" for name, found in used.items() if any(map(has_load, found))}
    in_export = [_is_of(row["file"], recorded) for row in draft.rows]
    if not all(in_export):
        for row, there in zip(draft.rows, in_export, strict=True):
            # beside rows with a load, a row that leaves it to its export names the record: raw/a.csv#1
            if there and row["file"] in recorded:
                row["file"] += "#1"
    width = len(str(len(draft.rows)))
    named_so = Counter(row.get("test_id") for row in draft.rows)
    for k, row in enumerate(draft.rows, start=1):
        if row.setdefault("test_id", f"T{k:0{width}d}") and named_so[row["test_id"]] > 1:
            row["test_id"] += "-" + row["file"].rpartition("#")[2] if "#" in row["file"] else f"-{k}"
        row.setdefault("sample", raw.stem)
    if all(len(row.get("started_at", "")) > len("2026-01-01") for row in draft.rows):  # a date with a time
        for k, row in enumerate(sorted(draft.rows, key=lambda r: r["started_at"]), start=1):
            row["run_order"] = str(k)
    for what in dict.fromkeys(f"{p.what}; give: {p.allowed}" for name in used for p in refused.get(name, ())):
        draft.missing.append(what)
    _say_what_is_missing(draft, used, speed_given=correction.speed_m_s is not None)
    in_strokes = {row["file"][len("raw/") : -len("#*")] for row in draft.rows if row["file"].endswith("#*")}
    _signs(draft, {name: found for name, found in readable.items() if name not in in_strokes})
    return draft


def _is_of(file: str, exports: Collection[str]) -> bool:
    """Whether the cell of a row names one of the exports, or a record in it; names of files may hold a "#" as well."""
    return file in exports or file.rpartition("#")[0] in exports


def _with_sizes(correction: Correction) -> Correction:
    """The correction with a load of 1 N, an area of 1 mm2 and a lever arm of 1 mm where none is stated."""
    return replace(
        correction, load_N=correction.load_N or 1.0, area_m2=correction.area_m2 or 1e-6,
        lever_arm_m=correction.lever_arm_m or 1e-3,
    )  # fmt: skip


def _without_speed_of_turns(record: Trace) -> dict[str, FloatArray]:
    """The columns of a record but for a speed that was computed from turns and a lever arm that nobody stated."""
    from_turns = record.source is not None and "lever arm" in record.source.reasons.get("speed", "")
    return {name: values for name, values in record.columns.items() if not (from_turns and name == "speed_m_s")}


def _named(used: Iterable[str], patterns: Sequence[str], draft: Draft) -> dict[str, dict[str, str]]:
    """What the names of files say, and notes on the patterns used and on what of the names is not.

    Raises
    ------
    CampaignError
        bad_names: a given pattern fits no file; names_not_used: names differ in what no proposed pattern reads.
    """
    # the name without folder and suffixes; a point between digits is no suffix
    stems = {file: re.sub(r"(?:\.[A-Za-z]\w{0,5})+$", "", file.rpartition("/")[2]) for file in used}
    names = list(dict.fromkeys(stems.values()))
    chosen = patterns or proposed_patterns(names)
    fits = {stem: found for stem in names if (found := columns_in_name(stem, chosen)) is not None}
    if not patterns and (asked := question(names, chosen, fits)):
        raise CampaignError(asked)
    problems = []
    for pattern in chosen:
        n = sum(columns_in_name(stem, [pattern]) is not None for stem in stems.values())
        how = "as given" if patterns else "proposed; give --names to read them otherwise"
        draft.found.append(f'names "{pattern}" ({how}): fits {n} of {len(stems)} files')
        if not n:
            what, where = f'the pattern "{pattern}" fits no file', where_it_stops(names[0], pattern)
            allowed = "{column} where a value is read, [text] for what may be missing, * for what is not used"
            problems.append(Problem("bad_names", what, found=where, allowed=allowed))
    if problems:
        raise CampaignError(problems)
    if not patterns and len(names) > 1:
        draft.found += parts_in_words(names, chosen)
    unfit = [stem for stem in names if stem not in fits]
    for stem in unfit if chosen else ():
        draft.missing.append(f"a name that no pattern fits: {where_it_stops(stem, chosen[0])}")
    draft.not_used = [*not_used(names, chosen), *([listed(unfit)] if chosen and unfit else [])]
    return {file: fits[stem] for file, stem in stems.items() if stem in fits}


def _rows_of(name: str, records: Sequence[Trace], named: Mapping[str, str], pattern: str) -> Iterator[dict[str, str]]:
    """One row for each record of an export; strokes in both directions share a row, as they share one zero.

    ``pattern`` is that of the heads of records, where there is one.
    """
    file = f"raw/{name}"
    # mean force of the second half
    signs = {math.copysign(1.0, float(np.mean(r.force_N[r.force_N.size // 2 :]))) for r in records}
    if len(records) < 2:
        strokes = "#*" if records and _is_strokes(records[0]) else ""
        yield _row(file + strokes, named, records[0], pattern) if records else {"file": file, **named}
    elif len(signs) == 2 and not pattern:
        yield _row(f"{file}#*", named, records[0], pattern)
    else:
        for k, record in enumerate(records, start=1):
            yield _row(f"{file}#{k}", named, record, pattern)


def _at_radius(rows: list[dict[str, str]], name: str, draft: Draft) -> list[dict[str, str]]:
    """Rows of one file with the sliding speed of the radius that its name states and the turns of each row."""
    turns = [float(row.get("speed_rpm") or 0.0) / 60.0 or float(row.get("speed_rps") or 0.0) for row in rows]
    radii = radii_in_name(name.rpartition("/")[2], len(rows), turns)
    if not radii or not all(turns) or any("speed_mm_s" in row for row in rows):
        return rows
    found = []
    for row, radius, per_s in zip(rows, radii, turns, strict=True):
        rest = {column: text for column, text in row.items() if column not in ("speed_rpm", "speed_rps")}
        found.append({**rest, "radius_mm": f"{radius:.6g}", "speed_mm_s": f"{2.0 * math.pi * radius * per_s:.4g}"})
    what = "the speed is 2 pi times the radius in the names of the files times the turns"
    draft.found += [] if what in draft.found else [what]
    return found


def _is_strokes(record: Trace) -> bool:
    """Whether the force of one record reverses several times, each time for a stroke."""
    from tribo.traces import split_pulls

    pieces = split_pulls(record)
    means = [float(np.mean(piece.force_N)) for piece in pieces]
    largest = max(map(abs, means))
    signs = [mean > 0 for mean in means if abs(mean) > _BOTH_SIGNS * largest]
    return sum(a != b for a, b in pairwise(signs)) >= _FEWEST_REVERSALS


def _row(file: str, named: Mapping[str, str], record: Trace, pattern: str) -> dict[str, str]:
    row = {"file": file, **named}
    label = str(record.metadata.get("record", ""))
    in_label = columns_in_name(label, [pattern]) if pattern else None
    if in_label is not None:
        row |= in_label
    elif label:
        row["record"] = label
    if has_load(record) and "normal_load_N" in row:
        row["nominal_load_N"] = row.pop("normal_load_N")  # the recorded load is used, as the row gives none
    stated_in_header = _in_header(record.metadata)
    if "normal_load_N" in stated_in_header and not has_load(record) and not any(row.get(key) for key in LOADS):
        row["normal_load_N"] = stated_in_header["normal_load_N"]
    recorded = _recorded_speed(record.columns.get("speed_m_s"))
    if speed := f"{recorded * 1e3:.3g}" if recorded else stated_in_header.get("speed_mm_s", ""):
        row.setdefault("speed_mm_s", speed)
    elif "speed_rps" not in row and (turns := _recorded_speed(record.columns.get("rotation_rev_per_s"))):
        row.setdefault("speed_rpm", f"{turns * 60.0:.4g}")
    if started := started_at(record.metadata):
        row.setdefault("started_at", started)
    return row


def has_load(record: Trace) -> bool:
    """Whether a normal force was recorded, and not zero throughout."""
    load = record.columns.get("normal_force_N")
    return load is not None and bool(np.any(load != 0))


def _recorded_speed(values: FloatArray | None) -> float:
    """The median of a recorded speed while there is any, 0.0 without one.

    Medians of short blocks are compared with half of the speed found so far; in single rows the noise of a tachometer
    may be larger than that.
    """
    if values is None or not np.abs(values).max() > 0:
        return 0.0
    size = max(1, values.size // _BLOCKS)
    whole = values[: values.size // size * size].reshape(-1, size)
    speed = np.abs(np.median(whole, axis=1))
    found = float(np.quantile(speed, 0.9)) or float(speed.max())
    for _ in range(3):
        found = float(np.median(speed[speed >= 0.5 * found]))
    return found


def _in_header(metadata: Mapping[str, str]) -> dict[str, str]:
    """Load and speed as a header states them with their unit: "Test speed: 12 mm/min"."""
    found = {}
    for key, value in metadata.items():
        for words, quantity, column, factor in _HEADERS:
            number = _NUMBER_AND_UNIT.fullmatch(value.strip())
            if number and words.fullmatch(key.strip()) and column not in found:
                try:
                    si, _ = unit_factor(number[2], quantity)
                except ReadError:
                    continue
                found[column] = f"{abs(float(number[1].replace(',', '.')) * si) * factor:.6g}"
    return found


def started_at(metadata: Mapping[str, str]) -> str:
    """The first date of a header in ISO 8601, "" where there is none; lines that speak of a start come first."""
    lines = sorted(metadata.items(), key=lambda item: not _STARTED.search(item[0]))
    for key, value in lines:
        for expression in _DATES:
            found = expression.search(f"{key}:{value}") or expression.search(f"{key} {value}")
            if not found:
                continue
            parts = found.groupdict()
            word = (parts.get("month") or "").lower()
            month = int(parts.get("m") or (_MONTHS.index(word) + 1 if word in _MONTHS else 0))
            if 1 <= month <= 12 and 1 <= int(parts["d"]) <= 31:
                date = f"{int(parts['y']):04d}-{month:02d}-{int(parts['d']):02d}"
                clock = parts.get("clock")
                return f"{date}T{clock:0>{5 if clock.count(':') == 1 else 8}}" if clock else date
    return ""


def _say_what_is_missing(draft: Draft, used: Mapping[str, Sequence[Trace]], speed_given: bool) -> None:
    recorded = {f"raw/{name}" for name, records in used.items() if any(map(has_load, records))}
    with_load = [r for r in draft.rows if _is_of(r["file"], recorded)]
    if with_load:
        draft.found.append(f"the normal force is recorded for {len(with_load)} of {len(draft.rows)} rows and is used")
    without = [r["file"] for r in draft.rows if r not in with_load and not any(r.get(c) for c in LOADS)]
    if without:
        draft.missing.append(
            f"the load of {len(without)} rows: normal_load_N or mass_g in tests.csv ({listed(without)})"
        )
    if not speed_given and not any(r.get("speed_mm_s") for r in draft.rows):
        turns = any("speed_rpm" in r or "speed_rps" in r for r in draft.rows)
        arm = "; or lever_arm_mm, the radius at which it slides, as turns are recorded" if turns else ""
        what = f"the speed: pull_speed_mm_s in campaign.toml, or a column speed_mm_s in tests.csv{arm}"
        draft.missing.append(what)
    for column, what in (("normal_load_N", "loads"), ("speed_mm_s", "speeds"), ("started_at", "starts")):
        n = sum(bool(r.get(column)) for r in draft.rows)
        if n:
            draft.found.append(f"{what} of {n} of {len(draft.rows)} rows")


def _signs(draft: Draft, readable: Mapping[str, Sequence[Trace]]) -> None:
    """Note whether the friction force is negative in every record, or takes both signs within one."""
    # lowest and highest force of each record but for a twentieth of the samples at either end, N
    ranges = {name: [np.percentile(r.force_N, (5, 95)) for r in found] for name, found in readable.items()}
    every = [between for found in ranges.values() for between in found]
    draft.negative = bool(every) and all(low < 0 and high < _BOTH_SIGNS * -low for low, high in every)
    if draft.negative:
        draft.found.append("the friction force is negative in every record: sign = -1 was written")
    alone = {name: found[0] for name, found in ranges.items() if len(found) == 1}
    mixed = [
        name
        for name, (low, high) in alone.items()
        if low < 0 < high and min(-low, high) > _BOTH_SIGNS * max(-low, high)
    ]
    if mixed and all(_positive_over_rest(record) for found in readable.values() for record in found):
        draft.zero = "at rest"
        draft.found.append(
            f"the force takes both signs within {len(mixed)} records, and is positive against the level at which the "
            'drive rests: zero = "at rest" was written'
        )
    elif mixed:
        draft.missing.append(
            f"the force takes both signs within {len(mixed)} records: state its zero in campaign.toml, and "
            f"sign = -1 if friction is negative ({listed(mixed)})"
        )


def _positive_over_rest(record: Trace) -> bool:
    """Whether the force while sliding lies above the level at which nothing pulls, by the recorded drive or load."""
    from tribo.traces import PullOptions, evaluate
    from tribo.zeroing import zero_choice

    test = Test(record.name, record.file, "", math.nan, "", zero=zero_choice("at rest"))
    try:
        return evaluate(record, PullOptions(test=test)).sliding_N > 0
    except TriboError:
        return False


_TOML = """\
# Written by tribo init from the exports in raw/. Lines that begin with "# FILL IN" hold what the exports do not say.

[campaign]
title = {title}
# FILL IN material = ""
# FILL IN counterface = ""
{area}
{not_used}{stated}
{columns}
# One table for each sample. cavity = "none" is a surface without a pattern of cavities.
{patterns}"""
_AREA = "nominal_area_mm2 = {:g}"
_NO_AREA = "# FILL IN nominal_area_mm2 =   # area of the sample face"


def texts(
    folder: Path, draft: Draft, stated_columns: Columns, given: Correction, area_mm2: float | None
) -> dict[Path, str]:
    """The two files of a campaign by their paths."""
    keys = {}
    if draft.negative or given.sign < 0:
        keys["sign"] = f"{given.sign * (-1.0 if draft.negative else 1.0):g}"
    if given.gain != UNCORRECTED.gain:
        keys["gain"] = f"{given.gain:g}"
    if given.lever_arm_m is not None:
        keys["lever_arm_mm"] = f"{given.lever_arm_m * 1e3:g}"
    if given.sampling_rate_Hz is not None:
        keys["sampling_rate_Hz"] = f"{given.sampling_rate_Hz:g}"
    if given.speed_m_s is not None:
        keys["pull_speed_mm_s"] = f"{given.speed_m_s * 1e3:g}"
    if draft.zero:
        keys["zero"] = json.dumps(draft.zero)
    keys |= {key: f"{value:g}   # FILL IN; 1 stands in for it" for key, value in draft.stands_in.items()}
    columns = [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in stated_columns.items()]
    samples = [json.dumps(sample, ensure_ascii=False) for sample in draft.samples]
    toml = _TOML.format(
        title=json.dumps(folder.resolve().name, ensure_ascii=False),
        area="" if "nominal_area_mm2" in draft.stands_in else _NO_AREA if area_mm2 is None else _AREA.format(area_mm2),
        not_used="".join(
            f"# names of files not used: {json.dumps(text, ensure_ascii=False)}\n" for text in draft.not_used
        ),
        stated="".join(f"{key} = {text}\n" for key, text in keys.items()),
        columns="".join(["[columns]\n", *columns]) if columns else "",
        patterns="\n".join(f'[patterns.{sample}]\ncavity = "none"\n' for sample in samples),
    )
    return {folder / TOML: toml, folder / TABLES[0]: _tests_csv(draft)}


def _tests_csv(draft: Draft) -> str:
    """Rows under the columns that any of them has: the known ones first, in the order of the reference."""
    present = {column for row in draft.rows for column in row}
    if not present & set(LOADS):
        present.add("normal_load_N")
    columns = [c for c in KNOWN if c in present] + sorted(present - set(KNOWN))
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(draft.rows)
    return out.getvalue()


def write_draft(folder: Path, contents: Mapping[Path, str], raw: Path | None) -> tuple[Path, ...]:
    """Write the files, and copy the exports (where there are any) into raw/ unless they are there; what was written.

    Raises
    ------
    CampaignError
        A file of the campaign, or one in raw/ of the same name as an export, already exists. Nothing is written.
    """
    from tribo.readers.source import archive_of

    copies: dict[Path, Path] = {}  # where each export goes, unless they are in raw/ already
    if raw is not None:
        raw = archive_of(raw) or raw
        base, target = raw if raw.is_dir() else raw.parent, folder / RAW
        files = [p for p in found_below(raw) if p.is_file()] if raw.is_dir() else [raw]
        if target.resolve() not in (base.resolve(), *base.resolve().parents):
            copies = {target / p.relative_to(base): p for p in files}
    there = [path for path in (*contents, *copies) if path.exists()]
    if there:
        what = "this file already exists and is not overwritten"
        raise CampaignError(Problem("exists", what, file=str(path)) for path in there)
    for to, source in copies.items():
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, to)
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in contents.items():
        write_new(path, text)
    return (*contents, *copies)


_SAMPLE = ("sample", "material", "probe", "werkstoff", "matiere", "materiau", "echantillon", "muestra")
_SETS = ("dataname", "data name", "data set", "dataset", "series")  # of one rig each: not to be pooled
_COEFFICIENT = re.compile(
    r"(?:cof|mu|friction coefficient|coefficient of friction|coefficient)(?: (?:mean|avg|average))?"
)
_FORCE = re.compile(r"(?:friction(?:al)?|sliding|tangential) force(?: (?:mean|avg|average))?")
_LOAD = re.compile(r"(?:nominal |applied |mean )?(?:normal )?load|normal force|nominalload|normalload")
_SPEED = re.compile(r"(?:max |mean |nominal )?(?:lin |linear |sliding )?(?:speed|velocity)|maxlinspeed")
_UNIT_AT_END = re.compile(r"[\[(]\s*(m?k?N|gf?|kgf|um/s|mm/s|m/s|mm/min)\s*[\])]\s*$")
_FIELDS = {
    "N": "normal_load_N", "mN": "normal_load_mN", "kN": "normal_load_kN", "gf": "normal_load_gf", "g": "mass_g",
    "kgf": "normal_load_kgf", "mm/s": "speed_mm_s", "um/s": "speed_um_s", "m/s": "speed_m_s", "mm/min": "speed_mm_min",
}  # fmt: skip
_LOOKED_AT = 200  # rows in which a label has to repeat the number with its unit

Table = Mapping[str, Sequence[str]]  # the cells of each column by its name


def draft_from_table(path: Path, mapping: Mapping[str, str]) -> Draft:
    """The rows of tests.csv from a table; ``mapping`` gives its column for each column of tests.csv.

    A column of tests.csv may carry another unit of its quantity: ``normal_load_mN``. Without a mapping one is proposed
    from the names of the columns. Columns not mapped are kept as covariates, unless every row has the same in them,
    they repeat a mapped column, or they are further figures of the evaluation.

    Raises
    ------
    CampaignError
        The table has no rows, a column that is not there is mapped, or neither a force nor a load is.
    """
    table, header_row = _table_of(path)
    n_rows = len(next(iter(table.values()), ()))
    if not n_rows:
        raise CampaignError(Problem("empty", "the table has no rows", file=path.name))
    draft = Draft(of_exports=False)
    if not mapping and (mapping := proposed_mapping(table)):
        text = ",".join(f"{field}={name}" for field, name in mapping.items())
        draft.found.append(f'columns "{text}" (proposed; give --table to read them otherwise)')
    place, here = (path.name, header_row), ", ".join(filter(None, table))
    problems = [
        Problem("missing_column", f"no such column for {field}", *place, name, None, here)
        for field, name in mapping.items()
        if name not in table
    ]
    columns = {as_column(field, "1")[0] for field in mapping}
    for wanted in (EVALUATED, ("normal_load_N", "mass_g", "normal_stress_Pa")):
        if not columns & set(wanted):
            what = "the table needs a force or coefficient, and a load"
            allowed = f"one of {', '.join(wanted)}; columns here: {here}"
            problems.append(Problem("missing_column", what, *place, None, None, allowed))
    if problems:
        raise CampaignError(problems)
    left_out = {"", *KNOWN, *mapping.values(), *repeated_or_derived(table, mapping)}
    kept = [name for name, cells in table.items() if name not in left_out and len(set(cells)) > 1]
    width = len(str(n_rows))
    for k in range(n_rows):
        cells = {name: " ".join(column[k].split()) for name, column in table.items()}
        stated = dict(as_column(field, cells[name]) for field, name in mapping.items())
        others = {name: cells[name] for name in kept}
        draft.rows.append({"test_id": f"T{k + 1:0{width}d}", "sample": path.stem, **others, **stated})
    draft.found.append(f"{n_rows} rows with {', '.join(mapping)}; kept as covariates: {', '.join(kept) or 'none'}")
    return draft


def _table_of(path: Path) -> tuple[Table, int]:
    """A table by its columns, and the line of the file that names them."""
    names, header_row, rows = read_table(path, path.name)
    return {name: [row.cells.get(name, "") for row in rows] for name in names}, header_row


def is_table_of_forces(path: Path) -> bool:
    """Whether the columns of a file name a load and a friction, both with units, and no time."""
    try:
        return bool(proposed_mapping(_table_of(path)[0]))
    except (CampaignError, OSError):
        return False


def proposed_mapping(table: Table) -> dict[str, str]:
    """Column of the table for each column of tests.csv, as far as names and units tell; {} without load and friction.

    The unit of a number stands in brackets behind the name, or in a column of labels that repeats it: 10 beside
    "10 mN". Without a unit a column is not taken. A table with a time or a displacement is a trace.
    """
    if any((match_quantity(name) or ("", 0))[0] in ("time", "displacement") for name in table):
        return {}
    found: dict[str, str] = {}
    for name in table:
        plain = _plain(name)
        if plain in _SAMPLE:
            found.setdefault("sample", name)
        elif _COEFFICIENT.fullmatch(plain):
            found.setdefault("coefficient", name)
        elif _FORCE.fullmatch(plain) and _unit(table, name) == "N":
            found.setdefault("sliding_N", name)
        elif _LOAD.fullmatch(plain) or _SPEED.fullmatch(plain):
            field = _FIELDS.get(_unit(table, name), "")
            if field.startswith("speed") == bool(_SPEED.fullmatch(plain)) and field:
                found.setdefault(field, name)
    if "sample" in found:
        sample = table[found["sample"]]
        for name, cells in table.items():  # data sets, each of one sample
            if _plain(name) in _SETS and len(set(zip(cells, sample, strict=True))) == len(set(cells)) < len(cells) / 2:
                found["sample"] = name
                break
    loads = [field for field in found if field.startswith(("normal_load", "mass"))]
    return found if loads and ("coefficient" in found or "sliding_N" in found) else {}


def _plain(name: str) -> str:
    """A column name in lower case without its unit, marks as blanks: "CoF.mean" -> "cof mean"."""
    return re.sub(r"[\W_]+", " ", _UNIT_AT_END.sub("", name)).strip().lower()


def _unit(table: Table, name: str) -> str:
    """The unit behind a name, or behind the numbers in another column that repeats this one row by row; else empty."""
    if stated := _UNIT_AT_END.search(name):
        return stated[1]
    for other, labels in table.items():
        units = {_unit_behind(*cells) for cells in zip(table[name][:_LOOKED_AT], labels, strict=False)}
        if other != name and len(units) == 1 and units != {None}:
            return str(units.pop())
    return ""


def _unit_behind(number: str, label: str) -> str | None:
    unit = label.strip().removeprefix(number.strip())
    return unit.strip() if number.strip() and unit != label.strip() and unit.strip() in _FIELDS else None


def repeated_or_derived(table: Table, taken: Mapping[str, str]) -> set[str]:
    """Columns that say nothing of their own: copies of a mapped number in other units or words, and further figures of
    the evaluation, whose names begin like that of the friction ("CoF.sd" beside "CoF.mean")."""
    friction = [name for field, name in taken.items() if field in ("coefficient", "sliding_N", "static_N")]
    stems = {_plain(name).split(" ")[0] for name in friction}
    found = {name for name in table if _plain(name).split(" ")[0] in stems and name not in friction}
    mapped = [name for name in taken.values() if name not in friction]
    for name, cells in table.items():
        for other in (table[other] for other in mapped if other != name):
            if len(set(zip(cells, other, strict=True))) == len(set(cells)) == len(set(other)):
                found.add(name)
    return found
