"""Traces to pulls: zero, onset, static peak, sliding window, by named rules."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.traces.cycles import StickSlip, stick_slip_cycles
    from tribo.traces.pull import read_pull
    from tribo.traces.rules import RULES, Rule
    from tribo.traces.segments import Strokes, orient_strokes, split_pulls
    from tribo.traces.strokes import load_of, pieces_of, read_pulls, read_sliding, sampling_clip_N, sampling_rate_Hz

_HOME = {
    "RULES": "rules",
    "Rule": "rules",
    "StickSlip": "cycles",
    "Strokes": "segments",
    "load_of": "strokes",
    "orient_strokes": "segments",
    "pieces_of": "strokes",
    "read_pull": "pull",
    "read_pulls": "strokes",
    "read_sliding": "strokes",
    "sampling_clip_N": "strokes",
    "sampling_rate_Hz": "strokes",
    "split_pulls": "segments",
    "stick_slip_cycles": "cycles",
}
__all__ = [
    "RULES",
    "Rule",
    "StickSlip",
    "Strokes",
    "load_of",
    "orient_strokes",
    "pieces_of",
    "read_pull",
    "read_pulls",
    "read_sliding",
    "sampling_clip_N",
    "sampling_rate_Hz",
    "split_pulls",
    "stick_slip_cycles",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
