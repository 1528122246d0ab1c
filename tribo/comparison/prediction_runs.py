"""The runs of a prediction, in cells of one sample at one pressure, each kept in a file of its own.

A cell's file is named after everything its runs are made from, sources included: a file that is there is valid, and
one finished run is never computed twice. Cells can be run by different processes, or machines, at once.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from tribo.errors import SimulationError, failed_by_system, naming
from tribo.file_contents import found_in
from tribo.records import Pattern, Run
from tribo.store.kept_results import DamagedResultWarning, Shelf, sources

if TYPE_CHECKING:
    import pandas as pd

    from tribo.simulate import SimConfig

SOURCES = ("simulate", "laws", "records")  # packages whose sources decide a run
SUFFIX = ".nc"
WAIT_S = 86400.0  # for another process that runs the same cell: its runs are then there
CELLS_AWAY = 16  # cells given to a scheduler at once


@dataclass(frozen=True)
class ModelRuns:
    """How the model is run for a campaign.

    ``runs`` simulations per sample and load, at stratified pull angles with random local friction from ``seed``,
    ``jobs`` at a time or on the workers of a dask scheduler at the address ``scheduler``. The folder ``kept`` holds the
    calibration and every finished run; results made from other inputs are not used.
    """

    runs: int = 4
    seed: int = 0
    jobs: int = 2
    kept: Path | None = None
    scheduler: str | None = None


@dataclass(frozen=True)
class Cell:
    """The runs of one sample at one nominal pressure."""

    sample: str
    pressure_Pa: float
    configs: tuple[SimConfig, ...]

    @property
    def name(self) -> str:
        """Sample and pressure, fit for a file name: "Sx@18180Pa"."""
        return cell_name(self.sample, self.pressure_Pa)

    def path(self, kept: Path) -> Path:
        """Where the results of exactly these runs are kept."""
        made_from = "\n".join([sources(*SOURCES), *map(repr, self.configs)])
        return kept / f"{self.name}-{hashlib.sha256(made_from.encode()).hexdigest()[:16]}{SUFFIX}"


def cell_name(sample: str, pressure_Pa: float) -> str:
    """Sample and nominal pressure as one word without a space or a slash."""
    return f"{sample_as_word(sample)}@{pressure_Pa:.0f}Pa"


def sample_as_word(sample: str) -> str:
    """The name of a sample as part of a file name and of a step of a build."""
    return quote(sample, safe="")


def cells_of(design: Iterable[SimConfig]) -> tuple[Cell, ...]:
    """A design by sample and pressure, in its own order."""
    found: dict[tuple[str, float], list[SimConfig]] = {}
    for config in design:
        found.setdefault((config.sample, config.pressure_Pa), []).append(config)
    return tuple(Cell(sample, pressure, tuple(configs)) for (sample, pressure), configs in found.items())


def run_cells(
    cells: Sequence[Cell],
    kept: Path | None = None,
    jobs: int = 2,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> pd.DataFrame:
    """All runs of the cells as one table, one row per run; those that ``kept`` holds are taken from there.

    Raises
    ------
    SimulationError
        An impossible configuration, or no dask where a scheduler is given.
    """
    import pandas as pd

    from tribo.simulate import run_ensemble

    total = sum(len(cell.configs) for cell in cells)
    if kept is None:
        return run_ensemble([config for cell in cells for config in cell.configs], jobs, progress)
    done_of = {cell.name: 0 for cell in cells}
    progress(0, total)

    def run(cell: Cell) -> pd.DataFrame:
        def count(done: int, _: int) -> None:
            done_of[cell.name] = done
            progress(sum(done_of.values()), total)

        return _run_stored(cell, kept, threads, scheduler, count)

    at_once = max(1, jobs // max(1, min(len(cell.configs) for cell in cells)))
    threads = -(-jobs // at_once)
    if scheduler is not None:  # the work is elsewhere: keep its workers busy
        at_once = CELLS_AWAY
    if at_once == 1:
        tables = [run(cell) for cell in cells]
    else:
        with ThreadPoolExecutor(at_once) as pool:
            tables = list(pool.map(run, cells))
    return pd.concat(tables, ignore_index=True)


def _run_stored(
    cell: Cell, kept: Path, threads: int, scheduler: str | None, progress: Callable[[int, int], None]
) -> pd.DataFrame:
    """The runs of one cell, from its file as far as it holds them; one that is damaged or unreadable is replaced."""
    from tribo.simulate.resume import fault_of, read_stored, run_stored

    path = cell.path(kept)
    kept.mkdir(parents=True, exist_ok=True)
    if path.exists():
        if (fault := fault_of(cell.configs, path)) is not None:
            warnings.warn(f"{path}: {fault.what}; these simulations are made again", DamagedResultWarning, stacklevel=2)
            path.unlink(missing_ok=True)
        elif (table := read_stored(path))["done"].all():  # finished: nothing to wait for or to check once more
            progress(len(table), len(table))
            return table
    return run_stored(cell.configs, path, threads, scheduler, progress, wait_s=WAIT_S)


def kept_runs(kept: Path, patterns: Mapping[str, Pattern]) -> pd.DataFrame | None:
    """Finished runs of the baseline in ``kept`` that the current sources would reproduce, one row per run, or None.

    A file counts where its name is the one that its own runs would be given.

    Raises
    ------
    OSError
        A file is there and cannot be read.
    """
    import pandas as pd

    from tribo.simulate import read_stored
    from tribo.simulate.stored_rows import UNREADABLE

    found = []
    for path in found_in(kept, f"*@*{SUFFIX}"):
        try:
            table = read_stored(path)
            cell = _cell_of(path, table, patterns)
        except (SimulationError, *UNREADABLE) as why:
            cause = why.__cause__ or why
            if failed_by_system(cause):  # the runs may be whole, and without them the result would be another one
                with naming(path):
                    raise cause from None
            warnings.warn(f"{path}: these simulations are not used: {why}", DamagedResultWarning, stacklevel=2)
            continue
        if cell is not None and cell.path(kept) == path and table["done"].all():
            found.append(table)
    return pd.concat(found, ignore_index=True) if found else None


def _cell_of(path: Path, table: pd.DataFrame, patterns: Mapping[str, Pattern]) -> Cell | None:
    """The cell that a kept file says it holds, its runs those of the baseline with the file's local friction."""
    import h5py

    from tribo.simulate import LocalFriction, SimConfig

    sample = str(table["sample"].iloc[0])
    if sample not in patterns:
        return None
    with h5py.File(path) as file:
        friction = LocalFriction(**{f.name: float(file.attrs[f"friction_{f.name}"]) for f in fields(LocalFriction)})
    configs = tuple(
        SimConfig(
            sample=sample, pattern=patterns[sample], pressure_Pa=float(row["pressure_Pa"]),
            angle_deg=float(row["angle_deg"]), seed=int(row["seed"]), friction=friction,
        )
        for row in table.to_dict("records")
    )  # fmt: skip
    return Cell(sample, configs[0].pressure_Pa, configs)


def example_run(cells: Sequence[Cell], kept: Path | None = None) -> Run:
    """One run of a sample with its whole force trace, at a middle load and a middle angle."""
    from tribo.simulate import simulate

    config = example_config(cells)
    name = f"example-{quote(config.sample, safe='')}"
    return Shelf(kept).take(name, config, lambda: simulate(config), SOURCES)


def example_config(cells: Sequence[Cell]) -> SimConfig:
    """The middle one of all runs of the cells."""
    configs = [config for cell in cells for config in cell.configs]
    return configs[len(configs) // 2]


def remove_strangers(cells: Iterable[Cell], kept: Path) -> None:
    """Delete kept runs that belong to none of the cells: other samples, loads, laws or sources."""
    ours = {cell.path(kept) for cell in cells}
    for path in found_in(kept, f"*@*{SUFFIX}"):
        if path not in ours:
            path.unlink(missing_ok=True)
