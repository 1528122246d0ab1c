"""An export of many pulls gives a campaign mu and tau0 across them, by rows of tests.csv alone."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.campaigns import written

from tribo import stages
from tribo.campaign import load_campaign
from tribo.campaign.table import is_chosen, overlap, split_choice
from tribo.cli import main
from tribo.readers import read_blocks
from tribo.records import Campaign, Ingested

RATE_HZ = 100
AREA_M2 = 55e-6
MU, TAU0_PA = 0.6, 2000.0  # of sliding; static friction is STATIC times as much
STATIC = 1.25
GRAM_FORCE_N = 9.80665e-3
TOML = """\
[campaign]
title = "Strokes under steps of load"
nominal_area_mm2 = 55.0

[patterns.F]
cavity = "none"
"""
HEADER = "test_id,file,sample,specimen,normal_load_N"


def strokes(loads_N: tuple[float, ...], strokes_a_load: int, scale: float, zero_N: float, seed: int) -> np.ndarray:
    """Time, friction and normal force (n, 3) of strokes of 4 s in turn forward and backward, two or more at a load."""
    one = np.arange(4 * RATE_HZ) / RATE_HZ
    parts = []
    for k, load in enumerate(np.repeat(loads_N, strokes_a_load)):
        friction = scale * (MU * load + TAU0_PA * AREA_M2)
        rise = np.minimum(friction * (-1 + (1 + STATIC) * one / 0.5), STATIC * friction)
        fall = friction * (1 + (STATIC - 1) * np.exp(-np.maximum(one - 0.5, 0) / 0.1))
        parts.append(np.column_stack([(-1) ** k * np.where(one < 0.5, rise, fall), np.full(one.size, -load)]))
    both = np.concatenate(parts)
    rng = np.random.default_rng(seed)
    both += [zero_N, 0.0] + rng.standard_normal(both.shape) * 0.005
    return np.column_stack([np.arange(len(both)) / RATE_HZ, both])


def umt_text(table: np.ndarray) -> str:
    """A log as the data viewer of a CETR UMT writes it: gram-force called g, the load negative."""
    rows = [f"{f / GRAM_FORCE_N:.3f},{n / GRAM_FORCE_N:.3f},{t:.3f}," for t, f, n in table]
    return "\n".join(["Created by CETR Data Viewer 2.19", "Step No. 1", "Fx,Fz,T,", "g,g,sec,", *rows, ""])


def write_campaign(root: Path, rows: list[str], header: str = HEADER) -> Campaign:
    exports = {}
    for k, scale in enumerate((0.98, 1.0, 1.02)):
        table = strokes((1.0, 2.0, 4.0), 4, scale, 0.15, seed=k)
        exports[f"F{k + 1}.csv"] = umt_text(table)
    return load_campaign(written(root, TOML, [header, *rows], exports))


@pytest.fixture(scope="module")
def ingested(tmp_path_factory: pytest.TempPathFactory) -> Ingested:
    """Three specimens, one log of twelve strokes each, every stroke of it named by one row."""
    root = tmp_path_factory.mktemp("strokes")
    campaign = write_campaign(root, [f"R{k},raw/F{k}.csv#*,F,F{k}," for k in (1, 2, 3)])
    return stages.ingest(campaign, rule="middle_share")


def test_one_row_gives_every_stroke_of_its_log_with_the_load_recorded_there(ingested: Ingested) -> None:
    assert not ingested.set_aside
    assert list(ingested.pulls)[:12] == [f"R1#1/{k}" for k in range(1, 13)]
    loads = [t.normal_load_N for t in ingested.campaign.tests[:12]]
    assert loads == pytest.approx(np.repeat((1.0, 2.0, 4.0), 4), rel=2e-3)
    assert {t.specimen for t in ingested.campaign.tests} == {"F1", "F2", "F3"}
    assert [p.zero_N for p in ingested.pulls.values()] == pytest.approx([0.15, -0.15] * 18, abs=0.01)


@pytest.mark.parametrize(("regime", "times"), [("static", STATIC), ("sliding", 1.0)])
def test_mu_and_tau0_come_out_across_the_strokes_of_a_log(ingested: Ingested, regime: str, times: float) -> None:
    (fit,) = (f for f in stages.fit(ingested) if f.regime == regime)
    assert fit.n_specimens == 3
    assert fit.value("mu") == pytest.approx(times * MU, rel=0.02)
    assert fit.value("tau0_Pa") == pytest.approx(times * TAU0_PA, rel=0.04)
    for parameter, truth in (("mu", times * MU), ("tau0_Pa", times * TAU0_PA)):
        low, high = fit.interval(parameter)
        assert low < truth < high


def test_the_trace_of_a_stroke_keeps_its_zero_and_the_rows_it_stands_on(ingested: Ingested) -> None:
    pull, trace = ingested.pulls["R1#1/2"], ingested.traces["R1#1/2"]
    rows = (ingested.campaign.root / "raw" / "F1.csv").read_text().splitlines()
    friction, load = (float(cell) * GRAM_FORCE_N for cell in rows[trace.first_row - 1].split(",")[:2])
    assert trace.force_N[0] == pytest.approx(-friction)  # turned, as a stroke backward is
    assert trace.columns["normal_force_N"][0] == pytest.approx(load)
    within = (trace.time_s >= pull.window_s[0]) & (trace.time_s <= pull.window_s[1])
    assert trace.force_N[within].mean() - pull.zero_N == pytest.approx(pull.sliding_N)


def test_one_pull_of_a_log_is_the_same_named_alone(ingested: Ingested, tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, ["one,raw/F1.csv#1/7,F,F1,", "other,raw/F1.csv#1/8,F,F1,2.5"])
    alone = stages.ingest(campaign, rule="middle_share")
    assert alone.pulls["one"].sliding_N == ingested.pulls["R1#1/7"].sliding_N
    assert [t.normal_load_N for t in alone.campaign.tests] == pytest.approx([2.0, 2.5], rel=2e-3)


def test_a_log_read_as_one_pull_is_doubted_with_what_to_write(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv,F,F1,1"])
    (doubt,) = stages.ingest(campaign).doubts()
    (problem,) = (p for p in doubt.problems if p.kind == "several_pulls")
    assert problem.what.startswith("this trace contains 12 pulls")
    assert "raw/F1.csv#1/* for all" in (problem.allowed or "")


def ladder_log(loads_N: tuple[float, ...], offset_N: float, rest_s: float = 4.0, level_s: float = 20.0) -> str:
    """A log that begins at rest and slides on under one load after another, 0.6 of the load."""
    time = np.arange(0, rest_s + level_s * len(loads_N), 0.02)
    level = np.clip(((time - rest_s) // level_s).astype(int), 0, len(loads_N) - 1)
    load = np.array(loads_N)[level]
    force = offset_N + MU * load * np.clip((time - rest_s) / 1.5, 0, 1)
    scatter = 0.004 * np.random.default_rng(5).standard_normal((time.size, 2))
    return umt_text(np.column_stack([time, force + scatter[:, 0], -load + scatter[:, 1]]))


def test_a_ladder_of_loads_is_one_test_a_level_and_says_which_way_each_was_reached(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv,F,F1,1", "R2,raw/F2.csv#whole,F,F2,2"])
    loads = (1.0, 1.3, 1.6, 2.0, 1.6, 1.3)
    for k in (1, 2):
        (tmp_path / "raw" / f"F{k}.csv").write_text(ladder_log(loads, 0.2))
    found = stages.ingest(campaign)
    assert not found.set_aside
    assert list(found.pulls) == [*(f"R1#1/{k}" for k in range(1, 7)), "R2"]
    tests, pulls = found.campaign.tests[:6], list(found.pulls.values())[:6]
    assert [t.normal_load_N for t in tests] == pytest.approx(loads, rel=5e-3)
    assert [p.sliding_N for p in pulls] == pytest.approx([MU * load for load in loads], abs=0.01)
    assert [p.zero_N for p in pulls] == pytest.approx([0.2] * 6, abs=0.01)
    assert [t.covariates["ladder"] for t in tests] == ["up", "up", "up", "up", "down", "down"]
    assert [float(t.covariates["duration_s"]) for t in tests] == pytest.approx([24.0, *[20.0] * 5], abs=0.5)
    assert [math.isnan(p.static_N) for p in pulls] == [False, True, True, True, True, True]
    assert "several_pulls" not in {p.kind for d in found.doubts() for p in d.problems}
    alone = write_campaign(tmp_path, ["one,raw/F1.csv#1/3,F,F1,"])
    (tmp_path / "raw" / "F1.csv").write_text(ladder_log(loads, 0.2))
    assert stages.ingest(alone).pulls["one"].sliding_N == found.pulls["R1#1/3"].sliding_N


def test_ladders_that_start_at_one_load_give_a_law_of_sliding_and_none_of_static_friction(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv,F,F1,1", "R2,raw/F2.csv,F,F2,1"])
    for k in (1, 2):
        (tmp_path / "raw" / f"F{k}.csv").write_text(ladder_log((1.0, 1.5, 2.0, 3.0), 0.1 * k))
    (law,) = stages.fit(stages.ingest(campaign))
    assert (law.regime, law.value("mu")) == ("sliding", pytest.approx(MU, rel=0.02))


def test_a_pull_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv#2/1,F,F1,", "R2,raw/F2.csv#*,F,F2,"])
    (aside,) = stages.ingest(campaign, rule="middle_share").set_aside
    assert [(p.kind, p.found) for p in aside.problems] == [("no_such_pull", "2/1")]
    assert "1/12" in (aside.problems[0].allowed or "")


def test_a_load_that_nobody_gives_sets_each_pull_aside(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv#*,F,F1,", "R2,raw/F2.csv#*,F,F2,"])
    log = (tmp_path / "raw" / "F1.csv").read_text().replace("Fx,Fz,T", "Fx,Aux,T")
    (tmp_path / "raw" / "F1.csv").write_text(log)
    found = stages.ingest(campaign, rule="middle_share")
    assert {p.kind for s in found.set_aside for p in s.problems} == {"no_load"}
    assert {s.test_id.partition("#")[0] for s in found.set_aside} == {"R1"}


def test_pieces_without_a_load_are_left_out_and_named(tmp_path: Path) -> None:
    """The head is off the disc for a while between two loads."""
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv#*,F,F1,"])
    time = np.arange(6000) / RATE_HZ
    load = np.where(time < 20, 1.0, np.where(time < 40, 0.0, 3.0))
    noise = 0.003 * np.random.default_rng(0).standard_normal((time.size, 2))
    table = np.column_stack([time, MU * load + noise[:, 0], -load + noise[:, 1]])
    (tmp_path / "raw" / "F1.csv").write_text(umt_text(table))
    found = stages.ingest(campaign, rule="middle_share")
    assert [t.normal_load_N for t in found.campaign.tests] == pytest.approx([1.0, 3.0], rel=1e-2)
    assert {p.kind for d in found.doubts() for p in d.problems} == {"unloaded"}


def test_steps_of_load_while_sliding_give_a_sliding_law_and_no_static_one(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv#*,F,F1,"])
    time = np.arange(9000) / RATE_HZ
    load = np.where(time < 30, 1.0, np.where(time < 60, 2.0, 4.0))
    noise = 0.003 * np.random.default_rng(0).standard_normal((time.size, 2))
    friction = MU * load + TAU0_PA * AREA_M2
    table = np.column_stack([time, friction + noise[:, 0], -load + noise[:, 1]])
    (tmp_path / "raw" / "F1.csv").write_text(umt_text(table))
    (fit,) = stages.fit(stages.ingest(campaign))
    assert (fit.regime, fit.n_tests) == ("sliding", 3)
    assert fit.value("mu") == pytest.approx(MU, rel=0.01)


@pytest.mark.parametrize(
    ("one", "other", "meet"),
    [("", "1", True), ("*", "2/3", True), ("1", "2", False), ("1", "1/2", True), ("1/2", "1/3", False),
     ("1/*", "1/3", True), ("1/*", "2/3", False), ("1/2", "1/2", True)],
)  # fmt: skip
def test_rows_may_share_an_export_but_no_sample_of_it(tmp_path: Path, one: str, other: str, meet: bool) -> None:
    assert overlap(one, other) is overlap(other, one) is meet
    rows = [f"A,raw/F1.csv{'#' + one if one else ''},F,F1,1", f"B,raw/F1.csv{'#' + other if other else ''},F,F1,1"]
    campaign = write_campaign(tmp_path, [*rows, "C,raw/F2.csv,F,F2,1"])
    assert len(campaign.set_aside) == (2 if meet else 0)


def test_a_choice_stands_behind_the_last_number_sign() -> None:
    assert split_choice("raw/a.csv#2/3") == ("raw/a.csv", "2/3")
    assert split_choice("raw/run #4.csv") == ("raw/run #4.csv", "")
    assert split_choice("raw/a#1.csv#*") == ("raw/a#1.csv", "*")
    assert [c for c in ("*", "2/*", "2/3", "1/*", "2/4") if is_chosen("2/3", c)] == ["*", "2/*", "2/3"]


def test_a_plan_needs_the_loads_in_its_table(tmp_path: Path) -> None:
    write_campaign(tmp_path, ["R1,raw/F1.csv#*,F,F1,", "R2,raw/F2.csv#*,F,F2,2"])
    (aside,) = load_campaign(tmp_path, measured=False).set_aside
    assert [p.kind for p in aside.problems] == ["no_load"]


@pytest.mark.slow
def test_the_command_fits_a_log_of_strokes(tmp_path: Path) -> None:
    campaign, out = tmp_path / "campaign", tmp_path / "out"
    campaign.mkdir()
    write_campaign(campaign, [f"R{k},raw/F{k}.csv#*,F,F{k}," for k in (1, 2, 3)])
    result = CliRunner().invoke(main, ["fit", str(campaign), "-o", str(out), "--rule", "middle_share", "--json"])
    assert result.exit_code == 0, result.stderr
    (sliding,) = (f for f in json.loads(result.stdout)["fits"] if f["regime"] == "sliding")
    assert sliding["mu"] == pytest.approx(MU, rel=0.02)
    assert (out / "tests.csv").read_text().count("\nR1#1/") == 12


def test_tables_and_pulls_are_counted_as_the_reader_gives_them(tmp_path: Path) -> None:
    """A log whose time starts again has a table for each start, and first rows that tell them apart."""
    (tmp_path / "log.csv").write_text(umt_text(np.concatenate([strokes((1.0,), 2, 1.0, 0.0, seed=k) for k in (0, 1)])))
    tables = read_blocks(tmp_path / "log.csv")
    assert [t.first_row for t in tables] == [5, 5 + 8 * RATE_HZ]


def test_an_inspection_lists_the_pulls_as_tests_csv_names_them(tmp_path: Path) -> None:
    write_campaign(tmp_path, ["R1,raw/F1.csv#*,F,F1,"])
    result = CliRunner().invoke(main, ["inspect", str(tmp_path / "raw" / "F1.csv"), "--json"])
    (seen,) = json.loads(result.stdout)["files"]
    assert [line.partition(":")[0] for line in seen["pulls"]] == [f"#1/{k}" for k in range(1, 13)]
    under = [float(line.split("under ")[1].split(" N")[0]) for line in seen["pulls"]]
    assert under == pytest.approx(np.repeat((1.0, 2.0, 4.0), 4), rel=2e-3)
    words = CliRunner().invoke(main, ["inspect", str(tmp_path / "raw" / "F1.csv")]).stdout
    assert "pull      #1/12: 44" in words


@pytest.mark.parametrize("file", ["../F1.csv#*", "/F1.csv#1/2", "raw/../../F1.csv#2"])
def test_a_choice_does_not_lead_out_of_the_campaign(tmp_path: Path, file: str) -> None:
    campaign = write_campaign(tmp_path, [f"R1,{file},F,F1,1", "R2,raw/F2.csv#*,F,F2,"])
    (aside,) = campaign.set_aside
    assert [p.kind for p in aside.problems] == ["path_outside_campaign"]


def test_neither_an_approach_nor_a_load_that_is_not_held_exactly_makes_a_ladder(tmp_path: Path) -> None:
    """Before contact the cell shows a fifth of the small load; under load it creeps by a tenth."""
    campaign = write_campaign(tmp_path, ["R1,raw/F1.csv,F,F1,1"])
    time = np.arange(0, 80, 0.05)
    load = np.interp(time, [0, 15, 18, 40, 41, 60, 62, 80], [0.2, 0.2, 1.0, 1.0, 1.1, 1.1, 0.2, 0.2])
    force = np.where((time > 15) & (time < 60), MU * load, 0.0)
    scatter = 0.002 * np.random.default_rng(6).standard_normal((time.size, 2))
    (tmp_path / "raw" / "F1.csv").write_text(
        umt_text(np.column_stack([time, force, -load]) + np.pad(scatter, ((0, 0), (1, 0))))
    )
    assert list(stages.ingest(campaign).pulls) == ["R1"]
