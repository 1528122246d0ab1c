"""Where a result comes from: command, versions, seed, options, and the hash of every input."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from tribo.records import Study
from tribo.report.files import write_text

PACKAGES = (
    "tribo",
    "numpy",
    "scipy",
    "pandas",
    "matplotlib",
    "xarray",
    "h5netcdf",
    "h5py",
    "numba",
    "statsmodels",
)


@dataclass(frozen=True)
class Provenance:
    """How a report was made. ``inputs`` maps each input file (relative to the campaign) to its SHA-256."""

    command: str = ""
    started_at: str = ""
    seed: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def inputs_digest(self) -> str:
        """One SHA-256 over the names and hashes of all inputs."""
        listing = "".join(f"{digest}  {name}\n" for name, digest in sorted(self.inputs.items()))
        return sha256(listing.encode()).hexdigest()


def gather_provenance(
    study: Study,
    command: str = "",
    seed: int | None = None,
    started_at: str = "",
    options: Mapping[str, Any] | None = None,
) -> Provenance:
    """Versions of what computes, and hashes of campaign.toml, tests.csv and every export that exists."""
    campaign = study.ingested.campaign
    names = dict.fromkeys(["campaign.toml", "tests.csv", *(test.file for test in campaign.tests)])
    inputs = {name: _hash(campaign.root / name) for name in names if (campaign.root / name).is_file()}
    return Provenance(command, started_at, seed, dict(options or {}), _versions(), inputs)


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def _hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()


def write_provenance(provenance: Provenance, out: Path) -> Path:
    """Write out/provenance.json."""
    record = {**asdict(provenance), "inputs_sha256": provenance.inputs_digest}
    return write_text(out / "provenance.json", json.dumps(record, indent=1, ensure_ascii=False, default=str) + "\n")
