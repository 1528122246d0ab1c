"""Make the second example again: ``python data/second_example/make_example.py [FOLDER]`` (same bytes each time)."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

from support.sled import SledDesign, SledLaw, SledTribometer, write_campaign

# mu and tau0 (kPa), static and sliding, of what the spring-block model says of the samples of the first example:
# a line through simulated_N against normal_load_N in its comparison.csv
MODELLED = {
    "F": (4.76, 23.7, 2.89, 12.1),
    "A": (4.34, 19.2, 2.94, 11.7),
    "B": (4.15, 11.0, 3.04, 7.4),
    "C": (3.94, 8.7, 3.04, 5.9),
}
HOLDS_S = (1.0, 10.0, 60.0, 300.0)

CAMPAIGN = """\
# The second example: a virtual sled tribometer whose samples are as the model says, but for one thing that is hidden.
[campaign]
title = "Second example: micro-patterned elastomer at four times at rest, simulated instrument"
material = "elastomer, simulated"
counterface = "polycarbonate, simulated"
nominal_area_mm2 = 55.0
slider_mass_g = 1.5
pull_speed_mm_s = 0.2

[patterns.F]
cavity = "none"

[patterns.A]
cavity = "circle"
diameter_um = 5.0
pitch_um = [20.0, 20.0]

[patterns.B]
cavity = "circle"
diameter_um = 10.0
pitch_um = [15.0, 15.0]

[patterns.C]
cavity = "circle"
diameter_um = 15.0
pitch_um = [20.0, 20.0]
"""


def ageing(hold_s: float) -> float:
    """Static friction over that after 10 s at rest: a power of the time at rest."""
    return float((hold_s / 10.0) ** 0.05)


def main(folder: Path) -> None:
    laws = {s: SledLaw(a, b * 1e3, c, d * 1e3) for s, (a, b, c, d) in MODELLED.items()}
    design = SledDesign(
        laws, holds_s=HOLDS_S, ageing=ageing, tribometer=SledTribometer(duration_s=14.0)
    )
    write_campaign(folder, design, CAMPAIGN, dialect="testxpert", seed=1930)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
