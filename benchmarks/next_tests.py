"""The next test of verdicts of all kinds, made on the virtual tribometer: whether it answers the headline.

    python benchmarks/next_tests.py run  out/next-tests.jsonl     100 verdicts; goes on where it was stopped
    python benchmarks/next_tests.py page out/next-tests.jsonl     the counts into docs/results/next-tests.md

The generator is in tests/blind and shares no code with the diagnosis. Each campaign is diagnosed, the proposed test is
carried out as its design says, and the campaign is diagnosed again with the result. Counted is whether the test speaks
of what the headline speaks of, whether its expected answer comes, and whether the verdict is sharper afterwards.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from blind_cases import SPEEDS, Case, design_for, seed_of, times_half
from blind_loop import campaign, measurement, with_pulls
from run_lines import read_rows, work_off

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
import pandas as pd  # isort: skip
from blind import hidden_laws  # isort: skip
from blind.tribometer import Bench, hide, with_further  # isort: skip
from figures.against_verdict import contradictions  # isort: skip
from scipy.stats import f as f_distribution, ttest_ind  # isort: skip

if TYPE_CHECKING:
    from tribo.diagnostics.verdict import NextTest, Verdict
    from tribo.records import Ingested

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, DATA = DOCS / "results" / "next-tests.md", DOCS / "data"
MARK = "<!-- below: python benchmarks/next_tests.py page -->"
TIMES = 3.0  # the size found half the time
SLOPE = 0.02
# how many campaigns of each kind come to 100; the effects of a kind take turns
KINDS: dict[str, tuple[int, tuple[str, ...]]] = {
    "causes of loads and patterns": (
        22, ("suction", "normal_load_error", "pressure_dependent_friction", "contact_area_loss", "edge_adhesion",
             "cavity_shear_deformation", "pattern_geometry")),
    "causes that follow a column": (
        22, ("velocity_dependence", "contact_ageing", "temperature", "humidity", "run_in", "covariate:operator")),
    "causes of one value": (10, ("wrong_weight", "mislabelled_specimen")),
    "patterns that the model is wrong about": (12, ("", "suction")),
    "nothing that the design can show": (10, ("", "velocity_dependence", "contact_ageing")),
    "laws outside the library": (
        12, ("threshold of temperature", "line of film, static", "optimum of speed", "film times speed, sliding",
             "bell of humidity, patterned", "lot, patterned")),
    "too little measured": (4, ("",)),
    "columns that vary together, without the model": (4, ("velocity_dependence",)),
    "a column that varies with the load, without the model": (4, ("velocity_dependence",)),
}  # fmt: skip
SIZES = {"wrong_weight": 2.0, "mislabelled_specimen": 1.0}
WRONG_PATTERNS, WELL = 4.0, 1.0  # times the error that the diagnosis assumes
UNITS = {"speed_m_s": ("speed_mm_s", 1e3), "hold_s": ("hold_s", 1.0), "film_um": ("film_um", 1.0), "lot": ("lot", 1.0)}
DRAWN = ("temperature_C", "humidity_pct", "operator")  # of the later day, unless they are set
FOLLOWS = 0.05  # p value of the values of a column that was varied alone


@dataclass(frozen=True)
class Piece:
    """A campaign of one kind, with the effect or law that is hidden in it ("" for none)."""

    kind: str
    hidden: str
    case: Case


def pieces(half: Mapping[str, float], share: float, seed: int) -> Iterator[Piece]:
    """All campaigns, or a share of every kind."""
    for kind, (number, names) in KINDS.items():
        for k in range(max(1, round(share * number))):
            name = names[k % len(names)]
            cell = f"{kind}: {name or 'nothing'}"
            own = seed_of(seed, cell, k)
            law = kind.startswith("laws")
            effects = ((name, SIZES.get(name) or times_half(name, half, TIMES)),) if name and not law else ()
            yield Piece(kind, name, Case(cell, own, effects, _design(kind, name)))


def _design(kind: str, name: str) -> Any:
    if kind.startswith("patterns"):
        return design_for(pattern_error=WRONG_PATTERNS, specimen_slope=SLOPE)
    if kind.startswith("nothing"):
        return design_for(pattern_error=WELL, specimen_slope=SLOPE)  # one speed, one hold
    if kind.startswith("too little"):
        return design_for(pattern_error=WELL, samples=("F", "B"), specimens=1, masses_g=(25.0,), repeats=2)
    if "without the model" in kind:
        return design_for(pattern_error=WELL, samples=("F",), specimens=4, repeats=3, speeds_mm_s=SPEEDS)
    return design_for(name, pattern_error=WELL, specimen_slope=SLOPE)


class Laboratory:
    """One campaign that can be diagnosed, and in which a proposed test can be carried out."""

    def __init__(self, piece: Piece) -> None:
        self.piece, self.case = piece, piece.case
        self.measured: dict[str, tuple[float, float]] = {}
        self.rng = np.random.default_rng([piece.case.seed, 91])
        if piece.kind.startswith("laws"):
            found = hidden_laws.hide_law(self.case.seed, piece.hidden)
            self.first, self.bench = found.bench.tests, found.bench
            unit, _ = hidden_laws._change(self.bench, self.first, hidden_laws.FORMS[piece.hidden], self.case.seed)
            self.size = float(found.change.ravel()[np.abs(unit).argmax()] / unit.ravel()[np.abs(unit).argmax()])
            self.design = hidden_laws.law_design(self.case.seed)
        else:
            self.design = self.case.design
            self.bench = hide(self.case.seed, list(self.case.effects), self.design)
            self._tie_columns()

    def _tie_columns(self) -> None:
        """Speeds that go with the hold, or with the load: the effect is hidden anew in what results."""
        if "without the model" not in self.piece.kind:
            return
        plain = hide(self.case.seed, [], self.design)
        tests = plain.tests
        if "together" in self.piece.kind:
            tests["hold_s"] = tests["speed_mm_s"].map(dict(zip(SPEEDS, (3.0, 30.0, 600.0), strict=True)))
        else:
            place = tests["N"].rank(method="dense").astype(int) - 1
            tests["speed_mm_s"] = np.geomspace(0.06, 0.7, int(place.max()) + 1)[place]
        for name, size in self.case.effects:
            hidden_effect(plain, name, size, self.rng)
        self.bench = plain

    def ingested(self) -> Ingested:
        if self.piece.kind.startswith("laws"):
            return hidden_laws.as_ingested(self.bench, self.case.seed, np.ones(len(self.bench.tests), bool))
        return campaign(self.bench, self.measured, self.case.seed)

    def verdict(self, against: list[str] | None = None) -> Verdict:
        """As `tribo diagnose` makes it, with its words; what its figures say ``against`` it is added to the list."""
        from tribo import stages
        from tribo.diagnostics.conclusion import cannot_tell
        from tribo.diagnostics.diagnosis import examine
        from tribo.fitting.alternatives import compared_laws, dependence
        from tribo.lawsearch.diagnosis_with_laws import with_laws
        from tribo.records import Study
        from tribo.wording.verdict_sentences import worded

        whole = self.ingested()
        if "without the model" in self.piece.kind:
            study = Study(whole, (), laws=compared_laws(whole.table()), dependence=dependence(whole))
            return stages.diagnosis_without_model(study).verdict
        if (lacking := cannot_tell(whole)) is not None:
            return worded(lacking)
        d = with_laws(examine(whole, seed=self.case.seed), seed=self.case.seed)
        if against is not None:
            against += contradictions(d)
        return worded(d.verdict)

    # ------------------------------------------------------------------------------------------ carrying out

    def carry_out(self, test: NextTest) -> pd.DataFrame:
        """Make the test as its design says; the rows of the new pulls, none for a direct measurement."""
        design, made = test.design, len(self.bench.tests)
        if "measure" in design:
            self.measured[design["measure"]] = self._measurement(design)
        elif test.kind in ("remove", "pull further", "pull more"):
            self.bench = with_pulls(self.bench, self.case, design)
        elif test.kind == "measure more":
            self.case = replace(self.case, design=design_for(pattern_error=WELL, specimen_slope=SLOPE))
            self.bench, made = hide(self.case.seed, [], self.case.design), 0
        else:
            rows = self._rows(test)
            self.bench = self._pulled(rows)
        return self.bench.tests.iloc[made:]

    def _measurement(self, design: Mapping[str, Any]) -> tuple[float, float]:
        name, _, choice = str(design["measure"]).partition(":")
        spread = float(design["uncertainty"])
        effects = dict(self.case.effects)
        if name == "wrong_weight":  # the weight that a 50 g one really has, over what it says
            truth = 0.157 * effects.get(name, 0.0) if choice == "mass 50 g" else 0.0
        elif name in ("mislabelled_specimen", "pattern_geometry"):
            return self._as_named(design)
        else:
            return measurement(self.case, design, 0)
        return truth + spread * float(self.rng.normal()), spread

    def _as_named(self, design: Mapping[str, Any]) -> tuple[float, float]:
        """What a look at the specimens gives: the size of the hidden effect in the parameter of the library, fitted to
        forces without scatter, since the generator has another parameter; nothing where something else is hidden."""
        from tribo.mechanisms import MECHANISMS

        name = str(design["measure"]).partition(":")[0]
        spread = float(design["uncertainty"])
        amplitude = MECHANISMS[name].amplitude
        there = self.piece.hidden == name and self.named_size is not None
        truth = float(self.named_size) if there else amplitude.zero
        return truth + spread * float(self.rng.normal()), spread

    named_size: float | None = None

    def _pulled(self, rows: pd.DataFrame) -> Bench:
        if not self.piece.kind.startswith("laws"):
            return with_further(self.bench, rows, self.case.seed, list(self.case.effects), self.design)
        made = len(self.bench.tests)
        both = with_further(self.bench, rows, self.case.seed, [], self.design)
        form = hidden_laws.FORMS[self.piece.hidden]
        change, _ = hidden_laws._change(both, self.first, form, self.case.seed)
        gain = np.exp(self.size * change)
        both.static[made:] *= gain[made:, 0]
        both.sliding[made:] *= gain[made:, 1]
        return both

    def _of(self, sample: str, pulls: int, load_N: float | None = None) -> pd.DataFrame:
        """So many tests of a sample to be made again; at one load where one is given."""
        rows = self.bench.tests[self.bench.tests["sample"] == sample]
        rows = rows.iloc[np.resize(np.arange(len(rows)), pulls)].reset_index(drop=True)
        return rows if load_N is None else rows.assign(N=load_N)

    def _set(self, rows: pd.DataFrame, column: str, values: np.ndarray) -> pd.DataFrame:
        """Rows with a condition in random order; ``column`` by its name in the library or in tests.csv."""
        name, factor = UNITS.get(column, (column, 1.0))
        drawn = self.rng.permutation(np.resize(values, len(rows)))
        drawn = drawn if factor == 1.0 else drawn.astype(float) * factor
        return rows.assign(**{f"set_{name}" if name in DRAWN else name: drawn})

    def _ends(self, column: str, ends: tuple[float, ...] = (0.05, 0.5, 0.95)) -> np.ndarray:
        """Values of a column over its range, in the unit of the library; its names where it has names."""
        name, factor = UNITS.get(column, (column, 1.0))
        known = self.bench.tests[name]
        if not pd.api.types.is_numeric_dtype(known):
            return np.unique(known.astype(str))
        return np.unique(np.quantile(known.to_numpy(float), ends)) / factor

    def _rows(self, test: NextTest) -> pd.DataFrame:
        design, pulls = test.design, int(test.design["pulls"])
        middle = float(np.median(self.bench.tests["N"]))
        if test.kind == "confirm":
            return self._set(self._of(design["sample"], pulls), design["covariate"], np.array(design["values"]))
        if test.kind == "vary what was fixed":
            return self._widened(test)
        if test.kind == "part from load":
            rows = self._of("F", pulls)
            loads = np.quantile(self.bench.tests["N"], (0.05, 0.35, 0.65, 0.95))
            return self._set(rows.assign(N=np.resize(loads, pulls)), "speed_m_s", self._ends("speed_m_s"))
        if test.kind == "part columns":
            varied = [c for c in ("speed_m_s", "hold_s") if c in test.separates]
            rows = self._of("F", pulls)
            for column in varied:
                rows = self._set(rows, column, self._ends(column))
            return rows
        sample = str(design.get("sample", self.sample))
        if test.kind == "vary one column":
            return self._alone(str(design["covariate"]), sample, pulls, middle)
        rows = self._of(sample, pulls)
        if test.kind == "factorial":
            corners = self.rng.permutation(np.resize(np.arange(4), pulls))
            for bit, column in enumerate(design["vary"]):
                name, factor = UNITS.get(column, (column, 1.0))
                ends = self._ends(column)[[0, -1]]
                drawn = ends[(corners >> bit) & 1] * factor
                rows = rows.assign(**{f"set_{name}" if name in DRAWN else name: drawn})
            return rows
        for column in design.get("vary", ()):  # laws that the design cannot tell
            if column in UNITS or column in DRAWN:
                rows = self._set(rows, column, self._ends(column))
        for column in set(design) & {*UNITS, *DRAWN}:
            rows = self._set(rows, column, np.array([design[column], float(self._ends(column)[1])]))
        return rows

    @property
    def sample(self) -> str:
        return "F" if self.piece.kind.startswith(("nothing", "causes")) else sorted(set(self.bench.tests["sample"]))[-1]

    def _alone(self, column: str, sample: str, pulls: int, middle: float) -> pd.DataFrame:
        rows = self._of(sample, pulls, middle)
        if column == "specimen_run":
            return rows.assign(specimen=[f"{sample[0]}{7 + k % 3}" for k in range(pulls)])
        if column.startswith("specimen "):  # that specimen and fresh ones in turn
            name = column.removeprefix("specimen ")
            own = self.bench.tests[self.bench.tests["specimen"] == name]
            own = own.iloc[np.resize(np.arange(len(own)), pulls // 2)].assign(N=middle)
            others = self._of(str(own["sample"].iloc[0]), pulls - len(own), middle)
            fresh = [f"{name[0]}{7 + k % 3}" for k in range(len(others))]
            others = others.assign(specimen=fresh, true_sample=others["sample"])
            return pd.concat([own, others]).sample(frac=1.0, random_state=1).reset_index(drop=True)
        if column == "sample":
            names = sorted(set(self.bench.tests["sample"]))
            parts = [self._of(name, -(-pulls // len(names)), middle) for name in names]
            rows = pd.concat(parts).assign(specimen=lambda t: t["sample"].str[0] + "7")
            return rows.sample(frac=1.0, random_state=1).reset_index(drop=True)
        if column == "normal_load_N":
            loads = np.geomspace(self.bench.tests["N"].min(), self.bench.tests["N"].max(), pulls // 2)
            return rows.assign(N=np.concatenate([loads, loads[::-1]]), specimen=rows["specimen"].iloc[0])
        return self._set(rows, column, self._ends(column)) if column in (*UNITS, *DRAWN) else rows

    def _widened(self, test: NextTest) -> pd.DataFrame:
        design = test.design
        removed = design.get("without", [])
        varied = [name for name in ("speed_mm_s", "hold_s") if name in design]
        sample = str(design.get("sample", ""))
        number = int(design["pulls"]) // (len(removed) + 2 * bool(varied)) if sample else int(design["pulls"])
        parts = []
        for name in ("F", sample) if sample and varied else ("F",) if varied else ():
            rows = self._of(name, number)
            for column in varied:
                rows[column] = self.rng.permutation(np.resize(np.array(design[column], float), len(rows)))
            parts.append(rows)
        parts += [self._of(sample, number).assign(without=name) for name in removed]
        return pd.concat(parts, ignore_index=True)


def hidden_effect(bench: Bench, name: str, size: float, rng: np.random.Generator) -> None:
    from blind.effects import EFFECTS

    EFFECTS[name](bench, size, rng)


# -------------------------------------------------------------------------------------------------- what is counted


def alternatives(v: Verdict) -> list[frozenset[str]]:
    """Every cause, with what the verdict cannot tell from it."""
    if v.verdict == "undetermined":
        return [frozenset(c.mechanism for c in v.causes)]
    tied = [frozenset(names) for names in v.equivalent]
    return [*tied, *(frozenset({c.mechanism}) for c in v.causes if not any(c.mechanism in t for t in tied))]


def law_columns(v: Verdict) -> set[str]:
    return {name for x in v.layers if x.kind == "law" for name in x.shows.law.columns if hasattr(x.shows, "law")}


def speaks(v: Verdict, test: NextTest) -> bool:
    """Whether a test is about what the headline is about: its cause, its column, its sample, or what it says that the
    design could not test."""
    from tribo.mechanisms import MECHANISMS

    design, separates = test.design, set(test.separates)
    about = set(design.get("vary", ())) | ({str(design["covariate"])} if "covariate" in design else set())
    if v.verdict == "cannot_tell":
        return test.kind == "measure more"
    untested = {e.mechanism for e in v.not_testable}
    if test.kind == "part from load":
        return separates - {"normal_load_N"} <= {e.shows for e in v.not_testable if e.why == "only with the load"}
    if v.verdict == "no_misfit":
        return not separates or separates <= untested
    if causes := {name for names in alternatives(v) for name in names}:
        acted = str(design.get("measure") or design.get("without") or "").partition(":")[0]
        follows = {str(MECHANISMS[n.partition(":")[0]].column(n.partition(":")[2])) for n in causes}
        if acted:
            return acted in {name.partition(":")[0] for name in causes}
        laws = {x.formula for x in v.layers if x.kind == "law"} | {t for x in v.layers for t in x.tied_with}
        columns = {n.partition(":")[2] or n for n in causes}
        return bool(separates & (causes | laws | columns | follows) or about & (follows | law_columns(v)))
    if laws := [x for x in v.layers if x.kind == "law"]:
        return bool(about and about <= law_columns(v)) or separates <= {laws[0].formula, *laws[0].tied_with}
    if v.misfits and v.misfits[0].covariate == "sample":
        return "sample" in about or (design.get("sample") == v.misfits[0].sample and separates <= untested)
    return bool(v.misfits) and v.misfits[0].covariate in about


def expected_comes(before: Verdict, after: Verdict, test: NextTest, rows: pd.DataFrame, lab: Laboratory) -> bool:
    """Whether the answer that the verdict predicts, or the one that is hidden, comes."""
    hidden, now = lab.piece.hidden, alternatives(after)
    if test.kind == "measure more":
        return after.verdict != "cannot_tell"
    if test.kind == "confirm":
        return _as_predicted(before, test, rows, lab)
    if test.kind == "vary what was fixed":
        named = {name for names in now for name in names}
        open_yet = {e.mechanism for e in after.not_testable} & set(test.separates)
        return not open_yet and all((name in named) == (name == hidden) for name in test.separates)
    if test.kind in ("vary one column", "factorial"):
        return _follows(test, rows, lab)
    if test.kind == "part laws":
        same = {frozenset(x.shows.law.columns) for x in after.layers if x.kind == "law"}
        true = hidden_laws.FORMS[hidden].columns if lab.piece.kind.startswith("laws") else ()
        return any(all(any(c in names or {c} & set(t) for t in map(_names, true)) for c in names) for names in same)
    return any(names == {hidden} for names in now)


def _names(column: frozenset[str] | str) -> frozenset[str]:
    return column if isinstance(column, frozenset) else frozenset({column})


def _fitted(
    rows: pd.DataFrame, regime: str, values: np.ndarray, lab: Laboratory
) -> tuple[np.ndarray, np.ndarray, float]:
    """ln T over that of the flat law at the load, by specimen and value of a column: least squares.

    The effects of the values on that of the first, their covariance, and the p value of no effect at all.
    """
    force = getattr(lab.bench, regime)[rows.index]
    own = lab.bench.forces(rows["N"].to_numpy(), list(rows["true_sample"]))[:, ("static", "sliding").index(regime)]
    names, bodies = np.unique(values), np.unique(rows["specimen"].to_numpy().astype(str))
    body = (rows["specimen"].to_numpy().astype(str)[:, None] == bodies) * 1.0
    x = np.column_stack([body, (values[:, None] == names[1:]) * 1.0])
    y = np.log(force / own)
    solution, *_ = np.linalg.lstsq(x, y, rcond=None)
    left = float(np.sum((y - x @ solution) ** 2))
    without = float(np.sum((y - body @ np.linalg.lstsq(body, y, rcond=None)[0]) ** 2))
    freedom, added = len(y) - np.linalg.matrix_rank(x), len(names) - 1
    covariance = np.linalg.pinv(x.T @ x)[len(bodies) :, len(bodies) :] * left / freedom
    ratio = (without - left) / max(added, 1) / (left / freedom)
    return solution[len(bodies) :], covariance, float(f_distribution.sf(ratio, max(added, 1), freedom))


def _as_predicted(before: Verdict, test: NextTest, rows: pd.DataFrame, lab: Laboratory) -> bool:
    """Whether the predicted ratio of friction at the highest value to that at the lowest lies in the 95 % interval of
    the measured one, the uncertainty of the prediction included."""
    name, factor = UNITS.get(test.design["covariate"], (test.design["covariate"], 1.0))
    x = rows[f"set_{name}" if name in DRAWN else name].to_numpy(float) / factor
    effects, covariance, _ = _fitted(rows, str(test.design["regime"]), x, lab)
    predicted = float(np.log1p(test.design["expected_percent"] / 100.0))
    cause = next(c for c in before.causes if c.mechanism in test.separates)
    amplitude = next(iter(cause.parameters.values()))
    relative = (amplitude.high - amplitude.low) / 3.29 / max(abs(amplitude.value), 1e-12)
    u = float(np.hypot(np.sqrt(covariance[-1, -1]), relative * predicted))
    return bool(abs(effects[-1] - predicted) <= 1.96 * u)


def _follows(test: NextTest, rows: pd.DataFrame, lab: Laboratory) -> bool:
    """Whether friction differs between the values of the column that was varied alone, or between the corners."""
    columns = list(test.design.get("vary") or [test.design["covariate"]])
    if columns == ["sample"]:
        return False  # no kind of this exam leads there: its expectation would have to be stated first
    if columns[0].startswith("specimen "):  # a body against the scatter of fresh ones
        own = rows["specimen"].to_numpy() == columns[0].removeprefix("specimen ")
        flat = lab.bench.forces(rows["N"].to_numpy(), list(rows["sample"]))
        y = np.log(np.column_stack([lab.bench.static, lab.bench.sliding])[rows.index] / flat)
        return 2 * min(float(ttest_ind(y[own, k], y[~own, k], equal_var=False).pvalue) for k in (0, 1)) < FOLLOWS
    if columns == ["specimen_run"]:
        cells = np.where(rows["specimen_run"].to_numpy() <= 2, "first", "later")
    else:
        names = [UNITS.get(c, (c, 1.0))[0] for c in columns]
        keys = [f"set_{n}" if n in DRAWN else n for n in names]
        cells = rows[keys].astype(str).agg(" ".join, axis=1).to_numpy().astype(str)
    found = [_fitted(rows, regime, cells, lab)[2] for regime in ("static", "sliding")]
    return 2 * min(found) < FOLLOWS


def vagueness(v: Verdict) -> dict[str, float]:
    """What a verdict leaves open: alternatives, mechanisms not tested, tied laws, and the width of its first size."""
    laws = [x for x in v.layers if x.kind == "law"]
    causes = [c for c in v.causes if c.parameters]
    sized = next(iter(causes[0].parameters.values()), None) if causes else None
    if sized is None and laws:
        sized = laws[0]
    if sized is None and v.misfits:
        sized = v.misfits[0]
    width = float(sized.high - sized.low) if sized is not None else np.nan
    return {  # plain floats: they are written as JSON
        "undecided": float(v.verdict == "cannot_tell"),
        "alternatives": float(sum(len(names) - 1 for names in alternatives(v))),
        "untested": float(len(v.not_testable)), "ties": float(sum(len(x.tied_with) for x in laws)), "width": width,
    }  # fmt: skip


def sharper(before: dict[str, float], after: dict[str, float]) -> bool:
    """Less is left open in number; or as much, and the size is known better, or for the first time."""
    counts = ("undecided", "alternatives", "untested", "ties")
    fewer = [after[k] - before[k] for k in counts]
    if any(step < 0 for step in fewer):
        return all(step <= 0 for step in fewer[:2])
    known = np.isfinite(after["width"]) and not after["width"] >= before["width"]
    return not any(step > 0 for step in fewer) and bool(known)


def work(piece: Piece) -> dict[str, Any]:
    from tribo.wording.verdict_sentences import why_next

    begin = time.process_time()
    lab = Laboratory(piece)
    against: list[str] = []
    before = lab.verdict(against)
    row = {
        "kind": piece.kind, "hidden": piece.hidden, "cell": piece.case.cell, "seed": piece.case.seed,
        "verdict": before.verdict, "headline": before.sentence, "named": sorted(map(sorted, alternatives(before))),
        "against_verdict": against,
    }  # fmt: skip
    test = before.next_test
    if test is None:
        return row | {"test": "none", "seconds": round(time.process_time() - begin, 1)}
    row |= {"test": test.kind, "text": test.text, "why": why_next(before), "speaks": speaks(before, test)}
    open_before = vagueness(before)
    if lab.piece.hidden in ("mislabelled_specimen", "pattern_geometry"):
        lab.named_size = next((next(iter(c.parameters.values())).value for c in before.causes
                               if c.mechanism == lab.piece.hidden), None)  # fmt: skip
    rows = lab.carry_out(test)
    after = lab.verdict()
    expected, is_sharper = expected_comes(before, after, test, rows, lab), sharper(open_before, vagueness(after))
    return row | {
        "after": after.verdict, "headline_after": after.sentence,
        "named_after": sorted(map(sorted, alternatives(after))),
        "expected": bool(expected), "sharper": bool(is_sharper),
        "open": [open_before, vagueness(after)], "seconds": round(time.process_time() - begin, 1),
    }  # fmt: skip


def in_a_line(row: dict[str, Any]) -> str:
    said = [k for k in ("speaks", "expected", "sharper") if row.get(k)]
    return f"{row['cell']}: {row['verdict']} {row['named']}; {row['test']}: {', '.join(said)}"


def table(rows: list[dict[str, Any]]) -> str:
    """Counts by kind of campaign and by kind of test."""

    def counts(part: list[dict[str, Any]]) -> str:
        return " | ".join(f"{sum(bool(r.get(k)) for r in part)}/{len(part)}" for k in ("speaks", "expected", "sharper"))

    lines = ["| campaigns | number | speaks of the headline | expected answer | sharper verdict |", "|---" * 5 + "|"]
    made = [r for r in rows if r["test"] != "none"]
    lines.append(f"| all with a next test | {len(made)} | {counts(made)} |")
    for key in ("kind", "test"):
        for name in dict.fromkeys(r[key] for r in sorted(made, key=lambda r: r[key])):
            part = [r for r in made if r[key] == name]
            lines.append(f"| {'test: ' if key == 'test' else ''}{name} | {len(part)} | {counts(part)} |")
    without = [r for r in rows if r["test"] == "none"]
    drawn = [r for r in rows if "without the model" not in r["kind"] and not r["kind"].startswith("too little")]
    against = [text for r in drawn for text in r.get("against_verdict", [])]
    said = f"{len(without)} of {len(rows)} verdicts propose no test."
    figures = f"Figures against their verdict: {len(against)} in {len(drawn)} campaigns."
    return "\n".join([*lines, "", said, figures, *(f"- {text}" for text in against)]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "table", "page"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--half", type=Path, default=DATA / "blind-half.jsonl", help="sizes of docs/blind.md")
    parser.add_argument("--share", type=float, default=1.0, help="of the 100 campaigns")
    parser.add_argument("--only", default="", help="kinds that begin with this")
    parser.add_argument("--seed", type=int, default=2801)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    if options.what == "run":
        half = {row["effect"]: row["half"] for row in read_rows(options.half)}
        known = {(row["cell"], row["seed"]) for row in read_rows(options.path)}
        every = [p for p in pieces(half, options.share, options.seed) if p.kind.startswith(options.only)]
        rest = [p for p in every if (p.case.cell, p.case.seed) not in known]
        np.random.default_rng(options.seed).shuffle(rest)  # type: ignore[arg-type]
        work_off(rest, work, options.path, options.jobs, in_a_line)
    rows = read_rows(options.path)
    text = table(rows)
    if options.what == "page":
        above = PAGE.read_text().split(MARK)[0]
        PAGE.write_text(f"{above}{MARK}\n\nSeed {options.seed}: {len(rows)} verdicts.\n\n{text}")
        kept = sorted(rows, key=lambda r: (r["cell"], r["seed"]))
        (DATA / "next-tests.jsonl").write_text("".join(json.dumps(row) + "\n" for row in kept))
    print(text)


if __name__ == "__main__":
    main()
