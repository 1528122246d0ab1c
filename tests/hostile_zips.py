"""Zips that someone wrote to do harm: a campaign of one test, and one thing in it that must be refused."""

from __future__ import annotations

import io
import stat
import struct
import warnings
import zipfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

TOML = '[campaign]\ntitle = "t"\nnominal_area_mm2 = 55.0\n[patterns.F]\ncavity = "none"\n'
TESTS = "test_id,file,sample,mass_g\nT1,raw/T1.csv,F,50\n"
EXPORT = "Time (s),Force (N)\n" + "".join(f"{k / 10},{k % 7}\n" for k in range(50))
GOOD = {"campaign.toml": TOML, "tests.csv": TESTS, "raw/T1.csv": EXPORT}
MEGABYTE = 1 << 20


@dataclass(frozen=True)
class Hostile:
    """A zip by name, the kind of problem it is refused with, and the part of the name that the message must show."""

    name: str
    kind: str
    make: Callable[[], bytes]
    shown: str = ""


def packed(*more: tuple[str | zipfile.ZipInfo, bytes], good: dict[str, str] = GOOD) -> bytes:
    """A zip of the good campaign and more entries."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as out, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a name that occurs twice
        for name, text in good.items():
            out.writestr(name, text)
        for entry, content in more:
            out.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return made.getvalue()


def named(name: str, content: bytes = b"1,2\n") -> tuple[zipfile.ZipInfo, bytes]:
    """An entry whose name stays exactly as it is given."""
    info = zipfile.ZipInfo("x")
    info.filename = info.orig_filename = name
    return info, content


def with_mode(mode: int, content: bytes = b"/etc/passwd") -> bytes:
    info = zipfile.ZipInfo("raw/odd.csv")
    info.external_attr = (mode | 0o777) << 16
    return packed((info, content))


def raw_name(name: bytes) -> bytes:
    """An entry with these bytes as its name, marked as UTF-8."""
    placeholder = "é" + "x" * (len(name) - 2)
    return packed(named(placeholder)).replace(placeholder.encode(), name)


def nul_name() -> bytes:
    return packed(named("raw/aXb.csv")).replace(b"raw/aXb.csv", b"raw/a\0b.csv")


def patched(offset: int, form: str, *values: int, of: str = "raw/T1.csv") -> bytes:
    """The good zip with other values in the list of entries (APPNOTE.TXT 4.3.12), for one entry."""
    made = bytearray(packed())
    at = made.rindex(of.encode()) - 46
    assert made[at : at + 4] == b"PK\1\2"
    struct.pack_into(form, made, at + offset, *values)
    return bytes(made)


def in_both_headers(offset: int, form: str, value: int, of: str) -> bytes:
    """The same in the header before the contents as well; ``offset`` counts in that one."""
    made = bytearray(patched(offset + 2, form, value, of=of))
    struct.pack_into(form, made, made.index(of.encode()) - 30 + offset, value)
    return bytes(made)


def many_bombs(count: int, megabytes: int) -> bytes:
    """Entries that are each below the size from which an expansion is looked at."""
    return packed(*((f"raw/{k}.csv", bytes(megabytes * MEGABYTE)) for k in range(count)))


def sharing(names: Iterable[str], content: bytes = b"") -> bytes:
    """Entries of these names, five letters each, that share the same packed bytes (Fifield, WOOT 2019)."""
    made = packed(("raw/00000", content))
    end = made.rindex(b"PK\5\6")
    start = struct.unpack_from("<L", made, end + 16)[0]
    last = made[made.rindex(b"PK\1\2", start, end) : end]
    more = [last.replace(b"00000", name.encode()) for name in names]
    listing = made[start:end] + b"".join(more)
    record = bytearray(made[end:])
    number = struct.unpack_from("<H", record, 10)[0] + len(more)
    struct.pack_into("<HHL", record, 8, number, number, len(listing))
    return made[:start] + listing + bytes(record)


def numbers(count: int) -> list[str]:
    return [f"{k:05d}" for k in range(1, count + 1)]


def long_listing() -> bytes:
    """A list of entries so long that reading it alone takes long; the same entry all over."""
    made = packed()
    end = made.rindex(b"PK\5\6")
    start = struct.unpack_from("<L", made, end + 16)[0]
    listing = made[start:end] * 60_000
    record = bytearray(made[end:])
    struct.pack_into("<HHL", record, 8, 65_535, 65_535, len(listing))
    return made[:start] + listing + bytes(record)


def in_zip64(listing_bytes: int) -> bytes:
    """A record of the longer form that announces a list of entries of so many bytes."""
    made = packed()
    end = made.rindex(b"PK\5\6")
    long = struct.pack("<4sQHHLLQQQQ", b"PK\6\6", 44, 45, 45, 0, 0, 9, 9, listing_bytes, 0)
    return made[:end] + long + struct.pack("<4sLQL", b"PK\6\7", 0, end, 1) + made[end:]


def truncated(share: float) -> bytes:
    made = packed()
    return made[: int(len(made) * share)]


def damaged(of: str) -> bytes:
    """Contents that do not match their checksum."""
    made = bytearray(packed())
    at = made.index(of.encode()) + len(of)
    made[at + 5] ^= 0xFF
    return bytes(made)


def shifted_end(offset: int, value: int) -> bytes:
    made = bytearray(packed())
    struct.pack_into("<L", made, made.rindex(b"PK\5\6") + offset, value)
    return bytes(made)


def without(name: str, *more: tuple[str | zipfile.ZipInfo, bytes]) -> bytes:
    return packed(*more, good={k: v for k, v in GOOD.items() if k != name})


def commented(comment: bytes, good: dict[str, str] = GOOD) -> bytes:
    """A zip with a comment."""
    made = io.BytesIO(packed(good=good))
    with zipfile.ZipFile(made, "a") as out:
        out.comment = comment
    return made.getvalue()


OUTSIDE = (
    "../evil.txt", "/evil.txt", "raw/../../evil.txt", "C:/evil.txt", "C:evil.txt", "c:\\evil.txt", "..\\evil.txt",
    "\\evil.txt", "raw\\..\\..\\evil.txt", "\\\\server\\share\\evil.txt", "//server/evil.txt", "..", "raw/..",
    "./../evil.txt", "raw/./../../evil.txt", "/", "/etc/cron.d/evil", "raw/../tests.csv",
)  # fmt: skip
COLLIDING = (
    "raw\\T1.csv", "./raw/T1.csv", "raw//T1.csv", "raw/./T1.csv", ".\\raw\\T1.csv", "raw/.//T1.csv", "raw/T1.csv",
    "RAW/T1.csv", "raw/t1.CSV", "raw/T1.csv.", "raw/T1.csv ", "raw./T1.csv", "Raw/T2.csv", "raw/T1.csv/x", "raw",
    "tests.csv/", "Tests.csv", "campaign.toml", "CAMPAIGN.TOML", "./campaign.toml", "raw \\T9.csv",
)  # fmt: skip
PAIRS = (
    ("raw/caf\u00e9.csv", "raw/cafe\u0301.csv"), ("raw/K.csv", "raw/\u212a.csv"), ("raw/stra\u00dfe", "raw/STRASSE"),
    ("raw/\u00c5.csv", "raw/\u212b.csv"), ("raw/\u0130.csv", "raw/i\u0307.csv"), ("a\\b.csv", "a/b.csv"),
    ("raw/\u00e9/x.csv", "raw/e\u0301/y.csv"), ("x/y", "x"),
)  # fmt: skip
CONTROL = ("raw/a\nb.csv", "raw/a\rb.csv", "raw/\x1b[31m.csv", "raw/\x7f.csv", "raw/a\u2028b.csv", "raw/a\x85b.csv",
           "raw/a\tb.csv")  # fmt: skip
NOT_UTF8 = (b"raw/\xff.csv", b"raw/\xc3\x28.csv", b"raw/\xed\xa0\x80.csv", b"raw/\xc0\xaf.csv", b"\x80\x81")
MODES = {"link": stat.S_IFLNK, "character device": stat.S_IFCHR, "block device": stat.S_IFBLK,
         "pipe": stat.S_IFIFO, "socket": stat.S_IFSOCK}  # fmt: skip
METHODS = {"bzip2": 12, "lzma": 14, "deflate64": 9, "zstd": 93, "aes": 99}


def by_name() -> Iterator[Hostile]:
    for name in OUTSIDE:
        yield Hostile(f"leads outside {name}", "entry_outside", lambda n=name: packed(named(n)), name)
    for name in COLLIDING:
        yield Hostile(f"overwrites by {name}", "duplicate_entry", lambda n=name: packed(named(n)))
    for one, two in PAIRS:
        make = lambda a=one, b=two: packed(named(a), named(b))  # noqa: E731
        yield Hostile(f"collides {two!a}", "duplicate_entry", make)
    for name in CONTROL:
        yield Hostile(f"control character {name!a}", "bad_entry_name", lambda n=name: packed(named(n)))
    yield Hostile("NUL in a name", "bad_entry_name", nul_name)
    for raw in NOT_UTF8:
        yield Hostile(f"not UTF-8 {raw!r}", "bad_entry_name", lambda r=raw: raw_name(r))
    yield Hostile("part of 300 bytes", "bad_entry_name", lambda: packed(named("raw/" + "x" * 300)))
    yield Hostile("part of 200 letters of two bytes", "bad_entry_name", lambda: packed(named("raw/" + "é" * 200)))
    yield Hostile("70 levels", "bad_entry_name", lambda: packed(named("a/" * 70 + "x")))
    yield Hostile("name of 60,000 bytes", "bad_entry_name", lambda: packed(named("ab/" * 20_000 + "x")))


def by_kind() -> Iterator[Hostile]:
    for name, mode in MODES.items():
        yield Hostile(name, "link", lambda m=mode: with_mode(m), "raw/odd.csv")
    yield Hostile("link upwards", "link", lambda: with_mode(stat.S_IFLNK, b"../../.."), "raw/odd.csv")
    yield Hostile("encrypted", "encrypted", lambda: in_both_headers(6, "<H", 1, "raw/T1.csv"), "raw/T1.csv")
    for name, method in METHODS.items():
        make = lambda m=method: in_both_headers(8, "<H", m, "raw/T1.csv")  # noqa: E731
        yield Hostile(name, "unusual_compression", make, "raw/T1.csv")
    yield Hostile("no campaign.toml", "missing_file", lambda: without("campaign.toml"))
    yield Hostile("two campaigns", "several_campaigns", lambda: packed(("b/campaign.toml", TOML.encode()),
                                                                        good={"a/campaign.toml": TOML}))  # fmt: skip
    a_folder = named("campaign.toml/")
    yield Hostile("campaign.toml is a folder", "missing_file", lambda: without("campaign.toml", a_folder))
    only_mac = ("__MACOSX/campaign.toml", TOML.encode())
    yield Hostile("campaign.toml beside the campaign only", "missing_file", lambda: without("campaign.toml", only_mac))


def by_size() -> Iterator[Hostile]:
    yield Hostile("30 MB of zeros", "zip_bomb", lambda: packed(("raw/x.csv", bytes(30 * MEGABYTE))), "raw/x.csv")
    yield Hostile("6 times 9 MB of zeros", "zip_bomb", lambda: many_bombs(6, 9))
    yield Hostile("entries that overlap", "zip_bomb", lambda: sharing(numbers(300), bytes(9 * MEGABYTE)))
    yield Hostile("says 3 GB", "zip_bomb", lambda: patched(24, "<L", 3_000_000_000))
    yield Hostile("says less than it is", "bad_zip", lambda: in_both_headers(22, "<L", 3, "raw/T1.csv"))
    yield Hostile("50,001 entries", "zip_bomb", lambda: sharing(numbers(50_001)))
    yield Hostile("40,000 entries, the last twice", "duplicate_entry", lambda: sharing([*numbers(40_000), "40000"]))
    yield Hostile("a list of 180,000 entries", "zip_bomb", long_listing)
    yield Hostile("a list of 2^40 bytes", "zip_bomb", lambda: in_zip64(1 << 40))
    yield Hostile("a list of 2^63 bytes", "zip_bomb", lambda: in_zip64(1 << 63))


def by_damage() -> Iterator[Hostile]:
    for share in (0.0, 0.01, 0.3, 0.7, 0.97):
        yield Hostile(f"cut at {share}", "bad_zip", lambda s=share: truncated(s))
    for name in GOOD:
        yield Hostile(f"damaged {name}", "bad_zip", lambda n=name: damaged(n))
    yield Hostile("list of entries elsewhere", "bad_zip", lambda: shifted_end(16, 1_000_000))
    yield Hostile("list of entries too short", "bad_zip", lambda: shifted_end(12, 60))
    yield Hostile("a record within the last record", "bad_zip", lambda: packed()[:-22] + b"PK\5\6" * 5 + b"\0\0")
    yield Hostile("a comment with the mark of the end", "bad_zip", lambda: commented(b"made with PK\5\6"))
    yield Hostile("a comment that is an empty zip", "bad_zip", lambda: commented(b"PK\5\6" + bytes(18)))
    yield Hostile("a comment that is another campaign", "bad_zip", lambda: commented(packed()))
    yield Hostile("another name before the contents", "bad_zip",
                  lambda: packed().replace(b"raw/T1.csv", b"raw/T2.csv", 1))  # fmt: skip
    yield Hostile("version 25.5", "bad_zip", lambda: patched(6, "<H", 255))
    yield Hostile("contents beyond the end", "bad_zip", lambda: patched(42, "<L", 1 << 30))
    yield Hostile("no zip", "bad_zip", lambda: b"PK\3\4 but no more")
    yield Hostile("a gzip", "bad_zip", lambda: b"\x1f\x8b\x08" + bytes(100))


def all_hostile() -> tuple[Hostile, ...]:
    """Every zip of this file."""
    return (*by_name(), *by_kind(), *by_size(), *by_damage())
