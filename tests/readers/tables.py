"""Write small exports in any dialect, as machines write them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

NAMES = {"time": "Time", "friction force": "Load", "displacement": "Extension"}


@dataclass(frozen=True)
class Dialect:
    """How a table is written: ``units`` per column, in brackets behind the name or in a row of their own."""

    delimiter: str = ","
    decimal: str = "."
    encoding: str = "utf-8"
    line_end: str = "\n"
    quoted: bool = False
    units_row: bool = True
    brackets: str = "()"
    above: tuple[str, ...] = ()
    last_line_end: bool = True

    def but(self, **changes: object) -> Dialect:
        return replace(self, **changes)  # type: ignore[arg-type]


def written(
    rows: Sequence[Sequence[str]], names: Sequence[str], units: Sequence[str], dialect: Dialect = Dialect()
) -> bytes:
    """The bytes of an export. ``rows`` are numbers as text with a decimal point."""

    def line(cells: Sequence[str]) -> str:
        return dialect.delimiter.join(f'"{c}"' if dialect.quoted else c for c in cells)

    left, right = dialect.brackets or ("", "")
    lines = list(dialect.above)
    if dialect.units_row:
        lines += [line(names), line([f"{left}{u}{right}" for u in units])]
    else:
        lines.append(line([f"{n} [{u}]" for n, u in zip(names, units, strict=True)]))
    lines += [line([cell.replace(".", dialect.decimal) for cell in row]) for row in rows]
    text = dialect.line_end.join(lines) + (dialect.line_end if dialect.last_line_end else "")
    return text.encode(dialect.encoding)


def ramp(n: int = 20) -> list[list[str]]:
    """Time, extension and load of a pull that rises: n rows."""
    return [[f"{0.04 * k:.3f}", f"{0.008 * k:.5f}", f"{0.01 * k - 0.003:.5f}"] for k in range(n)]
