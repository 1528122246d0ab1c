"""The uncertainty of a fitted law (GUM, JCGM 100:2008): components, their combination and the largest.

The interval of :func:`tribo.fitting.fit_samples` contains the differences between specimens and between pulls of one
sample (type A). Three specimens that agree by chance give an interval that is far too narrow: among the tenth of
samples whose specimens scatter least, the intervals by t(2) hold the law in two of three cases. The covariance of each
sample is therefore moved towards the mean of all samples, as if that mean were known from PRIOR_DOF further specimens
(moderated variances: Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3). A sample that scatters more than the others
keeps part of its own scatter. One that scatters less gets the mean of all: with few specimens a small scatter is luck
more often than a quieter pattern, and two thirds of the mean are too little for the luckiest.

Errors common to all pulls, such as those of the load cell or the height of the wire, do not show in repeats.
They are taken from ``[instrument]`` of campaign.toml or from the stated defaults (type B) and are added here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.linear import Rows, least_squares, sample_rows, weights_of
from tribo.fitting.samples import ONE_SPECIMEN
from tribo.laws import design_over_load, law_over_load
from tribo.records import STANDARD_GRAVITY, Fits, FloatArray, Ingested, LawFit

if TYPE_CHECKING:
    import pandas as pd

NUMBERS = ("mu", "tau0_kPa", "T_N")
PRESSURE_PA = 10e3  # where T/A is judged: the middle of the paper's 3 to 25 kPa
PRIOR_DOF = 4.0  # swept in benchmarks/combined_coverage.py: from 2 to 8 the coverage hardly depends on it
ROUNDING = 1e-12
DEFAULTS: dict[str, tuple[float, str]] = {  # used where campaign.toml gives none, and why
    "load_cell_u_percent": (0.58, "class 1 of ISO 7500-1: limits ±1 %, rectangular distribution"),
    "load_cell_u_N": (0.0, "the zero is measured before each contact"),
    "mass_u_g": (0.03, "balance with a resolution of 0.1 g, rectangular distribution"),
    "normal_load_u_percent": (0.0, "dead weights"),
    "area_u_percent": (1.0, "as for sides of about 7 mm measured by caliper to 0.05 mm; state another"),
    "wire_angle_deg": (0.0, "wire assumed to be horizontal"),
    "wire_angle_u_deg": (0.5, "as for a wire levelled by eye; state 0 where no wire pulls"),
}
DEFAULTS_WITHOUT_MASSES = DEFAULTS | {  # of a rig that records or states its load as a force
    "mass_u_g": (0.0, "no test states a mass"),
    "normal_load_u_percent": (0.58, "class 1 of ISO 7500-1: limits ±1 %, rectangular distribution"),
    "wire_angle_u_deg": (0.0, "no test states a mass, as a sled on a wire has one"),
}


def combined_fits(ingested: Ingested, fits: tuple[LawFit, ...], *, weights: str = "relative") -> Fits:
    """The fits with their combined uncertainty; those without values as they are.

    Parameters
    ----------
    ingested : the campaign with its pulls
    fits : those of :func:`tribo.fitting.fit_samples`, by the tests of each sample alone
    weights : the weights of these fits
    """
    budgets = campaign_budgets(ingested, fits, weights=weights) if fits else ()
    combined = {(fit.sample, fit.regime): fit for fit, _ in budgets}
    return Fits(combined.get((fit.sample, fit.regime), fit) for fit in fits)


def campaign_budgets(
    ingested: Ingested,
    fits: tuple[LawFit, ...],
    *,
    weights: str = "relative",
    load_N: float | None = None,
) -> tuple[tuple[LawFit, pd.DataFrame], ...]:
    """:func:`uncertainty_budget` of all ``fits`` that hold values, rise and sampling rate from pulls and traces.

    The covariance of specimens is partly pooled over the samples first. T is judged at ``load_N``; where that is not
    given, at a pressure of 10 kPa if it was measured there, else at the middle load of the campaign.
    """
    table, campaign = ingested.table(), ingested.campaign
    if load_N is None:
        load_N = campaign.judged_load_N(PRESSURE_PA)
    usable = tuple(fit.by_itself for fit in fits if np.isfinite(fit.by_itself.covariance).all())
    rate = [1 / float(np.median(np.diff(t.time_s))) for t in ingested.traces.values() if len(t.time_s) > 1]
    stated = campaign.instrument.get("sampling_rate_Hz", float(np.median(rate)) if rate else float("nan"))
    rises: dict[str, list[float]] = {}
    for test in campaign.tests:
        if (pull := ingested.pulls.get(test.test_id)) is not None and np.isfinite(pull.rise_N_per_s):
            rises.setdefault(test.sample, []).append(pull.rise_N_per_s)
    rise = {sample: float(np.median(values)) for sample, values in rises.items()}
    table.attrs["states_masses"] = any(test.mass_kg for test in campaign.tests)
    found = []
    for regime in dict.fromkeys(fit.regime for fit in usable):
        rows = {r.sample: r for r in sample_rows(table, regime)}
        own = tuple(fit for fit in usable if fit.regime == regime)
        for before, after in zip(own, partly_pooled(own, rows), strict=True):
            fit = replace(after, alone=before)
            if after is before and len(before.specimens) > 1:  # of a single sample, at least what its repeats explain
                fit = at_least(fit, _within(rows[fit.sample], fit, weights)[0])
            found.append(
                uncertainty_budget(
                    table, fit, campaign.instrument, weights=weights, sampling_rate_Hz=stated, load_N=load_N,
                    rise_N_per_s=rise.get(fit.sample, float("nan")),
                )
            )  # fmt: skip
    return tuple(found)


def uncertainty_budget(
    table: pd.DataFrame,
    fit: LawFit,
    instrument: Mapping[str, float],
    *,
    weights: str = "relative",
    rise_N_per_s: float = float("nan"),
    sampling_rate_Hz: float = float("nan"),
    load_N: float | None = None,
) -> tuple[LawFit, pd.DataFrame]:
    """One fit of ``fit_samples(table, ..., weights=weights)`` with its combined uncertainty, and the budget of that.

    Parameters
    ----------
    table : that of ``Ingested.table()``
    fit : the fitted law; its covariance is the type A part
    instrument : settings of campaign.toml (standard uncertainties, k = 1); what it lacks is taken from ``DEFAULTS``
        or, where ``table.attrs["states_masses"]`` is false, from ``DEFAULTS_WITHOUT_MASSES``
    weights : of the fit
    rise_N_per_s, sampling_rate_Hz : slope of the force before the peak, and f_s
        Together the sampling clip of static friction: a peak between two samples is read low by up to
        rise/(2 f_s) = k v/(2 f_s), taken as rectangular about zero because it is not corrected.
    load_N : where T is judged; a pressure of 10 kPa where it is not given

    Returns
    -------
    LawFit
        ``covariance`` is that of the fit plus every type B component, ``type_a`` that of the fit; ``largest`` names the
        component that dominates each number.
    DataFrame
        One row per component and a last one "combined": component, type, ``u_NUMBER`` and ``share_pct_NUMBER`` of mu,
        tau0_kPa (T0_N without an area) and T_N at ``load_N``, dof, origin. The type A rows share out the variance of
        the fit: what single readings and repeats explain, never more than there is, and the rest to the specimens.
        ``attrs["notes"]`` says what could not be told apart or is left out.

    Raises
    ------
    FitError
        The fit is not of T over the load, or holds no values.
    """
    import pandas as pd

    law = law_over_load(fit.nominal_area_m2).name
    if fit.law != law or not np.isfinite(fit.covariance).all():
        found = f"{fit.law}, sample {fit.sample}"
        raise FitError(Problem("no_budget", "a budget needs a fitted law", found=found, allowed=law))
    rows = next(r for r in sample_rows(table, fit.regime) if r.sample == fit.sample)
    if load_N is None:
        load_N = PRESSURE_PA * fit.nominal_area_m2 if fit.nominal_area_m2 else float(np.median(rows.load_N))
    by = sensitivities(fit, load_N)
    rows_a, notes = _type_a(rows, fit, weights, by)
    defaults = DEFAULTS if table.attrs.get("states_masses", True) else DEFAULTS_WITHOUT_MASSES
    changes = _type_b(fit, instrument, defaults, rise_N_per_s, sampling_rate_Hz)
    if fit.regime == "static" and not np.isfinite(rise_N_per_s * sampling_rate_Hz):
        notes += ("component sampling clip left out: the rise before the peak or the sampling rate is not known",)
    rows_b = [
        (name, "B", {k: abs(float(s @ change)) for k, s in by.items()}, float("inf"), origin)
        for name, change, origin in changes
    ]
    covariance = fit.covariance + sum((np.outer(change, change) for _, change, _ in changes), np.zeros((2, 2)))
    combined = {number: _u(covariance, s) for number, s in by.items()}
    components = [*rows_a, *rows_b, ("combined", "", combined, float("nan"), "")]
    table_of_parts = pd.DataFrame(
        {
            "component": name,
            "type": kind,
            **{f"u_{number}": u[number] for number in by},
            **{f"share_pct_{number}": 100 * (u[number] / combined[number]) ** 2 for number in by},
            "dof": dof,
            "origin": origin,
        }
        for name, kind, u, dof, origin in components
    )
    table_of_parts.attrs["notes"] = notes
    largest = {}
    for number, parameter in zip(by, (*fit.parameters, "T"), strict=True):
        name, _, u, _, origin = max(components[:-1], key=lambda component: component[2][number])
        assumed = ", assumed" if origin.startswith("default") else ""
        largest[parameter] = (f"{name}{assumed}", 100 * (u[number] / combined[number]) ** 2)
    whole = replace(fit, covariance=covariance, type_a=fit.covariance, largest=largest, alone=fit.by_itself)
    return whole, table_of_parts


def sensitivities(fit: LawFit, load_N: float) -> dict[str, FloatArray]:
    """Derivatives (2,) of mu, tau0_kPa (T0_N without an area) and T_N by the parameters."""
    area = fit.nominal_area_m2
    if area is None:
        return {"mu": np.array([1.0, 0.0]), "T0_N": np.array([0.0, 1.0]), "T_N": np.array([load_N, 1.0])}
    return {"mu": np.array([1.0, 0.0]), "tau0_kPa": np.array([0.0, 1e-3]), "T_N": np.array([load_N, area])}


def _u(covariance: FloatArray, by: FloatArray) -> float:
    return float(np.sqrt(max(float(by @ covariance @ by), 0.0)))


def _type_a(
    rows: Rows, fit: LawFit, weights: str, sensitivity: Mapping[str, FloatArray]
) -> tuple[list[tuple[str, str, dict[str, float], float, str]], tuple[str, ...]]:
    """(name, type, standard uncertainty of each number, dof, origin) of what the pulls show; and notes."""
    pulls, read, dof = _within(rows, fit, weights)
    u: dict[str, dict[str, float]] = {"specimens": {}, "repeats": {}, "reading": {}}
    capped = False
    for number, by in sensitivity.items():
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
    parts = [
        ("specimens", "A", u["specimens"], fit.dof, f"{fit.n_specimens} specimens"),
        ("repeats", "A", u["repeats"], float(dof), f"scatter of {fit.n_tests} pulls about the fitted lines"),
        ("reading of the trace", "A", u["reading"], float("inf"), "noise within each trace"),
    ]
    return parts, notes


def _within(rows: Rows, fit: LawFit, weights: str) -> tuple[FloatArray, FloatArray, int]:
    """Covariance of the parameters that pulls, and that readings alone, would give the mean over specimens."""
    weight = weights_of(rows, fit.nominal_area_m2, weights)
    pulls, reading, dof, count = np.zeros((2, 2)), np.zeros((2, 2)), 0, 0
    for name in rows.specimens:
        own = rows.specimen == name
        if len(np.unique(rows.load_N[own])) < 2:
            continue
        design = design_over_load(rows.load_N[own], fit.nominal_area_m2)
        line = least_squares(design, rows.force_N[own], weight[own])
        by_pull = line.unscaled @ (design * weight[own, None]).T
        reading += (by_pull * np.nan_to_num(rows.u_N[own]) ** 2) @ by_pull.T
        if line.dof:
            pulls += line.covariance
        dof, count = dof + line.dof, count + 1
    return pulls / max(count, 1) ** 2, reading / max(count, 1) ** 2, dof


def _type_b(
    fit: LawFit, instrument: Mapping[str, float], defaults: Mapping[str, tuple[float, str]], rise_N_per_s: float,
    sampling_rate_Hz: float,
) -> list[tuple[str, FloatArray, str]]:
    """(name, change (2,) of the parameters by one standard uncertainty, origin) of what all pulls share."""
    mu, adhesion = fit.values
    area = fit.nominal_area_m2
    settings = {name: float(instrument.get(name, value)) for name, (value, _) in defaults.items()}
    gain, as_adhesion = np.array([mu, adhesion]), np.array([0.0, 1.0 if area is None else 1 / area])
    mass_N = settings["mass_u_g"] * 1e-3 * STANDARD_GRAVITY
    settings["area_u_percent"] *= fit.has_area
    angle = np.radians(settings["wire_angle_deg"])
    # relative change of T by one standard uncertainty of the wire angle: T falls as 1/(cos f + mu sin f)
    slope = (mu * np.cos(angle) - np.sin(angle)) / (np.cos(angle) + mu * np.sin(angle))
    wire = float(slope * np.radians(settings["wire_angle_u_deg"]))
    relative_N = np.array([mu, 0.0]) * settings["normal_load_u_percent"] / 100
    changes = []
    for name, change, setting in (
        ("load cell, gain", gain * settings["load_cell_u_percent"] / 100, "load_cell_u_percent"),
        ("load cell, offset", as_adhesion * settings["load_cell_u_N"], "load_cell_u_N"),
        ("mass", as_adhesion * mu * mass_N, "mass_u_g"),
        ("normal load", relative_N, "normal_load_u_percent"),
        ("nominal area", np.array([0.0, adhesion]) * settings["area_u_percent"] / 100, "area_u_percent"),
        ("wire angle", gain * wire, "wire_angle_u_deg"),
    ):
        value, reason = defaults[setting]
        stated = f"campaign.toml: {setting} = {instrument[setting]:g}" if setting in instrument else ""
        changes.append((name, change, stated or f"default {setting} = {value:g}: {reason}"))
    low_N = rise_N_per_s / (2 * sampling_rate_Hz)
    if fit.regime == "static" and np.isfinite(low_N):
        origin = f"rise of {rise_N_per_s:.3g} N/s sampled at {sampling_rate_Hz:.3g} Hz"
        changes.append(("sampling clip", as_adhesion * low_N / np.sqrt(3), origin))
    return changes


def partly_pooled(
    fits: tuple[LawFit, ...], rows: Mapping[str, Rows], prior_dof: float = PRIOR_DOF
) -> tuple[LawFit, ...]:
    """The fits of one regime with the covariance of their specimens moved towards the mean of all samples.

    ``fits`` are those of ``fit_samples``, ``rows`` the tests of each sample. What is averaged is the covariance of T at
    the lowest and at the highest load, relative to the sample's own forces. Where a sample scatters more than it,
    ``dof`` becomes ``prior_dof`` plus that of the sample, at most that of all specimens together. Where it scatters
    less, it gets the mean with all degrees of freedom; no covariance is smaller than the mean in any combination of mu
    and tau0. A sample of one specimen gets the mean of the others, so that its interval applies to the pattern. Samples
    without values, with a force that is not positive, or without another sample to compare with, keep their own
    covariance.
    """
    shares = {f.sample: s for f in fits if (s := _shares(f, rows[f.sample])) is not None}
    several = [f for f in fits if f.sample in shares and len(f.specimens) > 1]
    if not several or len(shares) < 2:
        return fits
    freedom = np.array([len(f.specimens) - 1.0 for f in several])
    covariances = np.array([np.cov(shares[f.sample], rowvar=False) for f in several])
    mean = np.einsum("s,sij->ij", freedom, covariances) / freedom.sum()
    most = degrees_of_freedom(several)
    found = []
    for fit in fits:
        if fit.sample not in shares:
            found.append(fit)
            continue
        own = shares[fit.sample]
        forces = _end_forces(fit, rows[fit.sample])
        inverse = np.linalg.inv(forces / (forces @ fit.values)[:, None])
        scatter, dof = _believed(own, mean, prior_dof, most)
        moved = replace(
            fit,
            covariance=inverse @ scatter @ inverse.T / len(own),
            dof=dof,
            method=f"{fit.method}; scatter of specimens partly pooled over samples",
            notes=tuple(note for note in fit.notes if note != ONE_SPECIMEN),
        )
        found.append(at_least(moved, inverse @ mean @ inverse.T / len(own)))
    return tuple(found)


def _believed(shares: FloatArray, mean: FloatArray, prior: float, most: float) -> tuple[FloatArray, float]:
    """The scatter that is taken for the specimens of one sample, and its degrees of freedom."""
    own = len(shares) - 1.0
    if own == 0:
        return mean, min(prior, most)
    scatter = np.cov(shares, rowvar=False)
    if np.trace(scatter) < np.trace(mean):
        return mean, most
    return (prior * mean + own * scatter) / (prior + own), min(prior + own, most)


def _end_forces(fit: LawFit, rows: Rows) -> FloatArray:
    """(2, 2) that takes the parameters to T at the lowest and the highest load."""
    loads = rows.load_N[rows.load_N > 0]
    return design_over_load(np.array([loads.min(), loads.max()]), fit.nominal_area_m2)


def _shares(fit: LawFit, rows: Rows) -> FloatArray | None:
    """T of each specimen at both loads over that of the sample, (G, 2); None where there is nothing to compare."""
    if not fit.specimens or not np.isfinite(fit.values).all():
        return None
    forces = _end_forces(fit, rows)
    own = forces @ fit.values
    return np.array(list(fit.specimens.values())) @ forces.T / own if (own > 0).all() else None


def at_least(fit: LawFit, floor: FloatArray) -> LawFit:
    """The fit with a covariance that is in no combination of its parameters smaller than ``floor`` (2, 2).

    A floor without a width in some combination changes nothing.
    """
    if not np.linalg.det(floor) > ROUNDING * np.prod(np.diagonal(floor)):
        return fit
    root = np.linalg.cholesky(floor)
    inverse = np.linalg.inv(root)
    sizes, axes = np.linalg.eigh(inverse @ fit.covariance @ inverse.T)
    whole = root @ axes
    return replace(fit, covariance=whole @ np.diag(np.maximum(sizes, 1.0)) @ whole.T)


def degrees_of_freedom(fits: list[LawFit]) -> float:
    """Specimens less samples, samples that share specimens (one pattern pulled two ways) taken as one."""
    groups: list[set[str]] = []
    for fit in fits:
        names = set(fit.specimens)
        joined = [g for g in groups if g & names]
        groups = [g for g in groups if not g & names] + [names.union(*joined)]
    return float(sum(len(g) - 1 for g in groups))
