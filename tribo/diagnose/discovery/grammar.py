"""All laws that a design allows: column x shape x what it acts on x regime x where, and products of two columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

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
TENTHS = 10  # of the series: ends of its stretches
WIDTHS = (30.0, 22.0, 16.0, 12.0, 9.0, 7.0, 5.5, 4.0)  # of humps, by how much less than the range
SOFT = (120.0, 60.0, 40.0, 28.0, 20.0, 14.0, 10.0)  # the same of soft steps
ZEROS = (-1.0, -0.4, 0.0, 0.15, 0.3, 0.5)  # of a factor, from the lowest value in shares of the range
FINE = 41  # places of a shape that is looked at closely
# Columns that say the same in another unit or count, so that their product is no law of two columns.
PRESSURES = frozenset({"pressure_Pa", "contact_pressure_Pa"})
ALIKE = (
    PRESSURES, frozenset({"run_order", "specimen_run", "elapsed_s"}),
)  # fmt: skip


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
    monotone: dict[str, list[Shape]] = {}
    for name, values in columns.items():
        each = list(_of_column(name, values[np.isfinite(values)]))
        monotone[name] = [replace(s, place=float("nan")) for s in each if s.kind in ("linear", "log")]
        kinds = [s.kind for s in each]
        found += [((s,), float(np.log(kinds.count(s.kind)))) for s in each]
    for name, names in _named_columns(c).items():
        if name in without:
            continue
        found += [((Shape("level", name, level=level),), float(np.log(len(names)))) for level in names]
    pairs = [p for p in combinations(columns, 2) if not any(set(p) <= alike for alike in ALIKE)]
    products = [(one, other) for a, b in pairs for one in monotone[a] for other in monotone[b]]
    # the column of a law is free of charge; a product pays for the choice of its second column and of both shapes
    cost = float(np.log(max(2.0 * len(products) / max(len(columns), 1), 1.0)))
    return found + [(both, cost) for both in products]


def _of_column(name: str, x: FloatArray) -> Iterator[Shape]:
    low, high, distinct = float(x.min()), float(x.max()), np.unique(x)
    yield Shape("linear", name, low, high, place=0.5 * (low + high))
    if low > 0 and high / low > WIDE:
        yield Shape("log", name, low, high, place=float(np.sqrt(low * high)))
    if len(distinct) > 2:
        between = 0.5 * (distinct[1:] + distinct[:-1])
        places = between if len(between) <= 9 else np.unique(np.quantile(x, np.arange(1, 10) / 10))
        yield from (Shape("step", name, low, high, place=float(p)) for p in places)
    if len(distinct) > 4:
        for p in np.quantile(x, (0.2, 0.35, 0.5, 0.65, 0.8)):
            yield Shape("optimum", name, low, high, place=float(p))
        yield from _saturating(name, low, high, (20.0, 8.0, 3.0))
    if len(distinct) > 7:
        yield from _ramps(name, x, (0.25, 0.5, 0.75))
        for p in np.quantile(x, (0.2, 0.35, 0.5, 0.65, 0.8)):
            yield from (Shape("soft step", name, low, high, place=float(p), width=(high - low) / k) for k in (40, 15))
        for p in np.quantile(x, np.arange(1, 8) / 8):
            yield from (Shape("hump", name, low, high, place=float(p), width=(high - low) / k) for k in (16, 8, 4))
    if name == "run_order" and len(distinct) > 18:
        yield from _waves(name, low, high, 0.5)
        yield from _windows(name, low, high, TENTHS)
    if name == "elapsed_s" and high - low > DAY_S:
        yield from _waves(name, low, high, 1.0)


def _waves(name: str, low: float, high: float, step: float) -> Iterator[Shape]:
    """Periods of whole steps of the turns: in the series, up to so many; of the time, in one day, up to three."""
    whole, most = (DAY_S, 3.0) if name == "elapsed_s" else (high - low + 1, CYCLES - 0.5)
    turns = np.arange(1.0, most + 0.5 * step, step)
    yield from (Shape("wave", name, low, high, width=float(whole / k)) for k in turns)


def _saturating(name: str, low: float, high: float, times: Sequence[float]) -> Iterator[Shape]:
    """From either end, with widths of so many times less than the range."""
    for k in times:
        yield Shape("saturating", name, low, high, width=(high - low) / k)
        yield Shape("saturating", name, high, low, width=(low - high) / k)


def _ramps(name: str, x: FloatArray, quantiles: Sequence[float]) -> Iterator[Shape]:
    """Upwards and downwards from these quantiles."""
    for p in np.quantile(x, quantiles):
        for low, high in ((x.min(), x.max()), (x.max(), x.min())):
            if p != high:
                yield Shape("ramp", name, float(low), float(high), place=float(p))


def _windows(name: str, low: float, high: float, parts: int) -> Iterator[Shape]:
    """Stretches of whole parts of the range, of up to half of it, that touch neither end."""
    step = (high - low) / parts
    for first in range(1, parts):
        for n in range(1, min(parts // 2, parts - 1 - first) + 1):
            yield Shape("window", name, low, high, place=low + first * step, width=n * step)


def fine_shapes(s: Shape, c: Conditions) -> list[Shape]:
    """The shapes of the same kind on the same column with places and widths on a fine grid."""
    if s.kind in ("linear", "log", "level"):
        return [s]
    values = column_values(c, s.column)
    x = values[np.isfinite(values)]
    low, high, distinct = float(x.min()), float(x.max()), np.unique(x)
    reach = high - low
    if s.kind == "step":
        between = 0.5 * (distinct[1:] + distinct[:-1])
        places = between if len(between) <= FINE else np.unique(np.quantile(between, np.linspace(0.04, 0.96, FINE)))
        return [Shape("step", s.column, low, high, place=float(p)) for p in places]
    if s.kind == "ramp":
        return list(_ramps(s.column, x, tuple(np.linspace(0.05, 0.95, 19))))
    if s.kind == "saturating":
        return list(_saturating(s.column, low, high, (40.0, 25.0, 16.0, 10.0, 7.0, 5.0, 3.5, 2.5, 1.7, 1.2)))
    if s.kind == "optimum":
        return [Shape("optimum", s.column, low, high, place=float(p)) for p in np.linspace(low, high, FINE)]
    if s.kind == "window":
        return list(_windows(s.column, low, high, 4 * TENTHS))
    if s.kind == "wave":
        return list(_waves(s.column, low, high, 0.1))
    places = np.linspace(low, high, FINE)[1:-1]
    widths = [reach / k for k in (WIDTHS if s.kind == "hump" else SOFT)]
    return [Shape(s.kind, s.column, low, high, place=float(p), width=w) for p in places for w in widths]


def fine_products(shapes: tuple[Shape, ...]) -> list[tuple[Shape, ...]]:
    """Products of the same two shapes with the zero of each at several places."""
    return list(product(*([_from_zero(s, share) for share in ZEROS] for s in shapes)))


def _from_zero(s: Shape, share: float) -> Shape:
    """A line or logarithm whose zero lies at a share of the way from ``low`` to ``high``."""
    if s.kind == "log":
        return replace(s, low=s.low * (s.high / s.low) ** share)
    return replace(s, low=s.low + share * (s.high - s.low))


def refined_shapes(s: Shape, c: Conditions) -> list[Shape]:
    """Shapes about one of the fine grid, with places between its neighbours; none where the grid says all there is."""
    if s.kind not in ("step", "ramp", "optimum", "hump", "soft step", "window", "wave"):
        return []
    values = column_values(c, s.column)
    x = np.unique(values[np.isfinite(values)])
    near = 2.0 * float(np.ptp(x)) / (FINE - 1)
    if s.kind == "wave":
        return [replace(s, width=s.width / (1.0 + k)) for k in np.linspace(-0.1, 0.1, FINE) * s.width / np.ptp(x)]
    if s.kind == "window":
        ends = np.linspace(-near, near, 9)
        return [replace(s, place=s.place + a, width=s.width + b - a) for a in ends for b in ends if s.width + b > a]
    if s.kind == "step":
        between = 0.5 * (x[1:] + x[:-1])
        near = max(near, 3.0 * float(np.min(np.abs(np.diff(between)))) if len(between) > 1 else 0.0)
        chosen = between[np.abs(between - s.place) <= near]
        return [replace(s, place=float(p)) for p in chosen] if len(x) > FINE else []
    places = np.clip(np.linspace(s.place - near, s.place + near, 21), x[0], x[-1])
    widths = [s.width * k for k in (0.7, 0.85, 1.0, 1.2, 1.45)] if s.kind in ("hump", "soft step") else [s.width]
    return [replace(s, place=float(p), width=w) for p in np.unique(places) for w in widths if p != s.high]


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


def corrects_a_pattern(groups: Sequence[Group], shapes: Sequence[tuple[Shape, ...]]) -> NDArray[np.bool_]:
    """Which laws, (groups, shapes), follow the pressure alone on one sample, or by the elongation, which two samples
    have at most: no laws of their own, since they say how wrong the model is about that pattern."""
    one = np.array([group.where == ELONGATION or group.where.startswith("sample ") for group in groups])
    pressure_alone = np.array([{s.column for s in each} <= PRESSURES for each in shapes], bool)
    return one[:, None] & pressure_alone


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
