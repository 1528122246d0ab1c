"""A campaign is taken as its two files describe it; all faults come at once, only faulty tests are lost."""

from __future__ import annotations

import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from support.campaigns import DIALECTS, MadeCampaign, written

from tribo.campaign import load_campaign, open_campaign, write_template
from tribo.errors import CampaignError, Problem
from tribo.records import Campaign

TOML = """\
[campaign]
title = "A campaign"
nominal_area_mm2 = 55.0
slider_mass_g = 1.5
pull_speed_mm_s = 0.2

[patterns.F]
cavity = "none"

[patterns.A]
cavity = "circle"
diameter_um = 5.0
pitch_um = [20.0, 20.0]

[patterns.S]
cavity = "rectangle"
size_um = [200.0, 40.0]
pitch_um = [220.0, 120.0]
staggered = true
"""
HEADER = "test_id,file,sample,specimen,mass_g,normal_load_N,speed_mm_s,repeat,glove"
GOOD = "T{k},raw/T{k}.csv,F,F1,50,,0.1,{k},latex"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A campaign with three exports and no fault."""
    (tmp_path / "raw").mkdir()
    for k in (1, 2, 3):
        (tmp_path / "raw" / f"T{k}.csv").write_text("1,2\n3,4\n5,6\n")
    write(tmp_path, [GOOD.format(k=k) for k in (1, 2, 3)])
    return tmp_path


def write(folder: Path, rows: list[str], toml: str = TOML, header: str = HEADER) -> None:
    written(folder, toml, [header, *rows])


def faults_of_a_row(folder: Path, row: str, header: str = HEADER) -> list[Problem]:
    """Problems of the second of three tests, which must be the only one set aside."""
    good = [",".join(GOOD.format(k=k).split(",")[: header.count(",") + 1]) for k in (1, 3)]
    write(folder, [good[0], row, good[1]], header=header)
    campaign = load_campaign(folder)
    assert [t.test_id for t in campaign.tests] == ["T1", "T3"]
    (aside,) = campaign.set_aside
    assert all(p.file == "tests.csv" and p.test_id == aside.test_id for p in aside.problems)
    assert {p.row for p in aside.problems} <= {3, 4}
    return list(aside.problems)


def refusal(folder: Path) -> tuple[Problem, ...]:
    with pytest.raises(CampaignError) as caught:
        load_campaign(folder)
    return caught.value.problems


def test_a_campaign_is_read_in_si_units(folder: Path) -> None:
    campaign = load_campaign(folder)
    assert (campaign.title, campaign.set_aside, campaign.problems) == ("A campaign", (), ())
    assert campaign.nominal_area_m2 == pytest.approx(55e-6)
    assert campaign.slider_mass_kg == pytest.approx(1.5e-3)
    assert campaign.pull_speed_m_s == pytest.approx(0.2e-3)
    test = campaign.tests[0]
    assert test.normal_load_N == pytest.approx(51.5e-3 * 9.80665)
    assert test.speed_m_s == pytest.approx(0.1e-3)
    assert (test.repeat, test.row, test.file) == (1, 2, "raw/T1.csv")
    assert test.covariates == {"glove": "latex"}


def test_the_load_in_newton_wins_over_the_mass(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv,F,F1,50,0.7,0.1,1,latex"])
    assert load_campaign(folder).tests[0].normal_load_N == 0.7


def test_the_pull_speed_of_the_campaign_stands_in_for_a_missing_one(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv,F,F1,50,,,1,latex"])
    assert load_campaign(folder).tests[0].speed_m_s == pytest.approx(0.2e-3)


def test_only_id_file_sample_and_a_load_are_required(folder: Path) -> None:
    write(folder, ["raw/T1.csv,F,0.5,T1"], header="file,sample,normal_load_N,test_id")
    test = load_campaign(folder).tests[0]
    assert (test.specimen, test.hold_s, test.repeat) == ("F", None, None)


def test_a_sample_is_a_pattern_or_a_pattern_with_its_direction(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv,Sx,S1,50,,,1,", "T2,raw/T2.csv,A,A1,50,,,1,", "T3,raw/T3.csv,Sy,S1,50,,,1,"])
    campaign = load_campaign(folder)
    assert list(campaign.samples) == ["A", "Sx", "Sy"]
    assert campaign.samples["Sx"].name == "S"
    assert [t.direction for t in campaign.tests] == ["x", "", "y"]
    assert campaign.area_fraction("Sx") == pytest.approx(1 - 200 * 40 / (220 * 120))
    assert campaign.area_fraction("A") == pytest.approx(1 - 3.141592653589793 * 25 / 4 / 400)


def test_a_measured_area_fraction_replaces_the_geometry(folder: Path) -> None:
    write(
        folder,
        ["T1,raw/T1.csv,A,A1,50,,,1,"],
        toml=TOML.replace("diameter_um", "area_fraction = 0.9\ndiameter_um"),
    )
    assert load_campaign(folder).area_fraction("A") == 0.9


@pytest.mark.parametrize("delimiter", [";", "\t"])
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_the_table_may_have_a_bom_another_delimiter_and_decimal_commas(
    folder: Path, delimiter: str, encoding: str
) -> None:
    lines = [HEADER.replace("glove", "größe"), "T1,raw/T1.csv,F,F1,50§5,,0§1,1,groß"]
    text = "\r\n".join(line.replace(",", delimiter).replace("§", ",") for line in lines)
    (folder / "tests.csv").write_bytes(text.encode(encoding))
    test = load_campaign(folder).tests[0]
    assert test.normal_load_N == pytest.approx(52e-3 * 9.80665)
    assert test.covariates == {"größe": "groß"}


def test_a_hand_written_reason_excludes_a_test(folder: Path) -> None:
    write(
        folder,
        ["T1,raw/T1.csv,F,50,", "T2,raw/T2.csv,F,50,slipped"],
        header="test_id,file,sample,mass_g,exclude",
    )
    campaign = load_campaign(folder)
    assert [t.test_id for t in campaign.tests] == ["T1"]
    assert campaign.set_aside[0].reason == "excluded by hand: slipped"
    assert campaign.set_aside[0].problems == ()


@pytest.mark.parametrize(
    ("row", "kind", "column"),
    [
        ("T2,raw/T2.csv,Q,F1,50,,0.1,2,", "unknown_sample", "sample"),
        ("T2,raw/T2.csv,F,F1,twelve,,0.1,2,", "load_not_a_number", "mass_g"),
        ("T2,raw/T2.csv,F,F1,50,nan,0.1,2,", "load_not_a_number", "normal_load_N"),
        ("T2,raw/T2.csv,F,F1,,-0.2,0.1,2,", "load_not_positive", "normal_load_N"),
        ("T2,raw/T2.csv,F,F1,-3,,0.1,2,", "load_not_positive", "mass_g"),
        ("T2,raw/T2.csv,F,F1,,,0.1,2,", "no_load", "mass_g or normal_load_N"),
        ("T2,raw/T2.csv,F,F1,50,,-1,2,", "negative", "speed_mm_s"),
        ("T2,raw/T2.csv,F,F1,50,,0.1,2.5,", "not_a_number", "repeat"),
        ("T2,raw/T9.csv,F,F1,50,,0.1,2,", "missing", "file"),
        ("T2,,F,F1,50,,0.1,2,", "missing", "file"),
        (",raw/T2.csv,F,F1,50,,0.1,2,", "no_test_id", "test_id"),
        ("T2,../T2.csv,F,F1,50,,0.1,2,", "path_outside_campaign", "file"),
        ("T2,/etc/passwd,F,F1,50,,0.1,2,", "path_outside_campaign", "file"),
        ("T2,C:\\T2.csv,F,F1,50,,0.1,2,", "path_outside_campaign", "file"),
        ("T2,raw/T2.csv,F,F1,50,,0.1", "wrong_number_of_cells", None),
    ],
)
def test_a_fault_of_one_row_sets_that_test_aside(folder: Path, row: str, kind: str, column: str | None) -> None:
    found = faults_of_a_row(folder, row)
    assert [(p.kind, p.row, p.column) for p in found] == [(kind, 3, column)]


def test_all_faults_of_a_row_are_listed(folder: Path) -> None:
    found = faults_of_a_row(folder, "T2,raw/T9.csv,Q,F1,heavy,,0.1,2.5,")
    assert {p.kind for p in found} == {"unknown_sample", "load_not_a_number", "not_a_number", "missing"}


def test_rows_that_share_a_test_id_are_one_test_set_aside(folder: Path) -> None:
    write(folder, [GOOD.format(k=1), GOOD.format(k=2), GOOD.format(k=2), GOOD.format(k=3)])
    campaign = load_campaign(folder)
    assert [t.test_id for t in campaign.tests] == ["T1", "T3"]
    assert [[(p.kind, p.row) for p in s.problems] for s in campaign.set_aside] == [[("duplicate_row", 4)]]


def test_an_export_given_for_two_tests_is_used_for_none(folder: Path) -> None:
    write(folder, [GOOD.format(k=1), GOOD.format(k=2).replace("raw/T2", "raw/T1"), GOOD.format(k=3)])
    campaign = load_campaign(folder)
    assert [t.test_id for t in campaign.tests] == ["T3"]
    assert {(p.kind, p.row) for s in campaign.set_aside for p in s.problems} == {
        ("duplicate_file", 2),
        ("duplicate_file", 3),
    }


def test_tests_may_share_an_export_of_several_tables(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv#1,F,F1,50,,,1,", "T2,raw/T1.csv#2,F,F1,50,,,2,"])
    campaign = load_campaign(folder)
    assert [t.file for t in campaign.tests] == ["raw/T1.csv#1", "raw/T1.csv#2"]
    assert "raw/T1.csv" not in {p.file for p in campaign.problems}


def test_a_link_that_leads_out_of_the_campaign_is_refused(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    outside = tmp_path_factory.mktemp("outside") / "secret.csv"
    outside.write_text("1,2\n")
    (folder / "raw" / "T2.csv").unlink()
    (folder / "raw" / "T2.csv").symlink_to(outside)
    assert [p.kind for p in faults_of_a_row(folder, GOOD.format(k=2))] == ["path_outside_campaign"]


def test_a_missing_required_column_refuses_the_campaign_and_offers_the_nearest_name(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv,F"], header="test_id,file,sampel")
    found = {p.column: p for p in refusal(folder)}
    assert set(found) == {"sample", "mass_g or normal_load_N"}
    assert "sampel (did you mean sample?)" in str(found["sample"])


def test_a_column_that_is_almost_a_known_one_is_kept_and_noted(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv,F,50,21"], header="test_id,file,sample,mass_g,temprature_C")
    campaign = load_campaign(folder)
    assert campaign.tests[0].covariates == {"temprature_C": "21"}
    assert ("resembles_a_column", "temprature_C") in {(p.kind, p.column) for p in campaign.problems}


def test_a_column_that_stands_twice_refuses_the_campaign(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv,F,50,51"], header="test_id,file,sample,mass_g,mass_g")
    assert [(p.kind, p.column) for p in refusal(folder)] == [("duplicate_column", "mass_g")]


def test_without_one_usable_test_every_fault_is_listed(folder: Path) -> None:
    write(folder, ["T1,raw/T1.csv,Q,F1,50,,,1,", "T2,raw/T9.csv,F,F1,50,,,1,"])
    assert [p.kind for p in refusal(folder)] == ["unknown_sample", "missing", "no_usable_test"]


@pytest.mark.parametrize(
    ("change", "kind", "column", "row", "hint"),
    [
        (("slider_mass_g", "slider_mas_g"), "unknown_key", "campaign.slider_mas_g", 4, "slider_mass_g"),
        (("diameter_um", "diametre_um"), "unknown_key", "patterns.A.diametre_um", 12, "diameter_um"),
        (("[campaign]", "[campagin]"), "unknown_key", "campagin", 1, "campaign"),
        (('title = "A campaign"\n', ""), "missing_key", "campaign.title", 1, ""),
        (("= 55.0", '= "55"'), "wrong_value", "campaign.nominal_area_mm2", 3, "number"),
        (("= 55.0", "= -55.0"), "wrong_value", "campaign.nominal_area_mm2", 3, "greater than 0"),
        (('"circle"', '"round"'), "wrong_value", "patterns.A.cavity", 11, "'circle'"),
        (("diameter_um = 5.0\n", ""), "wrong_value", "patterns.A", 10, "requires diameter_um"),
        (("diameter_um = 5.0", "diameter_um = 25.0"), "wrong_value", "patterns.A", 10, "touch"),
        (("[20.0, 20.0]", "[20.0]"), "wrong_value", "patterns.A", 10, "one number or [x, y]"),
        (
            ('cavity = "none"', 'cavity = "none"\npitch_um = 3.0'),
            "wrong_value",
            "patterns.F",
            7,
            "does not allow pitch_um",
        ),
        (("true", 'true\n[columns]\ntiem = "T [s]"'), "wrong_value", "columns", 20, "did you mean time?"),
        (("true", "true\n[instrument]\nmas_u_g = 1.0"), "unknown_key", "instrument.mas_u_g", 21, "mass_u_g"),
    ],
)
def test_a_fault_of_the_description_is_named_with_its_row(
    folder: Path, change: tuple[str, str], kind: str, column: str, row: int, hint: str
) -> None:
    write(folder, [GOOD.format(k=1)], toml=TOML.replace(*change, 1))
    found = {p.column: p for p in refusal(folder)}[column]
    assert (found.kind, found.row, found.file) == (kind, row, "campaign.toml")
    assert hint in str(found)


def test_faults_of_both_files_are_listed_together(folder: Path) -> None:
    toml = TOML.replace("slider_mass_g", "slider_mas_g").replace("= 55.0", "= 0.0")
    write(folder, ["T1,raw/T1.csv"], toml=toml, header="test_id,file")
    assert sorted(p.kind for p in refusal(folder)) == [
        "missing_column", "missing_column", "unknown_key", "wrong_value",
    ]  # fmt: skip


def test_what_is_no_toml_is_named_with_its_line(folder: Path) -> None:
    write(folder, [GOOD.format(k=1)], toml=TOML.replace("= 55.0", "55.0"))
    assert [(p.kind, p.row) for p in refusal(folder)] == [("not_toml", 3)]


def test_missing_files_are_named(tmp_path: Path) -> None:
    assert [(p.kind, p.file) for p in refusal(tmp_path)] == [
        ("missing_file", "campaign.toml"),
        ("missing_file", "tests.csv"),
    ]


def test_columns_and_instrument_come_along(folder: Path) -> None:
    toml = TOML + '[columns]\nforce = "Fx [gf]"\n[instrument]\nload_cell_u_percent = 0.5\n'
    write(folder, [GOOD.format(k=1)], toml=toml)
    campaign = load_campaign(folder)
    assert campaign.columns == {"force": "Fx [gf]"}
    assert campaign.instrument == {"load_cell_u_percent": 0.5}


def test_files_that_no_row_names_are_noted(folder: Path) -> None:
    write(folder, [GOOD.format(k=1), GOOD.format(k=2)])
    (folder / "raw" / "notes.csv").write_text("call the supplier")
    notes = {p.file: p.kind for p in load_campaign(folder).problems}
    assert notes == {"raw/T3.csv": "not_listed", "raw/notes.csv": "not_an_export_and_not_listed"}


def zipped(folder: Path, archive: Path, below: str = "") -> Path:
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as out:
        for path in sorted(folder.rglob("*")):
            out.write(path, below + path.relative_to(folder).as_posix())
    return archive


def described(campaign: Campaign) -> tuple:
    return campaign.title, campaign.tests, campaign.samples, campaign.set_aside


@pytest.mark.parametrize("below", ["", "series-01/", "a/b/"])
def test_a_zip_opens_as_its_folder_does_and_leaves_nothing_behind(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, below: str
) -> None:
    archive = zipped(folder, tmp_path_factory.mktemp("zip") / "c.zip", below)
    with open_campaign(archive) as campaign, open_campaign(folder) as same:
        assert described(campaign) == described(same)
        assert (campaign.root / campaign.tests[0].file).is_file()
    assert not campaign.root.exists()
    assert folder.exists()


def _hostile(archive: Path, entry: zipfile.ZipInfo, data: bytes = b"x") -> tuple[Problem, ...]:
    with zipfile.ZipFile(archive, "a", zipfile.ZIP_DEFLATED) as out:
        out.writestr(entry, data, compress_type=zipfile.ZIP_DEFLATED)
    with pytest.raises(CampaignError) as caught, open_campaign(archive):
        pass
    return caught.value.problems


@pytest.mark.parametrize("name", ["../evil.txt", "/evil.txt", "raw/../../evil.txt", "C:/evil.txt", "..\\evil.txt"])
def test_an_entry_that_leaves_the_folder_is_refused(folder: Path, tmp_path: Path, name: str) -> None:
    archive = zipped(folder, tmp_path / "c.zip")
    assert [p.kind for p in _hostile(archive, zipfile.ZipInfo(name))] == ["entry_outside"]


def test_a_link_in_a_zip_is_refused(folder: Path, tmp_path: Path) -> None:
    entry = zipfile.ZipInfo("raw/link.csv")
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    assert [p.kind for p in _hostile(zipped(folder, tmp_path / "c.zip"), entry, b"/etc/passwd")] == ["link"]


def test_a_bomb_is_refused_before_it_is_unpacked(folder: Path, tmp_path: Path) -> None:
    found = _hostile(zipped(folder, tmp_path / "c.zip"), zipfile.ZipInfo("raw/bomb.csv"), bytes(30_000_000))
    assert [p.kind for p in found] == ["zip_bomb"]


def test_what_is_no_zip_is_refused(tmp_path: Path) -> None:
    (tmp_path / "c.zip").write_bytes(b"PK\x03\x04 but no more")
    with pytest.raises(CampaignError, match=r"not a readable \.zip"), open_campaign(tmp_path / "c.zip"):
        pass


def test_a_path_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"folder or \.zip does not exist"), open_campaign(tmp_path / "nothing"):
        pass


def test_several_campaigns_in_one_zip_are_refused(folder: Path, tmp_path: Path) -> None:
    archive = zipped(folder, tmp_path / "c.zip", "a/")
    with zipfile.ZipFile(archive, "a") as out:
        out.writestr("b/campaign.toml", TOML)
    with pytest.raises(CampaignError, match="more than one"), open_campaign(archive):
        pass


def test_the_template_is_a_campaign_once_exports_are_there(tmp_path: Path) -> None:
    write_template(tmp_path / "new")
    (tmp_path / "new" / "raw" / "T0001.csv").write_text("1,2\n")
    (tmp_path / "new" / "raw" / "T0002.csv").write_text("1,2\n")
    campaign = load_campaign(tmp_path / "new")
    assert [t.test_id for t in campaign.tests] == ["T0001"]
    assert [s.test_id for s in campaign.set_aside] == ["T0002"]


def test_the_template_never_overwrites(tmp_path: Path) -> None:
    (tmp_path / "tests.csv").write_text("mine")
    with pytest.raises(CampaignError, match="is not overwritten"):
        write_template(tmp_path)
    assert (tmp_path / "tests.csv").read_text() == "mine"
    assert not (tmp_path / "campaign.toml").exists()


@pytest.mark.parametrize("dialect", DIALECTS)
def test_a_campaign_of_the_virtual_tribometer_holds_180_usable_tests_of_six_samples(
    made: Callable[[str], MadeCampaign], dialect: str
) -> None:
    campaign = load_campaign(made(dialect).folder)
    assert (len(campaign.tests), campaign.set_aside, campaign.problems) == (180, (), ())
    assert list(campaign.samples) == ["F", "A", "B", "C", "Sx", "Sy"]


def test_the_practice_campaigns_hold_324_usable_tests_of_six_samples(practice: Callable[[str], Path]) -> None:
    found = [load_campaign(practice(number)) for number in ("01", "02", "03", "04")]
    assert [(len(c.tests), c.set_aside, c.problems) for c in found] == [(324, (), ())] * 4
    assert [list(c.samples) for c in found] == [["F", "A", "B", "C", "Sx", "Sy"]] * 4


def test_a_load_that_is_not_the_weight_put_on_is_noted_and_used(folder: Path) -> None:
    rows = ["T1,raw/T1.csv,F,F1,50,0.505,,1,", "T2,raw/T2.csv,F,F1,50,5.05,,2,", "T3,raw/T3.csv,F,F1,,5.05,,3,"]
    write(folder, rows)
    campaign = load_campaign(folder)
    assert [t.normal_load_N for t in campaign.tests] == [0.505, 5.05, 5.05]
    (note,) = campaign.problems
    assert (note.kind, note.test_id, note.row, note.column) == ("loads_disagree", "T2", 3, "normal_load_N")


def test_amplitudes_that_were_measured_are_taken_with_their_uncertainties(folder: Path) -> None:
    measured = '\n[measured]\nnormal_load_error = [0.002, 0.005]\n"pattern_geometry:B" = [-0.01, 0.02]\n'
    write(folder, [GOOD.format(k=1)], toml=TOML + measured)
    assert load_campaign(folder).measured == {"normal_load_error": (0.002, 0.005), "pattern_geometry:B": (-0.01, 0.02)}


@pytest.mark.parametrize("given", ["0.002", "[0.002]", "[0.002, 0.0]", '["a", 1.0]', "[nan, 1.0]"])
def test_a_measured_amplitude_without_an_uncertainty_is_a_fault(folder: Path, given: str) -> None:
    write(folder, [GOOD.format(k=1)], toml=f"{TOML}\n[measured]\nsuction = {given}\n")
    with pytest.raises(CampaignError) as caught:
        load_campaign(folder)
    assert {(p.file, p.row) for p in caught.value.problems} == {("campaign.toml", TOML.count("\n") + 3)}


CONDITIONS = "test_id,file,sample,mass_g,speed_mm_s,temperature_C,humidity_pct,roughness_um"


def conditions_and_notes(folder: Path, *conditions: str) -> tuple[Campaign, list[Problem]]:
    """A campaign whose tests have these cells from the speed on, and its notes on cells."""
    rows = [f"T{k},raw/T{k}.csv,F,50,{cells}" for k, cells in enumerate(conditions, 1)]
    for k in range(1, len(rows) + 1):
        (folder / "raw" / f"T{k}.csv").write_text("1,2\n3,4\n5,6\n")
    write(folder, rows, header=CONDITIONS)
    campaign = load_campaign(folder)
    assert campaign.set_aside == ()
    return campaign, [p for p in campaign.problems if p.kind != "not_listed"]


@pytest.mark.parametrize("cell", ["n/a", "-", "<5", "dry", "80 F"])
def test_a_word_in_place_of_a_condition_is_a_gap_with_a_note(folder: Path, cell: str) -> None:
    campaign, (note,) = conditions_and_notes(folder, "0.1,22.5,41,1.5", f"0.1,22.5,{cell},1.5")
    assert [t.humidity_pct for t in campaign.tests] == [41.0, None]
    assert (note.kind, note.row, note.column, note.found) == ("not_recorded", 3, "humidity_pct", cell)


def test_a_number_with_the_unit_of_its_column_is_that_number(folder: Path) -> None:
    campaign, notes = conditions_and_notes(folder, "0.1 mm/s,22.5 °C,45 %,1.5")
    (test,) = campaign.tests
    assert (test.speed_m_s, test.temperature_C, test.humidity_pct) == (pytest.approx(1e-4), 22.5, 45.0)
    assert notes == []


def test_words_of_one_column_are_one_note_with_their_number(folder: Path) -> None:
    _, (note,) = conditions_and_notes(folder, *(f"0.1,22,{cell},1.5" for cell in ("n/a", "-", "n/a", "40")))
    assert (note.row, note.found) == (2, "n/a, -")
    assert note.what.startswith("3 cells")


def test_a_word_for_the_speed_is_not_the_speed_of_the_campaign(folder: Path) -> None:
    campaign, _ = conditions_and_notes(folder, "fast,22,40,1.5", ",22,40,1.5")
    assert [t.speed_m_s for t in campaign.tests] == [None, pytest.approx(2e-4)]


def test_a_word_in_a_further_column_of_numbers_has_a_note_and_in_one_of_names_has_none(folder: Path) -> None:
    numbers = [f"0.1,22,40,1.{k}" for k in range(1, 6)]
    _, (note,) = conditions_and_notes(folder, *numbers, "0.1,22,40,<1")
    assert (note.row, note.column, note.found) == (7, "roughness_um", "<1")
    _, notes = conditions_and_notes(folder, *(cells + "x" for cells in numbers))
    assert notes == []
