"""Every number of a campaign that lies outside its broad physical bounds, as a doubt with the likely slip."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tribo.plausibility import bounds
from tribo.plausibility.bounds import Bound, bound_of, material_class
from tribo.plausibility.slips import Numbers, likely_slips
from tribo.records import Campaign, Doubt, Ingested, LawFit, Pattern

_MM2, _KPA, _MM, _UM, _KELVIN = 1e6, 1e-3, 1e3, 1e6, 273.15
_TABLE, _TOML = "tests.csv", "campaign.toml"
_COVERAGE = 2.0  # standard uncertainties by which a fitted number must lie outside
_MOST_SHOWN = 3


def doubts_of(
    campaign: Campaign, ingested: Ingested | None = None, fits: Sequence[LawFit] = ()
) -> tuple[Doubt, ...]:
    """Doubts about the numbers of a campaign: those stated, and the measured and fitted ones where they are given."""
    if ingested is not None:
        campaign = ingested.campaign
    numbers = _measured(campaign, ingested, fits)
    slip = likely_slips(campaign, numbers)
    found = [
        doubt for q, by in numbers.items() if (doubt := _outside(campaign, q, by, _PLACES[q], slip)) is not None
    ]
    if not slip:  # one that explains the loads or the area explains these as well
        found += [*_wide_pitches(campaign), *_load_span(campaign)]
    return (*found, *_stated(campaign), *_geometry(campaign))


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
        found["area_mm2"] = {"the sample": campaign.nominal_area_m2 * _MM2}
        loads = [t.normal_load_N for t in campaign.tests if t.normal_load_N > 0]
        if loads and campaign.contact in ("", "sled"):
            found["pressure_kPa"] = {
                name: campaign.nominal_pressure_Pa(load) * _KPA
                for name, load in (("the smallest load", min(loads)), ("the largest load", max(loads)))
            }
    return {q: by for q, by in found.items() if by}


def _if_resolved(fit: LawFit, parameter: str, of: str, bound: Bound, unit: float) -> dict[str, float]:
    """A fitted number; the bound itself where its uncertainty reaches back to it."""
    if parameter not in fit.parameters or not math.isfinite(fit.value(parameter)):
        return {}
    value, u = fit.value(parameter) * unit, fit.standard_uncertainty(parameter) * unit
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
        question = next((slip(v) for v in by.values() if not _plausible(campaign, quantity, v)), "")
        if doubt := _outside(campaign, quantity, by, _PLACES[quantity], f"{question}?" if question else ""):
            yield doubt
    if damp and 0 < max(damp.values()) <= 1:
        found = f"at most {max(damp.values()):g}"
        fraction = "humidity_pct looks like a fraction: multiply by 100?"
        yield Doubt("humidity_pct", _NAMES["humidity_pct"], found, "1 to 100", _PLACES["humidity_pct"], fraction)


def _plausible(campaign: Campaign, quantity: str, value: float) -> bool:
    bound = bound_of(quantity, campaign)
    return bound.low <= value <= bound.high


def _wide_pitches(campaign: Campaign) -> Iterator[Doubt]:
    """Patterns of which the sample would hold hardly one cavity."""
    if not campaign.has_area:
        return
    side_um = math.sqrt(campaign.nominal_area_m2) * _UM
    most_um = side_um / bounds.FEWEST_CAVITIES_ACROSS
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
        if size < bounds.SMALLEST_CAVITY_UM:
            allowed = f"{bounds.SMALLEST_CAVITY_UM:g} um or more"
            slip = "the lengths look like millimetres: multiply by 1000?"
            yield Doubt("size_um", f"cavity of pattern {name}", f"{size:.4g} um", allowed, place, slip)
        yield from _area_fraction(pattern, place)


def _area_fraction(pattern: Pattern, place: str) -> Iterator[Doubt]:
    measured = pattern.measured_area_fraction
    if measured is None:
        return
    nominal = replace(pattern, measured_area_fraction=None).area_fraction
    if abs(measured - nominal) <= bounds.MOST_OFF_AREA_FRACTION:
        return
    cavities = abs(1 - measured - nominal) <= bounds.MOST_OFF_AREA_FRACTION
    slip = f"it looks like the fraction of the cavities: 1 - {measured:g} = {1 - measured:.3g}?" if cavities else ""
    name, found = f"area_fraction of pattern {pattern.name}", f"{measured:g}"
    yield Doubt("area_fraction", name, found, f"about {nominal:.2g}, from its size and pitch", place, slip)


def _load_span(campaign: Campaign) -> Iterator[Doubt]:
    """Samples whose loads are too close together for a slope; of flat samples, loads meant to be one are none."""
    patterned = any(not pattern.is_flat for pattern in campaign.samples.values())
    one_load = 1.0 if patterned else bounds.ONE_LOAD
    by_sample: dict[str, list[float]] = {}
    for test in campaign.tests:
        if test.normal_load_N > 0:
            by_sample.setdefault(test.sample, []).append(test.normal_load_N)
    close = {
        s: 100 * (max(loads) / min(loads) - 1)
        for s, loads in sorted(by_sample.items())
        if one_load < max(loads) / min(loads) < bounds.SMALLEST_LOAD_SPAN
    }
    if not close:
        return
    found = _listed([f"{span:.2g} % ({s})" for s, span in close.items()])
    low = 100 * (bounds.SMALLEST_LOAD_SPAN - 1)
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
