"""Workers of a dask scheduler get work only where they would make the same runs, and nobody waits in silence."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from tribo.errors import SimulationError
from tribo.springblock import SimConfig, ensemble, stratified_design
from tribo.springblock.ensemble import RefusedWorkerWarning, Work, finished_runs, identity

distributed = pytest.importorskip("distributed")
SMALL = SimConfig(blocks=(12, 12), dt_s=1e-7, duration_peaks=1.5)
DESIGN = stratified_design(["F"], [5e3], 2, base=SMALL)


def read(run: Any) -> dict[str, float]:
    return {"static_friction": run.static_friction}


@contextmanager
def cluster(workers: int) -> Iterator[str]:
    """Workers in threads of this process."""
    options = {"n_workers": workers, "threads_per_worker": 1, "processes": False, "dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(**options) as started:
        yield started.scheduler_address


MAIN, TRUE = threading.main_thread(), identity()
OTHER: dict[str, str] = {}
ASKED: list[int] = []
RAN_ON: list[str] = []


def other_identity() -> dict[str, str]:
    """What a worker answers that differs in ``OTHER``; this process answers for itself."""
    return TRUE if threading.current_thread() is MAIN else {**TRUE, **OTHER}


def no_identity() -> dict[str, str]:
    if threading.current_thread() is not MAIN:
        raise AttributeError("module has no attribute 'identity'")
    return TRUE


def one_of_two() -> dict[str, str]:
    if threading.current_thread() is MAIN:
        return TRUE
    ASKED.append(1)
    return TRUE if len(ASKED) == 1 else {**TRUE, "tribo": "0"}


def noting(run: Any) -> dict[str, float]:
    RAN_ON.append(distributed.get_worker().address)
    return read(run)


def test_a_process_is_told_by_python_libraries_and_sources() -> None:
    assert {"Python", "numpy", "numba", "llvmlite", "scipy", "tribo"} <= set(identity())
    assert len(identity()["tribo"]) == 64


@pytest.mark.parametrize(
    ("other", "said"),
    [({"tribo": "0" * 64}, "other sources of tribo"), ({"numpy": "1.0"}, "numpy 1.0 (here "),
     ({"numba": "0.1"}, "numba 0.1 (here "), ({"Python": "3.1.0"}, "Python 3.1.0 (here ")],
)  # fmt: skip
def test_a_worker_with_other_code_or_versions_is_refused_by_name(
    monkeypatch: pytest.MonkeyPatch, other: dict[str, str], said: str
) -> None:
    monkeypatch.setattr(ensemble, "identity", other_identity)
    monkeypatch.setitem(globals(), "OTHER", other)
    with cluster(1) as address, pytest.raises(SimulationError) as refused:
        list(finished_runs(DESIGN, scheduler=address, work=Work(read=read)))
    (problem,) = refused.value.problems
    assert problem.kind == "other_workers"
    assert said in str(problem)
    assert "worker inproc://" in str(problem)


def test_a_worker_that_does_not_know_the_question_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ensemble, "identity", no_identity)
    with cluster(1) as address, pytest.raises(SimulationError, match="no answer: AttributeError"):
        list(finished_runs(DESIGN, scheduler=address, work=Work(read=read)))


def test_work_goes_to_the_other_workers_and_the_refused_one_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ensemble, "identity", one_of_two)
    with cluster(2) as address, warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        rows = dict(finished_runs(DESIGN * 3, scheduler=address, work=Work(read=noting)))
    refused = [str(w.message) for w in said if issubclass(w.category, RefusedWorkerWarning)]
    assert len(refused) == 1
    assert "other sources of tribo; it gets no work" in refused[0]
    assert len(set(RAN_ON)) == 1
    assert RAN_ON[0] not in refused[0]
    assert [rows[k] for k in range(2)] == [row for _, row in sorted(finished_runs(DESIGN, work=Work(read=read)))]


def test_a_scheduler_without_workers_is_told_after_a_stated_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ensemble, "WORKERS_TIMEOUT_S", 0.3)
    with cluster(0) as address, pytest.raises(SimulationError, match=r"has no workers; 0\.3 s were waited") as raised:
        list(finished_runs(DESIGN, scheduler=address, work=Work(read=read)))
    assert f"dask worker {address}" in str(raised.value)


def test_workers_that_leave_while_runs_wait_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ensemble, "WORKERS_TIMEOUT_S", 0.5)
    monkeypatch.setattr(ensemble, "LOOK_S", 0.2)

    def without_workers() -> None:
        raise SimulationError(ensemble._no_workers("tcp://here:1"))

    class Waiting:
        def submit(self, *_: object) -> Future[Any]:
            return Future()

    @contextmanager
    def executor(*_: object) -> Iterator[Any]:
        yield Waiting(), without_workers

    monkeypatch.setattr(ensemble, "_executor", executor)
    with pytest.raises(SimulationError, match="has no workers"):
        list(finished_runs(DESIGN, scheduler="tcp://here:1"))


def test_a_run_that_ends_every_worker_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    killed = distributed.KilledWorker("made-1", SimpleNamespace(address="tcp://w:1"), 3)

    class Killing:
        def submit(self, *_: object) -> Future[Any]:
            future: Future[Any] = Future()
            future.set_exception(killed)
            return future

    @contextmanager
    def executor(*_: object) -> Iterator[Any]:
        yield Killing(), lambda: None

    monkeypatch.setattr(ensemble, "_executor", executor)
    with pytest.raises(SimulationError, match="a run ended every worker that tried it") as raised:
        list(finished_runs(DESIGN, scheduler="tcp://here:1"))
    assert raised.value.problems[0].kind == "workers_killed"
