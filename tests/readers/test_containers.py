"""Exports in containers: .zip, .gz, workbooks of every kind and TDMS; each is read as the table in it."""

from __future__ import annotations

import base64
import gzip
import io
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter  # type: ignore[import-untyped]

from tribo.errors import ReadError
from tribo.readers import inspect_export, read_blocks, read_export, source as packed

CSV = "Time [s],Force [N]\n" + "".join(f"{0.1 * k:.1f},{0.5 * k + 0.25}\n" for k in range(6))
# The same table as a workbook of Excel 97, made by xlwt and compressed.
XLS = (
    "c-rk)O=uHA6n?Wm`J+vfnhLE@L&2(TK|~K;+Eu~!WUN+Dv_;c4NNG(ZdeMVcYw#opo)j;|Uc6Mj_=8IICMZ<&AP7RDM^A#%9@?yLzTMR"
    "{=For^E%Pn=&C8o_X5Q}1yzK6q*=T<9ep7+U&_y~G?I8I|e1gxQ_aj1FZ`;!J$^f6X!heNefG5&t(v#ZPemRG7z6+$$J>vy4(I-Cp=@c"
    "b0=~R3Lu^TZYg^Zz-S<o%^gsBlx)q{t?YruD*d<xzP&sA_IYxCj=&02}J9quYVthJynOtRmHX!8M{t<*p-<tn~#O*mSUc4bGBWB+DFvr"
    "$7+#PimZN~f~Pu{_0i0;lM^9Vhzc?bPRS<zHF9AokBM_4_OMuWJU;IN8Usz;m2jXLM(R`xa<DR;1?S)q^7^Q}Lsx2RQw9XR<?VCk8??9"
    "b@}OmTcczEbAKPVXA{2MK=-dXyMM+w|fVBtz+<vBV{{@eS?gJY`Q30aN{s)&?&TS;CApO^tujq6FA08lFQcK2G{7GfaWr4TX~#qz&mSW"
    "iM@&K+?V~2nscA6&1_Hi6wbw_-&>Q^!uMjB+sk8uIz)%Kc|+o{<(0xs0w2MRza@l#7I9;@-G8q-TBH!nDA@TW?~ZWwqD=pc#}LqK;1ke"
    "GrB*@dXxhPBgs0RiD0OK1z;i#9MwwFQIWVBv?%uEST8KR|;u+0}*sRdIi8i;vS9Gs;Uj?NPnpfa`hE#TG_4Ghq2q)2B2$6z<f`WpAf`Y"
    ";-fp8!1<s+$l*fiaj2*3MXXOYjM`b@HFaey*>oZ%PKJ(T7$OJ}QEKWoVpUSDFFZM^S=5{G#7ERE72;ux)Z{qk#<D7~I#H;nwbEmZCJ#c"
    "JaG%j5q5@ITPb"
)
ODS_CELL = '<table:table-cell office:value-type="{}"{}><text:p>{}</text:p></table:table-cell>'
ODS = (
    '<office:document-content xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0" '
    'xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0" '
    'xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0" office:version="1.2"><office:body>'
    '<office:spreadsheet><table:table table:name="S">{}</table:table></office:spreadsheet></office:body>'
    "</office:document-content>"
)


TABLE = [(round(0.1 * k, 9), 0.5 * k + 0.25) for k in range(6)]


def table_in(path: Path | str) -> list[tuple[float, float]]:
    """Time and force of an export, row by row."""
    trace = read_export(path)
    return list(zip(trace.time_s.round(9).tolist(), trace.force_N.round(9).tolist(), strict=True))


def zipped(path: Path, entries: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as out:
        for name, data in entries.items():
            out.writestr(name, data)
    return path


@pytest.mark.parametrize("name", ["a.zip", "a.csv.zip", "a.txt"])
def test_a_zip_with_one_file_is_read_as_that_file(tmp_path: Path, name: str) -> None:
    path = zipped(tmp_path / name, {"__MACOSX/._a.csv": b"x", "folder/": b"", "folder/a.csv": CSV.encode()})
    assert table_in(path) == TABLE


def test_a_gz_is_read_as_the_file_in_it_also_within_a_zip(tmp_path: Path) -> None:
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(CSV.encode()))
    assert table_in(tmp_path / "a.csv.gz") == TABLE
    assert table_in(zipped(tmp_path / "b.zip", {"a.csv.gz": gzip.compress(CSV.encode())})) == TABLE


def test_one_of_several_files_in_a_zip_is_given_after_its_name(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.zip", {"one.csv": b"no table", "in/two.csv": CSV.encode()})
    with pytest.raises(ReadError) as caught:
        read_export(path)
    (problem,) = caught.value.problems
    assert problem.kind == "several_entries"
    assert "a.zip/one.csv; here: one.csv, in/two.csv" in str(problem.allowed)
    assert inspect_export(path).refused
    assert table_in(path / "in" / "two.csv") == TABLE
    assert not inspect_export(path / "in" / "two.csv").refused
    with pytest.raises(ReadError, match="no such entry"):
        read_export(path / "three.csv")


def test_an_entry_of_a_file_that_is_no_zip_does_not_exist(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(CSV)
    with pytest.raises(ReadError, match="does not exist"):
        read_export(tmp_path / "a.csv" / "b.csv")


def test_a_packed_file_is_unpacked_up_to_a_limit_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packed, "MOST_UNPACKED_EXPORT_BYTES", 3_000_000)
    for path in (zipped(tmp_path / "a.zip", {"a.csv": bytes(4_000_000)}), tmp_path / "a.gz"):
        if path.suffix == ".gz":
            path.write_bytes(gzip.compress(bytes(4_000_000)))
        with pytest.raises(ReadError) as caught:
            read_export(path)
        assert caught.value.problems[0].kind == "too_large"


@pytest.mark.parametrize("cut", [0.3, 0.6, 0.9])
def test_a_damaged_archive_is_refused(tmp_path: Path, cut: float) -> None:
    whole = zipped(tmp_path / "a.zip", {"a.csv": CSV.encode()}).read_bytes()
    (tmp_path / "b.zip").write_bytes(whole[: int(cut * len(whole))])
    with pytest.raises(ReadError, match=r"not a readable \.zip"):
        read_export(tmp_path / "b.zip")
    whole = gzip.compress(CSV.encode())
    (tmp_path / "b.gz").write_bytes(whole[: int(cut * len(whole))])
    with pytest.raises(ReadError, match=r"not a readable \.gz"):
        read_export(tmp_path / "b.gz")


def test_a_workbook_of_excel_97_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.xls").write_bytes(zlib.decompress(base64.b85decode(XLS)))
    assert table_in(tmp_path / "a.xls") == TABLE


def test_an_opendocument_sheet_is_read(tmp_path: Path) -> None:
    rows = []
    for line in CSV.splitlines():
        kinds = [("string", "", c) if "[" in c else ("float", f' office:value="{c}"', c) for c in line.split(",")]
        row = [ODS_CELL.format(*kind) for kind in kinds]
        rows.append(f"<table:table-row>{''.join(row)}</table:table-row>")
    entries = {
        "mimetype": b"application/vnd.oasis.opendocument.spreadsheet",
        "META-INF/manifest.xml": b'<manifest xmlns="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0"/>',
        "content.xml": ODS.format("".join(rows)).encode(),
    }
    assert table_in(zipped(tmp_path / "a.ods", entries)) == TABLE


def test_a_sheet_that_spans_too_many_cells_is_refused(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Time [s]", "Force [N]"])
    book.active.cell(1_048_576, 16_384, 1.0)
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(ReadError) as caught:
        read_export(tmp_path / "a.xlsx")
    assert [p.kind for p in caught.value.problems] == ["too_large"]


def tdms(path: Path, channels: list[tuple[str, str, np.ndarray, dict[str, object]]]) -> Path:
    with TdmsWriter(path) as out:
        out.write_segment([ChannelObject(group, name, values, dict(more)) for group, name, values, more in channels])
    return path


def test_a_tdms_group_is_a_table_with_the_units_of_its_channels(tmp_path: Path) -> None:
    k = np.arange(6)
    path = tdms(
        tmp_path / "a.tdms",
        [
            ("Pull", "Time", 100.0 * k, {"unit_string": "ms"}),
            ("Pull", "Friction", 500.0 * k + 250, {"NI_UnitDescription": "mN"}),
            ("Pull", "Note", np.arange(3.0), {}),
            ("Empty", "Rate", np.arange(1.0), {}),
        ],
    )
    assert table_in(path) == TABLE
    assert inspect_export(path).family == "tdms"


def test_time_of_a_tdms_follows_from_the_waveform_of_its_channels(tmp_path: Path) -> None:
    wave = {"wf_increment": 0.1, "wf_start_offset": 0.0, "unit_string": "N"}
    path = tdms(tmp_path / "a.tdms", [("Pull", "Force", 0.5 * np.arange(6) + 0.25, wave)])
    assert table_in(path) == TABLE


def test_groups_of_a_tdms_are_tables_and_groups_of_one_channel_are_one(tmp_path: Path) -> None:
    k = np.arange(6)
    s, n = {"unit_string": "s"}, {"unit_string": "N"}
    two = [(g, *rest) for g in ("1", "2") for rest in (("Time", 0.1 * k, s), ("Force", 0.5 * k + 0.25, n))]
    assert len(read_blocks(tdms(tmp_path / "a.tdms", two))) == 2
    assert table_in(tdms(tmp_path / "b.tdms", [("1", "Time", 0.1 * k, s), ("2", "Force", 0.5 * k + 0.25, n)])) == TABLE


def test_a_damaged_tdms_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.tdms").write_bytes(b"TDSm" + bytes(range(200)))
    with pytest.raises(ReadError) as caught:
        read_export(tmp_path / "a.tdms")
    assert [p.kind for p in caught.value.problems] == ["not_an_export"]


def test_a_mat_file_inside_a_zip_is_read(tmp_path: Path) -> None:
    from scipy.io import savemat

    out = io.BytesIO()
    savemat(out, {"t": 0.1 * np.arange(6), "F": 0.5 * np.arange(6) + 0.25})
    path = zipped(tmp_path / "a.zip", {"a.mat": out.getvalue()})
    trace = read_export(path, columns={"time": "t [s]", "force": "F [N]"})
    np.testing.assert_allclose(trace.force_N, 0.5 * np.arange(6) + 0.25)
