"""Broad bounds of friction tests by material class, each with its source; campaign.toml may replace any of them.

A bound is wide on purpose: published values lie well inside it, and slips of a unit (a factor of 10 to 1000) outside.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from tribo.records import Campaign


@dataclass(frozen=True)
class Bound:
    """The plausible range of one quantity, in the unit of its name, and where it is from."""

    low: float
    high: float
    source: str


OWN = "[plausible] of campaign.toml"
_FRICTION = "static and kinetic coefficients of engineering tables"
_BERARDO = "Berardo et al. 2019, Table 2: mu up to 4.8 and tau0 up to 0.1 MPa for PDMS"
_PTFE = f"{_FRICTION}: the lowest of dry solids is PTFE with 0.04"
MU: Mapping[str, Bound] = {
    "": Bound(0.04, 20.0, _PTFE),
    "elastomer": Bound(0.1, 20.0, _BERARDO),
    "polymer": Bound(0.03, 3.0, _PTFE),
    "metal": Bound(0.05, 5.0, f"{_FRICTION}: clean copper on copper 1.6"),
    "ceramic": Bound(0.01, 3.0, "carbon coatings come near 0.01, below which friction is called superlubric"),
    "lubricated": Bound(0.0005, 0.6, "full films 0.001 to 0.1, boundary lubrication up to 0.3"),
    "granular": Bound(0.1, 2.0, "internal and boundary friction of sand 0.4 to 0.8"),
}
ADHESION = 5.0  # factor by which T/N at a low load may exceed mu, because tau0 A is added to mu N
TAU0_KPA: Mapping[str, Bound] = {
    "": Bound(-1e3, 1e3, "shear strength of elastomers in full contact is below 1 MPa, of sleds far less"),
    "elastomer": Bound(-1e3, 1e3, "shear strength of elastomers in full contact is below 1 MPa"),
    "polymer": Bound(-5e4, 5e4, "shear strength of polymers, about 50 MPa"),
    "metal": Bound(-1e6, 1e6, "shear strength of metals, below 1 GPa"),
    "ceramic": Bound(-1e6, 1e6, "shear strength of hard coatings, below 1 GPa"),
    "lubricated": Bound(-1e5, 1e5, "limiting shear stress of lubricants, below 100 MPa"),
    "granular": Bound(-1e3, 1e3, "cohesion of soils and rock powder, below 1 MPa"),
}
PRESSURE_KPA: Mapping[str, Bound] = {
    "": Bound(1e-3, 1e5, "a sheet of paper on itself presses with 1 Pa; polymers yield at about 100 MPa"),
    "elastomer": Bound(1e-3, 1e4, "modulus of elastomers, 1 to 10 MPa"),
    "metal": Bound(1e-3, 1e7, "hardness of steels, up to 10 GPa"),
    "ceramic": Bound(1e-3, 5e7, "hardness of diamond-like coatings, up to 50 GPa"),
    "lubricated": Bound(1e-3, 1e7, "Hertzian pressure of bearings, up to 4 GPa"),
}
_SLED = "sleds of ASTM D1894 and ISO 8295 (200 g, 40 cm2, 1.7 to 2.5 mm/s) and the paper (55 mm2, 0.2 mm/s)"
_RIGS = "force microscopes to brake rigs"
SPEED_MM_S: Mapping[str, Bound] = {"": Bound(1e-9, 1e5, _RIGS), "sled": Bound(1e-5, 1e4, _SLED)}
AREA_MM2: Mapping[str, Bound] = {"": Bound(1e-9, 1e7, _RIGS), "sled": Bound(1.0, 1e6, _SLED)}
MASS_G: Mapping[str, Bound] = {"": Bound(1e-3, 1e6, _RIGS), "sled": Bound(0.5, 5e4, _SLED)}
TEMPERATURE_C: Mapping[str, Bound] = {
    "": Bound(-100.0, 250.0, "glass transition to decomposition of common polymers"),
    "metal": Bound(-273.15, 1200.0, "melting of steels"),
    "ceramic": Bound(-273.15, 1500.0, "hot hardness tests of ceramics"),
    "lubricated": Bound(-80.0, 450.0, "pour point to decomposition of oils"),
}
HUMIDITY_PCT: Mapping[str, Bound] = {"": Bound(0.0, 100.0, "definition of relative humidity")}
SMALLEST_CAVITY_UM = 0.5  # about what contact lithography resolves
FEWEST_CAVITIES_ACROSS = 2.0  # a sample with fewer is no pattern
MOST_OFF_AREA_FRACTION = 0.2  # by which a measured contact area fraction may differ from that of the geometry
ONE_LOAD = 1.05  # largest over smallest load up to which loads were meant to be one, as in the fits
SMALLEST_LOAD_SPAN = 1.1  # largest over smallest load; at 1 % scatter of T a slope over 10 % is uncertain by about 20 %

TABLES: Mapping[str, Mapping[str, Bound]] = {
    "mu": MU, "tau0_kPa": TAU0_KPA, "pressure_kPa": PRESSURE_KPA, "speed_mm_s": SPEED_MM_S, "area_mm2": AREA_MM2,
    "mass_g": MASS_G, "temperature_C": TEMPERATURE_C, "humidity_pct": HUMIDITY_PCT,
}  # fmt: skip
_WORDS = {
    "lubricated": r"oils?|greased?|lubricat\w*|lubricants?|in water|glycerol",
    "granular": r"sand|quartz sand|granular|powder|gouge|soil",
    "elastomer": r"pdms|sylgard|rubbers?|elastomers?|silicones?|epdm|nbr|fkm|sbr|polyurethane|tpu|ecoflex",
    "polymer": r"ptfe|teflon|uhmwpe|polyethylene|polypropylene|nylon|polyamide|pa66?|pom|peek|pmma|petg?|pla|abs"
    r"|polycarbonate|films?|paper|wood|textile|leather",
    "ceramic": r"ceramics?|alumina|zirconia|si3n4|sic|glass|diamond|dlc|graphite|mos2",
    "metal": r"steels?|iron|metals?|aluminium|aluminum|copper|bronze|brass|titanium|alloys?|100cr6|nickel|42crmo4",
}


def material_class(campaign: Campaign) -> str:
    """The class stated in campaign.toml, else one that the words of material and counterface name, else empty.

    The softer or lubricated partner decides, as it does about friction: oil before sand, before rubber, before plastic.
    Where neither body is described, the names of the samples stand for them.
    """
    if campaign.material_class:
        return campaign.material_class
    words = f"{campaign.material} {campaign.counterface}".strip() or " ".join(campaign.samples).replace("_", " ")
    words = words.lower()
    return next((name for name, pattern in _WORDS.items() if re.search(rf"\b(?:{pattern})\b", words)), "")


def bound_of(quantity: str, campaign: Campaign) -> Bound:
    """The plausible range of a quantity for a campaign: its own, else that of its material class or kind of contact."""
    if quantity in campaign.plausible:
        low, high = campaign.plausible[quantity]
        return Bound(low, high, OWN)
    if quantity == "friction_ratio":
        mu = bound_of("mu", campaign)
        return Bound(mu.low, ADHESION * mu.high, mu.source)
    table = TABLES[quantity]
    return table.get(material_class(campaign)) or table.get(campaign.contact or "sled") or table[""]
