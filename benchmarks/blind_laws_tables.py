"""What a run of hidden laws showed, counted, in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from blind_tables import share

Row = dict[str, Any]
MOST_TIES = 3
SHOWN = 6.0  # strength of a law in another campaign: half of what is hidden in the first
WITHIN = 1.10  # of the error of the true law


def form_right(row: Row) -> bool:
    """The form of the law, or one of at most three ties."""
    return bool(row.get("form_right") or (row.get("form_tied") and len(row["ties"]) <= MOST_TIES))


def where_right(row: Row) -> bool:
    return bool(row.get("regime_right") and row.get("samples_right"))


def tables(rows: list[Row]) -> str:
    """All tables of a run, each under its heading."""
    unique = list({(r["cell"], r["form"], r["seed"]): r for r in rows}.values())
    parts = (("All laws", overall(unique)), ("By form", by_form(unique)), ("What was said instead", confusion(unique)))
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text) + "\n"


def _table(head: tuple[str, ...], lines: list[tuple[object, ...]]) -> str:
    made = [head, ("---",) * len(head), *lines]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in made)


def overall(rows: list[Row]) -> str:
    laws, clean = _of(rows, "law"), _of(rows, "clean")
    same, other = _of(rows, "next, same law"), _of(rows, "next, another law")
    tested = [r for r in laws if "band" in r]
    lines: list[tuple[object, ...]] = [
        ("a law is written", "", share(laws, lambda r: r["laws"] > 0)),
        ("the same, or a cause that is the law of a recorded column", "", share(laws, lambda r: "columns" in r)),
        ("column", "97 %", share(laws, lambda r: bool(r.get("column_right")))),
        ("regime and samples", "95 %", share(laws, where_right)),
        ("form, or among at most three ties", "85 %", share(laws, form_right)),
        ("error on pulls left out, over that of the true law (all campaigns)", "1.10", _ratio(tested)),
        ("the same: campaigns within 10 %", "", share(tested, lambda r: r["error_found"] <= WITHIN * r["error_true"])),
        ("the 90 % band holds the hidden change (mean share of tests)", "85 to 95 %", _mean(tested, "band")),
        ("clean campaigns: a law written", "at most 1 %", share(clean, lambda r: r["laws"] > 0)),
        ("the same law in the next campaign: held", "95 %", share(same, lambda r: r["answer"] == "held")),
        ("the same, where it is found and acts there at a strength of six or more", "",
         share([r for r in same if r.get("strength", 0.0) >= SHOWN], lambda r: r["answer"] == "held")),
        ("another law in the next campaign: held", "at most 3 %", share(other, lambda r: r["answer"] == "held")),
        ("processor time of a campaign, median", "", _seconds(laws)),
    ]  # fmt: skip
    return _table(("what", "asked", "counted"), lines)


def _of(rows: list[Row], cell: str) -> list[Row]:
    return [r for r in rows if r["cell"] == cell]


def _ratio(rows: list[Row]) -> str:
    if not rows:
        return "none"
    found, true = (np.sqrt(np.mean([r[key] ** 2 for r in rows])) for key in ("error_found", "error_true"))
    return f"{found / true:.3f}"


def _mean(rows: list[Row], key: str) -> str:
    return f"{100 * np.mean([r[key] for r in rows]):.1f} %" if rows else "none"


def _seconds(rows: list[Row]) -> str:
    return f"{np.median([r['seconds'] for r in rows]):.1f} s" if rows else "none"


def by_form(rows: list[Row]) -> str:
    tests: dict[str, Callable[[Row], bool]] = {
        "column": lambda r: bool(r.get("column_right")), "where": where_right, "form": form_right,
        "error": lambda r: bool(r.get("error_found", 9.0) <= WITHIN * r.get("error_true", 1.0)),
    }  # fmt: skip
    lines: list[tuple[object, ...]] = []
    for form in dict.fromkeys(r["form"] for r in sorted(_of(rows, "law"), key=lambda r: str(r["form"]))):
        g = [r for r in _of(rows, "law") if r["form"] == form]
        band = [r for r in g if "band" in r]
        lines.append((form, len(g), *(sum(map(test, g)) for test in tests.values()), _mean(band, "band")))
    return _table(("hidden", "campaigns", "column", "regime and samples", "form", "error", "band"), lines)


def confusion(rows: list[Row]) -> str:
    """What was said where column, place or form was wrong."""
    bad = [r for r in _of(rows, "law") if not (r.get("column_right") and where_right(r) and form_right(r))]
    found = Counter((r["form"], _said(r)) for r in bad)
    lines: list[tuple[object, ...]] = [(a, b, n) for (a, b), n in found.most_common()]
    return _table(("hidden", "said", "campaigns"), lines) if lines else ""


def _said(r: Row) -> str:
    causes = " with " + " and ".join(r["causes"]) if r["causes"] else ""
    if "cause" in r:
        return f"{r['kind']} of {r['columns'][0]} as a cause, {len(r['ties'])} ties"
    if not r["laws"]:
        return f"no law ({r['verdict']}{causes})"
    law = f"{r['kind']} of {' and '.join(r['columns'])}, {r['acts_on']}, {r['regime']}, {r['where']}"
    return f"{law}, {len(r['ties'])} ties{causes}"
