"""The verdict on a published table, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tribo.berardo2019.table_model import LEVEL, PATTERNS, Outlook, Weighed, estimate_of, friction_at, upper_limit
from tribo.diagnostics.sentences import p_text, sentence_case, signs_of
from tribo.diagnostics.terms import not_varied
from tribo.diagnostics.verdict import Cause, Excluded, Gain, Misfit, NextTest, Verdict
from tribo.mechanisms.record import Readings
from tribo.mechanisms.table import MECHANISMS

LEAST_ALIKE = 0.6  # correlations above this (less negative) no line over the range of the paper can have
NOT_TESTABLE = "cannot be tested with this table"
PRINT_FIRST = "Print T at every load, or the covariance of mu and tau0, which decides what is beyond chance."


def verdict_of(outlooks: Sequence[Outlook], gain: Gain) -> Verdict:
    """The verdict on the first reading; its text says what holds in the other readings."""
    main = outlooks[0]
    best = main.weighed[0]
    named = main.outcome in ("named", "undetermined")
    return Verdict(
        verdict=main.outcome,
        misfits=tuple(misfits(main)),
        causes=tuple(_cause(w, main) for w in main.near) if named else (),
        equivalent=(),
        excluded=tuple(exclusions(outlooks, {w.name for w in main.near} if named else set())),
        gain=gain if main.outcome != "no_misfit" else None,
        next_test=_next_test(),
        text=" ".join([misfit_sentence(outlooks), *guess_sentences(outlooks), extension_sentence(main, best, gain)]),
        model={"shares_from": "the numerical column of Table 2", "readings": [reading_record(o) for o in outlooks]},
    )


def reading_record(o: Outlook) -> dict[str, object]:
    """One reading in plain values: what was assumed, and what came out."""
    return {
        "model": o.reading.model, "correlation": o.reading.correlation, "correlation_is": o.reading.why,
        "standard_deviations_of": "a mean" if o.reading.specimens == 1 else f"{o.reading.specimens} specimens",
        "outcome": o.outcome, "p_misfit": o.p_misfit, "best": o.weighed[0].name, "gain_of_best": o.weighed[0].gain,
        "p_left": o.p_left,
    }  # fmt: skip


def misfits(outlook: Outlook) -> list[Misfit]:
    """Samples whose friction differs from the model beyond chance, the most certain first."""
    found: list[Misfit] = []
    table = outlook.table
    for look, p in sorted(outlook.looks.items(), key=lambda item: item[1]):
        if p >= LEVEL or look in MECHANISMS or " of " not in look:
            continue
        what, _, where = look.partition(" of ")
        sample, _, slope = where.partition(" ")
        low, high = _ratio_percent(outlook, sample, what)
        whose = "the patterned samples together" if sample == PATTERNS else sample
        text = f"{what[0].upper()}{what[1:]} of {whose} is {_off(low, high)} of the calibrated model"
        text += f" at {table.pressures_kPa[0]:g} to {table.pressures_kPa[-1]:g} kPa (adjusted p {p_text(p)})."
        observable = {"static friction": "static", "sliding friction": "sliding"}.get(what, "both")
        named = "" if sample == PATTERNS else sample
        found.append(Misfit(observable, named, "normal_load_N" if slope else "sample", (low + high) / 2, p, text))
    once = {(m.sample, m.observable): m for m in reversed(found)}
    return [m for m in found if once[m.sample, m.observable] is m]


def _ratio_percent(outlook: Outlook, sample: str, what: str) -> tuple[float, float]:
    """Measured less modelled T in percent of the model: the mean at either end of the loads, lowest first."""
    table = outlook.table
    picked = [k for k, s in enumerate(table.samples) if s == sample or (sample == PATTERNS and s != "F")]
    rows = {"static friction": [0], "sliding friction": [1]}.get(what, [0, 1])
    flat = table.values.reshape(-1, 4)[table.samples.index("F")]
    ratio = np.log(table.friction(table.values) / friction_at(table, flat))[np.ix_(picked, rows)]
    ends = 100.0 * np.expm1(ratio[..., [0, -1]].mean(axis=(0, 1)))
    return float(ends.min()), float(ends.max())


def _off(low: float, high: float) -> str:
    if high < 0:
        return f"{-high:.0f} to {-low:.0f} % below that"
    if low > 0:
        return f"{low:.0f} to {high:.0f} % above that"
    return f"from {-low:.0f} % below to {high:.0f} % above that"


def misfit_sentence(outlooks: Sequence[Outlook]) -> str:
    """Whether the model of the paper fails, and on what that depends."""
    possible = [o for o in outlooks if o.reading.correlation < -LEAST_ALIKE]
    free = [o for o in outlooks if o.reading.correlation == 0.0 and o.reading.specimens == 1]
    failing = sum(o.p_misfit < LEVEL for o in possible)
    main = outlooks[0]
    verb = "differs" if main.p_misfit < LEVEL else "does not differ"
    text = (
        f"The model calibrated on the flat sample {verb} from Table 2 beyond chance: adjusted p "
        f"{p_text(main.p_misfit)} for a correlation of mu and tau0 of {main.reading.correlation:.2f}, "
        "which loads spread evenly over 3 to 25 "
        f"kPa would give. It differs beyond chance in {failing} of {len(possible)} readings with a correlation that is "
        "possible for a line fit over these loads."
    )
    if free and all(o.p_misfit >= LEVEL for o in free):
        text += (
            " If mu and tau0 were uncorrelated, nothing would be beyond chance: the result depends on their "
            "covariance, which the paper does not print."
        )
    return text


def guess_sentences(outlooks: Sequence[Outlook]) -> list[str]:
    """What the numbers say of each explanation that the authors propose, and of errors of the instrument instead."""
    possible = [o for o in outlooks if o.reading.correlation < -LEAST_ALIKE]
    found = [
        m.in_table.finding(_readings_of(name, outlooks[0], possible))
        for name, m in MECHANISMS.items()
        if m.in_table.finding is not None
    ]
    return [*found, _adhesion_along_y(outlooks[0]), *_instrument_instead(possible)]


def _readings_of(name: str, main: Outlook, outlooks: Sequence[Outlook]) -> Readings:
    weighed = [next(w for w in o.weighed if w.name == name) for o in outlooks]
    return Readings(
        gains=tuple(w.gain for w in weighed),
        sizes=tuple(float(w.fit.parameters[0][0]) for w in weighed),
        limit=lambda: upper_limit(main.baseline, name),
        flat_traction_Pa=_flat_traction_Pa(main),
    )


def _instrument_instead(outlooks: Sequence[Outlook]) -> list[str]:
    """In how many readings another mechanism explains more than the authors' explanations."""
    best = [o.weighed[0].acting.mechanism for o in outlooks]
    ahead = [m.in_words for m in best if not m.in_table.guess]
    if not ahead:
        return []
    names = " or ".join(sorted(set(ahead)))
    return [f"In {len(ahead)} of these readings {names} explains more; nothing printed in the paper rules it out."]


def _adhesion_along_y(outlook: Outlook) -> str:
    """The adhesion of S across its long cavities, from the table itself."""
    table = outlook.table
    i = table.samples.index("Sy")
    measured = table.values.reshape(-1, 2, 2)[i, :, 1]
    sd = np.sqrt(np.diag(table.data_covariance)).reshape(-1, 2, 2)[i, :, 1]
    model = table.shares[i, [1, 3]] * table.values.reshape(-1, 4)[table.samples.index("F"), [1, 3]]
    return (
        f"Across its long cavities S shows hardly any adhesion: tau0 is {measured[0]:.1f} +- {sd[0]:.1f} kPa (static) "
        f"and {measured[1]:.1f} +- {sd[1]:.1f} kPa (sliding); the model gives {model[0]:.1f} and {model[1]:.1f} kPa."
    )


def _size(outlook: Outlook, name: str) -> float:
    return next(float(w.fit.parameters[0][0]) for w in outlook.weighed if w.name == name)


def _flat_traction_Pa(outlook: Outlook) -> float:
    """Static traction of the flat sample at 10 kPa by the calibrated law."""
    law = outlook.table.values.reshape(-1, 4)[outlook.table.samples.index("F")]
    return float(law[0] * 10e3 + law[1] * 1e3)


def extension_sentence(main: Outlook, best: Weighed, gain: Gain) -> str:
    """How much the best extended model explains, in the table and on samples left out, and what remains."""
    name, e = next(iter(estimate_of(best).items()))
    before, after = -2 * main.baseline.score, -2 * best.fit.score
    clear = gain.difference > 2 * gain.se
    text = (
        f"The best extension is {best.acting.mechanism.in_words}, {name} = {e.value:.2g} {e.unit}".rstrip()
        + f" (90 % interval {e.low:.2g} to {e.high:.2g}): chi-squared of the {len(main.table.values)} numbers falls "
        f"from {before:.0f} to {after:.0f}. On whole samples left out of the fit its gain is {gain.difference:+.2f} +- "
        f"{gain.se:.2f} in log score per number, which {'is clear' if clear else 'may be chance'}."
    )
    strongest = min(main.looks_left, key=lambda look: main.looks_left[look])
    if main.p_left < LEVEL:
        text += (
            f" A misfit remains ({strongest}, adjusted p {p_text(main.p_left)}): no single law of the library is "
            "sufficient."
        )
    rivals = [w.acting.mechanism.in_words for w in main.near if w is not best]
    if rivals:
        text += f" About as well explained by: {', '.join(rivals)}."
    return text


def _cause(w: Weighed, main: Outlook) -> Cause:
    gains = np.array([n.gain for n in main.near])
    share = float(np.exp(w.gain - gains.max()) / np.exp(gains - gains.max()).sum())
    m = w.acting.mechanism
    return Cause(w.name, share, estimate_of(w), f"{sentence_case(m.in_words)}. {signs_of(m)}")


def exclusions(outlooks: Sequence[Outlook], shown: set[str]) -> list[Excluded]:
    """Every mechanism that is not among the causes, and why, in the first reading."""
    main = outlooks[0]
    best = main.weighed[0]
    found = []
    for name, m in MECHANISMS.items():
        weighed = next((w for w in main.weighed if w.name == name), None)
        if name in shown or (not shown and weighed is best):
            continue
        if m.in_table.missing:
            found.append(Excluded(name, f"{NOT_TESTABLE}: {m.in_table.missing}"))
        elif m.in_table.barred:
            found.append(Excluded(name, m.in_table.barred))
        elif weighed is not None and m.amplitude.low == 0.0 and _size(main, name) < 1e-3 * m.amplitude.start:
            limit = upper_limit(main.baseline, name)
            most = f"at most {m.amplitude.name} = {limit:.2g} {m.amplitude.unit}".rstrip()
            reason = f"wrong sign: it can change friction in one direction only; {most} (95 %)"
            found.append(Excluded(name, reason))
        elif weighed is not None:
            lost = best.gain - weighed.gain
            found.append(Excluded(name, f"explains the table less well: log likelihood lower by {lost:.1f}"))
        else:
            found.append(Excluded(name, f"{NOT_TESTABLE}: {not_varied(m)}"))
    return found


def _next_test() -> NextTest | None:
    """The bench test that a mechanism of the library proposes, after the numbers that the paper could still print."""
    test = next((m.in_table.next_test for m in MECHANISMS.values() if m.in_table.next_test is not None), None)
    if test is None:
        return None
    text = f"{PRINT_FIRST} At the bench: {test.text}"
    return NextTest(text, test.separates, test.design, float("nan"))
