"""Published pairs of a patterned and a flat surface: signs and orders of the model beside those measured, and refusals.

    python benchmarks/published_pairs.py docs/data/published-pairs.csv

Inside the model: Table 2 of Berardo et al. 2019, T/N of each pattern over that of the flat sample at 5 and 20 kPa,
static and sliding, and S along x over S along y; the model is calibrated on the flat sample alone
(docs/results/table2-recomputed.md). Of other dry surfaces abstracts tell the sign alone, and their sizes are not the
paper's: the model is asked for the sign with the paper's material, at four area fractions and two pressures, and has
to give it in all eight. These slid over millimetres: sliding is taken from 2 to 4 peak times, not up to the paper's 2.
Outside: surfaces whose friction needs what the model does not contain; each is given to ``tribo design`` as the
``needs`` of a target. Only abstracts were read for these, so they carry no numbers.
"""

from __future__ import annotations

import csv
import math
import sys
import tempfile
from pathlib import Path

from structured_stick_slip import hexagonal

from tribo.berardo2019.published_tables import load_table2, load_table2_simulated_anew
from tribo.design.target import read_target
from tribo.errors import SimulationError
from tribo.records import Pattern
from tribo.springblock import SimConfig, simulate

PRESSURES_KPA = (5.0, 20.0)
AREA_FRACTIONS = (0.36, 0.51, 0.64, 0.75)
PITCH_M = 40e-6
LOWER = (  # what abstracts say to be below a flat sample, dry: shapes that touch or are left out, and the regime
    ("Biomimetics 9, 542, 2024: micro-hexagons on glass, dry", "hexagonal pillars", "static"),
    ("Biomimetics 9, 542, 2024: micro-hexagons on glass, dry", "hexagonal pillars", "sliding"),
    ("J. Tribol. 144, 031704, 2022: square cavities in polyethylene", "square holes", "sliding"),
    ("Lubricants 5, 45, 2017: grooves in elastomers", "grooves", "sliding"),
)
OUTSIDE = {
    "Varenberg and Gorb 2007, IJTC2007-44: mushroom-shaped pillars, dry": "height of mushroom-shaped pillars",
    "Bai et al. 2014, Langmuir: ridges and channels against a rough surface": "roughness of the counterface",
    "He et al. 2016, Sci. Rep. 6, 26867: ridges under a film": "a film over ridges",
    "Drotlef et al. 2013, Adv. Funct. Mater.: tree-frog pillars in a liquid": "wetting liquid",
    "Iturri et al. 2015, Adv. Funct. Mater.: elongated pillars in water": "water between the surfaces",
    "Tsipenyuk and Varenberg 2014, J. R. Soc. Interface: hexagons on lubricated skin": "a lubricant",
    "Nanni et al. 2015, Appl. Surf. Sci. 326: micro-dimples that hold by suction": "suction in dimples",
    "Suzuki and Ohzono 2016, Soft Matter: wrinkles of a textile": "height of wrinkles",
    "Baum et al. 2014, Beilstein J. Nanotechnol. 5, 1091: snake skin in epoxy": "heights that interlock",
    "Aymard et al. 2024, Science: asperities of chosen heights": "heights of asperities",
    "Adhesion and friction by a colloidal probe, 2013, J. Adhes. Sci. Technol.": "indentation of pillars by a probe",
    "Zhang et al. 2020, Adv. Sci. (PMC7578903): pillars with nanocavities, wetted": "wet pillars",
}
TARGET = """
needs = ["{need}"]
[[target]]
friction = "sliding"
pressure_kPa = 10
best = "largest"
[[pattern]]
cavity = "circle"
diameter_um = [5, 20]
pitch_um = [10, 40]
"""


def laws(table: object) -> dict[tuple[str, str], tuple[float, float]]:
    rows = table.to_dict("records")  # type: ignore[attr-defined]
    return {(r["sample"], r["regime"]): (r["mu"], r["tau0_kPa"]) for r in rows}


def friction(law: tuple[float, float], pressure_kPa: float) -> float:
    """T/N of mu and tau0."""
    return law[0] + law[1] / pressure_kPa


def inside() -> list[list[object]]:
    measured = laws(load_table2().query("source == 'experiment'"))
    model = laws(load_table2_simulated_anew())
    found: list[list[object]] = []
    pairs = [(s, "F") for s in ("A", "B", "C", "Sx", "Sy")] + [("Sx", "Sy")]
    for regime in ("static", "sliding"):
        for one, other in pairs:
            for p in PRESSURES_KPA:
                ratios = [
                    math.log(friction(t[one, regime], p) / friction(t[other, regime], p)) for t in (measured, model)
                ]
                right = ratios[0] * ratios[1] > 0
                found.append(["Berardo et al. 2019, Table 2", f"{one} over {other}, {regime}, {p:g} kPa", "inside",
                              *(f"{math.exp(r):.3f}" for r in ratios), "right" if right else "wrong"])  # fmt: skip
    return found


def shaped(shape: str, area_fraction: float) -> Pattern:
    if shape == "hexagonal pillars":
        diameter_m = math.sqrt(area_fraction * 2.0 * math.sqrt(3.0) / math.pi) * PITCH_M
        return hexagonal(shape, "pillar", 1e6 * diameter_m, 1e6 * PITCH_M)
    if shape == "square holes":
        side_m = math.sqrt(1.0 - area_fraction) * PITCH_M
        return Pattern(shape, "square", (side_m, side_m), (PITCH_M, PITCH_M))
    width_m = (1.0 - area_fraction) * PITCH_M
    return Pattern(shape, "ridge", (width_m, width_m), (PITCH_M, PITCH_M))


def signs() -> list[list[object]]:
    """The range of the predicted ratios, in place of a measured one the side of 1 on which it lies."""
    base = SimConfig(blocks=(45, 45), seed=1, duration_peaks=4.0, window_start_peaks=2.0, angle_deg=0.0)
    flat = {p: simulate(base.with_(pressure_Pa=1e3 * p)) for p in PRESSURES_KPA}
    found: list[list[object]] = []
    for source, shape, regime in LOWER:
        ratios = []
        for share in AREA_FRACTIONS:
            pattern = shaped(shape, share)
            for p in PRESSURES_KPA:
                run = simulate(base.with_(pressure_Pa=1e3 * p, sample=shape, pattern=pattern))
                ratios.append(getattr(run, f"{regime}_friction") / getattr(flat[p], f"{regime}_friction"))
        predicted = f"{min(ratios):.3f} to {max(ratios):.3f}"
        right = max(ratios) < 1.0
        found.append(
            [source, f"{shape} over flat, {regime}", "inside", "below 1", predicted, "right" if right else "wrong"]
        )
    return found


def outside() -> list[list[object]]:
    found: list[list[object]] = []
    with tempfile.TemporaryDirectory() as folder:
        for source, need in OUTSIDE.items():
            path = Path(folder) / "target.toml"
            path.write_text(TARGET.format(need=need))
            try:
                read_target(path)
                said = "not refused"
            except SimulationError as refused:
                said = "refused" if refused.problems[0].kind == "not_in_model" else "refused for another cause"
            found.append([source, need, "outside", "", "", said])
    return found


if __name__ == "__main__":
    rows = [*inside(), *signs(), *outside()]
    with Path(sys.argv[1]).open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["source", "pair_or_need", "called", "measured_ratio", "predicted_ratio", "result"])
        out.writerows(rows)
    for row in rows:
        print(*row, sep=" | ")
    for kind in ("inside", "outside"):
        of_kind = [row[-1] for row in rows if row[2] == kind]
        print(kind, len(of_kind), {said: of_kind.count(said) for said in sorted(set(map(str, of_kind)))})
