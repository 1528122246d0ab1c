"""What is written where there is no study: laws found, the diagnosis of a published table, the page of tribo demo."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from tribo import __version__
from tribo.diagnostics.verdict import plain
from tribo.figures.catalogue import PUBLISHED_FIGURES
from tribo.files import text_of, write_text
from tribo.lawsearch.across_patterns import table_of
from tribo.lawsearch.diagnosis_with_laws import law_layers
from tribo.lawsearch.known_laws import law_text
from tribo.outputs import csv_text, product
from tribo.report.drawings import figure_files, inline_svg, svg_text
from tribo.report.provenance import Provenance, write_results
from tribo.report.shell import STYLE, WORKING, environment, style_and_script
from tribo.wording.law_sentences import discovery_sentence, held_sentence, subject
from tribo.wording.part_sentences import layer_sentence

if TYPE_CHECKING:
    from tribo.berardo2019.table_diagnosis import PublishedDiagnosis
    from tribo.lawsearch.across_patterns import LawsAcross
    from tribo.lawsearch.known_laws import KnownLaw
    from tribo.lawsearch.search import Discovery


SCHEMA, RECORD = "tribo.discovery/1", "discovery.json"


def write_discovery(d: Discovery, title: str, out: Path, provenance: Provenance) -> tuple[dict[str, Any], str]:
    """law-1.toml and further laws, law.svg and law.csv (the figure), laws.csv (the best of all that were tried),
    discovery.json and provenance.json; returns the record and the same in words."""
    import pandas as pd

    from tribo.figures.extended_model import draw_law, law_numbers_of
    from tribo.figures.style import as_svg

    text = discovery_sentence(d)
    rows = [
        {
            "formula": law.formula(), "regime": law.regime, "where": law.where, "log_likelihood_gain": gain,
            "net_of_choosing": net, "acts_on": subject(law),
        }
        for law, gain, net in d.scored
    ]  # fmt: skip
    record: dict[str, Any] = {
        "schema": SCHEMA, "text": text, "laws_tried": d.searched,
        "layers": [plain(replace(layer, text=layer_sentence(layer))) for layer in law_layers(d)],
        "ties": [len(f.ties) for f in d.laws],
    }  # fmt: skip
    numbers = law_numbers_of(d)
    figure = {} if numbers.empty else {"law.svg": as_svg(draw_law(numbers)), "law.csv": numbers}
    laws = {"laws.csv": pd.DataFrame(rows, columns=product("laws.csv", "discover").column_names)}
    write_results(law_texts(d, title) | figure | laws | {RECORD: record}, out, provenance, "discover")
    return record, text


def law_texts(d: Discovery, title: str) -> dict[str, str]:
    """law-1.toml and so on by name, found in the campaign of this title."""
    return {f"law-{k}.toml": law_text(found.law, found.parameters, title) for k, found in enumerate(d.laws, start=1)}


def write_validation(held: KnownLaw, out: Path, provenance: Provenance) -> tuple[dict[str, Any], str]:
    """discovery.json of the test of one law, and provenance.json; returns the record and the same in words."""
    text = held_sentence(held)
    found, earlier = (plain(amplitudes.get("a")) for amplitudes in (held.found, held.parameters))
    own = {"answer": held.answer, "found": found, "earlier": earlier, "text": text}
    record: dict[str, Any] = {"schema": SCHEMA, **own}
    write_results({RECORD: record}, out, provenance, "discover")
    return record, text


def write_published(d: PublishedDiagnosis, across: Sequence[LawsAcross], out: Path, provenance: Provenance) -> None:
    """Write out/verdict.json, out/across-patterns.csv, out/figures/NAME.svg, .pdf, .png and .csv, and provenance.json
    with the hash of each."""
    contents: dict[str, Any] = {"verdict.json": d.verdict.as_dict(), "across-patterns.csv": table_of(across)}
    origin = f"published table {d.source}; {provenance.origin}"
    for figure in PUBLISHED_FIGURES.values():
        numbers = figure.numbers(d)
        svg = svg_text(figure.draw(numbers), figure.title, origin).encode("utf-8")
        files = {"csv": csv_text(numbers), "svg": svg, **figure_files(svg, figure.title, origin)}
        contents |= {f"figures/{figure.name}.{ending}": files[ending] for ending in files}
    write_results(contents, out, provenance, "published")


SECOND = "cause-found"


def write_demo_page(out: Path) -> Path:
    """Write OUT/index.html from the finished reports in OUT and OUT/cause-found; the same bytes for the same reports.

    Parameters
    ----------
    out : Path
        The folder of results of the first example; that of the second lies in it.

    Returns
    -------
    Path
        The page.
    """
    campaigns = []
    for name, folder in (("first", ""), ("second", f"{SECOND}/")):
        figure = text_of(out / folder / "figures" / "finding.svg")
        campaigns.append(
            {
                "folder": folder,
                "card": json.loads(text_of(out / folder / "card.json")),
                "verdict": json.loads(text_of(out / folder / "verdict.json")),
                "figure": Markup(inline_svg(figure, name, "difference of measured from modelled friction, in percent")),
            }
        )
    templates = environment()
    text = templates.get_template("demo.html").render(
        campaigns=campaigns, version=__version__, **style_and_script(templates, [STYLE], WORKING)
    )
    return write_text(out / "index.html", text)
