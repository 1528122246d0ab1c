"""Loads that hardly differ are not fitted as a law, whatever their scatter happens to be."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tribo.errors import FitError
from tribo.fitting.samples import fit_samples

AREA_M2 = 55e-6


def campaign(spread: float, seed: int, specimens: int = 3, tests: int = 4, load_N: float = 0.5) -> pd.DataFrame:
    """A sample with mu = 3 and tau0 = 10 kPa, a scatter of 2 %, at loads within ``spread`` of each other."""
    rng = np.random.default_rng(seed)
    load = load_N * (1.0 + spread * np.tile(np.linspace(0.0, 1.0, tests), specimens))
    force = (3.0 * load + 10e3 * AREA_M2) * rng.normal(1.0, 0.02, load.size)
    return pd.DataFrame({
        "test_id": [f"T{k}" for k in range(load.size)], "sample": "F",
        "specimen": np.repeat([f"F{k}" for k in range(specimens)], tests),
        "normal_load_N": load, "static_N": force, "static_u_N": 0.01 * force,
    })  # fmt: skip


@pytest.mark.parametrize("spread", [1e-6, 0.001, 0.005])
@pytest.mark.parametrize("load_N", [0.5, 500.0])
@pytest.mark.parametrize("specimens", [1, 2, 3])
def test_loads_that_hardly_differ_give_no_slope_and_say_why(spread: float, load_N: float, specimens: int) -> None:
    for seed in range(10):
        with pytest.raises(FitError, match=r"the loads span only .* does not determine a slope"):
            fit_samples(campaign(spread, seed, specimens, load_N=load_N), "static", AREA_M2)


def test_two_tests_at_loads_that_hardly_differ_give_no_slope() -> None:
    with pytest.raises(FitError, match="does not determine a slope"):
        fit_samples(campaign(0.001, 1, specimens=1, tests=2), "static", AREA_M2)


@pytest.mark.parametrize("spread", [1.0, 10.0])
def test_loads_that_differ_twofold_are_fitted(spread: float) -> None:
    for seed in range(10):
        (fit,) = fit_samples(campaign(spread, seed), "static", AREA_M2)
        assert abs(fit.value("mu") - 3.0) < 4.0 * fit.standard_uncertainty("mu") + 0.3


def test_one_sample_at_one_load_leaves_the_others_their_laws() -> None:
    wide, narrow = campaign(3.0, 1), campaign(0.001, 2).assign(sample="B")
    fits = {f.sample: f for f in fit_samples(pd.concat([wide, narrow], ignore_index=True), "static", AREA_M2)}
    assert np.isfinite(fits["F"].values).all()
    assert np.isnan(fits["B"].values).all()
    assert "does not determine a slope" in fits["B"].notes[-1]


@pytest.mark.parametrize(("spread", "said"), [(0.005, "0.5 %"), (0.001, "0.1 %")])
def test_the_span_of_the_loads_is_said_in_percent(spread: float, said: str) -> None:
    with pytest.raises(FitError, match=f"the loads span only {said}"):
        fit_samples(campaign(spread, 0), "static", AREA_M2)
