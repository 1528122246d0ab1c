"""Deviations of patterns and specimens: plain ones, lines in a logarithm, and odd ones that no parabola follows."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd
from blind.bench import GRAVITY

from .laboratory import SLIDER_G, Laboratory

Course = Callable[[np.ndarray], np.ndarray]
TOGETHER = 0.5  # correlation of the static and the sliding deviation of a specimen, a pattern or a pull
FAR_OUT = 1 / 10  # chance of a specimen that lies far out, and how many times farther
FARTHER = 3.0
HEAVY = 4  # degrees of freedom of repeats with heavy tails


def odd_course(rng: np.random.Generator, low: float, high: float) -> Course:
    """A random course between ``low`` and ``high``, constant beyond: bumps, a broken line, stairs or a wave.

    Its mean between the two is 0, its root mean square 1.
    """
    kind = rng.choice(["bumps", "broken line", "stairs", "wave"])
    places, heights = np.sort(rng.uniform(0.1, 0.9, 3)), rng.normal(size=5)
    width, turns, phase = rng.uniform(0.08, 0.2), rng.uniform(0.8, 2), rng.random()

    def raw(x: np.ndarray) -> np.ndarray:
        u = (np.clip(x, low, high) - low) / (high - low)
        if kind == "bumps":
            return np.asarray(sum(heights[k] * np.exp(-(((u - places[k]) / width) ** 2)) for k in range(2)))
        if kind == "broken line":
            return np.interp(u, [0, *places, 1], heights)
        if kind == "stairs":
            return np.asarray(heights[np.searchsorted(places[:2], u)])
        return np.sin(2 * np.pi * (turns * u + phase))

    along = raw(np.linspace(low, high, 201))
    return lambda x: (raw(x) - along.mean()) / along.std()


def pattern_deviations(laboratory: Laboratory, rng: np.random.Generator) -> dict[str, Course]:
    """For every sample with cavities, its deviation (n, 2) of ln T as a function of the load in N.

    The root mean square of its lines over samples, loads and regimes is ``pattern_rms`` exactly. Odd courses of
    ``pattern_curve`` come on top.
    """
    load = (np.array(laboratory.masses_g) + SLIDER_G) * 1e-3 * GRAVITY
    low, high = float(np.log(load[0])), float(np.log(load[-1]))
    samples = [s for s in laboratory.samples if s != "F"]
    if not samples:
        return {}
    lines = {s: _line(rng, low, high) for s in samples}
    larger = laboratory.pattern_rms / np.sqrt(np.mean([lines[s](load) ** 2 for s in samples]))
    odd = laboratory.pattern_curve if laboratory.patterns_are == "odd" else 0.0
    curves = {s: _curve(rng, low, high) for s in samples}

    def whole(sample: str) -> Course:
        return lambda N: larger * lines[sample](N) + odd * curves[sample](N)

    return {s: whole(s) for s in samples}


def _line(rng: np.random.Generator, low: float, high: float) -> Course:
    """A random line in the logarithm of the load for each regime, (n, 2)."""
    offset, slope = together(rng.uniform(-1, 1, 2)), 0.3 * together(rng.uniform(-1, 1, 2))
    return lambda N: offset + np.outer((2 * np.log(N) - low - high) / (high - low), slope)


def _curve(rng: np.random.Generator, low: float, high: float) -> Course:
    """An odd course in the logarithm of the load for each regime, (n, 2)."""
    own, other = odd_course(rng, low, high), odd_course(rng, low, high)
    return lambda N: together(np.stack([own(np.log(N)), other(np.log(N))])).T


def specimen_deviations(laboratory: Laboratory, tests: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    """By how much ln T of every test (n, 2) deviates with its specimen."""
    x = np.log(tests["N"].to_numpy())
    found = np.zeros((len(tests), 2))
    for name in sorted(set(tests["specimen"])):
        here = (tests["specimen"] == name).to_numpy()
        found[here] = one_specimen(laboratory, rng)(x[here])
    return found


def one_specimen(laboratory: Laboratory, rng: np.random.Generator) -> Course:
    """The deviation of a random specimen, (n, 2), by ln N: gain and slope, and a curve where it is odd."""
    loads = np.log((np.array(laboratory.masses_g) + SLIDER_G) * 1e-3 * GRAVITY)
    odd = laboratory.specimens_are == "odd"
    gain = laboratory.specimen_sd * together(rng.normal(size=2))
    slope = laboratory.specimen_slope * together(rng.normal(size=2))
    if odd and rng.random() < FAR_OUT:
        gain = FARTHER * gain
    curve = _curve(rng, float(loads[0]), float(loads[-1])) if odd else lambda N: np.zeros((len(N), 2))
    return lambda x: gain + np.outer(x - loads.mean(), slope) + laboratory.specimen_curve * curve(np.exp(x))


def repeat_deviations(laboratory: Laboratory, tests: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    """By how much ln T of every test (n, 2) deviates for no reason."""
    unit = together(rng.normal(size=(2, len(tests)))).T
    if laboratory.tails == "heavy":
        unit = unit / np.sqrt(rng.chisquare(HEAVY, (len(unit), 1)) / (HEAVY - 2))
    return np.asarray(unit * repeat_sds(laboratory, tests))


def repeat_sds(laboratory: Laboratory, tests: pd.DataFrame) -> np.ndarray:
    """Standard deviation of ln T by the scatter of repeats, (n, 2)."""
    factor = np.array([laboratory.noise_of.get(s, 1.0) for s in tests["sample"]])
    return np.outer(factor, laboratory.repeat_sd)


def together(own: np.ndarray) -> np.ndarray:
    """Static and sliding from two independent draws (2, ...), the sliding one correlated with the static one."""
    return np.stack([own[0], TOGETHER * own[0] + np.sqrt(1 - TOGETHER**2) * own[1]])


def of_samples(deviations: Mapping[str, Course], samples: list[str], load_N: np.ndarray) -> np.ndarray:
    """The deviation of these samples under these loads, (n, 2); none where a sample has no cavities."""
    found = np.zeros((len(samples), 2))
    for sample in set(samples) & set(deviations):
        here = np.array([s == sample for s in samples])
        found[here] = deviations[sample](load_N[here])
    return found
