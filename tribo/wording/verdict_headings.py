"""What stands above the parts of a diagnosis, with the spring-block model and without it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

OUTCOMES_WITHOUT_MODEL = {
    "no_misfit": "Nothing beyond the law of each sample was found.",
    "named": "Friction varies with more than the load.",
}
HEADINGS = {
    "fails": "Where the model fails", "misfits": "Significant misfits", "none": "No statistically significant misfit.",
    "cause": "Cause", "causes": "Possible causes, in order of weight",
    "not_testable": "Mechanisms that this design cannot test",
}  # fmt: skip
HEADINGS_WITHOUT_MODEL = {
    "fails": "What friction varies with", "misfits": "Significant dependences",
    "none": "No statistically significant dependence beyond the law of each sample.", "cause": "Result",
    "causes": "What friction varies with, with its size", "not_testable": "What this design cannot test",
}  # fmt: skip


def without_model(verdict: Mapping[str, Any]) -> bool:
    """Whether a verdict was made without the spring-block model."""
    return "baseline" in (verdict.get("model") or {})


def headings(verdict: Mapping[str, Any]) -> dict[str, str]:
    """The headings of the section on a verdict."""
    return HEADINGS_WITHOUT_MODEL if without_model(verdict) else HEADINGS
