"""report.html: one file that works offline and without scripts, on a phone, on paper, light and dark."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tribo import __version__
from tribo.figures import select
from tribo.figures.catalogue import FIGURES
from tribo.records import REGIMES, Regime, Study
from tribo.report import findings, wording
from tribo.report.diagnosis import verdict_in_words
from tribo.report.drawings import draw_all, inline_svg
from tribo.report.files import write_text
from tribo.report.numerals import ratio_text, significant, unbroken
from tribo.report.provenance import Provenance
from tribo.report.pulls import odd_rows, pull_groups
from tribo.report.tables import all_set_aside
from tribo.report.text import fit_cells
from tribo.report.uncertainty import budget_origins, budget_tables

LEAD_FIGURE = "agreement"
VERDICT_MARKS = {"agrees": "=", "model too high": "▲", "model too low": "▼", "cannot tell": "?"}


def write_html(
    study: Study,
    out: Path,
    provenance: Provenance | None = None,
    drawn: Mapping[str, str] | None = None,
    verdict: Mapping[str, Any] | None = None,
) -> Path:
    """Write out/report.html.

    ``drawn`` are SVG texts by figure name where they are at hand already, ``verdict`` the diagnosis in the form
    of verdict.json.
    """
    return write_text(out / "report.html", html(study, provenance, drawn, verdict))


def html(
    study: Study,
    provenance: Provenance | None = None,
    drawn: Mapping[str, str] | None = None,
    verdict: Mapping[str, Any] | None = None,
) -> str:
    """The page as text: the same bytes for the same study, provenance and verdict."""
    drawings = draw_all(study) if drawn is None else drawn
    shown = [_shown(name, svg) for name, svg in drawings.items() if name in FIGURES]
    return (
        _environment()
        .get_template("report.html")
        .render(
            study=study,
            campaign=study.ingested.campaign,
            verdict=verdict_in_words(verdict) if verdict is not None else None,
            summary=_summary(study),
            table2=_table2(study),
            budget=budget_tables(study),
            budget_origins=budget_origins(study),
            agreement=_agreement_tables(study),
            lead=[f for f in shown if f.name == LEAD_FIGURE],
            figures=[f for f in shown if f.name != LEAD_FIGURE],
            calibration=_calibration(study),
            set_aside=list(all_set_aside(study).values()),
            flags=_flag_counts(study),
            odd_pulls=odd_rows(study),
            pull_groups=pull_groups(study),
            provenance=provenance,
            version=__version__,
        )
    )


@lru_cache(maxsize=1)
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("tribo.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["sig"] = significant
    environment.filters["ratio"] = ratio_text
    environment.filters["unbroken"] = unbroken
    return environment


@dataclass(frozen=True)
class ShownFigure:
    """A figure as the page shows it."""

    name: str
    title: str
    caption: str
    svg: Markup


def _shown(name: str, svg: str) -> ShownFigure:
    record = FIGURES[name]
    picture = Markup(inline_svg(svg, name, str(escape(f"{record.title}. {record.caption}"))))
    return ShownFigure(name, record.title, record.caption, picture)


def _summary(study: Study) -> dict[str, Any]:
    agreements = findings.agreements(study)
    return {
        "measured": wording.what_was_measured(study),
        "flat": wording.flat_law(study),
        "model": wording.in_short(agreements, select.flat_sample(study)),
        "order": [wording.ranking_sentence(r) for r in findings.rankings(study)],
        "directions": wording.direction_sentences(findings.direction_ratios(study)),
        "correlation": wording.correlation_note(study),
        "how_to_read": wording.HOW_TO_READ,
    }


def _table2(study: Study) -> dict[str, Any]:
    simulated = study.comparison.simulated if study.comparison is not None else ()
    load = findings.common_loads(study)[1]
    regimes = []
    for regime in REGIMES:
        rows = []
        for sample in select.sample_numbers(study):
            fit = select.fit_of(study.fits, sample, regime)
            if fit is not None:
                model = fit_cells(select.fit_of(simulated, sample, regime), load)
                area_fraction = study.ingested.campaign.area_fraction(sample)
                rows.append((sample, area_fraction, fit_cells(fit, load), model, fit))
        regimes.append((regime, rows))
    return {
        "load_N": load,
        "regimes": [(r, rows) for r, rows in regimes if rows],
        "simulated": bool(simulated),
    }


def _agreement_tables(study: Study) -> list[dict[str, Any]]:
    agreements = findings.agreements(study)
    return [table for regime in REGIMES if (table := _agreement_table(agreements, regime))]


def _agreement_table(agreements: list[findings.Agreement], regime: Regime) -> dict[str, Any]:
    """Ratios of one regime: a row a sample, a column a load level, and the sentence of each sample."""
    part = [a for a in agreements if a.regime == regime]
    if not part:
        return {}
    every_load = np.array([load.normal_load_N for a in part for load in a.loads])
    levels = select.load_levels(every_load)
    level_of = dict(zip(every_load.tolist(), levels.tolist(), strict=True))
    columns = sorted(set(levels.tolist()))
    rows = [
        (a, [next((x for x in a.loads if level_of[x.normal_load_N] == level), None) for level in columns]) for a in part
    ]
    sentences = [(a.sample, wording.agreement_sentence(a)) for a in part]
    return {"regime": regime, "loads": columns, "rows": rows, "sentences": sentences, "marks": VERDICT_MARKS}


def _calibration(study: Study) -> list[tuple[str, str]]:
    if study.comparison is None:
        return []
    return [(name, f"{float(value):.5g}".replace("-", "−")) for name, value in study.comparison.calibration.items()]


def _flag_counts(study: Study) -> list[tuple[str, int, list[str]]]:
    """Each quality flag, how many pulls carry it, and the tests."""
    found: dict[str, list[str]] = {}
    for test_id, pull in study.ingested.pulls.items():
        for flag in pull.flags:
            found.setdefault(flag, []).append(test_id)
    return sorted(((f.replace("_", " "), len(tests), tests) for f, tests in found.items()), key=lambda x: (-x[1], x[0]))
