"""The law of every sample alone as layers of a verdict: the baseline of a diagnosis without the spring-block model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.stats import t as t_distribution

from tribo.diagnose.verdict import Estimate, Layer
from tribo.records import REGIMES, Study

UNITS = {"constant": ("N", ""), "linear": ("", "N"), "three_term": ("", "N")}
NAMES = {"constant": ("T0",), "proportional": ("mu",), "hertz": ("a",), "linear": ("mu", "T0"), "power": ("a", "b")}


def law_layers(study: Study) -> list[Layer]:
    """One layer per sample and regime: the law chosen for it, or the mean of T/N where the loads determine none."""
    table = study.laws
    chosen = {} if table is None else {(row["sample"], row["regime"]): row for row in _rows(table) if row["chosen"]}
    found = []
    for sample, regime, ratio, loads in _measured(study):
        row = chosen.get((sample, regime))
        found.append(_of_law(row, _line(table, row), loads) if row else _of_mean(sample, regime, ratio))
    return found


def _rows(table: Any) -> list[dict[str, Any]]:
    return [{str(k): v for k, v in row.items()} for row in table.to_dict("records")]


def _line(table: Any, row: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
    """The straight line fitted to the same sample and regime."""
    if row is None:
        return None
    same = (r for r in _rows(table) if (r["sample"], r["regime"], r["law"]) == (row["sample"], row["regime"], "linear"))
    return next(same, None)


def _measured(study: Study) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Sample, regime, T/N of its tests and their loads."""
    table = study.ingested.table()
    for sample in dict.fromkeys(table["sample"]):
        for regime in REGIMES:
            part = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"]) & (table["normal_load_N"] > 0)]
            if len(part):
                load = part["normal_load_N"].to_numpy(float)
                yield str(sample), regime, part[f"{regime}_N"].to_numpy(float) / load, load


def _of_law(row: Mapping[str, Any], line: Mapping[str, Any] | None, loads: np.ndarray) -> Layer:
    sample, regime = str(row["sample"]), str(row["regime"])
    names = NAMES.get(row["law"], ("a", "b"))
    units = UNITS.get(row["law"], ("", ""))
    parameters = {
        name: _estimate(row[key], row[f"{key}_u"], unit, row["loads"] - row["parameters"])
        for name, key, unit in zip(names, ("a", "b"), units, strict=False)
        if math.isfinite(row[key])
    }
    sizes = ", ".join(f"{n} = {_sized(e)}" for n, e in parameters.items())
    text = f"{regime.capitalize()} friction of {sample} follows {row['formula']} with {sizes}."
    if row["law"] in ("power", "linear", "constant", "three_term", "hertz") and line is not None:
        text += f" {_constant_part(line, loads)}"
    return Layer(
        kind="baseline", name="normal_load_N", samples=(sample,), regimes=(regime,), p_adjusted=float("nan"),
        effect_percent=float("nan"), low=float("nan"), high=float("nan"), parameters=parameters,
        formula=str(row["formula"]), text=text,
    )  # fmt: skip


def _constant_part(line: Mapping[str, Any], loads: np.ndarray) -> str:
    """How much of T does not depend on the load, by the straight line."""
    constant = _estimate(line["b"], line["b_u"], "N", line["loads"] - 2)
    if constant.low <= 0.0 <= constant.high:
        return "A straight line leaves no certain part of T that does not depend on the load."
    if constant.value < 0.0:
        return f"A straight line falls to {_sized(constant)} at zero load: friction is weak at small loads."
    middle = float(np.median(loads))
    share = 100.0 * line["b"] / max(line["a"] * middle + line["b"], 1e-300)
    return (
        f"A straight line leaves {_sized(constant)} at zero load: {share:.0f} % of T at {middle:.3g} N does not depend "
        "on the load."
    )


def _of_mean(sample: str, regime: str, ratio: np.ndarray) -> Layer:
    u = float(ratio.std(ddof=1) / math.sqrt(ratio.size)) if ratio.size > 1 else float("nan")
    mean = _estimate(float(ratio.mean()), u, "", ratio.size - 1)
    text = f"Mean {regime} T/N of {sample}: {_sized(mean)}; the loads do not determine a law."
    return Layer(
        kind="baseline", name="normal_load_N", samples=(sample,), regimes=(regime,), p_adjusted=float("nan"),
        effect_percent=float("nan"), low=float("nan"), high=float("nan"), parameters={"T/N": mean}, formula="T = μ N",
        text=text,
    )  # fmt: skip


def _estimate(value: float, u: float, unit: str, dof: int) -> Estimate:
    """A value with its 90 % interval by Student's t."""
    half = float(t_distribution.ppf(0.95, max(dof, 1))) * u
    return Estimate(float(value), float(value - half), float(value + half), unit)


def _sized(e: Estimate) -> str:
    said = f"{e.value:.3g} {e.unit}".rstrip()
    return f"{said} (90 % interval {e.low:.3g} to {e.high:.3g})" if math.isfinite(e.low) else said
