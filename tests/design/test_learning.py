"""What campaigns on earlier designs say of the model, and what it changes in the next search."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tribo.campaign import load_campaign
from tribo.cli import main
from tribo.design import rounds
from tribo.design.answer import REACHES, Answer, Learnt, Lesson, Prediction, measured_of, model_errors
from tribo.design.answer_files import campaign_of
from tribo.design.rounds import Aim, cost_once_measured
from tribo.design.target import Family, Space, Target, Want
from tribo.stages import study

CIRCLES = Family(cavity="circle", lattice="hexagonal", diameter_um=[6, 24], pitch_um=[12, 40], smallest_wall_um=3)
RIDGES = Family(cavity="ridge", size_x_um=[6, 24], pitch_um=[14, 50])
TARGET = Target(target=[Want(friction="static", pressure_kPa=10, value=5.0)], pattern=[CIRCLES, RIDGES])
STATIC = ("static", 1e4, "all")
SPACES = [Space(family, k) for k, family in enumerate(TARGET.pattern)]
FIRST = {"diameter_um": 12.0, "pitch_um": 20.0}
NEAR, FAR = {"diameter_um": 12.5, "pitch_um": 20.5}, {"diameter_um": 6.0, "pitch_um": 40.0}


def lesson(lengths: dict[str, float], percent: float, u_percent: float = 3.0) -> Lesson:
    measured = 5.0 * (1 + percent / 100)
    pattern = SPACES[0].pattern(lengths)
    return Lesson("first", "P", pattern, "static", 10.0, "all", measured, 5.0, percent, u_percent)


def learnt(*lessons: Lesson) -> Learnt:
    return Learnt.of(lessons, model_errors(TARGET, None), TARGET, SPACES)


def test_a_measured_pattern_corrects_its_neighbours_most_and_other_families_least():
    """The mean moves towards the measured ratio and its deviation falls, in this order."""
    found = learnt(lesson(FIRST, -25.0))
    means, sds = found.missed(0, [FIRST, NEAR, FAR])[STATIC]
    other, other_sd = (v[0] for v in found.missed(1, [{"size_x_um": 12.0, "pitch_um": 20.0}])[STATIC])
    assert means[0] == pytest.approx(math.log(0.75), rel=0.02)
    assert means[0] < means[1] < means[2] < 0
    assert means[2] <= other < 0
    assert sds[0] < sds[1] < sds[2]
    assert sds[1] < other_sd < found.prior["static"][1]


def test_what_a_campaign_leaves_of_the_error_at_its_pattern_is_its_own_uncertainty():
    """As the standard deviation of ln, to 10 %; a pressure or a regime that was not measured keeps all of it."""
    found = learnt(lesson(FIRST, 20.0, 4.0))
    (sd,) = found.missed(0, [FIRST])[STATIC][1]
    assert sd == pytest.approx(0.04 / 1.2, rel=0.1)
    wants = [Want(friction="sliding", pressure_kPa=10, value=4.0)]
    sliding = Target(target=wants, pattern=TARGET.pattern)
    prior = model_errors(sliding, None)
    none = Learnt.of([lesson(FIRST, 20.0)], prior, sliding, SPACES).missed(0, [FIRST])
    assert [v[0] for v in none[("sliding", 1e4, "all")]] == list(prior["sliding"])


def test_alike_ratios_of_unlike_patterns_let_a_correction_reach_further():
    """The mean ln of the reach is larger than where one of two patterns is off the other way."""
    away = {"diameter_um": 20.0, "pitch_um": 26.0}
    alike, unlike = (
        float((learnt(lesson(FIRST, 60.0), lesson(away, other)).weights * np.log(REACHES)).sum())
        for other in (60.0, -40.0)
    )
    assert alike > unlike + 0.1


def test_a_model_error_below_what_was_measured_is_widened_to_it():
    """A stated error of nothing would learn nothing."""
    target = TARGET.model_copy(update={"material": TARGET.material.model_copy(update={"model_error_percent": 0.0})})
    found = Learnt.of([lesson(FIRST, -25.0)], model_errors(target, None), target, SPACES)
    assert found.prior["static"] == (0.0, pytest.approx(-math.log(0.75)))
    assert found.missed(0, [FIRST])[STATIC][0][0] == pytest.approx(math.log(0.75), rel=0.05)


def test_once_something_was_measured_doubt_decides_among_designs_that_are_predicted_to_meet():
    """Within a quarter of the tolerance of 5 %; half of it off counts more than any doubt."""
    logs, sds = {STATIC: np.log([5.0, 5.05, 5.12])}, {STATIC: np.array([0.2, 0.1, 0.01])}
    sure, unsure, off = (1, 0, 2)
    assert list(np.argsort(cost_once_measured(TARGET, logs, sds))) == [sure, unsure, off]


def test_where_no_design_is_predicted_close_the_one_that_the_model_knows_least_of_comes_first():
    """A design that is sure to miss by 20 % has no chance; one that is predicted 24 % off, give or take 30 %, has."""
    logs, sds = {STATIC: np.log([6.0, 6.2])}, {STATIC: np.array([0.03, 0.3])}
    sure, unsure = cost_once_measured(TARGET, logs, sds)
    assert unsure < sure


def test_most_of_a_correction_is_carried_through_its_family():
    """To lengths half and twice as large; to another family less."""
    found = learnt(lesson(FIRST, -25.0))
    (far,) = found.missed(0, [FAR])[STATIC][0]
    (other,) = found.missed(1, [{"size_x_um": 12.0, "pitch_um": 20.0}])[STATIC][0]
    assert far < 0.85 * math.log(0.75)
    assert far < 1.2 * other


def test_the_patterns_of_the_paper_widen_the_doubt_and_leave_the_correction():
    """They differ more from each other than one measured pattern can show."""
    found = learnt(lesson(FIRST, -25.0))
    alone = replace(found, weights_of_paper=found.weights)
    (mean,), (sd,) = found.missed(0, [FAR])[STATIC]
    (mean_alone,), (sd_alone,) = alone.missed(0, [FAR])[STATIC]
    assert mean == mean_alone
    assert sd > 1.1 * sd_alone


def test_of_designs_that_are_predicted_alike_the_one_near_the_measured_is_chosen():
    """The correction is taken off first, so that both are predicted at the target."""
    found = learnt(lesson(FIRST, -25.0))
    aim = Aim(TARGET, SPACES, found.missed, measured=True)
    mean = found.missed(0, [NEAR, FAR])[STATIC][0]
    near, far = aim.costs(0, [NEAR, FAR], {STATIC: math.log(5.0) - mean})
    assert near < far


def test_the_search_aims_with_the_mean_correction_of_a_report():
    """A design that the model predicts 20 % too low costs nothing where reports say that it is 20 % too low."""
    aim = Aim(TARGET, SPACES, lambda _, lengths: {STATIC: (np.full(len(lengths), math.log(1.2)), np.zeros(1))})
    logs = {STATIC: np.array([math.log(5.0 / 1.2), math.log(5.0)])}
    costs = aim.costs(0, [FIRST, FIRST], logs)
    assert costs[0] == pytest.approx(0.0, abs=1e-12)
    assert costs[1] > 1


def measured_campaign(folder: Path, ratio: float = 1.0) -> Path:
    """The campaign that a design comes with, its forces evaluated elsewhere: T = ratio (3 N + 10 kPa A) of P."""
    predictions = [Prediction("static friction at 10 kPa", 5.0, 4.0, 6.0, "5", True, 0.0, {})]
    tables = campaign_of(Answer(1, 0, FIRST, 0.6, predictions, "", True), SPACES[0], TARGET)
    rows = list(csv.DictReader(io.StringIO(tables["tests.csv"])))
    for k, row in enumerate(rows):
        load, off = float(row["normal_load_N"]), 1 + 0.02 * math.sin(k)
        static = (ratio if row["sample"] == "P" else 1.6) * (3 * load + 1.0) * off
        row |= {"file": "", "static_N": f"{static:.6g}", "sliding_N": f"{0.8 * static:.6g}"}
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(tables["campaign.toml"])
    with (folder / "tests.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    return folder


def test_the_campaign_that_a_design_comes_with_is_given_back_once_measured(tmp_path: Path):
    """Its pattern, its direction and its laws at the wanted pressure; the flat sample beside it."""
    found = study(load_campaign(measured_campaign(tmp_path / "c")), until="fit")
    flat, patterned = measured_of(found.ingested.campaign, found.fits, "first")
    assert flat.pattern.is_flat
    assert (patterned.sample, patterned.direction) == ("P", "all")
    asked = SPACES[0].pattern(FIRST)
    assert patterned.pattern.size_m == pytest.approx(asked.size_m)
    assert patterned.pattern.pitch_m == pytest.approx(asked.pitch_m)
    own = next(f for f in patterned.fits if f.regime == "static")
    assert float(own.force_N(1.0)) == pytest.approx(4.0, rel=0.02)


def test_results_are_not_written_where_a_measured_campaign_lies(tmp_path: Path):
    """The folder of the first design holds the campaign that it came with."""
    measured_campaign(tmp_path / "first" / "design-1" / "campaign")
    text = '[[target]]\nfriction = "static"\npressure_kPa = 10\nvalue = 5\n[[pattern]]\ncavity = "ridge"\n'
    (tmp_path / "t.toml").write_text(text + "size_x_um = [6, 24]\npitch_um = [14, 50]\n")
    given = ["design", str(tmp_path / "t.toml"), "-o", str(tmp_path / "first")]
    ran = CliRunner().invoke(main, [*given, "--measured", str(tmp_path / "first" / "design-1" / "campaign")])
    assert ran.exit_code == 1
    assert "must not be written here" in ran.output


@pytest.mark.slow
def test_the_next_design_is_moved_by_what_was_measured_of_the_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The prediction near the measured pattern is its measured friction, and the answer says what was learnt."""
    for name, value in {"FIRST": 6, "ROUNDS": 1, "BATCH": 2, "FINAL": 2, "FINE_RUNS": 2}.items():
        monkeypatch.setattr(rounds, name, value)
    meshes = {"coarse": (16, 5e-6, 1e-7), "fine": (20, 4e-6, 1e-7)}
    monkeypatch.setattr(rounds, "MESHES", meshes | {"patch": (14, 4e-6, 1e-7), "halved": (28, 2e-6, 5e-8)})
    campaign = measured_campaign(tmp_path / "first", 0.8)
    (tmp_path / "t.toml").write_text(
        '[[target]]\nfriction = "static"\npressure_kPa = 10\nvalue = 3.2\ntolerance_percent = 8\n[[pattern]]\n'
        'cavity = "circle"\nlattice = "hexagonal"\ndiameter_um = [11, 13]\npitch_um = [19, 21]\nsmallest_wall_um = 3\n'
    )
    given = ["design", str(tmp_path / "t.toml"), "-o", str(tmp_path / "second"), "--json", "--jobs", "1"]
    found = json.loads(CliRunner().invoke(main, [*given, "--measured", str(campaign)]).stdout)
    patterned = [x for x in found["lessons"] if x["sample"] == "P"]
    assert [x["measured"] for x in patterned] == pytest.approx([3.2], rel=0.03)
    best = found["answers"][0]["predictions"][0]
    assert best["value"] == pytest.approx(3.2, rel=0.08)
    assert best["parts"]["model"] < 0.2 < found["model_error"]["static"][1]
    assert any("meets the target" in line for line in found["learnt"])
    assert "What earlier designs taught" in (tmp_path / "second" / "design.html").read_text()
