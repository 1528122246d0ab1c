"""Sentences of a report without the model: friction of every sample, its law, what it varies with, oscillations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.comparison.study_lookup import load_levels, sample_numbers, shown
from tribo.records import REGIMES, Study
from tribo.wording.numerals import counted, joined, loads_in_words, percent, significant, with_uncertainty

if TYPE_CHECKING:
    import pandas as pd


LEVEL = 0.05
_MOST_SAID = 12
_REGIMES = {
    "steady": "Steady sliding", "stick-slip": "Stick-slip", "irregular": "An irregularly varying sliding force",
    "inertial oscillation": "An oscillating sliding force without sticking (inertial oscillation)",
}  # fmt: skip


def friction_sentences(study: Study) -> dict[str, list[str]]:
    """Sentences by section; all empty where the study was made with the model."""
    if not shown(study):
        return {"samples": [], "laws": [], "dependence": [], "oscillation": []}
    return {
        "samples": list(_samples(study)),
        "laws": list(_laws(study)),
        "dependence": list(_dependence(study)),
        "oscillation": [*_directions(study), *_oscillation(study), *_restarts(study)],
    }


def _samples(study: Study) -> Iterator[str]:
    table = study.ingested.table()
    for sample in sample_numbers(study):
        for regime in REGIMES:
            part = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"]) & (table["normal_load_N"] > 0)]
            if part.empty:
                continue
            ratio = (part[f"{regime}_N"] / part["normal_load_N"]).to_numpy(float)
            loads = np.unique(load_levels(part["normal_load_N"].to_numpy(float)))
            at = loads_in_words(loads.tolist())
            spread = f", standard deviation {significant(float(ratio.std(ddof=1)), 2)}" if ratio.size > 1 else ""
            said = f"mean T/N = {significant(float(ratio.mean()))}{spread}"
            yield f"{regime.capitalize()} friction of {sample}: {said} ({counted(ratio.size, 'test')}, {at})."


def ratio_of_samples(study: Study) -> str:
    """The samples of the highest and of the lowest mean T/N, in one sentence."""
    table = study.ingested.table()
    said = []
    for regime in REGIMES[::-1]:
        usable = table[np.isfinite(table[f"{regime}_N"]) & (table["normal_load_N"] > 0)] if len(table) else table
        if usable.empty:
            continue
        ratio = (usable[f"{regime}_N"] / usable["normal_load_N"]).groupby(usable["sample"]).mean().sort_values()
        low, high = (f"{significant(float(ratio.iloc[k]))} for {ratio.index[k]}" for k in (0, -1))
        said.append(f"mean {regime} T/N is {high}" + (f" and {low}" if len(ratio) > 1 else ""))
    if not said:
        return "No friction force was read."
    return f"Friction was measured and not compared with a model: {'; '.join(said)}."


def _laws(study: Study) -> Iterator[str]:
    table = study.laws
    if table is None or table.empty:
        yield (
            "The loads do not allow a law of friction against load to be chosen: this needs four loads or more that "
            "differ by more than their scatter."
        )
        return
    for (sample, regime), part in table.groupby(["sample", "regime"], sort=False):
        laws = _rows(part)
        chosen = next(law for law in laws if law["chosen"])
        others = joined([f"{law['formula']} {_deviation(law)}" for law in laws if not law["chosen"]])
        yield (
            f"{str(regime).capitalize()} friction of {sample} is described best by {chosen['formula']} with "
            f"{_values(chosen)}: loads left out of the fit are predicted to within {_deviation(chosen)} (root mean "
            f"square of ln T). The other laws: {others}. Chosen is the law with the fewest parameters that is worse "
            "than the best by no more than one standard error, and that the parameters of the best do not exclude."
        )


def _deviation(law: Mapping[str, Any]) -> str:
    return f"{significant(law['held_out_percent'], 2)} %"


def _values(law: Mapping[str, Any]) -> str:
    a, b = (with_uncertainty(law[name], law[f"{name}_u"]) for name in ("a", "b"))
    return {
        "constant": f"T₀ = {a} N", "proportional": f"μ = {a}", "hertz": f"a = {a}",
        "linear": f"μ = {a} and T₀ = {b} N", "power": f"a = {a} and b = {b} (T and N in newton)",
    }[law["law"]]  # fmt: skip


def _dependence(study: Study) -> Iterator[str]:
    table = study.dependence
    if table is None or table.empty:
        return
    clear = table[table["p_adjusted"] < LEVEL].sort_values("p_adjusted")
    if clear.empty:
        yield "T/N varies significantly with no recorded variable (rank correlations, adjusted for their number)."
    for row in _rows(clear.head(_MOST_SAID)):
        change = f"{percent(row['change_percent'] / 100)} from {significant(row['low'])} to {significant(row['high'])}"
        yield (
            f"{row['regime'].capitalize()} T/N of {row['sample']} varies with {row['label']}: {change} (rank "
            f"correlation {row['rank']:.2f}, adjusted p {_p(row['p_adjusted'])}, {counted(row['n'], 'test')})."
        )
    yield from _inseparable(table)


def _p(value: float) -> str:
    return "below 0.001" if value < 0.001 else f"= {value:.1g}"


def _inseparable(table: pd.DataFrame) -> Iterator[str]:
    """Pairs of variables that vary together, each once, with the test that would separate them."""
    rows = _rows(table[table["inseparable_from"] != ""])
    pairs = [(row["sample"], *sorted((row["label"], other))) for row in rows for other in _others(row)]
    for sample, one, other in list(dict.fromkeys(pairs))[:_MOST_SAID]:
        yield (
            f"For {sample}, {one} and {other} vary together, so their effects cannot be separated. Next test: repeat "
            f"several values of {one} in random order of {other}."
        )


def _rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def _others(row: Mapping[str, Any]) -> list[str]:
    return str(row["inseparable_from"]).split(", ")


def _oscillation(study: Study) -> Iterator[str]:
    regimes: dict[str, list[str]] = {}
    for test_id, pull in study.ingested.pulls.items():
        if pull.oscillation is not None:
            regimes.setdefault(pull.oscillation.regime, []).append(test_id)
    for regime, tests in sorted(regimes.items()):
        named = joined(tests[:_MOST_SAID]) + (f" and {len(tests) - _MOST_SAID} more" if len(tests) > _MOST_SAID else "")
        yield f"{_REGIMES[regime]} in {counted(len(tests), 'test')}: {named}."


def _directions(study: Study) -> Iterator[str]:
    """The offset that parts the two directions of reciprocating strokes."""
    both = {way: [p for p in study.ingested.pulls.values() if way in p.flags] for way in ("forward", "backward")}
    if not all(both.values()):
        return
    offsets = np.array([p.zero_N for p in both["forward"]] + [-p.zero_N for p in both["backward"]])
    means = {way: float(np.mean([p.sliding_N for p in pulls])) for way, pulls in both.items()}
    yield (
        f"{counted(len(both['forward']), 'stroke')} forward and {len(both['backward'])} backward: the force recorded "
        f"in the two directions differs by twice {significant(float(offsets.mean()))} N (the zero, standard deviation "
        f"{significant(float(offsets.std()), 2)} N), which was subtracted. Mean sliding force forward "
        f"{significant(means['forward'])} N, backward {significant(means['backward'])} N."
    )


def _restarts(study: Study) -> Iterator[str]:
    tests = [(i, p) for i, p in study.ingested.pulls.items() if p.restarts]
    if tests:
        count = sum(len(pull.restarts) for _, pull in tests)
        yield (
            f"{counted(count, 'restart')} after a stop of the drive {'was' if count == 1 else 'were'} found in "
            f"{counted(len(tests), 'test')}; restarts.csv lists the static force and the time of the hold of each."
        )
