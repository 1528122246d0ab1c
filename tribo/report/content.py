"""The content of a report in its order: made once, then laid out as a page (page.py) and as a PDF (pdf.py)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from tribo import __version__
from tribo.comparison import findings
from tribo.comparison.findings import all_set_aside
from tribo.diagnostics.verdict import Verdict
from tribo.figures.catalogue import DIAGNOSIS_FIGURES
from tribo.outputs import unit_of
from tribo.records import PA_PER_KPA, REGIMES, Campaign, Regime, Study
from tribo.report.crate import conditions
from tribo.report.provenance import Provenance
from tribo.report.pulls import pull_cards
from tribo.user_text import plain
from tribo.wording import study_sentences as wording
from tribo.wording.card import Card, card_of, fit_cells
from tribo.wording.numerals import joined, significant, true_minus
from tribo.wording.verdict_sentences import verdict_in_words

# the first that there is shows what the card says
LEAD_FIGURES = ("finding", "agreement", "forces", "fig4", "dependence")
MISFIT_FIGURES = ("misfit", "residuals")
CAUSE_FIGURES = ("law", "extended", "evidence")
CALIBRATED = {  # of a block of the model: name and unit
    "mu_s": ("Static friction coefficient, mean over the blocks", "1"),
    "mu_s_sd": ("Static friction coefficient, standard deviation over the blocks", "1"),
    "mu_d": ("Sliding friction coefficient, mean over the blocks", "1"),
    "mu_d_sd": ("Sliding friction coefficient, standard deviation over the blocks", "1"),
    "static_adhesion_Pa": ("Adhesion per area at rest", "Pa"),
    "sliding_adhesion_Pa": ("Adhesion per area while sliding", "Pa"),
    "blocks_x": ("Number of blocks along x", "1"),
    "blocks_y": ("Number of blocks along y", "1"),
    "dt_s": ("Time step", "s"),
}
SUM = "combined"  # the component of budget.csv that is the sum of all
VERDICT_MARKS = {"agrees": "=", "model too high": "▲", "model too low": "▼", "inconclusive": "?"}


def content(
    study: Study, provenance: Provenance | None, verdict: Verdict | None, card: Card | None = None
) -> dict[str, Any]:
    """Everything but the figures, by the names the templates use."""
    return {
        "study": study,
        "campaign": study.ingested.campaign,
        "card": card if card is not None else card_of(study, verdict),
        "verdict": verdict_in_words(verdict) if verdict is not None else None,
        "summary": _summary(study),
        "friction": wording.friction_sentences(study, verdict),
        "has_area": study.ingested.campaign.has_area,
        "about": about(study.ingested.campaign),
        "table2": _table2(study),
        "uncertainty_kind": wording.uncertainty_kind(study),
        "paired": paired_sentences(study),
        "budget": budget_tables(study),
        "budget_origins": budget_origins(study),
        "agreement": _agreement_tables(study),
        "calibration": _calibration(study),
        "set_aside": list(all_set_aside(study).values()),
        "by_hand": by_hand(study),
        "flags": _flag_counts(study),
        "tribosystem": conditions(study),
        "cards": pull_cards(study),
        "provenance": provenance.in_words() if provenance is not None else None,
        "version": __version__,
    }


def about(campaign: Campaign) -> str:
    """The bodies, the nominal area and the speed in one line, as far as they are stated."""
    stated = campaign.material or campaign.counterface
    parts = [f"{campaign.material or 'sample'} on {campaign.counterface or 'counterface'}"] if stated else []
    if campaign.has_area:
        parts.append(f"nominal area {campaign.area_m2 * 1e6:g} mm²")
    if campaign.pull_speed_m_s:
        parts.append(f"pulled at {campaign.pull_speed_m_s * 1e3:g} mm/s")
    return ", ".join(parts)


def figure_places(names: list[str]) -> dict[str, list[str]]:
    """Place of each figure: beside the verdict, among Figs. 3 to 8, at the misfits, at the cause, at the end."""
    places: dict[str, list[str]] = {"lead": [], "figures": [], "misfit": [], "cause": [], "rest": []}
    lead = next((name for name in LEAD_FIGURES if name in names), "")
    for name in names:
        if name == lead:
            places["lead"].append(name)
        elif name in MISFIT_FIGURES:
            places["misfit"].append(name)
        elif name in CAUSE_FIGURES:
            places["cause"].append(name)
        else:
            places["rest" if name in DIAGNOSIS_FIGURES else "figures"].append(name)
    return places


def figure_numbers(names: list[str]) -> dict[str, int]:
    """The number of each figure, counted through the report in the order of its places."""
    in_order = [name for place in figure_places(names).values() for name in place]
    return {name: number for number, name in enumerate(in_order, start=1)}


def by_hand(study: Study) -> list[tuple[str, str]]:
    """Every pull with a peak or window moved by hand, with the change; excluded ones are among those set aside."""
    ingested = study.ingested
    return [
        (test_id, wording.by_hand_sentence(decided, ingested.pulls[test_id]))
        for test_id, decided in ingested.by_hand.items()
        if test_id in ingested.pulls
    ]


def _summary(study: Study) -> dict[str, Any]:
    agreements = findings.agreements(study)
    return {
        "measured": wording.what_was_measured(study),
        "flat": wording.flat_law(study) if study.comparison is not None else [],
        "model": wording.in_short(agreements, findings.flat_sample(study)),
        "order": [wording.ranking_sentence(r) for r in findings.rankings(study)],
        "directions": wording.direction_sentences(findings.direction_ratios(study)),
        "correlation": " ".join(filter(None, (wording.pooling_note(study), wording.correlation_note(study)))),
        "how_to_read": wording.HOW_TO_READ,
    }


def _table2(study: Study) -> dict[str, Any]:
    simulated = study.comparison.simulated if study.comparison is not None else ()
    lowest, load, highest = findings.common_loads(study)
    regimes = []
    for regime in REGIMES:
        rows: list[tuple[Any, ...]] = []
        for sample in findings.sample_numbers(study):
            fit = study.fits.of(sample, regime)
            if fit is not None:
                model = fit_cells(findings.fit_of(simulated, sample, regime), load)
                area_fraction = study.ingested.campaign.area_fraction(sample)
                rows.append((sample, area_fraction, fit_cells(fit, load), model, fit))
        if rows:
            regimes.append((regime, rows))
    of_loads = "the middle" if lowest < load < highest else "one"
    return {"load_N": load, "of_loads": of_loads, "regimes": regimes, "simulated": bool(simulated)}


def _agreement_tables(study: Study) -> list[dict[str, Any]]:
    """Ratios of each regime: one row per sample, one column per load level, and the sentence of each sample."""
    tables = []
    for regime in REGIMES:
        part = [a for a in findings.agreements(study) if a.regime == regime]
        if not part:
            continue
        every_load = np.array([load.normal_load_N for a in part for load in a.loads])
        levels = findings.load_levels(every_load)
        level_of = dict(zip(every_load.tolist(), levels.tolist(), strict=True))
        columns = sorted(set(levels.tolist()))
        rows = [
            (a, [next((x for x in a.loads if level_of[x.normal_load_N] == level), None) for level in columns])
            for a in part
        ]
        sentences = [(a.sample, wording.agreement_sentence(a)) for a in part]
        tables.append(
            {"regime": regime, "loads": columns, "rows": rows, "sentences": sentences, "marks": VERDICT_MARKS}
        )
    return tables


def _calibration(study: Study) -> list[tuple[str, str, str]]:
    """Name, value and unit of every calibrated parameter; one without words says its unit at the end of its name."""
    rows = []
    for name, value in study.comparison.calibration.items() if study.comparison is not None else ():
        words, unit = CALIBRATED.get(name, (name.replace("_", " "), unit_of(name) or "1"))
        rows.append((words, true_minus(f"{float(value):.5g}"), unit))
    return rows


def _flag_counts(study: Study) -> list[tuple[str, int, list[str]]]:
    """Each quality flag, how many pulls carry it, and the tests."""
    found: dict[str, list[str]] = {}
    for test_id, pull in study.ingested.pulls.items():
        for flag in pull.flags:
            found.setdefault(flag, []).append(test_id)
    counts = ((wording.flags_in_words([flag]), len(tests), tests) for flag, tests in found.items())
    return sorted(counts, key=lambda x: (-x[1], x[0]))


def budget_tables(study: Study) -> list[dict[str, Any]]:
    """The budget of T in both regimes: shares (percent of the variance) by ``components``, a row for each sample with
    the combined u(T) in newton, ``largest`` of each row; components below half a percent everywhere are left out."""
    if study.budget is None or study.budget.empty:
        return []
    order = findings.sample_numbers(study)
    parts = [(r, study.budget[study.budget["regime"] == r]) for r in REGIMES]
    load_N, campaign = study.ingested.campaign.judged_load_N(), study.ingested.campaign
    pressure_kPa = plain(campaign.nominal_pressure_Pa(load_N) / PA_PER_KPA) if campaign.has_area else ""
    at = f"{pressure_kPa} kPa" if campaign.has_area else f"{plain(load_N)} N"
    said = f"contribution of each component to the variance of T at {at}, in percent"
    return [{"caption": said, **_budget_table(regime, part, list(order))} for regime, part in parts if not part.empty]


def _budget_table(regime: Regime, part: pd.DataFrame, order: list[str]) -> dict[str, Any]:
    shares = part.pivot(index="sample", columns="component", values="share_pct_T_N").drop(columns=SUM).fillna(0.0)
    shares = shares.loc[[s for s in order if s in shares.index]]
    named = [c for c in dict.fromkeys(part["component"]) if c in shares.columns and shares[c].max() >= 0.5]
    combined = part[part["component"] == SUM].set_index("sample")["u_T_N"]
    rows = [
        (str(s), [f"{v:.0f}" for v in row], significant(float(combined[s]), 2))
        for s, row in zip(shares.index, shares[named].to_numpy(), strict=True)
    ]
    largest = [int(k) for k in shares[named].to_numpy().argmax(axis=1)] if named else []
    groups: dict[str, list[str]] = {}
    for (sample, _, _), k in zip(rows, largest, strict=bool(named)):
        groups.setdefault(named[k], []).append(sample)
    clauses = [f"{component} for {joined(names)}" for component, names in groups.items()]
    said = f"Largest contribution to the uncertainty of the {regime} force: {'; '.join(clauses)}." if clauses else ""
    return {"regime": regime, "components": named, "rows": rows, "largest": largest, "sentence": said}


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
