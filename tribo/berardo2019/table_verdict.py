"""The verdict on a published table: misfits, causes, and what the table cannot show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribo.berardo2019.table_model import (
    LEVEL,
    PATTERNS,
    Outlook,
    TableLook,
    Weighed,
    estimate_of,
    friction_at,
    upper_limit,
)
from tribo.diagnostics.verdict import Cause, Excluded, Gain, Misfit, NextTest, Verdict
from tribo.mechanisms.table import MECHANISMS

REGIME_ROWS = {"static": [0], "sliding": [1], "both": [0, 1]}


@dataclass(frozen=True)
class OverLoads:
    """Measured less modelled T in percent of the model, the least and the most of both ends of the pressures (kPa)."""

    low: float
    high: float
    pressures_kPa: tuple[float, float]


def verdict_of(outlooks: Sequence[Outlook], gain: Gain) -> Verdict:
    """The verdict on the first reading, which shows all of them."""
    main = outlooks[0]
    named = main.outcome in ("named", "undetermined")
    return Verdict(
        verdict=main.outcome,
        misfits=tuple(misfits(main)),
        causes=tuple(_cause(w, main) for w in main.near) if named else (),
        excluded=tuple(exclusions(main, {w.name for w in main.near} if named else set())),
        gain=gain if main.outcome != "no_misfit" else None,
        next_test=_next_test(),
        model={"shares_from": "the numerical column of Table 2", "readings": [reading_record(o) for o in outlooks]},
        shows=(tuple(outlooks), gain),
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
    pressures = outlook.table.pressures_kPa
    for look, p in sorted(outlook.looks.items(), key=lambda item: item[1]):
        if p >= LEVEL or not isinstance(look, TableLook):
            continue
        low, high = _ratio_percent(outlook, look.sample, look.observable)
        sample = "" if look.sample == PATTERNS else look.sample
        column = "normal_load_N" if look.along_load else "sample"
        over = OverLoads(low, high, (float(pressures[0]), float(pressures[-1])))
        found.append(Misfit(look.observable, sample, column, (low + high) / 2, p, shows=over))
    once = {(m.sample, m.observable): m for m in reversed(found)}
    return [m for m in found if once[m.sample, m.observable] is m]


def _ratio_percent(outlook: Outlook, sample: str, observable: str) -> tuple[float, float]:
    """Measured less modelled T in percent of the model: the mean at either end of the loads, lowest first."""
    table = outlook.table
    picked = [k for k, s in enumerate(table.samples) if s == sample or (sample == PATTERNS and s != "F")]
    rows = REGIME_ROWS[observable]
    flat = table.values.reshape(-1, 4)[table.samples.index("F")]
    ratio = np.log(table.friction(table.values) / friction_at(table, flat))[np.ix_(picked, rows)]
    ends = 100.0 * np.expm1(ratio[..., [0, -1]].mean(axis=(0, 1)))
    return float(ends.min()), float(ends.max())


def _cause(w: Weighed, main: Outlook) -> Cause:
    gains = np.array([n.gain for n in main.near])
    share = float(np.exp(w.gain - gains.max()) / np.exp(gains - gains.max()).sum())
    return Cause(w.name, share, estimate_of(w))


def exclusions(main: Outlook, shown: set[str]) -> list[Excluded]:
    """Every mechanism that is not among the causes, and why, in the first reading."""
    best = main.weighed[0]
    found = []
    for name, m in MECHANISMS.items():
        weighed = next((w for w in main.weighed if w.name == name), None)
        if name in shown or (not shown and weighed is best):
            continue
        if m.in_table.missing:
            found.append(Excluded(name, "not printed"))
        elif m.in_table.barred:
            found.append(Excluded(name, "contradicted"))
        elif weighed is None:
            found.append(Excluded(name, "not varied"))
        elif m.amplitude.low == 0.0 and float(weighed.fit.parameters[0][0]) < 1e-3 * m.amplitude.start:
            found.append(Excluded(name, "wrong sign", shows=upper_limit(main.baseline, name)))
        else:
            found.append(Excluded(name, "explains less", best.gain - weighed.gain))
    return found


def _next_test() -> NextTest | None:
    """The bench test that a mechanism of the library proposes."""
    test = next((m.in_table.next_test for m in MECHANISMS.values() if m.in_table.next_test is not None), None)
    return NextTest("at the bench", test.separates, test.design, shows=test) if test is not None else None
