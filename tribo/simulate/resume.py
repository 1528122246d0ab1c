"""An ensemble that lands run by run in one HDF5 file and goes on where it was stopped.

The file is made whole before the first run: the design, and for every result a column without values yet.
A finished run then overwrites its own numbers at their known place in the file, its mark last. HDF5 itself never
opens the file for writing again, so that a process killed at any moment leaves a file every reader opens.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.simulate.config import SimConfig
from tribo.simulate.ensemble import Progress, check_all, run_row
from tribo.simulate.run import simulate
from tribo.simulate.store import attributes, versions, written

if TYPE_CHECKING:
    import pandas as pd

RESULTS = {
    "static_friction": "1", "sliding_friction": "1", "peak_s": "s", "first_failure_s": "s", "window_start_s": "s",
    "window_end_s": "s", "area_fraction": "1", "normal_load_N": "N",
}  # fmt: skip


def run_stored(
    design: Sequence[SimConfig],
    path: str | Path,
    jobs: int = 2,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Run what ``path`` does not hold yet of a design, and return all of it.

    Parameters
    ----------
    design : configurations, in any order that stays the same between starts
    path : the HDF5 file; made if absent, continued if it holds exactly this design
    jobs : threads on this machine
    scheduler : address of a dask.distributed scheduler; its workers then run the cells (optional dependency)
    progress : called with the runs done, earlier starts included, and their total

    Raises
    ------
    SimulationError
        An impossible configuration, a file of another design, or no dask where a scheduler is given.
    """
    path = Path(path)
    check_all(design)
    if not path.exists():
        _create(design, path)
    _refuse_other_design(design, path)
    missing = [k for k, done in enumerate(read_stored(path)["done"]) if not done]
    finished = len(design) - len(missing)
    if progress is not None:
        progress(finished, len(design))
    with _columns(path) as columns:
        for k, row in _rows(design, missing, jobs, scheduler):
            for name in RESULTS:
                columns[name][k] = row[name]
            columns["done"][k] = 1
            finished += 1
            if progress is not None:
                progress(finished, len(design))
    return read_stored(path)


def read_stored(path: str | Path) -> pd.DataFrame:
    """The table of a stored ensemble, finished or not; ``done`` tells which rows hold results."""
    import h5py
    import pandas as pd

    with h5py.File(path) as file:
        columns = {name: file[name][:] for name in ("sample", "pressure_Pa", "angle_deg", "seed", *RESULTS, "done")}
    columns["sample"] = [text.decode() for text in columns["sample"]]
    return pd.DataFrame(columns | {"done": columns["done"].astype(bool)})


def fingerprint(design: Iterable[SimConfig]) -> str:
    """Hash of every field of every configuration, in order."""
    digest = hashlib.sha256()
    for config in design:
        digest.update(repr(config).encode())
    return digest.hexdigest()


def _create(design: Sequence[SimConfig], path: Path) -> None:
    import h5py

    def write(target: Path) -> None:
        with h5py.File(target, "w") as file:
            file.attrs["title"] = "an ensemble of the spring-block model, one entry a run"
            file.attrs["design"] = fingerprint(design)
            shared = _shared_parameters(design)
            for name, value in (attributes(shared) | versions()).items():
                file.attrs[name] = value
            run = file.create_dataset("run", data=np.arange(len(design)))
            run.make_scale("run")
            text = np.array([c.sample for c in design], dtype=h5py.string_dtype())
            inputs: dict[str, Any] = {"sample": text}
            inputs |= {
                name: np.array([getattr(c, name) for c in design]) for name in ("pressure_Pa", "angle_deg", "seed")
            }
            empty = {name: np.full(len(design), np.nan) for name in RESULTS}
            for name, values in (inputs | empty | {"done": np.zeros(len(design), np.uint8)}).items():
                column = file.create_dataset(name, data=values)
                column.dims[0].attach_scale(run)
                column.attrs["units"] = {"pressure_Pa": "Pa", "angle_deg": "degree"}.get(name, RESULTS.get(name, "1"))

    written(path, write)


def _shared_parameters(design: Sequence[SimConfig]) -> dict[str, Any]:
    """The parameters all runs have in common."""
    all_parameters = [config.parameters() for config in design]
    first = all_parameters[0] if all_parameters else {}
    return {name: value for name, value in first.items() if all(p.get(name) == value for p in all_parameters)}


def _refuse_other_design(design: Sequence[SimConfig], path: Path) -> None:
    import h5py

    try:
        with h5py.File(path) as file:
            known = file.attrs.get("design")
    except OSError as why:
        raise SimulationError(Problem("not_a_store", f"cannot be read as HDF5: {why}", file=str(path))) from why
    if known != fingerprint(design):
        raise SimulationError(
            Problem(
                "other_design", "holds an ensemble of another design", file=str(path), allowed="a new file, or the same"
            )
        )


@contextmanager
def _columns(path: Path) -> Iterator[dict[str, Any]]:
    """The result columns of a store as arrays mapped into memory, writable in place."""
    import h5py

    with h5py.File(path) as file:
        places = {name: (file[name].id.get_offset(), file[name].shape, file[name].dtype) for name in (*RESULTS, "done")}
    columns = {
        name: np.memmap(path, dtype, "r+", offset, shape) for name, (offset, shape, dtype) in places.items()
    }
    try:
        yield columns
    finally:
        for column in columns.values():
            column.flush()


def cell(config: SimConfig) -> dict[str, Any]:
    """One run as the row of the table, for workers in other processes."""
    return run_row(simulate(config))


def _rows(
    design: Sequence[SimConfig], missing: Sequence[int], jobs: int, scheduler: str | None
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Results in the order they come in, each with its place in the design."""
    if scheduler is not None:
        yield from _distributed_rows(design, missing, scheduler)
        return
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        pending = {pool.submit(cell, design[k]): k for k in missing}
        try:
            for future in as_completed(pending):
                yield pending[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _distributed_rows(
    design: Sequence[SimConfig], missing: Sequence[int], scheduler: str
) -> Iterator[tuple[int, dict[str, Any]]]:
    try:
        distributed = import_module("distributed")
    except ImportError as why:
        raise SimulationError(
            Problem(
                "missing_package", "a scheduler needs dask.distributed", column="scheduler", found=scheduler,
                allowed="pip install distributed, or no scheduler",
            )
        ) from why
    with distributed.Client(scheduler) as client:
        futures = client.map(cell, [design[k] for k in missing], pure=False)
        place = {future.key: k for future, k in zip(futures, missing, strict=True)}
        for future, row in distributed.as_completed(futures, with_results=True):
            yield place[future.key], row
