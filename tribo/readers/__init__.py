"""Readers of raw exports, one module a format family; ``read_export`` picks one of ``READERS`` by content."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.readers.export import READERS, read_export

__all__ = ["READERS", "read_export"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from tribo.readers import export

        return getattr(export, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
