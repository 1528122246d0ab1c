"""verdict.json (schema tribo.verdict/2) and card.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tribo.files import write_text


def write_verdict(verdict: Mapping[str, Any], out: Path) -> Path:
    """Write out/verdict.json from a verdict in the form of its schema."""
    return write_text(out / "verdict.json", json.dumps(verdict, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def write_card(card: Mapping[str, Any], out: Path) -> Path:
    """Write out/card.json from a card as plain types."""
    return write_text(out / "card.json", json.dumps(card, indent=2, ensure_ascii=False) + "\n")
