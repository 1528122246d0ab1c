"""Against the practice campaigns: the static and sliding force each trace was made with, and what was spoiled."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo.errors import TriboError
from tribo.readers import read_export
from tribo.records import Pull
from tribo.traces import read_pull

TRACE_KINDS = {"stopped_before_peak", "sign_flipped", "saturated"}


def pulls_of(folder: Path) -> dict[str, Pull]:
    tests = pd.read_csv(folder / "tests.csv")
    return {i: read_pull(read_export(folder / f)) for i, f in zip(tests["test_id"], tests["file"], strict=True)}


@pytest.mark.parametrize("number", ["01", "02", "03", "04"])
def test_pulls_agree_with_what_the_traces_were_made_with(
    number: str, practice: Callable[[str], Path], shared: Path
) -> None:
    truth = pd.read_csv(shared / "campaigns" / f"series-{number}.truth.csv").set_index("test_id")
    pulls = pulls_of(practice(number))
    assert len(pulls) == len(truth)
    for regime in ("static", "sliding"):
        true = truth[f"{regime}_N"]
        read = np.array([getattr(pulls[i], f"{regime}_N") for i in truth.index])
        u = np.array([getattr(pulls[i], f"{regime}_u_N") for i in truth.index])
        error = np.abs(read / true - 1)
        assert np.median(error) < 0.006
        assert np.mean(error < 0.03) >= 0.99
        z = (read - true) / u
        # tops are sharp here, and the static uncertainty allows for rounded ones
        assert (0.3 if regime == "static" else 0.6) < np.sqrt(np.mean(z**2)) < 1.4
        assert np.mean(np.abs(z) < 1.96) > 0.9
        assert np.median(u / true) < 0.015


def test_every_kind_of_spoiled_trace_is_named_and_its_clean_twin_is_not(
    practice: Callable[[str], Path], shared: Path
) -> None:
    spoiled, clean = practice("11-spoiled"), practice("11-clean")
    done = json.loads((shared / "campaigns" / "series-11-spoiled.truth.json").read_text(encoding="utf-8"))
    rows = pd.read_csv(clean / "tests.csv").set_index("test_id")["file"]
    for test_id, kind in done.items():
        if kind in TRACE_KINDS:
            with pytest.raises(TriboError) as fault:
                read_pull(read_export(spoiled / rows[test_id]))
            assert kind in {p.kind for p in fault.value.problems}
        if kind == "spike":
            pull = read_pull(read_export(spoiled / rows[test_id]))
            twin = read_pull(read_export(clean / rows[test_id]))
            assert [p.kind for p in pull.problems] == ["spike"]
            assert pull.static_N == pytest.approx(twin.static_N, rel=1e-3)


@pytest.mark.parametrize("number", ["06", "08", "10", "11-clean"])
def test_no_healthy_trace_raises_an_alarm(number: str, practice: Callable[[str], Path]) -> None:
    pulls = pulls_of(practice(number))
    assert len(pulls) == 324
    described = {"stick_slip", "no_drop", "rounded_peak"}
    assert not [p.test_id for p in pulls.values() if p.problems or set(p.flags) - described]
