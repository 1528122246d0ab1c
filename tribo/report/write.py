"""Write all results of a study into one folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribo.cache.own_folder import own_folder
from tribo.files import write_bytes, write_text
from tribo.records import Study
from tribo.report.campaign_nc import write_store
from tribo.report.drawing_choices import DRAWING, Drawing, Progress
from tribo.report.provenance import (
    Provenance,
    file_hash,
    gather_provenance,
    read_record,
    same_origin,
    settle_outputs,
    write_provenance,
)
from tribo.report.tables import write_tables

if TYPE_CHECKING:
    from tribo.diagnostics.diagnosis_record import Diagnosis, DiagnosisWithoutModel
    from tribo.wording.card import Card


def write_until(
    study: Study,
    out: Path,
    until: str = "report",
    drawing: Drawing = DRAWING,
    provenance: Provenance | None = None,
    diagnosis: Diagnosis | DiagnosisWithoutModel | None = None,
    card: Card | None = None,
) -> None:
    """Write the results of all stages up to ``until`` (ingest, fit, compare or report).

    Tables and campaign.nc always, as far as the study went; verdict.json and its figures where there is a
    ``diagnosis``; card.json where a ``card`` is given, and of a report always; the figures of the study from
    ``compare`` on; then page, PDF and crate. Every file is whole or absent: it is written under a temporary name and
    renamed. Last comes provenance.json with the hash of each; files of an earlier run that are no longer valid are
    removed.
    """
    before = read_record(out)
    made_by = provenance if provenance is not None else gather_provenance(study)
    if diagnosis is not None and not diagnosis.verdict.text:
        from tribo.wording.verdict_sentences import worded

        diagnosis = replace(diagnosis, verdict=worded(diagnosis.verdict))
    verdict = diagnosis.verdict if diagnosis is not None else None
    keep_earlier = before is not None and until != "report" and same_origin(before, made_by) and _is_as_recorded(
        out / "campaign.nc", before
    )
    modelled = _with_model(diagnosis)
    written = [*write_tables(study, out), write_store(study, out, made_by, modelled, keep_earlier)]
    if verdict is not None:
        from tribo.report.verdict_file import write_verdict

        written.append(write_verdict(verdict.as_dict(), out))
    if modelled is not None:
        written += _write_diagnosed(modelled, study.ingested.campaign.title, out)
    if until in ("compare", "report") or diagnosis is not None:
        from tribo.report.drawings import write_figures

        shown = study if until in ("compare", "report") else None
        drawn = write_figures(shown, out, modelled, made_by.origin, drawing)
        written += [out / "figures" / f"{f.name}.{ending}" for f in drawn.values() for ending in f.files]
    if card is not None or until == "report":
        from tribo.report.verdict_file import write_card
        from tribo.wording.card import card_of

        card = card or card_of(study, verdict)
        written.append(write_card(card.as_dict(), out))
    if until == "report":
        from tribo.report.content import content
        from tribo.report.crate import write_crate
        from tribo.report.page import pages_of
        from tribo.report.pdf import pdf_of

        said = content(study, made_by, verdict, card)
        written += [write_text(out / name, page) for name, page in pages_of(said, drawn).items()]
        written.append(write_bytes(out / "report.pdf", pdf_of(said, drawn, made_by.origin)))
        written.append(write_crate(study, out, made_by, written))
    write_provenance(made_by, out, settle_outputs(out, before, made_by, written, complete=until == "report"))


def _with_model(diagnosis: Diagnosis | DiagnosisWithoutModel | None) -> Diagnosis | None:
    if diagnosis is None:
        return None
    from tribo.diagnostics.diagnosis_record import Diagnosis

    return diagnosis if isinstance(diagnosis, Diagnosis) else None


def _write_diagnosed(diagnosis: Diagnosis, title: str, out: Path) -> list[Path]:
    """The tables of a diagnosis, and the laws that were found, if any."""
    from tribo.report.tables import write_diagnosis_tables
    from tribo.report.without_study import law_texts

    laws = law_texts(diagnosis.laws, title) if diagnosis.laws is not None else {}
    return [*(write_text(out / name, text) for name, text in laws.items()), *write_diagnosis_tables(diagnosis, out)]


def _is_as_recorded(path: Path, record: Mapping[str, Any]) -> bool:
    """Whether a file of an earlier run is still what that run wrote."""
    return path.is_file() and record["outputs"].get(path.name) == file_hash(path)


def write_report(
    study: Study,
    out: Path | str,
    progress: Progress | None = None,
    provenance: Provenance | None = None,
    diagnosis: Diagnosis | DiagnosisWithoutModel | None = None,
    jobs: int = 1,
) -> None:
    """All of OUT: tables, campaign.nc, figures, verdict.json where there is a diagnosis, page, PDF and crate.

    Raises
    ------
    CampaignError
        ``out`` is, holds or lies in a campaign, or holds files that tribo has not written.
    BusyError
        Another process writes into it.
    """
    with own_folder(Path(out), (study.ingested.campaign.root,)) as folder:
        write_until(study, folder, "report", Drawing(progress, jobs), provenance, diagnosis)
