"""The figures of a report are drawn again from the numbers beside them, at other widths and under other names."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pandas as pd
import pytest
from on_the_command_line import run
from support import first_quick

from figures.test_figures import collisions
from tribo.errors import CampaignError
from tribo.figures import FIGURES, style
from tribo.outputs import csv_text
from tribo.records import Study
from tribo.report.drawings import _numbers, redrawn


@pytest.mark.parametrize("width_mm", first_quick([90.0, 190.0]))
@pytest.mark.parametrize("name", list(FIGURES))
def test_no_label_lies_on_another_at_the_width_of_one_column_or_of_two(
    name: str, width_mm: float, study: Study
) -> None:
    numbers = FIGURES[name].numbers(study)
    with style.page(width_mm, editable_text=True):
        figure = FIGURES[name].draw(numbers)
        assert figure.get_figwidth() * 25.4 == pytest.approx(width_mm)
        assert collisions(figure) == []
        assert min(t.get_fontsize() for ax in figure.axes for t in (ax.xaxis.label, *ax.get_xticklabels())) >= 6


@pytest.mark.parametrize("name", first_quick(FIGURES, 3))
def test_numbers_read_from_the_file_beside_a_figure_draw_the_same(name: str, of_two: Study) -> None:
    numbers = FIGURES[name].numbers(of_two)
    again = _numbers(csv_text(numbers))
    first, second = (re.sub(r"\d+\.\d+", "", style.as_svg(FIGURES[name].draw(n))) for n in (numbers, again))
    assert len(first) == pytest.approx(len(second), rel=0.01)


@pytest.mark.slow
def test_figures_of_a_folder_have_text_that_can_be_edited_and_other_names(small_report: Path, tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    for name in ("fig4", "fig6", "agreement"):
        shutil.copy(small_report / "figures" / f"{name}.csv", tmp_path / "figures")
    result = run("figures", tmp_path, "--width", "90", "--names", "B=holes", "-o", tmp_path / "drawn")
    assert result.exit_code == 0, result.output
    svg = (tmp_path / "drawn" / "fig6.svg").read_text(encoding="utf-8")
    assert ">holes</text>" in svg
    assert ">B</text>" not in svg
    width = re.search(r'width="([\d.]+)pt"', svg)
    assert width is not None
    assert float(width[1]) / 72 * 25.4 == pytest.approx(90, abs=0.1)
    pdf = (tmp_path / "drawn" / "fig6.pdf").read_bytes()
    assert b"/TrueType" in pdf or b"/Type42" in pdf or b"CIDFontType2" in pdf
    assert {path.stem for path in (tmp_path / "drawn").glob("*.svg")} == {"fig4", "fig6", "agreement"}


def test_what_cannot_be_drawn_again_is_said(small_report: Path, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="no figures"):
        redrawn(tmp_path)
    with pytest.raises(CampaignError, match="mm"):
        redrawn(small_report, 9.0)
    with pytest.raises(CampaignError, match="Q"):
        redrawn(small_report, names={"Q": "other"})
    assert run("figures", small_report, "--names", "B", "-o", tmp_path / "drawn").exit_code == 2
    refused = run("figures", small_report, "-o", small_report / "figures")
    assert refused.exit_code == 1
    assert "there already" in refused.output


def test_one_figure_that_fails_is_named_and_the_others_are_drawn(small_report: Path, tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    for name in ("fig4", "fig6", "agreement"):
        shutil.copy(small_report / "figures" / f"{name}.csv", tmp_path / "figures")
    fig6 = tmp_path / "figures" / "fig6.csv"
    table = pd.read_csv(fig6, dtype=str)
    table.drop(columns="sample").to_csv(fig6, index=False)
    (tmp_path / "figures" / "fig4.csv").write_text("sample,normal_load_N\nF,much\n", encoding="utf-8")
    result = run("figures", tmp_path, "-o", tmp_path / "drawn")
    assert result.exit_code == 1
    assert "fig6.csv" in result.output
    assert "fig4.csv" in result.output
    assert "agreement.csv" not in result.output
    assert {path.name for path in (tmp_path / "drawn").iterdir()} == {"agreement.svg", "agreement.pdf"}
