"""Records side by side in one table: each with columns of its own, or one time and many forces."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from tribo.errors import Problem, ReadError
from tribo.readers.columns import (
    Given,
    Hint,
    bare_unit,
    by_a_word,
    is_unit,
    match_column,
    raw_signals,
    split_unit,
)
from tribo.readers.layout import Layout, cut
from tribo.readers.source import Source
from tribo.units import QUANTITIES

_NUMBER_BEHIND = re.compile(r"(?<=\w)[ ._#-]*\(?\d+\)?$")
_NUMBER_BEFORE = re.compile(r"^(?:specimen|sample|probe|test|run|pull|s|p|n)?[ _#]*\d+[ _:.-]+(?=\w)", re.I)
_RUN_BEFORE = re.compile(r"run #?\d+:", re.I)
_NUMERIC = re.compile(r"[-+]?\d*[.,]?\d+")
_NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "-", "--", "null", "none"})


Part = tuple[Source, Layout, Given]  # a table, and what was stated about it
Record = tuple[str, tuple[int, ...], tuple[int, ...], tuple[Hint, ...]]  # label, its columns, those not shared, hints


def records_side_by_side(source: Source, layout: Layout, given: Given) -> Iterator[Part]:
    """Each record of a table that holds several, as a table of its own; nothing where it is one.

    A record keeps the rows of the file, without rows past its end.

    Raises
    ------
    ReadError
        A pattern of names in columns fits no column, or patterns fit different numbers of columns.
    """
    try:
        records = _records(layout, given)
    except ReadError as why:
        raise ReadError(replace(p, file=source.file, row=layout.names_row) for p in why.problems) from None
    rows = []
    if records and not source.arrays:
        text = source.text(bytes(source.data[layout.start :])).replace("\r\n", "\n")
        rows = [cut(line, layout.delimiter) for line in text.split("\n") if line.strip()]
    above = [cut(line, layout.delimiter) for line in source.head[: (layout.names_row or 1) - 1]]
    for number, (label, columns, own, hints) in enumerate(records, start=1):
        over = next((row[columns[0]] for row in reversed(above) if columns[0] < len(row)), "")
        alone = replace(
            layout,
            delimiter="\t" if layout.delimiter in (" ", layout.decimal) else layout.delimiter,
            n_cells=len(columns),
            names=tuple(layout.names[k] for k in columns),
            units=tuple(layout.units[k] for k in columns),
            filled=tuple(layout.filled[k] or k in own for k in columns),
            metadata={**layout.metadata, "record": label} if label else layout.metadata,
            label=label or over or f"specimen {number}",
        )
        if source.arrays:
            part = replace(source, part=alone.label, names=alone.names, arrays=tuple(source.arrays[k] for k in columns))
        else:
            end = len(rows)
            while end and all(k >= len(rows[end - 1]) or rows[end - 1][k].lower() in _NOTHING for k in own):
                end -= 1
            lines = [alone.delimiter.join(row[k] if k < len(row) else "" for k in columns) for row in rows[:end]]
            data = ("\n" * layout.header_rows + "\n".join(lines) + "\n").encode(source.codec, errors="replace")
            part = replace(source, data=data, start=0, part=alone.label)
            alone = replace(alone, start=layout.header_rows, end=len(data))
        yield part, alone, _restated(given, columns, hints)


def _records(layout: Layout, given: Given) -> Sequence[Record]:
    if any(hint.is_pattern for hint in given.hints):
        return _by_patterns(layout, given)
    names = layout.names
    named = [k for k, name in enumerate(names) if name]
    for groups in _repeats(named, [names[k] for k in named], 2):  # the same names several times in a row
        if len({names[k] for k in groups[0]}) == len(groups[0]):
            return [("", group, group, ()) for group in groups]
    raw = raw_signals(names, layout.units)
    used = [k for k in range(layout.n_cells) if (names[k] or layout.filled[k]) and not given.ignores(k, names[k])]
    used = [k for k in used if k not in raw]
    stems = {k: _stem(names[k]) for k in used}
    meant = {k: _quantity(stem) for k, stem in stems.items()}
    times = tuple(k for k in used if meant[k] == "time")
    rest = [k for k in used if meant[k] != "time"]

    def record(own: tuple[int, ...], shared: tuple[int, ...] = ()) -> Record:
        columns = (*shared, *own)
        hints: dict[str, Hint] = {}
        for j, k in enumerate(columns, start=1):
            if meant[k]:
                hints.setdefault(meant[k], Hint(meant[k], f"#{j}", f'named "{names[k]}"'))
        return _label(layout, own), columns, own, tuple(hints.values())

    if len(times) != 1 or len(rest) < 2:  # the same names but for a number, with a time and a force in each
        for groups in _repeats(used, list(stems.values()), 2):
            if {"time", "friction force"} <= {meant[k] for k in groups[0]}:
                return [record(group) for group in groups]
        return ()
    of_unit = all(_is_a_force_by_unit(layout, k) for k in rest)
    if len(rest) == 2 and (of_unit or (stems[rest[0]] == stems[rest[1]] and meant[rest[0]] == "friction force")):
        if any(hint.quantity in ("friction force", "normal force") for hint in given.hints):
            return ()
        raise ReadError(_two_forces(names[rest[0]], names[rest[1]]))
    for groups in _repeats(rest, [stems[k] for k in rest], 1):
        if [meant[k] for k in groups[0]].count("friction force") == 1:
            return [record(group, times) for group in groups]
    if of_unit:
        by_unit = [Hint("friction force", "#2", f'"{names[k]}", by its unit') for k in rest]
        return [(names[k], (*times, k), (k,), (hint,)) for k, hint in zip(rest, by_unit, strict=True)]
    return ()


def _two_forces(first: str, second: str) -> Problem:
    """The fault of two forces under one time: two records, or the friction and the normal force of one."""
    what = f"{first} and {second} are two records, or the friction and the normal force of one"
    of_one = f'friction_force = "{first}", normal_force = "{second}" in columns'
    return Problem("two_forces", what, allowed=f'{of_one}; or, of two records, friction_force = "* [N]"')


def _repeats(columns: Sequence[int], names: Sequence[str], fewest: int) -> Iterator[list[tuple[int, ...]]]:
    """Columns in groups under the same names, for every size of a group, from ``fewest`` on, that fits."""
    for width in range(fewest, len(columns) // 2 + 1):
        repeats, rest = divmod(len(columns), width)
        if not rest and list(names) == [*names[:width]] * repeats:
            yield [tuple(columns[k * width : (k + 1) * width]) for k in range(repeats)]


def looks_wide(layout: Layout) -> bool:
    """Whether a table has a time and at least two further columns, none of which is a known quantity."""
    filled = [name for name, there in zip(layout.names, layout.filled, strict=True) if there or name]
    known = [_quantity(name) for name in filled if _quantity(name)]
    units = [
        bare_unit(unit) or split_unit(name)[1] or ""
        for name, unit in zip(layout.names, layout.units, strict=True)
        if name and _quantity(name) != "time"
    ]
    of_another = any(unit and not is_unit(unit, "friction force") for unit in units)
    return known == ["time"] and len(filled) > 3 and not of_another


def _quantity(name: str) -> str:
    hit = match_column(name) if name else None
    return hit[0] if hit else ""


def _stem(name: str) -> str:
    """A name without the number of its specimen: "Load.2", "Load (2)" and "S2 Load [N]" are all "Load"."""
    bare = split_unit(name)[0]
    if _quantity(bare) and not _NUMBER_BEHIND.search(bare) and not _RUN_BEFORE.match(bare):
        return bare
    return _NUMBER_BEFORE.sub("", _NUMBER_BEHIND.sub("", bare)) or bare


def _label(layout: Layout, group: Sequence[int]) -> str:
    return layout.names[group[0]] or f"#{group[0] + 1}"


def _is_a_force_by_unit(layout: Layout, k: int) -> bool:
    """Whether a column without a known name, and with one that is no number, has a unit of force."""
    name, unit = split_unit(layout.names[k])
    unit = bare_unit(layout.units[k]) or unit or ""
    told = _quantity(layout.names[k]) or (by_a_word(name, unit) or ("",))[0] == "normal force"
    named = bool(name) and not _NUMERIC.fullmatch(name) and not told
    return named and bool(unit) and unit not in ("g", "kg") and is_unit(unit, "friction force")


def _by_patterns(layout: Layout, given: Given) -> list[Record]:
    """One record for each column that the pattern of a name fits; other patterns fit as many, in the same order."""
    fitting = {h: _fitting(h, layout, given) for h in given.hints if h.is_pattern}
    listed = ", ".join(name or f"#{k + 1}" for k, name in enumerate(layout.names))
    problems = [
        Problem(
            "missing_column",
            f"no column has a name that fits the pattern for the {h.quantity}; every further column is "
            f'{h.quantity.replace(" ", "_")} = "* [{QUANTITIES[h.quantity].si_unit}]"',
            found=h.wanted,
        )
        for h, columns in fitting.items()
        if not columns
    ]
    if problems:
        raise ReadError(replace(problem, allowed=listed) for problem in problems)
    sizes = {len(columns) for columns in fitting.values()}
    if len(sizes) > 1:
        found = ", ".join(f"{h.quantity}: {len(columns)}" for h, columns in fitting.items())
        what = "the patterns in columns fit different numbers of columns"
        allowed = "as many columns for each, or none for one of them"
        raise ReadError(Problem("uneven_patterns", what, found=found, allowed=allowed))
    taken = {k for columns in fitting.values() for k in columns}
    shared = tuple(k for k in range(layout.n_cells) if k not in taken)
    records = []
    for r in range(sizes.pop()):
        own = tuple(columns[r] for columns in fitting.values())
        columns = tuple(sorted((*shared, *own)))
        hints = []
        for h, fitted in fitting.items():
            position, unit = f"#{columns.index(fitted[r]) + 1}", split_unit(h.wanted)[1]
            hints.append(Hint(h.quantity, f"{position} [{unit}]" if unit else position, f"asked for by {h.wanted}"))
        records.append((_label(layout, own), columns, own, tuple(hints)))
    return records


def _fitting(hint: Hint, layout: Layout, given: Given) -> tuple[int, ...]:
    """Columns whose name a pattern fits.

    ``*`` alone leaves out what is known by another name, has a unit of another quantity, or is asked for otherwise.
    """
    pattern = split_unit(hint.wanted)[0]
    others = [split_unit(h.wanted)[0] for h in given.hints if not h.is_pattern]
    found = []
    for k, name in enumerate(layout.names):
        if not (name or layout.filled[k]) or given.ignores(k, name):
            continue
        bare, unit = split_unit(name)
        unit = bare_unit(layout.units[k]) or unit
        is_other = _quantity(name) not in ("", hint.quantity) or bool(unit and not is_unit(unit, hint.quantity))
        asked_for = any(other in (name, bare, f"#{k + 1}") for other in others)
        fits = fnmatchcase(bare, pattern) or fnmatchcase(name, pattern)
        if fits and not asked_for and not (pattern == "*" and is_other):
            found.append(k)
    return tuple(found)


def _restated(given: Given, columns: Sequence[int], hints: Sequence[Hint]) -> Given:
    """What was stated, for the columns of one record: positions counted within it, patterns made positions."""

    def within(position: str) -> str | None:
        """ "#5" as a position within the record, None where the column is not in it; a name as it is."""
        if not re.fullmatch(r"#\d+", position):
            return position
        k = int(position[1:]) - 1
        return f"#{columns.index(k) + 1}" if k in columns else None

    kept = []
    for hint in given.hints:
        name, unit = split_unit(hint.wanted)
        position = within(name)
        if hint.is_pattern or position is None:
            continue
        if position != name:
            hint = replace(hint, wanted=f"{position} [{unit}]" if unit else position)
        kept.append(hint)
    ignored = tuple(kept_name for n in given.ignored if (kept_name := within(n)) is not None)
    return replace(given, hints=(*kept, *hints), ignored=ignored)
