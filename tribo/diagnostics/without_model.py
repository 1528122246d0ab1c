"""The law of every sample alone as layers of a verdict: the baseline of a diagnosis without the spring-block model.

The diagnosis of a study without the spring-block model; its baseline is the law of every sample alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import t as t_distribution

from tribo.diagnostics.column_search import (
    FEWEST_TESTS,
    ColumnEffect,
    RegimeTests,
    SearchedColumns,
    regime_tests,
    search_columns,
)
from tribo.diagnostics.verdict import Cause, Estimate, Excluded, Layer, Misfit, NextTest, Outcome, Verdict
from tribo.diagnostics.within_records import RunningIn, StrokeOffset, running_in, stroke_offset
from tribo.mechanisms.record import ALONG_RECORDS, STROKES_APART
from tribo.mechanisms.table import MECHANISMS
from tribo.records import REGIMES, Study
from tribo.vocabulary import label_with_unit

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
    has_constant = row["law"] in ("power", "linear", "constant", "three_term", "hertz") and line is not None
    return Layer(
        kind="baseline", name="normal_load_N", samples=(sample,), regimes=(regime,), p_adjusted=float("nan"),
        effect_percent=float("nan"), low=float("nan"), high=float("nan"), parameters=parameters,
        formula=str(row["formula"]), shows=_constant_part(line, loads) if has_constant else None,
    )  # fmt: skip


@dataclass(frozen=True)
class ConstantPart:
    """What a straight line leaves at zero load, and its share of T (percent) at the middle load."""

    constant: Estimate
    share_percent: float
    load_N: float


def _constant_part(line: Mapping[str, Any], loads: np.ndarray) -> ConstantPart:
    constant = _estimate(line["b"], line["b_u"], "N", line["loads"] - 2)
    middle = float(np.median(loads))
    share = 100.0 * line["b"] / max(line["a"] * middle + line["b"], 1e-300)
    return ConstantPart(constant, float(share), middle)


def _of_mean(sample: str, regime: str, ratio: np.ndarray) -> Layer:
    u = float(ratio.std(ddof=1) / math.sqrt(ratio.size)) if ratio.size > 1 else float("nan")
    mean = _estimate(float(ratio.mean()), u, "", ratio.size - 1)
    return Layer(
        kind="baseline", name="normal_load_N", samples=(sample,), regimes=(regime,), p_adjusted=float("nan"),
        effect_percent=float("nan"), low=float("nan"), high=float("nan"), parameters={"T/N": mean}, formula="T = μ N",
    )  # fmt: skip


def _estimate(value: float, u: float, unit: str, dof: int) -> Estimate:
    """A value with its 90 % interval by Student's t."""
    half = float(t_distribution.ppf(0.95, max(dof, 1))) * u
    return Estimate(float(value), float(value - half), float(value + half), unit)


BASELINE = "the law of each sample alone"

SHOWN_BY = {shown: m.name for m in MECHANISMS.values() for shown in m.without_model}
ANY_COLUMN = next(m.name for m in MECHANISMS.values() if m.any_column)
RUNNING_IN, OFFSET = SHOWN_BY[ALONG_RECORDS], SHOWN_BY[STROKES_APART]
MECHANISMS_OF_COLUMNS = {k: name for k, name in SHOWN_BY.items() if k not in (ALONG_RECORDS, STROKES_APART)}
SERIES = ("run_order", "specimen_run", "started_at", "date")  # columns that no one can vary


def name_of_column(column: str) -> str:
    """The name in a verdict of what follows a column: a mechanism of the library, or the column itself."""
    return MECHANISMS_OF_COLUMNS.get(column, f"{ANY_COLUMN}:{column}")


@dataclass(frozen=True)
class ColumnsTested:
    """The ``columns`` that were tested without the model, or why none was: ``n_tests`` are fewer than ``needed``."""

    columns: tuple[str, ...]
    untested: Literal["", "no tests", "no column varies", "too few tests"]
    n_tests: int = 0
    needed: int = 0


def diagnose_without_model(study: Study, *, seed: int = 0, level: float = 0.01) -> Verdict:
    """What friction varies with beyond the law of each sample over load, and what this design cannot tell.

    Parameters
    ----------
    study : Study
        With its laws chosen (:func:`tribo.assess`).
    seed : int
        Of the simulated campaigns that stand for chance.
    level : float
        Chance of naming anything where nothing is there.
    """
    rng = np.random.default_rng(seed)
    points = [t for regime in REGIMES if (t := regime_tests(study.ingested, regime)).n]
    enough = [t for t in points if t.enough]
    found = [search_columns(t, len(enough), level, rng) for t in enough]
    records = [r for r in running_in(study.ingested) if r.p < level]
    apart = stroke_offset(study.ingested)
    layers = [*law_layers(study), *_column_layers(found), *_record_layers(records), *_offset_layers(apart)]
    causes = [*_column_causes(found), *_record_causes(records), *_offset_causes(apart)]
    inseparable = _inseparable(study, found)
    tied = ((f.name, *f.alike) for s in found for f in s.follows if f.alike)
    equivalent = tuple(dict.fromkeys(tuple(map(name_of_column, names)) for names in tied))
    outcome: Outcome = "named" if causes else "no_misfit"
    return Verdict(
        verdict=outcome,
        misfits=tuple(_misfits(found, records)),
        causes=tuple(causes),
        equivalent=equivalent,
        not_testable=(*_not_testable(found), *inseparable),
        layers=tuple(layers),
        set_aside=study.ingested.set_aside,
        next_test=_next_test(found),
        model={"baseline": BASELINE},
        shows=_tested(points, found),
    )


def _tested(points: list[RegimeTests], found: list[SearchedColumns]) -> ColumnsTested:
    if found or not points:
        columns = tuple(sorted({name for s in found for name in s.columns}))
        return ColumnsTested(columns, "" if found else "no tests")
    if not any(t.columns or t.only_with_load for t in points):
        return ColumnsTested((), "no column varies")
    needed = max(FEWEST_TESTS, 2 * points[-1].law.shape[1])
    return ColumnsTested((), "too few tests", max(t.n for t in points), needed)


def _column_layers(found: list[SearchedColumns]) -> list[Layer]:
    return [
        Layer(
            kind="cause", name=name_of_column(f.name), samples=(), regimes=(f.regime,), p_adjusted=f.p,
            effect_percent=f.change_percent, low=f.low_percent, high=f.high_percent,
            tied_with=tuple(map(name_of_column, f.alike)), shows=(f,),
        )
        for s in found for f in s.follows
    ]  # fmt: skip


def _column_causes(found: list[SearchedColumns]) -> list[Cause]:
    """One cause per column, with its size in every regime in which it is beyond chance."""
    each: dict[str, list[ColumnEffect]] = {}
    for s in found:
        for f in s.follows:
            each.setdefault(f.name, []).append(f)
    return [
        Cause(
            name_of_column(alike[0].name), 1.0, {f"change of {f.regime} T": _size(f) for f in alike},
            shows=tuple(alike),
        )
        for alike in each.values()
    ]  # fmt: skip


def _size(f: ColumnEffect) -> Estimate:
    return Estimate(f.change_percent, f.low_percent, f.high_percent, "%")


def _misfits(found: list[SearchedColumns], records: list[RunningIn]) -> list[Misfit]:
    all_found = [f for s in found for f in s.follows]
    misfits = [Misfit(f.regime, "", f.name, f.change_percent, f.p, shows=(f,)) for f in all_found]
    for sample in dict.fromkeys(r.sample for r in records):
        part = [r for r in records if r.sample == sample]
        strongest = max(part, key=lambda r: abs(r.first_percent))
        misfits.append(Misfit("sliding", sample, "distance", strongest.first_percent, min(r.p for r in part),
                              shows=tuple(part)))  # fmt: skip
    return misfits


def _record_layers(records: list[RunningIn]) -> list[Layer]:
    found = []
    for sample in dict.fromkeys(r.sample for r in records):
        part = [r for r in records if r.sample == sample]
        changes = [r.first_percent for r in part]
        p = min(r.p for r in part)
        found.append(
            Layer(kind="cause", name=RUNNING_IN, samples=(sample,), regimes=("sliding",), p_adjusted=p,
                  effect_percent=float(np.median(changes)), low=min(changes), high=max(changes),
                  shows=tuple(part))
        )  # fmt: skip
    return found


def _record_causes(records: list[RunningIn]) -> list[Cause]:
    if not records:
        return []
    changes = [r.first_percent for r in records]
    size = Estimate(float(np.median(changes)), min(changes), max(changes), "%")
    return [Cause(RUNNING_IN, 1.0, {"first twentieth over second half": size}, shows=tuple(records))]


def _offset_layers(apart: StrokeOffset | None) -> list[Layer]:
    if apart is None or not apart.certain:
        return []
    return [Layer(kind="cause", name=OFFSET, samples=(), regimes=(), p_adjusted=apart.p,
                  effect_percent=apart.percent, low=apart.low_percent, high=apart.high_percent,
                  parameters={"F0": apart.offset}, shows=(apart,))]  # fmt: skip


def _offset_causes(apart: StrokeOffset | None) -> list[Cause]:
    if apart is None or not apart.certain:
        return []
    return [Cause(OFFSET, 1.0, {"F0": apart.offset}, shows=(apart,))]


def _inseparable(study: Study, found: list[SearchedColumns]) -> list[Excluded]:
    """Columns that vary only together with the load, and pairs of columns that vary together."""
    pairs: dict[tuple[str, str], list[str]] = {}
    table = study.dependence
    for row in [] if table is None else table.to_dict("records"):
        for other in row["inseparable_from"]:
            one, two = sorted((str(row["variable"]), other), key=label_with_unit)
            if "normal_load_N" in (one, two):
                continue  # said of the columns that vary only with the load
            samples = pairs.setdefault((one, two), [])
            if row["sample"] not in samples:
                samples.append(str(row["sample"]))
    said = [Excluded(name_of_column(name), "only with the load", shows=name) for name in _only_with_load(found)]
    together = (
        Excluded(f"{label_with_unit(a)} or {label_with_unit(b)}", "vary together", shows=(a, b, tuple(samples)))
        for (a, b), samples in pairs.items()
    )
    return [*said, *together]


def _only_with_load(found: list[SearchedColumns]) -> list[str]:
    return sorted({name for s in found for name in s.only_with_load})


def _not_testable(found: list[SearchedColumns]) -> list[Excluded]:
    """Mechanisms whose column does not vary, or was not recorded."""
    there = {name for s in found for name in (*s.columns, *s.only_with_load)}
    return [
        Excluded(mechanism, "not varied", shows=column)
        for column, mechanism in MECHANISMS_OF_COLUMNS.items()
        if found and column not in there
    ]


def _next_test(found: list[SearchedColumns]) -> NextTest | None:
    if columns := _only_with_load(found):
        design: dict[str, Any] = {"loads": 4, "repeats": 3, "order": "random", "pulls": 12, "hours": 1.4}
        return NextTest("part from load", (*columns, "normal_load_N"), design)
    tied = next((f for s in found for f in s.follows if f.alike), None)
    if tied is None:
        return None
    return NextTest("part columns", (tied.name, *tied.alike), {"covariate": tied.name, "pulls": 12, "hours": 1.4})
