"""Mistakes of a new user, each made in a small campaign that is otherwise right, and what must be said of it."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

Rows = list[dict[str, str]]


@dataclass(frozen=True)
class Mistake:
    """``make`` spoils the campaign folder; the dry run must then name ``place`` and ``remedy`` (regular expressions).

    ``make`` may return other arguments for the command: the campaign to give, and options. ``status`` are the exit
    statuses that are right: 1 and 2 refuse, 3 leaves tests out, 0 goes on with a doubt. What shows in the siblings of a
    test alone is made in a campaign of three specimens and five loads (``with_siblings``).
    """

    name: str
    make: Callable[[Path], Sequence[object] | None]
    place: str
    remedy: str
    status: tuple[int, ...]
    with_siblings: bool = False


def rows(folder: Path) -> Rows:
    with (folder / "tests.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def write_rows(folder: Path, table: Rows, delimiter: str = ",") -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(table[0]), delimiter=delimiter, lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    (folder / "tests.csv").write_text(text.getvalue(), encoding="utf-8")


def each_row(change: Callable[[dict[str, str]], Mapping[str, str] | None], first: int = 0, last: int | None = None):
    """Change the rows from ``first`` to before ``last``."""

    def make(folder: Path) -> None:
        table = rows(folder)
        for row in table[first:last]:
            row.update(change(row) or {})
        write_rows(folder, table)

    return make


def header(old: str, new: str):
    """Another name for a column."""

    def make(folder: Path) -> None:
        lines = (folder / "tests.csv").read_text(encoding="utf-8").split("\n")
        lines[0] = re.sub(old, new, lines[0])
        (folder / "tests.csv").write_text("\n".join(lines), encoding="utf-8")

    return make


def toml(old: str, new: str):
    """Another text in campaign.toml."""

    def make(folder: Path) -> None:
        text = (folder / "campaign.toml").read_text(encoding="utf-8")
        assert old in text, old
        (folder / "campaign.toml").write_text(text.replace(old, new), encoding="utf-8")

    return make


def export(old: str, new: str, only: str = "*.csv"):
    """Another text in the exports."""

    def make(folder: Path) -> None:
        for path in (folder / "raw").glob(only):
            text = path.read_text(encoding="utf-8")
            path.write_text(text.replace(old, new), encoding="utf-8")

    return make


def option(*words: str):
    """An option of the command, wrong as given."""
    return lambda folder: (folder, *words)


def renamed(old: str, new: str):
    def make(folder: Path) -> None:
        (folder / old).rename(folder / new)

    return make


def exchanged(one: str, other: str):
    """Two columns of tests.csv in each other's place."""
    return each_row(lambda row: {one: row[other], other: row[one]})


def without(column: str):
    """A column of tests.csv left out."""

    def make(folder: Path) -> None:
        write_rows(folder, [{name: cell for name, cell in row.items() if name != column} for row in rows(folder)])

    return make


def text_of(name: str, change: Callable[[bytes], bytes]):
    """Other bytes in a file."""

    def make(folder: Path) -> None:
        (folder / name).write_bytes(change((folder / name).read_bytes()))

    return make


def recorded(column: int, change: Callable[[float], float], only: str = "*.csv"):
    """Other numbers in one column of the exports."""

    def make(folder: Path) -> None:
        for path in (folder / "raw").glob(only):
            lines = [line.split(",") for line in path.read_text(encoding="utf-8").split("\n")]
            for cells in lines:
                if len(cells) == 3 and re.fullmatch(r'"-?[\d.]+"', cells[column]):
                    cells[column] = f'"{change(float(cells[column][1:-1])):.6g}"'
            path.write_text("\n".join(map(",".join, lines)), encoding="utf-8")

    return make


def workbook(folder: Path) -> None:
    """tests.csv as tests.xlsx, with numbers as a spreadsheet keeps them."""
    import openpyxl

    book = openpyxl.Workbook()
    table = rows(folder)
    book.active.append(list(table[0]))
    for row in table:
        book.active.append([_as_cell(text) for text in row.values()])
    book.save(folder / "tests.xlsx")
    (folder / "tests.csv").unlink()


def _as_cell(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text
