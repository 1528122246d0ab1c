"""The campaign template that `tribo init` writes."""

from __future__ import annotations

from pathlib import Path

from tribo.campaign.load import RAW, TESTS, TOML
from tribo.errors import CampaignError, Problem
from tribo.files import write_new

_TOML_TEXT = """\
# Description of a campaign: sample, counterface and patterns. Replace the example values by your own.

[campaign]
title = "Sled friction of patterned PDMS on polycarbonate"
material = "PDMS (Sylgard 184)"
counterface = "polycarbonate"
nominal_area_mm2 = 55.0   # area of the sample face, including cavities
slider_mass_g = 1.5       # mass of sled and sample, without the added mass
pull_speed_mm_s = 0.2     # used for tests without speed_mm_s in tests.csv
# zero = "none"           # of the force: "before contact", "at rest", "none", a number of newtons, or [from, to] in s
# load_zero = "none"      # of the recorded normal load, in the same form

# Patterns, one table each. cavity is "none", "circle" (with diameter_um), "square" or "rectangle" (with size_um);
# all but "none" also need pitch_um. Sizes and pitches are one number or [x, y], in micrometres.
# staggered = true shifts every other row of cavities by half a pitch along x.
# area_fraction = 0.71 gives a measured contact area fraction; it replaces the one computed from the geometry.
# Samples Sx and Sy in tests.csv mean pattern S pulled along x and along y.

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

# tests.csv has one row per pull; its column file names the export in raw/. If an export holds several pulls, file
# also selects the pull:
#   raw/log.csv#2     second table of the export (step, segment or specimen)
#   raw/log.csv#2/3   third pull of that table (a stroke, or one of several loads or speeds)
#   raw/log.csv#2/*   all pulls of that table, each as a separate test
#   raw/log.csv#*     all pulls of the export, each as a separate test
# In such a row the load may be left empty; the normal force recorded in the export is then used.

# If tribo does not recognise the columns of your exports (check with: tribo inspect FILE), name them here: the
# quantity, then the column by its name and unit, or by its position and unit.
# [columns]
# time = "Clock [s]"
# force = "Channel 2 [N]"
# displacement = "#3 [mm]"

# Standard uncertainties (k = 1) of the test rig. Defaults are used for values not given here.
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
        One of them already exists. In this case nothing is written.
    """
    folder = Path(folder)
    texts = {folder / TOML: _TOML_TEXT, folder / TESTS: _TESTS_TEXT}
    there = [path for path in texts if path.exists()]
    if there or (folder.exists() and not folder.is_dir()):
        what = "this file or folder already exists and is not overwritten"
        raise CampaignError(Problem("exists", what, file=str(path)) for path in there or [folder])
    (folder / RAW).mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        write_new(path, text)
    return (*texts, folder / RAW)
