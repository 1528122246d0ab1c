"""The sheets of a workbook on standard input, as JSON on standard output: a program of its own, so that a workbook that
asks for more memory or time than it may have ends this process and no other. It imports nothing of tribo.
"""

from __future__ import annotations

import contextlib
import datetime
import io
import json
import sys

MOST_MEMORY_BYTES = 2_000_000_000


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
        texts[name] = "\n".join("\t".join(map(cell_text, row)) for row in rows) + "\n"
    sys.stdout.buffer.write(json.dumps(texts).encode("ascii"))


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
