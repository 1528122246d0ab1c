"""Faults as lines of text: equal ones once, with their number, one example in full and the tests they concern."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tribo.errors import Problem
from tribo.records import Doubt, SetAside

FEWEST_GROUPED = 3  # equal faults fewer than this are listed one by one
LONGEST_LIST = 160  # characters of the tests listed below an example
_SAME_BEGINNING = 24  # characters by which two sentences of one kind count as the same


def faults_text(problems: Sequence[Problem], *, all_of_them: bool = False) -> str:
    """The problems, equal ones grouped: an example in full, then the others by test or row."""
    lines = []
    for group in _groups(problems):
        if all_of_them or len(group) < FEWEST_GROUPED:
            lines += [f"  {_full(problem)}" for problem in group]
        else:
            lines += [f"  {len(group)} times, for example {_full(group[0])}", f"    also {_others(group[1:])}"]
    return "\n".join(lines)


def doubts_text(doubts: Sequence[Doubt]) -> str:
    """Doubtful numbers, those that one slip explains together with it."""
    by_slip: dict[str, list[Doubt]] = {}
    for doubt in doubts:
        by_slip.setdefault(doubt.slip, []).append(doubt)
    lines = []
    for slip, together in by_slip.items():
        lines += [f"  {doubt.without_slip()}" for doubt in together]
        lines += [f"    likely slip: {slip}"] if slip else []
    return "\n".join(lines)


def set_aside_text(tests: Sequence[SetAside], *, all_of_them: bool = False) -> str:
    """Tests with their reasons; those with an equal fault once, with an example and the other tests."""
    groups: dict[object, list[SetAside]] = {}
    for test in tests:
        key = tuple(map(_key, test.problems)) or test.reason
        groups.setdefault(key, []).append(test)
    lines = []
    for group in groups.values():
        if all_of_them or len(group) < FEWEST_GROUPED:
            lines += [f"  {test.test_id}: {test.reason}" for test in group]
        else:
            others = _listed([test.test_id for test in group[1:]])
            lines += [
                f"  {len(group)} tests, for example {group[0].test_id}: {group[0].reason}", f"    also {others}"
            ]  # fmt: skip
    return "\n".join(lines)


def _groups(problems: Sequence[Problem]) -> list[list[Problem]]:
    """Problems of one kind in one column together, in the order of their first."""
    groups: dict[object, list[Problem]] = {}
    for problem in problems:
        groups.setdefault(_key(problem), []).append(problem)
    return list(groups.values())


def _key(problem: Problem) -> tuple[object, ...]:
    what = re.sub(r"^sample [^:]*: ", "", problem.what)
    return problem.kind, problem.column, re.sub(r"\d+", "#", what)[:_SAME_BEGINNING]


def _full(problem: Problem) -> str:
    return f"{problem.test_id + ': ' if problem.test_id else ''}{problem}"


def _others(problems: Sequence[Problem]) -> str:
    if all(p.test_id for p in problems):
        return _listed([str(p.test_id) for p in problems])
    if all(p.row is not None for p in problems):
        return "in rows " + _listed([str(p.row) for p in problems])
    return _listed([str(p.file or p.column or p.found or p.what.partition(":")[0]) for p in problems])


def _listed(names: Sequence[str]) -> str:
    """As many names as fit, then how many more there are."""
    names = list(dict.fromkeys(names))
    shown: list[str] = []
    for name in names:
        if shown and sum(len(n) + 2 for n in (*shown, name)) > LONGEST_LIST:
            break
        shown.append(name)
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {more} more (-v lists all)" if more else "")
