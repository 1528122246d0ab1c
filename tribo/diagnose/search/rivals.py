"""Which mechanisms explain a campaign about equally: those the design cannot distinguish, and distinct rivals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tribo.diagnose.search.weighing import Candidate
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Target
from tribo.records import FloatArray

# Log likelihood, at least and as a share of what the best gains, by which two mechanisms must differ to be told apart.
# If the one is at work, the difference has the expected value D = gain (1 - cosine^2) and the variance 2 D: the other
# one is ahead by 3 in at most 0.7 % of campaigns, whatever D is.
TIED = (3.0, 0.08)
ALIKE = float(np.sqrt(1.0 - 2.0 * TIED[1]))  # cosine above which not even a strong effect tells two mechanisms apart
CLOSE = 3.0  # log likelihood within which a mechanism that can be told apart explains about equally
IN_COMMON = 0.5  # share of its effect that a mechanism must have in common with one it is tied to


def sort_rivals(
    start: ModelFit, best: Candidate, ranked: Sequence[Candidate]
) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    """Those that the design cannot distinguish from the best, and distinct ones that explain about as much.

    What explains about as much does so whether or not the choices a mechanism had are paid for.
    """
    tied = max(TIED[0], TIED[1] * best.gain)
    near = [c for c in ranked if c is not best and c.gain > best.gain - max(CLOSE, tied)]
    if not near:
        return (best,), ()
    cosine = np.maximum(_likeness(start, best, near), 0.0)
    told = (best.gain * (1.0 - cosine**2) > 2.0 * tied) | (cosine**2 < IN_COMMON)
    alike = [c for c, apart in zip(near, told, strict=True) if not apart and c.gain > best.gain - tied]
    rivals = [c for c, apart in zip(near, told, strict=True) if apart and _about_equal(c, best)]
    return (best, *alike), tuple(rivals)


def _about_equal(c: Candidate, best: Candidate) -> bool:
    return c.gain > best.gain - CLOSE and c.raw > best.raw - CLOSE


def _likeness(start: ModelFit, best: Candidate, others: Sequence[Candidate]) -> FloatArray:
    """Cosine between what ``best`` changes in the fitted ln T and what each other changes, (others,).

    Every model has its own flat law fitted, so what the flat law can absorb is already removed; the sample error
    and the specimens are taken out here.
    """
    f, ground = best.fit, Target(best.fit.setup, best.fit.acting[:-1])
    x = np.concatenate([f.law, *f.values[:-1]])
    jacobian = ground.jacobian(x, ground.predict(x))
    changes = [c.fit.predicted - start.predicted for c in (best, *others)]
    left = replace(f.linear, jacobian=jacobian).cleared(np.stack(changes, axis=2))[0]
    length = np.sqrt(np.sum(left**2, axis=0)) + 1e-12
    return np.asarray((left[:, 1:].T @ left[:, 0]) / (length[1:] * length[0]))


def weights_of(candidates: Sequence[Candidate]) -> FloatArray:
    """Shares of candidates by likelihood, adding to one; the likelihood is trusted as far as the laws are.

    Between laws that may each be wrong in form, a large log likelihood parts less than it seems: differences
    count in units of the tie that :data:`TIED` allows.
    """
    gains = np.array([c.gain for c in candidates])
    unit = max(1.0, TIED[1] * gains.max() / CLOSE)
    share = np.exp((gains - gains.max()) / unit)
    return np.asarray(share / share.sum())
