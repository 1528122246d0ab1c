"""Ingested campaigns straight from the virtual tribometer, without files: fast, and free of reading errors."""

from __future__ import annotations

from blind.direct import ingested, pattern_of
from blind.tribometer import Design, hide

from tribo.records import Ingested

SMALL = Design(samples=("F", "A", "B", "C"), masses_g=(5.0, 25.0, 90.0, 138.5))
PATTERNS = {sample: pattern_of(sample) for sample in ("F", "A", "B", "C", "Sx", "Sy")}


def hidden(*effects: tuple[str, float], seed: int = 11, design: Design = SMALL) -> Ingested:
    """A campaign with effects hidden in it, as it looks once its traces are read."""
    return ingested(hide(seed, list(effects), design), seed)
