"""Snakemake as a process of a build: started, followed by the journal of its steps, and ended with all of them."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import IO

from tribo.files import found_below
from tribo.site.steps import JOURNAL, Step, journal, read_record
from tribo.temporary import temporary_folder_of_child

WORDS = {
    "fit": "reading exports and fitting laws", "predict": "reading exports and simulating",
    "calibrate": "calibrating the model", "simulate": "simulating", "diagnose": "diagnosing",
    "report": "writing the report", "index": "writing the index page",
}  # fmt: skip
END_S = 60.0  # how long the steps of an interrupted build may take to end
TICK_S = 1.0  # how often the progress is told where nothing changes


@dataclass(frozen=True)
class Progress:
    """``done`` of ``total`` steps, those that run in words, and the share of the work that is done (0 to 1)."""

    done: int
    total: int
    running: tuple[str, ...]
    share: float


def progress_of(state: Path, due: Sequence[Step], typical_s: Mapping[str, float]) -> Progress:
    """How far a build is, by its journal.

    ``due`` are its steps, ``typical_s`` is how long a step of each kind took in earlier builds; a kind that is not
    known takes as long as the others on average.
    """
    events = {step: event for step, event, _ in journal(state)}
    done = [step for step, event in events.items() if event == "ended"]
    running = [step for step, event in events.items() if event == "begun"]
    usual = sum(typical_s.values()) / len(typical_s) if typical_s else 1.0

    def work(steps: Iterable[Step]) -> float:
        return sum(typical_s.get(step.kind, usual) for step in steps)

    everything = {(step.name, step.campaign): step for step in (*due, *events)}.values()
    share = work(done) / work(everything) if everything else 0.0
    return Progress(len(done), len(everything), tuple(map(_in_words, running)), share)


def _in_words(step: Step) -> str:
    """"a: simulating B@5000Pa" of the step simulate-B@5000Pa of a."""
    kind, _, cell = step.name.partition("-")
    words = " ".join(filter(None, (WORDS.get(kind, kind), cell)))
    return f"{step.campaign}: {words}" if step.campaign else words


def typical_seconds(steps: Path) -> dict[str, float]:
    """Mean duration of each kind of step in the records of a site, in seconds."""
    found: dict[str, list[float]] = {}
    for path in found_below(steps, "*.json"):
        record = read_record(path)
        seconds = record.get("seconds") if record else None
        if isinstance(seconds, int | float) and seconds > 0:
            found.setdefault(path.stem.partition("-")[0], []).append(float(seconds))
    return {rule: sum(values) / len(values) for rule, values in found.items()}


def run_workflow(
    command: Sequence[str], state: Path, due: Sequence[Step], descriptor: int | None, tell: Callable[[Progress], None]
) -> subprocess.CompletedProcess[str]:
    """Run a Snakemake command to its end, and ``tell`` how far its steps are at every line and every second.

    The lock of the site, ``descriptor``, is passed on, so that it is held as long as Snakemake runs. Temporary files
    of Snakemake are in a folder of tribo: what it leaves when it is killed goes at the next start.
    """
    (state / "log").mkdir(parents=True, exist_ok=True)
    typical_s = typical_seconds(state / "steps")
    now, read = Progress(0, len(due), (), 0.0), -1
    said: list[str] = []
    path = state / JOURNAL
    with temporary_folder_of_child() as (temporary, in_use), subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
        env={**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONSAFEPATH": "1", "TMPDIR": str(temporary)},
        pass_fds=(in_use,) if descriptor is None else (in_use, descriptor),
    ) as process:  # fmt: skip
        assert process.stdout is not None
        try:
            for line in _lines(process.stdout):
                said.append(line)
                size = path.stat().st_size if path.is_file() else 0
                if size != read:  # Snakemake says much more than the journal holds
                    now, read = progress_of(state, due, typical_s), size
                    tell(now)
                elif not line:
                    tell(now)
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
