"""The paper's tables as they travel with tribo."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tribo import files
from tribo.berardo2019 import published_tables as published


def test_the_area_fractions_follow_from_the_sizes_printed_beside_them() -> None:
    patterned = published.load_table1().query("cavity != 'none'")
    share = np.where(patterned["cavity"] == "circle", np.pi / 4, 1.0)
    cavity = share * patterned["size_x_um"] * patterned["size_y_um"]
    computed = 1 - cavity / (patterned["pitch_x_um"] * patterned["pitch_y_um"])
    np.testing.assert_allclose(patterned["area_fraction_computed"], computed, atol=5e-7)


def test_only_pattern_s_is_printed_with_another_area_fraction_than_its_sizes_give() -> None:
    table = published.load_table1().set_index("sample")
    gap = (table["area_fraction_printed"] - table["area_fraction_computed"]).abs()
    assert list(gap.index[gap > 0.005]) == ["S"]


def test_table_2_has_six_samples_in_two_regimes_measured_and_simulated() -> None:
    table = published.load_table2()
    counts = table.groupby(["regime", "source"])["sample"].nunique()
    assert counts.tolist() == [6, 6, 6, 6]
    assert not table.isna().any().any()
    assert (table[["mu", "mu_sd", "tau0_sd_kPa"]] > 0).all().all()


def test_table_2_holds_the_numbers_printed_in_the_paper(shared: Path) -> None:
    text = (shared / "paper" / "berardo2019-accepted-manuscript.txt").read_text(encoding="utf-8")
    part = text[text.index("### STATIC FRICTION") :]
    printed = [
        [float(x) for x in re.findall(r"\t(\d+\.\d+)", line)]
        for line in part.splitlines()
        if re.match(r"(F|A|B|C|S <sub>[xy]</sub>)\t", line)
    ]
    table = published.load_table2()
    columns = ["mu", "mu_sd", "tau0_kPa", "tau0_sd_kPa"]
    ours = [
        table.query("regime == @regime and source == @source")[columns].to_numpy()
        for regime in ("static", "sliding")
        for source in ("experiment", "simulation")
    ]
    np.testing.assert_array_equal(np.vstack([np.hstack(ours[:2]), np.hstack(ours[2:])]), np.array(printed))


def test_the_model_of_the_paper_has_its_stated_mesh_and_adhesion() -> None:
    value = published.load_model_parameters().set_index("name")["value"]
    assert value["blocks_per_side"] == 85
    assert value["local_static_adhesion"] == 23.45


def test_every_contradiction_says_both_places_and_what_tribo_does() -> None:
    table = published.contradictions()
    assert len(table) >= 10
    assert not table.isna().any().any()


def test_an_installed_wheel_reads_its_own_copy_of_the_data(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(files, "_PACKAGE", tmp_path)
    with pytest.raises(FileNotFoundError):
        files.data_dir()
    (tmp_path / "_data").mkdir()
    assert files.data_dir() == tmp_path / "_data"
