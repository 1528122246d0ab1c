"""Narrower intervals from the scatter of specimens pooled over all samples of a campaign.

Three specimens leave two degrees of freedom and t = 4.3. Where specimens of every sample scatter by the same
share of their force, as scatter from moulding, mounting and cleaning does, all samples together determine that share
much better. This is an assumption about the campaign and not a property of one sample; it is therefore never the
default.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.samples import LAW, ONE_SPECIMEN
from tribo.records import FloatArray, LawFit

PRESSURES_PA = (3e3, 25e3)  # where the share of scatter is taken: the paper's range
UNLIKE_LEVEL = 0.05


def pool_specimen_scatter(
    fits: tuple[LawFit, ...], *, pressures_Pa: tuple[float, float] = PRESSURES_PA
) -> tuple[LawFit, ...]:
    """The same fits with the covariance of specimens pooled over samples, regime by regime.

    ``fits`` are those of ``fit_samples``. What is pooled is the covariance of (T at the lower, T at the higher
    pressure) relative to the sample's own forces. ``dof`` becomes that of all specimens together, samples that
    share specimens counted once. Samples of one specimen gain an interval for their pattern; samples without
    values stay as they are. Where Bartlett's test finds that samples differ in scatter at 5 %, a note says that
    the pooled intervals are not to be trusted.

    Raises
    ------
    FitError
        No sample has two specimens, a fitted force is not positive, or a law other than T = mu N + tau0 A.
    """
    regimes = dict.fromkeys(fit.regime for fit in fits)
    pooled = {r: _pool(tuple(f for f in fits if f.regime == r), pressures_Pa) for r in regimes}
    return tuple(pooled[fit.regime][fit.sample] for fit in fits)


def _pool(fits: tuple[LawFit, ...], pressures_Pa: tuple[float, float]) -> dict[str, LawFit]:
    if wrong := [fit for fit in fits if fit.law != LAW.name]:
        raise FitError(Problem("unknown_law", "this law cannot be pooled", found=wrong[0].law, allowed=LAW.name))
    used = [fit for fit in fits if fit.specimens]
    shares = {fit.sample: _shares(fit, pressures_Pa) for fit in used}
    several = [fit.sample for fit in used if len(fit.specimens) > 1]
    if not several:
        what = "the scatter between specimens cannot be determined"
        raise FitError(Problem("too_few_specimens", what, allowed="at least one sample with two or more specimens"))
    freedom = np.array([len(shares[s]) - 1.0 for s in several])
    covariances = np.array([np.cov(shares[s], rowvar=False) for s in several])
    common = np.einsum("s,sij->ij", freedom, covariances) / freedom.sum()
    dof = degrees_of_freedom([fit for fit in used if len(fit.specimens) > 1])
    notes = _unlike([shares[s] for s in several])
    found = {fit.sample: fit for fit in fits}
    for fit in used:
        found[fit.sample] = replace(
            fit,
            covariance=_back(common, fit, pressures_Pa) / len(fit.specimens),
            dof=dof,
            method=f"{fit.method}; scatter of specimens pooled over {len(several)} samples, t({dof:g})",
            notes=(*(n for n in fit.notes if n != ONE_SPECIMEN), *notes),
        )
    return found


def _map(fit: LawFit, pressures_Pa: tuple[float, float]) -> FloatArray:
    """(2, 2) that takes (mu, tau0_Pa) to the forces at both pressures, relative to the sample's own."""
    area = fit.nominal_area_m2
    forces = LAW.design_matrix(np.array(pressures_Pa) * area, area)
    own = forces @ fit.values
    if (own <= 0).any():
        found = f"sample {fit.sample}: {own.min():.3g} N"
        raise FitError(Problem("no_force", "a fitted force is not positive", found=found))
    return np.asarray(forces / own[:, None])


def _shares(fit: LawFit, pressures_Pa: tuple[float, float]) -> FloatArray:
    return np.array(list(fit.specimens.values())) @ _map(fit, pressures_Pa).T


def _back(common: FloatArray, fit: LawFit, pressures_Pa: tuple[float, float]) -> FloatArray:
    inverse = np.linalg.inv(_map(fit, pressures_Pa))
    return np.asarray(inverse @ common @ inverse.T)


def degrees_of_freedom(fits: list[LawFit]) -> float:
    """Specimens less samples, samples that share specimens (one pattern pulled two ways) taken as one."""
    groups: list[set[str]] = []
    for fit in fits:
        names = set(fit.specimens)
        joined = [g for g in groups if g & names]
        groups = [g for g in groups if not g & names] + [names.union(*joined)]
    return float(sum(len(g) - 1 for g in groups))


def _unlike(shares: list[FloatArray]) -> tuple[str, ...]:
    from scipy.stats import bartlett

    middle = [s.mean(axis=1) for s in shares]
    if len(middle) < 2 or any(np.ptp(m) == 0 for m in middle):
        return ()
    p = float(bartlett(*middle).pvalue)
    if p >= UNLIKE_LEVEL:
        return ()
    return (f"the scatter of specimens differs between samples (p = {p:.1g}): the pooled interval is not reliable",)
