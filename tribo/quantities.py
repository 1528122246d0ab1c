"""The quantities of the field: name, symbol, SI unit, and how exports spell them.

The only place where units are converted (pint). Everything inside tribo is SI.
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
    """A physical quantity; ``column`` is its SI column name, ``aliases`` patterns of a plain name."""

    name: str
    symbol: str
    si_unit: str
    column: str
    aliases: tuple[str, ...]


# Aliases are matched in full against plain_name(); earlier quantities win, earlier aliases are preferred.
_ALIASES = {
    "time": """
        time
        test time
        elapsed time
        total time
        run(ning)? time
        zeit
        prufzeit
        laufzeit
        versuchszeit
        temps
        temps d essai
        t
    """,
    "friction force": """
        friction force
        friction
        tangential force
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
        weg
        traverse abs
        traverse
        traverse absolue
        course standard
        deplacement
        axial displacement
        x
        dx
        distance
    """,
    "normal force": """
        normal force
        normal load
        vertical force
        normalkraft
        force normale
        fz
        fn
    """,
    "friction coefficient": """
        cof
        friction coefficient
        coefficient of friction
        mu
        reibwert
    """,
    "temperature": """
        temperature
        temp
        temperatur
    """,
    "humidity": """
        humidity
        relative humidity
        rh
        feuchte
    """,
    "speed": """
        speed
        velocity
        geschwindigkeit
        vitesse
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
    "mm/min": "mm/minute",
    "%": "percent",
    "°c": "degC",
    "degc": "degC",
    "c": "degC",
    "°f": "degF",
}
_CASE_MATTERS = {"mN": "millinewton", "MN": "meganewton", "Mm": "megameter"}


def plain_name(text: str) -> str:
    """A column name without case, accents, units in brackets or punctuation: "Prüfzeit [s]" -> "prufzeit"."""
    text = re.sub(r"[\[(].*?[\])]", " ", text)
    text = unicodedata.normalize("NFKD", text)
    text = "".join(c for c in text if not unicodedata.combining(c)).lower()
    return re.sub(r"[^a-z0-9%]+", " ", text).strip()


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


@lru_cache(maxsize=256)
def unit_factor(unit: str, quantity: str) -> tuple[float, float]:
    """(factor, offset) with SI value = factor * value + offset.

    Raises
    ------
    ReadError
        The unit is unknown, empty, or not one of this quantity: never a guess.
    """
    target = QUANTITIES[quantity].si_unit
    text = unit.strip()
    name = _CASE_MATTERS.get(text) or _SPELLINGS.get(text.lower()) or text
    if "force" in quantity and text.lower() in {"g", "kg"}:
        name = {"g": "gram_force", "kg": "kilogram_force"}[text.lower()]
    if not text and target:
        raise ReadError(Problem("missing_unit", f"the {quantity} has no unit", allowed=f"such as {target}"))
    try:
        ureg = _registry()
        zero = float(ureg.Quantity(0.0, name).to(target or "dimensionless").magnitude)
        one = float(ureg.Quantity(1.0, name).to(target or "dimensionless").magnitude)
    except Exception as why:  # pint raises many kinds, tokenizer errors among them
        raise ReadError(
            Problem("unknown_unit", f"not a unit of {quantity}", found=unit, allowed=f"such as {target}")
        ) from why
    return one - zero, zero


@lru_cache(maxsize=1024)
def match_quantity(name: str) -> tuple[str, int] | None:
    """(quantity, rank of the alias) for a column name, or None where nothing fits."""
    plain = plain_name(name)
    for q in QUANTITIES.values():
        for rank, alias in enumerate(q.aliases):
            if re.fullmatch(alias, plain):
                return q.name, rank
    return None
