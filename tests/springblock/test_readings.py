"""Named readings of the paper: what they set, and that every file says which one it holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo.errors import SimulationError
from tribo.springblock import SimConfig, simulate, stratified_design
from tribo.springblock.config import ANGLES, OPEN_CHOICES, READINGS
from tribo.springblock.design_file import runs_of_design
from tribo.springblock.engines.state import lattice_of, thresholds_of

RECORD = Path(__file__).resolve().parents[2] / "docs" / "data"
DESIGN = {"samples": ["A", "Sy"], "pressures_kPa": [5.0], "repeats": 2}


def test_the_default_is_the_letter_of_the_text():
    """The open choices of the reading "text" are the defaults of a configuration."""
    assert {name: getattr(SimConfig(), name) for name in OPEN_CHOICES} == OPEN_CHOICES
    assert SimConfig().reading == SimConfig().of_reading("text").reading == "text"


def test_every_reading_is_named_in_the_parameters_of_its_runs():
    """A change of any open choice makes the reading the user's own; other changes do not."""
    assert ANGLES.keys() == READINGS.keys()
    for name in READINGS:
        config = SimConfig(sample="B", dt_s=2e-8).of_reading(name).check()
        assert config.parameters()["reading"] == name
        assert config.with_(seed=5, pressure_Pa=3e3).reading == name
        assert config.with_(shear_factor=0.9).reading == "own"


def test_a_reading_replaces_every_open_choice():
    """What was set before does not remain."""
    assert SimConfig(edges="periodic", restrengthening=0.7).of_reading("text") == SimConfig()


def test_a_design_takes_choices_and_angles_of_its_reading():
    """Parameters and angles that the design gives itself come first."""
    runs = runs_of_design(DESIGN | {"reading": "berardo2019"})
    assert {run.reading for run in runs} == {"berardo2019"}
    assert [run.angle_deg for run in runs] == [0.0, 0.0, 90.0, 90.0]
    own = runs_of_design(DESIGN | {"reading": "berardo2019", "angles_deg": [30.0], "parameters": {"edges": "periodic"},
                                   "samples": ["F"]})  # fmt: skip
    assert {(run.angle_deg, run.edges, run.reading) for run in own} == {(30.0, "periodic", "own")}
    assert [run.angle_deg for run in runs_of_design(DESIGN)] == [22.5, 67.5, 85.0, 95.0]


def test_an_unknown_reading_is_refused():
    """The message lists the known ones."""
    with pytest.raises(SimulationError, match="text or berardo2019"):
        runs_of_design(DESIGN | {"reading": "mine"})


def test_nominal_angles_are_the_direction_in_the_name_of_a_sample():
    """Along x where the name has none; seeds differ all the same."""
    design = stratified_design(["C", "Sx", "Sy"], [5e3], 2, angles="nominal")
    assert [config.angle_deg for config in design] == [0.0, 0.0, 0.0, 0.0, 90.0, 90.0]
    assert len({config.seed for config in design}) == 6


EVERY = pytest.mark.parametrize("name", list(READINGS))
SHORT = SimConfig(blocks=(24, 24), angle_deg=27.0, seed=3, duration_peaks=1.1)


@EVERY
def test_the_weakest_block_is_static_friction_of_the_flat_sample_in_every_reading(name: str):
    """T/N = min(mu_s) + F_as / (p l2), to 0.1 %, at the steps of 1e-8 to 5e-8 s."""
    config = SHORT.of_reading(name)
    weakest = thresholds_of(config, lattice_of(config)).static_N.min() / (config.pressure_Pa * config.spacing_m**2)
    for dt_s in (1e-8, 5e-8):
        assert simulate(config.with_(dt_s=dt_s)).static_friction == pytest.approx(weakest, rel=1e-3)


@EVERY
@pytest.mark.parametrize("sample", ["F", "C"])
def test_finite_rotation_moves_peaks_by_less_than_half_a_percent_in_every_reading(sample: str, name: str):
    """Springs of the full r_ij against linearised ones."""
    config = SHORT.of_reading(name).with_(sample=sample, engine="dense")
    turned = simulate(config.with_(rotation="finite"))
    assert turned.static_friction == pytest.approx(simulate(config).static_friction, rel=5e-3)


def test_the_recorded_column_holds_what_the_documentation_says():
    """Forty-eight entries of twenty runs: static rms below 2.5 % and none beyond 5 %, sliding rms below 2.5 %."""
    column = pd.read_csv(RECORD / "table2-column.csv")
    assert set(column.groupby("regime").size()) == {48}
    assert set(column["runs"]) == {20}
    off = column.set_index("regime")["deviation_percent"]
    assert np.sqrt((off**2).groupby("regime").mean()).max() < 2.5
    assert off["static"].abs().max() < 5.0
    claims = pd.read_csv(RECORD / "table2-claims.csv").set_index("claim")["holds"]
    assert list(claims.index[~claims]) == [
        "the same of T/N at each load, A to Sy in pairs", "Figure 8: sliding tau0 = a AF + b",
    ]  # fmt: skip
