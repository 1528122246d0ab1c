"""What a run of hidden effects showed, counted: the tables of docs/blind.md, in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

TIED = {"suction", "normal_load_error"}
UNSEEN = {"pull_angle", "pulley_friction", "machine_compliance", "sampling_clip"}
# columns a misfit may follow where the effect follows something with several recorded names
FOLLOWS = {
    "outside:day": {"time of day"}, "outside:temperature": {"temperature_C"}, "outside:humidity": {"humidity_pct"},
    "outside:counterface": {"run_order", "started_at", "date"},
}  # fmt: skip
AXES = {
    "pattern_error": "pattern error, times the assumed one", "specimen_slope": "specimen slope per e-fold of load",
    "noise": "noise law", "pattern_draw": "distribution of the pattern error",
}  # fmt: skip
CAUSES_CERTAIN = ("named", "partly")  # verdicts whose causes are certain, whatever else is left
Row = dict[str, Any]
Test = Callable[[Row], bool]


def hidden(row: Row) -> set[str]:
    return {name for name, _ in row["effects"]}


def right(row: Row) -> bool:
    """Every hidden cause named, alone or in its inseparable set, and no other; unknown for what is outside."""
    names = hidden(row)
    if not names:
        return bool(row["verdict"] == "no_misfit")
    if any(name.startswith("outside") for name in names):
        return bool(row["verdict"] == "unknown")
    all_named = all(any(n in c for c in row["causes"]) for n in names)
    return row["verdict"] in CAUSES_CERTAIN and not wrong(row) and all_named


def wrong(row: Row) -> bool:
    """A set was named that holds nothing of what was hidden."""
    return row["verdict"] in CAUSES_CERTAIN and any(not set(c) & hidden(row) for c in row["causes"])


def part(row: Row) -> bool:
    """At least one hidden cause named, and no wrong one."""
    return row["verdict"] in CAUSES_CERTAIN and not wrong(row) and bool(row["causes"])


def tied(row: Row) -> bool:
    """Undecided between at most three causes, every hidden one among them."""
    listed = {name for causes in row["causes"] for name in causes}
    return row["verdict"] == "undetermined" and len(listed) <= 3 and bool(hidden(row)) and hidden(row) <= listed


def right_or_tied(row: Row) -> bool:
    return right(row) or tied(row)


def unknown(row: Row) -> bool:
    return bool(row["verdict"] == "unknown")


def seen(row: Row) -> bool:
    return bool(row["verdict"] != "no_misfit")


def blamed(row: Row) -> bool:
    """Any cause was given, alone or as one of several."""
    return bool(row["causes"])


def both_tied(row: Row) -> bool:
    """Suction and load error named together, with a test that separates them."""
    together = any(set(c) >= TIED for c in row["causes"])
    return row["verdict"] in CAUSES_CERTAIN and together and set(row.get("next_test", {}).get("separates", ())) >= TIED


def covariate_right(row: Row) -> bool:
    return any(c in FOLLOWS[name] for name in hidden(row) if name in FOLLOWS for c in row["covariates"][:1])


def held(row: Row) -> bool:
    truth, low, _, high = row["interval"]
    return bool(low <= truth <= high)


def no_gain(row: Row) -> bool:
    difference, error = row["gain"]
    return bool(difference - 1.645 * error <= 0.0)


def share(rows: list[Row], test: Test) -> str:
    """Count and share, with the 90 % interval of Wilson's score."""
    n, k = len(rows), sum(map(test, rows))
    if not n:
        return "none"
    low, high = wilson(k, n)
    return f"{k}/{n} = {100 * k / n:.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def wilson(k: int, n: int) -> tuple[float, float]:
    """90 % interval of a share of which k in n were counted."""
    z2 = 1.645**2
    centre, half = (k + z2 / 2) / (n + z2), (z2 * (k * (n - k) / n + z2 / 4)) ** 0.5 / (n + z2)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def tables(rows: list[Row]) -> str:
    """All tables of a run, each under its heading."""
    unique = list({(r["cell"], r["seed"]): r for r in rows}.values())
    parts = (
        ("What is promised", promised(unique)), ("Over the range of errors", curve_tables(unique)),
        ("At the assumed error", as_before(unique)), ("Every cell", cells(unique)),
        ("What was named wrongly", confusion(unique)), ("Recovered sizes", coverage(unique)),
    )  # fmt: skip
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in parts if text) + "\n"


def _table(head: Iterable[str], lines: Iterable[Iterable[object]]) -> str:
    """A table in Markdown; empty without lines."""
    names, body = list(head), [[str(x) for x in line] for line in lines]
    made = [names, ["---"] * len(names), *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in made) if body else ""


def _of(rows: list[Row], test: Callable[[str], bool]) -> list[Row]:
    return [r for r in rows if test(r["cell"])]


def promised(rows: list[Row]) -> str:
    """The figures that are promised, and what was counted."""
    clean = _of(rows, lambda c: c == "clean")
    swept = _of(rows, lambda c: c.endswith("swept"))
    least = min(
        ((sum(map(right_or_tied, g)) / len(g), name) for name, g in _by_effect(swept).items()), default=(0.0, "none")
    )
    sized = [r for r in rows if "interval" in r]
    worst = min(
        ((sum(map(held, g)) / len(g), name) for name, g in _by_effect(sized).items()), default=(0.0, "none")
    )
    lines = [
        ("nothing hidden: a cause named", "at most 1 %", share(clean, blamed)),
        ("nothing hidden: a misfit reported", "at most 3 %", share(clean, seen)),
        *(
            (f"nothing hidden, pattern error {t} times: a cause named", "at most 2 %",
             share(_of(rows, lambda c, t=t: c == f"clean, pattern error {t}"), blamed))  # type: ignore[misc]
            for t in (2, 3)
        ),
        ("one effect, pattern error 1.5 times, slopes 4 %: right or tied", "95 %", share(swept, right_or_tied)),
        ("the same: right", "", share(swept, right)),
        ("the effect that is right or tied least often", "95 %", f"{least[1]}: {100 * least[0]:.0f} %"),
        ("the same campaigns: a wrong cause named", "", share(swept, wrong)),
        ("90 % interval of a recovered size holds the hidden one", "87 to 93 %", share(sized, held)),
        ("the effect whose intervals hold least often", "84 %", f"{worst[1]}: {100 * worst[0]:.0f} %"),
    ]  # fmt: skip
    return _table(("what", "promised", "counted"), lines)


def _by_effect(rows: list[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(" + ".join(sorted(hidden(row))), []).append(row)
    return found


def curve_rows(rows: list[Row]) -> dict[str, dict[str, dict[str, list[Row]]]]:
    """Rows of the curves by axis, value on it, and "clean" or the name of the effect."""
    found: dict[str, dict[str, dict[str, list[Row]]]] = {}
    for row in _of(rows, lambda c: c.startswith("curve ")):
        _, axis, value, name = row["cell"].split(" ", 3)
        found.setdefault(axis, {}).setdefault(value, {}).setdefault(name, []).append(row)
    return found


def curve_tables(rows: list[Row]) -> str:
    """One table an axis: clean campaigns, then all effects together."""
    made = []
    for axis, by_value in curve_rows(rows).items():
        lines = []
        for value in sorted(by_value, key=lambda v: (0, float(v)) if v[0].isdigit() else (1, 0.0)):
            groups = by_value[value]
            clean = groups.get("clean", [])
            effects = [r for name, g in groups.items() if name != "clean" for r in g]
            counted = (share(clean, blamed), share(clean, seen), *(_percent(effects, t) for t in COUNTED.values()))
            lines.append((value, *counted))
        head = (AXES[axis], "clean: cause named", "clean: misfit", *(f"effects: {name}" for name in COUNTED))
        made.append(_table(head, lines))
    return "\n\n".join(made)


COUNTED: dict[str, Test] = {
    "right": right, "wrong": wrong, "tied": tied, "unknown": unknown, "not seen": lambda r: not seen(r),
}  # fmt: skip


def _percent(rows: list[Row], test: Test) -> str:
    return f"{100 * sum(map(test, rows)) / len(rows):.0f} %" if rows else ""


def as_before(rows: list[Row]) -> str:
    """Pattern error 1, no specimen slopes, relative noise: what was counted before the sweep was made."""
    plain = _of(rows, lambda c: c[-4:] in (" x 3", " x 6", " x 1") or (" + " in c and not c.endswith("swept")))
    if not plain:
        return ""
    inside = [r for r in plain if not any(n.startswith("outside") for n in hidden(r))]
    single = [r for r in inside if not hidden(r) <= UNSEEN and len(r["effects"]) == 1]
    at3, at6 = (_of(single, lambda c, t=t: c.endswith(f" x {t}") or c.endswith(" x 1")) for t in (3, 6))  # type: ignore[misc]
    load = [r for r in single if hidden(r) <= TIED]
    outside = [r for r in plain if any(n.startswith("outside") for n in hidden(r))]
    pairs = [r for r in plain if len(r["effects"]) == 2]
    unseen = [r for r in inside if hidden(r) <= UNSEEN]
    gained = [r for r in _of(rows, lambda c: c == "clean") if r.get("gain")]
    lines = [
        ("three times the size found half the time: right", share(at3, right)),
        ("the same: wrong", share(at3, wrong)),
        ("six times: right", share(at6, right)),
        ("six times: wrong", share(at6, wrong)),
        ("suction or load error: both named, with a test that separates them", share(load, both_tied)),
        ("outside the library: unknown", share(outside, right)),
        ("outside the library: the column right", share(outside, covariate_right)),
        ("two causes: both", share(pairs, right)),
        ("two causes: at least one and none wrong", share(pairs, part)),
        ("effects that no such design shows: no cause named", share(unseen, lambda r: not r["causes"])),
        ("clean: 90 % interval of the best mechanism's gain holds zero or less", share(gained, no_gain)),
    ]
    return _table(("what", "campaigns"), lines)


def cells(rows: list[Row]) -> str:
    lines = []
    for cell in sorted({r["cell"] for r in rows if not r["cell"].startswith("curve")}):
        g = _of(rows, lambda c, cell=cell: c == cell)  # type: ignore[misc]
        size = ", ".join(f"{s:g}" for _, s in g[0]["effects"])
        said = "; ".join(f"{n} {a}" for a, n in Counter(_answer(r) for r in g).most_common(4))
        counts = (sum(map(test, g)) for test in (seen, right, wrong, tied))
        lines.append((cell, size, len(g), *counts, said))
    return _table(("hidden", "size", "campaigns", "misfit", "right", "wrong", "tied", "answers"), lines)


def _answer(row: Row) -> str:
    causes = " and ".join("/".join(c) for c in row["causes"])
    return causes if row["verdict"] == "named" else f"{row['verdict']} {causes}".strip()


def confusion(rows: list[Row]) -> str:
    """What was named where it was wrong."""
    bad = [r for r in rows if wrong(r)]
    found = Counter((" + ".join(sorted(hidden(r))) or "nothing", _answer(r)) for r in bad)
    return _table(("hidden", "named", "campaigns"), ((a, b, n) for (a, b), n in found.most_common()))


def coverage(rows: list[Row]) -> str:
    lines = []
    for name, g in sorted(_by_effect([r for r in rows if "interval" in r]).items()):
        ratios = sorted(r["interval"][2] / r["interval"][0] for r in g)
        lines.append((name, share(g, held), f"{ratios[len(ratios) // 2]:.2f}"))
    return _table(("effect", "90 % interval holds the hidden size", "median of recovered over hidden"), lines)
