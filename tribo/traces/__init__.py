"""Traces to pulls: zero, onset, static peak, sliding window, by named rules."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.traces.pull import read_pull
    from tribo.traces.rules import RULES, Rule

__all__ = ["RULES", "Rule", "read_pull"]

_HOME = {"read_pull": "pull", "RULES": "rules", "Rule": "rules"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
