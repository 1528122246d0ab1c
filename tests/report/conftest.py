"""One synthetic study for the tests of the report."""

from __future__ import annotations

import pytest

from report.synthetic import make_study
from tribo.records import Study


@pytest.fixture(scope="session")
def study() -> Study:
    """Six samples, six loads, one repeat of three specimens; the last test and T9001 are set aside."""
    return make_study()
