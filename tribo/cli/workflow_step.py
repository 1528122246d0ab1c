"""One step of the workflow: a tribo command, and a record of what it was made from and how it ended.

``python -m tribo.cli.workflow_step RECORD --digest D [--laws DIR] [--after RECORD...] [--files FILES.json]
[--most-minutes M --most-gigabytes G] -- COMMAND...`` runs ``tribo COMMAND... --json``, with the laws of earlier
campaigns if the folder DIR holds any. Unusable input is a result and not a failure: it is recorded, the steps after it
are not run, and the build goes on with the other campaigns. So is a campaign that takes more time or memory than it
may, or ends the process that reads it.
Anything else that goes wrong ends the step with a failure, so that the next build tries it again.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from tribo.cli.console import DONE, SOME_SET_ASIDE, UNUSABLE
from tribo.errors import is_of_the_system
from tribo.files import found_below, found_in, text_of
from tribo.forked import ApartError, Limits, apart
from tribo.site.steps import OF_LIMITS, Step, beyond_limits, noted, read_record

FROM_OUTSIDE = 137  # of a process that somebody else has ended: nothing is known of the campaign
DONE_WORDS = {DONE: "done", SOME_SET_ASIDE: "some_set_aside", UNUSABLE: "unusable"}


def run_step(
    record: Path, command: Sequence[str], digest: str, after: Sequence[Path] = (), files: Path | None = None,
    limits: Limits | None = None,
) -> int:  # fmt: skip
    """Run a tribo command as a step, write its record and note both in the journal; returns the exit status."""
    out = Path(command[command.index("-o") + 1]) if "-o" in command else record.parent
    step, state = Step(record.stem, out.name), record.parents[2]
    return noted(state, step, lambda: _recorded(record, command, digest, after, files, limits))


def _recorded(
    record: Path, command: Sequence[str], digest: str, after: Sequence[Path], files: Path | None, limits: Limits | None
) -> int:
    records = [read_record(path, "status", "problems") for path in after]
    beside = (read_record(path, "status", "digest", "problems") for path in found_in(record.parent, "*.json"))
    records += [r for r in beside if r and r["digest"] == digest and _ended_by_limits(r["problems"])]
    before = next((r for r in records if r and r["status"] == "unusable"), None)
    started = time.time()
    if before is not None:
        status, said = UNUSABLE, {"problems": before["problems"]}
    elif limits is None:
        status, said = _run(command)
    else:
        try:
            status, said = apart(partial(_run, command), limits)
        except ApartError as why:
            if why.kind not in OF_LIMITS:
                print(f"this step has no result: {why.what}", file=sys.stderr)
                return FROM_OUTSIDE
            status, said = UNUSABLE, {"problems": [asdict(beyond_limits(why, limits, _campaign_of(command)))]}
        for problem in _problems(said):
            if problem.get("kind") == "out_of_memory":  # of the limit of this campaign, not of the machine
                problem["kind"] = "over_memory"
    if status not in DONE_WORDS:
        return status
    if status != DONE and any(is_of_the_system(str(problem.get("kind"))) for problem in _problems(said)):
        return status  # no fault of the input: the next build tries again
    if status == UNUSABLE and not said.get("problems"):
        return status  # what the input lacks was not told, so that this says nothing about it
    finished = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    written = {
        "command": ["tribo", *command],
        "digest": digest,
        "status": DONE_WORDS[status],
        "problems": said.get("problems", []) if status == UNUSABLE else [],
        "set_aside": len(said.get("set_aside") or ()),
        "files": json.loads(text_of(files))["files"] if files else None,
        "seconds": round(time.time() - started, 1),
        "finished": finished,
    }
    from tribo.files import write_text

    write_text(record, json.dumps(written, indent=1) + "\n")
    return 0


def _ended_by_limits(problems: Sequence[Any]) -> bool:
    """Whether an earlier step of the same campaign took too much or crashed: the next one would as well."""
    return any(isinstance(problem, dict) and problem.get("kind") in OF_LIMITS for problem in problems)


def _campaign_of(command: Sequence[str]) -> str:
    """The folder or .zip that a command is given, which stands before its output folder."""
    return command[command.index("-o") - 1] if "-o" in command[1:] else ""


def _problems(said: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Those of a command, and of the tests that it set aside."""
    return [*said.get("problems", ()), *(p for test in said.get("set_aside") or () for p in test["problems"])]


def _run(command: Sequence[str]) -> tuple[int, dict[str, Any]]:
    """Exit status and JSON result of a tribo command, run in this process."""
    from tribo.cli import main

    said = io.StringIO()
    status = 0
    try:
        with redirect_stdout(said):
            main([*command, "--json"], prog_name="tribo")
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else 70
    try:
        return status, json.loads(said.getvalue() or "{}")
    except ValueError:
        return status, {}


def main(arguments: Sequence[str]) -> int:
    """Run the step that the arguments describe."""
    own, _, command = _split(list(arguments))
    parser = argparse.ArgumentParser(prog="python -m tribo.cli.workflow_step")
    parser.add_argument("record", type=Path)
    parser.add_argument("--digest", required=True)
    parser.add_argument("--after", type=Path, nargs="*", default=[])
    parser.add_argument("--files", type=Path)
    parser.add_argument("--laws", type=Path)
    parser.add_argument("--most-minutes", type=float)
    parser.add_argument("--most-gigabytes", type=float)
    given = parser.parse_args(own)
    command += with_laws(given.laws)
    limits = Limits(given.most_minutes, given.most_gigabytes) if given.most_minutes and given.most_gigabytes else None
    return run_step(given.record, command, given.digest, given.after, given.files, limits)


def with_laws(folder: Path | None) -> list[str]:
    """The option that names a folder of laws, where there are any in it."""
    return ["--laws", str(folder)] if folder is not None and found_below(folder, "law*.toml") else []


def _split(arguments: list[str]) -> tuple[list[str], str, list[str]]:
    place = arguments.index("--") if "--" in arguments else len(arguments)
    return arguments[:place], "--", arguments[place + 1 :]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
