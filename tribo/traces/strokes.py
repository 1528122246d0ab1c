"""All pulls of a record that contains several: reciprocating strokes, steps of load or speed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import Pull, Test, Trace
from tribo.traces.loading import starting_level
from tribo.traces.noise import median_of_three, steady
from tribo.traces.pull import read_pull
from tribo.traces.segments import Strokes, orient_strokes, split_pulls
from tribo.traces.signal import signal_of, unreadable
from tribo.traces.sliding import settled

_NO_PEAK = {"stopped_before_peak", "sign_flipped", "spike"}
_CLIMB_OVER_SWING = 5.0


def read_pulls(
    traces: Trace | Sequence[Trace],
    *,
    rule: str = "middle_share",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
) -> tuple[Pull, ...]:
    """Read every pull of one record, or of several blocks of one (each split by :func:`split_pulls`).

    Strokes in both directions share a zero, determined from their asymmetry. A piece that slides from its first sample,
    after a step of load or speed, has no static peak: its ``static_N`` is NaN and it is flagged ``no_static``.
    ``test_id`` of a pull is the name of its piece. With :func:`load_of` the pieces give friction against load.

    Raises
    ------
    TraceError
        A piece cannot be read; every problem of every piece is listed.
    """
    pulls: list[Pull] = []
    problems: list[Problem] = []
    for pull in read_pieces(pieces_of(traces), rule=rule, test=test, parameters=parameters):
        if isinstance(pull, TraceError):
            problems += pull.problems
        else:
            pulls.append(pull)
    if problems:
        raise TraceError(problems)
    return tuple(pulls)


def read_pieces(
    strokes: Strokes,
    *,
    rule: str = "middle_share",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Iterator[Pull | TraceError]:
    """What each piece gives, in order: its pull (see :func:`read_pulls`), or why it cannot be read."""
    zero = None if math.isnan(strokes.zero_N) else (0.0, strokes.zero_u_N)
    for piece, direction in zip(strokes.traces, strokes.directions, strict=True):
        try:
            pull = _read_piece(piece, rule, test, parameters, zero)
        except TraceError as fault:
            yield fault
            continue
        offset = pull.zero_N if zero is None else strokes.zero_N
        flags = (*pull.flags, "forward" if direction > 0 else "backward") if zero or direction < 0 else pull.flags
        yield replace(pull, test_id=piece.name, zero_N=offset, flags=flags)


def pieces_of(traces: Trace | Sequence[Trace]) -> Strokes:
    """The pieces of a record in order, turned to one sign, with the zero that strokes of both directions share."""
    blocks = [traces] if isinstance(traces, Trace) else list(traces)
    return orient_strokes([piece for block in blocks for piece in split_pulls(block)])


def _read_piece(
    piece: Trace, rule: str, test: Test | None, parameters: Mapping[str, float] | None, zero: tuple[float, float] | None
) -> Pull:
    if zero is None and not unreadable(piece) and _slides_at_once(piece):
        return read_sliding(piece, zero=zero, rule=rule)
    try:
        return read_pull(piece, rule=rule, test=test, parameters=parameters, zero=zero)
    except TraceError as fault:
        if not {p.kind for p in fault.problems} <= _NO_PEAK:
            raise
    return read_sliding(piece, zero=zero, rule=rule)


def _slides_at_once(piece: Trace) -> bool:
    """Whether a piece begins near the force it keeps: above half its maximum, and climbing little for its swing."""
    force = median_of_three(piece.force_N)
    start, top = starting_level(force), float(force.max())
    return start > 0.5 * top and top - start < _CLIMB_OVER_SWING * float(force[force.size // 2 :].std())


def read_sliding(trace: Trace, *, zero: tuple[float, float] | None = None, rule: str = "seed") -> Pull:
    """Sliding friction of a trace that slides from its first sample: the mean once the force has stabilised.

    Static friction, onset and peak are NaN, flagged ``no_static``; without a ``zero`` (force, standard uncertainty)
    none is taken out, flagged ``no_zero_phase``.

    Raises
    ------
    TraceError
        ``too_short``, ``nan_gap``, ``time_goes_back``, ``time_stands_still``.
    """
    signal = signal_of(trace)
    start = settled(signal.force_N)
    window = steady(trace.time_s[start:], signal.force_N[start:])
    offset, offset_u = zero or (0.0, 0.0)
    flags = ("no_static",) if zero else ("no_static", "no_zero_phase")
    nan = math.nan
    return Pull(
        test_id=trace.name, rule=rule, static_N=nan, static_u_N=nan, sliding_N=window.mean_N - offset,
        sliding_u_N=math.hypot(window.u_N, offset_u), zero_N=offset, zero_u_N=offset_u if zero else nan, onset_s=nan,
        peak_s=nan, window_s=(float(trace.time_s[start]), float(trace.time_s[-1])), noise_N=window.noise_N,
        drift_N_per_s=window.drift_N_per_s, flags=(*flags, "spike") if signal.problems else flags,
        problems=signal.problems,
    )  # fmt: skip


def load_of(trace: Trace) -> tuple[float, float]:
    """Mean normal load of a piece (N, taken as positive) and its standard uncertainty; NaN where none was recorded."""
    load = trace.columns.get("normal_force_N")
    if load is None:
        return math.nan, math.nan
    level = steady(trace.time_s, np.abs(load) if float(np.median(load)) > 0 else -load)
    return level.mean_N, level.u_N


def sampling_clip_N(rise_N_per_s: float, rate_Hz: float) -> float:
    """Limit (GUM type B) of how far the largest data point lies below a sharp peak on average: k v / (2 f_s).

    ``rise_N_per_s`` is k v, the slope of the loading line, ``rate_Hz`` the sampling rate f_s. The apex fitted by
    :func:`read_pull` lies between the data points; this limit applies if the fit fails.
    """
    return rise_N_per_s / (2.0 * rate_Hz)


def sampling_rate_Hz(trace: Trace) -> float:
    """Median number of samples per second; NaN with fewer than two."""
    if trace.time_s.size < 2:
        return math.nan
    return float(1.0 / np.median(np.diff(trace.time_s)))
