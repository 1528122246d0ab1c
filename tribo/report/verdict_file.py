"""verdict.json (schema tribo.verdict/2), and the same verdict as a section of the report."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tribo.diagnostics.sentences import sentence_case
from tribo.diagnostics.terms import name_in_words
from tribo.figures.misfit import LABELS
from tribo.files import write_text
from tribo.wording.numerals import joined, significant
from tribo.wording.verdict_headings import OUTCOMES_WITHOUT_MODEL, headings, without_model

OBSERVABLES = {
    "static": "static friction", "sliding": "sliding friction", "both": "static and sliding friction",
    "drop": "drop from static to sliding friction",
}  # fmt: skip
OUTCOMES = {
    "no_misfit": "No misfit found.",
    "named": "The cause was identified.",
    "undetermined": "The model does not fit the data, and several causes explain the misfit about equally well.",
    "partly": "A cause was identified, and a misfit remains that it does not explain.",
    "unknown": "The model does not fit the data, and no known mechanism explains the misfit.",
}
TIED = {
    "named": "The model does not fit the data; the cause is one of several that this campaign cannot distinguish.",
    "partly": "The model does not fit the data; the cause is one of several that this campaign cannot distinguish, and "
    "a misfit remains that none of them explains.",
}


def write_verdict(verdict: Mapping[str, Any], out: Path) -> Path:
    """Write out/verdict.json from a verdict in the form of its schema."""
    return write_text(out / "verdict.json", json.dumps(verdict, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def verdict_in_words(verdict: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a verdict as text for the report; empty where the verdict has none."""
    return {
        "headings": headings(verdict),
        "own_laws": [str(layer["text"]) for layer in _layers(verdict, "baseline")],
        "outcome": _outcome(verdict),
        "text": str(verdict.get("text") or ""),
        "equivalent": [_tie(names) for names in verdict.get("equivalent") or () if len(names) > 1],
        "causes": [_cause(cause) for cause in verdict.get("causes") or ()],
        "gain": _gain(verdict.get("gain")),
        "next_test": str((verdict.get("next_test") or {}).get("text") or ""),
        "misfits": [_misfit(misfit) for misfit in verdict.get("misfits") or ()],
        "excluded": [(name_in_words(e["mechanism"]), e["reason"]) for e in verdict.get("excluded") or ()],
        "not_testable": [(name_in_words(e["mechanism"]), _why(e["reason"])) for e in verdict.get("not_testable") or ()],
        "corrections": [_correction(x) for x in _layers(verdict, "pattern_correction")],
        "laws": [_law(x) for x in _layers(verdict, "law")],
    }


def _layers(verdict: Mapping[str, Any], kind: str) -> list[Mapping[str, Any]]:
    return [layer for layer in verdict.get("layers") or () if layer["kind"] == kind]


def _outcome(verdict: Mapping[str, Any]) -> str:
    """The verdict in one sentence, and that it has laws; causes that cannot be told apart are not called identified."""
    if without_model(verdict):
        return OUTCOMES_WITHOUT_MODEL.get(str(verdict["verdict"]), str(verdict["verdict"]))
    outcome, laws = str(verdict["verdict"]), _layers(verdict, "law")
    tied = any(len(names) > 1 for names in verdict.get("equivalent") or ())
    found = TIED[outcome] if tied and outcome in TIED else OUTCOMES.get(outcome, outcome)
    if not laws:
        return found
    return f"{found} {'A law was' if len(laws) == 1 else f'{len(laws)} laws were'} found that it follows."


def _law(layer: Mapping[str, Any]) -> dict[str, str]:
    """A law: the formula, what it says with its size, the laws that the design cannot tell apart from it, its gain."""
    gain = layer.get("gain")
    ties = layer.get("tied_with") or ()
    return {
        "formula": "; ".join([str(layer["formula"]), *_sizes(layer)]), "text": str(layer["text"]),
        "ties": "; ".join(ties) or "none",
        "gain": _gain(gain) if gain else "not tested",
    }  # fmt: skip


def _why(reason: str) -> str:
    """The reason without the words that stand above the table."""
    return reason.partition(": ")[2] or reason


def _correction(layer: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Sample, regime, mean of measured over modelled T less one with its interval, and the adjusted p value."""
    value, low, high = (f"{_number(layer[key]):+.0f}" for key in ("effect_percent", "low", "high"))
    p = _number(layer["p_adjusted"])
    size = f"{value} % ({low} to {high} %)".replace("-", "−")
    return layer["name"], layer["regimes"][0], size, "below 0.001" if p < 0.001 else f"{p:.3f}"


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _tie(names: list[str]) -> str:
    return f"This campaign cannot distinguish between {joined([name_in_words(n) for n in names])}."


def _cause(cause: Mapping[str, Any]) -> dict[str, Any]:
    weight, text = f"{_number(cause['weight']):.2f}", cause.get("text", "")
    name = sentence_case(name_in_words(cause["mechanism"]))
    return {"mechanism": name, "weight": weight, "sizes": _sizes(cause), "text": text}


def _sizes(named: Mapping[str, Any]) -> list[str]:
    """The parameters of a cause or a law with their intervals."""
    return [
        f"{_plain(name)} = {significant(_number(e['value']))} ({significant(_number(e['low']))} to "
        f"{significant(_number(e['high']))}) {e.get('unit', '')}".rstrip()
        for name, e in (named.get("parameters") or {}).items()
    ]


def _misfit(misfit: Mapping[str, Any]) -> dict[str, str]:
    p = _number(misfit["p_adjusted"])
    return {
        "observable": OBSERVABLES.get(misfit["observable"], _plain(misfit["observable"])),
        "sample": str(misfit.get("sample") or "all"),
        "covariate": LABELS.get(str(misfit.get("covariate")), _plain(str(misfit.get("covariate") or "–"))),
        "p": "below 0.001" if p < 0.001 else f"{p:.3f}",
        "text": str(misfit.get("text") or ""),
    }


def _gain(gain: Mapping[str, Any] | None) -> str:
    """Improvement by the extended model on tests not used in the fit, in one sentence."""
    if not gain:
        return ""
    difference, se = _number(gain["difference"]), _number(gain["se"])
    before, after = _number(gain["rmse_percent_before"]), _number(gain["rmse_percent_after"])
    clear = abs(difference) > 2 * se
    return (
        f"For tests left out of the fit ({_plain(str(gain['held_out']))}), the extended model predicts "
        f"{'better' if difference > 0 else 'worse'} by a log score of {significant(abs(difference))} ± "
        f"{significant(se, 2)} per test{'' if clear else ', which may be due to chance'}; the RMSE changes from "
        f"{significant(before, 2)} % to {significant(after, 2)} %."
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
