"""tribo design: answers that can be made, the same again from kept runs, and refusals with the nearest."""

from __future__ import annotations

import csv
import io
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.image import imread

from tribo.campaign.description import PatternTable
from tribo.campaign.geometry import Making, faults_of_making
from tribo.cli import main
from tribo.design import answer_files, rounds
from tribo.design.answer_files import polygons_um, repeat_um
from tribo.design.rounds import Aim, Rounds, Tried, fitted, in_whole_periods, on_mesh
from tribo.design.target import Family, Space, Target, Want, read_target
from tribo.errors import SimulationError
from tribo.records import Pattern
from tribo.springblock import SimConfig
from tribo.springblock.lattice import touching_share
from tribo.units import CAMPAIGN_COLUMNS

TARGET = """
title = "Less static friction"
nominal_area_mm2 = 50
designs = 2
[[target]]
friction = "static"
pressure_kPa = 10
value = {value}
tolerance_percent = 8
[[pattern]]
cavity = "circle"
lattice = "hexagonal"
diameter_um = [6, 24]
pitch_um = [12, 40]
smallest_wall_um = 3
smallest_feature_um = 4
"""


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search of few runs of few blocks."""
    for name, value in {"FIRST": 8, "ROUNDS": 1, "BATCH": 3, "FINAL": 4, "FINE_RUNS": 2}.items():
        monkeypatch.setattr(rounds, name, value)
    meshes = {"coarse": (16, 5e-6, 1e-7), "fine": (20, 4e-6, 1e-7)}
    meshes |= {"patch": (14, 4e-6, 1e-7), "halved": (28, 2e-6, 5e-8)}
    monkeypatch.setattr(rounds, "MESHES", meshes)
    monkeypatch.setattr(answer_files, "PNG_PIXELS", 100)


def designed(folder: Path, out: str = "out", value: float = 5.0, **more: str) -> tuple[int, dict]:
    (folder / "t.toml").write_text(TARGET.format(value=value) + "".join(more.values()))
    ran = CliRunner().invoke(main, ["design", str(folder / "t.toml"), "-o", str(folder / out), "--json", "--jobs", "1"])
    return ran.exit_code, json.loads(ran.stdout)


@pytest.mark.usefixtures("small")
def test_designs_meet_the_target_can_be_made_and_come_with_their_campaign(tmp_path: Path):
    """Ranked and distinct, intervals around the prediction, masks, a campaign of known columns and its pattern."""
    status, found = designed(tmp_path)
    assert status == 0
    answers = found["answers"]
    assert [a["rank"] for a in answers][:1] == [1]
    assert len({tuple(a["lengths_um"].values()) for a in answers}) == len(answers) == 2
    first = answers[0]["predictions"][0]
    assert first["met"]
    assert abs(first["value"] / 5.0 - 1) <= 0.08
    assert first["low"] < first["value"] < first["high"]
    assert set(first["parts"]) == {"runs", "mesh", "model", "making"}
    assert len({a["predictions"][0]["parts"]["runs"] for a in answers}) == 1  # the scatter of runs, of all fine designs
    folder = tmp_path / "out" / "design-1"
    assert {p.name for p in folder.iterdir()} >= {"mask.svg", "mask.png", "campaign"}
    rows = list(csv.DictReader((folder / "campaign" / "tests.csv").read_text().splitlines()))
    assert set(rows[0]) <= set(CAMPAIGN_COLUMNS)
    assert {row["sample"] for row in rows} == {"F", "P"}
    import tomllib

    described = tomllib.loads((folder / "campaign" / "campaign.toml").read_text())["patterns"]["P"]
    pattern = PatternTable.model_validate(described).pattern("P")
    assert pattern.area_fraction == pytest.approx(answers[0]["area_fraction"])
    assert not list(faults_of_making(pattern, Making(4e-6, 3e-6, 0.5e-6)))


RECTANGLES = Family(cavity="rectangle", size_x_um=[20, 60], size_y_um=[8, 20], pitch_x_um=[70, 90], pitch_y_um=[30, 40])
SQUARES = Family(cavity="square", size_x_um=[6, 24], pitch_um=[30, 40])


@pytest.mark.parametrize(
    ("family", "first", "designs_of_rounds", "mesh"), [(SQUARES, 14, 15, "coarse"), (RECTANGLES, 102, 48, "fine")]
)
def test_the_more_lengths_are_free_the_more_designs_are_run_and_the_finer(
    family: Family, first: int, designs_of_rounds: int, mesh: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made: list[tuple[str, int, float]] = []
    wanted, rng = ("static", 1e4, "all"), np.random.default_rng(1)

    def run(_: object, name: str, chosen: list[tuple[int, dict]], base: SimConfig, *given: object) -> list[Tried]:
        made.append((name, len(chosen), base.spacing_m))
        return [Tried(*design, {wanted: float(rng.normal())}, {wanted: 0.01}) for design in chosen]

    monkeypatch.setattr(rounds, "tried", run)
    target = Target(target=[Want(friction="static", pressure_kPa=10, best="smallest")], pattern=[family])
    spaces = [Space(family, 0)]
    aim = Aim(target, spaces, lambda _, lengths: {wanted: (np.zeros(len(lengths)), np.zeros(len(lengths)))})
    rounds.search(Rounds(spaces, [wanted], tmp_path, 1, 1), aim, SimConfig(cavity_shape="exact"), lambda *said: None)
    spacing = rounds.MESHES[mesh][1]
    assert made[0] == ("first", first, spacing)
    in_rounds = [each for each in made if each[0].startswith("round")]
    assert {spaced for _, _, spaced in in_rounds} == {spacing}
    assert sum(number for _, number, _ in in_rounds) == designs_of_rounds


def test_designs_beside_another_one_are_near_it_in_every_length_and_can_be_made() -> None:
    space = Space(RECTANGLES, 0)
    middle = {"size_x_um": 58.0, "size_y_um": 12.0, "pitch_x_um": 80.0, "pitch_y_um": 35.0}
    near = space.candidates_near(middle, 40, 1)
    assert len(near) > 10
    for name, (low, high) in space.free.items():
        off = [abs(lengths[name] - middle[name]) for lengths in near]
        assert max(off) <= 0.1 * (high - low) + 0.25  # half a step of the mask
    assert not any(space.fault(lengths) for lengths in near)


@pytest.mark.parametrize("cavity", ["square", "circle", "ridge"])
def test_the_patch_that_is_simulated_has_the_area_fraction_of_the_sample(cavity: str):
    """As nearly as whole blocks allow; a patch of all blocks is off by up to 17 %."""
    lengths = {"diameter_um": [6, 24]} if cavity == "circle" else {"size_x_um": [6, 24]}
    space = Space(Family(cavity=cavity, pitch_um=[14, 40], smallest_wall_um=3, **lengths), 0)
    base = on_mesh(SimConfig(cavity_shape="exact"), "halved")
    for candidate in space.candidates(64, 1):
        pattern = space.pattern(candidate)
        share = touching_share(pattern, in_whole_periods(pattern, base), base.spacing_m)
        assert share.mean() == pytest.approx(pattern.area_fraction, rel=0.03)


def test_without_a_pattern_the_patch_is_all_blocks():
    base = SimConfig()
    assert in_whole_periods(Pattern("F"), base) == base.blocks


def test_every_candidate_can_be_simulated():
    """Rows of staggered cavities may lie between each other; the model has no such patterns."""
    family = Family(
        cavity="rectangle", lattice="staggered", size_x_um=[20, 120], size_y_um=[8, 40], pitch_x_um=[40, 160],
        pitch_y_um=[20, 80], smallest_wall_um=4,
    )  # fmt: skip
    space = Space(family, 0)
    for lengths in space.candidates(200, 1):
        SimConfig(sample="P", pattern=space.pattern(lengths), cavity_shape="exact").check()
    assert "25 um wide and 24.5 um apart along y" in space.fault(
        {"size_x_um": 20.0, "size_y_um": 25.0, "pitch_x_um": 80.0, "pitch_y_um": 24.5}
    )


@pytest.mark.parametrize("feature", ["hole", "pillar"])
@pytest.mark.parametrize("cavity", ["circle", "rectangle", "ridge", "chevron"])
def test_the_picture_of_a_mask_has_the_area_fraction_of_its_pattern(cavity: str, feature: str):
    pattern = Pattern("P", cavity, (12e-6, 9e-6), (40e-6, 25e-6), True, None, feature)
    white = imread(io.BytesIO(answer_files.png(pattern)), format="png")[..., 0]
    assert white.mean() == pytest.approx(pattern.area_fraction, abs=2e-3)


@pytest.mark.slow
@pytest.mark.usefixtures("small")
def test_a_search_that_was_stopped_ends_with_the_same_answer(tmp_path: Path):
    """To the bit, from the kept runs of its first half; and from none of them."""
    designed(tmp_path, "whole")
    shutil.copytree(tmp_path / "whole" / "kept", tmp_path / "half" / "kept")
    for name in ("fine-1.h5", "fine-2.h5", "mesh-1.h5"):
        (tmp_path / "half" / "kept" / name).unlink()
    designed(tmp_path, "half")
    one, other = ((tmp_path / name / "answer.json").read_bytes() for name in ("whole", "half"))
    assert one == other


@pytest.mark.slow
@pytest.mark.usefixtures("small")
def test_what_cannot_be_had_is_refused_with_the_nearest_and_the_limit(tmp_path: Path):
    """More static friction than the flat sample has: the status is 1, and a design is named all the same."""
    status, found = designed(tmp_path, value=15.0)
    assert status == 1
    assert "wanted 15" in found["refusal"][0]
    assert "reach" in found["refusal"][0]
    assert any("bound" in line or "smallest" in line for line in found["refusal"])
    assert found["answers"][0]["predictions"][0]["off_percent"] > 20


@pytest.mark.parametrize("need", ["a lubricant film", "wetting", "pillar height", "suction"])
def test_what_the_model_does_not_contain_is_said_first(tmp_path: Path, need: str):
    """Before any run."""
    (tmp_path / "t.toml").write_text(f'needs = ["{need}"]\n' + TARGET.format(value=5.0))
    with pytest.raises(SimulationError, match="the model does not contain"):
        read_target(tmp_path / "t.toml")


def test_faults_of_a_target_are_listed_at_once(tmp_path: Path):
    """A goal too many, an unknown key, lengths that a family does not have."""
    goals = '[[target]]\nfriction = "static"\nbest = "largest"\nvalue = 3\n'
    text = TARGET.format(value=5.0) + "size_x_um = 4\n" + goals
    (tmp_path / "t.toml").write_text(text + "[material]\ncolour = 3\n")
    with pytest.raises(SimulationError) as refused:
        read_target(tmp_path / "t.toml")
    assert len(refused.value.problems) == 3


def test_bounds_within_which_nothing_can_be_made_are_refused(tmp_path: Path):
    """Every cavity touches the next one."""
    text = TARGET.format(value=5.0).replace("[6, 24]", "[30, 40]").replace("[12, 40]", "[12, 29]")
    (tmp_path / "t.toml").write_text(text)
    ran = CliRunner().invoke(main, ["design", str(tmp_path / "t.toml"), "-o", str(tmp_path / "out")])
    assert ran.exit_code == 1
    assert "touches the next one" in ran.output


FAMILIES = (
    Family(cavity="circle", lattice="hexagonal", diameter_um=14, pitch_um=20),
    Family(cavity="ellipse", lattice="staggered", size_x_um=20, size_y_um=9, pitch_x_um=40, pitch_y_um=15),
    Family(cavity="rectangle", size_x_um=20, size_y_um=9, pitch_x_um=40, pitch_y_um=15, feature="pillar"),
    Family(cavity="ridge", size_x_um=8, pitch_um=20),
    Family(cavity="chevron", size_x_um=8, size_y_um=10, pitch_x_um=20, pitch_y_um=40),
)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda f: f.cavity)
def test_polygons_of_a_mask_have_the_area_of_the_pattern(family: Family):
    """To 0.1 %."""
    space = Space(family, 0)
    pattern = space.pattern(space.lengths_um(np.zeros(0)))
    shapes = [p.T for p in polygons_um(pattern)]
    area = sum(0.5 * abs(float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())) for x, y in shapes)
    width, height = repeat_um(pattern)
    covered = area / (width * height)
    expected = pattern.area_fraction if family.feature == "pillar" else 1 - pattern.area_fraction
    assert covered == pytest.approx(expected, rel=1e-3)


def test_a_surrogate_predicts_points_left_out():
    """A smooth function of two lengths, to 5 % of its range from 20 points; its own estimate agrees."""
    x = np.random.default_rng(0).random((40, 3))
    y = np.sin(2 * x[:, 0]) + 0.5 * x[:, 1] ** 2 + x[:, 2]
    found = fitted(x[:20], y[:20], 1e-3)
    error = float(np.sqrt(np.mean((found(x[20:]) - y[20:]) ** 2)))
    assert error < 0.05 * np.ptp(y)
    assert error < 4 * found.left_out + 1e-3
