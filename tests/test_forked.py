"""Forked workers end with the process that started them."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

SLEEPERS = """
import os, time
from tribo.forked import each

def sleep(item):
    os.write(1, f"{os.getpid()}\\n".encode())
    time.sleep(0.5)

list(each(sleep, range(1000), 2))
"""


def runs(pid: int) -> bool:
    """Whether a process is there and not only waiting to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_workers_of_a_killed_process_end() -> None:
    process = subprocess.Popen([sys.executable, "-c", SLEEPERS], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    workers = {int(process.stdout.readline()) for _ in range(2)}
    process.kill()
    process.wait()
    process.stdout.close()
    until = time.monotonic() + 60
    while any(map(runs, workers)):
        assert time.monotonic() < until, "the workers run on"
        time.sleep(0.05)
