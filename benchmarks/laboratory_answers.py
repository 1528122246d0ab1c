"""What the diagnosis answers about a campaign of a virtual laboratory, as a row of plain values.

The campaign goes the way of ``tribo diagnose``: causes, laws of what they leave, laws across patterns, sentences.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from blind_laws import acts_of_law, error_left_out

from tribo.diagnostics.diagnosis import Diagnosis, examine
from tribo.diagnostics.model import setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.verdict import Verdict
from tribo.lawsearch.diagnosis_with_laws import explained, with_law_across, with_laws
from tribo.lawsearch.grammar import LOAD_TERM
from tribo.lawsearch.model_choice import FoundLaw, centred
from tribo.lawsearch.scoring import terms_of
from tribo.records import Ingested
from tribo.wording.verdict_sentences import worded

Row = dict[str, Any]


def diagnosed(ingested: Ingested, seed: int) -> Diagnosis:
    """The diagnosis of a campaign with its sentences."""
    d = with_law_across(with_laws(examine(ingested, seed=seed), seed=seed), seed=seed)
    return replace(d, verdict=worded(d.verdict))


def answer(v: Verdict) -> Row:
    """All of a verdict that tables are made from."""
    return {
        "verdict": v.verdict,
        "causes": [_cause(c) for c in v.causes],
        "equivalent": [sorted(names) for names in v.equivalent],
        "layers": [_layer(x) for x in v.layers],
        "misfits": [
            {"observable": m.observable, "sample": m.sample, "column": m.covariate, "p": _short(m.p_adjusted),
             "effect": [_short(x) for x in (m.effect_percent, m.low, m.high)]}
            for m in v.misfits
        ],
        "within_chance": getattr(v.shows, "within_chance", None),
        "next_test": v.next_test.text if v.next_test else "",
        "text": v.text,
    }  # fmt: skip


def _cause(c: Any) -> Row:
    sizes = {name: [_short(e.low), _short(e.value), _short(e.high), e.unit] for name, e in c.parameters.items()}
    return {"mechanism": c.mechanism, "choice": c.choice, "parameters": sizes, "text": c.text}


def _layer(x: Any) -> Row:
    """A layer without its sentence, which the text of the verdict repeats."""
    sizes = {name: [_short(e.low), _short(e.value), _short(e.high), e.unit] for name, e in x.parameters.items()}
    levels = {
        str(name): [_short(e.low), _short(e.value), _short(e.high)]
        for name, e in (getattr(x, "levels", None) or {}).items()
    }
    row = {
        "kind": x.kind, "name": x.name, "samples": list(x.samples), "regimes": list(x.regimes), "choice": x.choice,
        "p": _short(x.p_adjusted), "effect": _short(x.effect_percent), "low": _short(x.low), "high": _short(x.high),
        "formula": x.formula, "tied_with": list(x.tied_with), "parameters": sizes,
    }  # fmt: skip
    return row | ({"levels": levels} if levels else {})


def _short(x: float) -> float | None:
    return float(f"{x:.5g}") if math.isfinite(x) else None


def values_at_levels(d: Diagnosis, bench: Any, column: str, change: np.ndarray) -> list[list[Any]]:
    """Of the laws of a column of few values: level, regime, hidden change, its 90 % band, all of ln T.

    Each is the mean over the tests at the level on which the law acts, beyond what flat law and patterns can absorb.
    """
    known_as = {"speed_mm_s": "speed_m_s"}.get(column, column)
    told = [law for law in (d.laws.laws if d.laws else ()) if law.law.columns == (known_as,)]
    found: list[list[Any]] = []
    for law in told[:1]:
        true, low, high, acts = hidden_and_band([law], change)
        for level in np.unique(bench.column(column)):
            here = bench.column(column) == level
            for k, regime in enumerate(("static", "sliding")):
                chosen = here & acts[:, k]
                if chosen.any():
                    sizes = [round(float(x[chosen, k].mean()), 5) for x in (true, low, high)]
                    found.append([str(level), regime, *sizes])
    return found


def hidden_and_band(
    laws: Sequence[FoundLaw], change: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The hidden change beyond what flat law and patterns can absorb, both ends of the 90 % band of what laws change
    together, and where one of them acts; each (n, 2)."""
    model = laws[-1].model
    true = centred(change, model.setup.observations.conditions, terms_of(model)[LOAD_TERM])
    value = sum(law.band[0] for law in laws)
    below, above = (np.sqrt(sum((law.band[end] - law.band[0]) ** 2 for law in laws)) for end in (1, 2))
    return true, value - below, value + above, np.any([acts_of_law(law) for law in laws], axis=0)


def band_of_laws(d: Diagnosis, change: np.ndarray) -> Row:
    """Share of the tests at which the 90 % band of all laws holds the hidden change, and its mean half width."""
    if d.laws is None or not d.laws.laws:
        return {}
    true, low, high, acts = hidden_and_band(d.laws.laws, change)
    either = (change != 0) | acts
    held = ((low <= true) & (true <= high))[either].mean()
    return {"band": round(float(held), 4), "band_width": round(float((0.5 * (high - low))[either].mean()), 4)}


def errors_left_out(d: Diagnosis, whole: Ingested, change: np.ndarray, out: np.ndarray) -> Row:
    """RMS error of ln T of the tests that were left ``out``: with the true law, with all that was found, with nothing.

    All are fitted to the other tests; the true law is taken off the forces as it was hidden.
    """
    model, o = explained(d), observe(whole)
    without = replace(o, log_force=o.log_force - change)
    tried = {"true": (without, ()), "found": (o, model.acting), "nothing": (o, ())}
    predictor = model.setup.predictor
    errors = {key: error_left_out(setup(data, predictor), acting, out) for key, (data, acting) in tried.items()}
    return {f"error_{key}": round(x, 5) for key, x in errors.items()}
