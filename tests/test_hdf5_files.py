"""HDF5 files are whole or absent, also where the disk is full."""

from __future__ import annotations

import errno
import io
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tribo import files as hdf5_files
from tribo.files import HeldBackErrors, intact_hdf5, whole_hdf5


class _Full(io.FileIO):
    """A file on a disk with room for 3000 bytes."""

    def write(self, data: Any) -> int:
        if self.tell() + len(data) > 3000:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data) or 0


def write(path: Path) -> None:
    with whole_hdf5(path) as held, h5py.File(held, "w") as file:
        file["numbers"] = np.arange(1000.0)
        file.attrs["title"] = "numbers"


def test_a_file_that_was_written_is_read_by_its_path(tmp_path: Path) -> None:
    write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["numbers"][:].tolist() == list(range(1000))
        assert file.attrs["title"] == "numbers"
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]


def test_a_full_disk_leaves_the_file_of_before_and_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(b"of before")

    def on_full_disk(raw: io.RawIOBase) -> HeldBackErrors:
        return HeldBackErrors(_Full(raw.fileno(), "w+", closefd=False))

    monkeypatch.setattr(hdf5_files, "HeldBackErrors", on_full_disk)
    with pytest.raises(OSError, match="No space left") as caught:
        write(path)
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(path))
    assert path.read_bytes() == b"of before"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_of_the_writer_itself_is_not_held_back(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), whole_hdf5(tmp_path / "a.h5"):
        _ = 1 / 0
    assert list(tmp_path.iterdir()) == []


def test_a_flipped_bit_is_noticed_before_the_library_opens_the_file(tmp_path: Path) -> None:
    """The library may search for ever in a damaged heap."""
    write(tmp_path / "a.h5")
    intact, rng = (tmp_path / "a.h5").read_bytes(), np.random.default_rng(6)
    assert intact_hdf5(tmp_path / "a.h5") == tmp_path / "a.h5"
    for place in rng.choice(len(intact) - 200, 40, replace=False):
        damaged = bytearray(intact)
        damaged[place] ^= 1 << int(rng.integers(8))
        (tmp_path / "b.h5").write_bytes(damaged)
        with pytest.raises(OSError, match=r"b\.h5: the file differs from its checksum"):
            intact_hdf5(tmp_path / "b.h5")


def test_a_file_that_another_program_wrote_has_no_checksum_and_is_opened(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["numbers"] = np.arange(10.0)
    assert intact_hdf5(tmp_path / "a.h5") == tmp_path / "a.h5"
