"""What the names of files say about tests, by a pattern such as "{sample}_{normal_load_N}N", given or proposed.

A campaign drafted from the exports at hand: what their names, headers and columns say, and what they do not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tribo.campaign.rows import Columns
from tribo.errors import CampaignError, Problem, ReadError, TriboError
from tribo.files import found_below
from tribo.records import Correction, Test, Trace
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


@dataclass(frozen=True)
class NamePattern:
    """A pattern of file names: its text, and the expression that its fields are read by."""

    text: str
    expression: re.Pattern[str]

    def fields(self, name: str) -> dict[str, str] | None:
        """Columns of tests.csv by what a name says, None where the pattern does not fit it."""
        found = self.expression.fullmatch(name)
        return None if found is None else dict(map(as_column, found.groupdict().items()))


def name_pattern(text: str) -> NamePattern:
    """The pattern of a text: ``{column}`` for what is read, ``[text]`` for text that may be missing.

    Raises
    ------
    CampaignError
        bad_names: it has no field, or one field twice.
    """
    fields = [name for name, _ in _FIELD.findall(text) if name]
    if not fields or len(set(fields)) < len(fields):
        what = "a pattern of names needs at least one field, each once"
        allowed = '{column} where a value is read, [text] for what may be missing: "{sample}_{normal_load_N}N_{repeat}"'
        raise CampaignError(Problem("bad_names", what, found=text, allowed=allowed))
    parts, at = [], 0
    for place in _FIELD.finditer(text):
        parts.append(re.escape(text[at : place.start()]))
        name, optional = place.groups()
        parts.append(f"(?P<{name}>{_kind(name)})" if name else f"(?:{re.escape(optional)})?")
        at = place.end()
    return NamePattern(text, re.compile("".join(parts) + re.escape(text[at:])))


def _kind(field: str) -> str:
    """A number where the field ends in a unit or counts, else text up to the next literal."""
    if field in ("repeat", "run_order", "specimen_run", "cycle"):
        return r"\d+"
    return _NUMBER if "_" in field and field not in _TEXTS else ".+?"


def as_column(field: tuple[str, str]) -> tuple[str, str]:
    """(column of tests.csv, text) of a field and its text: numbers with a point, in the unit of the column."""
    name, text = field
    if _kind(name) != _NUMBER:
        return name, text
    sign, digits = ("-", text[1:]) if text.startswith("-") else ("", text.lstrip("+"))
    number = sign + re.sub(r"[,p-]", ".", digits)  # 0-3 and 0p3 are 0.3 in names that may hold no point
    if name in _CONVERTED:
        column, factor = _CONVERTED[name]
        return column, f"{float(number) * factor:.10g}"
    return name, number


def read_names(names: Iterable[str], patterns: Sequence[NamePattern]) -> dict[str, dict[str, str]]:
    """What each name says by the first pattern that fits it; names that none fits are left out."""
    found = {}
    for name in names:
        read = next((fields for p in patterns if (fields := p.fields(name)) is not None), None)
        if read is not None:
            found[name] = read
    return found


def proposed_patterns(names: Sequence[str]) -> tuple[NamePattern, ...]:
    """Patterns that together fit the names, the most frequent first; nothing where names say nothing.

    Parts between ``_`` or blanks: a number with a unit is its quantity, a number at the end the repeat, the first other
    part that is no number the sample; everything else stays as it is.
    """
    shapes: dict[str, int] = {}
    for name in names:
        shape = _shape(name)
        shapes[shape] = shapes.get(shape, 0) + 1
    ordered = sorted(shapes, key=lambda shape: -shapes[shape])
    fewest = min(_FEWEST_FITTING, len(names))  # a pattern that only one of many names fits says nothing
    told = [shape for shape in ordered if "{" in shape and shape != "{sample}" and shapes[shape] >= fewest]
    return tuple(map(name_pattern, told))


def _shape(name: str) -> str:
    parts = _SEPARATOR.split(name)
    between = [*_SEPARATOR.findall(name), ""]
    taken: set[str] = set()
    shaped = []
    for k, part in enumerate(parts):
        shaped.append(_shape_of_part(part, k == len(parts) - 1 and k > 0, taken) + between[k])
    return "".join(shaped)


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


_NOT_LOOKED_AT = (".", "~$", "Thumbs.db")
_NAMES_OR_UNITS = {
    "missing_column", "missing_unit", "unknown_unit", "ambiguous_unit", "ambiguous_mark", "names_do_not_fit",
    "time_of_day",
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
_LOADS = ("normal_load_N", "mass_g", "normal_stress_Pa")
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


@dataclass(frozen=True)
class Stated:
    """What a user states for all exports of a draft."""

    patterns: tuple[NamePattern, ...] = ()
    records: NamePattern | None = None
    columns: Columns = field(default_factory=dict)
    correction: Correction = field(default_factory=Correction)
    filled: Mapping[str, str] = field(default_factory=dict)  # columns of tests.csv with one value for all tests


@dataclass(frozen=True)
class _Looked:
    """One export: its records, or why it cannot be read and what to give."""

    file: str
    records: tuple[Trace, ...] = ()
    problems: tuple[Problem, ...] = ()

    @property
    def needs_columns(self) -> bool:
        return bool(self.problems) and all(p.kind in _NAMES_OR_UNITS for p in self.problems)


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


def draft_campaign(raw: Path, stated: Stated) -> Draft:
    """The rows of tests.csv that the exports of a folder give.

    Raises
    ------
    CampaignError
        The folder holds no files, or none that could be an export.
    """
    looked = [_look(name, path, stated) for name, path in exports_in(raw).items()]
    readable = [one for one in looked if one.records]
    used = readable or [one for one in looked if one.needs_columns]
    draft = Draft()
    draft.not_read = [f"{one.file}: {_first(one.problems)}" for one in looked if one not in used]
    if not used:
        raise CampaignError([p for one in looked for p in one.problems[:1]])
    named = _named(used, stated.patterns, draft)
    for one in used:
        draft.rows += [_filled(row, stated.filled) for row in _rows_of(one, named.get(one.file, {}), stated)]
    _choose_records(draft.rows)
    _number_rows(draft.rows, raw.stem)
    _say_what_is_missing(draft, used, speed_given=stated.correction.speed_m_s is not None)
    _signs(draft, readable)
    return draft


def _look(name: str, path: Path, stated: Stated) -> _Looked:
    from tribo.readers import read_blocks

    try:
        records = read_blocks(path, columns=stated.columns, correction=stated.correction, name=name, file=name)
        return _Looked(name, tuple(r for r in records if r.time_s.size >= _FEWEST_ROWS))
    except TriboError as why:
        return _Looked(name, problems=why.problems)


def _first(problems: Sequence[Problem]) -> str:
    return problems[0].what if problems else "no record of more than a few rows"


def _named(used: Sequence[_Looked], patterns: tuple[NamePattern, ...], draft: Draft) -> dict[str, dict[str, str]]:
    """What the names of files say, and a note on the patterns used and on names that none fits."""
    stems = {one.file: _stem(one.file) for one in used}
    chosen = patterns or proposed_patterns(list(stems.values()))
    read = read_names(stems.values(), chosen)
    for pattern in chosen:
        n = sum(pattern.fields(stem) is not None for stem in stems.values())
        how = "as given" if patterns else "proposed; give --names to read them otherwise"
        draft.found.append(f'names "{pattern.text}" ({how}): fits {n} of {len(stems)} files')
    unfit = [file for file, stem in stems.items() if stem not in read]
    if unfit and chosen:
        draft.missing.append(f"names that no pattern fits: {_listed(unfit)}")
    return {file: read[stem] for file, stem in stems.items() if stem in read}


def _stem(file: str) -> str:
    """The name of a file without folder and suffixes; a point between digits is no suffix."""
    return re.sub(r"(?:\.[A-Za-z]\w{0,5})+$", "", file.rpartition("/")[2])


def _rows_of(one: _Looked, named: Mapping[str, str], stated: Stated) -> list[dict[str, str]]:
    """One row for each record of an export; strokes in both directions share a row, as they share one zero."""
    file = f"raw/{one.file}"
    if len(one.records) < 2:
        return [_row(file, named, one.records[0] if one.records else None, stated)]
    signs = {math.copysign(1.0, _level(record)) for record in one.records}
    if len(signs) == 2 and stated.records is None:
        return [_row(f"{file}#*", named, one.records[0], stated)]
    return [_row(f"{file}#{k}", named, record, stated) for k, record in enumerate(one.records, start=1)]


def _level(record: Trace) -> float:
    """Mean force of the second half, N."""
    return float(np.mean(record.force_N[record.force_N.size // 2 :]))


def _row(file: str, named: Mapping[str, str], record: Trace | None, stated: Stated) -> dict[str, str]:
    row = {"file": file, **named}
    if record is None:
        return row
    label = str(record.metadata.get("record", ""))
    if stated.records is not None and (fields := stated.records.fields(label)) is not None:
        row |= fields
    elif label:
        row["record"] = label
    if has_load(record) and "normal_load_N" in row:
        row["nominal_load_N"] = row.pop("normal_load_N")  # the recorded load is used, as the row gives none
    recorded = {**_in_header(record.metadata), **_recorded(record)}
    if "normal_load_N" in recorded and not has_load(record) and not any(row.get(key) for key in _LOADS):
        row["normal_load_N"] = recorded["normal_load_N"]
    if "speed_mm_s" in recorded:
        row.setdefault("speed_mm_s", recorded["speed_mm_s"])
    if started := started_at(record.metadata):
        row.setdefault("started_at", started)
    return row


def has_load(record: Trace) -> bool:
    """Whether a normal force was recorded, and not zero throughout."""
    load = record.columns.get("normal_force_N")
    return load is not None and bool(np.any(load != 0))


def _recorded(record: Trace) -> dict[str, str]:
    """The speed as a column of a record holds it: its median while there is any."""
    found = {}
    speed = record.columns.get("speed_m_s")
    if speed is not None and np.abs(speed).max() > 0:
        size = np.abs(speed)
        found["speed_mm_s"] = f"{np.median(size[size >= 0.5 * size.max()]) * 1e3:.3g}"
    return {key: text for key, text in found.items() if float(text) > 0}


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
            if found:
                parts = found.groupdict()
                month = parts.get("m") or str(_month(parts.get("month") or ""))
                date = f"{int(parts['y']):04d}-{int(month):02d}-{int(parts['d']):02d}"
                if 1 <= int(month) <= 12 and 1 <= int(parts["d"]) <= 31:
                    clock = parts.get("clock")
                    return f"{date}T{clock:0>{5 if clock.count(':') == 1 else 8}}" if clock else date
    return ""


def _month(word: str) -> int:
    return _MONTHS.index(word.lower()) + 1 if word.lower() in _MONTHS else 0


def _filled(row: dict[str, str], given: Mapping[str, str]) -> dict[str, str]:
    """A row with the given values in the columns that it leaves empty."""
    return row | {column: value for column, value in given.items() if not row.get(column)}


def _choose_records(rows: Sequence[dict[str, str]]) -> None:
    """Beside rows with a load, a row that leaves it to its export names the record: raw/a.csv#1."""
    loaded = [any(row.get(key) for key in _LOADS) for row in rows]
    if any(loaded):
        for row, there in zip(rows, loaded, strict=True):
            if not there and "#" not in row["file"] and "nominal_load_N" in row:
                row["file"] += "#1"


def _number_rows(rows: Sequence[dict[str, str]], sample: str) -> None:
    """Every row gets a test_id, a sample, and its place in the order of starts where all have a date."""
    width = len(str(len(rows)))
    for k, row in enumerate(rows, start=1):
        row.setdefault("test_id", f"T{k:0{width}d}")
        row.setdefault("sample", sample)
    if all(len(row.get("started_at", "")) > len("2026-01-01") for row in rows):
        for k, row in enumerate(sorted(rows, key=lambda r: r["started_at"]), start=1):
            row["run_order"] = str(k)


def _say_what_is_missing(draft: Draft, used: Sequence[_Looked], speed_given: bool) -> None:
    refused = [one for one in used if one.problems]
    for what in dict.fromkeys(f"{p.what}; give: {p.allowed}" for one in refused for p in one.problems):
        draft.missing.append(what)
    recorded = {f"raw/{one.file}" for one in used if any(map(has_load, one.records))}
    with_load = [r for r in draft.rows if r["file"].partition("#")[0] in recorded]
    if with_load:
        draft.found.append(f"the normal force is recorded for {len(with_load)} of {len(draft.rows)} rows and is used")
    without = [r["file"] for r in draft.rows if r not in with_load and not any(r.get(c) for c in _LOADS)]
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


def _signs(draft: Draft, readable: Sequence[_Looked]) -> None:
    """Note whether the friction force is negative in every record, or takes both signs within one."""
    records = [record for one in readable for record in one.records]
    draft.negative = bool(records) and all(map(_is_negative, records))
    if draft.negative:
        draft.found.append("the friction force is negative in every record: sign = -1 was written")
    mixed = [one.file for one in readable if len(one.records) == 1 and _takes_both_signs(one.records[0])]
    if mixed and all(map(_positive_over_rest, records)):
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


def _range(record: Trace) -> tuple[float, float]:
    """Lowest and highest force but for a twentieth of the samples at either end, N."""
    low, high = np.percentile(record.force_N, (5, 95))
    return float(low), float(high)


def _is_negative(record: Trace) -> bool:
    low, high = _range(record)
    return low < 0 and high < _BOTH_SIGNS * -low


def _takes_both_signs(record: Trace) -> bool:
    low, high = _range(record)
    return low < 0 < high and min(-low, high) > _BOTH_SIGNS * max(-low, high)


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
