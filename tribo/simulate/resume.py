"""An ensemble stored run by run in one HDF5 file, continued where it was stopped.

The file is made whole before the first run: the design, and for every result a column without values yet.
A finished run then overwrites its own numbers at their known place in the file, its mark last. HDF5 itself never
opens the file for writing again, so that a process killed at any moment leaves a file every reader opens.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.records import Run
from tribo.simulate.config import SimConfig
from tribo.simulate.ensemble import Progress, check_all, run_row
from tribo.simulate.results_file import attributes, unit_of, versions
from tribo.simulate.run import simulate
from tribo.store.hdf5_files import whole_hdf5

if TYPE_CHECKING:
    import pandas as pd

RESULTS = {
    "static_friction": "1", "sliding_friction": "1", "peak_s": "s", "first_failure_s": "s", "window_start_s": "s",
    "window_end_s": "s", "area_fraction": "1", "normal_load_N": "N",
}  # fmt: skip
INPUTS = {"sample": "1", "pressure_Pa": "Pa", "angle_deg": "degree", "seed": "1"}
OF_THE_SAMPLE = {"pattern", "cavity", "cavity_size_m", "cavity_pitch_m", "cavity_staggered"}
SCHEDULER_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class Work:
    """What is done for every configuration of a store. The functions are sent to workers in other processes.

    Parameters
    ----------
    run : makes the run; :func:`tribo.simulate.simulate` by default
    read : numbers by name, read off the run
    units : names of the numbers that are kept, with their units
    label : tells this work from another that keeps the same names
    """

    run: Callable[[SimConfig], Run] | None = None
    read: Callable[[Run], Mapping[str, Any]] = run_row
    units: Mapping[str, str] = field(default_factory=lambda: RESULTS)
    label: str = ""


FRICTION = Work()


def run_stored(
    design: Sequence[SimConfig],
    path: str | Path,
    jobs: int = 2,
    scheduler: str | None = None,
    progress: Progress | None = None,
    work: Work = FRICTION,
) -> pd.DataFrame:
    """Compute the runs of a design that ``path`` does not hold yet, and return all of them.

    Parameters
    ----------
    design : configurations, in any order that stays the same between starts
    path : the HDF5 file; made if absent, continued if it holds exactly this design
    jobs : threads on this machine
    scheduler : address of a dask.distributed scheduler; its workers then run the cells (optional dependency)
    progress : called with the runs done, earlier starts included, and their total
    work : how a run is made and what is kept of it, static and sliding friction with their times by default

    Raises
    ------
    SimulationError
        An impossible configuration, a file of another design, or no dask or no scheduler where one is given.
    """
    path = Path(path)
    check_all(design)
    if not path.exists():
        _create(design, path, work)
    _refuse_other_design(design, path, work)
    missing = [k for k, done in enumerate(read_stored(path)["done"]) if not done]
    finished = len(design) - len(missing)
    if progress is not None:
        progress(finished, len(design))
    with _columns(path, work) as columns:
        for k, row in _rows(design, missing, jobs, scheduler, partial(cell, work=work)):
            for name in work.units:
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
        columns = {name: file[name][:] for name in file.attrs["columns"]}
    texts = {name: [t.decode() for t in column] for name, column in columns.items() if column.dtype == object}
    return pd.DataFrame(columns | texts | {"done": columns["done"].astype(bool)})


def varied_columns(table: pd.DataFrame) -> list[str]:
    """The columns of a stored ensemble that hold parameters the design varies beside its inputs."""
    return [str(name) for name in table.columns if name not in {*INPUTS, *RESULTS, "done"}]


def fingerprint(design: Iterable[SimConfig], work: Work = FRICTION) -> str:
    """Hash of every field of every configuration, in order, and of what is done with them."""
    digest = hashlib.sha256(repr((list(work.units), work.label)).encode())
    for config in design:
        digest.update(repr(config).encode())
    return digest.hexdigest()


def continues(design: Sequence[SimConfig], path: str | Path, work: Work = FRICTION) -> bool:
    """Whether ``path`` is a store of exactly these runs, finished or not."""
    try:
        _refuse_other_design(design, Path(path), work)
    except SimulationError:
        return False
    return True


def _create(design: Sequence[SimConfig], path: Path, work: Work) -> None:
    import h5py

    given: dict[str, Any] = {name: [getattr(c, name) for c in design] for name in INPUTS} | _varied_parameters(design)
    empty = dict.fromkeys(work.units, np.full(len(design), np.nan))
    columns = given | empty | {"done": np.zeros(len(design), np.uint8)}

    with whole_hdf5(path) as held, h5py.File(held, "w") as file:
        file.attrs["title"] = "an ensemble of the spring-block model, one entry per run"
        file.attrs["design"] = fingerprint(design, work)
        file.attrs["columns"] = list(columns)
        for name, value in (attributes(_shared_parameters(design)) | versions()).items():
            file.attrs[name] = value
        run = file.create_dataset("run", data=np.arange(len(design)))
        run.make_scale("run")
        for name, values in columns.items():
            column = file.create_dataset(name, data=_as_stored(values))
            column.dims[0].attach_scale(run)
            column.attrs["units"] = {**INPUTS, **work.units}.get(name) or unit_of(name)


def _as_stored(values: Any) -> Any:
    """Numbers as they are; everything else as text."""
    import h5py

    array = np.array(values) if all(np.isscalar(v) for v in values) else np.array([str(v) for v in values])
    return array.astype(h5py.string_dtype()) if array.dtype.kind == "U" else array


def _varied_parameters(design: Sequence[SimConfig]) -> dict[str, Any]:
    """The parameters, beside the inputs, that differ between runs; those that follow from the sample are left out."""
    all_parameters = [config.parameters() for config in design]
    names = {name: None for parameters in all_parameters for name in parameters}
    shared = _shared_parameters(design)
    return {
        name: [p.get(name, "") for p in all_parameters]
        for name in names
        if name not in shared and name not in INPUTS and name not in OF_THE_SAMPLE
    }


def _shared_parameters(design: Sequence[SimConfig]) -> dict[str, Any]:
    """The parameters all runs have in common."""
    all_parameters = [config.parameters() for config in design]
    first = all_parameters[0] if all_parameters else {}
    return {name: value for name, value in first.items() if all(p.get(name) == value for p in all_parameters)}


def _refuse_other_design(design: Sequence[SimConfig], path: Path, work: Work) -> None:
    import h5py

    try:
        with h5py.File(path) as file:
            known = file.attrs.get("design")
    except OSError as why:
        raise SimulationError(Problem("not_a_store", f"cannot be read as HDF5: {why}", file=str(path))) from why
    if known != fingerprint(design, work):
        raise SimulationError(
            Problem(
                "other_design", "it holds runs of a different design", file=str(path), allowed="a new file, or the same"
            )
        )


@contextmanager
def _columns(path: Path, work: Work) -> Iterator[dict[str, Any]]:
    """The result columns of a store as arrays mapped into memory, writable in place."""
    import h5py

    names = (*work.units, "done")
    with h5py.File(path) as file:
        places = {name: (file[name].id.get_offset(), file[name].shape, file[name].dtype) for name in names}
    columns = {
        name: np.memmap(path, dtype, "r+", offset, shape) for name, (offset, shape, dtype) in places.items()
    }
    try:
        yield columns
    finally:
        for column in columns.values():
            column.flush()


def cell(config: SimConfig, work: Work) -> Mapping[str, Any]:
    """One run as the row of the table, for workers in other processes."""
    return work.read((work.run or simulate)(config))


def _rows(
    design: Sequence[SimConfig],
    missing: Sequence[int],
    jobs: int,
    scheduler: str | None,
    one: Callable[[SimConfig], Mapping[str, Any]],
) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Results in the order they come in, each with its place in the design."""
    if scheduler is not None:
        yield from _distributed_rows(design, missing, scheduler, one)
        return
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        pending = {pool.submit(one, design[k]): k for k in missing}
        try:
            for future in as_completed(pending):
                yield pending[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _distributed_rows(
    design: Sequence[SimConfig],
    missing: Sequence[int],
    scheduler: str,
    one: Callable[[SimConfig], Mapping[str, Any]],
) -> Iterator[tuple[int, Mapping[str, Any]]]:
    with _client(scheduler) as (client, as_done):
        futures = client.map(one, [design[k] for k in missing], pure=False)
        place = {future.key: k for future, k in zip(futures, missing, strict=True)}
        try:
            for future, row in as_done(futures, with_results=True):
                yield place[future.key], row
        except (OSError, asyncio.CancelledError, concurrent.futures.CancelledError) as why:
            what = "the dask scheduler stopped answering; finished runs are kept and the next start continues"
            reason = str(why) or type(why).__name__
            raise SimulationError(Problem("scheduler_gone", what, column="scheduler", found=reason[:200])) from why


@contextmanager
def _client(scheduler: str) -> Iterator[tuple[Any, Any]]:
    """A client of the scheduler at this address, and the function that yields its futures as they are done."""
    try:
        distributed = import_module("distributed")
    except ImportError as why:
        raise SimulationError(
            Problem(
                "missing_package", "a scheduler requires dask.distributed", column="scheduler", found=scheduler,
                allowed="pip install distributed, or no scheduler",
            )
        ) from why
    try:
        client = distributed.Client(scheduler, timeout=SCHEDULER_TIMEOUT_S)
    except (OSError, ValueError) as why:
        raise SimulationError(
            Problem(
                "no_scheduler", f"no dask scheduler answers here: {why}", column="scheduler", found=scheduler,
                allowed="the address printed by a running dask scheduler, such as tcp://HOST:8786",
            )
        ) from why
    with client:
        yield client, distributed.as_completed
