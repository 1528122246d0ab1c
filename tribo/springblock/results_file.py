"""Runs and ensembles as HDF5 files that xarray and plain h5py read; written whole or not at all."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.errors import failed_by_system
from tribo.files import whole_hdf5
from tribo.records import Run

if TYPE_CHECKING:
    import pandas as pd


ONE_RUN = "one run of the spring-block model"
ENSEMBLE = "an ensemble of the spring-block model"
UNITS = {
    "s": "s", "m": "m", "Pa": "Pa", "N": "N", "deg": "degree", "N_m": "N/m", "kg_m3": "kg/m3", "per_s": "1/s",
    "m_s": "m/s",
}  # fmt: skip
Column = tuple[Any, Mapping[str, str]]  # values along the dimension, attributes
_LONGEST_FIRST = sorted(UNITS, key=len, reverse=True)


def unit_of(name: str) -> str:
    """Unit that ends a parameter's name ("dt_s" -> "s"), "1" where it has none."""
    for suffix in _LONGEST_FIRST:
        if name.endswith(f"_{suffix}") and name not in {"mu_s", "friction_mu_s"}:
            return UNITS[suffix]
    return "1"


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


def write_columns(path: Path, dimension: str, columns: Mapping[str, Column], about: Mapping[str, Any]) -> Path:
    """Columns of equal length along one of them, with a checksum of all. xarray would take a second to import."""
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
    return path


def checksum_of(file: Any) -> str:
    """SHA-256 of every attribute and column of an open file, the checksum itself left out."""
    digest = hashlib.sha256()
    for name in sorted(set(file.attrs) - {"checksum"}):
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
        with h5py.File(path) as file:
            title = str(file.attrs.get("title", ""))
    except (OSError, ValueError, KeyError) as why:
        if failed_by_system(why):
            raise
        return ""
    return next((kind for kind in (ONE_RUN, ENSEMBLE) if title.startswith(kind)), "")
