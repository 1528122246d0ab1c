"""One step of the workflow: a tribo command, and a record of what it was made from and how it ended.

``python -m tribo.cli.workflow_step RECORD --digest D [--laws DIR] [--after RECORD...] [--files FILES.json] --
COMMAND...`` runs ``tribo COMMAND... --json``, with the laws of earlier campaigns if the folder DIR holds any. Unusable
input is a result and not a failure: it is recorded, the steps after it are not run, and the build goes on with the
other campaigns. Anything else that goes wrong ends the step with a failure, so that the next build tries it again.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from tribo.cli.console import DONE, SOME_SET_ASIDE, UNUSABLE
from tribo.errors import is_of_the_system
from tribo.files import found_below, text_of
from tribo.site.steps import Step, noted, read_record

DONE_WORDS = {DONE: "done", SOME_SET_ASIDE: "some_set_aside", UNUSABLE: "unusable"}


def run_step(
    record: Path, command: Sequence[str], digest: str, after: Sequence[Path] = (), files: Path | None = None
) -> int:
    """Run a tribo command as a step, write its record and note both in the journal; returns the exit status."""
    out = Path(command[command.index("-o") + 1]) if "-o" in command else record.parent
    step, state = Step(record.stem, out.name), record.parents[2]
    return noted(state, step, lambda: _recorded(record, command, digest, after, files))


def _recorded(record: Path, command: Sequence[str], digest: str, after: Sequence[Path], files: Path | None) -> int:
    records = (read_record(path, "status", "problems") for path in after)
    before = next((r for r in records if r and r["status"] == "unusable"), None)
    started = time.time()
    if before is not None:
        status, said = UNUSABLE, {"problems": before["problems"]}
    else:
        status, said = _run(command)
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
    given = parser.parse_args(own)
    command += with_laws(given.laws)
    return run_step(given.record, command, given.digest, given.after, given.files)


def with_laws(folder: Path | None) -> list[str]:
    """The option that names a folder of laws, where there are any in it."""
    return ["--laws", str(folder)] if folder is not None and found_below(folder, "law*.toml") else []


def _split(arguments: list[str]) -> tuple[list[str], str, list[str]]:
    place = arguments.index("--") if "--" in arguments else len(arguments)
    return arguments[:place], "--", arguments[place + 1 :]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
