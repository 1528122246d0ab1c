"""Records side by side in one table: each with columns of its own, or one time and many forces."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from tribo.errors import Problem, ReadError
from tribo.readers.columns import Given, Hint, bare_unit, is_unit, match_column, split_unit
from tribo.readers.layout import Layout, cut
from tribo.readers.source import Source

_NUMBER_BEHIND = re.compile(r"(?<=\w)[ ._#-]*\(?\d+\)?$")
_NUMBER_BEFORE = re.compile(r"^(?:specimen|sample|probe|test|run|pull|s|p|n)?[ _#]*\d+[ _:.-]+(?=\w)", re.I)
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
    rows = [] if source.arrays or not records else _rows(source, layout)
    for number, (label, columns, own, hints) in enumerate(records, start=1):
        alone = replace(
            layout,
            delimiter="\t" if layout.delimiter in (" ", layout.decimal) else layout.delimiter,
            n_cells=len(columns),
            names=tuple(layout.names[k] for k in columns),
            units=tuple(layout.units[k] for k in columns),
            filled=tuple(layout.filled[k] or k in own for k in columns),
            metadata={**layout.metadata, "record": label} if label else layout.metadata,
            label=label or _label_above(source, layout, columns[0]) or f"specimen {number}",
        )
        if source.arrays:
            part = replace(source, part=alone.label, names=alone.names, arrays=tuple(source.arrays[k] for k in columns))
        else:
            end = len(rows)
            while end and all(_is_nothing(rows[end - 1], k) for k in own):
                end -= 1
            lines = [alone.delimiter.join(row[k] if k < len(row) else "" for k in columns) for row in rows[:end]]
            data = ("\n" * layout.header_rows + "\n".join(lines) + "\n").encode(source.codec, errors="replace")
            part = replace(source, data=data, start=0, part=alone.label)
            alone = replace(alone, start=layout.header_rows, end=len(data))
        yield part, alone, _restated(given, columns, hints)


def _records(layout: Layout, given: Given) -> tuple[Record, ...]:
    if any(hint.is_pattern for hint in given.hints):
        return _by_patterns(layout, given)
    whole = tuple(_repeated(layout.names))
    if whole:
        return whole
    used = [
        k for k in range(layout.n_cells) if (layout.names[k] or layout.filled[k]) and not _ignored(layout, given, k)
    ]
    times = [k for k in used if _quantity(_stem(layout.names[k])) == "time"]
    rest = [k for k in used if k not in times]
    stems = [_stem(layout.names[k]) for k in rest]
    if len(times) != 1 or len(rest) < 2:
        return tuple(_with_own_time(layout, used))
    for width in range(1, len(rest) // 2 + 1):
        forces = [stem for stem in stems[:width] if _quantity(stem) == "friction force"]
        if len(rest) % width == 0 and stems == stems[:width] * (len(rest) // width) and len(forces) == 1:
            groups = [tuple(rest[at : at + width]) for at in range(0, len(rest), width)]
            return tuple(
                (_label(layout, group), (*times, *group), group, _hints(layout, (*times, *group))) for group in groups
            )
    if all(_is_a_force_by_unit(layout, k) for k in rest):
        return tuple(_forced(layout, (*times, k), k) for k in rest)
    return ()


def looks_wide(layout: Layout) -> bool:
    """Whether a table has a time and at least two further columns, none of which is a known quantity."""
    filled = [name for name, there in zip(layout.names, layout.filled, strict=True) if there or name]
    known = [_quantity(name) for name in filled if _quantity(name)]
    return known == ["time"] and len(filled) > 2


def _ignored(layout: Layout, given: Given, k: int) -> bool:
    return given.ignores(k, layout.names[k])


def _quantity(name: str) -> str:
    hit = match_column(name) if name else None
    return hit[0] if hit else ""


def _stem(name: str) -> str:
    """A name without the number of its specimen: "Load.2", "Load (2)" and "S2 Load [N]" are all "Load"."""
    bare = split_unit(name)[0]
    if _quantity(bare) and not _NUMBER_BEHIND.search(bare):
        return bare
    return _NUMBER_BEFORE.sub("", _NUMBER_BEHIND.sub("", bare)) or bare


def _label(layout: Layout, group: Sequence[int]) -> str:
    return layout.names[group[0]] or f"#{group[0] + 1}"


def _repeated(names: Sequence[str]) -> Iterator[Record]:
    """Each specimen where the same names stand several times in a row."""
    at = [k for k, name in enumerate(names) if name]
    kept = [names[k] for k in at]
    for width in range(2, len(kept) // 2 + 1):
        repeats, rest = divmod(len(kept), width)
        if not rest and kept == kept[:width] * repeats and len(set(kept[:width])) == width:
            for k in range(repeats):
                columns = tuple(at[k * width : (k + 1) * width])
                yield "", columns, columns, ()
            return


def _with_own_time(layout: Layout, used: Sequence[int]) -> Iterator[Record]:
    """Each specimen where names repeat but for their number, with a time and a force in each."""
    stems = [_stem(layout.names[k]) for k in used]
    for width in range(2, len(used) // 2 + 1):
        first = stems[:width]
        quantities = [_quantity(stem) for stem in first]
        repeats = len(used) // width
        if len(used) % width or stems != first * repeats or not {"time", "friction force"} <= set(quantities):
            continue
        for k in range(repeats):
            columns = tuple(used[k * width : (k + 1) * width])
            yield _label(layout, columns), columns, columns, _hints(layout, columns)
        return


def _hints(layout: Layout, columns: Sequence[int]) -> tuple[Hint, ...]:
    """The quantities of a record by its names without their numbers, as positions within it."""
    found: dict[str, Hint] = {}
    for j, k in enumerate(columns):
        quantity = _quantity(_stem(layout.names[k]))
        if quantity:
            found.setdefault(quantity, Hint(quantity, f"#{j + 1}", f'named "{layout.names[k]}"'))
    return tuple(found.values())


def _is_a_force_by_unit(layout: Layout, k: int) -> bool:
    """Whether a column without a known name, and with one that is no number, has a unit of force."""
    name, unit = split_unit(layout.names[k])
    unit = bare_unit(layout.units[k]) or unit or ""
    named = bool(name) and not _NUMERIC.fullmatch(name) and not _quantity(layout.names[k])
    return named and bool(unit) and unit not in ("g", "kg") and is_unit(unit, "friction force")


def _forced(layout: Layout, columns: tuple[int, ...], own: int) -> Record:
    hint = Hint("friction force", f"#{columns.index(own) + 1}", f'"{layout.names[own]}", by its unit')
    return layout.names[own], columns, (own,), (hint,)


def _by_patterns(layout: Layout, given: Given) -> tuple[Record, ...]:
    """One record for each column that the pattern of a name fits; other patterns fit as many, in the same order."""
    fitting = {h: _fitting(h, layout, given) for h in given.hints if h.is_pattern}
    problems = [_fits_nothing(h, layout) for h, columns in fitting.items() if not columns]
    if problems:
        raise ReadError(problems)
    sizes = {len(columns) for columns in fitting.values()}
    if len(sizes) > 1:
        found = ", ".join(f"{h.quantity}: {len(columns)}" for h, columns in fitting.items())
        what = "the patterns in columns fit different numbers of columns"
        raise ReadError(Problem("uneven_patterns", what, found=found, allowed="as many columns for each"))
    taken = {k for columns in fitting.values() for k in columns}
    shared = tuple(k for k in range(layout.n_cells) if k not in taken)
    records = []
    for r in range(sizes.pop()):
        own = tuple(columns[r] for columns in fitting.values())
        columns = tuple(sorted((*shared, *own)))
        hints = tuple(
            Hint(h.quantity, f"#{columns.index(fitted[r]) + 1}{_unit_of(h)}", f"asked for by {h.wanted}")
            for h, fitted in fitting.items()
        )
        records.append((_label(layout, own), columns, own, hints))
    return tuple(records)


def _unit_of(hint: Hint) -> str:
    unit = split_unit(hint.wanted)[1]
    return f" [{unit}]" if unit else ""


def _fitting(hint: Hint, layout: Layout, given: Given) -> tuple[int, ...]:
    """Columns whose name a pattern fits; ``*`` alone leaves out what has another name or is asked for otherwise."""
    pattern = split_unit(hint.wanted)[0]
    others = [h for h in given.hints if not h.is_pattern]
    found = []
    for k, name in enumerate(layout.names):
        if not (name or layout.filled[k]) or _ignored(layout, given, k):
            continue
        bare = split_unit(name)[0]
        wanted = any(split_unit(h.wanted)[0] in (name, bare, f"#{k + 1}") for h in others)
        other = pattern == "*" and (_quantity(name) not in ("", hint.quantity) or _has_other_unit(layout, k, hint))
        if not wanted and not other and (fnmatchcase(bare, pattern) or fnmatchcase(name, pattern)):
            found.append(k)
    return tuple(found)


def _has_other_unit(layout: Layout, k: int, hint: Hint) -> bool:
    """Whether a column has a unit of its own that is none of the quantity a pattern stands for."""
    unit = bare_unit(layout.units[k]) or split_unit(layout.names[k])[1]
    return bool(unit) and not is_unit(unit or "", hint.quantity)


def _fits_nothing(hint: Hint, layout: Layout) -> Problem:
    what = f"no column has a name that fits the pattern for the {hint.quantity}"
    listed = ", ".join(name or f"#{k + 1}" for k, name in enumerate(layout.names))
    return Problem("missing_column", what, found=hint.wanted, allowed=listed)


def _rows(source: Source, layout: Layout) -> list[list[str]]:
    text = source.text(bytes(source.data[source.offset(source.start, layout.header_rows) :])).replace("\r\n", "\n")
    return [cut(line, layout.delimiter) for line in text.split("\n") if line.strip()]


def _is_nothing(row: Sequence[str], k: int) -> bool:
    return k >= len(row) or row[k].lower() in _NOTHING


def _label_above(source: Source, layout: Layout, column: int) -> str:
    above = [cut(line, layout.delimiter) for line in source.head[: (layout.names_row or 1) - 1]]
    return next((row[column] for row in reversed(above) if column < len(row)), "")


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
