"""The laws found in the campaigns of a site, and which of them held in later ones."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tribo.escaping import for_spreadsheet
from tribo.file_contents import found_in, text_of
from tribo.store.whole_files import write_text

KEPT = "laws"  # folder in the state of a site, with the laws of each campaign in a folder of its name


@dataclass(frozen=True)
class LawAnswer:
    """What the campaign ``tested_in`` says of a law: held, not held, or cannot be told."""

    law: str
    found_in: str
    formula: str
    tested_in: str
    answer: str


def collect_laws(current: Path, state: Path) -> None:
    """Copy the laws of every report to the state of the site, where the steps of the next build find them.

    A campaign that is built is so tested against the laws of all campaigns that were built before it.
    """
    kept = state / KEPT
    wanted = {f"{law.parent.name}/{law.name}": law for law in _of_reports(current, "law-*.toml")}
    for path in _of_reports(kept, "law-*.toml"):
        if f"{path.parent.name}/{path.name}" not in wanted:
            path.unlink()
    for name, law in wanted.items():
        text = text_of(law)
        if not (kept / name).is_file() or text_of(kept / name) != text:
            write_text(kept / name, text)


def answers_of(current: Path) -> tuple[LawAnswer, ...]:
    """The answers of all reports, by law and then by campaign."""
    found = [answer for verdict in _of_reports(current, "verdict.json") for answer in _in_verdict(verdict)]
    return tuple(sorted(found, key=lambda a: (a.law, a.tested_in)))


def _of_reports(folder: Path, pattern: str) -> list[Path]:
    """The files of a pattern in all folders of a folder, by folder and name."""
    return [path for report in found_in(folder, "*") for path in found_in(report, pattern)]


def _in_verdict(path: Path) -> list[LawAnswer]:
    """The answers of one report; none where its verdict is damaged. Raises OSError where it cannot be read."""
    try:
        known: Sequence[Mapping[str, Any]] = json.loads(text_of(path))["model"].get("known_laws", ())
        return [
            LawAnswer(str(law["law"]), str(law["found_in"]), str(law["formula"]), path.parent.name, str(law["answer"]))
            for law in known
        ]
    except (FileNotFoundError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return []


def laws_csv(answers: Sequence[LawAnswer]) -> str:
    """laws.csv: one row a law and campaign."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["law", "found_in", "formula", "tested_in", "answer"])
    rows = ((a.law, a.found_in, a.formula, a.tested_in, a.answer) for a in answers)
    writer.writerows([for_spreadsheet(cell) for cell in row] for row in rows)
    return text.getvalue()


def laws_in_words(answers: Sequence[LawAnswer]) -> list[str]:
    """One sentence a law: in which campaigns it held and in which it did not."""
    said = []
    for law in dict.fromkeys(a.law for a in answers):
        here = [a for a in answers if a.law == law]
        by = {answer: [a.tested_in for a in here if a.answer == answer] for answer in ("held", "not held")}
        parts = [f"{answer} in {', '.join(names)}" for answer, names in by.items() if names]
        said.append(f"{law} ({here[0].formula}): {'; '.join(parts) or 'no later campaign can tell'}.")
    return said
