"""What is reported beside the fits: other weights and laws, uncertainty budget, power and outlying pulls."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd

from tribo.errors import FitError
from tribo.fitting.budget import Budget, campaign_budgets
from tribo.fitting.dependence import dependence
from tribo.fitting.law_choice import compared_laws
from tribo.fitting.mixed import mixed_model
from tribo.fitting.outlying import outlying_pulls, outlying_specimens
from tribo.fitting.paired import differences_table, paired_differences
from tribo.fitting.power import power_of_campaign
from tribo.fitting.samples import fit_samples
from tribo.fitting.three_term import fit_three_term
from tribo.fitting.weighting import WEIGHTS
from tribo.records import NO_AREA_M2, REGIMES, Ingested, LawFit


def assessment(ingested: Ingested, fits: tuple[LawFit, ...], weights: str) -> dict[str, Any]:
    """The results that complete the fits of a study, by the name of their field in ``Study``."""
    table, area = ingested.table(), ingested.campaign.nominal_area_m2
    has_area = ingested.campaign.has_area  # budget and power are stated at a pressure
    budgets = budgets_of(ingested, fits, weights)
    parts = [b.table().assign(sample=b.fit.sample, regime=b.fit.regime) for b in budgets if has_area]
    power: list[str] = []
    outlying: list[str] = []
    for regime in REGIMES:
        with suppress(FitError):
            if not has_area:
                break
            power += [p.text() for p in power_of_campaign(table, regime, area, weights=weights)]
        for look in (outlying_pulls, outlying_specimens):
            with suppress(FitError):
                outlying += [found.text() for found in look(table, regime, area)]
    return {
        "combined": tuple(b.combined() for b in budgets),
        "other_fits": _other_fits(ingested, fits, weights),
        "budget": pd.concat(parts, ignore_index=True) if parts else None,
        "power": tuple(power),
        "outlying": tuple(outlying),
        "laws": compared_laws(table),
        "dependence": dependence(ingested),
        "differences": differences_table(paired) if (paired := paired_differences(fits)) else None,
    }


def budgets_of(ingested: Ingested, fits: tuple[LawFit, ...], weights: str) -> tuple[Budget, ...]:
    """The budget of every fit; without a nominal area, T is judged at the middle load."""
    if not fits:
        return ()
    if ingested.campaign.has_area:
        return campaign_budgets(ingested, fits, weights=weights)
    middle = float(np.median([test.normal_load_N for test in ingested.campaign.tests]))
    return campaign_budgets(ingested, fits, weights=weights, pressure_Pa=middle / NO_AREA_M2)


def _other_fits(ingested: Ingested, fits: tuple[LawFit, ...], weights: str) -> tuple[LawFit, ...]:
    """The same law under the other weights, mixed models where they converge, and the three-term law."""
    table, area = ingested.table(), ingested.campaign.nominal_area_m2
    fractions = {s: ingested.campaign.area_fraction(s) for s in sorted(set(table["sample"]))}
    found: list[LawFit] = []
    for regime in REGIMES:
        for others in WEIGHTS:
            if others != weights:
                with suppress(FitError):  # "repeats" needs repeats, "ratio" loads above zero
                    found += fit_samples(table, regime, area, weights=others)
        resolved = {f.sample for f in fits if f.regime == regime and np.isfinite(f.values).all()}
        mixed = (mixed_model(rows, regime, area) for s, rows in table.groupby("sample") if s in resolved)
        found += [fit for fit in mixed if fit is not None]
        with suppress(FitError):
            found.append(fit_three_term(table, regime, area, fractions))
    return tuple(found)
