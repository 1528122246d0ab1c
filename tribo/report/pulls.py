"""Every pull of a campaign as rows of the page, each with a small picture of its trace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from tribo.figures import select
from tribo.records import Pull, Study, Test, Trace
from tribo.report.numerals import significant, with_uncertainty
from tribo.report.oddness import odd_pulls
from tribo.report.wording import flags_in_words, odd_sentence

WIDTH, HEIGHT = 120, 26
MOST_ODD, ODD_POINTS = 24, 240
PICTURE_BYTES = 3_000_000  # all pictures together, so that the page stays easy to send


@dataclass(frozen=True)
class PullRow:
    """One pull as the page shows it."""

    test_id: str
    sample: str
    specimen: str
    load: str
    static: str
    sliding: str
    zero: str
    window: str
    stick_slip: str
    flags: str
    picture: Markup


def pull_groups(study: Study) -> list[tuple[str, list[PullRow]]]:
    """The pulls of each sample by rising load, in the order of the samples."""
    ingested = study.ingested
    usable = [t for t in ingested.campaign.tests if t.test_id in ingested.pulls]
    points = int(np.clip(PICTURE_BYTES / (9 * max(len(usable), 1)), 24, 120))
    groups: list[tuple[str, list[PullRow]]] = []
    for sample in select.sample_numbers(study):
        tests = sorted((t for t in usable if t.sample == sample), key=lambda t: (t.normal_load_N, t.test_id))
        rows = [_row(t, ingested.pulls[t.test_id], ingested.traces.get(t.test_id), points) for t in tests]
        if rows:
            groups.append((sample, rows))
    return groups


def odd_rows(study: Study) -> list[tuple[PullRow, str]]:
    """The pulls that stand far from their siblings, the oddest first, each with a larger picture and the reason."""
    tests = {t.test_id: t for t in study.ingested.campaign.tests}
    found = [(tests[odd.test_id], odd) for odd in odd_pulls(study)[:MOST_ODD]]
    ingested = study.ingested
    return [
        (_row(t, ingested.pulls[t.test_id], ingested.traces.get(t.test_id), ODD_POINTS), odd_sentence(odd))
        for t, odd in found
    ]


def _row(test: Test, pull: Pull, trace: Trace | None, points: int) -> PullRow:
    start, end = pull.window_s
    return PullRow(
        test.test_id,
        test.sample,
        test.specimen,
        significant(test.normal_load_N),
        with_uncertainty(pull.static_N, pull.static_u_N),
        with_uncertainty(pull.sliding_N, pull.sliding_u_N),
        significant(pull.zero_N, 2),
        f"{significant(start)} to {significant(end)}",
        significant(pull.stick_slip_amplitude_N, 2),
        flags_in_words(pull.flags),
        trace_picture(trace, pull, points) if trace is not None else Markup(""),
    )


def trace_picture(trace: Trace, pull: Pull, points: int = 120) -> Markup:
    """A small SVG of a trace: the force, a dot at the static peak, a bar at the mean of the window."""
    time, force = select.thin_trace(trace.time_s, trace.force_N - pull.zero_N, points)
    time, force = time[np.isfinite(force)], force[np.isfinite(force)]
    if len(force) < 2 or time[-1] <= time[0]:
        return Markup("")
    low, high = min(0.0, float(force.min())), float(np.nanmax([*force, pull.static_N, 1e-12]))

    def x(t: float | np.ndarray) -> np.ndarray:
        return np.asarray((t - time[0]) / (time[-1] - time[0]) * WIDTH)

    def y(f: float | np.ndarray) -> np.ndarray:
        return np.asarray(2 + (high - f) / (high - low) * (HEIGHT - 4))

    path = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x(time), y(force), strict=True))
    marks = ""
    if np.isfinite([pull.peak_s, pull.static_N]).all():
        marks += f'<circle class="k" cx="{x(pull.peak_s):.0f}" cy="{y(pull.static_N):.1f}" r="2"/>'
    if np.isfinite([*pull.window_s, pull.sliding_N]).all():
        start, end = x(pull.window_s[0]), x(pull.window_s[1])
        marks += f'<path class="w" d="M{start:.0f} {y(pull.sliding_N):.1f}H{end:.0f}"/>'
    view = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
    return Markup(f'<svg class="trace" aria-hidden="true" {view}><path d="M{path}"/>{marks}</svg>')
