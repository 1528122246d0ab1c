"""Snakemake as a process of a build: started, followed line by line, and ended with all of its steps."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import IO

from tribo.pipeline.live import Follower, Progress, typical_seconds
from tribo.temporary import temporary_folder_of_child

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
