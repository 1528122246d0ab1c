"""Traces whose readings are kept, and the readings: the numbers of a campaign change only where that is meant.

    cd tests; python -m traces.kept

writes ``kept_readings.json`` anew. Do so where a change of a reading is meant, and say so in CHANGELOG.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from kept_numbers import scatter, write

from tribo import read_pull
from tribo.errors import TraceError
from tribo.records import Pull, Test, Trace
from tribo.traces import RULES, oscillation_of, pieces_of, read_pulls
from tribo.zeroing import zero_choice

from .synthetic import Shape, with_samples

FROM_REST = Test("T", "", "", math.nan, "", zero=zero_choice("before contact"))
LEFT_OUT = {"test_id", "rule", "zero_rule", "oscillation", "phases", "slips", "recorded_load_N", "recorded_load_u_N"}
KEPT = Path(__file__).with_name("kept_readings.json")


def noisy(shape: Shape, seed: int, noise_N: float = 0.01) -> Trace:
    trace = shape.trace()
    return replace(trace, name=f"{seed}", force_N=trace.force_N + noise_N * scatter(seed, trace.time_s.size))


def pulls() -> Iterator[tuple[str, Trace]]:
    """Single pulls: shapes of peaks and falls, rates and scales, and what recorders and people do to a trace."""
    plain = Shape(offset_N=0.3)
    shapes = {
        "plain": plain,
        "5 Hz": Shape(rate_Hz=5, rise_s=3.0),
        "10 Hz": Shape(rate_Hz=10),
        "500 Hz": Shape(rate_Hz=500),
        "3 kHz": Shape(rate_Hz=3000, sliding_s=5),
        "no drop": Shape(sliding_N=2.0),
        "slow fall": Shape(fall_s=2.0, sliding_s=20),
        "sudden drop": Shape(fall_s=0.005, rate_Hz=100),
        "rounded": Shape(dome_s=0.5),
        "rounded at 200 Hz": Shape(dome_s=0.8, rate_Hz=200),
        "stick-slip": Shape(swing_N=0.3, sliding_s=30),
        "rise of 1000 samples": Shape(rise_s=20, sliding_s=30),
        "short zero": Shape(zero_s=0.3, rise_s=6),
        "short record": Shape(sliding_s=1.0),
        "steep": Shape(rise_s=0.1),
        "risen in four samples": Shape(rise_s=0.07),
        "risen in two samples": Shape(rise_s=0.03),
        "risen in one sample": Shape(rise_s=0.015, fall_s=0.5),
    }
    for seed, (name, shape) in enumerate(shapes.items()):
        yield name, noisy(shape, seed)
    yield "noise of 4 %", noisy(plain, 20, 0.08)
    yield "noise of 4 % at 400 Hz", noisy(Shape(rate_Hz=400), 21, 0.08)
    yield "without noise", plain.trace()
    yield from spoiled(noisy(plain, 30))


def spoiled(trace: Trace) -> Iterator[tuple[str, Trace]]:
    time, force = trace.time_s, trace.force_N
    start, end = time - 2.0, time - 3.5
    yield "millinewtons", replace(trace, force_N=1e-3 * force)
    yield "a clock that starts late", replace(trace, time_s=time + 1e4)
    yield "backed off at the end", replace(trace, force_N=force * np.clip((14.0 - time) / 0.5, 0.0, 1.0))
    yield "climbing", replace(trace, force_N=force + 0.2 * np.maximum(end - 0.5, 0.0))
    yield "a drifting zero", replace(trace, force_N=force + 0.02 * time)
    yield "a rounded toe", replace(trace, force_N=force + 0.3 * np.exp(-np.abs(start) / 0.3))
    yield "a touch before", replace(trace, force_N=force + 0.25 * np.exp(-(((time - 1.0) / 0.1) ** 2)))
    yield "a bend in the rise", replace(trace, force_N=force - 0.3 * np.clip(start - 0.8, 0.0, 0.7) * (end < 0))
    yield "a wandering force", replace(trace, force_N=force + 0.01 * np.cumsum(scatter(31, time.size)))
    yield "starts in the rise", cut(trace, time > 2.4)
    yield "few samples before contact", cut(trace, time > 1.87)
    yield "ends at the peak", cut(trace, time < 3.6)
    yield "ends before the peak", cut(trace, time < 3.0)
    yield "a gap at the peak", cut(trace, (time < 3.3) | (time > 3.55))
    yield "an impulse", with_samples(trace, {100: 9.0})
    yield "impulses of two and three samples", with_samples(trace, {170: 4.0, 171: 4.1, 172: 4.0, 400: -3.0, 401: -3.2})
    yield "impulses at the ends", with_samples(trace, {0: 30.0, time.size - 1: -30.0})
    yield "many impulses", with_samples(trace, {k: force[k] + 5.0 for k in range(200, 700, 20)})
    yield "clipped", replace(trace, force_N=np.minimum(force, 1.9))
    yield "stuck", with_samples(trace, {k: float(force[300]) for k in range(300, 345)})
    yield "of a coarse resolution", replace(trace, force_N=np.round(force / 0.05) * 0.05)
    yield "of the other sign", replace(trace, force_N=-force)
    yield "stamped twice", replace(trace, time_s=np.floor(time * 25) / 25)
    yield "unevenly sampled", cut(trace, scatter(32, time.size) < 0.6)
    yield "pulled backwards", replace(trace, displacement_m=-np.asarray(trace.displacement_m))
    yield "without travel", replace(trace, displacement_m=None)
    yield "a missing number", with_samples(trace, {50: math.nan})
    yield "back in time", replace(trace, time_s=np.where(np.arange(time.size) > 300, time - 1.0, time))


def cut(trace: Trace, kept: np.ndarray) -> Trace:
    travel = None if trace.displacement_m is None else trace.displacement_m[kept]
    return replace(trace, time_s=trace.time_s[kept], force_N=trace.force_N[kept], displacement_m=travel)


def records() -> Iterator[tuple[str, Trace]]:
    """Records of several pulls: strokes both ways, steps of load and of speed."""
    one = np.arange(400) / 100.0
    load = np.minimum(-1.0 + 4.4 * one, 1.2)
    stroke = np.where(one < 0.5, load, 1.0 + 0.2 * np.exp(-(one - 0.5) / 0.1))
    force = np.concatenate([(-1) ** k * stroke for k in range(5)]) + 0.2
    time = np.arange(force.size) / 100.0
    yield "strokes", Trace("rig", time, force + 0.01 * scatter(40, time.size))
    long = np.arange(4000) / 100.0
    steps = np.select([long < 10, long < 20, long < 21], [1.0, 2.0, 2.0 + 2.0 * (long - 20.0)], 4.0)
    shaken = steps + 0.005 * scatter(41, long.size)
    yield "loads", Trace("bench", long, 0.5 * steps + 0.01 * scatter(42, 4000), columns={"normal_force_N": shaken})
    speed = np.select([long < 5, long < 22], [0.0, 1e-3], 3e-3)
    rise = np.select([long < 5, long < 6.5, long < 22], [0.0, 0.8 * (long - 5.0), 0.9], 1.1)
    yield "speeds", Trace("pin", long, rise + 0.01 * scatter(43, 4000), columns={"speed_m_s": speed})


def cycles() -> Iterator[tuple[str, Trace]]:
    for rate in (100.0, 2000.0):
        time = np.arange(int(12 * rate)) / rate
        phase = (time / 0.8) % 1.0
        saw = np.where(phase < 0.9, 1.0 + 0.5 * phase / 0.9, 1.5 - 0.5 * (phase - 0.9) / 0.1)
        yield f"saw at {rate:g} Hz", Trace("saw", time, saw + 0.01 * scatter(50, time.size))


def readings() -> dict[str, Any]:
    """Every reading by name: the numbers, flags and problems of a pull, or why it cannot be read."""
    return {name: read_by_every_rule(trace) for name, trace in pulls()} | others()


def read_by_every_rule(trace: Trace) -> dict[str, Any]:
    return {rule: read(trace, rule) for rule in RULES}


def others() -> dict[str, Any]:
    """Choices by hand, records of several pulls and cycles of stick-slip."""
    found: dict[str, Any] = {}
    by_hand = noisy(Shape(offset_N=0.3), 60)
    found["a peak chosen by hand"] = numbers(read_pull(by_hand, peak_s=3.4))
    found["a window chosen by hand"] = numbers(read_pull(by_hand, window_s=(5.0, 9.0)))
    found["a known zero"] = numbers(read_pull(by_hand, zero=(0.25, 0.02)))
    for name, record in records():
        pieces = pieces_of(record).values()
        spans = [[t.time_s[0], t.time_s[-1], t.first_row] for t, _ in pieces]
        found[f"{name}, pieces"] = {"directions": [-1 if o.turned else 1 for _, o in pieces], "spans": spans}
        for k, pull in enumerate(read_pulls(record), start=1):
            found[f"{name}, pull {k}"] = numbers(pull)
    for name, trace in cycles():
        found[name] = asdict(oscillation_of(trace.time_s, trace.force_N))
    return found


def read(trace: Trace, rule: str) -> Any:
    try:
        return numbers(read_pull(trace, rule=rule, test=FROM_REST))
    except TraceError as fault:
        return [[p.kind, p.row, str(p.found)] for p in fault.problems]


def numbers(pull: Pull) -> Mapping[str, Any]:
    record = asdict(pull)
    said = [[p["kind"], p["row"]] for p in record.pop("problems")]
    return {**{name: value for name, value in record.items() if name not in LEFT_OUT}, "problems": said}


if __name__ == "__main__":
    write(KEPT, readings())
