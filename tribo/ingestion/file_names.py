"""What the names of files say about tests, by a pattern such as "{sample}_{normal_load_N}N", given or proposed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tribo.errors import CampaignError, Problem

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
    for field in _FIELD.finditer(text):
        parts.append(re.escape(text[at : field.start()]))
        name, optional = field.groups()
        parts.append(f"(?P<{name}>{_kind(name)})" if name else f"(?:{re.escape(optional)})?")
        at = field.end()
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
