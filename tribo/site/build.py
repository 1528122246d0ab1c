"""`tribo build`: from a folder of campaigns to a site of reports, by the Snakemake workflow in pipelines/.

A site holds ``current`` (the outputs of each campaign and the index page), ``builds`` (dated copies), ``latest`` (a
link to the newest) and ``.tribo`` (records of steps, logs, the lock). Snakemake runs as a process of the build: it is
started, followed by the journal of its steps, and ended with all of them.
"""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import IO, Any

from tribo.dry_run import Checked, check
from tribo.errors import Problem, TriboError
from tribo.files import found_below, found_in, text_of, write_text
from tribo.forked import Limits
from tribo.kept_results import package_sources
from tribo.own_folder import STATE, WAIT, check_site, is_leftover, only_writer
from tribo.site.history import collect_laws
from tribo.site.scan import CURRENT, Dropped, clear_unfinished, date_build, difference, scan
from tribo.site.steps import (
    INDEX,
    JOURNAL,
    OF_A_REPORT,
    Step,
    due_steps,
    forget_other_limits,
    id_of,
    inputs_of,
    journal,
    read_record,
)
from tribo.stages import StudyOptions
from tribo.temporary import PREFIX, clear_abandoned, place_of_temporary_files, temporary_folder_of_child
from tribo.traces.rules import named_rule
from tribo.user_text import well_formed

WORDS = {
    "fit": "reading exports and fitting laws", "predict": "reading exports and simulating",
    "calibrate": "calibrating the model", "simulate": "simulating", "diagnose": "diagnosing",
    "report": "writing the report", "index": "writing the index page",
}  # fmt: skip
END_S = 60.0  # how long the steps of an interrupted build may take to end
TICK_S = 1.0  # how often the progress is told where nothing changes


@dataclass(frozen=True)
class Progress:
    """``done`` of ``total`` steps, those that run in words, and the share of the work that is done (0 to 1)."""

    done: int
    total: int
    running: tuple[str, ...]
    share: float


def progress_of(state: Path, due: Sequence[Step], typical_s: Mapping[str, float]) -> Progress:
    """How far a build is, by its journal.

    ``due`` are its steps, ``typical_s`` is how long a step of each kind took in earlier builds; a kind that is not
    known takes as long as the others on average.
    """
    events = {step: event for step, event, _ in journal(state)}
    done = [step for step, event in events.items() if event == "ended"]
    running = [step for step, event in events.items() if event == "begun"]
    usual = sum(typical_s.values()) / len(typical_s) if typical_s else 1.0

    def work(steps: Iterable[Step]) -> float:
        return sum(typical_s.get(step.kind, usual) for step in steps)

    everything = {(step.name, step.campaign): step for step in (*due, *events)}.values()
    share = work(done) / work(everything) if everything else 0.0
    return Progress(len(done), len(everything), tuple(map(_in_words, running)), share)


def _in_words(step: Step) -> str:
    """"a: simulating B@5000Pa" of the step simulate-B@5000Pa of a."""
    kind, _, cell = step.name.partition("-")
    words = " ".join(filter(None, (WORDS.get(kind, kind), cell)))
    return f"{step.campaign}: {words}" if step.campaign else words


def typical_seconds(steps: Path) -> dict[str, float]:
    """Mean duration of each kind of step in the records of a site, in seconds."""
    found: dict[str, list[float]] = {}
    for path in found_below(steps, "*.json"):
        record = read_record(path)
        seconds = record.get("seconds") if record else None
        if isinstance(seconds, int | float) and seconds > 0:
            found.setdefault(path.stem.partition("-")[0], []).append(float(seconds))
    return {rule: sum(values) / len(values) for rule, values in found.items()}


def run_workflow(
    command: Sequence[str], state: Path, due: Sequence[Step], descriptor: int | None, tell: Callable[[Progress], None]
) -> subprocess.CompletedProcess[str]:
    """Run a Snakemake command to its end, and ``tell`` how far its steps are at every line and every second.

    The lock of the site, ``descriptor``, is passed on, so that it is held as long as Snakemake runs. Temporary files
    of Snakemake are in a folder of tribo: what it leaves when it is killed goes at the next start.
    """
    (state / "log").mkdir(parents=True, exist_ok=True)
    typical_s = typical_seconds(state / "steps")
    now, read = Progress(0, len(due), (), 0.0), -1
    said: list[str] = []
    path = state / JOURNAL
    with temporary_folder_of_child() as (temporary, in_use), subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
        env={**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONSAFEPATH": "1", "TMPDIR": str(temporary)},
        pass_fds=(in_use,) if descriptor is None else (in_use, descriptor),
    ) as process:  # fmt: skip
        assert process.stdout is not None
        try:
            for line in _lines(process.stdout):
                said.append(line)
                size = path.stat().st_size if path.is_file() else 0
                if size != read:  # Snakemake says much more than the journal holds
                    now, read = progress_of(state, due, typical_s), size
                    tell(now)
                elif not line:
                    tell(now)
            process.wait()
        except BaseException:
            _end(process)
            raise
    return subprocess.CompletedProcess(command, process.returncode, "".join(said))


def _lines(stream: IO[str]) -> Iterator[str]:
    """Lines as they come; an empty text whenever none has come for a while."""
    arrived: Queue[str | None] = Queue()

    def read() -> None:
        for line in stream:
            arrived.put(line)
        arrived.put(None)

    Thread(target=read, daemon=True).start()
    while True:
        try:
            line = arrived.get(timeout=TICK_S)
        except Empty:
            yield ""
            continue
        if line is None:
            return
        yield line


def _end(process: subprocess.Popen[str]) -> None:
    """Ask the workflow and its steps to end, and wait for them, so that none writes on after the build."""
    import psutil

    try:
        workflow = psutil.Process(process.pid)
        everyone = [workflow, *workflow.children(recursive=True)]
    except psutil.NoSuchProcess:
        everyone = []
    for each in everyone:
        with suppress(psutil.NoSuchProcess):
            each.terminate()
    for each in psutil.wait_procs(everyone, timeout=END_S)[1]:
        with suppress(psutil.NoSuchProcess):
            each.kill()
    process.wait()


GONE = "report.html has been deleted"
PROFILES = ("local", "slurm")
_PACKAGE = Path(__file__).resolve().parents[1]


class BuildError(TriboError):
    """The workflow itself could not run, or a step failed in a way that is no fault of the input."""


@dataclass(frozen=True)
class BuildOptions(StudyOptions):
    """What a build may choose besides the options of a study.

    ``settle_s`` is how long a file must rest, ``keep`` how many dated copies stay, ``wait_s`` how long to wait for
    another build, ``force`` whether to write into a folder that holds files of others. A step of a campaign may take
    ``most_minutes``, and each of its processes ``most_gigabytes`` of memory.
    """

    profile: str = "local"
    settle_s: float = 60.0
    keep: int = 10
    wait_s: float = 0.0
    force: bool = False
    most_minutes: float = 240.0
    most_gigabytes: float = 4.0

    def of_commands(self) -> dict[str, str]:
        """Options of the commands of the workflow, and all of them in words for what a step is made from."""
        fit = ["--rule", self.rule, "--weights", self.weights, "--seed", str(self.seed)]
        flat = ["--flat", self.flat] if self.flat else []
        model = [*fit, *flat, "--runs", str(self.runs)]
        where = ["--scheduler", self.scheduler] if self.scheduler else []
        diagnosis = ["--rule", self.rule, "--seed", str(self.seed), *flat]
        parts = {"fit": fit, "model": [*model, *where], "diagnose": diagnosis, "words": model}
        return {name: shlex.join(words) for name, words in parts.items()}

    @property
    def made_with(self) -> str:
        """What every step of a build is made with, as one text: the sources of tribo and the options."""
        return f"{package_sources()} {self.of_commands()['words']}"


def _untold(*_: Any) -> None:
    """Nobody is told how far a build is."""


@dataclass(frozen=True)
class Built:
    """How a build ended: campaigns by name with what was due and why, those left waiting, and the dated copy."""

    site: Path
    due: Mapping[str, str]
    waiting: Mapping[str, tuple[str, ...]]
    status: Mapping[str, str] = field(default_factory=dict)
    steps: tuple[str, ...] = ()
    dated: Path | None = None
    checked: Mapping[str, Checked] = field(default_factory=dict)  # of a dry run: what each campaign would meet
    refused: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # why a campaign cannot be built as it is

    def as_dict(self) -> dict[str, Any]:
        """The same as plain types."""
        return {
            "site": str(self.site), "due": dict(self.due), "waiting": {k: list(v) for k, v in self.waiting.items()},
            "status": dict(self.status), "steps": list(self.steps), "dated": str(self.dated) if self.dated else None,
            "checked": {name: found.as_record() for name, found in self.checked.items()},
            "refused": {name: list(why) for name, why in self.refused.items()},
        }  # fmt: skip


def workflow_dir() -> Path:
    """Folder of the Snakefile: ``tribo/_pipelines`` of an installed wheel, ``pipelines`` of a source checkout."""
    for folder in (_PACKAGE / "_pipelines", _PACKAGE.parent / "pipelines"):
        if (folder / "Snakefile").is_file():
            return folder
    raise BuildError(Problem("missing_workflow", "this installation lacks pipelines/Snakefile; install tribo again"))


def build_site(
    drop: Path,
    site: Path,
    options: BuildOptions,
    *,
    dry_run: bool = False,
    steps: Callable[[Progress], None] = _untold,
    checks: Callable[[str, int, int], None] = _untold,
) -> Built:
    """Bring the site up to date with a folder of campaigns; with ``dry_run`` only check what would be built.

    A dry run lists the steps with their reasons, and opens every export of the campaigns that are due. ``steps`` is
    told how far a build is, ``checks`` (stage, done, total) how many exports a dry run has read.

    Raises
    ------
    BusyError
        Another build of this site is running.
    CampaignError
        The drop folder cannot be used; the site is, holds or lies in it, or holds files that tribo has not written.
    TraceError
        The rule is not known.
    BuildError
        Snakemake is missing, or a step failed other than by unusable input; everything else is built.
    """
    if find_spec("snakemake") is None:
        what, allowed = "tribo build requires snakemake", "pip install 'tribo[pipelines]'"
        raise BuildError(Problem("missing_package", what, allowed=allowed))
    options = replace(options, rule=named_rule(options.rule).name)
    check_site(site, drop, options.force)
    state = site.resolve() / STATE
    if dry_run:
        return _planned(drop, state, options, checks)
    busy = Problem("busy", f"another build of this site is running; {WAIT}", file=str(site))
    with only_writer(state / "lock", options.wait_s, lasting=True, busy=busy) as descriptor:
        _clear_leftovers(state)
        return _built(drop, state, options, steps, descriptor)


def _clear_leftovers(state: Path) -> None:
    """Remove what a killed build has left; the folders of reports are cleared by the steps that write into them."""
    site = state.parent
    for path in (*found_below(state, ".*"), *found_in(site, ".*"), *found_in(site / CURRENT, ".*")):
        if is_leftover(path.name) and path.is_file():
            path.unlink()
    clear_unfinished(site)
    clear_abandoned(place_of_temporary_files(), PREFIX)


def _planned(drop: Path, state: Path, options: BuildOptions, checks: Callable[[str, int, int], None]) -> Built:
    """What a build would do, and what it would meet in the campaigns that are due."""
    found, ready, due = _due(drop, state / "dry-run", options)
    config = _configuration(found, ready, state / "dry-run.json", options)
    steps = _steps(state, ready, due, config, options)
    said = _snakemake(state, config, options, ("--dry-run", *_forced(due, state)), steps, None, _untold)
    if said.returncode:
        raise BuildError(_failures(state, said.stdout))
    checked = {
        c.name: check(
            c.path, replace(options, overrides=c.overrides), "report", progress=partial(_of_campaign, c.name, checks)
        )
        for c in found
        if c.name in due
    }
    status = {c.name: "unusable" if c.refused else _status(c.name, state) for c in found if c.name not in due}
    status |= {name: "unusable" if look.faults else "to be built" for name, look in checked.items()}
    return Built(
        state.parent, due, _waiting(found), status, tuple(map(str, steps)), checked=checked, refused=_refused(found)
    )  # fmt: skip


def _of_campaign(name: str, checks: Callable[[str, int, int], None], stage: str, done: int, total: int) -> None:
    checks(f"{name}: {stage}", done, total)


def _due(
    drop: Path, inputs: Path, options: BuildOptions
) -> tuple[tuple[Dropped, ...], dict[str, Any], dict[str, str]]:
    """The campaigns of a drop folder, what the workflow needs to know of each, and which are to be built and why."""
    found, ready = inputs_of(scan(drop.resolve(), options.settle_s), inputs, options.made_with)
    whole = [c for c in found if c.is_ready]
    return found, ready, {c.name: why for c in whole if (why := _why_due(c, inputs.parent, ready[c.name]["digest"]))}


def _waiting(found: Sequence[Dropped]) -> dict[str, tuple[str, ...]]:
    return {c.name: c.waiting for c in found if c.waiting}


def _refused(found: Sequence[Dropped]) -> dict[str, tuple[str, ...]]:
    return {c.name: c.refused for c in found if c.refused}


def _built(
    drop: Path, state: Path, options: BuildOptions, tell: Callable[[Progress], None], descriptor: int | None
) -> Built:
    forget_other_limits(state, Limits(options.most_minutes, options.most_gigabytes))
    found, ready, due = _due(drop, state / "inputs", options)
    config = _configuration(found, ready, state / "build.json", options)
    steps = _steps(state, ready, due, config, options)
    (state / JOURNAL).unlink(missing_ok=True)
    said = _snakemake(state, config, options, _forced(due, state), steps, descriptor, tell)
    write_text(state / "log" / "snakemake.log", said.stdout)
    collect_laws(state.parent / CURRENT, state)
    dated = date_build(state.parent, options.keep)
    if said.returncode:
        raise BuildError(_failures(state, said.stdout))
    status = {c.name: "unusable" if c.refused else _status(c.name, state) for c in found}
    ran = _ran(state, steps)
    return Built(state.parent, due, _waiting(found), status, tuple(map(str, ran)), dated, refused=_refused(found))


def _ran(state: Path, due: Sequence[Step]) -> list[Step]:
    """The steps that a build ran, each with why."""
    why = {(step.name, step.campaign): step.why for step in due}
    begun = [step for step, event, _ in journal(state) if event == "begun"]
    return [step._replace(why=why.get((step.name, step.campaign), "an earlier step ran again")) for step in begun]


def _steps(
    state: Path, ready: Mapping[str, Any], due: Mapping[str, str], config: Path, options: BuildOptions
) -> list[Step]:
    """The steps of this build with their reasons; the index page is the last of them."""
    steps = due_steps(state, ready, _by_cell(options.profile))
    runs = {(step.name, step.campaign) for step in steps}
    steps += [Step("report", n, "its report is missing") for n in due if due[n] == GONE and ("report", n) not in runs]
    index = read_record(state / f"{INDEX}.json", "digest")
    listed = read_record(config, "digest")
    if steps or index is None or listed is None or index["digest"] != listed["digest"]:
        steps.append(Step(INDEX, why="not finished before" if index is None else "an earlier step runs again"))
    return steps


def _by_cell(profile: str) -> bool:
    """Whether the steps of a profile run the simulations cell by cell."""
    import yaml

    file = _profile_folder(profile) / "config.yaml"
    described = yaml.safe_load(text_of(file)) if file.is_file() else None
    config = described.get("config") if isinstance(described, dict) else None
    return "simulate_by=cell" in config if isinstance(config, list) else False


def _profile_folder(profile: str) -> Path:
    return (workflow_dir() / "profiles" / profile if profile in PROFILES else Path(profile)).resolve()


def _why_due(campaign: Dropped, state: Path, digest: str) -> str:
    """Why a campaign is to be built, in words; empty where its report is of exactly these files and options."""
    record = read_record(state / "steps" / id_of(campaign.name) / "report.json", *OF_A_REPORT, "files")
    if record is None:
        started = (state / "steps" / id_of(campaign.name)).is_dir()
        return "not finished in an earlier build" if started else "new"
    changed = difference(record["files"], campaign.files)
    if changed:
        return changed
    if record["status"] != "unusable" and not (state.parent / CURRENT / campaign.name / "report.html").is_file():
        return GONE
    return "" if record["digest"] == digest else "options or code of tribo changed"


def _forced(due: Mapping[str, str], state: Path) -> tuple[str, ...]:
    """Reports that Snakemake would not miss: gone ones, and records lost behind an index that is there."""
    if not (state / "index.json").is_file():
        return ()
    records = {name: f"steps/{id_of(name)}/report.json" for name in due}
    lost = [r for name, r in records.items() if due[name] == GONE or not (state / r).is_file()]
    return ("--forcerun", *lost) if lost else ()


def _configuration(found: Sequence[Dropped], ready: Mapping[str, Any], file: Path, options: BuildOptions) -> Path:
    """Write what the workflow needs to know; returns the file."""
    campaigns = {
        c.name: {"path": well_formed(str(c.path)), "waiting": list(c.waiting), "refused": list(c.refused)}
        for c in found
    }
    listing = json.dumps([campaigns, {n: r["digest"] for n, r in ready.items()}, options.made_with])
    config = {
        "ready": {id_of(name): {**inputs, "name": name} for name, inputs in ready.items()},
        "campaigns": campaigns,
        "digest": hashlib.sha256(listing.encode()).hexdigest(),
        "options": options.of_commands(),
        "python": sys.executable,
        "threads": options.jobs,
        "limits": f"--most-minutes {options.most_minutes:g} --most-gigabytes {options.most_gigabytes:g}",
    }
    return write_text(file, json.dumps(config, indent=1) + "\n")


def _snakemake(
    state: Path, config: Path, options: BuildOptions, more: Sequence[str], steps: Sequence[Step],
    descriptor: int | None, tell: Callable[[Progress], None],
) -> subprocess.CompletedProcess[str]:
    """Run the workflow; the lock of the site is what keeps two apart, so that Snakemake needs none of its own.

    Neither Python nor Snakemake takes modules or settings from the folder that the build happens to start in.
    """
    folder = workflow_dir()
    command = [
        sys.executable, "-P", "-m", "snakemake", "--snakefile", str(folder / "Snakefile"), "--directory", str(state),
        "--configfile", str(config), "--profile", str(_profile_folder(options.profile)), "--workflow-profile", "none",
        "--cores", str(options.jobs), "--nolock", "--nocolor", *more,
    ]  # fmt: skip
    return run_workflow(command, state, steps, descriptor, tell)


def _status(name: str, state: Path) -> str:
    record = read_record(state / "steps" / id_of(name) / "report.json", *OF_A_REPORT)
    return str(record["status"]) if record else "not built yet"


def _failures(state: Path, said: str) -> list[Problem]:
    """The steps that failed, each with the end of its log; what Snakemake said last where it was no step."""
    last = {step: (event, status) for step, event, status in journal(state)}
    logs = [state / step.log for step, how in last.items() if how != ("ended", 0)]
    what = "a step failed; all other steps are complete, and the next build will try this one again"
    if not logs:
        return [Problem("workflow_failed", "the workflow could not be run", found=_last_lines(said))]
    ends = {log: _last_lines(text_of(log, errors="replace")) if log.is_file() else "no log" for log in sorted(logs)}
    return [Problem("step_failed", what, file=str(log), found=end) for log, end in ends.items()]


def _last_lines(text: str, most: int = 8) -> str:
    return "\n".join(text.strip().splitlines()[-most:])
