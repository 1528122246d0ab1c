"""Laws and machines read from virtual records of known answer, and what a record cannot tell."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import on_the_command_line
import pytest
from support.virtual_slips import ladder, slips, strokes, velocity_step

from tribo import tracelaws
from tribo.slider import SliderConfig, constant_speed, recorded_displacement, simulate_slider, speed_steps
from tribo.slider.rate_and_state import WEIGHTS, integrated
from tribo.tracelaws import (
    SLIP_LAWS,
    SPEED_LAWS,
    chosen_step_laws,
    clearly_better,
    driven_force,
    fit_driven,
    fit_rests,
    fit_slips,
    fit_speeds,
    fit_steps,
    slip_force,
    unbeaten,
    white_likelihood,
    whitening,
)

COULOMB = {"mass_kg": 0.03, "stiffness": 170.0, "damping": 0.3, "load_N": 0.3, "speed_m_s": 1e-3, "mu_s": 0.36,
           "mu_d": 0.30, "scatter": 0.004, "duration_s": 12.0, "noise_N": 3e-4}  # fmt: skip
TRUTH = {"mu_s": 0.36, "mu_d": 0.30, "stiffness_N_per_m": 170.0, "mass_kg": 0.03, "damping_N_s_per_m": 0.3}
STEP = {"ageing": True, "a": 0.008, "b": 0.011, "Dc_m": 12e-6, "stiffness_per_m": 2e3, "mu0": 0.6,
        "speeds_m_s": (1e-6, 1e-5), "step_s": 60.0, "duration_s": 110.0, "rate_Hz": 5.0, "noise": 3e-4,
        "drift_per_m": 2.0}  # fmt: skip
DRIVE = speed_steps([0.0, 60.0], [1e-6, 1e-5])


def record(seed: int, rate_Hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Stick-slip after its first loading."""
    time, force = slips(np.random.default_rng(seed), rate_Hz=rate_Hz, **COULOMB)
    first = int(np.argmax(force > 0.3 * 0.3))
    return time[first:], force[first:]


def test_the_closed_form_of_a_slip_is_that_of_the_simulated_slider():
    run = simulate_slider(
        SliderConfig(0.03, 170.0, 0.3, 0.3, values={"mu_s": 0.36, "mu_d": 0.3}, drive=constant_speed(1e-3),
                     duration_s=1.2, rate_Hz=5000.0)
    )  # fmt: skip
    gamma = 0.3 / 0.06
    omega = math.sqrt(170.0 / 0.03 - gamma**2)
    inside = (run.time_s > 0.5) & (run.time_s < run.starts_s[1])
    expected = slip_force(run.time_s[inside], run.starts_s[0], 0.108, 0.09, omega, gamma, 0.17)
    np.testing.assert_allclose(run.force_N[inside], expected, rtol=0, atol=1e-5 * 0.108)


def test_coulomb_friction_and_the_machine_are_recovered_from_slips():
    (found,) = fit_slips(*record(3, 1000.0), ["coulomb"], 0.3, 1e-3)
    for name, truth in TRUTH.items():
        p = found[name]
        assert p.told
        if name != "damping_N_s_per_m":  # so few slips hold it to a third only
            assert p.value == pytest.approx(truth, rel=0.01)
            assert p.high - p.low < 0.05 * truth
        half = 0.5 * (p.high - p.low)
        assert abs(p.value - truth) < 2.0 * half  # four standard errors


def test_a_slow_recorder_tells_no_mass_and_bounds_sliding_friction():
    (found,) = fit_slips(*record(3, 60.0), ["coulomb"], 0.3, 1e-3)
    assert not found["mass_kg"].told
    assert not found["damping_N_s_per_m"].told
    assert not found["mu_d"].told
    assert found["mu_d"].low < 0.30 < found["mu_d"].high
    assert found["stiffness_N_per_m"].value == pytest.approx(170.0, rel=0.02)


@pytest.mark.slow
def test_growth_at_rest_is_not_told_by_slips_of_equal_hold_and_coulomb_is_not_beaten():
    time, force = record(5, 1000.0)
    coulomb, ageing = fit_slips(time, force, ["coulomb", "ageing"], 0.3, 1e-3)
    assert ageing["b"].low < 0.0 < ageing["b"].high
    assert not clearly_better(ageing, coulomb)


def test_steady_sliding_has_no_slips():
    rng = np.random.default_rng(0)
    time = np.arange(5000) / 1000.0
    assert fit_slips(time, 0.3 + 1e-3 * rng.standard_normal(5000), ["coulomb"], 1.0, 1e-3) == []


def test_rate_and_state_is_recovered_from_a_step_of_speed_and_the_other_law_is_refused():
    time, mu = velocity_step(np.random.default_rng(1), **STEP)
    made = fit_steps(time, mu, ("dieterich", "ruina"), DRIVE)
    assert [law.law for law in chosen_step_laws(made)] == ["dieterich"]
    for name, truth in (("a", 0.008), ("b", 0.011), ("a_minus_b", -0.003), ("Dc_m", 12e-6), ("stiffness_per_m", 2e3)):
        p = made[0][name]
        assert p.told
        assert p.value == pytest.approx(truth, rel=0.06)
        assert p.low - 0.5 * (p.high - p.low) < truth < p.high + 0.5 * (p.high - p.low)


def test_the_stiffness_of_a_machine_that_is_rigid_to_the_record_is_not_told_and_the_law_is():
    time, mu = velocity_step(np.random.default_rng(0), **{**STEP, "stiffness_per_m": 1e7})
    (found,) = fit_steps(time, mu, ["dieterich"], DRIVE)
    assert not found["stiffness_per_m"].told
    for name, truth in (("a", 0.008), ("b", 0.011), ("Dc_m", 12e-6)):
        assert found[name].told
        assert found[name].value == pytest.approx(truth, rel=0.06)


def test_a_slip_shorter_than_a_record_shows_is_given_up_before_it_takes_minutes():
    law = np.array([0.6, 1e-6, 4e-6, 400.0])  # mu0, first speed, a and stiffness over load
    drive = np.array([0.0, 80.0]), np.array([1e-6, 1e-5])
    times, out = np.arange(1800) / 10.0, np.empty((2, 1800))
    given = np.array([0.6, 0.0]), times, *drive, law, np.array([-8e-4]), np.array([1e-9]), False, 1e-9
    assert not integrated(*given, 180_000, WEIGHTS, out)


def test_whitened_noise_has_no_memory():
    rng = np.random.default_rng(7)
    r = np.zeros(20000)
    for i in range(1, r.size):
        r[i] = 0.7 * r[i - 1] + rng.standard_normal()
    white = whitening(r)(r)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.02
    assert white.std() == pytest.approx(1.0, rel=0.02)


def test_the_command_writes_the_laws_of_a_record_with_stick_slip(tmp_path: Path):
    time, force = slips(np.random.default_rng(11), rate_Hz=500.0, **COULOMB)
    folder = tmp_path / "c"
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.toml").write_text(
        '[campaign]\ntitle = "t"\nnominal_area_mm2 = 100\npull_speed_mm_s = 1.0\n[patterns.F]\ncavity = "none"\n'
    )
    (folder / "tests.csv").write_text("test_id,file,sample,normal_load_N,specimen\nT1,raw/a.csv,F,0.3,F1\n")
    rows = [f"{t:.4f},{f:.7f},{t:.4f}" for t, f in zip(time, force, strict=True)]
    (folder / "raw" / "a.csv").write_text("Time (s),Load (N),Extension (mm)\n" + "\n".join(rows) + "\n")
    result = on_the_command_line.run("fit", folder, "-o", tmp_path / "out", "--trace-law", "coulomb")
    assert result.exit_code == 0, result.stderr
    with open(tmp_path / "out" / "tracelaws.csv", newline="") as file:
        found = {row["parameter"]: row for row in csv.DictReader(file)}
    assert float(found["mu_s"]["value"]) == pytest.approx(0.36, rel=0.02)
    assert float(found["mass_kg"]["low"]) < 0.0305
    assert found["mu_d"]["told"] == "yes"
    assert {row["law"] for row in found.values()} == {"coulomb"}


def stick_slip_campaign(folder: Path, speeds_mm_s: list[float], b: float) -> Path:
    """Records of one sample at one load whose static friction grows by b per e-fold of the time at rest."""
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.toml").write_text('[campaign]\ntitle = "t"\n[patterns.F]\ncavity = "none"\n')
    lines = ["test_id,file,sample,normal_load_N,speed_mm_s"]
    for k, speed in enumerate(speeds_mm_s):
        given = COULOMB | {"speed_m_s": 1e-3 * speed, "mu_s": 0.36 - b * math.log(200.0), "b": b, "duration_s": 12.0}
        time, force = slips(np.random.default_rng(20 + k), rate_Hz=500.0, **given)
        rows = [f"{t:.4f},{f:.7f},{t * speed:.6f}" for t, f in zip(time, force, strict=True)]
        (folder / "raw" / f"{k}.csv").write_text("Time (s),Load (N),Extension (mm)\n" + "\n".join(rows) + "\n")
        lines.append(f"T{k},raw/{k}.csv,F,0.3,{speed}")
    (folder / "tests.csv").write_text("\n".join(lines) + "\n")
    return folder


def test_growth_at_rest_is_told_by_the_records_of_one_sample_at_several_speeds(tmp_path: Path):
    folder = stick_slip_campaign(tmp_path / "c", [0.3, 0.5, 0.9, 1.5, 2.2], b=0.006)
    result = on_the_command_line.run("fit", folder, "-o", tmp_path / "out", "--trace-law", "auto")
    assert result.exit_code == 0, result.stderr
    with open(tmp_path / "out" / "tracelaws.csv", newline="") as file:
        of_all = [row for row in csv.DictReader(file) if row["test_id"] == "F, 0.3 N" and row["law"] in SLIP_LAWS]
    assert {row["law"] for row in of_all} == {"ageing"}
    b = next(row for row in of_all if row["parameter"] == "b")
    assert float(b["low"]) < 0.006 < float(b["high"])
    assert float(b["low"]) > 0.0
    assert b["told"] == "yes"


def test_slips_of_a_stronger_contact_are_stuck_for_longer_and_their_means_show_no_growth():
    rng = np.random.default_rng(6)
    hold, friction = [], []
    for stuck in np.geomspace(0.1, 10.0, 6):
        strength = 0.4 * (1.0 + 0.05 * rng.standard_normal(200))
        hold.append(math.exp(np.log(stuck * strength / 0.4).mean()))
        friction.append(strength.mean())
    coulomb, ageing = (fit_rests(np.array(hold), np.array(friction), law) for law in ("coulomb", "ageing"))
    assert coulomb is not None
    assert ageing is not None
    assert "coulomb" in [law.law for law in unbeaten([coulomb, ageing])]
    assert ageing["b"].low < 0.0 < ageing["b"].high
    assert coulomb["mu_s"].low < 0.4 < coulomb["mu_s"].high


def test_four_records_of_stick_slip_tell_no_growth():
    assert fit_rests(np.geomspace(0.1, 10.0, 4), np.full(4, 0.4)) is None


DRIVEN = {"forward_N": 12e3, "backward_N": 8e3, "stiffness": 4e6, "backlash_m": 4e-3, "amplitude_m": 0.02,
          "frequency_Hz": 1.0, "cycles": 8, "rate_Hz": 200.0, "noise_N": 200.0}  # fmt: skip


def test_the_force_of_a_slider_without_inertia_is_that_of_a_light_simulated_one():
    time = np.linspace(0.0, 8.0, 801)
    drive = 0.02 * np.sin(1.5 * time)
    values = {"sliding_N": 10.0, "stiffness_N_per_m": 4e3, "backlash_m": 3e-3}
    config = SliderConfig(
        1e-3, 4e3, 1.0, 10.0, values={"mu_s": 1.0, "mu_d": 1.0}, drive=recorded_displacement(time, drive),
        backlash_m=3e-3, duration_s=8.0, rate_Hz=100.0,
    )  # fmt: skip
    np.testing.assert_allclose(simulate_slider(config).force_N, driven_force(drive, values), rtol=0, atol=0.1)


def test_friction_each_way_stiffness_and_backlash_are_recovered_from_strokes_and_equal_friction_is_refused():
    drive, force = strokes(np.random.default_rng(4), **DRIVEN)
    made = [fit_driven(drive, force + 1.5e3, law) for law in ("driven_backlash", "driven_directions")]
    assert made[1] is not None
    assert [law.law for law in unbeaten(made)] == ["driven_directions"]
    truths = {"forward_N": 12e3, "backward_N": 8e3, "stiffness_N_per_m": 4e6, "backlash_m": 4e-3, "zero_N": 1.5e3}
    for name, truth in truths.items():
        p = made[1][name]
        assert p.told
        assert p.value == pytest.approx(truth, rel=0.05)
        half = 0.5 * (p.high - p.low)
        assert 0.0 < half < 0.1 * truth
        assert abs(p.value - truth) < 2.0 * half


def test_five_strokes_tell_no_law():
    drive, force = strokes(np.random.default_rng(4), **DRIVEN | {"cycles": 2})
    assert fit_driven(drive, force) is None


def test_the_command_reads_a_drive_that_goes_to_and_fro_and_takes_its_strokes_for_no_steps_of_speed(tmp_path: Path):
    drive, force = strokes(np.random.default_rng(4), **DRIVEN)
    folder = tmp_path / "c"
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.toml").write_text('[campaign]\ntitle = "t"\n[patterns.F]\ncavity = "none"\n')
    (folder / "tests.csv").write_text("test_id,file,sample,normal_load_N\nT1,raw/a.csv#*,F,20000\n")
    rows = [f"{i / 200:.4f},{f:.5f},{1e3 * x:.6f}" for i, (f, x) in enumerate(zip(force, drive, strict=True))]
    (folder / "raw" / "a.csv").write_text("Time (s),Friction force (N),Position (mm)\n" + "\n".join(rows) + "\n")
    result = on_the_command_line.run("fit", folder, "-o", tmp_path / "out", "--trace-law", "auto")
    assert result.exit_code == 0, result.stderr
    with open(tmp_path / "out" / "tracelaws.csv", newline="") as file:
        found = {row["parameter"]: row for row in csv.DictReader(file) if row["law"] == "driven_directions"}
    assert float(found["forward_N"]["value"]) == pytest.approx(12e3, rel=0.05)
    assert float(found["backward_N"]["value"]) == pytest.approx(8e3, rel=0.05)


def test_a_filter_that_loses_samples_makes_no_law_likelier():
    white = 1e-4 * np.random.default_rng(2).standard_normal(1000)
    assert white_likelihood(white[8:], 1000) == pytest.approx(white_likelihood(white, 1000), abs=8.0)


def test_a_fall_of_the_calmed_force_alone_has_no_shape_of_a_slip():
    time = np.arange(200) / 1000.0
    force = 1.0 + 1e-3 * time
    assert tracelaws._shape(time, force, 100, 120, 20, 1e-3) is None


LADDER = np.concatenate([np.geomspace(1e-5, 1e-2, 8), np.geomspace(1e-2, 1e-5, 8)])


def test_stribeck_friction_is_recovered_from_a_ladder_of_speeds_and_beats_the_other_laws_on_speeds_left_out():
    truth = {"mu_d": 0.25, "mu_s": 0.40, "viscous_s_per_m": 5.0, "v_s_m_s": 3e-4}
    rng = np.random.default_rng(8)
    friction = 0.25 + 0.15 * np.exp(-LADDER / 3e-4) + 5.0 * LADDER + 0.004 * rng.standard_normal(16)
    made = [fit_speeds(LADDER, friction, law) for law in SPEED_LAWS]
    assert [law.law for law in unbeaten([law for law in made if law])] == ["stribeck"]
    for name, value in truth.items():
        p = made[-1][name]
        assert p.told
        assert p.low < value < p.high
        assert p.high - p.low < value


def test_constant_friction_tells_no_stribeck_law_and_four_speeds_tell_none():
    rng = np.random.default_rng(9)
    friction = 0.3 + 0.004 * rng.standard_normal(16)
    made = [fit_speeds(LADDER, friction, law) for law in SPEED_LAWS]
    assert not made[-1]["v_s_m_s"].told
    assert "constant" in [law.law for law in unbeaten([law for law in made if law])]
    assert fit_speeds(np.repeat([1e-4, 1e-3, 1e-2, 1e-1], 4), friction) is None


def test_the_command_fits_stribeck_friction_to_the_steady_stretches_of_a_ladder_of_speeds(tmp_path: Path):
    friction = 0.25 + 0.15 * np.exp(-LADDER / 3e-4)
    time, mu = ladder(np.random.default_rng(3), LADDER, friction, scatter=0.003, noise=0.003)
    place = np.cumsum(np.repeat(LADDER, 200)) / 10.0
    folder = tmp_path / "c"
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.toml").write_text('[campaign]\ntitle = "t"\n[patterns.F]\ncavity = "none"\n')
    (folder / "tests.csv").write_text("test_id,file,sample,normal_load_N\nT1,raw/a.csv#*,F,10\n")
    rows = [f"{t:.2f},{10 * m:.5f},{1e3 * x:.6f},10" for t, m, x in zip(time, mu, place, strict=True)]
    head = "Time (s),Friction force (N),Position (mm),Normal force (N)\n"
    (folder / "raw" / "a.csv").write_text(head + "\n".join(rows) + "\n")
    result = on_the_command_line.run("fit", folder, "-o", tmp_path / "out", "--trace-law", "stribeck")
    assert result.exit_code == 0, result.stderr
    with open(tmp_path / "out" / "tracelaws.csv", newline="") as file:
        found = {row["parameter"]: row for row in csv.DictReader(file)}
    assert float(found["mu_s"]["value"]) == pytest.approx(0.40, rel=0.03)
    assert float(found["v_s_m_s"]["low"]) < 3e-4 < float(found["v_s_m_s"]["high"])
