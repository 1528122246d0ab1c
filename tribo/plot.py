"""Every figure of a report by name: a study, a diagnosis, a pull or a run in, a matplotlib Figure out.

Each figure is as in the report, also in a notebook; ``figure.savefig("name.png")`` writes it. The numbers of a figure
are ``tribo.figures.FIGURES[NAME].numbers(study)``, and beside each figure of a report as a .csv file. A figure for
which a study has no numbers, for example a comparison without a model, is a :class:`tribo.errors.TriboError`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tribo.errors import Problem, TriboError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tribo.berardo2019.table_diagnosis import PublishedDiagnosis
    from tribo.diagnostics import Diagnosis
    from tribo.records import Ingested, Run, Study

__all__ = [
    "agreement", "dependence", "evidence", "extended", "finding", "forces", "law", "laws_against_area", "misfit",
    "oscillations", "power", "published", "published_readings", "pull", "pulls", "ratio_against_pressure", "records",
    "residuals", "restarts", "run", "simulated_pulls", "sliding_force", "static_force",
]  # fmt: skip


def __dir__() -> list[str]:
    return sorted(__all__)


def _drawn(name: str, record: Any) -> Figure:
    from tribo.figures import catalogue

    tables = (
        catalogue.FIGURES, catalogue.FRICTION_FIGURES, catalogue.DIAGNOSIS_FIGURES, catalogue.PUBLISHED_FIGURES,
    )  # fmt: skip
    figure: Any = next(table[name] for table in tables if name in table)
    numbers = figure.numbers(record)
    if numbers.empty:
        raise TriboError(Problem("nothing_to_draw", f"there are no numbers for the figure “{figure.title}”"))
    return figure.draw(numbers)


def agreement(study: Study) -> Figure:
    """Ratio of measured to simulated friction force at each load, for every sample."""
    return _drawn("agreement", study)


def pulls(study: Study) -> Figure:
    """One pull of each sample at a middle load, with its static peak and sliding window."""
    return _drawn("fig3", study)


def ratio_against_pressure(study: Study) -> Figure:
    """T/N against nominal pressure, with the fitted curves."""
    return _drawn("fig4", study)


def simulated_pulls(study: Study) -> Figure:
    """Pattern, model and simulated T/N against time, one run per sample."""
    return _drawn("fig5", study)


def static_force(study: Study) -> Figure:
    """Static friction force of every pull against load, with fit and model."""
    return _drawn("fig6", study)


def sliding_force(study: Study) -> Figure:
    """Mean sliding friction force of every pull against load, with fit and model."""
    return _drawn("fig7", study)


def laws_against_area(study: Study) -> Figure:
    """mu and tau0 of every sample against its contact area fraction."""
    return _drawn("fig8", study)


def dependence(study: Study) -> Figure:
    """T/N of every test against each recorded variable that varies."""
    return _drawn("dependence", study)


def forces(study: Study) -> Figure:
    """Friction force of every test against the load, with the law that the data choose."""
    return _drawn("forces", study)


def records(study: Study) -> Figure:
    """T/N along each record."""
    return _drawn("records", study)


def oscillations(study: Study) -> Figure:
    """Force lost in a slip, and period, of every test that oscillates."""
    return _drawn("oscillations", study)


def restarts(study: Study) -> Figure:
    """Static friction after each stop of the drive against the time of the hold."""
    return _drawn("restarts", study)


def misfit(diagnosis: Diagnosis) -> Figure:
    """Where the calibrated model fails, by sample and recorded variable."""
    return _drawn("misfit", diagnosis)


def finding(diagnosis: Diagnosis) -> Figure:
    """Measured over modelled friction against what the finding follows: the picture of the card."""
    return _drawn("finding", diagnosis)


def law(diagnosis: Diagnosis) -> Figure:
    """What a law that was found explains, test by test, with its band."""
    return _drawn("law", diagnosis)


def residuals(results: Diagnosis | Study) -> Figure:
    """Of a diagnosis, the strongest deviations against the variable that each follows; of a study, those of its fits.

    The residuals of a study are 100 (measured / fitted - 1) of every test against its load.
    """
    from tribo.records import Study

    if not isinstance(results, Study):
        return _drawn("residuals", results)
    from tribo.figures.load_and_area import draw_residuals_of_fits, residuals_of_fits

    return draw_residuals_of_fits(residuals_of_fits(results))


def extended(diagnosis: Diagnosis) -> Figure:
    """Residuals before and after the model is extended by the named mechanism."""
    return _drawn("extended", diagnosis)


def evidence(diagnosis: Diagnosis) -> Figure:
    """Increase in log likelihood by each mechanism."""
    return _drawn("evidence", diagnosis)


def power(diagnosis: Diagnosis) -> Figure:
    """The effects that this campaign could have detected."""
    return _drawn("power", diagnosis)


def published(diagnosis: PublishedDiagnosis) -> Figure:
    """A published table compared with the model of the paper."""
    return _drawn("published", diagnosis)


def published_readings(diagnosis: PublishedDiagnosis) -> Figure:
    """Evidence for each mechanism under each interpretation of the table."""
    return _drawn("published-readings", diagnosis)


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
