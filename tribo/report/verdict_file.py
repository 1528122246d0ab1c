"""A diagnosis on paper: verdict.json, and the same verdict as a section of the page (schema tribo.verdict/1)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tribo.report.words.numerals import joined, significant
from tribo.store.whole_files import write_text

OUTCOMES = {
    "no_misfit": "No misfit found.",
    "named": "The cause is named.",
    "undetermined": "Something is wrong, and several causes explain it about equally.",
    "unknown": "Something is wrong, and no known mechanism explains it.",
}


def write_verdict(verdict: Mapping[str, Any], out: Path) -> Path:
    """Write out/verdict.json from a verdict in the form of its schema."""
    return write_text(out / "verdict.json", json.dumps(verdict, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def verdict_in_words(verdict: Mapping[str, Any]) -> dict[str, Any]:
    """What the page shows of a verdict: every part in words, empty where the verdict has none."""
    return {
        "outcome": OUTCOMES.get(str(verdict["verdict"]), str(verdict["verdict"])),
        "text": str(verdict.get("text") or ""),
        "equivalent": [_tie(names) for names in verdict.get("equivalent") or () if len(names) > 1],
        "causes": [_cause(cause) for cause in verdict.get("causes") or ()],
        "gain": _gain(verdict.get("gain")),
        "next_test": str((verdict.get("next_test") or {}).get("text") or ""),
        "misfits": [_misfit(misfit) for misfit in verdict.get("misfits") or ()],
        "excluded": [(_plain(e["mechanism"]), e["reason"]) for e in verdict.get("excluded") or ()],
    }


def _plain(mechanism: str) -> str:
    return mechanism.replace("_", " ")


def _tie(names: list[str]) -> str:
    return f"This campaign cannot tell {joined([_plain(n) for n in names])} apart."


def _cause(cause: Mapping[str, Any]) -> dict[str, Any]:
    sizes = [
        f"{_plain(name)} = {significant(_number(e['value']))} ({significant(_number(e['low']))} to "
        f"{significant(_number(e['high']))}) {e.get('unit', '')}".rstrip()
        for name, e in (cause.get("parameters") or {}).items()
    ]
    weight = f"{_number(cause['weight']):.2f}"
    return {"mechanism": _plain(cause["mechanism"]), "weight": weight, "sizes": sizes, "text": cause.get("text", "")}


def _misfit(misfit: Mapping[str, Any]) -> dict[str, str]:
    p = _number(misfit["p_adjusted"])
    return {
        "observable": _plain(misfit["observable"]),
        "sample": str(misfit.get("sample") or "all"),
        "covariate": _plain(str(misfit.get("covariate") or "–")),
        "p": "below 0.001" if p < 0.001 else f"{p:.3f}",
        "text": str(misfit.get("text") or ""),
    }


def _gain(gain: Mapping[str, Any] | None) -> str:
    """What the extended model gains on tests left out, in one sentence."""
    if not gain:
        return ""
    difference, se = _number(gain["difference"]), _number(gain["se"])
    before, after = _number(gain["rmse_percent_before"]), _number(gain["rmse_percent_after"])
    clear = abs(difference) > 2 * se
    return (
        f"On data left out ({_plain(str(gain['held_out']))}), the extended model predicts "
        f"{'better' if difference > 0 else 'worse'} by {significant(abs(difference))} ± {significant(se, 2)} in log "
        f"score a test{'' if clear else ', which may be chance'}; its RMSE goes from {significant(before, 2)} to "
        f"{significant(after, 2)} %."
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
