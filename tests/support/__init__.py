"""What several folders of tests and the benchmarks share."""

from collections.abc import Iterable
from typing import Any

import pytest


def first_quick(cases: Iterable[Any]) -> list[Any]:
    """These cases of a test: the first runs in ``make test``, the others with all slow ones in ``make bench``."""
    rows = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*row) if n == 0 else pytest.param(*row, marks=pytest.mark.slow) for n, row in enumerate(rows)]
