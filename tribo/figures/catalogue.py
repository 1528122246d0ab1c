"""Every figure of a study by name. A new figure is its module and a line here."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tribo.comparison import agreement
from tribo.figures import (
    area,
    detectable,
    evidence,
    extended,
    force,
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
    from tribo.diagnose.from_table.table_diagnosis import PublishedDiagnosis
    from tribo.figures.record import DiagnosisFigure

FIGURES: dict[str, StudyFigure] = {
    figure.name: figure
    for figure in (
        StudyFigure(
            "agreement",
            "Friction force, measured over simulated",
            "Ratio of the measured to the simulated friction force at each normal load, with its 95 % "
            "interval. On the line at 1 the model is right; below it the model predicts too much "
            "friction. The flat sample was used to calibrate the model, so its agreement is no test.",
            agreement.ratios,
            measured_over_simulated.draw,
        ),
        StudyFigure(
            "fig3",
            "Example pulls",
            "One pull of each sample at a middle load, with its zero subtracted and divided by its own "
            "static peak. Marked are the static peak and the window over which the sliding force is "
            "averaged.",
            normalised_pulls.numbers,
            normalised_pulls.draw,
        ),
        StudyFigure(
            "fig4",
            "Friction over load against pressure",
            "Mean of T/N over all pulls at each nominal pressure. Error bars are the standard deviation "
            "of the mean over these pulls, as the paper defines them; they take no account of which "
            "specimen a pull belongs to, the uncertainties of the fits do. Curves are T/N = μ + τ₀/p "
            "with the fitted μ and τ₀.",
            ratio.numbers,
            ratio.draw,
        ),
        StudyFigure(
            "fig5",
            "The model against time",
            "Friction force over normal load in one run of the spring-block model for each sample. The "
            "filled mark is the static peak, the dotted line the mean over the sliding window.",
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
            "As the figure before, for the mean sliding friction force.",
            force.numbers("sliding"),
            force.draw,
        ),
        StudyFigure(
            "fig8",
            "μ and τ₀ against contact area fraction",
            "Fitted μ and τ₀ with their standard uncertainties, and a straight line in AF through the "
            "measured values, all of the same weight. Points that would hide each other are moved aside "
            "a little; the simulated ones stand at the area fraction of the model's own lattice. μ and "
            "τ₀ of one fit are not independent: judge the model by the force at a load, not by these one "
            "by one.",
            area.numbers,
            area.draw,
        ),
    )
}

DIAGNOSIS_FIGURES: dict[str, DiagnosisFigure] = {
    figure.name: figure
    for figure in (
        FigureOf(
            "misfit",
            "Where the calibrated model fails",
            "Change of measured over modelled friction from the low to the high end of each recorded column, in "
            "percent, sample by sample; in the first column the mean of a sample, under bend how far the ends of the "
            "load range lie above its middle. Strong colours and stars (** p < 0.01, * p < 0.05) mark what chance does "
            "not explain: the p value counts every look, by setting it against the strongest look in simulated "
            "campaigns of the calibrated model. Faint cells are within chance. The last rows are rank correlations "
            "within samples and loads, adjusted for their number.",
            misfit.numbers,
            misfit.draw,
        ),
        FigureOf(
            "residuals",
            "The strongest looks",
            "Measured over modelled friction (100 ln of the ratio) against the column it follows most strongly, or, "
            "where nothing is beyond chance, against the three that come closest. Grey: where 95 % of single tests lie "
            "by repeats, specimens and the model's own error. The line is what the named mechanism adds.",
            residuals.numbers,
            residuals.draw,
        ),
        FigureOf(
            "extended",
            "Before and after the extension of the model",
            "Mean of measured over modelled friction (100 ln of the ratio) at each load under the model calibrated on "
            "the flat sample and under the model with the named mechanism, fitted with equal effort; and, where it was "
            "run, under the spring-block model itself with the mechanism in it. Above each panel the root mean square "
            "over all its tests. The gain on tests that no fit has seen is in the verdict.",
            extended.numbers,
            extended.draw,
        ),
        FigureOf(
            "evidence",
            "What speaks for each mechanism",
            "Log likelihood gained over the calibrated model, less what the freedom of each mechanism is worth, with "
            "its fitted size. Those that the design cannot tell from the best are named with it. In italics why a "
            "mechanism was not weighed. With two causes the gains are those of the first step.",
            evidence.numbers,
            evidence.draw,
        ),
        FigureOf(
            "power",
            "What this campaign could have shown",
            "Left: the strongest of all looks at this campaign, and at simulated campaigns of the calibrated model "
            "with the same design and noise. Right: the effect on T, from end to end and beyond what the flat law "
            "takes up, that would be found one, five and nine times in ten.",
            detectable.numbers,
            detectable.draw,
        ),
    )
}

PUBLISHED_FIGURES: dict[str, FigureOf[PublishedDiagnosis]] = {
    figure.name: figure
    for figure in (
        FigureOf(
            "published",
            "The published table against the model of the paper",
            "Measured over simulated friction force at a load, from mu and tau0 of Table 2 of Berardo et al. (2019). "
            "The band is the 90 % interval of the measurement with the correlation of mu and tau0 that loads spread "
            "evenly over 3 to 25 kPa would give; dotted, if the two were independent. Dashed, the same model with its "
            "flat law fitted to the whole table; red, with the best mechanism of the library on top.",
            published_table.ratio_numbers,
            published_table.draw_ratio,
        ),
        FigureOf(
            "published-readings",
            "What each reading of the table says of each mechanism",
            "Log likelihood that each mechanism earns over the calibrated model. The three guesses of the authors "
            "stand left of the line. Rows: whose simulation is the model, the correlation of mu and tau0, whether the "
            "printed standard deviations are those of a mean or of three specimens, and the outcome.",
            published_table.reading_numbers,
            published_table.draw_readings,
        ),
    )
}
