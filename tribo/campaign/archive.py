"""A campaign in a folder or in a .zip that is not trusted."""

from __future__ import annotations

import re
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from tribo.campaign.load import TOML, load_campaign
from tribo.errors import CampaignError, Problem
from tribo.records import Campaign

MOST_ENTRIES = 50_000
MOST_BYTES = 2_000_000_000
MOST_EXPANSION = 200  # text of numbers shrinks about three- to tenfold
_SMALL_BYTES = 10_000_000  # below this no expansion is a danger
_CHUNK = 1 << 20
_NOT_A_ZIP = (zipfile.BadZipFile, NotImplementedError, EOFError, OSError, RuntimeError, zlib.error)


@contextmanager
def open_campaign(path: Path | str, *, measured: bool = True) -> Iterator[Campaign]:
    """Open a campaign folder, or a .zip that holds one (unpacked into a temporary folder while it is open).

    ``measured`` as in :func:`tribo.campaign.load_campaign`.

    Raises
    ------
    CampaignError
        The campaign is unusable; or the archive is not a .zip, or contains links, paths outside it, encrypted or
        oversized entries, no campaign.toml, or more than one.
    """
    path = Path(path)
    if path.is_dir():
        yield load_campaign(_campaign_folder(path, path.name), measured=measured)
    elif path.is_file():
        with tempfile.TemporaryDirectory(prefix="tribo-", ignore_cleanup_errors=True) as folder:
            _unpack(path, Path(folder))
            yield load_campaign(_campaign_folder(Path(folder), path.name), measured=measured)
    else:
        raise CampaignError(Problem("missing", "this folder or .zip does not exist", file=str(path)))


def _campaign_folder(folder: Path, shown: str) -> Path:
    """The folder itself if it holds campaign.toml, else the one folder below that does."""
    if (folder / TOML).is_file():
        return folder
    found = sorted(p.parent for p in folder.rglob(TOML) if "__MACOSX" not in p.parts)
    if len(found) == 1:
        return found[0]
    if not found:
        raise CampaignError(Problem("missing_file", f"no {TOML} in this folder", file=shown))
    names = ", ".join(p.relative_to(folder).as_posix() for p in found)
    raise CampaignError(Problem("several_campaigns", f"more than one {TOML} in it", file=shown, found=names))


def _unpack(archive: Path, folder: Path) -> None:
    try:
        with zipfile.ZipFile(archive) as opened:
            entries = [e for e in opened.infolist() if not e.filename.startswith("__MACOSX/")]
            problems = _entry_faults(entries, archive.name)
            if problems:
                raise CampaignError(problems)
            for entry in entries:
                _unpack_entry(opened, entry, folder, archive.name)
    except _NOT_A_ZIP as why:
        raise CampaignError(Problem("bad_zip", f"not a readable .zip ({why})", file=archive.name)) from why


def _entry_faults(entries: list[zipfile.ZipInfo], file: str) -> list[Problem]:
    problems = []
    for entry in entries:
        fault = _entry_fault(entry)
        if fault:
            problems.append(Problem(*fault, file=file, found=entry.filename))
    names = [e.filename.rstrip("/").lower() for e in entries]
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        problems.append(Problem("duplicate_entry", "an entry occurs twice", file=file, found=twice))
    total = sum(e.file_size for e in entries)
    if total > MOST_BYTES or len(entries) > MOST_ENTRIES:
        found = f"{len(entries)} entries, {total} bytes"
        what, allowed = "too large when unpacked", f"at most {MOST_ENTRIES} entries, {MOST_BYTES} bytes"
        problems.append(Problem("zip_bomb", what, file=file, found=found, allowed=allowed))
    return problems


def _entry_fault(entry: zipfile.ZipInfo) -> tuple[str, str] | None:
    name = entry.filename.replace("\\", "/")
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or re.match(r"[A-Za-z]:", name):
        return "entry_outside", "the path of an entry leads outside the folder"
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "link", "an entry is a link or a device"
    if entry.flag_bits & 1:
        return "encrypted", "an entry is encrypted"
    if entry.file_size > _SMALL_BYTES and entry.file_size > MOST_EXPANSION * max(entry.compress_size, 1):
        return "zip_bomb", "an entry is compressed to an implausibly small size"
    return None


def _unpack_entry(opened: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path, file: str) -> None:
    """Copy one entry, and stop where it turns out longer than it says."""
    target = folder / PurePosixPath(entry.filename.replace("\\", "/"))
    if entry.is_dir():
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    left = entry.file_size
    with opened.open(entry) as packed, target.open("wb") as out:
        while chunk := packed.read(_CHUNK):
            left -= len(chunk)
            if left < 0:
                what = "an entry is longer than its declared size"
                raise CampaignError(Problem("zip_bomb", what, file=file, found=entry.filename))
            out.write(chunk)
