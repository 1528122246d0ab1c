"""Two small campaigns, built for real: killed and resumed, two starts at once, nothing to do, exports that change.

The second has flat samples alone. The processes of these builds are forked from one that has loaded its modules, and
simulate small lattices; the tests at the end start Python for every step.
"""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from support.campaigns import SMALL_TOML, small

from pipeline.quick_starts import quick_starts

pytest.importorskip("snakemake")
JOBS = 2


@dataclass(frozen=True)
class Round:
    """One build: what it said, how it ended, and all files of the site after it."""

    said: dict[str, Any]
    status: int
    after: dict[str, bytes]


def records_in(names: Iterable[str]) -> set[str]:
    """Names of records of finished steps; one that is being written has a name of its own."""
    return {name for name in names if re.fullmatch(r"\.tribo/steps/[^/]+/[^./][^/]*\.json", name)}


@dataclass(frozen=True)
class Lab:
    """A drop folder and its site; what is started as Python, and its environment."""

    drop: Path
    site: Path
    python: str = sys.executable
    environment: Mapping[str, str] = field(default_factory=lambda: dict(os.environ))

    def words(self, *more: str) -> list[str]:
        """The command and its options."""
        chosen = ["--json", "--settle", "0", "--runs", "2", "--jobs", str(JOBS)]
        return ["build", str(self.drop), "-o", str(self.site), *chosen, *more]

    def start(self, *more: str) -> subprocess.Popen[str]:
        """Start `tribo build` in a process group of its own."""
        return subprocess.Popen(
            [self.python, "-m", "tribo", *self.words(*more)], text=True, process_group=0, env=self.environment,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip

    def finish(self, process: subprocess.Popen[str]) -> Round:
        """Wait for a build."""
        said, complaints = process.communicate()
        assert "Traceback" not in complaints, complaints
        return Round(json.loads(said or "{}"), process.returncode, self.files())

    def build(self, *more: str) -> Round:
        """Run a build to its end."""
        return self.finish(self.start(*more))

    def files(self) -> dict[str, bytes]:
        """Records of finished steps and outputs: every file of the site that a build may not touch without need."""
        places = (self.site / ".tribo" / "steps", self.site / "current")
        found = [p for place in places if place.is_dir() for p in place.rglob("*") if p.is_file()]
        return {str(p.relative_to(self.site)): p.read_bytes() for p in found}

    def wait_for(self, condition: Callable[[], bool]) -> None:
        """Look every few milliseconds until the condition holds."""
        until = time.monotonic() + 300
        while not condition():
            assert time.monotonic() < until, "never happened"
            time.sleep(0.02)

    def records(self) -> set[str]:
        """Names alone: while a build runs, a file that is listed may be gone before it is read."""
        steps = self.site / ".tribo" / "steps"
        return records_in(str(p.relative_to(self.site)) for p in steps.rglob("*")) if steps.is_dir() else set()


@dataclass(frozen=True)
class Story:
    """What the lab saw, build by build."""

    lab: Lab
    killed: dict[str, bytes]
    resumed: Round
    refused: subprocess.CompletedProcess[str]
    idle: Round
    mixed: Round
    added: Round
    again: Round
    nothing: Round
    restored: Round


def rows(campaign: Path) -> list[dict[str, str]]:
    with (campaign / "tests.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def write_rows(campaign: Path, table: list[dict[str, str]]) -> None:
    with (campaign / "tests.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(table[0]))
        writer.writeheader()
        writer.writerows(table)


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, dict[str, str]]]:
    """What is started in place of Python, and its environment."""
    with quick_starts(tmp_path_factory.mktemp("starts")) as serving:
        yield serving


@pytest.fixture(scope="module")
def story(tmp_path_factory: pytest.TempPathFactory, started: tuple[str, dict[str, str]]) -> Story:
    """The whole story, told once; each test looks at one of its builds."""
    drop, lab, elsewhere = map(tmp_path_factory.mktemp, ("drop", "lab", "elsewhere"))
    return told(Lab(drop, lab / "site", *started), elsewhere)


@pytest.fixture
def fresh(tmp_path: Path, started: tuple[str, dict[str, str]]) -> Lab:
    """A drop folder and a site that are not there yet."""
    return Lab(tmp_path / "drop", tmp_path / "site", *started)


def told(lab: Lab, other: Path) -> Story:
    a, b = small(lab.drop / "a", 0), small(lab.drop / "b", 1, samples="F")
    elsewhere = small(other, 2)

    first = lab.start()
    lab.wait_for(lambda: len(lab.records()) >= 2)
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate()
    killed = lab.files()

    second = lab.start()
    lab.wait_for(lambda: lab.records() > records_in(killed))
    third = lab.start()
    refused = subprocess.CompletedProcess("third", 0, *third.communicate())
    refused.returncode = third.returncode
    fourth = lab.start("--wait", "600")
    resumed = lab.finish(second)
    idle = lab.finish(fourth)

    # one export of a pattern of a is measured again and one is taken away, one is on its way to b
    of_b, gone = [row for row in rows(a) if row["sample"] == "B"][:2]
    shutil.copy(elsewhere / of_b["file"], a / of_b["file"])
    write_rows(a, [row for row in rows(a) if row != gone])
    (a / gone["file"]).unlink()
    (b / "raw" / "T009.csv.part").write_bytes((a / "raw" / "T001.csv").read_bytes()[:500])
    mixed = lab.build()

    (b / "raw" / "T009.csv.part").unlink()
    first_of_b = rows(b)[0]
    shutil.copy(b / first_of_b["file"], b / "raw" / "T009.csv")
    write_rows(b, [*rows(b), {**first_of_b, "test_id": "T009", "file": "raw/T009.csv"}])
    added = lab.build()
    for file in lab.drop.rglob("*"):
        os.utime(file, (1.7e9, 1.7e9))
    again, nothing = lab.build(), lab.build("--dry-run")
    (lab.site / "current" / "a" / "report.html").unlink()
    return Story(lab, killed, resumed, refused, idle, mixed, added, again, nothing, lab.build())


def touched(before: dict[str, bytes], after: dict[str, bytes]) -> set[str]:
    """Campaigns with a file that differs between two states of the site."""
    differing = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    found = (re.search(r"(?:steps|current)/([^/]+)/", name) for name in differing)
    return {m.group(1) for m in found if m}


@pytest.mark.slow
def test_a_killed_build_leaves_whole_files_only(story: Story) -> None:
    assert 0 < len(records_in(story.killed)) < 4
    for name, content in story.killed.items():
        if name.endswith(".json"):
            json.loads(content)


@pytest.mark.slow
def test_the_next_build_goes_on_where_the_killed_one_stopped(story: Story) -> None:
    assert story.resumed.status == 0
    kept = records_in(story.killed)
    again = {name for name in kept if story.resumed.after[name] != story.killed[name]}
    assert len(again) <= JOBS  # at most those that were ending when they were killed
    assert kept - again
    jobs = (re.match(r"(\w+) \((\w)\):", step) for step in story.resumed.said["steps"])
    assert {f".tribo/steps/{job.group(2)}/{job.group(1)}.json" for job in jobs if job} & kept == again


@pytest.mark.slow
@pytest.mark.parametrize("name", "ab")
def test_every_campaign_has_its_report_and_a_place_in_the_index(story: Story, name: str) -> None:
    latest = story.lab.site / "latest"
    assert (latest / name / "report.html").stat().st_size > 10_000
    assert f'href="{name}/report.html"' in (latest / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_of_two_starts_at_once_one_leaves_and_says_why(story: Story) -> None:
    assert story.refused.returncode == 75
    assert "another build of this site is running" in story.refused.stderr


@pytest.mark.slow
def test_a_start_that_waits_finds_nothing_left_to_do(story: Story) -> None:
    assert (story.idle.status, story.idle.said["steps"], story.idle.said["due"]) == (0, [], {})
    assert story.idle.after == story.resumed.after
    assert story.idle.said["dated"] is None


@pytest.mark.slow
def test_only_campaigns_whose_exports_changed_or_went_are_built_again(story: Story) -> None:
    assert set(story.mixed.said["due"]) == {"a"}
    why = r"changed raw/T\d+.csv, tests.csv; removed raw/T\d+.csv"
    assert re.fullmatch(why, story.mixed.said["due"]["a"]), story.mixed.said["due"]["a"]
    assert touched(story.idle.after, story.mixed.after) == {"a"}


@pytest.mark.slow
def test_a_half_copied_export_is_left_for_the_next_round_and_named(story: Story) -> None:
    assert story.mixed.status == 3
    assert story.mixed.said["waiting"] == {"b": ["raw/T009.csv.part is being uploaded"]}
    index = story.mixed.after["current/index.html"].decode()
    assert "postponed to the next build" in index
    assert "raw/T009.csv.part is being uploaded" in index


@pytest.mark.slow
def test_a_changed_export_of_a_pattern_runs_no_simulation_again(story: Story) -> None:
    cells = [name for name in story.idle.after if re.search(r"current/a/kept/.*(\.nc|calibration.json)$", name)]
    assert len(cells) == 5
    assert all(story.idle.after[name] == story.mixed.after[name] for name in cells)


@pytest.mark.slow
def test_an_added_export_builds_its_campaign_and_no_other(story: Story) -> None:
    assert story.added.status == 0
    assert story.added.said["due"] == {"b": "changed tests.csv; added raw/T009.csv"}
    assert touched(story.mixed.after, story.added.after) == {"b"}
    assert b"T009" in story.added.after["current/b/tests.csv"]


@pytest.mark.slow
def test_new_dates_on_the_same_contents_build_nothing(story: Story) -> None:
    assert (story.again.said["steps"], story.again.after) == ([], story.added.after)


@pytest.mark.slow
def test_a_dry_run_with_nothing_to_do_names_no_step(story: Story) -> None:
    assert (story.nothing.said["steps"], story.nothing.said["due"]) == ([], {})


@pytest.mark.slow
def test_a_report_that_was_deleted_is_made_again_from_what_is_there(story: Story) -> None:
    assert story.restored.said["due"] == {"a": "report.html has been deleted"}
    assert [step.split(":")[0] for step in story.restored.said["steps"]] == ["report (a)", "index"]
    assert "current/a/report.html" in story.restored.after


@pytest.mark.slow
def test_each_build_that_changed_something_is_kept_by_its_date(story: Story) -> None:
    made = [Path(r.said["dated"]) for r in (story.resumed, story.mixed, story.added, story.restored)]
    assert sorted(p.name for p in (story.lab.site / "builds").iterdir()) == [p.name for p in made]
    assert (story.lab.site / "latest").resolve() == made[-1].resolve()


def test_a_dry_run_says_why_each_step_would_run_and_does_nothing(fresh: Lab) -> None:
    small(fresh.drop / "a", 0)
    dry = fresh.build("--dry-run")
    assert dry.said["due"] == {"a": "new"}
    steps = {step.split(" (")[0].split(":")[0] for step in dry.said["steps"]}
    assert steps == {"predict", "report", "index"}
    assert all(step.endswith(": not finished before") for step in dry.said["steps"])
    assert dry.after == {}


def test_the_slurm_profile_is_accepted_and_runs_cell_by_cell(fresh: Lab) -> None:
    small(fresh.drop / "a", 0)
    dry = fresh.build("--dry-run", "--profile", "slurm")
    cells = [step for step in dry.said["steps"] if step.startswith("simulate")]
    assert len(cells) == 4
    assert all("Pa)" in step for step in cells)


def test_an_unusable_campaign_is_named_and_keeps_no_other_back(fresh: Lab) -> None:
    folder = fresh.drop / "broken"
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(SMALL_TOML.format(title="x"))
    (folder / "tests.csv").write_text("test_id,file,sample,mass_g\nT1,raw/T1.csv,F,5\n")
    first = fresh.build()
    assert (first.status, first.said["status"]) == (3, {"broken": "unusable"})
    index = first.after["current/index.html"].decode()
    assert "input not usable" in index
    assert "this file does not exist" in index
    assert fresh.build().said["steps"] == []
