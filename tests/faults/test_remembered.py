"""Steps of a build that the bench does over from memory come to what they would have come to."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
import typst

from faults.file_operations import Fault
from faults.remembered import RememberedPages, RememberedSteps
from faults.small_site import Place
from faults.test_bench import place as place
from faults.trial import Outcome, in_child, state_of

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="the bench forks")


class Site:
    """A site with one step, which doubles a text and removes it; ``done`` tells how often it was really done."""

    def __init__(self, place: Place):
        self.place, self.real = place, place.root.parent / "done"
        self.steps = RememberedSteps(place.root.parent / "steps", place)

    def step(self) -> int:
        with self.real.open("a") as done:
            done.write("once\n")
        text, double = self.place.out / "current" / "text", self.place.out / "current" / "folder" / "double"
        double.parent.mkdir()
        double.write_text(2 * text.read_text())
        text.unlink()
        print("doubled")
        return 0

    def start(self, text: str, work: Callable[[], int], fault: Fault | None = None) -> Outcome:
        current = self.place.out / "current"
        for path in sorted(current.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
        current.mkdir(parents=True, exist_ok=True)
        (current / "text").write_text(text)
        return in_child(lambda: self.steps.done(["double"], work) or 0, self.place, fault, remembers=fault is None)

    @property
    def done(self) -> int:
        return len(self.real.read_text().splitlines())


def test_a_step_that_finds_the_same_comes_to_the_same_without_being_done(place: Place) -> None:
    site = Site(place)
    first = site.start("one", site.step)
    expected = state_of(place.out)
    again = site.start("one", site.step)
    assert site.done == 1
    assert state_of(place.out) == expected
    assert (again.status, again.said, again.seen) == (first.status, "doubled\n", first.seen)
    assert (place.out / "current" / "folder" / "double").read_text() == "oneone"


def test_a_step_that_finds_something_else_is_done(place: Place) -> None:
    site = Site(place)
    site.start("one", site.step)
    site.start("two", site.step)
    assert site.done == 2
    assert (place.out / "current" / "folder" / "double").read_text() == "twotwo"


def test_no_step_of_a_start_with_a_fault_comes_from_memory(place: Place) -> None:
    site = Site(place)
    first = site.start("one", site.step)
    failed = site.start("one", site.step, Fault(len(first.seen) - 1, "EIO"))
    assert site.done == 2
    assert failed.struck == first.seen[-1]


def test_a_step_after_an_error_comes_from_memory_unless_the_error_lasts(place: Place) -> None:
    site = Site(place)
    site.start("one", site.step)
    before = place.campaign / "tests.csv"

    def after_an_error() -> int:
        with suppress(OSError):
            before.stat()
        return site.steps.done(["double"], site.step) or 0

    for name, done in (("EIO", 1), ("ENOSPC", 2)):
        site.start("one", site.step)
        (place.out / "current" / "text").write_text("one")
        (place.out / "current" / "folder" / "double").unlink()
        (place.out / "current" / "folder").rmdir()
        ended = in_child(after_an_error, place, Fault(0, name))
        assert ended.struck is not None
        assert site.done == done


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="counts the threads of a process of Linux")
def test_typst_leaves_no_thread_in_a_process_that_is_going_to_fork(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(typst, "Compiler", typst.Compiler)  # what the bench replaces is put back afterwards
    RememberedPages(tmp_path / "pages.pickle")
    folder = tmp_path / "page"
    folder.mkdir()
    (folder / "page.typ").write_text("text")
    threads = os.listdir("/proc/self/task")
    page = typst.Compiler(root=folder).compile(folder / "page.typ", format="pdf")
    assert page.startswith(b"%PDF")
    assert os.listdir("/proc/self/task") == threads


def test_a_step_that_depends_on_other_files_of_a_site_is_an_error_of_the_bench(place: Place) -> None:
    site = Site(place)

    def looking() -> int:
        return len(list(place.out.iterdir())) - 1

    ended = site.start("one", looking)
    assert ended.status == 70
    assert "does not depend on results and records alone" in ended.said
