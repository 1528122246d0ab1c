"""Whatever campaigns, samples, options and folders are called, every step gets exactly the words meant for it.

The workflow is run as it is, with a stand-in for Python that only notes its arguments.
"""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tribo.pipeline.build import BuildOptions, build_site, workflow_dir

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
ODD = "x y; touch evil $(touch evil) `touch evil` '\" \\ {output} {{}} > evil"


def written(folder: Path) -> Path:
    """A configuration for campaigns of all these names, with odd options, and the stand-in."""
    stand_in = folder / "it's {python}; touch evil"
    stand_in.write_text(STAND_IN.format(notes=shlex.quote(str(folder / "notes"))))
    stand_in.chmod(0o755)
    ready = {
        name: {
            "path": f"/drop/{name}", "digest": f"d {name}", "samples": [name], "cells": [],
            "files": f"inputs/{name}.json", "overrides": shlex.join(["--overrides", f"/drop/{name}{ODD}"]),
        }
        for name in NAMES
    }  # fmt: skip
    options = {name: shlex.join(["--flat", ODD]) for name in ("fit", "model", "diagnose", "words")}
    config = {"ready": ready, "campaigns": {}, "digest": "d", "options": options, "sources": "s"}
    file = folder / "build.json"
    file.write_text(json.dumps({**config, "python": str(stand_in), "threads": 1}))
    return file


def notes(folder: Path) -> list[list[str]]:
    state = folder / "site" / ".tribo"
    state.mkdir(parents=True)
    command = [
        sys.executable, "-P", "-m", "snakemake", "--snakefile", str(workflow_dir() / "Snakefile"), "--directory",
        str(state), "--configfile", str(written(folder)), "--profile", str(workflow_dir() / "profiles" / "local"),
        "--workflow-profile", "none", "--cores", "1", "--nolock", "--nocolor", "--quiet", "all",
    ]  # fmt: skip
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr[-3000:]
    return [line.split("\0")[:-2] for line in (folder / "notes").read_text().splitlines()]


def expected(name: str, step: str, *more: str, after: str, first: str = "") -> list[Any]:
    record = f"steps/{name}/{first or step}.json"
    digest = f"d {name} s {shlex.join(['--flat', ODD])}"
    own = ["-P", "-m", "tribo.cli.workflow_step", record, "--digest", digest]
    own += ["--laws", "laws"] if step in ("diagnose", "report") else []
    own += ["--after", f"steps/{name}/{after}.json"] if after else []
    own += ["--files", f"inputs/{name}.json"] if step == "report" else []
    given = ["--flat", ODD, "--overrides", f"/drop/{name}{ODD}"]
    out = ["-o", f"../current/{name}", "--wait", "600"]
    return [*own, "--", "predict" if first else step, *more, f"/drop/{name}", *out, *given]


def test_every_step_gets_the_words_meant_for_it_and_nothing_else_runs(tmp_path: Path) -> None:
    found = notes(tmp_path)
    wanted = [["-P", "-m", "tribo.pipeline.index_page", "..", "index.json"]]
    for name in NAMES:
        jobs = ("--jobs", "1")
        wanted += [
            expected(name, "ingest", after=""),
            expected(name, "fit", after="ingest"),
            expected(name, "calibrate", "--only", "calibration", *jobs, after="fit", first="calibrate"),
            expected(name, "simulate", "--only", name, *jobs, after="calibrate", first=f"simulate-{name}"),
            expected(name, "diagnose", *jobs, after="fit"),
            expected(name, "report", *jobs, after="fit"),
        ]
    assert sorted(found) == sorted(wanted)
    assert not list(tmp_path.rglob("evil"))


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
    assert any(step.startswith("ingest (a)") for step in built.steps)
    assert not (tmp_path / "ran").exists()
