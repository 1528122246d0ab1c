"""The verdict on a published table, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tribo.diagnose.from_table.table_diagnosis import (
    BARRED,
    GUESSES,
    LEVEL,
    PATTERNS,
    Outlook,
    Weighed,
    estimate_of,
    upper_limit,
)
from tribo.diagnose.from_table.table_observations import friction_at
from tribo.diagnose.verdict import Cause, Excluded, Gain, Misfit, NextTest, Verdict
from tribo.mechanisms.table import MECHANISMS

LEAST_ALIKE = 0.6  # correlations above this (less negative) no line over the range of the paper can have
ONE_PULL = {
    "velocity_dependence": "one speed", "contact_ageing": "the hold is not printed",
    "run_in": "the order of the pulls is not printed", "temperature": "no temperature is printed",
    "humidity": "no humidity is printed", "load_cell_drift": "no times are printed",
    "mislabelled_specimen": "no specimens are printed", "covariate": "no further column is printed",
    "machine_compliance": "no trace is printed in numbers", "bulk_viscoelasticity": "no trace is printed in numbers",
    "sampling_clip": "no sampling rate is printed",
}  # fmt: skip


def verdict_of(outlooks: Sequence[Outlook], gain: Gain) -> Verdict:
    """The verdict on the first reading, with what holds in all the others in its text."""
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
    """Samples whose friction is off beyond chance, the surest first; the strongest look where none is alone."""
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
        text += f" at {table.pressures_kPa[0]:g} to {table.pressures_kPa[-1]:g} kPa (adjusted p {_p(p)})."
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


def _p(p: float) -> str:
    return "below 0.001" if p < 1e-3 else f"{p:.3f}"


def misfit_sentence(outlooks: Sequence[Outlook]) -> str:
    """Whether the paper's own model fails, and on what that depends."""
    possible = [o for o in outlooks if o.reading.correlation < -LEAST_ALIKE]
    free = [o for o in outlooks if o.reading.correlation == 0.0 and o.reading.specimens == 1]
    failing = sum(o.p_misfit < LEVEL for o in possible)
    main = outlooks[0]
    text = (
        f"The model calibrated on the flat sample fails on Table 2 beyond chance (adjusted p {_p(main.p_misfit)} with "
        f"a correlation of mu and tau0 of {main.reading.correlation:.2f}, that of loads spread evenly over 3 to 25 kPa)"
        f", and in {failing} of {len(possible)} readings with a correlation that a line over these loads can have."
    )
    if free and all(o.p_misfit >= LEVEL for o in free):
        text += (
            " If the printed standard deviations of mu and tau0 were independent, nothing would be beyond chance: "
            "the unpublished covariance decides."
        )
    return text


def guess_sentences(outlooks: Sequence[Outlook]) -> list[str]:
    """What the numbers say of each of the authors' three guesses."""
    possible = [o for o in outlooks if o.reading.correlation < -LEAST_ALIKE]
    main = outlooks[0]
    found = []
    for guess, names in GUESSES.items():
        gains = [max(w.gain for w in o.weighed if w.name in names) for o in possible]
        if guess == "suction cups":
            limit = upper_limit(main.baseline, "suction")
            found.append(
                "Suction cups are excluded: they only add friction, and their best size is zero in "
                f"{sum(_size(o, 'suction') < 1.0 for o in possible)} of {len(possible)} readings "
                f"(at most {limit / 1e3:.1f} kPa, 95 %)."
            )
        elif guess == "changed contact area":
            limit = upper_limit(main.baseline, "contact_area_loss")
            lost = 100 * limit * _flat_traction_Pa(main) ** 2
            found.append(
                "A contact area that shrinks with traction is not supported: it would lower the flat sample too, earns "
                f"at most {max(gains):.1f} units of log likelihood and may take at most {lost:.0f} % of the flat "
                "contact at 10 kPa (95 %)."
            )
        else:
            found.append(
                f"Deformed patterns are supported: friction that parts along and across the long cavities of S earns "
                f"{min(gains):.1f} to {max(gains):.1f} units of log likelihood over these readings. Floors of cavities "
                f"that touch down would raise friction and are not behind it. {_adhesion_along_y(main)}"
                f"{_instrument_instead(possible)}"
            )
    return found


def _instrument_instead(outlooks: Sequence[Outlook]) -> str:
    """In how many readings an error of the instrument would explain more than any guess."""
    guesses = {name for names in GUESSES.values() for name in names}
    ahead = [o.weighed[0].name for o in outlooks if o.weighed[0].name not in guesses]
    if not ahead:
        return ""
    names = " or ".join(sorted(set(ahead)))
    return (
        f" In {len(ahead)} of these readings {names} would explain more; the paper prints nothing that rules it out."
    )


def _adhesion_along_y(outlook: Outlook) -> str:
    """What is left of the adhesion of S across its long cavities, from the table itself."""
    table = outlook.table
    i = table.samples.index("Sy")
    measured = table.values.reshape(-1, 2, 2)[i, :, 1]
    sd = np.sqrt(np.diag(table.data_covariance)).reshape(-1, 2, 2)[i, :, 1]
    model = table.shares[i, [1, 3]] * table.values.reshape(-1, 4)[table.samples.index("F"), [1, 3]]
    return (
        f"Across them the adhesion of S is gone: tau0 {measured[0]:.1f} +- {sd[0]:.1f} and {measured[1]:.1f} +- "
        f"{sd[1]:.1f} kPa, where the model has {model[0]:.1f} and {model[1]:.1f}."
    )


def _size(outlook: Outlook, name: str) -> float:
    return next(float(w.fit.parameters[0][0]) for w in outlook.weighed if w.name == name)


def _flat_traction_Pa(outlook: Outlook) -> float:
    """Static traction of the flat sample at 10 kPa by the calibrated law."""
    law = outlook.table.values.reshape(-1, 4)[outlook.table.samples.index("F")]
    return float(law[0] * 10e3 + law[1] * 1e3)


def extension_sentence(main: Outlook, best: Weighed, gain: Gain) -> str:
    """What the best extended model is worth, on the table and on samples left out, and what it leaves."""
    name, e = next(iter(estimate_of(best).items()))
    before, after = -2 * main.baseline.score, -2 * best.fit.score
    clear = gain.difference > 2 * gain.se
    text = (
        f"The best extension is {best.name}, {name} = {e.value:.2g} {e.unit}".rstrip()
        + f" (90 % {e.low:.2g} to {e.high:.2g}): chi-squared of the {len(main.table.values)} numbers falls from "
        f"{before:.0f} to {after:.0f}. On whole samples left out its gain is {gain.difference:+.2f} +- {gain.se:.2f} "
        f"in log score a number, {'which is clear' if clear else 'which may be chance'}."
    )
    strongest = min(main.looks_left, key=lambda look: main.looks_left[look])
    if main.p_left < LEVEL:
        text += f" Something is left ({strongest}, adjusted p {_p(main.p_left)}): no single law of the library does."
    rivals = [w.name for w in main.near if w is not best]
    if rivals:
        text += f" {', '.join(rivals)} would explain about as much."
    return text


def _cause(w: Weighed, main: Outlook) -> Cause:
    gains = np.array([n.gain for n in main.near])
    share = float(np.exp(w.gain - gains.max()) / np.exp(gains - gains.max()).sum())
    m = w.acting.mechanism
    return Cause(w.name, share, estimate_of(w), f"{w.name}: {m.shows}. What separates it: {m.separates}.")


def exclusions(outlooks: Sequence[Outlook], shown: set[str]) -> list[Excluded]:
    """Every mechanism that is not among the causes, and why, in the first reading."""
    main = outlooks[0]
    best = main.weighed[0]
    found = []
    for name, m in MECHANISMS.items():
        weighed = next((w for w in main.weighed if w.name == name), None)
        if name in shown or (not shown and weighed is best):
            continue
        if name in ONE_PULL:
            found.append(Excluded(name, f"cannot be told from this table: {ONE_PULL[name]}"))
        elif name in BARRED:
            found.append(Excluded(name, BARRED[name]))
        elif weighed is not None and m.amplitude.low == 0.0 and _size(main, name) < 1e-3 * m.amplitude.start:
            limit = upper_limit(main.baseline, name)
            most = f"at most {m.amplitude.name} = {limit:.2g} {m.amplitude.unit}".rstrip()
            reason = f"by its sign: it can only act one way, and the table goes the other; {most} (95 %)"
            found.append(Excluded(name, reason))
        elif weighed is not None:
            lost = best.gain - weighed.gain
            found.append(Excluded(name, f"explains less: its log likelihood is {lost:.1f} lower"))
        else:
            found.append(Excluded(name, "cannot be told from this table: what it needs does not vary"))
    return found


def _next_test() -> NextTest:
    text = (
        "Print T at every load, or the covariance of mu and tau0: it decides what is beyond chance. At the bench, pull "
        "S along x, along y, reversed and at 45 degrees at three loads: 72 pulls."
    )
    design = {"sample": "S", "direction_deg": [0, 45, 90, 180], "pressure_kPa": [3, 9, 25], "pulls": 72, "hours": 8.4}
    return NextTest(text, ("cavity_shear_deformation", "pull_angle", "load_cell_offset"), design, float("nan"))
