"""Laws as free functions: smooth, kinked, gated or periodic courses of a column, products and trees of two.

A law changes ln T, or one of its two terms, in one regime or both, of any set of samples. No formula is behind it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .campaign import Hide, LaboratoryBench, bare_bench, both, multiply, rms_percent, stream
from .laboratory import Laboratory, drawn_laboratory
from .observer import Observer

CLASSES = ("smooth", "kinked", "gated", "periodic", "product", "tree")
COLUMNS = ("temperature_C", "humidity_pct", "film_um", "speed_mm_s", "hold_s")
BY_LOGARITHM = ("speed_mm_s", "hold_s")
STRENGTHS = (12.0, 18.0)
LARGEST = 0.3  # root mean square of ln T where the law acts; beyond, another law is drawn
PLAN, LAW = 51, 52
Course = Callable[[np.ndarray], np.ndarray]


def law_laboratory(seed: int, **changes: Any) -> Laboratory:
    """A laboratory with many speeds and holds and three repeats, of which one is kept for judging."""
    speeds = tuple(float(f"{x:.3g}") for x in np.geomspace(0.05, 1, 40))
    holds = tuple(float(f"{x:.3g}") for x in np.geomspace(2, 500, 40))
    return drawn_laboratory(seed, **{"speeds_mm_s": speeds, "holds_s": holds, "repeats": 3, **changes})


def smooth(rng: np.random.Generator) -> Course:
    """A draw from a Gaussian process on 0 to 1, of a length of 0.15 to 0.5."""
    grid, length = np.linspace(0, 1, 81), rng.uniform(0.15, 0.5)
    covariance = np.exp(-(((grid[:, None] - grid) / length) ** 2) / 2) + 1e-9 * np.eye(len(grid))
    values = np.linalg.cholesky(covariance) @ rng.normal(size=len(grid))
    return lambda u: np.interp(u, grid, values)


def kinked(rng: np.random.Generator) -> Course:
    """A broken line with one to three kinks."""
    places = np.sort(rng.uniform(0.1, 0.9, int(rng.integers(1, 4))))
    heights = rng.normal(size=len(places) + 2)
    return lambda u: np.interp(u, [0, *places, 1], heights)


def periodic(rng: np.random.Generator) -> Course:
    """Two and a half to five turns of a wave with one harmonic."""
    turns, phase, other = rng.uniform(2.5, 5), rng.random(2), rng.uniform(0, 0.6)
    return lambda u: np.sin(2 * np.pi * (turns * u + phase[0])) + other * np.sin(4 * np.pi * (turns * u + phase[1]))


def _gated(u: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """A smooth course on one side of a gate; the gate is in its own column, or in another where there are two."""
    course, place, above = smooth(rng), rng.uniform(0.3, 0.7), rng.random() < 1 / 2
    beyond = u[-1] > np.quantile(u[-1], place)
    return course(u[0]) * (beyond if above else ~beyond)


def _product(u: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    first, second = (smooth(rng)(x) for x in u)
    return (first - first.mean()) * (second - second.mean())


def _tree(u: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """One split in the first column and one in the second on either side of it; a value on each of the four leaves."""
    places, leaves = rng.uniform(0.3, 0.7, 3), rng.normal(size=(2, 2))
    side = (u[0] > np.quantile(u[0], places[0])).astype(int)
    place = np.quantile(u[1], places[1:])[side]
    return np.asarray(leaves[side, (u[1] > place).astype(int)])


def draw_course(kind: str, u: Sequence[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """A course of this class over columns scaled to 0 to 1, each (n,)."""
    if kind in ("smooth", "kinked", "periodic"):
        return {"smooth": smooth, "kinked": kinked, "periodic": periodic}[kind](rng)(u[0])
    return {"gated": _gated, "product": _product, "tree": _tree}[kind](u, rng)


def hide_free_law(seed: int, laboratory: Laboratory, kind: str, strength: float | None = None) -> Hide:
    """A law of this class, to be given to ``campaign.make``.

    Its strength for an observer who knows all covariances, nuisance apart, is drawn unless it is given.
    """
    bench, plan = bare_bench(seed, laboratory), stream(seed, PLAN)
    observer = Observer(bench, laboratory)
    asked = strength or float(plan.uniform(*STRENGTHS))
    for k in range(20):
        rng = np.random.default_rng([seed, LAW, k])
        change, truth = _law(bench, kind, rng)
        for _ in range(3):  # where a term changes, the strength is not quite in proportion to the amplitude
            change = change * asked / max(observer.strength(_in_term(bench, change, truth["term"])), 1e-9)
        whole = _in_term(bench, change, truth["term"])
        truth |= {"strength": round(observer.strength(whole), 2), "rms_percent": rms_percent(whole, bench.tests)}
        if truth["rms_percent"] <= 100 * LARGEST:
            break

    def hide(bench: LaboratoryBench, rng: np.random.Generator) -> dict[str, Any]:
        multiply(bench, whole)
        return truth

    return hide


def _law(bench: LaboratoryBench, kind: str, rng: np.random.Generator) -> tuple[np.ndarray, dict[str, Any]]:
    """A change (n, 2) of ln T or of a term, and what is true of it."""
    two = kind in ("product", "tree") or (kind == "gated" and rng.random() < 1 / 2)
    columns = [str(c) for c in rng.choice(COLUMNS, 2 if two else 1, replace=False)]
    course = draw_course(kind, [_scaled(bench, c) for c in columns], rng)
    present = sorted(set(bench.column("sample")))
    number = int(rng.choice([1, 2, len(present) - 1, len(present)], p=[1 / 10, 1 / 5, 1 / 5, 1 / 2]))
    samples = sorted(str(s) for s in rng.choice(present, number, replace=False))
    regimes = ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0))[rng.choice(3, p=(1 / 2, 1 / 4, 1 / 4))]
    term = ("", "mu", "tau")[rng.choice(3, p=(3 / 5, 1 / 5, 1 / 5))]
    here = np.isin(bench.column("sample"), samples)
    course = course - course[here].mean()
    change = np.outer(0.05 * course / max(float(course[here].std()), 1e-9) * here, regimes)
    return change, {"class": kind, "columns": columns, "regimes": regimes, "samples": samples, "term": term}


def _scaled(bench: LaboratoryBench, column: str) -> np.ndarray:
    x = np.log(bench.column(column)) if column in BY_LOGARITHM else bench.column(column)
    return np.asarray((x - x.min()) / np.ptp(x))


def _in_term(bench: LaboratoryBench, change: np.ndarray, term: str) -> np.ndarray:
    """The change of ln T where one term of the law, mu N or tau0 A, is multiplied by the exponential of ``change``."""
    if not term:
        return change
    adhesive = np.clip(bench.adhesion_N() / both(bench), 0, 1)
    share = adhesive if term == "tau" else 1 - adhesive
    return np.asarray(np.log(1 + share * np.expm1(change)))
