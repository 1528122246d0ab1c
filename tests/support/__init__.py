"""What several folders of tests and the benchmarks share."""

from collections.abc import Iterable
from typing import Any

import pytest


def first_quick(cases: Iterable[Any], quick: int = 1) -> list[Any]:
    """These cases of a test: the first ``quick`` run in ``make test``, with all others in ``make test-all``."""
    rows = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*row, marks=pytest.mark.slow if n >= quick else ()) for n, row in enumerate(rows)]
