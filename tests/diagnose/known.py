"""Campaigns that follow the model of the diagnosis exactly, but for a change of ln T that a test chooses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from blind.tribometer import Design, hide

from tribo.diagnostics.contrasts import Contrast, all_contrasts
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.model import Acting, Setup, predict, setup, start_changes
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.lawsearch.grammar import corrects_a_pattern
from tribo.lawsearch.scoring import Grammar, Projection
from tribo.mechanisms import MECHANISMS
from tribo.records import Ingested

from .synthetic import SMALL, ingested

LAW = np.array([4.8, 23.0, 3.0, 11.6])  # mu and tau0 in kPa, static then sliding
Change = Callable[[Setup], np.ndarray]


def made(
    change: Change, seed: int, design: Design = SMALL, repeat_sd: tuple[float, float] = (0.09, 0.07)
) -> Ingested:
    """A campaign of ``design``: the model's own prediction, plus ``change`` (n, 2), plus the noise of repeats."""
    bench = hide(3, [], design)
    s = setup_of(ingested(bench))
    noise = np.random.default_rng(seed).normal(size=(s.observations.n, 2)) * repeat_sd
    bench.static, bench.sliding = np.exp(predict(s, LAW, (), ()) + change(s) + noise).T
    return ingested(bench)


def baseline(campaign: Ingested) -> ModelFit:
    """The model without mechanisms, fitted."""
    return fit(setup_of(campaign))


def acting(name: str, *values: float) -> Change:
    """What a mechanism changes in ln T."""
    return lambda s: predict(s, LAW, (Acting(MECHANISMS[name]),), (np.array(values),)) - predict(s, LAW, (), ())


def setup_of(campaign: Ingested) -> Setup:
    o = observe(campaign)
    return setup(o, tabled_predictor(o.patterns))


def contrasts_of(f: ModelFit) -> list[Contrast]:
    """Every contrast of a fitted model."""
    candidates, courses, _ = start_changes(f.setup, f.law)
    return all_contrasts(f.setup, f.law, candidates, courses)


def net_of(laws: Grammar, projected: Projection) -> np.ndarray:
    """What each law gains less its cost, (r, laws); those that correct a pattern are none."""
    found = projected.gains(laws.courses, laws.acts) - laws.courses.cost - laws.scope_cost[:, None]
    found[:, corrects_a_pattern(laws.scopes, laws.courses.shapes)] = -np.inf
    return found.reshape(len(found), -1)
