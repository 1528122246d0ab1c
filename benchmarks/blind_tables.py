"""What a run of hidden effects showed, counted: one table for the docs, in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

TIED = {"suction", "normal_load_error"}
# columns a misfit may follow where the effect follows something with several recorded names
FOLLOWS = {
    "outside:day": {"time of day"}, "outside:temperature": {"temperature_C"}, "outside:humidity": {"humidity_pct"},
    "outside:counterface": {"run_order", "started_at", "date"},
}  # fmt: skip
Row = dict[str, Any]


def hidden(row: Row) -> set[str]:
    return {name for name, _ in row["effects"]}


def right(row: Row) -> bool:
    """Every hidden cause named, alone or in its inseparable set, and no other; unknown for what is outside."""
    names = hidden(row)
    if not names:
        return bool(row["verdict"] == "no_misfit")
    if any(name.startswith("outside") for name in names):
        return bool(row["verdict"] == "unknown")
    return row["verdict"] == "named" and not wrong(row) and all(any(n in c for c in row["causes"]) for n in names)


def wrong(row: Row) -> bool:
    """A set was named that holds nothing of what was hidden."""
    return row["verdict"] == "named" and any(not set(c) & hidden(row) for c in row["causes"])


def part(row: Row) -> bool:
    """At least one hidden cause named, and no wrong one."""
    return row["verdict"] == "named" and not wrong(row) and bool(row["causes"])


def both_tied(row: Row) -> bool:
    """Suction and load error named together, with a test that separates them."""
    together = any(set(c) >= TIED for c in row["causes"])
    return row["verdict"] == "named" and together and set(row.get("next_test", {}).get("separates", ())) >= TIED


def covariate_right(row: Row) -> bool:
    return any(c in FOLLOWS[name] for name in hidden(row) if name in FOLLOWS for c in row["covariates"][:1])


def held(row: Row) -> bool:
    truth, low, _, high = row["interval"]
    return bool(low <= truth <= high)


def no_gain(row: Row) -> bool:
    difference, error = row["gain"]
    return bool(difference - 1.645 * error <= 0.0)


def share(rows: list[Row], test: Callable[[Row], bool]) -> str:
    """Count and share, with the 90 % interval of Wilson's score."""
    n, k = len(rows), sum(map(test, rows))
    if not n:
        return "none"
    z2 = 1.645**2
    centre, half = (k + z2 / 2) / (n + z2), (z2 * (k * (n - k) / n + z2 / 4)) ** 0.5 / (n + z2)
    return f"{k}/{n} = {100 * k / n:.1f} % ({100 * (centre - half):.0f} to {100 * (centre + half):.0f})"


def tables(rows: list[Row]) -> str:
    """All tables of a run."""
    unique = list({(r["cell"], r["seed"]): r for r in rows}.values())
    return "\n\n".join([_summary(unique), _cells(unique), _confusion(unique), _coverage(unique)]) + "\n"


def _cell_rows(rows: list[Row], test: Callable[[str], bool]) -> list[Row]:
    return [r for r in rows if test(r["cell"])]


def _summary(rows: list[Row]) -> str:
    clean = _cell_rows(rows, lambda c: c == "clean")
    inside = [r for r in rows if r["effects"] and not any(n.startswith("outside") for n in hidden(r))]
    seen = [r for r in inside if not hidden(r) <= UNSEEN and len(r["effects"]) == 1]
    at3, at6 = (_cell_rows(seen, lambda c, t=t: c.endswith(f" x {t}") or c.endswith(" x 1")) for t in (3, 6))  # type: ignore[misc]
    tied = [r for r in seen if hidden(r) <= TIED]
    outside = [r for r in rows if any(n.startswith("outside") for n in hidden(r))]
    pairs = [r for r in rows if len(r["effects"]) == 2]
    unseen = [r for r in inside if hidden(r) <= UNSEEN]
    gained = [r for r in clean if r.get("gain")]
    lines = [
        ("nothing hidden: a cause named", share(clean, lambda r: bool(r["causes"]))),
        ("nothing hidden: a misfit seen", share(clean, lambda r: r["verdict"] != "no_misfit")),
        ("nothing hidden: 90 % interval of the best mechanism's gain holds zero or less", share(gained, no_gain)),
        ("three times the size found half the time: right", share(at3, right)),
        ("the same: wrong", share(at3, wrong)),
        ("six times: right", share(at6, right)),
        ("six times: wrong", share(at6, wrong)),
        ("suction or load error: both named, with a test that parts them", share(tied, both_tied)),
        ("outside the library: unknown", share(outside, right)),
        ("outside the library: the column right", share(outside, covariate_right)),
        ("two causes: both", share(pairs, right)),
        ("two causes: at least one and none wrong", share(pairs, part)),
        ("90 % interval holds the hidden size", share([r for r in rows if "interval" in r], held)),
        ("what no such design shows: no cause named", share(unseen, lambda r: not r["causes"])),
    ]
    return "| what | campaigns |\n|---|---|\n" + "\n".join(f"| {a} | {b} |" for a, b in lines)


UNSEEN = {"pull_angle", "pulley_friction", "machine_compliance", "sampling_clip"}


def _cells(rows: list[Row]) -> str:
    lines = ["| hidden | size | campaigns | misfit seen | right | wrong | answers |", "|---|---|---|---|---|---|---|"]
    for cell in sorted({r["cell"] for r in rows}):
        g = _cell_rows(rows, lambda c, cell=cell: c == cell)  # type: ignore[misc]
        size = ", ".join(f"{s:g}" for _, s in g[0]["effects"])
        answers = Counter(_answer(r) for r in g).most_common(4)
        seen = sum(r["verdict"] != "no_misfit" for r in g)
        said = "; ".join(f"{n} {a}" for a, n in answers)
        lines.append(f"| {cell} | {size} | {len(g)} | {seen} | {sum(map(right, g))} | {sum(map(wrong, g))} | {said} |")
    return "\n".join(lines)


def _answer(row: Row) -> str:
    causes = " and ".join("/".join(c) for c in row["causes"])
    return causes if row["verdict"] == "named" else f"{row['verdict']} {causes}".strip()


def _confusion(rows: list[Row]) -> str:
    """What was named where it was wrong."""
    bad = [r for r in rows if wrong(r) or (not r["effects"] and r["causes"])]
    found = Counter((" + ".join(sorted(hidden(r))) or "nothing", _answer(r)) for r in bad)
    lines = ["| hidden | named wrongly | campaigns |", "|---|---|---|"]
    return "\n".join([*lines, *(f"| {a} | {b} | {n} |" for (a, b), n in found.most_common())])


def _coverage(rows: list[Row]) -> str:
    lines = ["| effect | 90 % interval holds the hidden size | median of recovered over hidden |", "|---|---|---|"]
    for name in sorted({n for r in rows if "interval" in r for n in hidden(r)}):
        g = [r for r in rows if "interval" in r and hidden(r) == {name}]
        ratios = sorted(r["interval"][2] / r["interval"][0] for r in g)
        lines.append(f"| {name} | {share(g, held)} | {ratios[len(ratios) // 2]:.2f} |")
    return "\n".join(lines)
