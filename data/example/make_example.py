"""Make the bundled example again: ``python data/example/make_example.py [FOLDER]`` (same bytes each time)."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

from support.sled import SledDesign, SledLaw, write_campaign

# mu and tau0 (kPa) measured by Berardo et al. 2019, Table 2, columns "fit T/N = mu + tau0/p"
MEASURED = {
    "F": (4.76, 23.45, 2.88, 11.85),
    "A": (5.71, 15.41, 3.75, 4.02),
    "B": (2.05, 24.85, 2.62, 2.98),
    "C": (2.18, 4.30, 1.88, 1.05),
    "Sx": (2.44, 9.17, 2.67, 4.52),
    "Sy": (2.25, 1.16, 2.14, 0.09),
}

CAMPAIGN = """\
# The bundled example: a virtual sled tribometer that obeys the laws measured by Berardo et al. (2019), Table 2.
[campaign]
title = "Example: micro-patterned PDMS on polycarbonate, simulated instrument"
material = "PDMS (Sylgard 184), simulated"
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

[patterns.S]
cavity = "rectangle"
size_um = [200.0, 40.0]
pitch_um = [220.0, 120.0]
staggered = true
"""


def main(folder: Path) -> None:
    laws = {s: SledLaw(a, b * 1e3, c, d * 1e3) for s, (a, b, c, d) in MEASURED.items()}
    write_campaign(folder, SledDesign(laws), CAMPAIGN, seed=2019)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
