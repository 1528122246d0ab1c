"""The effects of ``tests/blind`` in a virtual laboratory, of their own form or nearly so."""

from __future__ import annotations

from typing import Any

import numpy as np
from blind.effects import EFFECTS

from .campaign import Hide, LaboratoryBench, bare_bench, both, multiply, rms_percent
from .laboratory import HOLDS_S, SETS, SPEEDS_MM_S, Laboratory
from .nuisance import Nuisance
from .observer import Observer, seen_in_traces

# What a laboratory needs for an effect to act: a ladder of speeds or of holds, long cavities
NEEDS: dict[str, dict[str, Any]] = {
    "velocity_dependence": {"speeds_mm_s": SPEEDS_MM_S}, "bulk_viscoelasticity": {"speeds_mm_s": SPEEDS_MM_S},
    "contact_ageing": {"holds_s": HOLDS_S}, "cavity_shear_deformation": {"samples": SETS[0]},
}  # fmt: skip
# The column along which the form of an effect may be off; the load for all others
ALONG = {
    "velocity_dependence": "speed_mm_s", "contact_ageing": "hold_s", "run_in": "specimen_run",
    "temperature": "temperature_C", "humidity": "humidity_pct", "covariate:operator": "run_order",
}  # fmt: skip
WAVES = 3  # of a smooth random function


def hide_effect(name: str, size: float, off: float = 0.0) -> Hide:
    """This effect at this size, to be given to ``campaign.make``.

    Where ``off`` is not 0, its change of ln T is multiplied by 1 + off g, a smooth random function g of the column that
    drives it, of mean 0 and root mean square 1 weighted with the square of the change: the size that fits best stays.
    """

    def hide(bench: LaboratoryBench, rng: np.random.Generator) -> dict[str, Any]:
        before = np.log(both(bench))
        EFFECTS[name](bench, size, rng)
        change = np.log(both(bench)) - before
        if off:
            further = off * change * bent(change, bench.column(ALONG.get(name, "N")), rng)[:, None]
            multiply(bench, further)
            change = change + further
        return {"effect": name, "size": size, "off": off, "rms_percent": rms_percent(change, bench.tests)}

    return hide


def bent(change: np.ndarray, column: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A smooth random function of a column, (n,), of mean 0 and rms 1 weighted with the square of a change (n, 2)."""
    x = np.log(column) if column.min() > 0 else column.astype(float)
    u = (x - x.min()) / max(float(np.ptp(x)), 1e-12)
    raw = np.sum([rng.normal() / k * np.cos(np.pi * (k * u + rng.random())) for k in range(1, WAVES + 1)], axis=0)
    weight = np.sum(change**2, axis=1)
    raw = raw - np.average(raw, weights=weight)
    return np.asarray(raw / np.sqrt(np.average(raw**2, weights=weight)))


def strengths(
    seed: int, laboratory: Laboratory, nuisance: tuple[Nuisance, ...], hide: Hide, rng: np.random.Generator
) -> dict[str, float]:
    """How clearly a hidden effect shows to observers who know all covariances, its traces in the curves included.

    ``strength``: the law of every sample is free. ``patterns_known``: that of the flat sample alone, the patterns being
    known up to deviations of known covariance.
    """
    plain, bench = bare_bench(seed, laboratory), bare_bench(seed, laboratory)
    hide(bench, rng)
    change, traces = np.log(both(bench)) - np.log(both(plain)), seen_in_traces(bench, plain)
    found = {}
    for key, known in (("strength", False), ("patterns_known", True)):
        forces = Observer(plain, laboratory, nuisance, patterns_known=known).strength(change)
        found[key] = round(float(np.hypot(forces, traces)), 3)
    return found
