"""Names of columns in a file beside a nameless export: NAME.toml, NAME.json or a text of one name a line."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tribo.input_files import read_input

_SUFFIXES = (".toml", ".json", ".hdr", ".header", ".names", ".columns", ".meta", ".info", ".ini")
_MOST_BYTES = 100_000


def names_beside(path: Path, n_cells: int) -> tuple[tuple[str, ...], str] | None:
    """(names with their units, name of the sidecar) of an export with ``n_cells`` columns, or None.

    A sidecar shares the stem of the export, or adds its suffix to the whole name. TOML and JSON hold ``columns``,
    a list of "name [unit]" or of tables with name and unit; any other text one "name [unit]" a line.
    """
    for suffix in _SUFFIXES:
        for beside in (path.with_suffix(suffix), path.with_name(path.name + suffix)):
            if beside == path or not beside.is_file() or beside.stat().st_size > _MOST_BYTES:
                continue
            names = _names(beside)
            if len(names) == n_cells:
                return tuple(names), beside.name
    return None


def _names(path: Path) -> list[str]:
    text = read_input(path, _MOST_BYTES).decode("utf-8-sig", errors="replace")
    try:
        if path.suffix == ".toml":
            return _listed(tomllib.loads(text).get("columns", []))
        if path.suffix == ".json":
            stored = json.loads(text)
            return _listed(stored.get("columns", []) if isinstance(stored, dict) else stored)
    except (ValueError, RecursionError):
        return []
    return [line.strip() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]


def _listed(columns: Any) -> list[str]:
    if not isinstance(columns, Sequence) or isinstance(columns, str):
        return []
    return [_one(column) for column in columns]


def _one(column: Any) -> str:
    if isinstance(column, dict):
        unit = column.get("unit", "")
        return f"{column.get('name', '')} [{unit}]" if unit else str(column.get("name", ""))
    return str(column)
