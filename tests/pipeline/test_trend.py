"""A change between campaigns is found where it is clear, and rarely where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tribo.site.index_page import FEWEST, SHORTEST, change_points, split_p


def test_the_p_of_a_split_is_that_of_the_t_test() -> None:
    y = np.random.default_rng(1).normal(size=11)
    expected = [stats.ttest_ind(y[:k], y[k:]).pvalue for k in range(SHORTEST, 11 - SHORTEST + 1)]
    assert split_p(y[None, :])[0] == pytest.approx(expected)


def test_no_change_gives_a_false_alarm_no_oftener_than_the_level_says() -> None:
    rng = np.random.default_rng(2)
    alarms = 0
    for k in range(200):
        common = rng.standard_t(3, 12)  # a campaign moves all its series
        series = {f"s{i}": 5 + 0.2 * (0.7 * common + rng.standard_t(3, 12)) for i in range(6)}
        alarms += bool(change_points(series, seed=k, permutations=200))
    assert stats.binomtest(alarms, 200, 0.05, alternative="greater").pvalue > 0.01


def test_a_clear_change_is_found_at_its_campaign_and_in_its_series() -> None:
    rng = np.random.default_rng(3)
    hits = 0
    for k in range(50):
        series = {f"s{i}": rng.normal(5, 0.1, 12) for i in range(6)}
        series["s2"][7:] += 0.5
        found = change_points(series, seed=k, permutations=400)
        hits += [(name, at) for name, changes in found.items() for at, *_ in changes] == [("s2", 7)]
    assert hits >= 40


def test_two_changes_of_one_series_are_both_found() -> None:
    y = np.random.default_rng(4).normal(0, 0.1, 30)
    y[10:] += 1
    y[20:] += 1
    assert [at for at, *_ in change_points({"mu": y})["mu"]] == [10, 20]


def test_campaigns_without_the_sample_are_passed_over() -> None:
    y = np.random.default_rng(5).normal(0, 0.1, 14)
    y[8:] += 2
    y[[1, 9]] = np.nan
    ((at, before, after, _),) = change_points({"mu": y})["mu"]
    assert at == 8
    assert after - before == pytest.approx(2, abs=0.2)


NO_CHANGE = (np.arange(FEWEST - 1.0), np.ones(12), np.full(12, np.nan), np.r_[np.zeros(59), 9.0])


@pytest.mark.parametrize("y", NO_CHANGE)
def test_few_campaigns_constant_ones_none_and_a_single_odd_one_make_no_change(y: np.ndarray) -> None:
    assert change_points({"mu": y}) == {}
