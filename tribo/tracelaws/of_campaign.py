"""Which records of a campaign hold a friction law beyond mu and tau0, and the laws fitted to them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby, pairwise

import numpy as np

from tribo.errors import TriboError
from tribo.records import Ingested, Phase, Pull, Test, Trace, TraceLaw
from tribo.slider.motion import Drive, speed_steps
from tribo.tracelaws import slip_fits, step_fits
from tribo.traces.phases import phases_of

CHOICES = ("auto", *slip_fits.LAWS, *step_fits.LAWS)
_STEADY = "steady sliding"
_SMALLEST_STEP = math.log(1.3)  # change of the logarithm of the speed from which on it is a step
_CLEAR = 3.0  # log likelihood by which one of two laws of equal size must be better: a ratio of 20 to 1


def trace_laws_of(ingested: Ingested, law: str = "auto") -> tuple[TraceLaw, ...]:
    """Laws fitted to the records of a campaign that show stick-slip or steps of speed, in the order of its tests.

    Parameters
    ----------
    ingested
        The campaign with its traces.
    law
        "auto", or the name of one law. Under "auto" the ageing law is chosen over Coulomb's where it predicts slips
        left out better by twice the standard error, and the ageing law of Dieterich or the slip law of Ruina where its
        likelihood is 20 times that of the other; laws that are tied are all given.
    """
    tests = {test.test_id: test for test in ingested.campaign.tests}
    found: list[TraceLaw] = []
    for name, pieces in groupby(ingested.traces.items(), key=lambda item: _record_of(item[0])):
        traces = list(pieces)
        test, pull = tests.get(traces[0][0]), ingested.pulls.get(traces[0][0])
        if test is None or pull is None or not test.normal_load_N > 0:
            continue
        fitted = [
            *_of_slips(traces, ingested, tests, law),
            *_of_steps(_joined([trace for _, trace in traces]), pull, test, ingested, law),
        ]
        found += [replace(one, test_id=one.test_id or name) for one in fitted]
    return tuple(found)


def _record_of(test_id: str) -> str:
    """The record that a test was cut from: levels of one record are named ID#1/1, ID#1/2 and so on."""
    head, _, level = test_id.rpartition("/")
    return head if "#" in head and level.isdigit() else test_id


def _joined(traces: Sequence[Trace]) -> Trace:
    """The pieces of a record as one trace, in order of time."""
    if len(traces) == 1:
        return traces[0]
    order = sorted(traces, key=lambda trace: float(trace.time_s[0]))
    time = np.concatenate([trace.time_s for trace in order])
    keep = np.concatenate([[True], np.diff(time) > 0])
    place = [trace.displacement_m for trace in order if trace.displacement_m is not None]
    return replace(
        order[0], time_s=time[keep], force_N=np.concatenate([trace.force_N for trace in order])[keep],
        displacement_m=np.concatenate(place)[keep] if len(place) == len(order) else None, columns={},
    )  # fmt: skip


def _of_slips(
    traces: Iterable[tuple[str, Trace]], ingested: Ingested, tests: dict[str, Test], law: str
) -> Iterable[TraceLaw]:
    """Coulomb friction or its growth at rest, of every piece with stick-slip."""
    for test_id, trace in traces:
        pull, test = ingested.pulls.get(test_id), tests[test_id]
        speed = test.speed_m_s or ingested.campaign.pull_speed_m_s
        shows = pull is not None and pull.oscillation is not None and pull.oscillation.regime == "stick-slip"
        if not shows or pull is None or speed is None or not speed > 0 or law not in ("auto", *slip_fits.LAWS):
            continue
        start = pull.window_s[0]
        inside = trace.time_s >= start
        record = trace.time_s[inside], np.abs(trace.force_N[inside] - pull.zero_N)
        wanted = slip_fits.LAWS if law == "auto" else (law,)
        made = [slip_fits.fit_slips(*record, name, test.normal_load_N, speed) for name in wanted]
        fitted = [replace(one, test_id=test_id) for one in made if one is not None]
        yield from chosen_slip_laws(fitted)


def chosen_slip_laws(fitted: Sequence[TraceLaw]) -> list[TraceLaw]:
    """Those that no other law beats on slips left out, by twice the standard error of the difference."""
    return [law for law in fitted if not any(slip_fits.clearly_better(other, law) for other in fitted)]


def chosen_step_laws(fitted: Sequence[TraceLaw]) -> list[TraceLaw]:
    """Those whose likelihood is not 20 times below that of the best."""
    best = max(one.log_likelihood for one in fitted)
    return [one for one in fitted if one.log_likelihood > best - _CLEAR]


def _of_steps(trace: Trace, pull: Pull, test: Test, ingested: Ingested, law: str) -> Iterable[TraceLaw]:
    """Rate and state of a record with steps of speed."""
    if law not in ("auto", *step_fits.LAWS):
        return
    try:
        phases = phases_of(trace, ingested.campaign.contact or "")
    except TriboError:
        return
    steps = _drive_of(trace, phases)
    if steps is None:
        return
    start, end, drive = steps
    inside = (trace.time_s >= start) & (trace.time_s <= end)
    friction = np.abs(trace.force_N[inside] - pull.zero_N) / test.normal_load_N
    known = test.stiffness_N_per_m / test.normal_load_N if test.stiffness_N_per_m else math.nan
    wanted = step_fits.LAWS if law == "auto" else (law,)
    fitted = step_fits.fit_laws(trace.time_s[inside], friction, drive, wanted, known)
    yield from chosen_step_laws(fitted)


def _drive_of(trace: Trace, phases: Sequence[Phase]) -> tuple[float, float, Drive] | None:
    """From when to when a record slides through steps of speed, and its drive from then on; None without a step.

    A step is where the lines of displacement of both stretches meet, or the end of the first stretch.
    """
    steady = [p for p in phases if p.name == _STEADY and p.speed_m_s > 0]
    changes = [(a, b) for a, b in pairwise(steady) if abs(math.log(b.speed_m_s / a.speed_m_s)) > _SMALLEST_STEP]
    if not changes:
        return None
    chosen = [changes[0][0], *(b for a, b in changes)]
    start, end = chosen[0].start_s, chosen[-1].end_s
    knots, speeds = [0.0], [_line(trace, chosen[0])[0]]
    for a, b in pairwise(chosen):
        (v, x), (w, y) = _line(trace, a), _line(trace, b)
        meet = (x - y) / (w - v) if trace.displacement_m is not None and w != v else a.end_s
        knots.append(float(np.clip(meet, a.start_s, b.end_s)) - start)
        speeds.append(w)
    return start, end, speed_steps(knots, speeds)


def _line(trace: Trace, phase: Phase) -> tuple[float, float]:
    """Speed of a stretch and where its line of displacement meets time zero; 0 where no displacement was recorded."""
    inside = (trace.time_s >= phase.start_s) & (trace.time_s <= phase.end_s)
    if trace.displacement_m is None or inside.sum() < 3:
        return phase.speed_m_s, 0.0
    slope, at_zero = np.polyfit(trace.time_s[inside], trace.displacement_m[inside], 1)
    sign = math.copysign(1.0, slope)
    return float(abs(slope)), float(sign * at_zero)


def rows_of(laws: Sequence[TraceLaw]) -> list[dict[str, object]]:
    """The rows of tracelaws.csv."""
    return [
        {"test_id": law.test_id, "law": law.law, "parameter": p.name, "value": p.value, "low": p.low, "high": p.high,
         "unit": p.unit, "told": "yes" if p.told else "cannot be told"}
        for law in laws for p in law.parameters
    ]  # fmt: skip

