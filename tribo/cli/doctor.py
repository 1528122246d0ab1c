"""State of this installation: versions, cores, optional packages."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib import metadata
from typing import Any

OPTIONAL = {
    "distributed": "simulations on a dask cluster (--scheduler)",
    "snakemake": "building a folder of campaigns (tribo build)",
}


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def needed() -> list[str]:
    """The packages that tribo requires according to its metadata, without those of its extras."""
    asked = [line for line in metadata.requires("tribo") or [] if "extra ==" not in line]
    return [re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in asked]


def examine() -> dict[str, Any]:
    """Versions of required and optional packages; ``healthy`` is False if something required is missing."""
    from tribo import __version__
    from tribo.published import data_dir

    versions = {p: _version(p) for p in needed()}
    example = (data_dir() / "example" / "campaign.toml").is_file()
    return {
        "tribo": __version__,
        "python": platform.python_version(),
        "executable": sys.executable,
        "system": platform.platform(),
        "cores": os.cpu_count(),
        "needed": versions,
        "optional": {p: _version(p) for p in OPTIONAL},
        "bundled_example": example,
        "healthy": example and bool(versions) and all(versions.values()),
    }


def in_words(found: dict[str, Any]) -> str:
    """The result of :func:`examine` as lines of text."""
    lines = [f"tribo {found['tribo']}, Python {found['python']}, {found['cores']} cores, {found['system']}"]
    lines += [f"  {p:<20} {v or 'MISSING: pip install ' + p}" for p, v in found["needed"].items()]
    lines += [f"  {p:<20} {v or 'not installed; needed only for ' + OPTIONAL[p]}" for p, v in found["optional"].items()]
    lines.append(f"  {'bundled example':<20} {'found' if found['bundled_example'] else 'MISSING'}")
    return "\n".join(lines)
