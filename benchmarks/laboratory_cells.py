"""The campaigns of the exams in virtual laboratories, by cell: what each hides, and what is kept of its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from blind_cases import seed_of

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
from laboratories.campaign import Made, make, stream
from laboratories.handed_over import FURTHER, handed_over
from laboratories.laboratory import drawn_laboratory
from laboratories.levels import LADDERS, MOST, OF_NAMES, OF_NUMBERS, hide_levels, level_laboratory

from laboratories.levels import COLUMNS as LEVEL_COLUMNS  # isort: skip
from laboratories.nuisance import draw_nuisance, mixture
from laboratories.one_value import SIZES, hide_one_value
from laboratory_answers import Row, answer, diagnosed, values_at_levels

from tribo.diagnostics.diagnosis import Diagnosis

OFF = 0.15  # rms of the deviation of patterns in the cells of one value
PLAN = 41


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


CELLS: dict[str, Cell] = {
    "nuisance": Cell(600, in_turn({"order": "random"}, {"order": "in order"}), nuisance_row),
    "one value": Cell(200, in_turn(*({"kind": kind} for kind in SIZES)), one_value_row),
    "one value, clean": Cell(300, in_turn({}), clean_row),
    "levels": Cell(200, in_turn(*({"column": column} for column in LEVEL_COLUMNS)), levels_row),
}  # fmt: skip
