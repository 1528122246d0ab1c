"""Data for the script of the page: thinned traces with their results, and the points of the figures."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

from tribo.figures.thinning import thin_trace
from tribo.records import FloatArray, Pull, Study, Trace
from tribo.report.html.hover import Series
from tribo.report.html.pull_cards import doubted_s, reading
from tribo.report.html.shell import script_json

TRACE_BYTES = 2_000_000  # all traces together
FULL_SCALE = 65535


def trace_data(study: Study, test_ids: Iterable[str]) -> Markup:
    """JSON by test id of the thinned traces and the readings, for a script element of its own."""
    wanted = list(test_ids)
    points = int(np.clip(TRACE_BYTES / (5.4 * max(len(wanted), 1)), 100, 1000))
    return script_json({test_id: _pull_record(study, test_id, points) for test_id in wanted})


def _pull_record(study: Study, test_id: str, points: int) -> dict[str, Any]:
    pull, trace, decided = reading(study, test_id)
    record = _trace_record(trace, pull, points) | _marks(pull)
    doubts = doubted_s(trace, pull)
    if doubts:
        record["doubts"] = [[_short(time), "; ".join(what)] for time, what in doubts.items()]
    if decided is not None:
        override = decided.override
        record["automatic"] = _marks(decided.automatic)
        record["decided"] = {
            "action": override.action, "reason": override.reason, "peak": override.peak_s, "window": override.window_s,
        }  # fmt: skip
    return record


def _trace_record(trace: Trace, pull: Pull, points: int) -> dict[str, Any]:
    """Times and forces (zero subtracted) as 16-bit shares of their ranges: finer than any screen."""
    time, force = thin_trace(trace.time_s, trace.force_N - pull.zero_N, points)
    good = np.isfinite(force) & np.isfinite(time)
    time, force = (time[good], force[good]) if good.any() else (np.zeros(1), np.zeros(1))
    t, f = _packed(time), _packed(force)
    return {"t": t, "f": f, "whole": bool(len(time) == len(trace.time_s))}


def _packed(values: FloatArray) -> dict[str, Any]:
    low, high = float(values.min()), float(values.max())
    share = (values - low) / (high - low) if high > low else np.zeros_like(values)
    data = np.round(share * FULL_SCALE).astype("<u2").tobytes()
    return {"low": _short(low), "high": _short(high), "data": base64.b64encode(data).decode("ascii")}


def _marks(pull: Pull) -> dict[str, Any]:
    return {
        "peak": [_short(pull.peak_s), _short(pull.static_N)],
        "window": [_short(t) for t in pull.window_s],
        "sliding": _short(pull.sliding_N),
        "zero": _short(pull.zero_N),
    }


def _short(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


def figure_data(series: Mapping[str, Iterable[Series]]) -> Markup:
    """JSON by figure name of the points someone may hover over: place on the page in points, and values."""
    return script_json(
        {
            name: [
                {
                    "name": s.name,
                    "x": s.x,
                    "y": s.y,
                    "place": [float(f"{v:.1f}") for v in s.place.ravel()],
                    "value": [float(f"{v:.4g}") for v in s.value.ravel()],
                }
                for s in found
            ]
            for name, found in series.items()
        }
    )
