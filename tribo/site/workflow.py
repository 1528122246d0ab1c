"""How far a build is: the steps that run and those that are done, from what Snakemake says while it works.

Snakemake as a process of a build: started, followed line by line, and ended with all of its steps.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import IO

from tribo.files import found_below
from tribo.site.steps import read_record
from tribo.temporary import temporary_folder_of_child

WORDS = {
    "fit": "reading exports and fitting laws", "predict": "reading exports and simulating",
    "calibrate": "calibrating the model", "simulate": "simulating", "diagnose": "diagnosing",
    "report": "writing the report", "index": "writing the index page",
}  # fmt: skip
_TOTAL = re.compile(r"^total\s+(\d+)\s*$")
_COUNTED = re.compile(r"^(\w+)\s+(\d+)\s*$")
_RULE = re.compile(r"^(?:local)?rule (\w+):")
_FAILED = re.compile(r"^Error in rule (\w+):")
_JOB = re.compile(r"^\s+jobid: (\d+)")
_WILDCARDS = re.compile(r"^\s+wildcards: (.+)$")
_FINISHED = re.compile(r"^Finished job(?:id:)? (\d+)")
_DONE = re.compile(r"^(\d+) of (\d+) steps")


@dataclass(frozen=True)
class Progress:
    """``done`` of ``total`` steps, those that run by campaign, and the share of the work that is done (0 to 1)."""

    done: int
    total: int
    running: tuple[str, ...]
    share: float


class Follower:
    """Takes what Snakemake says line by line. ``typical_s`` is how long a step of each kind took in earlier builds."""

    def __init__(self, typical_s: Mapping[str, float]):
        known = list(typical_s.values())
        self._weights = typical_s
        self._usual = sum(known) / len(known) if known else 1.0
        self._planned: dict[str, int] = {}
        self._running: dict[str, tuple[str, str]] = {}  # job -> rule, and the step in words
        self._finished: list[str] = []
        self._rule = self._job = ""
        self._failed = False
        self._counting = False
        self._total = 0

    def take(self, line: str) -> bool:
        """Note one line; whether it changed what runs or is done."""
        if found := _RULE.match(line) or _FAILED.match(line):
            self._rule, self._job, self._failed = found[1], "", line.startswith("Error")
        elif found := _JOB.match(line):
            return self._take_job(found[1])
        elif (found := _WILDCARDS.match(line)) and self._job in self._running:
            self._running[self._job] = self._rule, _in_words(self._rule, found[1])
            return True
        elif found := _FINISHED.match(line):
            rule, _ = self._running.pop(found[1], ("", ""))
            self._finished += [rule] if rule else []
            return True
        else:
            self._count(line)
        return False

    def _take_job(self, job: str) -> bool:
        self._job = job
        if self._failed:
            self._running.pop(job, None)
        elif self._rule != "all":
            self._running[job] = self._rule, _in_words(self._rule, "")
        return self._failed  # a step that begins is told with the line that names its campaign

    def _count(self, line: str) -> None:
        """Lines of the table of planned jobs, which begins with "Job stats" and ends with the total."""
        if line.startswith("Job stats"):
            self._counting = True
        elif found := _TOTAL.match(line):
            self._counting, self._total = False, int(found[1])
        elif self._counting and (found := _COUNTED.match(line)):
            self._planned[found[1]] = int(found[2])
        elif found := _DONE.match(line):
            self._total = int(found[2])

    @property
    def progress(self) -> Progress:
        """How far the build is now."""
        work = sum(n * self._weight(rule) for rule, n in self._planned.items())
        done = sum(map(self._weight, self._finished))
        share = min(1.0, done / work) if work > 0 else 0.0
        return Progress(len(self._finished), self._total, tuple(words for _, words in self._running.values()), share)

    def _weight(self, rule: str) -> float:
        return 0.0 if rule == "all" else self._weights.get(rule, self._usual)


def _in_words(rule: str, wildcards: str) -> str:
    """"a: simulating B" of the rule simulate and "name=a, cell=B"."""
    values = dict(part.strip().partition("=")[::2] for part in wildcards.split(",") if "=" in part)
    words = " ".join(filter(None, (WORDS.get(rule, rule), values.get("cell", ""))))
    return f"{values['name']}: {words}" if "name" in values else words


def typical_seconds(steps: Path) -> dict[str, float]:
    """Mean duration of each kind of step in the records of a site, in seconds."""
    found: dict[str, list[float]] = {}
    for path in found_below(steps, "*.json"):
        record = read_record(path)
        seconds = record.get("seconds") if record else None
        if isinstance(seconds, int | float) and seconds > 0:
            found.setdefault(path.stem.partition("-")[0], []).append(float(seconds))
    return {rule: sum(values) / len(values) for rule, values in found.items()}


END_S = 60.0  # how long the steps of an interrupted build may take to end
TICK_S = 1.0  # how often the progress is told where nothing changes


def run_workflow(
    command: Sequence[str], state: Path, descriptor: int | None, tell: Callable[[Progress], None]
) -> subprocess.CompletedProcess[str]:
    """Run a Snakemake command to its end, and ``tell`` how far it is at every change and every second.

    The lock of the site, ``descriptor``, is passed on, so that it is held as long as Snakemake runs. Temporary files
    of Snakemake are in a folder of tribo: what it leaves when it is killed goes at the next start.
    """
    (state / "log").mkdir(parents=True, exist_ok=True)
    follower = Follower(typical_seconds(state / "steps"))
    said: list[str] = []
    with temporary_folder_of_child() as (temporary, in_use), subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
        env={**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONSAFEPATH": "1", "TMPDIR": str(temporary)},
        pass_fds=(in_use,) if descriptor is None else (in_use, descriptor),
    ) as process:  # fmt: skip
        assert process.stdout is not None
        try:
            for line in _lines(process.stdout):
                said.append(line)
                if not line or follower.take(line):
                    tell(follower.progress)
            process.wait()
        except BaseException:
            _end(process)
            raise
    return subprocess.CompletedProcess(command, process.returncode, "".join(said))


def _lines(stream: IO[str]) -> Iterator[str]:
    """Lines as they come; an empty text whenever none has come for a while."""
    arrived: Queue[str | None] = Queue()

    def read() -> None:
        for line in stream:
            arrived.put(line)
        arrived.put(None)

    Thread(target=read, daemon=True).start()
    while True:
        try:
            line = arrived.get(timeout=TICK_S)
        except Empty:
            yield ""
            continue
        if line is None:
            return
        yield line


def _end(process: subprocess.Popen[str]) -> None:
    """Ask the workflow and its steps to end, and wait for them, so that none writes on after the build."""
    import psutil

    try:
        workflow = psutil.Process(process.pid)
        everyone = [workflow, *workflow.children(recursive=True)]
    except psutil.NoSuchProcess:
        everyone = []
    for each in everyone:
        with suppress(psutil.NoSuchProcess):
            each.terminate()
    for each in psutil.wait_procs(everyone, timeout=END_S)[1]:
        with suppress(psutil.NoSuchProcess):
            each.kill()
    process.wait()
