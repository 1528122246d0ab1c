"""Laws as a step of a diagnosis: where a misfit is left that no mechanism explains, its law is searched and added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tribo.diagnose.diagnosis_record import Diagnosis
from tribo.diagnose.discovery.law_words import law_layers, laws_text
from tribo.diagnose.discovery.parting import parting_test
from tribo.diagnose.discovery.search import Discovery, Progress, discover_laws
from tribo.diagnose.layers import pattern_layers
from tribo.diagnose.search.screen import Screen, screen_left
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.verdict import CERTAIN_CAUSES, Layer, Verdict

REPLICATES_LEFT = 60


def with_laws(d: Diagnosis, *, seed: int = 0, level: float = 0.01, progress: Progress | None = None) -> Diagnosis:
    """The same diagnosis with the laws of what its causes leave as further layers; unchanged where nothing is left."""
    if not _is_left(d, level):
        return d
    rng = np.random.default_rng(seed)
    found = discover_laws(explained(d), level=level, rng=rng, progress=progress)
    if not found.laws:
        return replace(d, laws=found)
    model = found.laws[-1].model
    left = screen_left(model, replicates=REPLICATES_LEFT, rng=rng, progress=progress)
    return replace(d, laws=found, verdict=_extended(d.verdict, found, model, (left, level)))


def explained(d: Diagnosis) -> ModelFit:
    """The model with the causes that are certain."""
    certain = d.named is not None and d.named.causes and d.verdict.verdict in CERTAIN_CAUSES
    return d.named.model if d.named is not None and certain else d.baseline


def _is_left(d: Diagnosis, level: float) -> bool:
    """Whether a misfit is left that no mechanism explains."""
    if d.named is None:
        return False
    return not d.named.causes or bool(d.named.remainders) or d.named.p_left < level


def _extended(v: Verdict, found: Discovery, model: ModelFit, left: tuple[Screen, float]) -> Verdict:
    """The verdict with corrections of the patterns beside the laws, the laws, and what is left after them."""
    screened, level = left
    columns = {name for law in found.laws for name in law.law.columns}
    kept = [layer for layer in v.layers if layer.kind == "cause"]
    remainders = _still_left([layer for layer in v.layers if layer.kind == "remainder"], columns, screened, level)
    rest = (
        "With this included, the remaining differences are within chance."
        if screened.p.min() >= level
        else "A misfit remains beyond chance."
    )
    next_test = v.next_test
    first = found.laws[0]
    if first.ties and not v.equivalent:
        next_test = parting_test(first.law, first.ties[0], model.setup.observations.conditions)
    return replace(
        v, layers=(*pattern_layers(model), *kept, *law_layers(found), *remainders), next_test=next_test,
        text=f"{v.text} {laws_text(found)} {rest}",
    )  # fmt: skip


def _still_left(layers: Sequence[Layer], columns: set[str], screened: Screen, level: float) -> list[Layer]:
    """Remainders of other columns that are still beyond chance beside the laws."""
    follows = {
        look.covariate.split(",")[0]
        for look, p in zip(screened.looks, screened.p, strict=True)
        if p < level and look.kind != "mechanism"
    }
    return [layer for layer in layers if layer.name in follows and layer.name not in columns]

