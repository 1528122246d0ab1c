"""Quantity and unit of each column. Nothing is guessed: doubtful cases are errors."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from tribo.errors import Problem, ReadError
from tribo.quantities import QUANTITIES, match_quantity, narrow, quantity_named, unit_factor

NEEDED = ("time", "friction force")
ASKED = "asked for"
_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]*(?:\([^\[\]()]*\)[^\[\]()]*)?)\s*[\])]\s*$")
_AFTER_MARK = re.compile(r"^(.*\S)\s*(?:\s?/|\sin\s|,\s|_)\s*((?:[^\W\d_]|[°%])[\w/°%^·²-]*)$")
_MEANS_NORMAL_BESIDE_FRICTION = {
    "load", "last", "applied load", "charge", "carga", "obciążenie", "нагрузка", "载荷", "负荷", "荷重", "하중",
}  # fmt: skip


@dataclass(frozen=True)
class Hint:
    """A column for a quantity, by name and unit ("Fx [gf]") or position ("#3 [N]"), and its source."""

    quantity: str
    wanted: str
    reason: str = ASKED


@dataclass(frozen=True)
class Column:
    """One column taken for a quantity: SI value = factor * value + offset. ``index`` counts from 0."""

    quantity: str
    index: int
    label: str
    factor: float
    offset: float
    reason: str


@dataclass(frozen=True)
class Assignment:
    """The column of each quantity, time and friction force first, and what was left out for want of a unit."""

    columns: tuple[Column, ...]
    left_out: tuple[Problem, ...] = ()


def parse_columns(columns: Mapping[str, str] | None) -> tuple[Hint, ...]:
    """``{quantity: "name [unit]"}`` as hints.

    Raises
    ------
    ReadError
        unknown_quantity, for every key that names none.
    """
    found, problems = [], []
    for key, value in (columns or {}).items():
        quantity = quantity_named(key)
        if quantity is None:
            names = [name.replace(" ", "_") for name in QUANTITIES]
            near = difflib.get_close_matches(key, names, 1)
            allowed = f"{', '.join(names)}{f' (did you mean {near[0]}?)' if near else ''}"
            problems.append(Problem("unknown_quantity", "not a known quantity", found=key, allowed=allowed))
        else:
            found.append(Hint(quantity, value.strip()))
    if problems:
        raise ReadError(problems)
    return tuple(found)


def columns_from_text(text: str) -> dict[str, str]:
    """Columns as given on a command line: "time=Clock [s], friction_force=#3 [gf]".

    Raises
    ------
    ReadError
        bad_columns, for a part that is not QUANTITY=COLUMN.
    """
    found = {}
    for part in re.split(r",(?=\s*\w[\w ]*=)", text):
        key, equals, value = part.partition("=")
        if not equals or not key.strip() or not value.strip():
            allowed = "time=NAME [unit], friction_force=#3 [unit]"
            raise ReadError(Problem("bad_columns", "not QUANTITY=COLUMN", found=part.strip(), allowed=allowed))
        found[key.strip()] = value.strip()
    return found


def is_asked_for(name: str, hints: Sequence[Hint]) -> bool:
    """Whether a hint names this column."""
    return any(name in (hint.wanted, split_unit(hint.wanted)[0]) for hint in hints)


@lru_cache(maxsize=512)
def assign(
    names: tuple[str, ...], units: tuple[str, ...], filled: tuple[bool, ...], hints: tuple[Hint, ...] = ()
) -> Assignment:
    """The column of each quantity. Where a quantity that a trace can do without has no unit, it is left out.

    Raises
    ------
    ReadError
        missing_column, missing_unit or unknown_unit; all of them at once.
    """
    problems: list[Problem] = []
    left_out: list[Problem] = []
    chosen: dict[str, tuple[int, str | None, str]] = {}
    for hint in hints:
        try:
            chosen.setdefault(hint.quantity, _wanted_column(hint, names))
        except ReadError as why:
            problems.extend(why.problems)
    taken = {index for index, _, _ in chosen.values()}
    asked_in_vain = {hint.quantity for hint in hints} - set(chosen)
    for quantity, index, reason in _matches(names, filled, taken):
        chosen.setdefault(quantity, (index, None, reason))
    for quantity in NEEDED:
        if quantity not in chosen and quantity not in asked_in_vain:
            problems.append(_missing(quantity, names))
    columns = []
    for quantity in sorted(chosen, key=list(QUANTITIES).index):
        index, unit, reason = chosen[quantity]
        try:
            columns.append(_column(quantity, index, unit, reason, names, units))
        except ReadError as why:
            found = [_placed(p, quantity, names[index] or f"#{index + 1}") for p in why.problems]
            optional = quantity not in NEEDED and all(p.kind == "missing_unit" for p in found)
            (left_out if optional else problems).extend(found)
    if problems:
        raise ReadError(problems)
    return Assignment(tuple(columns), tuple(left_out))


def _matches(names: Sequence[str], filled: Sequence[bool], taken: set[int]) -> list[tuple[str, int, str]]:
    """(quantity, index, reason) of the best-named column of each quantity; the first of equal ones."""
    best: dict[str, tuple[int, int]] = {}
    hits = {
        index: hit
        for index, name in enumerate(names)
        if name and index not in taken and filled[index] and (hit := match_column(name))
    }
    for index, (quantity, rank) in hits.items():
        if quantity not in best or rank < best[quantity][0]:
            best[quantity] = (rank, index)
    friction = best.get("friction force")
    for index, (quantity, _) in hits.items():
        plain = split_unit(names[index])[0].strip().lower()
        beside = quantity == "friction force" and friction and index != friction[1]
        if beside and plain in _MEANS_NORMAL_BESIDE_FRICTION and "normal force" not in best:
            best["normal force"] = (0, index)
    return [(q, index, f'named "{names[index]}"') for q, (_, index) in best.items()]


def match_column(name: str) -> tuple[str, int] | None:
    """(quantity, rank) of a column name with or without its unit in it."""
    return match_quantity(name) or match_quantity(split_unit(name)[0])


def _wanted_column(hint: Hint, names: Sequence[str]) -> tuple[int, str | None, str]:
    wanted = hint.wanted
    name, unit = (wanted, None) if wanted in names else split_unit(wanted)
    if re.fullmatch(r"#\d+", name) and 1 <= int(name[1:]) <= len(names):
        return int(name[1:]) - 1, unit, f"{hint.reason} by position" if hint.reason == ASKED else hint.reason
    bare = [split_unit(n)[0] for n in names]
    for have in (list(names), bare):
        if name in have:
            return have.index(name), unit, f"{hint.reason} by name" if hint.reason == ASKED else hint.reason
    near = difflib.get_close_matches(name, [n for n in names if n], 1)
    allowed = f"{_listed(names)}{f' (did you mean {near[0]}?)' if near else ''}"
    what = f"no column has the name or position given for the {hint.quantity}"
    raise ReadError(Problem("missing_column", what, found=wanted, allowed=allowed))


def _column(
    quantity: str, index: int, unit: str | None, reason: str, names: Sequence[str], units: Sequence[str]
) -> Column:
    if unit is None:
        unit = _bare(units[index]) or split_unit(names[index])[1] or ""
    factor, offset = unit_factor(unit, quantity)
    label = split_unit(names[index])[0] or f"#{index + 1}"
    label = f"{label} [{unit}]" if unit else label
    return Column(quantity, index, label, factor, offset, reason)


def _placed(problem: Problem, quantity: str, name: str) -> Problem:
    """A fault of a unit with its column, and how to give the unit."""
    si = QUANTITIES[quantity].si_unit
    way = f'{_key(quantity)} = "{split_unit(name)[0]} [unit]" in columns, the unit such as {si}'
    return replace(problem, column=name, allowed=way)


def _key(quantity: str) -> str:
    return quantity.replace(" ", "_")


def _bare(unit: str) -> str:
    """ "(mm)" and "[mm]" -> "mm"."""
    found = _BRACKETS.fullmatch(unit.strip())
    return found.group(1).strip() if found else unit.strip()


@lru_cache(maxsize=1024)
def split_unit(name: str) -> tuple[str, str | None]:
    """("Kraft", "kN") of "Kraft [kN]", "Kraft (kN)", "Kraft / kN", "Kraft/kN", "Kraft in kN", "Kraft_kN"."""
    name = narrow(name)
    found = _BRACKETS.search(name)
    if found:
        return name[: found.start()].strip(), found.group(1).strip()
    found = _AFTER_MARK.match(name)
    hit = match_quantity(found.group(1)) if found and match_quantity(name) is None else None
    if found and hit and _is_unit(found.group(2), hit[0]):
        return found.group(1).strip(), found.group(2)
    return name, None


def _is_unit(text: str, quantity: str) -> bool:
    try:
        unit_factor(text, quantity)
    except ReadError:
        return False
    return True


def _missing(quantity: str, names: Sequence[str]) -> Problem:
    here = f"columns here: {_listed(names)}" if any(names) else f"{len(names)} columns without names"
    if quantity == "time":
        here = f"a counter takes the sampling interval as its unit, [0.01 s]; {here}"
    example = '"NAME [unit]"' if any(names) else '"#2 [unit]"'
    allowed = f"{_key(quantity)} = {example} in columns; {here}"
    return Problem("missing_column", f"no column was recognised as the {quantity}", allowed=allowed)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(n or f"#{k + 1}" for k, n in enumerate(names))
