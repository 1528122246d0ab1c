"""Traces thinned for drawing."""

from __future__ import annotations

import numpy as np

from tribo.figures.one_pull import thin_trace


def test_a_thinned_trace_keeps_its_spikes_its_ends_and_its_order() -> None:
    t = np.arange(100_000.0)
    force = np.sin(t / 1e4)
    force[[31_234, 77_777]] = [9.0, -9.0]
    time, thin = thin_trace(t, force, 400)
    assert len(thin) <= 402
    assert {9.0, -9.0} <= set(thin)
    assert (time[0], time[-1]) == (0.0, 99_999.0)
    assert (np.diff(time) > 0).all()


def test_a_short_trace_is_left_alone() -> None:
    t = np.arange(10.0)
    assert thin_trace(t, t)[1] is not None
    assert (thin_trace(t, t)[1] == t).all()
