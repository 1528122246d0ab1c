"""A force far from those of its siblings is a doubt, with one repeat and three specimens as well."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import tribo
from tribo.fitting.siblings import sibling_doubts
from tribo.records import Ingested, Pull
from tribo.stages import with_doubts


@pytest.fixture(scope="module")
def ingested(example: Ingested) -> Ingested:
    """Six samples, three specimens, four loads, one repeat."""
    tests = tuple(t for t in example.campaign.tests if t.repeat == 1)
    read = {t.test_id for t in tests}
    pulls, traces = ({k: v for k, v in of.items() if k in read} for of in (example.pulls, example.traces))
    return replace(example, campaign=replace(example.campaign, tests=tests), pulls=pulls, traces=traces)


def times(ingested: Ingested, factors: dict[str, float]) -> Ingested:
    def one(test_id: str, pull: Pull) -> Pull:
        factor = factors.get(test_id, 1.0)
        return replace(pull, static_N=factor * pull.static_N, sliding_N=factor * pull.sliding_N)

    return replace(ingested, pulls={i: one(i, pull) for i, pull in ingested.pulls.items()})


def test_a_campaign_without_slips_has_no_doubt(ingested: Ingested) -> None:
    assert sibling_doubts(ingested) == ()


@pytest.mark.parametrize("factor", [0.01, 0.1, 0.5, 2.0, 10.0, 1000.0])
@pytest.mark.parametrize("place", [0, 17, 40])
def test_one_pull_that_is_off_is_named_and_no_other(ingested: Ingested, factor: float, place: int) -> None:
    test_id = list(ingested.pulls)[place]
    (doubt,) = sibling_doubts(times(ingested, {test_id: factor}))
    assert f"test {test_id} " in doubt.name
    assert ("above" if factor > 1 else "below") in doubt.found


def test_a_load_with_a_digit_too_many_is_named_at_its_test(ingested: Ingested) -> None:
    tests = list(ingested.campaign.tests)
    k = next(k for k, t in enumerate(tests) if abs(t.normal_load_N - 0.505) < 0.01)
    tests[k] = replace(tests[k], normal_load_N=10 * tests[k].normal_load_N)
    (doubt,) = sibling_doubts(replace(ingested, campaign=replace(ingested.campaign, tests=tuple(tests))))
    assert f"test {tests[k].test_id} " in doubt.name
    assert "a decimal point in the load" in doubt.slip


@pytest.mark.parametrize("share", [0.25, 0.4])
def test_many_exports_in_another_unit_are_one_doubt(ingested: Ingested, share: float) -> None:
    names = list(ingested.pulls)
    spoiled = np.random.default_rng(1).permutation(names)[: round(share * len(names))]
    doubts = sibling_doubts(times(ingested, dict.fromkeys(spoiled, 1e-3)))
    assert f"friction of {len(spoiled)} of {len(names)} tests" in doubts[0].name
    assert "a thousand times smaller" in doubts[0].found
    assert "kilonewtons" in doubts[0].slip
    assert len(doubts) == 1


def test_what_tests_that_are_off_have_in_common_is_said(ingested: Ingested) -> None:
    first = [t.test_id for t in ingested.campaign.tests if t.specimen in ("A2", "B1", "F3")]
    (doubt, *_) = sibling_doubts(times(ingested, dict.fromkeys(first, 0.01)))
    assert "all of specimen A2, B1, F3" in doubt.place


def test_every_study_holds_the_doubt(ingested: Ingested) -> None:
    name = next(iter(ingested.pulls))
    study = with_doubts(tribo.Study(times(ingested, {name: 100.0})))
    assert any(f"test {name} " in doubt.name for doubt in study.doubts)


def test_loads_that_scatter_about_one_do_not_lead_to_another(ingested: Ingested) -> None:
    rng = np.random.default_rng(5)
    ids = list(ingested.pulls)[:40]
    chosen = [t for t in ingested.campaign.tests if t.test_id in ids]
    loads = {i: 5.0 + 0.01 * rng.standard_normal() for i in ids} | {ids[-1]: 0.42, ids[-2]: 4.7}
    tests = tuple(replace(t, sample="F", specimen="F", normal_load_N=float(loads[t.test_id])) for t in chosen)
    forces = {i: 0.5 * loads[i] * (1.0 + 0.03 * rng.standard_normal()) for i in ids}
    pulls = {i: replace(ingested.pulls[i], static_N=1.1 * forces[i], sliding_N=forces[i]) for i in ids}
    alike = replace(
        ingested, campaign=replace(ingested.campaign, tests=tests), pulls=pulls,
        traces={i: ingested.traces[i] for i in ids},
    )  # fmt: skip
    assert sibling_doubts(alike) == ()


def test_forces_of_one_sample_copied_from_another_are_named(ingested: Ingested) -> None:
    at = {(t.sample, t.normal_load_N, t.specimen[-1]): t.test_id for t in ingested.campaign.tests}
    pulls = dict(ingested.pulls)
    for (sample, load, body), test_id in at.items():
        if sample == "B":
            theirs = ingested.pulls[at["A", load, body]]
            pulls[test_id] = replace(pulls[test_id], static_N=theirs.static_N, sliding_N=theirs.sliding_N)
    doubts = sibling_doubts(replace(ingested, pulls=pulls))
    (copied,) = [d for d in doubts if "digit by digit" in d.found]
    assert copied.name == "friction of sample A"
    assert "12 of 12 pairs of forces are those of sample B" in copied.found


def test_forces_that_follow_a_power_of_the_load_are_no_slips(ingested: Ingested) -> None:
    """A straight line misses the ends of T = N^0.3 by more than a fifth."""
    rng = np.random.default_rng(4)
    loads = np.repeat(np.geomspace(0.5, 16.0, 6), 2)
    tests = tuple(
        replace(t, sample="S", specimen="S", normal_load_N=float(n))
        for t, n in zip(ingested.campaign.tests, loads, strict=False)
    )
    forces = loads**0.3 * np.exp(0.02 * rng.standard_normal(loads.size))
    pulls = {
        t.test_id: replace(ingested.pulls[t.test_id], static_N=float("nan"), sliding_N=float(f))
        for t, f in zip(tests, forces, strict=True)
    }
    powers = replace(ingested, campaign=replace(ingested.campaign, tests=tests), pulls=pulls)
    assert sibling_doubts(powers) == ()
    (doubt,) = sibling_doubts(times(powers, {tests[-1].test_id: 0.5}))
    assert f"test {tests[-1].test_id} " in doubt.name


def test_many_pulls_of_one_sample_that_lie_low_are_one_doubt_with_the_column_they_share(
    example: Ingested,
) -> None:
    whole = example.campaign
    of_sample = [t.test_id for t in whole.tests if t.sample == "B"]
    first = np.random.default_rng(0).permutation(of_sample)[:8].tolist()
    tests = tuple(replace(t, covariates={"cycle": str(2 - (t.test_id in first))}) for t in whole.tests)
    many = replace(example, campaign=replace(whole, tests=tests))
    doubt, *others = sibling_doubts(times(many, dict(zip(first, np.linspace(0.2, 0.4, len(first)), strict=True))))
    assert not others
    assert set(doubt.tests) == set(first)
    assert "friction of 8 tests of B" in doubt.name
    assert "all of cycle 1" in doubt.place
    assert re.fullmatch(r"between (5\d|6\d) % and a factor of [45](\.\d)? below that of siblings", doubt.found)


@pytest.mark.parametrize(("step", "way"), [(1, "down"), (-1, "up")])
def test_loads_that_slipped_by_a_row_are_named_with_the_tests_and_no_other(
    ingested: Ingested, step: int, way: str
) -> None:
    tests = [t for t in ingested.campaign.tests if t.test_id in ingested.pulls]
    order = np.random.default_rng(3).permutation(len(tests))
    tests = [tests[k] for k in order]
    loads = [t.normal_load_N for t in tests]
    slipped = loads[:20] + [loads[20:40][(k - step) % 20] for k in range(20)] + loads[40:]
    moved = tuple(replace(t, normal_load_N=load) for t, load in zip(tests, slipped, strict=True))
    doubt, *others = sibling_doubts(replace(ingested, campaign=replace(ingested.campaign, tests=moved)))
    wrong = {t.test_id for t, a, b in zip(tests, loads, slipped, strict=True) if a != b}
    assert {name for d in (doubt, *others) for name in d.tests} <= wrong
    assert len(doubt.tests) >= len(wrong) - 1  # the load that is left over may be that of either end
    assert f"move mass_g {'up' if way == 'down' else 'down'} by one row" in doubt.slip


def test_of_two_parts_that_differ_the_one_is_wrong_that_does_not_follow_the_loads(ingested: Ingested) -> None:
    rng = np.random.default_rng(4)
    cells: dict[tuple[str, float], list[str]] = {}
    for t in ingested.campaign.tests:
        if t.specimen.endswith(("1", "2")):
            cells.setdefault((t.sample, round(t.normal_load_N, 2)), []).append(t.test_id)
    chosen = [str(rng.choice(names)) for names in list(cells.values())[::3]]
    kept = tuple(t for t in ingested.campaign.tests if t.specimen.endswith(("1", "2")))
    few = replace(ingested, campaign=replace(ingested.campaign, tests=kept),
                  pulls={t.test_id: ingested.pulls[t.test_id] for t in kept})  # fmt: skip
    for factor in (100.0, 0.01):
        doubt, *_ = sibling_doubts(times(few, dict.fromkeys(chosen, factor)))
        assert set(doubt.tests) == set(chosen)
