"""What the figures ask of a study: its samples in order, its loads, its fits, traces thinned for drawing."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tribo.records import FloatArray, LawFit, Pattern, Study

LOAD_TOLERANCE = 0.02  # loads closer than this (relative) are repeats of one load
PAGE_POINTS = 1200  # a page is 190 mm wide: more points along a line cannot be seen


def flat_sample(study: Study) -> str:
    """The flat sample of the campaign; empty where none was measured or chosen."""
    return study.ingested.campaign.flat_sample


def sample_numbers(study: Study) -> dict[str, int]:
    """Each sample with its place, the flat one first, then in the order of the campaign."""
    campaign = study.ingested.campaign
    tested = {test.sample for test in campaign.tests}
    named = [s for s in campaign.samples if s in tested]
    rest = sorted(tested - set(named))
    order = sorted([*named, *rest], key=lambda s: s != flat_sample(study))
    return {sample: k for k, sample in enumerate(order)}


def is_anisotropic(pattern: Pattern) -> bool:
    """True where the cavities or their spacing differ between x and y."""
    unequal_size = pattern.size_m is not None and pattern.size_m[0] != pattern.size_m[1]
    unequal_pitch = pattern.pitch_m is not None and pattern.pitch_m[0] != pattern.pitch_m[1]
    return unequal_size or unequal_pitch


def fit_of(fits: Iterable[LawFit], sample: str, regime: str) -> LawFit | None:
    """The fit of one sample in one regime, None where there is none."""
    return next((f for f in fits if f.sample == sample and f.regime == regime), None)


def welch_dof(*components: tuple[float, float]) -> float:
    """Degrees of freedom of a sum of (standard uncertainty, degrees of freedom), Welch-Satterthwaite (GUM G.4).

    NaN where a part has an uncertainty without degrees of freedom, infinite where no part is uncertain.
    """
    uncertain = [(u, dof) for u, dof in components if u != 0]
    if not all(dof > 0 for _, dof in uncertain):
        return float("nan")
    parts = sum(u**4 / dof for u, dof in uncertain)
    return float(sum(u**2 for u, _ in uncertain) ** 2 / parts) if parts > 0 else float("inf")


def load_levels(normal_load_N: FloatArray, tolerance: float = LOAD_TOLERANCE) -> FloatArray:
    """The mean load of the level each load belongs to: loads within ``tolerance`` are one level."""
    loads = np.asarray(normal_load_N, float)
    order = np.argsort(loads, kind="stable")
    ordered = loads[order]
    new_level = np.diff(ordered) > tolerance * np.abs(ordered[1:])
    level = np.concatenate([[0], np.cumsum(new_level)]).astype(int)[: len(loads)]
    means = np.bincount(level, ordered) / np.bincount(level) if len(loads) else ordered
    levels = np.empty_like(loads)
    levels[order] = means[level]
    return levels


def thin_trace(time: FloatArray, force: FloatArray, points: int = PAGE_POINTS) -> tuple[FloatArray, FloatArray]:
    """At most about ``points`` samples that look the same: lowest and highest of each stretch, in order.

    No spike or dip is lost, as it would be by taking every n-th sample.
    """
    n = len(force)
    if n <= points:
        return np.asarray(time), np.asarray(force)
    stretch = -(-n // (points // 2))
    padded = np.full(-(-n // stretch) * stretch, np.nan)
    padded[:n] = force
    rows = padded.reshape(-1, stretch)
    starts = np.arange(len(rows)) * stretch
    lowest = starts + np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    highest = starts + np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    index = np.unique(np.concatenate([[0, n - 1], lowest, highest]))
    return np.asarray(time)[index], np.asarray(force)[index]
