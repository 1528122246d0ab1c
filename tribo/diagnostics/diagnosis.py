"""The diagnosis of a campaign: whether the model fails beyond chance, and which mechanism explains it."""

from __future__ import annotations

import numpy as np

from tribo.diagnostics.candidates import Rules, name_causes
from tribo.diagnostics.conclusion import Findings, conclude, exclusions
from tribo.diagnostics.contrasts import Progress, all_contrasts, screen
from tribo.diagnostics.diagnosis_record import Diagnosis
from tribo.diagnostics.direct_evidence import trace_findings
from tribo.diagnostics.fit import fit
from tribo.diagnostics.model import setup
from tribo.diagnostics.observations import enough, observe
from tribo.diagnostics.predictor import Predictor, tabled_predictor
from tribo.diagnostics.score_statistics import start_effects
from tribo.records import Ingested

REPLICATES = 120
REPLICATES_LEFT = 60


def examine(
    ingested: Ingested,
    *,
    seed: int = 0,
    level: float = 0.01,
    predictor: Predictor | None = None,
    progress: Progress | None = None,
    replicates: tuple[int, int] = (REPLICATES, REPLICATES_LEFT),
) -> Diagnosis:
    """Find out whether the calibrated model fails on a campaign beyond chance, and which mechanism explains it.

    Laws of what no mechanism explains are searched afterwards (:mod:`tribo.lawsearch`).

    Parameters
    ----------
    ingested : Ingested
        A campaign with its exports read.
    seed : int
        Of the simulated campaigns that stand for chance.
    level : float
        Chance of seeing a misfit where nothing is hidden.
    predictor : Predictor, optional
        Shares of the flat law per sample; those tabulated from simulations by default.
    progress : callable, optional
        Called with a stage, the steps done and the steps there are.
    replicates : (int, int)
        Simulated campaigns at most: for the first look, and for what a cause leaves.

    Returns
    -------
    Diagnosis
        The verdict with the fitted models and screens that it rests on.

    Raises
    ------
    FitError
        Fewer than twelve usable tests.
    """
    rng = np.random.default_rng(seed)
    observations = enough(observe(ingested))
    s = setup(observations, predictor or tabled_predictor(observations.patterns))
    baseline = fit(s)
    effects = start_effects(baseline)
    contrasts = all_contrasts(s, effects.changes)
    screened = screen(baseline, contrasts, replicates=replicates[0], rng=rng, progress=progress)
    evidence = trace_findings(observations)
    barred = exclusions(observations.conditions, evidence.found, effects.absorbed)
    named = None
    if screened.p.min() < level:
        rules = Rules([e.mechanism for e in barred], level, replicates[1], rng, progress)
        named = name_causes(effects, screened, rules)
    verdict = conclude(Findings(effects, screened, evidence, barred, named, level), rng)
    return Diagnosis(verdict, baseline, screened, named)
