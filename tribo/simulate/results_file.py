"""Runs and ensembles as HDF5 files that xarray and plain h5py read; written whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.errors import failed_by_system
from tribo.records import Run
from tribo.store.hdf5_files import whole_hdf5

if TYPE_CHECKING:
    import pandas as pd

ONE_RUN = "one run of the spring-block model"
ENSEMBLE = "an ensemble of the spring-block model"
UNITS = {
    "s": "s", "m": "m", "Pa": "Pa", "N": "N", "deg": "degree", "N_m": "N/m", "kg_m3": "kg/m3", "per_s": "1/s",
    "m_s": "m/s",
}  # fmt: skip
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
    import xarray as xr

    dataset = xr.Dataset(
        {
            "force": ("time", run.force_N, {"units": "N", "long_name": "slider force along the pull"}),
            "moving": ("time", run.moving, {"units": "1", "long_name": "number of moving contact blocks"}),
        },
        coords={"time": ("time", run.time_s, {"units": "s"})},
        attrs={
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
            **versions(),
        },
    )
    with whole_hdf5(Path(path)) as file:
        dataset.to_netcdf(file, engine="h5netcdf")
    return Path(path)


def write_ensemble(table: pd.DataFrame, path: str | Path, parameters: Mapping[str, Any] | None = None) -> Path:
    """Write the table of an ensemble: one variable per column, one entry per run."""
    import xarray as xr

    dataset = xr.Dataset(
        {
            name: ("run", _column(table[name].to_numpy()), {"units": unit_of(str(name))})
            for name in map(str, table.columns)
        },
        attrs={"title": ENSEMBLE, **attributes(parameters or {}), **versions()},
    )
    with whole_hdf5(Path(path)) as file:
        dataset.to_netcdf(file, engine="h5netcdf")
    return Path(path)


def _column(values: Any) -> Any:
    return values.astype(str).astype(object) if values.dtype.kind in "OUT" else values


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
