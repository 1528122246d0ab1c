"""Scatter of specimens partly pooled over the samples of a campaign, against the luck of few specimens.

Three specimens that agree by chance give an interval that is far too narrow: among the tenth of samples whose
specimens scatter least, the intervals by t(2) hold the law in two of three cases. The covariance of each sample is
therefore moved towards the mean of all samples, as if that mean were known from PRIOR_DOF further specimens (moderated
variances: Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3). A sample that scatters more than the others keeps part of
its own scatter. One that scatters less gets the mean of all: with few specimens a small scatter is luck more often than
a quieter pattern, and two thirds of the mean are too little for the luckiest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tribo.fitting.linear import Rows
from tribo.fitting.pooled_scatter import degrees_of_freedom
from tribo.fitting.samples import LAW, ONE_SPECIMEN
from tribo.records import FloatArray, LawFit

PRIOR_DOF = 4.0  # swept in benchmarks/combined_coverage.py: from 2 to 8 the coverage hardly depends on it

ROUNDING = 1e-12


def partly_pooled(
    fits: tuple[LawFit, ...], rows: Mapping[str, Rows], prior_dof: float = PRIOR_DOF
) -> tuple[LawFit, ...]:
    """The fits of one regime with the covariance of their specimens moved towards the mean of all samples.

    ``fits`` are those of ``fit_samples``, ``rows`` the tests of each sample. What is averaged is the covariance of T at
    the lowest and at the highest load, relative to the sample's own forces. Where a sample scatters more than it,
    ``dof`` becomes ``prior_dof`` plus that of the sample, at most that of all specimens together. Where it scatters
    less, it gets the mean with all degrees of freedom; no covariance is smaller than the mean in any combination of mu
    and tau0. A sample of one specimen gets the mean of the others, so that its interval applies to the pattern. Samples
    without values, with a force that is not positive, or without another sample to compare with, keep their own
    covariance.
    """
    shares = {f.sample: s for f in fits if (s := _shares(f, rows[f.sample])) is not None}
    several = [f for f in fits if f.sample in shares and len(f.specimens) > 1]
    if not several or len(shares) < 2:
        return fits
    freedom = np.array([len(f.specimens) - 1.0 for f in several])
    covariances = np.array([np.cov(shares[f.sample], rowvar=False) for f in several])
    mean = np.einsum("s,sij->ij", freedom, covariances) / freedom.sum()
    most = degrees_of_freedom(several)
    return tuple(
        _moved(f, shares[f.sample], mean, rows[f.sample], (prior_dof, most)) if f.sample in shares else f for f in fits
    )


def _moved(fit: LawFit, shares: FloatArray, mean: FloatArray, rows: Rows, dof: tuple[float, float]) -> LawFit:
    forces = _forces(fit, rows)
    inverse = np.linalg.inv(forces / (forces @ fit.values)[:, None])
    scatter, freedom = _believed(shares, mean, *dof)
    moved = replace(
        fit,
        covariance=inverse @ scatter @ inverse.T / len(shares),
        dof=freedom,
        method=f"{fit.method}; scatter of specimens partly pooled over samples",
        notes=tuple(note for note in fit.notes if note != ONE_SPECIMEN),
    )
    return at_least(moved, inverse @ mean @ inverse.T / len(shares))


def _believed(shares: FloatArray, mean: FloatArray, prior: float, most: float) -> tuple[FloatArray, float]:
    """The scatter that is taken for the specimens of one sample, and its degrees of freedom."""
    own = len(shares) - 1.0
    if own == 0:
        return mean, min(prior, most)
    scatter = np.cov(shares, rowvar=False)
    if np.trace(scatter) < np.trace(mean):
        return mean, most
    return (prior * mean + own * scatter) / (prior + own), min(prior + own, most)


def _forces(fit: LawFit, rows: Rows) -> FloatArray:
    """(2, 2) that takes (mu, tau0_Pa) to T at the lowest and the highest load."""
    loads = rows.load_N[rows.load_N > 0]
    return LAW.design_matrix(np.array([loads.min(), loads.max()]), fit.nominal_area_m2)


def _shares(fit: LawFit, rows: Rows) -> FloatArray | None:
    """T of each specimen at both loads over that of the sample, (G, 2); None where there is nothing to compare."""
    if not fit.specimens or not np.isfinite(fit.values).all():
        return None
    forces = _forces(fit, rows)
    own = forces @ fit.values
    return np.array(list(fit.specimens.values())) @ forces.T / own if (own > 0).all() else None


def at_least(fit: LawFit, floor: FloatArray) -> LawFit:
    """The fit with a covariance that is in no combination of its parameters smaller than ``floor`` (2, 2).

    A floor without a width in some combination changes nothing.
    """
    if not np.linalg.det(floor) > ROUNDING * np.prod(np.diagonal(floor)):
        return fit
    root = np.linalg.cholesky(floor)
    inverse = np.linalg.inv(root)
    sizes, axes = np.linalg.eigh(inverse @ fit.covariance @ inverse.T)
    whole = root @ axes
    return replace(fit, covariance=whole @ np.diag(np.maximum(sizes, 1.0)) @ whole.T)
