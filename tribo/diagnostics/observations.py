"""From an ingested campaign to the arrays that the diagnosis works on, with its sessions and its drift.

Sessions differ (setting up, room, cleaning), the whole series drifts (a walk along it), and each specimen drifts along
its own pulls. These columns are random effects of :mod:`tribo.diagnostics.model`, with sizes of their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.gaps import enough_recorded, with_gaps_filled
from tribo.diagnostics.verdict import TooLittle
from tribo.display import displayed
from tribo.errors import FitError, Problem
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.conditions import levels_of, names_in, numbers_in
from tribo.mechanisms.record import Conditions, Marks, StringArray
from tribo.records import Campaign, FloatArray, Ingested, Pattern, Pull, SetAside, Test, Trace
from tribo.user_text import is_recorded

STATIC, SLIDING = 0, 1
FEWEST_TESTS, FEWEST_LOADS, FEWEST_SAMPLES = 12, 2, 2
WITHOUT = "without"  # column of tests.csv: the mechanisms that were removed for a test
NO_FLAT = "flat"  # stands for the flat law where no flat sample was measured or chosen


@displayed()
@dataclass(frozen=True)
class Observations:
    """Every usable test: ln T, shape (n, 2) with static first, and what else its trace showed, shape (n,).

    ``reading`` is the relative standard uncertainty of each force within its trace, (n, 2).
    ``zero_slope_N_per_s`` is the slope of the force before contact. ``measured`` holds amplitudes of mechanisms that
    were measured directly, with their standard uncertainties.
    """

    test_ids: StringArray
    conditions: Conditions
    patterns: Mapping[str, Pattern]
    log_force: FloatArray
    reading: FloatArray
    zero_N: FloatArray
    zero_slope_N_per_s: FloatArray
    rise_N_per_m: FloatArray
    stick_slip_N: FloatArray
    noise_N: FloatArray
    clock_h: FloatArray
    flat: str
    set_aside: tuple[SetAside, ...] = ()
    measured: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    marks: Marks = field(default_factory=dict)

    @property
    def n(self) -> int:
        return len(self.test_ids)

    @property
    def samples(self) -> list[str]:
        """Their names, the flat sample first."""
        return sorted(set(self.conditions.sample.tolist()), key=lambda sample: (sample != self.flat, sample))

    def take(self, keep: np.ndarray) -> Observations:
        """The tests picked by a mask or by indices, in that order."""
        from dataclasses import fields, replace

        def cut(value: object) -> object:
            return value[keep] if isinstance(value, np.ndarray) and value.shape[:1] == (self.n,) else value

        def cut_record(record: object) -> dict[str, object]:
            return {f.name: cut(getattr(record, f.name)) for f in fields(record)}  # type: ignore[arg-type]

        columns = {name: column[keep] for name, column in self.conditions.columns.items()}
        gaps = {name: replace(gap, **cut_record(gap)) for name, gap in self.conditions.gaps.items()}  # type: ignore[arg-type]
        told_names = {name: told[keep] for name, told in self.conditions.told_names.items()}
        own = {**cut_record(self.conditions), "columns": columns, "gaps": gaps, "told_names": told_names}
        conditions = replace(self.conditions, **own)  # type: ignore[arg-type]
        marks = {name: mark[keep] for name, mark in self.marks.items()}
        return replace(self, **{**cut_record(self), "conditions": conditions, "marks": marks})  # type: ignore[arg-type]


def observe(ingested: Ingested) -> Observations:
    """The observations of a campaign; tests without a positive static and sliding force are left out."""
    campaign = ingested.campaign
    pairs = [(t, ingested.pulls[t.test_id]) for t in ingested.used_tests]
    good = [(t, p) for t, p in pairs if p.static_N > 0 and p.sliding_N > 0]
    left_out = tuple(
        SetAside(t.test_id, "no positive friction force was read off its trace")
        for t, p in pairs
        if not (p.static_N > 0 and p.sliding_N > 0)
    )
    tests, pulls = [t for t, _ in good], [p for _, p in good]
    traces = [ingested.traces.get(t.test_id) for t in tests]
    force = np.array([[p.static_N, p.sliding_N] for p in pulls]).reshape(-1, 2)
    error = np.array([[p.static_u_N, p.sliding_u_N] for p in pulls]).reshape(-1, 2)
    conditions = conditions_of(campaign, tests, pulls, traces)
    return Observations(
        test_ids=np.array([t.test_id for t in tests], str),
        conditions=conditions,
        patterns=dict(campaign.samples),
        log_force=np.log(force),
        reading=np.nan_to_num(error / force, nan=0.0, posinf=0.0),
        zero_N=np.array([p.zero_N for p in pulls]),
        zero_slope_N_per_s=np.array([_slope_before(t, p) for t, p in zip(traces, pulls, strict=True)]),
        rise_N_per_m=np.array([p.rise_stiffness_N_per_m for p in pulls]),
        stick_slip_N=np.array([p.stick_slip_amplitude_N for p in pulls]),
        noise_N=np.array([p.noise_N for p in pulls]),
        clock_h=conditions.clock_h,
        flat=campaign.flat_sample or NO_FLAT,
        set_aside=(*ingested.set_aside, *left_out),
        measured=dict(campaign.measured),
        marks=_marks(ingested, tests, pulls, conditions),
    )


def _marks(ingested: Ingested, tests: list[Test], pulls: list[Pull], conditions: Conditions) -> dict[str, FloatArray]:
    """What the traces show besides the forces, as far as one of them does."""
    shown = [ingested.features.get(test.test_id, {}) for test in tests]
    marks = {
        name: _numbers([found[name].value if name in found else None for found in shown])
        for name in sorted({name for found in shown for name in found})
    }
    marks |= {"clip_N": conditions.clip_N, "static_N": _numbers([pull.static_N for pull in pulls])}
    stated = _numbers([test.stiffness_N_per_m for test in tests])
    return marks | ({"stated_stiffness_N_per_m": stated} if np.isfinite(stated).any() else {})


def enough(o: Observations) -> Observations:
    """The same observations. Raises FitError where they are :func:`too_little`, or where a name is no mechanism."""
    if (lack := too_little(o)) is not None:
        raise FitError(
            Problem(
                "too_few_tests", "too few usable tests to diagnose anything",
                found=f"{lack.tests} tests at {lack.loads} loads of {lack.samples} samples",
                allowed=f"at least {FEWEST_TESTS} tests at two loads of two samples",
            )
        )  # fmt: skip
    return o


def too_little(o: Observations) -> TooLittle | None:
    """Why the model cannot be tested on these tests; None where it can. Raises FitError where a name is no mechanism.
    """
    stated = {name.partition(":")[0] for name in o.measured} | {n for c in o.conditions.without for n in names_in(c)}
    allowed = ", ".join(MECHANISMS)
    unknown = [
        Problem("unknown_mechanism", f"[measured] or column {WITHOUT}: not a mechanism", found=name, allowed=allowed)
        for name in sorted(stated - set(MECHANISMS))
    ]
    if unknown:
        raise FitError(unknown)
    tests, loads, samples = o.n, len(np.unique(o.conditions.normal_load_N)), len(np.unique(o.conditions.sample))
    if tests >= FEWEST_TESTS and loads >= FEWEST_LOADS and samples >= FEWEST_SAMPLES:
        return None
    return TooLittle(tests, loads, samples, FEWEST_TESTS, FEWEST_LOADS, FEWEST_SAMPLES)


def conditions_of(
    campaign: Campaign,
    tests: list[Test],
    pulls: list[Pull] | None = None,
    traces: list[Trace | None] | None = None,
) -> Conditions:
    """What tests.csv records about ``tests``, as arrays, gaps of columns of numbers filled; without traces the peak
    loses nothing by sampling."""
    patterns = [campaign.samples[t.sample] for t in tests]
    speed = _numbers([t.speed_m_s or campaign.pull_speed_m_s for t in tests])
    clip = np.zeros(len(tests))
    if pulls is not None and traces is not None:
        clip = np.array([_clip(p, t) for p, t in zip(pulls, traces, strict=True)])
    started = _numbers([_seconds(t.started_at) for t in tests])
    recorded = Conditions(
        normal_load_N=_numbers([t.normal_load_N for t in tests]),
        nominal_area_m2=campaign.area_m2,
        area_fraction=np.array([p.area_fraction for p in patterns]),
        rim_per_m=np.array([p.rim_per_m for p in patterns]),
        cavity_width_m=np.array([min(p.size_m) if p.size_m else 0.0 for p in patterns]),
        elongation=np.array([_elongation(t, p) for t, p in zip(tests, patterns, strict=True)]),
        sample=np.array([t.sample for t in tests], str),
        specimen=np.array([t.specimen for t in tests], str),
        speed_m_s=speed,
        hold_s=_numbers([t.hold_s for t in tests]),
        specimen_run=_specimen_runs(tests),
        run_order=_numbers([t.run_order for t in tests]),
        elapsed_s=started - np.nanmin(started) if np.isfinite(started).any() else started,
        temperature_C=_numbers([t.temperature_C for t in tests]),
        humidity_pct=_numbers([t.humidity_pct for t in tests]),
        clip_N=clip,
        columns=_further_columns(tests),
        pattern=np.array([p.name for p in patterns], str),
        without=_without(tests),
        mass_kg=_numbers([t.mass_kg for t in tests] if any(t.mass_kg for t in tests) else []),
        clock_h=np.array([_clock_h(t.started_at) for t in tests]),
    )
    return with_gaps_filled(recorded, np.array([t.started_at[:10] for t in tests], str))


def _without(tests: list[Test]) -> StringArray:
    """What was removed for each test, nothing where no test names any."""
    cells = [str(t.covariates.get(WITHOUT, "")) for t in tests]
    return np.array(cells if any(cells) else [], str)


def _elongation(test: Test, pattern: Pattern) -> float:
    if pattern.size_m is None or pattern.size_m[0] == pattern.size_m[1]:
        return 0.0
    direction = test.direction or test.sample.removeprefix(pattern.name)
    along_x = {"x": 1.0, "y": -1.0}.get(direction.lower(), 0.0)
    return float(along_x * np.log(pattern.size_m[0] / pattern.size_m[1]))


def _specimen_runs(tests: list[Test]) -> FloatArray:
    """specimen_run as recorded, else counted along run_order or, where that has gaps, along the time; NaN where none
    is known of every test."""
    if all(t.specimen_run is not None for t in tests):
        return _numbers([t.specimen_run for t in tests])
    order, when = (_numbers(each) for each in ([t.run_order for t in tests], [_moment(t.started_at) for t in tests]))
    along = next((values for values in (order, when) if np.isfinite(values).all()), None)
    if along is None:
        return np.full(len(tests), np.nan)
    runs, seen = np.zeros(len(tests)), dict[str, int]()
    for i in map(int, np.argsort(along, kind="stable")):
        seen[tests[i].specimen] = seen.get(tests[i].specimen, 0) + 1
        runs[i] = seen[tests[i].specimen]
    return runs


def _further_columns(tests: list[Test]) -> dict[str, StringArray]:
    """Recorded columns that take part only as covariates; a cell without a value is empty.

    Those with values enough, and with more than one: names, numbers, and every date.
    """
    names = sorted({name for t in tests for name in t.covariates} - {WITHOUT})
    columns = {name: np.array([str(t.covariates.get(name, "")) for t in tests], str) for name in names}
    columns["operator"] = np.array([t.operator for t in tests], str)
    columns["date"] = np.array([t.started_at[:10] for t in tests], str)
    if not (columns["date"] != "").all():
        del columns["date"]
    found = {}
    for name, column in columns.items():
        numbers = numbers_in(column)
        known = np.isfinite(numbers) if numbers is not None else np.array([*map(is_recorded, column)], bool)
        cells = np.where(known, column, "")
        if enough_recorded(int(known.sum()), len(tests)) and len(levels_of(cells)) > 1:
            found[name] = cells
    return found


def _numbers(values: Sequence[float | None]) -> FloatArray:
    return np.array([np.nan if v is None else float(v) for v in values])


def _seconds(stamp: str) -> float | None:
    try:
        when = datetime.fromisoformat(stamp)
    except ValueError:
        return None
    return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()  # not by the clock of this machine


def _moment(stamp: str) -> float | None:
    """The time of a test in seconds; None where only its day is known."""
    return _seconds(stamp) if len(stamp) > 10 else None


def _clock_h(stamp: str) -> float:
    try:
        when = datetime.fromisoformat(stamp)
    except ValueError:
        return float("nan")
    return when.hour + when.minute / 60 + when.second / 3600


def _clip(pull: Pull, trace: Trace | None) -> float:
    """k v / (2 f_s) from the slope of the rise in time and the sampling interval at the peak."""
    if trace is None or len(trace.time_s) < 3 or not np.isfinite(pull.rise_N_per_s):
        return 0.0
    near = np.clip(np.searchsorted(trace.time_s, pull.peak_s), 1, len(trace.time_s) - 2)
    step = float(np.median(np.diff(trace.time_s[max(near - 10, 0) : near + 10])))
    return 0.5 * max(pull.rise_N_per_s, 0.0) * max(step, 0.0)


def _slope_before(trace: Trace | None, pull: Pull) -> float:
    """Slope of the force before contact, N/s; NaN where fewer than eight samples come before."""
    if trace is None or not np.isfinite(pull.onset_s):
        return float("nan")
    length = pull.onset_s - trace.time_s[0]
    before = trace.time_s < pull.onset_s - 0.1 * length
    if before.sum() < 8:
        return float("nan")
    return float(np.polyfit(trace.time_s[before], trace.force_N[before], 1)[0])


BREAK_S = 3 * 3600.0  # without a pull: another session begins
FEWEST_IN_SESSION = 3.0  # pulls on average: below, sessions are not told from repeats
BENT = 0.5  # size of the bend of a drifting specimen over that of its line: as of the first two terms of a walk
WALK_TERMS = 14  # of the expansion of a random walk: it is followed down to a fourteenth of the series


def place_in_series(c: Conditions) -> FloatArray:
    """Where in the series every test was made, from 0 to 1: by time, else by run order; NaN where neither is known."""
    when = c.elapsed_s if np.isfinite(c.elapsed_s).all() and np.ptp(c.elapsed_s) > 0 else c.run_order
    if not np.isfinite(when).all() or np.ptp(when) == 0:
        return np.full(len(when), np.nan)
    rank = np.argsort(np.argsort(when, kind="stable"), kind="stable")
    return np.asarray((rank + 0.5) / len(rank))


def session_of(c: Conditions) -> NDArray[np.int64]:
    """The number of the session of every test, (n,): the time without a pull, else the date, divides them; all zero
    where there is one, or too few pulls in each."""
    none = np.zeros(len(c.sample), np.int64)
    if np.isfinite(c.elapsed_s).all():
        order = np.argsort(c.elapsed_s, kind="stable")
        found = none.copy()
        found[order] = np.cumsum(np.diff(c.elapsed_s[order], prepend=c.elapsed_s[order[0]]) > BREAK_S)
    elif "date" in c.columns:
        found = np.unique(c.columns["date"], return_inverse=True)[1]
    else:
        return none
    return found if len(found) >= FEWEST_IN_SESSION * (found.max() + 1) else none


def sessions(c: Conditions) -> list[FloatArray]:
    """One column (n,) a session, where there are several."""
    number = session_of(c)
    return [(number == k) * 1.0 for k in range(number.max() + 1)] if number.max() > 0 else []


def walks(c: Conditions) -> list[tuple[FloatArray, float]]:
    """Columns (n,) of a random walk along the series and their standard deviations, for a walk whose root mean square
    over the series is one: its expansion after Karhunen and Loève, about its mean."""
    place = place_in_series(c)
    if not np.isfinite(place).all() or len(place) < 2 * WALK_TERMS:
        return []
    # a walk less its mean has the eigenfunctions cos(k pi t) with variances in proportion to 1 / k^2
    order = np.arange(1, WALK_TERMS + 1)
    sd = (1.0 / order) / np.sqrt(np.sum(1.0 / order**2))
    return [(np.sqrt(2.0) * np.cos(np.pi * k * place), float(s)) for k, s in zip(order, sd, strict=True)]


def along_specimens(c: Conditions) -> tuple[FloatArray, FloatArray]:
    """Where every test lies among the pulls of its specimen, and the parabola of that beside the line, (n,) each: about
    a mean of zero with a root mean square of one for each specimen; zero where the order is not known."""
    line, parabola = np.zeros(len(c.sample)), np.zeros(len(c.sample))
    if not np.isfinite(c.specimen_run).all():
        return line, parabola
    for name in np.unique(c.specimen):
        here = c.specimen == name
        x = c.specimen_run[here] - c.specimen_run[here].mean()
        line[here] = x = _of_one_size(x)
        square = x**2 - np.mean(x**2)
        parabola[here] = _of_one_size(square - np.mean(square * x) * x)
    return line, parabola


def _of_one_size(x: FloatArray) -> FloatArray:
    size = float(np.sqrt(np.mean(x**2)))
    return np.asarray(x / size if size > 1e-9 else np.zeros_like(x))
