"""From an ingested campaign to its laws: the diagnosis first, then the search for what it leaves."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.diagnose.diagnosis import examine
from tribo.diagnose.discovery.held import Held, holds
from tribo.diagnose.discovery.search import Discovery, Progress, discover_laws
from tribo.diagnose.discovery.written_law import WrittenLaw
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.verdict import CERTAIN_CAUSES, Estimate
from tribo.records import Ingested


def discover_in(
    ingested: Ingested, *, seed: int = 0, level: float = 0.01, progress: Progress | None = None
) -> Discovery:
    """Search for the laws of what the causes of a campaign leave unexplained."""
    model = _explained(ingested, seed, level, progress)
    return discover_laws(model, level=level, rng=np.random.default_rng(seed), progress=progress)


def hold_law_against(
    ingested: Ingested, law: WrittenLaw, parameters: Mapping[str, Estimate], *, seed: int = 0, level: float = 0.01
) -> Held:
    """Whether a law of another campaign holds in this one, its own causes taken into account."""
    return holds(_explained(ingested, seed, level, None), law, parameters)


def _explained(ingested: Ingested, seed: int, level: float, progress: Progress | None) -> ModelFit:
    """The model with the causes that are certain."""
    d = examine(ingested, seed=seed, level=level, progress=progress)
    certain = d.named is not None and d.named.causes and d.verdict.verdict in CERTAIN_CAUSES
    return d.named.model if d.named is not None and certain else d.baseline
