"""What all commands share: given paths, the output folder, results and progress, faults as text or JSON, exit statuses.

Results go to standard output, everything else to standard error. Faults are listed, equal ones once with their number,
one example in full and the tests they concern. Nothing ends with a traceback.
"""

from __future__ import annotations

import functools
import io
import json
import logging
import math
import os
import re
import shlex
import shutil
import signal
import stat
import sys
import textwrap
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.errors import OF_THE_SYSTEM, Problem, TriboError, failed_by_system, system_problem, unexpected
from tribo.kept_results import DamagedResultWarning
from tribo.own_folder import BusyError, own_folder
from tribo.records import Doubt, SetAside
from tribo.user_text import nearest, printable

if TYPE_CHECKING:
    from tribo.dry_run import Checked
    from tribo.records import Study
    from tribo.report.provenance import Provenance
    from tribo.stages import StudyOptions


class GivenPath(click.Path):
    """A path that exists. Errors of the system other than its absence are named as such, with exit status 1."""

    def __init__(self, *, file_okay: bool = True, dir_okay: bool = True):
        super().__init__(exists=True, file_okay=file_okay, dir_okay=dir_okay, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        _refuse_not_utf8(value)
        try:
            is_folder = stat.S_ISDIR(os.stat(value).st_mode)
        except (FileNotFoundError, NotADirectoryError):
            if near := _beside(Path(value)):
                self.fail(f"{value!r} does not exist; did you mean {near}?", param, ctx)
            return super().convert(value, param, ctx)  # click says so
        except OSError as why:
            raise click.ClickException(f"{value}: {(why.strerror or str(why)).lower()}") from why
        if self.dir_okay if is_folder else self.file_okay:
            return Path(value)
        return super().convert(value, param, ctx)


class FolderPath(click.Path):
    """A folder of results, there or not."""

    def __init__(self) -> None:
        super().__init__(file_okay=False, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        _refuse_not_utf8(value)
        return super().convert(value, param, ctx)


def _refuse_not_utf8(value: Any) -> None:
    """End with a sentence where a place cannot be written down: records, pages and HDF5 files hold it as UTF-8."""
    place = os.path.abspath(os.fspath(value))
    try:
        place.encode()
    except UnicodeEncodeError as why:
        raise click.ClickException(f"{printable(place)}: this path is not UTF-8; rename its folder or file") from why


class ExportPath(GivenPath):
    """A path that exists; or one that goes on into a file, as ``all.zip/a.csv``, or chooses from it, as ``a.csv#2``."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = Path(value)
        within = Path(str(value).rpartition("#")[0]).is_file() or any(p.is_file() for p in path.parents)
        return path if within and not path.exists() else super().convert(value, param, ctx)


def _beside(path: Path) -> Path | None:
    """The file or folder beside ``path`` whose name is nearest to its name."""
    try:
        names = [p.name for p in path.parent.iterdir() if not p.name.startswith(".")]
    except OSError:
        return None
    near = nearest(path.name, names)
    return path.parent / near if near else None


FEWEST_GROUPED = 3  # equal faults fewer than this are listed one by one
LONGEST_LIST = 160  # characters of the tests listed below an example
_SAME_BEGINNING = 24  # characters by which two sentences of one kind count as the same


def faults_text(problems: Sequence[Problem], *, all_of_them: bool = False) -> str:
    """The problems, equal ones grouped: an example in full, then the others by test or row."""
    groups: dict[object, list[Problem]] = {}  # of one kind in one column, in the order of their first
    for problem in problems:
        groups.setdefault(_key(problem), []).append(problem)
    lines = []
    for group in groups.values():
        full = [f"{p.test_id + ': ' if p.test_id else ''}{p}" for p in group]
        if all_of_them or len(group) < FEWEST_GROUPED:
            lines += [f"  {text}" for text in full]
        else:
            lines += [f"  {len(group)} times, for example {full[0]}", f"    also {_others(group[1:])}"]
    return "\n".join(lines)


def doubts_text(doubts: Sequence[Doubt]) -> str:
    """Doubtful numbers, those that one slip explains together with it."""
    by_slip: dict[str, list[Doubt]] = {}
    for doubt in doubts:
        by_slip.setdefault(doubt.slip, []).append(doubt)
    lines = []
    for slip, together in by_slip.items():
        lines += [f"  {doubt.without_slip()}" for doubt in together]
        lines += [f"    likely slip: {slip}"] if slip else []
    return "\n".join(lines)


def set_aside_text(tests: Sequence[SetAside], *, all_of_them: bool = False) -> str:
    """Tests with their reasons; those with an equal fault once, with an example and the other tests."""
    groups: dict[object, list[SetAside]] = {}
    for test in tests:
        key = tuple(map(_key, test.problems)) or test.reason
        groups.setdefault(key, []).append(test)
    lines = []
    for group in groups.values():
        if all_of_them or len(group) < FEWEST_GROUPED:
            lines += [f"  {test.test_id}: {test.reason}" for test in group]
        else:
            others = _listed([test.test_id for test in group[1:]])
            lines += [
                f"  {len(group)} tests, for example {group[0].test_id}: {group[0].reason}", f"    also {others}"
            ]  # fmt: skip
    return "\n".join(lines)


def _key(problem: Problem) -> tuple[object, ...]:
    what = re.sub(r"^sample [^:]*: ", "", problem.what)
    return problem.kind, problem.column, re.sub(r"\d+", "#", what)[:_SAME_BEGINNING]


def _others(problems: Sequence[Problem]) -> str:
    if all(p.test_id for p in problems):
        return _listed([str(p.test_id) for p in problems])
    if all(p.row is not None for p in problems):
        return "in rows " + _listed([str(p.row) for p in problems])
    return _listed([str(p.file or p.column or p.found or p.what.partition(":")[0]) for p in problems])


def _listed(names: Sequence[str]) -> str:
    """As many names as fit, then how many more there are."""
    names = list(dict.fromkeys(names))
    shown: list[str] = []
    for name in names:
        if shown and sum(len(n) + 2 for n in (*shown, name)) > LONGEST_LIST:
            break
        shown.append(name)
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {more} more (-v lists all)" if more else "")


@contextmanager
def damage_said(say: Callable[[str], None]) -> Iterator[None]:
    """Say it as a line where a kept result is damaged and made again; other warnings are shown as ever."""
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
            if issubclass(category, DamagedResultWarning):
                say(f"warning: {message}")
            else:
                shown(message, category, *more, **named)

        warnings.showwarning = show
        yield


@contextmanager
def ended_by_terminate() -> Iterator[None]:
    """Let SIGTERM end the command as Ctrl-C does, so that nothing is left half written.

    Further ones are ignored: a build and Snakemake both ask a step to end, and the second request must not interrupt
    the removal of unfinished files.
    """
    process = os.getpid()

    def interrupt(number: int, _: Any) -> None:
        signal.signal(number, signal.SIG_IGN)
        if os.getpid() != process:  # a forked worker tidies up and ends; the command speaks for all
            raise SystemExit(128 + number)
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, interrupt)
    except ValueError:  # not in the main thread, where signals arrive
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def dry_run_text(found: Checked, out: Path, *, all_of_them: bool) -> str:
    """The result of a dry run but for the faults; equal ones are grouped unless ``all_of_them`` are asked for."""
    parts = [f"would {step}" for step in found.steps]
    if not found.faults:
        parts.append(f"would write into {out}")
    findings = findings_text(replace(found, faults=()), all_of_them=all_of_them)
    parts += [findings] if findings else []
    if not found.faults:
        clean = not (found.set_aside or found.doubts or found.used_with_doubts)
        parts.append(f"checked: {found.tests} tests can be used{'; nothing is doubtful' if clean else ''}")
    return "\n".join(parts)


def findings_text(found: Checked, *, all_of_them: bool) -> str:
    """Faults, doubtful numbers, tests set aside or used with doubts, and notes; empty where there is nothing to say."""
    parts = []
    groups = (
        ("fault", "", faults_text(found.faults, all_of_them=all_of_them), found.faults),
        ("doubtful number", "", doubts_text(found.doubts), found.doubts),
        ("test", "would be set aside", set_aside_text(found.set_aside, all_of_them=all_of_them), found.set_aside),
        ("test", "would be used with doubts", set_aside_text(found.used_with_doubts, all_of_them=all_of_them),
         found.used_with_doubts),
        ("note", "", faults_text(found.notes, all_of_them=all_of_them), found.notes),
    )  # fmt: skip
    for noun, what, text, items in groups:
        if items:
            number = f"{len(items)} {noun}{'s' if len(items) != 1 else ''}"
            parts.append(f"{number}{f' {what}' if what and noun == 'test' else ''}:\n{text}")
    return "\n".join(parts)


FOLDER = FolderPath()
FORCE = click.option(
    "--force", is_flag=True,
    help="Write even where there are files that tribo has not written; those of the same name are replaced.",
)  # fmt: skip
WAIT = click.option(
    "--wait", "wait_s", default=0.0, show_default=True,
    help="Seconds to wait if another process is writing there.",
)  # fmt: skip


def output_options(default: str | None = None) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add -o, --force and --wait to a command."""
    out = click.option(
        "-o", "--out", type=FOLDER, required=default is None, default=default, show_default=default is not None,
        help="Output folder.",
    )  # fmt: skip
    return lambda function: out(FORCE(WAIT(function)))


def provenance_of_run(study: Study, campaign: Path, chosen: StudyOptions) -> Provenance:
    """Provenance of a study run by this command."""
    from tribo.report import gather_provenance

    options = {**chosen.as_words(), "flat": study.ingested.campaign.flat_sample}
    if study.simulated is None:
        del options["runs"]  # nothing was simulated
    return gather_provenance(
        study,
        command=command_line(),
        seed=chosen.seed,
        started_at=now(),
        options=options,
        campaign=campaign,
        overrides=chosen.overrides,
    )


def command_line() -> str:
    return shlex.join(["tribo", *sys.argv[1:]])


def now() -> str:
    """The time of this run, or that of SOURCE_DATE_EPOCH (reproducible-builds.org) where it is set."""
    return (fixed_date() or datetime.now(UTC)).isoformat(timespec="seconds")


def fixed_date() -> datetime | None:
    """The time of SOURCE_DATE_EPOCH, None where it is not set. Raises TriboError where it is no time.

    numpy and other libraries read it, too, and would stop at another place. An empty one, at which they stop as well,
    is taken away.
    """
    fixed = os.environ.get("SOURCE_DATE_EPOCH")
    if fixed == "":
        del os.environ["SOURCE_DATE_EPOCH"]
    try:
        return datetime.fromtimestamp(int(fixed), UTC) if fixed else None
    except (ValueError, OverflowError, OSError):
        what = "the environment variable SOURCE_DATE_EPOCH is no time"
        allowed = "seconds since 1 January 1970, as a whole number, or nothing"
        raise TriboError(Problem("environment", what, found=fixed, allowed=allowed)) from None


def open_streams() -> None:
    """Open what is closed of the three standard streams, so that no file of results gets the number of one of them; and
    let a stream show what its encoding has no sign for as "?"."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
        if mode == "w" and isinstance(stream := getattr(sys, name), io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _drop(number: int) -> None:
    """Let what is still to be written to a stream that takes nothing go nowhere, or the end of Python fails on it."""
    with suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), number)


DONE, UNUSABLE, SOME_SET_ASIDE = 0, 1, 3
INTERRUPTED = 130
BUSY = 75  # EX_TEMPFAIL of sysexits.h: nothing is wrong, try again later


@dataclass(frozen=True)
class Console:
    """Output of a command: results to standard output, everything else to standard error; and files into its folder.

    With ``force`` a folder is written to that holds files of others; where another process writes, ``wait_s`` is how
    long it waits.
    """

    as_json: bool = False
    verbosity: int = 0
    force: bool = False
    wait_s: float = 0.0

    def taken(self, out: Path, *inputs: Path, shared: bool = False) -> AbstractContextManager[Path]:
        """The output folder, held as its only writer; or ``shared`` with others that only add kept results."""
        return own_folder(out, inputs, force=self.force, wait_s=self.wait_s, shared=shared)

    def say(self, text: str, *, level: int = 0) -> None:
        """Print a line to standard error; level 1 is shown only with -v, level -1 even with -q."""
        if self.verbosity >= level:
            try:
                click.echo(printable(text), err=True)
            except BrokenPipeError:
                raise
            except OSError:  # a full device: results are worth more than messages
                _drop(2)

    def list_tests(self, what: str, tests: Sequence[SetAside], *, level: int = 0) -> None:
        """The tests of one kind with their reasons, equal ones grouped; nothing where there are none."""
        if tests:
            lines = set_aside_text(tests, all_of_them=self.verbosity > 0)
            self.say(f"{len(tests)} test{'s' if len(tests) != 1 else ''} {what}:\n{lines}", level=level)

    def status_after(self, set_aside: Sequence[SetAside]) -> int:
        """The exit status of finished work, once the tests that were set aside are listed, even with -q."""
        self.list_tests("set aside", set_aside, level=-1)
        return status_of(set_aside)

    def list_problems(self, problems: Sequence[Problem]) -> None:
        """What stands in the way, equal ones grouped; shown even with -q, nothing where there is none."""
        if problems:
            lines = faults_text(problems, all_of_them=self.verbosity > 0)
            self.say(f"{len(problems)} problem{'s' if len(problems) != 1 else ''}:\n{lines}", level=-1)

    def list_doubts(self, doubts: Sequence[Doubt]) -> None:
        """Doubtful numbers; shown even with -q, nothing where there are none."""
        if doubts:
            number = f"{len(doubts)} doubtful number{'s' if len(doubts) != 1 else ''}"
            self.say(f"{number}:\n{doubts_text(doubts)}", level=-1)

    def result(self, record: dict[str, Any], text: str) -> None:
        """The result itself: JSON where asked for, else ``text``."""
        if self.as_json:
            text = json.dumps(without_nan(record), indent=1, default=str)
        elif sys.stdout.isatty():
            text = wrapped(text, shutil.get_terminal_size().columns)
        if getattr(sys.stdout, "name", "") == os.devnull:
            self.say("standard output is closed: the result is not shown, only its files are written", level=-1)
        try:
            click.echo(text if self.as_json else printable(text))
        except BrokenPipeError:
            raise
        except OSError as why:
            _drop(1)
            why.filename = "standard output, after all files were written"
            raise

    @contextmanager
    def progress(self) -> Iterator[Callable[[str, int, int], None]]:
        """A function (stage, done, total): a bar with the time left on a terminal, plain lines elsewhere."""
        if self.verbosity < 0:
            yield lambda stage, done, total: None
        elif sys.stderr.isatty():
            with _bars() as report:
                yield report
        else:
            yield _PlainLines(self)


def wrapped(text: str, width: int) -> str:
    """The text with long sentences wrapped at ``width`` columns; tables (columns two spaces apart) stay as they are."""
    lines = []
    for line in text.splitlines():
        indent = line[: len(line) - len(line.lstrip())]
        if len(line) <= width or "  " in line.strip():
            lines.append(line)
        else:
            lines += textwrap.wrap(line, width, subsequent_indent=f"{indent}  " if indent else "")
    return "\n".join(lines)


class _PlainLines:
    """Print a line every ten seconds while a stage runs, and when it ends."""

    def __init__(self, console: Console):
        self._console = console
        self._started: dict[str, tuple[float, int]] = {}  # when, and how much was done before
        self._last: dict[str, float] = {}

    def __call__(self, stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        start, before = self._started.setdefault(stage, (now, done if done < total else 0))
        if done < total and now - self._last.setdefault(stage, now) < 10.0:
            return
        self._last[stage] = now
        spent = now - start
        left = f", {spent / (done - before) * (total - done):.0f} s left" if before < done < total else ""
        self._console.say(f"{stage}: {done} of {total} ({spent:.0f} s{left})")


@contextmanager
def _bars() -> Iterator[Callable[[str, int, int], None]]:
    from rich.console import Console as RichConsole
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn as TimeLeft,
    )

    text = TextColumn("{task.description:<28}")
    columns = (text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeLeft())
    # drawn by hand: a refreshing thread would forbid the reading stage to fork
    with Progress(*columns, console=RichConsole(stderr=True), auto_refresh=False) as bars:
        tasks: dict[str, Any] = {}
        drawn = 0.0

        def report(stage: str, done: int, total: int) -> None:
            nonlocal drawn
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total, completed=done)
            bars.update(tasks[stage], completed=done, total=total)
            now = time.monotonic()
            if done >= total or now - drawn > 0.1:
                drawn = now
                bars.refresh()

        yield report


def without_nan(value: Any) -> Any:
    """The same record with null for NaN and infinite numbers, which JSON does not have."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def set_aside_record(set_aside: Sequence[SetAside]) -> list[dict[str, Any]]:
    """The same for JSON, with every problem in full."""
    return [{"test_id": s.test_id, "reason": s.reason, "problems": [asdict(p) for p in s.problems]} for s in set_aside]


def status_of(set_aside: Sequence[SetAside]) -> int:
    """Exit status of finished work: 3 where a fault set a test aside, 0 where only the user's ``exclude`` did."""
    return SOME_SET_ASIDE if any(s.problems for s in set_aside) else DONE


def command_options(function: Callable[..., int | None]) -> Callable[..., None]:
    """Add --json, --seed, --jobs, -v, -q and --debug; errors become a list and exit status 1, never a traceback."""

    @click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
    @click.option("--seed", type=int, default=0, show_default=True, help="Seed of all random numbers.")
    @click.option(
        "--jobs",
        type=click.IntRange(min=1),
        default=os.cpu_count() or 1,
        help="Number of parallel jobs.  [default: all cores]",
    )
    @click.option("-v", "--verbose", count=True, help="Print more messages.")
    @click.option("-q", "--quiet", is_flag=True, help="Print only results and errors.")
    @click.option("--debug", is_flag=True, help="Print the traceback of unexpected errors.")
    @functools.wraps(function)
    def command(
        as_json: bool, verbose: int, quiet: bool, debug: bool, force: bool = False, wait_s: float = 0.0, **options: Any
    ) -> None:
        console = Console(as_json, -1 if quiet else verbose, force, wait_s)
        logging.basicConfig(level=logging.INFO if verbose else logging.ERROR, stream=sys.stderr, format="%(message)s")
        logging.getLogger("tribo").setLevel(logging.DEBUG if debug else logging.NOTSET)
        try:
            with damage_said(lambda text: console.say(text, level=-1)), ended_by_terminate():
                fixed_date()
                status = function(console=console, **options)
        except (click.ClickException, BrokenPipeError):
            raise
        except Exception as why:
            problems = problems_of(why)
            console.list_problems(problems)
            if console.as_json:
                with suppress(OSError):  # said on standard error above
                    click.echo(json.dumps({"problems": [asdict(p) for p in problems]}, indent=1, default=str))
            status = BUSY if isinstance(why, BusyError) else UNUSABLE
        except (KeyboardInterrupt, click.Abort):
            console.say("interrupted; finished results are kept and no file is incomplete", level=-1)
            status = INTERRUPTED
        sys.exit(status or DONE)

    return command


def problems_of(why: Exception) -> tuple[Problem, ...]:
    """What ended a command: the problems it found, an error of the system with its path, or an error of tribo.

    Problems that an error of the system caused are problems of the system, whatever they are called.
    """
    if isinstance(why, TriboError):
        by_system = why.__cause__ is not None and failed_by_system(why.__cause__)
        return tuple(replace(p, kind=OF_THE_SYSTEM) for p in why.problems) if by_system else why.problems
    if isinstance(why, OSError):
        logging.getLogger("tribo").debug("an error of the system", exc_info=why)
        return (system_problem(why),)
    return (unexpected(why, "this command stopped"),)
