"""Five kinds of input as people, spreadsheets, failing disks and attackers write them, and what must come of each.

Every case starts from a clean input whose numbers are known. It is written in another spelling of the same, or one
value of it is replaced, or its bytes are damaged. A check then reads it and returns what happened: "same", "refused"
(with problems), "in part" (some tests are set aside with problems) or "changed" (accepted, and exactly what an
independent reading of the text says). Whatever else is accepted is wrong in silence: it raises :class:`DifferentError`.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import struct
import tomllib
import zipfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from tribo.campaign import load_campaign, open_campaign
from tribo.errors import CampaignError, Problem, SimulationError
from tribo.ingestion.overrides import TIMES, apply_overrides, read_overrides
from tribo.records import Campaign, Ingested, Test
from tribo.springblock.design_file import read_design, runs_of_design

Draw = Callable[[Any], Any]
SAME, REFUSED, IN_PART, CHANGED = "same", "refused", "in part", "changed"
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?")


class DifferentError(AssertionError):
    """Something was accepted that is not what the input says."""


TOML = """\
[campaign]
title = "clean"
nominal_area_mm2 = 55.0
slider_mass_g = 1.5
pull_speed_mm_s = 0.2

[patterns.F]
cavity = "none"

[patterns.A]
cavity = "circle"
diameter_um = 5.0
pitch_um = [20.0, 25.0]

[instrument]
load_cell_u_percent = 0.5
"""
COLUMNS = (
    "test_id", "file", "sample", "specimen", "mass_g", "normal_load_N", "speed_mm_s", "hold_s", "repeat", "started_at",
    "temperature_C", "operator", "glove",
)  # fmt: skip
ROWS = tuple(
    dict(zip(COLUMNS, row.split(","), strict=True))
    for row in (
        "001,raw/1.csv,F,F1,,0.5,0.2,10,1,2026-03-02T09:00:00,22.5,op1,latex",
        "1,raw/2.csv,F,F2,50,,0.2,10,2,2026-03-02T09:10:00,22.4,op2,nitrile",
        "1.0,raw/3.csv,Ax,A1,,1.5,,10,1,2026-03-03,-1.5,op1,-",
        "T4,raw/4.csv,A,A2,139,,0.1,,2,,,,",
        "1e5,raw/5.csv,F,001,,0.75,0.2,0,3,2026-03-02T09:20:00+01:00,22,op 3,none",
    )
)
EXPORT = "Time (s),Force (N)\n" + "".join(f"{k / 10},{k % 7}\n" for k in range(30))
HOSTILE_TEXTS = (
    "", " ", "nan", "inf", "-inf", "None", "True", "NaN", "1e300", "1e308", "1e309", "5e-324", "-1", "0", "-0", "1_000",
    "0x10", "1,5", "1.5", "1.5.2", "½", "١٢", "１.５", "\x00", "a\x00b", "\x1b[31mred", "\x9b31m", "\u202etxt", "=1+1",
    "@SUM(A1)", "-2+3", "+1", "../../etc/passwd", "/dev/zero", "raw", "raw/1.csv", "raw/1.csv#*", "raw/1.csv#9/9",
    "C:\\x", "CON", "A|B", "$\\frac$", "<script>", "{x}", "%s", "a\nb", 'a"b', "a'b", "001", "1", "F", "Sx", "x" * 200,
    "y" * 20_000, "yesterday", "2026-13-45", "31/12/2025", "03/04/2026", "2026-03-02", "9" * 400, "#", "#2/3", "\ufeff",
    "e" * 5 + "\u0301" * 50, "__proto__",
)  # fmt: skip
TEXT = st.one_of(
    st.sampled_from(HOSTILE_TEXTS),
    st.text(st.characters(exclude_categories=["Cs"]), max_size=30),
    st.floats().map(repr),
    st.integers(-(10**20), 10**20).map(str),
)
INSERTED = (
    b'"', b"'", b"\0", b"\x1b[31m", b"\n", b"\r", b",", b";", b"\t", b"\xff", b"\xef\xbb\xbf", b"\xff\xfe", b"=", b"[",
    b"[" * 300, b"{", b"#", b"\\", b"1e300", b"nan", b"0", b".", b"-", b"\xe9", b"\xf0\x9f\x98\x80", b'"""', b"\n\n",
)  # fmt: skip


def damaged(draw: Draw, content: bytes) -> bytes:
    """Bytes after one to three accidents: a byte flipped, something inserted, removed, repeated, or the end cut off.

    One accident in five is a pair of quotation marks at the beginning of two cells, which hides what is between them.
    """
    if draw(st.integers(0, 4)) == 0:
        begins = [k + 1 for k, byte in enumerate(content) if byte in b",;\t\n="]
        for at in sorted(draw(st.lists(st.sampled_from(begins), min_size=1, max_size=2)), reverse=True):
            content = content[:at] + b'"' + content[at:]
        return content
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, max(len(content) - 1, 0)))
        length = draw(st.integers(1, 40))
        kind = draw(st.sampled_from(("flip", "insert", "remove", "repeat", "cut")))
        if kind == "flip":
            content = content[:at] + bytes([draw(st.integers(0, 255))]) + content[at + 1 :]
        elif kind == "insert":
            content = content[:at] + draw(st.sampled_from(INSERTED)) + content[at:]
        elif kind == "remove":
            content = content[:at] + content[at + length :]
        elif kind == "repeat":
            content = content[: at + length] + content[at:]
        else:
            content = content[:at]
    return content


def number_in(text: str) -> float | None:
    """The number that a cell says, read apart from tribo; None where it says none that is finite."""
    if not _NUMBER.fullmatch(text.strip()):
        return None
    value = float(Decimal(text.strip()))
    return value if math.isfinite(value) else None


def write_clean(folder: Path) -> Path:
    """The clean campaign in a folder."""
    (folder / "raw").mkdir(parents=True, exist_ok=True)
    for k in range(1, 6):
        (folder / "raw" / f"{k}.csv").write_text(EXPORT)
    (folder / "campaign.toml").write_text(TOML)
    (folder / "tests.csv").write_bytes(spelled(ROWS, COLUMNS, ","))
    return folder


def spelled(rows: Sequence[Mapping[str, str]], names: Sequence[str], delimiter: str, **style: Any) -> bytes:
    """Rows as a table of text in UTF-8."""
    out = io.StringIO()
    writer = csv.DictWriter(out, names, delimiter=delimiter, **{"lineterminator": "\n", **style})
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue().encode()


def loaded(folder: Path) -> Campaign | tuple[Problem, ...]:
    """A campaign, or the problems it is refused with."""
    try:
        return load_campaign(folder)
    except CampaignError as why:
        return refused(why.problems)


def refused(problems: Sequence[Problem]) -> tuple[Problem, ...]:
    """The problems of a refusal: at least one, each a sentence of bounded length that a terminal can show."""
    if not problems or any(not p.what or len(str(p)) > 4000 for p in problems):
        raise DifferentError(f"a refusal that says nothing, or too much: {problems!r:.300}")
    return tuple(problems)


def same_test(found: Test, clean: Test) -> bool:
    """Whether two tests are alike in all but the line they are in."""
    return all(
        _alike(getattr(found, f.name), getattr(clean, f.name)) for f in fields(Test) if f.name not in ("row", "exclude")
    )


def _alike(one: Any, other: Any) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return one == other or math.isclose(one, other, rel_tol=1e-12) or (math.isnan(one) and math.isnan(other))
    return bool(one == other)


def compare_tests(found: Campaign, clean: Campaign, touched: set[str] = frozenset()) -> str:  # type: ignore[assignment]
    """How the tests of a campaign differ from the clean ones; only ``touched`` ones may have other values."""
    known = {t.test_id: t for t in clean.tests}
    tests = {t.test_id: t for t in found.tests}
    said = {s.test_id for s in found.set_aside if s.problems}
    outcome = SAME
    for test_id, test in known.items():
        if test_id in touched:
            continue
        if test_id in tests and not same_test(tests[test_id], test):
            raise DifferentError(f"test {test_id} is {tests[test_id]}, not {test}")
        if test_id not in tests:
            outcome = IN_PART
            if test_id not in said:
                raise DifferentError(f"test {test_id} is lost and nothing says so")
    return outcome


# ------------------------------------------------------------------------------------------------------- tests.csv


def check_tests_csv(draw: Draw, folder: Path) -> str:
    """One tests.csv: spelled otherwise, with one cell replaced, or damaged."""
    clean = load_campaign(write_clean(folder))
    way = draw(st.sampled_from(("spelled", "cell", "bytes")))
    if way == "spelled":
        (folder / "tests.csv").write_bytes(_another_spelling(draw))
        found = loaded(folder)
        if isinstance(found, tuple) or compare_tests(found, clean) != SAME:
            raise DifferentError(f"another spelling of the same table is not read alike: {found!r:.500}")
        return SAME
    if way == "cell":
        return _one_cell(draw, folder, clean)
    content = damaged(draw, (folder / "tests.csv").read_bytes())
    (folder / "tests.csv").write_bytes(content)
    return _after_damage(loaded(folder), clean, content)


def _another_spelling(draw: Draw) -> bytes:
    names = draw(st.permutations(COLUMNS))
    delimiter = draw(st.sampled_from(",;\t|"))
    rows = [dict(row) for row in ROWS]
    if delimiter != "," and draw(st.booleans()):
        for row in rows:
            row |= {n: row[n].replace(".", ",") for n in ("mass_g", "normal_load_N", "speed_mm_s", "temperature_C")}
    quoting = draw(st.sampled_from((csv.QUOTE_MINIMAL, csv.QUOTE_ALL)))
    text = spelled(rows, names, delimiter, quoting=quoting).decode()
    if draw(st.booleans()):
        text = text.replace("\n", "\n\n")
    text = text.replace("\n", draw(st.sampled_from(("\n", "\r\n"))))
    return text.encode(draw(st.sampled_from(("utf-8", "utf-8-sig", "utf-16", "cp1252"))))


def _one_cell(draw: Draw, folder: Path, clean: Campaign) -> str:
    place, name, cell = draw(st.integers(0, len(ROWS) - 1)), draw(st.sampled_from(COLUMNS)), draw(TEXT)
    rows = [dict(row) for row in ROWS]
    rows[place][name] = cell
    (folder / "tests.csv").write_bytes(spelled(rows, COLUMNS, ",", quoting=csv.QUOTE_ALL))
    found = loaded(folder)
    if isinstance(found, tuple):
        raise DifferentError(f"one cell {name} = {cell!r:.80} costs all tests: {found!r:.300}")
    before = ROWS[place]["test_id"]
    others = {row["test_id"] for row in ROWS} - {before}
    compare_tests(found, clean, {before})
    first, last = place + 2, place + 2 + len(cell.splitlines())  # lines of the file; a cell may hold line breaks
    (test,) = [t for t in found.tests if first <= t.row < max(last, first + 1) and t.test_id not in others] or [None]
    if test is None:
        if not any(s.problems for s in found.set_aside):
            raise DifferentError(f"the test with {name} = {cell!r:.80} is lost and nothing says so")
        return IN_PART
    noted = any(p.kind == "not_recorded" and p.column == name for p in found.problems)
    _check_cell(test, name, cell.strip(), noted)
    return CHANGED


def _check_cell(test: Test, name: str, cell: str, noted: bool) -> None:
    """A test that was accepted has what its cell says; a word in place of a number is no value, and ``noted`` so."""
    if name in ("test_id", "sample", "operator"):
        said: Any = getattr(test, name)
        expected: Any = cell
    elif name == "specimen":
        said, expected = test.specimen, cell or test.sample
    elif name == "glove":
        said, expected = test.covariates["glove"], cell
    elif name in ("hold_s", "repeat", "temperature_C", "normal_load_N"):
        said, expected = getattr(test, name), number_in(cell) if cell else None
        if name == "normal_load_N" and expected is None:
            return
        if cell and expected is None and (said is not None or not noted):
            raise DifferentError(f"{name} = {cell!r} is taken as {said!r}")
    else:
        return
    if not (said == expected or (isinstance(said, float) and isinstance(expected, float) and _alike(said, expected))):
        raise DifferentError(f"{name} = {cell!r:.80} is taken as {said!r:.80}")


def _after_damage(found: Campaign | tuple[Problem, ...], clean: Campaign, content: bytes) -> str:
    """Tests whose line and header are untouched keep their values; none is lost without a word."""
    if isinstance(found, tuple):
        return REFUSED
    lines = content.split(b"\n")
    before = spelled(ROWS, COLUMNS, ",").split(b"\n")
    if lines[0] != before[0] or content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return CHANGED  # other columns are another table
    untouched = {row["test_id"] for row, line in zip(ROWS, before[1:], strict=False) if line in lines}
    others = {t.test_id for t in clean.tests} - untouched
    tests = {t.test_id: t for t in found.tests}
    known = {t.test_id: t for t in clean.tests}
    for test_id in untouched & set(tests):
        if not same_test(tests[test_id], known[test_id]) and lines.count(before[1 + _place(test_id)]) == 1:
            raise DifferentError(f"the line of {test_id} is untouched and read as {tests[test_id]}")
    lost = untouched - set(tests) - {s.test_id for s in found.set_aside if s.problems}
    if lost and not any(s.problems for s in found.set_aside):
        raise DifferentError(f"tests {lost} are lost and nothing says so")
    return SAME if not others and set(tests) == set(known) else IN_PART


def _place(test_id: str) -> int:
    return next(k for k, row in enumerate(ROWS) if row["test_id"] == test_id)


# --------------------------------------------------------------------------------------------------- campaign.toml

HOSTILE_VALUES = (
    "0", "-1", "1e300", "1e-300", "5e-324", "nan", "inf", "-inf", "true", '""', '"x"', '"\\u001b[31m"', '"\\u0000"',
    "[]", "[1.0]", "[1.0, 2.0]", "[1.0, 2.0, 3.0]", "[[1.0]]", "{}", "{ a = 1 }", "9" * 300, "9" * 5000, "2026-03-02",
    "2026-13-45", "'none'", "'circle'", "'A|B'", "'$\\frac$'", '"""a\nb"""', "1_000.5", "0x1F", "[" * 60 + "]" * 60,
    "[" * 5000 + "]" * 5000, "55", "5.5e1", "1e15", "1e16",
)  # fmt: skip


def check_campaign_toml(draw: Draw, folder: Path) -> str:
    """One campaign.toml: spelled otherwise, with one value replaced, or damaged."""
    clean = load_campaign(write_clean(folder))
    file = folder / "campaign.toml"
    way = draw(st.sampled_from(("spelled", "value", "bytes")))
    if way == "spelled":
        file.write_text(_another_toml(draw), encoding=draw(st.sampled_from(("utf-8", "utf-8-sig"))))
    elif way == "value":
        lines = TOML.splitlines()
        at = draw(st.sampled_from([k for k, line in enumerate(lines) if "=" in line]))
        value = draw(st.one_of(st.sampled_from(HOSTILE_VALUES), st.floats().map(repr)))
        lines[at] = f"{lines[at].split('=')[0]}= {value}"
        file.write_text("\n".join(lines) + "\n")
    else:
        file.write_bytes(damaged(draw, file.read_bytes()))
    found = loaded(folder)
    if isinstance(found, tuple):
        if way == "spelled":
            raise DifferentError(f"another spelling of the same description is refused: {found!r:.500}")
        return REFUSED
    table = tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    if wrong := _unlike(found, table):
        raise DifferentError(wrong)
    same = described(found) == described(clean) and compare_tests(found, clean, set(_ids(clean))) == SAME
    if way == "spelled" and not same:
        raise DifferentError("another spelling of the same description is read otherwise")
    return SAME if same else CHANGED


def _ids(campaign: Campaign) -> list[str]:
    return [t.test_id for t in campaign.tests]


def described(campaign: Campaign) -> tuple[Any, ...]:
    """The numbers of a description as tribo holds them."""
    samples = {name: replace(p, name=p.name) for name, p in sorted(campaign.samples.items())}
    numbers = campaign.nominal_area_m2, campaign.slider_mass_kg, campaign.pull_speed_m_s
    return (campaign.title, *numbers, samples, dict(campaign.instrument))


def _unlike(found: Campaign, table: Mapping[str, Any]) -> str:
    """What a campaign holds otherwise than its TOML says, read apart from tribo; empty where nothing."""
    general = table["campaign"]
    pairs = {
        "nominal_area_mm2": (found.nominal_area_m2, 1e-6 * general["nominal_area_mm2"]),
        "slider_mass_g": (found.slider_mass_kg, 1e-3 * general.get("slider_mass_g", 0.0)),
        "pull_speed_mm_s": (found.pull_speed_m_s or 0.0, 1e-3 * general.get("pull_speed_mm_s", 0.0)),
    }
    for sample, pattern in found.samples.items():
        given = table["patterns"].get(sample) or table["patterns"][sample[:-1]]
        for key, held in (("diameter_um", pattern.size_m), ("size_um", pattern.size_m), ("pitch_um", pattern.pitch_m)):
            if key in given and held is not None:
                x, y = given[key] if isinstance(given[key], list) else (given[key], given[key])
                pairs |= {f"{sample}.{key}.x": (held[0], 1e-6 * x), f"{sample}.{key}.y": (held[1], 1e-6 * y)}
    for key, value in table.get("instrument", {}).items():
        pairs[key] = (found.instrument[key], value)
    wrong = [name for name, (held, said) in pairs.items() if not math.isclose(held, said, rel_tol=1e-12)]
    beyond = [name for name, (held, _) in pairs.items() if held and not 1e-30 < abs(held) < 1e18]
    if found.title != general["title"]:
        wrong.append("title")
    return f"held otherwise than written: {wrong}; beyond all measure: {beyond}" if wrong or beyond else ""


def _another_toml(draw: Draw) -> str:
    """The clean description with other line breaks, comments, orders, numbers and kinds of tables."""
    text = TOML
    numbers = {"55.0": ("55", "5.5e1", "5_5.0", "+55.00"), "0.2": ("2e-1", "0.20"), "5.0\n": ("5\n",)}
    for plain, others in numbers.items():
        text = text.replace(plain, draw(st.sampled_from((plain, *others))), 1)
    if draw(st.booleans()):
        text = text.replace('[patterns.A]\ncavity = "circle"', "[patterns.'A']\ncavity = 'circle'")
    blocks = []
    for block in draw(st.permutations(text.strip().split("\n\n"))):
        head, *keys = block.split("\n")
        blocks.append("\n".join([head, *draw(st.permutations(keys))]))
    text = draw(st.sampled_from(("\n\n", "\n", "\n\n# =[\n"))).join(blocks) + "\n"
    return text.replace("\n", draw(st.sampled_from(("\n", "\r\n", " # comment\n")))) if '"""' not in text else text


# --------------------------------------------------------------------------------------------------- overrides.csv

OVERRIDES = ("test_id", "action", "reason", "window_start_s", "window_end_s", "peak_s")


def check_overrides(draw: Draw, folder: Path, ingested: Ingested) -> str:
    """One overrides.csv for a campaign that has been read."""
    ids = list(ingested.pulls)[:4]
    end = min(float(ingested.traces[i].time_s[-1]) for i in ids)
    rows = [dict.fromkeys(OVERRIDES, "") | {"test_id": i, "action": "exclude", "reason": f"why {i}"} for i in ids[:2]]
    rows.append(dict.fromkeys(OVERRIDES, "") | {"test_id": ids[2], "action": "move", "peak_s": f"{0.4 * end:.3f}"})
    window = {"window_start_s": f"{0.5 * end:.3f}", "window_end_s": f"{0.9 * end:.3f}"}
    rows.append(dict.fromkeys(OVERRIDES, "") | {"test_id": ids[3], "action": "move", **window})
    file = folder / "overrides.csv"
    way = draw(st.sampled_from(("spelled", "cell", "bytes")))
    names = draw(st.permutations(OVERRIDES)) if way == "spelled" else OVERRIDES
    delimiter = draw(st.sampled_from(",;\t")) if way == "spelled" else ","
    clean = spelled(rows, names, delimiter)
    place = draw(st.integers(0, 3))
    if way == "cell":
        rows[place] = rows[place] | {draw(st.sampled_from(OVERRIDES)): draw(TEXT)}
        file.write_bytes(spelled(rows, names, ",", quoting=csv.QUOTE_ALL))
    else:
        file.write_bytes(damaged(draw, clean) if way == "bytes" else clean)
    try:
        found = read_overrides(file, ingested)
        apply_overrides(ingested, file, "first_peak")
    except CampaignError as why:
        if way == "spelled":
            raise DifferentError(f"a clean table is refused: {why}") from why
        refused(why.problems)
        return REFUSED
    if way != "bytes":
        _same_decisions(found, rows)
        return CHANGED if way == "cell" else SAME
    lines = file.read_bytes().split(b"\n")
    expected = {row["test_id"]: row for row, line in zip(rows, clean.split(b"\n")[1:], strict=False) if line in lines}
    if lines[0] == clean.split(b"\n")[0]:
        kept = [one for one in found if one.test_id in expected]
        _same_decisions(kept, [expected[one.test_id] for one in kept])
    return IN_PART


def _same_decisions(found: Sequence[Any], rows: Sequence[Mapping[str, str]]) -> None:
    """Every decision is what its row says."""
    if len(found) != len(rows):
        raise DifferentError(f"{len(rows)} decisions are read as {len(found)}")
    for one, row in zip(found, rows, strict=True):
        given = {name: number_in(row[name]) for name in TIMES if row[name].strip()}
        window = (given["window_start_s"], given["window_end_s"]) if "window_start_s" in given else None
        if (one.test_id, one.action) != (row["test_id"].strip(), row["action"].strip()):
            raise DifferentError(f"{row} is read as {one}")
        if one.action == "move" and (one.window_s, one.peak_s) != (window, given.get("peak_s")):
            raise DifferentError(f"{row} is read as {one}")


# -------------------------------------------------------------------------------------------------------- designs

MOST_COMPARED = 5_000  # runs of a design that are laid out again to be compared
DESIGN: Mapping[str, Any] = {
    "samples": ["F", "B"], "pressures_kPa": [5.0, 10.0], "angles_deg": "midpoints", "repeats": 2, "seed": 3,
    "parameters": {"dt_s": [5e-8, 2.5e-8], "blocks": [20, 30], "engine": "fast"},
}  # fmt: skip
HOSTILE_PARTS: tuple[Any, ...] = (
    None, True, 0, -1, 1e9, 10**9, 10**30, 10**400, 1e300, 5e-324, "", "x", "midpoints", "random", [], {}, [[]], [{}],
    [1.0], ["F"], ["F", "F"], ["\x1b[31m"], ["F"] * 3, [1e300], [-1.0], [0.0], {"dt_s": []}, {"dt_s": [5e-8] * 50},
    {"blocks": [10**9, 10**9]}, {"blocks": 10**400}, {"duration_s": 1e12}, {"nonsense": 1}, {"engine": ["fast", "x"]},
    {"spacing_m": 1e-300}, {"spacing_m": 1e300}, {"mu_s": "0.5"}, [0.1] * 2000, {"seed": 3}, {"edges": "periodic"},
)  # fmt: skip


AXES: Mapping[str, Any] = {
    "dt_s": st.floats(1e-9, 2e-8), "mu_s": st.floats(0.5, 2.0), "engine": st.sampled_from(("fast", "reference")),
    "shear_factor": st.floats(0.1, 1.0),
}  # fmt: skip
OTHER_DESIGN: Mapping[str, Any] = {
    "samples": st.lists(st.sampled_from(("F", "A", "B")), min_size=1, max_size=3, unique=True),
    "pressures_kPa": st.lists(st.floats(0.5, 40.0), min_size=1, max_size=3, unique=True),
    "angles_deg": st.sampled_from(("midpoints", "random", "nominal")),
    "repeats": st.integers(1, 4),
    "seed": st.integers(0, 2**63 - 1),
    "parameters": st.fixed_dictionaries(
        {}, optional={name: values | st.lists(values, min_size=1, max_size=3, unique=True)
                      for name, values in AXES.items()},
    ),
}  # fmt: skip


def check_design(draw: Draw, folder: Path) -> str:
    """One design file, as TOML or JSON."""
    table = dict(DESIGN)
    way = draw(st.sampled_from(("spelled", "other", "value", "bytes")))
    if way == "other":
        table |= draw(st.fixed_dictionaries({}, optional=OTHER_DESIGN))
    suffix = draw(st.sampled_from((".json", ".toml")))
    if way == "value":
        key = draw(st.sampled_from((*DESIGN, "patterns", "unknown")))
        table[key] = draw(st.one_of(st.sampled_from(HOSTILE_PARTS), st.integers(), st.floats(), st.text(max_size=10)))
        suffix = ".json"  # TOML has no null
    text = json.dumps(table, indent=draw(st.sampled_from((None, 1)))) if suffix == ".json" else _as_toml(table)
    content = damaged(draw, text.encode()) if way == "bytes" else text.encode("utf-8", errors="replace")
    file = folder / f"design{suffix}"
    file.write_bytes(content)
    try:
        runs = read_design(file)
    except SimulationError as why:
        if way in ("spelled", "other"):
            raise DifferentError(f"a clean design is refused: {why}") from why
        refused(why.problems)
        return REFUSED
    if len(runs) > MOST_COMPARED:
        return CHANGED
    decoded = content.decode("utf-8-sig")
    written = json.loads(decoded) if suffix == ".json" else tomllib.loads(decoded)
    if runs != runs_of_design({"seed": 0, **written}):
        raise DifferentError("a design is read otherwise than written")
    _laid_out(written, runs)
    return SAME if runs == runs_of_design(DESIGN) else CHANGED


def _laid_out(written: Mapping[str, Any], runs: Sequence[Any]) -> None:
    """Every combination of what is written is among the runs, each as often as the others, and nothing else."""
    parameters = written.get("parameters", {})
    axes = {name: value for name, value in parameters.items() if isinstance(value, list) and name != "blocks"}
    blocks = parameters.get("blocks")
    axes |= {"blocks": blocks} if isinstance(blocks, list) and any(isinstance(b, list) for b in blocks) else {}
    samples = list(dict.fromkeys(written["samples"]))
    angles = written.get("angles_deg", "midpoints")
    count = len(samples) * len(written["pressures_kPa"]) * int(written.get("repeats", 4))
    count *= math.prod(len(axis) for axis in axes.values()) * (len(angles) if isinstance(angles, list) else 1)
    if len(runs) != count:
        raise DifferentError(f"{count} runs are written and {len(runs)} are laid out")
    said = {"sample": samples, "pressure_Pa": [1e3 * p for p in written["pressures_kPa"]]}
    said |= {name: value if name in axes else [value] for name, value in parameters.items() if name != "blocks"}
    for name, values in said.items():
        found = Counter(_value_of(run, name) for run in runs)
        if set(found) != set(values) or (len(set(values)) == len(values) and len(set(found.values())) > 1):
            raise DifferentError(f"{name}: {values} are written and {dict(found)} are laid out")


def _value_of(run: Any, name: str) -> Any:
    """A parameter of a run, which may be one of its law of friction."""
    holder = next(part for part in (run, run.friction, run.terms) if hasattr(part, name))
    return getattr(holder, name)


def _as_toml(table: Mapping[str, Any]) -> str:
    lines = [f"{key} = {json.dumps(value)}" for key, value in table.items() if not isinstance(value, dict)]
    for key, value in table.items():
        if isinstance(value, dict):
            lines += [f"[{key}]", *(f"{name} = {json.dumps(part)}" for name, part in value.items())]
    return "\n".join(lines) + "\n"


# ----------------------------------------------------------------------------------------------------------- zips


WHEN = (2026, 3, 2, 9, 0, 0)  # of every entry: what is drawn must not depend on the clock
END = b"PK\5\6"
MARKED = st.tuples(st.binary(max_size=4), st.sampled_from((0, 4, 17, 18, 22)), st.integers(0, 8)).map(
    lambda parts: parts[0] + END + bytes(max(parts[1] - 2, 0)) + struct.pack("<H", parts[2]) + bytes(parts[2])
)  # comments that hold the mark of the end, with more or less of a record behind it


def zip_of(entries: Sequence[tuple[str, bytes, int]], comment: bytes) -> bytes:
    """A zip of entries (name, contents, method of compression): the same bytes at any time."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as out:
        for name, content, method in entries:
            out.writestr(zipfile.ZipInfo(name, WHEN), content, method)
        out.comment = comment
    return packed.getvalue()


def ends_of(content: bytes) -> set[int]:
    """Where the last record of a zip begins for programs that look for its mark from the end, and for programs
    that look for a record whose comment is as long as the record says (APPNOTE.TXT, 4.3.16).

    A comment that holds the mark leads them to different records, and so to different lists of entries.
    """
    marks = [found.start() for found in re.finditer(re.escape(END), content)]
    whole = [at for at in marks if at + 22 <= len(content)]
    fitting = [at for at in whole if at + 22 + int.from_bytes(content[at + 20 : at + 22], "little") == len(content)]
    return {*marks[-1:], *fitting} if fitting else set()


def check_zip(draw: Draw, folder: Path) -> str:
    """One campaign as a .zip: packed otherwise, or damaged."""
    clean = load_campaign(write_clean(folder / "clean"))
    below = [p for p in (folder / "clean").rglob("*") if p.is_file()]
    files = {p.relative_to(folder / "clean").as_posix(): p.read_bytes() for p in below}
    way = draw(st.sampled_from(("packed", "bytes", "bytes")))
    base = draw(st.sampled_from(("", "series/", "a/b c/", "prüf/")))
    methods = st.sampled_from((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    entries = [(base, b"", zipfile.ZIP_STORED)] if base and draw(st.booleans()) else []
    entries += [(base + name, files[name], draw(methods)) for name in draw(st.permutations(sorted(files)))]
    if draw(st.booleans()):
        entries.append((f"__MACOSX/{base}._tests.csv", b"\0\5\x16\7", zipfile.ZIP_STORED))
    packed = zip_of(entries, draw(MARKED if draw(st.integers(0, 9)) == 9 else st.binary(max_size=20)))
    content = damaged(draw, packed) if way == "bytes" else packed
    archive = folder / "campaign.zip"
    archive.write_bytes(content)
    readers_disagree = len(ends_of(content)) > 1
    try:
        with open_campaign(archive) as found:
            outcome = compare_tests(found, clean)
            if described(found) != described(clean):
                raise DifferentError("the description is read otherwise")
            for test in found.tests:
                if (found.root / test.file).read_bytes() != files[test.file]:
                    raise DifferentError(f"the export {test.file} has other bytes")
    except CampaignError as why:
        if way == "packed" and not readers_disagree:
            raise DifferentError(f"a clean zip is refused: {why}") from why
        refused(why.problems)
        return REFUSED
    if readers_disagree:
        raise DifferentError("a zip is read although readers disagree where its list of entries is")
    return outcome
