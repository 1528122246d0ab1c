"""What a user states about an export beside its contents: columns, columns left out, decimal mark, corrections."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from tribo.errors import Problem, ReadError
from tribo.nearest import did_you_mean
from tribo.quantities import QUANTITIES, quantity_named
from tribo.readers.core.names import split_unit
from tribo.records import UNCORRECTED, Correction

ASKED = "asked for"
NONE, IGNORE, DECIMAL = "none", "ignore", "decimal"
Columns = Mapping[str, str | Sequence[str]]


@dataclass(frozen=True)
class Hint:
    """A column for a quantity, by name and unit ("Fx [gf]") or position ("#3 [N]"), and its source.

    A name with ``*`` or ``?`` means every column it fits: one record each.
    """

    quantity: str
    wanted: str
    reason: str = ASKED

    @property
    def is_pattern(self) -> bool:
        """Whether the hint may mean several columns."""
        return any(mark in split_unit(self.wanted)[0] for mark in "*?")


@dataclass(frozen=True)
class Given:
    """Everything stated for one export.

    ``without`` are quantities that are not read although a column has their name, ``ignored`` columns that are not
    looked at, by name or position; ``decimal`` is the decimal mark, "" where the file settles it.
    """

    hints: tuple[Hint, ...] = ()
    without: frozenset[str] = frozenset()
    ignored: tuple[str, ...] = ()
    decimal: str = ""
    correction: Correction = UNCORRECTED

    def names(self, name: str) -> bool:
        """Whether a hint names this column."""
        return any(name in (hint.wanted, split_unit(hint.wanted)[0]) for hint in self.hints)

    def with_hints(self, hints: Sequence[Hint]) -> Given:
        """The same with hints of the format added; those of the user come first."""
        return replace(self, hints=(*self.hints, *(h for h in hints if h.quantity not in self.without)))

    def ignores(self, index: int, name: str) -> bool:
        """Whether the column at a position (from 0) is not to be looked at."""
        return any(wanted in (f"#{index + 1}", name, split_unit(name)[0]) for wanted in self.ignored)


NOTHING_GIVEN = Given()


def parse_columns(columns: Columns | None, correction: Correction | None = None) -> Given:
    """``{quantity: "name [unit]"}`` as hints; "none" for a quantity to leave out; ``ignore`` and ``decimal``.

    Raises
    ------
    ReadError
        unknown_quantity for every key that names none, unknown_decimal for a mark that is no decimal mark.
    """
    columns = columns or {}
    problems = [problem for key, value in columns.items() for problem in column_faults(key, value)]
    if problems:
        raise ReadError(problems)
    return _given(columns, correction or UNCORRECTED)


def column_faults(key: str, value: object) -> Iterator[Problem]:
    """Why one entry of columns cannot be used."""
    if key == IGNORE:
        return
    if key == DECIMAL:
        if value not in (".", ","):
            yield Problem("unknown_decimal", "not a decimal mark", found=str(value), allowed='"." or ","')
    elif quantity_named(key) is None:
        names = [name.replace(" ", "_") for name in QUANTITIES]
        meant = did_you_mean(key, [*names, IGNORE, DECIMAL])
        allowed = f"{', '.join(names)}; {IGNORE}, {DECIMAL}{f' ({meant})' if meant else ''}"
        yield Problem("unknown_quantity", "not a known quantity", found=key, allowed=allowed)


def _given(columns: Columns, correction: Correction) -> Given:
    """Columns whose keys are known."""
    hints, without = [], set()
    for key, value in columns.items():
        quantity = quantity_named(key)
        if quantity is None:
            continue
        if str(value).strip().lower() == NONE:
            without.add(quantity)
        else:
            hints.append(Hint(quantity, str(value).strip()))
    ignored = columns.get(IGNORE, ())
    listed = re.split(r"\s*;\s*", ignored) if isinstance(ignored, str) else ignored
    return Given(
        tuple(hints),
        frozenset(without),
        tuple(name.strip() for name in listed if name.strip()),
        str(columns.get(DECIMAL, "")),
        correction,
    )


def what_is_known(columns: Columns | None, correction: Correction | None = None) -> Given:
    """Columns as :func:`parse_columns` gives them, without those that name no quantity."""
    kept = {key: value for key, value in (columns or {}).items() if not list(column_faults(key, value))}
    return _given(kept, correction or UNCORRECTED)


def columns_from_text(text: str) -> dict[str, str]:
    """Columns as given on a command line: "time=Clock [s], friction_force=#3 [gf], displacement=none".

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
