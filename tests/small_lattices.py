"""Simulations of few blocks, for facts that do not depend on how many there are."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from tribo.springblock import SimConfig


@contextmanager
def small_lattices() -> Iterator[None]:
    """Simulations of 21 x 21 blocks, in place of 85 x 85, where a configuration does not say how many."""
    given = SimConfig.__init__.__defaults__
    assert given is not None
    assert (85, 85) in given
    SimConfig.__init__.__defaults__ = tuple((21, 21) if value == (85, 85) else value for value in given)
    try:
        yield
    finally:
        SimConfig.__init__.__defaults__ = given
