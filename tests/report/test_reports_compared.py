"""Two reports side by side: what differs is computed from their tables, and nothing in them can run on the page."""

from __future__ import annotations

import errno
import math
import os
import re
import shutil
from pathlib import Path

import h5py
import pandas as pd
import pytest
from on_the_command_line import run

from report.conftest import Written
from tribo.report import compare_reports as reported, verify
from tribo.report.compare_reports import common_load_N, differences, read_reported
from tribo.site.index_page import comparable


@pytest.fixture(scope="module")
def changed(written: Written, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same report with static friction of B 30 % higher, and a title that means harm."""
    folder = tmp_path_factory.mktemp("changed") / "out"
    shutil.copytree(written.out, folder)
    fits = pd.read_csv(folder / "fits.csv")
    here = (fits["sample"] == "B") & (fits["regime"] == "static")
    columns = [c for c in fits.columns if c.startswith(("mu", "tau0"))]
    fits.loc[here, columns] *= 1.3
    fits.loc[here, [c for c in fits.columns if c.startswith("cov")]] *= 1.3**2
    fits.to_csv(folder / "fits.csv", index=False)
    with h5py.File(folder / "campaign.nc", "r+") as file:
        file.attrs["title"] = "<script>alert(1)</script>"
    return folder


def test_a_report_does_not_differ_from_itself(written: Written) -> None:
    report = read_reported(written.out)
    table = differences(report, report)
    assert len(table) == 3 * len(report.fits)
    assert (table["difference"] == 0).all()
    assert not table["distinct"].any()


def test_a_change_is_found_with_its_size_and_the_interval_of_both(written: Written, changed: Path) -> None:
    first, second = read_reported(written.out), read_reported(changed)
    table = differences(first, second)
    other = table[(table["sample"] == "B") & (table["regime"] == "static")]
    assert other["difference_percent"].to_numpy() == pytest.approx([30.0] * 3)
    assert (table.drop(other.index)["difference"] == 0).all()
    fit = first.fits[(first.fits["sample"] == "B") & (first.fits["regime"] == "static")].iloc[0]
    low, high = "mu_low", "mu_high"
    half = (fit[high] - fit[low]) / 2
    mu = other[other["quantity"] == "mu"].iloc[0]
    assert (mu["difference_high"] - mu["difference_low"]) / 2 == pytest.approx(math.hypot(half, 1.3 * half))
    load = common_load_N(first, second)
    force = other[other["quantity"] == "T_N"].iloc[0]
    assert force["first"] == pytest.approx(fit["mu"] * load + 1e3 * fit["tau0_kPa"] * first.area_m2)
    assert mu["distinct"] == (abs(mu["difference"]) > math.hypot(half, 1.3 * half))


def test_the_command_writes_a_page_that_is_whole_and_in_which_nothing_runs(
    written: Written, changed: Path, tmp_path: Path
) -> None:
    out = tmp_path / "compared"
    result = run("compare-reports", written.out, changed, "-o", out)
    assert result.exit_code == 0, result.output
    assert "Static T of B is 30 % higher" in result.stdout
    page = (out / "compare.html").read_text(encoding="utf-8")
    assert "<script>alert(1)" not in page
    assert "&lt;script&gt;alert(1)" in page
    assert len(re.findall("<script", page)) == 1
    assert page.count("data:image/svg+xml;base64,") >= 8
    links = {link for link in re.findall(r'href="([^"#]+)"', page) if not link.startswith("compare.csv")}
    assert all((out / link).resolve().is_file() for link in links)
    assert len(pd.read_csv(out / "compare.csv")) == 3 * len(read_reported(changed).fits)
    assert verify(out).unchanged
    assert run("compare-reports", written.out, changed, "-o", out, "-q").exit_code == 0


def test_a_campaign_beside_two_reports_is_no_input_of_their_comparison(written: Written, tmp_path: Path) -> None:
    for name in ("a", "b"):
        shutil.copytree(written.out, tmp_path / name, ignore=shutil.ignore_patterns("figures", "*.pdf"))
    assert run("compare-reports", tmp_path / "a", tmp_path / "b", "-o", tmp_path / "out").exit_code == 0
    (tmp_path / "campaign" / "raw").mkdir(parents=True)
    for name in ("campaign.toml", "tests.csv", "raw/T1.csv"):
        (tmp_path / "campaign" / name).write_text("x")
    assert verify(tmp_path / "out").unchanged
    (tmp_path / "b" / "fits.csv").write_text("x")
    assert [d.file for d in verify(tmp_path / "out").differences] == ["b/fits.csv"]


@pytest.mark.parametrize("name", ["fits.csv", "campaign.nc"])
def test_a_report_that_the_system_cannot_read_is_not_left_out_of_a_comparison(
    written: Written, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def failing(*_: object, **__: object) -> None:
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE), name)

    monkeypatch.setattr(*((h5py, "File") if name == "campaign.nc" else (reported, "text_of")), failing)
    with pytest.raises(OSError, match=name):
        comparable(written.out.parent, [written.out.name])


def test_a_folder_without_a_report_is_refused_by_its_name(written: Written, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    result = run("compare-reports", written.out, tmp_path / "empty", "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "no folder of results" in result.stderr
    assert not (tmp_path / "out").exists()
