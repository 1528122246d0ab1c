"""Costly work of a command under test that is done once: pages of typst, figures, and steps of an undisturbed build."""

from __future__ import annotations

import hashlib
import io
import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from faults import file_operations
from faults.file_operations import Operation, Watch, real_listdir, real_open
from faults.small_site import Place
from faults.trial import but_for_times, masked

T = TypeVar("T")


class Remembered:
    """Results by key, in a file that the processes of a bench share."""

    def __init__(self, file: Path):
        self.file = file
        self.known: dict[str, Any] = {}
        self.read()

    def read(self) -> None:
        """What other processes have made since."""
        self.known |= _kept_in(self.file) or {}

    def made(self, key: str, make: Callable[[], T]) -> T:
        """What this process or another has made, or else will make now."""
        if key not in self.known:
            self.read()
        if key not in self.known:
            self.known[key] = make()
            _keep(self.known, self.file)
        found: T = self.known[key]
        return found


def _keep(value: Any, file: Path) -> None:
    """Write a value, so that no process reads half of it."""
    whole = file.with_name(f"{file.name}-{os.getpid()}")
    with real_open(whole, "wb") as stream:
        pickle.dump(value, stream)
    os.replace(whole, file)


def _kept_in(file: Path) -> Any:
    """The value that a file keeps; None without the file."""
    if not file.is_file():
        return None
    with real_open(file, "rb") as stream:
        return pickle.load(stream)


class RememberedPages(Remembered):
    """typst, with the pages that it has set before: setting them takes most of the time of a report.

    The files for typst are written all the same; typst itself is asked only for pages that it has not set yet.
    """

    def __init__(self, file: Path):
        import typst

        super().__init__(file)
        typst.Compiler = lambda root, **options: _Page(self, Path(root), options)  # type: ignore[misc, assignment]


class _Page:
    def __init__(self, pages: RememberedPages, root: Path, options: dict[str, Any]):
        self.pages, self.root, self.options = pages, root, options

    def compile(self, source: Path, **options: Any) -> bytes:
        key = hashlib.sha256(repr((source.name, sorted(options.items()))).encode())
        for name in sorted(real_listdir(self.root)):
            with real_open(self.root / name, "rb") as file:
                key.update(name.encode() + b"\0" + file.read())

        def make() -> bytes:
            asked = pickle.dumps((self.root, self.options, source, options))
            return subprocess.run(
                [sys.executable, "-c", _SETTING], input=asked, stdout=subprocess.PIPE, check=True
            ).stdout

        return self.pages.made(key.hexdigest(), make)


# In a process of its own: typst starts threads. A fork of this process does not have those that it started before, and
# would wait for them for ever.
_SETTING = """
import pickle, sys, typst
root, how, source, options = pickle.load(sys.stdin.buffer)
sys.stdout.buffer.write(typst.Compiler(root=root, **how).compile(source, **options))
"""


class RememberedFigures(Remembered):
    """Figures that have been drawn before: drawing reads and writes no file of the bench. They are written as ever."""

    def __init__(self, file: Path):
        from tribo.kept_results import fingerprint
        from tribo.report import drawings

        super().__init__(file)
        real = drawings._svg_and_points

        def drawn(record: Any, numbers: Any, origin: str) -> Any:
            key = fingerprint((numbers, record.title, origin))
            return self.made(key, lambda: real(record, numbers, origin))

        drawings._svg_and_points = drawn


OF_STEPS = ("out/current", "out/.tribo", "out/campaign.toml")  # what a step reads and writes of a site
NOT_OF_STEPS = ("out/.tribo/lock", "out/.tribo/log")
JOURNAL = ("out/.tribo/log", "out/.tribo/log/steps.jsonl")  # a step adds a line, and none reads it
FOLDER = "folder"


@dataclass(frozen=True)
class Step:
    """What a step of a build has done: the files below the watched folder that it made or changed, with their
    contents (None: a folder), and those that it removed."""

    status: int | None
    said: str
    seen: list[Operation]
    made: dict[str, bytes | None]
    removed: list[str]


class RememberedSteps:
    """Steps of a build. One that starts without a fault and is known from the same state is done over from memory.

    The state is that of all results and records of the site, but for times, and of temporary files. The file
    operations of the step count as if it had been done. Errors that do not last, of earlier steps and of the build
    itself, cannot reach a step, which is a process of its own.
    """

    def __init__(self, folder: Path, place: Place):
        self.folder, self.root, self.temporary = folder, place.root, place.temporary
        folder.mkdir()

    def done(self, words: Sequence[str], work: Callable[[], int | None]) -> int | None:
        """Do a step, or have it done over; its exit status."""
        watched = file_operations.current
        if watched is None or not watched.is_undisturbed:
            return work()
        with watched.unseen():
            before = self._entries()
            file = self.folder / self._key(words, before)
            known: Step | None = _kept_in(file)
        if known is None:
            return self._first(work, watched, before, file)
        with watched.unseen():
            self._do_over(known)
        watched.seen += known.seen
        print(known.said, end="")
        return known.status

    def _first(self, work: Callable[[], int | None], watched: Watch, before: dict[str, str], file: Path) -> int | None:
        at, said = len(watched.seen), io.StringIO()
        try:
            with redirect_stdout(said), redirect_stderr(said):
                status = work()
        finally:
            print(said.getvalue(), end="")
        seen = watched.seen[at:]
        strange = [o for o in seen if not _is_of_steps(o)]
        assert not strange, f"a step does not depend on results and records alone: {strange[:5]}"
        with watched.unseen():
            after = self._entries()
            changed = [name for name, digest in after.items() if before.get(name) != digest]
            made = {name: self._content(name, after[name]) for name in changed}
            _keep(Step(status, said.getvalue(), seen, made, sorted(before.keys() - after.keys())), file)
        return status

    def _content(self, name: str, digest: str) -> bytes | None:
        return None if digest == FOLDER else (self.root / name).read_bytes()

    def _do_over(self, step: Step) -> None:
        for name in step.removed:
            path = self.root / name
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
        for name, content in sorted(step.made.items()):
            path = self.root / name
            if content is None:
                path.mkdir(parents=True, exist_ok=True)
            else:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)

    def _entries(self) -> dict[str, str]:
        """Every file and folder that a step may find, by place, with a hash of the contents."""
        found = {}
        for folder in (*(self.root / name for name in OF_STEPS), self.temporary):
            for path in (folder, *folder.rglob("*")):
                name = str(path.relative_to(self.root))
                if path.exists() and not name.startswith(NOT_OF_STEPS):
                    found[name] = FOLDER if path.is_dir() else hashlib.sha256(path.read_bytes()).hexdigest()
        return found

    def _key(self, words: Sequence[str], entries: dict[str, str]) -> str:
        state = {masked(name): self._as_found(name, digest) for name, digest in entries.items()}
        return hashlib.sha256(repr((list(words), sorted(state.items()))).encode()).hexdigest()

    def _as_found(self, name: str, digest: str) -> str:
        if name.startswith("tmp/") or name.endswith("lock"):
            return ""
        return digest if digest == FOLDER else but_for_times(self.root / name, digest)


def _is_of_steps(operation: Operation) -> bool:
    """Whether an operation leaves aside all that is not part of the state: other files of a site."""
    path = operation.path
    if path in JOURNAL:
        return True
    if path.startswith(NOT_OF_STEPS):
        return False
    looked_at = operation.kind == "stat" and "out".startswith(path)
    return looked_at or not path.startswith("out") or path.startswith(OF_STEPS)
