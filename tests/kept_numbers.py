"""Numbers kept beside a test: they change only where that is meant, and ``python -m`` of their maker writes them anew.

A number is kept with ten digits and compared to a millionth, for computers differ in their last digits.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

DIGITS = 10


def scatter(seed: int, n: int) -> np.ndarray:
    """Nearly normal numbers of standard deviation one that are the same in every version of Python and numpy."""
    drawn = random.Random(seed).random
    return np.array([sum(drawn() for _ in range(12)) - 6.0 for _ in range(n)])


def plain(value: Any) -> Any:
    """Numbers, arrays and records as JSON has them: rounded, null for NaN, as text for the infinite."""
    if isinstance(value, Mapping):
        return {str(name): plain(inner) for name, inner in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(inner) for inner in value]
    if value is None or isinstance(value, (str, bool, np.bool_)):
        return value if not isinstance(value, np.bool_) else bool(value)
    number = float(value)
    if math.isfinite(number):
        return float(f"{number:.{DIGITS}g}")
    return None if math.isnan(number) else str(number)


def write(file: Path, found: Mapping[str, Any]) -> None:
    rows = ",\n".join(f"{json.dumps(name)}: {json.dumps(plain(value))}" for name, value in found.items())
    file.write_text(f"{{\n{rows}\n}}\n", encoding="utf-8")


def assert_as_kept(found: Any, kept: Any, least: float = 1e-9) -> None:
    """Words are equal, and numbers to a millionth or ``least``."""
    numbers, words = parted(plain(found))
    kept_numbers, kept_words = parted(kept)
    assert words == kept_words
    assert numbers == pytest.approx(kept_numbers, rel=1e-6, abs=least)


def parted(value: Any) -> tuple[dict[str, float], dict[str, Any]]:
    """The numbers of nested values by their place, and everything else by its place."""
    every = dict(leaves(value))
    numbers = {at: float(v) for at, v in every.items() if isinstance(v, (int, float)) and not isinstance(v, bool)}
    return numbers, {at: v for at, v in every.items() if at not in numbers}


def leaves(value: Any, at: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from leaves(inner, f"{at}, {name}" if at else name)
    elif isinstance(value, list):
        yield f"{at}: count", len(value)
        for k, inner in enumerate(value):
            yield from leaves(inner, f"{at} {k}")
    else:
        yield at, value
