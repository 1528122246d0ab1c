"""One module and one line: a mechanism that is added to the table is diagnosed, planned for, simulated and worded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnostics import examine, plan_design
from tribo.diagnostics.candidates import weigh
from tribo.diagnostics.diagnosis import Diagnosis
from tribo.diagnostics.score_statistics import start_effects
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import (
    Base,
    Conditions,
    DirectMeasurement,
    Forces,
    Mechanism,
    TraceEvidence,
    Values,
    amplitude,
)
from tribo.mechanisms_in_model import parse_with, simulate_with
from tribo.records import Ingested
from tribo.springblock import SimConfig, simulate
from tribo.wording.verdict_sentences import worded

from .synthetic import hidden

NAME = "every_other_pull"
SIZE = 0.3


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """Static friction is higher in every other pull of a specimen."""
    before = base.forces(conditions.normal_load_N)
    return Forces(before.static_N * np.exp(values[0] * (conditions.specimen_run % 2)), before.sliding_N)


TOY = Mechanism(
    name=NAME,
    kind="interface",
    formula="T_s -> T_s exp(a) in odd pulls",
    parameters=(amplitude("a", "", -1.0, 1.0, 0.1, "relative change in odd pulls"),),
    law=law,
    sign=0,
    regimes=("static",),
    enters="static thresholds of the blocks",
    shows="static friction alternates from pull to pull",
    confused_with="nothing",
    separates="pull each specimen once",
    silenced_by=("pull each specimen once",),
    needs=("specimen_run",),
    plain="alternating static friction",
    measurement=DirectMeasurement("Contrast at every other pull.", 0.01, 0.1),
)


def with_alternation(ingested: Ingested) -> Ingested:
    """The campaign with static friction higher in odd pulls of every specimen."""
    odd = {t.test_id: bool((t.specimen_run or 0) % 2) for t in ingested.campaign.tests}
    pulls = {
        name: replace(p, static_N=p.static_N * np.exp(SIZE)) if odd[name] else p for name, p in ingested.pulls.items()
    }
    return replace(ingested, pulls=pulls)


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> Mechanism:
    monkeypatch.setitem(MECHANISMS, NAME, TOY)
    return TOY


@pytest.fixture(scope="module")
def examined() -> Diagnosis:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(MECHANISMS, NAME, TOY)
        return examine(with_alternation(hidden(seed=8)), replicates=(40, 25))


def test_it_is_weighed_and_recovered(toy: Mechanism, examined: Diagnosis) -> None:
    best = weigh(start_effects(examined.baseline))[0]
    assert best.name == NAME
    assert best.values[0] == pytest.approx(SIZE, abs=0.05)


def test_the_verdict_names_it_and_words_it_by_what_its_record_says(toy: Mechanism, examined: Diagnosis) -> None:
    v = worded(examined.verdict)
    assert v.verdict == "named"
    assert [c.mechanism for c in v.causes] == [NAME]
    assert "alternating static friction" in v.text
    assert v.causes[0].text.startswith("Alternating static friction: a = 0.")
    assert "static friction alternates from pull to pull" in v.causes[0].text
    assert v.next_test is not None
    assert v.next_test.text == "Contrast at every other pull."


def test_a_plan_says_from_which_size_on_it_is_found(toy: Mechanism) -> None:
    found = {f.mechanism: f for f in plan_design(hidden(seed=8).campaign).findings}[NAME]
    assert 0 < found.amplitude < SIZE


def test_it_runs_in_the_simulator_by_its_law(toy: Mechanism) -> None:
    config = SimConfig(sample="B", pressure_Pa=8e3, blocks=(25, 25), seed=3, dt_s=1e-7)
    before = simulate(config)
    after = simulate_with(config, parse_with(f"{NAME}:a=0.2"), specimen_run=1.0)
    assert after.static_friction / before.static_friction == pytest.approx(np.exp(0.2), rel=0.05)
    assert simulate_with(config, parse_with(f"{NAME}:a=0.2"), specimen_run=2.0).static_friction == pytest.approx(
        before.static_friction
    )


def test_evidence_that_it_states_in_the_traces_is_read_and_bars_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mechanism with the force before contact as its evidence is named from that, without a line elsewhere."""
    stated = TraceEvidence("zero", "", "read from the force before contact", "zero", corrected="{found}")
    monkeypatch.setitem(MECHANISMS, NAME, replace(TOY, evidence=stated))
    monkeypatch.setitem(MECHANISMS, "load_cell_offset", replace(MECHANISMS["load_cell_offset"], evidence=None))
    v = worded(examine(hidden(("load_cell_offset", 1.0)), replicates=(20, 10)).verdict)
    assert [c.mechanism for c in v.causes] == [NAME]
    assert v.causes[0].text.endswith("read from the force before contact.")
    assert v.gain is not None
