"""The page and the PDF of a study alone, without a folder of results."""

from __future__ import annotations

from collections.abc import Mapping

from tribo.diagnostics.verdict import Verdict
from tribo.records import Study
from tribo.report import Provenance
from tribo.report.content import content
from tribo.report.drawings import Drawn, draw_all
from tribo.report.page import PAGE, pages_of
from tribo.report.pdf import pdf_of


def html(
    study: Study,
    provenance: Provenance | None = None,
    drawn: Mapping[str, Drawn] | None = None,
    verdict: Verdict | None = None,
) -> str:
    """The page as text."""
    return pages_of(content(study, provenance, verdict), draw_all(study) if drawn is None else drawn)[PAGE]


def pdf(
    study: Study,
    provenance: Provenance | None = None,
    drawn: Mapping[str, Drawn] | None = None,
    verdict: Verdict | None = None,
) -> bytes:
    """The document."""
    figures = draw_all(study) if drawn is None else drawn
    return pdf_of(content(study, provenance, verdict), figures, provenance.origin if provenance is not None else "")
