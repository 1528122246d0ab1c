"""The scores of the laws of the grammar, and the places at which a form is looked at closely."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.diagnostics.fit import ModelFit
from tribo.lawsearch import scoring
from tribo.lawsearch.grammar import fine_shapes, refined_shapes, shapes_of
from tribo.lawsearch.scoring import Grammar, Projection
from tribo.mechanisms.record import Conditions

from .known import baseline, made, net_of
from .test_known_laws import nothing


@pytest.fixture(scope="module")
def model() -> ModelFit:
    return baseline(made(nothing, seed=7))


@pytest.fixture(scope="module")
def conditions(model: ModelFit) -> Conditions:
    return model.setup.observations.conditions


def test_laws_scored_together_score_as_each_does_alone(model: ModelFit) -> None:
    laws = Grammar(model, ())
    together = net_of(laws, Projection(model, model.residual[None]))[0]
    two_columns = np.isin(np.arange(laws.size) % len(laws.courses.shapes), laws.courses.two)
    one_column = np.flatnonzero(~two_columns & np.isfinite(together))  # no corrections of a pattern
    some = one_column[:: len(one_column) // 60]
    groups, shapes = np.divmod(some, len(laws.courses.shapes))
    columns = [laws.courses.column(k) * laws.effects[g] for g, k in zip(groups, shapes, strict=True)]
    left, residual = model.cleared(np.stack(columns, axis=2))
    alone = 0.5 * (left.T @ residual) ** 2 / np.sum(left**2, axis=0) - laws.cost(some)
    assert together[some] == pytest.approx(alone, abs=1e-6)


def test_the_best_laws_are_those_of_all_scored_at_once(model: ModelFit, monkeypatch: pytest.MonkeyPatch) -> None:
    laws = Grammar(model, ())
    residual = np.stack([model.residual, model.residual[::-1]])
    every = net_of(laws, Projection(model, residual))
    monkeypatch.setattr(scoring, "COLUMNS_AT_ONCE", 70)
    for net, best in zip(every, laws.best(Projection(model, residual), 30), strict=True):
        assert np.sort(net[best]) == pytest.approx(np.sort(net)[-30:], abs=1e-9)


def test_a_wave_gains_what_its_sine_and_cosine_gain_together(model: ModelFit) -> None:
    laws = Grammar(model, ())
    first = int(laws.courses.two[0])
    gain = Projection(model, model.residual[None]).gains(laws.courses, laws.acts)[0, 0, first]
    left, residual = model.cleared(np.stack([laws.courses.column(first)] * 2, axis=1))
    pull = left.T @ residual
    assert gain + 1.0 == pytest.approx(0.5 * pull @ np.linalg.solve(left.T @ left, pull), abs=1e-6)


def test_a_wave_is_looked_at_in_all_its_periods_whichever_led(conditions: Conditions) -> None:
    """So that the choice of a period costs a wave what the choice of a place costs a step."""
    waves = [s for (s, *_), _ in shapes_of(conditions) if s.kind == "wave" and s.column == "run_order"]
    assert len(waves) > 10
    assert len({tuple(fine_shapes(wave, conditions)) for wave in (waves[0], waves[-1])}) == 1


def test_a_stretch_of_the_series_is_placed_to_a_test(conditions: Conditions) -> None:
    first = next(s for (s, *_), _ in shapes_of(conditions) if s.kind == "window")
    begin, end = (1.0 + share * (len(conditions.run_order) - 1.0) for share in (13.5 / 40, 23.5 / 40))
    fine = min(fine_shapes(first, conditions), key=lambda s: abs(s.place - begin) + abs(s.place + s.width - end))
    near = refined_shapes(fine, conditions)
    assert min(max(abs(s.place - begin), abs(s.place + s.width - end)) for s in near) < 0.5
