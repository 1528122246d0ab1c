"""Every figure of a study by name. A new figure is its module and a line here."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tribo.comparison import agreement, friction_tables
from tribo.figures import (
    area,
    detectable,
    evidence,
    extended,
    finding,
    force,
    friction_panels,
    law,
    measured_over_simulated,
    misfit,
    normalised_pulls,
    published_table,
    ratio,
    residuals,
    simulated_runs,
)
from tribo.figures.record import FigureOf, StudyFigure

if TYPE_CHECKING:
    from tribo.berardo2019.table_diagnosis import PublishedDiagnosis
    from tribo.figures.record import DiagnosisFigure

FIGURES: dict[str, StudyFigure] = {
    figure.name: figure
    for figure in (
        StudyFigure(
            "agreement",
            "Ratio of measured to simulated friction force",
            "Ratio of the measured to the simulated friction force at each normal load, with its 95 % "
            "interval. At a ratio of 1 the model is exact; below 1 it predicts too much friction. The model "
            "was calibrated on the flat sample, so agreement there does not test the model.",
            agreement.ratios,
            measured_over_simulated.draw,
        ),
        StudyFigure(
            "fig3",
            "Example pulls",
            "Friction force against time in one pull of each sample at a middle load, after subtraction of the "
            "zero, divided by the static peak. The static peak and the window over which the sliding force "
            "is averaged are marked.",
            normalised_pulls.numbers,
            normalised_pulls.draw,
        ),
        StudyFigure(
            "fig4",
            "T/N against pressure",
            "Mean of T/N over all pulls at each nominal pressure. Error bars: standard deviation of "
            "the mean over these pulls, as in the paper. Unlike the uncertainties of the fits, they do not "
            "account for differences between specimens. Curves: T/N = μ + τ₀/p with the fitted μ and τ₀.",
            ratio.numbers,
            ratio.draw,
        ),
        StudyFigure(
            "fig5",
            "Model, patterns and simulated friction",
            "Top: the spring-block model. Blocks on a square lattice are joined by springs to their eight neighbours "
            "and by shear springs to a slider that moves at a constant speed. Middle: the simulated part of each "
            "sample at scale, cavities grey, with the direction of the pull. Bottom: friction force divided by load in "
            "one run for each sample. Filled marker: static peak. Dotted line: mean over the sliding window.",
            simulated_runs.numbers,
            simulated_runs.draw,
        ),
        StudyFigure(
            "fig6",
            "Static friction force against load",
            "Static friction force of every pull, the fitted line T = μN + τ₀A with its 95 % band, the "
            "spring-block model calibrated on the flat sample alone, and the force expected if friction were "
            "proportional to the contact area fraction AF.",
            force.numbers("static"),
            force.draw,
        ),
        StudyFigure(
            "fig7",
            "Sliding friction force against load",
            "As in the previous figure, for the mean sliding friction force.",
            force.numbers("sliding"),
            force.draw,
        ),
        StudyFigure(
            "fig8",
            "μ and τ₀ against contact area fraction",
            "Fitted μ and τ₀ with their combined standard uncertainties, and a straight line in AF through the "
            "measured values (equal weights). Points that would overlap are shifted slightly. Simulated points are "
            "plotted at the area fraction of the model lattice. μ and τ₀ of a fit are correlated: judge the "
            "model by the force at a load, not by μ or τ₀ alone.",
            area.numbers,
            area.draw,
        ),
    )
}
"""The figures of a study by name."""

FRICTION_FIGURES: dict[str, StudyFigure] = {
    figure.name: figure
    for figure in (
        StudyFigure(
            "forces",
            "Friction force against load",
            "Friction force of every test and the law chosen for each sample by loads left out of the fit. Both axes "
            "are logarithmic where the forces span more than a decade: a power law is then a straight line.",
            friction_tables.law_points,
            friction_panels.draw_forces,
        ),
        StudyFigure(
            "dependence",
            "T/N against recorded variables",
            "T/N of every test against each recorded variable that varies, with the standard uncertainty of the "
            "reading. Variables that vary together cannot be separated by looking at one panel.",
            friction_tables.dependence_points,
            friction_panels.draw_dependence,
        ),
        StudyFigure(
            "records",
            "T/N along each record",
            "T/N against the distance slid, or against time where no speed is known: means of equal parts of each "
            "record, zero subtracted. Running-in shows as a change along the record.",
            friction_tables.within_records,
            friction_panels.draw_records,
        ),
        StudyFigure(
            "oscillations",
            "Stick-slip and oscillation",
            "Force lost in a slip over the normal load, and period, of every test whose sliding force oscillates: "
            "medians over its cycles with standard uncertainties.",
            friction_tables.oscillation_points,
            friction_panels.draw_oscillations,
        ),
        StudyFigure(
            "restarts",
            "Static friction against the time of the hold",
            "Peak after each stop of the drive over the normal load, against the time the drive stood still.",
            friction_tables.restart_points,
            friction_panels.draw_restarts,
        ),
    )
}
"""Figures of the measured friction by itself, by name."""

DIAGNOSIS_FIGURES: dict[str, DiagnosisFigure] = {
    figure.name: figure
    for figure in (
        FigureOf(
            "finding",
            "What was found",
            "100 (measured / model − 1) against what it follows, for the model calibrated on the flat sample. Points "
            "with bars: means with twice their standard error. Band: range of 95 % of such means if the model were "
            "right. Thick line, if a cause is named: what it adds. Small points, if shown: tests.",
            finding.numbers,
            finding.draw,
        ),
        FigureOf(
            "misfit",
            "Where the calibrated model fails",
            "Change of measured over modelled friction, in percent, from the low to the high end of each recorded "
            "variable (5 to 95 % of its range), for each sample. Column “mean”: mean over the sample of 100 (measured "
            "/ model − 1). Column “bend with load”: height of the ends of the load range above its middle. Strong "
            "colours and asterisks (** p < 0.01, * p < 0.05) mark statistically significant deviations. The p values "
            "are adjusted for all comparisons: each is compared with the strongest deviation in simulated campaigns "
            "of the calibrated model. Pale cells are not significant. Last rows: change of the zero of the force (in "
            "percent of the median sliding force), of the slope of the rise and of the stick-slip amplitude; their p "
            "values are those of rank correlations.",
            misfit.numbers,
            misfit.draw,
        ),
        FigureOf(
            "residuals",
            "The strongest deviations",
            "100 (measured / model − 1) against the recorded variable with which it varies most strongly; if no "
            "deviation is significant, against the three variables that come closest. Small points: tests; points with "
            "bars: means with twice their standard error. Band: range of 95 % of such means if the model were right, "
            "given the scatter of repeats and specimens and the error of the model. Thick line: contribution of the "
            "identified mechanism.",
            residuals.numbers,
            residuals.draw,
        ),
        FigureOf(
            "extended",
            "Model before and after its extension",
            "Mean of 100 (measured / model − 1) at each load, for the model "
            "calibrated on the flat sample and for the model extended by the identified mechanism, both fitted in the "
            "same way; where available, also for a spring-block simulation that includes the mechanism. Above each "
            "panel: root mean square over all its tests. The verdict states the improvement on tests not used in the "
            "fit.",
            extended.numbers,
            extended.draw,
        ),
        FigureOf(
            "law",
            "Laws that the remaining misfit follows",
            "Change of T over the column of each law that was found. Small points: what the model without the law "
            "leaves of each test; points with bars: means over stretches of the column with twice their standard "
            "error. Line: the law with its 90 % band, which is averaged over all forms in proportion to their "
            "evidence. Both are about the mean of the law. Of a product of two columns, the horizontal axis is the "
            "product of its two shapes.",
            law.numbers,
            law.draw,
        ),
        FigureOf(
            "evidence",
            "Evidence for each mechanism",
            "Increase in log likelihood over the calibrated model, minus a penalty for the free parameters of each "
            "mechanism, with its fitted size. Mechanisms that the design cannot distinguish from the best one are "
            "marked. Italics: reason why a mechanism was not evaluated. If two causes were found, the values are those "
            "of the first step.",
            evidence.numbers,
            evidence.draw,
        ),
        FigureOf(
            "power",
            "Effects this campaign could have detected",
            "Left: the strongest deviation in this campaign, and in simulated campaigns of the calibrated model "
            "with the same design and noise. Right: change of T over the whole range of a variable, after the part "
            "that calibration on the flat sample absorbs, that would be detected in 10 %, 50 % and 90 % of such "
            "campaigns (bar: 10 to 90 %, dot: 50 %).",
            detectable.numbers,
            detectable.draw,
        ),
    )
}
"""The figures of a diagnosis by name."""

PUBLISHED_FIGURES: dict[str, FigureOf[PublishedDiagnosis]] = {
    figure.name: figure
    for figure in (
        FigureOf(
            "published",
            "Published table compared with the model of the paper",
            "Ratio of measured to simulated friction force against pressure, from mu and tau0 in Table 2 of Berardo "
            "et al. (2019). Band: 90 % interval of the measurement, with the correlation of mu and tau0 that results "
            "from loads spread evenly over 3 to 25 kPa. Dotted: the same interval for independent mu and tau0. Dashed: "
            "the same model with the law of the flat sample fitted to the whole table. Red: this model extended by the "
            "best mechanism.",
            published_table.ratio_numbers,
            published_table.draw_ratio,
        ),
        FigureOf(
            "published-readings",
            "Evidence for each mechanism under each interpretation of the table",
            "Increase in log likelihood over the calibrated model for each mechanism. Left of the line: the three "
            "explanations suggested by the authors. Each row is one interpretation of the table: the simulation used "
            "as the model, the correlation of mu and tau0, whether the printed standard deviations are those of a "
            "mean or of three specimens, and the outcome.",
            published_table.reading_numbers,
            published_table.draw_readings,
        ),
    )
}
"""The figures of the diagnosis of a published table by name."""

TITLES: dict[str, str] = {
    name: figure.title for table in (FIGURES, FRICTION_FIGURES, DIAGNOSIS_FIGURES) for name, figure in table.items()
}
"""The title of every figure of a report, by name."""
