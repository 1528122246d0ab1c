"""Output of the diagnosis of a published table: verdict.json, and its figures with their numbers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tribo.diagnose.discovery.across_words import table_of
from tribo.figures.catalogue import PUBLISHED_FIGURES
from tribo.report.drawings import svg_text
from tribo.report.paper.typeset import figure_files
from tribo.report.provenance import Provenance, read_record, settle_outputs, write_provenance
from tribo.report.result_tables import to_csv
from tribo.report.verdict_file import write_verdict
from tribo.store.whole_files import write_bytes, write_text

if TYPE_CHECKING:
    from tribo.diagnose.discovery.across_patterns import AcrossPatterns
    from tribo.diagnose.from_table.published_diagnosis import PublishedDiagnosis


def write_published(d: PublishedDiagnosis, across: AcrossPatterns, out: Path, provenance: Provenance) -> None:
    """Write out/verdict.json, out/across-patterns.csv, out/figures/NAME.svg, .pdf, .png and .csv, and provenance.json
    with the hash of each."""
    before = read_record(out)
    laws = write_text(out / "across-patterns.csv", to_csv(table_of(across)))
    written = [write_verdict(d.verdict.as_dict(), out), laws]
    origin = f"published table {d.source}; {provenance.origin}"
    for figure in PUBLISHED_FIGURES.values():
        numbers = figure.numbers(d)
        svg = svg_text(figure.draw(numbers), figure.title, origin).encode("utf-8")
        files = {"csv": to_csv(numbers).encode("utf-8"), "svg": svg, **figure_files(svg, figure.title, origin)}
        written += [write_bytes(out / "figures" / f"{figure.name}.{end}", files[end]) for end in files]
    write_provenance(provenance, out, settle_outputs(out, before, provenance, written, complete=True))
