"""Several threads that share one lattice."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from tribo.springblock import SimConfig
from tribo.springblock.engines import team
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.state import Trajectory, lattice_of, thresholds_of

# Large enough for more than 64 strips to move at once, at the peak.
CONFIG = SimConfig(sample="C", blocks=(64, 60), dt_s=1e-7, duration_peaks=1.1, window_start_peaks=1.05, seed=4)


def run(threads: int) -> Trajectory:
    lattice = lattice_of(CONFIG)
    return run_fast(CONFIG, lattice, thresholds_of(CONFIG, lattice), threads)


@pytest.mark.slow
def test_the_result_does_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch):
    """To the bit, with one thread and with three; seed 4."""
    monkeypatch.setattr(team, "FEWEST_BLOCKS", 1000)
    monkeypatch.setattr(team, "cores", lambda: 3)
    alone, shared = run(1), run(3)
    for field in ("force_N", "impulse_Ns", "moving", "failed", "displacement_m", "velocity_m_s"):
        assert np.array_equal(getattr(shared, field), getattr(alone, field)), field
    assert shared.friction_work_J == alone.friction_work_J


def test_a_lattice_in_shares_gives_the_forces_of_one_that_is_not(monkeypatch: pytest.MonkeyPatch):
    """The sums over blocks are added in another order, and nothing else changes; seed 4."""
    whole = run(1)
    monkeypatch.setattr(team, "FEWEST_BLOCKS", 1000)
    cut = run(1)
    assert np.allclose(cut.force_N, whole.force_N, rtol=0.0, atol=1e-12 * whole.peak_N)
    assert np.array_equal(cut.moving, whole.moving)
    assert np.array_equal(cut.failed, whole.failed)


def test_a_team_has_no_more_threads_than_cores_or_shares(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(team, "cores", lambda: 3)
    assert team.team_size(team.orders_for(8, team.SHARES)) == 3
    assert team.team_size(team.orders_for(2, team.SHARES)) == 2
    assert team.team_size(team.orders_for(8, 1)) == 1


def test_no_thread_is_started_that_cannot_take_orders():
    """Were it started, the leader would wait for it without end."""
    before = threading.active_count()

    def fails(thread: int) -> None:
        raise ValueError("does not compile")

    two = np.zeros(2 * team.LINE, np.int64)
    with pytest.raises(ValueError, match="does not compile"), team.helped(two, fails):
        pass
    assert threading.active_count() == before


def test_the_other_threads_end_when_the_leader_fails(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(team, "cores", lambda: 2)
    before = threading.active_count()
    ended = []

    def waits(thread: int) -> None:
        ended.append(_take_orders(two))

    two = team.orders_for(2, team.SHARES)
    with pytest.raises(ValueError, match="the leader"), team.helped(two, waits):
        raise ValueError("the leader")
    assert ended == [True, True]
    assert threading.active_count() == before


def _take_orders(taken: team.IntArray) -> bool:
    """Wait for the last order, in Python."""
    while taken[team.ORDER] == 0:
        pass
    return bool(taken[team.KIND] == team.END)
