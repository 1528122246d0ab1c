"""Campaigns with a pattern error, specimen slopes and a noise law of a chosen size, made in memory for tuning.

The patterns follow the predictor's own shares times a random error of its own size and form times ``pattern_error``,
so that nothing but that error is wrong. What is reported is measured on campaigns of ``tests/blind``, not on these.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from blind.tribometer import AREA_MM2, EFFECTS, FIRST, Bench, Design, _table

from tribo.diagnose.statistics.predictor import OFFSET, SLOPE, tabled_predictor
from tribo.records import Ingested

from .synthetic import PATTERNS, SMALL, ingested

NOISE = ("relative", "absolute", "heavy", "unequal")


@dataclass(frozen=True)
class World:
    """What is wrong with a campaign besides its hidden effects."""

    design: Design = field(default_factory=lambda: SMALL)
    pattern_error: float = 1.0
    slope_sd: float = 0.0
    noise: str = "relative"


def world(seed: int, *effects: tuple[str, float], of: World) -> Ingested:
    """A campaign with ``effects`` hidden in the world ``of``."""
    rng = np.random.default_rng(seed)
    tests = _table(of.design, rng)
    law = (rng.normal(4.8, 0.35), rng.normal(23, 1.8), rng.normal(3.0, 0.2), rng.normal(11.6, 0.5))
    shares = {n: tuple(v) for n, v in tabled_predictor(PATTERNS).shares.items()}
    bench = Bench(tests, law, shares)  # type: ignore[arg-type]
    for name, size in sorted(effects, key=lambda e: e[0] not in FIRST):
        EFFECTS[name](bench, size, rng)
    off = _pattern_error(bench, of.pattern_error, rng) + _specimens(bench, of, rng)
    off += _repeats(bench, of, rng)
    bench.static, bench.sliding = bench.static * np.exp(off[:, 0]), bench.sliding * np.exp(off[:, 1])
    return ingested(bench, seed)


def _log_pressure(bench: Bench) -> np.ndarray:
    return np.log(bench.column("N") / AREA_MM2 * 1e3 / 8.0)


def _pattern_error(bench: Bench, factor: float, rng: np.random.Generator) -> np.ndarray:
    found = np.zeros((len(bench.tests), 2))
    for sample in sorted(set(bench.tests["true_sample"]) - {"F"}):
        here = (bench.tests["true_sample"] == sample).to_numpy()
        offset, slope = rng.normal(size=(2, 2)) * factor
        found[here] = offset * np.array(OFFSET) + slope * np.array(SLOPE) * _log_pressure(bench)[here, None]
    return found


def _specimens(bench: Bench, of: World, rng: np.random.Generator) -> np.ndarray:
    found = np.zeros((len(bench.tests), 2))
    for specimen in sorted(set(bench.tests["specimen"])):
        here = (bench.tests["specimen"] == specimen).to_numpy()
        gain, slope = rng.normal(0, of.design.specimen_sd, 2), rng.normal(0, of.slope_sd, 2)
        found[here] = gain + slope * _log_pressure(bench)[here, None]
    return found


def _repeats(bench: Bench, of: World, rng: np.random.Generator) -> np.ndarray:
    n, sd = len(bench.tests), np.array(of.design.repeat_sd)
    noise = rng.normal(size=(n, 2))
    if of.noise == "heavy":
        noise /= np.sqrt(rng.chisquare(3, (n, 1)))
    forces = np.column_stack([bench.static, bench.sliding])
    if of.noise == "absolute":
        relative = noise * sd * np.median(forces, axis=0) / forces
        return np.log(np.maximum(1.0 + relative, 0.1))
    if of.noise == "unequal":
        times = {s: np.exp(rng.normal(0, 0.5)) for s in sorted(set(bench.tests["sample"]))}
        noise *= np.array([[times[s]] for s in bench.tests["sample"]])
    return noise * sd
