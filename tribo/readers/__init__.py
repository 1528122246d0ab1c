"""Readers of raw exports, one module a format family; ``read_export`` picks one of ``READERS`` by content."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.readers.assign import columns_from_text
    from tribo.readers.export import read_blocks, read_export
    from tribo.readers.families import READERS
    from tribo.readers.inspect import Inspection, inspect_export

_HOME = {
    "READERS": "families",
    "columns_from_text": "assign",
    "Inspection": "inspect",
    "inspect_export": "inspect",
    "read_blocks": "export",
    "read_export": "export",
}
__all__ = ["READERS", "Inspection", "columns_from_text", "inspect_export", "read_blocks", "read_export"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        from importlib import import_module

        return getattr(import_module(f"tribo.readers.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
