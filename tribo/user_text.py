"""Text of users: escaped for a terminal, a cell of a spreadsheet or a file name; the name they may have meant; numbers
as they write them.
"""

from __future__ import annotations

import difflib
import math
import re
import unicodedata
from collections.abc import Iterable, Sequence

_DIRECTION_MARKS = "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\ufeff"
_NOT_PRINTED = ("Cc", "Cs", "Zl", "Zp")
_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # OWASP, CSV injection: beginnings that spreadsheets take for a formula
_FEWEST_INSIDE = 4  # letters of a name that may stand for a longer one: "load" for "normal_load_N"
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")


def is_control(character: str) -> bool:
    """Whether a terminal would obey a character and not show it; line ends and tabs included."""
    return character in _DIRECTION_MARKS or unicodedata.category(character) in _NOT_PRINTED


def printable(text: str) -> str:
    """Text for a terminal: control characters, direction marks and lone surrogates as escapes, line ends and tabs kept.

    The result can be encoded in UTF-8.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(_escaped(c) if is_control(c) and c not in "\n\t" else c for c in text)


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


def well_formed(name: str) -> str:
    """A name that can be written in UTF-8: bytes of a file name that are not UTF-8 are shown as escapes."""
    return name.encode("utf-8", errors="backslashreplace").decode("utf-8")


def for_spreadsheet(cell: str) -> str:
    """A cell of a CSV file that no spreadsheet takes for a formula; :func:`from_spreadsheet` gives the text back.

    An apostrophe is put before a text that begins with ``=``, ``+``, ``-``, ``@``, tab or carriage return. Numbers such
    as -1.5 stay as they are.
    """
    return f"'{cell}" if _would_be_formula(cell) else cell


def from_spreadsheet(cell: str) -> str:
    """The text that :func:`for_spreadsheet` was given."""
    return cell[1:] if cell.startswith("'") and _would_be_formula(cell) else cell


def _would_be_formula(cell: str) -> bool:
    """Whether a cell begins like a formula, apostrophes before it not counted."""
    begins = cell.lstrip("'")
    return begins.startswith(_FORMULA) and not _NUMBER.fullmatch(begins)


def nearest(given: str, allowed: Iterable[str], cutoff: float = 0.6) -> str:
    """The allowed name nearest to ``given``; empty where none is near. Names that differ in case only come first."""
    plain: dict[str, str] = {}
    for name in allowed:
        plain.setdefault(_plain(name), name)
    wanted = _plain(given)
    if not wanted or not plain:
        return ""
    if wanted in plain:
        return plain[wanted]
    if near := difflib.get_close_matches(wanted, plain, 1, cutoff):
        return plain[near[0]]
    inside = [name for name in plain if wanted in name.split("_")] if len(wanted) >= _FEWEST_INSIDE else []
    return plain[inside[0]] if inside else ""


def did_you_mean(given: str, allowed: Iterable[str], cutoff: float = 0.6) -> str:
    """The question "did you mean NAME?"; empty where no allowed name is near."""
    near = nearest(given, allowed, cutoff)
    return f"did you mean {near}?" if near else ""


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "_", name.strip().casefold()).strip("_")


# What people write into a cell that has no value.
NOT_RECORDED = frozenset(
    {"", "-", "--", "–", "—", "?", "n/a", "n.a.", "na", "nan", "not recorded", "not measured", "missing"}
)
MOSTLY_NUMBERS = 0.8  # share of the cells with something in them from which on a column is one of numbers


def is_recorded(cell: str) -> bool:
    """Whether a cell holds anything but a word for a missing value."""
    return cell.strip().casefold() not in NOT_RECORDED


def is_number(cell: str) -> bool:
    """Whether a cell is a finite number."""
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def are_numbers(cells: Sequence[str]) -> bool:
    """Whether a column is one of numbers, whatever words stand in a few of its cells."""
    numbers = sum(map(is_number, cells))
    return numbers > 0 and numbers >= MOSTLY_NUMBERS * sum(map(is_recorded, cells))


def plain(value: float, digits: int = 3) -> str:
    """ "1200", "0.05": at most so many significant digits, never in powers of ten."""
    rounded = f"{value:.{digits}g}"
    if "e" not in rounded:
        return rounded
    return f"{float(rounded):.0f}" if abs(value) >= 1.0 else f"{float(rounded):.12f}".rstrip("0")
