"""Readings of more than two hundred traces and rules are those that were kept."""

from __future__ import annotations

import json

import pytest
from kept_numbers import assert_as_kept

from .kept import KEPT, others, pulls, read_by_every_rule

SINGLE = dict(pulls())
KEPT_READINGS = json.loads(KEPT.read_text())


@pytest.mark.parametrize("name", SINGLE)
def test_a_pull_is_read_as_it_was_by_every_rule(name: str) -> None:
    assert_as_kept(read_by_every_rule(SINGLE[name]), KEPT_READINGS[name])


def test_records_of_several_pulls_cycles_and_choices_by_hand_are_read_as_they_were() -> None:
    rest = {name: reading for name, reading in KEPT_READINGS.items() if name not in SINGLE}
    assert len(rest) > 15
    assert_as_kept(others(), rest)
