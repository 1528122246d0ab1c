"""Fixtures for every test: where the practice data is, if it is there at all."""

from __future__ import annotations

import os
import pickle
import zipfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import settings
from on_the_command_line import run
from small_lattices import small_lattices
from support.campaigns import DESIGN, DIALECTS, MadeCampaign, small, write_made

from tribo.records import Ingested

SHARED = Path(__file__).resolve().parents[2] / "shared"

Once = Callable[[str, Callable[[Path], object]], Path]

# The same cases in every run; `make torture` draws others.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")


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


@pytest.fixture(scope="session")
def made(once: Once) -> Callable[[str], MadeCampaign]:
    """made("bluehill") -> a campaign of the virtual tribometer in that dialect, written once."""

    def write(folder: Path, dialect: str) -> None:
        written = write_made(folder / "campaign", dialect, seed=DIALECTS.index(dialect))
        written.truth.to_pickle(folder / "truth.pickle")

    def of(dialect: str) -> MadeCampaign:
        folder = once(f"made_{dialect}", lambda part: write(part, dialect))
        return MadeCampaign(folder / "campaign", pd.read_pickle(folder / "truth.pickle"), dict(DESIGN.laws))

    return of


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Once:
    """once(name, make) -> a folder that ``make`` filled, the same in every process of this run of the tests."""
    from tribo.own_folder import only_writer

    base = tmp_path_factory.getbasetemp()
    shared_by_all = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def made(name: str, make: Callable[[Path], object]) -> Path:
        folder = shared_by_all / name
        with only_writer(shared_by_all / f"{name}.lock", wait_s=600, lasting=True):
            if not folder.is_dir():
                part = folder.with_name(f"{name}.part")
                make(part)
                part.rename(folder)
        return folder

    return made


@pytest.fixture(scope="session")
def example(once: Once) -> Ingested:
    """The bundled example of 144 tests, read once."""
    import tribo

    return read_once(once, "example", lambda: tribo.data_dir() / "example")


@pytest.fixture(scope="session")
def read_made(once: Once, made: Callable[[str], MadeCampaign]) -> Callable[[str], Ingested]:
    """read_made("bluehill") -> a campaign of the virtual tribometer in that dialect, every export read, once."""
    return lru_cache(lambda dialect: read_once(once, f"read_{dialect}", lambda: made(dialect).folder))


def read_once(once: Once, name: str, campaign: Callable[[], Path]) -> Ingested:
    """What is read of a campaign, the same in every process of this run of the tests."""
    import tribo

    def read(folder: Path) -> None:
        folder.mkdir()
        ingested = tribo.ingest(tribo.load_campaign(campaign()))
        (folder / "ingested.pickle").write_bytes(pickle.dumps(ingested))

    found: Ingested = pickle.loads((once(name, read) / "ingested.pickle").read_bytes())
    return found


@pytest.fixture(scope="session")
def small_campaign(once: Once) -> Path:
    """A campaign of 24 pulls of the virtual tribometer: samples F and B, three specimens, two loads, two repeats."""
    made = once("small", lambda folder: small(folder / "campaign", 7, title="small", specimens=3, repeats=2))
    return made / "campaign"


@pytest.fixture(scope="session")
def eight_pulls(once: Once) -> Path:
    """A campaign of as few pulls as can be: samples F and B, two specimens, two loads."""
    return once("eight", lambda folder: small(folder / "campaign", 7, title="small")) / "campaign"


@pytest.fixture(scope="session")
def small_report(small_campaign: Path, once: Once) -> Path:
    """`tribo report` on the small campaign; what it said with --json lies beside its folder."""

    def report(folder: Path) -> None:
        with small_lattices():
            result = run("report", small_campaign, "-o", folder / "out", "--runs", 2, "--json", "--jobs", 1)
        assert result.exit_code == 0, result.output
        (folder / "said.json").write_text(result.stdout, encoding="utf-8")

    return once("small_report", report) / "out"


# The first compiles the engine; the second simulates nothing, so that only one process compiles.
LONG_FILES = (
    "design", "blind", "pipeline", "diagnose", "test_spoiled_campaigns", "faults", "test_docs", "cli", "springblock",
    "mistakes", "laboratories",
)  # fmt: skip


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that take long come first, so that no process is left alone with one of them at the end."""
    here = Path(__file__).parent

    def place(item: pytest.Item) -> int:
        name = item.path.relative_to(here).as_posix()
        return next((k for k, start in enumerate(LONG_FILES) if name.startswith(start)), len(LONG_FILES))

    items.sort(key=place)
