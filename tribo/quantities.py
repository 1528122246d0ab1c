"""Physical quantities: name, symbol, SI unit, and their names in exports.

All unit conversions are done here (pint). Everything inside tribo is in SI units.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from tribo.errors import Problem, ReadError
from tribo.quantity_names import ALIASES


@dataclass(frozen=True)
class Quantity:
    """A physical quantity; ``column`` is its SI column name, ``aliases`` plain names it goes by."""

    name: str
    symbol: str
    si_unit: str
    column: str
    aliases: tuple[str, ...]


def _quantity(name: str, symbol: str, si_unit: str, column: str) -> Quantity:
    aliases = tuple(line.strip() for line in ALIASES[name].strip().splitlines())
    return Quantity(name, symbol, si_unit, column, aliases)


QUANTITIES: dict[str, Quantity] = {
    q.name: q
    for q in (
        _quantity("time", "t", "s", "time_s"),
        _quantity("friction force", "T", "N", "force_N"),
        _quantity("displacement", "x", "m", "displacement_m"),
        _quantity("normal force", "N", "N", "normal_force_N"),
        _quantity("friction coefficient", "mu", "", "friction_coefficient"),
        _quantity("torque", "M", "N m", "torque_Nm"),
        _quantity("temperature", "theta", "degC", "temperature_C"),
        _quantity("humidity", "RH", "percent", "humidity_pct"),
        _quantity("speed", "v", "m/s", "speed_m_s"),
        _quantity("rotation speed", "n", "revolution/s", "rotation_rev_per_s"),
    )
}

# Spellings that pint does not know, or knows as something else.
_SPELLINGS = {
    "sec": "s",
    "secs": "s",
    "seconds": "s",
    "msec": "ms",
    "min": "minute",
    "h": "hour",
    "µs": "microsecond",
    "μs": "microsecond",
    "us": "microsecond",
    "n": "newton",
    "newtons": "newton",
    "millinewtons": "millinewton",
    "micron": "micrometer",
    "microns": "micrometer",
    "kn": "kilonewton",
    "mn": "millinewton",
    "cn": "centinewton",
    "un": "micronewton",
    "µn": "micronewton",
    "μn": "micronewton",
    "gf": "gram_force",
    "kgf": "kilogram_force",
    "kp": "kilogram_force",
    "lbf": "pound_force",
    "lb": "pound_force",
    "µm": "micrometer",
    "μm": "micrometer",
    "um": "micrometer",
    "in": "inch",
    '"': "inch",
    "%": "percent",
    "°c": "degC",
    "degc": "degC",
    "c": "degC",
    "°f": "degF",
    "℃": "degC",
    "sek": "s",
    "sek.": "s",
    "seg": "s",
    "с": "s",
    "сек": "s",
    "秒": "s",
    "초": "s",
    "mm/sec": "mm/s",
    "мс": "ms",
    "毫秒": "ms",
    "мин": "minute",
    "н": "newton",
    "кн": "kilonewton",
    "мн": "millinewton",
    "牛": "newton",
    "牛顿": "newton",
    "千牛": "kilonewton",
    "毫牛": "millinewton",
    "мм": "millimeter",
    "мкм": "micrometer",
    "м": "meter",
    "毫米": "millimeter",
    "微米": "micrometer",
    "米": "meter",
}
_CASE_MATTERS = {
    "mN": "millinewton",
    "MN": "meganewton",
    "Mm": "megameter",
    "МН": "meganewton",
    "Мм": "megameter",
    "Nm": "newton * meter",
    "mNm": "millinewton * meter",
    "Ncm": "newton * centimeter",
    "Nmm": "newton * millimeter",
}
_TURNS = {
    "rps": "revolution/s", "rev/s": "revolution/s", "r/s": "revolution/s", "1/s": "revolution/s", "hz": "revolution/s",
    "rpm": "revolution/minute", "rev/min": "revolution/minute", "r/min": "revolution/minute",
    "1/min": "revolution/minute", "min-1": "revolution/minute", "u/min": "revolution/minute",
}  # fmt: skip
_MASSES_AS_FORCES = {"g": "gram_force", "kg": "kilogram_force"}
_NO_UNIT = {"", "-", "1"}
_LONGEST_UNIT = 40
# A product of words and numbers with powers of one digit: nothing that could take long to work out.
_FACTOR = r"\(?[\d.]*\s*[^\W\d_]+[²³]?(?:\^-?\d)?\)?"
_UNIT_EXPRESSION = re.compile(rf"{_FACTOR}(?:\s*[/*· ]\s*{_FACTOR})*")
_NUMBER_BELOW = re.compile(r"/\s*([\d.]+\s*[^\W\d_]+)")


_LONGEST_NAME = 80  # characters; longer cells are no column names
_WIDE = str.maketrans("（）［］【】：／，　", "()[][]:/, ")
_BARRED = str.maketrans({"ł": "l", "ø": "o", "đ": "d", "ß": "ss", "æ": "ae", "œ": "oe", "ı": "i"})
_CHANNEL = re.compile(r"^\s*(?:c|ch|channel|kanal)[ _]?\d+[ _]", re.I)


def narrow(text: str) -> str:
    """Brackets, blanks and marks of full width, as Chinese and Japanese programs write them, as ordinary ones."""
    return text if text.isascii() else text.translate(_WIDE)


def plain_name(text: str) -> str:
    """A column name without case, accents, units in brackets or punctuation: "Prüfzeit [s]" -> "prufzeit"."""
    text = re.sub(r"[\[(].*?[\])]", " ", narrow(text))
    text = _CHANNEL.sub("", text)
    text = unicodedata.normalize("NFKD", text).replace("μ", "mu ")
    text = "".join(c for c in text if not unicodedata.combining(c)).lower().translate(_BARRED)
    return re.sub(r"[^\w%]+|_+", " ", text).strip()


_RANKS: dict[str, tuple[str, int]] = {
    plain_name(alias): (q.name, rank) for q in QUANTITIES.values() for rank, alias in enumerate(q.aliases)
}


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


@lru_cache(maxsize=256)
def unit_factor(unit: str, quantity: str) -> tuple[float, float]:
    """(factor, offset) with SI value = factor * value + offset.

    A unit may be a product and carry a number: "30.7 gf", "N m / 2.5 mm".

    Raises
    ------
    ReadError
        The unit is unknown, empty, or not a unit of this quantity. Units are never guessed.
    """
    target = QUANTITIES[quantity].si_unit or "dimensionless"
    text = unit.strip()
    if not text and target != "dimensionless":
        raise ReadError(Problem("missing_unit", f"the {quantity} has no unit", allowed=f"a unit such as {target}"))
    _registry()  # an installation without a working pint is no fault of the unit
    try:
        zero, one = _in_unit(0.0, text, quantity, target), _in_unit(1.0, text, quantity, target)
    except Exception as why:  # pint raises many kinds, tokenizer errors among them
        raise ReadError(
            Problem("unknown_unit", f"not a unit of {quantity}", found=unit, allowed=f"a unit such as {target}")
        ) from why
    return one - zero, zero


def _in_unit(value: float, text: str, quantity: str, target: str) -> float:
    """``value`` times the unit ``text``, in ``target``."""
    if target == "dimensionless" and text in _NO_UNIT:
        return value
    if quantity == "rotation speed":
        text = _TURNS.get(text.lower(), text)
    ureg = _registry()
    name = _spelled_out(text, quantity)
    if re.fullmatch(r"\w+", name):
        return float(ureg.Quantity(value, name).to(target).magnitude)
    if len(text) > _LONGEST_UNIT or not _UNIT_EXPRESSION.fullmatch(text):
        raise ValueError(text)
    text = _NUMBER_BELOW.sub(r"/(\1)", text)
    expression = re.sub(r"[^\W\d_]+", lambda word: f"({_spelled_out(word[0], quantity)})", text)
    return float((value * ureg.parse_expression(expression)).to(target).magnitude)


def _spelled_out(word: str, quantity: str) -> str:
    """A unit in pint's spelling; g and kg are forces where a force is meant."""
    if "force" in quantity and word.lower() in _MASSES_AS_FORCES:
        return _MASSES_AS_FORCES[word.lower()]
    return _CASE_MATTERS.get(word) or _SPELLINGS.get(word.lower()) or word


@lru_cache(maxsize=1024)
def match_quantity(name: str) -> tuple[str, int] | None:
    """(quantity, rank of the alias) for a column name, or None where nothing fits."""
    if len(name) > _LONGEST_NAME:
        return None
    return _RANKS.get(plain_name(name))


_SHORT_NAMES = {"force": "friction force", "friction": "friction force", "load": "normal force"}


def quantity_named(key: str) -> str | None:
    """The quantity meant by a key such as "force", "normal_force", "time_s"; None where there is none."""
    plain = key.strip().replace("_", " ").lower()
    if plain in _SHORT_NAMES:
        return _SHORT_NAMES[plain]
    for q in QUANTITIES.values():
        if plain == q.name or key.strip() == q.column:
            return q.name
    return None
