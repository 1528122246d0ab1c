"""Times of tests: ISO 8601, or day, month and year in the order that the column as a whole settles."""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import date, datetime, time

from tribo.limits import FIRST_YEAR, LAST_YEAR

ALLOWED = "YYYY-MM-DD or YYYY-MM-DDTHH:MM:SS; DD/MM/YYYY or MM/DD/YYYY where a day after the 12th settles the order"
_DATE = re.compile(r"(\d{1,4})([-./])(\d{1,2})\2(\d{1,4})")
_TIME = re.compile(r"(\d{1,2}):(\d\d)(?::(\d\d)(?:[.,](\d{1,9}))?)?(?: ?([AaPp])\.?[Mm]\.?)?")
_ISO = re.compile(r"\d{4}-?\d\d-?\d\d(?:[T ]\d\d.*)?|\d{4}-?W\d\d.*")

DAY_FIRST, MONTH_FIRST, UNSETTLED, CONTRADICTORY = "day first", "month first", "unsettled", "contradictory"


def order_of(cells: Iterable[str]) -> str:
    """Whether the dates of a column name the day or the month first.

    A number above 12 settles its place as the day; a column with points between the numbers names the day first
    (DIN 5008). Dates that begin with the year settle nothing.
    """
    first = second = dotted = False
    for cell in cells:
        found = _DATE.match(cell.strip())
        if found is None or len(found[1]) > 2:
            continue
        first |= int(found[1]) > 12
        second |= int(found[3]) > 12
        dotted |= found[2] == "."
    if first and second:
        return CONTRADICTORY
    if second:
        return MONTH_FIRST
    return DAY_FIRST if first or dotted else UNSETTLED


def parsed(cell: str, order: str) -> str:
    """A date, with its time if it has one, in ISO 8601; ``order`` as of :func:`order_of` for the column.

    Raises
    ------
    ValueError
        It is no date, or the order of day and month is not settled; the text is the end of a sentence.
    """
    text = " ".join(cell.split())
    found = _DATE.match(text)
    if _ISO.fullmatch(text):
        day, clock = _iso(text)
    elif found is not None:
        day = _day(found, order)
        clock = _clock(text[found.end() :].lstrip("T ,"))
    else:
        raise ValueError("not a date")
    if not FIRST_YEAR <= day.year <= LAST_YEAR:
        raise ValueError(f"not between the years {FIRST_YEAR} and {LAST_YEAR}")
    return day.isoformat() if clock is None else datetime.combine(day, clock).isoformat()


def _iso(text: str) -> tuple[date, time | None]:
    try:
        if len(text) <= 10 and ":" not in text and "T" not in text:
            return date.fromisoformat(text), None
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError("not a date") from None
    return moment.date(), moment.timetz()


def _day(found: re.Match[str], order: str) -> date:
    numbers = int(found[1]), int(found[3]), int(found[4])
    if len(found[1]) == 4 and len(found[4]) <= 2:
        year, month, day = numbers
    elif len(found[1]) <= 2 and len(found[4]) == 4:
        first, second, year = numbers
        if first != second and order not in (DAY_FIRST, MONTH_FIRST):
            raise ValueError(_WHY[order])
        day, month = (second, first) if order == MONTH_FIRST else (first, second)
    else:
        raise ValueError("a date needs a year of four digits")
    try:
        return date(year, month, day)
    except ValueError:
        raise ValueError("not a date") from None


_WHY = {
    UNSETTLED: "no date of this column settles whether the day or the month comes first",
    CONTRADICTORY: "some dates of this column name the day first and others the month",
}


def _clock(text: str) -> time | None:
    if not text:
        return None
    found = _TIME.fullmatch(text)
    if found is None:
        raise ValueError("not a time of day")
    hour, half = int(found[1]), (found[5] or "").lower()
    if half and not 1 <= hour <= 12:
        raise ValueError("not a time of day")
    if half:
        hour = hour % 12 + (12 if half == "p" else 0)
    try:
        return time(hour, int(found[2]), int(found[3] or 0), int((found[4] or "0").ljust(6, "0")[:6]))
    except ValueError:
        raise ValueError("not a time of day") from None
