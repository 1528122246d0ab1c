"""report.pdf is the same record on paper, and the same bytes for the same inputs and choices."""

from __future__ import annotations

from dataclasses import replace

import pytest

from report.conftest import PROVENANCE, Written
from report.laid_out import pdf
from tribo.figures import FIGURES
from tribo.records import Study
from tribo.report.drawings import Drawn, with_text


@pytest.fixture(scope="module")
def drawn(written: Written) -> dict[str, Drawn]:
    files = {kind: (written.out / "figures" / f"fig3.{kind}").read_bytes() for kind in ("csv", "svg", "pdf", "png")}
    return {"fig3": Drawn("fig3", FIGURES["fig3"].title, FIGURES["fig3"].caption, files)}


def test_another_day_and_another_command_give_the_same_bytes(study: Study, drawn: dict[str, Drawn]) -> None:
    later = replace(PROVENANCE, started_at="2031-12-31T23:59:59", command="tribo report elsewhere -o there")
    assert pdf(study, PROVENANCE, drawn) == pdf(study, later, drawn)


def test_other_choices_give_other_bytes(study: Study, drawn: dict[str, Drawn]) -> None:
    other = replace(PROVENANCE, options={"rule": "iso_8295"})
    assert pdf(study, PROVENANCE, drawn) != pdf(study, other, drawn)


def test_a_campaign_that_was_only_read_has_a_document_too(study: Study) -> None:
    assert pdf(Study(study.ingested), drawn={}).startswith(b"%PDF-")


def test_the_report_folder_holds_the_whole_document(written: Written) -> None:
    content = (written.out / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert content.rstrip().endswith(b"%%EOF")


def test_every_figure_says_in_its_own_file_what_it_was_made_from(written: Written) -> None:
    origin = PROVENANCE.origin
    assert "SHA-256" in origin
    for name in ("fig3", "fig6"):
        folder = written.out / "figures"
        assert origin in (folder / f"{name}.svg").read_text(encoding="utf-8")
        assert origin.encode() in (folder / f"{name}.png").read_bytes()
        assert (folder / f"{name}.pdf").read_bytes().startswith(b"%PDF-")


def test_text_in_a_png_leaves_its_picture_as_it_was() -> None:
    from io import BytesIO

    from matplotlib.image import imread, imsave

    buffer = BytesIO()
    imsave(buffer, [[0.0, 1.0], [1.0, 0.0]], format="png")
    plain = buffer.getvalue()
    told = with_text(plain, {"Title": "μ of B", "Description": ""})
    assert "μ of B".encode() in told
    assert b"Description" not in told
    assert (imread(BytesIO(told)) == imread(BytesIO(plain))).all()
