"""What `tribo init` writes: a commented campaign to fill in."""

from __future__ import annotations

from pathlib import Path

from tribo.campaign.load import RAW, TESTS, TOML
from tribo.errors import CampaignError, Problem

_TOML_TEXT = """\
# A campaign: what was pulled over what, and the patterns.

[campaign]
title = "Sled friction of patterned PDMS on polycarbonate"
material = "PDMS (Sylgard 184)"
counterface = "polycarbonate"
nominal_area_mm2 = 55.0   # area of the whole sample face, cavities included
slider_mass_g = 1.5       # sled with sample, without the mass put on it
pull_speed_mm_s = 0.2     # used where tests.csv gives no speed_mm_s

# One table a pattern. cavity: none, circle (diameter_um), square or rectangle (size_um), each with pitch_um;
# one number, or [x, y]. staggered = true shifts every other row by half a pitch along x.
# area_fraction = 0.71 replaces the fraction that follows from the geometry by a measured one.
# A sample Sx or Sy in tests.csv is pattern S pulled along x or y.

[patterns.F]
cavity = "none"

[patterns.A]
cavity = "circle"
diameter_um = 5.0
pitch_um = [20.0, 20.0]

[patterns.S]
cavity = "rectangle"
size_um = [200.0, 40.0]
pitch_um = [220.0, 120.0]
staggered = true

# Every pull is a row of tests.csv, and its file an export in raw/. Where one export holds several pulls, file says
# which: raw/log.csv#2 is its second table (step, segment, specimen), raw/log.csv#2/3 the third pull within that
# table (a stroke, or one of several loads or speeds), raw/log.csv#2/* every pull of it, raw/log.csv#* every pull of the
# export, each a test of its own. Such a row may leave the load empty: it is then the normal force in the export.

# Where the exports name their columns in a way that is not understood (tribo inspect FILE tells), say it
# here: the quantity, then the column's own name with its unit, or its position.
# [columns]
# time = "Clock [s]"
# force = "Channel 2 [N]"
# displacement = "#3 [mm]"

# Standard uncertainties (k = 1) of the rig; what is left out takes its stated default.
# [instrument]
# load_cell_u_percent = 0.5
# mass_u_g = 0.05
# area_u_percent = 1.0
# wire_angle_u_deg = 0.5
# stiffness_N_per_m = 2000.0
"""

# Required: test_id, file, sample, and mass_g or normal_load_N. Any further column is kept as a covariate.
_TESTS_TEXT = """\
test_id,file,sample,specimen,direction,mass_g,normal_load_N,speed_mm_s,hold_s,repeat,run_order,specimen_run,\
started_at,temperature_C,humidity_pct,operator,exclude
T0001,raw/T0001.csv,F,F1,,50,,0.2,10,1,1,1,2026-03-02T09:00:00,22.5,51,,
T0002,raw/T0002.csv,Sx,S1,x,50,,0.2,10,1,2,1,2026-03-02T09:08:00,22.6,51,,slipped off the hook
"""


def write_template(folder: Path | str) -> tuple[Path, ...]:
    """Write campaign.toml, tests.csv and an empty raw/ into a folder, and return what was written.

    Raises
    ------
    CampaignError
        One of them is there already: nothing is ever overwritten, and nothing at all written then.
    """
    folder = Path(folder)
    texts = {folder / TOML: _TOML_TEXT, folder / TESTS: _TESTS_TEXT}
    there = [path for path in texts if path.exists()]
    if there or (folder.exists() and not folder.is_dir()):
        what = "there already; nothing is overwritten"
        raise CampaignError(Problem("exists", what, file=str(path)) for path in there or [folder])
    (folder / RAW).mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        with path.open("x", encoding="utf-8", newline="\n") as out:
            out.write(text)
    return (*texts, folder / RAW)
