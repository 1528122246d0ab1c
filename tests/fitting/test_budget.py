"""The uncertainty budget: every component, combined, and what dominates."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from other_fits import fit_power_law

import tribo
from tribo.errors import FitError
from tribo.fitting import fit_samples, uncertainty_budget
from tribo.fitting.budget import DEFAULTS, PRESSURE_PA
from tribo.records import LawFit, Regime

AREA = 55e-6
LOADS = np.array([0.06, 0.13, 0.26, 0.5, 0.9, 1.4])
SILENT = dict.fromkeys(DEFAULTS, 0.0)


def pulls(specimens: int = 3, between: float = 0.05, within: float = 0.05, seed: int = 1) -> pd.DataFrame:
    """A flat sample of mu 4.9 and tau0 22 kPa; readings of the traces known to 1 %."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(specimens):
        gain = 1 + between * rng.standard_normal()
        for load in np.repeat(LOADS, 3):
            force = gain * (4.9 * load + 22e3 * AREA) * (1 + within * rng.standard_normal())
            rows.append((f"F{k}", load, force, 0.01 * force, 0.8 * force, 0.01 * force))
    columns = ["specimen", "normal_load_N", "static_N", "static_u_N", "sliding_N", "sliding_u_N"]
    return pd.DataFrame(rows, columns=columns).assign(sample="F")


def budget(
    table: pd.DataFrame,
    instrument: dict[str, float] | None = None,
    regime: Regime = "static",
    rise: float = math.nan,
    rate: float = math.nan,
) -> tuple[LawFit, pd.DataFrame]:
    (fit,) = fit_samples(table, regime, AREA)
    settings = SILENT | (instrument or {})
    whole, parts = uncertainty_budget(table, fit, settings, rise_N_per_s=rise, sampling_rate_Hz=rate)
    return whole, parts.set_index("component")


def test_without_type_b_the_budget_is_the_fit_and_its_rows_add_up_to_it() -> None:
    found, parts = budget(pulls())
    np.testing.assert_array_equal(found.covariance, found.by_itself.covariance)
    np.testing.assert_allclose(parts.filter(like="share_pct").drop(index="combined").sum(), 100.0)
    assert found.interval("mu") == pytest.approx(found.by_itself.interval("mu"))


@pytest.mark.parametrize(
    ("setting", "component", "mu_u", "tau0_u_kPa"),
    [
        ({"load_cell_u_percent": 1.0}, "load cell, gain", 0.01, 0.01),
        ({"normal_load_u_percent": 2.0}, "normal load", 0.02, 0.0),
        ({"area_u_percent": 3.0}, "nominal area", 0.0, 0.03),
    ],
)
def test_a_scale_that_all_pulls_share_gives_its_share_of_the_value(
    setting: dict[str, float], component: str, mu_u: float, tau0_u_kPa: float
) -> None:
    found, parts = budget(pulls(), setting)
    row = parts.loc[component]
    assert row["u_mu"] == pytest.approx(mu_u * found.mu)
    assert row["u_tau0_kPa"] == pytest.approx(tau0_u_kPa * found.tau0_Pa / 1e3)
    assert "campaign.toml" in row["origin"]


def test_a_load_cell_offset_and_an_unknown_mass_are_read_as_adhesion() -> None:
    found, parts = budget(pulls(), {"load_cell_u_N": 0.055, "mass_u_g": 1.0})
    u = parts["u_tau0_kPa"]
    assert u["load cell, offset"] == pytest.approx(1.0)
    assert u["mass"] == pytest.approx(found.mu * 1e-3 * 9.80665 / AREA / 1e3)


@pytest.mark.parametrize("angle", [0.0, 2.0, -3.0])
def test_the_wire_angle_counts_as_the_slope_of_its_gain(angle: float) -> None:
    found, parts = budget(pulls(), {"wire_angle_deg": angle, "wire_angle_u_deg": 0.01})
    mu = found.mu

    def gain(degrees: float) -> float:
        return 1 / (np.cos(np.radians(degrees)) + mu * np.sin(np.radians(degrees)))

    change = abs(gain(angle + 0.01) - gain(angle - 0.01)) / 2 / gain(angle)
    row = parts.loc["wire angle"]
    assert row["u_mu"] / mu == pytest.approx(change, rel=1e-4)
    assert row["u_T_N"] / found.force_N(PRESSURE_PA * AREA) == pytest.approx(change, rel=1e-4)


def test_the_largest_part_says_that_it_was_assumed_unless_the_instrument_is_stated() -> None:
    (fit,) = fit_samples(quiet := pulls(between=0.001, within=0.001), "static", AREA)
    assumed = uncertainty_budget(quiet, fit, {}, rise_N_per_s=math.nan, sampling_rate_Hz=math.nan)[0]
    assert assumed.largest["mu"][0] == "wire angle, assumed"
    assert budget(quiet, {"wire_angle_u_deg": 0.5})[0].largest["mu"][0] == "wire angle"


def test_the_sampling_clip_is_half_a_sample_of_rise_rectangular_and_static_only() -> None:
    _, static = budget(pulls(), rise=6.0, rate=50.0)
    assert static.loc["sampling clip", "u_T_N"] == pytest.approx(6.0 / (2 * 50.0) / np.sqrt(3))
    assert "sampling clip" not in budget(pulls(), regime="sliding", rise=6.0, rate=50.0)[1].index
    assert any("sampling clip" in note for note in budget(pulls())[1].attrs["notes"])


def test_components_add_in_squares_with_their_correlation() -> None:
    _, rows = budget(pulls(), {"load_cell_u_percent": 1.0, "area_u_percent": 2.0, "mass_u_g": 0.5})
    for number in ("mu", "tau0_kPa", "T_N"):
        parts = rows[f"u_{number}"].drop("combined")
        assert rows.loc["combined", f"u_{number}"] == pytest.approx(np.sqrt((parts**2).sum()))


def test_the_effective_degrees_of_freedom_grow_from_those_of_the_fit_with_type_b() -> None:
    (alone, _), (joined, _) = budget(pulls()), budget(pulls(), {"load_cell_u_percent": 5.0})
    mu = np.array([1.0, 0.0])
    assert alone.effective_dof(mu) == pytest.approx(2.0)
    assert joined.effective_dof(mu) == pytest.approx(2.0 * (joined.mu_u / alone.mu_u) ** 4)


def test_what_dominates_is_named_in_words() -> None:
    assert budget(pulls(), {"area_u_percent": 40.0})[0].largest["tau0_Pa"][0] == "nominal area"
    assert budget(pulls(between=0.3))[0].largest["mu"][0] == "specimens"
    lone, _ = budget(pulls(specimens=1, within=0.2))
    assert lone.largest["mu"][0] == "repeats"
    assert lone.largest["T"][0] == "repeats"


def test_alike_specimens_are_put_down_to_their_repeats() -> None:
    budgets = [budget(pulls(between=0.0, within=0.1, seed=s))[1] for s in range(20)]
    shares = [b["share_pct_T_N"] for b in budgets]
    assert np.median([s["repeats"] + s["reading of the trace"] for s in shares]) > 60
    assert any("scatter of their repeats" in note for b in budgets for note in b.attrs["notes"])


def test_silence_of_the_campaign_is_filled_with_stated_defaults() -> None:
    table = pulls()
    (fit,) = fit_samples(table, "static", AREA)
    origins = uncertainty_budget(table, fit, {})[1]["origin"]
    for name, (_, reason) in DEFAULTS.items():
        if name != "wire_angle_deg":
            assert any(reason in origin and f"default {name}" in origin for origin in origins)


def test_a_law_without_tau0_has_no_budget() -> None:
    table = pulls()
    (fit,) = fit_power_law(table, "static", AREA)
    with pytest.raises(FitError, match="a budget needs a fitted law"):
        uncertainty_budget(table, fit, {})


def test_the_force_is_judged_at_a_load_that_was_measured() -> None:
    campaign = tribo.load_campaign(tribo.data_dir() / "example")
    loads = [test.normal_load_N for test in campaign.tests]
    assert campaign.judged_load_N() == pytest.approx(10e3 * campaign.area_m2)
    wide = replace(campaign, nominal_area_m2=100 * campaign.area_m2)  # 10 kPa lie far above all loads
    assert wide.judged_load_N() == pytest.approx(float(np.median(loads)))
