"""Everything a study yields, written into one folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

from tribo.records import Study
from tribo.report.diagnosis import write_verdict
from tribo.report.drawings import write_figures
from tribo.report.provenance import Provenance, write_provenance
from tribo.report.store import write_store
from tribo.report.tables import write_tables

Progress = Callable[[str, int, int], None]
Until = Literal["ingest", "fit", "compare", "report"]


def write_until(
    study: Study,
    out: Path,
    until: str = "report",
    progress: Progress | None = None,
    provenance: Provenance | None = None,
    verdict: Mapping[str, Any] | None = None,
) -> None:
    """Write what a walk as far as ``until`` (ingest, fit, compare or report) yields.

    Tables and campaign.nc always, as far as the study went; figures from ``compare`` on; then the page.
    Every file is whole or absent: it is written under a temporary name and renamed.
    """
    write_tables(study, out)
    write_store(study, out)
    if provenance is not None:
        write_provenance(provenance, out)
    if verdict is not None:
        write_verdict(verdict, out)
    if until not in ("compare", "report"):
        return
    drawn = write_figures(study, out, progress)
    if until == "report":
        from tribo.report.page import write_html

        write_html(study, out, provenance=provenance, drawn=drawn, verdict=verdict)


def write_report(
    study: Study,
    out: Path,
    progress: Progress | None = None,
    provenance: Provenance | None = None,
    verdict: Mapping[str, Any] | None = None,
) -> None:
    """All of OUT: tables, campaign.nc, figures, verdict.json where there is a verdict, report.html."""
    write_until(study, out, "report", progress, provenance, verdict)
