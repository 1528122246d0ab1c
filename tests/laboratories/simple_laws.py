"""Laws with a size that a formula has: a line, a line of the logarithm, a step; exactly so, or nearly."""

from __future__ import annotations

from typing import Any

import numpy as np

from .campaign import Hide, LaboratoryBench, multiply, rms_percent
from .effects import bent

FORMS = ("line", "line of ln", "step")
COLUMNS = ("temperature_C", "humidity_pct", "film_um")
SIZES = (0.20, 0.40)  # of ln T from the least to the most


def hide_simple_law(form: str, column: str, off: float = 0.0) -> Hide:
    """A law of this form on all samples in both regimes; where ``off`` is not 0, times 1 + off g as of an effect.

    The truth states ``percent``, the change of T from the least to the most of the column.
    """

    def hide(bench: LaboratoryBench, rng: np.random.Generator) -> dict[str, Any]:
        x = bench.column(column)
        size, place = rng.choice([-1, 1]) * rng.uniform(*SIZES), np.quantile(x, rng.uniform(0.3, 0.7))
        course = {"line": x, "line of ln": np.log(x), "step": (x > place) * 1.0}[form]
        course = size * (course - course.mean()) / np.ptp(course)
        change = np.outer(course, [1.0, 1.0])
        if off:
            change = change * (1 + off * bent(change, x, rng))[:, None]
        multiply(bench, change)
        return {
            "form": form, "column": column, "off": off, "percent": round(100 * float(np.expm1(size)), 4),
            "rms_percent": rms_percent(change, bench.tests),
        }  # fmt: skip

    return hide
