"""mu and tau0 of each sample from campaign to campaign, and where they changed.

A change point splits the campaigns of a series, in the order in which they were measured, in two runs of different
mean. Each split is judged by the two-sample t test. The smallest p over all splits and all series accounts for the
number of comparisons. It is compared with the smallest p under random orders of the campaigns (the same order for
all series, since a campaign moves all of them at once): the single-step method of Westfall and Young (1993) with
permutations, which needs neither normal scatter nor independent series. Each part found this way is searched for
further changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray

FEWEST = 8  # campaigns in a series; with fewer, no order of them is rare enough to speak of a change
SHORTEST = 3  # campaigns on either side of a change, so that one odd campaign makes none
LEVEL = 0.05
PERMUTATIONS = 2000


@dataclass(frozen=True)
class Change:
    """A change of one series before its campaign ``at`` (an index into the series' campaigns)."""

    series: str
    at: int
    before: float
    after: float
    p: float


def change_points(
    series: Mapping[str, Sequence[float]], *, level: float = LEVEL, seed: int = 0, permutations: int = PERMUTATIONS
) -> tuple[Change, ...]:
    """Changes in any of several series over the same campaigns, in order.

    Parameters
    ----------
    series : name -> one value per campaign, NaN where the campaign has none
    level : chance of a false alarm in the first round, over all series together

    Returns
    -------
    tuple of Change
        By series and place. ``p`` is adjusted for all splits and series examined.
    """
    values = {name: np.asarray(v, float) for name, v in series.items()}
    if not values:
        return ()
    rng = np.random.default_rng(seed)
    keys = rng.random((permutations, len(next(iter(values.values())))))
    found: list[Change] = []
    spans = [(name, np.flatnonzero(np.isfinite(v))) for name, v in values.items()]
    while spans := [(name, places) for name, places in spans if places.size >= FEWEST]:
        next_spans = []
        for (name, places), (cut, p) in zip(spans, _adjusted(values, spans, keys), strict=True):
            if p <= level:
                y = values[name]
                left, right = places[:cut], places[cut:]
                found.append(Change(name, int(right[0]), float(y[left].mean()), float(y[right].mean()), p))
                next_spans += [(name, left), (name, right)]
        spans = next_spans
    order = list(values)
    return tuple(sorted(found, key=lambda c: (order.index(c.series), c.at)))


def _adjusted(
    values: Mapping[str, FloatArray], spans: Sequence[tuple[str, np.ndarray]], keys: FloatArray
) -> list[tuple[int, float]]:
    """For each span its best split and the adjusted p of that split."""
    smallest = np.ones(len(keys))
    best = []
    for name, places in spans:
        y = values[name][places]
        p = split_p(y[None, :])[0]
        best.append((int(np.argmin(p)) + SHORTEST, float(p.min())))
        shuffled = y[np.argsort(keys[:, places], axis=1)]
        smallest = np.minimum(smallest, split_p(shuffled).min(axis=1))
    return [(cut, float((1 + np.sum(smallest <= p * (1 + 1e-9))) / (1 + len(keys)))) for cut, p in best]


def split_p(y: FloatArray) -> FloatArray:
    """p of the two-sample t test (common variance) of each split of each row, shape (rows, n - 2 SHORTEST + 1)."""
    from scipy.special import stdtr

    n = y.shape[1]
    y = y - y.mean(axis=1, keepdims=True)
    left_n = np.arange(SHORTEST, n - SHORTEST + 1)
    sums, squares = np.cumsum(y, axis=1), np.cumsum(y**2, axis=1)
    left, total = sums[:, left_n - 1], squares[:, -1:]
    between = left**2 / left_n + left**2 / (n - left_n)  # the two sums are opposite, since the mean is out
    within = np.maximum(total - between, 1e-12 * total)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.sqrt(between * (n - 2) / within)
    t = np.where(total > 0, t, 0.0)
    return np.asarray(2 * stdtr(n - 2, -t))
