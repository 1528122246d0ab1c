"""What difference two samples must have to be told apart."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import ttest_ind

from tribo.errors import FitError
from tribo.fitting import power_of_campaign
from tribo.fitting.assessment import power_sentences, smallest_difference

AREA = 55e-6
LOADS = np.array([0.06, 0.26, 0.5, 1.4])


def pulls(
    between: float, within: float, specimens: int = 3, repeats: int = 3, samples: int = 6, seed: int = 0
) -> pd.DataFrame:
    rng = np.random.default_rng(seed)
    rows = [
        (f"S{s}", f"S{s}-{k}", load, gain * (4.9 * load + 22e3 * AREA) * (1 + within * rng.standard_normal()))
        for s in range(samples)
        for k in range(specimens)
        for gain in [1 + between * rng.standard_normal()]
        for load in np.repeat(LOADS, repeats)
    ]
    return pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "static_N"])


@pytest.mark.parametrize(("specimens", "level", "power"), [(3, 0.05, 0.8), (8, 0.05, 0.9), (2, 0.1, 0.5)])
def test_the_smallest_difference_is_found_with_the_stated_power(specimens: int, level: float, power: float) -> None:
    rng = np.random.default_rng(2)
    difference = smallest_difference(1.7, specimens, level, power)
    one, other = 1.7 * rng.standard_normal((2, specimens, 20000))
    found = np.mean(ttest_ind(one + difference, other).pvalue < level)
    assert found == pytest.approx(power, abs=4 * np.sqrt(power * (1 - power) / 20000))


def test_one_specimen_tells_nothing_apart() -> None:
    assert smallest_difference(1.0, 1) == np.inf


def test_the_scatter_of_specimens_and_of_repeats_is_parted() -> None:
    found = power_of_campaign(pulls(0.06, 0.04, samples=60), "static", AREA).set_index("number")
    assert found.loc["T_N", "specimen_sd_pct"] == pytest.approx(6.0, rel=0.2)
    assert found.loc["mu", "specimens"] == 3
    assert found.loc["mu", "repeats"] == 3


def test_the_stated_number_of_specimens_finds_the_wanted_difference_and_one_less_does_not() -> None:
    for p in power_of_campaign(pulls(0.06, 0.05), "static", AREA, wanted_pct=12.0).itertuples():
        sd = np.hypot(p.specimen_sd_pct, p.repeat_sd_pct / np.sqrt(p.repeats))
        assert smallest_difference(sd, p.specimens_needed, p.level, p.power) <= 12.0
        assert p.specimens_needed == 2 or smallest_difference(sd, p.specimens_needed - 1) > 12.0
        assert p.smallest_difference_pct == pytest.approx(smallest_difference(sd, p.specimens))


def test_repeats_help_where_repeats_scatter_and_not_where_specimens_do() -> None:
    noisy = power_of_campaign(pulls(0.0, 0.15, repeats=2), "static", AREA, wanted_pct=10.0)
    unlike = power_of_campaign(pulls(0.2, 0.01), "static", AREA, wanted_pct=10.0)
    assert noisy["repeats_needed"][2] > 2
    assert unlike["repeats_needed"][2] is pd.NA
    assert "more repeats alone are not sufficient" in power_sentences(unlike)[2]


def test_the_sentence_states_level_power_and_what_it_takes() -> None:
    text = power_sentences(power_of_campaign(pulls(0.06, 0.05), "static", AREA))[2]
    assert "T at 10 kPa" in text
    assert "probability 0.8 at significance level 0.05" in text
    assert "Detecting 10 % requires" in text


def test_one_specimen_a_sample_has_no_power_to_speak_of() -> None:
    with pytest.raises(FitError, match="between specimens cannot be determined"):
        power_of_campaign(pulls(0.05, 0.05, specimens=1), "static", AREA)
