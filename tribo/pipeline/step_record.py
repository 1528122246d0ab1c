"""The record that a finished step of the workflow leaves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tribo.file_contents import text_of

OF_A_REPORT = ("status", "digest", "problems", "finished")
_TYPES: dict[str, type | tuple[type, ...]] = {
    "status": str, "digest": str, "finished": str, "files": dict, "problems": list, "samples": list, "cells": list,
}  # fmt: skip


def read_record(path: Path, *keys: str) -> dict[str, Any] | None:
    """The record of a finished step; None where there is none, or a damaged one that lacks any of ``keys``.

    Raises
    ------
    OSError
        It is there and cannot be read.
    """
    try:
        record = json.loads(text_of(path))
    except (FileNotFoundError, NotADirectoryError, ValueError, RecursionError):
        return None
    whole = isinstance(record, dict) and all(isinstance(record.get(key), _TYPES[key]) for key in keys)
    return record if whole else None
