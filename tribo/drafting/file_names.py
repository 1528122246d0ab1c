"""What the names of files say, by patterns such as "{sample}_{normal_load_N}N_*", given or proposed."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from tribo.errors import CampaignError, Problem, ReadError
from tribo.units import turns_a_time, unit_factor

_MARKS = re.compile(r"\{(?P<field>\w+)\}|\[(?P<optional>[^\[\]{}]*)\]|(?P<skipped>\*)")
_NUMBER = r"[-+]?\d+(?:[.,p-]\d+)?"
_NUMBER_WITH_UNIT = r"[-+]?\d+(?:[.,p-]\d+)?[A-Za-zµ%]+(?:[-/][A-Za-z]+)?"
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
# field whose unit stands in the name: quantity, column of tests.csv, its unit in SI units
_WITH_UNIT = {
    "normal_load": ("normal force", "normal_load_N", 1.0), "load": ("normal force", "normal_load_N", 1.0),
    "normal_stress": ("normal stress", "normal_stress_Pa", 1.0), "hold": ("time", "hold_s", 1.0),
    "speed": ("speed", "speed_mm_s", 1e3), "mass": ("normal force", "mass_g", 1.0 / 9.80665e-3),
}  # fmt: skip
# text behind a number in a file name: the field it is proposed as
_UNITS = {
    "N": "normal_load_N", "mN": "normal_load_mN", "kN": "normal_load_kN", "gf": "normal_load_gf", "g": "mass_g",
    "kgf": "normal_load_kgf", "kg": "mass_kg", "Pa": "normal_stress_Pa", "kPa": "normal_stress_kPa",
    "MPa": "normal_stress_MPa", "rpm": "speed_rpm", "rps": "speed_rps", "Hz": "frequency_Hz", "hz": "frequency_Hz",
    "min": "duration_min", "mins": "duration_min", "C": "temperature_C", "degC": "temperature_C",
    "mms": "speed_mm_s", "mm-s": "speed_mm_s", "ums": "speed_um_s", "um-s": "speed_um_s", "pct": "humidity_pct",
    "RH": "humidity_pct", "wt": "content_wt",
}  # fmt: skip
_OF_ONE_COLUMN = {"normal_load_N": "normal_load", "normal_load_mN": "normal_load", "normal_load_kN": "normal_load"}
_PIECE = (  # 300-75 is a range, 0-3 a number
    r"((?:0-\d+|\d{1,2}-\d|\d+(?:[.,]\d+)?)(?![\d-]))((?:mm-s|um-s)(?![A-Za-z])|[A-Za-z]{0,12})"
)
_PIECES = re.compile(rf"([A-Za-z]*?){_PIECE}")
_IS_PIECES = re.compile(rf"[A-Za-z]{{0,4}}(?:{_PIECE})+")
_PARTS = re.compile(r"(?:\{[^{}]*\}|[^_ ])+")
_FEWEST_FITTING = 2
_REPEATS = {"", "r", "rep", "run", "test", "t", "no", "stroke"}
_DATE = re.compile(r"\d{4}[-.]\d{1,2}[-.]\d{1,2}|\d{1,2}[-.]\d{1,2}[-.]\d{4}")
_NUMBERED = re.compile(r"[A-Za-z]{0,4}-?\d+")
_SEPARATOR = re.compile(r"[_ ]+")
_DASHES = re.compile("-")
_SHOWN = 5
_DECIMAL = r"\d+(?:[.,]\d+)?"
_RADIUS = re.compile(
    rf"(?<![A-Za-z0-9.,-])(?P<a>{_DECIMAL})(?:-(?P<b>{_DECIMAL}))?[ -]?mm[ _-]?(?:track[ _-]?)?(?:radius|rad)(?![a-z])"
    rf"|(?<![A-Za-z])(?:radius|rad|r)[ _=-]?(?P<c>{_DECIMAL})[ -]?mm(?![A-Za-z/-])", re.I,
)  # fmt: skip
_SPEEDS = re.compile(rf"(?<![A-Za-z0-9.,-])(?P<a>{_DECIMAL})-(?P<b>{_DECIMAL})[ _]?mm-?s(?![A-Za-z])", re.I)
_AGREE = 0.03  # share by which a speed and that of its radius and turns differ at the most


@dataclass(frozen=True)
class _Element:
    """A piece of a pattern: its text, the expression that it stands for, and what it is.

    ``kind`` is field, skipped (``*``), optional (``[text]``) or literal.
    """

    text: str
    expression: str
    kind: str


def _elements(pattern: str) -> list[_Element]:
    found, at = [], 0
    for mark in _MARKS.finditer(pattern):
        if mark.start() > at:
            found.append(_Element(pattern[at : mark.start()], re.escape(pattern[at : mark.start()]), "literal"))
        if name := mark["field"]:
            found.append(_Element(mark[0], f"(?P<{name}>{_kind(name)})", "field"))
        elif mark["skipped"]:
            found.append(_Element("*", "(.*?)", "skipped"))
        else:
            found.append(_Element(mark[0], f"({re.escape(mark['optional'])})?", "optional"))
        at = mark.end()
    if at < len(pattern):
        found.append(_Element(pattern[at:], re.escape(pattern[at:]), "literal"))
    return found


@lru_cache
def name_expression(pattern: str) -> re.Pattern[str]:
    """The expression of a pattern: ``{column}`` is read, ``[text]`` may be missing, ``*`` is text that is not used.

    Raises
    ------
    CampaignError
        bad_names: it has neither a field nor ``*``, or one field twice.
    """
    elements = _elements(pattern)
    names = [e.text for e in elements if e.kind == "field"]
    if not (names or any(e.kind == "skipped" for e in elements)) or len(set(names)) < len(names):
        what = "a pattern of names needs at least one field, each once"
        allowed = (
            "{column} where a value is read, [text] for what may be missing, * for what is not used: "
            '"{sample}_{normal_load_N}N_*"'
        )
        raise CampaignError(Problem("bad_names", what, found=pattern, allowed=allowed))
    return re.compile("".join(e.expression for e in elements))


def columns_in_name(name: str, patterns: Sequence[str]) -> dict[str, str] | None:
    """Columns of tests.csv by what a name says, by the first pattern that fits it; None where none does."""
    found = next(filter(None, (name_expression(pattern).fullmatch(name) for pattern in patterns)), None)
    return None if found is None else dict(as_column(*one) for one in found.groupdict().items())


def not_used(names: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """Texts of the names that differ between files and that no field takes, one line for each ``*`` or ``[text]``."""
    taken: dict[tuple[str, int], list[str]] = {}
    for name in names:
        for pattern in patterns:
            if fits := name_expression(pattern).fullmatch(name):
                of_fields = set(name_expression(pattern).groupindex.values())
                for k in set(range(1, len(fits.groups()) + 1)) - of_fields - _units(pattern):
                    taken.setdefault((pattern, k), []).append(fits[k] or "")
                break
    differing = {place: list(dict.fromkeys(texts)) for place, texts in taken.items() if len(set(texts)) > 1}
    return [listed([text or "(nothing)" for text in texts]) for _, texts in sorted(differing.items())]


def _units(pattern: str) -> set[int]:
    """Groups of the expression of a pattern that are units which may be missing behind a number: {load_N}[N]."""
    elements = _elements(pattern)
    groups = [e for e in elements if e.kind != "literal"]
    after = {id(b) for a, b in pairwise(elements) if a.kind == "field" and _NUMBER in a.expression}
    return {k for k, e in enumerate(groups, start=1) if e.kind == "optional" and id(e) in after}


def where_it_stops(name: str, pattern: str) -> str:
    """At which character of a name a pattern no longer fits."""
    elements = _elements(pattern)
    for n in range(len(elements), -1, -1):
        before = re.compile("".join(e.expression for e in elements[:n])).match(name)
        if before is None:
            continue
        at, wanted = before.end(), elements[n].text if n < len(elements) else ""
        if not wanted:
            return f'"{name}" goes on with "{name[at:]}" from character {at + 1}, where the pattern ends'
        last = elements[n - 1] if n else None
        if last is not None and last.expression.endswith((".+?)", "(.*?)")):
            start = re.compile("".join(e.expression for e in elements[: n - 1])).match(name)
            at = start.end() if start else at
            return f'"{name}" has no "{wanted}" behind {last.text}, which begins at character {at + 1}'
        return f'"{name}" has "{name[at : at + 12]}" at character {at + 1}, where the pattern has "{wanted}"'
    return ""


def _kind(field: str) -> str:
    """A number where the field ends in a unit or counts, a number with its unit, else text up to the next literal."""
    if field in ("repeat", "run_order", "specimen_run", "cycle"):
        return r"\d+"
    if field in _WITH_UNIT:
        return _NUMBER_WITH_UNIT
    return _NUMBER if "_" in field and field not in _TEXTS else ".+?"


def as_column(name: str, text: str) -> tuple[str, str]:
    """(column of tests.csv, text) of a field and its text: numbers with a point, in the unit of the column.

    Raises
    ------
    CampaignError
        bad_names: the unit behind a number is none of its quantity.
    """
    if name in _WITH_UNIT:
        return _with_its_unit(name, text)
    if _kind(name) != _NUMBER:
        return name, text
    column, factor = _CONVERTED.get(name, (name, None))
    number = _as_number(text)
    return column, number if factor is None else f"{float(number) * factor:.10g}"


def _as_number(text: str) -> str:
    """0-3 and 0p3 are 0.3 in names that may hold no point."""
    sign, digits = ("-", text[1:]) if text.startswith("-") else ("", text.lstrip("+"))
    return sign + re.sub(r"[,p-]", ".", digits)


def _with_its_unit(name: str, text: str) -> tuple[str, str]:
    split = re.match(_NUMBER, text)
    number, unit = (text, "") if split is None else (split[0], text[split.end() :].replace("-", "/"))
    quantity, column, per_SI = _WITH_UNIT[name]
    if name == "speed" and turns_a_time(unit):
        return f"speed_{unit.lower()}", _as_number(number)
    try:
        factor, _ = unit_factor(unit, quantity)
    except ReadError as why:
        allowed = f"a number with a unit of {quantity}, or a field with the unit in its name, such as {{{column}}}"
        raise CampaignError(Problem("bad_names", f"not a unit of {name}", None, None, None, text, allowed)) from why
    return column, f"{float(_as_number(number)) * factor * per_SI:.10g}"


def listed(names: Sequence[str]) -> str:
    """The first names, and how many more there are."""
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")


def proposed_patterns(names: Sequence[str]) -> tuple[str, ...]:
    """Patterns that together fit the names, the most frequent first; nothing where names say nothing.

    Names are compared part by part, between ``_`` or blanks. A number with a unit is its quantity, a number at the end
    the repeat, one at the beginning the test; what differs otherwise is the sample first and ``part3`` for the third
    part of the name; text that is the same in all names stays as it is.
    """
    alike: dict[int, list[str]] = {}
    for name in names:
        alike.setdefault(len(_split(name)), []).append(name)
    fewest = min(_FEWEST_FITTING, len(names))  # a pattern that only one of many names fits says nothing
    groups = sorted((group for group in alike.values() if len(group) >= fewest), key=len, reverse=True)
    found = (_pattern_of(group) for group in groups)
    return tuple(pattern for pattern in found if "{" in pattern and pattern != "{sample}")


def _separator(name: str) -> re.Pattern[str]:
    """What stands between the parts of a name: ``_`` or blanks; ``-`` where neither does and it is no decimal mark."""
    dashes = not _SEPARATOR.search(name) and not _IS_PIECES.fullmatch(name) and not _DATE.fullmatch(name)
    return _DASHES if dashes else _SEPARATOR


def _split(name: str) -> list[str]:
    return _separator(name).split(name)


def _pieces_of(pattern: str) -> list[str]:
    """The pieces of a proposed pattern, one for each part of the names."""
    marks = _MARKS.sub("x", pattern)  # without the _ within fields
    return _PARTS.findall(pattern) if _SEPARATOR.search(marks) or "-" not in marks else pattern.split("-")


def _pattern_of(names: Sequence[str]) -> str:
    """One pattern for names of as many parts."""
    if len(set(names)) == len(names) > 1 and all(map(_NUMBERED.fullmatch, names)):
        return "{test_id}"
    parts = list(zip(*map(_split, names), strict=True))
    between = [*_separator(names[0]).findall(names[0]), ""]
    dates = [k for k, values in enumerate(parts) if all(map(_DATE.fullmatch, values))][:1]
    texts = [k for k, values in enumerate(parts) if not _numbers(values) and k not in dates]
    differing = [k for k in texts if len(set(parts[k])) > 1]
    sample = differing[0] if differing else (0 if 0 in texts and len(parts) > 1 else -1)
    taken: set[str] = set()
    found: list[str] = []
    for k, values in enumerate(parts):
        if k in dates:
            found.append("{started_at}")
        elif k in texts:
            name = "sample" if k == sample else f"part{k + 1}"
            found.append(f"{{{name}}}" if k == sample or k in differing else _bare(values[0]))
        else:
            found.append(_pattern_of_numbers(values, k == len(parts) - 1 > 0, k == 0, len(names), taken))
    return "".join(part + mark for part, mark in zip(found, between, strict=True))


def _bare(text: str) -> str:
    return re.sub(r"[{}\[\]*]", "", text)


def _numbers(values: Sequence[str]) -> list[list[tuple[str, str, str]]]:
    """(text before, number, unit) of each number in the parts of all names; [] where they are not alike."""
    if not all(map(_IS_PIECES.fullmatch, values)):
        return []
    found = [_PIECES.findall(value) for value in values]
    if len({tuple(prefix for prefix, _, _ in pieces) for pieces in found}) > 1:
        return []
    for pieces in zip(*found, strict=True):
        units = {unit for _, _, unit in pieces} - {""}
        if len(units) > 1 and {_OF_ONE_COLUMN.get(_UNITS.get(unit, "")) for unit in units} != {"normal_load"}:
            return []
    return found


def _pattern_of_numbers(values: Sequence[str], is_last: bool, is_first: bool, n: int, taken: set[str]) -> str:
    found: list[str] = []
    for pieces in zip(*_numbers(values), strict=True):
        prefix, number, _ = pieces[0]
        units = [unit for _, _, unit in pieces]
        known = sorted(set(units) - {""})
        differs = len({value for _, value, _ in pieces}) > 1
        literal = known[0] if known else ""
        name = (_UNITS.get(literal) or _UNITS.get(literal.lower(), "")) if literal else ""
        if len(known) > 1:
            name, literal = _OF_ONE_COLUMN[_UNITS[known[0]]], ""
        elif known and "" in units:
            literal = f"[{literal}]"
        if not name and is_last and not known and prefix.lower() in _REPEATS:
            name = "repeat"
        if not name and differs and is_first and not known and len(set(values)) == n and len(found) == 0:
            name = "test_id"
        if not name and differs:
            beside = prefix or literal.strip("[]")
            name = f"{beside.lower()}_number" if beside else f"number_{len(taken) + 1}"
        if name in taken and differs:
            name = f"{name}_{len(taken) + 1}"
        if not name or name in taken:
            found.append(f"{prefix}{number}{literal}")
        else:
            found.append(f"{prefix}{{{name}}}{literal}")
        taken.add(name)
    return "".join(found)


def parts_in_words(names: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """What stands in each part of the names, and the piece of the pattern that it is proposed to be."""
    lines = []
    for pattern in patterns:
        fitting = [_split(name) for name in names if name_expression(pattern).fullmatch(name)]
        alike = []
        for k, piece in enumerate(_pieces_of(pattern)):
            values = list(dict.fromkeys(parts[k] for parts in fitting))
            if "{" in piece:
                lines.append(f"part {k + 1} of the names: {listed(values)}, read as {piece}")
            else:
                alike.append(values[0])
        if alike:
            lines.append(f"the same in all names, and not read: {', '.join(alike)}")
    return lines


def radii_in_name(name: str, tables: int, turns_per_s: Sequence[float]) -> list[float]:
    """Radius (mm) of the track of each table of a file by its name: "10mm-radius", "r=10mm"; [] where it says none.

    A range such as "6-15mm-radius" goes evenly from the first table to the last. It is used only where the radii and
    the recorded turns give the speeds that the name states as well, "300-75mm-s".
    """
    found = _RADIUS.search(name)
    if found is None:
        return []
    first = _as_float(found["a"] or found["c"])
    if not found["b"]:
        return [first] * tables
    speeds = _SPEEDS.search(name)
    if speeds is None or tables < 2 or not all(turns > 0 for turns in turns_per_s):
        return []
    ends = (first, _as_float(found["b"])), (_as_float(speeds["a"]), _as_float(speeds["b"]))
    radii, stated = ([a + (b - a) * k / (tables - 1) for k in range(tables)] for a, b in ends)
    for one in (radii, radii[::-1]):
        given = [2.0 * math.pi * r * turns for r, turns in zip(one, turns_per_s, strict=True)]
        for wanted in (stated, stated[::-1]):
            if all(abs(v / w - 1.0) < _AGREE for v, w in zip(given, wanted, strict=True)):
                return one
    return []


def _as_float(text: str) -> float:
    return float(text.replace(",", "."))


def question(names: Sequence[str], patterns: Sequence[str], fits: Mapping[str, object]) -> Problem | None:
    """What has to be asked before names are read by a proposed pattern: nothing may be pooled in silence."""
    if len(names) < 2:
        return None
    unfit = [name for name in names if name not in fits]
    several = [p for p in patterns if "{sample}" in p and re.search(r"\{part\d+\}", p)]
    if several:
        pattern = several[0]
        others = re.findall(r"\{(part\d+)\}", pattern)
        first = next(k for k, piece in enumerate(_pieces_of(pattern), start=1) if "{sample}" in piece)
        without = pattern.replace("{sample}", f"{{part{first}}}")
        chosen = [pattern, *(without.replace(f"{{{name}}}", "{sample}") for name in others)]
        what = "the names of the files differ in more than one text, and one of them is the sample"
        allowed = " or ".join(f'--names "{one}"' for one in chosen)
        found = "; ".join(parts_in_words(names, [pattern]))
        return Problem("names_not_used", what, found=found, allowed=f"{allowed}; * in place of a field leaves it out")
    if unfit:
        what = "the names of the files differ, and nothing tells what this means"
        given = "".join(f'--names "{pattern}" ' for pattern in patterns)
        allowed = (
            f'{given}--names "{{sample}}" if each is a sample of its own, {given}--names "{{test_id}}" if they number '
            f'tests of one sample, {given}--names "*" to leave them out; or a pattern such as '
            '"{sample}_{normal_load_N}N"'
        )
        return Problem("names_not_used", what, found=listed(unfit), allowed=allowed)
    return None
