"""Effects, laws and gaps of the virtual laboratories: they are of the stated size, form and share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from .campaign import HIDDEN, bare_bench, both, make, stream
from .effects import ALONG, EFFECTS, NEEDS, bent, hide_effect, strengths
from .free_laws import CLASSES, STRENGTHS, draw_course, hide_free_law, law_laboratory
from .gaps import COLUMNS as GAP_COLUMNS, HOW, WORDED, gaps, missing
from .laboratory import Laboratory, day_of
from .nuisance import DAYS, Nuisance
from .simple_laws import FORMS, hide_simple_law

SMALL = Laboratory(samples=("F", "A", "B"), days=6, operators=3)


def test_a_form_that_is_off_keeps_the_size_that_fits_best() -> None:
    exact, off = (make(21, SMALL, hide=hide_effect("run_in", 1.0, off)).change for off in (0.0, 0.12))
    assert np.sum(exact * off) / np.sum(exact**2) == pytest.approx(1.0)
    assert np.sqrt(np.sum((off - exact) ** 2) / np.sum(exact**2)) == pytest.approx(0.12)


@pytest.mark.parametrize("name", ["temperature", "suction", "covariate:operator"])
def test_a_form_is_off_by_a_function_of_the_column_that_drives_it(name: str) -> None:
    made = make(22, SMALL, hide=hide_effect(name, 1.0))
    column = made.bench.column(ALONG.get(name, "N"))
    g = bent(made.change, column, np.random.default_rng(1))
    assert len(np.unique(g.round(9))) <= len(np.unique(column))


@pytest.mark.slow
def test_nuisance_weakens_what_the_observer_sees_of_an_effect() -> None:
    hide, rng = hide_effect("temperature", 1.0), stream(23, HIDDEN)
    free = strengths(23, SMALL, (), hide, rng)
    under = strengths(23, SMALL, (Nuisance(DAYS, "normal", 0.05),), hide, rng)
    assert under["strength"] < 0.95 * free["strength"]
    assert under["patterns_known"] < 0.95 * free["patterns_known"]


@pytest.mark.slow
def test_the_observer_needs_the_patterns_to_see_suction_but_not_to_see_an_offset() -> None:
    suction = strengths(24, SMALL, (), hide_effect("suction", 1.0), stream(24, HIDDEN))
    assert suction["patterns_known"] > 3 * suction["strength"]
    assert strengths(24, SMALL, (), hide_effect("load_cell_offset", 0.1), stream(24, HIDDEN))["strength"] > 20


@pytest.mark.parametrize("kind", CLASSES)
def test_a_free_law_acts_where_it_says_and_is_as_clear_as_it_says(kind: str) -> None:
    laboratory = law_laboratory(25, samples=("F", "A", "B"), order="random", repeats=2)
    made = make(25, laboratory, hide=hide_free_law(25, laboratory, kind))
    truth = made.truth
    here = np.isin(made.bench.column("sample"), truth["samples"])
    assert not made.change[~here].any()
    for k in (0, 1):
        assert bool(made.change[here, k].any()) == bool(truth["regimes"][k])
    assert STRENGTHS[0] * 0.97 <= truth["strength"] <= STRENGTHS[1] * 1.03
    assert len(truth["columns"]) in {"product": (2,), "tree": (2,), "gated": (1, 2)}.get(kind, (1,))
    at = {}
    for row, change in zip(made.bench.tests[here].to_dict("records"), made.change[here], strict=True):
        key = tuple(row[c] for c in (*truth["columns"], "sample", "mass_g"))
        at.setdefault(key, change)
        assert change == pytest.approx(at[key], abs=1e-9)  # the columns and the term decide, and nothing else


def test_courses_of_a_class_are_what_its_name_says() -> None:
    rng = np.random.default_rng(3)
    u, v = np.linspace(0, 1, 401), rng.random(401)
    for _ in range(5):
        assert len(np.unique(draw_course("tree", [u, v], rng))) == 4
        assert np.abs(np.diff(draw_course("smooth", [u], rng))).max() < 0.1
        bends = np.abs(np.diff(draw_course("kinked", [u], rng), 2)) > 1e-9
        assert 1 <= bends.sum() <= 6  # one to three kinks, each within one or two steps of the grid
        gated = draw_course("gated", [u], rng)
        assert 0.25 < np.mean(gated == 0) < 0.75
    wave = np.abs(np.fft.rfft(draw_course("periodic", [u], rng)))
    assert wave[2:12].sum() > 0.7 * wave[1:].sum()


@pytest.mark.parametrize("form", FORMS)
def test_a_simple_law_changes_the_force_by_the_stated_percent(form: str) -> None:
    made = make(26, SMALL, hide=hide_simple_law(form, "film_um"))
    x, change = made.bench.column("film_um"), made.change[:, 0]
    ends = np.expm1(change[np.argmax(x)] - change[np.argmin(x)])
    assert 100 * ends == pytest.approx(made.truth["percent"], abs=0.01)


@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5])
def test_the_stated_share_of_cells_is_missing(how: str, share: float) -> None:
    tests = bare_bench(27, SMALL).tests
    cells = gaps(tests, share, how, np.random.default_rng(1))
    assert set(cells) == set(GAP_COLUMNS) - ({"operator"} if how == "one operator" else set())
    words = {w for each in WORDED.values() for w in each}
    for values in cells.values():
        empty = np.array([v is None or v in words for v in values])
        assert empty.sum() == round(share * len(tests))


def test_gaps_take_whole_days_or_the_tests_of_one_operator() -> None:
    tests = bare_bench(28, replace(SMALL, turns="pull")).tests
    gone = missing(tests, 0.3, "whole days", "op1", np.random.default_rng(2))
    partly = [d for d in np.unique(day_of(tests)) if 0 < gone[day_of(tests) == d].mean() < 1]
    assert len(partly) <= 1
    gone = missing(tests, 0.2, "one operator", "op1", np.random.default_rng(2))
    assert set(tests["operator"][gone]) == {"op1"}


@pytest.mark.parametrize("name", sorted(set(EFFECTS) - {"pull_angle", "pulley_friction", "sampling_clip"}))
def test_every_effect_acts_in_the_laboratory_that_it_needs(name: str) -> None:
    laboratory = replace(SMALL, **NEEDS.get(name, {}))
    plain, changed = bare_bench(30, laboratory), bare_bench(30, laboratory)
    truth = hide_effect(name, 0.5)(changed, stream(30, HIDDEN))
    in_traces = np.any(changed.zero != plain.zero) or np.any(changed.stiffness_N_per_mm != plain.stiffness_N_per_mm)
    assert truth["rms_percent"] > 0.1 or in_traces


def test_an_effect_in_a_laboratory_changes_no_other_draw() -> None:
    plain, changed = make(29, SMALL), make(29, SMALL, hide=hide_effect("humidity", 1.0))
    assert np.log(both(changed.bench)) == pytest.approx(np.log(both(plain.bench)) + changed.change)
