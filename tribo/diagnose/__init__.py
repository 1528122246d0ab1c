"""Residuals, what the design can tell apart, null calibration, naming, extension, gain, next test."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "diagnose": "diagnosis",
    "examine": "diagnosis",
    "Diagnosis": "diagnosis",
    "Verdict": "verdict",
    "Plan": "plan",
    "extended": "extend",
    "look_table": "tables",
    "misfit_map": "tables",
    "parse_with": "extend",
    "plan_design": "plan",
    "residual_table": "tables",
    "tabled_predictor": "predictor",
    "simulate_with": "extend",
    "simulated_predictor": "predictor",
    "weighing_table": "tables",
}
__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"tribo.diagnose.{_HOME[name]}"), name)
