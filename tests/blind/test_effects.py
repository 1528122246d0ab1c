"""The virtual tribometer itself, and the counting of answers."""

from __future__ import annotations

import ast
import csv
import math
import sys
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from tribo.campaign import load_campaign
from tribo.mechanisms import NAMES
from tribo.stages import ingest

from .bench import Noise
from .direct import ingested
from .patterns import Draw, ErrorSize, draw_errors
from .tribometer import EFFECTS, LARGEST, Bench, Design, hide, write

ROOT = Path(__file__).resolve().parents[2]
FULL = Design(repeats=1, speeds_mm_s=(0.05, 0.2, 0.8), holds_s=(1.0, 300.0))
sys.path.append(str(ROOT / "benchmarks"))

from blind_tables import both_tied, covariate_right, part, right, share, wrong  # noqa: E402

# hidden by tests/laboratories/one_value.py
OF_ONE_VALUE = {"load_of_one_day", "tare_of_one_day", "area_of_one_specimen"}


def test_every_mechanism_of_the_library_can_be_hidden() -> None:
    assert {name.split(":")[0] for name in EFFECTS} - {"outside"} == set(NAMES) - OF_ONE_VALUE
    assert set(EFFECTS) - set(LARGEST) == {"covariate:operator", "load_cell_offset", "load_cell_drift"}


BLIND = ("bench.py", "effects.py", "hidden_laws.py", "patterns.py", "scatter.py", "tribometer.py")
LABORATORIES = tuple(sorted(
    p.name for p in (ROOT / "tests" / "laboratories").glob("*.py") if not p.name.startswith(("test_", "__"))
))  # fmt: skip
GENERATOR = (*(("blind", name) for name in BLIND), *(("laboratories", name) for name in LABORATORIES))
HANDS_OVER = "hidden_laws.py"  # names the record of the library that a finished campaign is handed over as
# What both may say: standard gravity, and the area (55 mm2), two loads (12 and 25 g) and the slider (1.5 g) of the
# published campaign, which the design repeats.
COMMON = {"9.80665", "55.0", "12.0", "25.0", "1.5"}
# Numbers that coincide all the same, and what each is in the generator: an end of a range from which sizes or places
# are drawn, round to the field, so that no single campaign has it. In the library, each is something else.
COINCIDE = {
    ("blind", "hidden_laws.py"): {
        "0.12": "range of the length of a stretch", "0.15": "where a stretch begins at the earliest",
        "0.25": "where a change comes at the earliest", "1.2": "the largest scatter of repeats, of the usual",
    },
    ("laboratories", "campaign.py"): {
        "5.5": "largest static coefficient", "2.5": "smallest sliding coefficient",
        "3.5": "largest sliding coefficient",
    },
    ("laboratories", "free_laws.py"): {
        "0.15": "shortest length of a smooth course", "2.5": "fewest turns of a periodic course",
    },
    ("laboratories", "laboratory.py"): {
        "0.012": "usual odd curve of a pattern or specimen", "1.2": "the largest scatter of repeats, of the usual",
    },
    ("laboratories", "levels.py"): {
        "0.12": "largest size of a law of levels", "0.25": "by how much of a step a level is off an even ladder",
    },
    ("laboratories", "nuisance.py"): {"2.5": "degrees of freedom of days with heavy tails"},
    ("laboratories", "one_value.py"): {
        "0.12": "largest habit of an operator", "0.15": "largest change by a lot", "0.25": "largest change of an area",
    },
}  # fmt: skip


def numbers_in(source: str) -> dict[tuple[str, int], str]:
    """Every decimal number of at least two significant digits, by its digits and its power of ten modulo 1000.

    So 5.37 kPa is found again as 5370 Pa or 0.00537 MPa.
    """
    found = {}
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, float) and math.isfinite(node.value):
            _, digits, exponent = Decimal(repr(node.value)).normalize().as_tuple()
            if len(digits) >= 2:
                found["".join(map(str, digits)), int(exponent) % 3] = repr(node.value)
    return found


def test_numbers_that_generator_and_library_have_in_common_are_listed_with_what_they_are() -> None:
    """Numbers of two digits and more. One that coincides is listed in COINCIDE and explained there, not shifted."""
    library: dict[tuple[str, int], str] = {}
    sources = [ROOT / "tribo" / "mechanisms_in_model.py"]
    for folder in ("mechanisms", "diagnostics", "lawsearch"):
        sources += (ROOT / "tribo" / folder).rglob("*.py")
    for path in sources:
        library |= numbers_in(path.read_text())
    assert len(library) > 20  # the scan sees the library
    for folder, name in GENERATOR:
        own = numbers_in((ROOT / "tests" / folder / name).read_text())
        shared = {v for k, v in own.items() if k in library} - COMMON
        assert shared <= set(COINCIDE.get((folder, name), {})), (folder, name)


def test_the_generator_does_not_import_the_library() -> None:
    for folder, name in GENERATOR:
        tree = ast.parse((ROOT / "tests" / folder / name).read_text())
        modules = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level == 0}
        modules |= {alias.name for n in ast.walk(tree) if isinstance(n, ast.Import) for alias in n.names}
        allowed = {"tribo.records"} if name == HANDS_OVER else set()
        assert not [m for m in modules if m.split(".")[0] == "tribo" and m not in allowed], name


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_an_effect_changes_something_that_a_pull_records(name: str) -> None:
    """Forces, the zero, the rise or the sampling; the same draw without the effect is the comparison."""
    plain, changed = hide(7, [], FULL), hide(7, [(name, 1.0)], FULL)
    pairs = ((plain.static, changed.static), (plain.sliding, changed.sliding), (plain.zero, changed.zero))
    moved = any(np.abs(a - b).max() > 1e-3 for a, b in pairs)
    stiffness = np.ptp(changed.stiffness_N_per_mm / plain.stiffness_N_per_mm) > 0 or (
        changed.stiffness_N_per_mm[0] != plain.stiffness_N_per_mm[0]
    )
    assert moved or stiffness or np.isfinite(changed.samples_per_s)


STILL = Design(specimen_sd=0.0, repeat_sd=(0.0, 0.0), pattern_error=0.0, speeds_mm_s=(0.2,))


def of(bench: Bench, sample: str) -> np.ndarray:
    return (bench.tests["sample"] == sample).to_numpy()


def test_without_scatter_a_pattern_holds_what_the_reference_engine_gives() -> None:
    """At 8 kPa, a pressure of the table: the mean over angles of C over that of F on the same lattice."""
    bench = hide(7, [], replace(STILL, samples=("F", "C"), masses_g=(8e3 * 55e-6 / 9.80665e-3 - 1.5,)))
    with (ROOT / "tests" / "blind" / "reference_engine.csv").open(newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["pressure_Pa"] == "8000" and r["blocks_x"] == "36"]
    static = {s: np.mean([float(r["static_over_load"]) for r in rows if r["sample"] == s]) for s in "FC"}
    ratio = bench.static[of(bench, "C")].mean() / bench.static[of(bench, "F")].mean()
    assert ratio == pytest.approx(static["C"] / static["F"], rel=1e-9)


def test_every_row_of_the_reference_table_is_one_the_script_would_make() -> None:
    from blind_engine import HEAD, PRESSURES_PA, SERIES, key

    with (ROOT / "tests" / "blind" / "reference_engine.csv").open(newline="") as file:
        found = {tuple(row[name] for name in HEAD[:6]) for row in csv.DictReader(file)}
    assert found == {key(series, p) for series in SERIES for p in PRESSURES_PA}


def test_patterns_hold_less_than_the_flat_sample() -> None:
    bench = hide(7, [], STILL)
    mean = {s: bench.static[of(bench, s)].mean() for s in STILL.samples}
    assert mean["F"] > mean["A"] > mean["B"] > mean["C"] > 0.5 * mean["F"]
    assert mean["F"] > mean["Sx"] > mean["Sy"] > 0.5 * mean["F"]


@pytest.mark.parametrize("draw", ["uniform", "heavy"])
def test_the_drawn_pattern_errors_have_the_size_that_is_asked_for(draw: Draw) -> None:
    sizes = {"A": ErrorSize((0.05, 0.04), (0.02, 0.01), (0.008, 0.004))}
    rng = np.random.default_rng(5)
    drawn = np.array([draw_errors(sizes, 1.5, draw, rng)["A"] for _ in range(4000)])
    assert drawn.mean(axis=0) == pytest.approx(np.zeros((3, 2)), abs=0.005)
    assert drawn.std(axis=0) == pytest.approx(1.5 * np.array([[0.05, 0.04], [0.02, 0.01], [0.008, 0.004]]), rel=0.06)


def test_a_specimen_differs_by_a_gain_and_a_slope_in_the_logarithm_of_the_load() -> None:
    design = replace(STILL, samples=("F",), specimens=400, specimen_sd=0.05, specimen_slope=0.04)
    bench, still = hide(7, [], design), hide(7, [], replace(design, specimen_sd=0.0, specimen_slope=0.0))
    change = np.log(bench.static / still.static)
    x = np.log(bench.column("N"))
    lines = [np.polyfit(x[r] - x.mean(), change[r], 1) for r in bench.tests.groupby("specimen").indices.values()]
    slope, gain = np.std(lines, axis=0)
    assert gain == pytest.approx(0.05, rel=0.1)
    assert slope == pytest.approx(0.04, rel=0.1)


@pytest.mark.parametrize("noise", ["relative", "absolute", "heavy", "unequal"])
def test_the_noise_laws_scatter_as_they_say(noise: Noise) -> None:
    """Relative and heavy: the same share at every load. Absolute: the same newtons. Unequal: samples differ."""
    design = replace(STILL, masses_g=(5.0, 138.5), repeats=400, repeat_sd=(0.09, 0.07), noise=noise)
    bench, still = hide(3, [], design), hide(3, [], replace(design, repeat_sd=(0.0, 0.0)))
    light = (bench.tests["mass_g"] == 5.0).to_numpy()
    error_N = bench.static - still.static
    share = {m: np.std((error_N / still.static)[of(bench, "F") & m_rows]) for m, m_rows in ((5, light), (138, ~light))}
    if noise == "absolute":
        assert np.std(error_N[of(bench, "F") & light]) == pytest.approx(np.std(error_N[~light]), rel=0.1)
        assert share[5] > 3 * share[138]
    else:
        assert share[5] == pytest.approx(share[138], rel=0.15)
    spread = [np.std((error_N / still.static)[of(bench, s)]) for s in design.samples]
    assert (max(spread) > 1.5 * min(spread)) == (noise in ("unequal", "absolute"))


def test_a_campaign_handed_over_as_records_is_the_one_its_files_give(tmp_path: Path) -> None:
    """Both routes of the blind test: forces agree within four of the stated reading errors in nearly every pull."""
    design = Design(samples=("F", "C"), specimens=2, repeats=1, masses_g=(5.0, 50.0, 138.5))
    bench = hide(31, [("run_in", 1.0)], design)
    files, records = ingest(load_campaign(write(bench, tmp_path / "campaign", 31))), ingested(bench, 31)
    assert [t.test_id for t in files.campaign.tests] == [t.test_id for t in records.campaign.tests]
    assert files.campaign.samples == records.campaign.samples
    for a, b in zip(files.campaign.tests, records.campaign.tests, strict=True):
        assert a.normal_load_N == pytest.approx(b.normal_load_N)
        of_files = replace(a, normal_load_N=0.0, row=None, correction=b.correction)  # records need none
        assert of_files == replace(b, normal_load_N=0.0, row=None)
    off = [abs(files.pulls[k].static_N - p.static_N) / p.static_u_N for k, p in records.pulls.items()]
    assert np.mean(np.array(off) < 4) > 0.9
    off = [abs(files.pulls[k].sliding_N - p.sliding_N) / p.sliding_u_N for k, p in records.pulls.items()]
    assert np.mean(np.array(off) < 4) > 0.9


def row(verdict: str, causes: list[list[str]], *hidden: str, **more: object) -> dict[str, object]:
    return {"verdict": verdict, "causes": causes, "effects": [[h, 1.0] for h in hidden], "covariates": [], **more}


def test_answers_are_counted_as_the_page_says() -> None:
    tied = row(
        "named",
        [["normal_load_error", "suction"]],
        "suction",
        next_test={"separates": ["normal_load_error", "suction"]},
    )
    assert right(tied)
    assert both_tied(tied)
    assert not wrong(tied)
    assert not both_tied(row("named", [["suction"]], "suction"))
    assert wrong(row("named", [["tilt"]], "run_in"))
    assert not right(row("named", [["tilt"]], "run_in"))
    half = row("named", [["run_in"]], "run_in", "suction")
    assert part(half)
    assert not right(half)
    assert wrong(row("named", [["run_in"], ["tilt"]], "run_in", "suction"))
    assert right(row("no_misfit", []))
    assert not right(row("undetermined", [["run_in"], ["tilt"]], "run_in"))
    outside = row("unknown", [], "outside:day", covariates=["time of day", "run_order"])
    assert right(outside)
    assert covariate_right(outside)
    assert share([outside, row("named", [["tilt"]], "outside:day")], right).startswith("1/2 = 50.0 %")
