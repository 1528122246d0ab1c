"""What the exams in virtual laboratories showed, counted: what has to hold, by cell, in Markdown."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from blind_tables import CAUSES_CERTAIN, share, wilson

Row = dict[str, Any]
Line = tuple[object, ...]
# Layers that tell the size of a nuisance, and the name of the hidden one
TOLD_AS = {"days": "all days", "drift": "drift", "specimen_drift": "specimen drift"}
NOISY_PERCENT = (2.0, 4.0, 6.0, 8.0, 10.5)
ALIASES = {"mass_g": "normal_load_N", "date": "started_at"}


def tables(rows: list[Row]) -> str:
    """All tables of a run, each under its heading."""
    unique = list({(r["cell"], r["seed"], str(r["what"])): r for r in rows}.values())
    parts = (
        ("What has to hold", must_hold(unique)), ("Nuisance by kind and order", by_nuisance(unique)),
        ("Nuisance by size", by_size(unique)), ("Causes of one value", by_value(unique)),
        ("Levels", by_level(unique)), ("Effects and laws under nuisance", by_effect(unique)),
        ("Gaps", by_gap(unique)), ("Laws as free functions", by_class(unique)), ("Sizes", by_size_of(unique)),
        ("What was said wrongly", confusion(unique)),
    )  # fmt: skip
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text) + "\n"


def table(head: Line, lines: list[Line]) -> str:
    made = [head, ("---",) * len(head), *lines]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in made) if lines else ""


def of(rows: list[Row], cell: str) -> list[Row]:
    return [r for r in rows if r["cell"] == cell]


def share_of(counts: list[bool]) -> str:
    """Count and share, with the 90 % interval of Wilson's score."""
    if not counts:
        return "none"
    low, high = wilson(sum(counts), len(counts))
    return f"{sum(counts)}/{len(counts)} = {100 * np.mean(counts):.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def causes(row: Row) -> list[Row]:
    """Every cause that is given, alone or as one of several."""
    return list(row["causes"])


def certain(row: Row) -> list[Row]:
    return list(row["causes"]) if row["verdict"] in CAUSES_CERTAIN else []


def laws(row: Row) -> list[Row]:
    return [x for x in row["layers"] if x["kind"] == "law"]


def must_hold(rows: list[Row]) -> str:
    """Every row of the promise that this run has campaigns for: what was asked, and what was counted."""
    lines = [
        *nuisance_lines(rows), *disturbed_lines(rows), *gap_lines(rows), *one_value_lines(rows), *level_lines(rows),
        *free_law_lines(rows), *size_lines(rows),
    ]  # fmt: skip
    return table(("what", "asked", "counted"), lines)


# nuisance


def nuisance_lines(rows: list[Row]) -> list[Line]:
    own = of(rows, "nuisance")
    if not own:
        return []
    told, absent = told_sizes(own)
    return [
        ("nuisance only: a physical cause", "at most 1 %", share(own, lambda r: bool(causes(r)))),
        ("nuisance only: a law", "at most 2 %", share(own, lambda r: bool(laws(r)))),
        ("nuisance only: the hidden size within its 90 % interval", "85 to 95 %", share_of([h for *_, h in told])),
        ("the same: kinds that are hidden and not told of", "", share_of(absent)),
    ]


def told_sizes(rows: list[Row]) -> tuple[list[tuple[str, float, bool]], list[bool]]:
    """Name, hidden size and whether its interval holds it, of every nuisance that is hidden and told of; and for each
    hidden one whether it is not told of."""
    told, absent = [], []
    for row in rows:
        layers = {x["name"]: x for x in row["layers"] if x["kind"] == "nuisance"}
        for name, kind in TOLD_AS.items():
            hidden = row["truth"]["nuisance"].get(kind)
            if hidden is None:
                continue
            layer = layers.get(name)
            known = layer is not None and layer["low"] is not None and layer["high"] is not None
            absent.append(not known)
            if known:
                told.append((name, hidden, layer["low"] <= hidden <= layer["high"]))
    return told, absent


def by_nuisance(rows: list[Row]) -> str:
    own, lines = of(rows, "nuisance"), []
    kinds = sorted({" + ".join(r["truth"]["forms"]) for r in own}, key=lambda k: (k.count("+"), k))
    for kind in kinds:
        for order in ("random", "in order"):
            g = [r for r in own if " + ".join(r["truth"]["forms"]) == kind and r["design"]["order"] == order]
            if g:
                told, absent = told_sizes(g)
                lines.append((kind, order, len(g), sum(bool(causes(r)) for r in g), sum(bool(laws(r)) for r in g),
                              share_of([h for *_, h in told]), sum(absent)))  # fmt: skip
    for name in TOLD_AS:
        told = [h for n, _, h in told_sizes(own)[0] if n == name]
        if told:
            lines.append((f"layer {name}", "", len(told), "", "", share_of(told), ""))
    head = ("nuisance", "order", "campaigns", "a cause", "a law", "size within interval", "not told of")
    return table(head, lines)


def by_size(rows: list[Row]) -> str:
    """Causes and laws over the size of the largest nuisance."""
    lines: list[Line] = []
    for low, high in pairwise(NOISY_PERCENT):
        g = [r for r in of(rows, "nuisance") if low <= max(r["truth"]["nuisance"].values()) < high]
        if g:
            lines.append((f"{low:g} to {high:g} %", len(g), share(g, lambda r: bool(causes(r))),
                          share(g, lambda r: bool(laws(r)))))  # fmt: skip
    return table(("largest nuisance", "campaigns", "a cause", "a law"), lines)


# one value


def says_value(text: str, value: str, column: str) -> bool:
    """Whether a text names a value of a column; a mass in grams also as the load in newtons."""
    if column != "mass_g":
        return re.search(rf"(?<![\w-]){re.escape(value)}(?![\w])", text) is not None
    mass = float(value)
    meant = (mass, mass + 1.5, (mass + 1.5) * 9.80665e-3)
    found = [float(x) for x in re.findall(r"\d+(?:\.\d+)?", text)]
    return any(abs(x - m) <= 0.006 * m for x in found for m in meant)


def names_value(row: Row, cause: Row) -> bool:
    """Whether a cause or a law is the hidden one: bound to its value, and not a wrong label or another mechanism."""
    truth = row["truth"]
    name = str(cause.get("mechanism") or cause.get("name"))
    if name == "covariate:operator":
        return bool(truth["column"] == "operator")
    if name == "mislabelled_specimen":
        return False
    text = " ".join(str(cause.get(k, "")) for k in ("mechanism", "name", "choice", "formula", "text"))
    column = truth["column"]
    about = any(w in text for w in (column, ALIASES.get(column, column), column.split("_")[0]))
    return says_value(text, truth["value"], column) and (about or bool(cause.get("choice")))


def value_named(row: Row) -> bool:
    return any(names_value(row, c) for c in (*certain(row), *laws(row)))


def other_named(row: Row) -> bool:
    tied = [set(names) for names in row["equivalent"]]
    right = {c["mechanism"] for c in certain(row) if names_value(row, c)}
    wrong = [
        c for c in certain(row)
        if not names_value(row, c) and not any(c["mechanism"] in names and names & right for names in tied)
    ]  # fmt: skip
    return bool(wrong) or any(not names_value(row, x) for x in laws(row))


def one_value_lines(rows: list[Row]) -> list[Line]:
    own, clean = of(rows, "one value"), of(rows, "one value, clean")
    lines: list[Line] = []
    if own:
        lines += [
            ("one value, patterns off by 15 %: named", "95 %", share(own, value_named)),
            ("the same: of those the observer finds", "",
             share([r for r in own if r["truth"]["strength"] > FOUND], value_named)),
            ("the same: another cause or law named", "at most 2 %", share(own, other_named)),
        ]  # fmt: skip
    if clean:
        blamed = share(clean, lambda r: bool(causes(r) or laws(r)))
        lines.append(("nothing hidden, patterns off by 15 %: a cause or law", "at most 1 %", blamed))
    return lines


def by_value(rows: list[Row]) -> str:
    own, lines = of(rows, "one value"), []
    for kind in dict.fromkeys(r["truth"]["kind"] for r in own):
        g = [r for r in own if r["truth"]["kind"] == kind]
        sizes = sorted(abs(r["truth"]["size"]) for r in g)
        lines.append((kind, f"{sizes[0]:.3g} to {sizes[-1]:.3g} {g[0]['truth']['unit']}", len(g),
                      sum(map(value_named, g)), sum(map(other_named, g)),
                      f"{np.median([r['truth']['strength'] for r in g]):.1f}"))  # fmt: skip
    return table(("hidden", "sizes", "campaigns", "named", "another", "strength, median"), lines)


# levels


def level_lines(rows: list[Row]) -> list[Line]:
    own = of(rows, "levels")
    if not own:
        return []
    return [
        ("levels: values hold the truth", "85 to 95 %", share_of([h for r in own for h in levels_held(r)])),
        ("levels: campaigns in which values are told", "", share(own, lambda r: bool(levels_held(r)))),
        ("levels: the true shape among those listed", "95 %", share(own, shape_listed)),
        ("levels: no misfit left beyond chance", "95 %", share(own, nothing_left)),
        ("levels: the column named", "", share(own, column_named)),
    ]


def levels_held(row: Row) -> list[bool]:
    """For every level that is told of whether its interval holds the hidden value.

    From ``levels`` of a layer of the column (percent of T relative to the mean over the levels), else from the band of
    its law.
    """
    truth = {float_or(name): 100 * np.expm1(x) for name, x in row["truth"]["levels"]}
    for layer in row["layers"]:
        if layer.get("levels") and of_column(layer, row):
            told = {float_or(name): x for name, x in layer["levels"].items()}
            return [bool(told[n][0] <= t <= told[n][2]) for n, t in truth.items() if n in told]
    return [low <= true <= high for _, _, true, low, high in row.get("at_levels", ())]


def float_or(name: str) -> float | str:
    try:
        return float(f"{float(name):.4g}")
    except ValueError:
        return name


def named_column(row: Row) -> str:
    return {"speed_mm_s": "speed"}.get(row["truth"]["column"], row["truth"]["column"])


CAUSES_OF = {"velocity_dependence": "speed_mm_s", "contact_ageing": "hold_s"}


def of_column(layer: Row, row: Row) -> bool:
    """Whether a layer follows the hidden column, by its name or by the mechanism that it is."""
    return named_column(row) in layer["name"] or CAUSES_OF.get(layer["name"]) == row["truth"]["column"]


def column_named(row: Row) -> bool:
    column = named_column(row)
    by_cause = any(CAUSES_OF.get(c["mechanism"]) == row["truth"]["column"] for c in certain(row))
    by_value = any(column in f"{c['mechanism']} {c['choice']}" for c in certain(row))
    return by_cause or by_value or any(column in x["name"] for x in laws(row))


# how each hidden shape may be written, by words of a formula
WRITTEN = {
    "line": ("linear", "line", "proportion"), "line of ln": ("ln", "log"), "parabola of ln": ("ln", "parabola"),
    "step": ("above", "step", "level"), "one apart": ("level", "=", "at "), "rising": (), "any": (),
}  # fmt: skip


def shape_listed(row: Row) -> bool:
    """The values at the levels are told, or a formula of the hidden shape is among those listed.

    A table of levels holds every shape.
    """
    if not column_named(row):
        return False
    own = [x for x in row["layers"] if of_column(x, row)]
    if any(x.get("levels") for x in own):
        return True
    words = WRITTEN[row["truth"]["shape"]]
    listed = " ".join(f for x in own for f in (x["formula"], *x["tied_with"]))
    return any(w in listed for w in words)


def nothing_left(row: Row) -> bool:
    """Nothing but the column is beyond chance."""
    other = [m for m in row["misfits"] if named_column(row) not in m["column"]]
    return column_named(row) and not other and row["within_chance"] is not False


def by_level(rows: list[Row]) -> str:
    own, lines = of(rows, "levels"), []
    tests: tuple[Callable[[Row], bool], ...] = (column_named, shape_listed, nothing_left)
    for part in ("column", "shape"):
        for name in sorted({r["truth"][part] for r in own}):
            g = [r for r in own if r["truth"][part] == name]
            held = share_of([h for r in g for h in levels_held(r)])
            lines.append((f"{part} {name}", len(g), *(sum(map(test, g)) for test in tests), held))
    head = ("hidden", "campaigns", "column named", "shape listed", "nothing left", "values hold")
    return table(head, lines)


# effects and laws under nuisance

FOUND = 4.5  # strength from which an observer who knows all covariances and the course of a change finds it
BY_CHANCE = 0.01  # below which an observer who has to search takes what is found for no chance
MOST_TIED = 3
SERIES = {"run_order", "elapsed_s", "date", "started_at", "time of day", "clock_h", "specimen_run"}
# The recorded columns that an effect follows, by all names that an answer may use
FOLLOWS = {
    "temperature": {"temperature_C"}, "outside:temperature": {"temperature_C"}, "humidity": {"humidity_pct"},
    "outside:humidity": {"humidity_pct"}, "velocity_dependence": {"speed_m_s", "speed_mm_s"},
    "contact_ageing": {"hold_s"}, "covariate:operator": {"operator"}, "run_in": {"specimen_run"},
    "outside:day": {"time of day", "clock_h", "elapsed_s", "run_order", "started_at"},
    "outside:counterface": {"run_order", "elapsed_s", "date", "started_at"},
}  # fmt: skip


def columns_of_cause(mechanism: str) -> set[str]:
    return FOLLOWS.get(mechanism, {mechanism.removeprefix("covariate:")} if ":" in mechanism else set())


def columns_of_law(layer: Row) -> set[str]:
    return set(layer["name"].split(" and "))


def effect_found(row: Row) -> bool:
    """Named alone or in its inseparable set, among at most three that are undecided, or by a law or a misfit of the
    column that it follows."""
    name = row["truth"]["effect"]
    follows = FOLLOWS.get(name, set())
    sure = {c["mechanism"] for c in certain(row)}
    tied = {n for names in row["equivalent"] if set(names) & sure for n in names}
    listed = {c["mechanism"] for c in causes(row)}
    by_law = any(columns_of_law(x) <= follows for x in laws(row))
    by_misfit = name.startswith("outside") and any(m["column"] in follows for m in row["misfits"])
    return name in sure | tied or (name in listed and len(listed) <= MOST_TIED) or by_law or by_misfit


def effect_wrong(row: Row) -> bool:
    """A certain cause that neither is the hidden one, nor inseparable from it, nor follows its column."""
    name = row["truth"]["effect"]
    tied = {n for names in row["equivalent"] if name in names for n in names}
    follows = FOLLOWS.get(name, set())
    return any(
        c["mechanism"] not in {name, *tied} and not (columns_of_cause(c["mechanism"]) & follows) for c in certain(row)
    )


def interval_held(row: Row) -> bool:
    truth, low, _, high = row["interval"]
    return bool(low <= truth <= high)


def said_columns(row: Row) -> set[str]:
    """Columns of all laws and of all certain causes, speeds and dates under one name each."""
    found = {c for x in laws(row) for c in columns_of_law(x)}
    found |= {n for c in certain(row) for n in columns_of_cause(c["mechanism"]) or {c["mechanism"]}}
    return {"speed_mm_s" if c == "speed_m_s" else c for c in found}


def columns_right(row: Row) -> bool:
    return set(row["truth"]["columns"]) <= said_columns(row)


def other_physical(row: Row) -> bool:
    return bool(said_columns(row) - set(row["truth"]["columns"]) - SERIES)


def observer_finds(row: Row) -> bool:
    return float(row["strength"]) > FOUND


def search_finds(row: Row) -> bool:
    """Whether an observer who knows all covariances, and has to search, finds the columns of a law."""
    found = row["searched"]
    return set(row["truth"]["columns"]) <= set(found["columns"]) and found["chance"] < BY_CHANCE


def disturbed_lines(rows: list[Row]) -> list[Line]:
    lines: list[Line] = []
    for under in ("5 %", "none"):
        effects, hidden_laws = of(rows, f"effects, {under}"), of(rows, f"laws, {under}")
        seen, clear = [r for r in effects if observer_finds(r)], [r for r in hidden_laws if search_finds(r)]
        if effects:
            sized = [r for r in effects if "interval" in r]
            lines += [
                (f"effects, nuisance {under}: found, of those the observer finds", "90 %", share(seen, effect_found)),
                ("the same: the observer finds", "", share(effects, observer_finds)),
                ("the same: found, of those that one finds who knows the errors of the patterns too", "",
                 share([r for r in effects if r["patterns_known"] > FOUND], effect_found)),
                ("the same: a wrong cause", "", share(effects, effect_wrong)),
                ("the same: intervals hold", "85 to 95 %", share(sized, interval_held)),
            ]  # fmt: skip
        if hidden_laws:
            lines += [
                (f"laws, nuisance {under}: columns right, of those the observer finds", "90 %",
                 share(clear, columns_right)),
                ("the same: of those that one finds who knows the course, too", "",
                 share([r for r in hidden_laws if observer_finds(r)], columns_right)),
                *beside_none(rows, hidden_laws, under),
                ("the same: another physical column", "", share(hidden_laws, other_physical)),
                ("the same: 90 % band holds the change, mean share of tests", "85 to 95 %", mean_band(hidden_laws)),
            ]  # fmt: skip
    return lines


def beside_none(rows: list[Row], hidden_laws: list[Row], under: str) -> list[Line]:
    """Under nuisance: the campaigns whose columns are right where the same law is hidden without any."""
    right = {r["seed"] for r in of(rows, "laws, none") if columns_right(r)}
    both = [r for r in hidden_laws if r["seed"] in right]
    label = "the same: of those whose columns are right without nuisance"
    return [(label, "", share(both, columns_right))] if under != "none" and both else []


def mean_band(rows: list[Row]) -> str:
    bands = [r["band"] for r in rows if "band" in r]
    return f"{100 * np.mean(bands):.1f} % ({len(bands)} campaigns)" if bands else "none"


def by_effect(rows: list[Row]) -> str:
    lines: list[Line] = []
    for cell in ("effects, none", "effects, 5 %"):
        for name in sorted({r["truth"]["effect"] for r in of(rows, cell)}):
            g = [r for r in of(rows, cell) if r["truth"]["effect"] == name]
            seen = [r for r in g if observer_finds(r)]
            sized = [r for r in g if "interval" in r]
            plain = f"{np.median([r['truth']['rms_percent'] for r in g]):.1f} %"
            lines.append((cell, name, plain, len(g), len(seen), sum(map(effect_found, seen)),
                          sum(map(effect_found, g)), sum(map(effect_wrong, g)),
                          f"{sum(map(interval_held, sized))}/{len(sized)}"))  # fmt: skip
    for cell in ("laws, none", "laws, 5 %"):
        for name in sorted({r["truth"]["class"] for r in of(rows, cell)}):
            g = [r for r in of(rows, cell) if r["truth"]["class"] == name]
            seen = [r for r in g if search_finds(r)]
            plain = f"{np.median([r['truth']['rms_percent'] for r in g]):.1f} %"
            lines.append((cell, name, plain, len(g), len(seen), sum(map(columns_right, seen)),
                          sum(map(columns_right, g)), sum(map(other_physical, g)), mean_band(g)))  # fmt: skip
    head = ("cell", "hidden", "rms of T, median", "campaigns", "the observer finds", "of these found", "found", "wrong",
            "interval or band holds")  # fmt: skip
    return table(head, lines)


# gaps


def gap_lines(rows: list[Row]) -> list[Line]:
    own = of(rows, "gaps")
    if not own:
        return []
    gappy = [r for r in own if r["what"]["share"] > 0]
    found = [
        (f"gaps, {100 * share_missing:.0f} % missing: found, of those found at 0 %",
         "90 %" if share_missing == 0.3 else "", share(still_found(own, share_missing), effect_found))
        for share_missing in sorted({r["what"]["share"] for r in gappy})
    ]  # fmt: skip
    sized = [r for r in gappy if "interval" in r]
    return [
        *found,
        ("gaps: a wrong cause", "at most 2 %", share(gappy, effect_wrong)),
        ("gaps: intervals hold", "85 to 95 %", share(sized, interval_held)),
    ]


def still_found(rows: list[Row], missing: float) -> list[Row]:
    """Campaigns with this share missing whose effect was found in the same campaign without gaps."""
    whole = {(r["what"]["effect"], r["seed"]) for r in rows if r["what"]["share"] == 0 and effect_found(r)}
    return [r for r in rows if r["what"]["share"] == missing and (r["what"]["effect"], r["seed"]) in whole]


def by_gap(rows: list[Row]) -> str:
    own, lines = of(rows, "gaps"), []
    for part in ("how", "effect"):
        for name in sorted({r["what"][part] for r in own}):
            for missing in sorted({r["what"]["share"] for r in own}):
                g = [r for r in own if r["what"][part] == name]
                at = [r for r in g if r["what"]["share"] == missing]
                sized = [r for r in at if "interval" in r]
                kept = still_found(g, missing)
                lines.append((name, f"{100 * missing:.0f} %", len(at), sum(map(effect_found, at)),
                              f"{sum(map(effect_found, kept))}/{len(kept)}", sum(map(effect_wrong, at)),
                              f"{sum(map(interval_held, sized))}/{len(sized)}"))  # fmt: skip
    head = ("gaps or effect", "missing", "campaigns", "found", "of those found at 0 %", "wrong", "intervals hold")
    return table(head, lines)


# laws as free functions

WITHIN = 1.10  # of the error of the true law on tests left out


def error_within(row: Row) -> bool:
    return bool(row["error_found"] <= WITHIN * row["error_true"])


def free_law_lines(rows: list[Row]) -> list[Line]:
    own = of(rows, "free laws")
    if not own:
        return []
    classes = {name: [r for r in own if r["truth"]["class"] == name] for name in {r["truth"]["class"] for r in own}}
    bands = {name: np.mean([r["band"] for r in g if "band" in r]) for name, g in classes.items()
             if any("band" in r for r in g)}  # fmt: skip
    worst = min(bands, key=lambda name: bands[name], default="")
    return [
        ("free laws: column or columns right", "90 %", share(own, columns_right)),
        ("the same: the observer finds them", "", share(own, search_finds)),
        ("the same: right of those the observer finds", "", share(list(filter(search_finds, own)), columns_right)),
        ("free laws: another physical column", "at most 2 %", share(own, other_physical)),
        ("free laws: error on tests left out within 10 % of that of the true law", "90 %", share(own, error_within)),
        ("free laws: 90 % band holds the change, mean share of tests", "85 to 95 %", mean_band(own)),
        ("the same in the class where it holds least", "80 %",
         f"{worst}: {100 * bands[worst]:.1f} %" if worst else "none"),
    ]  # fmt: skip


def by_class(rows: list[Row]) -> str:
    own, lines = of(rows, "free laws"), []
    parts: dict[str, Callable[[Row], str]] = {
        "class": lambda r: str(r["truth"]["class"]), "term": lambda r: r["truth"]["term"] or "T",
        "order": lambda r: str(r["design"]["order"]), "column": lambda r: " and ".join(sorted(r["truth"]["columns"])),
    }  # fmt: skip
    for part, told in parts.items():
        for name in sorted(set(map(told, own))):
            g = [r for r in own if told(r) == name]
            counts = (sum(map(test, g)) for test in (search_finds, columns_right, other_physical, error_within))
            lines.append((f"{part} {name}", len(g), *counts, mean_band(g)))
    head = ("hidden", "campaigns", "the observer finds", "columns right", "another physical", "error within 10 %",
            "band holds")  # fmt: skip
    return table(head, lines)


# sizes


def sized_rows(rows: list[Row]) -> list[tuple[str, float, bool, float]]:
    """What was hidden, how much its form is off, whether the interval holds the size, and told over true, where the
    cause or the law was named."""
    found = []
    for r in of(rows, "sizes of effects"):
        if "interval" in r:
            truth, _, value, _ = r["interval"]
            found.append((r["truth"]["effect"], r["truth"]["off"], interval_held(r), value / truth))
    for r in of(rows, "sizes of laws"):
        truth = r["truth"]["percent"]
        own = [x for x in r["layers"] if x["kind"] == "law" and x["name"] == r["truth"]["column"]]
        if own and None not in (own[0]["low"], own[0]["high"]):
            if "curve(" in own[0]["formula"] and truth < 0.0:  # a curve tells its highest value over its lowest
                truth = 100.0 * (1.0 / (1.0 + truth / 100.0) - 1.0)
            name = f"{r['truth']['form']} of {r['truth']['column']}"
            held = own[0]["low"] <= truth <= own[0]["high"]
            found.append((name, r["truth"]["off"], held, own[0]["effect"] / truth))
    return found


def size_lines(rows: list[Row]) -> list[Line]:
    found = sized_rows(rows)
    exact, nearly = [h for _, off, h, _ in found if not off], [h for _, off, h, _ in found if off]
    return [
        ("sizes, form right: 90 % intervals hold", "87 to 93 %", share_of(exact)),
        ("sizes, form 12 % off: 90 % intervals hold", "80 %", share_of(nearly)),
    ] if found else []  # fmt: skip


def by_size_of(rows: list[Row]) -> str:
    found, lines = sized_rows(rows), []
    for name in sorted({n for n, *_ in found}):
        for off in sorted({o for _, o, *_ in found}):
            g = [(h, ratio) for n, o, h, ratio in found if n == name and o == off]
            if g:
                ratio = f"{np.median([x for _, x in g]):.2f}"
                lines.append((name, f"{100 * off:.0f} %", share_of([h for h, _ in g]), ratio))
    return table(("hidden", "form off by", "interval holds", "told over hidden, median"), lines)


def confusion(rows: list[Row]) -> str:
    """Causes and laws that are said where nothing of the kind is hidden, numbers left out."""
    said: Counter[tuple[str, str]] = Counter()
    for row in rows:
        told = [*causes(row), *laws(row)]
        if row["cell"] == "one value":
            told = [c for c in (*certain(row), *laws(row)) if not names_value(row, c)]
        elif row["cell"] not in ("nuisance", "one value, clean"):
            continue
        hidden = f"{row['cell']}: {row['truth']['kind']}" if row["cell"] == "one value" else row["cell"]
        for one in told:
            said[hidden, re.sub(r"\d[\d.]*(e[+-]?\d+)?", "#", str(one.get("mechanism") or one["formula"]))] += 1
    return table(("hidden", "said", "times"), [(*key, n) for key, n in said.most_common(40)])
