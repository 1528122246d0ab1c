"""One synthetic study for the tests of figures."""

from __future__ import annotations

import pytest
from report.synthetic import make_study

from tribo.records import Study


@pytest.fixture(scope="session")
def study() -> Study:
    """Six samples, six loads, one repeat of three specimens; the last test and T9001 are set aside."""
    return make_study()


@pytest.fixture(scope="session")
def of_two() -> Study:
    """Two samples, two specimens, short records: figures of it are drawn in little time."""
    return make_study(samples=("F", "B"), n_specimens=2, n_samples=60)
