"""The bench of injected faults notices what it is there to notice: toy commands that do each thing wrong."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from faults.file_operations import KILL, Fault, Operation, errors_of
from faults.small_site import Place
from faults.trial import Bench, Command

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="the bench forks")


@pytest.fixture
def place(tmp_path: Path) -> Place:
    place = Place(tmp_path.resolve() / "watched")
    for folder in (place.campaign, place.drop, place.design.parent, place.temporary):
        folder.mkdir(parents=True)
    (place.campaign / "tests.csv").write_text("as measured", encoding="utf-8")
    return place


def said(why: OSError) -> int:
    print(f"{why.filename}: {why.strerror}", file=sys.stderr)
    return 1


def careful(place: Place) -> int:
    """Read a file, and write what it says whole or not at all; errors with path and cause."""
    source, target = place.campaign / "tests.csv", place.out / "copy.txt"
    part = target.with_name(".copy.txt.part")
    try:
        current = source
        text = source.read_text(encoding="utf-8")
        current = target
        place.out.mkdir(exist_ok=True)
        try:
            part.write_text(text * 2, encoding="utf-8")
            os.replace(part, target)
        except OSError:
            part.unlink(missing_ok=True)
            raise
    except OSError as why:
        why.filename = why.filename or str(current)
        return said(why)
    return 0


def swallowing(place: Place) -> int:
    careful(place)
    return 0


def half_written(place: Place) -> int:
    """Write under the final name; take what is there as finished."""
    target = place.out / "copy.txt"
    if target.exists():
        return 0
    place.out.mkdir(exist_ok=True)
    target.write_text((place.campaign / "tests.csv").read_text(encoding="utf-8") * 2, encoding="utf-8")
    return 0


def leaving(place: Place) -> int:
    place.out.mkdir(exist_ok=True)
    part = place.out / ".copy.txt.part"
    try:
        part.write_text("text", encoding="utf-8")
        os.replace(part, place.out / "copy.txt")
    except OSError as why:
        why.filename = why.filename or str(part)
        return said(why)
    return 0


def nameless(place: Place) -> int:
    try:
        return half_written(place)
    except OSError as why:
        print(f"failed: {why.strerror}", file=sys.stderr)
        return 1


def spoiling(place: Place) -> int:
    try:
        return careful(place)
    finally:
        if not (place.out / "copy.txt").is_file():
            (place.campaign / "tests.csv").write_text("changed", encoding="utf-8")


def bench(place: Place, command: Callable[[Place], int]) -> Bench:
    def run(arguments: Sequence[str]) -> int:
        return command(place)

    return Bench(place, Command("toy", (), run=run))


def at(operations: Sequence[Operation], kind: str) -> int:
    return next(n for n, operation in enumerate(operations) if operation.kind == kind)


def wrong(place: Place, command: Callable[[Place], int], kind: str, name: str) -> str:
    tried = bench(place, command)
    return "; ".join(tried.trial(Fault(at(tried.operations, kind), name))[1])


def test_a_careful_command_holds_at_every_operation(place: Place) -> None:
    tried = bench(place, careful)
    faults = [Fault(n, name) for n, o in enumerate(tried.operations) for name in errors_of(o.kind)]
    kinds = {"open to read", "read", "make folder", "open to write", "write", "rename"}
    assert {o.kind for o in tried.operations} >= kinds
    assert [(fault, held) for fault in faults if (held := tried.trial(fault)[1])] == []


def test_a_swallowed_error_is_noticed(place: Place) -> None:
    assert "exit status 0" in wrong(place, swallowing, "write", "ENOSPC")


def test_a_traceback_is_noticed(place: Place) -> None:
    assert "traceback" in wrong(place, half_written, "write", "ENOSPC")


def test_a_half_written_file_that_the_next_start_trusts_is_noticed(place: Place) -> None:
    assert "the next start makes something else" in wrong(place, half_written, "write", KILL)


def test_a_temporary_file_that_stays_is_noticed(place: Place) -> None:
    assert "left over" in wrong(place, leaving, "write", "ENOSPC")


def test_a_message_without_a_path_is_noticed(place: Place) -> None:
    assert "no path" in wrong(place, nameless, "write", "ENOSPC")


def test_a_changed_input_is_noticed(place: Place) -> None:
    assert "an input was changed" in wrong(place, spoiling, "open to write", "EIO")


def test_a_limit_on_the_size_of_files_is_noticed_where_it_is_swallowed(place: Place) -> None:
    assert "exit status 0" in "; ".join(bench(place, swallowing).with_largest_file(4)[1])
    assert bench(place, careful).with_largest_file(4)[1] == []
