"""The observer who has to search: names the columns of a clear law, and by chance finds next to nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from .campaign import bare_bench, make, multiply
from .free_laws import hide_free_law, law_laboratory
from .laboratory import Laboratory
from .nuisance import DAYS, Nuisance
from .observer import Observer
from .searching_observer import Found, search

SMALL = {"samples": ("F", "A", "B"), "repeats": 2, "noise_of": {}}


def found_in(seed: int, laboratory: Laboratory, kind: str = "", nuisance: tuple[Nuisance, ...] = ()) -> Found:
    bare = bare_bench(seed, laboratory)
    made = make(seed, laboratory, nuisance, hide_free_law(seed, laboratory, kind) if kind else None)
    return search(Observer(bare, laboratory, nuisance, draws=300), bare, made.bench)


@pytest.mark.parametrize("kind", ["smooth", "periodic", "product"])
def test_the_columns_of_a_clear_law_are_found(kind: str) -> None:
    right = 0
    for seed in (31, 32, 33):
        laboratory = law_laboratory(seed, **SMALL)
        truth = make(seed, laboratory, hide=hide_free_law(seed, laboratory, kind)).truth
        found = found_in(seed, laboratory, kind)
        right += set(truth["columns"]) <= set(found.columns) and found.chance < 1e-4
    assert right >= 2


def test_nothing_is_found_by_chance_alone() -> None:
    """At a chance of 5 % one of twenty; four would be one of sixty."""
    chances = [found_in(seed, law_laboratory(seed, tails="normal", **SMALL)).chance for seed in range(50, 70)]
    assert sum(chance < 0.05 for chance in chances) < 4


def test_pulls_that_lie_far_off_are_no_law_where_tails_are_heavy() -> None:
    heavy = [law_laboratory(seed, tails="heavy", specimens_are="plain", **SMALL) for seed in range(70, 78)]
    known = [found_in(70 + k, laboratory).chance for k, laboratory in enumerate(heavy)]
    assert min(known) > 1e-3
    taken_for_normal = []
    for k, laboratory in enumerate(heavy):
        bare = bare_bench(70 + k, laboratory)
        observer = Observer(bare, replace(laboratory, tails="normal"), draws=300)
        taken_for_normal.append(search(observer, bare, make(70 + k, laboratory).bench).chance)
    assert min(taken_for_normal) < 1e-3


def test_a_law_of_the_temperature_shows_less_where_days_are_nuisance() -> None:
    laboratory = law_laboratory(90, **SMALL)
    bare, made = bare_bench(90, laboratory), bare_bench(90, laboratory)
    temperature = made.column("temperature_C")
    multiply(made, 0.1 * np.outer(temperature - temperature.mean(), [1.0, 1.0]))
    quiet, noisy = (), (Nuisance(DAYS, "normal", 0.1),)
    chances = [search(Observer(bare, laboratory, n, draws=300), bare, made).chance for n in (quiet, noisy)]
    assert chances[0] < 1e-4
    assert chances[0] < 0.01 * chances[1]


def test_another_law_of_one_sample_is_no_law_of_a_column() -> None:
    laboratory = law_laboratory(91, **SMALL)
    bare, made = bare_bench(91, laboratory), make(91, laboratory).bench
    observer = Observer(bare, laboratory, draws=300)
    before = search(observer, bare, made)
    multiply(made, 0.2 * (made.column("sample") == "A")[:, None] * np.ones(2))
    after = search(observer, bare, made)
    assert after.columns == before.columns
    assert after.chance == pytest.approx(before.chance, rel=1e-6)
