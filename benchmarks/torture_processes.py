"""Shared by the runs that kill, pair and damage: a small campaign, commands in forked processes, and their results.

Commands run in children forked from a process that has imported tribo, so that a start costs no import; their
lattices are small, and pages that typst has set once are remembered. Builds are the exception: they and the steps that
Snakemake starts for them are processes of their own. The clock of the outputs is fixed (SOURCE_DATE_EPOCH) and all
paths are relative, so that equal results are equal bytes.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from faults.commands import RememberedPages, small_lattice

from tribo.virtual_tribometer.sled import SledDesign, SledLaw, write_campaign

TOML = (
    '[campaign]\ntitle = "torture"\nnominal_area_mm2 = 55.0\nslider_mass_g = 1.5\n'
    '[patterns.F]\ncavity = "none"\n'
    '[patterns.B]\ncavity = "circle"\ndiameter_um = 10.0\npitch_um = [15.0, 15.0]\n'
)
REPORT = ("report", "../campaign.zip", "-o", "out", "--runs", "2", "--jobs", "2", "-q")
ENSEMBLE = (
    "simulate", "--sample", "F", "--sample", "B", "--pressure", "5", "--pressure", "12", "--blocks", "40", "--dt",
    "1e-7", "--set", "rest_tolerance=0.01", "--jobs", "2", "-q", "-o", "e.nc", "--repeats",
)  # fmt: skip
BUILD = ("build", "../drop", "-o", "site", "--settle", "0", "--runs", "2", "--jobs", "2", "-q")


def small_campaign(folder: Path, specimens: int = 2, seed: int = 3) -> Path:
    """Two samples at two loads, as a folder that other folders stand beside, and as a zip of it."""
    laws = {"F": SledLaw(4.8, 23e3, 2.9, 12e3), "B": SledLaw(3.6, 10e3, 2.9, 6e3)}
    write_campaign(folder, SledDesign(laws, masses_g=(25.0, 138.5), specimens=specimens, repeats=2), TOML, seed=seed)
    shutil.make_archive(str(folder), "zip", folder)
    return folder


@dataclass
class Command:
    """A tribo command in a process of its own, with its words in a file."""

    pid: int
    said: Path
    status: int | None = None

    def wait(self, seconds: float | None = None) -> int | None:
        """The exit status, negative for a signal; None where it still runs after so many seconds."""
        until = None if seconds is None else time.monotonic() + seconds
        while self.status is None:
            done, code = os.waitpid(self.pid, 0 if until is None else os.WNOHANG)
            if done:
                self.status = os.waitstatus_to_exitcode(code)
            elif until is not None and time.monotonic() >= until:
                return None
            else:
                time.sleep(0.005)
        return self.status

    def kill(self) -> None:
        """Kill it with all its workers, without a word."""
        os.killpg(self.pid, signal.SIGKILL)
        self.wait()


def start(folder: Path, *arguments: str) -> Command:
    """Start a command in ``folder``, in a process group of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    said = folder.parent / f"{folder.name}-{time.monotonic_ns()}.log"
    surroundings(folder)
    pid = os.fork()
    if pid:
        return Command(pid, said)
    try:
        os.setsid()
        os.chdir(folder)
        stream = os.open(said, os.O_WRONLY | os.O_CREAT, 0o644)
        for number in (1, 2):
            os.dup2(stream, number)
        os.environ |= surroundings(folder)
        tempfile.tempdir = None
        sys.argv = ["tribo", *arguments]
        from tribo.cli import main

        main(list(arguments), prog_name="tribo")
    except SystemExit as ended:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(ended.code if isinstance(ended.code, int) else 1)
    except BaseException:
        import traceback

        traceback.print_exc()
        os._exit(70)
    os._exit(0)


def surroundings(folder: Path) -> dict[str, str]:
    """The environment of commands in ``folder``: a fixed clock, and a folder for temporary files, made beside it."""
    temporary = temporary_of(folder)
    temporary.mkdir(exist_ok=True)
    return {"SOURCE_DATE_EPOCH": "1700000000", "TMPDIR": str(temporary)}


def temporary_of(folder: Path) -> Path:
    return folder.resolve().with_name(f"{folder.name}-tmp")


def run(folder: Path, *arguments: str) -> int:
    """A command to its end."""
    status = start(folder, *arguments).wait()
    assert status is not None
    return status


def start_build(folder: Path, *more: str) -> Command:
    """Start `tribo build` in ``folder``, in a process group of its own, with Snakemake and all its steps."""
    folder.mkdir(exist_ok=True)
    said = folder.parent / f"{folder.name}.log"
    with said.open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "tribo", *BUILD, *more], cwd=folder, start_new_session=True,
            stdout=log, stderr=log, env={**os.environ, **surroundings(folder)},
        )  # fmt: skip
    return Command(process.pid, said)


def first_build(base: Path) -> Path:
    """Build a site of one campaign, for the first time; the folder of what it keeps for the next start."""
    small_campaign(base / "drop" / "a")
    assert start_build(base / "first").wait() == 0
    return base / "first" / "site" / "current" / "a" / "kept"


def begun_site(folder: Path) -> Path:
    """A folder that is known as a site of tribo; nothing is built in it yet."""
    site = folder / "site"
    (site / ".tribo").mkdir(parents=True)
    return site


def quick_reports(base: Path, *ways: Sequence[str]) -> None:
    """Let the reports of this process and its children be quick: small lattices, and the pages of these ways known."""
    small_lattice()
    pages = base / "pages.pickle"
    for number, way in enumerate(ways):
        child = os.fork()  # typst starts threads, which a process that forks must not have
        if not child:
            remembered = RememberedPages(pages)
            status = _here(base / f"pages-{number}", *way)
            remembered.save()
            os._exit(status)
        assert os.waitpid(child, 0)[1] == 0, way
    RememberedPages(pages)


def _here(folder: Path, *arguments: str) -> int:
    from faults.trial import run_command

    folder.mkdir()
    os.environ |= surroundings(folder)
    os.chdir(folder)
    for number in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), number)
    return run_command(arguments)


def results(out: Path) -> dict[str, str]:
    """Every file of a folder of results and its hash; what is kept for the next start and hidden locks left out."""
    files = (p for p in sorted(out.rglob("*")) if p.is_file() and "kept" not in p.relative_to(out).parts)
    return {p.relative_to(out).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def leftovers(folder: Path) -> list[str]:
    """Files that only a killed process leaves: in the folder, and among its temporary files."""
    hidden = [p for p in folder.rglob(".*") if p.name.endswith((".part", ".lock", ".unfinished"))]
    return [p.name for p in (*hidden, *temporary_of(folder).iterdir())]


def differing(found: dict[str, str], expected: dict[str, str]) -> list[str]:
    """Names of the files that are not the same in both."""
    return sorted(name for name in found.keys() | expected.keys() if found.get(name) != expected.get(name))


def ensemble(path: Path) -> str:
    """All rows and attributes of an ensemble as one hash; says where a run is not done."""
    import h5py

    from tribo.simulate import read_stored

    table = read_stored(path)
    if not table["done"].all():
        return "runs are missing"
    with h5py.File(path) as file:
        about = sorted((name, str(value)) for name, value in file.attrs.items())
    return hashlib.sha256(f"{about}{table.to_csv()}".encode()).hexdigest()


def thinned(kept: Path, copy: Path, rng: random.Random) -> None:
    """Some of the kept results, so that a start has some of the work before it."""
    copy.mkdir(parents=True)
    for file in sorted(kept.iterdir()):
        if file.suffix == ".nc" or rng.random() < 0.6:
            shutil.copy(file, copy / file.name)


def options(described: str, kinds: Iterable[str], trials: str, many: int) -> argparse.ArgumentParser:
    """The options of a run: the command it is about, the number of trials by the name that they have, the seed."""
    parser = argparse.ArgumentParser(description=described, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=list(kinds))
    parser.add_argument(f"--{trials}", dest="trials", metavar="N", type=int, default=many)
    parser.add_argument("--seed", type=int, default=1)
    return parser


@contextmanager
def folder_of_trials() -> Iterator[Path]:
    """A folder that all trials of a run lie in, gone at its end."""
    with tempfile.TemporaryDirectory(prefix="tribo-torture-") as base:
        yield Path(base)


def told(done: int, given: argparse.Namespace, trials: str, failures: list[str]) -> None:
    """How far a run is."""
    print(f"{done} of {given.trials} {trials}, {len(failures)} failures", file=sys.stderr, flush=True)


def finished(name: str, record: dict[str, Any], failures: list[str]) -> int:
    """Print the outcome as JSON; status 1 where something failed."""
    print(json.dumps({"run": name, **record, "failures": failures}, indent=1))
    return 1 if failures else 0
