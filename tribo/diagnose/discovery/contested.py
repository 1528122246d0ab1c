"""Causes and laws of the same column: which of them explains a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from tribo.diagnose.discovery.grammar import groups_of, shapes_of
from tribo.diagnose.discovery.scoring import courses_of
from tribo.diagnose.discovery.settling import CLOSE, Searched, best_form
from tribo.diagnose.discovery.written_law import Shape, WrittenLaw
from tribo.diagnose.search.weighing import refitted
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting, effect_of
from tribo.mechanisms.record import Conditions

# Log likelihood by which a law has to be better than mechanisms of the library: odds of 400 to 1. With 3, one of seven
# effects of the library (benchmarks/blind_cases.py, seed 7000, three times the half-found size) lost; none with 6.
MARGIN = 2.0 * CLOSE
# A covariate is a law of the grammar itself, on all samples and in both regimes. It stays where another law of its own
# column cannot be told from it; between its column and another one of the series, the likelier counts.
MARGIN_OF_COVARIATE = {True: CLOSE, False: 0.0}
SAME = {"speed_mm_s": "speed_m_s", "started_at": "elapsed_s"}  # columns of mechanisms by their names in the grammar
SERIES = {"run_order", "specimen_run", "elapsed_s", "date"}  # columns that follow each other through a series


def without_wrong_forms(model: ModelFit) -> tuple[ModelFit, dict[str, float]]:
    """The model without the mechanisms that lose against a law of their own column, or two of them against a product
    of their columns, and by how much each loses."""
    lost: dict[str, float] = {}
    for together in (*((a,) for a in model.acting), *combinations(model.acting, 2)):
        if not all(a in model.acting for a in together):
            continue
        by, own_column = _lost_by(model, together)
        if by > (MARGIN_OF_COVARIATE[own_column] if all(a.mechanism.any_column for a in together) else MARGIN):
            lost |= {a.name: by for a in together}
            model = refitted(model, [a for a in model.acting if a not in together])
    return model, lost


def _lost_by(model: ModelFit, together: Sequence[Acting]) -> tuple[float, bool]:
    """Log likelihood by which the best law of the columns of one or two mechanisms is better, negative where none is,
    and whether that law follows their own columns.

    Both are judged at the noise that the law leaves. The law pays for its choices among those of these columns, the
    mechanisms do not.
    """
    columns = set().union(*(_followed(a) for a in together))
    c = model.setup.observations.conditions
    shapes = _of_columns(c, columns) if len(columns) == len(together) else []
    if not shapes:
        return -np.inf, True
    changes = [effect_of(model.setup, model.law, a, model.values[model.acting.index(a)]) for a in together]
    without = refitted(model, [a for a in model.acting if a not in together])
    form, state = best_form(without, Searched(courses_of(shapes, c), tuple(groups_of(c))))
    by = form.evidence - state.projected.joint_gain(np.stack(changes, axis=2))
    return by, set(form.best.columns) <= columns


def _followed(a: Acting) -> set[str]:
    """What a mechanism follows, by its name in the grammar."""
    name = a.mechanism.column(a.choice)
    return {SAME.get(name, name)}


def without_rivals(model: ModelFit, law: WrittenLaw) -> tuple[ModelFit, dict[str, float]]:
    """The model without the mechanisms of the columns of a law of another campaign, and the log likelihood by which the
    law in their place is better.

    They stay where they are clearly better: what this campaign cannot tell apart, the other one has told.
    """
    columns = set(law.columns) | (SERIES if set(law.columns) & SERIES else set())
    rivals = [a for a in model.acting if _followed(a) & columns]
    if not rivals:
        return model, {}
    without = refitted(model, [a for a in model.acting if a not in rivals])
    instead = refitted(without, [*without.acting, Acting(law.mechanism())])
    by = instead.score - model.score
    return (without, {a.name: by for a in rivals}) if by > -CLOSE else (model, {})


def _of_columns(c: Conditions, columns: set[str]) -> list[tuple[tuple[Shape, ...], float]]:
    """The shapes of one column and its products, or the products of two; a product costs what choosing among these is
    worth."""
    alike = SERIES if len(columns) == 1 and columns <= SERIES else columns
    every = [(shape, cost) for shape, cost in shapes_of(c) if _follows(shape, columns, alike)]
    products = sum(len(shape) > 1 for shape, _ in every)
    return [(shape, float(np.log(products)) if len(shape) > 1 else cost) for shape, cost in every]


def _follows(shape: tuple[Shape, ...], columns: set[str], alike: set[str]) -> bool:
    """Whether a shape follows all these columns, or alone one that is alike."""
    own = {s.column for s in shape}
    return columns <= own or (len(own) == 1 and own <= alike)
