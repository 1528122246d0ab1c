"""The laws that were found: what is left of every test without the law, the law, and its band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tribo.diagnostics.effect_sizes import percent
from tribo.diagnostics.model import effect_of
from tribo.diagnostics.terms import in_words
from tribo.figures import style
from tribo.lawsearch.grammar import UNITS, WrittenLaw, column_values
from tribo.records import REGIMES

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis
    from tribo.lawsearch.model_choice import FoundLaw
    from tribo.lawsearch.search import Discovery

COLUMNS = [
    "law_number", "formula", "regime", "sample", "covariate", "x", "x_name", "partial_percent", "law_percent",
    "low_percent", "high_percent",
]  # fmt: skip
STRETCHES = 24  # of the column, whose means are drawn


def numbers(d: Diagnosis) -> pd.DataFrame:
    """The laws of a diagnosis as :func:`numbers_of`; empty where it has none."""
    return numbers_of(d.laws) if d.laws is not None else pd.DataFrame(columns=COLUMNS)


def numbers_of(found: Discovery) -> pd.DataFrame:
    """One row per law, regime and test that the law acts on, in percent of T.

    ``partial_percent`` is what the model without the law leaves of a test, ``law_percent`` the law with its 90 % band,
    both about the mean of the law over these tests. ``x`` is the column of the law, or the product of
    its two shapes; ``x_name`` the name in a column of names.
    """
    parts = [_of_law(number, law) for number, law in enumerate(found.laws, start=1)]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=COLUMNS)


def _of_law(number: int, found: FoundLaw) -> pd.DataFrame:
    s, law = found.model.setup, found.law
    c = s.observations.conditions
    left = found.model.residual - s.random_effects.on_tests(found.model.effects)
    change = effect_of(s, found.model.law, found.model.acting[-1], found.model.values[-1])
    half = 0.5 * (found.band.high - found.band.low)
    x, names = _abscissa(found)
    acts = law.weight(c) != 0
    parts = []
    for k in (k for k, regime in enumerate(REGIMES) if law.regime in (regime, "both")):
        course = change[acts, k] - change[acts, k].mean()
        part = {
            "law_number": number, "formula": law.formula(), "regime": REGIMES[k], "sample": c.sample[acts],
            "covariate": _label(law), "x": x[acts], "x_name": names[acts],
            "partial_percent": percent(left[acts, k] + course), "law_percent": percent(course),
            "low_percent": percent(course - half[acts, k]), "high_percent": percent(course + half[acts, k]),
        }  # fmt: skip
        parts.append(pd.DataFrame(part))
    return pd.concat(parts, ignore_index=True)[COLUMNS]


def _abscissa(found: FoundLaw) -> tuple[np.ndarray, np.ndarray]:
    """Numbers to draw a law over, (n,), and their names where the column holds names."""
    law, c = found.law, found.model.setup.observations.conditions
    nameless = np.full(len(c.sample), "")
    if len(law.shapes) > 1:
        return law.course(c)[:, 0], nameless
    if law.shapes[0].kind == "level":
        names = c.columns[law.columns[0]]
        return np.unique(names, return_inverse=True)[1].astype(float), names
    return column_values(c, law.columns[0]), nameless


def _label(law: WrittenLaw) -> str:
    if len(law.shapes) > 1:
        return f"{' × '.join(map(_name, law.columns))} (1: both at their highest)"
    unit = UNITS.get(law.columns[0], "")
    return _name(law.columns[0]) + (f" ({unit})" if unit else "")


def _name(column: str) -> str:
    return in_words(column).removeprefix("the ").capitalize() if in_words(column) != column else column


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """One panel per law and regime: tests, means over stretches of the column, the law and its band."""
    panels = list(numbers.groupby(["law_number", "regime"], sort=False))
    figure, axes = style.panel_grid(len(panels), 62, columns=min(len(panels), 2))
    for ax, ((number, regime), part) in zip(axes, panels, strict=True):
        _draw_panel(ax, part)
        style.panel_title(ax, f"Law {number}", f"{regime} friction")
        ax.set_ylabel("change of T (%)")
        ax.set_xlabel(str(part["covariate"].iloc[0]))
    handles = [
        Line2D([], [], ls="", marker=".", color="0.6", label="tests"),
        Line2D([], [], ls="", marker="o", color=style.BLACK, ms=3.2, label="means with 2 SE"),
        Line2D([], [], color=style.VERMILLION, lw=1.2, label="law"),
        Patch(color=style.VERMILLION, alpha=0.25, lw=0, label="90 % band"),
    ]
    style.legend_below(figure, handles)
    return figure


def _draw_panel(ax: Axes, part: pd.DataFrame) -> None:
    part = part.dropna(subset=["x"]).sort_values("x")
    ax.axhline(0, color="0.4", lw=0.8)
    ax.plot(part["x"], part["partial_percent"], ".", color="0.6", ms=2.0, zorder=1)
    means = part.groupby(_stretches(part["x"].to_numpy()))[["x", "partial_percent"]].agg(["mean", "std", "count"])
    error = 2.0 * means["partial_percent", "std"] / np.sqrt(means["partial_percent", "count"])
    ax.errorbar(
        means["x", "mean"], means["partial_percent", "mean"], error, fmt="o", color=style.BLACK, ms=3.2, elinewidth=0.8,
        zorder=3,
    )  # fmt: skip
    law = part.groupby("x")[["law_percent", "low_percent", "high_percent"]].mean()
    ax.fill_between(law.index, law["low_percent"], law["high_percent"], color=style.VERMILLION, alpha=0.25, lw=0)
    ax.plot(law.index, law["law_percent"], color=style.VERMILLION, lw=1.2, zorder=2)
    if (part["x_name"] != "").any():
        named = part.groupby("x")["x_name"].first()
        ax.set_xticks(list(named.index), list(named))


def _stretches(x: np.ndarray) -> np.ndarray:
    """The stretch of every value: each distinct value, or stretches with alike many tests."""
    if len(np.unique(x)) <= STRETCHES:
        return np.unique(x, return_inverse=True)[1]
    return np.searchsorted(np.quantile(x, np.arange(1, STRETCHES) / STRETCHES), x)
