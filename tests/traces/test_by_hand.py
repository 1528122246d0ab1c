"""A static peak or a sliding window that a person chose is read like one that the rule found."""

from __future__ import annotations

import numpy as np
import pytest

from traces.synthetic import Shape
from tribo import read_pull

SHAPE = Shape(noise_N=0.004, offset_N=0.05)
PEAK_S = SHAPE.zero_s + SHAPE.rise_s


def test_the_mean_over_a_chosen_window_is_that_of_its_samples() -> None:
    trace = SHAPE.trace()
    pull = read_pull(trace, window_s=(8.0, 11.0))
    inside = (trace.time_s >= 8.0) & (trace.time_s <= 11.0)
    assert pull.sliding_N == pytest.approx(float(trace.force_N[inside].mean()) - pull.zero_N, abs=1e-9)
    assert 8.0 <= pull.window_s[0] < pull.window_s[1] <= 11.0
    assert "window_by_hand" in pull.flags


def test_a_chosen_window_leaves_the_static_peak_as_it_was() -> None:
    trace = SHAPE.trace()
    automatic, moved = read_pull(trace), read_pull(trace, window_s=(8.0, 11.0))
    assert (moved.static_N, moved.static_u_N, moved.peak_s) == (
        automatic.static_N, automatic.static_u_N, automatic.peak_s,
    )  # fmt: skip


def test_the_peak_chosen_where_the_rule_found_it_gives_the_same_force() -> None:
    trace = SHAPE.trace()
    automatic = read_pull(trace)
    chosen = read_pull(trace, peak_s=automatic.peak_s)
    assert chosen.static_N == pytest.approx(automatic.static_N, abs=3 * automatic.static_u_N)
    assert chosen.static_N == pytest.approx(SHAPE.static_N, abs=0.03)
    assert "peak_by_hand" in chosen.flags


def test_a_peak_chosen_later_is_read_there_and_sliding_begins_after_it() -> None:
    trace = SHAPE.trace()
    later = np.asarray(trace.force_N).copy()
    bump = np.abs(trace.time_s - 6.0) < 0.4
    later[bump] += 1.5 * (1 - np.abs(trace.time_s[bump] - 6.0) / 0.4)
    pull = read_pull(type(trace)("bump", trace.time_s, later), peak_s=6.0)
    assert pull.peak_s == pytest.approx(6.0, abs=0.1)
    assert pull.static_N == pytest.approx(SHAPE.sliding_N + 1.5, abs=0.1)
    assert pull.window_s[0] > 6.0


def test_an_automatic_pull_carries_no_sign_of_a_hand() -> None:
    assert not any("by_hand" in flag for flag in read_pull(SHAPE.trace()).flags)
