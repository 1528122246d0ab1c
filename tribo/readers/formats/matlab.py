"""MATLAB .mat files with named variables; they have no units, which must be given in columns."""

from __future__ import annotations

import io
import mmap
from pathlib import Path
from typing import Any

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.readers.core.family import Family
from tribo.readers.source import Source
from tribo.records import FloatArray

_HDF5 = b"\x89HDF\r\n\x1a\n"


def is_matlab(head: bytes) -> bool:
    return head.startswith((b"MATLAB 5.0", b"MATLAB 7.3")) or head.startswith(_HDF5)


def open_matlab(path: Path, file: str, raw: bytes | mmap.mmap) -> Source:
    """All vectors of the most frequent length, as named columns.

    Raises
    ------
    ReadError
        bad_mat, or not_an_export where no two vectors share a length.
    """
    vectors = _vectors(raw, file)
    lengths = [v.size for v in vectors.values() if v.size > 1]
    if not lengths:
        raise ReadError(Problem("not_an_export", "no vectors in it", file=file, found=", ".join(vectors) or None))
    n = max(set(lengths), key=lambda size: (lengths.count(size), size))
    kept = {name: v for name, v in vectors.items() if v.size == n}
    return Source(path, file, b"", "binary", names=tuple(kept), arrays=tuple(kept.values()))


def _vectors(raw: bytes | mmap.mmap, file: str) -> dict[str, FloatArray]:
    stream = io.BytesIO(raw)
    try:
        found = _from_hdf5(stream) if _HDF5 in raw[:520] else _from_mat5(stream)
    except ReadError:
        raise
    except Exception as why:  # scipy and h5py raise many kinds on damaged files
        raise ReadError(Problem("bad_mat", f"not a readable .mat file ({why})", file=file)) from why
    return {
        name: np.ascontiguousarray(np.ravel(value), dtype=float)
        for name, value in found.items()
        if isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size == max(value.shape, default=0)
    }


def _from_mat5(stream: io.BytesIO) -> dict[str, Any]:
    from scipy.io import loadmat

    return {name: value for name, value in loadmat(stream).items() if not name.startswith("__")}


def _from_hdf5(stream: io.BytesIO) -> dict[str, Any]:
    import h5py

    with h5py.File(stream, "r") as stored:
        return {name: item[()] for name, item in stored.items() if isinstance(item, h5py.Dataset)}


def recognises(source: Source) -> bool:
    return bool(source.arrays)


ADVICE = (
    "the variables have no units; give them in columns "
    '(for a force divided by a weight, give that weight as the unit: friction_force = "Fnorm [30.7 gf]")'
)
MATLAB = Family("matlab", "MATLAB .mat, named variables", recognises, advice=ADVICE)
