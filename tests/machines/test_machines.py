"""What a machine leaves in its traces is named from its own mark, and from nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tribo
from tribo.diagnostics.direct_evidence import direct_evidence
from tribo.diagnostics.observations import observe
from tribo.figures.evidence import power_numbers
from tribo.records import Ingested, Trace
from tribo.traces import split_pulls
from tribo.traces.drive import load_as_set

from .bench import EFFECTS, campaign, seen_in_nine_of_ten


def read(folder: Path, effect: str, times: float, seed: int = 41) -> Ingested:
    size = times * seen_in_nine_of_ten(effect) if effect else 0.0
    return tribo.ingest(tribo.load_campaign(campaign(folder / "campaign", seed, effect, size)))


HIDDEN = pytest.mark.parametrize(("effect", "times"), list(zip(EFFECTS, (3.0, 3.0, 2.0, 2.0), strict=True)))
METRES = {"machine_compliance": 1e-3}  # of a millimetre


@HIDDEN
def test_the_traces_show_an_effect_of_the_machine_alone_with_its_size(
    tmp_path: Path, effect: str, times: float
) -> None:
    evidence = direct_evidence(observe(read(tmp_path, effect, times)))
    assert [name for name, e in evidence.items() if e.certain] == [effect]
    low, high = evidence[effect].interval
    assert effect == "sampling_clip" or low < times * seen_in_nine_of_ten(effect) * METRES.get(effect, 1.0) < high


@pytest.mark.slow
@HIDDEN
def test_an_effect_of_the_machine_is_named_alone(tmp_path: Path, effect: str, times: float) -> None:
    diagnosis = tribo.diagnose(read(tmp_path, effect, times), seed=1)
    assert [c.mechanism for c in diagnosis.verdict.causes] == [effect]
    power = power_numbers(diagnosis)
    assert power.loc[power["mark"] == "answer", "name"].item() == "traces: yes, else: no"


def test_without_a_hidden_effect_every_mark_is_said_not_to_matter(tmp_path: Path) -> None:
    verdict = tribo.diagnose(read(tmp_path, "", 0.0), seed=1).verdict
    assert verdict.verdict == "no_misfit"
    reasons = {e.mechanism: e.reason for e in (*verdict.excluded, *verdict.not_testable)}
    assert set(EFFECTS) <= set(reasons)
    assert "%" in reasons["pull_angle"]


def test_records_without_a_mark_leave_their_mechanism_untested(tmp_path: Path) -> None:
    """No recorded load, and no turn of the drive."""
    ingested = read(tmp_path, "pull_angle", 3.0)
    marks = ("load_lost_per_pull", "force_kept_at_turn")
    bare = {
        test: {name: f for name, f in found.items() if name not in marks} for test, found in ingested.features.items()
    }
    evidence = direct_evidence(observe(replace(ingested, features=bare)))
    assert "pull_angle" not in evidence
    assert "pulley_friction" not in evidence


def test_a_load_that_falls_because_of_the_pull_cuts_no_record() -> None:
    time = np.arange(1200) / 100.0
    force = np.where(time < 3.0, 0.0, np.minimum(20.0 * (time - 3.0), 4.0))
    noise = 0.002 * np.random.default_rng(3).standard_normal((2, 1200))
    record = Trace("r", time, force + noise[0], columns={"normal_force_N": 1.0 - 0.05 * force + noise[1]})
    assert len(split_pulls(record)) == 1


def test_a_load_that_was_changed_stays_as_it_was_recorded() -> None:
    load = np.repeat([2.0, 4.0], 300)
    assert np.array_equal(load_as_set(-load, 0.4 * load + 0.1), load)
