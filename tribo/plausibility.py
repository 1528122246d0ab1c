"""Numbers of a campaign outside their broad physical bounds, each a doubt with the slip that may explain it.

The bounds stand here by material class, each with its source; campaign.toml may replace any of them. A bound is wide on
purpose: published values lie well inside it, and slips of a unit (a factor of 10 to 1000) outside. A slip is likely
where it alone brings every number back into its bounds.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise

import numpy as np

from tribo.records import STANDARD_GRAVITY, Campaign, Doubt, Ingested, LawFit


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
LIGHTEST_SLIDER_G = 0.05  # a tenth of the lightest sled below
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


_GRAM, _KPA = 1e-3, 1e-3
Numbers = Mapping[str, dict[str, float]]  # quantity -> what it is of -> its value
MOST_NAMED = 2


@dataclass(frozen=True)
class LikelySlip:
    """A wrong unit: its question, and the factors by which loads, their differences, forces, masses and area change.

    A load N becomes ``difference`` (N - ``offset_N``): the mass of the slider may be right where the others are wrong.
    """

    question: str
    load: float = 1.0
    difference: float = 1.0
    offset_N: float = 0.0
    force: float = 1.0
    mass: float = 1.0
    area: float = 1.0

    def corrected(self, numbers: Numbers, area_m2: float | None) -> Numbers:
        """The numbers as they would be without the slip; there is no tau0 without an area."""
        factors = {
            "mu": self.force / self.difference,
            "friction_ratio": self.force / self.load,
            "tau0_kPa": self.force / self.area,
            "pressure_kPa": self.load / self.area,
            "area_mm2": self.area,
            "mass_g": self.mass,
        }
        found = {q: {of: value * factors[q] for of, value in by.items()} for q, by in numbers.items()}
        for of, mu in numbers.get("mu", {}).items():  # the intercept moves where loads move by more than a factor
            if area_m2 is not None and of in found.get("tau0_kPa", {}):
                found["tau0_kPa"][of] += factors["tau0_kPa"] * mu * self.offset_N / area_m2 * _KPA
        return found


def likely_slips(campaign: Campaign, numbers: Numbers) -> str:
    """The slips that bring every number into its bounds, as a question; empty where none does, or nothing is outside.

    ``numbers`` holds mu, friction_ratio, tau0_kPa, pressure_kPa, area_mm2 and mass_g by what they are of.
    """
    if _all_inside(campaign, numbers):
        return ""
    area_m2 = campaign.nominal_area_m2
    found = [s.question for s in _candidates(campaign) if _all_inside(campaign, s.corrected(numbers, area_m2))]
    return "? Or ".join(found[:MOST_NAMED]) + "?" if found else ""


def _all_inside(campaign: Campaign, numbers: Numbers) -> bool:
    bounds = {quantity: bound_of(quantity, campaign) for quantity in numbers}
    return all(bounds[q].low <= value <= bounds[q].high for q, by in numbers.items() for value in by.values())


def _candidates(campaign: Campaign) -> Iterator[LikelySlip]:
    """Slips in the order of how often they are made: a load typed by hand, the area, then the unit of an export."""
    stated = {test.load_from for test in campaign.tests}
    for column, ways in _LOADS.items():
        if stated == {column}:
            for words, change in ways:
                yield _of_loads(campaign, f"{column or 'the normal force'} looks like {words}", change)
    if "mass_g" in stated and campaign.slider_mass_kg > 0:
        slider = campaign.slider_mass_kg * STANDARD_GRAVITY
        loads = _loads(campaign)
        question = "slider_mass_g in campaign.toml looks like kilograms: multiply by 1000"
        yield LikelySlip(question, load=float(np.median((loads + 999 * slider) / loads)))
    if campaign.has_area:
        for words, factor in _AREAS:
            yield LikelySlip(f"nominal_area_mm2 looks like {words}", area=factor)
    if any(test.evaluated is None for test in campaign.tests):
        for words, factor in _FORCES:
            yield LikelySlip(f"the friction force of the exports looks like {words}", force=factor)


def _of_loads(campaign: Campaign, question: str, change: Callable[[np.ndarray, float], np.ndarray]) -> LikelySlip:
    loads = _loads(campaign)
    slider = campaign.slider_mass_kg * STANDARD_GRAVITY
    other = change(loads, slider)
    usual = float(np.median(other / loads))
    span = float(np.ptp(loads))
    steeper = float(np.ptp(other)) / span if span > 0 else usual
    return LikelySlip(question, usual, steeper, float(np.median(loads - other / steeper)), mass=steeper)


def _loads(campaign: Campaign) -> np.ndarray:
    loads = np.array([test.normal_load_N for test in campaign.tests])
    return loads[np.isfinite(loads) & (loads > 0)]


def _times(factor: float) -> Callable[[np.ndarray, float], np.ndarray]:
    return lambda loads, slider: factor * loads


def _mass_times(factor: float) -> Callable[[np.ndarray, float], np.ndarray]:
    """Loads whose mass, without that of the slider, was too small by ``factor``."""
    return lambda loads, slider: factor * (loads - slider) + slider


_NEWTON_PER_GRAM = _GRAM * STANDARD_GRAVITY
_LOADS: Mapping[str, tuple[tuple[str, Callable[[np.ndarray, float], np.ndarray]], ...]] = {
    "mass_g": (
        ("kilograms: multiply by 1000", _mass_times(1e3)),
        ("newtons: move it to a column normal_load_N", _mass_times(1 / _NEWTON_PER_GRAM)),
        ("milligrams: divide by 1000", _mass_times(1e-3)),
    ),
    "normal_load_N": (
        ("grams: move it to a column mass_g", _times(_NEWTON_PER_GRAM)),
        ("kilonewtons: multiply by 1000", _times(1e3)),
        ("millinewtons: divide by 1000", _times(1e-3)),
        ("kilograms: multiply by 9.81", _times(STANDARD_GRAVITY)),
    ),
    "normal_stress_Pa": (
        ("kilopascals: multiply by 1000", _times(1e3)),
        ("megapascals: multiply by 1000000", _times(1e6)),
    ),
    "": (
        ("kilonewtons in the exports: state the unit in [columns]", _times(1e3)),
        ("millinewtons in the exports: state the unit in [columns]", _times(1e-3)),
        ("gram-force in the exports: state the unit in [columns]", _times(_NEWTON_PER_GRAM)),
    ),
}  # fmt: skip
_AREAS = (
    ("cm2: multiply by 100", 1e2), ("m2: multiply by 1000000", 1e6), ("um2: divide by 1000000", 1e-6),
)  # fmt: skip
_FORCES = (
    ("millinewtons: state the unit in [columns]", 1e-3),
    ("kilonewtons: state the unit in [columns]", 1e3),
    ("gram-force: state the unit in [columns]", _NEWTON_PER_GRAM),
)


_MM2, _MM, _UM = 1e6, 1e3, 1e6
_TABLE, _TOML = "tests.csv", "campaign.toml"
_COVERAGE = 2.0  # standard uncertainties by which a fitted number must lie outside
_MOST_SHOWN = 3
_SLIDING_ABOVE = 0.5  # of the static force, by which sliding is rarely above it
_CERTAIN = 4.0  # standard uncertainties of an intercept
_LEAST_OFFSET = 0.5  # of the weight of the slider
_ROOM_C = (10.0, 35.0)  # of laboratories


def doubts_of(campaign: Campaign, ingested: Ingested | None = None, fits: Sequence[LawFit] = ()) -> tuple[Doubt, ...]:
    """Doubts about the numbers of a campaign: those stated, and the measured and fitted ones where they are given."""
    if ingested is not None:
        campaign = ingested.campaign
    numbers = _measured(campaign, ingested, fits)
    slip = likely_slips(campaign, numbers)
    found = [doubt for q, by in numbers.items() if (doubt := _outside(campaign, q, by, _PLACES[q], slip)) is not None]
    if not slip:  # one that explains the loads or the area explains these as well
        found += [*_wide_pitches(campaign), *_load_span(campaign)]
    measured = () if ingested is None else (*_signals(ingested), *_slid_above_static(ingested))
    offset = () if slip else _load_offset(campaign, fits)
    stated = (*_stated(campaign), *mixed_units(campaign), *_geometry(campaign), *_names(campaign))
    written = (*_sled(campaign), *_order(campaign), *_rests(campaign))
    return (*measured, *found, *offset, *stated, *written, *(_exports(ingested) if ingested is not None else ()))


def _measured(campaign: Campaign, ingested: Ingested | None, fits: Sequence[LawFit]) -> Numbers:
    """Numbers that hang together: a wrong load, force or area moves several of them."""
    masses = {f"test {t.test_id}": t.mass_kg * 1e3 for t in campaign.tests if t.mass_kg and t.load_from == "mass_g"}
    found: dict[str, dict[str, float]] = {
        "mu": {}, "friction_ratio": {}, "tau0_kPa": {}, "pressure_kPa": {}, "area_mm2": {}, "mass_g": masses,
    }  # fmt: skip
    for fit in fits:
        of = f"{fit.sample}, {fit.regime}"
        found["mu"] |= _if_resolved(fit, "mu", of, bound_of("mu", campaign), 1.0)
        if fit.has_area:
            found["tau0_kPa"] |= _if_resolved(fit, "tau0_Pa", of, bound_of("tau0_kPa", campaign), _KPA)
    if ingested is not None:
        found["friction_ratio"] = _ratios(ingested)
    if campaign.has_area:
        found["area_mm2"] = {"the sample": campaign.area_m2 * _MM2}
        loads = [t.normal_load_N for t in campaign.tests if t.normal_load_N > 0]
        if loads and campaign.contact in ("", "sled"):
            found["pressure_kPa"] = {
                name: campaign.nominal_pressure_Pa(load) * _KPA
                for name, load in (("the smallest load", min(loads)), ("the largest load", max(loads)))
            }
    return {q: by for q, by in found.items() if by}


def _if_resolved(fit: LawFit, parameter: str, of: str, bound: Bound, unit: float) -> dict[str, float]:
    """A fitted number; the bound itself where its uncertainty by specimens and repeats reaches back to it.

    The combined uncertainty holds that of the loads, which is what a slip would have spoiled.
    """
    if parameter not in fit.parameters or not math.isfinite(fit.value(parameter)):
        return {}
    value, u = fit.value(parameter) * unit, fit.by_itself.standard_uncertainty(parameter) * unit
    nearest = min(max(value, bound.low), bound.high)
    reach = _COVERAGE * u if math.isfinite(u) else 0.0
    return {of: nearest if abs(value - nearest) <= reach else value}


def _ratios(ingested: Ingested) -> dict[str, float]:
    """The median of T/N of every sample: while sliding, or static where nothing slid."""
    by_sample: dict[str, list[float]] = {}
    for test in ingested.campaign.tests:
        pull = ingested.pulls.get(test.test_id)
        force = math.nan if pull is None else next(filter(math.isfinite, (pull.sliding_N, pull.static_N)), math.nan)
        if math.isfinite(force) and test.normal_load_N > 0:
            by_sample.setdefault(test.sample, []).append(abs(force) / test.normal_load_N)
    return {sample: float(np.median(values)) for sample, values in sorted(by_sample.items())}


def _outside(campaign: Campaign, quantity: str, by: Mapping[str, float], place: str, slip: str) -> Doubt | None:
    """A doubt about the values outside their bound, one for all of them; None where all are inside."""
    bound = bound_of(quantity, campaign)
    wrong = {of: value for of, value in by.items() if not bound.low <= value <= bound.high}
    if not wrong:
        return None
    kind = material_class(campaign)
    found = _listed([f"{value:.3g} ({of})" for of, value in wrong.items()])
    allowed = f"{bound.low:g} to {bound.high:g}"
    return Doubt(quantity, _NAMES[quantity], found, allowed, place, slip, bound.source, kind)


def _listed(values: Sequence[str]) -> str:
    more = f" and {len(values) - _MOST_SHOWN} more" if len(values) > _MOST_SHOWN else ""
    return ", ".join(values[:_MOST_SHOWN]) + more


def _stated(campaign: Campaign) -> Iterator[Doubt]:
    """Speeds, temperatures and humidities as typed."""
    speeds = {f"test {t.test_id}": t.speed_m_s * _MM for t in campaign.tests if t.speed_m_s}
    warmth = {f"test {t.test_id}": t.temperature_C for t in campaign.tests if t.temperature_C is not None}
    damp = {f"test {t.test_id}": t.humidity_pct for t in campaign.tests if t.humidity_pct is not None}
    rules = (
        ("speed_mm_s", speeds, lambda v: _SPEEDS[0] if v < 1.0 else _SPEEDS[1]),
        ("temperature_C", warmth, lambda v: "it looks like kelvin: subtract 273.15" if 200 < v < 500 else ""),
        ("humidity_pct", damp, lambda v: ""),
    )
    for quantity, by, slip in rules:
        bound = bound_of(quantity, campaign)
        question = next((slip(v) for v in by.values() if not bound.low <= v <= bound.high), "")
        if doubt := _outside(campaign, quantity, by, _PLACES[quantity], f"{question}?" if question else ""):
            yield doubt
    fractions = [v for v in damp.values() if 0 < v <= 1]
    if fractions:
        of = "" if len(fractions) == len(damp) else f" in {len(fractions)} of {len(damp)} tests"
        found = f"at most {max(fractions):g}{of}"
        fraction = "humidity_pct looks like a fraction: multiply by 100?"
        yield Doubt("humidity_pct", _NAMES["humidity_pct"], found, "1 to 100", _PLACES["humidity_pct"], fraction)


SIGNALS = {
    "clipped": ("the peak", "noise up to the largest value"), "toggles": ("the force", "noise throughout"),
    "coarse": ("the resolution of the force", "steps below its noise"),
    "repeated_samples": ("the record", "every data point once"),
}  # fmt: skip


def _signals(ingested: Ingested) -> Iterator[Doubt]:
    """Records whose samples look like no measurement: one doubt for each kind, with its size in newtons."""
    files = {test.test_id: test.file for test in ingested.campaign.tests}
    for kind, (name, plausible) in SIGNALS.items():
        seen = {i: p for i, pull in ingested.pulls.items() for p in pull.problems if p.kind == kind}
        if not seen:
            continue
        test_id, problem = next(iter(seen.items()))
        of = f"test {test_id}" if len(seen) == 1 else f"{len(seen)} of {len(ingested.pulls)} tests"
        row = f", row {problem.row}" if problem.row is not None else ""
        place = f"{files.get(test_id) or problem.file}{row}" + ("" if len(seen) == 1 else ", and the others")
        found = f"odd: {problem.what}" + (f" ({problem.found})" if problem.found else "")
        yield Doubt("signal", f"{name} of {of}", found, plausible, place, tests=tuple(seen))


def _slid_above_static(ingested: Ingested) -> Iterator[Doubt]:
    """Tests that slid at a force far above their static peak."""
    beyond = {}
    for test_id, pull in ingested.pulls.items():
        more_N = pull.sliding_N - pull.static_N
        u_N = math.hypot(*(u for u in (pull.static_u_N, pull.sliding_u_N) if math.isfinite(u)), 0.0)
        if pull.static_N > 0 and more_N > max(_SLIDING_ABOVE * pull.static_N, 4.0 * u_N):
            beyond[test_id] = f"{pull.sliding_N:.3g} N, {more_N:.3g} N above the static force ({test_id})"
    if beyond:
        most = 2 * len(beyond) > len(ingested.pulls)
        slip = "static_N and sliding_N interchanged?" if most else "another load while sliding, or another peak?"
        name = f"sliding friction of {len(beyond)} of {len(ingested.pulls)} tests"
        place = f"{_TABLE} and the records"
        plausible = "below or near the static force"
        yield Doubt("signal", name, _listed(list(beyond.values())), plausible, place, slip, tests=tuple(beyond))


def _load_offset(campaign: Campaign, fits: Sequence[LawFit]) -> Iterator[Doubt]:
    """Laws of most samples that give no friction at one and the same load: so much of the load did not press."""
    if campaign.slider_mass_kg <= 0 or not any(t.load_from == "mass_g" for t in campaign.tests):
        return
    slider_N = campaign.slider_mass_kg * STANDARD_GRAVITY
    missing = []
    for fit in fits:
        if not (fit.has_area and "tau0_Pa" in fit.parameters and fit.value("mu") > 0 and campaign.has_area):
            continue
        offset_N = -fit.value("tau0_Pa") * campaign.area_m2 / fit.value("mu")
        u_N = fit.by_itself.standard_uncertainty("tau0_Pa") * campaign.area_m2 / fit.value("mu")
        missing.append(offset_N if math.isfinite(u_N) and offset_N > _CERTAIN * u_N else math.nan)
    sure = [n for n in missing if math.isfinite(n)]
    if len(sure) >= 2 and len(sure) >= 2 / 3 * len(missing):
        offset_N = float(np.median(sure))
        if offset_N > _LEAST_OFFSET * slider_N and np.ptp(sure) < offset_N:
            mass_g = max(campaign.slider_mass_kg - offset_N / STANDARD_GRAVITY, 0.0) * 1e3
            found = f"such that friction vanishes at a load of {offset_N:.3g} N in {len(sure)} of {len(missing)} laws"
            slip = f"slider_mass_g is {campaign.slider_mass_kg * 1e3:g}; about {mass_g:.2g} would explain it"
            plausible = "no load without friction"
            yield Doubt("slider_mass_g", "the load", found, plausible, f"{_TOML}, slider_mass_g", f"{slip}?")


def mixed_units(campaign: Campaign) -> Iterator[Doubt]:
    """Columns in two units: masses or loads some of which are a thousandth of others, holds a sixtieth, Fahrenheit.

    Parameters
    ----------
    campaign : Campaign
        Its tests are looked at; no export is read.
    """
    masses = {t.test_id: t.mass_kg * 1e3 for t in campaign.tests if t.mass_kg and t.load_from == "mass_g"}
    loads = {t.test_id: t.normal_load_N for t in campaign.tests if t.load_from == "normal_load_N"}
    held = {t.test_id: t.hold_s for t in campaign.tests if t.hold_s}
    for column, by, factor, unit, share in (
        ("mass_g", masses, 1000.0, "kilograms", 0.0), ("normal_load_N", loads, 1000.0, "kilonewtons", 0.0),
        ("hold_s", held, 60.0, "minutes", 1.0),
    ):  # fmt: skip
        small = _a_part_of_others(by, factor, share)
        if small:
            found = f"{by[small[0]]:g} in {len(small)} of {len(by)} tests ({_listed(small)}), and {factor:g} times that"
            name, slip = f"column {column}", f"it looks like {unit} there: multiply by {factor:g}?"
            place, allowed = f"{_TABLE}, column {column}", "one unit for all tests"
            yield Doubt(column, name, f"{found} in others", allowed, place, slip, tests=tuple(small))
    warmth = {t.test_id: t.temperature_C for t in campaign.tests if t.temperature_C is not None}
    low, high = _ROOM_C
    room = [name for name, celsius in warmth.items() if low <= celsius <= high]
    warm = [name for name, celsius in warmth.items() if low <= (celsius - 32.0) / 1.8 <= high]
    drifts = len({warmth[name] for name in warm}) > len(warm) / 4  # a heated stage holds a value
    if warm and drifts and len(room) + len(warm) == len(warmth):
        span = f"{min(warmth[n] for n in warm):g} to {max(warmth[n] for n in warm):g}"
        found = f"{span} in {len(warm)} of {len(warmth)} tests ({_listed(warm)})"
        slip = "it looks like Fahrenheit: subtract 32 and divide by 1.8?"
        plausible, name = f"{low:g} to {high:g} where nothing is heated", _NAMES["temperature_C"]
        yield Doubt("temperature_C", name, found, plausible, _PLACES["temperature_C"], slip, tests=tuple(warm))


def _a_part_of_others(by: Mapping[str, float], factor: float, share: float) -> list[str]:
    """Tests with a value of which ``factor`` times is that of others, where a share of all values come in such pairs.

    Hold times of 1 s and 60 s may be meant; loads over three decades, of exactly a thousand times others, hardly.
    """
    values = sorted(set(by.values()))
    small = {v for v in values for other in values if v > 0 and abs(factor * v / other - 1.0) < 1e-6}
    large = {v for v in values for other in small if abs(v / (factor * other) - 1.0) < 1e-6}
    if not small or small & large or len(small) + len(large) < share * len(values):
        return []
    return [name for name, value in by.items() if value in small]


def _names(campaign: Campaign) -> Iterator[Doubt]:
    """Names that differ in case, blanks or the coding of letters, and specimens of two patterns."""
    for column in ("sample", "specimen", "operator"):
        spellings: dict[str, set[str]] = {}
        for name in {str(getattr(t, column)) for t in campaign.tests} - {""}:
            alike = "".join(unicodedata.normalize("NFKC", name).casefold().split())
            spellings.setdefault(alike, set()).add(name)
        for names in (sorted(names) for names in spellings.values() if len(names) > 1):
            found = " and ".join(map(ascii if len({*map(str.casefold, names)}) > 1 else repr, names))
            slip = "the same one, spelled differently"
            yield Doubt("names", f"a {column}", found, "one spelling", f"{_TABLE}, column {column}", f"{slip}?")
    patterns: dict[str, set[str]] = {}
    for test in campaign.tests:
        if test.specimen and test.sample in campaign.samples:
            patterns.setdefault(test.specimen, set()).add(campaign.samples[test.sample].name)
    several = {name: found for name, found in patterns.items() if len(found) > 1}
    if several and len(several) < len(patterns):  # where all are, specimens are numbered anew in each sample
        found = _listed([f"{name} ({' and '.join(sorted(found))})" for name, found in sorted(several.items())])
        yield Doubt("names", "a specimen of two patterns", found, "one pattern each", f"{_TABLE}, column specimen")


def _sled(campaign: Campaign) -> Iterator[Doubt]:
    """What is not stated of a sled, and changes its numbers: the mass of the slider, and which specimen was pulled."""
    if not campaign.slider_mass_stated and any(t.load_from == "mass_g" for t in campaign.tests):
        slip = "weigh sled and sample without the added mass; if mass_g holds them, state slider_mass_g = 0"
        found, place = "not stated, and taken as 0 g", f"{_TOML}, slider_mass_g"
        yield Doubt("slider_mass_g", "the mass of the slider", found, "a mass in g, or 0", place, slip)
    slider_g = campaign.slider_mass_kg * 1e3
    if 0.0 < slider_g < LIGHTEST_SLIDER_G:
        slip, place = "it looks like kilograms: multiply by 1000?", f"{_TOML}, slider_mass_g"
        allowed = f"{LIGHTEST_SLIDER_G:g} g or more"
        yield Doubt("slider_mass_g", "the mass of the slider", f"{slider_g:.3g} g", allowed, place, slip)
    cells = [(t.sample, round(t.normal_load_N, 9)) for t in campaign.tests]
    is_sled = any(t.load_from == "mass_g" for t in campaign.tests)
    if is_sled and len(cells) > len(set(cells)) and all(t.specimen in ("", t.sample) for t in campaign.tests):
        slip = "column left out? All pulls of a sample then count as of one body; uncertainties may be too small"
        place = f"{_TABLE}, column specimen"
        yield Doubt("specimen", "the specimen of each test", "not stated", "a name for each", place, slip)


def _rests(campaign: Campaign) -> Iterator[Doubt]:
    """Hold times for which there was no time: longer than from one test to the next."""
    timed = sorted((t.started_at, t.hold_s, t.test_id) for t in campaign.tests if len(t.started_at) > 10)
    pairs = [
        (hold, (datetime.fromisoformat(at) - datetime.fromisoformat(before)).total_seconds(), name)
        for (before, _, _), (at, hold, name) in pairwise(timed)
        if hold is not None
    ]
    pairs = [row for row in pairs if row[1] > 0]
    late = [(hold, gap, name) for hold, gap, name in pairs if hold > gap]
    if len(late) > len(pairs) / 2:
        hold, gap, name = late[0]
        found, allowed = f"{hold:g} s ({name}), {gap:g} s after the test before", "less than between two tests"
        fits = all(hold / 1000 < gap for hold, gap, _ in late)
        slip = "hold_s looks like milliseconds: divide by 1000?" if fits else ""
        yield Doubt("hold_s", "hold time", found, allowed, f"{_TABLE}, column hold_s and started_at", slip)


def _exports(ingested: Ingested) -> Iterator[Doubt]:
    """Exports that bear the name of another test, and a lever arm where no torque was recorded."""
    ids = {t.test_id for t in ingested.campaign.tests if len(t.test_id) > 1 and not t.test_id.isdigit()}
    other = {}
    for name, trace in ingested.traces.items():
        said = {str(text).strip() for text in trace.metadata.values()} & ids
        if said and name not in said:
            other[name] = f"{name} ({', '.join(sorted(said))})"
    if other:
        place, slip = f"{_TABLE}, column file", "exports or rows may be exchanged"
        yield Doubt("file", "the test named in the export", _listed([*other.values()]), "that of its row", place, slip)
    why = {r for t in ingested.traces.values() if t.source is not None for r in t.source.reasons.values()}
    for key, stated, word, unit in (
        ("nominal_area_mm2", ingested.campaign.has_area and ingested.campaign.area_m2 == 1e-6, "stress", "mm2"),
        ("lever_arm_mm", any(t.correction.lever_arm_m == 1e-3 for t in ingested.campaign.tests), "lever arm", "mm"),
    ):
        if stated and any(word in reason for reason in why):
            found, place = f"1 {unit}, which stands where none is known", f"{_TOML}, {key}"
            slip = "T/N holds; forces, areas and pressures are not those of the specimen"
            yield Doubt(key, "the " + key.rpartition("_")[0].replace("_", " "), found, "that of the rig", place, slip)
    arms = [t.test_id for t in ingested.campaign.tests if t.correction.lever_arm_m is not None]
    sources = [ingested.traces[name].source for name in arms if name in ingested.traces]
    reasons = [why for source in sources if source is not None for why in source.reasons.values()]
    if reasons and not any("lever arm" in why for why in reasons):
        place, slip = f"{_TOML}, lever_arm_mm", "the exports record a force: leave the lever arm out?"
        allowed = "only where a torque is recorded"
        yield Doubt("lever_arm_mm", "a lever arm", "stated and not used", allowed, place, slip)


def _order(campaign: Campaign) -> Iterator[Doubt]:
    """Places in a series that are all one, below zero, or in another order than the times."""
    order = {t.test_id: t.run_order for t in campaign.tests if t.run_order is not None}
    place = f"{_TABLE}, column run_order"
    if len(order) > 2 and len(set(order.values())) == 1:
        yield Doubt("run_order", "run order", f"{next(iter(order.values()))} in every test", "one number a test", place)
    elif order and min(order.values()) < 0:
        yield Doubt("run_order", "run order", f"{min(order.values())}", "0 or more", place)
    timed = sorted((t.started_at, order[t.test_id], t.test_id) for t in campaign.tests if t.test_id in order)
    timed = [row for row in timed if len(row[0]) > 10]
    wrong = [name for (before, a, _), (at, b, name) in pairwise(timed) if before < at and a > b]
    if len(set(order.values())) > 1 and wrong:
        found = f"{len(wrong)} of {len(timed)} tests against their times ({_listed(wrong)})"
        yield Doubt("run_order", "run order", found, "the order of started_at", f"{place} and started_at")


def _wide_pitches(campaign: Campaign) -> Iterator[Doubt]:
    """Patterns of which the sample would hold hardly one cavity."""
    if not campaign.has_area:
        return
    side_um = math.sqrt(campaign.area_m2) * _UM
    most_um = side_um / FEWEST_CAVITIES_ACROSS
    pitches = {p.name: max(p.pitch_m) * _UM for p in campaign.samples.values() if p.pitch_m is not None}
    wide = [f"{pitch:.4g} um ({name})" for name, pitch in pitches.items() if pitch > most_um]
    if wide:
        slip = "pitch_um looks like nanometres: divide by 1000? Or nominal_area_mm2 like cm2: multiply by 100?"
        allowed = f"at most {most_um:.3g} um on a sample {side_um:.3g} um wide"
        yield Doubt("pitch_um", "pitch", _listed(wide), allowed, f"{_TOML}, pitch_um and nominal_area_mm2", slip)


def _geometry(campaign: Campaign) -> Iterator[Doubt]:
    """Cavities smaller than can be made, area fractions off the geometry."""
    for name, pattern in {p.name: p for p in campaign.samples.values()}.items():
        if pattern.size_m is None:
            continue
        place, size = f"{_TOML}, patterns.{name}", min(pattern.size_m) * _UM
        if size < SMALLEST_CAVITY_UM:
            allowed = f"{SMALLEST_CAVITY_UM:g} um or more"
            slip = "the lengths look like millimetres: multiply by 1000?"
            yield Doubt("size_um", f"cavity of pattern {name}", f"{size:.4g} um", allowed, place, slip)
        measured, nominal = pattern.measured_area_fraction, replace(pattern, measured_area_fraction=None).area_fraction
        if measured is None or abs(measured - nominal) <= MOST_OFF_AREA_FRACTION:
            continue
        cavities = abs(1 - measured - nominal) <= MOST_OFF_AREA_FRACTION
        slip = f"it looks like the fraction of the cavities: 1 - {measured:g} = {1 - measured:.3g}?" if cavities else ""
        about, of = f"about {nominal:.2g}, from its size and pitch", f"area_fraction of pattern {pattern.name}"
        yield Doubt("area_fraction", of, f"{measured:g}", about, place, slip)


def _load_span(campaign: Campaign) -> Iterator[Doubt]:
    """Samples whose loads are too close together for a slope; of flat samples, loads meant to be one are none."""
    patterned = any(not pattern.is_flat for pattern in campaign.samples.values())
    one_load = 1.0 if patterned else ONE_LOAD
    by_sample: dict[str, list[float]] = {}
    for test in campaign.tests:
        if test.normal_load_N > 0:
            by_sample.setdefault(test.sample, []).append(test.normal_load_N)
    close = {
        s: 100 * (max(loads) / min(loads) - 1)
        for s, loads in sorted(by_sample.items())
        if one_load < max(loads) / min(loads) < SMALLEST_LOAD_SPAN
    }
    if not close:
        return
    found = _listed([f"{span:.2g} % ({s})" for s, span in close.items()])
    low = 100 * (SMALLEST_LOAD_SPAN - 1)
    slip = "loads this close determine neither mu nor tau0: measure at loads that differ by a factor of two or more"
    yield Doubt("load_span", "range of the loads of a sample", found, f"{low:.0f} % or more", _TABLE, slip)


_SPEEDS = ("the speed looks like m/s: multiply by 1000", "the speed looks like um/s: divide by 1000")
_NAMES = {
    "mu": "mu", "friction_ratio": "T/N", "tau0_kPa": "tau0 in kPa", "pressure_kPa": "nominal pressure in kPa",
    "area_mm2": "nominal area in mm2", "mass_g": "mass in g", "speed_mm_s": "speed in mm/s",
    "temperature_C": "temperature in °C", "humidity_pct": "relative humidity in %",
}  # fmt: skip
_PLACES = {
    "mu": f"{_TABLE}, loads", "friction_ratio": f"{_TABLE}, loads", "tau0_kPa": f"{_TOML}, nominal_area_mm2",
    "pressure_kPa": f"{_TOML}, nominal_area_mm2, and {_TABLE}, loads", "area_mm2": f"{_TOML}, nominal_area_mm2",
    "mass_g": f"{_TABLE}, column mass_g", "speed_mm_s": f"{_TABLE}, column speed_mm_s, or {_TOML}, pull_speed_mm_s",
    "temperature_C": f"{_TABLE}, column temperature_C", "humidity_pct": f"{_TABLE}, column humidity_pct",
}  # fmt: skip
