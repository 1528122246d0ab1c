"""Laws, parameters and placements of all mechanisms are those that were kept."""

from __future__ import annotations

import json

from kept_numbers import assert_as_kept

from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Mechanism

from .kept import KEPT, of
from .test_contract import ALL

KEPT_LAWS = json.loads(KEPT.read_text(encoding="utf-8"))


@ALL
def test_a_mechanism_does_what_it_did(m: Mechanism) -> None:
    assert_as_kept(of(m), KEPT_LAWS[m.name], least=1e-12)


def test_every_mechanism_is_kept() -> None:
    assert list(KEPT_LAWS) == list(MECHANISMS)
