"""What a stored ensemble vouches for: every row bears a checksum, and a store belongs to one design and one version.

The checksum of a row covers its inputs and results, its place, and what the store is made from. A row that was not
finished, or that differs from its checksum, is never read as a result.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.store.kept_results import DamagedResultWarning

if TYPE_CHECKING:
    import pandas as pd

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
