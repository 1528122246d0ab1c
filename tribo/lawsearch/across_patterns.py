"""One law over all patterns: what the measurement is over the model, from the geometry of the pattern.

The deviations of five patterns are five observations, not as many as there are tests: a law across patterns is judged
by patterns that it was not fitted to. Every law of up to three terms of a small grammar is tried,

    ln(T_measured / T_model) = sum of c_k g_k(geometry) s_k(load),

with ``g`` one quantity of the pattern and ``s`` one, the share of the load term in T, the share of the adhesion term,
or ln p. Its error is that of every pattern in turn, predicted from the others. Two questions follow, which the best
error itself does not answer: how small chance makes it (the same search with the deviations handed to other patterns),
and how large it is where the choice of the law is part of what is left out (nested).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnostics.fit import ModelFit
from tribo.lawsearch.grammar import ADHESION_TERM, LOAD_TERM, T
from tribo.records import REGIMES, FloatArray

if TYPE_CHECKING:
    import pandas as pd

Term = tuple[str, str, str]  # a quantity of the pattern, what it acts on, and the regime ("both" or one)
BENT = "T, in proportion to ln p"
LOADS = 3  # groups of tests by load
CERTAIN = 0.01
FEWEST = 4  # patterns
MOST_PERMUTATIONS = 119  # of five patterns all but one; of more a random choice
LISTED = 200  # laws of each number of terms that are kept for the table
SAME = 1.0 + 1e-9  # two patterns of one geometry make reassignments that differ by rounding only
ROUNDING = 1e-6  # share of the diagonal added to it, so that terms that coincide share a coefficient


@dataclass(frozen=True)
class Deviations:
    """What the measurement is over the model, for n patterns, two regimes and m loads.

    ``geometry`` holds by name one number per pattern (n,); ``log_ratio`` (n, 2, m) is ln(measured / model), static
    before sliding; ``adhesion_share`` (n, 2, m) the share of the adhesion term in the model's friction force.
    """

    patterns: tuple[str, ...]
    geometry: Mapping[str, FloatArray]
    pressure_Pa: FloatArray
    log_ratio: FloatArray
    adhesion_share: FloatArray

    def take(self, order: Sequence[int]) -> Deviations:
        """The deviations of the patterns ``order``, and their geometry."""
        k = list(order)
        geometry = {name: values[k] for name, values in self.geometry.items()}
        names = tuple(self.patterns[i] for i in k)
        return Deviations(names, geometry, self.pressure_Pa, self.log_ratio[k], self.adhesion_share[k])

    @property
    def size(self) -> float:
        """Their rms: that of ln(measured / model) without a law."""
        return float(np.sqrt(np.mean(self.log_ratio**2)))


def geometry_of(
    area_fraction: FloatArray, rim_per_m: FloatArray, cavity_width_m: FloatArray, elongation: FloatArray
) -> dict[str, FloatArray]:
    """The quantities of patterns (n,) that a law may use, by name; ``elongation`` as in ``Conditions``."""
    return {
        "1 - AF": 1.0 - area_fraction, "(1 - AF)/AF": (1.0 - area_fraction) / area_fraction,
        "-ln AF": -np.log(area_fraction), "rim length per area (1/um)": 1e-6 * rim_per_m,
        "cavity width (um)": 1e6 * cavity_width_m, "elongation along the pull": elongation,
        "1": np.ones_like(area_fraction),
    }  # fmt: skip


def deviations_of(f: ModelFit) -> Deviations:
    """Mean of ln(measured / model) of every patterned sample and regime, in three groups of tests by load."""
    c, base = f.setup.observations.conditions, f.setup.base(f.law)
    forces = base.forces(c.normal_load_N)
    share = np.column_stack([base.static_adhesion_N / forces.static_N, base.sliding_adhesion_N / forces.sliding_N])
    names = tuple(str(s) for s in np.unique(c.sample[c.area_fraction < 1.0]))
    by_load = {s: np.flatnonzero(c.sample == s) for s in names}
    by_load = {s: rows[np.argsort(c.normal_load_N[rows], kind="stable")] for s, rows in by_load.items()}
    groups = {s: np.array_split(rows, LOADS) for s, rows in by_load.items()}
    first = [int(np.flatnonzero(c.sample == s)[0]) for s in names]
    means = {
        key: np.array([[values[rows].mean(axis=0) for rows in groups[s]] for s in names]).reshape(len(names), LOADS, 2)
        for key, values in (("left", f.residual), ("share", share))
    }
    pressure = np.array([[c.normal_load_N[rows].mean() for rows in groups[s]] for s in names]) / c.nominal_area_m2
    geometry = geometry_of(c.area_fraction[first], c.rim_per_m[first], c.cavity_width_m[first], c.elongation[first])
    middle = np.exp(np.log(pressure).mean(axis=0)) if len(names) else np.ones(LOADS)
    return Deviations(
        names, geometry, middle, np.swapaxes(means["left"], 1, 2), np.swapaxes(means["share"], 1, 2)
    )


def column(term: Term, d: Deviations) -> FloatArray:
    """The values (n, 2, m) of a term at coefficient one."""
    quantity, acts_on, regime = term
    share = {T: 1.0, LOAD_TERM: 1.0 - d.adhesion_share, ADHESION_TERM: d.adhesion_share}
    log_p = np.log(d.pressure_Pa / np.exp(np.log(d.pressure_Pa).mean()))
    there = np.array([regime in ("both", r) for r in REGIMES], float)[None, :, None]
    along = d.geometry[quantity][:, None, None] * there
    return np.asarray(along * share.get(acts_on, log_p) * np.ones_like(d.log_ratio))


@dataclass(frozen=True)
class LawAcross:
    """A law with its coefficients from all patterns, and its rms error of ln T for patterns left out."""

    terms: tuple[Term, ...]
    coefficients: tuple[float, ...]
    error: float


@dataclass(frozen=True)
class LawsAcross:
    """All laws of one number of terms: the best ones, and what chance and nesting make of the best.

    ``p`` is the share of reassignments of the deviations whose best law errs no more, ``nested`` the rms error of ln T
    of patterns for which the law was chosen without them.
    """

    deviations: Deviations
    terms: int
    tried: int
    laws: tuple[LawAcross, ...]
    p: float
    chance: float  # median error of the best law of a reassignment
    nested: float

    @property
    def best(self) -> LawAcross:
        return self.laws[0]


def grammar(d: Deviations) -> tuple[Term, ...]:
    """Every term whose column is not zero everywhere."""
    every = (
        (quantity, acts_on, regime)
        for quantity in d.geometry
        for acts_on in (T, LOAD_TERM, ADHESION_TERM, BENT)
        for regime in ("both", *REGIMES)
    )
    return tuple(term for term in every if np.abs(column(term, d)).max() > 0)


def across_patterns(d: Deviations, *, most_terms: int = 2, seed: int = 0) -> tuple[LawsAcross, ...]:
    """Search the laws of one to ``most_terms`` terms; nothing where fewer than four patterns were measured."""
    if len(d.patterns) < FEWEST:
        return ()
    terms = grammar(d)
    orders = _orders(len(d.patterns), np.random.default_rng(seed))
    return tuple(_searched(d, terms, k, orders) for k in range(1, most_terms + 1))


def _orders(n: int, rng: np.random.Generator) -> list[tuple[int, ...]]:
    """Reassignments of n deviations to n patterns, the true one not among them."""
    if n <= 5:
        return [order for order in permutations(range(n)) if order != tuple(range(n))]
    drawn = (tuple(int(i) for i in rng.permutation(n)) for _ in range(MOST_PERMUTATIONS))
    return [order for order in drawn if order != tuple(range(n))]


def _searched(d: Deviations, terms: Sequence[Term], k: int, orders: Sequence[tuple[int, ...]]) -> LawsAcross:
    columns = np.array([column(term, d) for term in terms])
    laws = np.array(list(combinations(range(len(terms)), k)))
    errors = left_out_errors(columns, d.log_ratio, laws)
    ranked = np.argsort(errors, kind="stable")
    by_chance = left_out_errors(columns, d.log_ratio, laws, orders).min(axis=1)
    best = tuple(_law(d, terms, laws[i], float(errors[i])) for i in ranked[:LISTED])
    nested = [law.error**2 for law in _nested(d, terms, laws, columns)]
    return LawsAcross(
        d, k, len(laws), best, float((1 + np.sum(by_chance <= SAME * errors[ranked[0]])) / (1 + len(by_chance))),
        float(np.median(by_chance)), float(np.sqrt(np.mean(nested))),
    )  # fmt: skip


def left_out_errors(
    columns: FloatArray, log_ratio: FloatArray, laws: np.ndarray, orders: Sequence[Sequence[int]] = ()
) -> FloatArray:
    """Rms error of ln T of every pattern predicted from the others, for each law (rows of ``laws``: its columns).

    ``columns`` (terms, n, 2, m), ``log_ratio`` (n, 2, m), ``laws`` (laws, k). With ``orders``, reassignments of the
    deviations to patterns, the errors are (orders, laws). By the normal equations: what a pattern contributes to them
    is taken off for its own prediction. Their inverse does not depend on the deviations and serves all reassignments.
    """
    n, k = len(log_ratio), laws.shape[1]
    x, y = columns.reshape(len(columns), n, -1), log_ratio.reshape(n, -1)
    products, targets = np.einsum("apq,bpq->pab", x, x), np.einsum("apr,qr->pqa", x, y)
    squares = np.sum(y**2, axis=1)
    every = [list(order) for order in orders] or [list(range(n))]
    pairs = (laws[:, :, None], laws[:, None, :])
    total = np.zeros((len(every), len(laws)))
    for left_out in range(n):
        normal = (products.sum(axis=0) - products[left_out])[pairs]
        size = np.trace(normal, axis1=1, axis2=2)[:, None, None] / k
        inverse = np.linalg.inv(normal + (ROUNDING * size + 1e-12) * np.eye(k))
        own = products[left_out][pairs]
        for row, order in zip(total, every, strict=True):
            others = sum(targets[p, q] for p, q in enumerate(order) if p != left_out)
            found = np.einsum("lab,lb->la", inverse, others[laws])
            fitted = np.einsum("lab,lb->la", own, found) - 2.0 * targets[left_out, order[left_out]][laws]
            row += squares[order[left_out]] + np.einsum("la,la->l", found, fitted)
    errors = np.sqrt(np.maximum(total, 0.0) / y.size)
    return np.asarray(errors if len(orders) else errors[0])


def _nested(d: Deviations, terms: Sequence[Term], laws: np.ndarray, columns: FloatArray) -> Iterator[LawAcross]:
    """For every pattern the law that predicts the others best, and its error at that pattern."""
    n = len(d.patterns)
    for left_out in range(n):
        kept = [i for i in range(n) if i != left_out]
        chosen = laws[np.argmin(left_out_errors(columns[:, kept], d.log_ratio[kept], laws))]
        law = _law(d.take(kept), terms, chosen, 0.0)
        at = d.take([left_out])
        error = at.log_ratio - predicted(law, at)
        yield LawAcross(law.terms, law.coefficients, float(np.sqrt(np.mean(error**2))))


def _law(d: Deviations, terms: Sequence[Term], law: np.ndarray, error: float) -> LawAcross:
    """A law fitted to all given patterns."""
    chosen = tuple(terms[i] for i in law)
    design = np.array([column(term, d).ravel() for term in chosen]).T
    found = np.linalg.lstsq(design, d.log_ratio.ravel(), rcond=ROUNDING)[0]
    return LawAcross(chosen, tuple(found.tolist()), error)


def predicted(law: LawAcross, d: Deviations) -> FloatArray:
    """ln(measured / model) by the law, (n, 2, m)."""
    parts = [c * column(term, d) for c, term in zip(law.coefficients, law.terms, strict=True)]
    return np.asarray(sum(parts))


def formula(law: LawAcross) -> str:
    """The law as a formula for ln(T measured / T model)."""
    parts = [f"{c:+.3g}{_term_formula(term)}" for c, term in zip(law.coefficients, law.terms, strict=True)]
    return "ln(T measured / T model) = " + " ".join(parts).removeprefix("+")


def _term_formula(term: Term) -> str:
    quantity, acts_on, regime = term
    what = "" if quantity == "1" else f" {quantity}"
    acts = {T: "", BENT: " ln(p/p_mean)"}.get(acts_on, f" x share of the {acts_on}")
    return f"{what}{acts}" + ("" if regime == "both" else f" ({regime})")


def table_of(found: Sequence[LawsAcross]) -> pd.DataFrame:
    """The best laws of every number of terms: formula, errors (rms of ln T), and chance."""
    import pandas as pd

    rows = [
        {
            "terms": s.terms, "formula": formula(law), "left_out_error": law.error, "model_error": s.deviations.size,
            "best_of_chance_error": s.chance, "p_of_the_best": s.p, "nested_error": s.nested, "laws_tried": s.tried,
        }
        for s in found
        for law in s.laws
    ]  # fmt: skip
    return pd.DataFrame(rows)
