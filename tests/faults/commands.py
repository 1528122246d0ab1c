"""The commands under test, each with the state of OUT that it starts from."""

from __future__ import annotations

import contextlib
import io
import json
import os
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from faults.file_operations import real_open
from faults.remembered import RememberedFigures, RememberedPages, RememberedSteps
from faults.small_site import Place
from faults.trial import Bench, Command, run_command

RUNS = ("--runs", "2", "--jobs", "1")


def prepared(place: Place, aside: Path, build: bool = True) -> dict[str, Command]:
    """Every command by name. Runs what they have in common once, so that what is forked from here starts at once.

    ``aside`` holds what trials start from; it lies outside the watched folder.
    """
    campaign, out = str(place.campaign), str(place.out)
    report = ("report", campaign, "-o", out, *RUNS)
    small_lattice()
    complete, kept, partly, site = (aside / name for name in ("complete", "kept-only", "partly-kept", "site"))
    RememberedPages(aside / "pages.pickle")
    RememberedFigures(aside / "figures.pickle")

    with _quiet(place):
        assert run_command(report) == 0
    shutil.copytree(out, complete)
    for folder in (kept, partly, site / "current" / "monday"):
        shutil.copytree(complete / "kept", folder / "kept")
    next((partly / "kept").glob("B@*.nc")).unlink()
    (site / ".tribo").mkdir()  # known as a site of tribo
    runs = ("simulate", "--design", str(place.design), "-o", f"{out}/runs.nc", "--jobs", "1")
    with _quiet(place):
        run_command(runs)
    found = [
        Command("ingest", ("ingest", campaign, "-o", out, "--jobs", "1")),
        Command("fit", ("fit", campaign, "-o", out, "--jobs", "1")),
        Command("predict", ("predict", campaign, "-o", out, *RUNS), partly),
        Command("diagnose", ("diagnose", campaign, "-o", out, "--jobs", "1"), kept),
        Command("report", report, kept),
        Command("report again", report, complete),
        Command("verify", ("verify", out), complete),
        Command("simulate one run", ("simulate", *_ONE, "-o", f"{out}/one.nc", "--jobs", "1")),
        Command("simulate --design", runs),
        *(_builds(place, aside, site) if build else ()),
    ]
    return {command.name: command for command in found}


def _builds(place: Place, aside: Path, site: Path) -> list[Command]:
    """tribo build with kept results at hand, and where only the index and the dated copy are missing."""
    arguments = ("build", str(place.drop), "-o", str(place.out), "--settle", "0", *RUNS)
    indexed = aside / "indexed-site"
    run = partial(build_in_one_process, RememberedSteps(aside / "steps", place))
    shutil.rmtree(place.out)
    shutil.copytree(site, place.out)
    with _quiet(place) as said:
        status = run(arguments)
    assert status == 0, said.getvalue()
    shutil.copytree(place.out, indexed, symlinks=True, ignore=shutil.ignore_patterns("builds", "latest", "index.json"))
    return [
        Command("build", arguments, site, run),
        Command("build of the index", arguments, indexed, run),
    ]


def warm(place: Place, command: Command) -> Bench:
    """A bench of a command whose modules and compiled code this process has loaded, so that its children have them."""
    with _quiet(place):
        (command.run or run_command)(command.arguments)
    return Bench(place, command)


def small_lattice() -> None:
    """Simulations of 21 x 21 blocks unless a command says otherwise, for the rest of this process."""
    from tribo.springblock import SimConfig

    given = SimConfig.__init__.__defaults__
    assert given is not None
    SimConfig.__init__.__defaults__ = tuple((21, 21) if value == (85, 85) else value for value in given)


_ONE = ("--sample", "F", "--pressure", "20", "--blocks", "10")


@contextlib.contextmanager
def _quiet(place: Place) -> Iterator[io.StringIO]:
    """What is printed in this process; temporary files and times as in a trial."""
    before, said = dict(os.environ), io.StringIO()
    os.environ |= {"TMPDIR": str(place.temporary), "SOURCE_DATE_EPOCH": "1700000000"}
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            yield said
    finally:
        os.environ.clear()
        os.environ |= before


def build_in_one_process(steps: RememberedSteps, arguments: Sequence[str]) -> int:
    """tribo build with the steps of its workflow run one after another in this process, in place of Snakemake."""
    from tribo.cli import workflow_step
    from tribo.site import build, steps as of_site

    of_site.apart = workflow_step.apart = lambda function, limits: function()  # type: ignore[assignment]
    build._snakemake = partial(_steps_in_order, steps)  # type: ignore[assignment]
    return run_command(arguments)


def _steps_in_order(
    steps: RememberedSteps, state: Path, config: Path, *_: Any
) -> subprocess.CompletedProcess[str]:
    with real_open(config, encoding="utf-8") as file:
        described = json.load(file)
    for name, campaign in described["ready"].items():
        for step, words in _steps(name, campaign, described["options"]):
            given = _arguments(state, name, step, words, described)
            if given and not _logged(state, f"{name}/{step}.log", partial(_step, steps, given)):
                _index(state, "-")
                return subprocess.CompletedProcess([], 1, "a step failed")
    if _index(state, "index.json"):
        return subprocess.CompletedProcess([], 0, "")
    return subprocess.CompletedProcess([], 1, "the index failed")


def _steps(name: str, campaign: dict[str, Any], options: dict[str, str]) -> list[tuple[str, str]]:
    where = f"{shlex.quote(campaign['path'])} -o ../current/{shlex.quote(campaign['name'])}"
    return [
        ("predict", f"predict --jobs 1 {where} {options['model']}"),
        ("report", f"report --jobs 1 {where} {options['model']}"),
    ]


def _arguments(state: Path, name: str, step: str, words: str, described: dict[str, Any]) -> list[str]:
    """What one step is started with; nothing where its record says that it has been run on the same."""
    campaign = described["ready"][name]
    digest = campaign["digest"]
    if _is_done(state / "steps" / name / f"{step}.json", digest):
        return []
    files = ["--files", campaign["files"]] if step == "report" else []
    laws = ["--laws", "laws"] if step == "report" else []
    return [f"steps/{name}/{step}.json", "--digest", digest, *laws, *files, "--", *shlex.split(words)]


def _step(steps: RememberedSteps, given: list[str]) -> int | None:
    from tribo.cli.workflow_step import main

    return steps.done(given, lambda: main(given))


def _is_done(record: Path, digest: str) -> bool:
    try:
        with real_open(record, encoding="utf-8") as file:
            return bool(json.load(file)["digest"] == digest)
    except FileNotFoundError:
        return False


def _index(state: Path, target: str) -> bool:
    from tribo.site.index_page import main

    return _logged(state, "index.log", lambda: main(["..", target]))


def _logged(state: Path, log: str, work: Callable[[], int | None]) -> bool:
    """Run a step as a shell would: in the folder of the workflow, what it prints in a file; whether it succeeded."""
    import traceback

    place, before = state / "log" / log, os.getcwd()
    said = io.StringIO()
    os.chdir(state)
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                return not work()
            except SystemExit as ended:
                return not ended.code
            except BaseException:
                traceback.print_exc()
                return False
    finally:
        os.chdir(before)
        with contextlib.suppress(OSError):
            subprocess.run(["mkdir", "-p", place.parent], check=True)
            with real_open(place, "w", encoding="utf-8") as file:
                file.write(said.getvalue())
