"""Typical mistakes end with a message that names the place and the remedy, before anything is computed."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from on_the_command_line import digest, run
from report.laid_out import html
from support import first_quick
from support.sled import SledDesign, SledLaw, write_campaign

from mistakes.cases import MISTAKES
from mistakes.slips import Mistake, each_row, workbook
from tribo import stages
from tribo.campaign import load_campaign
from tribo.errors import CampaignError

MOST_LINES = 6
TOML = """\
[campaign]
title = "small"
material = "PDMS"
nominal_area_mm2 = 55.0
slider_mass_g = 1.5
[patterns.F]
cavity = "none"
[patterns.B]
cavity = "circle"
diameter_um = 10.0
pitch_um = [15.0, 15.0]
[patterns.S]
cavity = "rectangle"
size_um = [200.0, 40.0]
pitch_um = [220.0, 120.0]
"""


def written(folder: Path, masses_g: tuple[float, ...], specimens: int) -> Path:
    """A campaign without a mistake: samples F, B and Sx, one pull of each specimen at each load."""
    law = SledLaw(3.6, 10e3, 2.9, 6e3)
    laws = {"F": SledLaw(4.8, 23e3, 2.9, 12e3), "B": law, "Sx": law}
    write_campaign(folder, SledDesign(laws, masses_g=masses_g, specimens=specimens, repeats=1), TOML, seed=7)
    for path in (folder / "raw").iterdir():
        path.write_bytes(path.read_bytes().replace(b"\r\n", b"\n"))
    return folder


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("right") / "campaign", (25.0, 138.5), 2)


@pytest.fixture(scope="module")
def with_siblings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("siblings") / "campaign", (12.0, 25.0, 50.0, 90.0, 138.5), 3)


@pytest.fixture
def campaign(right: Path, tmp_path: Path) -> Path:
    shutil.copytree(right, tmp_path / "campaign")
    return tmp_path / "campaign"


@pytest.fixture
def spoiled(mistake: Mistake, right: Path, with_siblings: Path, tmp_path: Path) -> tuple[object, ...]:
    """What a command is given once the mistake is made: the campaign, or what ``make`` says."""
    folder = tmp_path / "campaign"
    shutil.copytree(with_siblings if mistake.with_siblings else right, folder)
    return tuple(mistake.make(folder) or (folder,))


def test_a_campaign_without_a_mistake_is_not_doubted(campaign: Path, tmp_path: Path) -> None:
    result = run("report", campaign, "-o", tmp_path / "out", "--dry-run")
    assert result.exit_code == 0
    assert "checked: 12 tests can be used; nothing is doubtful" in result.stdout


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name.replace(" ", "_"))
def test_a_dry_run_names_the_place_and_the_remedy_of_a_mistake(
    mistake: Mistake, spoiled: tuple[object, ...], tmp_path: Path
) -> None:
    given = spoiled
    before = digest(tmp_path)
    where = () if "-o" in given else ("-o", tmp_path / "out")
    result = run("report", *given, *where, "--dry-run", "-q")
    assert result.exit_code in mistake.status, result.output
    said = [line for line in result.output.splitlines() if not line.startswith(("would ", "checked: ", "Usage", "Try"))]
    text = "\n".join(said)
    assert re.search(mistake.place, text), result.output
    assert re.search(mistake.remedy, text), result.output
    assert len([line for line in said if line.startswith("  ")]) <= MOST_LINES, result.output
    assert digest(tmp_path) == before


@pytest.mark.parametrize(
    "mistake", first_quick(m for m in MISTAKES if 0 in m.status), ids=lambda mistake: mistake.name.replace(" ", "_")
)
def test_a_run_that_ends_with_status_0_says_what_is_absurd(
    mistake: Mistake, spoiled: tuple[object, ...], tmp_path: Path
) -> None:
    result = run("ingest", *spoiled, "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert re.search("doubtful number|used with doubts", result.stderr)
    assert re.search(mistake.remedy, result.stderr), result.stderr


def test_a_campaign_may_state_bounds_of_its_own(campaign: Path, tmp_path: Path) -> None:
    with (campaign / "campaign.toml").open("a", encoding="utf-8") as stream:
        stream.write("[plausible]\nmu = [0.1, 2]\n")
    result = run("fit", campaign, "-o", tmp_path / "out", "--dry-run", "-q")
    assert re.search(r"mu is .* \(Sx, static\).*; plausible \(elastomer\): 0.1 to 2; ", result.stdout)


def with_mistake(campaign: Path, name: str) -> Path:
    next(mistake for mistake in MISTAKES if mistake.name == name).make(campaign)
    return campaign


def test_the_page_begins_with_the_doubtful_numbers(campaign: Path) -> None:
    study = stages.study(load_campaign(with_mistake(campaign, "grams typed as newtons")), until="ingest")
    page = html(study, drawn={})
    assert 'id="doubts"' in page.partition('id="short"')[0]
    assert "grams: move it to a column mass_g" in page


def test_diagnose_alone_doubts_loads_that_give_no_law(campaign: Path, tmp_path: Path) -> None:
    with_mistake(campaign, "loads 0.1 % apart")
    result = run("diagnose", campaign, "-o", tmp_path / "out", "--dry-run", "-q")
    assert result.exit_code == 0
    assert "loads this close determine neither mu nor tau0" in result.stdout


def test_the_tests_may_be_listed_in_a_workbook(campaign: Path, tmp_path: Path) -> None:
    listed = load_campaign(campaign).tests
    workbook(campaign)
    found = load_campaign(campaign)
    assert [(t.test_id, t.normal_load_N, t.speed_m_s, t.started_at) for t in found.tests] == [
        (t.test_id, t.normal_load_N, t.speed_m_s, t.started_at) for t in listed
    ]
    assert "tests.xlsx" in found.inputs
    assert run("ingest", campaign, "-o", tmp_path / "out", "-q").exit_code == 0


def test_two_lists_of_tests_are_refused(campaign: Path) -> None:
    text = (campaign / "tests.csv").read_bytes()
    workbook(campaign)
    (campaign / "tests.csv").write_bytes(text)
    with pytest.raises(CampaignError, match="more than one file"):
        load_campaign(campaign)


def test_a_dry_run_lists_faults_of_options_table_and_output_at_once(campaign: Path) -> None:
    each_row(lambda row: {"mass_g": f"{row['mass_g']} g"}, 0, 1)(campaign)
    result = run("report", campaign, "-o", campaign, "--rule", "first_peek", "--flat", "Q", "--dry-run")
    assert result.exit_code == 1
    for said in ("did you mean first_peak?", "--flat", "outside of every campaign", "did you mean 25?"):
        assert said in result.output or said.replace("25", "138.5") in result.output


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["reprot", "x"], "did you mean report?"),
        (["inspect", "x", "--set", "lever_arm=3"], "did you mean lever_arm_mm?"),
    ],
)
def test_words_of_the_command_line_that_are_not_known_are_asked_about(
    tmp_path: Path, words: list[str], meant: str
) -> None:
    (tmp_path / "x").write_text("")
    result = run(*(tmp_path / w if w == "x" else w for w in words))
    assert result.exit_code == 2
    assert meant in result.stderr


def test_more_than_sixty_mistakes_are_tried() -> None:
    assert len({mistake.name for mistake in MISTAKES}) == len(MISTAKES) >= 60
