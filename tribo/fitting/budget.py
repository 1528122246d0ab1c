"""Uncertainty budget of a fitted law (GUM, JCGM 100:2008): components, their combination and the largest.

The interval of :func:`tribo.fitting.fit_samples` contains the differences between specimens and between pulls
(type A); in a campaign the scatter of specimens is partly pooled over the samples, against the luck of few specimens
(:mod:`tribo.fitting.partial_pooling`).
Errors common to all pulls, such as those of the load cell or the height of the wire, do not show in repeats.
They are taken from ``[instrument]`` of campaign.toml or from the stated defaults (type B) and are added here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.linear import Rows, least_squares, sample_rows, weights_of
from tribo.fitting.partial_pooling import at_least, partly_pooled
from tribo.laws import LAWS
from tribo.records import STANDARD_GRAVITY, CombinedFit, FloatArray, Ingested, LawFit

if TYPE_CHECKING:
    import pandas as pd

LAW = LAWS["coulomb_adhesion"]
NUMBERS = ("mu", "tau0_kPa", "T_N")
PRESSURE_PA = 10e3  # where T/A is judged unless asked otherwise: the middle of the paper's 3 to 25 kPa


@dataclass(frozen=True)
class Default:
    """A standard uncertainty used where campaign.toml gives none, and its source."""

    value: float
    reason: str


DEFAULTS: dict[str, Default] = {
    "load_cell_u_percent": Default(0.58, "class 1 of ISO 7500-1: limits ±1 %, rectangular distribution"),
    "load_cell_u_N": Default(0.0, "the zero is measured before each contact"),
    "mass_u_g": Default(0.03, "balance with a resolution of 0.1 g, rectangular distribution"),
    "normal_load_u_percent": Default(0.0, "dead weights"),
    "area_u_percent": Default(1.0, "sides of about 7 mm, each measured by caliper to 0.05 mm"),
    "wire_angle_deg": Default(0.0, "wire assumed to be horizontal"),
    "wire_angle_u_deg": Default(0.5, "wire levelled by eye"),
}


@dataclass(frozen=True)
class Component:
    """One source of uncertainty: the standard uncertainty it gives each number, type, dof and origin."""

    name: str
    kind: str
    u: Mapping[str, float]
    dof: float
    origin: str


@dataclass(frozen=True)
class Budget:
    """All components of one fitted law and their combination, for the numbers mu, tau0_kPa and T_N.

    ``T_N`` is the friction force at ``pressure_Pa``. ``covariance`` (2, 2) of (mu, tau0_Pa) is that of the
    fit plus every type B component. The type A rows share out the variance of the fit: what single readings
    and repeats explain, never more than there is, and the rest to the specimens.
    """

    fit: LawFit
    components: tuple[Component, ...]
    covariance: FloatArray
    pressure_Pa: float = PRESSURE_PA
    notes: tuple[str, ...] = ()

    def value(self, number: str) -> float:
        """The number itself."""
        return float(sensitivities(self.fit, self.pressure_Pa)[number] @ self.fit.values)

    def standard_uncertainty(self, number: str) -> float:
        """Combined standard uncertainty."""
        return _u(self.covariance, sensitivities(self.fit, self.pressure_Pa)[number])

    def effective_dof(self, number: str) -> float:
        """Welch and Satterthwaite (GUM, G.4): type B components have infinitely many."""
        type_a = _u(self.fit.covariance, sensitivities(self.fit, self.pressure_Pa)[number])
        if type_a == 0:
            return float("inf")
        return self.fit.dof * (self.standard_uncertainty(number) / type_a) ** 4

    def expanded_uncertainty(self, number: str, level: float = 0.95) -> float:
        """Half width of the interval at ``level``, by t of the effective degrees of freedom."""
        from scipy.stats import t

        factor = t.ppf(0.5 + level / 2, self.effective_dof(number))
        return float(factor) * self.standard_uncertainty(number)

    def share_pct(self, component: Component, number: str) -> float:
        """Share of a component in the combined variance of a number."""
        return 100 * (component.u[number] / self.standard_uncertainty(number)) ** 2

    def dominant(self, number: str) -> Component:
        """The component with the largest share in a number."""
        return max(self.components, key=lambda component: component.u[number])

    def combined(self) -> CombinedFit:
        """The fit with the combined covariance, and the component that dominates each number."""
        largest = {}
        for number, key in {"mu": "mu", "tau0_kPa": "tau0_Pa", "T_N": "T"}.items():
            top = self.dominant(number)
            largest[key] = (top.name, self.share_pct(top, number))
        own = {f.name: getattr(self.fit, f.name) for f in fields(self.fit)}
        return CombinedFit(**own | {"covariance": self.covariance}, type_a=self.fit.covariance, largest=largest)

    def table(self) -> pd.DataFrame:
        """One row per component and a last one "combined": type, dof, origin, u_NUMBER, share_pct_NUMBER."""
        import pandas as pd

        combined = {number: self.standard_uncertainty(number) for number in NUMBERS}
        last = Component("combined", "", combined, float("nan"), "")
        return pd.DataFrame(
            {
                "component": c.name,
                "type": c.kind,
                **{f"u_{number}": c.u[number] for number in NUMBERS},
                **{f"share_pct_{number}": self.share_pct(c, number) for number in NUMBERS},
                "dof": c.dof,
                "origin": c.origin,
            }
            for c in (*self.components, last)
        )

    def text(self) -> str:
        """The largest components, in one sentence."""
        said = []
        for number in NUMBERS:
            top = self.dominant(number)
            share = self.share_pct(top, number)
            said.append(f"{label(number, self.pressure_Pa)}, {top.name} ({share:.0f} % of the variance)")
        return f"{self.fit.sample}, {self.fit.regime}: largest component for {'; for '.join(said)}."


def label(number: str, pressure_Pa: float) -> str:
    """A number in words: mu, tau0, T at 10 kPa."""
    return {"mu": "mu", "tau0_kPa": "tau0", "T_N": f"T at {pressure_Pa / 1e3:g} kPa"}[number]


def uncertainty_budget(
    table: pd.DataFrame,
    fit: LawFit,
    instrument: Mapping[str, float],
    *,
    weights: str = "relative",
    rise_N_per_s: float = float("nan"),
    sampling_rate_Hz: float = float("nan"),
    pressure_Pa: float = PRESSURE_PA,
) -> Budget:
    """Budget of one fit of ``fit_samples(table, ..., weights=weights)``.

    ``instrument`` holds the settings of campaign.toml (standard uncertainties, k = 1); what it lacks is taken
    from :data:`DEFAULTS`. ``rise_N_per_s`` is the slope of the force before the peak and ``sampling_rate_Hz``
    f_s, together the sampling clip of static friction: a peak between two samples is read low by up to
    rise/(2 f_s) = k v/(2 f_s), taken as rectangular about zero because it is not corrected.

    Raises
    ------
    FitError
        The fit is not of the law T = mu N + tau0 A, or holds no values.
    """
    if fit.law != LAW.name or not np.isfinite(fit.covariance).all():
        found = f"{fit.law}, sample {fit.sample}"
        raise FitError(Problem("no_budget", "a budget needs a fitted law", found=found, allowed=LAW.name))
    rows = next(r for r in sample_rows(table, fit.regime) if r.sample == fit.sample)
    random, notes = _type_a(rows, fit, weights, pressure_Pa)
    changes = _type_b(fit, instrument, rise_N_per_s, sampling_rate_Hz)
    if fit.regime == "static" and not np.isfinite(rise_N_per_s * sampling_rate_Hz):
        notes += ("component sampling clip left out: the rise before the peak or the sampling rate is not known",)
    by = sensitivities(fit, pressure_Pa)
    shared = tuple(
        Component(name, "B", {k: abs(float(s @ change)) for k, s in by.items()}, float("inf"), origin)
        for name, change, origin in changes
    )
    common = sum((np.outer(change, change) for _, change, _ in changes), np.zeros((2, 2)))
    return Budget(fit, (*random, *shared), fit.covariance + common, pressure_Pa, notes)


def campaign_budgets(
    ingested: Ingested,
    fits: tuple[LawFit, ...],
    *,
    weights: str = "relative",
    pressure_Pa: float = PRESSURE_PA,
) -> tuple[Budget, ...]:
    """Budgets of all ``fits`` that hold values, rise and sampling rate taken from pulls and traces.

    The covariance of specimens is partly pooled over the samples first.
    """
    table = ingested.table()
    fits = _partly_pooled(table, tuple(fit for fit in fits if np.isfinite(fit.covariance).all()), weights)
    rate = [1 / float(np.median(np.diff(t.time_s))) for t in ingested.traces.values() if len(t.time_s) > 1]
    instrument = ingested.campaign.instrument
    stated = instrument.get("sampling_rate_Hz", float(np.median(rate)) if rate else float("nan"))
    rises: dict[str, list[float]] = {}
    for test in ingested.campaign.tests:
        if (pull := ingested.pulls.get(test.test_id)) is not None and np.isfinite(pull.rise_N_per_s):
            rises.setdefault(test.sample, []).append(pull.rise_N_per_s)
    rise = {sample: float(np.median(values)) for sample, values in rises.items()}
    return tuple(
        uncertainty_budget(
            table, fit, instrument, weights=weights, sampling_rate_Hz=stated, pressure_Pa=pressure_Pa,
            rise_N_per_s=rise.get(fit.sample, float("nan")),
        )
        for fit in fits
    )  # fmt: skip


def _partly_pooled(table: pd.DataFrame, fits: tuple[LawFit, ...], weights: str) -> tuple[LawFit, ...]:
    """Of a single sample, the scatter of specimens is at least what its repeats explain."""
    found: list[LawFit] = []
    for regime in dict.fromkeys(fit.regime for fit in fits):
        rows = {r.sample: r for r in sample_rows(table, regime)}
        own = tuple(fit for fit in fits if fit.regime == regime)
        for before, fit in zip(own, partly_pooled(own, rows), strict=True):
            alone = fit is before and len(fit.specimens) > 1
            found.append(at_least(fit, _within(rows[fit.sample], fit, weights)[0]) if alone else fit)
    return tuple(found)


def sensitivities(fit: LawFit, pressure_Pa: float) -> dict[str, FloatArray]:
    """Derivatives (2,) of mu, tau0_kPa and T_N by (mu, tau0_Pa)."""
    area = fit.nominal_area_m2
    return {
        "mu": np.array([1.0, 0.0]),
        "tau0_kPa": np.array([0.0, 1e-3]),
        "T_N": np.array([pressure_Pa * area, area]),
    }


def _u(covariance: FloatArray, by: FloatArray) -> float:
    return float(np.sqrt(max(float(by @ covariance @ by), 0.0)))


def _type_a(rows: Rows, fit: LawFit, weights: str, pressure_Pa: float) -> tuple[tuple[Component, ...], tuple[str, ...]]:
    pulls, read, dof = _within(rows, fit, weights)
    u: dict[str, dict[str, float]] = {"specimens": {}, "repeats": {}, "reading": {}}
    capped = False
    for number, by in sensitivities(fit, pressure_Pa).items():
        total, repeats, reading = (_u(c, by) ** 2 for c in (fit.covariance, pulls, read))
        capped |= repeats > total
        repeats, reading = min(repeats, total), min(reading, repeats, total)
        u["specimens"][number] = float(np.sqrt(total - repeats))
        u["repeats"][number] = float(np.sqrt(repeats - reading))
        u["reading"][number] = float(np.sqrt(reading))
    notes: tuple[str, ...] = ()
    if not np.isfinite(rows.u_N).any():
        notes += ("the reading uncertainty of single traces is not known",)
    if capped and fit.n_specimens > 1:
        notes += ("specimens differ by less than the scatter of their repeats",)
    parts = (
        Component("specimens", "A", u["specimens"], fit.dof, f"{fit.n_specimens} specimens"),
        Component("repeats", "A", u["repeats"], float(dof), f"scatter of {fit.n_tests} pulls about the fitted lines"),
        Component("reading of the trace", "A", u["reading"], float("inf"), "noise within each trace"),
    )
    return parts, notes


def _within(rows: Rows, fit: LawFit, weights: str) -> tuple[FloatArray, FloatArray, int]:
    """Covariance of (mu, tau0_Pa) that pulls, and that readings alone, would give the mean over specimens."""
    weight = weights_of(rows, fit.nominal_area_m2, weights)
    pulls, reading, dof, count = np.zeros((2, 2)), np.zeros((2, 2)), 0, 0
    for name in rows.specimens:
        own = rows.specimen == name
        if len(np.unique(rows.load_N[own])) < 2:
            continue
        design = LAW.design_matrix(rows.load_N[own], fit.nominal_area_m2)
        line = least_squares(design, rows.force_N[own], weight[own])
        by_pull = line.unscaled @ (design * weight[own, None]).T
        reading += (by_pull * np.nan_to_num(rows.u_N[own]) ** 2) @ by_pull.T
        if line.dof:
            pulls += line.covariance
        dof, count = dof + line.dof, count + 1
    return pulls / max(count, 1) ** 2, reading / max(count, 1) ** 2, dof


def _type_b(
    fit: LawFit, instrument: Mapping[str, float], rise_N_per_s: float, sampling_rate_Hz: float
) -> list[tuple[str, FloatArray, str]]:
    """(name, change (2,) of (mu, tau0_Pa) by one standard uncertainty, origin) of what all pulls share."""
    mu, tau0_Pa = fit.values
    area = fit.nominal_area_m2
    settings = {name: float(instrument.get(name, default.value)) for name, default in DEFAULTS.items()}
    gain, as_adhesion = np.array([mu, tau0_Pa]), np.array([0.0, 1 / area])
    mass_N = settings["mass_u_g"] * 1e-3 * STANDARD_GRAVITY
    settings["area_u_percent"] *= fit.has_area
    effects = [
        ("load cell, gain", gain * settings["load_cell_u_percent"] / 100, "load_cell_u_percent"),
        ("load cell, offset", as_adhesion * settings["load_cell_u_N"], "load_cell_u_N"),
        ("mass", as_adhesion * mu * mass_N, "mass_u_g"),
        (
            "normal load",
            np.array([mu, 0.0]) * settings["normal_load_u_percent"] / 100,
            "normal_load_u_percent",
        ),
        ("nominal area", np.array([0.0, tau0_Pa]) * settings["area_u_percent"] / 100, "area_u_percent"),
        ("wire angle", gain * _wire(mu, settings), "wire_angle_u_deg"),
    ]
    changes = [(name, change, _origin(setting, instrument)) for name, change, setting in effects]
    low_N = rise_N_per_s / (2 * sampling_rate_Hz)
    if fit.regime == "static" and np.isfinite(low_N):
        origin = f"rise of {rise_N_per_s:.3g} N/s sampled at {sampling_rate_Hz:.3g} Hz"
        changes.append(("sampling clip", as_adhesion * low_N / np.sqrt(3), origin))
    return changes


def _wire(mu: float, settings: Mapping[str, float]) -> float:
    """Relative change of T by one standard uncertainty of the wire angle: T falls as 1/(cos f + mu sin f)."""
    angle = np.radians(settings["wire_angle_deg"])
    slope = (mu * np.cos(angle) - np.sin(angle)) / (np.cos(angle) + mu * np.sin(angle))
    return float(slope * np.radians(settings["wire_angle_u_deg"]))


def _origin(setting: str, instrument: Mapping[str, float]) -> str:
    if setting in instrument:
        return f"campaign.toml: {setting} = {instrument[setting]:g}"
    return f"default {setting} = {DEFAULTS[setting].value:g}: {DEFAULTS[setting].reason}"
