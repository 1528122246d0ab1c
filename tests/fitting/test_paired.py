"""Samples measured on the same specimens differ by what is left once the specimens are taken out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.campaigns import DESIGN, write_made

from tribo import stages
from tribo.campaign import load_campaign
from tribo.fitting import fit_samples, paired_differences

AREA_M2 = 55e-6
LOADS_N = np.array([0.1, 0.3, 0.6, 1.2])
LAWS = {"Sx": (3.0, 15e3), "Sy": (2.7, 14e3)}


def both_ways(seed: int, specimens: int = 3, own: float = 0.1, shared: bool = True) -> pd.DataFrame:
    """A pattern pulled both ways: specimens differ by ``own`` of their force, alike both ways where they are shared."""
    rng = np.random.default_rng(seed)
    parts = []
    scale = {}
    for sample, (mu, tau0_Pa) in LAWS.items():
        for k in range(specimens):
            name = f"S{k}" if shared else f"{sample}{k}"
            scale.setdefault(name, 1 + own * rng.standard_normal())
            load = np.repeat(LOADS_N, 3)
            force = scale[name] * (mu * load + tau0_Pa * AREA_M2) * (1 + 0.02 * rng.standard_normal(load.size))
            parts.append(pd.DataFrame({"sample": sample, "specimen": name, "normal_load_N": load, "static_N": force}))
    return pd.concat(parts, ignore_index=True)


def differences(seed: int, **design: float | bool) -> pd.DataFrame:
    return paired_differences(fit_samples(both_ways(seed, **design), "static", AREA_M2))  # type: ignore[arg-type]


def test_the_difference_is_known_better_than_by_two_samples_of_their_own_specimens() -> None:
    found = pd.concat([differences(seed) for seed in range(20)])
    assert (found["u"] / found["unpaired_u"]).median() < 0.5


@pytest.mark.slow
def test_95_percent_intervals_of_the_difference_hold_it() -> None:
    truth = {"mu": 0.3, "tau0_kPa": 1.0, "T_N": (0.3 * 10e3 + 1e3) * AREA_M2}
    found = pd.concat([differences(1000 + seed) for seed in range(300)])
    assert 0.93 <= found["number"].map(truth).between(found["low"], found["high"]).mean() <= 0.97


def test_only_samples_that_share_two_specimens_are_compared() -> None:
    assert differences(0, shared=False).empty
    assert differences(0, specimens=1).empty
    found = differences(0, specimens=2).iloc[0]
    assert found[["sample", "other", "dof", "specimens"]].tolist() == ["Sx", "Sy", 1.0, "S0;S1"]


def test_a_difference_beyond_chance_has_a_small_p_and_names_its_specimens() -> None:
    table = differences(3, own=0.02, specimens=6)
    assert list(table["number"]) == ["mu", "tau0_kPa", "T_N"]
    assert table["specimens"][0] == "S0;S1;S2;S3;S4;S5"
    assert table["p"].between(0, 1).all()
    assert table["p"][2] < 0.05


def test_a_fit_of_a_campaign_carries_the_difference_of_its_directions(tmp_path: Path) -> None:
    laws = {name: DESIGN.laws[name] for name in ("F", "Sx", "Sy")}
    few = replace(DESIGN, laws=laws, masses_g=(5.0, 50.0, 138.5), repeats=1)
    made = write_made(tmp_path / "made", "testxpert", seed=1, design=few)
    study = stages.study(load_campaign(made.folder), until="fit")
    assert study.differences is not None
    assert set(study.differences["sample"] + study.differences["other"]) == {"SxSy"}
    assert len(study.differences) == 6
    fits = {(f.sample, f.regime): f for f in study.fits}
    for row in study.differences.itertuples():
        if row.number == "mu":
            apart = fits["Sx", row.regime].value("mu") - fits["Sy", row.regime].value("mu")
            assert row.difference == pytest.approx(apart)
