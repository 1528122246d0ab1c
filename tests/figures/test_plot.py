"""tribo.plot has a function for every figure of a report; each gives a Figure, or says why it cannot."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from matplotlib.figure import Figure

import tribo
from tribo import plot
from tribo.errors import TriboError
from tribo.figures import DIAGNOSIS_FIGURES, FIGURES, FRICTION_FIGURES, PUBLISHED_FIGURES
from tribo.records import Study

OF_ONE = {"pull", "run"}
OF_A_STUDY = ("agreement", "pulls", "ratio_against_pressure", "simulated_pulls", "static_force", "sliding_force",
              "laws_against_area", "traces")  # fmt: skip


def test_every_figure_of_a_report_has_its_function_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def note(name: str, record: Any, width_mm: float) -> None:
        asked.append(name)

    monkeypatch.setattr(plot, "_drawn", note)
    for name in set(dir(plot)) - OF_ONE:
        getattr(plot, name)(None)
    assert sorted(asked) == sorted([*FIGURES, *FRICTION_FIGURES, *DIAGNOSIS_FIGURES, *PUBLISHED_FIGURES])


@pytest.mark.parametrize("name", OF_A_STUDY)
def test_a_study_gives_a_figure_without_a_file_or_a_window(name: str, study: Study) -> None:
    assert isinstance(getattr(plot, name)(study), Figure)


def test_a_figure_is_as_wide_as_asked(study: Study) -> None:
    widths = [plot.static_force(study, **asked).get_figwidth() * 25.4 for asked in ({}, {"width_mm": 90.0})]
    assert widths == pytest.approx([190.0, 90.0])


def test_a_figure_shows_itself_in_a_notebook(study: Study) -> None:
    svg = plot.run(study.example_runs[0])._repr_svg_()  # type: ignore[attr-defined]
    assert "<svg" in svg
    assert svg == plot.run(study.example_runs[0])._repr_svg_()  # type: ignore[attr-defined]


def test_a_pull_is_drawn_in_newton_with_its_peak(study: Study) -> None:
    pull = study.ingested.pulls["T0001"]
    lines = plot.pull(study.ingested, "T0001").axes[0].lines
    assert [(pull.peak_s, pull.static_N)] == [tuple(line.get_xydata()[0]) for line in lines if line.get_marker() == "v"]


def test_what_cannot_be_drawn_is_said(study: Study) -> None:
    with pytest.raises(TriboError, match="Ratio of measured to simulated"):
        plot.agreement(replace(study, comparison=None))
    with pytest.raises(TriboError, match="T0"):
        plot.pull(study.ingested, "T0")


def test_the_names_are_listed() -> None:
    assert "plot" in dir(tribo)
    assert set(plot.__all__) == set(dir(plot)) >= OF_ONE
    assert {"FIGURES", "DIAGNOSIS_FIGURES"} <= set(dir(tribo.figures))
