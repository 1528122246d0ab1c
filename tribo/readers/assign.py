"""Which column is which quantity, in what unit. Nothing is guessed: a doubt is an error."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from tribo.errors import Problem, ReadError
from tribo.quantities import QUANTITIES, match_quantity, unit_factor

NEEDED = ("time", "friction force")
_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]*?)\s*[\])]\s*$")
_AFTER_SLASH = re.compile(r"^(.*\S)\s*(?:\s/|\sin\s|,\s|_)\s*([A-Za-zµμ°%][\w/µμ°%^·²-]*)$")
_SHORT_NAMES = {"force": "friction force", "friction": "friction force", "load": "normal force"}


@dataclass(frozen=True)
class Column:
    """One column taken for a quantity: SI value = factor * value + offset. ``index`` counts from 0."""

    quantity: str
    index: int
    label: str
    factor: float
    offset: float
    reason: str


def quantity_named(key: str) -> str | None:
    """The quantity meant by a key such as "force", "normal_force", "time_s"; None where there is none."""
    plain = key.strip().replace("_", " ").lower()
    if plain in _SHORT_NAMES:
        return _SHORT_NAMES[plain]
    for q in QUANTITIES.values():
        if plain == q.name or key.strip() == q.column:
            return q.name
    return None


def parse_overrides(columns: Mapping[str, str] | None) -> tuple[tuple[str, str], ...]:
    """User's ``{quantity: "name [unit]"}`` with the quantities' own names.

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
            hint = f"{', '.join(names)}{f' (did you mean {near[0]}?)' if near else ''}"
            problems.append(Problem("unknown_quantity", "columns names no quantity", found=key, allowed=hint))
        else:
            found.append((quantity, value))
    if problems:
        raise ReadError(problems)
    return tuple(found)


def is_override(name: str, overrides: Sequence[tuple[str, str]]) -> bool:
    """Whether the user asked for a column of this name."""
    return any(name in (value, _split_unit(value)[0]) for _, value in overrides)


@lru_cache(maxsize=512)
def assign(
    names: tuple[str, ...], units: tuple[str, ...], overrides: tuple[tuple[str, str], ...] = ()
) -> tuple[Column, ...]:
    """The column of each quantity, time and friction force first.

    Raises
    ------
    ReadError
        missing_column, ambiguous_column, missing_unit or unknown_unit; all of them at once.
    """
    problems: list[Problem] = []
    chosen: dict[str, tuple[int, str | None, str]] = {}
    for quantity, wanted in overrides:
        try:
            chosen[quantity] = _wanted_column(quantity, wanted, names)
        except ReadError as why:
            problems.extend(why.problems)
    taken = {index for index, _, _ in chosen.values()}
    for quantity, index, reason in _matches(names, taken):
        chosen.setdefault(quantity, (index, None, reason))
    for quantity in NEEDED:
        if quantity not in chosen:
            problems.append(_missing(quantity, names))
    columns = []
    for quantity in sorted(chosen, key=list(QUANTITIES).index):
        index, unit, reason = chosen[quantity]
        try:
            columns.append(_column(quantity, index, unit, reason, names, units))
        except ReadError as why:
            problems.extend(replace(p, column=names[index] or f"#{index + 1}") for p in why.problems)
    if problems:
        raise ReadError(problems)
    return tuple(columns)


def _matches(names: Sequence[str], taken: set[int]) -> list[tuple[str, int, str]]:
    """(quantity, index, reason) of the best-named column of each quantity; the first of equal ones."""
    best: dict[str, tuple[int, int]] = {}
    for index, name in enumerate(names):
        if not name or index in taken:
            continue
        hit = match_quantity(name) or match_quantity(_split_unit(name)[0])
        if hit is not None and (hit[0] not in best or hit[1] < best[hit[0]][0]):
            best[hit[0]] = (hit[1], index)
    return [(q, index, f'named "{names[index]}"') for q, (_, index) in best.items()]


def _wanted_column(quantity: str, wanted: str, names: Sequence[str]) -> tuple[int, str | None, str]:
    name, unit = (wanted, None) if wanted in names else _split_unit(wanted)
    if re.fullmatch(r"#\d+", name) and 1 <= int(name[1:]) <= len(names):
        return int(name[1:]) - 1, unit, "asked for by position"
    bare = [_split_unit(n)[0] for n in names]
    for have in (list(names), bare):
        if name in have:
            return have.index(name), unit, "asked for by name"
    near = difflib.get_close_matches(name, [n for n in names if n], 1)
    hint = f"{_listed(names)}{f' (did you mean {near[0]}?)' if near else ''}"
    raise ReadError(
        Problem("missing_column", f"no such column for the {quantity}", found=wanted, allowed=hint)
    )


def _column(
    quantity: str, index: int, unit: str | None, reason: str, names: Sequence[str], units: Sequence[str]
) -> Column:
    if unit is None:
        unit = _bare(units[index]) or _split_unit(names[index])[1] or ""
    factor, offset = unit_factor(unit, quantity)
    label = f"{_split_unit(names[index])[0] or f'#{index + 1}'} [{unit}]"
    return Column(quantity, index, label, factor, offset, reason)


def _bare(unit: str) -> str:
    """ "(mm)" and "[mm]" -> "mm"."""
    found = _BRACKETS.fullmatch(unit.strip())
    return found.group(1) if found else unit.strip()


def _split_unit(name: str) -> tuple[str, str | None]:
    """("Kraft", "kN") of "Kraft [kN]", "Kraft (kN)", "Kraft / kN", "Kraft in kN", "Kraft_kN"."""
    found = _BRACKETS.search(name)
    if found:
        return name[: found.start()].strip(), found.group(1)
    found = _AFTER_SLASH.match(name)
    if found and match_quantity(found.group(1)) is not None and match_quantity(name) is None:
        return found.group(1).strip(), found.group(2)
    return name, None


def _missing(quantity: str, names: Sequence[str]) -> Problem:
    key = quantity.replace(" ", "_")
    how = f'give it as {key} = "NAME [unit]" in columns; columns here: {_listed(names)}'
    return Problem("missing_column", f"no column for the {quantity}", allowed=how)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(n or f"#{k + 1}" for k, n in enumerate(names))
