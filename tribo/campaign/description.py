"""campaign.toml: its allowed contents, all errors at once with their rows, and a template to fill in."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import quote

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from tribo.campaign.geometry import Making, faults_of_making, mean_chords_m, picture_from, random_picture
from tribo.campaign.table import RAW, TABLES, TOML
from tribo.errors import CampaignError, Problem, system_problem
from tribo.files import write_new
from tribo.input_files import (
    DEEPEST_NESTING,
    LARGEST_DESCRIPTION_BYTES,
    LARGEST_NUMBER,
    LONGEST_NAME,
    SMALLEST_NUMBER,
    nests_too_deeply,
    read_input,
    toml_table,
)
from tribo.records import Pattern, picture_mask
from tribo.units import QUANTITIES, quantity_named
from tribo.user_text import did_you_mean, is_control
from tribo.zeroing import zero_choice

_UM = 1e-6
_QUOTED_NUMBER = re.compile(r"([-+]?\d+(?:[.,]\d+)?)\s*[^\d]{0,10}")


def _checked(is_allowed: Callable[[Any], bool], otherwise: str) -> AfterValidator:
    def check(value: Any) -> Any:
        if not is_allowed(value):
            raise ValueError(otherwise)
        return value

    return AfterValidator(check)


_MEASURABLE = _checked(lambda value: not 0 < value < SMALLEST_NUMBER, f"must be 0, or {SMALLEST_NUMBER:g} or more")
Positive = Annotated[float, Field(gt=0, le=LARGEST_NUMBER, allow_inf_nan=False), _MEASURABLE]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST_NUMBER, allow_inf_nan=False), _MEASURABLE]
Line = Annotated[
    str,
    _checked(lambda text: not any(map(is_control, text)), "must not contain control characters or line breaks"),
]
Name = Annotated[  # part of the names of files
    Line,
    _checked(
        lambda name: len(quote(name, safe="")) <= LONGEST_NAME,
        f"must not be longer than {LONGEST_NAME} bytes in the encoding of addresses",
    ),
]
Range = Annotated[
    list[float], _checked(lambda given: len(given) == 2 and given[0] < given[1], "must be [lowest, highest]")
]
Measured = Annotated[
    list[Annotated[float, Field(allow_inf_nan=False, ge=-LARGEST_NUMBER, le=LARGEST_NUMBER)]],
    _checked(
        lambda given: len(given) == 2 and given[1] > 0,
        "must be [value, standard uncertainty], the uncertainty more than 0",
    ),
]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


def _a_zero(given: str | float | list[float]) -> str | float | list[float]:
    zero_choice(given)
    return given


Zero = Annotated[str | float | list[float], AfterValidator(_a_zero)]


class CampaignTable(_Strict):
    """[campaign]: properties of the whole campaign."""

    title: Line
    material: Line = ""
    counterface: Line = ""
    nominal_area_mm2: Positive | None = None
    contact: Literal["", "sled", "pin_on_disc", "ball_on_disc", "ring_shear", "reciprocating", "rotary"] = ""
    material_class: Literal["", "elastomer", "polymer", "metal", "ceramic", "lubricated", "granular"] = ""
    slider_mass_g: NotNegative | None = None
    pull_speed_mm_s: Positive | None = None
    viscosity_mPa_s: Positive | None = None
    sign: Literal[1, -1] | None = None
    gain: Positive | None = None
    lever_arm_mm: Positive | None = None
    sampling_rate_Hz: Positive | None = None
    zero: Zero = ""
    load_zero: Zero = ""


def _a_fraction(given: Any) -> Any:
    if isinstance(given, int | float) and not isinstance(given, bool) and 1 < given <= 100:
        raise ValueError(f"must not be more than 1; {given:g} looks like percent: divide by 100?")
    return given


class PatternTable(_Strict):
    """[patterns.NAME]: geometry of one pattern, lengths in micrometre; one number is x and y alike."""

    cavity: Literal["none", "circle", "square", "rectangle", "ellipse", "ridge", "chevron", "random", "mask"]
    feature: Literal["hole", "pillar"] = "hole"
    lattice: Literal["square", "staggered", "hexagonal"] | None = None
    mask: Line | None = None
    um_per_pixel: Positive | None = None
    fraction: Annotated[float, Field(gt=0, lt=1)] | None = None
    correlation_um: Positive | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    smallest_feature_um: Positive | None = None
    smallest_wall_um: Positive | None = None
    mask_grid_um: Positive | None = None
    diameter_um: Positive | None = None
    size_um: Positive | list[Positive] | None = None
    pitch_um: Positive | list[Positive] | None = None
    staggered: bool = False
    area_fraction: Annotated[float, BeforeValidator(_a_fraction), Field(gt=0, le=1)] | None = None

    @property
    def size(self) -> tuple[float, float] | None:
        """(x, y) of a cavity in micrometre."""
        return _pair(self.diameter_um if self.cavity == "circle" else self.size_um)

    @property
    def pitch(self) -> tuple[float, float] | None:
        """(x, y) of the lattice in micrometre."""
        pair = _pair(self.pitch_um)
        if pair is not None and self.lattice == "hexagonal":
            return pair[0], pair[0] * 3**0.5 / 2
        return pair

    @property
    def making(self) -> Making:
        """What can be made, in metre."""
        limits = (self.smallest_feature_um, self.smallest_wall_um, self.mask_grid_um)
        return Making(*((limit or 0.0) * _UM for limit in limits))

    def pattern(self, name: str, folder: Path | None = None) -> Pattern:
        """The pattern in metre; ``folder`` holds its picture. ValueError where that cannot be used or made."""

        def metres(pair: tuple[float, float] | None) -> tuple[float, float] | None:
            return None if pair is None else (pair[0] * _UM, pair[1] * _UM)

        if self.cavity in ("mask", "random"):
            if self.mask is not None:
                text, pixel_m = picture_from((folder or Path()) / self.mask), (self.um_per_pixel or 1.0) * _UM
            else:
                correlation_m = (self.correlation_um or 1.0) * _UM
                text, pixel_m = random_picture(self.fraction or 0.5, correlation_m, self.seed)
            mask = picture_mask(text)
            found = Pattern(
                name, self.cavity, mean_chords_m(mask, pixel_m), (mask.shape[1] * pixel_m, mask.shape[0] * pixel_m),
                measured_area_fraction=self.area_fraction, picture=text, pixel_m=pixel_m,
            )  # fmt: skip
            if faults := list(faults_of_making(found, self.making)):
                raise ValueError("; ".join(faults))
            return found
        return Pattern(
            name=name,
            cavity=self.cavity,
            size_m=metres(self.size),
            pitch_m=metres(self.pitch),
            staggered=self.staggered or self.lattice in ("staggered", "hexagonal"),
            measured_area_fraction=self.area_fraction,
            feature=self.feature,
            lattice="hexagonal" if self.lattice == "hexagonal" else "rows",
        )

    @model_validator(mode="after")
    def _keys_fit_the_cavity(self) -> PatternTable:
        own: dict[str, tuple[str, ...]] = {
            "none": (), "circle": ("diameter_um", "pitch_um"), "mask": ("mask", "um_per_pixel"),
            "random": ("fraction", "correlation_um"),
        }  # fmt: skip
        wanted = own.get(self.cavity, ("size_um", "pitch_um"))
        lengths = ("diameter_um", "size_um", "pitch_um", "mask", "um_per_pixel", "fraction", "correlation_um")
        given = [key for key in lengths if getattr(self, key) is not None]
        missing = [key for key in wanted if key not in given]
        unused = [key for key in given if key not in wanted]
        if missing:
            raise ValueError(f"cavity = {self.cavity} requires {' and '.join(missing)}")
        if unused:
            raise ValueError(f"cavity = {self.cavity} does not allow {' and '.join(unused)}")
        return self

    @model_validator(mode="after")
    def _cavities_stand_apart(self) -> PatternTable:
        if self.cavity in ("none", "mask", "random"):
            return self
        if self.size is None or self.pitch is None:
            raise ValueError("size_um and pitch_um must be one number or [x, y]")
        if self.cavity == "square" and self.size[0] != self.size[1]:
            raise ValueError("a square has one size_um; for two sizes use cavity = rectangle")
        pattern = self.pattern("")
        if pattern.too_wide_along:
            raise ValueError("the pitch must be larger than the cavity; otherwise cavities touch")
        limited = self.making != Making()
        if (pattern.is_drawn or limited) and (faults := list(faults_of_making(pattern, self.making))):
            raise ValueError("; ".join(faults))
        return self


class InstrumentTable(_Strict):
    """[instrument]: standard uncertainties (k = 1) and properties of the rig."""

    load_cell_u_percent: NotNegative | None = None
    load_cell_u_N: NotNegative | None = None
    load_cell_range_N: Positive | None = None
    mass_u_g: NotNegative | None = None
    normal_load_u_percent: NotNegative | None = None
    area_u_percent: NotNegative | None = None
    wire_angle_deg: Annotated[float, Field(gt=-90, lt=90)] | None = None
    wire_angle_u_deg: NotNegative | None = None
    stiffness_N_per_m: Positive | None = None
    sampling_rate_Hz: Positive | None = None


class PlausibleTable(_Strict):
    """[plausible]: bounds outside which a number is doubtful, in place of those of the material class."""

    mu: Range | None = None
    friction_ratio: Range | None = None
    tau0_kPa: Range | None = None
    pressure_kPa: Range | None = None
    speed_mm_s: Range | None = None
    area_mm2: Range | None = None
    mass_g: Range | None = None
    temperature_C: Range | None = None
    humidity_pct: Range | None = None


Stated = dict[str, str | list[str] | dict[str, str | list[str]]]


def _only_quantities(columns: Stated) -> Stated:
    """[columns] holds quantities, "ignore", "decimal" and "accept", and tables of the same for a file or a glob."""
    names = [*(name.replace(" ", "_") for name in QUANTITIES), "ignore", "decimal", "accept"]
    for key, value in columns.items():
        if isinstance(value, dict):
            _only_quantities(dict(value))
        elif key not in ("ignore", "decimal", "accept") and quantity_named(key) is None:
            hint = did_you_mean(key, names) or f"known quantities: {', '.join(names)}"
            raise ValueError(f"{key} is not a known quantity; {hint}")
        elif key not in ("ignore", "accept") and not isinstance(value, str):
            raise ValueError(f"{key} must be one column, not a list; only ignore and accept take a list")
        elif key == "decimal" and value not in (".", ","):
            raise ValueError("decimal must be a point or a comma")
    return columns


class CampaignFile(_Strict):
    """The whole of campaign.toml."""

    campaign: CampaignTable
    patterns: Annotated[dict[Name, PatternTable], Field(min_length=1)]
    columns: Annotated[Stated, AfterValidator(_only_quantities)] = {}
    instrument: InstrumentTable = InstrumentTable()
    plausible: PlausibleTable = PlausibleTable()
    measured: dict[Name, Measured] = {}  # amplitudes of mechanisms that were measured directly


def _pair(value: float | list[float] | None) -> tuple[float, float] | None:
    if isinstance(value, list):
        return (value[0], value[1]) if len(value) == 2 else None
    return None if value is None else (value, value)


def read_description(path: Path, file: str, problems: list[Problem]) -> CampaignFile | None:
    """campaign.toml as checked tables; None where it cannot be used; every fault goes to ``problems``."""
    deep = Problem("too_deep", "tables and arrays nested too deeply", file, allowed=f"at most {DEEPEST_NESTING} levels")
    try:
        text = read_input(path, LARGEST_DESCRIPTION_BYTES).decode("utf-8-sig")
        table = toml_table(text)
        if not nests_too_deeply(table):
            return CampaignFile.model_validate(table)
        problems.append(deep)
    except FileNotFoundError:
        problems.append(Problem("missing_file", f"a campaign must contain {file}", file=file))
    except OSError as why:
        problems.append(system_problem(why, file))
    except RecursionError:
        problems.append(deep)
    except UnicodeDecodeError as why:
        row = why.object[: why.start].count(b"\n") + 1
        problems.append(Problem("not_utf8", "TOML files must be encoded in UTF-8", file=file, row=row))
    except tomllib.TOMLDecodeError as why:
        row_said = re.search(r"line (\d+)", str(why))
        row = int(row_said.group(1)) if row_said else text.count("\n") + 1
        problems.append(_not_toml(str(why), text, file, row))
    except ValidationError as why:
        problems.extend(_problem(error, text, file) for error in why.errors(include_url=False))
    except ValueError as why:  # a whole number of more digits than Python converts
        problems.append(Problem("not_toml", f"not valid TOML: {why}", file=file))
    return None


def _not_toml(why: str, text: str, file: str, row: int) -> Problem:
    """A line that is not TOML, with what it may mean: a decimal comma, a text or a unit without quotation marks."""
    line = [*text.split("\n"), ""][row - 1].strip()
    key, _, value = (part.strip() for part in line.partition("="))
    number = re.match(r"([-+]?\d+)(?:,(\d+))?\s*(\S.*)?$", value)
    meant = None
    if number and number[2]:
        meant = f"a decimal point: did you mean {key} = {number[1]}.{number[2]}?"
    elif number and number[3]:
        meant = f"a number without its unit: did you mean {key} = {number[1]}?"
    elif key and re.match(r"[^\W\d]", value) and not value.startswith(("true", "false", "inf", "nan")):
        meant = f'a text in quotation marks: did you mean {key} = "{value}"?'
    return Problem("not_toml", f"not valid TOML: {why}", file, row, None, line[:80] or None, meant)


def _problem(error: Any, text: str, file: str) -> Problem:
    # pydantic names the branch of a union in its path: "float", "list[float]"
    path = [str(p) for p in error["loc"] if not (isinstance(p, str) and (p in {"float", "int", "str"} or "[" in p))]
    row, column = _row_of(path, text), ".".join(path)
    if error["type"] == "extra_forbidden":
        tables: dict[str, type[BaseModel]] = {
            "campaign": CampaignTable,
            "patterns": PatternTable,
            "instrument": InstrumentTable,
            "plausible": PlausibleTable,
        }
        allowed = list((CampaignFile if len(path) == 1 else tables[path[0]]).model_fields)
        hint = did_you_mean(path[-1], allowed, 0.5) or ", ".join(allowed)
        return Problem("unknown_key", "unknown key", file, row, column, path[-1], hint)
    if error["type"] == "missing":
        return Problem("missing_key", "this required key is missing", file, row, column)
    what = error["msg"].removeprefix("Value error, ")
    found = None if isinstance(error["input"], dict) else str(error["input"])[:200]
    return Problem("wrong_value", what[:1].lower() + what[1:], file, row, column, found, _meant_value(error))


def _meant_value(error: Any) -> str | None:
    """The allowed values where pydantic knows them, or the number that a quoted text may mean."""
    given, expected = error["input"], error.get("ctx", {}).get("expected")
    if error["type"] == "literal_error" and isinstance(given, str):
        return did_you_mean(given, re.findall(r"'([^']+)'", expected)) or expected
    found = _QUOTED_NUMBER.fullmatch(given.strip()) if isinstance(given, str) else None
    if found and error["type"] in ("float_type", "float_parsing", "int_type"):
        return f"a number without quotation marks and unit: did you mean {found[1].replace(',', '.')}?"
    return None


def _row_of(path: Sequence[str], text: str) -> int | None:
    """Line of the deepest part of ``path`` that stands in the file: the key in its table, else the table."""
    lines = text.split("\n")
    for depth in range(len(path), 0, -1):
        dotted = r"\s*\.\s*".join(f'"?{re.escape(part)}"?' for part in path[:depth])
        header = re.compile(rf"\s*\[\s*{dotted}\s*\]")
        start = next((k for k, line in enumerate(lines) if header.match(line)), None)
        if start is None:
            continue
        for k in range(start + 1, len(lines)):
            if re.match(r"\s*\[", lines[k]):
                break
            if depth < len(path) and re.match(rf'\s*"?{re.escape(path[depth])}"?\s*=', lines[k]):
                return k + 1
        return start + 1
    key = re.compile(rf'\s*"?{re.escape(path[0])}"?\s*=') if path else None
    return next((k + 1 for k, line in enumerate(lines) if key and key.match(line)), None)


_TOML_TEXT = """\
# Description of a campaign: sample, counterface and patterns. Replace the example values by your own.

[campaign]
title = "Sled friction of patterned PDMS on polycarbonate"
material = "PDMS (Sylgard 184)"
counterface = "polycarbonate"
nominal_area_mm2 = 55.0   # area of the sample face, including cavities
slider_mass_g = 1.5       # mass of sled and sample, without the added mass
pull_speed_mm_s = 0.2     # used for tests without speed_mm_s in tests.csv
# viscosity_mPa_s = 85.0  # of the lubricant, for Hersey numbers; also a column of tests.csv
# zero = "none"           # of the force: "before contact", "at rest", "none", a number of newtons, or [from, to] in s
# load_zero = "none"      # of the recorded normal load, in the same form

# Patterns, one table each. cavity is "none", "circle" (with diameter_um), "square" or "rectangle" (with size_um);
# all but "none" also need pitch_um. Sizes and pitches are one number or [x, y], in micrometres.
# staggered = true shifts every other row of cavities by half a pitch along x.
# area_fraction = 0.71 gives a measured contact area fraction; it replaces the one computed from the geometry.
# Samples Sx and Sy in tests.csv mean pattern S pulled along x and along y.

[patterns.F]
cavity = "none"

[patterns.A]
cavity = "circle"
diameter_um = 5.0
pitch_um = [20.0, 20.0]

[patterns.S]
cavity = "rectangle"
size_um = [200.0, 40.0]
pitch_um = [220.0, 120.0]
staggered = true

# tests.csv has one row per pull; its column file names the export in raw/. If an export holds several pulls, file
# also selects the pull:
#   raw/log.csv#2     second table of the export (step, segment or specimen)
#   raw/log.csv#2/3   third pull of that table (a stroke, or one of several loads or speeds)
#   raw/log.csv#2/*   all pulls of that table, each as a separate test
#   raw/log.csv#*     all pulls of the export, each as a separate test
# In such a row the load may be left empty; the normal force recorded in the export is then used.

# If tribo does not recognise the columns of your exports (check with: tribo inspect FILE), name them here: the
# quantity, then the column by its name and unit, or by its position and unit.
# [columns]
# time = "Clock [s]"
# force = "Channel 2 [N]"
# displacement = "#3 [mm]"

# Standard uncertainties (k = 1) of the test rig. Defaults are used for values not given here.
# [instrument]
# load_cell_u_percent = 0.5
# mass_u_g = 0.05
# area_u_percent = 1.0
# wire_angle_u_deg = 0.5
# stiffness_N_per_m = 2000.0
"""

# Required: test_id, file, sample, and mass_g or normal_load_N. Any further column is kept as a covariate.
_TESTS_TEXT = """\
test_id,file,sample,specimen,direction,mass_g,normal_load_N,speed_mm_s,hold_s,repeat,run_order,specimen_run,\
started_at,temperature_C,humidity_pct,operator,exclude
T0001,raw/T0001.csv,F,F1,,50,,0.2,10,1,1,1,2026-03-02T09:00:00,22.5,51,,
T0002,raw/T0002.csv,Sx,S1,x,50,,0.2,10,1,2,1,2026-03-02T09:08:00,22.6,51,,slipped off the hook
"""


def write_template(folder: Path | str) -> tuple[Path, ...]:
    """Write campaign.toml, tests.csv and an empty raw/ into a folder, to be filled in.

    Parameters
    ----------
    folder : path
        A new folder, or one that holds neither of the two files.

    Returns
    -------
    tuple of Path
        What was written: campaign.toml, tests.csv and raw/.

    Raises
    ------
    CampaignError
        One of them already exists. In this case nothing is written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in tribo.write_template(folder)]
    ['campaign.toml', 'tests.csv', 'raw']
    """
    folder = Path(folder)
    texts = {folder / TOML: _TOML_TEXT, folder / TABLES[0]: _TESTS_TEXT}
    there = [path for path in texts if path.exists()]
    if there or (folder.exists() and not folder.is_dir()):
        what = "this file or folder already exists and is not overwritten"
        raise CampaignError(Problem("exists", what, file=str(path)) for path in there or [folder])
    (folder / RAW).mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        write_new(path, text)
    return (*texts, folder / RAW)
