"""campaign.nc: tables and traces of a study in one HDF5 file, readable by plain h5py and by xarray.

It is written by h5netcdf alone: xarray, and dask where that is installed, take a second to import.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from tribo import outputs
from tribo.errors import failed_by_system
from tribo.files import intact_hdf5, whole_hdf5
from tribo.outputs import unit_of
from tribo.records import Study, Trace
from tribo.report.provenance import Provenance
from tribo.report.tables import covariates, tables_of

if TYPE_CHECKING:
    import h5netcdf

    from tribo.diagnostics import Diagnosis

Variable = tuple[str, np.ndarray, Mapping[str, Any]]  # dimension, values along it, attributes
Group = tuple[dict[str, Variable], dict[str, Any]]  # variables by name, and attributes of the group
OF_DIAGNOSIS = ("/residuals", "/extended_runs")  # groups that a diagnosis rewrites or leaves out as a whole
OF_A_TEST = ("test_id", "sample", "specimen", "normal_load_N")  # what identifies a test in the dataset at the root
_PLAIN_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][-+]?\d{1,2})?")  # 001 is a name


def _units(column: str) -> dict[str, str]:
    unit = unit_of(column)
    return {"units": unit} if unit else {}


def write_store(
    study: Study,
    out: Path,
    provenance: Provenance | None = None,
    diagnosis: Diagnosis | None = None,
    keep_earlier: bool = False,
    tables: Mapping[str, pd.DataFrame] | None = None,
) -> Path:
    """Write out/campaign.nc, with the groups tests, fits, comparison, simulated and traces.

    The root holds the table of tests as well, so that ``xarray.open_dataset`` gives it without a word on groups.

    With a ``diagnosis`` also residuals, one row per test and regime under the calibrated and the extended model, and
    extended_runs, pairs of simulated runs without and with the named mechanisms.

    ``provenance`` is stored in the attributes of the file, as JSON. With ``keep_earlier``, groups stay that an earlier
    run of more stages on the same inputs wrote and that this study does not have.

    ``traces`` is a contiguous ragged array (CF conventions 9.3.3): the samples of all traces end to end, with
    ``row_size`` samples and the first at ``row_start`` for each trace. Times in s, forces in N as recorded
    (the zero is not subtracted; it is ``zero_N`` in tests).
    """
    campaign = study.ingested.campaign
    about = {
        "title": campaign.title,
        "material": campaign.material,
        "counterface": campaign.counterface,
        "nominal_area_m2": np.nan if campaign.nominal_area_m2 is None else campaign.nominal_area_m2,
        "Conventions": "CF-1.11",
    }
    if provenance is not None:
        about |= {"source": provenance.origin, "history": f"{provenance.started_at} {provenance.command}".strip()}
        about["provenance"] = json.dumps(provenance.as_record(), ensure_ascii=False, default=str)
    tables = tables_of(study, diagnosis) if tables is None else tables
    groups: dict[str, Group] = {
        f"/{p.group}": (_table(tables[p.name], p.row, covariates(study) if p.open_ended else ()), {})
        for p in outputs.PRODUCTS
        if p.group and p.name in tables
    }
    coordinates = {"coordinates": " ".join(OF_A_TEST)}  # CF conventions 5
    groups["/"] = {
        name: (dimension, values, attributes if name in OF_A_TEST else {**attributes, **coordinates})
        for name, (dimension, values, attributes) in groups["/tests"][0].items()
    }, about
    groups["/traces"] = _ragged(study), {"featureType": "timeSeries"}
    if study.comparison is not None:
        groups["/comparison"] = groups["/comparison"][0], {"flat": study.comparison.flat}
    if study.simulated is not None:
        groups["/simulated"] = _table(study.simulated, "run"), {}
    if diagnosis is not None and diagnosis.named is not None and diagnosis.extended_runs is not None:
        mechanisms = {"mechanisms": ", ".join(a.name for a in diagnosis.named.model.acting)}
        groups["/extended_runs"] = _table(diagnosis.extended_runs, "pair"), mechanisms
    if keep_earlier:
        renewed = OF_DIAGNOSIS if diagnosis is not None else ()
        groups = {name: group for name, group in _earlier(out / "campaign.nc").items() if name not in renewed} | groups
    return outputs.write(out, "campaign.nc", partial(_write, groups=groups))


def _write(path: Path, groups: Mapping[str, Group]) -> None:
    """Everything in the order of its name: what is taken over from an earlier file comes in that order, and a second
    run is to make the same bytes."""
    import h5netcdf

    with whole_hdf5(path) as held, h5netcdf.File(held, "w") as file:
        for name, group in sorted(groups.items()):
            _fill(file if name == "/" else file.create_group(name), group)


def _fill(place: h5netcdf.Group, group: Group) -> None:
    """Dimensions, variables and attributes of one group; NaN is the missing value of every floating-point number."""
    variables, about = group
    place.dimensions = dict(sorted((dimension, len(values)) for dimension, values, _ in variables.values()))
    for name, (dimension, values, attributes) in sorted(variables.items()):
        missing = np.nan if values.dtype.kind == "f" else None
        variable = place.create_variable(name, (dimension,), _stored_type(values), values, fillvalue=missing)
        variable.attrs.update(sorted(attributes.items()))
    place.attrs.update(sorted(about.items()))


def _stored_type(values: np.ndarray) -> Any:
    import h5py

    return h5py.string_dtype() if values.dtype.kind == "O" else values.dtype


def _earlier(path: Path) -> dict[str, Group]:
    """The groups of a file that is there, but the root; none where it is damaged."""
    import h5netcdf

    try:
        with h5netcdf.File(intact_hdf5(path), "r", decode_vlen_strings=True) as file:
            return {f"/{name}": _read(place) for name, place in file.groups.items()}
    except (OSError, ValueError, KeyError, RuntimeError) as why:  # h5py on damaged files
        if failed_by_system(why):
            raise
        return {}


def _read(place: h5netcdf.Group) -> Group:
    variables: dict[str, Variable] = {
        name: (variable.dimensions[0], variable[...], {k: v for k, v in variable.attrs.items() if k != "_FillValue"})
        for name, variable in place.variables.items()
    }
    return variables, dict(place.attrs.items())


def _table(frame: pd.DataFrame, dimension: str, covariates: Iterable[str] = ()) -> dict[str, Variable]:
    """A table as variables of one dimension; texts of ``covariates`` become numbers where all are written as such."""
    variables: dict[str, Variable] = {}
    for name in frame.columns:
        safe = stem = re.sub(r"[/\s\0]+", "_", str(name)).strip(".") or "unnamed"
        number = 2
        while safe in variables:  # "a b" and "a/b" are two columns
            safe, number = f"{stem}_{number}", number + 1
        values = _values(frame[name], as_numbers=name in covariates)
        variables[safe] = (dimension, values, _units(str(name)))
    return variables


def _values(column: pd.Series, as_numbers: bool = False) -> np.ndarray:
    """Numbers as float64 or int64, everything else as text; a missing number is NaN, a missing text empty."""
    if pd.api.types.is_integer_dtype(column):
        return column.to_numpy(np.int64)
    if pd.api.types.is_numeric_dtype(column) or column.isna().all():
        return column.to_numpy(float)
    given = column.dropna()
    if not any(isinstance(value, str) for value in given):
        return pd.to_numeric(column).to_numpy(float)
    if as_numbers and all(_PLAIN_NUMBER.fullmatch(str(value)) for value in given if value != ""):
        return pd.to_numeric(column.replace("", np.nan)).to_numpy(float)
    return column.fillna("").astype(str).to_numpy(object)


def _ragged(study: Study) -> dict[str, Variable]:
    traces = study.ingested.traces
    sizes = np.array([len(t.time_s) for t in traces.values()], np.int64)
    names = list(dict.fromkeys(name for t in traces.values() for name in t.columns))
    data = {"time_s": _joined(traces, "time_s"), "force_N": _joined(traces, "force_N")}
    if any(t.displacement_m is not None for t in traces.values()):
        data["displacement_m"] = _joined(traces, "displacement_m")
    data |= {name: _joined(traces, name) for name in names if name not in data}
    variables: dict[str, Variable] = {name: ("sample", values, _units(name)) for name, values in data.items()}
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64) if len(sizes) else sizes
    per_test: dict[str, Variable] = {
        "test_id": ("trace", np.array(list(traces), object), {"cf_role": "timeseries_id"}),
        "file": ("trace", np.array([t.file for t in traces.values()], object), {}),
        "row_size": ("trace", sizes, {"sample_dimension": "sample"}),
        "row_start": ("trace", starts, {}),
    }
    return {**per_test, **variables}


def _joined(traces: Mapping[str, Trace], name: str) -> np.ndarray:
    """One quantity of all traces end to end, NaN where a trace lacks it."""
    parts = []
    for trace in traces.values():
        values = trace.columns.get(name) if name in trace.columns else getattr(trace, name, None)
        parts.append(np.full(len(trace.time_s), np.nan) if values is None else np.asarray(values, float))
    return np.concatenate(parts) if parts else np.empty(0)
