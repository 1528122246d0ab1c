"""Fixtures for every test: where the practice data is, if it is there at all."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference material beside the checkout; tests that need it skip where it is absent."""
    if not SHARED.is_dir():
        pytest.skip("the shared reference material is not beside this checkout")
    return SHARED


@pytest.fixture(scope="session")
def practice(shared: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """practice("01") -> folder of the unzipped practice campaign series-01."""
    base = tmp_path_factory.mktemp("practice")

    def unzip(number: str) -> Path:
        archive = shared / "campaigns" / f"series-{number}.zip"
        if not archive.is_file():
            pytest.skip(f"no practice campaign {archive.name}")
        folder = base / number
        if not folder.is_dir():
            with zipfile.ZipFile(archive) as z:
                z.extractall(folder)
        return next(folder.rglob("campaign.toml")).parent

    return unzip
