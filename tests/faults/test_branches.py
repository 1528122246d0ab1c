"""A command that is forked before its file operations is judged as one that is started anew for each of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from support import first_quick

from faults.branches import branch_trials, can_branch
from faults.file_operations import KILL, Fault, Operation, errors_of
from faults.small_site import Place
from faults.test_bench import bench, careful, half_written, leaving, place as place, spoiling
from tribo.own_folder import only_writer

pytestmark = pytest.mark.skipif(not can_branch(), reason="needs file systems of its own: Linux, root")


def both(at: int, operation: Operation) -> list[str]:
    return [errors_of(operation.kind)[0], KILL]


@pytest.mark.parametrize("command", first_quick([half_written, careful, leaving, spoiling]))
def test_branches_find_what_single_starts_find(place: Place, tmp_path: Path, command: Callable[[Place], int]) -> None:
    tried = bench(place, command)
    faults = [Fault(at, name) for at, o in enumerate(tried.operations) for name in both(at, o)]
    alone = {fault: tried.trial(fault)[1] for fault in faults}
    assert {f: wrong for f, _, wrong in branch_trials(tried, both, tmp_path / "aside")} == alone
    assert any(alone.values()) == (command is not careful)


def appending(place: Place) -> int:
    """Write a file in two pieces, under a lock."""
    place.out.mkdir(exist_ok=True)
    with only_writer(place.out / ".lock"), (place.out / "log.txt").open("w", buffering=1) as log:
        log.write("one\n")
        log.write("two\n")
    return 0


def test_a_branch_writes_on_in_its_own_copy_of_an_open_file(place: Place, tmp_path: Path) -> None:
    tried = bench(place, appending)
    seen = []
    last = max(at for at, operation in enumerate(tried.operations) if operation.path == "out/log.txt")

    def judged(fault: Fault, outcome: object) -> list[str]:
        return [(place.out / "log.txt").read_text()]

    tried.judged = judged  # type: ignore[method-assign]
    for _, _, said in branch_trials(tried, lambda at, o: [KILL] if at == last else [], tmp_path / "aside"):
        seen += said
    assert seen == ["one\ntw"]  # half of the last write
    assert (place.out / "log.txt").read_text() == "one\ntwo\n"


def test_results_of_a_start_are_taken_over_only_where_it_read_the_same(place: Place) -> None:
    def copying(place: Place) -> int:
        place.out.mkdir(exist_ok=True)
        part = place.out / "part.txt"
        (place.out / "copy.txt").write_text(part.read_text() if part.exists() else "none")
        part.unlink(missing_ok=True)
        return 0

    tried = bench(place, copying)
    wrong = []
    for text in ("none", "half", "none"):
        place.out.mkdir(exist_ok=True)
        (place.out / "part.txt").write_text(text)
        wrong.append(bool(tried._mends()))
    assert wrong == [False, True, False]
