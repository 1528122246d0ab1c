"""The columns of an export: what their names say, what the user states, and the quantity and unit each is read as.

Nothing is guessed: doubtful cases are errors.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from tribo.errors import Problem, ReadError
from tribo.records import UNCORRECTED, Correction
from tribo.units import QUANTITIES, match_quantity, narrow, plain_name, quantity_named, turns_a_time, unit_factor
from tribo.user_text import did_you_mean

ASKED = "asked for"
NONE, IGNORE, DECIMAL, ACCEPT = "none", "ignore", "decimal", "accept"
# damage that a user may accept: rows that are then left out, and one that is then taken as it stands
ROWS_LEFT_OUT = ("text_in_numbers", "two_decimal_marks", "nan_gap", "wrong_number_of_cells", "truncated_mid_row")
ACCEPTABLE = ("scale_jump", *ROWS_LEFT_OUT)
NEEDED = ("time", "friction force")
_SIMILAR = 0.7  # difflib ratio from which a name that was asked for is taken for a misspelt one of the file
_MEANS_NORMAL_BESIDE_FRICTION = {  # beside a friction force, a friction coefficient or a torque
    "load", "last", "applied load", "charge", "carga", "obciążenie", "obciazenie", "нагрузка", "载荷", "负荷", "荷重",
    "하중",
}  # fmt: skip
FORCES_OF_NO_KIND = {
    "force", "kraft", "f", "effort", "fuerza", "forza", "forca", "kracht", "sila", "voima", "kuvvet", "forta",
    "load cell", "axial force", "standard force", "standardkraft", "prufkraft", "force standard", "сила", "усилие",
    "力", "試験力", "힘",
}  # fmt: skip
_A_RATIO_BESIDE_STRESS = {"friction", "friktion", "frottement", "tarcie", "reibung"}  # without a unit
_WITHOUT_DIMENSION = ("-", "1")
_LOAD_AND_PATH = ("normal force", "displacement")  # what a test is about: an unknown unit of theirs is a fault
_ALONG_THE_AXIS = {"axial force", "axial load", "thrust", "thrust force"}
_SAYS_FRICTION = re.compile(
    r"friction|friccion|rozamiento|frottement|attrito|atrito|friktion|reib|tarci|wrijving|treni|surtunme|frecare|kitka|"
    r"tangential|tangentiel|horizontal|orizzontal|poziom|трени|摩擦力|水平力|마찰력"
)
_SAYS_SLIDING_SPEED = re.compile(r"sliding (?:speed|velocity)|gleitgeschwindigkeit|vitesse de glissement")
_MEASURED_BEFORE = re.compile(r"^(?:measured|actual|gemessene?[rs]?)\s+", re.I)
_SAYS_DEPTH = re.compile(r"\bdepth\b|penetration|indentation|eindring|profondeur|profundidad")
_SAYS_NORMAL = re.compile(
    r"\bnorma[al]|normalkraft|normallast|vertical|vertikal|pionow|нормальн|法向|垂直力|수직"
)
_NO_FORCE = re.compile(
    r"set ?point|\bset\b|target|soll|limit|max|min|peak|break|\bstd\b|\bsd\b|deviation|error|zero|offset"
)
_CLOCK_OF_RATE = re.compile(r"^(?:zeit|time|temps)\b.*rate$")  # "Zeit  1 - Standardmessrate"
_ONLY_WITH_UNIT = ("radius", "frequency", "normal stress", "shear stress")  # of no use without
_A_RATIO = re.compile(
    r"\b(?:cof|coeff?|coefficient|koeffizient|coefficiente?)\b|friction factor|reibwert|reibzahl|摩擦[係系]数"
)
_RPM = ("rpm", "RPM", "rev/min", "r/min", "1/min", "U/min", "tr/min", "obr/min", "об/мин", "转/分")
_OF_A_CONVERTER = re.compile(r"[mµu]?v(?:olts?)?|[mµu]?v/v|bits?|counts?|digits?|adc|raw|lsb", re.I)
_UNIT_OF_COUNTS = {"seconds": "s", "sekunden": "s", "millis": "ms", "milliseconds": "ms"}  # names that are a unit
_ACCELERATION = re.compile(r"m\s*/\s*s(?:ec)?\s*(?:\^?2|²)|m/s/s|m·?s(?:\^?-2|⁻²)")
_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]*(?:\([^\[\]()]*\)[^\[\]()]*)?)\s*[\])]\s*$")
_AFTER_MARK = re.compile(r"^(.*\S)\s*(?:\s?/|\sin\s|,\s|_)\s*((?:[^\W\d_]|[°%])[\w/°%^·²-]*)$")
_SPEED_BEHIND = re.compile(r"(.*\S)_([munk]?m)_(?:per_)?(s|min)", re.I)  # speed_mm_s
_AFTER_BLANK = re.compile(r"^(.*\S)\s+((?:[^\W\d_]|[°%])[\w/°%^·²-]*)$")
_RUN_BEHIND = re.compile(r"(.*[\])])\s+(run\s*#?\s*\d+)\s*", re.I)  # "Force (N) Run #1" is "Run #1: Force (N)"

TABLE_OPTION = "--table sample=COLUMN,normal_load_N=COLUMN,coefficient=COLUMN"

Columns = Mapping[str, str | Sequence[str]]  # the column of each quantity, as a user states it
Chosen = dict[str, tuple[int, str | None, str]]  # position, unit if given, and reason of the column of each quantity


def bare_unit(unit: str) -> str:
    """ "(mm)" and "[mm]" -> "mm"."""
    found = _BRACKETS.fullmatch(narrow(unit.strip()))
    return found.group(1).strip() if found else unit.strip()


def match_column(name: str) -> tuple[str, int] | None:
    """(quantity, rank) of a column name with or without its unit in it."""
    return match_quantity(name) or match_quantity(split_unit(name)[0])


@lru_cache(maxsize=1024)
def split_unit(name: str) -> tuple[str, str | None]:
    """("Kraft", "kN") of "Kraft [kN]", "Kraft (kN)", "Kraft / kN", "Kraft/kN", "Kraft in kN", "Kraft_kN", "Kraft kN".

    A number of a run behind them, as in "Kraft (kN) Run #1", comes before the name.
    """
    name = narrow(name)
    if found := _RUN_BEHIND.fullmatch(name):
        name = f"{found.group(2)}: {found.group(1)}"
    found = _BRACKETS.search(name)
    if found:
        return name[: found.start()].strip().removesuffix("/").strip(), found.group(1).strip()
    if (found := _SPEED_BEHIND.fullmatch(name)) and match_quantity(found.group(1)):
        return found.group(1), f"{found.group(2)}/{found.group(3)}"
    for pattern in (_AFTER_MARK, _AFTER_BLANK):
        found = pattern.match(name)
        hit = match_quantity(found.group(1)) if found and match_quantity(name) is None else None
        if found and hit and (is_unit(found.group(2), hit[0]) or (hit[0] == "speed" and turns_a_time(found.group(2)))):
            return found.group(1).strip(), found.group(2)
    return name, None


def is_unit(text: str, quantity: str) -> bool:
    """Whether a text is a unit of a quantity."""
    try:
        unit_factor(text, quantity)
    except ReadError:
        return False
    return True


@dataclass(frozen=True)
class Hint:
    """A column for a quantity, by name and unit ("Fx [gf]") or position ("#3 [N]"), and its source.

    A name with ``*`` or ``?`` means every column it fits: one record each.
    """

    quantity: str
    wanted: str
    reason: str = ASKED

    @property
    def is_pattern(self) -> bool:
        """Whether the hint may mean several columns."""
        return any(mark in split_unit(self.wanted)[0] for mark in "*?")


@dataclass(frozen=True)
class Given:
    """Everything stated for one export.

    ``without`` are quantities that are not read although a column has their name, ``ignored`` columns that are not
    looked at, by name or position; ``decimal`` is the decimal mark, "" where the file settles it; ``accepted`` are
    kinds of damage.
    """

    hints: tuple[Hint, ...] = ()
    without: frozenset[str] = frozenset()
    ignored: tuple[str, ...] = ()
    decimal: str = ""
    accepted: frozenset[str] = frozenset()
    correction: Correction = UNCORRECTED

    def names(self, name: str) -> bool:
        """Whether a hint names this column."""
        return any(name in (hint.wanted, split_unit(hint.wanted)[0]) for hint in self.hints)

    def with_hints(self, hints: Sequence[Hint]) -> Given:
        """The same with hints of the format added; those of the user come first."""
        return replace(self, hints=(*self.hints, *(h for h in hints if h.quantity not in self.without)))

    def ignores(self, index: int, name: str) -> bool:
        """Whether the column at a position (from 0) is not to be looked at."""
        return any(wanted in (f"#{index + 1}", name, split_unit(name)[0]) for wanted in self.ignored)


def parse_columns(columns: Columns | None, correction: Correction | None = None, *, strict: bool = True) -> Given:
    """``{quantity: "name [unit]"}`` as hints; "none" for a quantity to leave out; ``ignore``, ``decimal``, ``accept``.

    Without ``strict``, entries that cannot be used are left out.

    Raises
    ------
    ReadError
        unknown_quantity for every key that names none, unknown_decimal for a mark that is no decimal mark,
        not_acceptable for damage that cannot be accepted.
    """
    stated: dict[str, str | Sequence[str]] = {}
    problems = []
    for key, value in (columns or {}).items():
        if key == IGNORE or (key == DECIMAL and value in (".", ",")) or quantity_named(key) is not None:
            stated[key] = value
        elif key == DECIMAL:
            what, allowed = "not a decimal mark", '"." or ","'
            problems.append(Problem("unknown_decimal", what, found=str(value), allowed=allowed))
        elif key == ACCEPT:
            stated[key] = value
            if wrong := set(_listed_in(value)) - set(ACCEPTABLE):
                what = "not a damage that can be accepted"
                found, allowed = ", ".join(sorted(wrong)), ", ".join(ACCEPTABLE)
                problems.append(Problem("not_acceptable", what, found=found, allowed=allowed))
        else:
            names = [name.replace(" ", "_") for name in QUANTITIES]
            meant = did_you_mean(key, [*names, IGNORE, DECIMAL, ACCEPT])
            allowed = f"{', '.join(names)}; {IGNORE}, {DECIMAL}, {ACCEPT}{f' ({meant})' if meant else ''}"
            problems.append(Problem("unknown_quantity", "not a known quantity", found=key, allowed=allowed))
    if strict and problems:
        raise ReadError(problems)
    wanted = [(quantity, str(value).strip()) for key, value in stated.items() if (quantity := quantity_named(key))]
    return Given(
        tuple(Hint(quantity, name) for quantity, name in wanted if name.lower() != NONE),
        frozenset(quantity for quantity, name in wanted if name.lower() == NONE),
        _listed_in(stated.get(IGNORE, ())),
        str(stated.get(DECIMAL, "")),
        frozenset(_listed_in(stated.get(ACCEPT, ()))),
        correction or UNCORRECTED,
    )


def _listed_in(value: str | Sequence[str]) -> tuple[str, ...]:
    listed = re.split(r"\s*;\s*", value) if isinstance(value, str) else value
    return tuple(text.strip() for text in listed if text.strip())


def columns_from_text(text: str) -> dict[str, str]:
    """Columns as given on a command line: "time=Clock [s], friction_force=#3 [gf], displacement=none".

    Raises
    ------
    ReadError
        bad_columns, for a part that is not QUANTITY=COLUMN.
    """
    found = {}
    for part in re.split(r",(?=\s*\w[\w ]*=)", text):
        key, equals, value = part.partition("=")
        if not equals or not key.strip() or not value.strip():
            allowed = "time=NAME [unit], friction_force=#3 [unit]"
            raise ReadError(Problem("bad_columns", "not QUANTITY=COLUMN", found=part.strip(), allowed=allowed))
        found[key.strip()] = value.strip()
    return found


@dataclass(frozen=True)
class Column:
    """One column taken for a quantity: SI value = factor * value + offset. ``index`` counts from 0.

    ``index`` is -1 for a quantity that follows from others, or from what was stated.
    """

    quantity: str
    index: int
    label: str
    factor: float
    offset: float
    reason: str


@lru_cache(maxsize=512)
def assign(
    names: tuple[str, ...], units: tuple[str, ...], filled: tuple[bool, ...], given: Given
) -> tuple[tuple[Column, ...], tuple[Problem, ...]]:
    """The column of each quantity, time and friction force first, and doubts.

    Where a quantity that a trace can do without has no unit, it is left out. A column that was asked for and is not
    here is a doubt where the names of the file are sufficient without it.

    Raises
    ------
    ReadError
        missing_column, missing_unit, ambiguous_unit or unknown_unit; all of them at once.
    """
    filled = tuple(there and not given.ignores(k, names[k]) for k, there in enumerate(filled))
    chosen, absent, problems = _asked_for(given.hints, names)
    taken = {index for index, _, _ in chosen.values()}
    for quantity, index, reason in _matches(names, units, filled, taken, set(chosen)):
        if quantity not in given.without:
            chosen.setdefault(quantity, (index, None, reason))
    columns, doubts, faults = _columns(chosen, names, units, given.correction)
    unreadable = {problem.column for problem in faults}
    there = {c.quantity for c in columns} | {q for q, (k, *_) in chosen.items() if _called(names, k) in unreadable}
    follows = {  # time from rate or path
        "time": given.correction.sampling_rate_Hz is not None or "displacement" in there,
        "friction force": force_follows(there, given.correction),
    }
    if not problems and (of_two := _one_of_two_forces(chosen, names, units, filled)):
        raise ReadError(of_two)
    missing = [q for q in NEEDED if q not in there and not follows[q]]
    if "friction force" in missing and doubts:  # it may follow from a column whose unit is missing or unknown
        faults, doubts = [*faults, *doubts], []
        if force_follows({*there, *chosen}, given.correction):
            missing.remove("friction force")
    refused = {h.quantity for h in given.hints} - set(chosen)
    if absent and (missing or faults or problems):
        problems += absent
    elif absent:
        what = "this column, given in columns, is not in this table, which was read by its own names"
        doubts += [Problem("column_not_here", what, found=p.found, allowed=p.allowed) for p in absent]
    problems += [_missing(q, names, there) for q in missing if q not in refused]
    if problems or faults:
        raise ReadError([*problems, *faults])
    return tuple(columns), tuple(doubts)


def _one_of_two_forces(
    chosen: Chosen, names: Sequence[str], units: Sequence[str], filled: Sequence[bool]
) -> Problem | None:
    """The fault of a load or force read as friction beside a force of a name that nobody knows: it may be the load."""
    index, _, reason = chosen.get("friction force", (-1, None, ""))
    plain = plain_name(split_unit(names[index])[0]) if index >= 0 else ""
    of_no_kind = plain in _MEANS_NORMAL_BESIDE_FRICTION or plain in FORCES_OF_NO_KIND
    if not reason.startswith("named") or not of_no_kind or "normal force" in chosen:
        return None
    taken = {k for k, _, _ in chosen.values()}
    for k, name in enumerate(names):
        unit, bare = _unit_of(names, units, k), plain_name(split_unit(name)[0])
        unknown = name and k not in taken and filled[k] and not match_column(name) and not _NO_FORCE.search(bare)
        if unknown and unit and is_unit(unit, "friction force") and not set(bare.split()) & set(plain.split()):
            what = f"of two forces it is not known which is the friction: {names[index]} or {name}"
            of_both = f'friction_force = "{name}", normal_force = "{names[index]}"'
            allowed = f'{of_both} in columns; or friction_force = "{names[index]}"'
            return Problem("one_of_two_forces", what, column=names[index], allowed=allowed)
    return None


def force_follows(there: Collection[str], stated: Correction) -> str:
    """How the friction force follows from the quantities of a table and what was stated; "" where it does not."""
    if "torque" in there and stated.lever_arm_m is not None:
        return "torque over lever arm"
    ratio = "friction coefficient" in there
    if ratio and "normal force" in there:
        return "coefficient times recorded load"
    if "shear stress" in there and stated.area_m2 is not None:
        return "shear stress times area"
    if ratio and "normal stress" in there and stated.area_m2 is not None:
        return "coefficient times recorded stress"
    if ratio and stated.load_N is not None:
        return "coefficient times stated load"
    return "torque over recorded radius" if {"torque", "radius"} <= set(there) else ""


def _asked_for(hints: Sequence[Hint], names: Sequence[str]) -> tuple[Chosen, list[Problem], list[Problem]]:
    """(column, unit, reason) of each quantity with a hint; hints for columns not in the file; hints misspelt."""
    chosen: Chosen = {}
    absent: list[Problem] = []
    problems: list[Problem] = []
    for hint in hints:
        try:
            chosen.setdefault(hint.quantity, _wanted_column(hint, names))
        except ReadError as why:
            bare = split_unit(hint.wanted)[0]
            similar = difflib.get_close_matches(bare, [split_unit(n)[0] for n in names if n], 1, _SIMILAR)
            strict = bool(similar) or hint.wanted.startswith("#") or hint.reason != ASKED
            (problems if strict else absent).extend(why.problems)
    return chosen, absent, problems


def _columns(
    chosen: Chosen, names: Sequence[str], units: Sequence[str], correction: Correction
) -> tuple[list[Column], list[Problem], list[Problem]]:
    """Columns with their units; doubts about columns left out; faults of columns that are needed."""
    columns: list[Column] = []
    doubts: list[Problem] = []
    faults: list[Problem] = []
    for quantity in sorted(chosen, key=list(QUANTITIES).index):
        index, unit, reason = chosen[quantity]
        try:
            columns.append(_column(quantity, index, unit, reason, (names, units)))
        except ReadError as why:
            if quantity in _ONLY_WITH_UNIT and reason.startswith("named"):
                continue
            called = _called(names, index)
            way = f'{quantity.replace(" ", "_")} = "{split_unit(called)[0]} [unit]" in columns, the unit such as '
            units_of = {"ambiguous_unit": "gf or N"}
            volts = bool(_OF_A_CONVERTER.fullmatch(_unit_of(names, units, index)))
            calibrated = f'; of a raw signal, what 1 of it means: "{split_unit(called)[0]} [12.5 N]"' if volts else ""
            found = [
                replace(p, column=called, allowed=way + units_of.get(p.kind, QUANTITIES[quantity].si_unit) + calibrated)
                for p in why.problems
            ]
            replaced = quantity == "time" and correction.sampling_rate_Hz is not None
            optional = quantity not in NEEDED or replaced
            may_be_wrong = quantity not in _LOAD_AND_PATH and reason.startswith("named")
            doubtful = ("missing_unit", "ambiguous_unit", *(("unknown_unit",) if may_be_wrong else ()))
            left_out = optional and all(p.kind in doubtful for p in found)
            (doubts if left_out else faults).extend(found)
    return columns, doubts, faults


def _called(names: Sequence[str], index: int) -> str:
    return names[index] or f"#{index + 1}"


def _matches(
    names: Sequence[str], units: Sequence[str], filled: Sequence[bool], taken: set[int], asked: set[str]
) -> list[tuple[str, int, str]]:
    """(quantity, index, reason) of the best-named column of each quantity; the first of equal ones."""
    raw = raw_signals(names, units)
    hits = {
        index: _by_its_unit(names, units, index, hit)
        for index, name in enumerate(names)
        if name and index not in taken | raw and filled[index] and (hit := match_column(name))
    }
    bare = [split_unit(name)[0] for name in names]
    for index in sorted({*range(len(names))} - taken - raw - set(hits)):
        beside = _MEASURED_BEFORE.sub("", bare[index])
        if filled[index] and beside in bare and beside != bare[index] and (hit := match_quantity(beside)):
            hits[index] = (hit[0], hit[1] - 1)  # before the same without that word: what was set
            continue
        if filled[index] and names[index] and (hit := by_a_word(names[index], _unit_of(names, units, index))):
            hits[index] = hit
    there = asked | {quantity for quantity, _ in hits.values()}
    if "torque" in there:  # along the axis about which it acts
        for index in hits:
            if plain_name(split_unit(names[index])[0]) in _ALONG_THE_AXIS:
                hits[index] = ("normal force", len(QUANTITIES["normal force"].aliases))
    plain = [plain_name(split_unit(name)[0]) for name in names]
    pressed = "displacement" not in there and any(map(_SAYS_DEPTH.search, plain))  # an indenter, a needle
    of_loads = _MEANS_NORMAL_BESIDE_FRICTION | (_ALONG_THE_AXIS | {"force", "kraft", "fz"} if pressed else set())
    loads = [index for index in hits if split_unit(names[index])[0].strip().lower() in of_loads]
    friction = [(rank, index) for index, (quantity, rank) in hits.items() if quantity == "friction force"]
    of_another = "friction force" in asked or bool(friction and min(friction)[1] not in loads)
    ratio = there & {"friction coefficient", "torque"} or any(map(_A_RATIO.search, plain))
    if not (of_another or ratio or pressed):
        loads = [index for _, index in sorted(friction)[1:] if index in loads]
    for index in loads:  # a load beside what friction is read from is the normal one; it comes after those named so
        if hits[index][0] == "friction force":
            hits[index] = ("normal force", len(QUANTITIES["normal force"].aliases))
    best: dict[str, tuple[int, int]] = {}
    for index, (quantity, rank) in hits.items():
        if quantity not in best or rank < best[quantity][0]:
            best[quantity] = (rank, index)
    return [(q, index, f'named "{names[index]}"') for q, (_, index) in best.items()]


def raw_signals(names: Sequence[str], units: Sequence[str]) -> set[int]:
    """Columns in volts of what another column holds in its unit: a machine may write both."""
    hits = {k: hit[0] for k, name in enumerate(names) if name and (hit := match_column(name))}
    raw = {k for k in hits if _OF_A_CONVERTER.fullmatch(_unit_of(names, units, k))}
    measured = {hits[k] for k in set(hits) - raw if is_unit(_unit_of(names, units, k), hits[k])}
    return {k for k in raw if hits[k] in measured}


def by_a_word(name: str, unit: str) -> tuple[str, int] | None:
    """What a column is whose name holds a telling word, "RMS friction force", and whose unit agrees; None otherwise."""
    plain = plain_name(split_unit(name)[0])
    if unit in _RPM:
        return "rotation speed", len(QUANTITIES["rotation speed"].aliases)
    if _CLOCK_OF_RATE.search(plain) and is_unit(unit, "time"):
        return "time", len(QUANTITIES["time"].aliases)
    if unit and is_unit(unit, "normal force") and not _NO_FORCE.search(plain):
        if _SAYS_NORMAL.search(plain):
            return "normal force", len(QUANTITIES["normal force"].aliases) + 1
        if _SAYS_FRICTION.search(plain):  # before names such as load or force, which say less
            return "friction force", QUANTITIES["friction force"].aliases.index("lateral force")
    if (plain == "v" or _SAYS_SLIDING_SPEED.search(plain)) and unit and is_unit(unit, "speed"):
        return "speed", len(QUANTITIES["speed"].aliases)
    return None


def _by_its_unit(names: Sequence[str], units: Sequence[str], index: int, hit: tuple[str, int]) -> tuple[str, int]:
    """What a column is where its unit, or the lack of one, tells more than its name."""
    unit = _unit_of(names, units, index)
    if hit[0] == "time" and is_unit(unit, "temperature"):  # T [°C]
        return "temperature", len(QUANTITIES["temperature"].aliases)
    if hit[0] == "speed" and turns_a_time(unit):
        return "rotation speed", hit[1]
    if hit[0] == "rotation speed" and unit and not turns_a_time(unit) and is_unit(unit, "speed"):
        return "speed", hit[1]
    if hit[0] == "friction force" and plain_name(split_unit(names[index])[0]) in _A_RATIO_BESIDE_STRESS:
        beside_stress = any((other := match_column(name)) and other[0] == "normal stress" for name in names)
        if unit in _WITHOUT_DIMENSION or (not unit and beside_stress):
            return "friction coefficient", hit[1]
    return hit


def _unit_of(names: Sequence[str], units: Sequence[str], index: int) -> str:
    """The unit of a column as the file has it; a name such as "rpm" is its own."""
    own = split_unit(names[index])[0].strip()
    named = own if turns_a_time(own) else _UNIT_OF_COUNTS.get(own.lower(), "")
    return bare_unit(units[index]) or split_unit(names[index])[1] or named


def _wanted_column(hint: Hint, names: Sequence[str]) -> tuple[int, str | None, str]:
    wanted = hint.wanted
    name, unit = (wanted, None) if wanted in names else split_unit(wanted)
    if re.fullmatch(r"#\d+", name) and 1 <= int(name[1:]) <= len(names):
        return int(name[1:]) - 1, unit, f"{hint.reason} by position" if hint.reason == ASKED else hint.reason
    bare = [split_unit(n)[0] for n in names]
    for have in (list(names), bare):
        if name in have:
            return have.index(name), unit, f"{hint.reason} by name" if hint.reason == ASKED else hint.reason
    meant = did_you_mean(name, [n for n in names if n])
    allowed = f"{_listed(names)}{f' ({meant})' if meant else ''}"
    what = f"no column has the name or position given for the {hint.quantity}"
    raise ReadError(Problem("missing_column", what, found=wanted, allowed=allowed))


def _column(
    quantity: str, index: int, unit: str | None, reason: str, header: tuple[Sequence[str], Sequence[str]]
) -> Column:
    names, units = header
    if unit is None:
        unit = _unit_of(names, units, index)
        if unit == "g" and "force" in quantity and any(map(_ACCELERATION.search, (*names, *units))):
            what = "the unit g may be gram-force or acceleration of gravity, as another column is in m/s2"
            raise ReadError(Problem("ambiguous_unit", what, found=unit))
    factor, offset = unit_factor(unit, quantity)
    label = split_unit(names[index])[0] or f"#{index + 1}"
    label = f"{label} [{unit}]" if unit else label
    return Column(quantity, index, label, factor, offset, reason)


def _missing(quantity: str, names: Sequence[str], there: set[str]) -> Problem:
    here = f"columns here: {_listed(names)}" if any(names) else f"{len(names)} columns without names"
    example = '"NAME [unit]"' if any(names) else f'"#{1 if quantity == "time" else 2} [unit]"'
    what = f"no column was recognised as the {quantity}"
    ways = [f"{quantity.replace(' ', '_')} = {example} in columns"]
    if quantity == "time":
        ways += ["a counter takes the sampling interval as its unit, [0.01 s]", "or sampling_rate_Hz = 100"]
        ways += [f"of forces evaluated elsewhere, one row a test: tribo init NEW --from FILE {TABLE_OPTION}"]
    elif "torque" in there:
        what = "the friction is recorded as a torque, without a friction force"
        ways = ["lever_arm_mm = 2.5, the distance of the contact from the axis"]
        return Problem("missing_lever", what, allowed="; ".join([*ways, here]))
    elif "shear stress" in there or {"friction coefficient", "normal stress"} <= there:
        what = "the friction is recorded as a stress, or as a coefficient beside one; the forces need the nominal area"
        return Problem("missing_area", what, allowed="nominal_area_mm2 = 100, in campaign.toml or with --set")
    elif "friction coefficient" in there:
        what = "a friction coefficient is recorded, without a friction force or a load"
        ways = ["normal_load_N in tests.csv or with --set", 'or the load as the unit, friction_force = "NAME [3 N]"']
        return Problem("missing_load", what, allowed="; ".join([*ways, here]))
    return Problem("missing_column", what, allowed="; ".join([*ways, here]))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(n or f"#{k + 1}" for k, n in enumerate(names))
