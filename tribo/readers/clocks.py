"""The time of a record from the clock of its logger: a time of day in every row, its date in front of it or beside it.

Dates and milliseconds may stand in columns of their own. A clock without a date passes midnight where it falls back by
more than half a day; minutes and seconds with decimals (``00:01.95``) pass the hour in the same way. A column of
elapsed seconds goes before a clock.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import date, datetime

import numpy as np

from tribo.readers.columns import Given, Hint, bare_unit, is_unit, match_column, split_unit
from tribo.readers.layout import Layout, cut
from tribo.readers.source import HEAD_BYTES, Source

_DATE = r"\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/. ](?:\d{1,2}|[A-Za-z]{3})[-/. ]\d{2,4}"
_CLOCK = re.compile(
    rf"(?:(?P<date>{_DATE})[ T]+)?(?P<h>\d{{1,3}}):(?P<m>\d\d):(?P<s>\d\d)(?:[.,:](?P<part>\d{{1,9}}))?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?(?:Z|[+-]\d\d:?\d\d)?"
)
_MINUTES = re.compile(r"(?P<m>\d{1,3}):(?P<s>[0-5]\d)(?:[.,](?P<part>\d{1,9}))?")
_NAMED_MINUTES = re.compile(r"\bm+(?:in)?\s*:\s*s", re.I)  # else two whole numbers may be hours and minutes
_MILLISECONDS = re.compile(r"\s*(?:ms|msec|millis|milliseconds?|millisekunden)\b", re.I)
_FORMS = (
    "%Y-%m-%d", "%d-%m-%Y", "%m-%d-%Y", "%d-%b-%Y", "%d-%m-%y", "%m-%d-%y", "%y-%m-%d", "%d-%b-%y",
)  # of dates, every mark between their parts made a hyphen  # fmt: skip
_HOUR_S, _DAY_S = 3600.0, 86400.0
REASON = "the clock of the file, counted in seconds from its first row"


def by_the_clock(source: Source, layout: Layout, given: Given) -> tuple[Source, Given] | None:
    """A table with its clock written in seconds, and what was stated with the hint that names this column.

    None where no column holds a time of day or minutes and seconds, or its dates contradict it.
    """
    if source.arrays or source.is_large:
        return None
    lines, _ = source.lines(layout.start, HEAD_BYTES)
    first = cut(lines[0], layout.delimiter)
    elapsed = _elapsed(layout)
    form, clocks = _CLOCK, [k for k, cell in enumerate(first) if _CLOCK.fullmatch(cell)]
    if not clocks:
        form, told = _MINUTES, [_MINUTES.fullmatch(cell) for cell in first]
        named = [bool(_NAMED_MINUTES.search(f"{layout.name(k)} {layout.units[k]}")) for k in range(len(layout.names))]
        clocks = [k for k, hit in enumerate(told) if hit and (hit["part"] or (k < len(named) and named[k]))]
    if elapsed is not None and clocks:
        return source, given.with_hints((Hint("time", f"#{elapsed + 1}", "elapsed time, beside a clock"),))
    if not clocks:
        return None
    at = next((k for k in clocks if k < len(layout.names) and match_column(layout.names[k])), clocks[0])
    dates = next((k for k, cell in enumerate(first) if re.fullmatch(_DATE, cell)), None)
    parts = next((k for k, name in enumerate(layout.names) if k != at and _MILLISECONDS.match(name)), None)
    rows = source.text(bytes(source.data[layout.start : layout.end])).split("\n")
    cells = [cut(row, layout.delimiter) for row in rows]
    found = [form.fullmatch(c[at]) if len(c) == layout.n_cells else None for c in cells]
    counted = [k for k, hit in enumerate(found) if hit]
    hits = [hit for hit in found if hit]
    seconds = np.array([_seconds(hit) for hit in hits])
    if parts is not None and not any(hit["part"] for hit in hits):
        with suppress(ValueError):
            seconds += np.array([float(cells[k][parts]) for k in counted]) / 1e3
    beside = [cells[k][dates] if dates is not None else "" for k in counted]
    if form is _MINUTES:
        seconds += _HOUR_S * _turns(seconds, _HOUR_S)
    else:
        days = _days([hit["date"] or text for hit, text in zip(hits, beside, strict=True)])
        seconds += _DAY_S * (_turns(seconds, _DAY_S) if days is None else days)
    for k, value in zip(counted, seconds - seconds[0], strict=True):
        cells[k][at] = f"{value:.6f}".replace(".", layout.decimal)
        rows[k] = layout.delimiter.join(f'"{c}"' if layout.delimiter in c and c else c for c in cells[k])
    text = "\n".join(rows).encode(source.codec, errors="replace")
    data = bytes(source.data[: layout.start]) + text + bytes(source.data[layout.end :])
    return replace(source, data=data), given.with_hints((Hint("time", f"#{at + 1} [s]", REASON),))


def _turns(seconds: np.ndarray, period_s: float) -> np.ndarray:
    """How often a clock has begun anew: it falls back by more than half of its period."""
    return np.concatenate(([0.0], np.cumsum(np.diff(seconds) < -period_s / 2)))


def _elapsed(layout: Layout) -> int | None:
    """The column of a time with its unit; None without one."""
    for k, name in enumerate(layout.names):
        hit, unit = match_column(name) if name else None, bare_unit(layout.units[k]) or split_unit(name)[1]
        named = (hit and hit[0] == "time") or name.lower().startswith("elapsed")
        if named and unit and is_unit(unit, "time"):
            return k
    return None


def _seconds(hit: re.Match[str]) -> float:
    """Seconds since midnight, or since the beginning of the hour where the clock shows none."""
    told = hit.groupdict()
    hours, half, part = int(told.get("h") or 0), told.get("half"), told["part"]
    if half:
        hours = hours % 12 + 12 * (half[0] in "Pp")
    return _HOUR_S * hours + 60.0 * int(hit["m"]) + int(hit["s"]) + (int(part) / 10 ** len(part) if part else 0.0)


def _days(texts: Sequence[str]) -> np.ndarray | None:
    """Days since the first of some dates, in the reading in which they follow each other most closely.

    None where a date is missing, or no reading puts them in order: the clock then tells by itself.
    """
    distinct = list(dict.fromkeys(re.sub(r"[/. ]", "-", text) for text in texts))
    readings: list[list[date]] = []
    for form in _FORMS:
        with suppress(ValueError):
            days = [datetime.strptime(text, form).date() for text in distinct]
            if days == sorted(days):
                readings.append(days)
    if not readings:
        return None
    best = min(readings, key=lambda days: days[-1] - days[0])
    since = {text: float((day - best[0]).days) for text, day in zip(distinct, best, strict=True)}
    return np.array([since[re.sub(r"[/. ]", "-", text)] for text in texts])
