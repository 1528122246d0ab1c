"""Commands write where only tribo has written: never into a campaign, never among or in place of files of others."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from on_the_command_line import digest, run

import tribo
from tribo.errors import CampaignError

COMMANDS = ("ingest", "fit", "predict", "compare", "diagnose", "report")
QUICK = ("--blocks", 45, "--dt", 1e-7, "--set", "rest_tolerance=0.01", "--set", "duration_peaks=1.5")


@pytest.fixture
def lab(eight_pulls: Path, tmp_path: Path) -> Path:
    """A folder that holds a campaign, in a folder of its own."""
    shutil.copytree(eight_pulls, tmp_path / "lab" / "campaign")
    return tmp_path / "lab"


def linked_campaign(lab: Path) -> Path:
    (lab.parent / "link").symlink_to(lab / "campaign")
    return lab.parent / "link"


def figures_linked_into_the_campaign(lab: Path) -> Path:
    out = lab.parent / "out"
    out.mkdir()
    (out / "figures").symlink_to(lab / "campaign" / "raw")
    return out


PLACES: dict[str, Callable[[Path], Path]] = {
    "the campaign": lambda lab: lab / "campaign",
    "raw": lambda lab: lab / "campaign" / "raw",
    "a new folder in it": lambda lab: lab / "campaign" / "results" / "first",
    "the folder around it": lambda lab: lab,
    "two folders around it": lambda lab: lab.parent,
    "a link to it": linked_campaign,
    "a detour to it": lambda lab: lab / "x" / ".." / "campaign",
    "a folder with figures linked into it": figures_linked_into_the_campaign,
}


EVERY_COMMAND_AND_EVERY_PLACE = [(c, "the campaign", ()) for c in COMMANDS] + [("fit", p, ("--force",)) for p in PLACES]


@pytest.mark.parametrize(("command", "place", "force"), EVERY_COMMAND_AND_EVERY_PLACE)
def test_no_command_writes_into_or_around_its_campaign(
    lab: Path, command: str, place: str, force: tuple[str, ...]
) -> None:
    out = PLACES[place](lab)
    before = digest(lab)
    result = run(command, lab / "campaign", "-o", out, *force)
    assert result.exit_code == 1
    assert "results must not be written here" in result.stderr
    assert digest(lab) == before


@pytest.mark.parametrize("out", [".", "raw", "..", "../campaign"])
def test_a_command_that_starts_in_its_campaign_writes_nothing_there(
    lab: Path, monkeypatch: pytest.MonkeyPatch, out: str
) -> None:
    before = digest(lab)
    monkeypatch.chdir(lab / "campaign")
    assert run("report", ".", "-o", out).exit_code == 1
    assert digest(lab) == before


def test_a_link_to_a_campaign_is_the_campaign(lab: Path) -> None:
    before = digest(lab)
    assert run("fit", linked_campaign(lab), "-o", lab / "campaign" / "out").exit_code == 1
    assert digest(lab) == before


def test_a_zip_is_not_written_around(lab: Path) -> None:
    archive = shutil.make_archive(str(lab / "zipped"), "zip", lab / "campaign")
    (lab / "only").mkdir()
    alone = shutil.move(archive, lab / "only" / "campaign.zip")
    before = digest(lab)
    result = run("fit", alone, "-o", lab / "only", "--force")
    assert result.exit_code == 1
    assert "holds" in result.stderr
    assert run("fit", alone, "-o", alone).exit_code == 2
    assert digest(lab) == before


def test_no_command_writes_into_another_campaign(lab: Path, eight_pulls: Path) -> None:
    before = digest(lab)
    result = run("fit", eight_pulls, "-o", lab / "campaign" / "out", "--force")
    assert result.exit_code == 1
    assert "lies in the campaign" in result.stderr
    assert digest(lab) == before


@pytest.mark.parametrize("command", COMMANDS)
def test_a_folder_with_files_of_others_is_refused_as_it_is(eight_pulls: Path, tmp_path: Path, command: str) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "tests.csv").write_text("mine\n")
    (tmp_path / "out" / "letter.txt").write_text("mine too\n")
    before = digest(tmp_path)
    result = run(command, eight_pulls, "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "letter.txt, tests.csv" in result.stderr
    assert "--force" in result.stderr
    assert digest(tmp_path) == before


def test_a_dry_run_refuses_the_folder_that_the_run_would_refuse(lab: Path) -> None:
    assert run("report", lab / "campaign", "-o", lab, "--dry-run").exit_code == 1


def test_with_force_results_stand_among_files_of_others(eight_pulls: Path, tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("mine\n")
    (tmp_path / "tests.csv").write_text("mine\n")
    assert run("ingest", eight_pulls, "-o", tmp_path, "--force").exit_code == 0
    assert (tmp_path / "letter.txt").read_text() == "mine\n"
    assert (tmp_path / "tests.csv").read_text().startswith("test_id,")


def test_results_are_written_again_into_their_own_folder_and_beside_notes(eight_pulls: Path, tmp_path: Path) -> None:
    assert run("ingest", eight_pulls, "-o", tmp_path / "out").exit_code == 0
    (tmp_path / "out" / "overrides.csv").write_text("test_id,action,reason\n")
    assert run("ingest", eight_pulls, "-o", tmp_path / "out").exit_code == 0
    assert (tmp_path / "out" / "overrides.csv").is_file()


def test_a_file_of_a_users_own_beside_results_is_not_replaced(eight_pulls: Path, tmp_path: Path) -> None:
    assert run("ingest", eight_pulls, "-o", tmp_path / "out").exit_code == 0
    (tmp_path / "out" / "fits.csv").write_text("mine\n")
    result = run("fit", eight_pulls, "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "'fits.csv'" in result.stderr
    assert (tmp_path / "out" / "fits.csv").read_text() == "mine\n"


def test_a_finished_run_leaves_neither_lock_nor_mark(eight_pulls: Path, tmp_path: Path) -> None:
    run("ingest", eight_pulls, "-o", tmp_path / "out")
    assert [p.name for p in (tmp_path / "out").iterdir() if p.name.startswith(".")] == []


def test_a_failed_run_leaves_no_folder(tmp_path: Path) -> None:
    (tmp_path / "campaign").mkdir()
    (tmp_path / "campaign" / "campaign.toml").write_text("[campaign\n")
    assert run("fit", tmp_path / "campaign", "-o", tmp_path / "out").exit_code == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("runs", [(), ("--repeats", 1)])
def test_a_simulation_replaces_no_file_of_another_kind(tmp_path: Path, runs: tuple[object, ...]) -> None:
    precious = tmp_path / "precious.csv"
    precious.write_text("a,b\n1,2\n")
    result = run("simulate", "--sample", "F", "--pressure", 5, *QUICK, *runs, "-o", precious)
    assert result.exit_code == 1
    assert "this file is not replaced" in result.stderr
    assert precious.read_text() == "a,b\n1,2\n"
    assert list(tmp_path.iterdir()) == [precious]
    asked = ("simulate", "--sample", "F", "--pressure", 5, *QUICK, *runs)
    assert run(*asked, "-o", precious, "--force").exit_code == 0
    assert run(*asked, "-o", precious).exit_code == 0


def test_one_run_does_not_replace_an_ensemble(tmp_path: Path) -> None:
    asked = ("simulate", "--sample", "F", "--pressure", 5, *QUICK, "-o", tmp_path / "e.nc")
    assert run(*asked, "--repeats", 1).exit_code == 0
    before = digest(tmp_path)
    result = run(*asked)
    assert result.exit_code == 1
    assert "an ensemble of the spring-block model" in result.stderr
    assert digest(tmp_path) == before


def test_an_ensemble_of_another_design_is_replaced_only_by_force(tmp_path: Path) -> None:
    asked = ("simulate", "--sample", "F", *QUICK, "-o", tmp_path / "e.nc", "--repeats", 1)
    assert run(*asked, "--pressure", 5).exit_code == 0
    assert run(*asked, "--pressure", 6).exit_code == 1
    found = run(*asked, "--pressure", 6, "--force", "--json")
    assert [row["pressure_Pa"] for row in json.loads(found.stdout)["means"]] == [6e3]


def test_a_simulation_is_not_written_into_a_campaign(lab: Path) -> None:
    before = digest(lab)
    out = lab / "campaign" / "raw" / "run.nc"
    assert run("simulate", "--sample", "F", "--pressure", 5, *QUICK, "-o", out, "--force").exit_code == 1
    assert digest(lab) == before


@pytest.mark.parametrize("site", ["drop", "drop/site", "drop/campaign/site", "", "link", "elsewhere/campaign/site"])
def test_a_site_is_not_built_in_or_around_the_folder_of_campaigns(
    eight_pulls: Path, tmp_path: Path, site: str
) -> None:
    pytest.importorskip("snakemake")
    shutil.copytree(eight_pulls, tmp_path / "drop" / "campaign")
    shutil.copytree(eight_pulls, tmp_path / "elsewhere" / "campaign")
    (tmp_path / "drop" / "other").symlink_to(tmp_path / "elsewhere" / "campaign")
    (tmp_path / "link").symlink_to(tmp_path / "drop")
    before = digest(tmp_path)
    result = run("build", tmp_path / "drop", "-o", tmp_path / site, "--force")
    assert result.exit_code == 1
    assert "results must not be written here" in result.stderr
    assert digest(tmp_path) == before


@pytest.mark.parametrize("more", [(), ("--dry-run",)])
def test_a_site_is_not_built_among_files_of_others(tmp_path: Path, more: tuple[str, ...]) -> None:
    pytest.importorskip("snakemake")
    (tmp_path / "drop").mkdir()
    (tmp_path / "site" / "current").mkdir(parents=True)
    (tmp_path / "site" / "current" / "index.html").write_text("mine")
    before = digest(tmp_path)
    result = run("build", tmp_path / "drop", "-o", tmp_path / "site", *more)
    assert result.exit_code == 1
    assert "files that tribo has not written" in result.stderr
    assert digest(tmp_path) == before


def test_the_functions_of_python_refuse_the_same_folders(lab: Path) -> None:
    with tribo.open_campaign(lab / "campaign") as campaign:
        study = tribo.study(campaign, until="ingest")
    before = digest(lab)
    for out in (lab / "campaign", lab):
        with pytest.raises(CampaignError, match="results must not be written here"):
            tribo.write_report(study, out)
    assert digest(lab) == before
