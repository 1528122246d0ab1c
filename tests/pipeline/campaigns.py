"""Small campaigns in a drop folder, as a lab would leave them there."""

from __future__ import annotations

import os
import time
from pathlib import Path

from support.sled import SledDesign, SledLaw, write_campaign

TOML = (
    '[campaign]\ntitle = "{title}"\nnominal_area_mm2 = 55.0\nslider_mass_g = 1.5\n'
    '[patterns.F]\ncavity = "none"\n'
    '[patterns.B]\ncavity = "circle"\ndiameter_um = 10.0\npitch_um = [15.0, 15.0]\n'
)
LAWS = {"F": SledLaw(4.8, 23e3, 2.9, 12e3), "B": SledLaw(3.6, 10e3, 2.9, 6e3)}


def small(folder: Path, seed: int, samples: str = "FB", **design: object) -> Path:
    """Four pulls of each sample: two specimens, two loads."""
    laws = {s: LAWS[s] for s in samples}
    chosen = {"masses_g": (25.0, 138.5), "specimens": 2, "repeats": 1, **design}
    write_campaign(folder, SledDesign(laws, **chosen), TOML.format(title=folder.name), seed=seed)  # type: ignore[arg-type]
    return folder


def age(path: Path, seconds: float = 3600.0) -> None:
    """Let a file, or all files of a folder, have been written that long ago."""
    then = time.time() - seconds
    for file in [path, *path.rglob("*")]:
        os.utime(file, (then, then))
