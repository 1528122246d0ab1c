"""Columns that are one and the same are tested once; copied readings have no scatter and show nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.campaigns import written

import tribo
from tribo import stages
from tribo.campaign import load_campaign
from tribo.diagnostics.column_search import same_columns
from tribo.diagnostics.verdict import Verdict

from .test_without_model import Change, Further, made, verdict_of

TOML = '[campaign]\ntitle = "copies"\nnominal_area_mm2 = 55.0\n[patterns.F]\ncavity = "none"\n'
ALIASES: dict[str, Further] = {
    "copy": lambda row: {"other": row["speed_mm_s"]},
    "another unit": lambda row: {"other": row["speed_mm_s"] / 31.4},
    "falling": lambda row: {"other": 12.0 - 3.0 * row["speed_mm_s"]},
    "logarithm": lambda row: {"other": float(np.log(row["speed_mm_s"]))},
    "words": lambda row: {"other": {0.1: "slow", 1.0: "medium", 10.0: "fast"}[row["speed_mm_s"]]},
}


def curved(row: dict[str, Any]) -> float:
    """A change with the speed that no trend describes, 15 % at most."""
    x = float(np.log10(row["speed_mm_s"]))
    return 0.05 * x + 0.1 * x**2


@pytest.mark.parametrize("alias", list(ALIASES))
@pytest.mark.parametrize("seed", [1, 2])
def test_a_column_and_its_alias_are_one_column_that_is_tested_once(tmp_path: Path, alias: str, seed: int) -> None:
    found = verdict_of(made(tmp_path / "c", curved, seed, columns=ALIASES[alias]))
    assert [cause.mechanism for cause in found.causes] == ["velocity_dependence"]
    assert len(found.causes[0].parameters) == 1
    assert all(abs(e.value) < 30 for e in found.causes[0].parameters.values())  # the hidden change is 16 % at most
    assert "The pull speed and other are the same column" in found.text
    assert found.equivalent == (("velocity_dependence", "covariate:other"),)


def test_a_run_order_with_two_aliases_is_named_once_and_never_beyond_its_data(tmp_path: Path) -> None:
    change: Change = lambda row: 0.004 * row["run_order"] + 0.1 * np.sin(row["run_order"] / 8)  # noqa: E731
    further: Further = lambda row: {"wear_m": 3 * row["run_order"] + 1, "wear2": row["run_order"] ** 2}  # noqa: E731
    found = verdict_of(made(tmp_path / "c", change, seed=2, columns=further))
    assert [cause.mechanism for cause in found.causes] == ["covariate:run_order"]
    hidden = [change({"run_order": k}) for k in range(1, 61)]
    most = 100 * np.expm1(max(hidden) - min(hidden) + 6 * 0.03)
    assert all(abs(e.value) < most for cause in found.causes for e in cause.parameters.values())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_column_that_is_nearly_another_is_not_extrapolated(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    further: Further = lambda row: {"near": row["run_order"] + rng.normal(0.0, 0.5)}  # noqa: E731
    change: Change = lambda row: 0.1 * np.sin(row["run_order"] / 8)  # noqa: E731
    found = verdict_of(made(tmp_path / "c", change, seed, columns=further))
    sizes = [abs(e.value) for cause in found.causes for e in cause.parameters.values()]
    assert sizes
    assert max(sizes) < 100 * np.expm1(0.2 + 6 * 0.03)


def test_columns_that_differ_in_one_test_are_two(tmp_path: Path) -> None:
    odd: Further = lambda row: {"other": 5.0 if row["run_order"] == 7 else row["speed_mm_s"]}  # noqa: E731
    found = verdict_of(made(tmp_path / "c", lambda row: 0.0, columns=odd))
    assert "same column" not in found.text
    assert same_columns(()) == ()


def identical(folder: Path) -> Verdict:
    """Thirty-two tests at four loads whose repeats are equal to the last digit."""
    rng = np.random.default_rng(5)
    rows = []
    for k, load in enumerate(rng.permutation(np.repeat([1.0, 2.0, 4.0, 8.0], 8))):
        force = 0.5123 * load**0.9
        rows.append(f"T{k},F,S{k % 3},{load},{k + 1},{20 + rng.normal():.3f},{force:.9g},{0.8 * force:.9g}")
    head = "test_id,sample,specimen,normal_load_N,run_order,temperature_C,static_N,sliding_N"
    study = tribo.study(load_campaign(written(folder, TOML, [head, *rows])), tribo.StudyOptions(no_model=True))
    return stages.diagnosis_without_model(study).verdict


def test_repeats_without_scatter_show_no_effect_and_are_named_as_copies(tmp_path: Path) -> None:
    found = identical(tmp_path / "c")
    assert (found.verdict, found.causes) == ("no_misfit", ())
    assert "Forces are equal to the last digit in T" in found.text


def test_two_repeats_of_exactly_zero_are_set_aside_from_the_fit_with_the_reason(tmp_path: Path) -> None:
    forces = [0.0, 0.0, 1.0, 1.01, 2.0, 2.03, 4.0, 4.1]
    loads = [1, 1, 2, 2, 4, 4, 8, 8]
    rows = [f"T{k},F,S1,{n},{f},{f}" for k, (n, f) in enumerate(zip(loads, forces, strict=True))]
    head = "test_id,sample,specimen,normal_load_N,static_N,sliding_N"
    campaign = load_campaign(written(tmp_path / "c", TOML, [head, *rows]))
    study = tribo.study(campaign, tribo.StudyOptions(no_model=True))
    for fit in study.fits:
        assert fit.mu == pytest.approx(0.507, abs=0.02)
        assert fit.n_tests == 6
        assert any("exactly 0 N" in note and "T0, T1" in note for note in fit.notes)
