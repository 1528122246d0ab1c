"""Designs beyond the limits are refused before anything is laid out; a lost scheduler is a sentence."""

from __future__ import annotations

import asyncio
import concurrent.futures
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tribo.errors import SimulationError
from tribo.springblock import ensemble, run_stored
from tribo.springblock.config import SimConfig
from tribo.springblock.design_file import read_design, runs_of_design

BASE = {"samples": ["F"], "pressures_kPa": [10.0]}


@pytest.mark.parametrize(
    ("more", "kind"),
    [
        ({"repeats": 10**9}, "too_many_runs"),
        ({"repeats": 10**300}, "too_many_runs"),
        ({"pressures_kPa": [1.0] * 2000, "parameters": {"dt_s": [5e-8] * 2000}}, "too_many_runs"),
        ({"parameters": {"blocks": [10**9, 10**9]}}, "too_many_blocks"),
        ({"parameters": {"duration_s": 1e9}}, "too_many_steps"),
        ({"seed": 10**400}, "wrong_value"),
        ({"parameters": {"spacing_m": 1e-300}}, "impossible_number"),
        ({"parameters": {"modulus_Pa": 1e300}}, "impossible_number"),
    ],
)
def test_a_design_beyond_the_limits_is_refused_before_it_is_laid_out(more: dict[str, Any], kind: str) -> None:
    with pytest.raises(SimulationError) as refused:
        runs_of_design({**BASE, **more})
    assert kind in {p.kind for p in refused.value.problems}


@pytest.mark.parametrize("suffix", [".json", ".toml"])
def test_a_design_of_too_many_levels_is_refused(tmp_path: Path, suffix: str) -> None:
    for depth in (60, 100_000):
        file = tmp_path / f"design{suffix}"
        nested = "[" * depth + "]" * depth
        file.write_text(f'{{"x": {nested}}}' if suffix == ".json" else f"x = {nested}\n")
        with pytest.raises(SimulationError, match="nested too deeply"):
            read_design(file)


def test_a_design_that_is_a_pipe_or_not_utf8_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "latin.json").write_bytes(json.dumps(BASE).encode() + b"\xe9")
    for name, said in {"pipe.toml": "not a regular file", "latin.json": "cannot be read as JSON"}.items():
        with pytest.raises(SimulationError, match=said):
            read_design(tmp_path / name)


@pytest.mark.parametrize("error", [asyncio.CancelledError, concurrent.futures.CancelledError, ConnectionResetError])
def test_a_scheduler_that_goes_away_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    class Pool:
        def submit(self, function: object, *given: object) -> concurrent.futures.Future[object]:
            future: concurrent.futures.Future[object] = concurrent.futures.Future()
            future.set_exception(error())
            return future

    @contextmanager
    def workers(jobs: int, address: str) -> Iterator[Any]:
        yield Pool(), lambda: None

    monkeypatch.setattr(ensemble, "_executor", workers)
    with pytest.raises(SimulationError, match="the dask scheduler stopped answering"):
        run_stored([SimConfig()], tmp_path / "runs.nc", 1, "tcp://host:1")
