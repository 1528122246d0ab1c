"""The diagnosis without the spring-block model: what friction varies with beside the law of each sample."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from tribo import stages
from tribo.campaign import load_campaign
from tribo.cli import main
from tribo.diagnostics.column_search import load_levels, regime_tests
from tribo.diagnostics.direct_evidence import running_in, stroke_offset
from tribo.diagnostics.verdict import Cause, Verdict
from tribo.fitting.alternatives import compared_laws, dependence
from tribo.plausibility import doubts_of
from tribo.records import Campaign, Ingested, Pattern, Pull, Study, Test, Trace
from tribo.vocabulary import label_with_unit
from tribo.wording.part_sentences import cause_sentence, layer_sentence
from tribo.wording.verdict_sentences import meanings

Change = Callable[[dict[str, Any]], float]
Further = Callable[[dict[str, Any]], dict[str, Any]]


def of_speed(row: dict[str, Any]) -> float:
    return float(0.02 * np.log(row["speed_mm_s"]))


def no_further(row: dict[str, Any]) -> dict[str, Any]:
    return {}


def made(folder: Path, change: Change, seed: int = 1, columns: Further = no_further) -> Path:
    """Sixty tests of two samples: five loads, six repeats in random order, power law and line, 3 % scatter."""
    rng = np.random.default_rng(seed)
    plan = [(s, n) for s in "AB" for n in (1.0, 2.0, 4.0, 8.0, 16.0) for _ in range(6)]
    rows = []
    for place, at in enumerate(rng.permutation(len(plan))):
        sample, load = plan[at]
        row = {"test_id": f"T{place:02d}", "sample": sample, "normal_load_N": load, "run_order": place + 1,
               "speed_mm_s": float(rng.choice([0.1, 1.0, 10.0])), "bath": str(rng.choice(["old", "new"]))}  # fmt: skip
        force = (0.5 * load**0.8 if sample == "A" else 0.3 * load + 1.0) * np.exp(change(row) + rng.normal(0.0, 0.03))
        rows.append({**row, "sliding_N": f"{force:.6g}", **columns(row)})
    folder.mkdir()
    lines = [",".join(rows[0]), *(",".join(map(str, row.values())) for row in rows)]
    (folder / "tests.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = '[campaign]\ntitle = "made"\n[patterns.A]\ncavity = "none"\n[patterns.B]\ncavity = "none"\n'
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    return folder


def verdict_of(folder: Path) -> Verdict:
    return diagnosed(stages.ingest(load_campaign(folder)))


def diagnosed(ingested: Ingested) -> Verdict:
    study = Study(ingested, (), laws=compared_laws(ingested.table()), dependence=dependence(ingested))
    return stages.diagnosis_without_model(study).verdict


def test_one_law_is_found_among_a_hundred_columns_of_noise_and_nothing_among_noise_alone(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    noise: Further = lambda row: {f"c{k:03d}": f"{rng.standard_normal():.4f}" for k in range(100)}  # noqa: E731
    found = verdict_of(made(tmp_path / "law", of_speed, columns=noise))
    assert [cause.mechanism for cause in found.causes] == ["velocity_dependence"]
    nothing = verdict_of(made(tmp_path / "noise", lambda row: 0.0, columns=noise))
    assert nothing.verdict == "no_misfit"
    assert "c010 and 91 more columns." in nothing.text  # and bath, run order and speed


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_is_named_where_friction_follows_its_laws_alone(tmp_path: Path, seed: int) -> None:
    found = verdict_of(made(tmp_path / "c", lambda row: 0.0, seed))
    assert (found.verdict, found.causes) == ("no_misfit", ())
    assert "nothing exceeds chance" in found.text


def test_the_law_of_every_sample_is_a_layer_with_its_parameters(tmp_path: Path) -> None:
    laws = {layer.samples[0]: layer for layer in verdict_of(made(tmp_path / "c", lambda row: 0.0)).layers}
    assert laws["A"].formula == "T = a N^b"
    b = laws["A"].parameters["b"]
    assert b.low < b.value < b.high
    assert b.value == pytest.approx(0.8, abs=3 * 0.007)  # six repeats of 3 % at five loads: 0.7 % of standard error
    assert laws["B"].parameters["T0"].low < 1.0 < laws["B"].parameters["T0"].high
    assert "At 4 N, T₀ is 45 % of T." in laws["B"].text  # 1 N of 0.3 x 4 N + 1 N


def test_a_dependence_on_speed_is_named_with_its_size(tmp_path: Path) -> None:
    found = verdict_of(made(tmp_path / "c", of_speed))
    assert [cause.mechanism for cause in found.causes] == ["velocity_dependence"]
    size = found.causes[0].parameters["change of sliding T"]
    assert size.low < 100 * (100**0.02 - 1) < size.high
    assert size.high - size.low < 5.0
    (layer,) = (x for x in found.layers if x.kind == "cause")
    assert layer.p_adjusted < 0.01


def test_two_causes_are_named_beside_each_other(tmp_path: Path) -> None:
    found = verdict_of(made(tmp_path / "c", lambda row: of_speed(row) + 0.08 * (row["bath"] == "old")))
    assert {cause.mechanism for cause in found.causes} == {"velocity_dependence", "covariate:bath"}
    assert "bath" in found.text


def test_a_column_recorded_for_three_tests_of_five_is_named_with_its_size(tmp_path: Path) -> None:
    def lid(row: dict[str, Any]) -> str:
        return "on" if int(row["test_id"][1:]) % 2 else "off"

    def recorded(row: dict[str, Any]) -> dict[str, Any]:
        return {"lid": "" if int(row["test_id"][1:]) % 5 < 2 else lid(row)}

    verdict = verdict_of(made(tmp_path / "c", lambda row: 0.1 * (lid(row) == "on"), columns=recorded))
    (cause,) = verdict.causes
    assert cause.mechanism == "covariate:lid"
    (size,) = cause.parameters.values()
    assert size.low < 100.0 * np.expm1(0.1) < size.high


def test_columns_that_run_alike_are_named_as_tied_with_the_test_that_parts_them(tmp_path: Path) -> None:
    further: Further = lambda row: {"wear_m": 3 * row["run_order"]}  # noqa: E731
    found = verdict_of(made(tmp_path / "c", lambda row: 0.004 * row["run_order"], columns=further))
    assert {frozenset(names) for names in found.equivalent} == {frozenset({"covariate:run_order", "covariate:wear_m"})}
    assert found.next_test is not None
    assert set(found.next_test.separates) == {"run_order", "wear_m"}
    assert found.next_test.text == "Choose the values of wear at random, independently of the run order: 12 pulls."


def test_a_column_that_varies_only_with_the_load_cannot_be_told_from_it(tmp_path: Path) -> None:
    found = verdict_of(made(tmp_path / "c", lambda row: 0.0, columns=lambda row: {"step": 7 * row["normal_load_N"]}))
    assert "covariate:step" in [e.mechanism for e in found.not_testable]
    assert found.next_test is not None
    assert found.next_test.separates == ("step", "normal_load_N")
    assert "random order" in found.next_test.text


def test_fewer_than_twelve_tests_are_not_searched_and_the_verdict_says_so(tmp_path: Path) -> None:
    folder = made(tmp_path / "c", lambda row: 0.5 * (row["bath"] == "old"))
    lines = (folder / "tests.csv").read_text().splitlines()
    (folder / "tests.csv").write_text("\n".join(lines[:10]) + "\n", encoding="utf-8")
    found = verdict_of(folder)
    assert found.causes == ()
    assert found.verdict == "cannot_tell"
    assert "too little was measured (9 usable tests, at least" in found.sentence


def test_the_verdict_does_not_depend_on_the_unit_of_the_force(tmp_path: Path) -> None:
    first = stages.ingest(load_campaign(made(tmp_path / "c", of_speed)))
    small = {i: _scaled(pull, 1e-6) for i, pull in first.pulls.items()}
    tests = tuple(_lighter(test, 1e-6) for test in first.campaign.tests)
    second = replace(first, pulls=small, campaign=replace(first.campaign, tests=tests))
    both = [diagnosed(one) for one in (first, second)]
    sizes = [v.causes[0].parameters["change of sliding T"].value for v in both]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-6)


def _scaled(pull: Pull, factor: float) -> Pull:
    return replace(pull, sliding_N=pull.sliding_N * factor)


def _lighter(test: Test, factor: float) -> Test:
    return replace(test, normal_load_N=test.normal_load_N * factor)


def test_loads_that_scatter_about_one_value_are_one_level() -> None:
    assert load_levels(np.array([2.0, 1.0, 2.01, 1.005, 4.0])).tolist() == [1, 0, 1, 0, 2]


def long_slides(excess: float, records: int = 4) -> Ingested:
    """Rotary records of 150 m at 0.15 m/s, 10 N, with an excess of friction that fades over 5 m."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 1000.0, 1.0)
    tests, traces, pulls = [], {}, {}
    for k in range(records):
        force = 10.0 * (1.0 + excess * np.exp(-0.15 * time / 5.0)) + rng.normal(0.0, 0.2, time.size)
        name = f"T{k}"
        tests.append(Test(name, "", "pin", 50.0, "pin", speed_m_s=0.15))
        traces[name] = Trace(name, time, force)
        nan = float("nan")
        pulls[name] = Pull(
            test_id=name, rule="first_peak", static_N=nan, static_u_N=nan, sliding_N=10.0, sliding_u_N=0.1, zero_N=0.0,
            zero_u_N=nan, onset_s=nan, peak_s=nan, window_s=(500.0, 999.0),
        )  # fmt: skip
    return Ingested(Campaign("pins", Path(), 1.0, tuple(tests), {"pin": Pattern("pin")}), traces, pulls, ())


def test_running_in_along_a_long_slide_is_found_and_a_steady_one_is_left() -> None:
    found = running_in(long_slides(0.3))
    assert [r.p < 0.001 for r in found] == [True] * 4
    # over the first 7.5 m, 0.3 exp(-s / 5 m) has the mean 0.3 (1 - exp(-1.5)) / 1.5
    assert [r.first_percent for r in found] == pytest.approx([100 * 0.3 * (1 - np.exp(-1.5)) / 1.5] * 4, abs=1.5)
    assert all(r.p > 0.01 for r in running_in(long_slides(0.0)))


def strokes(zeros: list[float]) -> Any:
    """Pulls in both directions in turn, with these zeros (N)."""
    flags = (("forward",), ("backward",))
    return SimpleNamespace(
        pulls={str(k): SimpleNamespace(flags=flags[k % 2], zero_N=z, sliding_N=2.0) for k, z in enumerate(zeros)}
    )


def test_an_offset_between_strokes_is_stated_in_newtons_only_where_it_is_certain() -> None:
    layer = stroke_offset(strokes([0.3, 0.3, 0.31, 0.3, 0.29, 0.3, 0.3, 0.3]))
    assert layer is not None
    assert layer.parameters["F0"].value == pytest.approx(0.3)
    assert layer.effect_percent == pytest.approx(15.0)
    said = layer_sentence(layer)
    assert said.startswith("The force recorded in 4 forward and 4 backward strokes is offset by 0.3 N")
    assert cause_sentence(Cause(layer.name, 1.0, layer.parameters, shows=layer)) == said
    assert stroke_offset(strokes([0.3, 0.3, -0.31, 0.3, 0.29, 0.3, -0.3, 0.3])) is None


def test_diagnose_writes_a_verdict_without_the_model(tmp_path: Path) -> None:
    folder = made(tmp_path / "c", of_speed)
    done = CliRunner().invoke(main, ["diagnose", str(folder), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert verdict["model"] == {"baseline": "the law of each sample alone"}
    assert [cause["mechanism"] for cause in verdict["causes"]] == ["velocity_dependence"]
    assert "Sliding friction rises by" in done.output


def test_a_column_named_by_another_name_of_the_load_is_no_column(tmp_path: Path) -> None:
    folder = made(tmp_path / "c", lambda row: 0.0, columns=lambda row: {"nominal_load_N": row["normal_load_N"]})
    points = regime_tests(stages.ingest(load_campaign(folder)), "sliding")
    assert "nominal_load_N" not in [*points.only_with_load, *(c.name for c in points.columns)]


@pytest.mark.parametrize(("spread", "doubted"), [(1.003, False), (1.08, True)])
def test_loads_that_were_meant_to_be_one_are_no_doubtful_number(tmp_path: Path, spread: float, doubted: bool) -> None:
    campaign = load_campaign(made(tmp_path / "c", lambda row: 0.0))
    tests = tuple(replace(t, normal_load_N=2.0 * (spread if k % 2 else 1.0)) for k, t in enumerate(campaign.tests))
    found = doubts_of(replace(campaign, tests=tests))
    assert any("range of the loads" in str(doubt) for doubt in found) is doubted


def test_running_in_within_records_is_not_explained_as_a_matter_of_first_pulls() -> None:
    records = running_in(long_slides(0.3))
    within = Verdict(verdict="named", causes=(Cause("run_in", 1.0, {}, shows=records),))
    over_pulls = Verdict(verdict="named", causes=(Cause("run_in", 1.0, {}),))
    assert [text for _, text in meanings(within)] == [
        "Within one record, friction changes with the distance."
    ]
    assert "first pulls" in meanings(over_pulls)[0][1]


@pytest.mark.parametrize(
    ("column", "label"),
    [("radius_mm", "radius (mm)"), ("slide_speed_um_s", "slide speed (µm/s)"), ("spring_N_per_m", "spring (N/m)"),
     ("cure_time_h", "cure time (h)"), ("rh_pct", "rh (%)"), ("SequenceID", "SequenceID"),
     ("speed_mm_s", "pull speed (mm/s)")],
)  # fmt: skip
def test_a_users_own_column_is_named_with_the_unit_that_ends_its_name(column: str, label: str) -> None:
    assert label_with_unit(column) == label
