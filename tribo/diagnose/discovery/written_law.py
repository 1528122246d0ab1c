"""A law of the grammar: what it follows, its shape, what it acts on, in which regime and where; as a mechanism."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.display import displayed
from tribo.mechanisms.record import Base, Choosing, Conditions, Forces, Mechanism, Values, amplitude
from tribo.records import REGIMES, FloatArray

T, LOAD_TERM, ADHESION_TERM = "T", "load term", "adhesion term"
BOTH = "both"
ALL, PATTERNED, FLAT, CAVITY_SHARE, RIM, ELONGATION = "all", "patterned", "flat", "1 - AF", "rim", "elongation"
UNITS = {
    "pressure_Pa": "Pa", "contact_pressure_Pa": "Pa", "run_order": "", "specimen_run": "", "elapsed_s": "s",
    "temperature_C": "°C", "humidity_pct": "%", "speed_m_s": "m/s", "hold_s": "s",
}  # fmt: skip
LARGEST = 3.0  # of an amplitude in ln T


@displayed()
@dataclass(frozen=True)
class Shape:
    """A function of one column x, about one in size and zero where a campaign mostly is.

    ``linear`` and ``log`` rise by 1 from ``low`` to ``high`` and are 0 at ``place`` (at ``low`` without one); ``step``
    is 1 above ``place``; ``soft step`` is a logistic function of the scale ``width`` about it; ``ramp`` is 0 up to
    ``place`` and runs to 1 at ``high``, which may lie on either side; ``optimum`` is a parabola with 0 at ``place`` and
    -1 at the farther end; ``hump`` is a Gaussian of standard deviation ``width`` at ``place``; ``saturating`` is
    -exp(-(x - low) / width), from ``low`` upwards or, with a negative ``width``, downwards; ``window`` is 1 from
    ``place`` to ``place`` + ``width``; ``wave`` is sin and cos of the period ``width``; ``level`` is 1 where a column
    of names has the value ``level``.
    """

    kind: str
    column: str
    low: float = 0.0
    high: float = 1.0
    place: float = float("nan")
    width: float = float("nan")
    level: str = ""

    @property
    def zero(self) -> float:
        """Where a line or a logarithm is zero."""
        return self.low if math.isnan(self.place) else self.place

    def of(self, c: Conditions) -> FloatArray:
        """Values of shape (n, 1), or (n, 2) of a wave; 0 where the column has no value."""
        if self.kind == "level":
            return np.asarray(c.columns[self.column] == self.level, float)[:, None]
        x = column_values(c, self.column)
        return np.nan_to_num(self.of_numbers(x), nan=0.0)

    def of_numbers(self, x: FloatArray) -> FloatArray:
        """Values at numbers x (n,), NaN where x is."""
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

    ``where`` is ALL, PATTERNED, FLAT, the name of a sample after "sample ", or a property of the pattern in proportion
    to which it acts (CAVITY_SHARE, RIM, ELONGATION; the latter two over ``where_scale``).
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

    def course(self, c: Conditions) -> FloatArray:
        """The product of its shapes, (n, d)."""
        found = self.shapes[0].of(c)
        for shape in self.shapes[1:]:
            found = found * shape.of(c)
        return found

    def weight(self, c: Conditions) -> FloatArray:
        """How much it acts on the sample of every test, (n,)."""
        patterned = c.area_fraction < 1.0
        if self.where.startswith("sample "):
            return np.asarray(c.sample == self.where.removeprefix("sample "), float)
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
        d = 2 if self.shapes[0].kind == "wave" else 1
        parameters = [first, *(amplitude("b", "", -LARGEST, LARGEST, 0.1, "of the cosine") for _ in range(d - 1))]

        needs = tuple(name for name in self.columns if name in UNITS and not name.endswith("pressure_Pa"))
        return Mechanism(
            name=f"law {self.formula()} ({self.regime}, {self.where})", kind="any", formula=self.formula(),
            parameters=tuple(parameters), law=ActingLaw(self), sign=0,
            regimes=REGIMES if self.regime == BOTH else (self.regime,),
            enters="the friction forces", shows="", confused_with="", separates="", needs=needs,
            choosing=Choosing(held_out="loads" if self.where.startswith("sample ") else "samples"),
        )  # fmt: skip

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
        inner = " * ".join(_formula(s) for s in self.shapes)
        return f"{self.acts_on} * exp({a} {inner}{weight})"


@dataclass(frozen=True)
class ActingLaw:
    """The forces under a law, as a mechanism calls for them; a record, so that it can be kept and sent to workers."""

    law: WrittenLaw

    def __call__(self, values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
        course = self.law.course(conditions)
        change = course @ values[: course.shape[1]] * self.law.weight(conditions)
        return self.law.changed(base, conditions.normal_load_N, change)


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
    return f"[{x} = {s.level}]"


def column_values(c: Conditions, name: str) -> FloatArray:
    """A recorded column as numbers, NaN where it has no value.

    Raises
    ------
    KeyError
        The campaign has no such column.
    """
    if name in UNITS:
        return np.asarray(getattr(c, name), float)
    return np.array([_number(text) for text in c.columns[name]])


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")

