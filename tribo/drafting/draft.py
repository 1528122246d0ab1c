"""A campaign drafted from the exports at hand: what their names, headers and columns say, and what they do not.

Names of files are read by a pattern such as "{sample}_{normal_load_N}N", given or proposed.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from tribo.campaign.rows import Columns
from tribo.campaign.table import LOADS
from tribo.errors import CampaignError, Problem, ReadError, TriboError
from tribo.files import found_below
from tribo.records import UNCORRECTED, Correction, Test, Trace
from tribo.units import unit_factor

_FIELD = re.compile(r"\{(\w+)\}|\[([^\[\]{}]*)\]")
_NUMBER = r"[-+]?\d+(?:[.,p-]\d+)?"
_TEXTS = {"sample", "specimen", "direction", "operator", "test_id", "started_at"}
# column of tests.csv, factor: what a field with another unit is written as
_CONVERTED = {
    "load_N": ("normal_load_N", 1.0), "load_mN": ("normal_load_N", 1e-3), "load_kN": ("normal_load_N", 1e3),
    "normal_load_mN": ("normal_load_N", 1e-3), "normal_load_kN": ("normal_load_N", 1e3),
    "normal_load_gf": ("normal_load_N", 9.80665e-3), "normal_load_kgf": ("normal_load_N", 9.80665),
    "mass_kg": ("mass_g", 1e3), "mass_mg": ("mass_g", 1e-3),
    "normal_stress_kPa": ("normal_stress_Pa", 1e3), "normal_stress_MPa": ("normal_stress_Pa", 1e6),
    "speed_um_s": ("speed_mm_s", 1e-3), "speed_m_s": ("speed_mm_s", 1e3), "speed_mm_min": ("speed_mm_s", 1 / 60),
    "speed_cm_s": ("speed_mm_s", 10.0), "hold_min": ("hold_s", 60.0), "hold_h": ("hold_s", 3600.0),
}  # fmt: skip
# text behind a number in a file name: the field it is proposed as
_UNITS = {
    "N": "normal_load_N", "mN": "normal_load_mN", "kN": "normal_load_kN", "gf": "normal_load_gf", "g": "mass_g",
    "kg": "mass_kg", "Pa": "normal_stress_Pa", "kPa": "normal_stress_kPa", "MPa": "normal_stress_MPa",
    "rpm": "speed_rpm", "rps": "speed_rps", "Hz": "frequency_Hz", "hz": "frequency_Hz", "min": "duration_min",
    "mins": "duration_min", "C": "temperature_C", "degC": "temperature_C", "mms": "speed_mm_s", "ums": "speed_um_s",
    "pct": "humidity_pct", "RH": "humidity_pct", "wt": "content_wt",
}  # fmt: skip
_NUMBERS_IN_PART = re.compile(r"([A-Za-z]*?)(\d+(?:[.,-]\d+)?)([A-Za-z]*)")
_NUMBERS = re.compile(r"[A-Za-z]{0,4}(?:\d+(?:[.,-]\d+)?[A-Za-z]{0,4})+")
_FEWEST_FITTING = 2
_REPEATS = {"", "r", "rep", "run", "test", "t", "no", "stroke"}
_SEPARATOR = re.compile(r"[_ ]+")
_NOT_LOOKED_AT = (".", "~$", "Thumbs.db")
_NAMES_OR_UNITS = {
    "missing_column", "missing_unit", "unknown_unit", "ambiguous_unit", "ambiguous_mark", "names_do_not_fit",
    "time_of_day", "missing_load", "missing_area",
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
_BOTH_SIGNS = 0.2  # share of the larger side from which a force takes both signs, above noise and a small offset


@dataclass
class Draft:
    """Rows of tests.csv by column, and what was found and not found while drafting them."""

    rows: list[dict[str, str]] = field(default_factory=list)
    found: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    not_read: list[str] = field(default_factory=list)
    negative: bool = False  # the friction force is negative in every record
    zero: str = ""  # of the force, where the exports show which is meant
    of_exports: bool = True  # not of a table of evaluated forces

    @property
    def samples(self) -> list[str]:
        """Samples in the order of the rows."""
        return list(dict.fromkeys(row["sample"] for row in self.rows))


def exports_in(raw: Path) -> dict[str, Path]:
    """Exports below a folder (or the one file) by the name they get in raw/: entries of a .zip as ZIP/ENTRY."""
    from tribo.readers.source import entries_of

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
    for name, path in exports_in(raw).items():
        try:
            blocks = read_blocks(path, columns=columns, correction=correction, name=name, file=name)
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
    named = _named(used, patterns, draft)
    for name, found in used.items():
        for row in _rows_of(name, found, named.get(name, {}), records):
            draft.rows.append(row | {c: value for c, value in (filled or {}).items() if not row.get(c)})
    loaded = [any(row.get(key) for key in LOADS) for row in draft.rows]
    for row, there in zip(draft.rows, loaded, strict=True):
        # beside rows with a load, a row that leaves it to its export names the record: raw/a.csv#1
        if any(loaded) and not there and "#" not in row["file"] and "nominal_load_N" in row:
            row["file"] += "#1"
    width = len(str(len(draft.rows)))
    for k, row in enumerate(draft.rows, start=1):
        row.setdefault("test_id", f"T{k:0{width}d}")
        row.setdefault("sample", raw.stem)
    if all(len(row.get("started_at", "")) > len("2026-01-01") for row in draft.rows):  # a date with a time
        for k, row in enumerate(sorted(draft.rows, key=lambda r: r["started_at"]), start=1):
            row["run_order"] = str(k)
    for what in dict.fromkeys(f"{p.what}; give: {p.allowed}" for name in used for p in refused.get(name, ())):
        draft.missing.append(what)
    _say_what_is_missing(draft, used, speed_given=correction.speed_m_s is not None)
    _signs(draft, readable)
    return draft


def _named(used: Iterable[str], patterns: Sequence[str], draft: Draft) -> dict[str, dict[str, str]]:
    """What the names of files say, and a note on the patterns used and on names that none fits."""
    # the name without folder and suffixes; a point between digits is no suffix
    stems = {file: re.sub(r"(?:\.[A-Za-z]\w{0,5})+$", "", file.rpartition("/")[2]) for file in used}
    chosen = patterns or proposed_patterns(list(stems.values()))
    read = {file: columns_in_name(stem, chosen) for file, stem in stems.items()}
    for pattern in chosen:
        n = sum(columns_in_name(stem, [pattern]) is not None for stem in stems.values())
        how = "as given" if patterns else "proposed; give --names to read them otherwise"
        draft.found.append(f'names "{pattern}" ({how}): fits {n} of {len(stems)} files')
    unfit = [file for file, columns in read.items() if columns is None]
    if unfit and chosen:
        draft.missing.append(f"names that no pattern fits: {_listed(unfit)}")
    return {file: columns for file, columns in read.items() if columns is not None}


def _rows_of(name: str, records: Sequence[Trace], named: Mapping[str, str], pattern: str) -> Iterator[dict[str, str]]:
    """One row for each record of an export; strokes in both directions share a row, as they share one zero.

    ``pattern`` is that of the heads of records, where there is one.
    """
    file = f"raw/{name}"
    # mean force of the second half
    signs = {math.copysign(1.0, float(np.mean(r.force_N[r.force_N.size // 2 :]))) for r in records}
    if len(records) < 2:
        yield _row(file, named, records[0], pattern) if records else {"file": file, **named}
    elif len(signs) == 2 and not pattern:
        yield _row(f"{file}#*", named, records[0], pattern)
    else:
        for k, record in enumerate(records, start=1):
            yield _row(f"{file}#{k}", named, record, pattern)


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
    if speed := _recorded_speed_mm_s(record) or stated_in_header.get("speed_mm_s", ""):
        row.setdefault("speed_mm_s", speed)
    if started := started_at(record.metadata):
        row.setdefault("started_at", started)
    return row


def has_load(record: Trace) -> bool:
    """Whether a normal force was recorded, and not zero throughout."""
    load = record.columns.get("normal_force_N")
    return load is not None and bool(np.any(load != 0))


def _recorded_speed_mm_s(record: Trace) -> str:
    """The median of a recorded speed while there is any; "" without one."""
    speed = record.columns.get("speed_m_s")
    if speed is None or not np.abs(speed).max() > 0:
        return ""
    size = np.abs(speed)
    text = f"{np.median(size[size >= 0.5 * size.max()]) * 1e3:.3g}"
    return text if float(text) > 0 else ""


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
    with_load = [r for r in draft.rows if r["file"].partition("#")[0] in recorded]
    if with_load:
        draft.found.append(f"the normal force is recorded for {len(with_load)} of {len(draft.rows)} rows and is used")
    without = [r["file"] for r in draft.rows if r not in with_load and not any(r.get(c) for c in LOADS)]
    if without:
        draft.missing.append(
            f"the load of {len(without)} rows: normal_load_N or mass_g in tests.csv ({_listed(without)})"
        )
    if not speed_given and not any(r.get("speed_mm_s") for r in draft.rows):
        draft.missing.append("the speed: pull_speed_mm_s in campaign.toml, or a column speed_mm_s in tests.csv")
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
            f"sign = -1 if friction is negative ({_listed(mixed)})"
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


def _listed(names: Iterable[str]) -> str:
    names = list(names)
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


@lru_cache
def name_expression(pattern: str) -> re.Pattern[str]:
    """The expression of a pattern: ``{column}`` for what is read, ``[text]`` for text that may be missing.

    Raises
    ------
    CampaignError
        bad_names: it has no field, or one field twice.
    """
    names = [name for name, _ in _FIELD.findall(pattern) if name]
    if not names or len(set(names)) < len(names):
        what = "a pattern of names needs at least one field, each once"
        allowed = '{column} where a value is read, [text] for what may be missing: "{sample}_{normal_load_N}N_{repeat}"'
        raise CampaignError(Problem("bad_names", what, found=pattern, allowed=allowed))
    parts, at = [], 0
    for mark in _FIELD.finditer(pattern):
        name, optional = mark.groups()
        parts.append(re.escape(pattern[at : mark.start()]))
        parts.append(f"(?P<{name}>{_kind(name)})" if name else f"(?:{re.escape(optional)})?")
        at = mark.end()
    return re.compile("".join(parts) + re.escape(pattern[at:]))


def columns_in_name(name: str, patterns: Sequence[str]) -> dict[str, str] | None:
    """Columns of tests.csv by what a name says, by the first pattern that fits it; None where none does."""
    found = next(filter(None, (name_expression(pattern).fullmatch(name) for pattern in patterns)), None)
    return None if found is None else dict(as_column(*one) for one in found.groupdict().items())


def _kind(field: str) -> str:
    """A number where the field ends in a unit or counts, else text up to the next literal."""
    if field in ("repeat", "run_order", "specimen_run", "cycle"):
        return r"\d+"
    return _NUMBER if "_" in field and field not in _TEXTS else ".+?"


def as_column(name: str, text: str) -> tuple[str, str]:
    """(column of tests.csv, text) of a field and its text: numbers with a point, in the unit of the column."""
    if _kind(name) != _NUMBER:
        return name, text
    sign, digits = ("-", text[1:]) if text.startswith("-") else ("", text.lstrip("+"))
    number = sign + re.sub(r"[,p-]", ".", digits)  # 0-3 and 0p3 are 0.3 in names that may hold no point
    column, factor = _CONVERTED.get(name, (name, None))
    return column, number if factor is None else f"{float(number) * factor:.10g}"


def proposed_patterns(names: Sequence[str]) -> tuple[str, ...]:
    """Patterns that together fit the names, the most frequent first; nothing where names say nothing.

    Parts between ``_`` or blanks: a number with a unit is its quantity, a number at the end the repeat, the first other
    part that is no number the sample; everything else stays as it is.
    """
    shapes = Counter(map(_shape, names))
    ordered = sorted(shapes, key=lambda shape: -shapes[shape])
    fewest = min(_FEWEST_FITTING, len(names))  # a pattern that only one of many names fits says nothing
    return tuple(shape for shape in ordered if "{" in shape and shape != "{sample}" and shapes[shape] >= fewest)


def _shape(name: str) -> str:
    parts = _SEPARATOR.split(name)
    between = [*_SEPARATOR.findall(name), ""]
    taken: set[str] = set()
    last = len(parts) - 1
    return "".join(_shape_of_part(part, 0 < k == last, taken) + between[k] for k, part in enumerate(parts))


def _shape_of_part(part: str, is_last: bool, taken: set[str]) -> str:
    part = re.sub(r"[{}\[\]]", "", part)
    if part.isdigit():
        return _field("repeat", part, taken) if is_last else part
    if _NUMBERS.fullmatch(part):
        return _NUMBERS_IN_PART.sub(lambda found: _shape_of_number(found, is_last, taken), part)
    return _field("sample", part, taken) if part else ""


def _shape_of_number(found: re.Match[str], is_last: bool, taken: set[str]) -> str:
    """A number with what stands before and behind it: 60N, 200RPM, k168, v42."""
    prefix, number, unit = found.groups()
    field = _UNITS.get(unit) or _UNITS.get(unit.lower(), "") if unit else ""
    if not field and is_last and not unit and prefix.lower() in _REPEATS:
        field = "repeat"
    field = field or (f"{prefix.lower()}_number" if prefix else "")
    return f"{prefix}{_field(field, number, taken) if field else number}{unit}"


def _field(name: str, text: str, taken: set[str]) -> str:
    """The field, or the text itself where the field is already in the pattern."""
    if name in taken:
        return text
    taken.add(name)
    return f"{{{name}}}"
