"""Events and features read from records of known answer, with noise as measured on public records of real rigs.

    python benchmarks/events.py --records 300 --first 20000 > events.jsonl
    python benchmarks/events.py --summary events.jsonl

One line of JSON per record, so that a run can be stopped. The reading was tuned on seeds below 10000.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from support.coulomb_slider import (
    Slider,
    noise_of_rigs,
    population,
    pull_from_rest,
    random_pull,
    random_rig,
    record,
    scores,
)

from tribo.records import Phase, Test, Trace
from tribo.traces import PullOptions, evaluate, features_of, slips_of

OF_EVENTS = {
    "stick_peak_N": ("peak_N", 1.0), "stick_trough_N": ("trough_N", 1.0), "drop_N": ("drop_N", 1.0),
    "period_s": ("recurrence_s", 1.0), "hold_s": ("hold_s", 1.0), "slip_um": ("slip_m", 1e6),
    "loading_stiffness_N_per_m": ("stiffness_N_per_m", 1.0), "slip_duration_s": ("duration_s", 1.0),
    "peak_velocity_mm_s": ("peak_velocity_m_s", 1e3), "creep_um": ("precursory_slip_m", 1e6),
}  # fmt: skip


def stick_slip(seed: int) -> dict[str, Any]:
    """Every slip of a Coulomb slider beside the truth, and the features of its record."""
    rig = random_rig(np.random.default_rng([seed, 2]), quick=True)
    time, force, truth = record(rig, seed)
    test = Test("T", "", "S", 1.0, "", speed_m_s=rig.speed_m_s)
    slides = (Phase("steady sliding", 0.0, float(time[-1])),)
    trace = Trace("slider", time, force)
    pull = evaluate(trace, PullOptions(test=test, phases=slides))
    f1, pairs = scores(np.array([s.fail_s for s in pull.slips]), truth["fail_s"])
    names = ("drop_N", "stiffness_N_per_m", "slip_m", "duration_s", "recurrence_s", "hold_s", "peak_velocity_m_s")
    ratios = {
        name: float(np.nanmedian([getattr(pull.slips[j], name) for _, j in pairs]) / np.nanmedian(truth[name]))
        for name in names
        if any(math.isfinite(getattr(pull.slips[j], name)) for _, j in pairs)
    }  # fmt: skip
    expected, found = population(rig, 10**6 + seed), features_of(trace, pull, rig.speed_m_s)
    true = {name: expected[own] * factor for name, (own, factor) in OF_EVENTS.items()} | {"drift_N_per_s": 0.0}
    return {"kind": "stick-slip", "f1": f1, "slips": int(truth["fail_s"].size), "ratios": ratios} | _beside(found, true)


def from_rest(seed: int) -> dict[str, Any]:
    rig = random_pull(np.random.default_rng([seed, 1]))
    time, force, true = pull_from_rest(rig, seed)
    trace = Trace("pull", time, force)
    pull = evaluate(trace, PullOptions(test=Test("T", "", "S", 1.0, "", speed_m_s=rig.speed_m_s)))
    found = features_of(trace, pull, rig.speed_m_s)
    return {"kind": "from rest", "extra": len(pull.slips) - 1 - rig.drops} | _beside(found, true)


def steady(seed: int) -> dict[str, Any]:
    """Slips that are found in correlated noise with impulses alone."""
    rng = np.random.default_rng([seed, 3])
    rig = Slider(
        noise=10.0 ** rng.uniform(-2.0, -1.4), correlation=rng.uniform(0.0, 0.97), impulses=rng.choice([0.0, 0.01])
    )
    time = np.arange(int(10.0 ** rng.uniform(2.5, 4.3))) / 100.0
    return {
        "kind": "steady",
        "slips": len(slips_of(time, 1.0 + noise_of_rigs(rig, 1.0, time.size, rng), speed_m_s=1e-3)),
    }


def _beside(found: Any, true: dict[str, float]) -> dict[str, Any]:
    both = {name: [found[name].value, found[name].low, found[name].high, true[name]] for name in true if name in found}
    return {"features": {name: [None if math.isnan(v) else v for v in four] for name, four in both.items()}}


def summary(rows: list[dict[str, Any]]) -> Iterator[str]:
    of = {kind: [r for r in rows if r["kind"] == kind] for kind in ("stick-slip", "from rest", "steady")}
    if slipping := of["stick-slip"]:
        f1 = np.array([r["f1"] for r in slipping])
        slips = np.array([r["slips"] for r in slipping])
        yield f"events: {len(f1)} records, {slips.sum()} slips, F1 {f1 @ slips / slips.sum():.4f}, worst {f1.min():.3f}"
        for name in sorted({name for r in slipping for name in r["ratios"]}):
            each = [r["ratios"][name] for r in slipping if name in r["ratios"]]
            yield f"  {name}: {len(each)} records, median over truth {np.median(each):.4f}"
    noisy = of["steady"]
    yield f"steady: {sum(r['slips'] > 0 for r in noisy)} of {len(noisy)} records with a slip"
    for name in dict.fromkeys(name for r in rows for name in r.get("features", {})):
        values = [r["features"][name] for r in rows if name in r.get("features", {})]
        if values[0][1] is None:
            yield f"{name}: right in {sum(v[0] == v[3] for v in values)} of {len(values)}"
            continue
        value, low, high, true = np.array(values, float).T
        held = float(np.mean((low <= true) & (true <= high)))
        away = f"median over truth {np.median(value / true):.4f}" if np.abs(true).min() > 0 else ""
        size = f"half the interval over truth {np.median((high - low) / 2 / np.abs(true)):.3f}" if away else ""
        yield f"{name}: {len(values)} records, 95 % intervals hold in {100 * held:.1f} %; {away}; {size}"


if __name__ == "__main__":
    options = argparse.ArgumentParser()
    options.add_argument("--records", type=int, default=300)
    options.add_argument("--first", type=int, default=20000)
    options.add_argument("--summary", type=Path)
    given = options.parse_args()
    if given.summary:
        for said in summary([json.loads(row) for row in given.summary.read_text().splitlines()]):
            print(said)
    else:
        for seed in range(given.first, given.first + given.records):
            for kind in (stick_slip, from_rest, steady):
                print(json.dumps({"seed": seed, **kind(seed)}), flush=True)
