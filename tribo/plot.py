"""Every figure of a report by name: a study, a diagnosis, a pull or a run in, a matplotlib Figure out.

Each figure is as in the report, also in a notebook; ``width_mm=90`` draws it for one column of a journal.
``figure.savefig("name.png")`` writes it. The numbers of a figure
are ``tribo.figures.FIGURES[NAME].numbers(study)``, and beside each figure of a report as a .csv file. A figure for
which a study has no numbers, for example a comparison without a model, is a :class:`tribo.errors.TriboError`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from tribo.errors import Problem, TriboError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tribo.berardo2019.table_diagnosis import PublishedDiagnosis
    from tribo.diagnostics import Diagnosis
    from tribo.records import Ingested, Run, Study

__all__ = [
    "agreement", "cycles", "dependence", "evidence", "extended", "finding", "forces", "law", "laws_against_area",
    "levels", "misfit", "oscillations", "power", "published", "published_readings", "pull", "pulls",
    "ratio_against_pressure", "records", "residuals", "restarts", "run", "running_in", "simulated_pulls",
    "sliding_force", "static_force", "traces",
]  # fmt: skip


PAGE_MM = 190.0  # as in the report


def __dir__() -> list[str]:
    return sorted(__all__)


def _drawn(name: str, record: Any, width_mm: float) -> Figure:
    from tribo.figures import catalogue, style

    tables = (
        catalogue.FIGURES, catalogue.FRICTION_FIGURES, catalogue.DIAGNOSIS_FIGURES, catalogue.PUBLISHED_FIGURES,
    )  # fmt: skip
    figure: Any = next(table[name] for table in tables if name in table)
    numbers = figure.numbers(record)
    if numbers.empty:
        raise TriboError(Problem("nothing_to_draw", f"there are no numbers for the figure “{figure.title}”"))
    with style.page(width_mm):
        return figure.draw(numbers)


def _of_study(name: str, shows: str, figure: str = "") -> Callable[..., Figure]:
    """The function that draws one figure of a study; ``figure`` where a report calls it otherwise."""

    def draw(study: Study, width_mm: float = PAGE_MM) -> Figure:
        return _drawn(figure or name, study, width_mm)

    draw.__name__ = draw.__qualname__ = name
    draw.__doc__ = shows
    return draw


def _of_diagnosis(name: str, shows: str, figure: str = "") -> Callable[..., Figure]:
    """The function that draws one figure of a diagnosis; ``figure`` where a report calls it otherwise."""

    def draw(diagnosis: Diagnosis | PublishedDiagnosis, width_mm: float = PAGE_MM) -> Figure:
        return _drawn(figure or name, diagnosis, width_mm)

    draw.__name__ = draw.__qualname__ = name
    draw.__doc__ = shows
    return draw


agreement = _of_study("agreement", "Ratio of measured to simulated friction force at each load, for every sample.")
pulls = _of_study("pulls", "One pull of each sample at a middle load, with its static peak and sliding window.", "fig3")
ratio_against_pressure = _of_study(
    "ratio_against_pressure", "T/N against nominal pressure, with the fitted curves.", "fig4"
)
simulated_pulls = _of_study(
    "simulated_pulls", "Pattern, model and simulated T/N against time, one run per sample.", "fig5"
)
traces = _of_study(
    "traces", "Measured trace of a pull of each sample over that of the model, as its machine would record it."
)
static_force = _of_study(
    "static_force", "Static friction force of every pull against load, with fit and model.", "fig6"
)
sliding_force = _of_study(
    "sliding_force", "Mean sliding friction force of every pull against load, with fit and model.", "fig7"
)
laws_against_area = _of_study(
    "laws_against_area", "mu and tau0 of every sample against its contact area fraction.", "fig8"
)
dependence = _of_study("dependence", "T/N of every test against each recorded variable that varies.")
forces = _of_study("forces", "Friction force of every test against the load, with the law that the data choose.")
records = _of_study("records", "T/N along each record.")
oscillations = _of_study("oscillations", "Force lost in a slip, and period, of every test that oscillates.")
levels = _of_study("levels", "Mean T/N of the levels of each ladder against Hersey number, speed or load.")
cycles = _of_study("cycles", "T/N and friction work of each cycle of strokes.")
running_in = _of_study("running_in", "T/N along records that slide on and on, with the distance of running-in.")
restarts = _of_study("restarts", "Static friction after each stop of the drive against the time of the hold.")
misfit = _of_diagnosis("misfit", "Where the calibrated model fails, by sample and recorded variable.")
finding = _of_diagnosis(
    "finding", "Measured over modelled friction against what the finding follows: the picture of the card."
)
law = _of_diagnosis("law", "What a law that was found explains, test by test, with its band.")
extended = _of_diagnosis("extended", "Residuals before and after the model is extended by the named mechanism.")
evidence = _of_diagnosis("evidence", "Increase in log likelihood by each mechanism.")
power = _of_diagnosis("power", "The effects that this campaign could have detected.")
published = _of_diagnosis("published", "A published table compared with the model of the paper.")
published_readings = _of_diagnosis(
    "published_readings", "Evidence for each mechanism under each interpretation of the table.", "published-readings"
)


def residuals(results: Diagnosis | Study, width_mm: float = PAGE_MM) -> Figure:
    """Of a diagnosis, the strongest deviations against the variable that each follows; of a study, those of its fits.

    The residuals of a study are 100 (measured / fitted - 1) of every test against its load.
    """
    from tribo.records import Study

    if not isinstance(results, Study):
        return _drawn("residuals", results, width_mm)
    from tribo.figures import style
    from tribo.figures.load_and_area import draw_residuals_of_fits, residuals_of_fits

    with style.page(width_mm):
        return draw_residuals_of_fits(residuals_of_fits(results))


def pull(ingested: Ingested, test_id: str) -> Figure:
    """One pull at full size: force (N) against time (s), zero subtracted, with static peak and sliding window.

    Raises
    ------
    TriboError
        The campaign has no such pull, or no trace of it.
    """
    from tribo.figures.one_pull import draw_pull, pull_numbers

    if test_id not in ingested.pulls or test_id not in ingested.traces:
        raise TriboError(Problem("unknown_test", "no pull with a trace has this id", found=test_id))
    return draw_pull(pull_numbers(ingested.traces[test_id], ingested.pulls[test_id]))


def run(run: Run) -> Figure:
    """One run of the spring-block model: T/N against time (ms), with its peak and sliding window."""
    from tribo.figures.simulated import draw_runs, run_numbers

    return draw_runs(run_numbers(run))
