"""Faults at a few file operations of some commands; benchmarks/torture_faults.py tries every one of every command."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from faults.commands import prepared, warm
from faults.file_operations import KILL, Fault, Operation, errors_of
from faults.small_site import write_inputs
from faults.trial import Bench, Command

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="the bench forks")


def places(operations: list[Operation], kinds: list[str], per_kind: int) -> list[tuple[int, str]]:
    """A few operations of each kind, evenly spread, with their kind."""
    found = []
    for kind in kinds:
        of_kind = [n for n, operation in enumerate(operations) if operation.kind == kind]
        found += [(of_kind[len(of_kind) * (2 * k + 1) // (2 * per_kind)], kind) for k in range(per_kind) if of_kind]
    return found


def failures(bench: Bench, kinds: list[str], per_kind: int = 1) -> list[tuple[str, str, list[str]]]:
    """What did not hold at a few operations of each kind: one error each, and one kill for every three of them."""
    found = []
    for turn, (at, kind) in enumerate(places(bench.operations, kinds, per_kind)):
        names = errors_of(kind)
        for name in (names[turn % len(names)], *([KILL] if turn % 3 == 0 else [])):
            outcome, wrong = bench.trial(Fault(at, name))
            if wrong:
                found.append((name, str(outcome.struck), [*wrong, outcome.said[-300:]]))
    return found


@pytest.mark.slow
def test_ingest_withstands_a_fault_at_each_kind_of_file_operation(tmp_path: Path) -> None:
    place = write_inputs(tmp_path.resolve() / "watched")
    bench = warm(place, Command("ingest", ("ingest", str(place.campaign), "-o", str(place.out), "--jobs", "1")))
    kinds = ["stat", "list", "open to read", "read", "make folder", "open to write", "write", "rename"]
    assert bench.expected.status == 0
    assert {o.kind for o in bench.operations} >= set(kinds)
    assert failures(bench, kinds) == []


def test_a_limit_on_the_size_of_files_ends_a_simulation_with_a_sentence(tmp_path: Path) -> None:
    place = write_inputs(tmp_path.resolve() / "watched")
    runs = ("simulate", "--design", str(place.design), "-o", str(place.out / "runs.nc"), "--jobs", "1")
    bench = warm(place, Command("simulate --design", runs))
    assert bench.expected.status == 0
    largest = (place.out / "runs.nc").stat().st_size
    assert [(size, wrong) for size in (0, 600, largest - 1) if (wrong := bench.with_largest_file(size)[1])] == []


@pytest.mark.slow
def test_report_and_build_withstand_a_fault_at_each_kind_of_file_operation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import typst

    from tribo.report import drawings
    from tribo.site import build
    from tribo.springblock import SimConfig

    # what the bench replaces in this process is put back afterwards
    monkeypatch.setattr(typst, "Compiler", typst.Compiler)
    monkeypatch.setattr(build, "_snakemake", build._snakemake)
    monkeypatch.setattr(drawings, "_svg_and_points", drawings._svg_and_points)
    monkeypatch.setattr(SimConfig.__init__, "__defaults__", SimConfig.__init__.__defaults__)
    place = write_inputs(tmp_path.resolve() / "watched")
    commands = prepared(place, tmp_path.resolve())
    report = Bench(place, commands["report"])
    kinds = ["stat", "list", "open to read", "read", "make folder", "open to write", "write", "rename"]
    assert {o.kind for o in report.operations} >= set(kinds)
    assert failures(report, kinds) == []
    site = Bench(place, commands["build of the index"])
    assert {o.kind for o in site.operations} >= {*kinds, "link"}
    assert failures(site, [*kinds, "link"]) == []
