"""The statistics of a measured over a simulated force."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.comparison.findings import welch_dof


def test_degrees_of_freedom_join_by_welch_and_satterthwaite() -> None:
    assert welch_dof((1.0, 2.0), (1.0, 2.0)) == pytest.approx(4.0)
    assert welch_dof((1.0, 5.0), (0.0, 0.0)) == pytest.approx(5.0)
    assert welch_dof((0.0, 3.0)) == float("inf")
    assert np.isnan(welch_dof((1.0, 0.0), (1.0, 4.0)))
