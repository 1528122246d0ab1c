"""Sources of the uncertainty of the fitted forces, and differences between samples on the same specimens."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from tribo.comparison import study_lookup
from tribo.records import REGIMES, Regime, Study
from tribo.report.result_tables import PA_PER_KPA
from tribo.report.words.numerals import joined, significant

SUM = "combined"


@dataclass(frozen=True)
class BudgetTable:
    """Shares (percent of the variance of T) of one regime: one row per sample, one column per component."""

    regime: Regime
    components: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...], str], ...]  # sample, shares, combined u(T) in newton
    largest: tuple[int, ...]  # of each row
    sentence: str


def budget_tables(study: Study) -> list[BudgetTable]:
    """The budget of T in both regimes, components that never matter (below half a percent everywhere) left out."""
    if study.budget is None or study.budget.empty:
        return []
    order = study_lookup.sample_numbers(study)
    parts = [(r, study.budget[study.budget["regime"] == r]) for r in REGIMES]
    return [_budget_table(regime, part, list(order)) for regime, part in parts if not part.empty]


def _budget_table(regime: Regime, part: pd.DataFrame, order: list[str]) -> BudgetTable:
    shares = part.pivot(index="sample", columns="component", values="share_pct_T_N").drop(columns=SUM).fillna(0.0)
    shares = shares.loc[[s for s in order if s in shares.index]]
    named = [c for c in dict.fromkeys(part["component"]) if c in shares.columns and shares[c].max() >= 0.5]
    combined = part[part["component"] == SUM].set_index("sample")["u_T_N"]
    rows = tuple(
        (str(s), tuple(f"{v:.0f}" for v in row), significant(float(combined[s]), 2))
        for s, row in zip(shares.index, shares[named].to_numpy(), strict=True)
    )
    largest = shares[named].to_numpy().argmax(axis=1) if named else []
    return BudgetTable(
        regime, tuple(named), rows, tuple(int(k) for k in largest), _dominant(regime, shares.index, named, largest)
    )


def _dominant(regime: Regime, samples: pd.Index, components: list[str], largest: list[int]) -> str:
    """The largest component of each sample, in one sentence."""
    groups: dict[str, list[str]] = {}
    for sample, k in zip(samples, largest, strict=bool(components)):
        groups.setdefault(components[k], []).append(str(sample))
    clauses = [f"{component} for {joined(names)}" for component, names in groups.items()]
    return f"Largest contribution to the uncertainty of the {regime} force: {'; '.join(clauses)}." if clauses else ""


def budget_origins(study: Study) -> list[tuple[str, str]]:
    """Each type B component with what its size rests on, where that is the same for every fit."""
    if study.budget is None or study.budget.empty:
        return []
    type_b = study.budget[study.budget["type"] == "B"]
    origins = type_b.groupby("component", sort=False)["origin"].unique()
    return [(str(c), str(found[0]) if len(found) == 1 else "differs between samples") for c, found in origins.items()]


def paired_sentences(study: Study) -> list[str]:
    """Difference in force between samples measured on the same specimens, one sentence per pair."""
    if study.differences is None:
        return []
    return [_paired_sentence(row) for _, row in study.differences.iterrows() if row["number"] == "T_N"]


def _paired_sentence(row: pd.Series) -> str:
    pair = f"{row['sample']} minus {row['other']}, measured on the same {len(row['specimens'].split(';'))} specimens"
    return (
        f"{row['regime'].capitalize()} friction at {significant(row['pressure_Pa'] / PA_PER_KPA)} kPa, {pair}: "
        f"{significant(row['difference'])} ± {significant(row['u'], 2)} N (95 %: {significant(row['low'])} to "
        f"{significant(row['high'])} N). With different specimens the uncertainty "
        f"would be ± {significant(row['unpaired_u'], 2)} N."
    )
