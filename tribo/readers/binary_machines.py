"""Machines and programs that export named arrays in place of text: National Instruments TDMS, MATLAB .mat.

A new one is a record in ``BINARY_MACHINES``: ``recognises`` looks at the first bytes of the file, ``opens`` gives the
sources that hold its arrays. Both are handed the file as a source of bytes that were not decoded.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.readers.columns import match_column, split_unit
from tribo.readers.source import Source
from tribo.readers.text_machines import Machine
from tribo.records import FloatArray

_HDF5 = b"\x89HDF\r\n\x1a\n"
_TDMS_UNITS = ("unit_string", "NI_UnitDescription", "Unit", "unit", "Units", "units")
_NO_UNITS = {"", "none", "no unit"}
_MOST_COLUMNS = 64  # of a matrix that is a table


def _most_frequent_length(arrays: Mapping[str, Any]) -> int:
    """The length that most arrays of several numbers share, the larger of equally frequent ones; 0 for none."""
    lengths = [len(array) for array in arrays.values() if len(array) > 1]
    return max(set(lengths), key=lambda n: (lengths.count(n), n), default=0)


def _open_matlab(source: Source) -> tuple[Source, ...]:
    """All vectors of the most frequent length, as named columns; those of matrices and structs among them.

    Raises
    ------
    ReadError
        bad_mat, or not_an_export where no two vectors share a length.
    """
    stream = io.BytesIO(source.data)
    try:
        if _HDF5 in source.data[:520]:
            import h5py

            with h5py.File(stream, "r") as stored:
                found = {name: item[()] for name, item in stored.items() if isinstance(item, h5py.Dataset)}
        else:
            from scipy.io import loadmat

            found = {name: value for name, value in loadmat(stream).items() if not name.startswith("__")}
    except Exception as why:  # scipy and h5py raise many kinds on damaged files
        raise ReadError(Problem("bad_mat", f"not a readable .mat file ({why})", file=source.file)) from why
    vectors = dict(_vectors(found))
    size = _most_frequent_length(vectors)
    if not size:
        held = ", ".join(f"{name} ({_held(value)})" for name, value in found.items()) or None
        what, allowed = "no vectors in it", "vectors of one length, or a matrix with a column for each quantity"
        raise ReadError(Problem("not_an_export", what, file=source.file, found=held, allowed=allowed))
    kept = {name: v for name, v in vectors.items() if v.size == size}
    return (replace(source, data=b"", names=tuple(kept), arrays=tuple(kept.values())),)


def _vectors(found: Mapping[str, Any]) -> Iterator[tuple[str, FloatArray]]:
    """The vectors of a .mat file by name; a matrix is its columns, "data(1)" and so on, a struct its fields."""
    for name, value in found.items():
        if isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
            yield from _vectors({field: value[field].item() for field in value.dtype.names})
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiu":
            if value.size == max(value.shape, default=0):
                yield name, np.ascontiguousarray(np.ravel(value), dtype=float)
            elif value.ndim == 2 and min(value.shape) <= _MOST_COLUMNS:
                rows = value if value.shape[0] > value.shape[1] else value.T
                for k, column in enumerate(rows.T, start=1):
                    yield f"{name}({k})", np.ascontiguousarray(column, dtype=float)


def _held(value: Any) -> str:
    return " x ".join(map(str, value.shape)) if isinstance(value, np.ndarray) else type(value).__name__


def _open_tdms(source: Source) -> tuple[Source, ...]:
    """One source per group of channels that share a length; channels of one length in several groups are one table.

    Raises
    ------
    ReadError
        bad_tdms, or not_an_export where no two channels share a length.
    """
    from nptdms import TdmsFile  # type: ignore[import-untyped]

    logging.getLogger("nptdms").setLevel(logging.ERROR)  # what it warns of shows as a fault of the file
    file = source.file
    try:
        stored = TdmsFile.read(io.BytesIO(source.data))
        groups = {group.name: {channel.name: channel for channel in group.channels()} for group in stored.groups()}
    except Exception as why:  # nptdms raises many kinds on damaged files
        raise ReadError(Problem("bad_tdms", f"not a readable .tdms file ({why})", file=file)) from why
    tables = {name: table for name, channels in groups.items() if len(table := _table(channels)) > 1}
    if not tables:
        everything = _table({name: c for channels in groups.values() for name, c in channels.items()})
        tables = {"": everything} if len(everything) > 1 else {}
    if not tables:
        found = ", ".join(name for channels in groups.values() for name in channels) or None
        raise ReadError(Problem("not_an_export", "no two channels of the same length", file=file, found=found))
    read = replace(source, data=b"", encoding="tdms")
    if len(tables) > 1:
        return tuple(
            replace(read, file=f"{file} [{name}]", part=name, names=tuple(table), arrays=tuple(table.values()))
            for name, table in tables.items()
        )
    (table,) = tables.values()
    return (replace(read, names=tuple(table), arrays=tuple(table.values())),)


def _table(channels: dict[str, Any]) -> dict[str, FloatArray]:
    """Channels of numbers by "name [unit]" that share the most frequent length; an implied time comes first."""
    numbers = {name: c for name, c in channels.items() if len(c) > 1 and _values(c) is not None}
    size = _most_frequent_length(numbers)
    alike = {name: c for name, c in numbers.items() if len(c) == size}
    found = {_named(name, c): _values(c) for name, c in alike.items()}
    has_time = any((hit := match_column(name)) and hit[0] == "time" for name in found)
    waveforms = {
        (float(c.properties.get("wf_start_offset", 0.0)), float(c.properties.get("wf_increment", 0.0)))
        for c in alike.values()
    }
    if not has_time and len(waveforms) == 1:  # all channels agree on where their samples stand in time
        offset, increment = waveforms.pop()
        if increment > 0:
            found = {"Time [s]": np.asarray(offset + increment * np.arange(size), dtype=float), **found}
    return {name: values for name, values in found.items() if values is not None}


def _values(channel: Any) -> FloatArray | None:
    values = np.asarray(channel[:])
    if values.dtype.kind in "fiu":
        return np.ascontiguousarray(values, dtype=float)
    if values.dtype.kind == "M" and values.size:
        return np.asarray((values - values[0]) / np.timedelta64(1, "s"), dtype=float)
    return None


def _named(name: str, channel: Any) -> str:
    unit = next((str(channel.properties[key]) for key in _TDMS_UNITS if channel.properties.get(key)), "")
    if channel.data_type is not None and channel[:1].dtype.kind == "M":
        unit = "s"
    if unit.strip().lower() in _NO_UNITS or split_unit(name)[1] is not None:
        return name
    return f"{name} [{unit.strip()}]"


BINARY_MACHINES = (
    Machine(
        "tdms",
        "National Instruments TDMS, groups of channels",
        lambda source: source.data[:4] == b"TDSm",
        opens=_open_tdms,
    ),
    Machine(
        "matlab",
        "MATLAB .mat, named variables",
        lambda source: source.data[:16].startswith((b"MATLAB 5.0", b"MATLAB 7.3", _HDF5)),
        advice='the variables have no units; give them in columns: time = "NAME [s]", friction_force = "NAME [N]" '
        '(or "#2 [N]", the second one; for a force divided by a weight, give that weight as the unit: '
        'friction_force = "Fnorm [30.7 gf]")',
        opens=_open_matlab,
    ),
)
