"""Pulls and specimens that stand apart are shown, and the fit keeps them."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from tribo.fitting import fit_samples, outlying_pulls, outlying_specimens, repeat_scatter
from tribo.fitting.assessment import outlying_sentences
from tribo.fitting.linear import sample_rows, weights_by_repeats

AREA = 55e-6
LOADS = np.array([0.06, 0.13, 0.26, 0.5, 0.9, 1.4])


def campaign(seed: int, share: float = 0.06, constant_N: float = 0.05, between: float = 0.04) -> pd.DataFrame:
    """Six samples of three specimens; repeats scatter by a share of T and a constant."""
    rng = np.random.default_rng(seed)
    rows = [
        (sample, f"{sample}{k}", load, force * (1 + share * rng.standard_normal()) + constant_N * rng.standard_normal())
        for sample in "ABCDEF"
        for k in range(3)
        for gain in [1 + between * rng.standard_normal()]
        for load in np.repeat(LOADS, 3)
        for force in [gain * (4.0 * load + 15e3 * AREA)]
    ]
    table = pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "static_N"])
    return table.assign(test_id=[f"T{k}" for k in range(len(table))])


def test_a_pull_twice_as_high_as_its_siblings_is_found_by_its_id() -> None:
    table = campaign(3)
    table.loc[100, "static_N"] *= 2
    found = outlying_pulls(table, "static", AREA)
    first = found.iloc[0]
    assert (first["name"], first["kind"]) == ("T100", "pull")
    assert first.deviation_pct == pytest.approx(100, abs=25)
    assert first.score > first.limit
    assert "T100" in outlying_sentences(found)[0]


def test_pulls_of_a_power_of_the_load_are_not_outliers_of_a_line() -> None:
    table = campaign(3)
    table["static_N"] *= 3.0 * table["normal_load_N"] ** 0.5 / (4.0 * table["normal_load_N"] + 15e3 * AREA)
    assert outlying_pulls(table, "static", AREA, dict.fromkeys("ABCDEF", 0.5)).empty


def test_many_outliers_of_one_sample_are_one_sentence() -> None:
    table = campaign(3)
    table.loc[range(54, 103, 7), "static_N"] *= 2
    found = outlying_pulls(table, "static", AREA)
    (sentence,) = outlying_sentences(found)
    assert len(found) == 7
    assert re.match(r"7 pulls \(B, static\): \d+ to \d+ % above the law of their specimen, ", sentence)


def test_a_specimen_far_above_the_others_is_found_once_and_stays_in_the_fit() -> None:
    table = campaign(4)
    table.loc[table["specimen"] == "C1", "static_N"] *= 1.8
    found = outlying_specimens(table, "static", AREA)
    assert found[["name", "sample"]].to_numpy().tolist() == [["C1", "C"]]
    fit = next(f for f in fit_samples(table, "static", AREA) if f.sample == "C")
    assert set(fit.specimens) == {"C0", "C1", "C2"}


@pytest.mark.slow
def test_campaigns_without_outliers_are_mostly_left_alone() -> None:
    alarms = [len(outlying_pulls(campaign(seed), "static", AREA)) > 0 for seed in range(30)]
    specimens = [len(outlying_specimens(campaign(seed), "static", AREA)) > 0 for seed in range(30)]
    assert sum(alarms) <= 7
    assert sum(specimens) <= 6


def test_pulls_without_any_scatter_have_no_outliers() -> None:
    table = campaign(0, share=0.0, constant_N=0.0, between=0.0)
    assert outlying_pulls(table, "static", AREA).empty
    assert outlying_specimens(table, "static", AREA).empty


def test_one_load_or_two_specimens_leave_nothing_to_judge() -> None:
    table = campaign(1)
    assert outlying_pulls(table[table["normal_load_N"] == LOADS[0]], "static", AREA).empty
    assert outlying_specimens(table[~table["specimen"].str.endswith("2")], "static", AREA).empty


@pytest.mark.parametrize(("share", "constant_N"), [(0.08, 0.0), (0.0, 0.1), (0.05, 0.08)])
def test_the_scatter_of_repeats_is_recovered_with_both_terms(share: float, constant_N: float) -> None:
    found = [repeat_scatter(sample_rows(campaign(seed, share, constant_N), "static")) for seed in range(12)]
    assert all(f is not None and f[2] > 100 for f in found)
    at = np.array([1.0, 3.0, 6.0])
    expected = np.sqrt(constant_N**2 + (share * at) ** 2)
    mean = np.mean([weights_by_repeats(at, f) ** -0.5 for f in found], axis=0)
    np.testing.assert_allclose(mean, expected, rtol=0.1)


def test_one_wild_repeat_does_not_widen_the_scatter_of_all() -> None:
    table = campaign(7)
    clean = repeat_scatter(sample_rows(table, "static"))
    table.loc[53, "static_N"] *= 3
    spoiled = repeat_scatter(sample_rows(table, "static"))
    without, with_it = (1 / weights_by_repeats(np.array([3.0]), scatter)[0] for scatter in (clean, spoiled))
    assert with_it == pytest.approx(without, rel=0.15)


def test_single_pulls_have_no_repeats_to_scatter() -> None:
    table = campaign(1).drop_duplicates(["specimen", "normal_load_N"])
    assert repeat_scatter(sample_rows(table, "static")) is None
    assert np.isfinite(fit_samples(table, "static", AREA, weights="repeats")[0].values).all()


@pytest.mark.parametrize(("off_N", "cells"), [(3.0, 40), (2.0, 41)])
def test_a_cell_of_repeats_counts_unless_chance_gives_its_scatter_less_than_once_in_a_thousand(
    off_N: float, cells: int
) -> None:
    """Three pulls of 10 N a cell, 1 N apart: chance reaches 6.9 times the variance once in a thousand cells."""
    apart = [1.0] * 40 + [off_N]
    rows = [("A", f"A{k}", 1.0, 10.0 + shift * d) for k, d in enumerate(apart) for shift in (-1, 0, 1)]
    table = pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "static_N"])
    found = repeat_scatter(sample_rows(table, "static"))
    assert found is not None
    assert found[2] == 2 * cells
    variance = 1 / weights_by_repeats(np.array([10.0]), found)
    assert variance[0] == pytest.approx(1.0 if cells == 40 else 44 / 41, rel=1e-3)


def test_repeats_that_are_equal_but_for_one_cell_have_a_scatter_that_is_a_number() -> None:
    rows = [("A", f"A{k}", 1.0, 5.0) for k in range(30) for _ in range(2)]
    rows += [("A", "A30", 1.0, 4.0), ("A", "A30", 1.0, 6.0)]
    table = pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "static_N"])
    found = repeat_scatter(sample_rows(table, "static"))
    assert found is not None
    assert np.isfinite(found).all()
    assert np.isfinite(weights_by_repeats(np.array([5.0]), found)).all()
