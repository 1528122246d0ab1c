"""What a diagnosis of a published table leaves in OUT: verdict.json, and its figures with their numbers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tribo.figures.catalogue import PUBLISHED_FIGURES
from tribo.report.diagnosis import write_verdict
from tribo.report.drawings import svg_text
from tribo.report.files import write_bytes, write_text
from tribo.report.tables import to_csv
from tribo.report.typeset import figure_files

if TYPE_CHECKING:
    from tribo.diagnose.published import PublishedDiagnosis


def write_published(d: PublishedDiagnosis, out: Path) -> None:
    """Write out/verdict.json and out/figures/NAME.svg, .pdf, .png and .csv."""
    write_verdict(d.verdict.as_dict(), out)
    origin = f"published table {d.source}"
    for figure in PUBLISHED_FIGURES.values():
        numbers = figure.numbers(d)
        svg = svg_text(figure.draw(numbers), figure.title, origin)
        write_text(out / "figures" / f"{figure.name}.csv", to_csv(numbers))
        write_text(out / "figures" / f"{figure.name}.svg", svg)
        for ending, content in figure_files(svg.encode("utf-8"), figure.title, origin).items():
            write_bytes(out / "figures" / f"{figure.name}.{ending}", content)
