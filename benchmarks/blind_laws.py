"""Laws outside the library: how often the search finds the column, the form, the regime and the samples.

    python benchmarks/blind_laws.py run    out/laws.jsonl     all campaigns; goes on where it was stopped
    python benchmarks/blind_laws.py tables out/laws.jsonl     the tables, printed
    python benchmarks/blind_laws.py page   out/laws.jsonl     the same into docs/results/blind-laws.md

The generator is in tests/blind/hidden_laws.py and shares no code with the search. Of three repeats, two are searched
and one judges. Forces are handed over as a perfect reader would read them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from blind_cases import seed_of
from blind_laws_tables import tables
from run_lines import read_rows, work_off

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
from blind.hidden_laws import FORMS, Hidden, as_ingested, hide_law  # isort: skip

from tribo.diagnostics.diagnosis import examine
from tribo.diagnostics.fit import fit
from tribo.diagnostics.model import Acting, Setup, predict, setup
from tribo.diagnostics.observations import observe
from tribo.lawsearch.diagnosis_with_laws import explained, searched_laws
from tribo.lawsearch.grammar import LOAD_TERM, WrittenLaw
from tribo.lawsearch.known_laws import KnownLaw, validate_law
from tribo.lawsearch.model_choice import FoundLaw, centred, without_refuted_causes
from tribo.lawsearch.scoring import terms_of
from tribo.lawsearch.search import Discovery
from tribo.wording.law_sentences import held_sentence

PAGE = Path(__file__).resolve().parents[1] / "docs" / "results" / "blind-laws.md"
MARK = "<!-- below: python benchmarks/blind_laws.py page -->"
KEPT = 2  # repeats that are searched; the others judge


@dataclass(frozen=True)
class Piece:
    """One campaign, or a pair: the ``cell`` it counts for, the ``form`` that is hidden, that of the ``second``."""

    cell: str
    seed: int
    form: str = ""
    second: str = ""


def pieces(options: argparse.Namespace) -> Iterator[Piece]:
    """All campaigns; a seed follows from what a campaign is, so that a run can be widened."""
    names = list(FORMS)
    for form in names:
        for k in range(options.campaigns):
            yield Piece("law", seed_of(options.seed, form, k), form)
    for k in range(options.clean):
        yield Piece("clean", seed_of(options.seed, "clean", k))
    for k in range(options.pairs):
        form, other = names[k % len(names)], names[(k + 1 + k // len(names)) % len(names)]
        yield Piece("next, same law", seed_of(options.seed, "same", k), form, form)
        yield Piece("next, another law", seed_of(options.seed, "other", k), form, other)


def work(piece: Piece) -> dict[str, Any]:
    begin = time.process_time()
    row = {"cell": piece.cell, "seed": piece.seed, "form": piece.form}
    row |= _pair(piece) if piece.second else _one(piece)
    return row | {"seconds": round(time.process_time() - begin, 2)}


def _one(piece: Piece) -> dict[str, Any]:
    """Search a campaign, and judge its first law against the hidden one."""
    hidden = hide_law(piece.seed, piece.form)
    kept = hidden.bench.column("repeat") <= KEPT
    d = examine(as_ingested(hidden.bench, piece.seed, kept), seed=piece.seed)
    found = searched_laws(d, seed=piece.seed)
    row: dict[str, Any] = {
        "verdict": d.verdict.verdict, "causes": [c.mechanism for c in d.verdict.causes],
        "laws": len(found.laws),
    }  # fmt: skip
    if piece.form and found.laws:
        return row | judged(hidden, found, kept, piece.seed)
    if piece.form and found.of_causes:
        return row | judged_cause(hidden, *next(iter(found.of_causes.items())))
    return row


def judged_cause(hidden: Hidden, cause: str, forms: tuple[WrittenLaw, ...]) -> dict[str, Any]:
    """The same where a cause of the library is the law of a recorded column: its form with those it cannot be told
    from. It acts on all samples, in both regimes."""
    (law, *ties), truth = forms, hidden.truth
    return {
        "cause": cause, "columns": list(law.columns), "kind": _kind(law), "where": law.where,
        "regime": law.regime, "ties": [[*t.columns, _kind(t), t.regime, t.where] for t in ties],
        "column_right": _same_columns(law.columns, truth.columns), "regime_right": truth.regimes == (1.0, 1.0),
        "samples_right": set(hidden.bench.column("sample").tolist()) == set(truth.samples),
        "form_right": _kind(law) in truth.kinds, "form_tied": any(_kind(t) in truth.kinds for t in ties),
    }  # fmt: skip


def judged(hidden: Hidden, found: Discovery, kept: np.ndarray, seed: int) -> dict[str, Any]:
    """What the first law says, whether that is right, its band, and its error on pulls that were not searched."""
    law, truth = found.laws[0], hidden.truth
    acts = acts_of_law(law)
    inside, width = _band(law, hidden.change[kept])
    true, own, none = _held_out(hidden, law, seed)
    return {
        "columns": list(law.law.columns), "kind": _kind(law.law), "acts_on": law.law.acts_on, "where": law.law.where,
        "regime": law.law.regime, "p": law.p, "ties": [[*t.columns, _kind(t), t.regime, t.where] for t in law.ties],
        "column_right": _same_columns(law.law.columns, truth.columns),
        "regime_right": tuple(acts.any(axis=0) * 1.0) == truth.regimes,
        "samples_right": set(_samples(law)) == set(truth.samples),
        "form_right": _kind(law.law) in truth.kinds,
        "form_tied": any(_kind(t) in truth.kinds for t in law.ties),
        "band": round(inside, 4), "band_width": round(width, 4),
        "error_true": round(true, 5), "error_found": round(own, 5), "error_without": round(none, 5),
    }  # fmt: skip


def _kind(law: Any) -> str:
    return "product" if len(law.shapes) > 1 else str(law.shapes[0].kind)


def _same_columns(found: tuple[str, ...], true: tuple[frozenset[str], ...]) -> bool:
    return len(found) == len(true) and all(any(f in t for f in found) for t in true)


def acts_of_law(law: FoundLaw) -> np.ndarray:
    """Where the law acts, (n, 2)."""
    c = law.model.setup.observations.conditions
    regimes = np.array([law.law.regime != "sliding", law.law.regime != "static"])
    return np.asarray((law.law.weight(c) != 0)[:, None] * regimes)


def _samples(law: FoundLaw) -> list[str]:
    c = law.model.setup.observations.conditions
    return [str(s) for s in np.unique(c.sample[law.law.weight(c) != 0])]


def _band(law: FoundLaw, change: np.ndarray) -> tuple[float, float]:
    """Share of the tests at which the 90 % band holds the hidden change, both beyond what flat law and patterns can
    absorb; and the mean half width of the band."""
    true = centred(change, law.model.setup.observations.conditions, terms_of(law.model)[LOAD_TERM])
    either = (change != 0) | acts_of_law(law)
    _, low, high = law.band
    held = (low <= true) & (true <= high)
    return float(held[either].mean()), float((0.5 * (high - low))[either].mean())


def _held_out(hidden: Hidden, law: FoundLaw, seed: int) -> tuple[float, float, float]:
    """RMS error of ln T of the pulls that were not searched: with the true law, the one found, and without any.

    All models are fitted to the pulls that were searched; the true law is taken off the forces as it was hidden.
    """
    o = observe(as_ingested(hidden.bench, seed, np.ones(len(hidden.bench.tests), bool)))
    out = hidden.bench.column("repeat") > KEPT
    without = replace(o, log_force=o.log_force - hidden.change)
    acting, predictor = law.model.acting, law.model.setup.predictor
    models = ((without, acting[:-1]), (o, acting), (o, acting[:-1]))
    errors = [error_left_out(setup(data, predictor), model, out) for data, model in models]
    return errors[0], errors[1], errors[2]


def error_left_out(s: Setup, acting: tuple[Acting, ...], out: np.ndarray) -> float:
    trained = fit(s.take(~out), acting)
    residual = s.observations.log_force - predict(s, trained.law, trained.acting, trained.values)
    return float(np.sqrt(np.mean((residual - s.dense @ trained.effects)[out] ** 2)))


def _pair(piece: Piece) -> dict[str, Any]:
    """The law found in one campaign, tried on the next."""
    hidden = hide_law(piece.seed, piece.form)
    kept = hidden.bench.column("repeat") <= KEPT
    d = examine(as_ingested(hidden.bench, piece.seed, kept), seed=piece.seed)
    found = searched_laws(d, seed=piece.seed)
    if not found.laws:
        causes = [c.mechanism for c in d.verdict.causes]
        return {"answer": "no law found", "verdict": d.verdict.verdict, "causes": causes}
    seed = seed_of(piece.seed, "next", 0)
    same = piece.second == piece.form
    later = hide_law(seed, piece.second, piece.seed if same else None)
    kept = later.bench.column("repeat") <= KEPT
    d = examine(as_ingested(later.bench, seed, kept), seed=seed)
    known = KnownLaw("", "", found.laws[0].law, found.laws[0].parameters)
    held = validate_law(without_refuted_causes(explained(d))[0], known)
    return {
        "answer": held.answer, "second": piece.second, "text": held_sentence(held), "verdict": d.verdict.verdict,
        "strength": round(later.strength, 2),
    }  # fmt: skip


def run(todo: list[Piece], path: Path, jobs: int) -> None:
    """Append a line for each campaign as it ends; campaigns that the file holds are left out."""
    known = {(row["cell"], row["form"], row["seed"]) for row in read_rows(path)}
    rest = [p for p in todo if (p.cell, p.form, p.seed) not in known]
    print(f"{len(todo)} campaigns, {len(todo) - len(rest)} of them done", flush=True)
    work_off(rest, work, path, jobs, lambda row: f"{row['cell']}, {row['form']}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "tables", "page"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--campaigns", type=int, default=15, help="per form")
    parser.add_argument("--clean", type=int, default=300)
    parser.add_argument("--pairs", type=int, default=50)
    parser.add_argument("--seed", type=int, default=2029)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    todo, rows = list(pieces(options)), read_rows(options.path)
    if options.what == "run":
        np.random.default_rng(options.seed).shuffle(todo)  # type: ignore[arg-type]
        run(todo, options.path, options.jobs)
        rows = read_rows(options.path)
    text = tables(rows)
    if options.what == "page":
        above = PAGE.read_text().split(MARK)[0]
        PAGE.write_text(f"{above}{MARK}\n\nSeed {options.seed}: {len(rows)} of {len(todo)} campaigns.\n\n{text}")
    print(text)


if __name__ == "__main__":
    main()
