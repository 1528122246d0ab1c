"""What a run with wrong patterns, three causes and next tests showed, counted, in Markdown."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from blind_tables import CAUSES_CERTAIN, held, hidden, right, right_or_tied, share, tied, unknown, wilson, wrong

Row = dict[str, Any]
RIGHT, OFF, HALF_WAY = "right patterns", "patterns off by 15 %", "patterns half way to the measured ones"
# Mechanisms that show in the forces of static or sliding friction, whatever the traces show.
COLUMNS = ("velocity_dependence", "contact_ageing", "run_in", "temperature", "humidity", "covariate:operator")
LOADS = (
    "suction", "normal_load_error", "pressure_dependent_friction", "edge_adhesion", "tilt", "cavity_shear_deformation",
)  # fmt: skip
ASKED_RATIO = {"columns": 1.3, "patterns and loads": 2.5}
# A wrong pattern can look like an effect of patterns and loads, and then adds to its strength.
WAYS = {"columns": ("strength", "staircase"), "patterns and loads": ("staircase",)}
GROUPS = {"columns": COLUMNS, "patterns and loads": LOADS}


def tables(rows: list[Row], halves: list[Row]) -> str:
    """All tables of a run, each under its heading."""
    unique = list({(r["cell"], r["seed"]): r for r in rows}.values())
    parts = (
        ("What is asked", asked(unique, halves)), ("Effects with wrong patterns", by_effect(unique)),
        ("Sizes found half the time", ratios(halves)), ("Three causes at once", by_triple(unique)),
        ("Next tests", by_loop(unique)),
    )  # fmt: skip
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text) + "\n"


def _table(head: tuple[str, ...], lines: list[tuple[object, ...]]) -> str:
    made = [head, ("---",) * len(head), *lines]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in made) if lines else ""


def _of(rows: list[Row], kind: str) -> list[Row]:
    return [r for r in rows if r["kind"] == kind]


def asked(rows: list[Row], halves: list[Row]) -> str:
    """What was asked for, and what was counted."""
    clean, three, loop = (_of(rows, kind) for kind in ("clean", "three", "loop"))
    lines: list[tuple[object, ...]] = []
    for which in (OFF, HALF_WAY):
        named = [r for r in _of(rows, "named") if r["cell"].startswith(which)]
        least = _least(named)
        lines += [
            (f"{which}: cause named, alone or rightly tied", "95 %", share(named, right_or_tied)),
            ("the effect that is named least often", "95 %", least),
            ("the same campaigns: a wrong cause", "at most 2 %", share(named, wrong)),
            ("90 % interval of a size holds the hidden one", "85 to 95 %", share(_sized(named), held)),
        ]
    for group, names in GROUPS.items():
        for by in WAYS[group]:
            what = f"size seen half the time over that with right patterns, {group}, by {by}"
            lines.append((what, f"at most {ASKED_RATIO[group]}", _largest(halves, by, names)))
    counts = [x for r in clean for x in r["held"]]
    lines += [
        ("nothing hidden, patterns off by 15 %: a cause or law named", "at most 1 %", share(clean, blamed)),
        ("90 % interval of a pattern's correction holds the truth", "85 to 95 %", _share_of(counts)),
        ("three causes: all three", "85 %", share(three, right)),
        ("three causes: none wrong", "95 %", share(three, lambda r: not wrong(r))),
        *_loop_lines(loop),
    ]
    return _table(("what", "asked", "counted"), lines)


def blamed(row: Row) -> bool:
    return bool(row["causes"] or row["laws"])


def _sized(rows: list[Row]) -> list[Row]:
    return [r for r in rows if "interval" in r]


def _share_of(counts: list[bool]) -> str:
    if not counts:
        return "none"
    low, high = wilson(sum(counts), len(counts))
    return f"{sum(counts)}/{len(counts)} = {100 * np.mean(counts):.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def _least(rows: list[Row]) -> str:
    shares = {c: [r for r in rows if r["cell"] == c] for c in {r["cell"] for r in rows}}
    worst = min(shares, key=lambda c: sum(map(right_or_tied, shares[c])) / len(shares[c]), default="")
    return f"{worst.split(': ', 1)[1]}: {share(shares[worst], right_or_tied)}" if worst else "none"


def by_effect(rows: list[Row]) -> str:
    lines: list[tuple[object, ...]] = []
    named = _of(rows, "named")
    for cell in sorted({r["cell"] for r in named}):
        group = [r for r in named if r["cell"] == cell]
        sized = _sized(group)
        counts = (sum(map(test, group)) for test in (right_or_tied, wrong, unknown))
        ratio = np.median([r["interval"][2] / r["interval"][0] for r in sized]) if sized else float("nan")
        kept = f"{sum(map(held, sized))}/{len(sized)}, {ratio:.2f}" if sized else ""
        said = "; ".join(f"{n} {a}" for a, n in Counter(map(_answer, group)).most_common(3))
        lines.append((cell, f"{group[0]['effects'][0][1]:g}", len(group), *counts, kept, said))
    head = ("hidden", "size", "campaigns", "right or tied", "wrong", "unknown", "interval holds, ratio", "answers")
    return _table(head, lines)


def _answer(row: Row) -> str:
    causes = " and ".join("/".join(c) for c in row["causes"])
    return causes if row["verdict"] == "named" else f"{row['verdict']} {causes}".strip()


def _sizes(halves: list[Row], by: str) -> dict[tuple[str, str], float]:
    """Sizes found half the time by effect and patterns: of staircases, or (up to a factor) one over a mean strength."""
    if by == "staircase":
        return {(r["effect"], r["patterns"]): r["half"] for r in halves if "half" in r}
    return {(r["effect"], r["patterns"]): 1.0 / float(np.mean(r["strengths"])) for r in halves if "strengths" in r}


def _ratios(halves: list[Row], by: str) -> dict[str, tuple[float, float]]:
    """Sizes with both kinds of wrong patterns over that with right ones, by effect."""
    sizes, found = _sizes(halves, by), {}
    for name in (*COLUMNS, *LOADS):
        each = [sizes.get((name, which)) for which in (RIGHT, OFF, HALF_WAY)]
        if all(each):
            right_one, off, half_way = (float(x or 0.0) for x in each)
            found[name] = (off / right_one, half_way / right_one)
    return found


def _largest(halves: list[Row], by: str, names: tuple[str, ...]) -> str:
    """Median and largest ratio of these effects, over both kinds of patterns."""
    found = {name: pair for name, pair in _ratios(halves, by).items() if name in names}
    if not found:
        return "not measured"
    worst = max(found, key=lambda name: max(found[name]))
    return f"{np.median(list(found.values())):.2f} in the median, {max(found[worst]):.2f} at most ({worst})"


def ratios(halves: list[Row]) -> str:
    """One line an effect: sizes of the staircases, and their ratios by both ways."""
    sizes, stairs, strengths = _sizes(halves, "staircase"), _ratios(halves, "staircase"), _ratios(halves, "strength")
    lines: list[tuple[object, ...]] = []
    for group, names in GROUPS.items():
        for name in names:
            if name in stairs:
                own = (f"{sizes[name, which]:.3g}" for which in (RIGHT, OFF, HALF_WAY))
                by_strength = strengths.get(name, ()) if "strength" in WAYS[group] else ("", "")
                each = (x and f"{x:.2f}" for x in (*stairs[name], *by_strength))
                lines.append((name, group, *own, *each))
    head = ("effect", "of", "right", "off by 15 %", "half way", "off, ratio", "half way, ratio", "off, by strength",
            "half way, by strength")  # fmt: skip
    return _table(head, lines)


def by_triple(rows: list[Row]) -> str:
    three = _of(rows, "three")
    lines: list[tuple[object, ...]] = []
    for number in range(4):
        alike = [r for r in three if len(hidden(r) & set(LOADS)) == number]
        if alike:
            counts = len(alike), sum(map(right, alike)), "", sum(map(wrong, alike))
            lines.append((f"{number} of patterns and loads", *counts))
    for name in (*COLUMNS, *LOADS):
        with_it = [r for r in three if name in hidden(r)]
        if with_it:
            missed = [r for r in with_it if not any(name in c for c in r["causes"])]
            lines.append((name, len(with_it), sum(map(right, with_it)), len(missed), sum(map(wrong, with_it))))
    return _table(("among the three", "campaigns", "all three named", "this one not named", "a wrong one"), lines)


def one_right(row: Row) -> bool:
    """One answer stands, and it is the hidden one."""
    names = {name for c in row["causes"] for name in c}
    return row["verdict"] in CAUSES_CERTAIN and names == hidden(row)


def started_tied(row: Row) -> bool:
    return bool(row["steps"])


def _loop_lines(loop: list[Row]) -> list[tuple[object, ...]]:
    begun = [r for r in loop if started_tied(r)]
    pulls = [sum(s["pulls"] for s in r["steps"]) for r in begun]
    median = f"{np.median(pulls):.0f} ({max(pulls)} at most)" if pulls else "none"
    return [
        ("tied or undetermined campaigns: one right answer after at most three tests", "90 %", share(begun, one_right)),
        ("the same: a wrong answer", "", share(begun, wrong)),
        ("further pulls, median", "said", median),
    ]


def by_loop(rows: list[Row]) -> str:
    loop = [r for r in _of(rows, "loop") if started_tied(r)]
    lines: list[tuple[object, ...]] = []
    for name in sorted({next(iter(hidden(r))) for r in loop}):
        group = [r for r in loop if name in hidden(r)]
        tests = Counter(s["how"] for r in group for s in r["steps"])
        said = "; ".join(f"{n} {how}" for how, n in tests.most_common())
        ends = "; ".join(f"{n} {a}" for a, n in Counter(map(_answer, group)).most_common(3))
        steps = np.mean([len(r["steps"]) for r in group])
        counts = sum(map(one_right, group)), sum(map(wrong, group)), sum(map(tied, group))
        lines.append((name, len(group), *counts, f"{steps:.1f}", said, ends))
    head = ("hidden", "campaigns", "one right answer", "wrong", "still tied", "tests, mean", "tests made", "answers")
    return _table(head, lines)
