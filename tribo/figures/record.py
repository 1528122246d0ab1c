"""The record of a figure: its numbers and how they are drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from tribo.display import displayed
from tribo.records import Study

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from tribo.diagnostics import Diagnosis

Of = TypeVar("Of")


@displayed()
@dataclass(frozen=True)
class FigureOf(Generic[Of]):
    """One figure of a record of type ``Of``.

    ``numbers(record)`` gives exactly what is plotted, one row per point, units in the column names; an empty
    frame where the record lacks what the figure needs. ``draw(numbers)`` has no other input, so a table
    written from the numbers holds exactly what the figure shows.
    """

    name: str
    title: str
    caption: str
    numbers: Callable[[Of], pd.DataFrame]
    draw: Callable[[pd.DataFrame], Figure]


StudyFigure = FigureOf[Study]
if TYPE_CHECKING:
    DiagnosisFigure = FigureOf[Diagnosis]
