"""Every figure by name, in the order of a report. A new one: its functions and its record in a chapter, a name here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tribo.figures.evidence import EVIDENCE, POWER
from tribo.figures.extended_model import EXTENDED, LAW
from tribo.figures.load_and_area import AGREEMENT, LAWS_AGAINST_AREA, RATIO, SLIDING_FORCE, STATIC_FORCE
from tribo.figures.measured_friction import DEPENDENCE, FORCES, OSCILLATIONS, RECORDS, RESTARTS
from tribo.figures.misfit import MISFIT
from tribo.figures.one_pull import EXAMPLE_PULLS
from tribo.figures.programmes import CYCLES, LEVELS, RUNNING_IN
from tribo.figures.published_table import PUBLISHED, PUBLISHED_READINGS
from tribo.figures.residuals import FINDING, RESIDUALS
from tribo.figures.simulated import COMPARED_TRACES, SIMULATED_PULLS
from tribo.figures.style import FigureOf, StudyFigure

if TYPE_CHECKING:
    from tribo.berardo2019.table_diagnosis import PublishedDiagnosis
    from tribo.diagnostics import Diagnosis


def _by_name(*figures: FigureOf[Any]) -> dict[str, FigureOf[Any]]:
    return {figure.name: figure for figure in figures}


FIGURES: dict[str, StudyFigure] = _by_name(
    AGREEMENT, EXAMPLE_PULLS, RATIO, SIMULATED_PULLS, COMPARED_TRACES, STATIC_FORCE, SLIDING_FORCE, LAWS_AGAINST_AREA
)
"""The figures of a study by name."""

FRICTION_FIGURES: dict[str, StudyFigure] = _by_name(
    FORCES, DEPENDENCE, LEVELS, CYCLES, RUNNING_IN, RECORDS, OSCILLATIONS, RESTARTS
)
"""Figures of the measured friction by itself, by name."""

DIAGNOSIS_FIGURES: dict[str, FigureOf[Diagnosis]] = _by_name(FINDING, MISFIT, RESIDUALS, EXTENDED, LAW, EVIDENCE, POWER)
"""The figures of a diagnosis by name."""

PUBLISHED_FIGURES: dict[str, FigureOf[PublishedDiagnosis]] = _by_name(PUBLISHED, PUBLISHED_READINGS)
"""The figures of the diagnosis of a published table by name."""

TITLES: dict[str, str] = {
    name: figure.title for table in (FIGURES, FRICTION_FIGURES, DIAGNOSIS_FIGURES) for name, figure in table.items()
}
"""The title of every figure of a report, by name."""
