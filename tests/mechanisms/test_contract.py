"""Every mechanism of the table is held to the same contract."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.mechanisms import MECHANISMS, NAMES, mechanism
from tribo.mechanisms.record import Base, Conditions, Mechanism, Values
from tribo.vocabulary import OBSERVABLES

LAWS = {"F": (4.8, 1.29, 2.9, 0.62), "B": (4.2, 0.59, 3.0, 0.38), "Sx": (3.7, 0.69, 2.95, 0.47)}
ALL = pytest.mark.parametrize("m", MECHANISMS.values(), ids=list(MECHANISMS))


def conditions() -> Conditions:
    """Forty-eight pulls of three samples at four loads, everything recorded and varied."""
    rng = np.random.default_rng(7)
    samples = np.repeat(["F", "B", "Sx"], 16)
    n = len(samples)
    number = np.tile(np.repeat([1, 2], 8), 3)
    return Conditions(
        normal_load_N=np.tile([0.06, 0.25, 0.6, 1.4], n // 4),
        nominal_area_m2=55e-6,
        area_fraction=np.repeat([1.0, 0.651, 0.697], 16),
        rim_per_m=np.repeat([0.0, 1.4e5, 1.8e4], 16),
        cavity_width_m=np.repeat([0.0, 1e-5, 4e-5], 16),
        elongation=np.repeat([0.0, 0.0, np.log(5.0)], 16),
        sample=samples,
        pattern=np.repeat(["F", "B", "S"], 16),
        specimen=np.array([f"{s[0]}{k}" for s, k in zip(samples, number, strict=True)]),
        speed_m_s=np.tile([5e-5, 2e-4, 8e-4], n // 3),
        hold_s=np.tile([1.0, 10.0, 300.0], n // 3),
        specimen_run=np.tile(np.arange(1.0, 9.0), n // 8),
        run_order=np.arange(1.0, n + 1),
        elapsed_s=420.0 * np.arange(n),
        temperature_C=rng.normal(23.0, 1.0, n),
        humidity_pct=rng.normal(50.0, 4.0, n),
        clip_N=np.full(n, 0.02),
        clock_h=8.0 + 420.0 / 3600.0 * np.arange(n),
        columns={
            "operator": np.where(np.arange(n) % 2 == 0, "ann", "bo"),
            "date": np.where(np.arange(n) % 24 < 13, "2026-03-04", "2026-03-05"),
        },
    )


def base(c: Conditions) -> Base:
    rows = np.array([LAWS[s] for s in c.sample])
    return Base(*rows.T, by_sample=LAWS, flat="F")


def first_choice(m: Mechanism, b: Base, c: Conditions) -> str:
    return m.choices(b, c)[0]


def change(m: Mechanism, values: Values) -> np.ndarray:
    c = conditions()
    b = base(c)
    after, before = m.law(values, b, c, first_choice(m, b, c)), b.forces(c.normal_load_N)
    return np.column_stack([after.static_N - before.static_N, after.sliding_N - before.sliding_N])


def test_the_table_names_every_mechanism_by_its_own_name() -> None:
    assert tuple(MECHANISMS) == NAMES == tuple(m.name for m in MECHANISMS.values())


def test_an_unknown_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(KeyError, match="suction"):
        mechanism("sucktion")
    assert mechanism("covariate:operator").name == "covariate"


@ALL
def test_zero_amplitude_is_the_baseline_to_the_bit(m: Mechanism) -> None:
    assert np.array_equal(change(m, m.zero()), np.zeros((48, 2)))


@ALL
def test_a_clear_amplitude_acts_in_the_declared_sign_and_regimes(m: Mechanism) -> None:
    moved = change(m, m.start())
    if m.sign != 0 and m.regimes != ("rise",):
        assert (m.sign * moved >= -1e-12).all()
    assert moved[:, 0].any() == ("static" in m.regimes)
    assert moved[:, 1].any() == ("sliding" in m.regimes)


@ALL
def test_values_start_inside_their_bounds_and_say_their_units(m: Mechanism) -> None:
    low, high = m.bounds()
    assert m.parameters[0].amplitude
    assert not any(p.amplitude for p in m.parameters[1:])
    assert ((low <= m.start()) & (m.start() <= high)).all()
    assert ((low <= m.zero()) & (m.zero() <= high)).all()
    assert all(p.text and p.name for p in m.parameters)
    assert all((m.formula, m.separates, m.shows, m.enters, m.confused_with, m.silenced_by))


@ALL
def test_the_law_is_finite_positive_and_smooth_from_the_start(m: Mechanism) -> None:
    """Central differences of two widths agree, so that a fit may follow the gradient."""
    c = conditions()
    b = base(c)
    choice = first_choice(m, b, c)
    for k, p in enumerate(m.parameters):
        slopes = []
        for h in (1e-3 * abs(p.start), 2e-3 * abs(p.start)):
            step = np.zeros(len(m.parameters))
            step[k] = h
            up, down = (m.law(m.start() + sign * step, b, c, choice).static_N for sign in (1, -1))
            assert (up > 0).all()
            slopes.append((up - down) / (2 * h))
        assert np.allclose(*slopes, rtol=2e-2, atol=1e-6 * np.abs(slopes[0]).max() + 1e-12) or m.name == "tilt"


@ALL
def test_a_mechanism_needs_columns_that_conditions_have(m: Mechanism) -> None:
    c = conditions()
    assert all(hasattr(c, name) for name in m.needs)
    assert m.applies(c) or m.name == "sampling_clip"


def test_what_does_not_vary_does_not_apply() -> None:
    from dataclasses import replace

    one_speed = replace(conditions(), speed_m_s=np.full(48, 2e-4))
    assert not MECHANISMS["velocity_dependence"].applies(one_speed)
    unrecorded = replace(conditions(), humidity_pct=np.full(48, np.nan))
    assert not MECHANISMS["humidity"].applies(unrecorded)


@ALL
def test_it_has_a_plain_name_of_its_own_and_no_identifier_in_its_words(m: Mechanism) -> None:
    assert m.plain
    assert [other.name for other in MECHANISMS.values() if other.plain == m.plain] == [m.name]
    words = (m.plain, m.shows, m.confused_with, m.separates, m.enters, m.untested, m.in_table.missing)
    assert not any("_" in text for text in (*words, m.in_table.barred, *m.silenced_by))


@ALL
def test_what_the_traces_show_of_it_has_words(m: Mechanism) -> None:
    assert m.evidence is None or (m.evidence.observable in OBSERVABLES and m.evidence.source)
    assert m.evidence is None or m.evidence.absent or m.evidence.corrected


@ALL
def test_a_choice_concerns_some_test_and_is_called_by_the_name_of_the_mechanism(m: Mechanism) -> None:
    c = conditions()
    choice = first_choice(m, base(c), c)
    acting = [m.choosing.on_test(m.start(), choice, c, test) for test in range(48)]
    assert any(here is not None for here in acting)
    assert all(here is None or len(here[0]) == len(m.parameters) for here in acting)
    assert m.called(choice).split(":")[0] == m.name
    assert m.choosing.held_out in ("samples", "loads")


@ALL
def test_on_one_test_it_changes_the_force_as_its_law_does_over_the_campaign(m: Mechanism) -> None:
    """The values of one test, with the choice of a single run, give the change that the law gives that test."""
    from dataclasses import fields, replace

    c = conditions()
    b = base(c)
    choice = first_choice(m, b, c)
    whole = m.law(m.start(), b, c, choice).static_N
    plain = b.forces(c.normal_load_N).static_N
    for test in range(48):
        here = m.choosing.on_test(m.start(), choice, c, test)
        if here is None:
            assert whole[test] == pytest.approx(plain[test])
            continue
        arrays = {f.name for f in fields(c)} - NOT_BY_TEST
        one = replace(c, **{name: getattr(c, name)[[test]] for name in arrays}, columns={"column": np.array(["this"])})
        alone = np.array([[v[test] for v in (b.static_mu, b.static_adhesion_N, b.sliding_mu, b.sliding_adhesion_N)]])
        single = Base(*alone.T, by_sample=LAWS, flat="F")
        values, other_sample = here
        if other_sample:
            other = single.as_sample(other_sample).forces(one.normal_load_N)
            assert whole[test] == pytest.approx(other.static_N[0])
        else:
            after = m.law(values, single, one, m.choosing.in_one_run(one))
            assert whole[test] == pytest.approx(after.static_N[0])


@ALL
def test_its_placement_is_neutral_at_zero_amplitude_and_acts_at_the_start(m: Mechanism) -> None:
    p, pulled, one = m.placement, ((4.0, 2.5), 49e3), one_run()
    place = np.linspace(-0.5, 0.5, 11)
    neutral: list[tuple[object, list[float], float]] = [
        (p.thresholds, [v for values in both(m) for v in (p.thresholds(values, *pulled) if p.thresholds else ())], 1.0),
        (p.load, [v for values in both(m) for v in (p.load(values, *pulled) if p.load else ())], 1.0),
        (p.springs, [p.springs(values, one) for values in both(m)] if p.springs else [], 1.0),
        (p.floors, [p.floors(values, one) for values in both(m)] if p.floors else [], 0.0),
        (p.rims, [p.rims(values)[0] for values in both(m)] if p.rims else [], 0.0),
        (p.along, [v for values in both(m) for v in (p.along(values, 4.0, place)[0] if p.along else ())], 1.0),
        (p.chain, [v for values in both(m) for v in (p.chain(values, RECORDED).values() if p.chain else ())], 0.0),
    ]
    assert p.by_law or p.other_sample or any(part is not None for part, *_ in neutral)
    for part, values, nothing in neutral:
        if part is not None:
            half = len(values) // 2
            assert values[:half] == [nothing] * half
            assert values[half:] != [nothing] * half


def both(m: Mechanism) -> tuple[Values, Values]:
    """Values at which a mechanism is absent, and a clear effect."""
    return m.zero(), m.start()


def one_run() -> Conditions:
    """A pull of a pattern at four times the reference speed, at a pressure at which cavities collapse."""
    from dataclasses import fields, replace

    c = conditions()
    arrays = {f.name for f in fields(c)} - NOT_BY_TEST
    return replace(c, **{name: getattr(c, name)[[23]] for name in arrays})


NOT_BY_TEST = {"nominal_area_m2", "columns", "without", "gaps", "told_names", "mass_kg"}
RECORDED = {"elapsed_s": 3600.0, "samples_in_rise": 100.0}


@ALL
def test_what_depends_on_the_friction_it_changes_says_so(m: Mechanism) -> None:
    p, place = m.placement, np.linspace(-0.5, 0.5, 11)
    low, high = ((1.0, 1.0), 12e3), ((5.0, 5.0), 60e3)
    moved = [gains(m.start(), *low) != gains(m.start(), *high) for gains in (p.thresholds, p.load) if gains is not None]
    if p.along is not None:
        moved.append(not np.array_equal(p.along(m.start(), 1.0, place)[0], p.along(m.start(), 5.0, place)[0]))
    assert p.own_friction == any(moved)


@ALL
def test_what_it_states_of_evidence_tests_and_tables_is_complete(m: Mechanism) -> None:
    if m.evidence is not None:
        assert set(m.evidence.contains) <= set(NAMES)
        assert m.evidence.corrected or m.evidence.absent.format(value=1.0, percent=100.0)
    if m.measurement is not None:
        assert m.measurement.uncertainty > 0
        assert m.measurement.hours > 0
        assert m.measurement.text.endswith(".")
    if m.variation is not None:
        assert len(set(m.variation.values)) >= 3
    t = m.in_table
    assert not (t.missing and (t.barred or t.finding))
    assert bool(t.finding) <= bool(t.guess)
    assert set(t.separates) <= set(NAMES)
    if t.finding is not None:
        text = t.finding((0.0, 4.0), (0.0, 0.1), lambda: 0.2, 6e4)
        assert text.endswith(".")
        assert "nan" not in text


@ALL
def test_its_record_can_be_kept_and_read_back(m: Mechanism) -> None:
    """Every function in it is one of its module, not a lambda."""
    import json

    from tribo.kept_results import decoded, encoded

    assert decoded(json.loads(json.dumps(encoded(m)))) == m
