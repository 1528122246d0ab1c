"""Findings in plain English. Every sentence is computed; none says more than its interval allows."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tribo.comparison import findings, study_lookup
from tribo.comparison.findings import Agreement, DirectionRatio, Ranking, Verdict
from tribo.records import REGIMES, ByHand, LawFit, Pull, Regime, Study
from tribo.report.oddness import OddPull
from tribo.report.result_tables import PA_PER_KPA, all_set_aside
from tribo.report.words.numerals import counted, joined, percent, significant, span, with_uncertainty

SIDE: dict[Verdict, str] = {"model too high": "too high", "model too low": "too low"}
HOW_TO_READ = (
    "The ratio is measured over simulated friction force, with its 95 % interval. The model agrees at a load "
    "where the interval holds 1 and reaches no further than a factor of 1.2 to either side of the ratio; where "
    "it holds 1 but is wider than that, the measurement cannot tell. A sample as a whole is given the verdict "
    "of at least half of its loads. The loads of one sample share their specimens, so their verdicts are not "
    "independent of each other; and of twenty intervals, one misses by chance."
)


def what_was_measured(study: Study) -> str:
    """How many pulls of what, under which loads."""
    campaign, used = study.ingested.campaign, study.ingested.pulls
    aside = len(all_set_aside(study))
    tests = [t for t in campaign.tests if t.test_id in used]
    samples = [s for s in study_lookup.sample_numbers(study) if any(t.sample == s for t in tests)]
    specimens = {(t.sample, t.specimen) for t in tests}
    loads = np.array([t.normal_load_N for t in tests])
    levels = np.unique(study_lookup.load_levels(loads))
    lowest, highest = (significant(p / campaign.nominal_area_m2 / PA_PER_KPA) for p in (levels[0], levels[-1]))
    return (
        f"{counted(len(tests), 'pull')} of {counted(len(specimens), 'specimen')} of "
        f"{counted(len(samples), 'sample')} ({joined(samples)}) at {counted(len(levels), 'load')} from "
        f"{significant(levels[0])} to {significant(levels[-1])} N, a nominal pressure of {lowest} to "
        f"{highest} kPa. {_set_aside_clause(aside)}"
    )


def _set_aside_clause(aside: int) -> str:
    if not aside:
        return "No test was set aside."
    return f"{counted(aside, 'test')} {'was' if aside == 1 else 'were'} set aside."


def flat_law(study: Study) -> list[str]:
    """The measured law of the flat sample, one sentence a regime."""
    flat = study_lookup.flat_sample(study)
    fits = [(regime, study_lookup.fit_of(study.fits, flat, regime)) for regime in REGIMES]
    return [
        f"The {regime} friction of the flat sample {flat} follows T = μN + τ₀A with {_law_values(fit)} "
        "(standard uncertainties)."
        for regime, fit in fits
        if fit is not None
    ]


def _law_values(fit: LawFit) -> str:
    tau0, tau0_u = (v / PA_PER_KPA for v in (fit.value("tau0_Pa"), fit.standard_uncertainty("tau0_Pa")))
    mu = with_uncertainty(fit.value("mu"), fit.standard_uncertainty("mu"))
    return f"μ = {mu} and τ₀ = {with_uncertainty(tau0, tau0_u)} kPa"


def in_short(agreements: Iterable[Agreement], flat: str) -> list[str]:
    """One sentence a regime: where the model agrees, where not, where the data cannot tell."""
    predicted = [a for a in agreements if not a.calibrated]
    return [
        f"{regime.capitalize()} friction: calibrated on {flat} alone, the model {_verdicts(part)}."
        for regime in REGIMES
        if (part := [a for a in predicted if a.regime == regime])
    ]


def _verdicts(agreements: list[Agreement]) -> str:
    clauses = []
    by_verdict = {v: [a for a in agreements if a.verdict == v] for v in dict.fromkeys(a.verdict for a in agreements)}
    if agreeing := by_verdict.get("agrees"):
        clauses.append(f"agrees with the measurement for {joined([_inside(a) for a in agreeing])}")
    for verdict, side in SIDE.items():
        if off := by_verdict.get(verdict):
            clauses.append(f"is {side} for {joined([_off_by(a) for a in off])}")
    if mixed := by_verdict.get("mixed"):
        clauses.append(f"is too high at some loads and too low at others for {joined([a.sample for a in mixed])}")
    if unclear := by_verdict.get("cannot tell"):
        clauses.append(
            f"may or may not be right for {joined([a.sample for a in unclear])}, where the intervals are "
            "too wide to tell"
        )
    return "; it ".join(clauses)


def _inside(agreement: Agreement) -> str:
    if not agreement.n_outside:
        return agreement.sample
    return f"{agreement.sample} (but not at {_at(agreement.n_outside, len(agreement.loads))})"


def _off_by(agreement: Agreement) -> str:
    count, n = agreement.n_outside, len(agreement.loads)
    off = percent(abs(agreement.mean_deviation))
    return f"{agreement.sample} (by {off}{'' if count == n else ' on average'}, at {_at(count, n)})"


def agreement_sentence(agreement: Agreement) -> str:
    """One sample in one regime: the ratio, where the model agrees, by how much it is off, where worst."""
    loads, n = agreement.loads, len(agreement.loads)
    parts = [f"T measured over T simulated is {span([load.ratio for load in loads])}."]
    if inside := agreement.count("agrees"):
        parts.append(f"The model agrees within the 95 % interval at {_at(inside, n)}.")
    for verdict, side in SIDE.items():
        if count := agreement.count(verdict):
            parts.append(f"The model is {side} at {_at(count, n)}.")
    if unclear := agreement.count("cannot tell"):
        where = "any load" if unclear == n else _at(unclear, n)
        parts.append(f"The measurement cannot tell at {where}.")
    if agreement.verdict in ("model too high", "model too low", "mixed"):
        worst = agreement.worst
        parts.append(
            f"On average over the loads the model is {percent(abs(agreement.mean_deviation))} too "
            f"{'high' if agreement.mean_deviation > 0 else 'low'}; it is farthest off at "
            f"{significant(worst.normal_load_N)} N, by {percent(worst.deviation)}."
        )
    if agreement.calibrated:
        parts.append("The model was calibrated on this sample: agreement here is no test of it.")
    return " ".join(parts)


def _at(count: int, n: int) -> str:
    if count == n:
        return "every load" if n > 1 else "the one load"
    return f"{count or 'none'} of {counted(n, 'load')}"


def ranking_sentence(ranking: Ranking) -> str:
    """Whether the model puts the samples in the measured order, by pairs the measurement can part."""
    n = len(ranking.told_apart)
    start = (
        f"{ranking.regime.capitalize()} friction at {significant(ranking.normal_load_N)} N, from most to "
        f"least: measured {' > '.join(ranking.measured)}; simulated {' > '.join(ranking.simulated)}. "
    )
    if not n:
        return start + "The measurement cannot tell any two samples apart, so it cannot judge the order."
    start += f"The measurement tells {n} of {counted(ranking.n_pairs, 'pair')} apart; "
    if not ranking.reversed:
        return start + "the model has every one of them in the right order."
    wrong = joined([f"{a} over {b}" for a, b in ranking.reversed])
    return start + f"the model has {n - len(ranking.reversed)} of them in the right order and reverses {wrong}."


def direction_sentences(ratios: Iterable[DirectionRatio]) -> list[str]:
    """How much more friction a pattern has along x than along y, measured and simulated."""
    groups: dict[tuple[str, Regime], list[DirectionRatio]] = {}
    for ratio in ratios:
        groups.setdefault((ratio.pattern, ratio.regime), []).append(ratio)
    return [_direction_sentence(group) for group in groups.values()]


def _direction_sentence(group: list[DirectionRatio]) -> str:
    x, y = group[0].pair
    values = ", ".join(
        f"{r.measured:.2f} ({r.low:.2f} to {r.high:.2f}) against {r.simulated:.2f} at {significant(r.normal_load_N)} N"
        for r in group
    )
    outside = [r for r in group if not r.low <= r.simulated <= r.high]
    anisotropic = [r for r in group if not r.low <= 1 <= r.high]
    seen = (
        f"The measurement shows that the directions differ at {len(anisotropic)} of these {counted(len(group), 'load')}"
        if anisotropic
        else "The measurement cannot tell the directions apart at these loads"
    )
    verdict = (
        "the model lies within its interval at all of them"
        if not outside
        else f"the model lies outside its interval at {len(outside)} of them"
    )
    return f"{x} over {y}, {group[0].regime}, measured against simulated: {values}. {seen}; {verdict}."


def correlation_note(study: Study) -> str:
    """Why mu and tau0 must not be compared one by one."""
    values = findings.parameter_correlations(study.fits)
    if not values:
        return ""
    return (
        f"The μ and τ₀ of one fit are not independent: their correlation coefficient is {span(values)} over the "
        "fits above (from few specimens it is itself poorly known). Two fits can differ in both and still give the "
        "same forces, so a difference in μ alone or in τ₀ alone says little. Compare the friction "
        "force at each load, with the covariance taken into account."
    )


def odd_sentence(pull: OddPull) -> str:
    """How far a pull stands from its siblings."""
    side = "above" if pull.deviation > 0 else "below"
    return (
        f"{pull.regime.capitalize()} force {percent(abs(pull.deviation))} {side} the median of the {pull.siblings} "
        f"other pulls of this sample at this load, {abs(pull.score):.1f} robust standard deviations."
    )


def by_hand_sentence(decided: ByHand, pull: Pull | None) -> str:
    """What a person decided about a pull, and what it changed against the automatic reading."""
    reason = f" ({decided.override.reason})" if decided.override.reason else ""
    if pull is None:
        return f"Left out by hand{reason}."
    automatic = decided.automatic
    moved = []
    if decided.override.peak_s is not None:
        moved.append(f"static peak from {significant(automatic.peak_s)} to {significant(pull.peak_s)} s")
    if decided.override.window_s is not None:
        before, after = (" to ".join(map(significant, p.window_s)) for p in (automatic, pull))
        moved.append(f"sliding window from {before} s to {after} s")
    return (
        f"Read elsewhere by hand{reason}: {joined(moved)}. Static force {_changed(automatic.static_N, pull.static_N)}, "
        f"sliding force {_changed(automatic.sliding_N, pull.sliding_N)}."
    )


def _changed(before: float, after: float) -> str:
    change = percent(after / before - 1) if before else "–"
    return f"{significant(after)} N where the rule reads {significant(before)} N ({change})"


def flags_in_words(flags: Iterable[str]) -> str:
    """Quality flags as readers see them: underscores become spaces."""
    return ", ".join(flag.replace("_", " ") for flag in flags)
