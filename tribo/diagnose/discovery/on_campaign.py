"""From an ingested campaign to its laws: the diagnosis first, then the search for what it leaves."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.diagnose.diagnosis import examine
from tribo.diagnose.discovery.held import Held, holds
from tribo.diagnose.discovery.in_verdict import explained
from tribo.diagnose.discovery.search import Discovery, Progress, discover_laws
from tribo.diagnose.discovery.written_law import WrittenLaw
from tribo.diagnose.verdict import Estimate
from tribo.records import Ingested

WITHOUT_MISFIT = 0.1  # of the level: the diagnosis did not ask for a law


def discover_in(
    ingested: Ingested, *, seed: int = 0, level: float = 0.01, progress: Progress | None = None
) -> Discovery:
    """Search for the laws of what the causes of a campaign leave unexplained.

    Where the diagnosis finds no misfit, a law has to be beyond chance at a tenth of the level.
    """
    d = examine(ingested, seed=seed, level=level, progress=progress)
    strict = level if d.named is not None else WITHOUT_MISFIT * level
    return discover_laws(explained(d), level=strict, rng=np.random.default_rng(seed), progress=progress)


def hold_law_against(
    ingested: Ingested, law: WrittenLaw, parameters: Mapping[str, Estimate], *, seed: int = 0, level: float = 0.01
) -> Held:
    """Whether a law of another campaign holds in this one, its own causes taken into account."""
    return holds(explained(examine(ingested, seed=seed, level=level)), law, parameters)
