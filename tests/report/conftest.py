"""One synthetic study for the tests of the report, and one report of it, written once."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from report.synthetic import make_study
from tribo.records import Study
from tribo.report import Provenance, write_report

Once = Callable[[str, Callable[[Path], object]], Path]
PROVENANCE = Provenance("tribo report 'a b' -o out", "2026-01-01T00:00:00", 3, {"rule": "first_peak"})


class Written(NamedTuple):
    """A written report: its folder and what progress was told meanwhile."""

    out: Path
    told: list[tuple[str, int, int]]


@pytest.fixture(scope="session")
def study() -> Study:
    """Six samples, six loads, one repeat of three specimens; the last test and T9001 are set aside."""
    return make_study()


@pytest.fixture(scope="session")
def of_two() -> Study:
    """Two samples, two specimens, short records."""
    return make_study(samples=("F", "B"), n_specimens=2, n_samples=60)


@pytest.fixture(scope="session")
def measured(of_two: Study) -> Study:
    """Only what was measured on two samples: seven figures that are drawn in little time."""
    return replace(of_two, comparison=None, fits=(), other_fits=(), example_runs=())


@pytest.fixture(scope="session")
def written(study: Study, once: Once) -> Written:
    """The whole report of the study."""

    def write(folder: Path) -> None:
        told: list[tuple[str, int, int]] = []
        write_report(study, folder / "out", lambda *step: told.append(step), PROVENANCE)
        (folder / "told.json").write_text(json.dumps(told), encoding="utf-8")

    folder = once("written_report", write)
    return Written(folder / "out", [tuple(step) for step in json.loads((folder / "told.json").read_text("utf-8"))])
