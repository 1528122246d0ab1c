"""What a fit says of a mechanism: parameters with intervals, what patterns differ by, the gain on tests left out.

Intervals follow from the curvature, or from the profile likelihood near a bound, and are averaged over how wrong the
model's patterns may be: the predictor states a size for their error, and a campaign of several patterns tells whether
it is that large here. The gain is a cross-validation by whole samples, specimens or loads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, softmax
from scipy.stats import chi2, norm

from tribo.diagnostics.effect_sizes import NORMAL_90, rms_percent
from tribo.diagnostics.fit import ModelFit, fit, fit_without, precision_of
from tribo.diagnostics.model import (
    ALIKE_IN_BOTH,
    DRIFT,
    N_LAW,
    OF_PATTERNS,
    SESSION,
    SPECIMEN_DRIFT,
    WITHIN,
    Acting,
    Setup,
    Target,
    along_what_it_follows,
    effect_of,
)
from tribo.diagnostics.normal_equations import Normal, block_cholesky, model_columns
from tribo.diagnostics.observations import Observations, along_specimens
from tribo.diagnostics.replicates import drawn_residuals, refits
from tribo.diagnostics.scatter import SIZE_PRIORS, Noise, held_at, held_still, log_size_prior, prior_sd
from tribo.diagnostics.verdict import Estimate, Gain, Layer, Nuisance
from tribo.records import REGIMES, FloatArray

DROP_90 = 0.5 * NORMAL_90**2  # of the log likelihood at the ends of a 90 % interval
NEAR = 2.0 * NORMAL_90  # standard errors from a bound within which the curvature is not trusted
REPLICATES, WIDEST = 80, 1.5  # campaigns that show how far estimates scatter; a factor beyond this is their chance
SMALLEST_SHARE = 1e-6  # of the way to a bound
RESAMPLES = 400
MOST_FOLDS = 30  # of whole specimens: where there are more of them, several are left out at a time
UNKNOWN = 25.0  # variance of ln T: its factor is uncertain by e to the 5
FORM_SHARES = (0.03, 0.06, 0.12)  # of its own effect, by which a formula may be off along a column, to average over
PATTERN_STEPS = np.linspace(-0.8, 1.2, 6)  # of the logarithm of the pattern error about its estimate, to average over


def recovered(f: ModelFit, index: int) -> list[tuple[float, float, float]]:
    """Value and 90 % interval (value, low, high) of every parameter of the mechanism ``index`` of a fit.

    The average over the error of the model's patterns, each size weighed by how likely it makes the campaign.
    """
    if not f.setup.of_patterns.any():
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
    """The values and intervals of :func:`recovered`, by the name of the parameter."""
    parameters = f.acting[index].mechanism.parameters
    return {p.name: Estimate(*found, p.unit) for p, found in zip(parameters, recovered(f, index), strict=True)}


def with_open_form(f: ModelFit, index: int) -> dict[str, Estimate]:
    """The values and intervals of the parameters of a mechanism whose formula may be nearly right only.

    Its change of ln T may differ by a smooth course along what it follows. How large that is, the campaign tells: the
    average over FORM_SHARES, each weighed by how likely it makes the campaign. What an interval widens by, it widens by
    on both sides in proportion.
    """
    weight, fits = _open_forms(f, index)
    values = np.array([g.values[index] for g in fits])
    variances = np.array([standard_errors(g, index) for g in fits]) ** 2
    middle = weight @ values
    further = np.maximum(weight @ (variances + (values - middle) ** 2) - variances[0], 0.0)
    found = {}
    each = zip(f.acting[index].mechanism.parameters, recovered(f, index), strict=True)
    for k, (p, (value, low, high)) in enumerate(each):
        half = max(0.5 * (high - low), 1e-300)
        wider = float(np.hypot(half, NORMAL_90 * np.sqrt(further[k]))) / half
        below, above = wider * (value - low), wider * (high - value)
        value = float(np.clip(value + middle[k] - values[0, k], p.low, p.high))
        found[p.name] = Estimate(value, max(value - below, p.low), min(value + above, p.high), p.unit)
    return found


def change_with_open_form(f: ModelFit, index: int, change: Callable[[FloatArray], float]) -> FloatArray:
    """The value and the interval, (3,), of the ``change`` that all parameters (k,) of a mechanism make together, its
    formula nearly right only (:func:`with_open_form`).

    Where the data tell the change and not each parameter, the interval of one parameter alone says far too much of it.
    """
    weight, fits = _open_forms(f, index)
    changes, variances = (np.array(each) for each in zip(*(_propagated(g, index, change) for g in fits), strict=True))
    middle = float(weight @ changes)
    variance = weight @ (understated(f, index)[0] ** 2 * variances + (changes - middle) ** 2)
    if f.setup.of_patterns.any():
        likely, others = over_pattern_error(f)
        moved = np.array([change(g.values[index]) for g in others])
        variance += likely @ (moved - likely @ moved) ** 2
    half = NORMAL_90 * float(np.sqrt(variance))
    return middle + half * np.array([0.0, -1.0, 1.0])


def _propagated(f: ModelFit, index: int, change: Callable[[FloatArray], float]) -> tuple[float, float]:
    """A change by the parameters of one mechanism, and its variance by their joint covariance."""
    values, slopes = f.values[index], []
    for k, p in enumerate(f.acting[index].mechanism.parameters):
        step = 1e-4 * (p.high - p.low)
        low, high = (np.clip(values[k] + side * step, p.low, p.high) for side in (-1.0, 1.0))
        ends = [np.where(np.arange(len(values)) == k, end, values) for end in (low, high)]
        slopes.append((change(ends[1]) - change(ends[0])) / (high - low))
    return change(values), float(np.array(slopes) @ _covariance(f, index) @ np.array(slopes))


def _open_forms(f: ModelFit, index: int) -> tuple[FloatArray, list[ModelFit]]:
    """The fit with the formula of a mechanism right and off by FORM_SHARES, and how likely each makes the campaign."""
    fits = [f] + [_with_form(f, index, share) for share in FORM_SHARES]
    return softmax(np.array([g.score + _log_freedom(g) for g in fits])), fits


def _with_form(f: ModelFit, index: int, share: float) -> ModelFit:
    """The fit where the change of ln T by a mechanism may differ by a ``share`` of itself, in a smooth course."""
    s, acting = f.setup, f.acting[index]
    courses = along_what_it_follows(acting, s.observations.conditions)
    if not courses.shape[1]:
        return f
    change = effect_of(s, f.law, acting, f.values[index])
    wider = s.with_effects(change[:, :, None] * courses[:, None, :], np.full(courses.shape[1], share))
    return fit(wider, f.acting, start=f, iterations=15)


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
    fits = [with_pattern_error(f, factor) for factor in pattern_factor(f) * np.exp(PATTERN_STEPS)]
    log_weight = np.array([g.score + _log_freedom(g) for g in fits])
    for group in OF_PATTERNS:
        log_weight += log_size_prior(group, f.noise.sizes[group] * np.exp(PATTERN_STEPS))
    return softmax(log_weight), fits


def _log_freedom(f: ModelFit) -> float:
    """What integrating over law and mechanisms adds to the log likelihood (restricted likelihood), up to a constant."""
    p = N_LAW + sum(len(v) for v in f.values)
    free = np.diag(f.covariance)[:p] > 0.0
    scale = np.sqrt(np.diag(f.covariance)[:p][free])
    correlation = f.covariance[:p, :p][np.ix_(free, free)] / np.outer(scale, scale)
    return float(np.sum(np.log(scale)) + 0.5 * np.linalg.slogdet(correlation)[1])


def pattern_factor(f: ModelFit) -> float:
    """The estimated error of the patterns over what the predictor states, root mean square over tests and regimes."""
    s = f.setup
    patterns = np.flatnonzero(s.of_patterns)
    stated = (s.shared[:, :, patterns - s.of_specimens] * s.unit[patterns]) ** 2
    there = stated.sum(axis=2) > 0.0
    return float(np.sqrt(np.mean((stated @ f.noise.sizes[s.group[patterns]] ** 2)[there] / stated.sum(axis=2)[there])))


def with_pattern_error(f: ModelFit, factor: float) -> ModelFit:
    """The fit with the error of the patterns held at ``factor`` times what the predictor states; what both regimes have
    in common of it stays as it is."""
    held = held_at(f.setup, f.setup.of_patterns, f.noise.sizes * factor / pattern_factor(f))
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
    each = zip(parameters, errors, strict=True)
    return [(_end(f, index, k, p.low, e), _end(f, index, k, p.high, e)) for k, (p, e) in enumerate(each)]


def standard_errors(f: ModelFit, index: int) -> list[float]:
    """Of every parameter of one mechanism, from the curvature; zero for one held at a bound."""
    return [float(np.sqrt(max(d, 0.0))) for d in np.diag(_covariance(f, index))]


def _covariance(f: ModelFit, index: int) -> FloatArray:
    """Of the parameters (k,) of one mechanism, from the curvature, (k, k)."""
    first = N_LAW + sum(len(v) for v in f.values[:index])
    here = slice(first, first + len(f.values[index]))
    return f.covariance[here, here] / informed_share(f.noise)


def informed_share(noise: Noise) -> float:
    """Of the information in the weighted normal equations, what a pull really tells about its location.

    Under the bivariate t with ``tail`` degrees of freedom the expected information is smaller by
    (tail + 2) / (tail + 4) (Lange, Little and Taylor, JASA 84, 881, 1989, appendix B).
    """
    return (noise.tail + 2.0) / (noise.tail + 4.0)


def _end(f: ModelFit, index: int, k: int, bound: float, error: float) -> float:
    """Where the profile falls by DROP_90 between the estimate and a bound; the bound where it does not."""
    from scipy.optimize import brentq

    best = float(f.values[index][k])
    score_at = cache(lambda value: _score_at(f, index, k, value))  # the search asks for its ends again
    if best == bound or f.score - score_at(bound) < DROP_90:
        return bound

    def excess(share: float) -> float:
        return f.score - score_at(best + share * (bound - best)) - DROP_90

    outside = 1.0
    inside = min(2.0 * error / abs(bound - best), 0.5) or 0.1
    while excess(inside) > 0.0 and inside > SMALLEST_SHARE:
        inside, outside = 0.2 * inside, inside
    share = brentq(excess, inside, outside, rtol=0.05) if inside > SMALLEST_SHARE else inside
    return best + float(share) * (bound - best)


def _score_at(f: ModelFit, index: int, k: int, value: float) -> float:
    """Log likelihood with one parameter held at a value and everything but the noise fitted anew."""
    acting, values = list(f.acting), [v.copy() for v in f.values]
    parameters = list(acting[index].mechanism.parameters)
    parameters[k] = replace(parameters[k], low=value, high=value)
    held = replace(acting[index].mechanism, parameters=tuple(parameters))
    acting[index] = replace(acting[index], mechanism=held)
    values[index][k] = value
    begin = replace(f, acting=tuple(acting), values=tuple(values))
    return fit(f.setup, acting, start=begin, noise=f.noise, iterations=12).score


def pattern_excess(f: ModelFit) -> tuple[float, float] | None:
    """The estimated error of the model over the stated one, and the chance of such a factor where the true one is at
    most WITHIN (likelihood ratio, one-sided); None where the factor is not larger."""
    s = f.setup
    if not s.of_patterns.any() or (found := pattern_factor(f)) <= WITHIN:
        return None
    ratio = 2.0 * (f.score - with_pattern_error(f, WITHIN).score)
    return found, max(0.5 * float(chi2.sf(max(ratio, 0.0), 1)), 1e-12)


def pattern_corrections(f: ModelFit) -> list[Layer]:
    """How far the measurement of every patterned sample is from the model, static before sliding: on average over its
    tests, and as parameters at loads (N). p values are adjusted for the number of corrections.

    The estimates are shrunk towards the model by as much as the campaign itself suggests: the size of the pattern error
    is learnt from all samples together, and the estimates are averaged over how large it may be. Of the loads, the
    lowest, the middle and the highest are given.
    """
    s = f.setup
    patterns = np.flatnonzero(s.of_patterns[s.of_specimens :])
    if not len(patterns):
        return []
    weight, fits = over_pattern_error(f)
    each = np.array([g.effects[s.of_specimens :][patterns] for g in fits])
    effects = weight @ each
    apart = np.einsum("i,ip,iq->pq", weight, each - effects, each - effects)
    here = f.columns.parameters + patterns
    within = [g.inverse.border[0][np.ix_(here, here)] / informed_share(g.noise) for g in fits]
    spread = np.tensordot(weight, np.array(within), axes=1) + apart

    def estimate(row: FloatArray) -> tuple[float, float]:
        """Value and standard error of a combination of random effects."""
        return float(row @ effects), float(np.sqrt(row @ spread @ row)) + 1e-12

    def in_percent(value: float, sd: float) -> Estimate:
        low, middle, high = (100.0 * float(np.expm1(value + k * NORMAL_90 * sd)) for k in (-1, 0, 1))
        return Estimate(middle, low, high, "%")

    columns = s.shared[:, :, patterns]
    sample, load = s.observations.conditions.sample, s.observations.conditions.normal_load_N
    there = [str(name) for name in np.unique(sample) if np.any(columns[sample == name])]
    corrections = []
    for name in there:
        loads = load[sample == name]
        order = np.argsort(loads, kind="stable")
        three = dict.fromkeys(int(order[k]) for k in (0, len(order) // 2, len(order) - 1))
        for k, regime in enumerate(REGIMES):
            rows = columns[sample == name, k]
            mean, sd = estimate(rows.mean(axis=0))
            chance = min(2.0 * float(norm.sf(abs(mean) / sd)) * 2 * len(there), 1.0)
            at = {f"at {float(f'{loads[i]:.4g}'):g} N": in_percent(*estimate(rows[i])) for i in three}
            over = in_percent(mean, sd)
            corrections.append(
                Layer(
                    kind="pattern_correction", name=name, samples=(name,), regimes=(regime,), p_adjusted=chance,
                    effect_percent=over.value, low=over.low, high=over.high, parameters=at,
                )
            )  # fmt: skip
    return corrections


NUISANCES: dict[Nuisance, tuple[int, int]] = {
    "days": (SESSION, SESSION + 1), "drift": (DRIFT, DRIFT + 1), "specimen_drift": (SPECIMEN_DRIFT, SPECIMEN_DRIFT + 1),
}  # fmt: skip
STEP_OVER_LINE = 2.0 / 3**0.5  # a line has three quarters of the square of a step half way, with a bend or without
CHAINS, SETTLING, KEPT = 40, 20, 40  # of draws of the random effects; steps of a chain, before it counts and after


def nuisance_layers(f: ModelFit, level: float) -> list[Layer]:
    """Days, drift of the series and drift of the specimens that are beyond chance, each with its size: a hundred times
    the root mean square of what it adds to ln T over the tests of the campaign, about its mean, with a 90 % interval.

    The chance is that of a likelihood ratio with the sizes of both regimes free or held still. The interval is that of
    the random effects given the campaign, whatever the sizes of all of them are: days and drift take each other's place
    in part, and a kind that is not beyond chance may still be there. A specimen is fitted by a line with a bend, which
    is smaller than a course that steps: the upper end for specimens is that of a step.
    """
    s, chances = f.setup, {}
    for name, groups in NUISANCES.items():
        here = np.isin(s.group, groups)
        if here.any():
            held, offset = held_still(s, here)
            ratio = f.score - fit(held, f.acting, start=f, iterations=15).score - offset
            chances[name] = float(chi2.sf(2.0 * max(ratio, 0.0), 2))
    told = {name: p for name, p in chances.items() if p < level}
    if not told:
        return []
    wider = _drifting_in_common(f)
    drawn = drawn_effects(wider, np.random.default_rng(0))
    layers = []
    for name, p in told.items():
        here = np.isin(wider.setup.group, NUISANCES[name])
        sizes = [_realised(wider.setup, np.where(here, part, 0.0)) for part in np.array_split(drawn, KEPT)]
        low, middle, high = 100.0 * np.quantile(np.concatenate(sizes), (0.05, 0.5, 0.95))
        high *= STEP_OVER_LINE if name == "specimen_drift" else 1.0
        layers.append(
            Layer(
                kind="nuisance", name=name, samples=(), regimes=tuple(REGIMES), p_adjusted=p,
                effect_percent=float(middle), low=float(low), high=float(high),
            )
        )  # fmt: skip
    return layers


def _drifting_in_common(f: ModelFit) -> ModelFit:
    """The fit where all specimens may drift alike as well, by as much as each on its own.

    For sizes alone: whether specimens drift is decided without it, for a run-in would hide in it.
    """
    line = along_specimens(f.setup.observations.conditions)[0]
    alike = line[:, None, None] * ALIKE_IN_BOTH[:, None]
    return fit(f.setup.with_effects(alike, np.ones(1), SPECIMEN_DRIFT), f.acting, start=f, iterations=15)


def drawn_effects(f: ModelFit, rng: np.random.Generator) -> FloatArray:
    """Draws of the random effects given the campaign, over all that their sizes may be, (CHAINS * KEPT, q).

    By turns the effects given their sizes, with law and mechanisms linear about the fit, and the sizes given the
    effects (Gibbs sampling: Gelfand and Smith, JASA 85 (1990) 398). Weights and repeats are those of the fit.
    """
    s, columns = f.setup, f.columns
    weighted = columns.weighted(precision_of(f.factor, f.weight) * informed_share(f.noise))
    normal, right = weighted.normal, weighted.with_residual(f.residual.T[None])

    def in_each(part: FloatArray) -> FloatArray:
        return np.broadcast_to(part, (CHAINS, *part.shape[1:]))

    base = Normal(in_each(normal.own), in_each(normal.across), in_each(normal.border))
    sides = in_each(right[0]), in_each(right[1])
    sizes, kept = np.repeat(f.noise.sizes[None], CHAINS, axis=0), []
    for step in range(SETTLING + KEPT):
        prior = columns.prior(prior_sd(s, sizes) ** -2)
        root = block_cholesky(base.with_prior(*columns.sides(prior)), sides)
        own, border = (part + rng.standard_normal(part.shape) for part in root.right)
        border = np.einsum("rkm,rk->rm", root.border, border)
        own = np.einsum("rsab,rsa->rsb", root.own, own - np.einsum("rsam,rm->rsa", root.across, border))
        effects = columns.vector(own, border)[:, columns.parameters :]
        for group, (expected, worth) in enumerate(SIZE_PRIORS):
            here = s.group == group
            if here.any():
                squares = np.sum((effects[:, here] / s.unit[here]) ** 2, axis=1) + worth * expected**2
                sizes[:, group] = np.sqrt(squares / rng.chisquare(worth + here.sum(), CHAINS))
        if step >= SETTLING:
            kept.append(effects)
    return np.concatenate(kept)


def _realised(s: Setup, effects: FloatArray) -> FloatArray:
    """Root mean square over the tests of what random effects (d, q) add to ln T, about its mean, (d,)."""
    added = s.on_tests(effects)
    return np.asarray(np.sqrt(np.mean((added - added.mean(axis=1, keepdims=True)) ** 2, axis=(1, 2))))


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


def gain_on_groups(before: ModelFit, after: ModelFit, group: NDArray[np.int64]) -> tuple[float, float]:
    """What ``after`` gains over ``before`` in log score per test on whole groups (n,) left out, and its standard error
    between groups; NaN where there are fewer than three."""
    gained = []
    for number in np.unique(group) if len(np.unique(group)) > 2 else ():
        out = group == number
        without, extended = _held_out(before, out), _held_out(after, out)
        if without is not None and extended is not None:
            gained.append(float(np.sum(extended[0] - without[0])))
    if len(gained) < 3:
        return float("nan"), float("nan")
    return float(np.sum(gained)) / len(group), float(np.std(gained, ddof=1) * np.sqrt(len(gained))) / len(group)


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
    error = (residual - s.on_tests(trained.effects))[out]
    jacobian = target.jacobian(x, s.observations.log_force - residual)
    columns = model_columns(jacobian[out], s.take(out))
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
