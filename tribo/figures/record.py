"""What a figure is: its numbers, and how they are drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tribo.records import Study

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class StudyFigure:
    """One figure of a study.

    ``numbers(study)`` gives exactly what is plotted, one row a point, units in the column names; an empty
    frame where the study lacks what the figure needs. ``draw(numbers)`` knows nothing else, so a table
    written from the numbers is by construction what the figure shows.
    """

    name: str
    title: str
    caption: str
    numbers: Callable[[Study], pd.DataFrame]
    draw: Callable[[pd.DataFrame], Figure]
