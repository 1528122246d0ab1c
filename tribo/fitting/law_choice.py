"""Which friction law a sample follows: candidates compared by the loads that each was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribo.fitting.load_levels import levels_of, meant_to_be_one
from tribo.fitting.rows import Rows, sample_rows
from tribo.records import REGIMES, FloatArray, Regime

if TYPE_CHECKING:
    import pandas as pd

HERTZ = 2.0 / 3.0  # exponent of a single elastic contact: T = tau A with A as N^(2/3)
_FEWEST_LEVELS = 4
_ROUNDS = 4
_CONFIDENT = 1.96  # standard uncertainties of a 95 % interval
_SMALLEST_SHARE = 0.05  # of the median force, below which no fitted force sets a weight or a ratio
COLUMNS = ["sample", "regime", "law", "formula", "parameters", "a", "a_u", "b", "b_u", "held_out_percent", "se_percent",
           "loads", "chosen"]  # fmt: skip


@dataclass(frozen=True)
class Candidate:
    """A law T(N) with at most two parameters a and b; ``powers`` are the exponents of N its linear terms have.

    The power law has none: it is a line in logarithms.
    """

    name: str
    formula: str
    powers: tuple[float, ...]

    @property
    def parameters(self) -> int:
        return len(self.powers) or 2

    @property
    def names(self) -> tuple[str, ...]:
        return {"power": ("a", "b"), "linear": ("mu", "T0")}.get(self.name, ("a",))


CANDIDATES = (
    Candidate("constant", "T = T₀", (0.0,)),
    Candidate("proportional", "T = μ N", (1.0,)),
    Candidate("hertz", "T = a N^(2/3)", (HERTZ,)),
    Candidate("linear", "T = μ N + T₀", (1.0, 0.0)),
    Candidate("power", "T = a N^b", ()),
)


def force_N(law: str, a: float, b: float, load_N: FloatArray) -> FloatArray:
    """T of a candidate by its name and parameters, N; loads (n,) in N."""
    if law == "power":
        return np.asarray(a * load_N**b)
    candidate = next(c for c in CANDIDATES if c.name == law)
    values = (a, b)[: len(candidate.powers)]
    return np.asarray(sum(value * load_N**power for value, power in zip(values, candidate.powers, strict=True)))


@dataclass(frozen=True)
class Fitted:
    """A candidate fitted: values and standard uncertainties of its parameters, and its force at loads."""

    values: FloatArray
    u: FloatArray
    force_N: Callable[[FloatArray], FloatArray]


def fit_candidate(law: Candidate, load_N: FloatArray, force_N: FloatArray) -> Fitted:
    """Least squares of the relative deviations (constant relative scatter of T)."""
    if not law.powers:
        return _power(load_N, force_N)
    design = np.column_stack([load_N**power for power in law.powers])
    expected = np.abs(force_N)
    floor = _SMALLEST_SHARE * float(np.median(expected))
    for _ in range(_ROUNDS):
        scale = np.maximum(expected, floor)
        values, u = _least_squares(design / scale[:, None], force_N / scale)
        expected = np.abs(design @ values)
    powers = np.array(law.powers)
    return Fitted(values, u, lambda load: (load[:, None] ** powers) @ values)


def _power(load_N: FloatArray, force_N: FloatArray) -> Fitted:
    there = force_N > 0
    design = np.column_stack([np.ones(there.sum()), np.log(load_N[there])])
    (log_a, b), (log_a_u, b_u) = _least_squares(design, np.log(force_N[there]))
    a = math.exp(log_a)
    return Fitted(np.array([a, b]), np.array([a * log_a_u, b_u]), lambda load: a * load**b)


def _least_squares(design: FloatArray, response: FloatArray) -> tuple[FloatArray, FloatArray]:
    values, *_ = np.linalg.lstsq(design, response, rcond=None)
    away = response - design @ values
    dof = max(len(response) - design.shape[1], 1)
    covariance = np.linalg.pinv(design.T @ design) * float(away @ away) / dof
    return np.asarray(values, float), np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)), float)


def compared_laws(table: pd.DataFrame) -> pd.DataFrame:
    """Every candidate of every sample and regime that was measured at four load levels or more, the chosen one marked.

    ``table`` is that of ``Ingested.table()``. The laws are fitted to the median force of each level, so that single
    odd tests do not decide. ``held_out_percent`` is the root mean square of ln T predicted over measured for the
    levels left out one after another, ``se_percent`` its standard error over the levels. Chosen is the law with the
    fewest parameters that is worse than the best by no more than one standard error (after Breiman et al. 1984,
    Classification and Regression Trees, section 3.4.3; here that of the difference, level by level); of equally many
    parameters, the one that deviates less. A law that is a special case of the best one (an exponent of 2/3, no
    intercept) is not chosen where the best one's own parameter excludes it with 95 % confidence.
    """
    import pandas as pd

    found = [row for regime in REGIMES for rows in sample_rows(table, regime) for row in _compared(rows, regime)]
    return pd.DataFrame(found, columns=COLUMNS)


def _compared(rows: Rows, regime: Regime) -> list[dict[str, object]]:
    rows = rows.take((rows.load_N > 0) & (rows.force_N > 0))
    load, force = _medians(rows)
    if load.size < _FEWEST_LEVELS or meant_to_be_one(load):
        return []
    squares = {law.name: _held_out(law, load, force) for law in CANDIDATES}
    excluded = {name for name in squares if _rejected(name, _best(squares), load, force)}
    chosen = choose({name: found for name, found in squares.items() if name not in excluded})
    found = []
    for law in CANDIDATES:
        fitted = fit_candidate(law, load, force)
        a, b = (*fitted.values, math.nan)[:2]
        a_u, b_u = (*fitted.u, math.nan)[:2]
        share, se = _root(squares[law.name])
        found.append(
            {"sample": rows.sample, "regime": regime, "law": law.name, "formula": law.formula,
             "parameters": law.parameters, "a": a, "a_u": a_u, "b": b, "b_u": b_u, "held_out_percent": 100 * share,
             "se_percent": 100 * se, "loads": load.size, "chosen": law.name == chosen}
        )  # fmt: skip
    return found


def _medians(rows: Rows) -> tuple[FloatArray, FloatArray]:
    """Each load level with the median of the forces measured there."""
    level = levels_of(rows.load_N) if len(rows) else rows.load_N
    loads = np.unique(level)
    return loads, np.array([float(np.median(rows.force_N[level == load])) for load in loads])


def _held_out(law: Candidate, load_N: FloatArray, force_N: FloatArray) -> FloatArray:
    """Square of ln T predicted over measured for each load, the law fitted to the other loads."""
    squares = []
    for k in range(load_N.size):
        others = np.arange(load_N.size) != k
        predicted = float(fit_candidate(law, load_N[others], force_N[others]).force_N(load_N[k : k + 1])[0])
        squares.append(math.log(max(predicted / force_N[k], _SMALLEST_SHARE)) ** 2)
    return np.array(squares)


def _root(squares: FloatArray) -> tuple[float, float]:
    """Root of the mean of squares, and its standard error."""
    root = math.sqrt(float(np.mean(squares)))
    spread = float(np.std(squares, ddof=1)) / math.sqrt(len(squares))
    return root, spread / (2.0 * root) if root > 0 else 0.0


def _best(squares: dict[str, FloatArray]) -> str:
    return min(squares, key=lambda name: float(squares[name].mean()))


def _rejected(name: str, best: str, load_N: FloatArray, force_N: FloatArray) -> bool:
    """Whether a law is the best one with a parameter at a value that the best one excludes with 95 % confidence."""
    fixed = {("power", "constant"): (1, 0.0), ("power", "proportional"): (1, 1.0), ("power", "hertz"): (1, HERTZ),
             ("linear", "proportional"): (1, 0.0), ("linear", "constant"): (0, 0.0)}.get((best, name))  # fmt: skip
    if fixed is None:
        return False
    place, value = fixed
    fitted = fit_candidate(next(law for law in CANDIDATES if law.name == best), load_N, force_N)
    return abs(float(fitted.values[place]) - value) > _CONFIDENT * float(fitted.u[place])


def choose(squares: dict[str, FloatArray]) -> str:
    """The simplest law that predicts the loads left out no worse than the best by one standard error.

    The standard error is that of the mean difference to the best law, level by level.
    """
    best = _best(squares)
    parameters = {law.name: law.parameters for law in CANDIDATES}

    def no_worse(name: str) -> bool:
        away = squares[name] - squares[best]
        return float(away.mean()) <= float(away.std(ddof=1)) / math.sqrt(away.size)

    within = [name for name in squares if no_worse(name)]
    return min(within, key=lambda name: (parameters[name], float(squares[name].mean())))
