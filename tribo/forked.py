"""The same function over many items, on several processes where that is safe and pays."""

from __future__ import annotations

import multiprocessing
import os
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import wait
from typing import TypeVar

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
