"""Every figure of a study by name. A new figure is its module and a line here."""

from __future__ import annotations

from tribo.figures import agreement, area, force, pulls, ratio, runs
from tribo.figures.record import StudyFigure

FIGURES: dict[str, StudyFigure] = {
    figure.name: figure
    for figure in (
        StudyFigure(
            "agreement",
            "Friction force, measured over simulated",
            "Ratio of the measured to the simulated friction force at each normal load, with its 95 % "
            "interval. On the line at 1 the model is right; below it the model predicts too much "
            "friction. The flat sample was used to calibrate the model, so its agreement is no test.",
            agreement.numbers,
            agreement.draw,
        ),
        StudyFigure(
            "fig3",
            "Example pulls",
            "One pull of each sample at a middle load, with its zero subtracted and divided by its own "
            "static peak. Marked are the static peak and the window over which the sliding force is "
            "averaged.",
            pulls.numbers,
            pulls.draw,
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
            runs.numbers,
            runs.draw,
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
