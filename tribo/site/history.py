"""All campaigns of a site: one row each with its fitted parameters, and the laws found and which held in later ones."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from tribo.errors import failed_by_system, naming
from tribo.files import found_below, found_in, intact_hdf5, text_of, write_text
from tribo.site.steps import OF_A_REPORT, id_of, read_record
from tribo.user_text import for_spreadsheet, from_spreadsheet

PARAMETERS = {
    "mu": ("mu", "mu_combined_low", "mu_combined_high", "mu_low", "mu_high"),
    "tau0": ("tau0_kPa", "tau0_combined_low_kPa", "tau0_combined_high_kPa", "tau0_low_kPa", "tau0_high_kPa"),
}  # value, interval of the combined uncertainty, and that of the fit alone where a report has no other


Key = tuple[str, str, str]  # sample, regime, parameter
Interval = tuple[float, float, float]  # value and its 95 % interval; tau0 in kPa


@dataclass(frozen=True)
class CampaignRow:
    """One campaign as the index page shows it: its verdict, its counts and its next test are those of its card.

    ``state`` is done, some set aside, unusable, failed, waiting or gone (no longer in the folder of campaigns); ``why``
    the reason. ``measured`` is when the first pull started, ``built`` when the report was made. ``laws`` are its fitted
    parameters.
    """

    name: str
    title: str
    state: str
    why: tuple[str, ...] = ()
    measured: str = ""
    built: str = ""
    tests: int = 0
    set_aside: int = 0
    verdict: str = ""
    verdict_text: str = ""
    counts: str = ""
    next_test: str = ""
    has_report: bool = False
    laws: Mapping[Key, Interval] = field(default_factory=dict)
    measured_s: float = math.inf  # the same moment in seconds since 1970


def history(site: Path) -> tuple[CampaignRow, ...]:
    """Every campaign of a site, those in the drop folder and those that once were, in the order of measurement."""
    state = site / ".tribo"
    config = json.loads(text_of(state / "build.json"))
    steps = state / "steps"
    reported = {p.parent.name for p in found_below(steps, "report.json")}
    current = site / "current"
    folders = current.iterdir() if current.is_dir() else ()
    named = (folder.name for folder in folders if id_of(folder.name) in reported)
    names = set(config["campaigns"]) | set(named) | {name for name in reported if name == id_of(name)}
    rows = [_row(name, site, config) for name in names]
    return tuple(sorted(rows, key=lambda row: (row.measured_s, row.name)))


def _row(name: str, site: Path, config: Mapping[str, Any]) -> CampaignRow:
    out = site / "current" / name
    record = read_record(site / ".tribo" / "steps" / id_of(name) / "report.json", *OF_A_REPORT)
    state, why = _state(name, record, config)
    verdict, card = (read_record(out / f"{name}.json") or {} for name in ("verdict", "card"))
    step, tests = card.get("next_test"), _table(out / "tests.csv")
    started = sorted(moment for t in tests if (moment := _moment(t.get("started_at", ""))))
    return CampaignRow(
        name=name,
        title=_title(out) or name,
        state=state,
        why=why,
        measured=started[0].date().isoformat() if started else "",
        built=record["finished"][:16].replace("T", " ") if record else "",
        tests=sum(not t.get("set_aside") for t in tests),
        set_aside=sum(bool(t.get("set_aside")) for t in tests),
        verdict=str(verdict.get("verdict", "")),
        verdict_text=str(card.get("sentence") or verdict.get("text") or ""),
        counts=str(card.get("counts") or ""),
        next_test=str(step.get("line") or "") if isinstance(step, dict) else "",
        has_report=(out / "report.html").is_file(),
        laws=_laws(_table(out / "fits.csv")),
        measured_s=started[0].timestamp() if started else math.inf,
    )


def _state(name: str, record: Mapping[str, Any] | None, config: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """State of a campaign after a build, and why."""
    if name not in config["campaigns"]:
        return "gone", ("no longer in the folder of campaigns; the last report is kept",)
    if refused := config["campaigns"][name].get("refused"):
        return "unusable", tuple(refused)
    waiting = config["campaigns"][name]["waiting"]
    if waiting:
        return "waiting", tuple(waiting)
    if record is None or record["digest"] != config["ready"][id_of(name)]["digest"]:
        return "failed", ("a step failed; see its log in .tribo/log; the next build will try it again",)
    if record["status"] == "unusable":
        return "unusable", tuple(_problem(p) for p in record["problems"])
    return record["status"].replace("_", " "), ()


def _problem(problem: Any) -> str:
    """A recorded problem in words; whatever else a damaged record holds, as it is."""
    from tribo.errors import Problem

    try:
        return str(Problem(**problem))
    except TypeError:
        return str(problem)


def _moment(started_at: str) -> datetime | None:
    """The start of a test as a time that can be compared; None where it is none."""
    try:
        moment = datetime.fromisoformat(started_at)
    except ValueError:
        return None
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def _title(out: Path) -> str:
    import h5py

    try:
        with h5py.File(intact_hdf5(out / "campaign.nc")) as file:
            return str(file.attrs.get("title", ""))
    except (OSError, RuntimeError, KeyError, ValueError) as why:  # h5py on damaged files
        if failed_by_system(why):
            raise
        return ""


def _table(path: Path) -> list[dict[str, str]]:
    try:
        with naming(path), path.open(encoding="utf-8", newline="") as stream:
            rows = csv.DictReader(stream)
            return [{k: from_spreadsheet(v or "") for k, v in row.items() if k is not None} for row in rows]
    except (OSError, ValueError, csv.Error) as why:
        if failed_by_system(why):
            raise
        return []


def _laws(fits: Sequence[Mapping[str, str]]) -> dict[Key, Interval]:
    found = {}
    for fit in fits:
        for parameter, columns in PARAMETERS.items():
            value, low, high, fit_low, fit_high = (_number(fit.get(column, "")) for column in columns)
            low, high = (low, high) if math.isfinite(low) else (fit_low, fit_high)
            if {"sample", "regime"} <= set(fit) and math.isfinite(value):
                found[fit["sample"], fit["regime"], parameter] = value, low, high
    return found


def _number(cell: str) -> float:
    try:
        return float(cell) if cell else math.nan
    except ValueError:
        return math.nan


KEPT = "laws"  # folder in the state of a site, with the laws of each campaign in a folder of its name


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


def answers_of(current: Path) -> list[dict[str, str]]:
    """What each campaign says of each law of an earlier one, by law and then by campaign.

    Columns: law, found_in, formula, tested_in, answer (held, not held, or cannot be told).
    """
    answers = [answer for verdict in _of_reports(current, "verdict.json") for answer in _in_verdict(verdict)]
    return sorted(answers, key=lambda a: (a["law"], a["tested_in"]))


def _of_reports(folder: Path, pattern: str) -> list[Path]:
    """The files of a pattern in all folders of a folder, by folder and name."""
    return [path for report in found_in(folder, "*") for path in found_in(report, pattern)]


def _in_verdict(path: Path) -> list[dict[str, str]]:
    """The answers of one report; none where its verdict is damaged. Raises OSError where it cannot be read."""
    try:
        known: Sequence[Mapping[str, Any]] = json.loads(text_of(path))["model"].get("known_laws", ())
        return [
            {
                "law": str(law["law"]), "found_in": str(law["found_in"]), "formula": str(law["formula"]),
                "tested_in": path.parent.name, "answer": str(law["answer"]),
            }
            for law in known
        ]  # fmt: skip
    except (FileNotFoundError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return []


def laws_csv(answers: Sequence[Mapping[str, str]]) -> str:
    """laws.csv: one row a law and campaign."""
    text = io.StringIO()
    writer = csv.DictWriter(text, ["law", "found_in", "formula", "tested_in", "answer"], lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: for_spreadsheet(cell) for name, cell in row.items()} for row in answers)
    return text.getvalue()


def laws_in_words(answers: Sequence[Mapping[str, str]]) -> list[str]:
    """One sentence a law: in which campaigns it held and in which it did not."""
    said = []
    for law in dict.fromkeys(a["law"] for a in answers):
        here = [a for a in answers if a["law"] == law]
        by = {answer: [a["tested_in"] for a in here if a["answer"] == answer] for answer in ("held", "not held")}
        parts = [f"{answer} in {', '.join(names)}" for answer, names in by.items() if names]
        said.append(f"{law} ({here[0]['formula']}): {'; '.join(parts) or 'no later campaign can tell'}.")
    return said
