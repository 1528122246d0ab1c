"""What moves friction in a real laboratory though nothing of interest happens: days, slow drift, specimens that change.

Four kinds, each of several shapes and of a stated size: the root mean square of ln T over the tests, both regimes
together, each regime about its own mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from .laboratory import day_of

DAYS, DAYS_APART, DRIFT, SPECIMEN_DRIFT = "days", "days apart", "drift", "specimen drift"
KINDS = (DAYS, DAYS_APART, DRIFT, SPECIMEN_DRIFT)
FORMS = {
    DAYS: ("normal", "heavy", "odd days"), DAYS_APART: ("normal", "heavy", "odd days"),
    DRIFT: ("walk", "steps", "sinusoids", "heavy walk"), SPECIMEN_DRIFT: ("linear", "saturating", "break"),
}  # fmt: skip
SIZES = (0.02, 0.10)


@dataclass(frozen=True)
class Nuisance:
    """One kind, its form, and its size ``rms`` (ln T).

    The rates of drifting specimens are ``heavy`` or normal; ``shared`` is what they have in common, in units of their
    standard deviation.
    """

    kind: str
    form: str
    rms: float
    heavy: bool = False
    shared: float = 0.0


def draw_nuisance(kinds: Sequence[str], rng: np.random.Generator, whole: float | None = None) -> tuple[Nuisance, ...]:
    """These kinds with forms at random and sizes of 2 to 10 %; where ``whole`` is given, squares of sizes add to its
    square."""
    sizes = rng.uniform(*SIZES, len(kinds))
    if whole is not None and len(kinds):
        sizes = whole * sizes / np.linalg.norm(sizes)
    return tuple(
        Nuisance(
            kind, str(rng.choice(FORMS[kind])), float(size), heavy=bool(rng.random() < 1 / 3),
            shared=float(rng.choice([0.0, 0.0, -0.5, 0.5])),
        )
        for kind, size in zip(kinds, sizes, strict=True)
    )  # fmt: skip


def mixture(rng: np.random.Generator) -> tuple[str, ...]:
    """One kind in two campaigns of five, two in two of five, three or four in the fifth."""
    number = int(rng.choice([1, 2, 3, 4], p=[2 / 5, 2 / 5, 1 / 10, 1 / 10]))
    chosen = set(rng.choice(KINDS, number, replace=False))
    return tuple(k for k in KINDS if k in chosen)


def course_of(nuisance: Nuisance, tests: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    """The change of ln T of every test, (n, 2), of the stated size and of mean 0 in each regime.

    Of drifting specimens the mean of every specimen is 0: what they differ by for good is not drift.
    """
    if nuisance.kind in (DAYS, DAYS_APART):
        raw = _of_days(nuisance, day_of(tests), rng)
    elif nuisance.kind == DRIFT:
        raw = np.repeat(_along(nuisance.form, len(tests), rng)[:, None], 2, axis=1)
    else:
        raw = np.repeat(_of_specimens(nuisance, tests, rng)[:, None], 2, axis=1)
    raw = raw - raw.mean(axis=0)
    return np.asarray(nuisance.rms * raw / np.sqrt(np.mean(raw**2)))


def _of_days(nuisance: Nuisance, days: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    names, which = np.unique(days, return_inverse=True)
    columns = 2 if nuisance.kind == DAYS_APART else 1
    shape = (len(names), columns)
    if nuisance.form == "normal":
        drawn = rng.normal(size=shape)
    elif nuisance.form == "heavy":
        drawn = rng.standard_t(2.5, shape)
    else:
        odd = rng.choice(len(names), int(rng.integers(1, max(len(names) // 4, 1) + 1)), replace=False)
        drawn = np.zeros(shape)
        drawn[odd] = rng.choice([-1, 1], (len(odd), columns)) * rng.uniform(0.5, 1.5, (len(odd), columns))
    return np.asarray(np.broadcast_to(drawn, (len(names), 2))[which])


def _along(form: str, n: int, rng: np.random.Generator) -> np.ndarray:
    """A slow course along n pulls."""
    if form == "walk":
        return np.cumsum(rng.normal(size=n))
    if form == "heavy walk":
        return np.cumsum(rng.standard_t(1.5, n))
    x = np.arange(n) / n
    if form == "steps":
        places = np.sort(rng.random(int(rng.integers(2, 7))))
        return np.asarray(np.concatenate([[0.0], rng.normal(size=len(places)).cumsum()])[np.searchsorted(places, x)])
    waves = range(int(rng.integers(2, 6)))
    return np.sum([rng.normal() * np.sin(2 * np.pi * (rng.uniform(0.4, 4) * x + rng.random())) for _ in waves], axis=0)


def _of_specimens(nuisance: Nuisance, tests: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    found = np.zeros(len(tests))
    for name in sorted(set(tests["specimen"])):
        here = (tests["specimen"] == name).to_numpy()
        x = (tests["specimen_run"].to_numpy()[here] - 1) / here.sum()
        rate = nuisance.shared + (rng.standard_t(3) / np.sqrt(3) if nuisance.heavy else rng.normal())
        reach, place = rng.uniform(0.1, 0.5), rng.uniform(0.2, 0.8)
        if nuisance.form == "linear":
            own = x
        elif nuisance.form == "saturating":
            own = 1 - np.exp(-x / reach)
        else:
            own = np.where(x < place, 0.0, x - place) / (1 - place)
        found[here] = rate * (own - own.mean())
    return found


def realised(courses: dict[str, np.ndarray]) -> dict[str, float]:
    """Realised root mean square by kind, percent of T; "all days" is what both kinds of days make together."""
    sums = dict(courses)
    days = [courses[k] for k in (DAYS, DAYS_APART) if k in courses]
    if days:
        sums["all days"] = np.sum(days, axis=0)
    return {k: round(100 * float(np.sqrt(np.mean((c - c.mean(axis=0)) ** 2))), 4) for k, c in sums.items()}
