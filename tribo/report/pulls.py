"""Every pull of a campaign as the page shows it: a card with its results and a small picture of its trace, and the
thinned trace with its readings for the script of the page."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

from tribo.comparison import findings
from tribo.comparison.findings import ODD_SCORE, standings
from tribo.figures.one_pull import thin_trace
from tribo.records import FloatArray, Override, Pull, Study, Test, Trace
from tribo.report.shell import script_json
from tribo.wording.numerals import percent, significant, with_uncertainty
from tribo.wording.study_sentences import by_hand_sentence, flags_in_words, odd_sentence

WIDTH, HEIGHT = 180, 56
PICTURE_BYTES = 1_200_000  # all pictures together, so that the page stays easy to send
PULLS_A_PAGE = 2000  # more of them on one page are slow to open
LEAST_ABOVE = 1.01  # of the highest sample, from which on a peak above it is said
BY_HAND = ("peak_by_hand", "phases_by_hand", "window_by_hand")


def pull_cards(study: Study) -> list[dict[str, Any]]:
    """Every pull that was read, as the page shows it, including those excluded by hand.

    ``state`` is used, moved or excluded; ``oddness``, by which they are sorted, is the deviation in robust standard
    deviations, plus one for every flag.
    """
    ingested = study.ingested
    standing = standings(study)
    levels = load_labels(study)
    read = [t for t in ingested.campaign.tests if t.test_id in ingested.pulls or t.test_id in ingested.by_hand]
    points = int(np.clip(PICTURE_BYTES / (9 * min(max(len(read), 1), PULLS_A_PAGE)), 24, 160))
    read = [t for t in read if t.test_id in study.ingested.traces or t.test_id in study.ingested.by_hand]
    cards = [_card(study, t, levels[t.test_id], standing.get(t.test_id), points) for t in read]
    return sorted(cards, key=lambda card: (-card["oddness"], card["test_id"]))


def on_pages(cards: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """The cards of each page. Where there are several pages, pulls with a decision by hand come first, so that the
    first page holds all decisions."""
    if len(cards) <= PULLS_A_PAGE:
        return [cards]
    ordered = sorted(cards, key=lambda card: card["state"] == "used")
    return [ordered[k : k + PULLS_A_PAGE] for k in range(0, len(ordered), PULLS_A_PAGE)]


def doubted_s(trace: Trace, pull: Pull) -> dict[float, tuple[str, ...]]:
    """Times (s) of doubtful data points, each with the doubts."""
    found: dict[float, tuple[str, ...]] = {}
    for problem in dict.fromkeys((*trace.problems, *pull.problems)):
        sample = -1 if problem.row is None else problem.row - trace.first_row
        if 0 <= sample < len(trace.time_s) and math.isfinite(trace.time_s[sample]):
            time = float(trace.time_s[sample])
            found[time] = (*found.get(time, ()), problem.what)
    return dict(sorted(found.items()))


def load_labels(study: Study) -> dict[str, str]:
    """The load level of every test in newton, as it is filtered by."""
    tests = study.ingested.campaign.tests
    levels = findings.load_levels(np.array([t.normal_load_N for t in tests], float)) if tests else np.empty(0)
    return {t.test_id: significant(float(level)) for t, level in zip(tests, levels, strict=True)}


def reading(study: Study, test_id: str) -> tuple[Pull, Trace, Override | None]:
    """The pull of a test (also if it is excluded), its trace and the decision made by hand."""
    ingested = study.ingested
    decided = ingested.by_hand.get(test_id)
    if test_id in ingested.pulls:
        return ingested.pulls[test_id], ingested.traces[test_id], decided
    assert decided is not None
    assert decided.trace is not None
    return decided.automatic, decided.trace, decided


def _card(study: Study, test: Test, load: str, standing: Mapping[str, Any] | None, points: int) -> dict[str, Any]:
    pull, trace, decided = reading(study, test.test_id)
    used = test.test_id in study.ingested.pulls
    start, end = pull.window_s
    flags = tuple(flag for flag in pull.flags if flag not in BY_HAND)
    score = abs(standing["score"]) if standing is not None else 0.0
    return {
        "test_id": test.test_id,
        "sample": test.sample,
        "specimen": test.specimen,
        "load": load,
        "state": "excluded" if not used else "moved" if decided else "used",
        "static": with_uncertainty(pull.static_N, pull.static_u_N),
        "sliding": with_uncertainty(pull.sliding_N, pull.sliding_u_N),
        "zero": significant(pull.zero_N, 2),
        "window": f"{significant(start)} to {significant(end)}",
        "above_samples": peak_above_samples(trace, pull),
        "flags": flags,
        "flags_in_words": flags_in_words(flags),
        "odd": odd_sentence(standing) if standing is not None and score > ODD_SCORE else "",
        "by_hand": by_hand_sentence(decided, pull if used else None) if decided is not None else "",
        "oddness": round(score + len(flags), 2),
        "order": test.run_order or 0,
        "picture": trace_picture(trace, pull, points),
    }


def peak_above_samples(trace: Trace, pull: Pull) -> str:
    """By how much an interpolated static peak lies above every sample before the sliding window; empty below 1 %."""
    start = pull.window_s[0] if math.isfinite(pull.window_s[0]) else math.inf
    before = (trace.force_N - pull.zero_N)[(trace.time_s < start) & np.isfinite(trace.force_N)]
    if not len(before) or not pull.static_N > LEAST_ABOVE * before.max() > 0.0:
        return ""
    above = percent(pull.static_N / float(before.max()) - 1)
    return f"the peak is interpolated between samples, {above} above the highest of them"


def trace_picture(trace: Trace, pull: Pull, points: int = 120) -> Markup:
    """A small SVG of a trace, its zero subtracted: a line at zero, a shaded window with its mean, a dot at the peak.

    Notches from above point at samples with a doubt.
    """
    time, force = thin_trace(trace.time_s, trace.force_N - pull.zero_N, points)
    time, force = time[np.isfinite(force)], force[np.isfinite(force)]
    if len(force) < 2 or time[-1] <= time[0]:
        return Markup("")
    low, high = min(0.0, float(force.min())), float(np.nanmax([*force, pull.static_N, 1e-12]))

    def x(t: float | np.ndarray) -> np.ndarray:
        return np.asarray((t - time[0]) / (time[-1] - time[0]) * WIDTH)

    def y(f: float | np.ndarray) -> np.ndarray:
        return np.asarray(3 + (high - f) / (high - low) * (HEIGHT - 6))

    marks = f'<path class="z" d="M0 {y(0.0):.1f}H{WIDTH}"/>'
    if all(map(math.isfinite, (*pull.window_s, pull.sliding_N))):
        start, end = x(pull.window_s[0]), x(pull.window_s[1])
        marks += f'<path class="b" d="M{start:.0f} 0H{end:.0f}V{HEIGHT}H{start:.0f}z"/>'
    marks += '<path d="M' + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x(time), y(force), strict=True)) + '"/>'
    if all(map(math.isfinite, (*pull.window_s, pull.sliding_N))):
        marks += f'<path class="w" d="M{start:.0f} {y(pull.sliding_N):.1f}H{end:.0f}"/>'
    if math.isfinite(pull.peak_s) and math.isfinite(pull.static_N):
        marks += f'<circle class="k" cx="{x(pull.peak_s):.0f}" cy="{y(pull.static_N):.1f}" r="2.6"/>'
    doubts = "".join(f"M{x(t):.0f} 0v7" for t in doubted_s(trace, pull))
    marks += f'<path class="d" d="{doubts}"/>' if doubts else ""
    view = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
    return Markup(f'<svg class="trace" aria-hidden="true" {view}>{marks}</svg>')


TRACE_BYTES = 2_000_000  # all traces together
FULL_SCALE = 65535
MOST_SLIPS = 300
MOST_PHASES = 200  # drawn of one pull; all stand in phases.csv


def trace_data(study: Study, test_ids: Iterable[str]) -> Markup:
    """JSON by test id of the thinned traces and the readings, for a script element of its own."""
    wanted = list(test_ids)
    points = int(np.clip(TRACE_BYTES / (5.4 * max(len(wanted), 1)), 100, 1000))
    return script_json({test_id: _pull_record(study, test_id, points) for test_id in wanted})


def _pull_record(study: Study, test_id: str, points: int) -> dict[str, Any]:
    pull, trace, decided = reading(study, test_id)
    record = _trace_record(trace, pull, points) | _marks(pull)
    record["phases"] = [[p.name, _short(p.start_s), _short(p.end_s)] for p in pull.phases[:MOST_PHASES]]
    if pull.slips:
        step = -(-len(pull.slips) // MOST_SLIPS)
        lines = [(s.fail_s, s.peak_N, s.end_s, s.trough_N) for s in pull.slips[::step]]
        record["slips"] = [[_short(value) for value in line] for line in lines]
    doubts = doubted_s(trace, pull)
    if doubts:
        record["doubts"] = [[_short(time), "; ".join(what)] for time, what in doubts.items()]
    if decided is not None:
        record["automatic"] = _marks(decided.automatic)
        if decided.action != "event":
            record["decided"] = _decision(decided)
        if decided.slips:  # kept by the page, which does not change them
            rows = [(n or "", decided.reason, *("" if math.isnan(t) else t for t in at)) for n, *at in decided.slips]
            record["slips_by_hand"] = [list(row) for row in rows]
    return record


def _decision(decided: Override) -> dict[str, Any]:
    """A decision as the page takes it up: of stated phases the peak and the window that they give."""
    rises = [phase.end_s for phase in decided.phases if phase.name == "rise"]
    slides = [(phase.start_s, phase.end_s) for phase in decided.phases if phase.name == "steady sliding"]
    return {
        "action": "exclude" if decided.action == "exclude" else "move", "reason": decided.reason,
        "peak": decided.peak_s if decided.peak_s is not None else next(iter(rises), None),
        "window": decided.window_s or next(iter(slides), None),
    }  # fmt: skip


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
