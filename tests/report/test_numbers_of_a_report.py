"""Every percentage and every count of a report is that of its CSV files, to the digit and with its sign."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from report.recomputed import Written, unchecked
from tribo.campaign import open_campaign
from tribo.cli import main
from tribo.files import data_dir


def written(campaign: Path, out: Path) -> Written:
    with open_campaign(campaign) as c:
        return Written(out, c.flat_sample, c.nominal_area_m2, {name: p.name for name, p in c.samples.items()})


def judged(w: Written) -> None:
    left = unchecked(w)
    assert w.wrong == []
    assert left == []


def test_the_numbers_of_a_small_report_are_those_of_its_tables(small_campaign: Path, small_report: Path) -> None:
    w = written(small_campaign, small_report)
    judged(w)
    assert w.checked > 80


def test_a_percentage_or_a_count_that_is_off_by_one_is_noticed(
    small_campaign: Path, small_report: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "out"
    shutil.copytree(small_report, copy, ignore=shutil.ignore_patterns("kept", "*.nc", "*.pdf"))
    page = copy / "report.html"
    page.write_text(page.read_text(encoding="utf-8").replace("24 tests used", "25 tests used"), encoding="utf-8")
    table = (copy / "comparison.csv").read_text(encoding="utf-8").splitlines()
    head, rows = table[0], [row.split(",") for row in table[1:]]
    at = head.split(",").index("ratio")
    for row in rows:
        row[at] = str(1.5 * float(row[at]))
    (copy / "comparison.csv").write_text("\n".join([head, *map(",".join, rows)]) + "\n", encoding="utf-8")
    w = written(small_campaign, copy)
    unchecked(w)
    assert "used: printed 25, recomputed 24" in w.wrong
    assert len(w.wrong) > 2


@pytest.mark.slow
@pytest.mark.parametrize("series", ["demo", "03", "11-spoiled"])
def test_the_numbers_of_the_reports_of_real_size_are_those_of_their_tables(
    series: str, practice: Callable[[str], Path], tmp_path: Path
) -> None:
    campaign = data_dir() / "example" if series == "demo" else practice(series)
    result = CliRunner().invoke(main, ["report", str(campaign), "-o", str(tmp_path / "out"), "-q"])
    assert result.exit_code in (0, 3), result.output
    judged(written(campaign, tmp_path / "out"))
