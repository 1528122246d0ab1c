"""What is read from programmes of the virtual tribometer, beside what they were."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import tribo
from tribo.errors import CampaignError, TriboError
from tribo.readers import read_export
from tribo.records import Ingested, Phase
from tribo.traces import phases_of

from .kinds import KINDS
from .rig import Record

CLASS = {
    "rise": "slide", "slip": "slide", "running-in": "slide", "steady sliding": "slide", "reversal": "turn",
    "step of speed": "step", "step of load": "step", "end of the drive": "end",
}  # fmt: skip
BETWEEN = ("step", "turn")  # phases that may be as short as no time
SAMPLES = 3
SHARE = 0.01
NEAR_S = 1.0  # within which a static force is that of a start of sliding
TURN = 0.06  # share of a stroke that a reversal which holds the true one may take: a crank turns slowly


@dataclass
class Seen:
    """What was counted of one record."""

    kind: str
    seed: int
    boundaries: int = 0
    missed: list[str] = field(default_factory=list)
    extra: list[str] = field(default_factory=list)  # boundaries that were found where none is
    invented: int = 0  # static forces where no rise from rest is
    over_rest: int = 0  # sliding windows that hold a rest
    mixed: int = 0  # sliding windows over two levels
    tests: int = 0
    refused: str = ""
    state: str = ""
    readings: list[tuple[str, float, float, bool]] = field(default_factory=list)  # quantity, found, true, held


def written(records: Sequence[Record], folder: Path) -> None:
    """A campaign of records: one export each, as a user has them."""
    (folder / "raw").mkdir(parents=True)
    lines = ["test_id,file,sample,normal_load_N"]
    for k, record in enumerate(records):
        names = list(record.channels)
        table = np.column_stack([record.channels[name] for name in names])
        np.savetxt(folder / "raw" / f"T{k}.csv", table, "%.7g", ",", header=",".join(names), comments="")
        load = "" if "normal force (N)" in names else f"{float(record.load.max()):.6g}"
        lines.append(f"T{k},raw/T{k}.csv{'#1/*' if record.kind.startswith('strokes') else ''},F,{load}")
    (folder / "tests.csv").write_text("\n".join(lines) + "\n")
    (folder / "campaign.toml").write_text('[campaign]\ntitle = "programmes"\n[patterns.F]\ncavity = "none"\n')


def sat(kinds: Iterable[str], seeds: Iterable[int], folder: Path) -> list[Seen]:
    """The exam on some kinds and seeds."""
    asked = [(kind, seed) for kind in kinds for seed in seeds]
    records = [KINDS[kind](np.random.default_rng([seed, 7])) for kind, seed in asked]
    written(records, folder)
    ingested: Ingested | None = None
    why = ""
    try:
        ingested = tribo.ingest(tribo.load_campaign(folder))
    except CampaignError as fault:
        why = str(fault)
    found = []
    for k, ((kind, seed), record) in enumerate(zip(asked, records, strict=True)):
        seen = Seen(kind, seed, refused=why)
        phases: tuple[Phase, ...] = ()
        try:
            phases = phases_of(read_export(folder / "raw" / f"T{k}.csv"))
        except TriboError as fault:
            seen.refused = str(fault)
        boundaries(seen, record, phases)
        if ingested is not None:
            _windows(seen, record, ingested, f"T{k}")
            _readings(seen, record, ingested, f"T{k}")
        found.append(seen)
    return found


def _of_record(test_id: str, record_id: str) -> bool:
    return test_id.partition("#")[0] == record_id


def boundaries(seen: Seen, record: Record, phases: Sequence[Phase]) -> None:
    """Count the boundaries of a record that were missed, and those that were found where none is."""
    merged: list[tuple[str, float, float]] = []
    for phase in phases:
        name = CLASS.get(phase.name, phase.name)
        if merged and merged[-1][0] == name != "stroke":
            name, start, _ = merged.pop()
            merged.append((name, start, phase.end_s))
        else:
            merged.append((name, phase.start_s, phase.end_s))
    found = [(a[0], b[0], b[1]) for a, b in pairwise(merged)]
    near = [False] * len(found)
    for one, other in pairwise(record.parts):
        at, longest = other[1], max(one[2] - one[1], other[2] - other[1])
        within = max(SHARE * longest, SAMPLES / record.rate_Hz) + 1e-9
        hits = [
            abs(t - at) <= within and a in (one[0], *BETWEEN) and b in (other[0], *BETWEEN) for a, b, t in found
        ]
        turns = [(b, e) for name, b, e in merged if name == "turn" and b <= at <= e and e - b <= TURN * longest]
        hits = [hit or any(t in turn for turn in turns) for hit, (_, _, t) in zip(hits, found, strict=True)]
        near = [old or new for old, new in zip(near, hits, strict=True)]
        if record.told:
            seen.boundaries += 1
            if not any(hits):
                others = ", ".join(f"{a}|{b} {t - at:+.2f}" for a, b, t in found if abs(t - at) < longest / 2)
                seen.missed.append(f"{one[0]}|{other[0]} at {at:.1f} (within {within:.2f}): {others or 'none near'}")
    seen.extra = [
        f"{a}|{b} at {t:.1f}"
        for n, (a, b, t) in zip(near, found, strict=True)
        if not n and a not in BETWEEN and (b not in BETWEEN or a == "slide")
    ]


def _windows(seen: Seen, record: Record, ingested: Ingested, record_id: str) -> None:
    slides = [(start, end) for what, start, end in record.parts if what in ("slide", "stroke")]
    first_end = slides[0][1]
    for test_id, pull in ingested.pulls.items():
        if not _of_record(test_id, record_id):
            continue
        seen.tests += 1
        start, end = pull.window_s
        if math.isfinite(pull.static_N) and not record.kind.startswith("strokes"):
            seen.invented += not record.from_rest or pull.peak_s > first_end
        starts = [start_s for start_s, _ in record.statics]
        seen.invented += sum(all(abs(r.peak_s - at) > NEAR_S for at in starts) for r in pull.restarts)
        if not math.isfinite(start):
            continue
        inside = (record.time_s >= start) & (record.time_s <= end)
        seen.over_rest += int((inside & ~record.moves).sum() > max(SAMPLES, SHARE * inside.sum()))
        held = [min(end, b) - max(start, a) for a, b in slides]
        edge = max((SAMPLES + 1) / record.rate_Hz, SHARE * (end - start))
        seen.mixed += record.told and sum(h > edge for h in held) > 1
    aside = [s for s in ingested.set_aside if _of_record(s.test_id, record_id)]
    if aside and not seen.tests:
        seen.refused = aside[0].reason


def _readings(seen: Seen, record: Record, ingested: Ingested, record_id: str) -> None:
    time, clean = record.time_s, record.clean_N
    for static, found_s, found_N, u_N in _statics(ingested, record_id):
        at_s, true = min(record.statics, key=lambda start: abs(start[0] - found_s), default=(math.nan, math.nan))
        if abs(at_s - found_s) < NEAR_S:
            seen.readings.append((static, found_N, true, abs(found_N - true) <= 1.96 * u_N))
    for test_id, pull in ingested.pulls.items():
        if _of_record(test_id, record_id) and math.isfinite(pull.window_s[0]) and "L" not in record.kind:
            inside = (time >= pull.window_s[0]) & (time <= pull.window_s[1])
            true = abs(float(clean[inside].mean()))
            seen.readings.append(
                ("sliding force of a test", pull.sliding_N, true, abs(pull.sliding_N - true) <= 1.96 * pull.sliding_u_N)
            )
    for r in ingested.readings:
        if not _of_record(r.test_id, record_id):
            continue
        inside = (time >= r.start_s) & (time <= r.end_s)
        true: dict[str, float] = {}
        if r.name == "plateau":
            if record.from_rest or not record.channels.get("offset"):
                true["force_N"] = abs(float(clean[inside].mean()))
        elif r.name == "cycle":
            strength = float(np.abs(clean[inside & record.slides]).mean())
            steps = np.abs(np.diff(np.cumsum(record.speed)[inside])) / record.rate_Hz
            true = {"force_N": strength, "asymmetry_N": record.truth.get("offset_N", math.nan),
                    "energy_J": float(np.abs(clean[inside][1:]) @ steps)}  # fmt: skip
        elif r.name == "running-in":
            seen.state = r.state
            if "run_in_m" in record.truth and "runs in" in record.kind:
                true = {"run_in_m": record.truth["run_in_m"] * math.log(10.0), "force_N": record.truth["sliding_N"]}
        elif r.name.startswith("step of speed"):
            true = _step_truth(record, (r.start_s + r.end_s) / 2.0)
        elif r.name == "healing":
            true["healing_N_per_decade"] = record.truth.get("healing_N", math.nan)
        for quantity, value in true.items():
            if quantity in r.values and math.isfinite(value):
                found, low, high = r.values[quantity]
                seen.readings.append((f"{r.name}: {quantity}", found, value, bool(low <= value <= high)))


def _statics(ingested: Ingested, record_id: str) -> Iterator[tuple[str, float, float, float]]:
    """Kind, time, force and standard uncertainty of every static force that was read of a record, strokes left out."""
    for test_id, pull in ingested.pulls.items():
        if _of_record(test_id, record_id) and not {"forward", "backward"} & set(pull.flags):
            if math.isfinite(pull.static_N):
                yield "static force", pull.peak_s, pull.static_N, pull.static_u_N
            for restart in pull.restarts:
                yield "static force after a hold", restart.peak_s, restart.static_N, restart.static_u_N


def _step_truth(record: Record, near_s: float) -> dict[str, float]:
    """Change to the new steady state, and at once, of the step nearest to a time; none where no true step is near."""
    slides = [part for part in record.parts if part[0] == "slide"]
    pairs = [(a, b) for a, b in pairwise(slides) if abs(b[1] - near_s) < 0.1 * (b[2] - b[1])]
    if not pairs:
        return {}
    one, other = pairs[0]

    def late(part: tuple[str, float, float]) -> float:
        start, end = part[1] + 0.7 * (part[2] - part[1]), part[2]
        return float(record.clean_N[(record.time_s >= start) & (record.time_s < end)].mean())

    after = record.clean_N[(record.time_s >= other[1]) & (record.time_s < other[2])]
    old, new = late(one), late(other)
    found = {"total_change_N": new - old}
    top, bottom = float(after.max()), float(after.min())
    beyond = max(top - max(old, new), min(old, new) - bottom)
    extreme = top if top - max(old, new) == beyond else bottom
    lasts = int((np.abs(after - new) > 0.5 * abs(extreme - new)).sum())
    if beyond > 0.01 * abs(old) and lasts > SAMPLES:  # else it is over between two samples
        found["direct_change_N"] = extreme - old
    return found


def summary(seen: Iterable[Seen]) -> dict[str, Any]:
    """Counts of all, by kind, and of every quantity: number, median ratio, share of intervals that hold."""
    by_kind: dict[str, list[Seen]] = defaultdict(list)
    values: dict[str, list[tuple[float, float, bool]]] = defaultdict(list)
    for one in seen:
        by_kind[one.kind].append(one)
        for quantity, found, true, held in one.readings:
            values[quantity].append((found, true, held))
    return {
        "kinds": {
            kind: {
                "records": len(all_), "boundaries": sum(s.boundaries for s in all_),
                "missed": sum(len(s.missed) for s in all_), "extra": sum(len(s.extra) for s in all_),
                "invented": sum(s.invented for s in all_), "over_rest": sum(s.over_rest for s in all_),
                "mixed": sum(s.mixed for s in all_), "refused": sum(bool(s.refused) for s in all_),
                "steady": sum(s.state == "steady" for s in all_),
                "drifts": sum(s.state == "still drifts" for s in all_),
            }
            for kind, all_ in by_kind.items()
        },
        "quantities": {
            quantity: {
                "number": len(rows), "median": float(np.median([f / t for f, t, _ in rows if t])),
                "held": float(np.mean([h for _, _, h in rows])),
            }
            for quantity, rows in values.items()
        },
    }  # fmt: skip
