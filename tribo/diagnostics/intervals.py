"""Values and intervals of a mechanism's parameters.

From the curvature, or by profile likelihood near a bound, and averaged over how wrong the model's patterns may be:
the predictor states a size for their error, and a campaign of several patterns tells whether it is that large here.

Whether the patterned samples differ from the model by more than the model's own error.

By how much the model is wrong for each patterned sample: the estimated pattern error with its interval.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.model import FIXED, N_LAW, PATTERN
from tribo.diagnostics.replicates import drawn_residuals, refits
from tribo.diagnostics.scatter import Noise, log_size_prior
from tribo.diagnostics.verdict import Estimate
from tribo.mechanisms.record import Mechanism
from tribo.records import REGIMES, FloatArray

NORMAL_90 = 1.645
DROP_90 = 0.5 * NORMAL_90**2  # of the log likelihood at the ends of a 90 % interval
NEAR = 2.0 * NORMAL_90  # standard errors from a bound within which the curvature is not trusted
REPLICATES, WIDEST = 80, 1.5  # campaigns that show how far estimates scatter; a factor beyond this is their chance
SMALLEST_SHARE = 1e-6  # of the way to a bound
PATTERN_STEPS = np.linspace(-0.8, 1.2, 6)  # of the logarithm of the pattern error about its estimate, to average over


def recovered(f: ModelFit, index: int) -> list[tuple[float, float, float]]:
    """Value and 90 % interval (value, low, high) of every parameter of the mechanism ``index`` of a fit.

    The average over the error of the model's patterns, each size weighed by how likely it makes the campaign.
    """
    if not (f.setup.group == PATTERN).any():
        return [(float(v), *ends) for v, ends in zip(f.values[index], intervals(f, index), strict=True)]
    weight, fits = over_pattern_error(f)
    ends = np.array([intervals(g, index) for g in fits])  # (errors, parameters, 2)
    values = np.array([g.values[index] for g in fits])
    wider = understated(f, index)
    return [
        _averaged(weight, values[:, k], ends[:, k], wider[k], (p.low, p.high))
        for k, p in enumerate(f.acting[index].mechanism.parameters)
    ]


def estimates(f: ModelFit, index: int) -> dict[str, Estimate]:
    """The same, by the name of the parameter."""
    parameters = f.acting[index].mechanism.parameters
    return {p.name: Estimate(*found, p.unit) for p, found in zip(parameters, recovered(f, index), strict=True)}


def understated(f: ModelFit, index: int) -> FloatArray:
    """Factor (at least one) by which the standard errors of a mechanism's parameters are too small.

    The curvature knows neither that the weights of the tests are estimated nor that the repeats need not follow the t
    distribution. Campaigns that the fit makes itself, with its own residuals, show how far their estimates scatter.
    """
    _, solution, variances, _ = refits(f, drawn_residuals(f, np.random.default_rng(0), REPLICATES))
    first = N_LAW + sum(len(v) for v in f.values[:index])
    here = slice(first, first + len(f.values[index]))
    variance = variances[:, here] / informed_share(f.noise)
    squares = solution[:, here] ** 2 / np.maximum(variance, 1e-300)
    return np.asarray(np.clip(np.sqrt(np.mean(squares, axis=0)), 1.0, WIDEST))


def over_pattern_error(f: ModelFit) -> tuple[FloatArray, list[ModelFit]]:
    """The fit at several sizes of the pattern error, and how likely each makes the campaign, adding to one."""
    factors = f.noise.pattern * np.exp(PATTERN_STEPS)
    fits = [with_pattern_error(f, factor) for factor in factors]
    log_weight = np.array([g.score + _log_freedom(g) for g in fits]) + log_size_prior(PATTERN, factors)
    weight = np.exp(log_weight - log_weight.max())
    return weight / weight.sum(), fits


def _log_freedom(f: ModelFit) -> float:
    """What integrating over law and mechanisms adds to the log likelihood (restricted likelihood), up to a constant."""
    p = N_LAW + sum(len(v) for v in f.values)
    free = np.diag(f.covariance)[:p] > 0.0
    scale = np.sqrt(np.diag(f.covariance)[:p][free])
    correlation = f.covariance[:p, :p][np.ix_(free, free)] / np.outer(scale, scale)
    return float(np.sum(np.log(scale)) + 0.5 * np.linalg.slogdet(correlation)[1])


def with_pattern_error(f: ModelFit, factor: float) -> ModelFit:
    """The fit with the error of the patterns held at ``factor`` times what the predictor states."""
    s = f.setup
    here = s.group == PATTERN
    held = replace(s, unit=np.where(here, factor * s.unit, s.unit), group=np.where(here, FIXED, s.group))
    return fit(held, f.acting, start=f, iterations=15)


def _averaged(
    weight: FloatArray, values: FloatArray, ends: FloatArray, wider: float, bounds: tuple[float, float]
) -> tuple[float, float, float]:
    """Mean, and ends whose distance has the mean square of the single ones, ``wider`` times, and of what the values
    differ by."""
    value = float(weight @ values)
    apart = weight @ (NORMAL_90 * (values - value)) ** 2
    squares = wider**2 * (weight @ (ends - values[:, None]) ** 2) + apart
    below, above = np.sqrt(squares).tolist()
    return value, max(value - below, bounds[0]), min(value + above, bounds[1])


def intervals(f: ModelFit, index: int) -> list[tuple[float, float]]:
    """90 % interval of every parameter of the mechanism ``index`` of a fit, kept inside the bounds.

    The error of the model's patterns is taken as assumed. Where one parameter lies at a bound or near it, the intervals
    of all are profile likelihoods, the others and the flat law fitted anew at each value; the noise stays that of the
    fit.
    """
    errors = standard_errors(f, index)
    parameters = f.acting[index].mechanism.parameters
    values = f.values[index]
    clear = all(
        e > 0 and v - NEAR * e > p.low and v + NEAR * e < p.high
        for v, e, p in zip(values, errors, parameters, strict=True)
    )
    if clear:
        return [(float(v - NORMAL_90 * e), float(v + NORMAL_90 * e)) for v, e in zip(values, errors, strict=True)]
    return [_profile(f, index, k, errors[k]) for k in range(len(parameters))]


def standard_errors(f: ModelFit, index: int) -> list[float]:
    """Of every parameter of one mechanism, from the curvature; zero for one held at a bound."""
    first = N_LAW + sum(len(v) for v in f.values[:index])
    diagonal = np.diag(f.covariance)[first : first + len(f.values[index])]
    return [float(np.sqrt(max(d, 0.0) / informed_share(f.noise))) for d in diagonal]


def informed_share(noise: Noise) -> float:
    """Of the information in the weighted normal equations, what a pull really tells about its location.

    Under the bivariate t with ``tail`` degrees of freedom the expected information is smaller by
    (tail + 2) / (tail + 4) (Lange, Little and Taylor, JASA 84, 881, 1989, appendix B).
    """
    return (noise.tail + 2.0) / (noise.tail + 4.0)


def _profile(f: ModelFit, index: int, k: int, error: float) -> tuple[float, float]:
    p = f.acting[index].mechanism.parameters[k]
    return _end(f, index, k, p.low, error), _end(f, index, k, p.high, error)


def _end(f: ModelFit, index: int, k: int, bound: float, error: float) -> float:
    """Where the profile falls by DROP_90 between the estimate and a bound; the bound where it does not."""
    from scipy.optimize import brentq

    best = float(f.values[index][k])
    if best == bound or f.score - _score_at(f, index, k, bound) < DROP_90:
        return bound

    def excess(share: float) -> float:
        return f.score - _score_at(f, index, k, best + share * (bound - best)) - DROP_90

    outside = 1.0
    inside = min(2.0 * error / abs(bound - best), 0.5) or 0.1
    while excess(inside) > 0.0 and inside > SMALLEST_SHARE:
        inside, outside = 0.2 * inside, inside
    share = brentq(excess, inside, outside, rtol=0.05) if inside > SMALLEST_SHARE else inside
    return best + float(share) * (bound - best)


def _score_at(f: ModelFit, index: int, k: int, value: float) -> float:
    """Log likelihood with one parameter held at a value and everything but the noise fitted anew."""
    acting, values = list(f.acting), [v.copy() for v in f.values]
    acting[index] = replace(acting[index], mechanism=_held(acting[index].mechanism, k, value))
    values[index][k] = value
    begin = replace(f, acting=tuple(acting), values=tuple(values))
    return fit(f.setup, acting, start=begin, noise=f.noise, iterations=12).score


def _held(mechanism: Mechanism, k: int, value: float) -> Mechanism:
    parameters = list(mechanism.parameters)
    parameters[k] = replace(parameters[k], low=value, high=value)
    return replace(mechanism, parameters=tuple(parameters))


WITHIN = 1.5  # times the stated error of the model: the range for which docs/blind.md counts false alarms


@dataclass(frozen=True)
class PatternExcess:
    """How far the patterned samples are from the model.

    ``factor`` is the estimated error of the model over the stated one, ``p`` the chance of such a factor where the true
    one is at most WITHIN. ``percent`` holds the mean of measured over modelled T, less one, in percent, by sample as
    (static, sliding).
    """

    factor: float
    p: float
    percent: Mapping[str, tuple[float, float]]


def pattern_excess(f: ModelFit) -> PatternExcess | None:
    """Likelihood ratio of the estimated factor against WITHIN, one-sided; None where the factor is not larger."""
    s = f.setup
    patterns = s.group[s.random_effects.of_specimens :] == PATTERN
    if not patterns.any() or f.noise.pattern <= WITHIN:
        return None
    ratio = 2.0 * (f.score - with_pattern_error(f, WITHIN).score)
    correction = s.random_effects.shared[:, :, patterns] @ s.random_effects.parts(f.effects)[1][patterns]
    sample = s.observations.conditions.sample
    percent = {
        str(name): (float(mean[0]), float(mean[1]))
        for name in np.unique(sample)
        if np.any(mean := 100.0 * np.expm1(correction[sample == name].mean(axis=0)))
    }
    return PatternExcess(f.noise.pattern, _one_sided(ratio), percent)


def _one_sided(ratio: float) -> float:
    from scipy.stats import chi2

    return max(0.5 * float(chi2.sf(max(ratio, 0.0), 1)), 1e-12)


@dataclass(frozen=True)
class Percent:
    """100 (measured / model - 1) with its 90 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class PatternCorrection:
    """What the measurement of one sample in one regime is over the model, on average over its tests and at loads (N).

    ``p`` is the chance of such a mean correction where the model is right, adjusted for the number of corrections.
    """

    sample: str
    regime: str
    mean: Percent
    at_load: dict[float, Percent]
    p: float


def pattern_corrections(f: ModelFit) -> list[PatternCorrection]:
    """The corrections of all patterned samples, static before sliding; none where no sample is patterned.

    The estimates are shrunk towards the model by as much as the campaign itself suggests: the size of the pattern error
    is learnt from all samples together, and the estimates are averaged over how large it may be.
    """
    s = f.setup
    patterns = np.flatnonzero(s.group[s.random_effects.of_specimens :] == PATTERN)
    if not len(patterns):
        return []
    effects, spread = _averaged_pattern_correction(f, patterns)
    columns = s.random_effects.shared[:, :, patterns]
    sample, load = s.observations.conditions.sample, s.observations.conditions.normal_load_N
    there = [str(name) for name in np.unique(sample) if np.any(columns[sample == name])]
    found = []
    for name in there:
        for k, regime in enumerate(REGIMES):
            rows = columns[sample == name, k]
            mean, sd = _estimate(rows.mean(axis=0), effects, spread)
            chance = min(2.0 * float(norm.sf(abs(mean) / sd)) * 2 * len(there), 1.0)
            at = {
                float(f"{load[sample == name][i]:.4g}"): _percent(*_estimate(rows[i], effects, spread))
                for i in _three(load[sample == name])
            }
            found.append(PatternCorrection(name, regime, _percent(mean, sd), at, chance))
    return found


def _averaged_pattern_correction(f: ModelFit, patterns: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Shared effects and their covariance over the sizes that the pattern error may have."""
    weight, fits = over_pattern_error(f)
    effects = np.array([f.setup.random_effects.parts(g.effects)[1][patterns] for g in fits])
    mean = weight @ effects
    apart = np.einsum("i,ip,iq->pq", weight, effects - mean, effects - mean)
    here = f.linear.columns.parameters + patterns
    within = [g.inverse.border[0][np.ix_(here, here)] / informed_share(g.noise) for g in fits]
    return mean, np.tensordot(weight, np.array(within), axes=1) + apart


def _estimate(row: FloatArray, effects: FloatArray, spread: FloatArray) -> tuple[float, float]:
    """Value and standard error of a combination of random effects."""
    return float(row @ effects), float(np.sqrt(row @ spread @ row)) + 1e-12


def _percent(value: float, sd: float) -> Percent:
    low, middle, high = (100.0 * float(np.expm1(value + k * NORMAL_90 * sd)) for k in (-1, 0, 1))
    return Percent(middle, low, high)


def _three(load: FloatArray) -> list[int]:
    """Tests at the lowest, the middle and the highest load."""
    order = np.argsort(load, kind="stable")
    return list(dict.fromkeys(int(order[k]) for k in (0, len(order) // 2, len(order) - 1)))
