"""One command with one fault, in a forked child, and what is required of it afterwards."""

from __future__ import annotations

import errno
import os
import re
import resource
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import NoReturn

from faults.file_operations import KILL, KILLED, LASTING, Fault, Operation, watch
from faults.small_site import Place, hashes

SLOW_S = 1200
PAGE_BYTES = 4096
TEMPORARY_NAME = re.compile(r"\.(?P<name>.+?)(\.[^.]+)?\.part$")
# times, and what holds them as a hash: the marker of the index of a site
TIMES = re.compile(
    r'\d{4}-\d\d-\d\d[T ]\d\d:?\d\d(:?\d\d)?Z?|"seconds": [\d.]+|process \d+|(?<="index": ")[0-9a-f]{64}'
)

RANDOM = re.compile(r"(?<=\.)\d+(?=\.part$)|(?<=-)\w{8}(?=/|$)")  # process numbers, names of temporary folders


@dataclass(frozen=True)
class Command:
    """A command of tribo and what it starts from.

    ``ready`` is the folder that OUT is a copy of before every trial, None for no OUT; ``optional`` tells paths,
    relative to the watched folder, without which the result is complete (kept results).
    """

    name: str
    arguments: tuple[str, ...]
    ready: Path | None = None
    run: Callable[[Sequence[str]], int] | None = None


@dataclass
class Outcome:
    """How a run ended: exit status (negative: a signal), what it printed, and the operations it made."""

    status: int
    said: str
    struck: Operation | None = None
    seen: list[Operation] = field(default_factory=list)


def run_command(arguments: Sequence[str]) -> int:
    """tribo with these arguments, as from a shell; its exit status."""
    from tribo.cli import main

    sys.argv = ["tribo", *arguments]
    try:
        main(list(arguments), prog_name="tribo")
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(bool(ended.code))
    return 0


def in_child(
    work: Callable[[], int],
    place: Place,
    fault: Fault | None = None,
    largest_file: int | None = None,
    remembers: bool = False,
) -> Outcome:
    """Run ``work`` in a forked child with its file operations watched; everything it prints is read back.

    With ``largest_file`` (bytes) no file may grow beyond that, whoever writes it. Where it ``remembers``, steps of a
    build that have been done from the same state are done over from memory.
    """
    printed, listed = os.pipe(), os.pipe()
    child = os.fork()
    if child == 0:
        be_child(work, Orders(place, fault, largest_file, remembers=remembers), printed[1], listed[1])
    os.close(printed[1])
    os.close(listed[1])
    said, lines = _read_both(printed[0], listed[0])
    _, ended = os.waitpid(child, 0)
    struck, seen = None, []
    for kind, _, path in (line.partition("\t") for line in lines.splitlines()):
        if kind.startswith("!"):
            struck = Operation(kind[1:], path)
        else:
            seen.append(Operation(kind, path))
    return Outcome(os.waitstatus_to_exitcode(ended), said, struck, seen)


def _read_both(*pipes: int) -> list[str]:
    """Everything that comes out of pipes until all are closed."""
    found = dict.fromkeys(pipes, b"")
    with selectors.DefaultSelector() as ready:
        for pipe in pipes:
            ready.register(pipe, selectors.EVENT_READ)
        while ready.get_map():
            for key, _ in ready.select():
                pipe = key.fd
                if piece := os.read(pipe, 1 << 16):
                    found[pipe] += piece
                else:
                    ready.unregister(pipe)
                    os.close(pipe)
    return [content.decode("utf-8", "replace") for content in found.values()]


@dataclass(frozen=True)
class Orders:
    """What a child is to do beside its work."""

    place: Place
    fault: Fault | None = None
    largest_file: int | None = None
    branching: Callable[[int, Operation], Fault | None] | None = None
    remembers: bool = False


def be_child(work: Callable[[], int], orders: Orders, printed: int, listed: int) -> NoReturn:
    """Do the work in this process, which ends with it: what it prints to one descriptor, its operations to another."""
    status, report = 70, os.write
    try:
        os.dup2(printed, 1)
        os.dup2(printed, 2)
        sys.stdout, sys.stderr = (open(n, "w", encoding="utf-8", closefd=False) for n in (1, 2))  # noqa: SIM115
        signal.alarm(SLOW_S)
        os.environ |= {"TMPDIR": str(orders.place.temporary), "SOURCE_DATE_EPOCH": "1700000000"}
        tempfile.tempdir = None
        watched = watch(orders.place.root, orders.fault)
        watched.on_strike = lambda o: report(listed, f"!{o.kind}\t{o.path}\n".encode("utf-8", "replace"))
        watched.branching, watched.remembers = orders.branching, orders.remembers
        if orders.largest_file is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (orders.largest_file, resource.RLIM_INFINITY))
        status = work()
        sys.stdout.flush()
        sys.stderr.flush()
        lines = "".join(f"{o.kind}\t{o.path}\n" for o in watched.seen).encode("utf-8", "replace")
        while lines:
            lines = lines[report(listed, lines) :]
    except BaseException:
        report(2, traceback.format_exc().encode())
    finally:
        os._exit(status)


def state_of(out: Path) -> dict[str, str]:
    """Every file below OUT by place, hidden ones included, as a hash; times masked in records, locks left out.

    Logs are left out, too: they hold what the steps of a build have said.

    Of several dated copies the last one counts, and their numbers do not: one may show that a campaign was unusable.
    """
    found = {}
    for name, digest in (hashes(out) if out.exists() else {}).items():
        file = out.parent / name
        if "lock" in file.name or file.name == ".number" or "/.tribo/log/" in f"/{name}":
            continue
        found[masked(name)] = but_for_times(file, digest)
    return found


_KNOWN: dict[str, str] = {}  # by the hash of a file: that of its text without times


def but_for_times(file: Path, digest: str) -> str:
    """The hash of a file; of a record or page, that of its text without times."""
    if file.suffix not in (".json", ".html"):
        return digest
    if digest not in _KNOWN:
        text = TIMES.sub("", file.read_text("utf-8", "replace"))
        _KNOWN[digest] = sha256(text.encode()).hexdigest()
    return _KNOWN[digest]


@cache
def masked(name: str) -> str:
    """A path without times, process numbers and the random names of temporary folders.

    A second dated copy of one second has a number behind its time.
    """
    return RANDOM.sub("", re.sub(r"TIME-\d+", "TIME", TIMES.sub("TIME", name)))


def files_read(seen: Iterable[Operation]) -> set[str]:
    """The files, by masked path, that were read as they were at the start: not after they had been removed."""
    found, gone = set(), set()
    for operation in seen:
        name = masked(operation.path)
        if operation.kind in ("delete", "rename"):
            gone.add(name)
        elif operation.kind in ("open to read", "read") and name not in gone:
            found.add(name)
    return found


def leftovers(place: Place) -> list[str]:
    """Temporary files that are still there: beside results, and in the folder for temporary files of the system."""
    parts = [p for p in place.out.rglob("*") if p.name.endswith(".part")] if place.out.is_dir() else []
    return [str(p.relative_to(place.root)) for p in (*parts, *place.temporary.iterdir())]


@dataclass(frozen=True)
class Mended:
    """An undisturbed start from a state that a fault has left: what of its result does not hold.

    The start did not read the ``unread`` files, and replaced or removed them: from a state that differs in their
    contents only, it would have come to the same.
    """

    state: dict[str, str]
    unread: frozenset[str]
    wrong: list[str]

    def tells(self, state: dict[str, str]) -> bool:
        """Whether a start from this state comes to the same."""
        same = self.state.keys() == state.keys()
        return same and all(digest == state[name] for name, digest in self.state.items() if name not in self.unread)


@dataclass
class Bench:
    """Trials of one command; what an undisturbed start makes of a state of OUT is computed once per state."""

    place: Place
    command: Command
    expected: Outcome = field(init=False)
    result: dict[str, str] = field(init=False)
    inputs: dict[str, str] = field(init=False)
    written_bytes: int = field(init=False)
    mended: list[Mended] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.inputs = self._inputs()
        self.reset()
        self.expected = self._run_undisturbed()
        self.result = state_of(self.place.out)
        self.written_bytes = sum(p.stat().st_size for p in self.place.out.rglob("*") if p.is_file())

    @property
    def operations(self) -> list[Operation]:
        """Those of the undisturbed command, in order."""
        return self.expected.seen

    def trial(self, fault: Fault) -> tuple[Outcome, list[str]]:
        """Run the command with this fault from its first state; what was required and does not hold."""
        self.reset()
        outcome = self._run(fault)
        return outcome, self.judged(fault, outcome)

    def judged(self, fault: Fault, outcome: Outcome) -> list[str]:
        """What was required of a fault that came out so, and does not hold in the files as they now are."""
        if outcome.struck is None:
            return ["the operation was not reached"]
        wrong = self._killed(outcome) if fault.name == KILL else self._failed(outcome, fault)
        return [*wrong, *self._inputs_changed(), *self._mends()]

    def with_largest_file(self, size: int) -> tuple[Outcome, list[str]]:
        """The same where no file can grow beyond ``size`` bytes, whoever writes it."""
        self.reset()
        outcome = self._run(None, size)
        wrong = self._without_space(outcome, "EFBIG", ("out/", "tmp/"))
        return outcome, [*wrong, *self._inputs_changed(), *self._mends()]

    def on_full_disk(self, size: int) -> tuple[Outcome, list[str]]:
        """The same where OUT is a file system of ``size`` bytes; it has more of them at the next start. Root only."""
        self.reset()
        self.place.out.mkdir(exist_ok=True)
        with mounted(self.place.out, size) as mount:
            if self.command.ready is not None:
                shutil.copytree(self.command.ready, self.place.out, symlinks=True, dirs_exist_ok=True)
            outcome = self._run(None)
            wrong = self._without_space(outcome, "ENOSPC", ("out/",))
            mount(1 << 30)
            return outcome, [*wrong, *self._inputs_changed(), *self._mends()]

    def _without_space(self, outcome: Outcome, name: str, folders: tuple[str, ...]) -> list[str]:
        if outcome.status == self.expected.status and state_of(self.place.out) == self.result:
            return []
        said = " ".join(outcome.said.split())
        held = {
            "traceback": "Traceback" not in said and "Exception ignored" not in said,
            f"exit status {outcome.status}": outcome.status == 1,
            "no path": any(f"{self.place.root}/{folder}" in said for folder in folders),
            "no cause": names_cause(said, name),
            f"left over: {leftovers(self.place)[:3]}": not leftovers(self.place),
        }
        return [what for what, holds in held.items() if not holds]

    def _inputs_changed(self) -> list[str]:
        return [] if self._inputs() == self.inputs else ["an input was changed"]

    @property
    def ready_bytes(self) -> int:
        """What a file system needs for all that OUT holds at the start: whole pages, and one for each name."""
        ready = self.command.ready
        sizes = [p.stat().st_size if p.is_file() else 0 for p in ready.rglob("*")] if ready else []
        return sum(-(-size // PAGE_BYTES) + 1 for size in sizes) * PAGE_BYTES

    def reset(self) -> None:
        """OUT as it is before a trial, no temporary files."""
        for folder in (self.place.out, self.place.temporary):
            shutil.rmtree(folder, ignore_errors=True)
        self.place.temporary.mkdir()
        if self.command.ready is not None:
            shutil.copytree(self.command.ready, self.place.out, symlinks=True)

    def work(self) -> int:
        """The command, in this process; its exit status."""
        return (self.command.run or run_command)(self.command.arguments)

    def _run(self, fault: Fault | None, largest_file: int | None = None) -> Outcome:
        return in_child(self.work, self.place, fault, largest_file)

    def _run_undisturbed(self) -> Outcome:
        return in_child(self.work, self.place, remembers=True)

    def _inputs(self) -> dict[str, str]:
        return {name: digest for folder in self.place.inputs for name, digest in hashes(folder).items()}

    def _killed(self, outcome: Outcome) -> list[str]:
        return [] if outcome.status == KILLED else [f"exit status {outcome.status} in place of a kill"]

    def _failed(self, outcome: Outcome, fault: Fault) -> list[str]:
        assert outcome.struck is not None
        wrong = []
        said = " ".join(outcome.said.split())
        if "Traceback" in said or "Exception ignored" in said:
            wrong.append("traceback")
        named, caused = names_path(said, outcome.struck.path, self.place), names_cause(said, fault.name)
        if fault.name in LASTING:  # later attempts fail, too; one of them may be what is reported
            named = named or f"{self.place.root}/" in said
        same = outcome.status == self.expected.status and state_of(self.place.out) == self.result
        if same:
            logged = " ".join((said, *self._logs().split()))
            named = named or names_path(logged, outcome.struck.path, self.place)
            caused = caused or names_cause(logged, fault.name)
            if not (named and caused) and _wanted(outcome.struck):
                wrong.append("done in silence")
        elif outcome.status == 3 and outcome.struck.path.startswith(("campaign/raw/", "drop/")):
            named = named or "tests.csv, row" in said
            wrong += [] if named and caused else ["set aside without path and cause"]
        elif outcome.status != 1:
            wrong.append(f"exit status {outcome.status}")
        else:
            wrong += [what for what, said_so in (("no path", named), ("no cause", caused)) if not said_so]
        left = [] if outcome.struck.path.startswith("tmp/") else leftovers(self.place)  # an error of tidying up
        if left and not (fault.name in ("EROFS", "EACCES") or outcome.struck.kind == "delete"):
            wrong.append(f"left over: {', '.join(left[:3])}")
        return wrong

    def _logs(self) -> str:
        """What the steps of a build have said."""
        logs = sorted((self.place.out / ".tribo" / "log").rglob("*.log"))
        return "\n".join(log.read_text("utf-8", "replace") for log in logs)

    def _mends(self) -> list[str]:
        """What does not hold after an undisturbed start from the present state."""
        state = self._state()
        known = next((mended for mended in self.mended if mended.tells(state)), None)
        if known is None:
            again = self._run_undisturbed()
            after = self._state()
            replaced = {name for name, digest in state.items() if after.get(name) != digest}
            unread = frozenset(replaced - files_read(again.seen))
            known = Mended(state, unread, self._not_mended(again))
            self.mended.append(known)
        return known.wrong

    def _not_mended(self, again: Outcome) -> list[str]:
        if again.status != self.expected.status:
            return [f"the next start ends with {again.status}: {again.said.strip()[-300:]}"]
        if (found := state_of(self.place.out)) != self.result:
            names = [n for n in {*found, *self.result} if found.get(n) != self.result.get(n)]
            return [f"the next start makes something else of {', '.join(sorted(names)[:4])}"]
        left = leftovers(self.place)
        return [f"left over after the next start: {', '.join(left[:3])}"] if left else []

    def _state(self) -> dict[str, str]:
        """Everything that a start finds: results with their hashes, temporary files by name."""
        names = (str(path.relative_to(self.place.root)) for path in self.place.temporary.rglob("*"))
        return state_of(self.place.out) | {masked(name): "" for name in names}


@contextmanager
def mounted(folder: Path, size: int) -> Iterator[Callable[[int], object]]:
    """A file system of ``size`` bytes at ``folder`` while this lasts; yields what gives it another size."""

    def mount(*how: str) -> None:
        subprocess.run(["mount", "-t", "tmpfs", "-o", *how, "none", str(folder)], check=True, capture_output=True)

    mount(f"size={size}")
    try:
        yield lambda more: mount(f"remount,size={more}")
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def _wanted(operation: Operation) -> bool:
    """Whether a user has to be told that an operation failed although the result is complete: a file was not read."""
    return operation.kind in ("open to read", "read")


def names_path(said: str, path: str, place: Place) -> bool:
    """Whether a message names the path, its folder in full, or what a temporary file was going to be."""
    temporary = TEMPORARY_NAME.match(Path(path).name)
    shown = [str(place.root / path), path, Path(path).name]
    shown += [temporary["name"]] if temporary else []
    if path.startswith("tmp/"):
        shown += [str(place.temporary)]
    return any(text in said for text in shown)


def names_cause(said: str, name: str) -> bool:
    """Whether a message gives the cause in the words of the operating system."""
    return os.strerror(getattr(errno, name)).lower() in said.lower()
