"""A command that is forked before its file operations: one branch for each fault, with a file system of its own.

The command runs once. Before an operation it forks: the branch goes on with the fault; the command waits until the
branch has ended and has been judged, and then goes on undisturbed. So a fault costs what comes after it, not what came
before. Each branch is in a mount namespace of its own, with an overlay on the watched folder: what it writes, no other
sees, and it is judged in there as well. Linux only, and only for root.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import pickle
import shutil
import signal
import tempfile
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from filelock import BaseFileLock

from faults.file_operations import Fault, Operation, real_os_open
from faults.trial import SLOW_S, Bench, Orders, Outcome, be_child

NEW_MOUNTS, PRIVATE = 0x20000, 0x44000  # CLONE_NEWNS; MS_REC | MS_PRIVATE
OF_OPENING = os.O_CREAT | os.O_EXCL | os.O_TRUNC
Wanted = Callable[[int, Operation], Sequence[str]]


def _checked(result: int) -> None:
    if result:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def _mount(source: str, target: str, kind: str | None, flags: int = 0, options: str | None = None) -> None:
    given = [text.encode() if text is not None else None for text in (source, target, kind, options)]
    _checked(_LIBC.mount(given[0], given[1], given[2], ctypes.c_ulong(flags), given[3]))


_LIBC = ctypes.CDLL(None, use_errno=True)


def overlay(root: Path, above: Path) -> None:
    """From now on this process, alone, sees its own copy of everything below ``root``; ``above`` is an empty folder."""
    _checked(_LIBC.unshare(NEW_MOUNTS))
    _mount("none", "/", None, PRIVATE)
    _mount("none", str(above), "tmpfs")
    for name in ("upper", "work"):
        os.mkdir(f"{above}/{name}")
    where = f"lowerdir={root},upperdir={above}/upper,workdir={above}/work,redirect_dir=on"
    _mount("none", str(root), "overlay", 0, where)


def can_branch() -> bool:
    """Whether this process may give its children file systems of their own."""
    if not hasattr(_LIBC, "unshare") or os.geteuid() != 0:
        return False
    with tempfile.TemporaryDirectory() as folder:
        for name in ("root", "above"):
            os.mkdir(f"{folder}/{name}")
        child = os.fork()
        if not child:
            try:
                overlay(Path(folder) / "root", Path(folder) / "above")
                os._exit(0)
            finally:
                os._exit(1)
        return os.waitpid(child, 0)[1] == 0


def _open_below(root: Path) -> dict[int, str]:
    """The open descriptors of this process below a folder, with their paths."""
    found = {}
    for name in os.listdir("/proc/self/fd"):
        try:
            path = os.readlink(f"/proc/self/fd/{name}")
        except OSError:
            continue
        if path.startswith(f"{root}/"):
            found[int(name)] = path
    return found


def _fork_with_locks() -> int:
    """A fork that keeps the locks of tribo, as the same command would: it passes by the hooks of Python, by which the
    workers of a command let them go. The branch is the same command: it does not count as another process to a lock."""
    if not (child := int(_LIBC.fork())):
        BaseFileLock._raise_if_inherited = lambda _: None  # type: ignore[method-assign]
    return child


def _reopen(below: dict[int, str]) -> None:
    """Let descriptors lead into the overlay, at the same place in the same files."""
    for descriptor, path in below.items():
        flags = fcntl.fcntl(descriptor, fcntl.F_GETFL) & ~OF_OPENING
        new = real_os_open(path, flags)
        if not flags & os.O_DIRECTORY:
            os.lseek(new, os.lseek(descriptor, 0, os.SEEK_CUR), os.SEEK_SET)
        os.dup2(new, descriptor, inheritable=False)
        os.close(new)


@dataclass(frozen=True)
class Stem:
    """What forks the command; lives in the child that runs it. ``reports`` lead to the judge, ``orders`` from it."""

    root: Path
    aside: Path
    wanted: Wanted
    reports: int
    orders: int

    def __call__(self, at: int, operation: Operation) -> Fault | None:
        """Fork for every fault that is wanted here; the fault in a branch, None in the command itself."""
        for name in self.wanted(at, operation):
            below = _open_below(self.root)
            if len(os.listdir("/proc/self/task")) > 1 or any(path.endswith(" (deleted)") for path in below.values()):
                self._report("alone", at, name)  # a fork has one thread, and deleted files cannot be opened again
                continue
            signal.alarm(0)  # a branch has its own
            if not (child := _fork_with_locks()):
                self._branch(at, name, operation, below)
                return Fault(at, name)
            _, ended = os.waitpid(child, 0)
            self._report("ended", os.waitstatus_to_exitcode(ended))
            self._wait()
        return None

    def _wait(self) -> None:
        if not os.read(self.orders, 1):
            os._exit(1)  # the judge has gone

    def _report(self, *words: object) -> None:
        os.write(self.reports, ("\t".join(map(str, words)) + "\n").encode("utf-8", "replace"))

    def _branch(self, at: int, name: str, operation: Operation, below: dict[int, str]) -> None:
        try:
            self._enter(below)
        except BaseException:
            with (self.aside / "said-in-branch").open("a") as said:
                said.write(traceback.format_exc())
            os._exit(70)
        self._report("ready", os.getpid(), at, name, operation.kind, operation.path)
        self._wait()
        os.dup2(real_os_open(os.devnull, os.O_WRONLY), self.reports)
        signal.alarm(SLOW_S)

    def _enter(self, below: dict[int, str]) -> None:
        here = os.getcwd()
        overlay(self.root, self.aside / "above")
        _reopen(below)
        os.chdir(here)
        shutil.copyfile(self.aside / "said", self.aside / "said-in-branch")
        said = real_os_open(self.aside / "said-in-branch", os.O_WRONLY | os.O_APPEND)
        for descriptor in (1, 2):
            os.dup2(said, descriptor)


def branch_trials(bench: Bench, wanted: Wanted, aside: Path) -> Iterator[tuple[Fault, Outcome, list[str]]]:
    """Every wanted fault of a command, how it came out and what of that does not hold, as ``bench.trial`` tells it.

    ``aside`` is a folder outside of the watched one, for what is printed.
    """
    shutil.rmtree(aside, ignore_errors=True)
    (aside / "above").mkdir(parents=True)
    reports, orders = os.pipe(), os.pipe()
    said = os.open(aside / "said", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    bench.reset()
    child = os.fork()
    if not child:
        os.close(orders[1])
        stem = Stem(bench.place.root, aside, wanted, reports[1], orders[0])
        be_child(bench.work, Orders(bench.place, branching=stem), said, os.open(os.devnull, os.O_WRONLY))
    for descriptor in (said, reports[1], orders[0]):
        os.close(descriptor)
    alone, space = [], None
    try:
        with os.fdopen(reports[0], encoding="utf-8", errors="replace") as lines:
            for line in lines:
                what, *words = line.rstrip("\n").split("\t")
                if what == "alone":
                    alone.append(Fault(int(words[0]), words[1]))
                elif what == "ready":
                    space = os.open(f"/proc/{words[0]}/ns/mnt", os.O_RDONLY)
                    fault, struck = Fault(int(words[1]), words[2]), Operation(words[3], words[4])
                    os.write(orders[1], b"g")
                else:
                    printed = (aside / "said-in-branch").read_text("utf-8", "replace")
                    assert space is not None, f"a branch did not begin: {printed}"
                    outcome = Outcome(int(words[0]), printed, struck)
                    wrong = _judged_in(space, bench, fault, outcome)
                    os.close(space)
                    space = None
                    os.write(orders[1], b"n")
                    yield fault, outcome, wrong
        _, ended = os.waitpid(child, 0)
        status = os.waitstatus_to_exitcode(ended)
        assert status == bench.expected.status, f"the command itself ended with {status}"
    finally:
        os.close(orders[1])
    for fault in alone:
        yield fault, *bench.trial(fault)


def _judged_in(space: int, bench: Bench, fault: Fault, outcome: Outcome) -> list[str]:
    """What does not hold in the file system of a branch, judged by a child that enters it."""
    answers = os.pipe()
    child = os.fork()
    if not child:
        try:
            _checked(_LIBC.setns(space, NEW_MOUNTS))
            known = len(bench.mended)
            answer = bench.judged(fault, outcome), bench.mended[known:]
        except BaseException:
            answer = [f"the judge failed: {traceback.format_exc()}"], []
        with os.fdopen(answers[1], "wb") as stream:
            pickle.dump(answer, stream)
        os._exit(0)
    os.close(answers[1])
    with os.fdopen(answers[0], "rb") as stream:
        wrong, mended = pickle.load(stream)
    os.waitpid(child, 0)
    bench.mended += mended
    return list(wrong)
