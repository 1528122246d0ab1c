"""The one builder of test campaigns: rows and exports as given, or pulls of the virtual sled with their truth."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from support.sled import EXPORTERS, SledDesign, SledLaw, SledTribometer, write_campaign

FLAT_TOML = '[campaign]\ntitle = "{title}"\nnominal_area_mm2 = 55.0\n{more}\n[patterns.F]\ncavity = "none"\n'
SMALL_TOML = (
    '[campaign]\ntitle = "{title}"\nnominal_area_mm2 = 55.0\nslider_mass_g = 1.5\n'
    '[patterns.F]\ncavity = "none"\n'
    '[patterns.B]\ncavity = "circle"\ndiameter_um = 10.0\npitch_um = [15.0, 15.0]\n'
)
SMALL_LAWS = {"F": SledLaw(4.8, 23e3, 2.9, 12e3), "B": SledLaw(3.6, 10e3, 2.9, 6e3)}


def written(folder: Path, toml: str, rows: Sequence[str], exports: Mapping[str, str] | None = None) -> Path:
    """A campaign with these texts: ``rows`` are the lines of tests.csv with its header, ``exports`` texts by name."""
    (folder / "raw").mkdir(parents=True, exist_ok=True)
    (folder / "campaign.toml").write_text(toml, encoding="utf-8")
    (folder / "tests.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    for name, text in (exports or {}).items():
        (folder / "raw" / name).write_text(text, encoding="utf-8")
    return folder


def small(folder: Path, seed: int, samples: str = "FB", title: str = "", **design: object) -> Path:
    """Pulls of the virtual sled at two loads, by default once with each of two specimens of F and B."""
    laws = {s: SMALL_LAWS[s] for s in samples}
    chosen = SledDesign(laws, **{"masses_g": (25.0, 138.5), "specimens": 2, "repeats": 1, **design})  # type: ignore[arg-type]
    write_campaign(folder, chosen, SMALL_TOML.format(title=title or folder.name), seed=seed)
    return folder


def age(path: Path, seconds: float = 3600.0) -> None:
    """Let a file, or all files of a folder, have been written that long ago."""
    then = time.time() - seconds
    for file in [path, *path.rglob("*")]:
        os.utime(file, (then, then))


DIALECTS = ("bluehill", "testxpert", "testsuite", "delimited")
PATTERNS = """
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
LAWS = {
    "F": SledLaw(4.6, 21e3, 3.1, 11e3), "A": SledLaw(4.1, 17e3, 3.1, 10e3), "B": SledLaw(3.8, 11e3, 3.2, 7e3),
    "C": SledLaw(3.7, 9e3, 3.2, 6e3), "Sx": SledLaw(3.4, 11e3, 3.1, 8e3), "Sy": SledLaw(3.3, 10e3, 3.1, 8e3),
}  # fmt: skip
# 180 pulls of six samples: three specimens, five loads, two repeats
DESIGN = SledDesign(LAWS, masses_g=(5.0, 25.0, 50.0, 90.0, 138.5))


@dataclass(frozen=True)
class Recorded(SledTribometer):
    """The sled tribometer, with a record of the static and sliding force of every pull."""

    forces_N: list[tuple[float, float]] = field(default_factory=list)

    def pull(
        self, static_N: float, sliding_N: float, speed_m_s: float, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self.forces_N.append((static_N, sliding_N))
        return super().pull(static_N, sliding_N, speed_m_s, rng)


@dataclass(frozen=True)
class MadeCampaign:
    """A campaign on disk. ``truth`` holds static_N and sliding_N by test_id, ``laws`` the law of every sample."""

    folder: Path
    truth: pd.DataFrame
    laws: dict[str, SledLaw]


def as_testsuite(test_id: str, t: np.ndarray, travel: np.ndarray, force: np.ndarray) -> bytes:
    """MTS TestSuite: UTF-8 with a byte order mark, tabs, names and units in rows of their own."""
    head = f"Data Acquisition: {test_id} – (Timed)\nStation Name: sled\n\nTime \tCrosshead \tLoad \ns\tmm\tN\n"
    rows = (f"{a:.6f}\t{b:.8f}\t{c:.8f}\n" for a, b, c in zip(t, travel * 1e3, force, strict=True))
    return (head + "".join(rows)).encode("utf-8-sig")


def write_made(folder: Path, dialect: str, seed: int, design: SledDesign = DESIGN) -> MadeCampaign:
    """Write ``design`` in one of DIALECTS; the same seed gives the same bytes."""
    # no slow wander, and stick-slip that dies out soon: the sliding force is then the level that the pull was made with
    tribometer = Recorded(drift_share=0.0, stick_slip_share=0.02, stick_slip_decay_s=1.0)
    toml = f'[campaign]\ntitle = "made {seed}"\nnominal_area_mm2 = 55.0\nslider_mass_g = 1.5\n{PATTERNS}'
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(EXPORTERS, "testsuite", as_testsuite)
        write_campaign(folder, replace(design, tribometer=tribometer), toml, dialect=dialect, seed=seed)
    tests = pd.read_csv(folder / "tests.csv")
    truth = pd.DataFrame(tribometer.forces_N, columns=["static_N", "sliding_N"], index=tests["test_id"])
    return MadeCampaign(folder, truth, dict(design.laws))
