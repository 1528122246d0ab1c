"""The zero of force and load: for a campaign, for one test, on the command line; the nearest to the test counts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from support.campaigns import FLAT_TOML, written

import tribo
from tribo.campaign import load_campaign
from tribo.campaign.load import with_zeros
from tribo.cli import main
from tribo.errors import CampaignError

RATE = 50.0


def campaign(folder: Path, of_campaign: str = "", of_test: str = "") -> Path:
    """Three pulls whose force before contact is 0.4 N; the second has a zero of its own."""
    exports = {}
    for k in range(3):
        noise = 0.01 * np.random.default_rng(k).standard_normal(900)
        force = np.concatenate([np.full(150, 0.4), np.linspace(0.4, 3.4, 50), np.full(700, 2.4)]) + noise
        rows = (f"{t:.2f},{f:.4f}" for t, f in zip(np.arange(900) / RATE, force, strict=True))
        exports[f"T{k}.csv"] = "\n".join(["time [s],force [N]", *rows]) + "\n"
    tests = [f"T{k},raw/T{k}.csv,F,F1,{k + 1},{of_test if k == 1 else ''}" for k in range(3)]
    header = "test_id,file,sample,specimen,normal_load_N,zero"
    return written(folder, FLAT_TOML.format(title="zeros", more=of_campaign), [header, *tests], exports)


def zeros(folder: Path, out: Path, *options: str) -> list[float]:
    if not options:
        return [pull.zero_N for pull in tribo.ingest(load_campaign(folder)).pulls.values()]
    result = CliRunner().invoke(main, ["ingest", str(folder), "-o", str(out), *options])
    assert result.exit_code == 0, result.output
    return list(pd.read_csv(out / "tests.csv")["zero_N"])


@pytest.mark.parametrize(
    ("of_campaign", "of_test", "options", "expected"),
    [
        ("", "", (), [0.4, 0.4, 0.4]),
        ('zero = "none"', "", (), [0.0, 0.0, 0.0]),
        ('zero = "none"', "0.1", (), [0.0, 0.1, 0.0]),
        ("zero = [0.5, 2.5]", "none", (), [0.4, 0.0, 0.4]),
        ("zero = 0.3", "", (), [0.3, 0.3, 0.3]),
        ("", "none", ("--zero", "0.2"), [0.2, 0.0, 0.2]),
        ('zero = "none"', "", ("--zero", "before contact"), [0.4, 0.4, 0.4]),
    ],
)
def test_the_nearest_zero_counts(
    tmp_path: Path, of_campaign: str, of_test: str, options: tuple[str, ...], expected: list[float]
) -> None:
    found = zeros(campaign(tmp_path / "c", of_campaign, of_test), tmp_path / "out", *options)
    assert found == pytest.approx(expected, abs=0.01)


def test_a_zero_that_is_none_names_its_place_and_what_is_allowed(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"campaign.toml, row 4, column campaign.zero: a zero must be"):
        load_campaign(campaign(tmp_path / "a", 'zero = "maybe"'))
    (fault,) = load_campaign(campaign(tmp_path / "b", "", "maybe")).set_aside
    assert "row 3, column zero: not a zero; found 'maybe'; allowed: \"before contact\"" in fault.reason
    result = CliRunner().invoke(main, ["ingest", str(tmp_path / "b"), "-o", str(tmp_path / "o"), "--zero", "maybe"])
    assert result.exit_code == 2
    assert "a zero must be" in result.output


def test_without_a_choice_the_campaign_stays_as_it_is(tmp_path: Path) -> None:
    loaded = load_campaign(campaign(tmp_path / "c"))
    assert with_zeros(loaded) is loaded
