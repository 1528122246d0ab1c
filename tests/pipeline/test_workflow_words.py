"""Whatever campaigns, samples, options and folders are called, every step gets exactly the words meant for it.

The workflow is run as it is, with a stand-in for Python that only notes its arguments.
"""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import first_quick

from tribo.cli import workflow_step
from tribo.site.build import BuildOptions, build_site, workflow_dir

pytest.importorskip("snakemake")

STAND_IN = """#!/bin/sh
case $3 in *index_page) record=$5;; *) record=$4;; esac
mkdir -p "$(dirname "./$record")"
echo done > "./$record"
printf '%s\\0' "$@" "$record" >> {notes}
printf '\\n' >> {notes}
"""
NAMES = (
    "-o", "a'b\"c; touch evil $(touch evil) `touch evil` && touch evil",
    "--config=evil > evil | tee evil * ~ !! $HOME %i back\\slash é #a",
)  # fmt: skip
JOBS = ("--jobs", "1")
ODD = "x y; touch evil $(touch evil) `touch evil` '\" \\ {output} {{}} > evil"


def written(folder: Path) -> Path:
    """A configuration for campaigns of all these names, with odd options, and the stand-in."""
    stand_in = folder / "it's {python}; touch evil"
    stand_in.write_text(STAND_IN.format(notes=shlex.quote(str(folder / "notes"))))
    stand_in.chmod(0o755)
    ready = {
        name: {
            "name": name, "path": f"/drop/{name}", "digest": f"d {name} s {shlex.join(['--flat', ODD])}",
            "samples": [], "cells": [name], "files": f"inputs/{name}.json",
            "overrides": shlex.join(["--overrides", f"/drop/{name}{ODD}"]),
        }
        for name in NAMES
    }  # fmt: skip
    options = {name: shlex.join(["--flat", ODD]) for name in ("fit", "model", "diagnose")}
    config = {"ready": ready, "campaigns": {}, "digest": "d", "options": options}
    file = folder / "build.json"
    file.write_text(json.dumps({**config, "python": str(stand_in), "threads": 1}))
    return file


def notes(folder: Path, by: str) -> list[list[str]]:
    """The words of every step, in the order in which they ran; ``by`` is what a step runs the simulations of."""
    state = folder / "site" / ".tribo"
    state.mkdir(parents=True)
    command = [
        sys.executable, "-P", "-m", "snakemake", "--snakefile", str(workflow_dir() / "Snakefile"), "--directory",
        str(state), "--configfile", str(written(folder)), "--profile", str(workflow_dir() / "profiles" / "local"),
        "--workflow-profile", "none", "--cores", "1", "--nolock", "--nocolor", "--quiet", "all",
        "--config", f"simulate_by={by}",
    ]  # fmt: skip
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr[-3000:]
    return [line.split("\0")[:-2] for line in (folder / "notes").read_text().splitlines()]


def expected(name: str, step: str, *more: str, after: str = "fit", record: str = "") -> list[Any]:
    record = f"steps/{name}/{record or step}.json"
    digest = f"d {name} s {shlex.join(['--flat', ODD])}"
    own = ["-P", "-m", "tribo.cli.workflow_step", record, "--digest", digest]
    own += ["--laws", "laws"] if step in ("diagnose", "report") else []
    own += ["--after", f"steps/{name}/{after}.json"] if after else []
    own += ["--files", f"inputs/{name}.json"] if step == "report" else []
    given = ["--flat", ODD, "--overrides", f"/drop/{name}{ODD}"]
    out = ["-o", f"../current/{name}", "--wait", "600"]
    return [*own, "--", step, *more, f"/drop/{name}", *out, *given]


def on_this_machine(name: str) -> list[list[Any]]:
    return [expected(name, "predict", *JOBS, after=""), expected(name, "report", *JOBS, after="")]


def on_a_cluster(name: str) -> list[list[Any]]:
    """The cell of each campaign is called as the campaign is."""
    return [
        expected(name, "fit", after=""),
        expected(name, "predict", "--only", "calibration", *JOBS, record="calibrate"),
        expected(name, "predict", "--only", name, *JOBS, after="calibrate", record=f"simulate-{name}"),
        expected(name, "diagnose", *JOBS),
        expected(name, "report", *JOBS),
    ]


@pytest.mark.parametrize(("by", "words_of"), first_quick([("cell", on_a_cluster), ("campaign", on_this_machine)]))
def test_every_step_gets_the_words_meant_for_it_and_nothing_else_runs(
    tmp_path: Path, by: str, words_of: Callable[[str], list[list[Any]]]
) -> None:
    found = notes(tmp_path, by)
    assert found.pop() == ["-P", "-m", "tribo.site.index_page", "..", "index.json"]
    for name in NAMES:
        of_campaign = [words for words in found if f"/drop/{name}" in words]
        wanted = words_of(name)
        assert of_campaign == wanted
    assert len(found) == len(NAMES) * len(wanted)
    assert not list(tmp_path.rglob("evil"))


def test_a_step_is_not_run_where_an_earlier_one_could_not_use_the_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tribo.cli.workflow_step._run", lambda command: pytest.fail("the step was run"))
    steps = tmp_path / "steps" / "a"
    steps.mkdir(parents=True)
    fit, diagnose, problems = steps / "fit.json", steps / "diagnose.json", [{"what": "no such sample"}]
    fit.write_text(json.dumps({"status": "unusable", "problems": problems}))
    assert workflow_step.main([str(diagnose), "--digest", "d", "--after", str(fit), "--", "diagnose", "a"]) == 0
    written = json.loads(diagnose.read_text())
    assert (written["status"], written["problems"]) == ("unusable", problems)


PLANTED = "import pathlib\npathlib.Path({mark!r}).touch()\n"


def test_nothing_in_the_folder_where_a_build_starts_is_run_or_obeyed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start, drop = tmp_path / "start", tmp_path / "drop"
    for folder in (start / "profiles" / "default", drop / "a"):
        folder.mkdir(parents=True)
    for module in ("snakemake", "yaml", "sitecustomize"):
        (start / f"{module}.py").write_text(PLANTED.format(mark=str(tmp_path / "ran")))
    (start / "profiles" / "default" / "config.yaml").write_text("summary: true\n")  # a report in place of a build
    (drop / "a" / "campaign.toml").write_text("")
    monkeypatch.chdir(start)
    built = build_site(drop, tmp_path / "site", BuildOptions(settle_s=0.0), dry_run=True)
    assert any(step.startswith("predict (a)") for step in built.steps)
    assert not (tmp_path / "ran").exists()
