"""All laws that a design allows: column x shape x what it acts on x regime x where, and products of two columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tribo.diagnose.discovery.written_law import (
    ADHESION_TERM,
    ALL,
    BOTH,
    CAVITY_SHARE,
    ELONGATION,
    FLAT,
    LOAD_TERM,
    PATTERNED,
    RIM,
    UNITS,
    Shape,
    T,
    WrittenLaw,
    column_values,
)
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

DAY_S = 86400.0
WIDE = 3.0  # ratio of the largest to the smallest value above which a logarithm differs from a line
LEVELS = 12  # names of a column that may each have an effect of its own
CYCLES = 12  # of a wave over the series


@dataclass(frozen=True)
class Group:
    """Laws that differ by their shapes alone: what they act on, in which regime and where."""

    acts_on: str
    regime: str
    where: str
    where_scale: float
    cost: float

    def law(self, shapes: tuple[Shape, ...]) -> WrittenLaw:
        return WrittenLaw(shapes, self.acts_on, self.regime, self.where, self.where_scale)


def numeric_columns(c: Conditions) -> dict[str, FloatArray]:
    """Columns of numbers that take at least two values; missing values stay NaN."""
    found = {}
    for name in (*UNITS, *c.columns):
        values = column_values(c, name)
        known = values[np.isfinite(values)]
        if len(known) >= 0.5 * len(values) and len(np.unique(known)) > 1:
            found[name] = values
    return found


def shapes_of(c: Conditions, without: Collection[str] = ()) -> list[tuple[tuple[Shape, ...], float]]:
    """Shapes of one column and products of two, each with what its choice costs; ``without`` some columns."""
    columns = {name: values for name, values in numeric_columns(c).items() if name not in without}
    found: list[tuple[tuple[Shape, ...], float]] = []
    monotone = {}
    for name, values in columns.items():
        each = list(_of_column(name, values[np.isfinite(values)]))
        monotone[name] = next(s for s in reversed(each) if s.kind in ("linear", "log"))
        kinds = [s.kind for s in each]
        found += [((s,), float(np.log(kinds.count(s.kind)))) for s in each]
    for name, names in _named_columns(c).items():
        if name in without:
            continue
        found += [((Shape("level", name, level=level),), float(np.log(len(names)))) for level in names]
    pairs = [p for p in combinations(columns, 2) if not all(name.endswith("pressure_Pa") for name in p)]
    found += [((monotone[a], monotone[b]), float(np.log(len(pairs)))) for a, b in pairs]
    return found


def _of_column(name: str, x: FloatArray) -> Iterator[Shape]:
    low, high, distinct = float(x.min()), float(x.max()), np.unique(x)
    yield Shape("linear", name, low, high)
    if low > 0 and high / low > WIDE:
        yield Shape("log", name, low, high)
    if len(distinct) > 2:
        between = 0.5 * (distinct[1:] + distinct[:-1])
        places = between if len(between) <= 9 else np.unique(np.quantile(x, np.arange(1, 10) / 10))
        yield from (Shape("step", name, low, high, place=float(p)) for p in places)
    if len(distinct) > 4:
        for p in np.quantile(x, (0.2, 0.35, 0.5, 0.65, 0.8)):
            yield Shape("optimum", name, low, high, place=float(p))
        yield from (Shape("saturating", name, low, high, width=(high - low) / k) for k in (20, 8, 3))
    if len(distinct) > 7:
        for p in np.quantile(x, np.arange(1, 8) / 8):
            yield from (Shape("hump", name, low, high, place=float(p), width=(high - low) / k) for k in (16, 8, 4))
    if name == "run_order" and len(distinct) > 18:
        yield from (Shape("wave", name, low, high, width=(high - low + 1) / k) for k in range(1, CYCLES + 1))
    if name == "elapsed_s" and high - low > DAY_S:
        yield from (Shape("wave", name, low, high, width=DAY_S / k) for k in (1, 2, 3))


def _named_columns(c: Conditions) -> dict[str, list[str]]:
    found = {}
    for name, column in c.columns.items():
        names = [str(v) for v in np.unique(column) if v]
        if 1 < len(names) <= LEVELS and np.isnan(column_values(c, name)).all():
            found[name] = names if len(names) > 2 else names[1:]
    return found


def groups_of(c: Conditions) -> list[Group]:
    """What laws may act on, in which regime and where."""
    places = _places(c)
    sides = [(ALL, 1.0, 0.0), *((name, scale, float(np.log(len(places)))) for name, scale in places)]
    found = []
    for regime, chosen in ((BOTH, 0.0), ("static", np.log(2)), ("sliding", np.log(2))):
        found += [Group(T, regime, name, scale, float(chosen) + cost) for name, scale, cost in sides]
        for acts_on in (LOAD_TERM, ADHESION_TERM):
            found += [
                Group(acts_on, regime, name, scale, float(chosen) + cost + float(np.log(2)))
                for name, scale, cost in sides
                if name in (ALL, PATTERNED)
            ]
    return found


def _places(c: Conditions) -> list[tuple[str, float]]:
    """Where a law may act, besides everywhere, with the scale of the property."""
    samples = np.unique(c.sample)
    if len(samples) < 2:
        return []
    found = [(f"sample {name}", 1.0) for name in samples]
    patterned = c.area_fraction < 1.0
    if patterned.any() and not patterned.all():
        found += [(PATTERNED, 1.0), (FLAT, 1.0)]
    if len(np.unique(c.area_fraction)) > 2:
        found += [(CAVITY_SHARE, 1.0), (RIM, float(c.rim_per_m.max()))]
    if len(np.unique(c.elongation)) > 1:
        found.append((ELONGATION, float(np.abs(c.elongation).max())))
    return found
