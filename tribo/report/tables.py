"""The tables of a study as data frames and CSV files. Units end the column names; NaN is an empty cell.

The numbers of a diagnosis as CSV: every test beside the models, and every layer and misfit with its percentages.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from tribo.comparison.agreement import ratios
from tribo.comparison.study_lookup import all_set_aside
from tribo.files import write_text
from tribo.records import Pull, SetAside, Study, Test
from tribo.user_text import for_spreadsheet
from tribo.vocabulary import label_with_unit

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis


FLOAT_FORMAT = "%.8g"
TESTS_COLUMNS = [
    "test_id", "static_N", "static_u_N", "sliding_N", "sliding_u_N", "rule", "window", "zero_N", "flags",
    "set_aside", "sample", "specimen", "normal_load_N", "peak_s", "onset_s", "window_start_s", "window_end_s",
    "zero_u_N", "rise_N_per_s", "rise_stiffness_N_per_m", "stick_slip_amplitude_N", "stick_slip_period_s", "noise_N",
    "drift_N_per_s", "direction", "speed_m_s", "hold_s", "repeat", "run_order", "specimen_run", "started_at",
    "temperature_C", "humidity_pct", "operator", "file", "doubts", "zero_rule", "first_maximum_N", "highest_N",
    "first_drop_N", "recorded_load_N", "recorded_load_u_N", "regime", "cycles", "stick_peak_N", "stick_peak_u_N",
    "stick_trough_N", "stick_trough_u_N", "stick_drop_N", "stick_drop_u_N", "stick_period_s", "stick_period_u_s",
    "loading_N_per_s", "loading_u_N_per_s", "stuck_share", "stuck_share_u", "restarts", "restart_N", "restart_u_N",
    "restart_hold_s",
]  # fmt: skip
RESTARTS_COLUMNS = [
    "test_id", "sample", "specimen", "normal_load_N", "restart", "hold_s", "stop_s", "peak_s", "static_N", "static_u_N",
    "sliding_N", "sliding_u_N",
]  # fmt: skip
COMPARISON_COLUMNS = [
    "sample", "regime", "normal_load_N", "measured_N", "measured_u_N", "simulated_N", "simulated_u_N",
    "ratio", "ratio_low", "ratio_high",
]  # fmt: skip
_READINGS = [
    "static_N", "static_u_N", "sliding_N", "sliding_u_N", "rule", "zero_N", "peak_s", "onset_s", "zero_u_N",
    "rise_N_per_s", "rise_stiffness_N_per_m", "stick_slip_amplitude_N", "stick_slip_period_s", "noise_N",
    "drift_N_per_s", "zero_rule", "first_maximum_N", "highest_N", "first_drop_N", "recorded_load_N",
    "recorded_load_u_N",
]  # fmt: skip
_CONDITIONS = [
    "sample", "specimen", "normal_load_N", "direction", "speed_m_s", "hold_s", "repeat", "run_order",
    "specimen_run", "started_at", "temperature_C", "humidity_pct", "operator", "file",
]  # fmt: skip


def tests_table(study: Study) -> pd.DataFrame:
    """One row per test in the order of the campaign, used or set aside; its own covariates come last."""
    ingested = study.ingested
    aside = all_set_aside(study)
    doubts = {doubted.test_id: doubted.reason for doubted in ingested.doubts()}
    placed = [
        (
            t.row,
            _test_row(t, ingested.pulls.get(t.test_id), aside.pop(t.test_id, None))
            | {"doubts": doubts.get(t.test_id, "")},
        )
        for t in ingested.campaign.tests
    ]
    placed += [(_faulty_row(fault), {"test_id": fault.test_id, "set_aside": fault.reason}) for fault in aside.values()]
    rows = [row for _, row in sorted(placed, key=lambda item: math.inf if item[0] is None else item[0])]
    return pd.DataFrame(rows, columns=[*TESTS_COLUMNS, *covariates(study)])


def covariates(study: Study) -> list[str]:
    """Columns of tests.csv that tribo does not know and keeps as they are."""
    found = dict.fromkeys(name for t in study.ingested.campaign.tests for name in t.covariates)
    return [name for name in found if name not in TESTS_COLUMNS]


def _faulty_row(fault: SetAside) -> int | None:
    """The row of tests.csv that a test set aside before its export was read stands in, where it is known."""
    return next((p.row for p in fault.problems if p.row is not None), None)


def _test_row(test: Test, pull: Pull | None, fault: SetAside | None) -> dict[str, object]:
    row: dict[str, object] = {**test.covariates, "test_id": test.test_id}
    row |= {name: getattr(test, name) for name in _CONDITIONS}
    row["set_aside"] = fault.reason if fault is not None else ""
    if pull is not None:
        start, end = pull.window_s
        row |= {name: getattr(pull, name) for name in _READINGS}
        row |= {"window": f"{start:.6g}:{end:.6g}", "window_start_s": start, "window_end_s": end}
        row["flags"] = ";".join(pull.flags)
        row |= _oscillation_cells(pull) | _restart_cells(pull)
    return row


def _oscillation_cells(pull: Pull) -> dict[str, object]:
    """How the force varies while sliding; a steady or irregular one has no cycles to report."""
    found = pull.oscillation
    if found is None:
        return {}
    named = {name: getattr(found, name) for name in ("regime", "cycles", "loading_N_per_s", "loading_u_N_per_s")}
    named |= {"stuck_share": found.stuck_share, "stuck_share_u": found.stuck_share_u}
    for name in ("peak", "trough", "drop"):
        named |= {f"stick_{name}_N": getattr(found, f"{name}_N"), f"stick_{name}_u_N": getattr(found, f"{name}_u_N")}
    return named | {"stick_period_s": found.period_s, "stick_period_u_s": found.period_u_s}


def _restart_cells(pull: Pull) -> dict[str, object]:
    """The number of restarts, and the first of them; all are in restarts.csv."""
    if not pull.restarts:
        return {}
    first = pull.restarts[0]
    found = {"restart_N": first.static_N, "restart_u_N": first.static_u_N, "restart_hold_s": first.hold_s}
    return {"restarts": len(pull.restarts), **found}


def restarts_table(study: Study) -> pd.DataFrame:
    """One row per restart after a stop of the drive, with the time it stood still."""
    pulls = study.ingested.pulls
    rows = [
        {name: getattr(test, name) for name in RESTARTS_COLUMNS[:4]} | {"restart": number} | vars(restart)
        for test in study.ingested.campaign.tests
        if test.test_id in pulls
        for number, restart in enumerate(pulls[test.test_id].restarts, start=1)
    ]
    return pd.DataFrame(rows, columns=RESTARTS_COLUMNS)


def other_fits_table(study: Study) -> pd.DataFrame:
    """The data under other weights or laws, and the model's own fits: one row per parameter, SI units."""
    simulated = study.comparison.simulated if study.comparison is not None else ()
    labelled = [("measured", f) for f in study.other_fits] + [("simulated", f) for f in simulated]
    rows = [
        (
            source,
            f.sample,
            f.regime,
            f.law,
            f.method,
            name,
            f.value(name),
            f.standard_uncertainty(name),
            *f.interval(name),
            f.dof,
            f.n_specimens,
            f.n_tests,
            f.chi2_red,
        )
        for source, f in labelled
        for name in f.parameters
    ]
    columns = ["source", "sample", "regime", "law", "method", "parameter", "value", "u", "low", "high"]
    return pd.DataFrame(rows, columns=[*columns, "dof", "n_specimens", "n_tests", "chi2_red"])


def comparison_table(study: Study) -> pd.DataFrame:
    """Measured and simulated force at each load; ``ratio`` is measured over simulated, with 95 %."""
    if study.comparison is None:
        return pd.DataFrame(columns=COMPARISON_COLUMNS)
    rows = pd.DataFrame([vars(row) for row in study.comparison.rows], columns=COMPARISON_COLUMNS[:7])
    beside = ratios(study).drop(columns="sample_number")
    return rows.merge(beside, on=["sample", "regime", "normal_load_N"], how="left", validate="1:1")


def to_csv(table: pd.DataFrame) -> str:
    """CSV text, the same for the same table on every machine; texts that a spreadsheet would take for formulas escaped.

    See :func:`tribo.user_text.for_spreadsheet`.
    """
    table = table.rename(columns=lambda name: for_spreadsheet(str(name)))
    for name in table.select_dtypes(exclude="number"):
        table[name] = [for_spreadsheet(cell) if isinstance(cell, str) else cell for cell in table[name]]
    for name in table.select_dtypes("float"):
        table[name] = table[name].replace(-0.0, 0.0).where(np.isfinite(table[name]) | table[name].isna(), np.nan)
    return str(table.to_csv(index=False, float_format=FLOAT_FORMAT, lineterminator="\n"))


def _dependence_table(table: pd.DataFrame) -> pd.DataFrame:
    """The dependences with the labels of the variables that cannot be separated."""
    others = [", ".join(map(label_with_unit, names)) for names in table["inseparable_from"]]
    return table.assign(inseparable_from=others)


def write_tables(study: Study, out: Path) -> list[Path]:
    """tests.csv, and fits, other_fits, budget, differences and comparison as far as the study went."""
    tables = {"tests.csv": tests_table(study)}
    if not (restarts := restarts_table(study)).empty:
        tables["restarts.csv"] = restarts
    if study.fits:
        tables["fits.csv"] = study.fits.table()
        tables["other_fits.csv"] = other_fits_table(study)
    if study.laws is not None and not study.laws.empty:
        tables["laws.csv"] = study.laws
    if study.dependence is not None and not study.dependence.empty:
        tables["dependence.csv"] = _dependence_table(study.dependence)
    if study.budget is not None:
        tables["budget.csv"] = study.budget
    if study.differences is not None:
        tables["differences.csv"] = study.differences
    if study.comparison is not None:
        tables["comparison.csv"] = comparison_table(study)
    return [write_text(out / name, to_csv(table)) for name, table in tables.items()]


LAYERS_COLUMNS = [
    "kind", "name", "samples", "regimes", "effect_percent", "low", "high", "p_adjusted", "at", "tied_with", "formula",
    "log_score_gain", "log_score_gain_se", "rmse_percent_before", "rmse_percent_after",
]  # fmt: skip


def write_diagnosis_tables(diagnosis: Diagnosis, out: Path) -> list[Path]:
    """OUT/diagnosis.csv, one row per test and regime, and OUT/layers.csv, one row per layer and misfit."""
    from tribo.diagnostics import residual_table

    tables = {"diagnosis.csv": residual_table(diagnosis), "layers.csv": layers_table(diagnosis.verdict.as_dict())}
    return [write_text(out / name, to_csv(table)) for name, table in tables.items()]


def layers_table(verdict: Mapping[str, Any]) -> pd.DataFrame:
    """Pattern corrections, causes, laws, remainders, misfits and the gain of the verdict, with their percentages."""
    import pandas as pd

    rows = [_of_layer(layer) for layer in verdict["layers"]] + [_of_misfit(m) for m in verdict["misfits"]]
    if verdict["gain"]:
        rows.append({"kind": "gain", "name": verdict["gain"]["held_out"], **_gain(verdict["gain"])})
    simulated = (verdict.get("model") or {}).get("simulated") or {}
    if "rms_percent_before" in simulated:
        rows += [
            {"kind": "rms", "name": name, "effect_percent": simulated[f"rms_percent_{name}"]}
            for name in ("before", "law", "simulated")
        ]
    return pd.DataFrame(rows, columns=LAYERS_COLUMNS)


def _of_layer(layer: Mapping[str, Any]) -> dict[str, Any]:
    own = {name: layer[name] for name in ("kind", "name", "effect_percent", "low", "high", "p_adjusted", "formula")}
    lists = {name: ";".join(layer[name]) for name in ("samples", "regimes", "tied_with")}
    return own | lists | {"at": layer.get("at", "")} | _gain(layer.get("gain"))


def _of_misfit(misfit: Mapping[str, Any]) -> dict[str, Any]:
    own = {name: misfit.get(name) for name in ("effect_percent", "low", "high", "p_adjusted")}
    where = {"name": misfit["covariate"], "samples": misfit["sample"], "regimes": misfit["observable"]}
    return {"kind": "misfit"} | where | own


def _gain(gain: Mapping[str, Any] | None) -> dict[str, Any]:
    if not gain:
        return {}
    rmse = {name: gain[name] for name in ("rmse_percent_before", "rmse_percent_after")}
    return {"log_score_gain": gain["difference"], "log_score_gain_se": gain["se"]} | rmse
