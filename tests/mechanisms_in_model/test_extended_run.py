"""Every mechanism in the simulator itself, against the quick predictor that is used to find it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tribo.errors import SimulationError
from tribo.mechanisms import MECHANISMS, NAMES
from tribo.mechanisms.record import Base, Conditions
from tribo.mechanisms_in_model import (
    RECORDED,
    SIMULATED,
    choice_of,
    conditions_of_run,
    parse_given,
    parse_with,
    simulate_with,
)
from tribo.records import Run
from tribo.springblock import SimConfig, simulate

# With this seed the highest force comes with the same avalanche under every mechanism that changes all blocks alike.
# With others it may come with the next, and static friction of single runs then scatters about the law by 0.3 %.
SMALL = SimConfig(sample="B", pressure_Pa=8e3, angle_deg=20.0, blocks=(25, 25), seed=3, dt_s=1e-7)
LONG = SMALL.with_(sample="Sx", angle_deg=4.0, blocks=(45, 25))
KNOWN = {"humidity_pct": 58.0, "hold_s": 100.0, "temperature_C": 25.0, "speed_m_s": 8e-4, "specimen_run": 2.0}
KEYS = [f"{name}(C)" if MECHANISMS[name].placement.other_sample else name for name in SIMULATED]
EVERY = pytest.mark.parametrize("key", KEYS)
# Friction of a run may differ from that of the law by this share. A thousandth where every block is changed alike:
# the equations of the model are linear in load and adhesion, and only the samples that the mean over stick-slip takes
# in may shift. More where the law averages over what the blocks do one by one, for the reason given.
ALIKE = 1e-3
# Sliding friction is chaotic. Standard deviation of single runs about the law over the seeds 3 to 10: up to 0.1 % where
# the strength of all blocks changes by one factor; up to 0.3 % where load and adhesion change differently, because the
# law is then extrapolated from runs at three loads. The latter are compared as means of several runs.
SD, SD_OF_LOADED = 1e-3, 3e-3
LOADED = {
    "pressure_dependent_friction", "pattern_geometry", "normal_load_error", "bulk_viscoelasticity", "humidity",
    "wrong_weight", "load_of_one_day", "area_of_one_specimen",
}  # fmt: skip
NO_OTHER_SLIPS = {
    "load_cell_offset", "tare_of_one_day", "load_cell_drift", "pulley_friction", "machine_compliance", "sampling_clip",
}  # fmt: skip
SEEDS = range(3, 8)
BLOCK_BY_BLOCK = {
    "velocity_dependence": 0.02,  # blocks slide faster and slower than they are pulled
    "contact_ageing": 0.02,  # a block that has slipped is young again, also while others still stick
    "edge_adhesion": 0.01,  # blocks at a rim slip before or after their neighbours
    "pull_angle": 0.01,  # the wire lifts with a force that rises and falls as blocks slip
    "cavity_collapse": 0.03,  # floors touch down in 25 by 25 blocks, a cavity is ten of them
    "tilt": 0.2,  # the law is that of a rigid edge; blocks are carried by springs and peel off sooner
}
AGAINST_ITS_SIGN = {"tilt": 0.02}  # sliding friction of blocks loaded unevenly is a percent higher


def mechanism_of(key: str):
    return MECHANISMS[key.split("(")[0]]


def config_of(key: str) -> SimConfig:
    """Directions part only long cavities."""
    return LONG if key == "cavity_shear_deformation" else SMALL


@cache
def started(key: str) -> Run:
    """The run with the amplitude from which a fit starts; several tests look at it."""
    return simulate_with(config_of(key), {key: mechanism_of(key).start()}, **KNOWN)


def base_of(config: SimConfig, others: tuple[str, ...] = ("C", "F")) -> Base:
    """The law of the simulated sample without mechanism, and of others, from runs at three pressures."""
    load = conditions_of_run(config, {}).normal_load_N[0]
    rows = []
    samples = tuple(dict.fromkeys((config.sample, *others)))
    for sample in samples:
        own = config.with_(sample=sample)
        light, here, heavy = (simulate(own.with_(pressure_Pa=config.pressure_Pa * f)) for f in (0.8, 1.0, 1.25))
        for regime in ("static_friction", "sliding_friction"):
            low, middle, high = (getattr(run, regime) for run in (light, here, heavy))
            mu = (1.25 * high - 0.8 * low) / 0.45
            rows.append((mu, (middle - mu) * load))
    laws = {sample: (*rows[2 * k], *rows[2 * k + 1]) for k, sample in enumerate(samples)}
    return Base(*(np.array([v]) for v in laws[config.sample]), by_sample=laws, flat="F")


@pytest.fixture(scope="module")
def bases() -> dict[str, tuple[Base, Run]]:
    return {"B": (base_of(SMALL), simulate(SMALL)), "Sx": (base_of(LONG, ()), simulate(LONG))}


@pytest.fixture(scope="module")
def several() -> list[tuple[SimConfig, Base, Run]]:
    """The small sample with several draws of its local friction."""
    configs = [SMALL.with_(seed=seed) for seed in SEEDS]
    return [(config, base_of(config, ()), simulate(config)) for config in configs]


def quick(key: str, config: SimConfig, base: Base, before: Run) -> tuple[float, float]:
    """T/N that the law of the mechanism expects of this run."""
    conditions = conditions_of_run(config, KNOWN)
    load = conditions.normal_load_N
    conditions = replace(conditions, clip_N=before.static_friction * load * 0.5 / 100)
    forces = mechanism_of(key).law(mechanism_of(key).start(), base, conditions, _choice(key, config, conditions))
    return float(forces.static_N[0] / load[0]), float(forces.sliding_N[0] / load[0])


def _choice(key: str, config: SimConfig, conditions: Conditions) -> str:
    return {
        "pattern_geometry": config.sample[0], "covariate": "column is this", "load_of_one_day": "column is this",
        "tare_of_one_day": "column is this", "wrong_weight": MECHANISMS["wrong_weight"].choosing.in_one_run(conditions),
        "mislabelled_specimen(C)": f" of {config.sample} behaves as C",
    }.get(key, "")  # fmt: skip


def test_every_stated_condition_of_a_pull_reaches_the_laws() -> None:
    stated = {name: 7.5 for name in RECORDED if name != "samples_in_rise"}  # of the recorder alone
    conditions = conditions_of_run(SMALL, stated)
    assert {name: float(np.squeeze(getattr(conditions, name))) for name in stated} == stated


def test_every_mechanism_of_the_library_can_be_simulated() -> None:
    assert SIMULATED == NAMES


@EVERY
def test_zero_amplitude_is_the_run_without_to_the_bit(key: str, bases: dict[str, tuple[Base, Run]]) -> None:
    config = config_of(key)
    run = simulate_with(config, {key: mechanism_of(key).zero()}, **KNOWN)
    assert np.array_equal(run.force_N, bases[config.sample][1].force_N)
    assert np.array_equal(run.time_s, bases[config.sample][1].time_s)


@EVERY
def test_the_simulated_friction_is_that_of_the_law_and_the_stated_error_does_not_promise_more(
    key: str, bases: dict[str, tuple[Base, Run]]
) -> None:
    m, config = mechanism_of(key), config_of(key)
    base, before = bases[config.sample]
    run = started(key)
    static, sliding = quick(key, config, base, before)
    within = BLOCK_BY_BLOCK.get(key, ALIKE)
    assert run.static_friction == pytest.approx(static, rel=within)
    if key not in LOADED:
        scatter = 0.0 if key in NO_OTHER_SLIPS else 3 * SD
        assert run.sliding_friction == pytest.approx(sliding, rel=max(within, scatter))
    assert m.quick_error >= within


@pytest.mark.parametrize("key", sorted(LOADED))
def test_the_mean_sliding_friction_of_several_runs_is_that_of_the_law_where_the_load_changes(
    key: str, several: list[tuple[SimConfig, Base, Run]]
) -> None:
    """Within three standard errors of the mean."""
    start = {key: mechanism_of(key).start()}
    off = [
        simulate_with(config, start, **KNOWN).sliding_friction / quick(key, config, base, before)[1] - 1
        for config, base, before in several
    ]
    assert np.mean(off) == pytest.approx(0.0, abs=3 * SD_OF_LOADED / len(SEEDS) ** 0.5)


@EVERY
def test_the_simulated_change_has_the_declared_sign_and_regimes(key: str, bases: dict[str, tuple[Base, Run]]) -> None:
    m, config = mechanism_of(key), config_of(key)
    before = bases[config.sample][1]
    run = started(key)
    moved = {
        "static": run.static_friction / before.static_friction - 1,
        "sliding": run.sliding_friction / before.sliding_friction - 1,
    }
    for regime, change in moved.items():
        if regime in m.regimes and m.sign != 0:
            assert m.sign * change > -AGAINST_ITS_SIGN.get(key, ALIKE)
        if regime not in m.regimes:
            assert abs(change) < BLOCK_BY_BLOCK.get(key, ALIKE)
    if m.regimes != ("rise",):
        assert max(abs(change) for change in moved.values()) > 1e-4


def test_what_acts_on_the_rise_changes_its_slope_as_its_law_says(bases: dict[str, tuple[Base, Run]]) -> None:
    before = bases["B"][1]
    for key in ("machine_compliance", "bulk_viscoelasticity"):
        m = mechanism_of(key)
        run = simulate_with(SMALL, {key: m.start()}, **KNOWN)
        sled = conditions_of_run(SMALL, KNOWN)
        scale = sled.normal_load_N[0] / before.normal_load_N
        own = slope_N_per_m(before) * scale
        assert m.rise is not None
        expected = m.rise(m.start(), np.array([own]), sled)[0]
        assert slope_N_per_m(run) * scale == pytest.approx(expected, rel=0.01)
        assert abs(expected / own - 1) > 0.03


def slope_N_per_m(run: Run) -> float:
    """Of the force against the way of the crosshead, up to the first slip, where the run begins to be sampled."""
    return float((run.force_N[1] - run.force_N[0]) / (run.time_s[1] - run.time_s[0]) / SMALL.speed_m_s)


def test_floors_that_all_touch_down_make_the_sample_flat() -> None:
    run = simulate_with(SMALL, {"cavity_collapse": np.array([1.0, 2e3, 0.0])})
    flat = simulate(SMALL.with_(sample="F"))
    assert run.static_friction == pytest.approx(flat.static_friction, rel=2e-3)


def test_a_tilted_sample_has_its_load_off_the_middle_by_what_was_asked() -> None:
    from functools import partial

    from tribo.mechanisms.tilt import uneven
    from tribo.mechanisms_in_model import even, with_profile
    from tribo.springblock.engines.state import lattice_of

    flat = SMALL.with_(sample="F", angle_deg=0.0, blocks=(60, 60))
    lattice = lattice_of(flat)
    place = np.arange(3600) % 60 / 59 - 0.5
    for eccentricity in (0.05, 0.16, 0.25):
        load, grip = with_profile(flat, lattice, partial(uneven, eccentricity), even(lattice))
        assert load.mean() == pytest.approx(1.0)
        assert np.mean(load * place) == pytest.approx(eccentricity, rel=0.05)
    assert grip.mean() == pytest.approx(3 * (0.5 - 0.25), abs=0.02)


def test_a_wrong_label_at_share_one_is_the_other_sample_to_the_bit() -> None:
    run = simulate_with(SMALL, {"mislabelled_specimen(C)": np.array([1.0])})
    assert np.array_equal(run.force_N, simulate(SMALL.with_(sample="C")).force_N)
    assert run.sample == "B"


def test_long_cavities_do_not_count_at_45_degrees() -> None:
    assert conditions_of_run(LONG.with_(angle_deg=45.0), {}).elongation[0] == pytest.approx(0.0, abs=1e-12)
    assert conditions_of_run(LONG.with_(angle_deg=90.0), {}).elongation[0] == pytest.approx(-np.log(5))


def test_two_mechanisms_act_together() -> None:
    both = simulate_with(SMALL, parse_with("suction:dp=3000,load_cell_offset:F_0=0.1"))
    suction = simulate_with(SMALL, parse_with("suction:dp=3000"))
    load = conditions_of_run(SMALL, {}).normal_load_N[0]
    assert both.static_friction - suction.static_friction == pytest.approx(0.1 / load, rel=1e-6)


def test_values_are_parsed_with_their_bounds() -> None:
    found = parse_with("suction:dp=3000, run_in:c=0.1,n0=4, mislabelled_specimen(C):share=1, covariate:operator:g=0.2")
    assert found["suction"] == pytest.approx([3000.0])
    assert found["run_in"] == pytest.approx([0.1, 4.0])
    assert choice_of(next(key for key in found if key.startswith("mislabelled"))) == "C"
    assert found["covariate:operator"] == pytest.approx([0.2])
    with pytest.raises(SimulationError) as why:
        parse_with("suction:dp=-1,suction:pd=3,sucktion:dp=3,mislabelled_specimen:share=1,suction(B):dp=3")
    kinds = [p.kind for p in why.value.problems]
    assert kinds == ["bad_value", "unknown_parameter", "unknown_mechanism", "unknown_sample", "unknown_choice"]


def test_what_does_not_exist_is_refused() -> None:
    with pytest.raises(SimulationError, match="suction"):
        simulate_with(SMALL, {"sucktion": np.array([0.02])})


def test_conditions_of_the_pull_are_parsed_by_name() -> None:
    assert parse_given("hold_s=100, temperature_C=25") == {"hold_s": 100.0, "temperature_C": 25.0}
    with pytest.raises(SimulationError) as why:
        parse_given("hold=100,humidity_pct=wet")
    assert [p.kind for p in why.value.problems] == ["unknown_condition", "bad_value"]
