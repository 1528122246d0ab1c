"""Causes whose form is wrong: a law of the same column explains the campaign better than the mechanism does."""

from __future__ import annotations

import numpy as np

from tribo.diagnose.discovery.grammar import groups_of, shapes_of
from tribo.diagnose.discovery.scoring import courses_of
from tribo.diagnose.discovery.settling import CLOSE, Searched, best_form
from tribo.diagnose.search.weighing import refitted
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting, effect_of

MARGIN = 2.0 * CLOSE  # log likelihood by which a law has to be better than a mechanism of the library: odds of 400 to 1
SAME = {"speed_mm_s": "speed_m_s", "started_at": "elapsed_s"}  # columns of mechanisms by their names in the grammar


def without_wrong_forms(model: ModelFit) -> tuple[ModelFit, dict[str, float]]:
    """The model without the mechanisms that lose against a law of their own column, and by how much each loses."""
    lost: dict[str, float] = {}
    for acting in model.acting:
        by = _lost_by(model, acting)
        if by > MARGIN:
            lost[acting.name] = by
            model = refitted(model, [a for a in model.acting if a != acting])
    return model, lost


def _lost_by(model: ModelFit, acting: Acting) -> float:
    """Log likelihood by which the best law of the column of a mechanism is better; negative where it is not.

    Both are judged at the noise that the law leaves. The law pays for its choices, the mechanism does not.
    """
    named = acting.mechanism.column(acting.choice)
    column = SAME.get(named, named)
    c = model.setup.observations.conditions
    shapes = [(shape, cost) for shape, cost in shapes_of(c) if any(s.column == column for s in shape)]
    if not shapes:
        return -np.inf
    index = model.acting.index(acting)
    change = effect_of(model.setup, model.law, acting, model.values[index])
    without = refitted(model, [a for a in model.acting if a != acting])
    form, state = best_form(without, Searched(courses_of(shapes, c), tuple(groups_of(c))))
    own, pull, _ = state.projected.products(np.ones((len(change), 1)), change)
    return form.evidence - float(0.5 * pull[0, 0] ** 2 / own[0])
