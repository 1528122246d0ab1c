"""The diagnosis of a study without the spring-block model; its baseline is the law of every sample alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.stats import t as t_distribution

from tribo.diagnostics.column_search import (
    FEWEST_TESTS,
    ColumnEffect,
    RegimeTests,
    load_levels,
    regime_tests,
    search_columns,
    with_repeats,
)
from tribo.diagnostics.direct_evidence import RunningIn, running_in, stroke_offset
from tribo.diagnostics.planning import more_tests
from tribo.diagnostics.verdict import Cause, Estimate, Excluded, Layer, Misfit, NextTest, Outcome, TooLittle, Verdict
from tribo.fitting.alternatives import CANDIDATES
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import ALONG_RECORDS, STROKES_APART
from tribo.records import REGIMES, Ingested, Study
from tribo.vocabulary import label_with_unit

BASELINE = "the law of each sample alone"
SHOWN_BY = {shown: m.name for m in MECHANISMS.values() for shown in m.without_model}
ANY_COLUMN = next(m.name for m in MECHANISMS.values() if m.any_column)
RUNNING_IN = SHOWN_BY[ALONG_RECORDS]
MECHANISMS_OF_COLUMNS = {k: name for k, name in SHOWN_BY.items() if k not in (ALONG_RECORDS, STROKES_APART)}
Shown = tuple[list[Layer], list[Cause], list[Misfit]]
SERIES = ("run_order", "specimen_run", "started_at", "date", "cycle")  # columns that no one can vary


def law_layers(study: Study) -> list[Layer]:
    """One layer per sample and regime: the law chosen for it, or the mean of T/N where the loads determine none."""
    rows = [] if study.laws is None else [{str(k): v for k, v in r.items()} for r in study.laws.to_dict("records")]
    chosen = {(row["sample"], row["regime"]): row for row in rows if row["chosen"]}
    lines = {(row["sample"], row["regime"]): row for row in reversed(rows) if row["law"] == "linear"}
    table = study.ingested.table()
    found = []
    for sample, regime in product(dict.fromkeys(table["sample"]), REGIMES):
        part = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"]) & (table["normal_load_N"] > 0)]
        if not len(part):
            continue
        loads, row = part["normal_load_N"].to_numpy(float), chosen.get((sample, regime))
        constant = None
        if row is not None:
            formula, parameters = str(row["formula"]), _parameters(row)
            if row["law"] != "proportional" and (sample, regime) in lines:
                constant = _constant_part(lines[sample, regime], loads)
        else:
            ratio = part[f"{regime}_N"].to_numpy(float) / loads
            u = float(ratio.std(ddof=1) / math.sqrt(ratio.size)) if ratio.size > 1 else float("nan")
            formula, parameters = "T = μ N", {"T/N": _estimate(float(ratio.mean()), u, "", ratio.size - 1)}
        found.append(
            Layer(
                kind="baseline", name="normal_load_N", samples=(str(sample),), regimes=(regime,),
                p_adjusted=float("nan"), effect_percent=float("nan"), low=float("nan"), high=float("nan"),
                parameters=parameters, formula=formula, shows=constant,
            )
        )  # fmt: skip
    return found


def _parameters(row: Mapping[str, Any]) -> dict[str, Estimate]:
    """The parameters of a law with a row of the table of laws."""
    return {
        name: _estimate(row[key], row[f"{key}_u"], unit, row["loads"] - row["parameters"])
        for (name, unit), key in zip(CANDIDATES[row["law"]].parameters, ("a", "b"), strict=False)
        if math.isfinite(row[key])
    }


def _constant_part(line: Mapping[str, Any], loads: np.ndarray) -> tuple[Estimate, float, float]:
    """What a straight line leaves at zero load, and its share of T (percent) at the middle load (N)."""
    constant = _estimate(line["b"], line["b_u"], "N", line["loads"] - 2)
    middle = float(np.median(loads))
    share = 100.0 * line["b"] / max(line["a"] * middle + line["b"], 1e-300)
    return constant, float(share), middle


def _estimate(value: float, u: float, unit: str, dof: int) -> Estimate:
    """A value with its 90 % interval by Student's t."""
    half = float(t_distribution.ppf(0.95, max(dof, 1))) * u
    return Estimate(float(value), float(value - half), float(value + half), unit)


def name_of_column(column: str) -> str:
    """The name in a verdict of what follows a column: a mechanism of the library, or the column itself."""
    return MECHANISMS_OF_COLUMNS.get(column, f"{ANY_COLUMN}:{column}")


@dataclass(frozen=True)
class ColumnsTested:
    """The ``columns`` that were tested without the model; ``lack`` says why none could be.

    ``same`` are groups of columns that are one and the same, ``copied`` groups of tests with exactly the same forces.
    """

    columns: tuple[str, ...]
    lack: TooLittle | None = None
    same: tuple[tuple[str, ...], ...] = ()
    copied: tuple[tuple[str, ...], ...] = ()


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
    tests = [t for regime in REGIMES if (t := regime_tests(study.ingested, regime)).n]
    enough = [t for t in tests if t.enough]
    effects = [f for t in enough for f in search_columns(t, len(enough), level, rng)]
    records = [r for r in running_in(study.ingested) if r.p < level]
    offsets = [] if (offset := stroke_offset(study.ingested)) is None else [offset]
    of_strokes = [Cause(layer.name, 1.0, layer.parameters, shows=layer) for layer in offsets]
    shown = [_of_columns(effects), _of_records(records), (offsets, of_strokes, [])]
    causes = [cause for _, each, _ in shown for cause in each]
    tied = ((f.name, *f.same, *f.alike) for f in effects if f.same or f.alike)
    shows = _tested(study, tests, enough)
    without_causes: Outcome = "no_misfit" if shows.lack is None else "cannot_tell"
    return Verdict(
        verdict="named" if causes else without_causes,
        misfits=tuple(misfit for _, _, each in shown for misfit in each),
        causes=tuple(causes),
        equivalent=tuple(dict.fromkeys(tuple(map(name_of_column, names)) for names in tied)),
        not_testable=(*_not_testable(enough), *_inseparable(study, enough)),
        layers=(*law_layers(study), *(layer for each, _, _ in shown for layer in each)),
        set_aside=study.ingested.set_aside,
        next_test=more_tests(shows.lack) if shows.lack is not None else _next_test(enough, effects),
        model={"baseline": BASELINE},
        shows=shows,
    )


def _tested(study: Study, tests: list[RegimeTests], enough: list[RegimeTests]) -> ColumnsTested:
    same, copied = tuple(dict.fromkeys(names for t in tests for names in t.same)), copied_readings(study.ingested)
    if enough:
        return ColumnsTested(tuple(sorted({c.name for t in enough for c in t.columns})), None, same, copied)
    needed = max([FEWEST_TESTS, *(2 * t.law.shape[1] for t in tests)])
    n, loads, samples = max(
        ((t.n, len(np.unique(load_levels(t.load_N))), len(np.unique(t.sample))) for t in tests), default=(0, 0, 0)
    )
    lack = with_repeats(TooLittle(n, loads, samples, needed, 1, 1), study.ingested)
    return ColumnsTested((), lack, (), copied)


def copied_readings(ingested: Ingested) -> tuple[tuple[str, ...], ...]:
    """Tests of one sample at one load whose forces are equal to the last digit, where equality is no rounding.

    Forces of three digits or fewer may be equal by rounding, unless most of all tests are.
    """
    groups: dict[tuple[object, ...], list[str]] = {}
    rounded = set()
    for test in ingested.campaign.tests:
        if (pull := ingested.pulls.get(test.test_id)) is None:
            continue
        forces = tuple(float(f) if np.isfinite(f) else None for f in (pull.static_N, pull.sliding_N))
        key = (test.sample, test.normal_load_N, forces)
        groups.setdefault(key, []).append(test.test_id)
        if all(f is None or f == float(f"{f:.3g}") for f in forces):
            rounded.add(key)
    equal = {key: ids for key, ids in groups.items() if len(ids) > 1}
    most = 2 * sum(map(len, equal.values())) > sum(map(len, groups.values()))
    return tuple(tuple(ids) for key, ids in equal.items() if most or key not in rounded)


def _of_columns(effects: Sequence[ColumnEffect]) -> Shown:
    """One cause per column, with its size in every regime in which it is beyond chance."""
    layers = [
        Layer(
            kind="cause", name=name_of_column(f.name), samples=(), regimes=(f.regime,), p_adjusted=f.p,
            effect_percent=f.change_percent, low=f.low_percent, high=f.high_percent,
            tied_with=tuple(map(name_of_column, (*f.same, *f.alike))), shows=(f,),
        )
        for f in effects
    ]  # fmt: skip
    causes = []
    for name in dict.fromkeys(f.name for f in effects):
        own = tuple(f for f in effects if f.name == name)
        sizes = {
            f"change of {f.regime} T": Estimate(f.change_percent, f.low_percent, f.high_percent, "%") for f in own
        }
        causes.append(Cause(name_of_column(name), 1.0, sizes, shows=own))
    return layers, causes, [Misfit(f.regime, "", f.name, f.change_percent, f.p, shows=(f,)) for f in effects]


def _of_records(records: Sequence[RunningIn]) -> Shown:
    """Running-in: a layer and a misfit per sample, one cause."""
    layers, misfits = [], []
    for sample in dict.fromkeys(r.sample for r in records):
        part = tuple(r for r in records if r.sample == sample)
        size, p = _middle(part), min(r.p for r in part)
        strongest = max(part, key=lambda r: abs(r.first_percent))
        layers.append(
            Layer(
                kind="cause", name=RUNNING_IN, samples=(sample,), regimes=("sliding",), p_adjusted=p,
                effect_percent=size.value, low=size.low, high=size.high, shows=part,
            )
        )  # fmt: skip
        misfits.append(Misfit("sliding", sample, "distance", strongest.first_percent, p, shows=part))
    sizes = {"first twentieth over second half": _middle(records)} if records else {}
    return layers, [Cause(RUNNING_IN, 1.0, sizes, shows=tuple(records))] if records else [], misfits


def _middle(records: Sequence[RunningIn]) -> Estimate:
    """The median over records, and their range; of one record no range."""
    changes = [r.first_percent for r in records]
    ends = (min(changes), max(changes)) if len(changes) > 1 else (math.nan, math.nan)
    return Estimate(float(np.median(changes)), *ends, "%")


def _inseparable(study: Study, enough: list[RegimeTests]) -> list[Excluded]:
    """Columns that vary only together with the load, and pairs of columns that vary together."""
    pairs: dict[tuple[str, str], list[str]] = {}
    table = study.dependence
    for row in [] if table is None else table.to_dict("records"):
        for other in row["inseparable_from"]:
            one, two = sorted((str(row["variable"]), other), key=label_with_unit)
            same = any({one, two} <= set(names) for t in enough for names in t.same)
            if same or "normal_load_N" in (one, two):
                continue  # said of the columns that are the same, and of those that vary only with the load
            samples = pairs.setdefault((one, two), [])
            if row["sample"] not in samples:
                samples.append(str(row["sample"]))
    said = [Excluded(name_of_column(name), "only with the load", shows=name) for name in _only_with_load(enough)]
    together = (
        Excluded(f"{label_with_unit(a)} or {label_with_unit(b)}", "vary together", shows=(a, b, tuple(samples)))
        for (a, b), samples in pairs.items()
    )
    return [*said, *together]


def _only_with_load(enough: list[RegimeTests]) -> list[str]:
    return sorted({name for t in enough for name in t.only_with_load})


def _not_testable(enough: list[RegimeTests]) -> list[Excluded]:
    """Mechanisms whose column does not vary, or was not recorded."""
    there = {name for t in enough for name in (*(c.name for c in t.columns), *t.only_with_load, *sum(t.same, ()))}
    return [
        Excluded(mechanism, "not varied", shows=column)
        for column, mechanism in MECHANISMS_OF_COLUMNS.items()
        if enough and column not in there
    ]


def _next_test(enough: list[RegimeTests], effects: Sequence[ColumnEffect]) -> NextTest | None:
    design: dict[str, Any]
    if columns := _only_with_load(enough):
        design = {"loads": 4, "repeats": 3, "order": "random", "pulls": 12, "hours": 1.4}
        return NextTest("part from load", (*columns, "normal_load_N"), design)
    tied = next((f for f in effects if {*f.same} - {*SERIES} or f.alike or (f.same and f.name not in SERIES)), None)
    if tied is None:  # nobody can part the places of a series from their numbers
        return None
    design = {"covariate": tied.name, "pulls": 12, "hours": 1.4}
    return NextTest("part columns", (tied.name, *tied.same, *tied.alike), design)
