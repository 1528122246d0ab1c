"""One campaign of eight samples with everything that a fit may meet, and all that is fitted to it: kept.

    cd tests; PYTHONPATH=.:../benchmarks python fitting/kept_fits.py

writes ``kept_fits.json`` anew. Do so where a change of a fit is meant, and say so in CHANGELOG.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from kept_numbers import scatter, write
from other_fits import fit_errors_in_both, fit_power_law, pool_specimen_scatter

from tribo.fitting import fit_samples, fit_three_term, power_of_campaign, uncertainty_budget
from tribo.fitting.assessment import (
    outlying_pulls,
    outlying_sentences,
    outlying_specimens,
    paired_differences,
    power_sentences,
    smallest_difference,
)
from tribo.fitting.linear import WEIGHTS, repeat_scatter, sample_rows
from tribo.records import REGIMES, LawFit, Regime

KEPT = Path(__file__).with_name("kept_fits.json")
AREA = 55e-6
LOADS = (0.064, 0.26, 0.5, 0.9, 1.37)
LAWS = {"F": (4.8, 22e3), "A": (4.2, 17e3), "B": (3.8, 11e3), "Sx": (3.5, 12e3), "Sy": (3.2, 10e3)}
FRACTIONS = {"F": 1.0, "A": 0.95, "B": 0.65, "Sx": 0.7, "Sy": 0.7, "lone": 0.8, "apart": 0.9, "still": 1.0}
INSTRUMENT = {"mass_u_g": 0.1, "wire_angle_deg": 1.0, "load_cell_u_N": 0.01, "normal_load_u_percent": 0.5}


def campaign() -> pd.DataFrame:
    """Five samples of three specimens, five loads and two repeats, S pulled both ways; and three odd samples.

    One pull of B is twice as high, one specimen of five of A more than twice; one force of F is missing. "lone" has one
    specimen, "apart" one load for each of its specimens, "still" one load in all.
    """
    rows = [
        (s, f"{s[0]}{k}", load, s)
        for s in LAWS for k in range(5 if s == "A" else 3) for load in LOADS for _ in range(2)
    ]  # fmt: skip
    rows += [("lone", "L0", load, "F") for load in (0.0, *LOADS) for _ in range(2)]
    rows += [("apart", f"P{k}", load, "A") for k, load in enumerate(LOADS) for _ in range(2)]
    rows += [("still", f"T{k}", 0.5, "F") for k in range(3) for _ in range(2)]
    own = dict(zip(sorted({r[1] for r in rows}), 0.05 * scatter(1, 40), strict=False))
    forces = []
    for k, (static, sliding) in enumerate(zip(0.06 * scatter(2, len(rows)), 0.04 * scatter(3, len(rows)), strict=True)):
        _, specimen, load, like = rows[k]
        mu, tau0 = LAWS[like]
        gain = 1.0 + own[specimen]
        line = gain * (mu * load + tau0 * AREA)
        bent = gain * (0.6 * mu * load ** (0.9 if like == "F" else 1.0) + 0.5 * tau0 * AREA)
        forces.append((line * (1.0 + static), 0.01 * line, bent * (1.0 + sliding) + 0.002, 0.004 * bent))
    table = pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "like"]).drop(columns="like")
    table[["static_N", "static_u_N", "sliding_N", "sliding_u_N"]] = forces
    table["test_id"] = [f"P{k:03d}" for k in range(len(table))]
    table.loc[table.index[table["specimen"] == "A1"], "static_N"] *= 1.33
    table.loc[table.index[table["sample"] == "B"][7], "static_N"] *= 2.0
    table.loc[table.index[table["sample"] == "F"][4], "static_N"] = np.nan
    return table


def fitted() -> dict[str, Any]:
    """Everything that is fitted to the campaign, by name."""
    found = {f"{regime}, {name}": value for regime in REGIMES for name, value in fitted_to(campaign(), regime).items()}
    found["smallest differences"] = [
        [smallest_difference(sd, g, level, power) for sd, g in ((1.0, 2), (0.5, 3.5), (2.0, 12))]
        for level, power in ((0.05, 0.8), (0.01, 0.9))
    ]
    return found


def fitted_to(table: pd.DataFrame, regime: Regime) -> dict[str, Any]:
    """Every law under all weights, and what is judged by the fits."""
    lines = table[table["sample"] != "still"]
    loaded = lines[(lines["sample"] != "apart") & (lines["normal_load_N"] > 0)]
    found: dict[str, Any] = {}
    for weights in WEIGHTS:
        found[weights] = records(fit_samples(table, regime, AREA, weights=weights))
    found["tests"] = records(fit_samples(table, regime, AREA, by="tests"))
    for law in ("pressure_power", "pressure_power_adhesion"):
        found[law] = records(fit_power_law(table, regime, AREA, law=law))
    for weights in ("relative", "force"):
        found[f"three terms, {weights}"] = record(fit_three_term(lines, regime, AREA, FRACTIONS, weights=weights))
    for u_N, share in ((0.01, 0.0), (0.0, 0.03), (0.02, 0.01)):
        both = fit_errors_in_both(loaded, regime, AREA, load_u_N=u_N, load_u_share=share)
        found[f"load uncertain by {u_N} N and {share}"] = records(both)
    return found | judged(table, regime)


def judged(table: pd.DataFrame, regime: Regime) -> dict[str, Any]:
    """Scatter of repeats, outliers, power, pooled scatter, paired differences and budgets."""
    fits = fit_samples(table, regime, AREA)
    samples = tuple(rows for rows in sample_rows(table, regime) if len(rows.specimens) > 1)
    whole = [fit for fit in fits if np.isfinite(fit.covariance).all()]
    power = pd.concat([power_of_campaign(table, regime, AREA, wanted_pct=wanted) for wanted in (60.0, 10.0)])
    pulls, specimens = (look(table, regime, AREA) for look in (outlying_pulls, outlying_specimens))
    budgets = [
        (load_N, uncertainty_budget(table, fit, instrument, load_N=load_N, **signal))
        for fit in whole
        for load_N, instrument, signal in (
            (10e3 * AREA, INSTRUMENT, {"rise_N_per_s": 1.5, "sampling_rate_Hz": 50.0}), (4e3 * AREA, {}, {}),
        )
    ]  # fmt: skip
    return {
        "repeats": dict(zip(("constant_N", "share", "dof"), repeat_scatter(samples) or (), strict=True)),
        "outlying": said(pulls, outlying_sentences(pulls)),
        "outlying specimens": said(specimens, outlying_sentences(specimens)),
        "power": said(power, power_sentences(power)),
        "paired": paired_differences(fits).to_dict("records"),
        "pooled": records(pool_specimen_scatter(fits)),
        "budgets": [
            [budget.to_dict("list"), budget.attrs["notes"], combined(fit, load_N)] for load_N, (fit, budget) in budgets
        ],
    }


def said(rows: pd.DataFrame, sentences: list[str]) -> list[Any]:
    """Every row with its sentence; None where a number is missing."""
    found = rows.astype(object).where(rows.notna(), None).to_dict("records")
    return [[row, sentence] for row, sentence in zip(found, sentences, strict=True)]


def combined(fit: LawFit, load_N: float) -> list[list[float]]:
    """Degrees of freedom and half width of the 95 % interval of mu, tau0 in kPa, and T."""
    mu, tau0_Pa = (np.diff(fit.interval(name))[0] / 2 for name in fit.parameters)
    halves = (mu, tau0_Pa / 1e3, float(fit.force_half_width_N(load_N)[0]))
    by = (*np.eye(2), np.array([load_N, AREA]))
    return [[fit.effective_dof(row), width] for row, width in zip(by, halves, strict=True)]


def records(fits: Iterable[LawFit]) -> list[Mapping[str, Any]]:
    return [record(fit) for fit in fits]


def record(fit: LawFit) -> Mapping[str, Any]:
    """Values and uncertainties in units of comparable size: tau0 in kPa."""
    scale = np.array([1e-3 if name.endswith("_Pa") else 1.0 for name in fit.parameters])
    return {
        "sample": fit.sample, "values": fit.values * scale, "covariance": fit.covariance * np.outer(scale, scale),
        "dof": fit.dof, "counts": [fit.n_specimens, fit.n_tests], "method": fit.method, "chi2_red": fit.chi2_red,
        "specimens": {name: own * scale for name, own in fit.specimens.items()}, "notes": fit.notes,
    }  # fmt: skip


if __name__ == "__main__":
    write(KEPT, fitted())
