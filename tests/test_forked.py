"""Forked workers end with the process that started them; a process with limits ends alone."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

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


APART = """
import ctypes, json, os, signal, sys, time
from tribo.forked import ApartError, Limits, apart

def aborts(): os.abort()
def hangs(): time.sleep(60)
def hangs_and_will_not_end():
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(60)
def computes_without_end():
    while True: pass
def eats(): return len([bytearray(10_000_000) for _ in range(1000)])
def eats_in_a_child():
    if not os.fork():
        eats()
        os._exit(0)
    time.sleep(60)
def asks_for_all(): return len(bytearray(549_000_000_000))
def raises(): raise ValueError("odd")
def exits(): sys.exit(5)
def is_killed(): os.kill(os.getpid(), signal.SIGKILL)
def works(): return {"a": [1, 2.5, "text"]}

try:
    print(json.dumps(["result", apart(globals()[sys.argv[1]], Limits(float(sys.argv[2]), 0.5))]))
except ApartError as why:
    print(json.dumps([why.kind, why.what]))
"""
ENDS = {
    "works": ("result", ""), "aborts": ("crashed", "SIGABRT"), "hangs": ("over_time", "0.02 minutes"),
    "hangs_and_will_not_end": ("over_time", "0.02 minutes"), "computes_without_end": ("over_time", "0.02 minutes"),
    "eats": ("over_memory", "0.5 GB"), "eats_in_a_child": ("over_memory", "0.5 GB"),
    "asks_for_all": ("crashed", "exit status 70"), "raises": ("crashed", "exit status 70"),
    "exits": ("crashed", "exit status 70"), "is_killed": ("killed", "from outside (SIGKILL)"),
}  # fmt: skip


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked")
@pytest.mark.parametrize("what", ENDS)
def test_a_function_apart_gives_its_result_or_why_it_ended(what: str) -> None:
    started = time.monotonic()
    minutes = "0.02" if ENDS[what][0] == "over_time" else "0.5"  # a busy machine takes seconds to fill its memory
    words = [sys.executable, "-c", APART, what, minutes]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    kind, said = json.loads(ended.stdout)
    assert kind == ENDS[what][0]
    assert ENDS[what][1] in str(said)
    assert time.monotonic() - started < 50


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked")
def test_a_function_apart_ends_with_the_process_that_watches_it() -> None:
    script = (
        "import os, time\nfrom tribo.forked import Limits, apart\n"
        "apart(lambda: (os.write(1, f'{os.getpid()}\\n'.encode()), time.sleep(60)), Limits(5.0, 1.0))"
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    child = int(process.stdout.readline())
    assert child != process.pid
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    until = time.monotonic() + 60
    while runs(child):
        assert time.monotonic() < until, "it runs on"
        time.sleep(0.05)


BESIDE = """
import json, os, sys, time
from tribo.forked import beside

def number():
    print("begun", os.getpid(), flush=True)
    return os.getpid()

def fails_there():
    if os.getpid() != HERE:
        raise OSError("not here")
    return "done here"

def crashes_there():
    if os.getpid() != HERE:
        os.abort()
    return "done here"

HERE = os.getpid()
found = {}
with beside(number) as result:
    found["other"] = result() != HERE
for function in (fails_there, crashes_there):
    with beside(function) as result:
        found[function.__name__] = result()
try:
    with beside(lambda: time.sleep(600)) as result:
        raise ValueError
except ValueError:
    found["left"] = True
print(json.dumps(found))
"""


def test_what_runs_beside_gives_its_result_and_is_done_here_where_its_process_failed() -> None:
    done = subprocess.run([sys.executable, "-c", BESIDE], capture_output=True, text=True, timeout=120, check=True)
    found = json.loads(done.stdout.splitlines()[-1])
    assert found == {"other": True, "fails_there": "done here", "crashes_there": "done here", "left": True}
    assert done.stderr == ""
