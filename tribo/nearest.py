"""What a user may have meant: the nearest of the names that are allowed, capitals, blanks and brackets left aside."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

_FEWEST_INSIDE = 4  # letters of a name that may stand for a longer one: "load" for "normal_load_N"


def nearest(given: str, allowed: Iterable[str], cutoff: float = 0.6) -> str:
    """The allowed name nearest to ``given``; empty where none is near. Names that differ in case only come first."""
    plain: dict[str, str] = {}
    for name in allowed:
        plain.setdefault(_plain(name), name)
    wanted = _plain(given)
    if not wanted or not plain:
        return ""
    if wanted in plain:
        return plain[wanted]
    if near := difflib.get_close_matches(wanted, plain, 1, cutoff):
        return plain[near[0]]
    inside = [name for name in plain if wanted in name.split("_")] if len(wanted) >= _FEWEST_INSIDE else []
    return plain[inside[0]] if inside else ""


def did_you_mean(given: str, allowed: Iterable[str], cutoff: float = 0.6) -> str:
    """The question "did you mean NAME?"; empty where no allowed name is near."""
    near = nearest(given, allowed, cutoff)
    return f"did you mean {near}?" if near else ""


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "_", name.strip().casefold()).strip("_")
