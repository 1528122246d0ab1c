"""What is shipped: the marker of types, the licence, and the same pinned versions with and without hashes."""

from __future__ import annotations

import re
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

HASHED = {"constraints-hashed.txt": ("cluster",), "constraints-hashed-pipelines.txt": ("cluster", "pipelines")}
ROOT = Path(__file__).resolve().parents[1]
PIN = re.compile(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)", re.MULTILINE)


def pins(name: str) -> dict[str, str]:
    text = (ROOT / name).read_text(encoding="utf-8")
    return {re.sub(r"[-_.]+", "-", package).lower(): version for package, version in PIN.findall(text)}


def test_the_package_is_marked_as_typed() -> None:
    assert files("tribo").joinpath("py.typed").is_file()


@pytest.mark.parametrize("name", HASHED)
def test_pins_with_hashes_are_the_pins_without(name: str) -> None:
    assert pins(name).items() <= pins("constraints.txt").items()


@pytest.mark.parametrize("name", HASHED)
def test_every_pin_with_hashes_has_one(name: str) -> None:
    blocks = re.split(r"\n(?=\S)", (ROOT / name).read_text(encoding="utf-8"))
    packages = [block for block in blocks if PIN.match(block)]
    assert len(packages) == len(pins(name))
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", block) for block in packages)


@pytest.mark.parametrize("name", HASHED)
def test_everything_tribo_needs_is_pinned_with_hashes(name: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    needed = [*project["dependencies"], *(word for extra in HASHED[name] for word in extras[extra])]
    names = {re.sub(r"[-_.]+", "-", re.split(r"[<>=\[]", word)[0]).lower() for word in needed}
    assert names <= set(pins(name))


def test_what_is_published_as_source_only_is_not_among_the_wheels() -> None:
    """connection-pool, which Snakemake needs, would make an installation of wheels alone fail."""
    assert "connection-pool" not in pins("constraints-hashed.txt")
    assert "connection-pool" in pins("constraints-hashed-pipelines.txt")


def test_pythons_3_11_to_3_13_are_named() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = {c.rpartition(":: ")[2] for c in project["classifiers"] if re.search(r":: 3\.\d+$", c)}
    assert named == {"3.11", "3.12", "3.13"}
    assert project["requires-python"] == ">=3.11"
