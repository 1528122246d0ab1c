"""The directory of compiled code: what is unused goes, what is used stays, also with many starts at once."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

from tribo.springblock.engines import jit


def aged(folder: Path, days: float) -> Path:
    (folder / "part").mkdir(parents=True)
    (folder / "part" / "code.nbc").write_bytes(b"x")
    long_ago = time.time() - 86400 * days
    os.utime(folder, (long_ago, long_ago))
    return folder


def test_code_unused_for_a_month_is_removed_and_the_rest_stays(tmp_path: Path):
    """Only directories of compiled code, and only old ones."""
    old, young = aged(tmp_path / "numba-0123", 31), aged(tmp_path / "numba-4567", 29)
    other = aged(tmp_path / "something-else", 400)
    jit.remove_unused(tmp_path)
    assert not old.exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([young.name, other.name])


def test_many_starts_at_once_remove_without_a_fault(tmp_path: Path):
    """Sixteen threads over forty old directories; nothing is raised and nothing is left."""
    for n in range(40):
        aged(tmp_path / f"numba-{n:04d}", 50)
    with ThreadPoolExecutor(16) as pool:
        list(pool.map(jit.remove_unused, [tmp_path] * 16))
    assert list(tmp_path.iterdir()) == []


def test_a_start_marks_its_directory_as_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A directory of these very sources that is a year old is used, not removed."""
    monkeypatch.setenv("TRIBO_CACHE_DIR", str(tmp_path))
    fresh = jit.cache_directory.__wrapped__
    folder = fresh()
    long_ago = time.time() - 86400 * 365
    os.utime(folder, (long_ago, long_ago))
    assert fresh() == folder
    assert time.time() - folder.stat().st_mtime < 3600


def test_garbage_is_collected_again_after_a_first_call_that_fails():
    """Collection is off while a function without compiled code runs, and on afterwards; else it stays on."""
    seen = []

    def failing(signatures: list[str]) -> None:
        with jit.uncollected(SimpleNamespace(signatures=signatures)):  # type: ignore[arg-type]
            seen.append(gc.isenabled())
            raise KeyError

    for signatures in ([], ["compiled"]):
        with pytest.raises(KeyError):
            failing(signatures)
        assert gc.isenabled()
    assert seen == [False, True]


RUN = """
from tribo.springblock import SimConfig, simulate
run = simulate(SimConfig(sample="B", blocks=(24, 24), seed=2))
print(run.sliding_friction.hex(), run.static_friction.hex())
"""


ANOTHER_LAW = """
from tribo.springblock import SimConfig, simulate
from tribo.springblock.config import FrictionTerms
simulate(SimConfig(sample="B", blocks=(24, 24), terms=FrictionTerms(ageing_b=0.05, hold_s=10.0), seed=2))
"""


@pytest.mark.slow
def test_all_starts_give_the_same_bits(tmp_path: Path):
    """One that compiles, one that loads what was compiled, and one that has run another friction law before."""
    environment = {**os.environ, "TRIBO_CACHE_DIR": str(tmp_path)}
    compiles, loads, called = (
        subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True).stdout
        for code in (RUN, RUN, ANOTHER_LAW + RUN)
    )
    assert compiles == loads == called != ""
