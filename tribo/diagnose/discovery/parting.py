"""The test that tells apart two laws that the design cannot."""

from __future__ import annotations

from typing import Any

import numpy as np

from tribo.diagnose.discovery.grammar import PRESSURES
from tribo.diagnose.discovery.written_law import BOTH, UNITS, WrittenLaw, column_values
from tribo.diagnose.next_test import HOURS_PER_PULL, PULLS
from tribo.diagnose.terms import in_words
from tribo.diagnose.verdict import NextTest
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

BEYOND = 0.25  # of the measured range, on either side, within which a further test may lie
PLACES = 61
PARTS_PRESSURES = (
    "Pull patterned samples and the flat one at equal contact pressures, with loads in proportion to the contact area"
)


def parting_test(law: WrittenLaw, other: WrittenLaw, c: Conditions) -> NextTest:
    """Where two tied laws differ: in their columns, samples, terms, regimes or, at last, in their courses."""
    text, design = _how(law, other, c)
    design |= {"pulls": PULLS, "hours": PULLS * HOURS_PER_PULL}
    return NextTest(f"{text}: {PULLS} pulls.", (law.formula(), other.formula()), design, float("nan"))


def _how(law: WrittenLaw, other: WrittenLaw, c: Conditions) -> tuple[str, dict[str, Any]]:
    if set(law.columns) ^ set(other.columns) == PRESSURES:
        return PARTS_PRESSURES, {"vary": sorted(PRESSURES)}
    if set(law.columns) != set(other.columns):
        only = [name for name in (*law.columns, *other.columns) if not (name in law.columns and name in other.columns)]
        varied = " and ".join(dict.fromkeys(in_words(name) for name in only))
        return f"Vary {varied} independently of each other and of all other conditions", {"vary": sorted(set(only))}
    if law.where != other.where:
        sample = _told_by(law, other, c)
        return f"{_vary(law)} on sample {sample} alone, at one load", {"sample": sample, "vary": list(law.columns)}
    if law.acts_on != other.acts_on:
        ends = [float(c.normal_load_N.min()), float(c.normal_load_N.max())]
        return f"{_vary(law)} at {ends[0]:.3g} N and at {ends[1]:.3g} N alone", {"normal_load_N": ends}
    if law.regime != other.regime:
        regime = next(r for r in (law.regime, other.regime) if r != BOTH)
        again = _vary(law) if _days(law) else f"Repeat pulls at the lowest and the highest value of {_words(law)}"
        return f"{again} ({regime} friction decides)", {"vary": list(law.columns)}
    if len(law.shapes) > 1 or law.shapes[0].kind == "level":
        again = _vary(law) if _days(law) else f"Pull at the corners of the ranges of {_words(law)}"
        return again, {"vary": list(law.columns)}
    name = law.columns[0]
    at = _apart(law, other, column_values(c, name))
    return f"Pull at {in_words(name)} = {at:.4g} {UNITS.get(name, '')}".rstrip(), {name: at}


def _vary(law: WrittenLaw) -> str:
    """What to change for a further test: a column, or what a day had in particular, since no day comes back."""
    days = _days(law)
    if not days:
        return f"Vary {_words(law)}"
    return f"Find out what differed on {' and '.join(days)}, and pull with it and without it"


def _days(law: WrittenLaw) -> list[str]:
    return [s.level for s in law.shapes if s.kind == "level" and s.column == "date"]


def _words(law: WrittenLaw) -> str:
    return " and ".join(dict.fromkeys(in_words(name) for name in law.columns))


def _told_by(law: WrittenLaw, other: WrittenLaw, c: Conditions) -> str:
    """The sample on which the two act most differently."""
    apart = np.abs(law.weight(c) - other.weight(c))
    return str(c.sample[int(np.argmax(apart))])


def _apart(law: WrittenLaw, other: WrittenLaw, x: FloatArray) -> float:
    """The value of the column at which the two courses differ most, each scaled to the same mean and spread."""
    known = x[np.isfinite(x)]
    reach = BEYOND * float(np.ptp(known))
    low = max(known.min() - reach, 0.0) if known.min() >= 0 else known.min() - reach
    grid = np.linspace(low, known.max() + reach, PLACES)
    courses = []
    for shape in (law.shapes[0], other.shapes[0]):
        measured, there = shape.of_numbers(known)[:, 0], shape.of_numbers(grid)[:, 0]
        courses.append((there - measured.mean()) / max(float(measured.std()), 1e-12))
    one, two = courses
    sign = np.sign(np.dot(one - one.mean(), two - two.mean())) or 1.0
    return float(grid[int(np.nanargmax(np.abs(one - sign * two)))])
