"""The numbers of a diagnosis as CSV: every test beside the models, and every layer and misfit with its percentages."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribo.report.result_tables import to_csv
from tribo.store.whole_files import write_text

if TYPE_CHECKING:
    import pandas as pd

    from tribo.diagnose import Diagnosis

LAYERS_COLUMNS = [
    "kind", "name", "samples", "regimes", "effect_percent", "low", "high", "p_adjusted", "at", "tied_with", "formula",
    "log_score_gain", "log_score_gain_se", "rmse_percent_before", "rmse_percent_after",
]  # fmt: skip


def write_diagnosis_tables(diagnosis: Diagnosis, out: Path) -> list[Path]:
    """OUT/diagnosis.csv, one row per test and regime, and OUT/layers.csv, one row per layer and misfit."""
    from tribo.diagnose import residual_table

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
