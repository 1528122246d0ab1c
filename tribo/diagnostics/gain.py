"""How much better a named mechanism predicts tests that were left out of the fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import gammaln

from tribo.diagnostics.effect_sizes import rms_percent
from tribo.diagnostics.fit import ModelFit, fit_without
from tribo.diagnostics.model import Acting, Setup, Target
from tribo.diagnostics.normal_equations import model_columns
from tribo.diagnostics.observations import Observations
from tribo.diagnostics.verdict import Gain
from tribo.records import FloatArray

RESAMPLES = 400
MOST_FOLDS = 30  # of whole specimens: where there are more of them, several are left out at a time
UNKNOWN = 25.0  # variance of ln T: its factor is uncertain by e to the 5


def gain(before: ModelFit, after: ModelFit, rng: np.random.Generator) -> Gain | None:
    """What ``after`` gains over ``before`` on whole samples, specimens or loads left out.

    Both are fitted anew without the held-out tests, noise included. A mechanism whose choice cannot be learned
    from other specimens (a wrong label, a wrong pattern) has whole loads left out; otherwise whole samples are
    left out where there are at least four, else whole specimens. Of tests that ``after`` can say nothing about, because
    it acts on none of the others, it says what ``before`` does.
    """
    s = after.setup
    kind, labels = _folds(s, after.acting)
    if len(np.unique(labels)) < 2:
        return None
    scores = np.zeros((s.observations.n, 2))
    errors = np.zeros((s.observations.n, 2, 2))
    for label in np.unique(labels):
        out = labels == label
        without = _held_out(before, out)
        if without is None:
            continue
        for k, found in enumerate((without, _held_out(after, out) or without)):
            scores[out, k], errors[out, k] = found
    difference = scores[:, 1] - scores[:, 0]
    rmse_before, rmse_after = (rms_percent(errors[:, k]) for k in range(2))
    return Gain(
        held_out=kind,
        log_score_baseline=float(scores[:, 0].mean()),
        log_score_extended=float(scores[:, 1].mean()),
        difference=float(difference.mean()),
        se=_specimen_bootstrap(difference, s.observations.conditions.specimen, rng),
        rmse_percent_before=rmse_before,
        rmse_percent_after=rmse_after,
    )


def _folds(s: Setup, acting: Sequence[Acting]) -> tuple[str, np.ndarray]:
    c = s.observations.conditions
    if any(a.mechanism.choosing.held_out == "loads" for a in acting):
        return "loads", np.round(c.normal_load_N, 4).astype(str)
    if len(np.unique(c.sample)) >= 4:
        return "samples", c.sample
    names, code = np.unique(c.specimen, return_inverse=True)
    return "specimens", names[code % MOST_FOLDS]


def _held_out(model: ModelFit, out: np.ndarray) -> tuple[FloatArray, FloatArray] | None:
    """Log density per held-out test and its error in ln T (m, 2), the model fitted to all other tests; None where these
    leave T unknown."""
    trained = fit_without(model, out)
    s = model.setup
    target, x = Target(s, trained.acting), np.concatenate([trained.law, *trained.values])
    residual = target.residual(x)
    error = (residual - s.random_effects.on_tests(trained.effects))[out]
    jacobian = target.jacobian(x, s.observations.log_force - residual)
    columns = model_columns(jacobian[out], s.random_effects.take(out))
    spread = trained.inverse.spread(columns)[0][[[0, 1], [1, 2]]].transpose(2, 0, 1)
    if np.abs(spread).max() > UNKNOWN:
        return None
    reading = s.observations.reading[out][:, :, None] ** 2 * np.eye(2)
    scale = spread + trained.noise.per_test(s)[out] + reading
    distance = np.einsum("ni,nij,nj->n", error, np.linalg.inv(scale), error)
    tail = trained.noise.tail
    constant = gammaln(tail / 2 + 1) - gammaln(tail / 2) - np.log(np.pi * tail)
    density = constant - 0.5 * np.linalg.slogdet(scale)[1] - (tail / 2 + 1) * np.log1p(distance / tail)
    return density, error


def gain_of_zero(o: Observations, drifting: bool, rng: np.random.Generator) -> Gain | None:
    """The same for the force before contact: a load cell at zero against one with an offset, or with a drift.

    Whole specimens are left out; RMSE is in percent of the median sliding force.
    """
    hours = o.conditions.elapsed_s / 3600.0
    usable = np.isfinite(o.zero_N) & (np.isfinite(hours) if drifting else True)
    zero, hours, specimen = o.zero_N[usable], hours[usable], o.conditions.specimen[usable]
    if len(np.unique(specimen)) < 2:
        return None
    scores, errors = np.zeros((len(zero), 2)), np.zeros((len(zero), 2))
    for name in np.unique(specimen):
        out = specimen == name
        line = np.polyfit(hours[~out], zero[~out], 1) if drifting else np.array([np.median(zero[~out])])
        for k, polynomial in enumerate((np.zeros(1), line)):
            spread = max(float(np.sqrt(np.mean((zero - np.polyval(polynomial, hours))[~out] ** 2))), 1e-9)
            errors[out, k] = zero[out] - np.polyval(polynomial, hours[out])
            scores[out, k] = -np.log(spread * np.sqrt(2 * np.pi)) - 0.5 * (errors[out, k] / spread) ** 2
    difference = scores[:, 1] - scores[:, 0]
    rmse = 100 * np.sqrt(np.mean(errors**2, axis=0)) / float(np.exp(np.median(o.log_force[:, 1])))
    return Gain(
        "specimens", float(scores[:, 0].mean()), float(scores[:, 1].mean()), float(difference.mean()),
        _specimen_bootstrap(difference, specimen, rng), float(rmse[0]), float(rmse[1]),
    )  # fmt: skip


def _specimen_bootstrap(difference: FloatArray, specimen: np.ndarray, rng: np.random.Generator) -> float:
    """Standard error of the mean difference, whole specimens resampled."""
    names, code = np.unique(specimen, return_inverse=True)
    total = np.bincount(code, difference)
    count = np.bincount(code).astype(float)
    drawn = rng.integers(0, len(names), (RESAMPLES, len(names)))
    return float(np.std(total[drawn].sum(axis=1) / count[drawn].sum(axis=1)))
