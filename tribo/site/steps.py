"""The steps of a build: what each is told of its campaign, which are due and why, and what they leave.

A step that is finished leaves a record, steps/CAMPAIGN/STEP.json. Every step writes two lines into a journal, when it
begins and when it ends. What a build shows and reports is taken from these two, not from what the workflow prints.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from tribo.errors import CampaignError, Problem, is_of_the_system, unexpected
from tribo.files import found_below, text_of, write_text
from tribo.forked import ApartError, Limits, apart
from tribo.site.scan import Dropped

JOURNAL = Path("log") / "steps.jsonl"  # in the state of a site
INDEX = "index"
OF_A_REPORT = ("status", "digest", "problems", "finished")
OF_LIMITS = ("over_time", "over_memory", "crashed")  # kinds of problems of a campaign that ends its process
LISTING = Limits(5.0, 2.0)  # to read the table of a campaign, which is of limited size
_TYPES: dict[str, type | tuple[type, ...]] = {
    "status": str, "digest": str, "finished": str, "files": dict, "problems": list, "samples": list, "cells": list,
}  # fmt: skip


def read_record(path: Path, *keys: str) -> dict[str, Any] | None:
    """The record of a finished step; None where there is none, or a damaged one that lacks any of ``keys``.

    Raises
    ------
    OSError
        It is there and cannot be read.
    """
    try:
        record = json.loads(text_of(path))
    except (FileNotFoundError, NotADirectoryError, ValueError, RecursionError):
        return None
    whole = isinstance(record, dict) and all(isinstance(record.get(key), _TYPES[key]) for key in keys)
    return record if whole else None


_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,60}")
_REPEATED = re.compile(r"(.+)\1{9}")


def id_of(campaign: str) -> str:
    """The name by which the workflow knows a campaign, and its folder of records: its own where that is plain.

    Snakemake reads paths: ``<name>`` is a variable to it, and a part that is repeated often a loop of rules. No plain
    name holds a "=".
    """
    if _PLAIN.fullmatch(campaign) and not _REPEATED.search(campaign):
        return campaign
    return f"={hashlib.sha256(campaign.encode('utf-8', 'surrogatepass')).hexdigest()[:24]}"


class Step(NamedTuple):
    """A step of a build: ``name`` as in the workflow, its campaign (empty for the index), and why it runs.

    The campaign has its own name here, and :func:`id_of` it in paths.
    """

    name: str
    campaign: str = ""
    why: str = ""

    @property
    def kind(self) -> str:
        """Its name without the cell that it simulates."""
        return self.name.partition("-")[0]

    @property
    def log(self) -> Path:
        """Where it prints to, in the state of a site."""
        return Path("log") / (id_of(self.campaign) if self.campaign else "") / f"{self.name}.log"

    def __str__(self) -> str:
        of = ", ".join(filter(None, (self.campaign, self.name.partition("-")[2])))
        return f"{self.kind}{f' ({of})' if of else ''}: {self.why}"


def note(state: Path, step: Step, event: str, status: int = 0) -> None:
    """Add a line to the journal: the step has "begun", or has "ended" with an exit status."""
    line = json.dumps({"step": step.name, "campaign": step.campaign, "event": event, "status": status})
    with suppress(OSError):  # no step fails for want of its progress
        (state / JOURNAL).parent.mkdir(parents=True, exist_ok=True)
        with (state / JOURNAL).open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")  # one write: steps that run at once share the file


def noted(state: Path, step: Step, work: Callable[[], int]) -> int:
    """Do the work of a step, and note when it begins and how it ends; returns its exit status."""
    note(state, step, "begun")
    status = 1
    try:
        status = work()
    finally:
        note(state, step, "ended", status)
    return status


def journal(state: Path) -> Iterator[tuple[Step, str, int]]:
    """The lines of the journal: step, event and exit status. Lines that are not whole yet are left out."""
    path = state / JOURNAL
    for line in text_of(path).splitlines() if path.is_file() else ():
        try:
            said = json.loads(line)
        except ValueError:
            continue
        yield Step(said["step"], said["campaign"]), said["event"], said["status"]


def steps_of(cells: Iterable[str], by_cell: bool) -> list[str]:
    """The steps of one campaign in their order, as pipelines/Snakefile has them."""
    if not by_cell:
        return ["predict", "report"]
    return ["fit", "calibrate", *(f"simulate-{cell}" for cell in cells), "diagnose", "report"]


def due_steps(state: Path, ready: Mapping[str, Any], by_cell: bool) -> list[Step]:
    """The steps whose records are missing or are of other contents, options or sources, and those after them."""
    due = []
    for campaign, inputs in ready.items():
        runs: list[str] = []
        for name in steps_of(inputs["cells"], by_cell):
            record = read_record(state / "steps" / id_of(campaign) / f"{name}.json", "digest")
            needed = [r for r in runs if not (name.startswith("simulate-") and r.startswith("simulate-"))]
            if record is None:
                why = "not finished before"
            elif record["digest"] != inputs["digest"]:
                why = "contents of its inputs or its options changed"
            elif needed:
                why = "an earlier step runs again"
            else:
                continue
            runs.append(name)
            due.append(Step(name, campaign, why))
    return due


def beyond_limits(why: ApartError, limits: Limits, campaign: str) -> Problem:
    """The problem of a campaign that took more than it may, or ended its process."""
    most = f"{limits.minutes:g} minutes and {limits.gigabytes:g} GB for a step (--most-minutes, --most-gigabytes)"
    return Problem(why.kind, why.what, file=campaign or None, allowed=most)


def forget_other_limits(state: Path, limits: Limits) -> None:
    """Remove the records of steps that other limits than these have ended, so that they run again."""
    now = beyond_limits(ApartError("", ""), limits, "").allowed
    for path in found_below(state / "steps", "*.json"):
        record = read_record(path, "problems")
        for problem in record["problems"] if record else ():
            if isinstance(problem, dict) and problem.get("kind") in OF_LIMITS and problem.get("allowed") != now:
                path.unlink(missing_ok=True)


def inputs_of(
    found: Iterable[Dropped], folder: Path, made_with: str = ""
) -> tuple[tuple[Dropped, ...], dict[str, dict[str, Any]]]:
    """The campaigns, and the inputs of the steps of each that can be built, by name.

    ``digest`` of the inputs is what every step of the campaign is made from, as one text: the contents of its files,
    and ``made_with``, the sources of tribo and the options.

    A campaign that the system cannot read now is refused with path and cause; the next build tries it again. What was
    listed is kept in ``folder``, a file for each campaign, until the campaign changes.
    """
    campaigns, inputs = [], {}
    for campaign in found:
        if campaign.is_ready:
            samples, cells, refused = _listed(campaign, folder, made_with)
            if refused:
                campaigns.append(replace(campaign, refused=tuple(refused)))
                continue
            overrides = ["--overrides", str(campaign.overrides)] if campaign.overrides else []
            inputs[campaign.name] = {
                "path": str(campaign.path), "digest": f"{campaign.digest} {made_with}", "samples": samples,
                "cells": cells, "files": f"inputs/{campaign.name}.json", "overrides": shlex.join(overrides),
            }  # fmt: skip
        campaigns.append(campaign)
    return tuple(campaigns), inputs


def _listed(campaign: Dropped, folder: Path, made_with: str) -> tuple[list[str], list[str], list[str]]:
    """Samples and cells of a campaign, or why it is refused; those that are kept where it has not changed."""
    file = folder / f"{campaign.name}.json"
    known = read_record(file, "digest", "samples", "cells")
    tried_with = known.get("refused_with") if known else None
    if known is None or known["digest"] != campaign.digest or tried_with not in (None, made_with):
        try:
            samples, cells, refused = apart(lambda: _to_simulate(campaign), LISTING)
        except ApartError as why:
            samples, cells, refused = [], [], [str(beyond_limits(why, LISTING, str(campaign.path)))]
            if why.kind in OF_LIMITS:
                tried_with = made_with
        else:
            tried_with = None
        known = {"digest": campaign.digest, "samples": samples, "cells": cells, "files": dict(campaign.files)}
        if refused and tried_with is None:
            return samples, cells, refused  # by the system: the next build tries again
        known |= {"refused": refused, "refused_with": tried_with} if refused else {}
        write_text(file, json.dumps(known, indent=1) + "\n")
    return known["samples"], known["cells"], known.get("refused") or []


def _to_simulate(campaign: Dropped) -> tuple[list[str], list[str], list[str]]:
    """Samples and cells as a campaign describes them; none where it cannot be used (its first step says why).

    The third list says why the system cannot read it now.
    """
    from tribo.campaign import open_campaign
    from tribo.comparison.prediction import cell_name, loads_to_simulate, sample_as_word

    try:
        with open_campaign(campaign.path) as opened:
            measured = {test.sample for test in opened.tests}
            samples = [s for s in opened.samples if s in measured]
            words = [sample_as_word(s) for s in samples]
            pressures = [opened.nominal_pressure_Pa(load) for load in loads_to_simulate(opened)]
            return words, [cell_name(s, p) for s in samples for p in pressures], []
    except CampaignError as why:
        problems = why.problems
    except Exception as why:  # of an error in tribo, its first step will say it again, as the fault of this campaign
        problems = (unexpected(why, "the samples of this campaign cannot be listed", str(campaign.path)),)
    return [], [], [str(problem) for problem in problems if is_of_the_system(problem.kind)]
