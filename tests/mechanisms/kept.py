"""What every mechanism does to forty-eight pulls and to single blocks, and its parameters: kept.

    cd tests; python -m mechanisms.kept

writes ``kept_laws.json`` anew. Do so where a change of a mechanism is meant, and say so in CHANGELOG.md.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from kept_numbers import scatter, write

from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Conditions, Mechanism, Values

from .test_contract import RECORDED, base, conditions, one_run

KEPT = Path(__file__).with_name("kept_laws.json")
PULLED = (((4.0, 2.5), 4.0 * 8e3 / 0.65), ((2.0, 1.5), 2.0 * 25e3), ((6.0, 4.0), 6.0 * 3e3 / 0.9))


def recorded() -> Conditions:
    """The pulls of the contract, their temperature and humidity without a random generator, with columns of a kind."""
    c = conditions()
    n = len(c.sample)
    columns = {
        "operator": np.where(np.arange(n) % 3 == 0, "ann", "bo"),
        "date": np.where(np.arange(n) % 24 < 13, "2026-03-04", "2026-03-05"),
        "batch": np.array(["a", "b", "c"] * (n // 3)),
        "oven_C": np.array(["70", "80", "95", "60"] * (n // 4)),
        "one": np.array(["same"] * n),
        "pull": np.array([f"n{k}" for k in range(n)]),
    }
    return replace(
        c, temperature_C=23.0 + scatter(1, n), humidity_pct=50.0 + 4.0 * scatter(2, n), columns=columns,
        clip_N=0.02 + 0.01 * np.abs(scatter(3, n)),
    )  # fmt: skip


def of(m: Mechanism) -> dict[str, Any]:
    """Parameters, choices, and the law at the start and far from it."""
    c, chosen = recorded(), m.choosing
    b = base(c)
    choices = m.choices(b, c)
    several = dict.fromkeys([*choices[:4], *choices[:: max(len(choices) // 6, 1)], choices[-1]])
    far = np.array([p.low + 0.8 * (p.high - p.low) for p in m.parameters])
    low = np.array([p.low + 0.1 * (p.high - p.low) for p in m.parameters])
    return {
        "parameters": [[p.name, p.unit, p.low, p.high, p.start, p.zero, p.amplitude, p.tries] for p in m.parameters],
        "is": [m.kind, m.sign, list(m.regimes), list(m.needs), m.quick_error],
        "measured": [m.measurement.uncertainty, m.measurement.hours] if m.measurement else [],
        "varied": [m.variation.column, list(m.variation.values)] if m.variation else [],
        "chosen": [chosen.column, chosen.held_out, chosen.all_or_nothing_sd, chosen.in_one_run(one_run())],
        "choices": [len(choices), list(several)],
        "called": [m.called(choice) for choice in several],
        "law": {choice: [change(m, v, c, choice) for v in (m.start(), far, low)] for choice in several},
        "on tests": [acts(m, c, choice, test) for choice in several for test in (0, 9, 20, 37)],
        "placement": [placed(m, v) for v in (m.start(), far, low)],
        "in a table": said(m),
    }  # fmt: skip


def change(m: Mechanism, values: Values, c: Conditions, choice: str) -> list[Any]:
    """Force of every fifth test over the baseline, static and sliding."""
    b = base(c)
    after, before = m.law(values, b, c, choice), b.forces(c.normal_load_N)
    return [(after.static_N / before.static_N)[::5], (after.sliding_N / before.sliding_N)[::5]]


def acts(m: Mechanism, c: Conditions, choice: str, test: int) -> list[Any]:
    here = m.choosing.on_test(m.start(), choice, c, test)
    return [] if here is None else list(here)


def placed(m: Mechanism, values: Values) -> list[Any]:
    p, place, one = m.placement, np.linspace(-0.5, 0.5, 7), one_run()
    rise = [] if m.rise is None else m.rise(values, np.array([4e3, 9e3]), one)
    return [
        [p.thresholds(values, *pulled) for pulled in PULLED] if p.thresholds else [],
        [p.load(values, *pulled) for pulled in PULLED] if p.load else [],
        [p.springs(values, one)] if p.springs else [],
        [p.floors(values, one)] if p.floors else [],
        [p.rims(values)] if p.rims else [],
        [p.along(values, ratio, place) for ratio in (1.0, 3.0, 9.0, 60.0)] if p.along else [],
        p.chain(values, RECORDED) if p.chain else {},
        [p.by_law, p.other_sample, p.own_friction, p.on_single_blocks],
        rise,
    ]


def said(m: Mechanism) -> list[str]:
    if m.in_table.finding is None:
        return []
    cases = (((0.0, 4.0), (0.0, 0.1)), ((3.5, 6.0), (0.05, 0.2)), ((-1.0, -0.5), (-0.1, 0.0)))
    return [m.in_table.finding(gains, sizes, lambda: 0.2, 6e4) for gains, sizes in cases]


if __name__ == "__main__":
    write(KEPT, {name: of(m) for name, m in MECHANISMS.items()})
