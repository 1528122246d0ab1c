"""A figure is drawn once for the same numbers, the same on several processes, and reads on light and on dark.

A point under the pointer says the numbers that were plotted, from where it stands on the page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tribo.records import Study
from tribo.report import drawings
from tribo.report.drawings import MOST_POINTS, Drawn, draw_all, inline_svg, points_of, svg_text


@dataclass(frozen=True)
class Kept:
    """All figures of a study, drawn in this process, and the folder that keeps them."""

    figures: Mapping[str, Drawn]
    folder: Path


@pytest.fixture(scope="module")
def kept(measured: Study, tmp_path_factory: pytest.TempPathFactory) -> Kept:
    folder = tmp_path_factory.mktemp("kept")
    return Kept(draw_all(measured, kept=folder), folder)


def test_a_kept_figure_is_not_drawn_again_unless_its_numbers_change(
    measured: Study, kept: Kept, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = kept.figures
    drawn = []
    noted = lambda record, numbers, origin: drawn.append(record.name) or ("", [])  # noqa: E731
    monkeypatch.setattr(drawings, "_svg_and_points", noted)
    monkeypatch.setattr(drawings, "figure_files", lambda svg, title, origin: {})
    again = draw_all(measured, kept=kept.folder)
    assert drawn == []
    assert {n: f.files["svg"] for n, f in again.items()} == {n: f.files["svg"] for n, f in first.items()}
    ingested = measured.ingested
    pulls = {**ingested.pulls, "T0001": replace(ingested.pulls["T0001"], static_N=9.0)}
    draw_all(replace(measured, ingested=replace(ingested, pulls=pulls)), kept=kept.folder)
    assert set(drawn) == {"fig4", "fig6", "dependence", "forces"}  # no other one shows the static force of a pull


@pytest.mark.slow
def test_several_processes_draw_the_same_bytes(measured: Study, kept: Kept) -> None:
    one, two = kept.figures, draw_all(measured, jobs=2)
    assert list(one) == list(two)
    assert all(one[name].files == two[name].files for name in one)


def test_ink_and_paper_follow_the_theme_but_not_under_a_colour_scale() -> None:
    paths = '<path style="fill: #000000; stroke: #ffffff"/><g style="fill: #666666"/>'
    ink = f'<svg width="1" height="2" viewBox="0 0 1 2">{paths}'
    plain = inline_svg(ink + "</svg>", "a", "label")
    assert "fill: currentColor; stroke: var(--paper)" in plain
    assert "fill: var(--soft)" in plain
    scaled = inline_svg(ink + '<image href="data:x"/></svg>', "a", "label")
    assert "fill: #000000; stroke: #ffffff" in scaled
    assert 'class="on-paper"' in scaled


def test_points_that_look_alike_say_their_style_once() -> None:
    alike = "".join(f'<use xlink:href="#m1" x="{k}.123456" y="2" style="fill: #0072b2"/>\n' for k in range(3))
    other = '<use xlink:href="#m1" x="9" y="2" style="fill: #d55e00"/>'
    body = inline_svg(f'<svg viewBox="0 0 1 1">{alike}{other}</svg>', "fig6", "label")
    assert body.count("fill: var(--blue)") == 1
    assert [f'<use xlink:href="#fig6-m1" x="{k}.12" y="2.00"/>' in body for k in range(3)] == [True] * 3
    assert '<use xlink:href="#fig6-m1" x="9" y="2" style="fill: #d55e00"/>' in body


def test_the_names_inside_a_figure_are_its_own() -> None:
    body = inline_svg('<svg viewBox="0 0 1 1"><defs><path id="m1"/></defs><use href="#m1"/></svg>', "fig6", "label")
    assert 'id="fig6-m1"' in body
    assert 'href="#fig6-m1"' in body


@pytest.fixture
def figure() -> Figure:
    figure = Figure(figsize=(4, 3))
    ax = figure.subplots()
    ax.set_title("A", loc="left")
    ax.set_xlabel("N (N)")
    ax.set_ylabel("T (N)")
    ax.errorbar([1, 2], [3, np.nan], [0.1, 0.1], fmt="o", label="measured")
    ax.plot(np.linspace(0, 1, 1000), np.zeros(1000), label="model")
    ax.set_xlim(0, 4)
    ax.set_ylim(0, 6)
    svg_text(figure)
    return figure


def test_every_mark_is_found_and_the_caps_of_its_bar_are_not(figure: Figure) -> None:
    marks, line = points_of(figure)
    assert marks["value"] == [1.0, 3.0]
    assert (marks["name"], marks["x"], marks["y"]) == ("A", "N (N)", "T (N)")
    assert len(line["value"]) <= 4 * MOST_POINTS
    assert line["name"] == "A, model"


def test_the_place_is_that_on_the_page_from_the_top_left(figure: Figure) -> None:
    box = figure.axes[0].get_position()
    x, y = points_of(figure)[0]["place"]
    assert x == pytest.approx((box.x0 + box.width / 4) * 4 * 72, abs=0.05)
    assert y == pytest.approx((1 - box.y0 - box.height / 2) * 3 * 72, abs=0.05)
