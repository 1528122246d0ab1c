"""Laws fitted to the pulls of a campaign: specimens first, then samples. Names load on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.fitting.both_variables import fit_errors_in_both
    from tribo.fitting.budget import campaign_budgets, uncertainty_budget
    from tribo.fitting.curves import fit_power_law
    from tribo.fitting.mixed import mixed_model
    from tribo.fitting.outlying import outlying_pulls, outlying_specimens
    from tribo.fitting.pooled_scatter import pool_specimen_scatter
    from tribo.fitting.power import power_of_campaign
    from tribo.fitting.repeats import repeat_scatter
    from tribo.fitting.samples import fit_samples
    from tribo.fitting.three_term import fit_three_term

__all__ = [
    "campaign_budgets",
    "fit_errors_in_both",
    "fit_power_law",
    "fit_samples",
    "fit_three_term",
    "mixed_model",
    "outlying_pulls",
    "outlying_specimens",
    "pool_specimen_scatter",
    "power_of_campaign",
    "repeat_scatter",
    "uncertainty_budget",
]

_HOME = {
    "campaign_budgets": "budget",
    "fit_errors_in_both": "both_variables",
    "fit_power_law": "curves",
    "fit_samples": "samples",
    "fit_three_term": "three_term",
    "mixed_model": "mixed",
    "outlying_pulls": "outlying",
    "outlying_specimens": "outlying",
    "pool_specimen_scatter": "pooled_scatter",
    "power_of_campaign": "power",
    "repeat_scatter": "repeats",
    "uncertainty_budget": "budget",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
