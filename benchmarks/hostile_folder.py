# ruff: noqa: E501
"""Hostile campaigns in a drop folder beside good ones: what `tribo build` makes of the folder.

    python benchmarks/hostile_folder.py [--hostile 500] [--good 20] [--seed 1] [--keep FOLDER]

The folder is drawn at the seed: hostile names, descriptions, tables, workbooks, zips, links and special files, records,
forged results and patterns. One build processes it with limits of 2 minutes for a step and 2 GB for a process. While it
runs, a file changes and every process of the build is watched. Counted are

- the good campaigns that were built, and the hostile ones that have a row of their own on the index page, with a reason
  where they are not built;
- canaries: a command on the path, modules and start files that would tell if anything of a campaign were run, and a
  secret outside the folder that must stand in no file of the site;
- the highest memory of every process (VmHWM of /proc) and the longest time of a step;
- tracebacks and errors of tribo itself, in the words of the build and in its logs.

Processes are forked from one that has tribo loaded (forked_starts.py), so that a start costs no import; lattices are
small. One line per kind is printed at the end. Exit status 1 where a count is not as it must be. Linux only.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import shutil
import socket
import sys
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from html import unescape
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import torture_processes as processes  # noqa: E402
from forked_starts import stand_in_for_python  # noqa: E402
from hostile_inputs import COLUMNS, HOSTILE_TEXTS, HOSTILE_VALUES, ROWS, TOML, spelled  # noqa: E402
from hostile_zips import all_hostile  # noqa: E402
from readers.test_workbooks import workbook  # noqa: E402
from support.campaigns import FLAT_TOML, SMALL_LAWS  # noqa: E402
from support.sled import SledDesign, write_campaign  # noqa: E402

MOST_MINUTES, MOST_GIGABYTES = 2.0, 2.0
ENDING_S = 20.0  # what a step over its time may take to end, and to write its record
SECRET = "canary-of-a-file-outside"
COMMAND = "tribocanary"  # a command on the path
RUN_MARK = "EXECUTED"

# -------------------------------------------------------------------------------------------------- hostile campaigns

Make = Callable[[Path, str, random.Random], None]
KINDS: dict[str, tuple[int, Make]] = {}


def kind(label: str, weight: int = 2) -> Callable[[Make], Make]:
    def register(make: Make) -> Make:
        KINDS[label] = weight, make
        return make

    return register


def template(folder: Path) -> Path:
    """A small campaign with nothing wrong in it: four pulls of one flat sample."""
    write_campaign(
        folder, SledDesign({"F": SMALL_LAWS["F"]}, masses_g=(25.0, 138.5), specimens=2, repeats=1),
        FLAT_TOML.format(title="plain", more="slider_mass_g = 1.5"), seed=5,
    )  # fmt: skip
    return folder


def copied(drop: Path, name: str) -> Path:
    """The small campaign under a name, to be spoiled."""
    shutil.copytree(drop.parent / "template", drop / name)
    return drop / name


def exports(folder: Path) -> list[Path]:
    return sorted((folder / "raw").iterdir())


SHELL = (
    "$({c})", "`{c}`", ";{c};", "|{c}|", "&& {c} &&", "a\"$({c})\"", "a'$({c})'", "$(${{IFS}}{c})", "-o {c}", "--help",
    "{{{c}}}", "{{wildcards.name}}", "<name>", "<results>", "%({c})s", "${{{c}}}", "{{{{{c}}}}}", "{{% {c} %}}", "=cmd|' /C {c}'!A0",
)  # fmt: skip
MARKUP = (
    "<script>alert(1)<", "<img src=x onerror=alert(1)>", "&lt;b&gt;", "\"><svg onload=alert(1)>", "PDMS <new>", "a&b",
    "#set page(fill: red)", "#eval(\"1\")", "$x$ *bold* _it_", "\\input{x}", "[[link]]", "@here", "<!--", "]]>", "'-->",
)  # fmt: skip
ODD = (
    "\x1b[31mred", "a\nb", "a\rb", "a\tb", "\u202egnp.exe", "\ufeffbom", "\u2028line", "e\u0301" * 20, "\u212a",
    "CON", "nul.txt", "a.", " a", "a ", "..a", "~", "*", "?", "[a-z]", "!", "a:b", "a\\b", "index.html", "trend.csv",
    "laws", "latest", "current", "0", "-", "--", "=deadbeef", "a" * 150, "a" * 151, "a" * 240, "é" * 75, "é" * 120,
    "ab" * 21, "x" * 25, "a.a." * 22, "\U0001f600" * 30, "${HOME}", "%00", "a%2Fb", "kept", "report", "index",
)  # fmt: skip


def _named(drop: Path, name: str, texts: tuple[str, ...], rng: random.Random) -> None:
    text = rng.choice(texts).format(c=COMMAND) if texts is SHELL else rng.choice(texts)
    number = name.split("-")[1]
    place = rng.choice([text, f"{text} {number}", f"{number} {text}"]).replace("/", "∕")
    while len(place.encode()) > 250:
        place = place[:-1]
    if (drop / place).exists():
        place = f"{number} {place}"[:100]
    copied(drop, place)


@kind("name: shell, Python and Snakemake", 16)
def shell_name(drop: Path, name: str, rng: random.Random) -> None:
    _named(drop, name, SHELL, rng)


@kind("name: markup", 12)
def markup_name(drop: Path, name: str, rng: random.Random) -> None:
    _named(drop, name, MARKUP, rng)


@kind("name: control, long, repeated, reserved", 24)
def odd_name(drop: Path, name: str, rng: random.Random) -> None:
    _named(drop, name, ODD, rng)


@kind("name: not UTF-8", 6)
def bytes_name(drop: Path, name: str, rng: random.Random) -> None:
    raw = rng.choice([b"\xff\xfe", b"caf\xe9", b"\xed\xa0\x80", b"\xc0\xaf", b"a\x80"])
    if rng.random() < 0.5:
        raw += name.encode()  # else two of them look the same
    target = os.fsencode(drop) + b"/" + raw
    if os.path.exists(target):
        target += name.encode()
    shutil.copytree(os.fsencode(drop.parent / "template"), target)


@kind("name: a folder and a zip of one name", 3)
def one_name(drop: Path, name: str, rng: random.Random) -> None:
    copied(drop, name)
    shutil.make_archive(str(drop / name), "zip", drop.parent / "template")


def _description(drop: Path, name: str, text: str | bytes) -> None:
    place = copied(drop, name) / "campaign.toml"
    place.write_bytes(text if isinstance(text, bytes) else text.encode())


@kind("description: deep", 6)
def deep_toml(drop: Path, name: str, rng: random.Random) -> None:
    depth = rng.choice([60, 5_000, 200_000])
    one = rng.choice(["[" * depth + "]" * depth, "{a=" * depth + "1" + "}" * depth, "[" * depth])
    _description(drop, name, f"{TOML}\nx = {one}\n")


@kind("description: long keys and quadratic", 10)
def quadratic_toml(drop: Path, name: str, rng: random.Random) -> None:
    part = rng.choice(["a", '"a"', "'a'", " a ", "a-1"])
    many = rng.choice([45, 2_000, 40_000, 200_000])
    key = ".".join([part] * many)
    text = rng.choice([
        f"{key} = 1\n", f"[{key}]\nx = 1\n", f"[[{key}]]\nx = 1\n", "".join(f"[a{'.a' * (k % 40)}]\n" for k in range(9_000)),
        f"x = {{ {key} = 1 }}\n", "\n".join(f"a{'.b' * 40}.c{k} = 1" for k in range(8_000)), "[[t]]\n" * 150_000,
        "x = [" + ",".join(["{a=1}"] * 150_000) + "]\n",
    ])  # fmt: skip
    _description(drop, name, text if rng.random() < 0.5 else f"{TOML}\n{text}")


@kind("description: huge, binary, odd values", 20)
def odd_toml(drop: Path, name: str, rng: random.Random) -> None:
    way = rng.randrange(4)
    if way == 0:
        _description(drop, name, rng.choice([b"x" * 3_000_000, rng.randbytes(5_000), b"\0" * 900_000, b"", b"\xff\xfe[\0",
                                             b"#" * 990_000, b'x = "' + b"\\" * 900_000, b'x = """' + b'"' * 5]))  # fmt: skip
    elif way == 1:
        _description(drop, name, TOML.replace("5.0", rng.choice(HOSTILE_VALUES)))
    else:
        lines = TOML.splitlines()
        at = rng.choice([k for k, line in enumerate(lines) if "=" in line])
        lines[at] = f"{lines[at].split('=')[0]}= {rng.choice(HOSTILE_VALUES)}"
        _description(drop, name, "\n".join(lines) + "\n")


@kind("description: texts that would be run or read", 10)
def running_toml(drop: Path, name: str, rng: random.Random) -> None:
    text = rng.choice([*SHELL, *MARKUP]).format(c=COMMAND) if rng.random() < 0.5 else "/etc/passwd"
    key = rng.choice(["title", "material", "counterface", "notes", "operator", "instrument_name"])
    extra = rng.choice(["", '[columns]\nforce = "../../etc/passwd"\n', '[zero]\nfile = "/dev/zero"\n'])
    quoted = json.dumps(text)
    _description(drop, name, f'[campaign]\ntitle = "t"\n{"" if key == "title" else f"{key} = {quoted}"}\nnominal_area_mm2 '
                             f'= 55.0\n[patterns.{quoted}]\ncavity = "none"\n[patterns.F]\ncavity = "none"\n{extra}')  # fmt: skip


PITCHES = ("1e-9", "1e-3", "1e-300", "[1e-6, 1e6]", "[20.0, 1e-12]", "5.0000001", "1e15")


@kind("description: patterns of enormous simulations", 6)
def pattern_bomb(drop: Path, name: str, rng: random.Random) -> None:
    folder = copied(drop, name)
    area = rng.choice(["55.0", "5.5e8", "1e15", "1e-9"])
    pattern = f'cavity = "circle"\ndiameter_um = {rng.choice(["5.0", "1e-9", "1e9"])}\npitch_um = {rng.choice(PITCHES)}'
    patterns = "".join(f"[patterns.P{k}]\n{pattern}\n" for k in range(rng.choice([1, 3, 2_000])))
    (folder / "campaign.toml").write_text(
        f'[campaign]\ntitle = "t"\nnominal_area_mm2 = {area}\nslider_mass_g = 1.5\n[patterns.F]\ncavity = "none"\n{patterns}'
    )
    table = (folder / "tests.csv").read_text().splitlines()
    columns = table[0].split(",")
    rows = [line.split(",") for line in table[1:]]
    for row in rows[len(rows) // 2 :]:
        row[columns.index("sample")] = "P0"
    (folder / "tests.csv").write_text("\n".join([table[0], *map(",".join, rows)]) + "\n")


def _table(drop: Path, name: str, content: bytes) -> Path:
    folder = copied(drop, name)
    (folder / "tests.csv").write_bytes(content)
    return folder


@kind("tests.csv: cells", 36)
def odd_cells(drop: Path, name: str, rng: random.Random) -> None:
    folder = copied(drop, name)
    lines = [line.split(",") for line in (folder / "tests.csv").read_text().splitlines()]
    for _ in range(rng.randint(1, 6)):
        cell = rng.choice([*HOSTILE_TEXTS, *(t.format(c=COMMAND) for t in SHELL), *MARKUP, "inf", "1e308", "-1e308"])
        row = rng.choice(lines[1:]) if rng.random() < 0.9 else lines[0]
        row[rng.randrange(len(row))] = '"' + cell.replace('"', '""') + '"'
    (folder / "tests.csv").write_bytes("\n".join(map(",".join, lines)).encode("utf-8", "surrogatepass") + b"\n")


@kind("tests.csv: sizes", 16)
def huge_table(drop: Path, name: str, rng: random.Random) -> None:
    plain = (drop.parent / "template" / "tests.csv").read_bytes()
    head, rest = plain.split(b"\n", 1)
    content = rng.choice([
        lambda: b",".join(b"c%d" % k for k in range(1_000_000)) + b"\n" + b"," * 999_999 + b"\n",
        lambda: head + b"," * 1_000_000 + b"\n" + rest, lambda: head + b"\n" + b"x" * 20_000_000 + b"\n",
        lambda: head + b"\n" + b'"' + b"x\n" * 5_000_000, lambda: head + b"\n" + b"," * 30_000_000,
        lambda: head + b"\n" + b"\n" * 10_000_000 + rest, lambda: head + b"\n" + b"T,raw/x,F\n" * 400_000,
        lambda: plain + b"\n".join(b"T%d,raw/T001.csv,F" % k for k in range(3_000)),
        lambda: b'"' * 1_000_001, lambda: b"\n" * 2_000_000, lambda: head * 2_000 + b"\n" + rest,
    ])()  # fmt: skip
    _table(drop, name, content)


@kind("tests.csv: encodings, NUL, line ends", 16)
def encoded_table(drop: Path, name: str, rng: random.Random) -> None:
    text = (drop.parent / "template" / "tests.csv").read_text()
    content = rng.choice([
        text.replace("\n", "\r").encode(), text.encode("utf-16-le"), text.encode("utf-32"), text.encode("utf-7"),
        text.encode("cp037"), text.replace(",", "\0").encode(), text.replace("F", "F\0").encode(), b"\xff\xfe" + text.encode(),
        b"\xef\xbb\xbf" * 3 + text.encode(), text.replace("\n", "\v").encode(), text.replace("\n", "\u2028").encode(),
        rng.randbytes(20_000), bytes(50_000), text.encode()[: rng.randrange(len(text))], text.replace(",", ", ,").encode(),
        b"PK\3\4" + text.encode(), b"\x1f\x8b" + text.encode(), b"SQLite format 3\0" + bytes(100), text.encode("utf-16")[:-1],
    ])  # fmt: skip
    _table(drop, name, content)


@kind("tests.csv: of other people", 8)
def drawn_table(drop: Path, name: str, rng: random.Random) -> None:
    rows = [dict(row) for row in ROWS]
    for row in rows:
        row[rng.choice(COLUMNS)] = rng.choice(HOSTILE_TEXTS)
    folder = _table(drop, name, spelled(rows, COLUMNS, rng.choice(",;\t|")))
    (folder / "campaign.toml").write_text(TOML)


@kind("tests.csv: exports elsewhere", 14)
def elsewhere(drop: Path, name: str, rng: random.Random) -> None:
    outside = drop.parent / "secret.txt"
    places = (str(outside), "../../secret.txt", "/dev/zero", "/dev/stdin", "/proc/self/environ", "/etc/passwd", "raw", ".",
              "..", "/", "", "raw/*", "raw/../../../secret.txt", "file:///etc/passwd", "http://127.0.0.1:1/x",
              f"$({COMMAND})", f"|{COMMAND}", "raw/T001.csv#9999999999", "raw/T001.csv#*", "\\\\server\\share", "NUL")  # fmt: skip
    lines = [line.split(",") for line in (drop.parent / "template" / "tests.csv").read_text().splitlines()]
    at = lines[0].index("file")
    for row in lines[1:]:
        if rng.random() < 0.7:
            row[at] = rng.choice(places)
    _table(drop, name, ("\n".join(map(",".join, lines)) + "\n").encode())


FAR = (
    '<c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>2</v></c>',
    "<c r='A1'><v>1</v></c></row><row r='1048576'><c r='xfd1048576'><v>2</v></c>",
    '<c r="A1"><v>1</v></c><c\n r\n=\n"XFD1048576"><v>2</v></c>',
    '<c r="&#65;1"><v>1</v></c><c r="&#88;FD1048576"><v>2</v></c>',
    '<c r="A1"><v>1</v></c></row><row r="1048576"><c><v>2</v></c>',
    '<c r="ZZZ9999999"><v>1</v></c>', '<c r="A0"><v>1</v></c>', '<c r="A99999999999999999999"><v>1</v></c>',
    '<c r="$XFD$1048576"><v>1</v></c>', '<c r="A1:XFD1048576"><v>1</v></c>', '<c r="-1"><v>1</v></c>',
    '<c r="A1" t="s"><v>99999999</v></c>', '<c r="A1" t="s"><v>-1</v></c>', '<c r="A1" s="99999999"><v>1</v></c>',
    '<c r="A1"><f>cmd|\'/C tribocanary\'!A0</f><v>1</v></c>', '<c r="A1"><f>[1]Sheet1!A1</f><v>1</v></c>',
    '<c r="A1"><v>1e308</v></c><c r="B1"><v>inf</v></c>', '<c r="A1" t="d"><v>9999999-01-01</v></c>',
    "</row>" + "<row>" * 30_000 + "<c/>" + "</row>" * 30_000 + "<row>",
    '<c r="A1"><v>' + "9" * 2_000_000 + "</v></c>", "</row>" + '<row r="2"><c r="A2"><v>1</v></c></row>' * 200_000 + "<row>",
)  # fmt: skip


@kind("workbook: cells", 30)
def workbook_cells(drop: Path, name: str, rng: random.Random) -> None:
    data = workbook(f'<row r="1">{rng.choice(FAR)}</row>')
    folder = copied(drop, name)
    if rng.random() < 0.5:
        (folder / "tests.csv").unlink()
        (folder / rng.choice(["tests.xlsx", "tests.ods", "tests.xls"])).write_bytes(data)
    else:
        for export in exports(folder)[: rng.randint(1, 4)]:
            export.write_bytes(data)


@kind("workbook: parts, bombs, links outside", 16)
def workbook_parts(drop: Path, name: str, rng: random.Random) -> None:
    import io
    import zipfile

    made = io.BytesIO(workbook('<row r="1"><c r="A1" t="s"><v>0</v></c></row>'))
    entity = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">' + "".join(
        '<!ENTITY a{} "{}">'.format(k, "&a{};".format(k - 1 or "") * 10) for k in range(1, 9)
    ) + "]>"
    outside = f'<!DOCTYPE x [<!ENTITY e SYSTEM "file://{drop.parent / "secret.txt"}">]>'
    parts = rng.choice([
        {"xl/sharedStrings.xml": f'{entity}<sst xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><si><t>&a8;</t></si></sst>'},
        {"xl/sharedStrings.xml": f"{outside}<sst><si><t>&e;</t></si></sst>"}, {"xl/worksheets/sheet2.xml": bytes(60_000_000)},
        {"xl/worksheets/sheet1.xml": b"<worksheet>" + b" " * 190_000_000}, {"xl/vbaProject.bin": b"\0" * 1_000},
        {"xl/worksheets/sheet1.xml": b"<worksheet><sheetData>" + b"<row>" * 20_000_000}, {"[Content_Types].xml": b"<"},
        {"xl/workbook.xml": f"{entity}<workbook>&a8;</workbook>"}, {"xl/externalLinks/externalLink1.xml": "<externalLink/>"},
        {"xl/_rels/workbook.xml.rels": '<Relationships><Relationship Id="rId1" Target="../../../etc/passwd"/></Relationships>'},
        {"../../evil.xml": "x"}, {"xl/styles.xml": "<styleSheet><numFmts count='999999999'/></styleSheet>"},
    ])  # fmt: skip
    import warnings

    with zipfile.ZipFile(made, "a", zipfile.ZIP_DEFLATED) as out, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a part that is there twice
        for part, content in parts.items():
            out.writestr(part, content)
    folder = copied(drop, name)
    for export in exports(folder)[:2]:
        export.write_bytes(made.getvalue())
    if rng.random() < 0.4:
        (folder / "tests.csv").unlink()
        (folder / "tests.xlsx").write_bytes(made.getvalue())


@kind("zips", 70)
def zipped(drop: Path, name: str, rng: random.Random) -> None:
    (drop / f"{name}.zip").write_bytes(rng.choice(all_hostile()).make())


@kind("links, pipes, sockets, devices", 40)
def special(drop: Path, name: str, rng: random.Random) -> None:
    way = rng.randrange(8)
    if way == 0:  # in place of the campaign
        target = rng.choice(["/dev/zero", "/etc", "/proc/self", str(drop), ".", name, str(drop.parent / "nothing")])
        (drop / f"{name}{rng.choice(['', '.zip'])}").symlink_to(target)
        return
    if way == 1:
        os.mkfifo(drop / f"{name}.zip")
        return
    folder = copied(drop, name)
    place = rng.choice([folder / "campaign.toml", folder / "tests.csv", *exports(folder)[:2]])
    place.unlink()
    if way == 2:
        os.mkfifo(place)
    elif way == 3:
        here = Path.cwd()
        os.chdir(place.parent)  # addresses of sockets are short
        with socket.socket(socket.AF_UNIX) as s:
            s.bind(place.name)
        os.chdir(here)
    elif way == 4:
        place.symlink_to(place.name)
        (folder / "raw" / "loop").symlink_to("..")
    elif way == 5:
        place.mkdir()
    else:
        place.symlink_to(rng.choice(["/dev/zero", "/dev/random", "/etc/passwd", str(drop.parent / "secret.txt"), "/dev/stdin",
                                     "/proc/kcore", "../../secret.txt", "/proc/self/mem", "/dev/tty"]))  # fmt: skip


@kind("many files, deep folders, huge holes", 8)
def many_files(drop: Path, name: str, rng: random.Random) -> None:
    folder = copied(drop, name)
    way = rng.randrange(4)
    if way == 0:
        (folder / "more").mkdir()
        for k in range(5_000):
            (folder / "more" / f"{k}").touch()
    elif way == 1:
        here = os.open(folder, os.O_RDONLY)
        for _ in range(900):  # longer than any path may be
            os.mkdir("deep-deep", dir_fd=here)
            below = os.open("deep-deep", os.O_RDONLY, dir_fd=here)
            os.close(here)
            here = below
        os.close(here)
    else:
        place = rng.choice([folder / "tests.csv", folder / "campaign.toml", *exports(folder)[:1], folder / "notes.bin"])
        with place.open("ab") as out:
            out.truncate(rng.choice([3 << 30, 64 << 30, 8 << 40]))


NUMBERS = ("inf", "-inf", "nan", "1e308", "-1e308", "1e-320", "1e999", "", "NaN", "0x1p9", "9" * 400, "1_0", "--1", "1e15")


@kind("records: numbers", 30)
def odd_numbers(drop: Path, name: str, rng: random.Random) -> None:
    folder = copied(drop, name)
    for export in exports(folder)[: rng.randint(1, 4)]:
        lines = export.read_text(encoding="utf-8", errors="replace").splitlines()
        value = rng.choice(NUMBERS)
        share = rng.choice([0.01, 0.3, 1.0])
        for k in range(len(lines) // 4, len(lines)):
            if rng.random() < share:
                lines[k] = re.sub(r"[-+]?\d[\d.,eE+-]*(?=\D*$)", lambda _, v=value: v, lines[k])
        export.write_text("\n".join(lines))


@kind("records: bytes", 34)
def odd_bytes(drop: Path, name: str, rng: random.Random) -> None:
    folder = copied(drop, name)
    for export in exports(folder)[: rng.randint(1, 4)]:
        plain = export.read_bytes()
        content = rng.choice([
            lambda plain: plain[: rng.randrange(len(plain))], lambda plain: plain.replace(b"\n", b" "),
            lambda plain: b"1.0," * 8_000_000, lambda plain: plain + b"\0" * 5_000_000, lambda plain: rng.randbytes(300_000),
            lambda plain: plain.replace(b"\n", b"\r"), lambda plain: plain[::-1], lambda plain: plain * 60,
            lambda plain: b"\n".join(sorted(plain.split(b"\n"))), lambda plain: b"\x89HDF\r\n\x1a\n" + plain,
            lambda plain: b"PK\3\4" + plain, lambda plain: b"\x1f\x8b\x08" + plain, lambda plain: b"%PDF-1.7\n" + plain,
            lambda plain: b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + plain, lambda plain: b"MATLAB 5.0 MAT-file" + bytes(200),
            lambda plain: b"TDSm" + rng.randbytes(4_000), lambda plain: b"\x93NUMPY\1\0" + plain,
            lambda plain: b"\x80\4cos\nsystem\n(S'tribocanary'\ntR.", lambda plain: plain.replace(b".", b","),
            lambda plain: b"<?xml version='1.0'?>" + b"<a>" * 300_000, lambda plain: b"{" * 300_000, lambda plain: b'"' + plain,
        ])(plain)  # fmt: skip
        export.write_bytes(content)


@kind("files that tools might run or read", 12)
def start_files(drop: Path, name: str, rng: random.Random) -> None:
    folder = copied(drop, name)
    code = f'import os; os.system("{COMMAND}")\n'
    for module in ("sitecustomize", "usercustomize", "numpy", "tribo", "conftest", "json", "pandas", "Snakefile", "snakefile"):
        (folder / (module if module.lower() == "snakefile" else f"{module}.py")).write_text(code)
    (folder / "matplotlibrc").write_text("backend: module://numpy\n")
    (folder / "config.yaml").write_text(f"!!python/object/apply:os.system ['{COMMAND}']\n")
    (folder / "law-1.toml").write_text(f'[law]\nformula = "__import__(\'os\').system(\'{COMMAND}\')"\n')
    (folder / "raw" / "x.pkl").write_bytes(b"cos\nsystem\n(S'tribocanary'\ntR.")


@kind("overrides beside the campaign", 10)
def overrides(drop: Path, name: str, rng: random.Random) -> None:
    copied(drop, name)
    beside = drop / f"{name}.overrides.csv"
    if rng.random() < 0.2:
        beside.symlink_to("/dev/zero")
        return
    rows = "\n".join(f"{rng.choice(['T001', 'x', '*'])},{rng.choice(['exclude', 'move', 'rm'])},{rng.choice(HOSTILE_TEXTS)!r},"
                     f"{rng.choice(NUMBERS)},{rng.choice(NUMBERS)},{rng.choice(NUMBERS)}" for _ in range(4))  # fmt: skip
    text = "test_id,action,reason,window_start_s,window_end_s,peak_s\n" + rows + "\n"
    beside.write_bytes(rng.choice([text.encode("utf-8", "surrogatepass"), b"\0" * 5_000, b"," * 3_000_000, text.encode("utf-16", "replace")]))


@kind("results that are there already", 12)
def forged(drop: Path, name: str, rng: random.Random) -> None:
    """Results beside the campaign and, as if a foreign hand had been in the site, in its place in the site."""
    folder = copied(drop, name)
    content = rng.choice([b"{}", b"\x89PNG\r\n\x1a\nIHDR", rng.randbytes(3_000), b'{"verdict": "named", "causes": []}',
                          b"\x80\4cos\nsystem\n(S'tribocanary'\ntR.", b"", b"[" * 100_000])  # fmt: skip
    for place in (folder / "out", drop.parent / "run" / "site" / "current" / name):
        (place / "kept").mkdir(parents=True)
        for file in ("verdict.json", "fits.csv", "campaign.nc", "provenance.json", "report.html", "kept/report.pickle",
                     "kept/alone.pickle", "kept/F@5000Pa.nc", "kept/finding.png", "kept/assessment.pickle"):  # fmt: skip
            (place / file).write_bytes(content)


@kind("a file that grows while it is read", 2)
def growing(drop: Path, name: str, rng: random.Random) -> None:
    copied(drop, name)


# ------------------------------------------------------------------------------------------------------------- the run


def draw_folder(base: Path, hostile: int, good: int, seed: int) -> dict[str, str]:
    """The drop folder: the kind of every campaign by its name as the index shows it."""
    drop = base / "drop"
    drop.mkdir()
    template(base / "template")
    (base / "secret.txt").write_text(f"{SECRET}\n1,2\n")
    for k in range(good):
        write_campaign(
            drop / f"good {k:02d}", SledDesign({"F": SMALL_LAWS["F"]}, masses_g=(25.0, 138.5), specimens=2, repeats=1),
            FLAT_TOML.format(title=f"good {k}", more="slider_mass_g = 1.5"), seed=1_000 * seed + k,
        )  # fmt: skip
    rng = random.Random(seed)
    labels = list(KINDS)
    each = [labels[k] for k in range(min(hostile, len(labels)))]  # every kind once
    each += rng.choices(labels, [KINDS[label][0] for label in labels], k=hostile - len(each))
    kinds = {f"good {k:02d}": "good" for k in range(good)}
    for k, label in enumerate(each):
        before = set(os.listdir(os.fsencode(drop)))
        KINDS[label][1](drop, f"h-{k:03d}", random.Random(f"{seed} {k}"))
        for raw in set(os.listdir(os.fsencode(drop))) - before:
            if not raw.endswith(b".overrides.csv"):
                kinds[os.fsdecode(raw)] = label
    return kinds


class Watch(threading.Thread):
    """The highest memory of every process below this one, and a file that grows meanwhile."""

    def __init__(self, growing_files: list[Path]):
        super().__init__(daemon=True)
        self.peak_gb: dict[int, tuple[float, str]] = {}
        self.growing_files, self.ended = growing_files, False

    def run(self) -> None:
        import psutil

        own = psutil.Process()
        while not self.ended:
            for child in own.children(recursive=True):
                try:
                    status = Path(f"/proc/{child.pid}/status").read_text()
                    peak = int(re.search(r"VmHWM:\s+(\d+)", status)[1]) * 1024 / 1e9  # type: ignore[index]
                    if peak >= self.peak_gb.get(child.pid, (0.0, ""))[0]:
                        self.peak_gb[child.pid] = peak, child.name()
                except (OSError, TypeError, psutil.Error):
                    continue
            for file in self.growing_files:
                with file.open("ab") as out:
                    out.write(b"1,2,3\n")
            time.sleep(0.03)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hostile", type=int, default=500)
    parser.add_argument("--good", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="Keep drop folder and site here.")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="tribo-hostile-") as folder:
        base = given.keep or Path(folder)
        base.mkdir(parents=True, exist_ok=True)
        return run(base, given.hostile, given.good, given.seed)


def run(base: Path, hostile: int, good: int, seed: int) -> int:
    (base / "bin").mkdir()
    mark = base / RUN_MARK
    (base / "bin" / COMMAND).write_text(f"#!/bin/sh\necho run >> {mark}\n")
    (base / "bin" / COMMAND).chmod(0o755)
    os.environ["PATH"] = f"{base / 'bin'}:{os.environ['PATH']}"
    kinds = draw_folder(base, hostile, good, seed)
    warm = str(template(base / "warm-campaign"))
    where = (warm, "-o", "out")
    processes._warm(base, ("report", *where, *processes.REPORT[4:]), ("ingest", *where))
    for module in processes.OF_A_BUILD:
        import_module(module)
    (base / "run" / "site" / ".tribo").mkdir(parents=True, exist_ok=True)  # known as a site of tribo
    script = stand_in_for_python(base)
    words = ("build", "../drop", "-o", "site", "--settle", "0", "--runs", "2", "--jobs", "1", "--json",
             "--most-minutes", str(MOST_MINUTES), "--most-gigabytes", str(MOST_GIGABYTES))  # fmt: skip
    began = time.monotonic()
    command = processes.start(base / "run", *words, script=script)
    watch = Watch([p for name, label in kinds.items() if label.startswith("a file that grows")
                   for p in exports(base / "drop" / name)[:1]])  # fmt: skip
    watch.start()
    status = command.wait()
    took = time.monotonic() - began
    watch.ended = True
    watch.join()
    return judged(base, kinds, command.said.read_text(errors="replace"), status, took, watch)


def judged(base: Path, kinds: dict[str, str], said: str, status: int | None, took: float, watch: Watch) -> int:
    """Print the counts; 1 where one is not as it must be."""
    state, site = base / "run" / "site" / ".tribo", base / "run" / "site"
    answer = json.loads(said[said.index("\n{") if not said.startswith("{") else 0 :][: said.rindex("}") + 1]) if "{" in said else {}
    index = (site / "current" / "index.html").read_text(errors="replace") if (site / "current" / "index.html").is_file() else ""
    body = index.partition("<tbody>")[2].partition("</tbody>")[0]
    rows = Counter(" ".join(unescape(re.sub(r"<[^>]+>", " ", part.partition("</td>")[0])).split()) for part in body.split("<tr>")[1:])
    outcome: dict[str, Counter[str]] = defaultdict(Counter)
    faults: list[str] = []
    from tribo.user_text import well_formed

    for name, label in kinds.items():
        stem = name[:-4] if name.lower().endswith(".zip") else name
        shown = [well_formed(n) for n in (stem, name)]
        found = next((answer["status"][n] for n in shown if n in answer.get("status", {})), "no answer")
        if any(n in answer.get("waiting", {}) for n in shown):
            found = "postponed"
        outcome[label][found] += 1
        if label == "good" and found != "done":
            faults.append(f"{name}: good, and {found}")
        if found in ("no answer", "not built yet"):
            faults.append(f"{label}: {name!r}: {found}")
    if sum(rows.values()) < len(answer.get("status", {})):
        faults.append(f"{sum(rows.values())} rows of the index for {len(answer.get('status', {}))} campaigns")
    records = [json.loads(p.read_text()) for p in state.glob("steps/*/*.json")]
    longest = max((r.get("seconds", 0.0) for r in records), default=0.0)
    if longest > 60.0 * MOST_MINUTES + ENDING_S:
        faults.append(f"a step took {longest:.0f} s")
    peak, which = max(watch.peak_gb.values(), default=(0.0, ""))
    if peak > MOST_GIGABYTES:
        faults.append(f"a process took {peak:.2f} GB ({which})")
    if (base / RUN_MARK).exists():
        faults.append(f"a command was run {len((base / RUN_MARK).read_text().splitlines())} times")
    told = [p for p in site.rglob("*") if p.is_file() and not p.is_symlink() and SECRET.encode() in p.read_bytes()]
    faults += [f"the secret is in {p}" for p in told]
    texts = {"the build": said} | {str(p.relative_to(state)): p.read_text(errors="replace") for p in state.rglob("*.log")}
    texts |= {r["command"][2]: json.dumps(r["problems"]) for r in records}
    broken = {k: t for k, t in texts.items() if "Traceback (most" in t or "panicked at" in t or "error in tribo" in t}
    faults += [f"traceback or error of tribo: {k}: {t.strip().splitlines()[-1][-300:]}" for k, t in broken.items()]
    problems = [p for r in records for p in r["problems"]]
    print(f"build: exit status {status}, {took:.0f} s, {len(records)} steps, {len(watch.peak_gb)} processes")
    print(f"highest memory of a process {peak:.2f} GB; longest step {longest:.1f} s")
    print("ended by limits:", dict(Counter(p["kind"] for p in problems if p["kind"].startswith(("over_", "crash")))))
    if status not in (0, 3):
        faults.append(f"the build ended with {status}: {said[-1500:]}")
    print("| kind | campaigns | built | some tests set aside | unusable | postponed | other |\n|---|---|---|---|---|---|---|")
    for label, count in sorted(outcome.items()):
        known = ("done", "some_set_aside", "unusable", "postponed")
        rest = sum(count.values()) - sum(count[k] for k in known)
        print(f"| {label} | {sum(count.values())} | {' | '.join(str(count[k]) for k in known)} | {rest} |")
    print(f"{len(faults)} faults")
    for fault in faults:
        print(f"- {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
