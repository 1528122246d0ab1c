"""Laws across patterns in words and as a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnostics.sentences import p_text
from tribo.lawsearch.across_patterns import BENT, CERTAIN, AcrossPatterns, LawAcross, LawsAcross, Term
from tribo.lawsearch.grammar import T

if TYPE_CHECKING:
    import pandas as pd


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


def _tried(s: LawsAcross) -> str:
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
