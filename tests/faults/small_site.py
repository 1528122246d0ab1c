"""The smallest campaign, design and folder of campaigns on which every command does all of its work."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass
from pathlib import Path

DESIGN_TOML = """samples = ["F", "B"]
pressures_kPa = [20.0]
repeats = 2
seed = 3
[parameters]
blocks = 10
"""


@dataclass(frozen=True)
class Place:
    """The folder of one bench: inputs, outputs and temporary files are all below it."""

    root: Path

    @property
    def campaign(self) -> Path:
        return self.root / "campaign"

    @property
    def drop(self) -> Path:
        return self.root / "drop"

    @property
    def design(self) -> Path:
        return self.root / "designs" / "runs.toml"

    @property
    def out(self) -> Path:
        return self.root / "out"

    @property
    def temporary(self) -> Path:
        return self.root / "tmp"

    @property
    def inputs(self) -> tuple[Path, ...]:
        """What no command may change."""
        return self.campaign, self.drop, self.design.parent


def write_inputs(root: Path) -> Place:
    """Campaign, folder of campaigns and design below ``root``; the same bytes every time."""
    from support.campaigns import small

    place = Place(root.resolve())
    small(place.campaign, 7, title="small", specimens=3)
    shutil.copytree(place.campaign, place.drop / "monday")
    place.design.parent.mkdir(parents=True)
    place.design.write_text(DESIGN_TOML, encoding="utf-8")
    place.temporary.mkdir()
    return place


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, or of the file itself, by place."""
    files = [folder] if folder.is_file() else sorted(p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder.parent)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}
