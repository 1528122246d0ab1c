"""Scatter of specimens moved towards that of all samples: what it gives, and where a sample keeps its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tribo.fitting import fit_samples
from tribo.fitting.budget import PRIOR_DOF, at_least, partly_pooled
from tribo.fitting.linear import Rows, sample_rows
from tribo.records import LawFit

AREA = 55e-6
LOADS = np.array([0.06, 0.26, 0.5, 1.4])
LAWS = {"A": (4.0, 18e3), "B": (3.5, 10e3), "C": (4.2, 7e3), "F": (4.8, 23e3)}


def made(spread: dict[str, float], specimens: int = 3, seed: int = 0) -> tuple[tuple[LawFit, ...], dict[str, Rows]]:
    """Specimens whose force is off by a gain of 5 % (or that of ``spread``), pulled without further scatter."""
    rng = np.random.default_rng(seed)
    rows = [
        (sample, f"{sample}{k}", load, gain * (mu * load + tau0 * AREA))
        for sample, (mu, tau0) in LAWS.items()
        for k in range(specimens)
        for gain in [1 + spread.get(sample, 0.05) * rng.standard_normal()]
        for load in LOADS
    ]
    table = pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "static_N"])
    return fit_samples(table, "static", AREA), {r.sample: r for r in sample_rows(table, "static")}


def share(fit: LawFit) -> float:
    return fit.standard_uncertainty("mu") / fit.value("mu")


def test_specimens_that_agree_by_luck_get_the_mean_scatter_of_all_samples() -> None:
    fits, rows = made({"C": 0.0})
    pooled = {fit.sample: fit for fit in partly_pooled(fits, rows)}
    own = {fit.sample: fit for fit in fits}
    others = np.sqrt(np.mean([share(own[s]) ** 2 for s in LAWS]))
    assert share(own["C"]) < 1e-9
    assert share(pooled["C"]) == pytest.approx(others, rel=1e-6)
    assert pooled["C"].dof == 2 * len(LAWS)
    np.testing.assert_array_equal(pooled["C"].values, own["C"].values)


def test_a_sample_that_scatters_more_than_the_others_keeps_an_interval_wider_than_theirs() -> None:
    ratios = []
    for seed in range(15):
        pooled = {fit.sample: fit for fit in partly_pooled(*made({"B": 0.3}, seed=seed))}
        ratios.append(share(pooled["B"]) / np.mean([share(pooled[s]) for s in ("A", "C", "F")]))
    assert np.median(ratios) > 1.3


def test_specimens_that_differ_more_than_the_others_are_believed_in_part() -> None:
    fits, rows = made({"B": 0.3})
    pooled, own = ({f.sample: f for f in each} for each in (partly_pooled(fits, rows), fits))
    mean = np.mean([share(own[s]) ** 2 for s in LAWS])
    assert share(own["B"]) ** 2 > mean
    expected = (PRIOR_DOF * mean + 2 * share(own["B"]) ** 2) / (PRIOR_DOF + 2)
    assert share(pooled["B"]) ** 2 == pytest.approx(expected, rel=1e-6)
    assert pooled["B"].dof == PRIOR_DOF + 2


def test_a_sample_of_one_specimen_gets_an_interval_for_its_pattern() -> None:
    fits, rows = made({})
    one = next(fit for fit in fits if fit.sample == "A")
    first = dict(list(one.specimens.items())[:1])
    lone = replace(one, specimens=first, values=next(iter(first.values())), notes=("only one specimen: the interval",))
    pooled = partly_pooled((lone, *(fit for fit in fits if fit.sample != "A")), rows)[0]
    assert share(pooled) > 0.01
    assert pooled.dof == PRIOR_DOF


def test_one_sample_alone_keeps_its_own_covariance() -> None:
    fits, rows = made({})
    assert partly_pooled(fits[:1], rows) == fits[:1]


def test_a_force_that_is_not_positive_is_not_compared_with_others() -> None:
    fits, rows = made({})
    below = replace(fits[0], values=np.array([4.0, -2e4]))
    assert partly_pooled((below, *fits[1:]), rows)[0] is below


def test_a_floor_holds_in_every_combination_of_the_parameters() -> None:
    fits, _ = made({"A": 1e-6})
    floor = np.array([[0.04, -200.0], [-200.0, 4e6]])
    raised = at_least(fits[0], floor).covariance
    for angle in np.linspace(0, np.pi, 7):
        by = np.array([np.cos(angle), 1e-4 * np.sin(angle)])
        assert by @ raised @ by >= by @ floor @ by * (1 - 1e-9)
    np.testing.assert_allclose(at_least(fits[1], floor * 1e-12).covariance, fits[1].covariance)
