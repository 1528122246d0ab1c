"""From an ingested campaign to its laws: the diagnosis first, then the search for what it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tribo.diagnostics.diagnosis import examine
from tribo.diagnostics.diagnosis_record import Diagnosis
from tribo.diagnostics.verdict import Estimate
from tribo.lawsearch.diagnosis_with_laws import LEVEL_OF_LAWS, uncontested
from tribo.lawsearch.grammar import WrittenLaw
from tribo.lawsearch.known_laws import Held, holds
from tribo.lawsearch.search import Discovery, Progress, discover_laws
from tribo.records import Ingested


def discover_in(
    ingested: Ingested, *, seed: int = 0, level: float = 0.01, progress: Progress | None = None
) -> Discovery:
    """Search for the laws of what the causes of a campaign leave unexplained."""
    d = examine(ingested, seed=seed, level=level, progress=progress)
    return searched_laws(d, seed=seed, level=level, progress=progress)


def searched_laws(d: Diagnosis, *, seed: int = 0, level: float = 0.01, progress: Progress | None = None) -> Discovery:
    """The laws of what the causes of a diagnosis leave unexplained.

    ``level`` is that of a misfit; a law has to be beyond chance at LEVEL_OF_LAWS times it.
    """
    strict, contested = LEVEL_OF_LAWS * level, uncontested(d)
    found = discover_laws(contested.model, level=strict, rng=np.random.default_rng(seed), progress=progress)
    return replace(found, of_causes=contested.forms)


def hold_law_against(
    ingested: Ingested, law: WrittenLaw, parameters: Mapping[str, Estimate], *, seed: int = 0, level: float = 0.01
) -> Held:
    """Whether a law of another campaign holds in this one, its own causes taken into account."""
    return holds(uncontested(examine(ingested, seed=seed, level=level)).model, law, parameters)
