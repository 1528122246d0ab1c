"""The verdict keeps its schema, whatever the outcome."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import pytest

from tribo.diagnostics import Diagnosis, examine
from tribo.diagnostics.planning import bits
from tribo.diagnostics.verdict import Excluded, Misfit, Verdict
from tribo.errors import FitError
from tribo.records import SetAside
from tribo.wording.verdict_sentences import worded

from .synthetic import hidden

KEYS = {"schema", "verdict", "misfits", "causes", "equivalent", "excluded", "gain", "set_aside", "next_test"}
FEW = (40, 25)


@pytest.fixture(scope="module")
def tied() -> Diagnosis:
    found = examine(hidden(("suction", 1.0)), replicates=FEW)
    return replace(found, verdict=worded(found.verdict))


def test_the_json_has_every_key_of_the_schema(tied: Diagnosis) -> None:
    plain = json.loads(tied.verdict.to_json())
    assert set(plain) >= KEYS
    assert plain["schema"] == "tribo.verdict/2"
    assert set(plain["misfits"][0]) >= {"observable", "sample", "covariate", "effect_percent", "p_adjusted", "text"}
    assert set(plain["causes"][0]) == {"mechanism", "weight", "parameters", "text"}
    suction = next(cause for cause in plain["causes"] if cause["mechanism"] == "suction")
    assert set(suction["parameters"]["dp"]) == {"value", "low", "high", "unit"}
    assert set(plain["gain"]) == {
        "held_out", "log_score_baseline", "log_score_extended", "difference", "se",
        "rmse_percent_before", "rmse_percent_after",
    }  # fmt: skip
    assert set(plain["next_test"]) == {"text", "separates", "design", "expected_bits"}


def test_numbers_that_do_not_exist_are_null_not_nan() -> None:
    v = Verdict("unknown", misfits=(Misfit("zero", "", "", float("nan"), 0.0, ""),), set_aside=(SetAside("T1", "x"),))
    plain = json.loads(v.to_json())
    assert plain["misfits"][0]["effect_percent"] is None
    assert plain["set_aside"] == [{"test_id": "T1", "reason": "x"}]
    assert plain["gain"] is None


def test_a_mechanism_that_loses_to_a_law_of_its_own_column_is_named_as_what_can_be_the_cause() -> None:
    differs = Misfit("both", "", "humidity_pct", 371.0, 1e-11, "")
    lost = Verdict("unknown", misfits=(differs,), excluded=(Excluded("humidity", "a law explains more", 23.5),))
    assert worded(lost).sentence.endswith("humidity can be its cause, with another formula than that of the library.")
    assert worded(replace(lost, excluded=())).sentence.endswith("no mechanism of the library explains it.")


def test_suction_and_a_load_error_are_named_together_with_a_test_that_parts_them(tied: Diagnosis) -> None:
    v = tied.verdict
    assert v.verdict == "named"
    assert {c.mechanism for c in v.causes} == {"suction", "normal_load_error"}
    assert set(v.equivalent[0]) == {"suction", "normal_load_error"}
    assert v.next_test is not None
    assert set(v.next_test.separates) == {"suction", "normal_load_error"}
    assert v.next_test.expected_bits > 0.5


def test_the_named_cause_gains_on_samples_it_has_not_seen(tied: Diagnosis) -> None:
    g = tied.verdict.gain
    assert g is not None
    assert g.held_out == "samples"
    assert g.difference > 2 * g.se > 0
    assert g.rmse_percent_after < g.rmse_percent_before


def test_every_mechanism_is_either_a_cause_or_excluded_with_a_reason(tied: Diagnosis) -> None:
    from tribo.mechanisms import NAMES

    v = tied.verdict
    spoken_of = {c.mechanism for c in v.causes} | {e.mechanism.split(":")[0] for e in (*v.excluded, *v.not_testable)}
    assert spoken_of == set(NAMES)
    reasons = {e.mechanism: e.reason for e in (*v.excluded, *v.not_testable)}
    assert "before contact" in reasons["load_cell_offset"]
    assert "the pull speed does not vary" in reasons["velocity_dependence"]
    assert "the calibration on the flat sample absorbs" in reasons["pulley_friction"]


def test_only_what_the_design_can_test_is_ruled_out(tied: Diagnosis) -> None:
    from tribo.mechanisms import mechanism

    v, conditions = tied.verdict, tied.baseline.setup.observations.conditions
    assert all(mechanism(e.mechanism).applies(conditions) for e in v.excluded)
    assert not [e for e in v.excluded if "cannot be tested" in e.reason]
    assert {"velocity_dependence", "pulley_friction"} <= {e.mechanism for e in v.not_testable}


@cache
def quiet() -> Verdict:
    return examine(hidden(seed=8), seed=4, replicates=(20, 10)).verdict


def test_the_same_seed_gives_the_same_verdict_to_the_bit() -> None:
    again = examine(hidden(seed=8), seed=4, replicates=(20, 10)).verdict
    assert again.to_json() == quiet().to_json()


def test_too_few_tests_are_refused_with_what_is_needed() -> None:
    ingested = hidden()
    few = replace(ingested.campaign, tests=ingested.campaign.tests[:5])
    with pytest.raises(FitError, match="at least 12"):
        examine(replace(ingested, campaign=few))


def test_no_difference_tells_nothing_and_a_large_one_tells_all() -> None:
    assert bits(0.0) == pytest.approx(0.0, abs=1e-9)
    assert 0.05 < bits(1.0) < 0.2
    assert bits(400.0) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.slow
def test_a_batch_that_grips_more_is_named_by_its_column() -> None:
    ingested = hidden(seed=21)
    batches = {t.test_id: "abc"[k % 3] for k, t in enumerate(ingested.campaign.tests)}
    tests = tuple(replace(t, covariates={"batch": batches[t.test_id]}) for t in ingested.campaign.tests)
    gain = {"a": 1.0, "b": 1.0, "c": 1.2}
    pulls = {
        k: replace(p, static_N=p.static_N * gain[batches[k]], sliding_N=p.sliding_N * gain[batches[k]])
        for k, p in ingested.pulls.items()
    }
    campaign = replace(ingested.campaign, tests=tests)
    v = examine(replace(ingested, campaign=campaign, pulls=pulls), replicates=FEW).verdict
    assert v.verdict == "named"
    assert [c.mechanism for c in v.causes] == ["covariate:batch"]


def test_an_offset_gains_on_the_zeros_of_specimens_it_has_not_seen() -> None:
    v = examine(hidden(("load_cell_offset", 1.0)), replicates=(20, 10)).verdict
    assert v.verdict == "named"
    assert [c.mechanism for c in v.causes] == ["load_cell_offset"]
    assert v.misfits[0].observable == "zero"
    assert 0.0 < v.misfits[0].p_adjusted < 1e-3
    assert v.gain is not None
    assert v.gain.difference > 10 * v.gain.se


def test_a_campaign_without_misfit_is_told_what_it_never_varied() -> None:
    v = quiet()
    assert v.next_test is not None
    assert v.next_test.separates == ("velocity_dependence", "contact_ageing")


def one_pattern_falls() -> Verdict:
    """A verdict on a campaign in which the forces of C fall by a further 30 % for each e-fold of load."""
    ingested = hidden(seed=8)
    falls = {t.test_id: t.normal_load_N**-0.3 for t in ingested.campaign.tests if t.sample == "C"}
    pulls = {
        k: replace(p, static_N=p.static_N * falls.get(k, 1.0), sliding_N=p.sliding_N * falls.get(k, 1.0))
        for k, p in ingested.pulls.items()
    }
    return worded(examine(replace(ingested, pulls=pulls), replicates=FEW).verdict)


@pytest.mark.slow
def test_a_misfit_is_said_in_words_of_the_field_and_not_of_the_flat_sample(tied: Diagnosis) -> None:
    found = [*tied.verdict.misfits, *one_pattern_falls().misfits]
    assert any("of C falls with the normal load" in m.text for m in found)
    assert not any("normal_load_N" in m.text for m in found)
    assert not any("_" in text for text in (tied.verdict.text, *(c.text for c in tied.verdict.causes)))
    assert not any(m.sample == "F" and m.covariate in ("sample", "normal_load_N") for m in found)
