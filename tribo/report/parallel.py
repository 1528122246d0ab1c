"""The same function over many items, on several processes where that is safe and pays."""

from __future__ import annotations

import multiprocessing
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")


def each(function: Callable[[T], R], items: Sequence[T], jobs: int = 1) -> Iterator[R]:
    """The results in the order of the items. Processes are forked, and only where no other thread of Python runs."""
    may_fork = "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1
    if jobs == 1 or len(items) < 2 or not may_fork:
        yield from map(function, items)
        return
    with ProcessPoolExecutor(min(jobs, len(items)), mp_context=multiprocessing.get_context("fork")) as pool:
        with warnings.catch_warnings():
            # Python 3.12 and later warn of threads at a fork; the ones here are those of BLAS, which survives it
            warnings.simplefilter("ignore", DeprecationWarning)
            results = pool.map(function, items)
        yield from results
