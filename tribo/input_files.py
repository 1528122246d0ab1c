"""Files of the user, none of which is trusted: the limits on all that is read, files read whole, archives, workbooks.

Each limit is checked before the work that it bounds; the reasons are in docs/reference/limits.md. Numbers are limits of
a computer unless a source is named.

The standard library unpacks zips, and refuses entries that are damaged or longer than they say. What it does not refuse
is checked here, by the list of entries and before any of them is unpacked: a list that is too long to be read, or that
other programs read otherwise; sizes of a bomb; links and devices; names that lead out of the folder, cannot be shown,
or overwrite each other on some system.
"""

from __future__ import annotations

import errno
import io
import json
import mmap
import os
import re
import stat
import struct
import subprocess
import sys
import tomllib
import unicodedata
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import IO, Any
from xml.parsers import expat

from tribo.errors import CampaignError, Problem, ReadError, naming
from tribo.workbook_sheets import MOST_MEMORY_BYTES

# Files
LARGEST_EXPORT_BYTES = 2 << 30
LARGEST_TABLE_BYTES = 100_000_000  # tests.csv, overrides.csv
LARGEST_DESCRIPTION_BYTES = 1_000_000  # campaign.toml, a design file
MOST_DROPPED_BYTES = 50_000_000_000  # all files of a campaign of a build: to hash them takes minutes
LONGEST_NAME = 150  # characters of a campaign folder: files named after it stay below the 255 bytes of file systems

# Tables
LONGEST_CELL = 10_000  # characters
MOST_TABLE_ROWS = 200_000  # rows of tests.csv or overrides.csv
MOST_COLUMNS = 1_000
MOST_EXPORT_ROWS = 40_000_000  # reading takes 8 bytes a number, and a pull about 110 bytes a row: 4.4 GB

# Texts with levels
DEEPEST_NESTING = 50  # arrays and tables within each other in TOML and JSON

# Designs of simulations
MOST_RUNS = 50_000
MOST_BLOCKS = 4_000_000  # 2000 x 2000; a run of them takes about 2 GB
MOST_STEPS = 100_000_000  # of a run

# Zip archives
MOST_ENTRIES = 50_000
MOST_UNPACKED_BYTES = 2_000_000_000
MOST_UNPACKED_EXPORT_BYTES = 400_000_000  # of an export in a .zip or .gz, which is held in memory
MOST_EXPANSION = 200  # text of numbers shrinks about three- to tenfold
SMALL_ENTRY_BYTES = 10_000_000  # below this no expansion is a danger
MOST_WORKBOOK_BYTES = 200_000_000  # an Excel export, unpacked
LONGEST_WORKBOOK_S = 120.0  # of reading it
LONGEST_ENTRY_NAME_BYTES = 1_000
LONGEST_PATH_PART_BYTES = 255  # on all common file systems
DEEPEST_PATH = 32
LARGEST_LISTING_BYTES = 200 * MOST_ENTRIES  # of the list of entries: 46 bytes, a name and time stamps each

# Numbers in SI units. Squares of these, summed over the longest table, stay finite and above zero in double precision;
# no friction test comes near them.
LARGEST_NUMBER = 1e15
SMALLEST_NUMBER = 1e-18  # a force or time base whose largest number is below this was not measured
LARGEST_LOAD_N = 1e12
SMALLEST_LOAD_N = 1e-15  # a tenth of the thermal noise of the finest force microscopes is above this
LARGEST_COUNT = 2**53  # larger whole numbers are not exact in double precision
ABSOLUTE_ZERO_C = -273.15
FIRST_YEAR, LAST_YEAR = 1900, 2199  # of a measurement


MAPPED_BYTES = 64 << 20  # larger files are mapped and read in pieces, so that memory holds the numbers only

OLD_EXCEL = b"\xd0\xcf\x11\xe0"
ZIP = b"PK\x03\x04"
_MOST_CELLS = 20_000_000  # of the rectangle that a sheet spans, filled or not: its reader keeps all of them
_PLACE = re.compile(r"([A-Za-z]{1,3})(\d{1,7})")
_QUOTED = re.compile(  # texts and comments of TOML
    r'"""(?:[^"\\]|\\.|"(?!""))*+"""|' r"'''(?:[^']|'(?!''))*+'''|" r'"(?:[^"\\\n]|\\.)*+"|'
    r"'[^'\n]*+'|#[^\n]*+",
    re.DOTALL,
)
_KEYS = re.compile(r"[^=\[\]{},\n]++")
_MOST_NAMED = 5
_CHUNK = 1 << 20
_NOT_A_ZIP = (zipfile.BadZipFile, NotImplementedError, EOFError, OSError, RuntimeError, ValueError, zlib.error)
_END, _END_64, _END_64_PLACE = b"PK\5\6", b"PK\6\6", b"PK\6\7"  # APPNOTE.TXT 6.3.10, 4.3.14 to 4.3.16
LAST_BYTES = (1 << 16) + 22 + 20 + 56  # the longest comment, and the records before it

_HASHES: ContextVar[dict[str, str] | None] = ContextVar("hashes of the files that were read", default=None)


class NotRegularError(OSError):
    """A pipe, a device, a socket or a folder where a file is expected."""


class TooLargeError(OSError):
    """A file is larger than allowed; ``size`` in bytes."""

    def __init__(self, size: int, limit: int, path: Path):
        super().__init__(errno.EFBIG, f"{size} bytes; at most {limit} are allowed", str(path))
        self.size = size


@contextmanager
def hashes_of_reads() -> Iterator[dict[str, str]]:
    """Collect the SHA-256 of every file that is read in this block, by its path as it was opened."""
    found: dict[str, str] = {}
    token = _HASHES.set(found)
    try:
        yield found
    finally:
        _HASHES.reset(token)


def read_input(path: Path, most_bytes: int) -> bytes:
    """The bytes of a regular file.

    Raises
    ------
    NotRegularError, TooLargeError
        Before anything is read.
    OSError
        The file is missing or cannot be opened.
    """
    return bytes(read_or_map(path, most_bytes, mapped_from=most_bytes))


def read_or_map(path: Path, most_bytes: int, mapped_from: int = MAPPED_BYTES) -> bytes | mmap.mmap:
    """The same; a file larger than ``mapped_from`` bytes is mapped into memory."""
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with naming(path), os.fdopen(descriptor, "rb") as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise NotRegularError(errno.EINVAL, "not a regular file", str(path))
        if status.st_size > most_bytes:
            raise TooLargeError(status.st_size, most_bytes, path)
        content: bytes | mmap.mmap
        if status.st_size > mapped_from:
            content = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
        else:
            content = stream.read(most_bytes + 1)
        if len(content) > most_bytes:
            raise TooLargeError(len(content), most_bytes, path)
    hashes = _HASHES.get()
    if hashes is not None:
        hashes[str(path)] = sha256(content).hexdigest()
    return content


def nests_too_deeply(parsed: Any) -> bool:
    """Whether arrays and tables of a TOML or JSON text stand within each other beyond the limit."""
    level = [parsed]
    for _ in range(DEEPEST_NESTING):
        below: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                below += value.values()
            elif isinstance(value, list):
                below += value
        if not below:
            return False
        level = below
    return True


def toml_table(text: str) -> dict[str, Any]:
    """A TOML text as a table; keys of more than DEEPEST_NESTING parts, whose reading takes a time of their square, are
    refused before they are read.

    Raises
    ------
    RecursionError
        Tables or arrays nested too deeply.
    ValueError
        It is not TOML.
    """
    bare = _QUOTED.sub("q", text)
    if any(run[0].count(".") >= DEEPEST_NESTING for run in _KEYS.finditer(bare)):
        raise RecursionError
    return tomllib.loads(text)


@contextmanager
def opened_zip(archive: Path) -> Iterator[tuple[zipfile.ZipFile, dict[str, zipfile.ZipInfo]]]:
    """A zip and its entries by their path inside, "/" between its parts and behind a folder; all of them harmless.

    Raises
    ------
    CampaignError
        It is no zip; its entries are too many, too large, or compressed to an implausibly small size; or an entry is a
        link, a device, encrypted, compressed by an unusual method, leads out of the folder, has an unusable name, or
        would overwrite another one on this or another system.
    """
    file = archive.name
    try:
        _refuse_long_listing(archive)
        opened = zipfile.ZipFile(archive)
    except UnicodeDecodeError as why:
        name = bytes(why.object).decode("utf-8", errors="backslashreplace")
        what = "the name of an entry is marked as UTF-8 but is not"
        raise CampaignError(Problem("bad_entry_name", what, file=file, found=name)) from None
    except _NOT_A_ZIP as why:
        raise CampaignError(Problem("bad_zip", f"not a readable .zip ({why})", file=file)) from why
    with opened:
        infos = opened.infolist()
        problems = size_problems(infos, archive.stat().st_size, file, MOST_UNPACKED_BYTES)
        if problems:
            raise CampaignError(problems)
        entries = [(_path_of(info), info) for info in infos]
        entries = [(path, info) for path, info in entries if path.split("/")[0] != "__MACOSX"]
        problems = _entry_problems(entries, file)
        if problems:
            raise CampaignError(problems)
        yield opened, {path: info for path, info in entries if path != "/"}


def unpack(archive: Path, folder: Path) -> None:
    """Unpack a zip into a folder.

    Raises
    ------
    CampaignError
        As :func:`opened_zip`; or an entry is damaged, or longer than it says.
    """
    with opened_zip(archive) as (opened, entries):
        for parent in {path.rpartition("/")[0] for path in entries}:
            (folder / parent).mkdir(parents=True, exist_ok=True)
        for path, info in entries.items():
            if not path.endswith("/"):
                with naming(folder / path), (folder / path).open("wb") as out:
                    out.writelines(pieces(opened, info, archive.name))


def pieces(opened: zipfile.ZipFile, info: zipfile.ZipInfo, file: str) -> Iterator[bytes]:
    """The contents of an entry in pieces of bounded size.

    Raises
    ------
    CampaignError
        It is longer than it says, or damaged.
    """
    try:
        with opened.open(info) as packed:
            while piece := packed.read(_CHUNK):
                yield piece
    except _NOT_A_ZIP as why:
        raise CampaignError(
            Problem("bad_zip", f"not a readable .zip ({why})", file=file, found=_path_of(info))
        ) from why


def size_problems(infos: Sequence[zipfile.ZipInfo], archive_bytes: int, file: str, most_bytes: int) -> list[Problem]:
    """Why a zip must not be unpacked, by the number and the sizes of its entries."""
    problems = []
    total = sum(info.file_size for info in infos)
    if total > most_bytes or len(infos) > MOST_ENTRIES:
        found = f"{len(infos)} entries, {total} bytes"
        what, allowed = "too large when unpacked", f"at most {MOST_ENTRIES} entries, {most_bytes} bytes"
        problems.append(Problem("zip_bomb", what, file=file, found=found, allowed=allowed))
    names = [i.filename for i in infos if _expands(i.file_size, i.compress_size)]
    if names or _expands(total, archive_bytes):
        what = "compressed to an implausibly small size"
        found = _listed(names) if names else f"{total} bytes in a file of {archive_bytes}"
        allowed = f"at most {MOST_EXPANSION} times its compressed size"
        problems.append(Problem("zip_bomb", what, file=file, found=found, allowed=allowed))
    return problems


def _expands(size: int, packed: int) -> bool:
    return size > SMALL_ENTRY_BYTES and size > MOST_EXPANSION * max(packed, 1)


def _path_of(info: zipfile.ZipInfo) -> str:
    """Backslashes, doubled slashes and single dots mean what they mean as a path; a folder ends in a slash."""
    path = "/".join(part for part in re.split(r"[/\\]", info.filename) if part not in ("", "."))
    return f"{path}/" if info.filename.endswith(("/", "\\")) else path


def _entry_problems(entries: Sequence[tuple[str, zipfile.ZipInfo]], file: str) -> list[Problem]:
    """One problem for each kind of fault, with the entries it was found in."""
    found: dict[tuple[str, str, str], list[str]] = {}
    for path, info in entries:
        if fault := _name_fault(path, info.orig_filename) or _kind_fault(info):
            found.setdefault(fault, []).append(info.orig_filename)
    if not found and (twice := list(_colliding(entries))):
        what = "entries that overwrite each other, on this system or on one that takes their names for the same"
        found["duplicate_entry", what, "names that differ in more than case, slashes or the coding of letters"] = twice
    return [
        Problem(kind, what, file=file, found=_listed(names), allowed=allowed or None)
        for (kind, what, allowed), names in found.items()
    ]


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(name[:LONGEST_PATH_PART_BYTES] for name in names[:_MOST_NAMED]) + more


def _name_fault(path: str, given: str) -> tuple[str, str, str] | None:
    """(kind, sentence, what is allowed) for an entry that cannot be unpacked under its name."""
    parts = path.removesuffix("/").split("/")
    if not given.isprintable() and any(unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp") for letter in given):
        return "bad_entry_name", "the name of an entry contains a control character", ""
    if given.startswith(("/", "\\")) or ".." in parts or re.match(r"[A-Za-z]:", given):
        return "entry_outside", "the path of an entry leads outside the folder", ""
    if len(parts) > DEEPEST_PATH or len(given.encode()) > LONGEST_ENTRY_NAME_BYTES:
        allowed = f"at most {DEEPEST_PATH} levels, {LONGEST_ENTRY_NAME_BYTES} bytes"
        return "bad_entry_name", "the path of an entry is too long", allowed
    if any(len(part.encode()) > LONGEST_PATH_PART_BYTES for part in parts):
        return "bad_entry_name", "the name of an entry is too long", f"at most {LONGEST_PATH_PART_BYTES} bytes"
    return None if path else ("bad_entry_name", "an entry has no name", "")


def _kind_fault(info: zipfile.ZipInfo) -> tuple[str, str, str] | None:
    if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "link", "an entry is a link or a device", ""
    if info.flag_bits & 1:
        return "encrypted", "an entry is encrypted", ""
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        return "unusual_compression", "an entry is compressed by a method that is not supported", "Deflate"
    return None


def _colliding(entries: Sequence[tuple[str, zipfile.ZipInfo]]) -> Iterator[str]:
    """Entries whose place is taken by another one, and folders spelled in two ways."""
    files: dict[str, str] = {}
    folders: dict[str, str] = {}
    for path, info in entries:
        above = path.rpartition("/")[0]
        for end in [found.start() for found in re.finditer("/", above)] + [len(above)]:
            folder = above[:end]
            if folder and folders.setdefault(_alike(folder), folder) != folder:
                yield path.removesuffix("/")
        if not path.endswith("/"):
            if _alike(path) in files:
                yield info.filename
            files[_alike(path)] = path
    yield from (path for key, path in files.items() if key in folders)


def _alike(name: str) -> str:
    """The same for names that some file system takes for one: case, coding of letters, dots and blanks at an end."""
    parts = (part.rstrip(" .") for part in name.split("/"))
    folded = unicodedata.normalize("NFD", "/".join(parts)).casefold()
    return unicodedata.normalize("NFD", folded)


def _refuse_long_listing(archive: Path) -> None:
    """Refuse a zip whose list of entries is too long to be read, by the record at its end."""
    size = archive.stat().st_size
    with archive.open("rb") as stream:
        stream.seek(max(0, size - LAST_BYTES))
        tail = stream.read()
    at = last_record(tail)
    (listing,) = struct.unpack_from("<L", tail, at + 12)
    if at >= 76 and tail[at - 20 : at - 16] == _END_64_PLACE and tail[at - 76 : at - 72] == _END_64:
        (listing,) = struct.unpack_from("<Q", tail, at - 76 + 40)
    if listing > LARGEST_LISTING_BYTES:
        what, allowed = "the list of entries is too long", f"{LARGEST_LISTING_BYTES} bytes, {MOST_ENTRIES} entries"
        found = f"{listing} bytes"
        raise CampaignError(Problem("zip_bomb", what, file=archive.name, found=found, allowed=allowed))


def last_record(tail: bytes) -> int:
    """Where the last record of a zip begins in the last :data:`LAST_BYTES` of its file.

    Some programs look for the mark of this record from the end of the file, others for a record with a comment as long
    as the rest of the file (APPNOTE.TXT, 4.3.16). Where a comment holds the mark, they read different lists of entries.

    Raises
    ------
    zipfile.BadZipFile
        There is no such record, or the comment holds its mark.
    """
    marks = [found.start() for found in re.finditer(re.escape(_END), tail)]
    complete = [at for at in marks if len(tail) >= at + 22]
    fitting = [at for at in complete if at + 22 + int.from_bytes(tail[at + 20 : at + 22], "little") == len(tail)]
    if fitting and fitting != marks[-1:]:
        raise zipfile.BadZipFile("its comment holds the mark of the end of a .zip; pack it again without the comment")
    if not complete or marks[-1] != complete[-1]:
        raise zipfile.BadZipFile("it does not end as a .zip does")
    return complete[-1]


def sheets_as_text(data: bytes, file: str) -> dict[str, str]:
    """The sheets that hold anything, by name: one line per row, cells separated by tabs.

    Raises
    ------
    ReadError
        bad_workbook, too_large or empty.
    """
    try:
        if data[:4] == ZIP:
            _refuse_large(data, file)
    except (*_NOT_A_ZIP, expat.ExpatError) as why:
        raise ReadError(Problem("bad_workbook", f"not a readable workbook ({why})", file=file)) from None
    sheets = _sheets(data, file)
    texts = {name: text for name, text in sheets.items() if text.strip()}
    if not texts:
        raise ReadError(Problem("empty", "the workbook contains no filled cells", file=file))
    return texts


def _refuse_large(data: bytes, file: str) -> None:
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        entries = packed.infolist()
        if problems := size_problems(entries, len(data), file, MOST_WORKBOOK_BYTES):
            raise ReadError(replace(problem, kind="too_large") for problem in problems)
        for entry in entries:
            if entry.filename.lower().endswith(".xml"):
                with packed.open(entry) as sheet:
                    cells = _spanned(sheet)
                if cells > _MOST_CELLS:
                    found, allowed = f"{cells} cells in {entry.filename}", f"at most {_MOST_CELLS}"
                    raise ReadError(Problem("too_large", "the file is too large", file, found=found, allowed=allowed))


def _spanned(sheet: IO[bytes]) -> int:
    """Cells of the rectangle from the first to the last cell of a worksheet; 0 of XML without cells.

    A cell and a row may state their place or leave it to their order (ECMA-376-1, 18.3.1.4 and 18.3.1.73); tables of
    OpenDocument repeat both by number (OpenDocument 1.3, 19.675 and 19.679).
    """
    rows: list[int] = []  # the first and the last so far, as the columns
    columns: list[int] = []
    row = column = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal row, column
        name = tag.rpartition(" ")[2]
        stated = {key.rpartition(" ")[2]: value for key, value in attributes.items()}
        if name == "row":
            row, column = int(stated.get("r", row + 1)), 0
        elif name == "table-row":
            row, column = row + int(stated.get("number-rows-repeated", 1)), 0
        elif name == "c":
            place = _PLACE.fullmatch(stated.get("r", ""))
            column += 1
            if place:
                row, column = int(place[2]), sum((ord(x) - 64) * 26**k for k, x in enumerate(place[1].upper()[::-1]))
        elif name == "table-cell":
            column += int(stated.get("number-columns-repeated", 1))
        if name == "c" or (name == "table-cell" and "value-type" in stated):
            rows[:] = [min([*rows, row]), max([*rows, row])]
            columns[:] = [min([*columns, column]), max([*columns, column])]

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler = start
    parser.ParseFile(sheet)
    return (rows[1] - rows[0] + 1) * (columns[1] - columns[0] + 1) if rows else 0


def _sheets(data: bytes, file: str) -> dict[str, str]:
    """The text of every sheet, read by a process of its own with a limit of memory and of time."""
    program = [sys.executable, "-P", str(Path(__file__).with_name("workbook_sheets.py"))]
    try:
        done = subprocess.run(program, input=data, capture_output=True, timeout=LONGEST_WORKBOOK_S, check=False)
    except subprocess.TimeoutExpired:
        what, allowed = "reading the workbook takes too long", f"{LONGEST_WORKBOOK_S:g} s"
        raise ReadError(Problem("too_large", what, file, allowed=f"{allowed}; save the sheet as .csv")) from None
    said = done.stderr.decode("utf-8", errors="replace")
    if done.returncode == 0:
        return dict(json.loads(done.stdout))
    if done.returncode < 0 or "memory" in said:
        what, allowed = "reading the workbook takes too much memory", f"{MOST_MEMORY_BYTES / 1e9:g} GB"
        raise ReadError(Problem("too_large", what, file, allowed=f"{allowed}; delete far cells, or save it as .csv"))
    said = said.strip().rpartition("\n")[2]
    raise ReadError(Problem("bad_workbook", f"not a readable workbook ({said})", file=file))
