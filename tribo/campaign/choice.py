"""Which pulls of an export a row of tests.csv means: PATH, PATH#2, PATH#2/3, PATH#2/* or PATH#*."""

from __future__ import annotations

import re

_CHOICE = re.compile(r"#(\*|\d+(?:/(?:\d+|\*))?)$")


def split_choice(file: str) -> tuple[str, str]:
    """("raw/a.csv", "2/3") of "raw/a.csv#2/3", the third pull of the second table; "" where nothing is chosen.

    "2" is the second table as a whole, "2/*" every pull of it, "*" every pull of every table.
    """
    found = _CHOICE.search(file)
    return (file, "") if found is None else (file[: found.start()], found[1])


def names_pulls(choice: str) -> bool:
    """Whether a choice cuts tables into pulls, and does not take one as it stands."""
    return choice.endswith("*") or "/" in choice


def is_chosen(address: str, choice: str) -> bool:
    """Whether the pull at ``address`` ("2/3") is one of those a choice means."""
    return choice in ("*", address) or choice == f"{address.partition('/')[0]}/*"


def overlap(one: str, other: str) -> bool:
    """Whether two choices within one export may mean the same samples."""
    if "" in (one, other) or "*" in (one, other):
        return True
    tables = one.partition("/"), other.partition("/")
    if tables[0][0] != tables[1][0]:
        return False
    return any(pull in ("", "*") for _, _, pull in tables) or one == other
