"""Laws across patterns: from a fitted model to its deviations, and the outcome in words and as a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.sentences import p_text
from tribo.lawsearch.across_patterns import BENT, AcrossPatterns, Deviations, LawAcross, Search, T, Term
from tribo.records import FloatArray

if TYPE_CHECKING:
    import pandas as pd


LOADS = 3  # groups of tests by load
CERTAIN = 0.01


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
    groups = {s: _by_load(c.normal_load_N, c.sample == s) for s in names}
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


def _by_load(load_N: FloatArray, here: np.ndarray) -> list[np.ndarray]:
    rows = np.flatnonzero(here)
    return list(np.array_split(rows[np.argsort(load_N[rows], kind="stable")], LOADS))


def formula(law: LawAcross) -> str:
    """The law as a formula for ln(T measured / T model)."""
    parts = [f"{c:+.3g}{_term(term)}" for c, term in zip(law.coefficients, law.terms, strict=True)]
    return "ln(T measured / T model) = " + " ".join(parts).removeprefix("+")


def _term(term: Term) -> str:
    what = "" if term.quantity == "1" else f" {term.quantity}"
    acts = {T: "", BENT: " ln(p/p_mean)"}.get(term.acts_on, f" x share of the {term.acts_on}")
    return f"{what}{acts}" + ("" if term.regime == "both" else f" ({term.regime})")


def sentence(found: AcrossPatterns) -> str:
    """Whether the geometry of the patterns predicts what the model gets wrong about them."""
    beyond = [s for s in found.searches if s.p < CERTAIN and s.nested < found.without]
    if beyond:
        best = min(beyond, key=lambda s: s.nested)
        return (
            f"One law across the patterns predicts the deviation of a pattern that it was not fitted to: "
            f"{formula(best.best)}. It lowers the error of friction from {_factor(found.without)} to "
            f"{_factor(best.nested)} (p {p_text(best.p)}). {_tried(best)}"
        )
    best = min(found.searches, key=lambda s: s.best.error)
    return (
        f"No law across the patterns is beyond chance. The best one, {formula(best.best)}, predicts patterns that it "
        f"was not fitted to within {_factor(best.best.error)}, where the model alone is wrong by "
        f"{_factor(found.without)}; but a search with the deviations assigned to other patterns does as well in "
        f"{100 * best.p:.0f} % of all assignments, and a law that is also chosen without the pattern it predicts is "
        f"wrong by {_factor(best.nested)}. {_tried(best)}"
    )


def _tried(s: Search) -> str:
    return f"{s.tried} laws of {s.terms} term{'s' if s.terms > 1 else ''} were tried."


def _factor(rms: float) -> str:
    """An rms error of ln T as a factor of friction."""
    return f"a factor of {np.exp(rms):.2f}"


def table_of(found: AcrossPatterns) -> pd.DataFrame:
    """The best laws of every number of terms: formula, errors (rms of ln T), and chance."""
    import pandas as pd

    rows = [
        {
            "terms": s.terms, "formula": formula(law), "left_out_error": law.error, "model_error": found.without,
            "best_of_chance_error": s.chance, "p_of_the_best": s.p, "nested_error": s.nested, "laws_tried": s.tried,
        }
        for s in found.searches
        for law in s.laws
    ]  # fmt: skip
    return pd.DataFrame(rows)


def record_of(found: AcrossPatterns) -> Mapping[str, object]:
    """The outcome for a JSON file."""
    return {
        "text": sentence(found), "patterns": list(found.deviations.patterns), "model_error": found.without,
        "searches": [
            {
                "terms": s.terms, "laws_tried": s.tried, "best": formula(s.best), "left_out_error": s.best.error,
                "p": s.p, "best_of_chance_error": s.chance, "nested_error": s.nested,
            }
            for s in found.searches
        ],
    }  # fmt: skip
