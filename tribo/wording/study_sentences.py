"""What a study measured, and where the model agrees with it. No sentence claims more than the intervals support."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.comparison import findings
from tribo.comparison.findings import Agreement, Ranking, Verdict, all_set_aside, shown
from tribo.diagnostics.column_search import ColumnEffect
from tribo.diagnostics.verdict import Verdict as Found
from tribo.diagnostics.without_model import SERIES
from tribo.records import PA_PER_KPA, REGIMES, Campaign, LawFit, Override, Pull, Study, Test
from tribo.user_text import plain
from tribo.vocabulary import label_with_unit
from tribo.wording.numerals import (
    counted,
    interval,
    joined,
    loads_in_words,
    p_text,
    percent,
    signed,
    significant,
    span,
    with_uncertainty,
)

if TYPE_CHECKING:
    import pandas as pd

FLAGS = {
    "follows_load": "follows the normal load", "gap_at_peak": "gap in the data at the peak",
    "impulsive": "impulsive noise", "no_drop": "no certain drop after the peak", "no_sliding": "no sliding phase",
    "no_static": "no static peak", "no_zero_phase": "no zero phase", "peak_ambiguous": "readings of the peak differ",
    "peak_between_samples": "peak between samples", "peak_by_hand": "peak moved by hand", "restarts": "restarts",
    "phases_by_hand": "phases stated by hand",
    "stick_slip": "stick-slip", "window_by_hand": "window moved by hand", "window_short": "window too short",
    "zero_uncertain": "zero uncertain",
}  # fmt: skip
SIDE: dict[Verdict, str] = {"model too high": "too high", "model too low": "too low"}
HOW_TO_READ = (
    "The ratio is the measured friction force divided by the simulated one, with its 95 % interval. Percentages are "
    "its difference from 1: −20 % means that the measured force is 20 % below the simulated one. The interval contains "
    "the scatter of specimens and repeats and the error of the calibration; an error of the load cell's gain changes "
    "the measurement and the calibrated model alike, so it is not in the interval. The model "
    "agrees at a load if the interval contains 1 and its limits are within a factor of 1.2 of the ratio. If the "
    "interval contains 1 but is wider, the result at this load is inconclusive. The overall result for a sample "
    "is the result found at half or more of its loads. The loads of a sample share the same specimens, so their "
    "results are not independent. By chance, one interval in twenty does not contain the true ratio."
)
LEVEL = 0.05
MOST_SAID = 12
OSCILLATING = {
    "steady": "Steady sliding", "stick-slip": "Stick-slip", "irregular": "An irregularly varying sliding force",
    "inertial oscillation": "An oscillating sliding force without sticking (inertial oscillation)",
}  # fmt: skip


def what_was_measured(study: Study) -> str:
    """Number of pulls, specimens, samples and loads."""
    campaign, tests = study.ingested.campaign, study.ingested.used_tests
    aside = len(all_set_aside(study))
    samples = findings.tested_samples(study)
    specimens = specimens_of(campaign, tests)
    loads = np.array([t.normal_load_N for t in tests])
    levels = np.unique(findings.load_levels(loads))
    pressure = ""
    if campaign.has_area:
        lowest, highest = (significant(n / campaign.area_m2 / PA_PER_KPA) for n in (levels[0], levels[-1]))
        pressure = f" (nominal pressure {lowest if lowest == highest else f'{lowest} to {highest}'} kPa)"
    return (
        f"{counted(len(tests), 'pull')} of {counted(len(specimens), 'specimen')} of "
        f"{counted(len(samples), 'sample')} ({joined(samples)}) at {loads_in_words(levels.tolist())}{pressure}. "
        f"{'No test was' if not aside else counted(aside, 'test') + (' was' if aside == 1 else ' were')} set aside."
    )


def specimens_of(campaign: Campaign, tests: Iterable[Test]) -> set[tuple[str, str]]:
    """Pattern and name of every specimen: one that was pulled in two directions counts once."""
    return {(campaign.samples[t.sample].name if t.sample in campaign.samples else t.sample, t.specimen) for t in tests}


def flat_law(study: Study) -> list[str]:
    """The measured law of the flat sample, one sentence per regime."""
    flat = findings.flat_sample(study)
    fits = [(regime, study.fits.of(flat, regime)) for regime in REGIMES]
    return [
        f"The {regime} friction of the flat sample {flat} follows T = μN + {'τ₀A' if fit.has_area else 'T₀'} with "
        f"{_law_values(fit)} "
        f"(± {uncertainty_kind(study)})."
        for regime, fit in fits
        if fit is not None
    ]


def uncertainty_kind(study: Study) -> str:
    """What stands after ±."""
    if any(fit.alone is not None for fit in study.fits):
        return "combined standard uncertainty, k = 1: scatter of specimens and repeats, and the instrument"
    return "standard uncertainty, k = 1, of specimens and repeats alone"


def _law_values(fit: LawFit) -> str:
    mu = with_uncertainty(fit.mu, fit.mu_u)
    if not fit.has_area:
        return f"μ = {mu} and T₀ = {with_uncertainty(fit.T0_N, fit.T0_u_N)} N"
    return f"μ = {mu} and τ₀ = {with_uncertainty(fit.tau0_Pa / PA_PER_KPA, fit.tau0_u_Pa / PA_PER_KPA)} kPa"


def in_short(agreements: Iterable[Agreement], flat: str) -> list[str]:
    """One sentence per regime: where the model agrees, where it does not, where the data are inconclusive."""
    predicted = [a for a in agreements if not a.calibrated]
    return [
        f"{regime.capitalize()} friction: the model, calibrated on {flat} alone, {_verdicts(part)}."
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
    if unclear := by_verdict.get("inconclusive"):
        clauses.append(
            f"can be neither confirmed nor rejected for {joined([a.sample for a in unclear])}, where the intervals are "
            "too wide"
        )
    return "; it ".join(clauses)


def deviation(fraction: float) -> str:
    """measured / model - 1 in percent, with its sign."""
    return f"{'+' if fraction > 0 else ''}{percent(fraction)}"


def _inside(agreement: Agreement) -> str:
    """The sample; where it does not agree at all loads, at how many it does, and at how many nothing can be said."""
    inside, unclear, n = agreement.count("agrees"), agreement.count("inconclusive"), len(agreement.loads)
    if inside == n:
        return agreement.sample
    open_yet = f"; inconclusive at {unclear}" if unclear else ""
    return f"{agreement.sample} (at {_at(inside, n)}{open_yet})"


def _off_by(agreement: Agreement) -> str:
    count, n = agreement.n_outside, len(agreement.loads)
    off = deviation(agreement.mean_deviation)
    return f"{agreement.sample} ({off}{'' if n == 1 else ' on average'}, at {_at(count, n)})"


def agreement_sentence(agreement: Agreement) -> str:
    """One sample in one regime: the ratio, where the model agrees, and how far off it is."""
    loads, n = agreement.loads, len(agreement.loads)
    parts = [f"The ratio of measured to simulated T is {span([load.ratio for load in loads])}."]
    if inside := agreement.count("agrees"):
        parts.append(f"The model agrees within the 95 % interval at {_at(inside, n)}.")
    for verdict, side in SIDE.items():
        if count := agreement.count(verdict):
            parts.append(f"The model is {side} at {_at(count, n)}.")
    if unclear := agreement.count("inconclusive"):
        parts.append(f"The measurement is inconclusive at {_at(unclear, n)}.")
    if agreement.verdict in ("model too high", "model too low", "mixed"):
        worst = agreement.worst
        parts.append(
            f"Averaged over the loads, measured T differs from simulated T by {deviation(agreement.mean_deviation)}; "
            f"the largest difference is {deviation(worst.deviation)}, at {significant(worst.normal_load_N)} N."
        )
    if agreement.calibrated:
        parts.append("The model was calibrated on this sample, so agreement here does not test the model.")
    return " ".join(parts)


def _at(count: int, n: int) -> str:
    if count == n:
        return "all loads" if n > 1 else "the only load"
    return f"{count or 'none'} of {counted(n, 'load')}"


def ranking_sentence(ranking: Ranking) -> str:
    """Whether the model ranks the samples as measured, judged by pairs that differ significantly."""
    n = len(ranking.told_apart)
    start = (
        f"{ranking.regime.capitalize()} friction at {significant(ranking.normal_load_N)} N, from highest "
        f"to lowest: measured {' > '.join(ranking.measured)}; simulated {' > '.join(ranking.simulated)}. "
    )
    if not n:
        return start + "No two samples differ significantly in the measurement, so it does not test the order."
    start += f"The measurement distinguishes {n} of {counted(ranking.n_pairs, 'pair')} of samples; "
    if not ranking.reversed:
        return start + "the model ranks all of them in the measured order."
    wrong = joined([f"{a} > {b}" for a, b in ranking.reversed])
    return start + f"the model ranks {n - len(ranking.reversed)} of them in the measured order and reverses {wrong}."


def direction_sentences(ratios: pd.DataFrame) -> list[str]:
    """Ratio of the friction along x to that along y of each pattern, measured and simulated."""
    groups = ratios.groupby(["pattern", "regime"], sort=False)
    return [_direction_sentence(part.to_dict("records")) for _, part in groups]


def _direction_sentence(group: Sequence[Mapping[Any, Any]]) -> str:
    x, y = group[0]["x"], group[0]["y"]
    values = ", ".join(
        f"{r['measured']:.2f} ({r['low']:.2f} to {r['high']:.2f}) and {r['simulated']:.2f} at "
        f"{significant(r['normal_load_N'])} N"
        for r in group
    )
    outside = [r for r in group if not r["low"] <= r["simulated"] <= r["high"]]
    anisotropic = [r for r in group if not r["low"] <= 1 <= r["high"]]
    seen = (
        f"In the measurement, the directions differ significantly at {_at(len(anisotropic), len(group))}"
        if anisotropic
        else "In the measurement, the directions do not differ significantly at these loads"
    )
    verdict = (
        "the simulated ratio lies within the 95 % interval of the measurement at all of them"
        if not outside
        else f"the simulated ratio lies outside the 95 % interval of the measurement at {len(outside)} of them"
    )
    return f"Ratio of {group[0]['regime']} friction {x} / {y}, measured and simulated: {values}. {seen}; {verdict}."


def pooling_note(study: Study) -> str:
    """Where the scatter of other samples makes an interval narrower than the tests of a sample alone do."""
    pooled = [fit for fit in study.fits if fit.alone is not None and math.isfinite(fit.mu)]
    widths = [[high - low for low, high in (f.interval("mu"), f.by_itself.interval("mu"))] for f in pooled]
    narrower = sum(stated < alone for stated, alone in widths)
    if not narrower:
        return ""
    return (
        "The scatter of specimens is partly pooled over the samples of the campaign, because few specimens may agree "
        "by chance; the 95 % interval of μ is thereby narrower than by its own specimens alone in "
        f"{narrower} of {len(pooled)} fits."
    )


def correlation_note(study: Study) -> str:
    """Why mu and tau0 must not be compared separately."""
    values = findings.parameter_correlations(study.fits)
    if not values:
        return ""
    return (
        f"The μ and τ₀ of a fit are correlated: in the fits above, their correlation coefficient is {span(values)} "
        "(with few specimens, this coefficient is itself uncertain). Two fits may differ in both parameters and still "
        "give the same forces. A difference in μ alone or in τ₀ alone is therefore weak evidence: compare the "
        "friction force at each load, including the covariance."
    )


def odd_sentence(standing: Mapping[str, Any]) -> str:
    """How far a pull is from the other pulls of its sample at its load, from its row of the standings."""
    side = "above" if standing["deviation"] > 0 else "below"
    return (
        f"{standing['regime'].capitalize()} force {percent(abs(standing['deviation']))} {side} the median of the "
        f"{standing['siblings']} other pulls of this sample at this load ({abs(standing['score']):.1f} robust standard "
        "deviations)."
    )


def by_hand_sentence(decided: Override, pull: Pull | None) -> str:
    """A decision made by hand about a pull, and how it changed the automatic values."""
    reason = f" ({decided.reason})" if decided.reason else ""
    if pull is None:
        return f"Excluded by hand{reason}."
    automatic = decided.automatic
    moved = []
    if decided.peak_s is not None:
        moved.append(f"static peak from {significant(automatic.peak_s)} to {significant(pull.peak_s)} s")
    if decided.window_s is not None:
        before, after = (" to ".join(map(significant, p.window_s)) for p in (automatic, pull))
        moved.append(f"sliding window from {before} s to {after} s")
    for phase in decided.phases:
        moved.append(f"{phase.name} from {significant(phase.start_s)} to {significant(phase.end_s)} s")
    for number, fail, end in decided.slips:
        between = f"from {significant(fail)} to {significant(end)} s"
        moved.append(
            f"slip {number} taken out" if not math.isfinite(fail)
            else f"slip {number} moved: {between}" if number else f"a slip added {between}"
        )  # fmt: skip
    done = "Changed" if decided.slips else "Stated" if decided.phases else "Moved"
    return (
        f"{done} by hand{reason}: {joined(moved)}. Static force {_changed(automatic.static_N, pull.static_N)}, "
        f"sliding force {_changed(automatic.sliding_N, pull.sliding_N)}."
    )


def _changed(before: float, after: float) -> str:
    if not (math.isfinite(before) and math.isfinite(after)):
        now, then = (f"{significant(v)} N" if math.isfinite(v) else "none" for v in (after, before))
        return f"{now}, automatic value {then}"
    change = percent(after / before - 1) if before else "–"
    return f"{significant(after)} N, automatic value {significant(before)} N ({change})"


def flags_in_words(flags: Iterable[str]) -> str:
    """Quality flags as text."""
    return ", ".join(FLAGS.get(flag, flag.replace("_", " ")) for flag in flags)


def bent_laws(study: Study) -> Iterator[str]:
    """The samples whose friction is no straight line in the load, with the chi-squared ratio of each."""
    bent = [fit for fit in study.fits if fit.bent]
    if bent:
        intercept = "τ₀" if study.ingested.campaign.has_area else "T₀"
        named = joined([f"{fit.sample} {fit.regime} (χ²/ν = {significant(fit.chi2_red, 2)})" for fit in bent])
        yield (f"T against N is not a straight line for {named}: μ and {intercept} there depend on the range of loads.")


def friction_sentence(study: Study) -> str:
    """The measured friction, highest and lowest, where it was not compared with a model."""
    if study.comparison is not None:
        off = [a for a in findings.agreements(study) if not a.calibrated]
        if off:
            worst = max((load for a in off for load in a.loads), key=lambda load: abs(load.deviation))
            a = next(a for a in off if worst in a.loads)
            value, low, high = (100 * (x - 1) for x in (worst.ratio, worst.low, worst.high))
            return (
                f"Measured friction differs most from the model for {a.regime} friction of {a.sample} at "
                f"{significant(worst.normal_load_N)} N, by {signed(value)} % (95 % interval {interval(low, high)}); no "
                "diagnosis was made."
            )
    return ratio_of_samples(study)


def friction_sentences(study: Study, verdict: Found | None = None) -> dict[str, list[str]]:
    """Sentences by section; all empty where the study was made with the model.

    The size of a dependence that the ``verdict`` states is not told a second time by another measure.
    """
    if not shown(study):
        return {"samples": [], "laws": [], "dependence": [], "oscillation": []}
    effects = [f for m in (verdict.misfits if verdict else ()) for f in _effects(m.shows)]
    said = {(f.regime, name) for f in effects for name in (f.name, *f.same)}
    return {
        "samples": list(_samples(study)),
        "laws": list(_chosen_laws(study)),
        "dependence": list(_dependence(study, said)),
        "oscillation": [*_directions(study), *_oscillation(study), *_restarts(study), *_readings(study)],
    }


def _samples(study: Study) -> Iterator[str]:
    table = study.ingested.table()
    for sample in findings.sample_numbers(study):
        for regime in REGIMES:
            part = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"]) & (table["normal_load_N"] > 0)]
            if part.empty:
                continue
            ratio = (part[f"{regime}_N"] / part["normal_load_N"]).to_numpy(float)
            loads = np.unique(findings.load_levels(part["normal_load_N"].to_numpy(float)))
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


def _chosen_laws(study: Study) -> Iterator[str]:
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


def _effects(shows: object) -> tuple[ColumnEffect, ...]:
    return tuple(f for f in shows if isinstance(f, ColumnEffect)) if isinstance(shows, tuple) else ()


def _dependence(study: Study, said: Collection[tuple[str, str]]) -> Iterator[str]:
    table = study.dependence
    if table is None or table.empty:
        return
    clear = table[table["p_adjusted"] < LEVEL].sort_values("p_adjusted")
    if clear.empty:
        yield "T/N varies significantly with no recorded variable (rank correlations, adjusted for their number)."
    for row in _rows(clear.head(MOST_SAID)):
        change = f": {percent(row['change_percent'] / 100)} from {plain(row['low'])} to {plain(row['high'])}"
        if (row["regime"], row["variable"]) in said or row["change_percent"] * row["rank"] < 0:
            change = ""  # the diagnosis states it, or a line and the ranks contradict each other
        yield (
            f"{row['regime'].capitalize()} T/N of {row['sample']} varies with {row['label']}{change} (rank "
            f"correlation {significant(row['rank'], 2)}, adjusted p {p_text(row['p_adjusted'])}, "
            f"{counted(row['n'], 'test')})."
        )
    yield from _inseparable(table)


def _inseparable(table: pd.DataFrame) -> Iterator[str]:
    """Pairs of variables that vary together, each once, with the test that would separate them."""
    pairs = [
        (row["sample"], *sorted((row["label"], label_with_unit(other))))
        for row in _rows(table)
        for other in row["inseparable_from"]
    ]
    series = {label_with_unit(name) for name in SERIES}  # places of a series, which nobody can part
    for sample, one, other in list(dict.fromkeys(pairs))[:MOST_SAID]:
        said = f"For {sample}, {one} and {other} vary together, so their effects cannot be separated."
        test = f" Next test: repeat several values of {one} in random order of {other}."
        yield said if {one, other} <= series else said + test


def _rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def _oscillation(study: Study) -> Iterator[str]:
    regimes: dict[str, list[str]] = {}
    for test_id, pull in study.ingested.pulls.items():
        if pull.oscillation is not None:
            regimes.setdefault(pull.oscillation.regime, []).append(test_id)
    for regime, tests in sorted(regimes.items()):
        named = joined(tests[:MOST_SAID]) + (f" and {len(tests) - MOST_SAID} more" if len(tests) > MOST_SAID else "")
        yield f"{OSCILLATING[regime]} in {counted(len(tests), 'test')}: {named}."


def _directions(study: Study) -> Iterator[str]:
    """The offset that parts the two directions of reciprocating strokes."""
    both = {way: [p for p in study.ingested.pulls.values() if way in p.flags] for way in ("forward", "backward")}
    if not all(both.values()):
        return
    offsets = np.array([p.zero_N for p in both["forward"]] + [-p.zero_N for p in both["backward"]])
    apart = f", standard deviation {significant(float(offsets.std()), 2)} N" if np.ptp(offsets) > 1e-9 else ""
    means = {way: float(np.mean([p.sliding_N for p in pulls])) for way, pulls in both.items()}
    yield (
        f"{counted(len(both['forward']), 'stroke')} forward and {len(both['backward'])} backward: the force recorded "
        f"in the two directions differs by twice {significant(float(offsets.mean()))} N (the zero{apart}), "
        f"which was subtracted. Mean sliding force forward "
        f"{significant(means['forward'])} N, backward {significant(means['backward'])} N."
    )


def _readings(study: Study) -> Iterator[str]:
    """What the records tell that are programmes: levels, cycles, and whether they have run in."""
    of = {name: [r for r in study.ingested.readings if r.name == name] for name in ("plateau", "cycle", "running-in")}
    levels = [r for r in of["plateau"] if r.way]
    if levels:
        ways = [way for way in ("up", "down") if any(r.way == way for r in levels)]
        said = [
            f"{significant(r.values['coefficient'][0])} at {significant(r.speed_m_s * 1e3)} mm/s and "
            f"{significant(r.normal_load_N)} N" for r in levels if "coefficient" in r.values
        ]  # fmt: skip
        shown = f": sliding T/N {', '.join(said)}" if 0 < len(said) == len(levels) <= MOST_SAID else ""
        yield (
            f"{counted(len(levels), 'level')} of speed or load were read on the way {' and '.join(ways)}{shown}; "
            "readings.csv holds the mean of each with its 95 % interval."
        )
    if of["cycle"]:
        yield f"{counted(len(of['cycle']), 'cycle')} of strokes were read, each a line of readings.csv."
    for state, why in (
        ("still drifts", "force still drifts at the end: the mean of the last part is no steady level"),
        ("cannot tell", "force varies too much to tell whether a steady level was reached"),
    ):
        found = [r.test_id for r in of["running-in"] if r.state == state]
        if found:
            yield f"In {counted(len(found), 'record')} of continuous sliding, the {why}: {', '.join(found)}."


def _restarts(study: Study) -> Iterator[str]:
    tests = [(i, p) for i, p in study.ingested.pulls.items() if p.restarts]
    if tests:
        count = sum(len(pull.restarts) for _, pull in tests)
        yield (
            f"{counted(count, 'restart')} after a stop of the drive {'was' if count == 1 else 'were'} found in "
            f"{counted(len(tests), 'test')}; restarts.csv lists the static force and the time of the hold of each."
        )
