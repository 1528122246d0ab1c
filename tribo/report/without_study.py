"""What tribo discover writes: laws, the table of scores, and the record of a test of a law.

Output of the diagnosis of a published table: verdict.json, and its figures with their numbers.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribo.diagnostics.verdict import plain
from tribo.figures.catalogue import PUBLISHED_FIGURES
from tribo.files import write_bytes, write_text
from tribo.lawsearch.across_patterns import table_of
from tribo.lawsearch.diagnosis_with_laws import law_layers
from tribo.lawsearch.law_file import law_text
from tribo.report.drawings import figure_files, svg_text
from tribo.report.provenance import Provenance, read_record, settle_outputs, write_provenance
from tribo.report.tables import to_csv
from tribo.report.verdict_file import write_verdict
from tribo.wording.law_sentences import discovery_sentence, held_sentence, subject
from tribo.wording.part_sentences import layer_sentence

if TYPE_CHECKING:
    from tribo.berardo2019.table_diagnosis import PublishedDiagnosis
    from tribo.lawsearch.across_patterns import AcrossPatterns
    from tribo.lawsearch.known_laws import Validation
    from tribo.lawsearch.search import Discovery


SCHEMA, RECORD = "tribo.discovery/1", "discovery.json"


@dataclass(frozen=True)
class Written:
    """What was written, as a record and in words."""

    record: dict[str, Any]
    text: str


def write_discovery(d: Discovery, title: str, out: Path, provenance: Provenance) -> Written:
    """law-1.toml and further laws, law.svg and law.csv (the figure), laws.csv (the best of all that were tried),
    discovery.json and provenance.json."""
    import pandas as pd

    from tribo.figures.extended_model import draw_law, law_numbers_of
    from tribo.figures.style import as_svg

    text = discovery_sentence(d)
    laws = law_texts(d, title)
    rows = [
        {
            "formula": s.law.formula(), "regime": s.law.regime, "where": s.law.where, "log_likelihood_gain": s.gain,
            "net_of_choosing": s.net, "acts_on": subject(s.law),
        }
        for s in d.scored
    ]  # fmt: skip
    record: dict[str, Any] = {
        "schema": SCHEMA, "text": text, "laws_tried": d.searched,
        "layers": [plain(replace(layer, text=layer_sentence(layer))) for layer in law_layers(d)],
        "ties": [len(f.ties) for f in d.laws],
    }  # fmt: skip
    numbers = law_numbers_of(d)
    figure = {} if numbers.empty else {"law.svg": as_svg(draw_law(numbers)), "law.csv": to_csv(numbers)}
    _write({**laws, **figure, "laws.csv": to_csv(pd.DataFrame(rows)), RECORD: _json(record)}, out, provenance)
    return Written(record, text)


def law_texts(d: Discovery, title: str) -> dict[str, str]:
    """law-1.toml and so on by name, found in the campaign of this title."""
    return {f"law-{k}.toml": law_text(found.law, found.parameters, title) for k, found in enumerate(d.laws, start=1)}


def write_validation(held: Validation, out: Path, provenance: Provenance) -> Written:
    """discovery.json of the test of one law, and provenance.json."""
    text = held_sentence(held)
    own = {"answer": held.answer, "found": plain(held.found), "earlier": plain(held.earlier), "text": text}
    record: dict[str, Any] = {"schema": SCHEMA, **own}
    _write({RECORD: _json(record)}, out, provenance)
    return Written(record, text)


def _json(record: dict[str, Any]) -> str:
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _write(texts: dict[str, str], out: Path, provenance: Provenance) -> None:
    before = read_record(out)
    written = [write_text(out / name, text) for name, text in texts.items()]
    write_provenance(provenance, out, settle_outputs(out, before, provenance, written, complete=True))


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
