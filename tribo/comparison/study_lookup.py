"""What is looked up in a study: its samples in order, the flat one, its load levels, its fits."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tribo.fitting.linear import levels_of
from tribo.records import FloatArray, LawFit, Pattern, SetAside, Study

LOAD_TOLERANCE = 0.02  # loads closer than this (relative) are repeats of one load


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


def load_levels(normal_load_N: FloatArray, tolerance: float = LOAD_TOLERANCE) -> FloatArray:
    """The mean load of the level each load belongs to: loads within ``tolerance`` are one level."""
    return levels_of(np.asarray(normal_load_N, float), tolerance)


def shown(study: Study) -> bool:
    """Whether the study was made without the spring-block model, whose report shows other figures."""
    return study.comparison is None and bool(study.ingested.pulls)


def all_set_aside(study: Study) -> dict[str, SetAside]:
    """Every test that takes no part, by its id: faulty rows of tests.csv and exports that fail."""
    ingested = study.ingested
    return {fault.test_id: fault for fault in (*ingested.campaign.set_aside, *ingested.set_aside)}
