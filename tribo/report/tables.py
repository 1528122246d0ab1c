"""The tables of a study and of its diagnosis as data frames. Units end the column names; NaN is an empty cell.

What tables there are, with their columns in order, is stated in :mod:`tribo.outputs`, which calls the functions of this
module: each takes a study and its diagnosis, and gives None where there is nothing to write.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from tribo import outputs
from tribo.comparison.findings import all_set_aside, ratios_of
from tribo.records import Pull, SetAside, Study, Test
from tribo.vocabulary import label_with_unit

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis

_OF_TEST = {field.name for field in fields(Test)}
_OF_PULL = {field.name for field in fields(Pull)} - {"flags", "restarts", "slips"}


def tables_of(study: Study, diagnosis: Diagnosis | None = None) -> dict[str, pd.DataFrame]:
    """Every table that there is for a study, by the name of its file."""
    made = {p.name: p.table(study, diagnosis) for p in outputs.PRODUCTS if p.writer}
    return {name: table for name, table in made.items() if table is not None}


def write_tables(
    study: Study, out: Path, diagnosis: Diagnosis | None = None, tables: Mapping[str, pd.DataFrame] | None = None
) -> list[Path]:
    """Write every table that there is for a study as CSV.

    Parameters
    ----------
    study : Study
        The results of all stages that were run.
    out : Path
        Folder of results.
    diagnosis : Diagnosis, optional
        The diagnosis of the study.
    tables : mapping of str to DataFrame, optional
        The tables of :func:`tables_of` where they are at hand.

    Returns
    -------
    list of Path
        tests.csv, and restarts, phases, events, features, readings, fits, other_fits, laws, dependence, budget,
        differences, comparison, diagnosis and layers as far as the study went.
    """
    made = tables_of(study, diagnosis) if tables is None else tables
    return [outputs.write(out, name, table) for name, table in made.items()]


def tests_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame:  # noqa: PT028  (no test)
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
    return pd.DataFrame(rows, columns=[*outputs.product("tests.csv").column_names, *covariates(study)])


def covariates(study: Study) -> list[str]:
    """Columns of tests.csv that tribo does not know and keeps as they are."""
    found = dict.fromkeys(name for t in study.ingested.campaign.tests for name in t.covariates)
    return [name for name in found if name not in outputs.product("tests.csv").column_names]


def _faulty_row(fault: SetAside) -> int | None:
    """The row of tests.csv that a test set aside before its export was read stands in, where it is known."""
    return next((p.row for p in fault.problems if p.row is not None), None)


def _test_row(test: Test, pull: Pull | None, fault: SetAside | None) -> dict[str, object]:
    """A column is what the test, and then what the pull, holds under its name; a few are put together here."""
    row: dict[str, object] = {**test.covariates}
    for name in outputs.product("tests.csv").column_names:
        if name in _OF_TEST:
            row[name] = getattr(test, name)
        elif name in _OF_PULL and pull is not None:
            row[name] = getattr(pull, name)
    row["set_aside"] = fault.reason if fault is not None else ""
    if pull is not None:
        start, end = pull.window_s
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


def trace_laws_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """One row per parameter of every law that was read from a whole trace; None where none was."""
    if not study.trace_laws:
        return None
    rows = [
        (law.test_id, law.law, p.name, p.value, p.low, p.high, p.unit, "yes" if p.told else "cannot be told")
        for law in study.trace_laws for p in law.parameters
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=outputs.product("tracelaws.csv").column_names)


def restarts_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """One row per restart after a stop of the drive, with the time it stood still; None where there is none."""
    pulls, names = study.ingested.pulls, outputs.product("restarts.csv").column_names
    rows = [
        {name: getattr(test, name) for name in names[:4]} | {"restart": number} | vars(restart)
        for test in study.ingested.used_tests
        for number, restart in enumerate(pulls[test.test_id].restarts, start=1)
    ]
    return pd.DataFrame(rows, columns=names) if rows else None


def phases_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """One row per phase of every record that was read; None where forces were evaluated elsewhere alone."""
    pulls = study.ingested.pulls
    rows = [
        (
            test.test_id, p.name, p.start_s, p.end_s, 1e3 * p.speed_m_s, p.normal_load_N, p.cycle, p.force_N,
            p.force_u_N, p.evidence, p.doubt,
        )
        for test in study.ingested.used_tests
        for p in pulls[test.test_id].phases
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=outputs.product("phases.csv").column_names) if rows else None


def events_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """One row per slip of every record that was read; None where there is none."""
    pulls = study.ingested.pulls
    rows = [
        (
            test.test_id, number, s.start_s, s.fail_s, s.end_s, s.stiffness_N_per_m, s.points, s.drop_N, 1e6 * s.slip_m,
            s.duration_s, 1e3 * s.peak_velocity_m_s, 1e6 * s.precursory_slip_m, s.recurrence_s, s.hold_s,
        )
        for test in study.ingested.used_tests
        for number, s in enumerate(pulls[test.test_id].slips, start=1)
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=outputs.product("events.csv").column_names) if rows else None


def features_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """One row per feature of every trace that was read; None where there is none."""
    samples = {test.test_id: test.sample for test in study.ingested.campaign.tests}
    rows = [
        (test_id, samples.get(test_id, ""), name, f.value, f.u, f.low, f.high, f.count, outputs.unit_of(name) or "1")
        for test_id, found in study.ingested.features.items()
        if test_id in study.ingested.pulls
        for name, f in found.items()
    ]
    return pd.DataFrame(rows, columns=outputs.product("features.csv").column_names) if rows else None


def readings_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """One row per reading of a record that is more than one pull from rest; None where there is none."""
    samples = {test.test_id: test.sample for test in study.ingested.campaign.tests}
    samples |= {test_id.partition("#")[0]: sample for test_id, sample in samples.items()}
    rows = []
    for r in study.ingested.readings:
        row: dict[str, object] = {
            "test_id": r.test_id, "sample": samples.get(r.test_id, ""), "reading": r.name, "start_s": r.start_s,
            "end_s": r.end_s, "speed_mm_s": 1e3 * r.speed_m_s, "normal_load_N": r.normal_load_N, "way": r.way,
            "cycle": r.cycle, "hold_s": r.hold_s, "state": r.state,
        }  # fmt: skip
        for name, (value, low, high) in r.values.items():
            row |= {name: value, outputs.end_of(name, "low"): low, outputs.end_of(name, "high"): high}
        rows.append(row)
    table = pd.DataFrame(rows, columns=outputs.product("readings.csv").column_names)
    return table.replace([np.inf, -np.inf], np.nan) if rows else None


def fits_of_study(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """mu and tau0 (kPa) of every fit (:meth:`tribo.records.Fits.table`)."""
    return study.fits.table() if study.fits else None


def other_fits_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """The data under other weights or laws, and the model's own fits: one row per parameter, SI units."""
    if not study.fits:
        return None
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
    return pd.DataFrame(rows, columns=outputs.product("other_fits.csv").column_names)


def laws_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    return study.laws if study.laws is not None and not study.laws.empty else None


def dependence_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """The dependences with the labels of the variables that cannot be separated."""
    if study.dependence is None or study.dependence.empty:
        return None
    others = [", ".join(map(label_with_unit, names)) for names in study.dependence["inseparable_from"]]
    return study.dependence.assign(inseparable_from=others)


def budget_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    return study.budget


def differences_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    return study.differences


def comparison_table(study: Study, _: Diagnosis | None = None) -> pd.DataFrame | None:
    """Measured and simulated force at each load; ``ratio`` is measured over simulated, with 95 %."""
    if study.comparison is None:
        return None
    names = outputs.product("comparison.csv").column_names
    rows = pd.DataFrame([vars(row) for row in study.comparison.rows], columns=names[:7])
    beside = ratios_of(study).drop(columns="sample_number")
    return rows.merge(beside, on=["sample", "regime", "normal_load_N"], how="left", validate="1:1")


def residuals_table(_: Study | None, diagnosis: Diagnosis | None) -> pd.DataFrame | None:
    """One row per test and regime beside the models of the diagnosis."""
    from tribo.diagnostics import residual_table

    return residual_table(diagnosis) if diagnosis is not None else None


def layers_table(_: Study | None, diagnosis: Diagnosis | None) -> pd.DataFrame | None:
    """Pattern corrections, causes, laws, remainders, misfits and the gain of the verdict, with their percentages."""
    if diagnosis is None:
        return None
    verdict: Mapping[str, Any] = diagnosis.verdict.as_dict()
    rows = [_of_layer(layer) for layer in verdict["layers"]] + [_of_misfit(m) for m in verdict["misfits"]]
    if verdict["gain"]:
        rows.append({"kind": "gain", "name": verdict["gain"]["held_out"], **_gain(verdict["gain"])})
    simulated = (verdict.get("model") or {}).get("simulated") or {}
    if "rms_percent_before" in simulated:
        rows += [
            {"kind": "rms", "name": name, "effect_percent": simulated[f"rms_percent_{name}"]}
            for name in ("before", "law", "simulated")
        ]
    return pd.DataFrame(rows, columns=outputs.product("layers.csv").column_names)


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
