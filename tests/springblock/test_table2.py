"""T/N of the model with the paper's parameters against the numerical columns of the paper's Table 2."""

from __future__ import annotations

import pandas as pd
import pytest

from tribo.springblock import SimConfig, run_ensemble, stratified_design

# sample: static mu, tau0 kPa, sliding mu, tau0 kPa; Berardo 2019, Table 2, numerical simulation
TABLE2 = {
    "F": (4.78, 23.44, 2.879, 11.89),
    "A": (4.15, 17.71, 2.864, 11.17),
    "B": (3.76, 9.83, 3.036, 6.02),
    "C": (4.00, 7.47, 3.107, 4.85),
    "Sx": (3.29, 10.84, 2.866, 8.57),
    "Sy": (3.25, 10.12, 2.851, 8.60),
}
PRESSURES_PA = (3e3, 10e3, 25e3)


@pytest.fixture(scope="module")
def ensemble() -> pd.DataFrame:
    """Three stratified angles a sample and pressure."""
    base = SimConfig(dt_s=1e-7, rest_tolerance=1e-2, duration_peaks=2.0)
    table = run_ensemble(stratified_design(list(TABLE2), PRESSURES_PA, 3, base=base))
    return table.groupby(["sample", "pressure_Pa"])[["static_friction", "sliding_friction"]].mean()


@pytest.mark.parametrize("pressure_Pa", PRESSURES_PA)
@pytest.mark.parametrize("sample", TABLE2)
def test_simulated_friction_is_that_of_table_2(ensemble: pd.DataFrame, sample: str, pressure_Pa: float):
    """Static within 12 % for F, A, B, C and 18 % for Sx, Sy; sliding within 8 %."""
    mu_s, tau_s, mu_d, tau_d = TABLE2[sample]
    row = ensemble.loc[(sample, pressure_Pa)]
    p_kPa = pressure_Pa / 1e3
    assert row["static_friction"] == pytest.approx(mu_s + tau_s / p_kPa, rel=0.18 if sample[0] == "S" else 0.12)
    assert row["sliding_friction"] == pytest.approx(mu_d + tau_d / p_kPa, rel=0.08)
