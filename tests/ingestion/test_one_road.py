"""Whole records, chosen pulls, strokes and windows moved by hand walk one road: what is stated holds in each."""

from __future__ import annotations

import ast
import math
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.campaigns import written

import tribo
from tribo import stages
from tribo.campaign import load_campaign
from tribo.cli import main
from tribo.errors import CampaignError, TraceError
from tribo.ingestion.overrides import apply_overrides
from tribo.records import Ingested, Pull

PACKAGE = Path(tribo.__file__).parent
TOML = '[campaign]\ntitle = "one road"\nnominal_area_mm2 = 50.0\n{stated}\n[patterns.F]\ncavity = "none"\n'
OFFSET_N, LOAD_OFFSET_N, LOAD_N = 0.3, 0.5, 4.0
SAW = {"stiffness_N_per_m": 80.0, "speed_mm_s": 2.0}  # a stick is loaded by 0.16 N/s
CHOICES = ("", "#1/1", "#*")
ZEROS = {"none": 0.0, "0.1": 0.1, "[0.2, 1.8]": OFFSET_N, "before contact": OFFSET_N, "": OFFSET_N}


def noise(size: int, seed: int = 0) -> np.ndarray:
    return 0.005 * np.random.default_rng(seed).standard_normal(size)


def one_pull() -> np.ndarray:
    """Time, friction with an offset, and a load with an offset, of one pull from rest at 2 s to a peak at 3.5 s."""
    time = np.arange(700) / 50.0
    fall = 1.2 + 0.8 * np.exp(-np.maximum(time - 3.5, 0) / 0.15)
    force = np.where(time < 2, 0.0, np.where(time < 3.5, (time - 2) / 0.75, fall)) + OFFSET_N
    return np.column_stack([time, force + noise(700), LOAD_N + LOAD_OFFSET_N + noise(700, 1)])


def strokes(zero_N: float = 0.15) -> np.ndarray:
    """Six strokes of 4 s in turn forward and backward, sliding at 1 N with a static peak of 1.25 N."""
    one = np.arange(400) / 100.0
    after = 1 + 0.25 * np.exp(-np.maximum(one - 0.5, 0) / 0.1)
    stroke = np.where(one < 0.5, np.minimum(-1 + 2.25 * one / 0.5, 1.25), after)
    force = np.concatenate([(-1) ** k * stroke for k in range(6)]) + zero_N
    return np.column_stack([np.arange(force.size) / 100.0, force + noise(force.size), np.full(force.size, 4.5)])


def sawtooth(seconds: float = 60.0) -> np.ndarray:
    """Stick-slip of 1 N to 0.7 N every 2 s, loaded at 0.16 N/s."""
    time = np.arange(int(seconds * 250)) / 250
    phase = time % 2.0
    force = np.where(phase < 1.9, 0.7 + 0.3 * phase / 1.9, 1.0 - 3.0 * (phase - 1.9))
    return np.column_stack([time, force + noise(time.size) / 5, 2.0 + noise(time.size, 1)])


def with_a_stop() -> np.ndarray:
    """A start from rest at 2 s, a stop of the drive at 19 s that relaxes to nothing, a restart with a peak of 2.2 N."""
    first = np.concatenate([np.full(100, 0.4), np.linspace(0.4, 2.5, 50), np.full(800, 2.0)])
    again = np.concatenate([np.linspace(0, 2.2, 50), 2.0 * (1 + 0.1 * np.exp(-np.arange(800) / 30))])
    force = np.concatenate([first, np.linspace(2.0, 0, 10), np.zeros(120), again])
    return np.column_stack([np.arange(force.size) / 50.0, force + 2 * noise(force.size), np.full(force.size, 5.0)])


def ingested(folder: Path, record: np.ndarray, choices: dict[str, str], stated: str = "", **cells: object) -> Ingested:
    """A campaign of one export: a test for each choice of it, with what its row and campaign.toml state."""
    exports = {}
    rows = "\n".join("\t".join(f"{v:.6f}" for v in row) for row in record)
    columns = {"normal_load_N": "", **cells}
    lines = [",".join(["test_id", "file", "sample", *columns])]
    for k, (test_id, choice) in enumerate(choices.items()):
        exports[f"{k}.txt"] = f"Time [s]\tFriction [N]\tNormal force [N]\n{rows}\n"
        stated_cells = (f'"{v}"' if v != "" else "" for v in columns.values())
        lines.append(",".join([test_id, f"raw/{k}.txt{choice}", "F", *stated_cells]))
    return stages.ingest(load_campaign(written(folder, TOML.format(stated=stated), lines, exports)))


def by_choice(folder: Path, record: np.ndarray, stated: str = "", **cells: object) -> list[Pull]:
    """The pull of a record as a whole, chosen alone and chosen as one of all: each in a campaign of its own."""
    found = [ingested(folder / f"c{k}", record, {"T": choice}, stated, **cells) for k, choice in enumerate(CHOICES)]
    return [pull for campaign in found for pull in campaign.pulls.values()]


def same(one: Pull, other: Pull, but: tuple[str, ...] = ()) -> None:
    """Two pulls hold the same in every field but the named ones."""
    for field in fields(Pull):
        if field.name not in ("test_id", "problems", *but):
            a, b = getattr(one, field.name), getattr(other, field.name)
            assert a == b or repr(a) == repr(b), field.name


@pytest.mark.parametrize("by_row", [True, False])
@pytest.mark.parametrize("zero", ZEROS)
def test_a_zero_that_is_stated_holds_for_a_pull_that_is_chosen(tmp_path: Path, zero: str, by_row: bool) -> None:
    stated = "" if by_row or not zero else f"zero = {zero}" if zero[0] in "[0" else f'zero = "{zero}"'
    whole, one, every = by_choice(tmp_path, one_pull(), stated, zero=zero if by_row else "")
    assert whole.zero_N == pytest.approx(ZEROS[zero], abs=0.005)
    assert whole.static_N == pytest.approx(2.0 + OFFSET_N - ZEROS[zero], abs=0.03)
    same(whole, one)
    same(whole, every)


@pytest.mark.parametrize(("load_zero", "load_N"), [("", 4.5), ("0.5", 4.0), ("[0, 1]", 0.0)])
def test_a_zero_of_the_load_holds_for_a_pull_that_is_chosen(tmp_path: Path, load_zero: str, load_N: float) -> None:
    for pull in by_choice(tmp_path, one_pull(), load_zero=load_zero, normal_load_N=4.0):
        assert pull.recorded_load_N == pytest.approx(load_N, abs=0.01)


@pytest.mark.parametrize("choice", ["#*", "#1/2"])
@pytest.mark.parametrize(("zero", "expected"), [("", 0.15), ("none", 0.0), ("0.4", 0.4)])
def test_a_zero_that_is_stated_holds_for_strokes(tmp_path: Path, zero: str, expected: float, choice: str) -> None:
    found = ingested(tmp_path, strokes(), {"T": choice}, zero=zero)
    for test_id, pull in found.pulls.items():
        sign = -1.0 if choice == "#1/2" or int(test_id[-1]) % 2 == 0 else 1.0
        assert pull.zero_N == pytest.approx(sign * expected, abs=0.01)
        assert pull.sliding_N == pytest.approx(1.0 + sign * (0.15 - expected), abs=0.02)
        assert pull.static_N == pytest.approx(1.25 + sign * (0.15 - expected), abs=0.04)
        assert ("forward" if sign > 0 else "backward") in pull.flags


def test_the_zero_of_the_load_of_strokes_is_read_on_the_clock_of_their_record(tmp_path: Path) -> None:
    record = strokes()
    record[:, 2] = np.where(record[:, 0] < 12, 4.5, 4.6)
    found = ingested(tmp_path, record, {"T": "#1/6"}, load_zero="[1, 3]", normal_load_N=0.1)
    assert found.pulls["T"].recorded_load_N == pytest.approx(0.1, abs=1e-3)


def test_a_zero_at_rest_that_a_record_of_strokes_does_not_have_sets_them_aside(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="no rest"):
        ingested(tmp_path, strokes(), {"T": "#*"}, zero="at rest")


def test_a_load_that_the_record_of_a_chosen_pull_contradicts_is_doubted(tmp_path: Path) -> None:
    for pull in by_choice(tmp_path, one_pull(), normal_load_N=3.0):
        assert "off_load" in pull.flags
        assert [p.kind for p in pull.problems] == ["off_load"]


def test_a_zero_that_is_known_holds_for_every_stroke_in_the_sign_of_the_record(tmp_path: Path) -> None:
    ingested(tmp_path, strokes(), {"T": "#*"})
    forward, backward = (tribo.read_pull(f"{tmp_path}/raw/0.txt#1/{k}", zero=(0.15, 0.01)) for k in (3, 4))
    assert (forward.zero_N, backward.zero_N) == (0.15, -0.15)
    assert (forward.sliding_N, backward.sliding_N) == pytest.approx((1.0, 1.0), abs=0.02)


@pytest.mark.parametrize(("stiffness", "regime"), [(80.0, "stick-slip"), (400.0, "inertial oscillation")])
def test_a_stiffness_holds_for_a_pull_that_is_chosen(tmp_path: Path, stiffness: float, regime: str) -> None:
    for pull in by_choice(tmp_path, sawtooth(), **{**SAW, "stiffness_N_per_m": stiffness}):
        assert pull.oscillation is not None
        assert pull.oscillation.regime == regime


def moved(found: Ingested, folder: Path, test_id: str, cells: str) -> Pull:
    table = folder / "overrides.csv"
    table.write_text(f"test_id,action,reason,window_start_s,window_end_s,peak_s\n{test_id},move,x,{cells}\n")
    return apply_overrides(found, table, "first_peak").pulls[test_id]


@pytest.mark.parametrize("choice", ["", "#1/1"])
@pytest.mark.parametrize("zero", ["", "none", "0.1"])
def test_a_window_moved_by_hand_keeps_all_that_it_does_not_move(tmp_path: Path, zero: str, choice: str) -> None:
    found = ingested(tmp_path, with_a_stop(), {"T": choice}, zero=zero, **SAW)
    pull = found.pulls["T"]
    assert pull.restarts
    assert pull.oscillation is not None
    again = moved(found, tmp_path, "T", f"{pull.window_s[0]},{pull.window_s[1]},")
    assert "window_by_hand" in again.flags
    same(pull, again, but=("flags",))
    other = moved(found, tmp_path, "T", "10,15,")
    assert other.window_s == pytest.approx((10, 15), abs=0.03)
    assert other.recorded_load_N == pytest.approx(5.0)
    changes = ("flags", "window_s", "sliding_N", "sliding_u_N", "noise_N", "drift_N_per_s", "oscillation", "phases")
    same(pull, other, (*changes, "recorded_load_u_N"))
    assert [phase.name for phase in other.phases] == [phase.name for phase in pull.phases]


def test_a_window_of_a_stroke_moved_by_hand_keeps_the_zero_of_the_strokes(tmp_path: Path) -> None:
    found = ingested(tmp_path, strokes(), {"T": "#*"})
    pull = found.pulls["T#1/2"]
    again = moved(found, tmp_path, "T#1/2", "6,7,")
    assert (again.static_N, again.zero_N, again.zero_rule) == (pull.static_N, pull.zero_N, pull.zero_rule)
    assert again.sliding_N == pytest.approx(1.0, abs=0.01)
    assert {"backward", "window_by_hand"} <= set(again.flags)


def test_a_window_of_a_record_that_slides_from_its_first_sample_is_moved_as_well(tmp_path: Path) -> None:
    found = ingested(tmp_path, sawtooth(), {"T": ""}, **SAW)
    again = moved(found, tmp_path, "T", "20,40,")
    assert math.isnan(again.static_N)
    assert again.sliding_N == pytest.approx(0.84, abs=0.02)
    assert again.oscillation is not None
    assert again.oscillation.regime == "stick-slip"


def test_a_window_after_a_stop_is_read_above_the_same_zero(tmp_path: Path) -> None:
    found = ingested(tmp_path, with_a_stop(), {"T": ""}, zero="none")
    pull = found.pulls["T"]
    again = moved(found, tmp_path, "T", "30,35,")
    assert again.sliding_N == pytest.approx(2.0, abs=0.02)
    assert len(again.restarts) == len(pull.restarts) == 1


def test_a_force_evaluated_elsewhere_has_nothing_to_move_and_can_be_excluded(tmp_path: Path) -> None:
    rows = "".join(f"T{k},F,10,3,2\n" for k in range(3))
    (tmp_path / "campaign.toml").write_text(TOML.format(stated=""))
    (tmp_path / "tests.csv").write_text(f"test_id,sample,normal_load_N,static_N,sliding_N\n{rows}")
    found = stages.ingest(load_campaign(tmp_path))
    with pytest.raises(CampaignError, match="evaluated elsewhere"):
        moved(found, tmp_path, "T1", "1,2,")
    (tmp_path / "overrides.csv").write_text("test_id,action,reason\nT1,exclude,why\n")
    left = apply_overrides(found, tmp_path / "overrides.csv", "first_peak")
    assert list(left.pulls) == ["T0", "T2"]


def test_read_pull_gives_what_a_campaign_gives(tmp_path: Path) -> None:
    found = ingested(tmp_path, with_a_stop(), {"T": ""})
    test = found.campaign.tests[0]
    same(tribo.read_pull(found.traces["T"], test=test), found.pulls["T"])
    file = tmp_path / "raw" / "0.txt"
    for path in (file, str(file), f"{file}#1/1"):
        same(tribo.read_pull(path), found.pulls["T"])
    ingested(tmp_path / "strokes", strokes(), {"T": "#*"})
    with pytest.raises(TraceError, match="several"):
        tribo.read_pull(f"{tmp_path}/strokes/raw/0.txt#*")


def test_a_pull_is_made_in_one_module_only() -> None:
    makers = set()
    for module in PACKAGE.rglob("*.py"):
        calls = [n for n in ast.walk(ast.parse(module.read_text("utf-8"))) if isinstance(n, ast.Call)]
        if any(isinstance(n.func, ast.Name) and n.func.id == "Pull" for n in calls):
            makers.add(module.relative_to(PACKAGE).as_posix())
        replaced = [n.args[0] for n in calls if isinstance(n.func, ast.Name) and n.func.id == "replace" and n.args]
        if any(isinstance(first, ast.Name) and first.id == "pull" for first in replaced):
            makers.add(module.relative_to(PACKAGE).as_posix())
    assert makers == {"traces/evaluation.py"}


@pytest.mark.slow
def test_the_old_name_of_a_rule_is_taken_and_the_new_one_said_once(tmp_path: Path) -> None:
    found = ingested(tmp_path / "c", strokes(), {"T1": "#*"}, normal_load_N=4.5)
    with pytest.warns(FutureWarning, match="now called first_peak") as said:
        again = stages.ingest(found.campaign, rule="seed")
    assert len(said) == 1
    assert {pull.rule for pull in again.pulls.values()} == {"first_peak"}
    result = CliRunner().invoke(main, ["ingest", str(tmp_path / "c"), "-o", str(tmp_path / "o"), "--rule", "seed"])
    assert result.exit_code == 0
    assert result.stderr.count("--rule seed is now called first_peak") == 1
    assert "seed" not in (tmp_path / "o" / "tests.csv").read_text()
