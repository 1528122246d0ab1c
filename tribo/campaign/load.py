"""From a folder with campaign.toml and tests.csv, or a .zip of one, to a Campaign in SI units.

Choices of the command line are made for it later: the flat sample that calibrates the model, zeros of force and load.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from tribo.campaign.description import CampaignFile, read_description
from tribo.campaign.rows import (
    correction_of,
    date_faults,
    evaluated_forces,
    export_of,
    number,
    pattern_of,
    relative_path,
    row_faults,
    words_for_numbers,
)
from tribo.campaign.table import (
    COUNTS,
    KNOWN,
    LOADS,
    NUMBERS,
    RAW,
    TABLES,
    TOML,
    TestRow,
    order_of,
    overlap,
    parsed,
    read_tests,
)
from tribo.errors import CampaignError, Problem
from tribo.files import LEADS_OUT, found_below, leads_out, paths_below
from tribo.input_files import hashes_of_reads, unpack
from tribo.records import STANDARD_GRAVITY, Campaign, Pattern, SetAside, Test
from tribo.temporary import temporary_folder
from tribo.units import quantity_named
from tribo.user_text import did_you_mean, nearest, well_formed
from tribo.zeroing import DEFAULT, ZeroChoice, zero_choice

_NOT_WORTH_A_NOTE = (".", "~$", "Thumbs.db")
_TABLES_OF_EXPORTS = (".csv", ".txt", ".tsv", ".dat", ".xlsx", ".xls", ".ods", ".tra", ".mat", ".tdms")
_MM2, _GRAM, _MM = 1e-6, 1e-3, 1e-3
# beginning of the name of a covariate that ends in a unit, and the number of a test that is the same quantity
_SAME_QUANTITY = {
    "speed": "speed_m_s", "velocity": "speed_m_s", "rotation": "speed_m_s", "normal_load": "normal_load_N",
    "load": "normal_load_N", "mass": "normal_load_N", "hold": "hold_s", "temperature": "temperature_C",
    "humidity": "humidity_pct",
}  # fmt: skip
_OF_A_QUANTITY = re.compile(
    rf"(?:nominal_|set_)?({'|'.join(_SAME_QUANTITY)})"
    r"_(?:rpm|rps|Hz|[muc]?m_s|mm_min|[mk]?N|k?gf|[mk]?g|s|min|h|C|pct)"
)
_IN_TABLE = {"speed_m_s": "speed_mm_s", "normal_load_N": "the load"}
_SAME_RATIO = 0.02  # largest over smallest ratio of a column to another, beyond 1, of which both have three digits
_LOADS_AGREE = 0.05  # share by which normal_load_N may differ from the weight put on
_NUMBER_ROW = re.compile(rb'^\s*"?[-+]?[.,]?\d+[.,\d]*"?\s*[,;\t|]', re.M)
_FIELDS = {f.name for f in fields(Test)}


def load_campaign(folder: Path | str, *, measured: bool = True) -> Campaign:
    """Read campaign.toml and tests.csv of a folder, and the list of files in raw/.

    Parameters
    ----------
    folder : path
        The folder that holds campaign.toml.
    measured : bool, optional
        False for a plan, whose exports need not exist yet.

    Returns
    -------
    Campaign
        SI units. ``tests`` are the usable rows, ``set_aside`` those with an error or an ``exclude`` reason,
        ``problems`` all errors and notes.

    Raises
    ------
    CampaignError
        campaign.toml is wrong, a required column is missing, or no test is usable; with the errors of both
        files. Or one of the two files, or raw/, is a link that leads out of the folder.

    Examples
    --------
    >>> campaign = tribo.load_campaign("data/example")
    >>> campaign.tests[0].normal_load_N, campaign.samples["F"].cavity
    (0.25987622499999996, 'none')
    """
    root = Path(folder)
    links = (TOML, *TABLES, RAW)
    problems = [Problem("link", LEADS_OUT, file=name) for name in links if leads_out(root, root / name)]
    if problems:
        raise CampaignError(problems)
    with hashes_of_reads() as hashes:
        described = read_description(root / TOML, TOML, problems)
        rows = read_tests(root, problems)
    if described is None or rows is None:
        raise CampaignError(problems)
    patterns = {}
    for name, table in described.patterns.items():
        try:
            patterns[name] = table.pattern(name, root)
        except (OSError, ValueError) as why:
            problems.append(Problem("mask", str(why), file=TOML, column=f"patterns.{name}", found=table.mask))
    if len(patterns) < len(described.patterns):
        raise CampaignError(problems)
    order = order_of(row.cells.get("started_at", "") for row in rows)
    by_file = {key: value for key, value in described.columns.items() if isinstance(value, dict)}
    stated = [*described.columns, *(key for columns in by_file.values() for key in columns)]
    in_columns = any(quantity_named(key) == "normal force" for key in stated)
    usable, set_aside = _sort_rows(root, rows, patterns, order, measured, in_columns)
    problems += [p for s in set_aside for p in s.problems]
    if not usable:
        file = rows[0].file if rows else TABLES[0]
        raise CampaignError([*problems, Problem("no_usable_test", "no test of this campaign is usable", file=file)])
    general = described.campaign
    if general.nominal_area_mm2 is None and any(row.cells.get("normal_stress_Pa") for row in usable):
        what, allowed = "a load given as normal stress needs the nominal area", "more than 0 mm2"
        raise CampaignError(Problem("no_area", what, file=TOML, column="nominal_area_mm2", allowed=allowed))
    area_m2 = None if general.nominal_area_mm2 is None else general.nominal_area_mm2 * _MM2
    problems += _unlisted(root, rows)
    problems += [note for row in usable if (note := _loads_disagree(row, described))]
    problems += words_for_numbers(usable)
    tests = tuple(_test(row, described, order, area_m2) for row in usable)
    tests = _each_quantity_once(tests, problems, rows[0].file)
    names = sorted({t.sample for t in tests}, key=lambda n: (list(patterns).index(pattern_of(n, patterns)), n))
    return Campaign(
        title=general.title,
        root=root,
        nominal_area_m2=area_m2,
        contact=general.contact,
        material_class=general.material_class,
        plausible={k: (v[0], v[1]) for k, v in described.plausible.model_dump(exclude_none=True).items()},
        measured={name: (value[0], value[1]) for name, value in described.measured.items()},
        tests=tests,
        samples={name: patterns[pattern_of(name, patterns)] for name in names},
        material=general.material,
        counterface=general.counterface,
        slider_mass_kg=(general.slider_mass_g or 0.0) * _GRAM,
        slider_mass_stated=general.slider_mass_g is not None,
        pull_speed_m_s=None if general.pull_speed_mm_s is None else general.pull_speed_mm_s * _MM,
        set_aside=set_aside,
        problems=tuple(problems),
        columns={key: value for key, value in described.columns.items() if not isinstance(value, dict)},
        columns_by_file=by_file,
        instrument=described.instrument.model_dump(exclude_none=True),
        viscosity_Pa_s=None if general.viscosity_mPa_s is None else 1e-3 * general.viscosity_mPa_s,
        zero=zero_choice(general.zero),
        load_zero=zero_choice(general.load_zero),
        inputs={Path(path).name: digest for path, digest in hashes.items()},
    )


def _sort_rows(
    root: Path, rows: Sequence[TestRow], patterns: Mapping[str, Pattern], order: str, measured: bool, in_columns: bool
) -> tuple[list[TestRow], tuple[SetAside, ...]]:
    """Usable rows, and the others with all their faults; rows that share a test_id are one set-aside test."""
    places: dict[str, list[int]] = {}
    users: dict[str, list[tuple[str, str]]] = {}
    for row in rows:
        places.setdefault(row.test_id, []).append(row.row)
        path, choice = export_of(row)
        users.setdefault(path, []).append((row.test_id, choice))
    # by all exports, or in a column that campaign.toml names
    recorded = in_columns or not any(row.cells.get(column) for row in rows for column in LOADS)
    usable, set_aside = [], []
    for row in rows:
        test_id = row.test_id
        if row.row != places[test_id][0]:
            continue
        problems = row_faults(root, row, patterns, measured, recorded) + date_faults(row, order)
        if len(places[test_id]) > 1:
            what = f"this test_id occurs in rows {', '.join(map(str, places[test_id]))}; none of them is used"
            place = (row.file, places[test_id][1], "test_id", test_id)
            problems.append(Problem("duplicate_row", what, *place, "one row per test"))
        path, choice = export_of(row)
        others = [other for other, theirs in users[path] if other != test_id and overlap(choice, theirs)]
        if others and path:
            what = f"this export is also given for {', '.join(others)}; none of these tests is used"
            place = (row.file, row.row, "file", row.cells["file"])
            problems.append(Problem("duplicate_file", what, *place, "one export per test"))
        if problems:
            problems = [p.at(test_id=test_id) for p in problems]
            set_aside.append(SetAside(test_id, "; ".join(map(str, problems)), tuple(problems)))
        elif row.cells.get("exclude"):
            set_aside.append(SetAside(test_id, f"excluded by hand: {row.cells['exclude']}"))
        else:
            usable.append(row)
    return usable, tuple(set_aside)


def _test(row: TestRow, described: CampaignFile, order: str, area_m2: float | None) -> Test:
    """A row without faults as a Test. N = normal_load_N, or (mass + slider mass) g; NaN where the export tells it."""
    cells, general = row.cells, described.campaign
    numbers: dict[str, Any] = {column: number(row, column) for column in NUMBERS}
    numbers |= {column: None if (v := number(row, column)) is None else int(v) for column in COUNTS}
    speed = numbers["speed_mm_s"] if cells.get("speed_mm_s") else general.pull_speed_mm_s  # a word hides another speed
    load, stress, mass = numbers["normal_load_N"], numbers["normal_stress_Pa"], numbers["mass_g"]
    given = {"normal_load_N": load, "normal_stress_Pa": stress, "mass_g": mass}  # the first of them counts
    if load is None and stress is not None and area_m2 is not None:
        load = stress * area_m2
    if load is None:
        load = math.nan if mass is None else (mass + (general.slider_mass_g or 0.0)) * _GRAM * STANDARD_GRAVITY
    speed_m_s = None if speed is None else speed * _MM
    sample = cells["sample"]
    stated = {
        "test_id": cells["test_id"],
        "file": "#".join(part for part in export_of(row) if part),
        "sample": sample,
        "normal_load_N": load,
        "specimen": cells.get("specimen") or sample,
        "direction": cells.get("direction") or (sample[-1:] if sample not in described.patterns else ""),
        "speed_m_s": speed_m_s,
        "started_at": parsed(cells["started_at"], order) if cells.get("started_at") else "",
        "operator": cells.get("operator", ""),
        "covariates": {name: cell for name, cell in cells.items() if name and name not in KNOWN},
        "row": row.row,
        "correction": correction_of(numbers, general, speed_m_s, load),
        "evaluated": evaluated_forces(row, load),
        "zero": zero_choice(cells.get("zero") or general.zero),
        "load_zero": zero_choice(cells.get("load_zero") or general.load_zero),
        "stiffness_N_per_m": numbers["stiffness_N_per_m"] or described.instrument.stiffness_N_per_m,
        "load_from": next((column for column, value in given.items() if value is not None), ""),
        "mass_kg": None if mass is None else mass * _GRAM,
    }
    return Test(**{column: value for column, value in numbers.items() if column in _FIELDS} | stated)


def _each_quantity_once(tests: tuple[Test, ...], problems: list[Problem], file: str) -> tuple[Test, ...]:
    """The tests without columns that say what another one says, in other words or units, with a note on each.

    A nominal value beside the recorded one, a speed in turns that goes with the speed, a repeat that counts the tests
    in their order: none of them is a second variable.
    """
    same: dict[str, str] = {}
    for name in dict.fromkeys(name for test in tests for name in test.covariates):
        named = _OF_A_QUANTITY.fullmatch(name)
        if named is None or len(tests) < 2:
            continue
        column = _SAME_QUANTITY[named[1]]
        pairs = [(test.covariates.get(name, ""), getattr(test, column)) for test in tests]
        if (name == "nominal_load_N" and any(math.isnan(load) for _, load in pairs)) or _are_proportional(pairs):
            same[name] = column
    places = [(test.run_order, test.repeat) for test in tests if test.repeat is not None and test.run_order is not None]
    if len(places) == len(tests) > 2:
        repeats = [repeat for _, repeat in sorted(places)]
        if all(a < b for a, b in pairwise(repeats)):
            same["repeat"] = "run_order"
    for name, column in same.items():
        what = f"this column says what {_IN_TABLE.get(column, column)} says, and is not treated as a second variable"
        problems.append(Problem("same_quantity", what, file, None, name))
    if not same:
        return tests
    return tuple(
        replace(
            test, covariates={name: cell for name, cell in test.covariates.items() if name not in same},
            repeat=None if "repeat" in same else test.repeat,
        )
        for test in tests
    )  # fmt: skip


def _are_proportional(pairs: Sequence[tuple[str, float | None]]) -> bool:
    """Whether a column of text is one factor times a number in all tests, within the rounding of three digits."""
    try:
        ratios = [float(text) / float(value) for text, value in pairs if value is not None]
    except (ValueError, ZeroDivisionError):
        return False
    known = len(ratios) == len(pairs) and all(map(math.isfinite, ratios))
    return known and min(ratios) > 0 and max(ratios) < (1.0 + _SAME_RATIO) * min(ratios)


def _loads_disagree(row: TestRow, described: CampaignFile) -> Problem | None:
    """A note where both loads are given and are not the same; normal_load_N is used."""
    mass, load = number(row, "mass_g"), number(row, "normal_load_N")
    if mass is None or load is None:
        return None
    weight = (mass + (described.campaign.slider_mass_g or 0.0)) * _GRAM * STANDARD_GRAVITY
    if abs(weight / load - 1.0) < _LOADS_AGREE:
        return None
    what, found = "this load is used, although it differs from the weight of mass_g and slider", f"{load:g} N"
    place = (row.file, row.row, "normal_load_N", found, f"about {weight:.4g} N")
    return Problem("loads_disagree", what, *place, test_id=row.test_id)


def _unlisted(root: Path, rows: Sequence[TestRow]) -> list[Problem]:
    """Notes on files of raw/ that no row names."""
    named = {str(relative_path(row.cells.get("file", ""))) for row in rows}
    notes = []
    for path, outward in paths_below(root, RAW):
        name = path.relative_to(root).as_posix()
        if outward:
            if name not in named:
                notes.append(Problem("link", LEADS_OUT, file=well_formed(name)))
            continue
        if name in named or path.name.startswith(_NOT_WORTH_A_NOTE) or not path.is_file():
            continue
        if _holds_numbers(path):
            note = Problem("not_listed", f"not listed in {TABLES[0]}; this export is not read", file=well_formed(name))
        else:
            what = f"not an export and not listed in {TABLES[0]}; it is not read"
            note = Problem("not_an_export_and_not_listed", what, file=well_formed(name))
        notes.append(note)
    return notes


def _holds_numbers(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return len(_NUMBER_ROW.findall(stream.read(8000))) > 2
    except OSError:
        return False


@contextmanager
def open_campaign(path: Path | str, *, measured: bool = True) -> Iterator[Campaign]:
    """Open a campaign folder, or a .zip that holds one (unpacked into a temporary folder while it is open).

    Parameters
    ----------
    path : path
        The folder or .zip; campaign.toml may stand in one folder below it.
    measured : bool, optional
        False for a plan, whose exports need not exist yet.

    Returns
    -------
    context manager of Campaign
        As :func:`load_campaign` gives it; of a .zip, its files exist while the context is open.

    Raises
    ------
    CampaignError
        The campaign is unusable; or the archive is refused (:func:`tribo.input_files.opened_zip`), or contains no
        campaign.toml, or more than one.

    Examples
    --------
    >>> with tribo.open_campaign("data/example") as campaign:
    ...     len(campaign.tests)
    144
    """
    path = Path(path)
    if path.is_dir():
        yield load_campaign(_campaign_folder(path, path.name), measured=measured)
    elif path.is_file():
        _refuse_a_file_of_a_campaign(path)
        with temporary_folder() as folder:
            unpack(path, folder)
            yield load_campaign(_campaign_folder(folder, path.name), measured=measured)
    else:
        beside = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
        allowed = did_you_mean(path.name, beside) or None
        raise CampaignError(Problem("missing", "this folder or .zip does not exist", file=str(path), allowed=allowed))


def _refuse_a_file_of_a_campaign(path: Path) -> None:
    """Raises CampaignError where a file of a campaign, or an export, is given in place of the folder."""
    if path.suffix.lower() == ".zip":
        return
    if path.name in (TOML, *TABLES) or (path.parent / TOML).is_file():
        what, folder = "this is a file of a campaign; give the folder", path.parent
    elif path.parent.name == RAW and (path.parent.parent / TOML).is_file():
        what, folder = "this is an export of a campaign; give the folder", path.parent.parent
    elif path.suffix.lower() in _TABLES_OF_EXPORTS:
        what = "this is neither a campaign folder nor a .zip of one; an export alone is no campaign"
        allowed = f"tribo inspect {path} shows what is in it; tribo init NEW --from {path.parent} makes a campaign"
        raise CampaignError(Problem("not_a_campaign", what, file=str(path), allowed=allowed))
    else:
        return
    raise CampaignError(Problem("file_of_a_campaign", what, file=str(path), allowed=str(folder)))


def _campaign_folder(folder: Path, shown: str) -> Path:
    """The folder itself if it holds campaign.toml, else the one folder below that does."""
    if (folder / TOML).is_file():
        return folder
    found = sorted(p.parent for p in found_below(folder, TOML) if p.is_file() and "__MACOSX" not in p.parts)
    if len(found) == 1:
        return found[0]
    if not found:
        raise CampaignError(Problem("missing_file", f"no {TOML} in this folder", shown, allowed=_instead(folder)))
    names = ", ".join(p.relative_to(folder).as_posix() for p in found)
    raise CampaignError(Problem("several_campaigns", f"more than one {TOML} in it", file=shown, found=names))


def _instead(folder: Path) -> str:
    """What to do about a folder without campaign.toml."""
    names = sorted(path.name for path in folder.iterdir() if path.is_file())
    near = next((n for n in names if n.casefold().startswith(TOML)), "") or nearest(TOML, names, 0.75)
    if near:
        return f"{TOML}; rename {near}?"
    if not names:
        return f"{TOML}, {TABLES[0]} and {RAW}/; tribo init writes them into a new folder"
    return f"{TOML}, {TABLES[0]} and {RAW}/; for a folder of exports: tribo init NEW --from {folder.name}"


def with_flat_sample(campaign: Campaign, wanted: str = "") -> Campaign:
    """The campaign with the flat sample a user asked for; unchanged where none was asked for.

    Raises
    ------
    CampaignError
        ``wanted`` was not measured, or has cavities.
    """
    if not wanted or wanted == campaign.chosen_flat:
        return campaign
    if wanted not in campaign.flat_samples:
        measured = {test.sample for test in campaign.tests}
        what = "this sample has cavities" if wanted in measured else "no test of this campaign has this sample"
        raise CampaignError(replace(_problem(campaign, what, wanted), file="--flat", column=None))
    return replace(campaign, chosen_flat=wanted)


def required_flat_sample(campaign: Campaign) -> str:
    """Name of the flat sample.

    Raises
    ------
    CampaignError
        No flat sample was measured, or several were and none of them was chosen.
    """
    if campaign.flat_sample:
        return campaign.flat_sample
    found = ", ".join(campaign.flat_samples) or "no sample whose pattern has cavity = none"
    raise CampaignError(_problem(campaign, "the model must be calibrated on one flat sample", found))


def _problem(campaign: Campaign, what: str, found: str) -> Problem:
    flat = campaign.flat_samples
    allowed = f"--flat {' or --flat '.join(flat)}" if flat else "at least one sample whose pattern has cavity = none"
    return Problem("no_flat_sample", what, file="tests.csv", column="sample", found=found, allowed=allowed)


def with_zeros(campaign: Campaign, zero: str = "", load_zero: str = "") -> Campaign:
    """The campaign with the zero of the force and of the load as given; unchanged where nothing is given.

    Raises
    ------
    ValueError
        A text that is no zero.
    """
    if not zero and not load_zero:
        return campaign
    force, load = zero_choice(zero), zero_choice(load_zero)

    def own(test: Test) -> Test:
        return replace(
            test,
            zero=_chosen(test.zero, campaign.zero, force),
            load_zero=_chosen(test.load_zero, campaign.load_zero, load),
        )

    return replace(
        campaign, tests=tuple(map(own, campaign.tests)), zero=_chosen(campaign.zero, campaign.zero, force),
        load_zero=_chosen(campaign.load_zero, campaign.load_zero, load),
    )  # fmt: skip


def _chosen(own: ZeroChoice, of_campaign: ZeroChoice, given: ZeroChoice) -> ZeroChoice:
    return given if given != DEFAULT and own == of_campaign else own
