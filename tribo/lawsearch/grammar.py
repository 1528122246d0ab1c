"""Laws of recorded columns: a law as a mechanism, and all laws that a design allows.

A law is a column x a shape x what it acts on x a regime x where; or a product of two columns.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.gaps import enough_recorded
from tribo.display import displayed
from tribo.mechanisms.conditions import is_level, levels_of
from tribo.mechanisms.record import Base, Choosing, Conditions, Forces, Mechanism, Values, amplitude
from tribo.records import REGIMES, FloatArray

T, LOAD_TERM, ADHESION_TERM = "T", "load term", "adhesion term"
BOTH = "both"
ALL, PATTERNED, FLAT, CAVITY_SHARE, RIM, ELONGATION = "all", "patterned", "flat", "1 - AF", "rim", "elongation"
UNITS = {
    "pressure_Pa": "Pa", "contact_pressure_Pa": "Pa", "run_order": "", "specimen_run": "", "elapsed_s": "s",
    "temperature_C": "°C", "humidity_pct": "%", "speed_m_s": "m/s", "hold_s": "s",
    "clock_h": "h",
}  # fmt: skip
LARGEST = 3.0  # of an amplitude in ln T
AMPLITUDES = "abcde"  # of a wave two, of levels one less than there are values
MOST_SETS = 30  # sets of samples, of up to seven, on which terms of T are looked at: memory and time grow with them
MOST_VALUES = len(AMPLITUDES) + 1  # of a column that is told by its values


@displayed()
@dataclass(frozen=True)
class Shape:
    """A function of one column x, about one in size and zero where a campaign mostly is.

    ``linear`` and ``log`` rise by 1 from ``low`` to ``high`` and are 0 at ``place`` (at ``low`` without one); ``step``
    is 1 above ``place``; ``soft step`` is a logistic function of the scale ``width`` about it; ``ramp`` is 0 up to
    ``place`` and runs to 1 at ``high``, which may lie on either side; ``optimum`` is a parabola with 0 at ``place`` and
    -1 at the farther end; ``hump`` is a Gaussian of standard deviation ``width`` at ``place``; ``saturating`` is
    -exp(-(x - low) / width), from ``low`` upwards or, with a negative ``width``, downwards; ``window`` is 1 from
    ``place`` to ``place`` + ``width``; ``wave`` is sin and cos of the period ``width``; ``log optimum`` is a parabola
    of the logarithm; ``level`` is 1 where a column of names has the value ``level``, or one of numbers the value
    ``place``; ``levels`` is 1 at the second of the ``values`` of a column, 1 at the third, and so on: a column each;
    ``curve`` has the ``heights`` at the ``values`` of a column, and runs straight from one to the next; ``surface`` is
    one of two columns: the second holds the ``heights`` at every pair of their ``values``, the first column's in rows.
    """

    kind: str
    column: str
    low: float = 0.0
    high: float = 1.0
    place: float = float("nan")
    width: float = float("nan")
    level: str = ""
    values: tuple[float | str, ...] = ()
    heights: tuple[float, ...] = ()

    @property
    def zero(self) -> float:
        """Where a line or a logarithm is zero."""
        return self.low if math.isnan(self.place) else self.place

    def of(self, c: Conditions) -> FloatArray:
        """Values of shape (n, 1), (n, 2) of a wave, (n, values - 1) of levels, (n, values) of one side of a surface.

        Where the column has no value, it is what is expected of the shape given what is known of the value, or the mean
        over the recorded ones where nothing is.
        """
        if self.kind == "levels":
            return np.concatenate([level.of(c) for level in self.at_each[1:]], axis=1)
        if self.level:
            return is_level(c.columns[self.column], self.level)[:, None]
        if self.column in c.gaps:
            return c.gaps[self.column].mean_of(self.of_numbers)
        x = column_values(c, self.column)
        values, known = self.of_numbers(x), np.isfinite(x)
        return np.where(known[:, None], values, values[known].mean(axis=0) if known.any() else 0.0)

    @property
    def at_each(self) -> tuple[Shape, ...]:
        """The values of ``levels``, each as a level of its own."""
        return tuple(
            replace(self, kind="level", values=(), **({"level": v} if isinstance(v, str) else {"place": v}))
            for v in self.values
        )

    def of_numbers(self, x: FloatArray) -> FloatArray:
        """Values at numbers x (n,), NaN where x is."""
        if self.kind == "levels":
            return np.concatenate([level.of_numbers(x) for level in self.at_each[1:]], axis=1)
        if self.kind == "level":
            return np.where(np.isnan(x), np.nan, np.isclose(x, self.place, rtol=1e-6, atol=0.0) * 1.0)[:, None]
        if self.kind == "log optimum":
            half = max(np.log(self.high / self.place), np.log(self.place / self.low))
            return (-((np.log(np.maximum(x, 1e-300) / self.place) / half) ** 2))[:, None]
        if self.kind == "curve":
            return np.interp(x, np.array(self.values, float), self.heights)[:, None]
        if self.kind == "surface":
            return hats(x, np.array(self.values, float))
        if self.kind == "linear":
            return ((x - self.zero) / (self.high - self.low))[:, None]
        if self.kind == "log":
            return (np.log(np.maximum(x, 1e-300) / self.zero) / np.log(self.high / self.low))[:, None]
        if self.kind == "step":
            return np.where(np.isnan(x), np.nan, (x > self.place) * 1.0)[:, None]
        if self.kind == "optimum":
            half = max(self.high - self.place, self.place - self.low)
            return (-(((x - self.place) / half) ** 2))[:, None]
        if self.kind == "hump":
            return np.exp(-0.5 * ((x - self.place) / self.width) ** 2)[:, None]
        if self.kind == "saturating":
            return -np.exp(-np.maximum((x - self.low) / self.width, 0.0))[:, None]
        if self.kind == "ramp":
            return np.maximum((x - self.place) / (self.high - self.place), 0.0)[:, None]
        if self.kind == "soft step":
            return 1.0 / (1.0 + np.exp(-(x - self.place) / self.width))[:, None]
        if self.kind == "window":
            inside = (x >= self.place) & (x <= self.place + self.width)
            return np.where(np.isnan(x), np.nan, inside * 1.0)[:, None]
        turns = 2.0 * np.pi * x / self.width
        return np.column_stack([np.sin(turns), np.cos(turns)])


@displayed()
@dataclass(frozen=True)
class WrittenLaw:
    """One law: the product of one or two shapes, acting on T or on one term of it, in a regime, on some samples.

    Without shapes it is a scope: what laws act on, in which regime and where.

    ``where`` is ALL, PATTERNED, FLAT, the name of a sample after "sample ", of several after "samples " with " + "
    between them, or a property of the pattern in proportion to which it acts (CAVITY_SHARE, RIM, ELONGATION; the latter
    two over ``where_scale``).
    """

    shapes: tuple[Shape, ...]
    acts_on: str = T
    regime: str = BOTH
    where: str = ALL
    where_scale: float = 1.0

    @property
    def form(self) -> tuple[object, ...]:
        """What distinguishes laws of different form, whatever their places are."""
        kinds = tuple((s.kind, s.column, s.level) for s in self.shapes)
        return (kinds, self.acts_on, self.regime, self.where)

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(s.column for s in self.shapes)

    @property
    def sample(self) -> str:
        """The one sample it acts on; empty where it acts on more."""
        return self.where.removeprefix("sample ") if self.where.startswith("sample ") else ""

    def course(self, c: Conditions) -> FloatArray:
        """The product of its shapes, (n, d)."""
        found = self.shapes[0].of(c)
        if self.shapes[0].kind == "surface":
            second = self.shapes[1]
            heights = np.reshape(second.heights, (found.shape[1], -1))
            return np.einsum("ni,nj,ij->n", found, second.of(c), heights)[:, None]
        for shape in self.shapes[1:]:
            found = found * shape.of(c)
        return found

    def weight(self, c: Conditions) -> FloatArray:
        """How much it acts on the sample of every test, (n,)."""
        patterned = c.area_fraction < 1.0
        if self.where.startswith("sample "):
            return np.asarray(c.sample == self.where.removeprefix("sample "), float)
        if self.where.startswith("samples "):
            return np.asarray(np.isin(c.sample, self.where.removeprefix("samples ").split(" + ")), float)
        return np.asarray(
            {
                ALL: np.ones(len(patterned)), PATTERNED: patterned * 1.0, FLAT: ~patterned * 1.0,
                CAVITY_SHARE: 1.0 - c.area_fraction, RIM: c.rim_per_m / self.where_scale,
                ELONGATION: c.elongation / self.where_scale,
            }[self.where]
        )  # fmt: skip

    def mechanism(self) -> Mechanism:
        """The law as a mechanism: its amplitude is free (two of a wave), its places and widths are as written."""
        first = amplitude("a", "", -LARGEST, LARGEST, 0.1, "change of ln T at 1 of the shape")
        of_each = {"wave": ("of the cosine",), "levels": tuple(f"at {v}" for v in self.shapes[0].values[2:])}
        names = zip(AMPLITUDES[1:], of_each.get(self.shapes[0].kind, ()), strict=False)
        parameters = [first, *(amplitude(name, "", -LARGEST, LARGEST, 0.1, what) for name, what in names)]
        needs = tuple(name for name in self.columns if name in UNITS and not name.endswith("pressure_Pa"))
        return Mechanism(
            name=f"law {self.formula()} ({self.regime}, {self.where})", kind="any", formula=self.formula(),
            parameters=tuple(parameters), law=self, sign=0,
            regimes=REGIMES if self.regime == BOTH else (self.regime,),
            enters="the friction forces", shows="", confused_with="", separates="", needs=needs,
            choosing=Choosing(held_out="loads" if self.where.startswith("sample ") else "samples"),
        )  # fmt: skip

    def __call__(self, values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
        """The forces under the law, as a mechanism calls for them."""
        course = self.course(conditions)
        change = course @ values[: course.shape[1]] * self.weight(conditions)
        return self.changed(base, conditions.normal_load_N, change)

    def changed(self, base: Base, load_N: FloatArray, change: FloatArray) -> Forces:
        """The forces with ``change`` (n,) of ln T, or of the logarithm of the term it acts on."""
        factor = np.exp(np.clip(change, -20.0, 20.0))
        on_load = factor if self.acts_on in (T, LOAD_TERM) else 1.0
        on_adhesion = factor if self.acts_on in (T, ADHESION_TERM) else 1.0
        static = base.static_mu * load_N * on_load + base.static_adhesion_N * on_adhesion
        sliding = base.sliding_mu * load_N * on_load + base.sliding_adhesion_N * on_adhesion
        before = base.forces(load_N)
        return Forces(
            before.static_N if self.regime == "sliding" else static,
            before.sliding_N if self.regime == "static" else sliding,
        )

    def formula(self, a: str = "a") -> str:
        """T -> T exp(a g), with the shape written out."""
        share = {ALL: "", PATTERNED: "", FLAT: "", CAVITY_SHARE: " (1 - AF)", RIM: " rim", ELONGATION: " elongation"}
        weight = share.get(self.where, "")
        if self.shapes[0].kind == "wave":
            s = self.shapes[0]
            turns = f"2 pi {s.column} / {s.width:.4g}"
            return f"{self.acts_on} * exp(a sin({turns}) + b cos({turns}))"
        if self.shapes[0].kind == "levels":
            each = zip(AMPLITUDES, self.shapes[0].at_each[1:], strict=False)
            return f"{self.acts_on} * exp({' + '.join(f'{name} {_formula(s)}{weight}' for name, s in each)})"
        if self.shapes[0].kind == "surface":
            return f"{self.acts_on} * exp({a} surface({', '.join(self.columns)}){weight})"
        inner = " * ".join(_formula(s) for s in self.shapes)
        return f"{self.acts_on} * exp({a} {inner}{weight})"


def _formula(s: Shape) -> str:
    x = s.column
    if s.kind == "linear":
        return f"({x} - {s.zero:.4g}) / {s.high - s.low:.4g}"
    if s.kind == "log":
        return f"ln({x} / {s.zero:.4g}) / ln({s.high / s.low:.4g})"
    if s.kind == "step":
        return f"[{x} > {s.place:.4g}]"
    if s.kind == "optimum":
        return f"(-(({x} - {s.place:.4g}) / {max(s.high - s.place, s.place - s.low):.4g})^2)"
    if s.kind == "hump":
        return f"exp(-(({x} - {s.place:.4g}) / {s.width:.4g})^2 / 2)"
    if s.kind == "saturating":
        from_low = f"{x} - {s.low:.4g}" if s.width > 0 else f"{s.low:.4g} - {x}"
        return f"(-exp(-({from_low}) / {abs(s.width):.4g}))"
    if s.kind == "ramp":
        beyond = f"{x} - {s.place:.4g}" if s.high > s.place else f"{s.place:.4g} - {x}"
        return f"max(0, {beyond}) / {abs(s.high - s.place):.4g}"
    if s.kind == "soft step":
        return f"1 / (1 + exp(-({x} - {s.place:.4g}) / {s.width:.4g}))"
    if s.kind == "window":
        return f"[{s.place:.4g} <= {x} <= {s.place + s.width:.4g}]"
    if s.kind == "curve":
        return f"curve({x})"
    if s.kind == "log optimum":
        half = max(math.log(s.high / s.place), math.log(s.place / s.low))
        return f"(-(ln({x} / {s.place:.4g}) / {half:.4g})^2)"
    return f"[{x} = {s.level or f'{s.place:.4g}'}]"


def hats(x: FloatArray, knots: FloatArray) -> FloatArray:
    """Of numbers x (n,) the weights (n, knots) of the knots between which they lie, NaN where x is."""
    return np.column_stack([np.interp(x, knots, one) for one in np.eye(len(knots))])


def column_values(c: Conditions, name: str) -> FloatArray:
    """A column as numbers, gaps filled, NaN where neither a value nor an estimate of it is there.

    Raises
    ------
    KeyError
        The campaign has no such column.
    """
    if name in UNITS:
        known = np.asarray(getattr(c, name), float)
        return known if len(known) else np.full(len(c.sample), np.nan)
    values = np.full(len(c.columns[name]), np.nan)
    for k, text in enumerate(c.columns[name]):
        with suppress(ValueError):
            values[k] = float(text)
    return values


def recorded_values(c: Conditions, name: str) -> FloatArray:
    """The recorded values of a column of numbers, (values,)."""
    values = column_values(c, name)
    return values[np.isfinite(values) & ~c.not_recorded(name)]


DAY_H = 24.0
FEWEST_HOURS = 2.0  # of the day in which pulls were made: a shorter time has no afternoon
WIDE = 3.0  # ratio of the largest to the smallest value above which a logarithm differs from a line
LEVELS = 12  # names of a column that may each have an effect of its own
CYCLES = 12  # of a wave over the series
# columns without waves: those of the series are periods of the run order
WITHOUT_WAVES = {"pressure_Pa", "contact_pressure_Pa", "specimen_run", "elapsed_s"}
TENTHS = 10  # of the series: ends of its stretches
WIDTHS = (30.0, 22.0, 16.0, 12.0, 9.0, 7.0, 5.5, 4.0)  # of humps, by how much less than the range
SOFT = (120.0, 60.0, 40.0, 28.0, 20.0, 14.0, 10.0)  # the same of soft steps
ZEROS = (-1.0, -0.4, 0.0, 0.15, 0.3, 0.5)  # of a factor, from the lowest value in shares of the range
FINE = 41  # places of a shape that is looked at closely
TIMES = frozenset({"run_order", "elapsed_s", "clock_h", "date"})  # what days and drift follow as well
OF_SERIES = TIMES | {"specimen_run"}  # and what run-in follows
SUCCESSIVE = OF_SERIES - {"clock_h"}  # columns that follow each other through a series
# Columns that say the same in another unit or count, so that their product is no law of two columns.
PRESSURES = frozenset({"pressure_Pa", "contact_pressure_Pa"})
ALIKE = (PRESSURES, SUCCESSIVE)


def shapes_of(c: Conditions, without: Collection[str] = ()) -> list[tuple[tuple[Shape, ...], float]]:
    """Shapes of one column and products of two, each with what its choice costs; ``without`` some columns.

    A column of numbers has values enough, and two different ones.
    """
    columns = {}
    for name in (*UNITS, *c.columns):
        known = recorded_values(c, name)
        if name not in without and enough_recorded(len(known), len(c.sample)) and len(np.unique(known)) > 1:
            columns[name] = known
    found: list[tuple[tuple[Shape, ...], float]] = []
    monotone: dict[str, list[Shape]] = {}
    for name, values in columns.items():
        each = list(_of_column(name, values))
        monotone[name] = [replace(s, place=float("nan")) for s in each if s.kind in ("linear", "log")]
        kinds = [s.kind for s in each]
        found += [((s,), float(np.log(kinds.count(s.kind)))) for s in each]
    for name, column in c.columns.items():
        names = levels_of(column)
        if name not in without and 1 < len(names) <= LEVELS and np.isnan(column_values(c, name)).all():
            names = names if len(names) > 2 else names[1:]
            found += [((Shape("level", name, level=level),), float(np.log(len(names)))) for level in names]
    pairs = [p for p in combinations(columns, 2) if not any(set(p) <= alike for alike in ALIKE)]
    products = [(one, other) for a, b in pairs for one in monotone[a] for other in monotone[b]]
    # the column of a law is free of charge; a product pays for the choice of its second column and of both shapes
    cost = float(np.log(max(2.0 * len(products) / max(len(columns), 1), 1.0)))
    return found + [(both, cost) for both in products]


def logarithmic(low: float, high: float) -> bool:
    """Whether a column between these values is looked at in its logarithm too."""
    return low > 0 and high / low > WIDE


def _of_column(name: str, x: FloatArray) -> Iterator[Shape]:
    low, high, distinct = float(x.min()), float(x.max()), np.unique(x)
    if name == "clock_h":
        if high - low > FEWEST_HOURS:
            yield from (Shape("step", name, low, high, place=float(p)) for p in _hours_between(distinct))
            yield from _waves(name, low, high, 1.0)
        return
    yield Shape("linear", name, low, high, place=0.5 * (low + high))
    if logarithmic(low, high):
        yield Shape("log", name, low, high, place=float(np.sqrt(low * high)))
    if len(distinct) > 2:
        between = 0.5 * (distinct[1:] + distinct[:-1])
        places = between if len(between) <= 9 else np.unique(np.quantile(x, np.arange(1, 10) / 10))
        yield from (Shape("step", name, low, high, place=float(p)) for p in places)
    if 2 < len(distinct) <= MOST_VALUES:
        yield from (Shape("level", name, low, high, place=float(v)) for v in distinct[1:-1])
    if len(distinct) > 4 and logarithmic(low, high):
        for share in (0.2, 0.35, 0.5, 0.65, 0.8):
            yield Shape("log optimum", name, low, high, place=float(low * (high / low) ** share))
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
    if len(distinct) > 18 and name not in WITHOUT_WAVES:
        yield from _waves(name, low, high, 0.5)
    if name == "run_order" and len(distinct) > 18:
        yield from _windows(name, low, high, TENTHS)


def _hours_between(hours: FloatArray) -> FloatArray:
    """Half hours between the first and the last pull of a day: what begins at an hour begins at it on every day."""
    halves = np.arange(np.ceil(2.0 * hours[0]), np.floor(2.0 * hours[-1]) + 1.0) / 2.0
    return np.asarray(halves[(halves > hours[0]) & (halves < hours[-1])])


def _waves(name: str, low: float, high: float, step: float) -> Iterator[Shape]:
    """Periods of whole steps of the turns: in the series, up to so many; in one day, up to three; over the range of any
    other column, from one and a half to five."""
    ranges = {"clock_h": (DAY_H, 1.0, 3.0), "run_order": (high - low + 1, 1.0, CYCLES - 0.5)}
    whole, least, most = ranges.get(name, (high - low, 1.5, 5.0))
    turns = np.arange(least, most + 0.5 * step, step)
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
    if s.kind in ("linear", "log", "level", "levels", "curve") or (s.kind == "wave" and s.column == "clock_h"):
        return [s]  # a day has 24 hours
    x = recorded_values(c, s.column)
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
    if s.kind == "log optimum":
        return [replace(s, place=float(p)) for p in np.geomspace(low, high, FINE)]
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
    if s.column == "clock_h" and s.kind == "wave":
        return []
    x = np.unique(recorded_values(c, s.column))
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


def scopes_of(c: Conditions) -> tuple[tuple[WrittenLaw, ...], FloatArray]:
    """What laws may act on, in which regime and where; with what the choice of each costs."""
    samples = np.unique(c.sample)
    places: list[tuple[str, float]] = []  # besides everywhere, with the scale of the property
    if len(samples) > 1:
        places = [(f"sample {name}", 1.0) for name in samples]
        patterned = c.area_fraction < 1.0
        if patterned.any() and not patterned.all():
            places += [(PATTERNED, 1.0), (FLAT, 1.0)]
        if len(np.unique(c.area_fraction)) > 2:
            places += [(CAVITY_SHARE, 1.0), (RIM, float(c.rim_per_m.max()))]
        if len(np.unique(c.elongation)) > 1:
            places.append((ELONGATION, float(np.abs(c.elongation).max())))
    everywhere = [(ALL, 1.0, 0.0), *((name, scale, float(np.log(len(places)))) for name, scale in places)]
    sets = _sets_of_samples(c)
    everywhere += [(each, 1.0, float(np.log(len(places) + len(sets)))) for each in sets]
    few = (ALL, PATTERNED, *(f"sample {name}" for name in samples), *(sets if len(sets) <= MOST_SETS else ()))
    found, costs = [], []
    for regime, chosen in ((BOTH, 0.0), ("static", float(np.log(2))), ("sliding", float(np.log(2)))):
        for acts_on in (T, LOAD_TERM, ADHESION_TERM):
            for where, scale, cost in everywhere:
                if acts_on == T or where in few:
                    found.append(WrittenLaw((), acts_on, regime, where, scale))
                    costs.append(chosen + cost if acts_on == T else chosen + cost + float(np.log(2)))
    return tuple(found), np.array(costs)


def _sets_of_samples(c: Conditions) -> list[str]:
    """Every two samples alone, and all but every one, where that is no other place."""
    names = [str(name) for name in np.unique(c.sample)]
    if len(names) < 3 or any(" + " in name for name in names):
        return []
    patterned = frozenset(np.unique(c.sample[c.area_fraction < 1.0]).tolist())
    sets = dict.fromkeys([*combinations(names, len(names) - 1), *combinations(names, 2)])
    return [f"samples {' + '.join(each)}" for each in sets if frozenset(each) != patterned]


def corrects_a_pattern(scopes: Sequence[WrittenLaw], shapes: Sequence[tuple[Shape, ...]]) -> NDArray[np.bool_]:
    """Which laws, (scopes, shapes), follow the pressure alone on one sample, or by the elongation, which two samples
    have at most: no laws of their own, since they say how wrong the model is about that pattern."""
    one = np.array([scope.where == ELONGATION or scope.where.startswith("sample") for scope in scopes])
    pressure_alone = np.array([{s.column for s in each} <= PRESSURES for each in shapes], bool)
    return one[:, None] & pressure_alone
