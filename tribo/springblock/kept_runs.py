"""Runs and ensembles as HDF5 files that xarray and plain h5py read, and the files of an ensemble that goes on.

A file is always written whole: every :data:`WRITE_EVERY_S` while its runs are made, and once more when they end or are
interrupted. It bears a checksum of all it holds, the signature of the user who made it, and the hashes of its design
and of the sources that made it.
"""

from __future__ import annotations

import hashlib
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo import outputs
from tribo.display import exact_text
from tribo.errors import Problem, SimulationError, failed_by_system
from tribo.files import DamagedFileError, intact_hdf5, whole_hdf5
from tribo.kept_results import FOREIGN, DamagedResultWarning, signature, sources
from tribo.own_folder import only_writer_of
from tribo.records import Run
from tribo.springblock.config import SimConfig
from tribo.springblock.ensemble import FRICTION, RESULTS, Progress, Work, check_all, finished_runs

if TYPE_CHECKING:
    import pandas as pd


ONE_RUN = "one run of the spring-block model"
ENSEMBLE = "an ensemble of the spring-block model"
Column = tuple[Any, Mapping[str, str]]  # values along the dimension, attributes


def unit_of(name: str) -> str:
    """Unit that ends a parameter's name ("dt_s" -> "s"), "1" where it has none."""
    return outputs.unit_of(name) or "1"


def versions() -> dict[str, str]:
    """Versions of what decides the numbers of a run."""
    found = {}
    for package in ("tribo", "numba", "numpy", "scipy"):
        try:
            found[f"version_{package}"] = version(package)
        except PackageNotFoundError:
            found[f"version_{package}"] = "unknown"
    return found


def plain(value: Any) -> Any:
    """A value as an HDF5 attribute: booleans as 0 or 1, sequences as arrays, nothing as an empty text."""
    if value is None:
        return ""
    if isinstance(value, bool | np.bool_):
        return int(value)
    if isinstance(value, list | tuple):
        return np.asarray(value)
    return value


def attributes(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Every parameter as an attribute, with ``NAME_unit`` beside each number."""
    found: dict[str, Any] = {}
    for name, value in parameters.items():
        found[name] = plain(value)
        if isinstance(value, int | float | tuple | list) and not isinstance(value, bool):
            found[f"{name}_unit"] = unit_of(name)
    return found


def write_run(run: Run, path: str | Path) -> Path:
    """Write one run: ``time`` (s), ``force`` (N), ``moving``, and every parameter as an attribute."""
    columns: dict[str, Column] = {
        "time": (run.time_s, {"units": "s"}),
        "force": (run.force_N, {"units": "N", "long_name": "slider force along the pull"}),
        "moving": (run.moving, {"units": "1", "long_name": "number of moving contact blocks"}),
    }
    about = {
        "title": ONE_RUN,
        "sample": run.sample,
        "static_friction": run.static_friction,
        "sliding_friction": run.sliding_friction,
        "static_friction_unit": "1",
        "sliding_friction_unit": "1",
        "window": np.asarray(run.window_s),
        "window_unit": "s",
        "peak_s": run.peak_s,
        "normal_load_N": run.normal_load_N,
        "engine": run.engine,
        **attributes(run.parameters),
    }
    return write_columns(Path(path), "time", columns, about)


def write_ensemble(table: pd.DataFrame, path: str | Path, parameters: Mapping[str, Any] | None = None) -> Path:
    """Write the table of an ensemble: one variable per column, one entry per run."""
    columns: dict[str, Column] = {"run": (np.arange(len(table)), {"units": "1"})}
    columns |= {name: (table[name].to_numpy(), {"units": unit_of(name)}) for name in map(str, table.columns)}
    return write_columns(Path(path), "run", columns, {"title": ENSEMBLE, **attributes(parameters or {})})


def write_columns(
    path: Path, dimension: str, columns: Mapping[str, Column], about: Mapping[str, Any], *, signed: bool = False
) -> Path:
    """Columns of equal length along one of them, with a checksum of all. xarray would take a second to import.

    Where it is ``signed``, the checksum has the signature of this user as well.
    """
    import h5py

    with whole_hdf5(path) as held, h5py.File(held, "w") as file:
        for name, value in {**about, **versions()}.items():
            file.attrs[name] = value
        for name, (values, attrs) in columns.items():
            text = values.dtype.kind in "OUT"
            column = file.create_dataset(name, data=values.astype(str).astype(object) if text else values)
            column.attrs.update(attrs)
            if name == dimension:
                column.make_scale(name)
            else:
                column.dims[0].attach_scale(file[dimension])
        file.attrs["checksum"] = checksum_of(file)
        if signed:
            file.attrs["signed"] = signature(str(file.attrs["checksum"]).encode())
    return path


def checksum_of(file: Any) -> str:
    """SHA-256 of every attribute and column of an open file, the checksum itself and its signature left out."""
    digest = hashlib.sha256()
    for name in sorted(set(file.attrs) - {"checksum", "signed"}):
        digest.update(f"{name} {np.asarray(file.attrs[name]).tolist()!r}\n".encode())
    for name in sorted(file):
        values = file[name][:]
        content = repr(values.tolist()).encode() if values.dtype.kind == "O" else values.tobytes()
        digest.update(f"{name} {values.dtype} {file[name].attrs['units']}\n".encode() + content)
    return digest.hexdigest()


def kind_of(path: Path) -> str:
    """What a file of results holds, one run or an ensemble in the words of its title; empty for any other file."""
    import h5py

    try:
        with h5py.File(intact_hdf5(path)) as file:
            title = str(file.attrs.get("title", ""))
    except (OSError, ValueError, KeyError) as why:
        if failed_by_system(why):
            raise
        return ""
    return next((kind for kind in (ONE_RUN, ENSEMBLE) if title.startswith(kind)), "")


INPUTS = {"sample": "1", "pressure_Pa": "Pa", "angle_deg": "degree", "seed": "1"}
OF_THE_SAMPLE = {"pattern", "cavity", "cavity_size_m", "cavity_pitch_m", "cavity_staggered"}
OF_THE_SAMPLE |= {"feature", "pattern_lattice", "picture"}
DONE = "done"
WRITE_EVERY_S = 2.0
UNREADABLE = (OSError, KeyError, ValueError, TypeError, RuntimeError, MemoryError, AttributeError, IndexError)


def run_stored(
    design: Sequence[SimConfig],
    path: str | Path,
    jobs: int = 2,
    scheduler: str | None = None,
    progress: Progress | None = None,
    work: Work = FRICTION,
    wait_s: float = 0.0,
) -> pd.DataFrame:
    """Compute the runs of a design that ``path`` does not hold yet, and return all of them.

    One process at a time writes the file. Where it is damaged, all runs are computed again, and a warning says so.

    Parameters
    ----------
    design
        Configurations, in any order that stays the same between starts.
    path
        The HDF5 file; made if absent, continued if it holds exactly this design.
    jobs
        Threads on this machine.
    scheduler
        Address of a dask.distributed scheduler; its workers then make the runs (optional dependency).
    progress
        Called with the runs done, earlier starts included, and their total.
    work
        How a run is made and what is kept of it, static and sliding friction with their times by default.
    wait_s
        How long to wait for another process that writes the file, in s.

    Returns
    -------
    DataFrame
        One row per run: sample, pressure_Pa, angle_deg, seed, what varies in the design, what is kept of a run, done.

    Raises
    ------
    SimulationError
        An impossible configuration, a file of another design or version, or no dask or no scheduler where one is given.
    BusyError
        Another process writes the file.
    """
    return run_all_stored([(design, Path(path))], jobs, scheduler, progress, work, wait_s)[0]


def run_all_stored(
    stores: Sequence[tuple[Sequence[SimConfig], Path]],
    jobs: int = 2,
    scheduler: str | None = None,
    progress: Progress | None = None,
    work: Work = FRICTION,
    wait_s: float = 0.0,
) -> list[pd.DataFrame]:
    """As :func:`run_stored`, for several designs in files of their own, whose runs are made side by side."""
    check_all(config for design, _ in stores for config in design)
    with ExitStack() as held:
        rows = {path: _rows_of(design, path, work) for design, path in stores}
        for design, path in sorted(stores, key=lambda store: store[1]):  # so that no two processes wait for each other
            if len(rows[path]) < len(design):
                held.enter_context(only_writer_of(path, wait_s))
                rows[path] = _rows_of(design, path, work)  # another process may have made them meanwhile
        missing = [(path, k) for design, path in stores for k in range(len(design)) if k not in rows[path]]
        finished, total = sum(map(len, rows.values())), sum(len(design) for design, _ in stores)
        if progress is not None:
            progress(finished, total)
        designs = {path: design for design, path in stores}
        written = dict.fromkeys(designs, time.monotonic())
        unwritten: set[Path] = set()
        try:
            for place, row in finished_runs([designs[path][k] for path, k in missing], jobs, scheduler, work):
                path, k = missing[place]
                rows[path][k] = row
                unwritten.add(path)
                if len(rows[path]) == len(designs[path]) or time.monotonic() >= written[path] + WRITE_EVERY_S:
                    _write(designs[path], path, work, rows[path])
                    written[path] = time.monotonic()
                    unwritten.remove(path)
                finished += 1
                if progress is not None:
                    progress(finished, total)
        finally:
            for path in unwritten:
                _write(designs[path], path, work, rows[path])
        return [read_stored(path) for _, path in stores]


def _rows_of(design: Sequence[SimConfig], path: Path, work: Work) -> dict[int, Mapping[str, Any]]:
    """The results that a file of these runs holds, by place; none where it is absent or damaged."""
    fault = fault_of(design, path, work) if path.exists() else None
    if fault is not None and fault.kind != "damaged_store":
        raise SimulationError(fault)
    if fault is not None:
        warnings.warn(f"{path}: the file is damaged; all runs are computed again", DamagedResultWarning, stacklevel=3)
    if fault is not None or not path.exists():
        return {}
    table = read_stored(path)
    rows: list[dict[str, Any]] = table[list(work.units)].to_dict("records")  # type: ignore[assignment]
    return {int(k): rows[k] for k in np.flatnonzero(table[DONE])}


def read_stored(path: str | Path) -> pd.DataFrame:
    """The table of a stored ensemble, finished or not.

    ``done`` tells which rows hold results; the results of the others are NaN.

    Raises
    ------
    SimulationError
        This is no stored ensemble, or it differs from its checksum.
    """
    import h5py
    import pandas as pd

    path = Path(path)
    try:
        with h5py.File(intact_hdf5(path)) as file:
            intact = file.attrs["checksum"] == checksum_of(file)
            columns = {str(name): file[name][:] for name in file.attrs["columns"]}
        texts = {name: np.array([t.decode() for t in c], object) for name, c in columns.items() if c.dtype == object}
    except DamagedFileError:
        intact = False
    except UNREADABLE as why:
        raise SimulationError(_no_store(path, why)) from why
    if not intact:
        raise SimulationError(Problem("damaged_store", "it differs from its checksum", file=str(path)))
    return pd.DataFrame({**columns, **texts, DONE: columns[DONE].astype(bool)})


def _no_store(path: Path, why: BaseException) -> Problem:
    what = f"cannot be read as HDF5 with runs and their checksum: {why}"
    return Problem("not_a_store", what, file=str(path), allowed="a new file, or --force to replace this one")


def fault_of(design: Sequence[SimConfig], path: Path, work: Work = FRICTION) -> Problem | None:
    """Why ``path`` is no intact file of exactly these runs, finished or not; None where it is."""
    import h5py

    place, allowed = str(path), "a new file, or --force to replace this one"
    try:
        with h5py.File(intact_hdf5(path)) as file:
            made_from = file.attrs["design"], file.attrs["sources"]
            checksum, signed = (str(file.attrs.get(name, "")) for name in ("checksum", "signed"))
            intact = checksum == checksum_of(file)
    except DamagedFileError:
        return Problem("damaged_store", "it differs from its checksum", file=place)
    except UNREADABLE as why:
        if failed_by_system(why) and path.is_file():  # the runs may be whole
            raise
        return _no_store(path, why)
    if made_from[0] != fingerprint(design, work):
        return Problem("other_design", "it holds runs of a different design", file=place, allowed=allowed)
    if made_from[1] != sources(*work.rooms):
        what = "it holds runs of another version of tribo or of its libraries, and is not continued"
        return Problem("other_version", what, file=place, allowed=allowed)
    if not intact:
        return Problem("damaged_store", "it differs from its checksum", file=place)
    if signature(checksum.encode()) != signed:
        return Problem("foreign_store", f"it {FOREIGN}", place, allowed=allowed)
    return None


def fingerprint(design: Iterable[SimConfig], work: Work = FRICTION) -> str:
    """Hash of every field of every configuration, in order, and of what is done with them."""
    digest = hashlib.sha256(repr((list(work.units), work.label)).encode())
    for config in design:
        digest.update(exact_text(config).encode())
    return digest.hexdigest()


def _write(design: Sequence[SimConfig], path: Path, work: Work, rows: Mapping[int, Mapping[str, Any]]) -> None:
    """The design and the results that are there, as one file."""
    given = {name: [getattr(config, name) for config in design] for name in INPUTS} | _varied_parameters(design)
    done = np.array([k in rows for k in range(len(design))], np.uint8)
    results = {
        name: np.array([rows[k][name] if k in rows else np.nan for k in range(len(design))]) for name in work.units
    }
    columns = {"run": np.arange(len(design)), **{n: _as_stored(v) for n, v in given.items()}, **results, DONE: done}
    units = {**INPUTS, **work.units}
    about = {
        "title": f"{ENSEMBLE}, one entry per run",
        "columns": [name for name in columns if name != "run"],
        "results": list(work.units),
        "design": fingerprint(design, work),
        "sources": sources(*work.rooms),
        **attributes(_shared_parameters(design)),
    }
    typed = {n: (v, {"units": units.get(n) or unit_of(n)}) for n, v in columns.items()}
    write_columns(path, "run", typed, about, signed=True)


def varied_columns(table: pd.DataFrame) -> list[str]:
    """The columns of a stored ensemble that hold parameters the design varies beside its inputs."""
    return [str(name) for name in table.columns if name not in {*INPUTS, *RESULTS, DONE}]


def _as_stored(values: Any) -> Any:
    """Numbers as they are; everything else as text."""
    return np.array(values) if all(np.isscalar(v) for v in values) else np.array([str(v) for v in values])


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
