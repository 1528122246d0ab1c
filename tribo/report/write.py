"""Write all results of a study into one folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribo import outputs
from tribo.own_folder import own_folder
from tribo.records import Study
from tribo.report.campaign_nc import write_store
from tribo.report.provenance import (
    Provenance,
    file_hash,
    gather_provenance,
    read_record,
    same_origin,
    settle_outputs,
    write_provenance,
)
from tribo.report.tables import tables_of, write_tables

Progress = Callable[[str, int, int], None]

if TYPE_CHECKING:
    from tribo.diagnostics.diagnosis import Diagnosis, DiagnosisWithoutModel
    from tribo.wording.card import Card


@dataclass(frozen=True)
class Drawing:
    """How figures are drawn: where the progress is reported, in how many processes, and the folder of kept results
    from which a figure is taken whose numbers have not changed."""

    progress: Progress | None = None
    jobs: int = 1
    kept: Path | None = None


DRAWING = Drawing()


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
    modelled = _with_model(diagnosis)
    tables = tables_of(study, modelled)
    keep_earlier = before is not None and until != "report" and same_origin(before, made_by) and _is_as_recorded(
        out / "campaign.nc", before
    )
    written = write_tables(study, out, tables=tables)
    written.append(write_store(study, out, made_by, modelled, keep_earlier, tables))
    if verdict is not None:
        written.append(outputs.write(out, "verdict.json", verdict.as_dict()))
    if modelled is not None and modelled.laws is not None:
        from tribo.report.without_study import law_texts

        laws = law_texts(modelled.laws, study.ingested.campaign.title)
        written += [outputs.write(out, name, text) for name, text in laws.items()]
    if until in ("compare", "report") or diagnosis is not None:
        from tribo.report.drawings import write_figures

        shown = study if until in ("compare", "report") else None
        drawn = write_figures(shown, out, modelled, made_by.origin, drawing.progress, drawing.jobs, drawing.kept)
        written += [out / "figures" / f"{f.name}.{ending}" for f in drawn.values() for ending in f.files]
    if card is not None or until == "report":
        from tribo.wording.card import card_of

        card = card or card_of(study, verdict)
        written.append(outputs.write(out, "card.json", asdict(card)))
    if until == "report":
        from tribo.report.content import content
        from tribo.report.crate import crate_text
        from tribo.report.page import pages_of
        from tribo.report.pdf import pdf_of

        said = content(study, made_by, verdict, card)
        written += [outputs.write(out, name, page) for name, page in pages_of(said, drawn).items()]
        written.append(outputs.write(out, "report.pdf", pdf_of(said, drawn, made_by.origin)))
        written.append(outputs.write(out, "ro-crate-metadata.json", crate_text(study, out, made_by, written)))
    write_provenance(made_by, out, settle_outputs(out, before, made_by, written, complete=until == "report"))


def _with_model(diagnosis: Diagnosis | DiagnosisWithoutModel | None) -> Diagnosis | None:
    if diagnosis is None:
        return None
    from tribo.diagnostics.diagnosis import Diagnosis

    return diagnosis if isinstance(diagnosis, Diagnosis) else None


def _is_as_recorded(path: Path, record: Mapping[str, Any]) -> bool:
    """Whether a file of an earlier run is still what that run wrote."""
    return path.is_file() and record["outputs"].get(path.name) == file_hash(path)


def write_verdict(verdict: Mapping[str, Any], out: Path) -> Path:
    """Write out/verdict.json from a verdict in the form of its schema."""
    return outputs.write(out, "verdict.json", verdict)


def write_report(
    study: Study,
    out: Path | str,
    progress: Progress | None = None,
    provenance: Provenance | None = None,
    diagnosis: Diagnosis | DiagnosisWithoutModel | None = None,
    jobs: int = 1,
) -> None:
    """All of OUT: tables, campaign.nc, figures, verdict.json where there is a diagnosis, page, PDF and crate.

    Parameters
    ----------
    study : Study
        The results of all stages (:func:`tribo.study`).
    out : Path or str
        Folder of results, made where it is absent.
    progress : callable, optional
        Told the stage, the number of figures drawn so far, and the number of all.
    provenance : Provenance, optional
        How the study was made; gathered from its campaign if it is left out.
    diagnosis : Diagnosis or DiagnosisWithoutModel, optional
        The diagnosis of the study (:func:`tribo.diagnose`).
    jobs : int
        Number of processes that draw figures.

    Raises
    ------
    CampaignError
        ``out`` is, holds or lies in a campaign, or holds files that tribo has not written.
    BusyError
        Another process writes into it.
    OSError
        A file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import tribo
    >>> study = tribo.study(tribo.load_campaign(tribo.data_dir() / "example"), until="fit")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tribo.write_report(study, Path(folder) / "out")
    ...     unchanged = tribo.verify(Path(folder) / "out").unchanged
    >>> unchanged
    True
    """
    with own_folder(Path(out), (study.ingested.campaign.root,)) as folder:
        write_until(study, folder, "report", Drawing(progress, jobs), provenance, diagnosis)
