"""Names of columns: the unit in them, and the quantity they stand for."""

from __future__ import annotations

import re
from functools import lru_cache

from tribo.errors import ReadError
from tribo.quantities import match_quantity, narrow, unit_factor

_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]*(?:\([^\[\]()]*\)[^\[\]()]*)?)\s*[\])]\s*$")
_AFTER_MARK = re.compile(r"^(.*\S)\s*(?:\s?/|\sin\s|,\s|_)\s*((?:[^\W\d_]|[°%])[\w/°%^·²-]*)$")


def bare_unit(unit: str) -> str:
    """ "(mm)" and "[mm]" -> "mm"."""
    found = _BRACKETS.fullmatch(narrow(unit.strip()))
    return found.group(1).strip() if found else unit.strip()


def match_column(name: str) -> tuple[str, int] | None:
    """(quantity, rank) of a column name with or without its unit in it."""
    return match_quantity(name) or match_quantity(split_unit(name)[0])


@lru_cache(maxsize=1024)
def split_unit(name: str) -> tuple[str, str | None]:
    """("Kraft", "kN") of "Kraft [kN]", "Kraft (kN)", "Kraft / kN", "Kraft/kN", "Kraft in kN", "Kraft_kN"."""
    name = narrow(name)
    found = _BRACKETS.search(name)
    if found:
        return name[: found.start()].strip(), found.group(1).strip()
    found = _AFTER_MARK.match(name)
    hit = match_quantity(found.group(1)) if found and match_quantity(name) is None else None
    if found and hit and is_unit(found.group(2), hit[0]):
        return found.group(1).strip(), found.group(2)
    return name, None


def is_unit(text: str, quantity: str) -> bool:
    """Whether a text is a unit of a quantity."""
    try:
        unit_factor(text, quantity)
    except ReadError:
        return False
    return True
