"""How specimens and repeats scatter around the law of their sample."""

from __future__ import annotations

import numpy as np

from .bench import Bench, Design

TOGETHER = 0.4  # correlation of the static and the sliding force of one specimen, and of one pull
FREEDOM = 4  # of Student's t where the tails are heavy


def specimen_gains(
    bench: Bench, design: Design, rng: np.random.Generator, first: Bench | None = None
) -> np.ndarray:
    """Factor of every force, shape (n, 2): each specimen has a gain and a slope in the logarithm of the load.

    For further pulls with the specimens of a ``first`` bench, the same draws as there; fresh ones are drawn after them.
    """
    first = first or bench
    x = np.log(bench.column("N")) - np.log(first.column("N")).mean()
    names = sorted(set(first.tests["specimen"]))
    fresh = sorted(set(bench.tests["specimen"]) - set(names))
    drawn = {name: _pair(rng, 2) * [[design.specimen_sd], [design.specimen_slope]] for name in [*names, *fresh]}
    rows = np.array([drawn[name] for name in bench.tests["specimen"]])
    return np.exp(rows[:, 0] + x[:, None] * rows[:, 1])


def add_noise(bench: Bench, design: Design, rng: np.random.Generator) -> None:
    """Change every force by the scatter of repeats, by the noise law of the design."""
    unit = _pair(rng, len(bench.tests))
    if design.noise == "heavy":
        unit /= np.sqrt(rng.chisquare(FREEDOM, (len(unit), 1)) / (FREEDOM - 2))
    if design.noise == "unequal":
        factor = {s: 2.0 ** rng.uniform(-1, 1) for s in sorted(set(bench.tests["sample"]))}
        unit *= np.array([[factor[s]] for s in bench.tests["sample"]])
    both = np.column_stack([bench.static, bench.sliding])
    relative = unit * design.repeat_sd
    if design.noise == "absolute":  # as many newtons at every load; as large as the relative noise at the median force
        changed = np.maximum(both + relative * np.median(both, axis=0), both / 10)
    else:
        changed = both * np.exp(relative)
    bench.static, bench.sliding = changed[:, 0], changed[:, 1]


def _pair(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Standard normal numbers for the static and the sliding force, correlated, shape (rows, 2)."""
    own, other = rng.normal(size=(2, rows))
    return np.column_stack([own, TOGETHER * own + np.sqrt(1 - TOGETHER**2) * other])
