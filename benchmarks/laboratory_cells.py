"""The campaigns of the exams in virtual laboratories, by cell: what each hides, and what is kept of its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from blind_cases import ALL_OR_NOTHING, UNSEEN, seed_of, times_half, true_parameter

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
from blind.effects import EFFECTS
from laboratories.campaign import HIDDEN, LaboratoryBench, Made, bare_bench, make, stream
from laboratories.effects import NEEDS, hide_effect, strengths
from laboratories.free_laws import CLASSES, hide_free_law, law_laboratory
from laboratories.gaps import HOW, gaps
from laboratories.handed_over import FURTHER, handed_over
from laboratories.laboratory import drawn_laboratory
from laboratories.levels import (
    COLUMNS as LEVEL_COLUMNS,
    LADDERS,
    MOST,
    OF_NAMES,
    OF_NUMBERS,
    hide_levels,
    level_laboratory,
)
from laboratories.nuisance import Nuisance, draw_nuisance, mixture
from laboratories.observer import Observer
from laboratories.one_value import SIZES, hide_one_value
from laboratories.searching_observer import search
from laboratories.simple_laws import COLUMNS as SIMPLE_COLUMNS, FORMS, hide_simple_law
from laboratory_answers import Row, answer, band_of_laws, diagnosed, errors_left_out, values_at_levels
from run_lines import read_rows

from tribo.diagnostics.diagnosis import Diagnosis
from tribo.diagnostics.verdict import Verdict

OFF = 0.15  # rms of the deviation of patterns in the cells of one value
PLAN = 41
DATA = Path(__file__).resolve().parents[1] / "docs" / "data"
UNDER = 0.05  # rms of ln T of all nuisance together
TIMES_HALF = (1.5, 3.0)  # sizes of effects under nuisance, of the half-found one
LAW_STRENGTHS = (6.0, 14.0)  # of laws under nuisance, to an observer without it
MISSING = (0.0, 0.1, 0.3, 0.5)
GAP_EFFECTS = tuple(name for name in EFFECTS if name not in (*UNSEEN, *ALL_OR_NOTHING, "load_cell_drift",
                                                             "wrong_weight", "bulk_viscoelasticity"))  # fmt: skip
SEARCHED = 2  # repeats of three
OFF_FORM = (0.0, 0.12)
SIZED = tuple(name for name in GAP_EFFECTS if true_parameter(name, 1.0) and name != "load_cell_offset")
SIZED_EFFECTS = tuple({"effect": name, "off": off} for off in OFF_FORM for name in SIZED)
SIZED_LAWS = tuple(
    {"form": form, "column": column, "off": off} for off in OFF_FORM for form in FORMS for column in SIMPLE_COLUMNS
)


@dataclass(frozen=True)
class Piece:
    """One campaign: the cell it counts for, its seed, and what the cell needs to know to make it."""

    cell: str
    seed: int
    what: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Cell:
    """A kind of campaigns: how many there are by default, the ``pieces`` of a run, how one is answered."""

    count: int
    pieces: Callable[[str, int, int], Iterator[Piece]]
    row: Callable[[Piece], Row]


def in_turn(*whats: dict[str, Any]) -> Callable[[str, int, int], Iterator[Piece]]:
    """Pieces that take these descriptions in turn. A seed follows from what a campaign is, so that a run can be
    widened."""

    def pieces(cell: str, count: int, seed: int) -> Iterator[Piece]:
        for k in range(count):
            yield Piece(cell, seed_of(seed, cell, k), whats[k % len(whats)])

    return pieces


def columns_of(seed: int) -> tuple[str, ...]:
    """The further columns that the table of this campaign has: none in a third, else each with a chance of one half."""
    rng = stream(seed, PLAN)
    there = rng.random(len(FURTHER)) < 1 / 2
    return () if rng.random() < 1 / 3 else tuple(np.array(FURTHER)[there].tolist())


def design_row(made: Made) -> Row:
    lab = made.laboratory
    return {
        "pulls": len(made.bench.tests), "samples": len(lab.samples), "days": lab.days, "order": lab.order,
        "turns": lab.turns, "tails": lab.tails, "specimens_are": lab.specimens_are, "patterns_are": lab.patterns_are,
        "pattern_rms": round(lab.pattern_rms, 4),
    }  # fmt: skip


def with_answer(piece: Piece, made: Made, columns: tuple[str, ...] = FURTHER) -> tuple[Row, Diagnosis]:
    """The truth and the answer of a campaign."""
    d = diagnosed(handed_over(made.bench, piece.seed, columns), piece.seed)
    return {"truth": made.truth, "design": design_row(made), **answer(d.verdict)}, d


def nuisance_row(piece: Piece) -> Row:
    rng = stream(piece.seed, PLAN + 1)
    made = make(piece.seed, drawn_laboratory(piece.seed, **piece.what), draw_nuisance(mixture(rng), rng))
    return with_answer(piece, made, columns_of(piece.seed))[0]


def one_value_row(piece: Piece) -> Row:
    laboratory = drawn_laboratory(piece.seed, pattern_rms=OFF)
    hide = hide_one_value(piece.seed, laboratory, piece.what["kind"])
    return with_answer(piece, make(piece.seed, laboratory, hide=hide))[0]


def clean_row(piece: Piece) -> Row:
    return with_answer(piece, make(piece.seed, drawn_laboratory(piece.seed, pattern_rms=OFF)))[0]


def levels_row(piece: Piece) -> Row:
    column, rng = piece.what["column"], stream(piece.seed, PLAN + 2)
    number = int(rng.integers(2, MOST.get(column, 6) + 1))
    laboratory = level_laboratory(piece.seed, column, number)
    shape = str(rng.choice(OF_NUMBERS if column in LADDERS else OF_NAMES))
    made = make(piece.seed, laboratory, hide=hide_levels(piece.seed, laboratory, column, shape))
    row, d = with_answer(piece, made)
    return row | {"at_levels": values_at_levels(d, made.bench, column, made.change)}


# effects and laws under nuisance


def half_found() -> dict[str, float]:
    """The size of every effect that is found half the time without nuisance (docs/blind.md)."""
    return {row["effect"]: row["half"] for row in read_rows(DATA / "blind-half.jsonl")}


def effect_pieces(cell: str, count: int, seed: int) -> Iterator[Piece]:
    """The same campaigns for every share of nuisance: the seed follows from the effect alone."""
    names = sorted(half_found())
    for k in range(count):
        name = names[k % len(names)]
        yield Piece(cell, seed_of(seed, f"effect {name}", k), {"effect": name})


def law_pieces(cell: str, count: int, seed: int) -> Iterator[Piece]:
    """The same for laws."""
    for k in range(count):
        yield Piece(cell, seed_of(seed, "law under nuisance", k), {"class": CLASSES[k % len(CLASSES)]})


def disturbance(piece: Piece) -> tuple[Nuisance, ...]:
    """Nuisance of 5 % in all, or none, by the name of the cell."""
    rng = stream(piece.seed, PLAN + 3)
    return draw_nuisance(mixture(rng), rng, UNDER) if piece.cell.endswith("5 %") else ()


def effect_row(piece: Piece) -> Row:
    name, nuisance = piece.what["effect"], disturbance(piece)
    times = stream(piece.seed, PLAN + 4).uniform(*TIMES_HALF)
    size = times_half(name, half_found(), times)
    laboratory = drawn_laboratory(piece.seed, **NEEDS.get(name, {}))
    hide = hide_effect(name, size)
    made = make(piece.seed, laboratory, nuisance, hide)
    seen = strengths(piece.seed, laboratory, nuisance, hide, stream(piece.seed, HIDDEN))
    row, d = with_answer(piece, made)
    return row | {"times_half": round(times, 3), **seen, **size_told(d.verdict, name, size)}


def size_told(v: Verdict, name: str, size: float) -> Row:
    """The hidden size in the unit of the library, with the interval that the diagnosis gives."""
    for key, truth in true_parameter(name, size).items():
        for cause in v.causes:
            if cause.mechanism == name and key in cause.parameters:
                e = cause.parameters[key]
                return {"interval": [float(f"{x:.5g}") for x in (truth, e.low, e.value, e.high)]}
    return {}


def disturbed_law_row(piece: Piece) -> Row:
    nuisance, asked = disturbance(piece), stream(piece.seed, PLAN + 5).uniform(*LAW_STRENGTHS)
    laboratory = law_laboratory(piece.seed, repeats=2)
    made = make(piece.seed, laboratory, nuisance, hide_free_law(piece.seed, laboratory, piece.what["class"], asked))
    row, d = with_answer(piece, made)
    return row | seen_by_observers(piece.seed, made, nuisance) | band_of_laws(d, made.change)


def seen_by_observers(seed: int, made: Made, nuisance: tuple[Nuisance, ...]) -> Row:
    """How clearly a law shows to an observer who knows its course, too, and what one finds who has to search for it."""
    bare = bare_bench(seed, made.laboratory)
    observer = Observer(bare, made.laboratory, nuisance)
    return {"strength": round(observer.strength(made.change), 3), **what_is_found(observer, bare, made.bench)}


def what_is_found(observer: Observer, bare: LaboratoryBench, made: LaboratoryBench) -> Row:
    """The columns that an observer finds who has to search, and their chance."""
    found = search(observer, bare, made)
    return {"searched": {"columns": list(found.columns), "chance": float(f"{found.chance:.3g}")}}


# gaps


def gap_pieces(cell: str, count: int, seed: int) -> Iterator[Piece]:
    """Every campaign with each share missing: the seed follows from the effect alone."""
    for k in range(count // len(MISSING)):
        name = GAP_EFFECTS[k % len(GAP_EFFECTS)]
        number, how = seed_of(seed, f"gaps {name}", k), HOW[k // len(GAP_EFFECTS) % len(HOW)]
        for share in MISSING:
            yield Piece(cell, number, {"effect": name, "how": how, "share": share})


def gaps_row(piece: Piece) -> Row:
    name, size = piece.what["effect"], times_half(piece.what["effect"], half_found(), 3)
    laboratory = drawn_laboratory(piece.seed, **NEEDS.get(name, {}))
    made = make(piece.seed, laboratory, hide=hide_effect(name, size))
    cells = gaps(made.bench.tests, piece.what["share"], piece.what["how"], stream(piece.seed, PLAN + 6))
    d = diagnosed(handed_over(made.bench, piece.seed, FURTHER, cells=cells), piece.seed)
    row = {"truth": made.truth, "design": design_row(made), **answer(d.verdict)}
    return row | size_told(d.verdict, name, size)


# free laws


def free_law_row(piece: Piece) -> Row:
    """The first two repeats are searched, the third judges."""
    laboratory = law_laboratory(piece.seed)
    made = make(piece.seed, laboratory, hide=hide_free_law(piece.seed, laboratory, piece.what["class"]))
    searched = made.bench.column("repeat") <= SEARCHED
    d = diagnosed(handed_over(made.bench, piece.seed, FURTHER, searched), piece.seed)
    errors = errors_left_out(d, handed_over(made.bench, piece.seed), made.change, ~searched)
    row = {"truth": made.truth, "design": design_row(made), **answer(d.verdict)}
    return row | errors | band_of_laws(d, made.change[searched]) | found_in_part(piece.seed, made, searched)


def found_in_part(seed: int, made: Made, searched: np.ndarray) -> Row:
    """What an observer finds in the part of a campaign that is searched."""
    tests = made.bench.tests[searched].reset_index(drop=True)
    bare, part = (replace(bare_bench(seed, made.laboratory), tests=tests) for _ in range(2))
    part.static, part.sliding = made.bench.static[searched], made.bench.sliding[searched]
    return what_is_found(Observer(bare, made.laboratory), bare, part)


# sizes


def effect_size_row(piece: Piece) -> Row:
    name, size = piece.what["effect"], times_half(piece.what["effect"], half_found(), 3)
    laboratory = drawn_laboratory(piece.seed, **NEEDS.get(name, {}))
    row, d = with_answer(piece, make(piece.seed, laboratory, hide=hide_effect(name, size, piece.what["off"])))
    return row | size_told(d.verdict, name, size)


def law_size_row(piece: Piece) -> Row:
    hide = hide_simple_law(piece.what["form"], piece.what["column"], piece.what["off"])
    return with_answer(piece, make(piece.seed, drawn_laboratory(piece.seed), hide=hide))[0]


CELLS: dict[str, Cell] = {
    "nuisance": Cell(600, in_turn({"order": "random"}, {"order": "in order"}), nuisance_row),
    "one value": Cell(200, in_turn(*({"kind": kind} for kind in SIZES)), one_value_row),
    "one value, clean": Cell(300, in_turn({}), clean_row),
    "levels": Cell(200, in_turn(*({"column": column} for column in LEVEL_COLUMNS)), levels_row),
    "effects, none": Cell(220, effect_pieces, effect_row),
    "effects, 5 %": Cell(220, effect_pieces, effect_row),
    "laws, none": Cell(120, law_pieces, disturbed_law_row),
    "laws, 5 %": Cell(120, law_pieces, disturbed_law_row),
    "gaps": Cell(800, gap_pieces, gaps_row),
    "free laws": Cell(400, in_turn(*({"class": kind} for kind in CLASSES)), free_law_row),
    "sizes of effects": Cell(220, in_turn(*SIZED_EFFECTS), effect_size_row),
    "sizes of laws": Cell(180, in_turn(*SIZED_LAWS), law_size_row),
}  # fmt: skip
