"""A point under the pointer says the numbers that were plotted, from where it stands on the page."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from tribo.report.drawings import MOST_POINTS, points_of, svg_text


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
