"""Ensembles: a design of samples, pressures and stratified angles, run on several threads.

What a stored ensemble vouches for: every row bears a checksum, and a store belongs to one design and one version.

The checksum of a row covers its inputs and results, its place, and what the store is made from. A row that was not
finished, or that differs from its checksum, is never read as a result.

An ensemble stored run by run in one HDF5 file, continued where it was stopped.

The file is made whole before the first run: the design, and for every result a column without values yet.
A finished run then overwrites its own numbers at their known place in the file, its mark last. HDF5 itself never
opens the file for writing again, so that a process killed at any moment leaves a file every reader opens.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import hashlib
import re
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, as_completed, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal

import numpy as np

from tribo.cache.kept_results import DamagedResultWarning, sources
from tribo.cache.own_folder import only_writer_of
from tribo.display import exact_text
from tribo.errors import Problem, SimulationError, naming
from tribo.files import whole_hdf5
from tribo.records import Pattern, Run
from tribo.springblock.config import SimConfig
from tribo.springblock.lattice import pattern_of
from tribo.springblock.results_file import ENSEMBLE, attributes, unit_of, versions
from tribo.springblock.run import simulate

if TYPE_CHECKING:
    import pandas as pd


AngleRule = Literal["midpoints", "random", "nominal"]
Angles = AngleRule | Sequence[float]
Progress = Callable[[int, int], None]
ANGLE_SPREAD_DEG = 10.0  # around the nominal direction of an anisotropic sample (Berardo 2019)


def angle_range_deg(sample: str, pattern: Pattern | None = None) -> tuple[float, float]:
    """Range of pull angles of a sample: nominal +-10 deg where its name ends in a direction, else 0 to 90.

    A name is a direction of a pattern when it ends in x or y and the pattern's own name (or the paper's) is the
    name without that letter, as ``Sx`` is S along x.
    """
    known = pattern or pattern_of(sample)
    direction = re.fullmatch(r"(.+?)[_ -]?([xy])", sample)
    if direction and (known is None or known.name != sample):
        nominal = 0.0 if direction[2] == "x" else 90.0
        return nominal - ANGLE_SPREAD_DEG, nominal + ANGLE_SPREAD_DEG
    return 0.0, 90.0


def middle_deg(limits_deg: tuple[float, float]) -> float:
    """The direction a sample is named after, from its range of angles; 0 where it is named after none."""
    low, high = limits_deg
    return 0.0 if (low, high) == (0.0, 90.0) else (low + high) / 2


def run_seed(seed: int, sample: str, pressure_Pa: float, repeat: int) -> int:
    """Seed of one run, from what the run is and not from its place in the list."""
    case = zlib.crc32(f"{sample} {pressure_Pa:.9g}".encode())
    return int(np.random.SeedSequence([seed, case, repeat]).generate_state(1)[0])


def stratified_design(
    samples: Mapping[str, Pattern | None] | Sequence[str],
    pressures_Pa: Sequence[float] | Mapping[str, Sequence[float]],
    repeats: int = 4,
    seed: int = 0,
    base: SimConfig | None = None,
    angles: Angles = "midpoints",
) -> list[SimConfig]:
    """Configurations of an ensemble: every sample at every pressure, ``repeats`` times.

    The angle range of a sample is cut into as many strata as there are repeats. Each stratum has one angle: its
    midpoint, which gives the best average over the uniform distribution of the paper, or a random one. With "nominal",
    every run is pulled in the direction of the sample's name, or along x. If angles are given in degrees, each is
    simulated ``repeats`` times instead.

    Parameters
    ----------
    samples : mapping of name to Pattern, or names of the paper's samples
    pressures_Pa : nominal pressures, the same for all samples or by sample
    base : everything else, defaults included
    """
    base = base or SimConfig()
    patterns = dict(samples) if isinstance(samples, Mapping) else dict.fromkeys(samples)
    design = []
    for sample, pattern in patterns.items():
        for pressure in pressures_Pa[sample] if isinstance(pressures_Pa, Mapping) else pressures_Pa:
            runs = range(repeats if isinstance(angles, str) else repeats * len(angles))
            seeds = [run_seed(seed, sample, pressure, k) for k in runs]
            pulls = _angles_deg(angles, angle_range_deg(sample, pattern), repeats, seeds)
            design += [
                base.with_(sample=sample, pattern=pattern, pressure_Pa=float(pressure), angle_deg=angle, seed=own)
                for own, angle in zip(seeds, pulls, strict=True)
            ]
    return design


def _angles_deg(
    angles: Angles, limits_deg: tuple[float, float], repeats: int, seeds: Sequence[int]
) -> list[float]:
    """The pull angle of every run at one pressure."""
    if not isinstance(angles, str):
        return [float(angle) for angle in angles for _ in range(repeats)]
    low, high = limits_deg
    if angles == "nominal":
        return [middle_deg(limits_deg)] * repeats
    within = [0.5 if angles == "midpoints" else np.random.default_rng([own, 1]).random() for own in seeds]
    return [float(low + (high - low) * (k + share) / repeats) for k, share in enumerate(within)]


def run_row(run: Run) -> dict[str, Any]:
    """The row of a run in the table of an ensemble."""
    return {
        "sample": run.sample,
        "pressure_Pa": run.pressure_Pa,
        "angle_deg": run.angle_deg,
        "seed": run.seed,
        "static_friction": run.static_friction,
        "sliding_friction": run.sliding_friction,
        "peak_s": run.peak_s,
        "first_failure_s": run.parameters["first_failure_s"],
        "window_start_s": run.window_s[0],
        "window_end_s": run.window_s[1],
        "area_fraction": run.parameters["area_fraction"],
        "normal_load_N": run.normal_load_N,
        "engine": run.engine,
    }


def check_all(configs: Iterable[SimConfig]) -> None:
    """Refuse a design with every distinct fault of its configurations."""
    found: dict[str, Problem] = {}
    for config in configs:
        try:
            config.check()
        except SimulationError as refused:
            found |= {str(problem): problem for problem in refused.problems}
    if found:
        raise SimulationError(list(found.values()))


def run_ensemble(
    design: Sequence[SimConfig], jobs: int = 2, progress: Progress | None = None
) -> pd.DataFrame:
    """Run a list of configurations on ``jobs`` threads; one row per run, in the order of the list.

    The rows do not depend on the number of threads. ``progress(done, total)`` is called after each run.

    Raises
    ------
    SimulationError
        A configuration is impossible (all of them are checked first), or a run failed.
    """
    import pandas as pd

    check_all(design)
    rows: list[dict[str, Any] | None] = [None] * len(design)
    threads = max(1, jobs // max(1, len(design)))
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        pending = {pool.submit(simulate, config, threads): k for k, config in enumerate(design)}
        done = 0
        try:
            while pending:
                finished, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in finished:
                    rows[pending.pop(future)] = run_row(future.result())
                    done += 1
                    if progress is not None:
                        progress(done, len(design))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return pd.DataFrame(rows)


DONE, CHECKSUM = "done", "checksum"
OF_THE_STORE = (DONE, CHECKSUM)
UNREADABLE = (OSError, KeyError, ValueError, TypeError, RuntimeError, MemoryError, AttributeError, IndexError)


def row_checksum(made_from: str, place: int, row: Iterable[tuple[str, Any]]) -> np.uint64:
    """64 bits over one row, given as names and values in the order of the columns."""
    plain = [(name, value.item() if isinstance(value, np.generic) else value) for name, value in row]
    digest = hashlib.blake2b(f"{made_from} {place} {plain!r}".encode(), digest_size=8).digest()
    return np.uint64(int.from_bytes(digest, "little"))


def read_stored(path: str | Path) -> pd.DataFrame:
    """The table of a stored ensemble, finished or not.

    ``done`` tells which rows hold results; the results of the others are NaN. A row that differs from its checksum is
    not done, and a warning says so.

    Raises
    ------
    SimulationError
        This is no stored ensemble, or one without checksums.
    """
    import pandas as pd

    columns, results, made_from = _contents(Path(path))
    names = [name for name in columns if name not in OF_THE_STORE]
    done = columns[DONE].astype(bool)
    for k in np.flatnonzero(done):
        row = [(name, columns[name][k]) for name in names]
        done[k] = columns[DONE][k] == 1 and row_checksum(made_from, int(k), row) == columns[CHECKSUM][k]
    damaged = np.flatnonzero(done != columns[DONE].astype(bool))
    if damaged.size:
        what = f"{path}: {damaged.size} of {done.size} runs differ from their checksums; they are not used"
        warnings.warn(what, DamagedResultWarning, stacklevel=2)
    for name in results:
        columns[name] = np.where(done, columns[name], np.nan)
    return pd.DataFrame({name: columns[name] for name in names} | {DONE: done})


def _contents(path: Path) -> tuple[dict[str, Any], list[str], str]:
    """All columns of a store, the names of its results, and what it is made from."""
    import h5py

    try:
        with h5py.File(path) as file:
            columns = {str(name): file[name][:] for name in file.attrs["columns"]}
            results = [str(name) for name in file.attrs["results"]]
            made_from = f"{file.attrs['design']} {file.attrs['sources']}"
        texts = {name: np.array([t.decode() for t in c], object) for name, c in columns.items() if c.dtype == object}
        if not {*OF_THE_STORE, *results} <= set(columns) or len({len(column) for column in columns.values()}) != 1:
            raise ValueError("its columns are incomplete")
    except UNREADABLE as why:
        raise SimulationError(_no_store(path, why)) from why
    return columns | texts, results, made_from


def _no_store(path: Path, why: BaseException) -> Problem:
    what = f"cannot be read as HDF5 with runs and their checksums: {why}"
    return Problem("not_a_store", what, file=str(path), allowed="a new file, or --force to replace this one")


def fault_of_store(path: Path, identity: Mapping[str, str], attributes: Mapping[str, Any],
                   given: Mapping[str, Sequence[Any]]) -> Problem | None:  # fmt: skip
    """Why a file is no store of these runs, or not an intact one; None where it is.

    Parameters
    ----------
    identity : the hashes that tell what a store is made from, ``design`` and ``sources``
    attributes, given : all other attributes, and the columns of inputs, as they would be written now
    """
    import h5py

    place, allowed = str(path), "a new file, or --force to replace this one"
    try:
        with h5py.File(path) as file:
            known = {name: file.attrs.get(name) for name in identity}
            intact = _same(file, attributes, given)
    except UNREADABLE as why:
        return _no_store(path, why)
    if known["design"] != identity["design"]:
        return Problem("other_design", "it holds runs of a different design", file=place, allowed=allowed)
    if known["sources"] != identity["sources"]:
        what = "it holds runs of another version of tribo or of its libraries, and is not continued"
        return Problem("other_version", what, file=place, allowed=allowed)
    return None if intact else Problem("damaged_store", "its description of the runs is damaged", file=place)


def _same(file: Any, attributes: Mapping[str, Any], given: Mapping[str, Sequence[Any]]) -> bool:
    try:
        return all(_equal(file.attrs[name], value) for name, value in attributes.items()) and all(
            _equal([v.decode() if isinstance(v, bytes) else v for v in file[name][:]], values)
            for name, values in given.items()
        )
    except UNREADABLE:
        return False


def _equal(found: Any, expected: Any) -> bool:
    one, other = np.asarray(found), np.asarray(expected)
    if one.shape != other.shape:
        return False
    if one.dtype.kind in "fiub" and other.dtype.kind in "fiub":
        return bool(np.array_equal(one, other, equal_nan=True))
    return bool(one.astype(str).tolist() == other.astype(str).tolist())


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
    run : makes the run; :func:`tribo.springblock.simulate` by default
    read : numbers by name, read off the run
    units : names of the numbers that are kept, with their units
    label : tells this work from another that keeps the same names
    rooms : packages of tribo whose sources decide the result
    """

    run: Callable[[SimConfig], Run] | None = None
    read: Callable[[Run], Mapping[str, Any]] = run_row
    units: Mapping[str, str] = field(default_factory=lambda: RESULTS)
    label: str = ""
    rooms: Sequence[str] = ("springblock", "laws", "records")


FRICTION = Work()


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

    One process at a time writes the file. Runs that differ from their checksums are computed again, and a warning says
    so.

    Parameters
    ----------
    design : configurations, in any order that stays the same between starts
    path : the HDF5 file; made if absent, continued if it holds exactly this design
    jobs : threads on this machine
    scheduler : address of a dask.distributed scheduler; its workers then run the cells (optional dependency)
    progress : called with the runs done, earlier starts included, and their total
    work : how a run is made and what is kept of it, static and sliding friction with their times by default
    wait_s : how long to wait for another process that writes the file

    Raises
    ------
    SimulationError
        An impossible configuration, a file of another design or version, or no dask or no scheduler where one is given.
    BusyError
        Another process writes the file.
    """
    path = Path(path)
    check_all(design)
    with only_writer_of(path, wait_s):
        _open_store(design, path, work)
        table = read_stored(path)
        missing = [k for k, done in enumerate(table[DONE]) if not done]
        finished = len(design) - len(missing)
        if progress is not None:
            progress(finished, len(design))
        if not missing:
            return table
        given = _given(design)
        made_from = " ".join(identity(design, work).values())
        with _places(path, work) as places:
            for k, row in _rows(design, missing, jobs, scheduler, partial(cell, work=work)):
                results = [(name, places.write(name, k, row[name])) for name in work.units]
                places.write(CHECKSUM, k, row_checksum(made_from, k, [*_row(given, k), *results]))
                places.write(DONE, k, 1)
                finished += 1
                if progress is not None:
                    progress(finished, len(design))
        table = read_stored(path)
    if not table[DONE].all():
        what = "runs are missing after all have been computed: the file was changed from outside meanwhile"
        raise SimulationError(Problem("incomplete", what, file=str(path)))
    return table


def _open_store(design: Sequence[SimConfig], path: Path, work: Work) -> None:
    """Let ``path`` be a store of exactly these runs: made where it is absent, and made anew where it is damaged."""
    fault = fault_of(design, path, work) if path.exists() else None
    if fault is not None and fault.kind == "damaged_store":
        warnings.warn(f"{path}: the file is damaged; all runs are computed again", DamagedResultWarning, stacklevel=3)
    elif fault is not None:
        raise SimulationError(fault)
    if fault is not None or not path.exists():
        _create(design, path, work)


def _given(design: Sequence[SimConfig]) -> dict[str, Any]:
    """The columns of inputs as they are stored: text, or numbers of one type."""
    columns = {name: [getattr(c, name) for c in design] for name in INPUTS} | _varied_parameters(design)
    return {name: _as_stored(values) for name, values in columns.items()}


def _row(given: Mapping[str, Any], k: int) -> list[tuple[str, Any]]:
    return [(name, str(values[k]) if values.dtype.kind == "O" else values[k]) for name, values in given.items()]


def varied_columns(table: pd.DataFrame) -> list[str]:
    """The columns of a stored ensemble that hold parameters the design varies beside its inputs."""
    return [str(name) for name in table.columns if name not in {*INPUTS, *RESULTS, DONE}]


def fingerprint(design: Iterable[SimConfig], work: Work = FRICTION) -> str:
    """Hash of every field of every configuration, in order, and of what is done with them."""
    digest = hashlib.sha256(repr((list(work.units), work.label)).encode())
    for config in design:
        digest.update(exact_text(config).encode())
    return digest.hexdigest()


def identity(design: Sequence[SimConfig], work: Work = FRICTION) -> dict[str, str]:
    """What a store is made from: the hash of its design, and that of the sources that compute it."""
    return {"design": fingerprint(design, work), "sources": sources(*work.rooms)}


def continues(design: Sequence[SimConfig], path: str | Path, work: Work = FRICTION) -> bool:
    """Whether ``path`` is an intact store of exactly these runs, finished or not."""
    return fault_of(design, Path(path), work) is None


def fault_of(design: Sequence[SimConfig], path: Path, work: Work = FRICTION) -> Problem | None:
    """Why ``path`` is no intact store of exactly these runs; None where it is."""
    given = {"run": np.arange(len(design)), **_given(design)}
    return fault_of_store(path, identity(design, work), _attributes(design, work), given)


def _attributes(design: Sequence[SimConfig], work: Work) -> dict[str, Any]:
    """All attributes of a store but those that say what it is made from."""
    return {
        "title": f"{ENSEMBLE}, one entry per run",
        "columns": [*_given(design), *work.units, DONE, CHECKSUM],
        "results": list(work.units),
        **attributes(_shared_parameters(design)),
        **versions(),
    }


def _create(design: Sequence[SimConfig], path: Path, work: Work) -> None:
    import h5py

    empty = dict.fromkeys(work.units, np.full(len(design), np.nan))
    marks = {DONE: np.zeros(len(design), np.uint8), CHECKSUM: np.zeros(len(design), np.uint64)}

    # from 1.8 on, HDF5 checks its own structure
    with whole_hdf5(path) as held, h5py.File(held, "w", libver=("v108", "v108")) as file:
        for name, value in (_attributes(design, work) | identity(design, work)).items():
            file.attrs[name] = value
        run = file.create_dataset("run", data=np.arange(len(design)))
        run.make_scale("run")
        for name, values in (_given(design) | empty | marks).items():
            column = file.create_dataset(name, data=values)
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


@dataclass(frozen=True)
class _Places:
    """Where the numbers of a store are in its file: for each column its offset in bytes, and the type of a number."""

    file: IO[bytes]
    columns: Mapping[str, tuple[int, np.dtype[Any]]]

    def write(self, name: str, k: int, value: Any) -> Any:
        """Overwrite one number; the number as it is stored. Written at once: errors of the disk are raised here."""
        offset, kind = self.columns[name]
        stored = np.asarray(value).astype(kind)
        self.file.seek(offset + k * kind.itemsize)
        self.file.write(stored.tobytes())
        return stored[()]


@contextmanager
def _places(path: Path, work: Work) -> Iterator[_Places]:
    """The result columns of a store, writable in place."""
    import h5py

    with h5py.File(path) as file:
        found = {name: file[name].id for name in (*work.units, DONE, CHECKSUM)}
        columns = {name: (column.get_offset(), column.dtype) for name, column in found.items()}
    with naming(path), path.open("r+b", buffering=0) as raw:
        yield _Places(raw, columns)


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
        client = distributed.Client(scheduler, timeout=SCHEDULER_TIMEOUT_S, set_as_default=False)
    except (OSError, ValueError) as why:
        raise SimulationError(
            Problem(
                "no_scheduler", f"no dask scheduler answers here: {why}", column="scheduler", found=scheduler,
                allowed="the address printed by a running dask scheduler, such as tcp://HOST:8786",
            )
        ) from why
    try:
        with client, client.as_current():
            yield client, distributed.as_completed
    finally:  # a client that ends leaves itself behind as the scheduler of whatever else uses dask in this process
        import_module("dask").config.set(scheduler=None)
