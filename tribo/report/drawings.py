"""Figures to files: SVG, PNG and the plotted numbers as CSV, the same bytes for the same study."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from tribo.figures.catalogue import FIGURES
from tribo.figures.record import StudyFigure
from tribo.figures.style import house_style
from tribo.records import Study
from tribo.report.files import write_bytes, write_text
from tribo.report.tables import to_csv

Progress = Callable[[str, int, int], None]
STAGE = "drawing figures"
PNG_DPI = 300


def write_figures(study: Study, out: Path, progress: Progress | None = None) -> dict[str, str]:
    """Write out/figures/NAME.svg, .png and .csv of every figure the study has the numbers for.

    Returns the SVG text of each figure drawn, by name, so that a page can show it without drawing it again.
    """
    drawn = {}
    for done, figure in enumerate(FIGURES.values(), start=1):
        svg = _write_one(study, figure, out / "figures")
        if svg:
            drawn[figure.name] = svg
        if progress is not None:
            progress(STAGE, done, len(FIGURES))
    return drawn


def _write_one(study: Study, record: StudyFigure, folder: Path) -> str:
    numbers = record.numbers(study)
    if numbers.empty:
        return ""
    figure = record.draw(numbers)
    _settle(figure)
    svg = svg_text(figure)
    write_text(folder / f"{record.name}.csv", to_csv(numbers))
    write_text(folder / f"{record.name}.svg", svg)
    write_bytes(folder / f"{record.name}.png", png_bytes(figure))
    return svg


def draw_all(study: Study) -> dict[str, str]:
    """SVG text of every figure the study has the numbers for, by name; nothing is written."""
    drawn = {}
    for record in FIGURES.values():
        numbers = record.numbers(study)
        if not numbers.empty:
            figure = record.draw(numbers)
            _settle(figure)
            drawn[record.name] = svg_text(figure)
    return drawn


def _settle(figure: Figure) -> None:
    """Lay the figure out once, so that each rendering need not do it again."""
    with house_style():
        figure.draw_without_rendering()
        figure.set_layout_engine("none")


# The canvases are called directly: Figure.savefig draws every figure once more than it needs to.
def svg_text(figure: Figure) -> str:
    """A settled figure as SVG without a date and without random names."""
    buffer = io.StringIO()
    with house_style():
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None, "Creator": "tribo"})
    return buffer.getvalue()


def png_bytes(figure: Figure) -> bytes:
    """A settled figure as PNG at print resolution, without the version of the program that drew it."""
    buffer = io.BytesIO()
    with house_style():
        figure.set_dpi(PNG_DPI)
        FigureCanvasAgg(figure).print_png(buffer, metadata={"Software": None})
    return buffer.getvalue()


def inline_svg(svg: str, name: str, label: str) -> str:
    """An SVG to stand inside an HTML page: names unique to it, a label for screen readers, theme colours.

    White paper becomes transparent and black ink the colour of the text, so that it reads on light and dark.
    """
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", body)
    body = re.sub(r"(fill|stroke): #ffffff", r"\1: var(--paper)", body)
    body = re.sub(r"(fill|stroke): #000000", r"\1: currentColor", body)
    body = re.sub(r"(fill|stroke): #0072b2", r"\1: var(--blue)", body)
    body = re.sub(r'<svg([^>]*?) (width|height)="[^"]*"', r"<svg\1", body, count=1)
    body = re.sub(r'<svg([^>]*?) (width|height)="[^"]*"', r"<svg\1", body, count=1)
    body = body.replace("<svg", f'<svg role="img" aria-label="{label}"', 1)
    return "\n".join(line.rstrip() for line in body.splitlines())
