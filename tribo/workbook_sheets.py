"""The sheets of a workbook on standard input, as JSON on standard output: a program of its own, so that a workbook that
asks for more memory or time than it may have ends this process and no other. It imports nothing of tribo.
"""

from __future__ import annotations

import collections
import contextlib
import datetime
import io
import json
import sys
from typing import Any

MOST_MEMORY_BYTES = 2_000_000_000
MOSTLY = 9  # numbers to one date, from which a column is one of numbers
DAY_THAT_WAS_NOT = 61  # from it on, workbooks count the 29th of February 1900


def main() -> None:
    with contextlib.suppress(ImportError):  # not on Windows
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY_BYTES, MOST_MEMORY_BYTES))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    from python_calamine import CalamineWorkbook

    book = CalamineWorkbook.from_filelike(io.BytesIO(sys.stdin.buffer.read()))
    texts = {}
    for name in book.sheet_names:
        rows = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
        numbers_shown_as_dates(rows)
        texts[name] = "\n".join("\t".join(map(cell_text, row)) for row in rows) + "\n"
    sys.stdout.buffer.write(json.dumps(texts).encode("ascii"))


def numbers_shown_as_dates(rows: list[list[Any]]) -> None:
    """A date in a column of numbers is a number that the workbook shows so: 12 as 1900-01-12."""
    numbers = collections.Counter(k for row in rows for k, value in enumerate(row) if isinstance(value, float))
    dates = collections.Counter(k for row in rows for k, value in enumerate(row) if isinstance(value, datetime.date))
    for row in rows:
        for k, value in enumerate(row):
            if isinstance(value, datetime.date) and numbers[k] > MOSTLY * dates[k]:
                day = datetime.datetime.combine(value, getattr(value, "time", datetime.time)())
                serial = (day - datetime.datetime(1899, 12, 30)) / datetime.timedelta(days=1)
                row[k] = serial - 1.0 if serial < DAY_THAT_WAS_NOT else serial


def cell_text(value: object) -> str:
    """A cell as text: whole numbers without a decimal point, dates as they are in tests.csv."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    if isinstance(value, datetime.datetime):
        return value.isoformat(" ")
    return " ".join(str(value).split())


if __name__ == "__main__":
    try:
        main()
    except BaseException as why:  # calamine raises a panic of Rust, which is no Exception
        sys.exit("too much memory" if isinstance(why, MemoryError) else " ".join(str(why).split())[-300:])
