"""The static and sliding force each trace was made with, by the virtual tribometer or in the practice campaigns."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support import first_quick
from support.campaigns import DIALECTS, MadeCampaign

from tribo import read_pull
from tribo.errors import TriboError
from tribo.readers import read_export
from tribo.records import Ingested, Pull

TRACE_KINDS = {"stopped_before_peak", "sign_flipped", "saturated"}


def pulls_of(folder: Path) -> dict[str, Pull]:
    tests = pd.read_csv(folder / "tests.csv")
    return {i: read_pull(read_export(folder / f)) for i, f in zip(tests["test_id"], tests["file"], strict=True)}


def disagreements(pulls: dict[str, Pull], truth: pd.DataFrame) -> list[str]:
    """What of the forces and uncertainties read does not agree with the forces that the traces were made with."""
    wrong = [] if len(pulls) == len(truth) else [f"{len(pulls)} pulls of {len(truth)}"]
    for regime in ("static", "sliding"):
        true = truth[f"{regime}_N"]
        read = np.array([getattr(pulls[i], f"{regime}_N") for i in truth.index])
        u = np.array([getattr(pulls[i], f"{regime}_u_N") for i in truth.index])
        error, z = np.abs(read / true - 1), np.abs((read - true) / u)
        # tops are sharp here, and the static uncertainty allows for rounded ones
        least = 0.3 if regime == "static" else 0.6
        held = {
            "median error below 0.6 %": np.median(error) < 0.006,
            "99 of 100 errors below 3 %": np.mean(error < 0.03) >= 0.99,
            "rms of z": least < np.sqrt(np.mean(z**2)) < 1.4,
            "90 % within 1.96 standard uncertainties": np.mean(z < 1.96) > 0.9,
            "median uncertainty below 1.5 %": np.median(u / true) < 0.015,
        }
        wrong += [f"{regime}: {what}" for what, holds in held.items() if not holds]
    return wrong


@pytest.fixture(scope="module")
def made_pulls(read_made: Callable[[str], Ingested]) -> Callable[[str], dict[str, Pull]]:
    """made_pulls("bluehill") -> the pulls of the campaign of the virtual tribometer in that dialect, read once."""
    return lambda dialect: dict(read_made(dialect).pulls)


@pytest.mark.parametrize("dialect", first_quick(DIALECTS))
def test_pulls_agree_with_the_forces_of_the_virtual_tribometer(
    dialect: str, made: Callable[[str], MadeCampaign], made_pulls: Callable[[str], dict[str, Pull]]
) -> None:
    assert disagreements(made_pulls(dialect), made(dialect).truth) == []


@pytest.mark.parametrize("dialect", first_quick(DIALECTS))
def test_no_healthy_trace_of_the_virtual_tribometer_raises_an_alarm(
    dialect: str, made_pulls: Callable[[str], dict[str, Pull]]
) -> None:
    pulls = made_pulls(dialect)
    assert len(pulls) == 180
    assert alarms(pulls) == []


def alarms(pulls: dict[str, Pull]) -> list[str]:
    described = {"stick_slip", "no_drop", "rounded_peak"}
    return [p.test_id for p in pulls.values() if p.problems or set(p.flags) - described]


@pytest.mark.slow
def test_pulls_agree_with_what_the_practice_traces_were_made_with(
    practice: Callable[[str], Path], shared: Path
) -> None:
    wrong = {}
    for number in ("01", "02", "03", "04"):
        truth = pd.read_csv(shared / "campaigns" / f"series-{number}.truth.csv").set_index("test_id")
        wrong[number] = disagreements(pulls_of(practice(number)), truth)
    assert not any(wrong.values()), wrong


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


@pytest.mark.slow
def test_no_healthy_practice_trace_raises_an_alarm(practice: Callable[[str], Path]) -> None:
    pulls = {number: pulls_of(practice(number)) for number in ("06", "08", "10", "11-clean")}
    assert [len(p) for p in pulls.values()] == [324] * 4
    assert {number: alarms(p) for number, p in pulls.items() if alarms(p)} == {}
