"""Causes and laws of the same column: which of them explains a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tribo.diagnose.discovery.grammar import groups_of, shapes_of
from tribo.diagnose.discovery.scoring import courses_of
from tribo.diagnose.discovery.settling import CLOSE, Searched, forms_in_reach
from tribo.diagnose.discovery.written_law import Shape, WrittenLaw, column_values
from tribo.diagnose.search.weighing import refitted
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting, effect_of
from tribo.mechanisms.record import Conditions

# Log likelihood by which a law has to be better than mechanisms of the library. A law of their own columns (True) says
# the same with another formula, and needs odds of 400 to 1: where the humidity acts exponentially, the best law is
# better than the straight line of the library by 0.6 to 3 in three campaigns of five, by 10 and 15 in two. A law of
# another column of the series or of a product says something else, and needs odds of 20 to 1: where velocity, ageing,
# run-in or temperature are at work, no law is better by more than 0.1 (25 campaigns, benchmarks/blind_cases.py, seed
# 7100); where a start of the series is taken for run-in, one is by 2 to 7 in eight of nine (tests/blind/hidden_laws.py,
# seed 4001).
MARGIN = {True: 2.0 * CLOSE, False: CLOSE}
# A covariate is a law of the grammar itself, on all samples and in both regimes. It stays where another law of its own
# column cannot be told from it; between its column and another one of the series, the likelier counts.
MARGIN_OF_COVARIATE = {True: CLOSE, False: 0.0}
SAME = {"speed_mm_s": "speed_m_s", "started_at": "elapsed_s"}  # columns of mechanisms by their names in the grammar
SERIES = {"run_order", "specimen_run", "elapsed_s", "date"}  # columns that follow each other through a series


@dataclass(frozen=True)
class CauseForms:
    """A recorded column as a ``cause``, written as the law that it is, and the other forms of a law of that column that
    explain the campaign about as well, the likeliest first."""

    cause: str
    law: WrittenLaw
    ties: tuple[WrittenLaw, ...]


@dataclass(frozen=True)
class Contested:
    """The ``model`` with the causes that stand against the laws of their columns, by how much the others ``lost``, and
    the ``forms`` of the recorded columns among those that stand."""

    model: ModelFit
    lost: dict[str, float]
    forms: tuple[CauseForms, ...]


def without_wrong_forms(model: ModelFit) -> Contested:
    """The model without the mechanisms that lose against a law of their own column, or two of them against a product
    of their columns."""
    lost: dict[str, float] = {}
    forms: dict[str, CauseForms] = {}
    for together in (*((a,) for a in model.acting), *combinations(model.acting, 2)):
        if not all(a in model.acting for a in together):
            continue
        laws = _best_laws(model, together)
        if laws is None:
            continue
        if laws.by > (MARGIN_OF_COVARIATE if _recorded(together) else MARGIN)[laws.own_column]:
            lost |= {a.name: laws.by for a in together}
            model = refitted(model, [a for a in model.acting if a not in together])
        elif len(together) == 1 and _recorded(together):
            law = _as_law(together[0], model.setup.observations.conditions)
            others = tuple(tie for tie in laws.ties if tie.form != law.form and set(tie.columns) == set(law.columns))
            forms[together[0].name] = CauseForms(together[0].name, law, others)
    standing = {a.name for a in model.acting}
    return Contested(model, lost, tuple(f for f in forms.values() if f.cause in standing))


def _recorded(together: Sequence[Acting]) -> bool:
    return all(a.mechanism.any_column for a in together)


@dataclass(frozen=True)
class _BestLaws:
    """The laws of the columns of one or two mechanisms: ``by`` how much log likelihood the best is better than the
    mechanisms, whether it follows their ``own_column``, and the forms within CLOSE of the mechanisms or better."""

    by: float
    own_column: bool
    ties: tuple[WrittenLaw, ...]


def _best_laws(model: ModelFit, together: Sequence[Acting]) -> _BestLaws | None:
    """The laws in the place of one or two mechanisms; None where their columns have none.

    Both are judged at the noise that the law leaves. The law pays for its choices among those of these columns, the
    mechanisms do not.
    """
    columns = set().union(*(_followed(a) for a in together))
    c = model.setup.observations.conditions
    shapes = _of_columns(c, columns) if len(columns) == len(together) else []
    if not shapes:
        return None
    changes = [effect_of(model.setup, model.law, a, model.values[model.acting.index(a)]) for a in together]
    without = refitted(model, [a for a in model.acting if a not in together])
    forms, state = forms_in_reach(without, Searched(courses_of(shapes, c), tuple(groups_of(c))))
    gained = state.projected.joint_gain(np.stack(changes, axis=2))
    ties = tuple(form.best for form in forms if form.evidence > gained - CLOSE)
    return _BestLaws(forms[0].evidence - gained, set(forms[0].best.columns) <= columns, ties)


def _as_law(a: Acting, c: Conditions) -> WrittenLaw:
    """A recorded column as a law of the grammar: a line of its numbers, or one of its names."""
    (column,) = _followed(a)
    numbers = column_values(c, column)
    if np.isfinite(numbers).any():
        return WrittenLaw((Shape("linear", column, float(np.nanmin(numbers)), float(np.nanmax(numbers))),))
    level = a.mechanism.choosing.level(a.choice) or str(np.unique(c.columns[column])[-1])
    return WrittenLaw((Shape("level", column, level=level),))


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
