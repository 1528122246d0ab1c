"""What is looked up in a study: load levels, patterns that differ between x and y."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.comparison import findings
from tribo.records import Pattern


def test_loads_within_two_percent_are_one_level() -> None:
    loads = np.array([1.00, 0.5, 1.01, 2.0, 0.502])
    assert findings.load_levels(loads) == pytest.approx([1.005, 0.501, 1.005, 2.0, 0.501])
    assert findings.load_levels(np.array([])).shape == (0,)


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [
        (Pattern("F"), False),
        (Pattern("A", "circle", (5e-6, 5e-6), (2e-5, 2e-5)), False),
        (Pattern("S", "rectangle", (2e-4, 4e-5), (2.2e-4, 1.2e-4)), True),
        (Pattern("G", "square", (5e-6, 5e-6), (2e-5, 3e-5)), True),
    ],
)
def test_a_pattern_is_anisotropic_if_its_cavities_or_spacing_are(pattern: Pattern, expected: bool) -> None:
    assert findings.is_anisotropic(pattern) is expected
