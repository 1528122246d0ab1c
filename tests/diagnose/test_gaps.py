"""Columns that are recorded for some tests only: what stands in their gaps, and what is said of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from tribo.diagnostics.diagnosis import examine
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.gaps import gaps_of, told_names
from tribo.diagnostics.model import Acting, setup
from tribo.diagnostics.observations import Observations, observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.diagnostics.score_statistics import RecordedInPart, gaps_in, recorded_in_part
from tribo.figures.extended_model import law_numbers_of
from tribo.lawsearch.grammar import Shape, WrittenLaw, shapes_of
from tribo.lawsearch.model_choice import FoundLaw
from tribo.lawsearch.search import Discovery
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.conditions import Conditions
from tribo.mechanisms.covariate import score
from tribo.records import FloatArray, Ingested
from tribo.wording.verdict_sentences import in_part_sentences, worded

from .synthetic import hidden

N = 200
ONE_DAY = np.full(N, "2026-03-02")


def without(campaign: Ingested, out: Callable[[int], bool], **changes: Any) -> Ingested:
    """The same campaign with these changes to the tests whose place in the series is ``out``."""
    tests = tuple(replace(t, **changes) if out(k) else t for k, t in enumerate(campaign.campaign.tests))
    return replace(campaign, campaign=replace(campaign.campaign, tests=tests))


def every_third(k: int) -> bool:
    return k % 3 == 1


@cache
def in_part() -> Observations:
    """Temperature and operator are missing for every third test."""
    return observe(without(hidden(seed=6), every_third, temperature_C=None, operator=""))


def with_gaps(values: FloatArray, missing: np.ndarray) -> FloatArray:
    return np.where(missing, np.nan, values)


def test_a_gap_is_filled_with_what_the_other_columns_say() -> None:
    rng = np.random.default_rng(1)
    other = rng.normal(size=N)
    column = 20.0 + 3.0 * other + rng.normal(0.0, 0.1, N)
    missing = rng.random(N) < 0.4
    found = gaps_of("a", {"a": with_gaps(column, missing), "b": other}, np.full(N, np.nan), ONE_DAY)
    assert found.missing.tolist() == missing.tolist()
    inside = missing & (column > column[~missing].min()) & (column < column[~missing].max())
    assert inside.sum() > 60
    assert found.expected[inside] == pytest.approx(column[inside], abs=0.5)


def test_a_gap_is_filled_with_what_its_neighbours_in_time_say_of_the_same_day_alone() -> None:
    rng = np.random.default_rng(2)
    day = np.repeat([f"2026-03-{k + 1:02}" for k in range(20)], 10)
    level = np.repeat(rng.normal(40.0, 8.0, 20), 10)
    column = level + rng.normal(0.0, 0.5, N)
    missing = rng.random(N) < 0.3
    missing[:10] = True
    found = gaps_of("a", {"a": with_gaps(column, missing)}, np.arange(N) * 1.0, day)
    later = missing & (np.arange(N) >= 10)
    assert np.sqrt(np.mean((found.expected[later] - level[later]) ** 2)) < 1.5
    assert found.expected[:10] == pytest.approx(np.nanmean(with_gaps(column, missing)), abs=1.5)
    assert found.draws[:10].std() > 4.0 * found.draws[later].std(axis=1).mean()


def test_what_may_stand_in_a_gap_scatters_as_the_recorded_values_do() -> None:
    rng = np.random.default_rng(3)
    column = rng.choice([1.0, 2.0, 10.0], N)
    missing = rng.random(N) < 0.3
    found = gaps_of("a", {"a": with_gaps(column, missing)}, np.full(N, np.nan), ONE_DAY)
    assert found.draws[missing].std() == pytest.approx(column[~missing].std(), rel=0.15)
    assert found.draws[~missing] == pytest.approx(np.repeat(column[~missing, None], found.draws.shape[1], axis=1))
    share_above = found.mean_of(lambda x: (x > 1.5) * 1.0)[missing].mean()
    assert share_above == pytest.approx(np.mean(column[~missing] > 1.5), abs=0.15)


@pytest.mark.parametrize(("field", "other"), [("temperature_C", 23.0), ("humidity_pct", 40.0), ("hold_s", 10.0)])
def test_a_column_with_gaps_takes_part_with_every_test(field: str, other: float) -> None:
    varied = without(hidden(seed=6), lambda k: k % 2 == 0, **{field: other + 5.0})
    c = observe(without(varied, every_third, **{field: None})).conditions
    recorded = c.recorded(field)
    assert np.isnan(recorded).mean() == pytest.approx(1 / 3, abs=0.02)
    assert np.isfinite(getattr(c, field)).all()
    assert all(m.applies(c) for m in MECHANISMS.values() if m.needs == (field,))


def test_a_column_with_too_few_values_keeps_its_gaps() -> None:
    c = observe(without(hidden(seed=6), lambda k: k > 6, temperature_C=None)).conditions
    assert np.isfinite(c.temperature_C).sum() == 7
    assert not MECHANISMS["temperature"].applies(c)


def test_a_name_that_was_not_recorded_counts_as_the_others_do_on_average() -> None:
    c = in_part().conditions
    column = c.columns["operator"]
    mean = score(c, "operator")[column != ""].mean()
    assert score(c, "operator")[column == ""] == pytest.approx(mean)
    assert Shape("level", "operator", level="op2").of(c)[column == "", 0] == pytest.approx(
        np.mean(column[column != ""] == "op2")
    )


def names_told(column: np.ndarray, out: np.ndarray, specimen: np.ndarray) -> np.ndarray:
    """Names of tests in ten days of twenty, those of ``out`` (n,) missing and told by the others."""
    day = np.repeat([f"2026-03-{k + 1:02d}" for k in range(10)], 20)
    return told_names(np.where(out, "", column), specimen, np.arange(float(N)), day)


def test_names_are_told_by_the_same_specimen_and_by_the_tests_around_and_else_by_nothing() -> None:
    rng = np.random.default_rng(8)
    specimen, out = rng.choice([f"s{k}" for k in range(9)], N), rng.random(N) < 0.2
    lot = np.array([f"m{int(name[1]) % 3}" for name in specimen])
    assert names_told(lot, out, specimen).tolist() == lot.tolist()
    operator = np.where(np.arange(N) // 10 % 3 == 0, "op1", "op2")
    found = names_told(operator, out, specimen)
    assert (found[out] == operator[out]).sum() > 0.7 * out.sum()
    assert set(found[out & (found != operator)]) == {""}
    recipe = rng.choice(["r1", "r2"], N)
    assert names_told(recipe, out, specimen).tolist() == np.where(out, "", recipe).tolist()
    whole_day = np.arange(N) // 20 == 4
    assert (names_told(operator, whole_day, specimen)[whole_day] == "").all()


def test_a_name_that_was_told_still_counts_as_not_recorded() -> None:
    o = in_part()
    c = o.conditions
    told = c.columns["operator"].copy()
    told[1] = "op1"
    known = replace(c, columns={**c.columns, "operator": told}, told_names={"operator": np.arange(o.n) == 1})
    assert gaps_in(replace(o, conditions=known))["operator"].tolist() == gaps_in(o)["operator"].tolist()
    assert replace(o, conditions=known).take(np.arange(3)).conditions.told_names["operator"].tolist() == [0, 1, 0]


def test_a_word_in_a_further_column_of_numbers_is_a_gap() -> None:
    oven = [str(20 + k % 9) for k in range(len(hidden(seed=6).campaign.tests))]
    oven[4] = "n/a"
    campaign = hidden(seed=6)
    tests = tuple(replace(t, covariates={"oven": cell}) for t, cell in zip(campaign.campaign.tests, oven, strict=True))
    c = observe(replace(campaign, campaign=replace(campaign.campaign, tests=tests))).conditions
    assert c.gaps["oven"].missing.tolist() == [cell == "n/a" for cell in oven]
    assert 20.0 <= float(c.columns["oven"][4]) <= 28.0


def test_places_of_shapes_are_those_of_recorded_values() -> None:
    speeds = without(hidden(seed=6), lambda k: k % 2 == 0, speed_m_s=8e-4)
    c = observe(without(speeds, every_third, speed_m_s=None)).conditions
    assert len(np.unique(c.speed_m_s)) > 2
    kinds = {s.kind for shapes, _ in shapes_of(c) for s in shapes if s.column == "speed_m_s"}
    assert kinds == {"linear", "log"}


def test_gaps_go_with_their_tests() -> None:
    o = in_part()
    part = o.take(np.arange(o.n) % 3 == 1)
    assert part.conditions.gaps["temperature_C"].missing.all()
    assert len(part.conditions.gaps["temperature_C"].draws) == part.n


def fitted(o: Observations) -> ModelFit:
    return fit(setup(o, tabled_predictor(o.patterns)))


def test_the_share_that_is_recorded_is_known_and_gaps_by_the_calendar_are_not_doubted() -> None:
    found = {gaps.column: gaps for gaps in recorded_in_part(fitted(in_part()), 0.01)}
    assert set(found) == {"temperature_C", "operator"}
    assert found["temperature_C"].share == pytest.approx(2 / 3, abs=0.01)
    assert not any(gaps.doubted for gaps in found.values())


def test_gaps_where_friction_is_high_are_doubted() -> None:
    whole = fitted(observe(hidden(seed=6)))
    high = whole.left.sum(axis=1) > 0.1
    o = observe(without(hidden(seed=6), lambda k: bool(high[k]), humidity_pct=None))
    (gaps,) = recorded_in_part(fitted(o), 0.01)
    assert gaps.column == "humidity_pct"
    assert gaps.doubted


def test_a_temperature_recorded_for_two_tests_of_three_is_named_with_its_share() -> None:
    campaign = without(hidden(("temperature", 1.5)), every_third, temperature_C=None)
    v = worded(examine(campaign, replicates=(40, 20)).verdict)
    assert [c.mechanism for c in v.causes] == ["temperature"]
    assert "The temperature is recorded for 67 % of the tests." in v.evidence


def test_a_column_of_a_few_values_is_said_to_be_recorded_for_these() -> None:
    campaign = without(hidden(), lambda k: k > 6, temperature_C=None)
    v = worded(examine(campaign, replicates=(40, 20)).verdict)
    (left_out,) = [e for e in v.not_testable if e.mechanism == "temperature"]
    assert "the temperature is recorded for 7 of 96 tests only" in left_out.reason
    assert "not vary" not in left_out.reason


def test_columns_recorded_for_the_same_share_are_said_in_one_sentence() -> None:
    columns = (("temperature_C", 0.9, 0.5, False), ("humidity_pct", 0.9, 0.001, True), ("hold_s", 0.5, 0.5, False))
    said = list(in_part_sentences([RecordedInPart(*each) for each in columns]))
    assert said[:2] == [
        "The temperature and the humidity are each recorded for 90 % of the tests.",
        "The hold time is recorded for 50 % of the tests.",
    ]
    (doubt,) = said[2:]
    assert "with and without a value of the humidity" in doubt


def test_a_law_is_drawn_over_recorded_values_alone() -> None:
    o = in_part()
    law = WrittenLaw((Shape("linear", "temperature_C", 20.0, 26.0),))
    model = fit(setup(o, tabled_predictor(o.patterns)), [Acting(law.mechanism())])
    found = FoundLaw(law, {}, (0.0, 0.0, 0.0), 0.0, None, (), model, np.zeros((3, o.n, 2)))
    x = law_numbers_of(Discovery((found,), (), 1))["x"].to_numpy()
    recorded = o.conditions.recorded("temperature_C")
    assert x.tolist() == 2 * recorded[np.isfinite(recorded)].tolist()


def test_the_mean_of_a_shape_over_a_gap_lies_between_its_ends() -> None:
    c: Conditions = in_part().conditions
    missing = c.gaps["temperature_C"].missing
    place = float(np.median(c.recorded("temperature_C")[~missing]))
    step = Shape("step", "temperature_C", place=place).of(c)[:, 0]
    assert set(step[~missing]) == {0.0, 1.0}
    assert 0.3 < step[missing].mean() < 0.7
