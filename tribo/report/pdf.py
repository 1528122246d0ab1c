"""report.pdf: the same record as the page, set on A4 with typst; the same bytes for the same inputs and choices."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.resources import files
from typing import Any

from tribo.comparison.findings import LoadRatio
from tribo.files import write_bytes, write_text
from tribo.records import Study
from tribo.report.content import figure_numbers, figure_places
from tribo.report.drawings import Drawn
from tribo.temporary import temporary_folder
from tribo.wording.card import Card
from tribo.wording.numerals import ratio_text, significant, unbroken

TEMPLATE = "report.typ"
MOST_TESTS = 24  # of a flag, about two lines
FRICTION = {
    "samples": "Samples", "laws": "Law of friction against load", "dependence": "Dependence on recorded variables",
    "oscillation": "Sliding regimes and restarts",
}  # fmt: skip
NOT_OF_THE_INPUTS = ("Command", "Started")  # differ from run to run, which the bytes of the PDF must not


def pdf_of(said: Mapping[str, Any], figures: Mapping[str, Drawn], origin: str) -> bytes:
    """The document with the given content (:func:`tribo.report.content.content`) and figures.

    Its date is that of the last test, or none if no test has a time. The command and the time of the run are left to
    provenance.json, so that two runs over the same inputs with the same choices give the same bytes.
    """
    import typst

    record = record_of(said, figures)
    record["origin"] = origin
    pictures = {f"{name}.svg": figure.files["svg"] for name, figure in figures.items()}
    template = (files("tribo.report") / "templates" / TEMPLATE).read_text(encoding="utf-8")
    data = json.dumps(record, ensure_ascii=False).encode("utf-8")
    with temporary_folder() as folder:
        for name, content in {"data.json": data, **pictures}.items():
            write_bytes(folder / name, content)
        write_text(folder / "document.typ", template)
        compiler: Any = typst.Compiler(root=folder, ignore_system_fonts=True)
        return bytes(compiler.compile(folder / "document.typ", format="pdf", timestamp=_last_day(said["study"])))


def _last_day(study: Study) -> datetime:
    """Time of the newest test; without any, 1970-01-01."""
    days = []
    for test in study.ingested.campaign.tests:
        try:
            day = datetime.fromisoformat(test.started_at)
        except ValueError:
            continue
        days.append(day if day.tzinfo else day.replace(tzinfo=UTC))
    return max(days, default=datetime.fromtimestamp(0, UTC))


def record_of(said: Mapping[str, Any], figures: Mapping[str, Drawn]) -> dict[str, Any]:
    """The content as plain strings and tables of strings."""
    verdict, summary, campaign, study = said["verdict"], said["summary"], said["campaign"], said["study"]
    record = {
        "title": campaign.title,
        "about": said["about"],
        "friction": [[title, said["friction"][key]] for key, title in FRICTION.items() if said["friction"][key]],
        "law": "T = μN + τ₀A" if said["has_area"] else "T = μN + T₀",
        "verdict": verdict,
        "card": _card(said["card"]),
        "model": summary["model"],
        "flat": summary["flat"],
        "measured": summary["measured"],
        "set_aside": [[fault.test_id, fault.reason] for fault in said["set_aside"]],
        "by_hand": said["by_hand"],
        "flags": [[flag, str(count), _first_tests(tests)] for flag, count, tests in said["flags"]],
        "tribosystem": [[c.name, c.in_words] for c in said["tribosystem"]],
        "uncertainty_kind": said["uncertainty_kind"],
        "load": significant(said["table2"]["load_N"]),
        "correlation": summary["correlation"],
        "table2": _table2(said["table2"], "τ₀ (kPa)" if said["has_area"] else "T₀ (N)"),
        "paired": said["paired"],
        "table2_notes": [[f"{f.sample}, {f.regime}", "; ".join(f.notes)] for f in study.fits if f.notes],
        "agreement": [_agreement(part) for part in said["agreement"]],
        "calibration": said["calibration"],
        "flat_sample": study.comparison.flat if study.comparison is not None else "",
        "how_to_read": summary["how_to_read"],
        "order": summary["order"],
        "directions": summary["directions"],
        "budget": [
            {
                "title": _title(table["regime"]), "caption": table["caption"], "sentence": table["sentence"],
                "head": ["Sample", *table["components"], "u(T), combined (N)"],
                "rows": [[sample, *shares, combined] for sample, shares, combined in table["rows"]],
            }
            for table in said["budget"]
        ],
        "budget_origins": said["budget_origins"],
        "power": study.power,
        "outlying": study.outlying,
        "notes": study.notes,
        "provenance": [[n, v] for n, v in said["provenance"] or () if n not in NOT_OF_THE_INPUTS],
        "pulls": [_pull_row(card) for card in sorted(said["cards"], key=lambda card: card["test_id"])],
        **_diagnosis_tables(verdict),
    }
    spaced: dict[str, Any] = _spaced(record)
    numbers = figure_numbers(list(figures))
    return spaced | {
        "places": figure_places(list(figures)),
        "figures": {
            f.name: {"title": f.title, "caption": f.caption, "number": str(numbers[f.name])} for f in figures.values()
        },
    }


def _title(regime: str) -> str:
    return f"{regime.capitalize()} friction"


def _table2(table: Mapping[str, Any], intercept: str) -> list[dict[str, Any]]:
    head = ["Sample", "AF", "μ", intercept, "T (N)", "Specimens, tests", "χ²/ν"]
    if table["simulated"]:
        head[5:5] = ["μ simulated", "τ₀ simulated", "T simulated"]
    return [
        {
            "title": _title(regime),
            "head": head,
            "rows": [
                [sample, f"{af:.3f}", *measured, *(model if table["simulated"] else ()),
                 f"{fit.n_specimens}, {fit.n_tests}", significant(fit.chi2_red, 2)]
                for sample, af, measured, model, fit in rows
            ],
        }
        for regime, rows in table["regimes"]
    ]  # fmt: skip


def _card(card: Card) -> dict[str, Any]:
    """The card with its next test in one line."""
    said = asdict(card) | {"next": card.next_test["line"] if card.next_test is not None else ""}
    return said | {"laws": [list(law.values()) for law in card.laws]}


def _agreement(part: Mapping[str, Any]) -> dict[str, Any]:
    """The ratios of one regime, one column per load, and the sentence of each sample."""
    head = ["Sample", *(f"{significant(load)} N" for load in part["loads"])]
    rows = [
        [f"{a.sample} (calibrated)" if a.calibrated else a.sample, *(_ratio(cell, part["marks"]) for cell in cells)]
        for a, cells in part["rows"]
    ]
    return {"title": _title(part["regime"]), "head": head, "ratios": rows, "rows": part["sentences"]}


def _ratio(cell: LoadRatio | None, marks: Mapping[str, str]) -> str:
    if cell is None:
        return "–"
    return f"{marks[cell.verdict]} {cell.ratio:.2f} ({ratio_text(cell.low)}–{ratio_text(cell.high)})"


def _diagnosis_tables(verdict: Mapping[str, Any] | None) -> dict[str, list[Any]]:
    if verdict is None:
        return {"misfits": [], "causes": [], "excluded": [], "not_testable": [], "corrections": [], "laws": []}
    return {
        "misfits": [[m["observable"], m["p"], m["sample"], m["covariate"], m["text"]] for m in verdict["misfits"]],
        "causes": [[c["mechanism"], c["weight"], "; ".join(c["sizes"]), c["text"]] for c in verdict["causes"]],
        "excluded": verdict["excluded"],
        "not_testable": verdict["not_testable"],
        "corrections": verdict["corrections"],
        "laws": [[law["formula"], law["text"], law["ties"], law["gain"]] for law in verdict["laws"]],
    }


def _first_tests(tests: list[str]) -> str:
    """The tests that carry a flag; of many the first ones, since tests.csv has all of them."""
    more = f" and {len(tests) - MOST_TESTS} more; see tests.csv" if len(tests) > MOST_TESTS else ""
    return ", ".join(tests[:MOST_TESTS]) + more


def _pull_row(card: Mapping[str, Any]) -> list[str]:
    by_hand = {"used": "", "moved": "moved by hand", "excluded": "excluded by hand"}[card["state"]]
    return [
        *(card[name] for name in ("test_id", "sample", "specimen", "load", "static", "sliding", "window")),
        significant(card["oddness"], 2), "; ".join(part for part in (card["flags_in_words"], by_hand) if part),
    ]  # fmt: skip


def _spaced(value: Any) -> Any:
    """The same record with unbreakable spaces where numbers and units stand."""
    if isinstance(value, str):
        return unbroken(value)
    if isinstance(value, Mapping):
        return {key: _spaced(part) for key, part in value.items()}
    if isinstance(value, Iterable):
        return [_spaced(part) for part in value]
    return value
