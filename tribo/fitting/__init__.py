"""Laws fitted to the pulls of a campaign: specimens first, then samples. Names load on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.fitting.mixed import mixed_model
    from tribo.fitting.samples import fit_samples
    from tribo.fitting.three_term import fit_three_term

__all__ = ["fit_samples", "fit_three_term", "mixed_model"]

_HOME = {"fit_samples": "samples", "fit_three_term": "three_term", "mixed_model": "mixed"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
