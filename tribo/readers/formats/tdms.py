"""National Instruments TDMS: the channels of a group are the columns of a table; time from their waveform."""

from __future__ import annotations

import io
import logging
import mmap
from pathlib import Path
from typing import Any

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.readers.columns import match_column, split_unit
from tribo.readers.core.family import Family
from tribo.readers.source import Source
from tribo.records import FloatArray

ENCODING = "tdms"
_UNITS = ("unit_string", "NI_UnitDescription", "Unit", "unit", "Units", "units")
_NO_UNITS = {"", "none", "no unit"}


def is_tdms(head: bytes) -> bool:
    return head.startswith(b"TDSm")


def open_tdms(path: Path, file: str, raw: bytes | mmap.mmap) -> tuple[Source, ...]:
    """One source per group of channels that share a length; channels of one length in several groups are one table.

    Raises
    ------
    ReadError
        bad_tdms, or not_an_export where no two channels share a length.
    """
    try:
        groups = _groups(raw[:])
    except Exception as why:  # nptdms raises many kinds on damaged files
        raise ReadError(Problem("bad_tdms", f"not a readable .tdms file ({why})", file=file)) from why
    tables = {name: table for name, channels in groups.items() if len(table := _table(channels)) > 1}
    if not tables:
        everything = _table({name: c for channels in groups.values() for name, c in channels.items()})
        tables = {"": everything} if len(everything) > 1 else {}
    if not tables:
        found = ", ".join(name for channels in groups.values() for name in channels) or None
        raise ReadError(Problem("not_an_export", "no two channels of the same length", file=file, found=found))
    return tuple(
        Source(
            path, f"{file} [{name}]" if len(tables) > 1 else file, b"", ENCODING,
            part=name if len(tables) > 1 else "", names=tuple(table), arrays=tuple(table.values()),
        )
        for name, table in tables.items()
    )  # fmt: skip


def _groups(data: bytes) -> dict[str, dict[str, Any]]:
    from nptdms import TdmsFile  # type: ignore[import-untyped]

    logging.getLogger("nptdms").setLevel(logging.ERROR)  # what it warns of shows as a fault of the file
    stored = TdmsFile.read(io.BytesIO(data))
    return {group.name: {channel.name: channel for channel in group.channels()} for group in stored.groups()}


def _table(channels: dict[str, Any]) -> dict[str, FloatArray]:
    """Channels of numbers by "name [unit]" that share the most frequent length; an implied time comes first."""
    numbers = {name: c for name, c in channels.items() if len(c) > 1 and _values(c) is not None}
    lengths = [len(c) for c in numbers.values()]
    if not lengths:
        return {}
    size = max(set(lengths), key=lambda n: (lengths.count(n), n))
    found = {_named(name, c): _values(c) for name, c in numbers.items() if len(c) == size}
    has_time = any((hit := match_column(name)) and hit[0] == "time" for name in found)
    if not has_time and (time := _waveform_time(list(numbers.values()), size)) is not None:
        found = {"Time [s]": time, **found}
    return {name: values for name, values in found.items() if values is not None}


def _values(channel: Any) -> FloatArray | None:
    values = np.asarray(channel[:])
    if values.dtype.kind in "fiu":
        return np.ascontiguousarray(values, dtype=float)
    if values.dtype.kind == "M" and values.size:
        return np.asarray((values - values[0]) / np.timedelta64(1, "s"), dtype=float)
    return None


def _named(name: str, channel: Any) -> str:
    unit = next((str(channel.properties[key]) for key in _UNITS if channel.properties.get(key)), "")
    if channel.data_type is not None and channel[:1].dtype.kind == "M":
        unit = "s"
    if unit.strip().lower() in _NO_UNITS or split_unit(name)[1] is not None:
        return name
    return f"{name} [{unit.strip()}]"


def _waveform_time(channels: list[Any], size: int) -> FloatArray | None:
    """Start offset plus sample number times increment, where all channels of this length agree on both."""
    steps = {
        (float(c.properties.get("wf_start_offset", 0.0)), float(c.properties.get("wf_increment", 0.0)))
        for c in channels
        if len(c) == size
    }
    if len(steps) != 1:
        return None
    offset, increment = steps.pop()
    return np.asarray(offset + increment * np.arange(size), dtype=float) if increment > 0 else None


def recognises(source: Source) -> bool:
    return source.encoding == ENCODING


TDMS = Family("tdms", "National Instruments TDMS, groups of channels", recognises)
