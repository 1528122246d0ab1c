"""What the script of the page reads is what was measured, as finely as a screen can show, and cannot break the page."""

from __future__ import annotations

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from tribo.errors import Problem
from tribo.figures.one_pull import pull_numbers
from tribo.records import Override, Phase, Study
from tribo.report.pulls import peak_above_samples, trace_data, trace_picture
from tribo.report.shell import script_json
from tribo.report.tables import phases_table
from tribo.wording.study_sentences import FLAGS


def unpacked(record: dict[str, object]) -> np.ndarray:
    share = np.frombuffer(base64.b64decode(str(record["data"])), "<u2") / 65535
    low, high = float(str(record["low"])), float(str(record["high"]))
    return low + (high - low) * share


def test_a_trace_comes_out_as_it_went_in(study: Study) -> None:
    record = json.loads(trace_data(study, ["T0001"]))["T0001"]
    trace, pull = study.ingested.traces["T0001"], study.ingested.pulls["T0001"]
    assert record["whole"] is True
    assert unpacked(record["t"]) == pytest.approx(trace.time_s, abs=1e-3)
    assert unpacked(record["f"]) == pytest.approx(trace.force_N - pull.zero_N, abs=1e-4)
    assert record["peak"] == pytest.approx([pull.peak_s, pull.static_N], rel=1e-5)


def test_a_long_trace_is_thinned_without_losing_its_extremes(study: Study) -> None:
    time = np.linspace(0, 20, 200_000)
    force = np.sin(time)
    force[77_777] = 9.0
    trace = replace(study.ingested.traces["T0001"], time_s=time, force_N=force, displacement_m=None)
    ingested = replace(study.ingested, traces={**study.ingested.traces, "T0001": trace})
    record = json.loads(trace_data(replace(study, ingested=ingested), ["T0001"]))["T0001"]
    values = unpacked(record["f"])
    assert len(values) <= 1002
    assert record["whole"] is False
    assert values.max() == pytest.approx(9.0 - study.ingested.pulls["T0001"].zero_N, abs=1e-3)


def test_a_peak_above_every_sample_is_said_to_be_interpolated(study: Study) -> None:
    trace, pull = study.ingested.traces["T0001"], study.ingested.pulls["T0001"]
    before = (trace.force_N - pull.zero_N)[trace.time_s < pull.window_s[0]]
    above, among = (replace(pull, static_N=factor * float(before.max())) for factor in (1.08, 1.0))
    assert peak_above_samples(trace, above) == (
        "the peak is interpolated between samples, 8 % above the highest of them"
    )
    assert peak_above_samples(trace, among) == ""
    assert peak_above_samples(trace, replace(pull, static_N=np.nan)) == ""


def test_every_doubt_about_a_sample_is_shown_at_its_time(study: Study) -> None:
    """On the picture of the card and in the data of the chart, said once; one about no sample is not."""
    trace, pull = study.ingested.traces["T0001"], study.ingested.pulls["T0001"]
    gap = Problem("nan_gap", "the force is missing", row=trace.first_row + 30)
    about_none = Problem("off_speed", "the travel is off its speed")
    doubted = replace(trace, problems=(gap, about_none))
    ingested = replace(study.ingested, traces={**study.ingested.traces, "T0001": doubted})
    both = replace(pull, problems=(gap,))
    ingested = replace(ingested, pulls={**ingested.pulls, "T0001": both})
    record = json.loads(trace_data(replace(study, ingested=ingested), ["T0001"]))["T0001"]
    [[time_s, what]] = record["doubts"]
    assert (time_s, what) == (pytest.approx(trace.time_s[30], rel=1e-5), "the force is missing")
    assert trace_picture(doubted, both).count('class="d"') == 1
    assert 'class="d"' not in trace_picture(trace, pull)


def test_no_name_can_end_the_script_element() -> None:
    series = {"name": "</script><script>alert(1)", "place": [0.0, 0.0]}
    text = script_json({"fig": [series]})
    assert "<" not in text
    assert json.loads(text)["fig"][0]["name"] == series["name"]


def test_the_phases_of_a_pull_are_in_its_picture_its_figure_and_their_table(study: Study) -> None:
    phases = (Phase("rest", 0.0, 1.0), Phase("steady sliding", 1.0, 9.0, 2e-3, 5.0, 0, 1.5, 0.01, "the drive moves"))
    pulls = {**study.ingested.pulls, "T0001": replace(study.ingested.pulls["T0001"], phases=phases)}
    changed = replace(study, ingested=replace(study.ingested, pulls=pulls))
    record = json.loads(trace_data(changed, ["T0001"]))["T0001"]
    assert record["phases"] == [["rest", 0.0, 1.0], ["steady sliding", 1.0, 9.0]]
    marks = pull_numbers(study.ingested.traces["T0001"], pulls["T0001"])
    assert marks[marks["mark"] == "phase: steady sliding"]["time_s"].tolist() == [1.0, 9.0]
    table = phases_table(changed)
    assert table is not None
    row = table[(table["test_id"] == "T0001") & (table["phase"] == "steady sliding")].iloc[0]
    assert (row["speed_mm_s"], row["normal_load_N"], row["force_N"], row["u_N"]) == (2.0, 5.0, 1.5, 0.01)
    assert row["evidence"] == "the drive moves"


def test_stated_phases_are_a_peak_and_a_window_for_the_page(study: Study) -> None:
    phases = (Phase("rise", 0.5, 1.0), Phase("steady sliding", 2.0, 9.0))
    decided = Override(
        "T0001", "phase", study.ingested.pulls["T0001"], study.ingested.traces["T0001"], "seen", phases=phases
    )
    changed = replace(study, ingested=replace(study.ingested, by_hand={"T0001": decided}))
    record = json.loads(trace_data(changed, ["T0001"]))["T0001"]
    assert record["decided"] == {"action": "move", "reason": "seen", "peak": 1.0, "window": [2.0, 9.0]}


def test_a_drop_smaller_than_its_uncertainty_is_called_uncertain_and_not_absent() -> None:
    """The flag is set where the peak lies less than three standard uncertainties above the sliding mean."""
    assert FLAGS["no_drop"] == "no certain drop after the peak"
