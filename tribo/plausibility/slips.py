"""Slips of a unit that would bring implausible numbers back into their bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tribo.plausibility.bounds import bound_of
from tribo.records import STANDARD_GRAVITY, Campaign

_GRAM, _KPA = 1e-3, 1e-3
Numbers = Mapping[str, dict[str, float]]  # quantity -> what it is of -> its value
MOST_NAMED = 2


@dataclass(frozen=True)
class Slip:
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

    def corrected(self, numbers: Numbers, area_m2: float) -> Numbers:
        """The numbers as they would be without the slip."""
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
            if of in found.get("tau0_kPa", {}):
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


def _candidates(campaign: Campaign) -> Iterator[Slip]:
    """Slips in the order of how often they are made: a load typed by hand, the area, then the unit of an export."""
    stated = {test.load_from for test in campaign.tests}
    for column, ways in _LOADS.items():
        if stated == {column}:
            for words, change in ways:
                yield _of_loads(campaign, f"{column} looks like {words}", change)
    if "mass_g" in stated and campaign.slider_mass_kg > 0:
        slider = campaign.slider_mass_kg * STANDARD_GRAVITY
        loads = _loads(campaign)
        question = "slider_mass_g in campaign.toml looks like kilograms: multiply by 1000"
        yield Slip(question, load=float(np.median((loads + 999 * slider) / loads)))
    if campaign.has_area:
        for words, factor in _AREAS:
            yield Slip(f"nominal_area_mm2 looks like {words}", area=factor)
    if any(test.evaluated is None for test in campaign.tests):
        for words, factor in _FORCES:
            yield Slip(f"the friction force of the exports looks like {words}", force=factor)


def _of_loads(campaign: Campaign, question: str, change: Callable[[np.ndarray, float], np.ndarray]) -> Slip:
    loads = _loads(campaign)
    slider = campaign.slider_mass_kg * STANDARD_GRAVITY
    other = change(loads, slider)
    usual = float(np.median(other / loads))
    span = float(np.ptp(loads))
    steeper = float(np.ptp(other)) / span if span > 0 else usual
    return Slip(question, usual, steeper, float(np.median(loads - other / steeper)), mass=steeper)


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
