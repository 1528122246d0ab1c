"""A mechanism in the simulator, against the quick predictor that is used to find it."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.diagnose.extend import SIMULATED, extended, parse_with, simulate_with
from tribo.errors import SimulationError
from tribo.mechanisms.record import Base
from tribo.mechanisms.table import MECHANISMS
from tribo.simulate import SimConfig, simulate

SMALL = SimConfig(sample="B", pressure_Pa=8e3, angle_deg=20.0, blocks=(25, 25), seed=3, dt_s=1e-7)


@pytest.mark.parametrize("name", SIMULATED)
def test_zero_amplitude_leaves_the_configuration_to_the_bit(name: str) -> None:
    assert extended(SMALL, {name: MECHANISMS[name].zero()}) == SMALL
    assert extended(SMALL, {name: MECHANISMS[name].start()}, hold_s=99.0, humidity_pct=60.0, speed_m_s=1e-3,
                    temperature_C=25.0) != SMALL  # fmt: skip


def test_without_mechanisms_the_run_is_the_same_to_the_bit() -> None:
    assert np.array_equal(simulate_with(SMALL, {}).force_N, simulate(SMALL).force_N)


@pytest.mark.parametrize("name", ["suction", "pressure_dependent_friction", "run_in", "humidity", "contact_ageing"])
def test_simulator_and_quick_predictor_agree(name: str) -> None:
    """Relative change of static friction within 3 % of T: the predictor's base is the run without mechanism."""
    values = MECHANISMS[name].start()
    known = {"humidity_pct": 58.0, "hold_s": 100.0}
    after, before = simulate_with(SMALL, {name: values}, **known), simulate(SMALL)
    light, heavy = (simulate(SMALL.with_(pressure_Pa=p)) for p in (6e3, 10e3))
    mu = (heavy.static_friction * 10e3 - light.static_friction * 6e3) / 4e3
    tau = before.static_friction * 8e3 - mu * 8e3
    from tribo.diagnose.extend import conditions_of_run

    base = Base(np.array([mu]), np.array([tau]), np.array([1.0]), np.array([1.0]))
    quick = MECHANISMS[name].law(values, base, conditions_of_run(SMALL, known), "").static_N[0] / 8e3
    assert after.static_friction == pytest.approx(quick, rel=0.03)
    assert abs(after.static_friction / before.static_friction - 1) > 0.02


def test_values_are_parsed_with_their_bounds() -> None:
    found = parse_with("suction:dp=3000, run_in:c=0.1,n0=4")
    assert found["suction"] == pytest.approx([3000.0])
    assert found["run_in"] == pytest.approx([0.1, 4.0])
    with pytest.raises(SimulationError) as why:
        parse_with("suction:dp=-1,suction:pd=3,sucktion:dp=3")
    assert [p.kind for p in why.value.problems] == ["bad_value", "unknown_parameter", "unknown_mechanism"]


def test_what_cannot_be_simulated_is_refused() -> None:
    with pytest.raises(SimulationError, match="suction"):
        extended(SMALL, {"tilt": np.array([0.02])})
