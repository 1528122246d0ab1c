"""Healthy campaigns spoiled in every way known here: each fault must be named, and nothing healthy touched.

    python benchmarks/spoil_campaign.py CAMPAIGN... [--tests-per-kind 3] [--seed 1] [--keep FOLDER]

A copy of each campaign gets ``--tests-per-kind`` tests spoiled by each kind of damage, every test by one kind at most.
Then it is ingested as a user would. A spoiled test is found if it is set aside, or used with a doubt, under the kind
that belongs to the damage. A healthy test is touched if it is set aside or doubted where it was not before, or if a
bit of its trace or of its pull differs. Exit status 1 if a fault was missed or a healthy test touched.
"""

from __future__ import annotations

import argparse
import random
import re
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribo.campaign import load_campaign
from tribo.records import Ingested
from tribo.stages import ingest

_NUMBER = re.compile(r"[-+]?\d+[.,]?\d*")


@dataclass
class Export:
    """An export as lines of cells: ``above`` the lines over the data, ``rows`` the data, columns by what they are."""

    above: list[str]
    rows: list[list[str]]
    delimiter: str
    end: str
    encoding: str
    time: int
    force: int
    displacement: int
    decimal: str

    def text(self) -> str:
        return self.end.join([*self.above, *(self.delimiter.join(row) for row in self.rows), ""])

    def bytes(self) -> bytes:
        return self.text().encode(self.encoding)

    def number(self, row: int, column: int) -> float:
        return float(self.rows[row][column].strip('"').replace(",", "."))

    def write(self, row: int, column: int, value: float, decimals: int | None = None) -> None:
        """Put a number into a cell in the style of the cell."""
        old = self.rows[row][column]
        bare = old.strip('"')
        decimals = len(re.split("[.,]", bare)[-1]) if decimals is None else decimals
        self.rows[row][column] = old.replace(bare, f"{value:.{decimals}f}".replace(".", self.decimal))

    def force_values(self) -> np.ndarray:
        return np.array([self.number(k, self.force) for k in range(len(self.rows))])

    def while_pulling(self, rng: random.Random) -> int:
        """A row after the static peak and well before the end."""
        return rng.randrange(int(0.5 * len(self.rows)), int(0.8 * len(self.rows)))


def parse(raw: bytes, columns: tuple[int, int, int]) -> Export:
    encoding = "utf-8-sig" if raw.startswith(b"\xef\xbb\xbf") else "cp1252"
    text = raw.decode(encoding)
    end = "\r\n" if "\r\n" in text else "\n"
    lines = text.split(end)
    first = next(k for k, line in enumerate(lines) if re.match(r'"?-?\d', line))
    delimiter = next(d for d in ("\t", ";", ",") if d in lines[first])
    rows = [line.split(delimiter) for line in lines[first:] if line.strip()]
    decimal = "," if delimiter == ";" else "."
    return Export(lines[:first], rows, delimiter, end, encoding, *columns, decimal)


Spoil = Callable[[Export, random.Random], bytes]
KINDS: dict[str, tuple[set[str], Spoil]] = {}


def kind(*named: str) -> Callable[[Spoil], Spoil]:
    """Register a way to spoil an export, with the kinds of problem under which it may be reported."""

    def register(spoil: Spoil) -> Spoil:
        KINDS[spoil.__name__] = (set(named), spoil)
        return spoil

    return register


@kind("empty")
def empty_file(e: Export, rng: random.Random) -> bytes:
    return b""


@kind("bom_only")
def only_a_byte_order_mark(e: Export, rng: random.Random) -> bytes:
    return rng.choice([b"\xef\xbb\xbf", b"\xff\xfe", b"\xef\xbb\xbf\r\n"])


@kind("header_only")
def only_a_header(e: Export, rng: random.Random) -> bytes:
    e.rows = []
    return e.bytes()


@kind("binary", "not_an_export")
def binary_rubbish(e: Export, rng: random.Random) -> bytes:
    return rng.randbytes(20_000)


@kind("text_in_numbers", "binary", "wrong_number_of_cells")
def a_block_of_nul_bytes(e: Export, rng: random.Random) -> bytes:
    raw = bytearray(e.bytes())
    at = rng.randrange(len(raw) // 2, len(raw) - 600)
    raw[at : at + 512] = bytes(512)
    return bytes(raw)


@kind("truncated_mid_row")
def last_row_breaks_off(e: Export, rng: random.Random) -> bytes:
    keep = e.while_pulling(rng)
    e.rows = e.rows[:keep]
    raw = e.bytes().rstrip()
    return raw[: len(raw) - rng.randrange(2, 9)]


@kind("stopped_before_peak")
def record_stops_while_rising(e: Export, rng: random.Random) -> bytes:
    force = np.abs(e.force_values())
    e.rows = e.rows[: int(np.argmax(force > rng.uniform(0.4, 0.6) * force[: force.size // 2].max()))]
    return e.bytes()


@kind("text_in_numbers")
def letters_for_digits(e: Export, rng: random.Random) -> bytes:
    row, column = e.while_pulling(rng), rng.choice([e.time, e.force])
    cell = e.rows[row][column]
    digit = rng.choice([d for d in "015" if d in cell] or [cell.strip('"')[-1]])
    e.rows[row][column] = cell.replace(digit, {"0": "O", "1": "l", "5": "S"}.get(digit, "x"), 1)
    return e.bytes()


@kind("text_in_numbers")
def the_word_of_an_overload(e: Export, rng: random.Random) -> bytes:
    for row in range(e.while_pulling(rng), len(e.rows), 50):
        e.rows[row][e.force] = rng.choice(["OVERLOAD", "#VALUE!", "****"])
    return e.bytes()


@kind("two_decimal_marks")
def two_decimal_marks(e: Export, rng: random.Random) -> bytes:
    row = e.while_pulling(rng)
    cell = e.rows[row][e.force]
    at = cell.index(e.decimal) + 2
    e.rows[row][e.force] = cell[:at] + e.decimal + cell[at:]
    return e.bytes()


@kind("two_decimal_marks", "wrong_number_of_cells")
def the_other_decimal_mark(e: Export, rng: random.Random) -> bytes:
    other = "." if e.decimal == "," else ","
    for row in range(e.while_pulling(rng), len(e.rows)):
        e.rows[row] = [cell.replace(e.decimal, other) for cell in e.rows[row]]
    return e.bytes()


@kind("nan_gap")
def missing_numbers(e: Export, rng: random.Random) -> bytes:
    start, what = e.while_pulling(rng), rng.choice(["", "NaN", "n/a", "--"])
    for row in range(start, start + rng.randrange(1, 40)):
        e.rows[row][e.force] = what
    return e.bytes()


@kind("time_gap")
def missing_rows(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    del e.rows[start : start + rng.randrange(20, 60)]
    return e.bytes()


@kind("wrong_number_of_cells")
def a_missing_cell(e: Export, rng: random.Random) -> bytes:
    del e.rows[e.while_pulling(rng)][e.displacement]
    return e.bytes()


@kind("time_goes_back")
def a_block_of_rows_again(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    length = rng.randrange(3, 60)
    e.rows[start:start] = [list(row) for row in e.rows[start - length : start]]
    return e.bytes()


@kind("time_repeats")
def rows_written_twice(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    e.rows[start : start + 30] = [list(row) for row in e.rows[start : start + 30] for _ in range(2)]
    return e.bytes()


@kind("time_goes_back")
def a_clock_that_starts_again(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    t0 = e.number(start, e.time)
    for row in range(start, len(e.rows)):
        e.write(row, e.time, e.number(row, e.time) - t0)
    return e.bytes()


@kind("time_stands_still")
def a_clock_that_stands(e: Export, rng: random.Random) -> bytes:
    for row in e.rows:
        row[e.time] = e.rows[0][e.time]
    return e.bytes()


def _scaled(e: Export, rows: range, factor: float) -> bytes:
    for row in rows:
        e.write(row, e.force, e.number(row, e.force) * factor)
    return e.bytes()


@kind("scale_jump")
def ten_times_off_for_a_while(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    return _scaled(e, range(start, start + rng.randrange(5, 60)), rng.choice([0.1, 10.0]))


@kind("scale_jump")
def ten_times_off_to_the_end(e: Export, rng: random.Random) -> bytes:
    return _scaled(e, range(e.while_pulling(rng), len(e.rows)), rng.choice([0.1, 10.0]))


@kind("scale_jump")
def another_unit_from_a_row_on(e: Export, rng: random.Random) -> bytes:
    return _scaled(e, range(e.while_pulling(rng), len(e.rows)), rng.choice([1e-3, 1e3, 1 / 9.80665e-3]))


@kind("missing_unit")
def a_unit_cell_missing(e: Export, rng: random.Random) -> bytes:
    column = rng.choice([e.time, e.force])
    units = e.above[-1].split(e.delimiter)
    units[column] = re.sub(r"\s*\(.*\)|[^\W\d_]+$", "", units[column]) if "(" in units[column] else ""
    e.above[-1] = e.delimiter.join(units)
    return e.bytes()


@kind("unknown_unit")
def a_unit_of_something_else(e: Export, rng: random.Random) -> bytes:
    units = e.above[-1].split(e.delimiter)
    units[e.force] = re.sub(r"\b(mN|N|gf)\b", rng.choice(["mm", "V", "XN"]), units[e.force])
    e.above[-1] = e.delimiter.join(units)
    return e.bytes()


@kind("sign_flipped")
def sign_flipped(e: Export, rng: random.Random) -> bytes:
    return _scaled(e, range(len(e.rows)), -1.0)


@kind("saturated")
def clipped_at_the_top(e: Export, rng: random.Random) -> bytes:
    limit = rng.uniform(0.5, 0.85) * float(e.force_values().max())
    for row in range(len(e.rows)):
        if e.number(row, e.force) > limit:
            e.write(row, e.force, limit)
    return e.bytes()


@kind("stuck")
def force_stuck_for_a_while(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    for row in range(start, start + rng.randrange(30, 80)):
        e.rows[row][e.force] = e.rows[start][e.force]
    return e.bytes()


@kind("stuck")
def force_stuck_to_the_end(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    for row in range(start, len(e.rows)):
        e.rows[row][e.force] = e.rows[start][e.force]
    return e.bytes()


@kind("stopped_before_peak", "stuck", "saturated")
def a_dead_load_cell(e: Export, rng: random.Random) -> bytes:
    for row in e.rows:
        row[e.force] = e.rows[0][e.force]
    return e.bytes()


@kind("spike")
def impulses(e: Export, rng: random.Random) -> bytes:
    top = float(e.force_values().max())
    for _ in range(rng.randrange(1, 5)):
        # not 9: nine times the peak can be ten times the sliding force, which is a lost decimal mark as well
        e.write(e.while_pulling(rng), e.force, rng.choice([-3.0, 4.0, 6.0]) * top)
    return e.bytes()


@kind("several_tables", "header_again", "time_goes_back", "text_in_numbers", "wrong_number_of_cells")
def the_header_again_in_the_middle(e: Export, rng: random.Random) -> bytes:
    start = e.while_pulling(rng)
    e.rows[start:start] = [[line] for line in e.above]
    return e.bytes()


@kind("time_goes_back", "several_tables")
def two_tests_in_one_file(e: Export, rng: random.Random) -> bytes:
    e.rows += [list(row) for row in e.rows]
    return e.bytes()


@kind("time_goes_back", "stopped_before_peak", "sign_flipped", "scale_jump", "off_speed", "too_short")
def force_and_time_swapped(e: Export, rng: random.Random) -> bytes:
    for row in e.rows:
        row[e.time], row[e.force] = row[e.force], row[e.time]
    return e.bytes()


@kind("off_speed", "stopped_before_peak")
def force_and_displacement_swapped(e: Export, rng: random.Random) -> bytes:
    for row in e.rows:
        row[e.displacement], row[e.force] = row[e.force], row[e.displacement]
    return e.bytes()


@kind("off_speed")
def another_speed_than_the_table_says(e: Export, rng: random.Random) -> bytes:
    factor = rng.choice([0.1, 0.5, 2.0, 10.0])
    for row in range(len(e.rows)):
        e.write(row, e.displacement, e.number(row, e.displacement) * factor)
    return e.bytes()


COLUMNS = {"Time": "time", "Load": "force", "Extension": "displacement"}
MISSING = "the file is gone"
OTHER_TEST = "the file of another test"
SAME_NUMBERS = "the numbers of another test"


def columns_of(ingested: Ingested) -> tuple[int, int, int]:
    """Positions of time, force and displacement in the exports of a campaign, told by their values."""
    test_id, trace = next(iter(ingested.traces.items()))
    test = next(t for t in ingested.campaign.tests if t.test_id == test_id)
    raw = (ingested.campaign.root / test.file).read_bytes()
    row = parse(raw, (0, 1, 2)).rows[-1]
    numbers = np.array([float(cell.strip('"').replace(",", ".")) for cell in row])
    assert trace.displacement_m is not None
    wanted = np.array([trace.time_s[-1], trace.force_N[-1], trace.displacement_m[-1]])
    exponent = np.log10(np.abs(numbers)[None, :] / np.abs(wanted)[:, None])
    in_grams = np.log10(np.abs(numbers)[None, :] / (np.abs(wanted)[:, None] / 9.80665e-3))
    off = np.minimum(np.abs(exponent / 3 - np.round(exponent / 3)), np.abs(in_grams))
    time, force, displacement = (int(k) for k in np.argmin(off, axis=1))
    assert len({time, force, displacement}) == 3, (numbers, wanted)
    return time, force, displacement


def spoil(healthy: Ingested, root: Path, per_kind: int, rng: random.Random) -> dict[str, tuple[str, set[str]]]:
    """Spoil a copy of a campaign at ``root``; the damage done to each test and the kinds it may be reported under."""
    columns = columns_of(healthy)
    tests = list(healthy.campaign.tests)
    rng.shuffle(tests)
    done: dict[str, tuple[str, set[str]]] = {}
    for name, (named, damage) in KINDS.items():
        for _ in range(per_kind):
            test = tests.pop()
            path = root / test.file
            path.write_bytes(damage(parse(path.read_bytes(), columns), rng))
            done[test.test_id] = (name, named)
    for _ in range(per_kind):
        gone, copied, other, merged, another = (tests.pop() for _ in range(5))
        (root / gone.file).unlink()
        done[gone.test_id] = (MISSING, {"missing"})
        shutil.copyfile(root / other.file, root / copied.file)
        done[copied.test_id] = (OTHER_TEST, {"other_test"})
        done[other.test_id] = ("", set())  # the one that was copied must stay
        mine, theirs = (parse((root / t.file).read_bytes(), columns) for t in (merged, another))
        mine.rows = theirs.rows
        (root / merged.file).write_bytes(mine.bytes())
        done[merged.test_id] = done[another.test_id] = (SAME_NUMBERS, {"same_numbers"})
    return done


def kinds_by_test(ingested: Ingested) -> dict[str, set[str]]:
    """Every kind of problem by test, set aside or doubted."""
    found: dict[str, set[str]] = {}
    for named in (*ingested.set_aside, *ingested.doubts()):
        found.setdefault(named.test_id, set()).update(p.kind for p in named.problems)
    return found


def judge(healthy: Ingested, spoiled: Ingested, done: dict[str, tuple[str, set[str]]]) -> tuple[Counter, list[str]]:
    """Counts of found faults by damage, and what went wrong."""
    before, after = kinds_by_test(healthy), kinds_by_test(spoiled)
    counts: Counter[str] = Counter()
    wrong = []
    for test_id, pull in healthy.pulls.items():
        name, wanted = done.get(test_id, ("", set()))
        new = after.get(test_id, set()) - before.get(test_id, set())
        if wanted:
            counts[name] += bool(new & wanted)
            if not new & wanted:
                wrong.append(f"{test_id}: {name} not found, told {sorted(new) or 'nothing'}")
            elif new - wanted:
                counts["further kinds told beside"] += 1
        elif new or repr(spoiled.pulls.get(test_id)) != repr(pull) or not _same(healthy, spoiled, test_id):
            wrong.append(f"{test_id}: healthy, yet touched: {sorted(new) or 'other numbers'}")
        else:
            counts["healthy tests untouched"] += 1
    return counts, wrong


def _same(healthy: Ingested, spoiled: Ingested, test_id: str) -> bool:
    one, two = healthy.traces[test_id], spoiled.traces[test_id]
    return np.array_equal(one.time_s, two.time_s) and np.array_equal(one.force_N, two.force_N)


def run(campaign: Path, per_kind: int, seed: int, folder: Path) -> tuple[Counter, list[str]]:
    """One campaign copied into ``folder``, spoiled, ingested and judged."""
    shutil.copytree(campaign, folder)
    healthy = ingest(load_campaign(folder))
    done = spoil(healthy, folder, per_kind, random.Random(seed))
    return judge(healthy, ingest(load_campaign(folder)), done)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("campaigns", nargs="+", type=Path)
    parser.add_argument("--tests-per-kind", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for the spoiled campaigns")
    options = parser.parse_args()
    total: Counter[str] = Counter()
    failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        for campaign in options.campaigns:
            folder = (options.keep or Path(scratch)) / f"{campaign.name}-{options.seed}"
            counts, wrong = run(campaign, options.tests_per_kind, options.seed, folder)
            total += counts
            failed += len(wrong)
            print(f"{campaign.name}: {len(wrong)} wrong", *wrong, sep="\n  ", flush=True)
    for name, n in sorted(total.items()):
        print(f"{n:6d}  {name}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
