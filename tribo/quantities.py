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


@dataclass(frozen=True)
class Quantity:
    """A physical quantity; ``column`` is its SI column name, ``aliases`` plain names it goes by."""

    name: str
    symbol: str
    si_unit: str
    column: str
    aliases: tuple[str, ...]


# Plain names (see plain_name) of columns; of several that fit, the one standing first here is preferred.
_ALIASES = {
    "time": """
        time
        test time
        step time
        elapsed time
        timestamp
        time stamp
        total time
        run time
        running time
        zeit
        prufzeit
        laufzeit
        versuchszeit
        temps
        temps d essai
        duree
        t
        test zeit
        temps ecoule
        tiempo
        tempo
        tijd
        total elapsed time
        cycle elapsed time
    """,
    "friction force": """
        friction force
        friction
        tangential force
        traction force
        frictionforce
        lateral force
        reibkraft
        reibungskraft
        force de frottement
        load
        force
        standard force
        standardkraft
        prufkraft
        kraft
        force standard
        fx
        ff
        ft
        f
        load cell
        axial force
        traction force 1
        effort
        last
        tangential load
        tangentialkraft
        force tangentielle
        horizontal force
        pull force
        pulling force
        tensile force
        sled force
        fuerza de friccion
        forza di attrito
        fuerza
        forza
        forca
        kracht
        carga
        force x
        fx force
        daq fx
        tensile load
        zugkraft
        charge
    """,
    "displacement": """
        extension
        displacement
        stroke
        crosshead
        crosshead position
        position
        standard travel
        standardweg
        course standard
        weg
        hub
        course
        deplacement
        axial displacement
        traverse
        course traverse
        traverse abs
        traverse absolue
        maschine
        maschinenweg
        machine displacement
        linear position
        sliding distance
        distance
        x position
        x
        dx
        tensile extension
        tensile displacement
        crosshead displacement
        crosshead travel
        axial extension
        grip to grip separation
        absolute crosshead travel
        crosshead absolute
        actuator displacement
        sled displacement
        travel
        desplazamiento
        spostamento
        deslocamento
        verplaatsing
        extension en traction
        disp
        displ
        xyz x position
    """,
    "normal force": """
        normal force
        normal load
        vertical force
        normal force fz
        ball load
        contact force
        normalkraft
        force normale
        fz
        fn
        fz force
        daq fz
        nominal load
        force z
        carga normal
        forza normale
        fuerza normal
    """,
    "friction coefficient": """
        cof
        friction coefficient
        coefficient of friction
        traction coeff
        daq cof
        mu
        reibwert
        coefficient de frottement
        reibungskoeffizient
        reibzahl
        reibungszahl
        coefficiente di attrito
        coeficiente de friccion
        cof mu
    """,
    "temperature": """
        temperature
        temp
        temperatur
        ambient temperature
        room temperature
        raumtemperatur
    """,
    "humidity": """
        humidity
        relative humidity
        rh
        feuchte
        luftfeuchte
        humidite
    """,
    "speed": """
        sliding velocity
        sliding speed
        speed
        velocity
        geschwindigkeit
        gleitgeschwindigkeit
        vitesse
        vitesse de glissement
    """,
}


def _quantity(name: str, symbol: str, si_unit: str, column: str) -> Quantity:
    aliases = tuple(line.strip() for line in _ALIASES[name].strip().splitlines())
    return Quantity(name, symbol, si_unit, column, aliases)


QUANTITIES: dict[str, Quantity] = {
    q.name: q
    for q in (
        _quantity("time", "t", "s", "time_s"),
        _quantity("friction force", "T", "N", "force_N"),
        _quantity("displacement", "x", "m", "displacement_m"),
        _quantity("normal force", "N", "N", "normal_force_N"),
        _quantity("friction coefficient", "mu", "", "friction_coefficient"),
        _quantity("temperature", "theta", "degC", "temperature_C"),
        _quantity("humidity", "RH", "percent", "humidity_pct"),
        _quantity("speed", "v", "m/s", "speed_m_s"),
    )
}

_RANKS: dict[str, tuple[str, int]] = {
    alias: (q.name, rank) for q in QUANTITIES.values() for rank, alias in enumerate(q.aliases)
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
}
_CASE_MATTERS = {"mN": "millinewton", "MN": "meganewton", "Mm": "megameter", "Nm": "newton * meter"}
_MASSES_AS_FORCES = {"g": "gram_force", "kg": "kilogram_force"}
_NO_UNIT = {"", "-", "1"}
_LONGEST_UNIT = 40
# A product of words and numbers with powers of one digit: nothing that could take long to work out.
_FACTOR = r"\(?[\d.]*\s*[^\W\d_]+[²³]?(?:\^-?\d)?\)?"
_UNIT_EXPRESSION = re.compile(rf"{_FACTOR}(?:\s*[/*· ]\s*{_FACTOR})*")
_NUMBER_BELOW = re.compile(r"/\s*([\d.]+\s*[^\W\d_]+)")


_LONGEST_NAME = 80  # characters; longer cells are no column names
_CHANNEL = re.compile(r"^\s*(?:c|ch|channel|kanal)[ _]?\d+[ _]", re.I)


def plain_name(text: str) -> str:
    """A column name without case, accents, units in brackets or punctuation: "Prüfzeit [s]" -> "prufzeit"."""
    text = re.sub(r"[\[(].*?[\])]", " ", text)
    text = _CHANNEL.sub("", text)
    text = unicodedata.normalize("NFKD", text).replace("μ", "mu ")
    text = "".join(c for c in text if not unicodedata.combining(c)).lower()
    return re.sub(r"[^a-z0-9%]+", " ", text).strip()


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
