"""Every percentage and every count of a report is that of its CSV files, to the digit and with its sign."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from report.recomputed import Page, Written, unchecked
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


# wordings that a tribologist had to read twice, each with what stands for it now
RIDDLES = {
    r"less one": "difference from the model",
    r"100 \(measured / model . 1\) against": "difference of measured from modelled friction",
    r"\+-": "±",
    r"does as well in": "a law is as good in ... of the cases",
    r"A law was found": "the law itself",
    r"beyond the 95 % interval in \d": "the number of loads",
    r"times the error that is stated for it": "times its stated error",
    r"except at \d+ of": "at how many it agrees",
    r"(?<![\w.e])-\d+ %": "−, the sign of a number",
}


def test_no_sentence_of_a_report_is_a_riddle(small_report: Path) -> None:
    texts = [text for _, text in Page(small_report / "report.html").texts]
    assert len(texts) > 100
    assert {said: text for said in RIDDLES for text in texts if re.search(said, text)} == {}


@pytest.mark.slow
@pytest.mark.parametrize("series", ["demo", "03", "11-spoiled"])
def test_the_numbers_of_the_reports_of_real_size_are_those_of_their_tables(
    series: str, practice: Callable[[str], Path], tmp_path: Path
) -> None:
    campaign = data_dir() / "example" if series == "demo" else practice(series)
    result = CliRunner().invoke(main, ["report", str(campaign), "-o", str(tmp_path / "out"), "-q"])
    assert result.exit_code in (0, 3), result.output
    judged(written(campaign, tmp_path / "out"))
