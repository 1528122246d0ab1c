"""What a model of a campaign is made of: random effects, laws of every sample, several mechanisms, derivatives."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tribo.diagnostics.model import (
    ALIKE_IN_BOTH,
    APART,
    DEGREES,
    FIXED,
    GAIN,
    LAW_BOUNDS,
    LAW_SCALE,
    PATTERN,
    SLOPE,
    Acting,
    Setup,
    Target,
    added,
    along_what_it_follows,
    candidates,
    effect_of,
    predict,
    setup,
    start_changes,
    with_form_error,
    with_free_columns,
)
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.mechanisms import MECHANISMS

from .synthetic import SMALL, hidden

LAW = np.array([4.8, 23.0, 3.0, 11.6])


@cache
def campaign() -> Setup:
    o = observe(hidden(seed=2))
    return setup(o, tabled_predictor(o.patterns))


def named(*names: str) -> tuple[Acting, ...]:
    return tuple(Acting(MECHANISMS[name]) for name in names)


def test_a_law_predicts_the_shares_of_its_mu_and_tau0_in_every_sample() -> None:
    s = campaign()
    c = s.observations.conditions
    for sample in ("F", "A", "C"):
        here = c.sample == sample
        m_static, a_static, m_sliding, a_sliding = s.predictor.shares[sample]
        static = m_static * 4.8 * c.normal_load_N[here] + a_static * 23e3 * c.nominal_area_m2
        sliding = m_sliding * 3.0 * c.normal_load_N[here] + a_sliding * 11.6e3 * c.nominal_area_m2
        expected = np.log(np.column_stack([static, sliding]))
        assert predict(s, LAW, (), ())[here] == pytest.approx(expected)
        as_one = s.base(LAW).as_sample(sample).forces(c.normal_load_N)
        assert np.log(as_one.static_N)[here] == pytest.approx(expected[:, 0])
        assert np.log(as_one.sliding_N)[here] == pytest.approx(expected[:, 1])


def test_a_force_that_would_be_negative_is_a_micronewton() -> None:
    assert predict(campaign(), np.array([0.01, -200.0, 3.0, 11.6]), (), ())[:, 0].min() == pytest.approx(np.log(1e-6))


def test_several_mechanisms_add_their_changes_and_keep_their_own_parameters() -> None:
    s = campaign()
    acting = named("cavity_collapse", "run_in", "suction")
    target = Target(s, acting)
    counts = [len(a.mechanism.parameters) for a in acting]
    parts = [a.start * 0.7 for a in acting]
    x = np.concatenate([LAW, *parts])
    found = target.values(x)
    assert [len(v) for v in found] == counts
    for value, part in zip(found, parts, strict=True):
        assert value == pytest.approx(part)
    changes = sum(effect_of(s, LAW, a, v) for a, v in zip(acting, parts, strict=True))
    assert target.predict(x) == pytest.approx(predict(s, LAW, (), ()) + changes)
    assert target.residual(x) == pytest.approx(s.observations.log_force - target.predict(x))
    assert Target(s, ()).values(LAW) == ()
    low, high = target.bounds
    assert low.tolist() == [*LAW_BOUNDS[0], *(p.low for a in acting for p in a.mechanism.parameters)]
    assert high.tolist() == [*LAW_BOUNDS[1], *(p.high for a in acting for p in a.mechanism.parameters)]
    assert target.scales.tolist() == [*LAW_SCALE, *(abs(p.start) for a in acting for p in a.mechanism.parameters)]


def test_derivatives_are_those_of_the_prediction_by_every_parameter() -> None:
    s = campaign()
    target = Target(s, named("suction", "run_in", "temperature"))
    x = np.concatenate([LAW, *(0.7 * a.start for a in target.acting)])
    found = target.jacobian(x, target.predict(x))
    assert found.shape == (s.observations.n, 2, len(x))
    for k, scale in enumerate(target.scales):
        step = np.zeros(len(x))
        step[k] = 1e-5 * scale
        central = (target.predict(x + step) - target.predict(x - step)) / (2 * step[k])
        assert found[:, :, k] == pytest.approx(central, rel=2e-3, abs=2e-4 * np.abs(central).max())


def test_derivatives_at_an_upper_bound_are_taken_from_below() -> None:
    """Beyond its bound a share of collapsed cavities would have no meaning."""
    s = campaign()
    target = Target(s, named("cavity_collapse"))
    x = np.concatenate([LAW, [1.0, 1e4, 0.3]])
    seen: list[float] = []

    class Watched(Target):
        def predict(self, x: np.ndarray) -> np.ndarray:
            seen.append(float(x[4]))
            return super().predict(x)

    found = Watched(s, target.acting).jacobian(x, target.predict(x))
    assert max(seen) <= 1.0
    assert min(seen) == pytest.approx(1.0 - 0.5e-4, abs=1e-9)
    down = x.copy()
    down[4] -= 1e-5
    assert found[:, :, 4] == pytest.approx((target.predict(x) - target.predict(down)) / 1e-5, rel=1e-3, abs=1e-6)


def test_a_specimen_has_a_gain_and_a_slope_alike_in_both_regimes_and_apart() -> None:
    s = campaign()
    c, p = s.observations.conditions, s.log_pressure
    assert p == pytest.approx(np.log(c.pressure_Pa) - np.log(c.pressure_Pa).mean())
    names = np.unique(c.specimen)
    assert np.sum(s.group < PATTERN) == 4 * len(names)
    for group, shape, regimes in (
        (GAIN, np.ones_like(p), ALIKE_IN_BOTH), (GAIN + 1, np.ones_like(p), APART),
        (SLOPE, p, ALIKE_IN_BOTH), (SLOPE + 1, p, APART),
    ):  # fmt: skip
        here = np.flatnonzero(s.group == group)
        assert s.unit[here].tolist() == [1.0] * len(names)
        for column, name in zip(here, names, strict=True):
            expected = ((c.specimen == name) * shape)[:, None] * regimes
            assert s.dense[:, :, column] == pytest.approx(expected)
    assert pytest.approx(1.0) == ALIKE_IN_BOTH @ ALIKE_IN_BOTH == APART @ APART
    assert pytest.approx(0.0) == ALIKE_IN_BOTH @ APART


def test_a_pattern_has_an_offset_a_slope_and_a_curve_in_each_regime_of_the_stated_sizes_and_the_flat_sample_none() -> (
    None
):
    s = campaign()
    c, p = s.observations.conditions, s.log_pressure
    shapes = (np.ones_like(p), p, p**2 - np.mean(p**2))
    columns = s.dense[:, :, s.of_patterns] * s.unit[s.of_patterns]
    assert columns.shape[2] == 21
    expected = np.zeros((s.observations.n, 2, 2, s.observations.n))
    for sample in ("A", "B", "C"):
        for known, shape in zip(("offset", "slope", "curve"), shapes, strict=True):
            for regime in (0, 1):
                along = getattr(s.predictor.error[sample], known)[regime] * (c.sample == sample) * shape
                expected[:, regime, regime] += np.outer(along, along)
        both = 0.25 * min(s.predictor.error[sample].offset) ** 2 * np.outer(c.sample == sample, c.sample == sample)
        expected[:, [0, 1], [1, 0]] += both[:, None]
    assert np.einsum("nrk,mtk->nrtm", columns, columns) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("group", "moved"), [(PATTERN, (1.0, 1.0)), (PATTERN + 1, (1.0, 0.0)), (PATTERN + 2, (0.0, 1.0))]
)
def test_errors_of_a_pattern_move_both_regimes_by_one_factor_or_one_of_them(
    group: int, moved: tuple[float, float]
) -> None:
    s = campaign()
    columns = s.dense[:, :, s.group == group]
    assert columns.shape[2] == (3 if group == PATTERN else 9)
    assert columns.any(axis=(0, 2)).tolist() == [m > 0.0 for m in moved]
    assert columns[:, 0] * moved[1] == pytest.approx(columns[:, 1] * moved[0])


def test_repeats_may_depend_on_the_sample_and_on_the_force_the_law_expects() -> None:
    s = campaign()
    c = s.observations.conditions
    for k, name in enumerate(np.unique(c.sample)):
        assert s.scatter[:, k].tolist() == (c.sample == name).astype(float).tolist()
    log_force = predict(s, s.first_law, (), ()).mean(axis=1)
    assert s.scatter[:, -1] == pytest.approx(log_force - log_force.mean())
    assert s.scatter.shape[1] == 5


def test_the_first_guess_is_the_law_of_a_campaign_without_scatter_and_hardly_moved_by_wild_tests() -> None:
    s = campaign()
    o = replace(s.observations, log_force=predict(s, LAW, (), ()))
    assert setup(o, s.predictor).first_law == pytest.approx(LAW, rel=1e-6)
    wild = o.log_force.copy()
    wild[::9] += 1.0
    assert setup(replace(o, log_force=wild), s.predictor).first_law == pytest.approx(LAW, rel=0.01)


def test_the_first_guess_of_a_force_that_does_not_depend_on_the_load_has_the_smallest_mu() -> None:
    s = campaign()
    area = s.observations.conditions.nominal_area_m2
    even = replace(s.observations, log_force=np.log(s.shares[:, [1, 3]] * 23e3 * area))
    assert setup(even, s.predictor).first_law == pytest.approx([0.05, 23.0, 0.05, 23.0], abs=1e-6)


def test_the_tests_of_a_setup_that_are_kept_keep_everything_about_them() -> None:
    s = campaign()
    keep = s.observations.conditions.sample != "B"
    part = s.take(keep)
    assert part.observations.n == keep.sum()
    for name in ("shares", "log_pressure", "scatter"):
        assert np.array_equal(getattr(part, name), getattr(s, name)[keep])
    assert np.array_equal(part.dense, s.dense[keep])
    assert np.array_equal(part.group, s.group)


def test_a_form_error_lets_an_effect_be_off_by_a_share_of_itself_along_what_it_follows_and_by_sample_and_regime() -> (
    None
):
    s = campaign()
    acting, values = named("suction"), (np.array([8e3]),)
    wider = with_form_error(s, LAW, acting, values, 0.2)
    change = effect_of(s, LAW, acting[0], values[0])
    further = wider.dense[:, :, s.dense.shape[2] :]
    c = s.observations.conditions
    along = along_what_it_follows(acting[0], c)
    assert along.shape == (s.observations.n, DEGREES) == (s.observations.n, 3)
    assert further[:, :, :3] == pytest.approx(change[:, :, None] * along[:, None, :])
    wanted = [
        (sample, regime, shape)
        for shape in (np.ones_like(s.log_pressure), s.log_pressure)
        for sample in ("A", "B", "C")  # there is no suction on F
        for regime in (0, 1)
    ]
    assert further.shape[2] == 3 + len(wanted) == 15
    for k, (sample, regime, shape) in enumerate(wanted, start=3):
        assert further[:, regime, k] == pytest.approx(change[:, regime] * (c.sample == sample) * shape)
        assert not further[:, 1 - regime, k].any()
    assert wider.unit[-15:].tolist() == [0.2] * 15
    assert wider.group[-15:].tolist() == [FIXED] * 15
    assert len(wider.unit) == len(wider.group) == len(s.unit) + 15
    assert with_form_error(s, LAW, (), (), 0.2) is s


def test_a_formula_is_off_by_smooth_courses_of_its_own_column_or_of_the_load_of_a_mean_square_of_one() -> None:
    """Three polynomials along the logarithm of positive numbers, without a constant; nothing where it does not vary."""
    c = campaign().observations.conditions
    n = len(c.sample)
    speed = np.geomspace(1e-5, 1e-3, n)
    (velocity,), (suction,) = named("velocity_dependence"), named("suction")
    along = along_what_it_follows(velocity, replace(c, speed_m_s=speed))
    assert np.mean(np.sum(along**2, axis=1)) == pytest.approx(1.0, abs=0.1)
    assert along.mean(axis=0) == pytest.approx(0.0, abs=0.1)
    line = np.polyfit(np.log(speed), along[:, 0], 1)
    assert along[:, 0] == pytest.approx(np.polyval(line, np.log(speed)))
    assert along_what_it_follows(velocity, replace(c, speed_m_s=np.full(n, 1e-4))).shape == (n, 0)
    of_load = along_what_it_follows(suction, replace(c, speed_m_s=speed))[:, 0]
    line = np.polyfit(np.log(c.normal_load_N), of_load, 1)
    assert of_load == pytest.approx(np.polyval(line, np.log(c.normal_load_N)))


def test_every_mechanism_that_the_design_can_show_is_a_candidate_with_each_of_its_choices() -> None:
    s = campaign()
    c, base = s.observations.conditions, s.base(LAW)
    wanted = [
        (m.name, choice)
        for m in MECHANISMS.values()
        if m.regimes != ("rise",) and m.applies(c)
        for choice in m.choices(base, c)
    ]
    assert [(a.mechanism.name, a.choice) for a in candidates(s, LAW)] == wanted
    assert ("velocity_dependence", "") not in wanted  # one speed
    assert ("machine_compliance", "") not in wanted  # only the rise shows it


def test_changes_at_the_start_are_those_of_every_candidate_and_of_every_size_a_fit_starts_from() -> None:
    s = campaign()
    acting, courses, every_start = start_changes(s, LAW)
    before = predict(s, LAW, (), ())
    for k, a in enumerate(acting):
        assert added(courses[k])[:, :, 0] == pytest.approx(predict(s, LAW, (a,), (a.start,)) - before)
    assert set(every_start) == {a.name for a in acting if not a.choice}
    tilt = MECHANISMS["tilt"]
    sizes = [tilt.amplitude.start, *tilt.amplitude.tries]
    columns = [effect_of(s, LAW, Acting(tilt), np.array([size])) for size in sizes]
    assert every_start["tilt"] == pytest.approx(np.stack(columns, axis=2))


def test_a_candidate_is_called_by_its_mechanism_and_its_choice() -> None:
    a = Acting(MECHANISMS["covariate"], "operator is ann")
    assert a.name == "covariate:operator"
    assert a.start.tolist() == [p.start for p in a.mechanism.parameters]
    assert SMALL.samples == ("F", "A", "B", "C")


def test_free_columns_may_be_twice_their_coefficients_and_at_least_half_the_largest() -> None:
    s = campaign()
    columns = np.ones((s.observations.n, 2, 3))
    wider = with_free_columns(s, columns, np.array([3.0, -1.0, 0.0]))
    assert wider.unit[-3:].tolist() == [6.0, 2.0, 1.5]
    assert wider.group[-3:].tolist() == [FIXED] * 3
    assert wider.n_effects == s.n_effects + 3
