"""The exports of a campaign, read one by one or on several processes, each into a trace and its pull."""

from __future__ import annotations

import multiprocessing
import threading
import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

from tribo.errors import TriboError
from tribo.records import Campaign, Pull, SetAside, Test, Trace

FEWEST_FOR_PROCESSES = 100  # below, starting processes costs more than it gains
CHUNK = 16

Outcome = tuple[Trace, Pull] | SetAside


def read_one(root: Path, columns: Mapping[str, str], rule: str, test: Test) -> Outcome:
    """One export into its trace and pull, or what is wrong with it."""
    from tribo.readers import read_export
    from tribo.traces import read_pull

    try:
        trace = read_export(root / test.file, columns=columns or None, name=test.test_id, file=test.file)
        pull = read_pull(trace, rule=rule, test=test)
        return trace, replace(pull, flags=tuple(dict.fromkeys((*trace.flags, *pull.flags))))
    except TriboError as why:
        problems = tuple(replace(p, file=test.file, test_id=test.test_id) for p in why.problems)
        return SetAside(test.test_id, "; ".join(str(p) for p in problems), problems)


def read_all(campaign: Campaign, rule: str, jobs: int = 1) -> Iterator[tuple[Test, Outcome]]:
    """Every test with its outcome, in the order of the campaign."""
    read = partial(read_one, campaign.root, dict(campaign.columns), rule)
    if jobs == 1 or len(campaign.tests) < FEWEST_FOR_PROCESSES or not _may_fork():
        yield from zip(campaign.tests, map(read, campaign.tests), strict=True)
        return
    read(campaign.tests[0])  # what it imports is then in every process
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("fork")) as pool:
        try:
            with warnings.catch_warnings():
                # Python 3.12 and later warn of threads at a fork; the ones here are those of BLAS, which survives it
                warnings.simplefilter("ignore", DeprecationWarning)
                outcomes = pool.map(read, campaign.tests, chunksize=CHUNK)
            yield from zip(campaign.tests, outcomes, strict=True)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _may_fork() -> bool:
    """Processes are forked, which is quick, and safe only where no other thread of Python runs."""
    return "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1
