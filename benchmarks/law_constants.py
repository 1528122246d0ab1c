"""What the constants of the search for laws decide: each halved and doubled on one fixed set of hidden laws.

    python benchmarks/law_constants.py run   out/law-constants.jsonl     one line a campaign; resumable
    python benchmarks/law_constants.py table out/law-constants.jsonl     the table of docs/results/blind-laws.md

The campaigns come from the generator of tests/blind with a seed of their own (SEED), which no reported figure uses.
Each is diagnosed once; then causes and laws are weighed and the best form is chosen anew with every variant.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

from blind_cases import seed_of
from blind_laws import KEPT, Piece
from run_lines import read_rows, work_off

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
from blind.hidden_laws import FORMS, Hidden, as_ingested, hide_law  # isort: skip

from tribo.diagnostics.diagnosis import Diagnosis, examine
from tribo.lawsearch.diagnosis_with_laws import explained
from tribo.lawsearch.grammar import WrittenLaw
from tribo.lawsearch.model_choice import forms_in_reach, without_refuted_causes
from tribo.lawsearch.scoring import Grammar
from tribo.mechanisms.record import Conditions

SEED = 7_701
HOUSE = "tribo.lawsearch"
Change = Callable[[Any, float], Any]


def _times(value: Any, factor: float) -> Any:
    return factor * value


def _whole(value: int, factor: float) -> int:
    return round(factor * value)


def _each(value: dict[bool, float], factor: float) -> dict[bool, float]:
    return {key: factor * each for key, each in value.items()}


def _dearer(scopes_of: Callable[..., Any], factor: float) -> Callable[..., Any]:
    """The choice of regime, term and samples at another price."""

    def priced(c: Conditions) -> Any:
        scopes, cost = scopes_of(c)
        return scopes, factor * cost

    return priced


@dataclass(frozen=True)
class Constant:
    """A constant under its ``name`` in some ``rooms`` of the house, and how it is changed."""

    name: str
    rooms: tuple[str, ...]
    change: Change = _times


CONSTANTS = {
    "margin of a law over a mechanism": Constant("MARGIN", ("model_choice",), _each),
    "margin of a law over a covariate": Constant("MARGIN_OF_COVARIATE", ("model_choice",), _each),
    "cost of a place or width": Constant("PER_PARAMETER", ("model_choice",)),
    "cost of regime, term and samples": Constant("scopes_of", ("scoring",), _dearer),
    "reach of forms that are looked at closely": Constant("IN_REACH", ("model_choice",)),
    "forms that are looked at closely": Constant("LOOKED_AT", ("model_choice",), _whole),
    "forms that are fitted in full": Constant("FITTED", ("model_choice",), _whole),
}
VARIANTS = [("as it is", 1.0), *((name, factor) for name in CONSTANTS for factor in (0.5, 2.0))]


def work(piece: Piece) -> dict[str, Any]:
    """Which of column, place and form are right with each variant."""
    hidden = hide_law(piece.seed, piece.form)
    kept = hidden.bench.column("repeat") <= KEPT
    d = examine(as_ingested(hidden.bench, piece.seed, kept), seed=piece.seed)
    return {"form": piece.form, "seed": piece.seed, "right": [_right(d, hidden, *variant) for variant in VARIANTS]}


def _right(d: Diagnosis, hidden: Hidden, name: str, factor: float) -> list[bool]:
    with ExitStack() as stack:
        constant = CONSTANTS.get(name)
        for room in constant.rooms if constant is not None else ():
            module = import_module(f"{HOUSE}.{room}")
            changed = constant.change(getattr(module, constant.name), factor) if constant is not None else None
            stack.enter_context(patch.object(module, constant.name if constant is not None else "", changed))
        model, _, _ = without_refuted_causes(explained(d))
        _, (form, *_) = forms_in_reach(model, Grammar(model))
    return [*_judged(form.best, d, hidden), len(model.acting) == 0]


def _judged(law: WrittenLaw, d: Diagnosis, hidden: Hidden) -> list[bool]:
    """Column; regime and samples; form."""
    c, truth = d.baseline.setup.observations.conditions, hidden.truth
    regimes = (float(law.regime != "sliding"), float(law.regime != "static"))
    samples = {str(s) for s in np.unique(c.sample[law.weight(c) != 0])}
    kind = "product" if len(law.shapes) > 1 else law.shapes[0].kind
    columns = len(law.columns) == len(truth.columns) and all(any(f in t for f in law.columns) for t in truth.columns)
    return [columns, regimes == truth.regimes and samples == set(truth.samples), kind in truth.kinds]


def table(rows: list[dict[str, Any]]) -> str:
    """One line a variant."""
    lines = ["| constant | value | column | regime and samples | form | no cause beside the law |", "|---" * 6 + "|"]
    for k, (name, factor) in enumerate(VARIANTS):
        counts = np.sum([row["right"][k] for row in rows], axis=0)
        value = {1.0: "", 0.5: "halved", 2.0: "doubled"}[factor]
        lines.append(f"| {name} | {value} | " + " | ".join(str(n) for n in counts) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "table"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--campaigns", type=int, default=1, help="per form")
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    if options.what == "run":
        known = {row["seed"] for row in read_rows(options.path)}
        every = [Piece("law", seed_of(SEED, form, k), form) for form in FORMS for k in range(options.campaigns)]
        work_off([p for p in every if p.seed not in known], work, options.path, options.jobs, lambda row: row["form"])
    rows = read_rows(options.path)
    print(f"{len(rows)} campaigns\n\n{table(rows)}")


if __name__ == "__main__":
    main()
