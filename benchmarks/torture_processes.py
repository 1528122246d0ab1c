"""Shared by the runs that kill, pair and damage: a small campaign, commands in forked processes, and their results.

Commands run in children forked from a process that has imported tribo, so that a start costs no import; their
lattices are small, and pages that typst has set once are remembered. So do Snakemake and the steps that it starts for
a build (see forked_starts.py). The clock of the outputs is fixed (SOURCE_DATE_EPOCH) and all
paths are relative, so that equal results are equal bytes.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from faults.commands import small_lattice
from faults.remembered import RememberedPages
from faults.trial import TIMES, run_command
from forked_starts import stand_in_for_python, start_here
from support.sled import SledDesign, SledLaw, write_campaign

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
OF_A_BUILD = ("snakemake.cli", "tribo.cli.workflow_step", "tribo.site.index_page")


def small_campaign(folder: Path, specimens: int = 2, seed: int = 3) -> Path:
    """Two samples at two loads, as a folder."""
    laws = {"F": SledLaw(4.8, 23e3, 2.9, 12e3), "B": SledLaw(3.6, 10e3, 2.9, 6e3)}
    write_campaign(folder, SledDesign(laws, masses_g=(25.0, 138.5), specimens=specimens, repeats=2), TOML, seed=seed)
    return folder


def zipped_campaign(folder: Path) -> None:
    """The same campaign, and a zip of it beside the folder."""
    shutil.make_archive(str(folder), "zip", small_campaign(folder))


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


def start(folder: Path, *arguments: str, script: Path | None = None) -> Command:
    """Start a command in ``folder``, in a process group of its own; the Python that it starts is ``script``."""
    folder.mkdir(parents=True, exist_ok=True)
    beside = folder.parent.resolve() / f"{folder.name}-{time.monotonic_ns()}"
    surroundings(folder)
    pid = os.fork()
    if pid:
        return Command(pid, beside.with_name(f"{beside.name}.log"))
    starter = None
    try:
        os.setsid()
        os.chdir(folder)
        stream = os.open(f"{beside}.log", os.O_WRONLY | os.O_CREAT, 0o644)
        for number in (1, 2):
            os.dup2(stream, number)
        os.environ |= surroundings(Path.cwd())
        tempfile.tempdir = None
        if script is not None:
            starter = start_here(script, beside)
        status = run_command(arguments)
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        status = 70
        traceback.print_exc()
    finally:
        if starter is not None:
            os.kill(starter, signal.SIGKILL)
        os._exit(status)


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


@dataclass(frozen=True)
class Builds:
    """Builds of a site of one campaign; ``kept`` is the folder of what the first one kept, ``seconds`` what one takes.

    The first one is made here, and a second one from what it kept.
    """

    base: Path
    script: Path
    expected: dict[str, str]
    seconds: float

    @property
    def kept(self) -> Path:
        return self.base / "first" / "site" / "current" / "a" / "kept"

    def start(self, folder: Path, *more: str) -> Command:
        """Start `tribo build` in ``folder``, in a process group of its own, with Snakemake and all its steps."""
        return start(folder, *BUILD, *more, script=self.script)


def quick_builds(base: Path) -> Builds:
    """Let builds start no Python anew, with small lattices and known pages; the results of one that was left alone."""
    campaign = str(small_campaign(base / "drop" / "a"))
    where = (campaign, "-o", "out")
    pages = _warm(base, ("report", *where, *REPORT[4:]), ("ingest", *where), ("diagnose", *where))
    for module in OF_A_BUILD:
        import_module(module)
    builds = Builds(base, stand_in_for_python(base), {}, 0.0)
    took = 0.0
    for name in ("first", "untouched"):
        if name == "untouched":
            shutil.copytree(builds.kept, begun_site(base / name) / "current" / "a" / "kept")
        began = time.monotonic()
        command = builds.start(base / name)
        assert command.wait() == 0, command.said.read_text(encoding="utf-8")
        took = time.monotonic() - began
        pages.read()
    return replace(builds, expected=results(base / "untouched" / "site" / "current"), seconds=took)


def begun_site(folder: Path) -> Path:
    """A folder that is known as a site of tribo; nothing is built in it yet."""
    site = folder / "site"
    (site / ".tribo").mkdir(parents=True)
    return site


def quick_reports(base: Path, *ways: Sequence[str]) -> None:
    """Let the reports of this process and its children be quick: lattices small, pages known, modules loaded."""
    pages = _warm(base, ways[0])
    for number, way in enumerate(ways):
        assert run(base / f"pages-{number}", *way) == 0, way
        pages.read()


def _warm(base: Path, *commands: Sequence[str]) -> RememberedPages:
    """Run commands in this process, so that modules and compiled code are loaded, with small lattices and no pages."""
    import typst

    small_lattice()
    real, typst.Compiler = typst.Compiler, _NoPages  # typst starts threads, which a process that forks must not have
    here, before = Path.cwd(), dict(os.environ)
    os.environ |= surroundings(base / "warm")
    (base / "warm").mkdir()
    os.chdir(base / "warm")
    for words in commands:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said:
            status = run_command(words)
        assert status == 0, said.getvalue()
    os.chdir(here)
    os.environ.clear()
    os.environ |= before
    typst.Compiler = real
    return RememberedPages(base / "pages.pickle")


class _NoPages:
    def __init__(self, **_: Any):
        pass

    def compile(self, *_: Any, **__: Any) -> bytes:
        return b"\0\0\0\0IDAT"  # a PNG gets lines of text before this


def results(out: Path) -> dict[str, str]:
    """Every file of a folder of results and its hash; what is kept for the next start and hidden locks left out.

    Of the index of a site the times of its builds do not count.
    """
    files = (p for p in sorted(out.rglob("*")) if p.is_file() and "kept" not in p.relative_to(out).parts)
    return {p.relative_to(out).as_posix(): hashlib.sha256(_but_for_times(p)).hexdigest() for p in files}


def _but_for_times(file: Path) -> bytes:
    content = file.read_bytes()
    return TIMES.sub("", content.decode()).encode() if file.name == "index.html" else content


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

    from tribo.springblock import read_stored

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
