"""The same function over many items, on several processes where that is safe and pays; one function
with limits, or beside others."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import selectors
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any, TypeVar

T = TypeVar("T")
R = TypeVar("R")


def each(function: Callable[[T], R], items: Sequence[T], jobs: int = 1, chunk: int = 1) -> Iterator[R]:
    """The results in the order of the items. Processes are forked, and only where no other thread of Python runs.

    ``chunk`` items go to a process at a time. The processes end with the one that started them, also if it is killed.
    """
    if jobs == 1 or len(items) < 2 or not may_fork():
        yield from map(function, items)
        return
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(min(jobs, len(items)), fork, initializer=_end_with_parent) as pool:
        try:
            with warnings.catch_warnings():
                # Python 3.12 and later warn of threads at a fork; the ones here are those of BLAS, which survives it
                warnings.simplefilter("ignore", DeprecationWarning)
                results = pool.map(function, items, chunksize=chunk)
            yield from results
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@dataclass(frozen=True)
class Limits:
    """What a function in a process of its own may take, its child processes included: time, and memory of each."""

    minutes: float
    gigabytes: float


class ApartError(Exception):
    """A process ended without a result; ``kind`` is over_time, over_memory, crashed or killed, ``what`` a sentence."""

    def __init__(self, kind: str, what: str):
        super().__init__(what)
        self.kind, self.what = kind, what


LOOK_S = 0.1  # how often the memory of a process is looked at
LOOK_AROUND_S = 1.0  # how often its child processes are looked for
ADDRESSES = 4.0  # gigabytes of addresses beyond the memory: threads and libraries reserve what they never use
END_S = 5.0  # how long a process over its limits may take to end by itself


def apart(function: Callable[[], R], limits: Limits) -> R:
    """The result of a function that runs in a forked process with limits; here, where processes cannot be forked.

    The process ends with this one. What the function gives has to be picklable.

    Raises
    ------
    ApartError
        It took longer or more memory than it may, or the process ended without a result.
    """
    if not may_fork():
        return function()
    child, reading = _begun(function, limits)
    found = b""
    over: ApartError | None = None
    try:
        with open(reading, "rb", buffering=0) as pipe:
            found, over = _watched(child, pipe, limits)
    except BaseException:
        _end(child)
        _status(child)
        raise
    status = _status(child)
    if over is not None:
        raise over
    if status == 0:
        result: R = pickle.loads(found)
        return result
    if status in (-signal.SIGKILL, -signal.SIGTERM, -signal.SIGINT):
        raise ApartError("killed", f"the process was ended from outside ({signal.Signals(-status).name})")
    how = signal.Signals(-status).name if status < 0 else f"exit status {status}"
    raise ApartError("crashed", f"the process that worked on it crashed ({how})")


@contextmanager
def beside(function: Callable[[], R]) -> Iterator[Callable[[], R]]:
    """A function begun in a forked process; what is given waits for its result, which has to be picklable.

    The function runs here when it is waited for, where processes cannot be forked, and again where the process ended
    without a result, so that an error is raised as if there were no process. The process ends with this one.
    """
    if not may_fork():
        yield function
        return

    def tried() -> tuple[R] | None:
        try:
            return (function(),)
        except BaseException:
            return None

    child, reading = _begun(tried, None)
    ended = False

    def result() -> R:
        nonlocal ended
        found = pipe.read()
        status, ended = _status(child), True
        done: tuple[R] | None = pickle.loads(found) if status == 0 else None
        return done[0] if done is not None else function()

    with open(reading, "rb") as pipe:
        try:
            yield result
        finally:
            if not ended:
                _end(child)
                _status(child)


def _begun(function: Callable[[], Any], limits: Limits | None) -> tuple[int, int]:
    """The number of a forked process that runs the function, and of the pipe from which its result is read."""
    reading, writing = os.pipe()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        os.close(reading)
        _run_apart(function, writing, limits)
    os.close(writing)
    return child, reading


def _status(child: int) -> int:
    """Exit status of a child that has ended or will; that of a killed one where it was already waited for."""
    try:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    except ChildProcessError:
        return -signal.SIGKILL


def _run_apart(function: Callable[[], Any], writing: int, limits: Limits | None) -> None:
    """In the child: the function, its result into the pipe, and the end of the process."""
    status = 70
    try:
        with suppress(ImportError, ValueError, OSError):
            import resource

            if limits is not None:
                most = int((limits.gigabytes + ADDRESSES + 0.25 * (os.cpu_count() or 1)) * 1e9)
                resource.setrlimit(resource.RLIMIT_AS, (most, most))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        with suppress(AttributeError, OSError):  # Linux: asked to end when the process that watches is gone
            import ctypes

            ctypes.CDLL(None).prctl(1, signal.SIGTERM)
        result = pickle.dumps(function())
        with open(writing, "wb") as pipe:
            pipe.write(result)
        status = 0
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(status)


def _watched(child: int, pipe: Any, limits: Limits) -> tuple[bytes, ApartError | None]:
    """What arrives in a pipe until it ends, and which limit ended the process, if one did."""
    import psutil

    until, around = time.monotonic() + 60.0 * limits.minutes, 0.0
    family: list[psutil.Process] = []
    found = bytearray()
    with selectors.DefaultSelector() as selector:
        selector.register(pipe, selectors.EVENT_READ)
        while True:
            if selector.select(LOOK_S):
                part = pipe.read(1 << 16)
                if not part:
                    return bytes(found), None
                found += part
            now = time.monotonic()
            with suppress(psutil.Error):
                if now >= around:
                    first = psutil.Process(child)
                    family, around = [first, *first.children(recursive=True)], now + LOOK_AROUND_S
            memory = [0.0]
            for process in family:
                with suppress(psutil.Error):
                    memory.append(process.memory_info().rss / 1e9)
            over = None
            if max(memory) > limits.gigabytes:
                over = ApartError("over_memory", f"it takes more memory than the {limits.gigabytes:g} GB that it may")
            elif now > until:
                over = ApartError("over_time", f"it takes longer than the {limits.minutes:g} minutes that it may")
            if over is not None:
                _end(child, at_once=over.kind == "over_memory")
                return bytes(found), over


def _end(child: int, *, at_once: bool = False) -> None:
    """Ask a process and its children to end, and end what is left after a while."""
    import psutil

    with suppress(psutil.Error):
        first = psutil.Process(child)
        everyone = [*first.children(recursive=True), first]
        for process in () if at_once else everyone:
            with suppress(psutil.Error):
                process.terminate()
        left = everyone if at_once else psutil.wait_procs(everyone, timeout=END_S)[1]
        for process in left:
            with suppress(psutil.Error):
                process.kill()


def may_fork() -> bool:
    """Processes are forked, which is quick, and safe only where no other thread of Python runs."""
    return "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1


def _end_with_parent() -> None:
    """End this worker when its parent is killed; otherwise it would wait for work for ever."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch(sentinel: int) -> None:
        wait([sentinel])
        os._exit(1)

    threading.Thread(target=watch, args=(parent.sentinel,), daemon=True).start()
