"""A few programmes of every kind, read by their channels: the whole exam is ``benchmarks/programmes.py``."""

from __future__ import annotations

from pathlib import Path

import pytest
from support import first_quick

from .exam import Seen, sat, summary
from .kinds import KINDS


@pytest.fixture(scope="module", params=first_quick([list(KINDS)[1::2], list(KINDS)]), ids=["every other", "all"])
def seen(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> list[Seen]:
    return sat(request.param, [3], Path(tmp_path_factory.mktemp("programmes")) / "campaign")


def test_boundaries_of_phases_are_where_the_programme_has_them(seen: list[Seen]) -> None:
    missed = [f"{s.kind}: {said}" for s in seen for said in s.missed]
    assert len(missed) <= 0.05 * sum(s.boundaries for s in seen), missed


def test_no_static_force_is_invented_and_no_window_holds_a_rest(seen: list[Seen]) -> None:
    assert not [s.kind for s in seen if s.invented or s.over_rest]


def test_a_disc_that_drifts_is_not_called_steady(seen: list[Seen]) -> None:
    assert {s.kind: s.state for s in seen if "drifts" in s.kind} == {"disc that drifts, speed only": "still drifts"}


def test_readings_agree_with_what_the_programme_was(seen: list[Seen]) -> None:
    found = summary(seen)["quantities"]
    for quantity in ("plateau: force_N", "cycle: force_N", "cycle: energy_J"):
        assert found[quantity]["median"] == pytest.approx(1.0, abs=0.01), quantity
        assert found[quantity]["held"] > 0.85, quantity
