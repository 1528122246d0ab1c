"""A workbook that spans more than a computer holds is refused with its reason, and ends no process but its own."""

from __future__ import annotations

import io
import zipfile

import pytest

from tribo.errors import ReadError
from tribo.input_files import sheets_as_text

TYPES = "http://schemas.openxmlformats.org/package/2006/content-types"
LINKS = "http://schemas.openxmlformats.org/package/2006/relationships"
OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
SHEET = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
MAIN = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"


def workbook(rows: str, sheet: str = "worksheets/sheet1.xml") -> bytes:
    """The smallest workbook that Excel opens, with these rows."""
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{TYPES}"><Default Extension="rels" ContentType="application/xml"/>'
        f'<Default Extension="xml" ContentType="application/xml"/><Override PartName="/xl/workbook.xml" '
        f'ContentType="{MAIN}"/></Types>',
        "_rels/.rels": f'<Relationships xmlns="{LINKS}"><Relationship Id="a" Type="{OFFICE}/officeDocument" '
        f'Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{SHEET}" xmlns:r="{OFFICE}"><sheets><sheet name="S" sheetId="1" '
        f'r:id="a"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{LINKS}"><Relationship Id="a" '
        f'Type="{OFFICE}/worksheet" Target="{sheet}"/></Relationships>',
        f"xl/{sheet}": f'<worksheet xmlns="{SHEET}"><sheetData>{rows}</sheetData></worksheet>',
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
    return packed.getvalue()


def problem(data: bytes) -> tuple[str, str]:
    with pytest.raises(ReadError) as caught:
        sheets_as_text(data, "far.xlsx")
    (found,) = caught.value.problems
    return found.kind, str(found)


def test_the_cells_of_a_small_workbook_are_read() -> None:
    rows = '<row r="1"><c r="A1"><v>1</v></c><c r="B1"><v>2.5</v></c></row><row><c><v>3</v></c></row>'
    assert sheets_as_text(workbook(rows), "small.xlsx") == {"S": "1\t2.5\n3\t\n"}


@pytest.mark.parametrize(
    "rows",
    [
        "<row r='1'><c r='A1'><v>1</v></c></row><row r='1048576'><c r='XFD1048576'><v>2</v></c></row>",
        '<row r="1"><c r="a1"><v>1</v></c></row><row r="1048576"><c r="xfd1048576"><v>2</v></c></row>',
        '<row r="1"><c s="1"\n r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>2</v></c></row>',
        '<row r="1"><c><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>2</v></c></row>',
    ],
    ids=["single quotes", "lower case", "another attribute and a line break", "a cell without a place"],
)
def test_cells_at_the_far_end_of_a_sheet_are_counted_however_they_are_written(rows: str) -> None:
    kind, said = problem(workbook(rows))
    assert kind == "too_large"
    assert "17179869184 cells" in said or "17179852800 cells" in said


@pytest.mark.parametrize("place", ["A4000000000", "ZZZZZZ99999999"])
def test_a_place_that_no_sheet_has_costs_the_workbook_and_not_the_process(place: str) -> None:
    rows = f'<row r="1"><c r="A1"><v>1</v></c></row><row r="1"><c r="{place}"><v>1</v></c></row>'
    kind, said = problem(workbook(rows))
    assert kind in {"too_large", "bad_workbook"}
    assert "panic" not in said


def test_a_sheet_under_an_unusual_name_is_read_within_its_memory() -> None:
    rows = '<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>2</v></c></row>'
    assert problem(workbook(rows, "odd.bin"))[0] == "too_large"
