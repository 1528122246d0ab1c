"""How often do 95 % intervals hold the law? Simulated campaigns of known law, several designs and methods.

    python benchmarks/interval_coverage.py [--campaigns 200] [--seed 1] [--design NAME] [--method NAME] [--csv FILE]

Every campaign has six samples whose population laws T = mu N + tau0 A stand in Table 2 of Berardo et al.
(2019). A specimen has its own mu and tau0, scattered about the population's; a pull scatters by a share of T
and by a constant. Fitted is what a user would fit, on the table that a campaign's traces give. lmfit takes
part where it is installed; it is no dependency of tribo.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import t

sys.path.insert(0, str(Path(__file__).resolve().parent))
from other_fits import pool_specimen_scatter

from tribo.berardo2019.published_tables import load_table2
from tribo.errors import FitError
from tribo.fitting import fit_samples, mixed_model
from tribo.records import LawFit

AREA_M2 = 55e-6
LOADS_N = (0.0638, 0.1324, 0.26, 0.5052, 0.8976, 1.388)  # 5 to 140 g on a sled of 1.5 g
AT_PRESSURE_PA = 10e3
LEVEL = 0.95
DEFAULT = "specimens first, relative"
QUANTITIES = ("mu", "tau0", "T at 10 kPa")


@dataclass(frozen=True)
class Design:
    """A way to measure, and how specimens (relative sd of mu and of tau0) and pulls scatter."""

    specimens: int = 3
    repeats: int = 3
    loads_N: tuple[float, ...] = LOADS_N
    specimen_cv: tuple[float, float] = (0.05, 0.08)
    specimen_correlation: float = 0.3
    repeat_cv: float = 0.07
    repeat_sd_N: float = 0.1
    heavy_tails: bool = False
    missing_pulls: float = 0.0
    missing_cells: float = 0.0
    laws: str = "simulation"
    unlike_sample: str = ""  # its specimens scatter three times as much as those of the others


STANDARD = Design()
DESIGNS: dict[str, Design] = {
    "standard": STANDARD,
    "as the paper": replace(STANDARD, repeats=10, loads_N=tuple(np.linspace(0.015, 1.388, 8))),
    "few pulls": replace(STANDARD, repeats=1, loads_N=LOADS_N[::2]),
    "five specimens": replace(STANDARD, specimens=5),
    "two specimens": replace(STANDARD, specimens=2),
    "alike specimens": replace(STANDARD, specimen_cv=(0.0, 0.0)),
    "unlike specimens": replace(STANDARD, specimen_cv=(0.2, 0.3)),
    "missing cells": replace(STANDARD, missing_pulls=0.1, missing_cells=0.2),
    "heavy tails": replace(STANDARD, heavy_tails=True),
    "heavy, missing": replace(STANDARD, heavy_tails=True, missing_pulls=0.1, missing_cells=0.2),
    "one unlike sample": replace(STANDARD, unlike_sample="B"),
    "weak adhesion": replace(STANDARD, laws="experiment"),
}


def laws(source: str) -> dict[str, tuple[float, float]]:
    """(mu, tau0_Pa) of each sample: static friction of Table 2, measured or simulated column."""
    rows = load_table2().query("regime == 'static' and source == @source")
    return {r.sample: (r.mu, 1e3 * r.tau0_kPa) for r in rows.itertuples()}


def noise(rng: np.random.Generator, design: Design, size: tuple[int, ...]) -> np.ndarray:
    """Unit-variance scatter: normal, or Student's t with 3 degrees of freedom."""
    return rng.standard_t(3, size) / np.sqrt(3) if design.heavy_tails else rng.standard_normal(size)


def campaign(design: Design, rng: np.random.Generator) -> pd.DataFrame:
    """One campaign as ``Ingested.table()`` would give it."""
    tables = [_sample(name, *law, design, rng) for name, law in laws(design.laws).items()]
    return pd.concat(tables, ignore_index=True)


def _sample(name: str, mu: float, tau0_Pa: float, design: Design, rng: np.random.Generator) -> pd.DataFrame:
    g, n, r = design.specimens, len(design.loads_N), design.repeats
    z = noise(rng, design, (2, g)) * (3 if name == design.unlike_sample else 1)
    rho = design.specimen_correlation
    own_mu = mu * (1 + design.specimen_cv[0] * z[0])
    own_tau0 = tau0_Pa * (1 + design.specimen_cv[1] * (rho * z[0] + np.sqrt(1 - rho**2) * z[1]))
    load = np.broadcast_to(np.array(design.loads_N)[None, :, None], (g, n, r))
    force = own_mu[:, None, None] * load + own_tau0[:, None, None] * AREA_M2
    pulls = noise(rng, design, (2, g, n, r))
    force = force * (1 + design.repeat_cv * pulls[0]) + design.repeat_sd_N * pulls[1]
    gone = rng.random((g, n, r)) < design.missing_pulls
    gone |= (rng.random((g, n)) < design.missing_cells)[:, :, None]
    specimen = np.broadcast_to(np.array([f"{name}{k + 1}" for k in range(g)])[:, None, None], (g, n, r))
    table = pd.DataFrame(
        {
            "sample": name,
            "specimen": specimen.ravel(),
            "normal_load_N": load.ravel(),
            "static_N": force.ravel(),
        }
    )
    return table[~gone.ravel()]


def specimens_first(table: pd.DataFrame, weights: str) -> Iterator[LawFit]:
    yield from fit_samples(table, "static", AREA_M2, weights=weights)


def pooled_scatter(table: pd.DataFrame) -> Iterator[LawFit]:
    yield from pool_specimen_scatter(fit_samples(table, "static", AREA_M2))


def pooled(table: pd.DataFrame) -> Iterator[LawFit]:
    yield from fit_samples(table, "static", AREA_M2, by="tests")


def mixed(table: pd.DataFrame) -> Iterator[LawFit]:
    """The first sample only: the others would only cost time."""
    fit = mixed_model(table[table["sample"] == "F"], "static", AREA_M2)
    if fit is not None:
        yield fit


def lmfit_model(table: pd.DataFrame) -> Iterator[LawFit]:
    """lmfit's Model with weights 1/T and its scaled covariance, all pulls of a sample together."""
    from lmfit import Model

    law = Model(lambda load, mu, tau0_kPa: mu * load + tau0_kPa * 1e3 * AREA_M2, independent_vars=["load"])
    for fit in fit_samples(table, "static", AREA_M2, by="tests"):
        rows = table[table["sample"] == fit.sample]
        result = law.fit(
            rows["static_N"].to_numpy(), load=rows["normal_load_N"].to_numpy(), mu=3.0, tau0_kPa=10.0,
            weights=1 / np.abs(fit.force_N(rows["normal_load_N"].to_numpy())),
        )  # fmt: skip
        scale = np.array([1.0, 1e3])
        values = np.array([result.params["mu"].value, result.params["tau0_kPa"].value]) * scale
        yield replace(fit, values=values, covariance=result.covar * np.outer(scale, scale), dof=result.nfree)


Method = Callable[[pd.DataFrame], Iterator[LawFit]]


def methods() -> dict[str, Method]:
    """The methods compared; lmfit only where it is installed."""
    from importlib.util import find_spec

    found: dict[str, Method] = {
        "specimens first, relative": partial(specimens_first, weights="relative"),
        "specimens first, ratio": partial(specimens_first, weights="ratio"),
        "specimens first, force": partial(specimens_first, weights="force"),
        "specimens first, repeats": partial(specimens_first, weights="repeats"),
        "specimens first, pooled scatter": pooled_scatter,
        "pooled least squares": pooled,
        "MixedLM": mixed,
    }
    if find_spec("lmfit"):
        found["lmfit"] = lmfit_model
    return found


def judged(fit: LawFit, law: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Relative error and relative half width of the interval for mu, tau0 and T at 10 kPa, each (3,)."""
    load = AT_PRESSURE_PA * AREA_M2
    truth = np.array([law[0], law[1], law[0] * load + law[1] * AREA_M2])
    found = np.array([*fit.values, float(fit.force_N(load))])
    u = np.array([*np.sqrt(np.diag(fit.covariance)), float(fit.force_u_N(load))])
    return (found - truth) / truth, t.ppf(0.5 + LEVEL / 2, fit.dof) * u / truth


def coverage(name: str, design: Design, campaigns: int, seed: int, wanted: list[str] | None) -> pd.DataFrame:
    """One row a method and quantity: share of intervals that hold the law, and the size of errors."""
    true = laws(design.laws)
    rng = np.random.default_rng([seed, *name.encode()])
    tables = [campaign(design, rng) for _ in range(campaigns)]
    rows = []
    for method, fitter in methods().items():
        if wanted and method not in wanted:
            continue
        results = [judged(fit, true[fit.sample]) for table in tables for fit in _fits(fitter, table)]
        error, half = (np.array(part) for part in zip(*results, strict=True))
        usable = np.isfinite(half).all(axis=1)
        hit = (np.abs(error) <= half)[usable]
        for k, quantity in enumerate(QUANTITIES):
            share = hit[:, k].mean()
            rows.append(
                {
                    "design": name, "method": method, "quantity": quantity, "intervals": len(hit),
                    "coverage_pct": 100 * share, "se_pct": 100 * np.sqrt(share * (1 - share) / len(hit)),
                    "rms_error_pct": 100 * np.sqrt((error[usable, k] ** 2).mean()),
                    "half_width_pct": 100 * np.median(half[usable, k]),
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def _fits(fitter: Method, table: pd.DataFrame) -> list[LawFit]:
    try:
        return list(fitter(table))
    except FitError:
        return []


def show(result: pd.DataFrame) -> str:
    """A Markdown table, one row a design and method, coverage of the three quantities side by side."""
    lines = [
        f"| design | method | intervals | {' | '.join(QUANTITIES)} | half width of mu, tau0, T | rms error |",
        "|---|---|---|" + "---|" * (len(QUANTITIES) + 2),
    ]
    for (design, method), group in result.groupby(["design", "method"], sort=False):
        held = " | ".join(f"{c:.1f} ± {s:.1f}" for c, s in zip(group.coverage_pct, group.se_pct, strict=True))
        width = ", ".join(f"{w:.0f}" for w in group.half_width_pct)
        error = ", ".join(f"{e:.1f}" for e in group.rms_error_pct)
        lines.append(f"| {design} | {method} | {group.intervals.iloc[0]} | {held} | {width} | {error} |")
    return "\n".join(lines)


def of_default(result: pd.DataFrame) -> str:
    """Markdown: coverage of the default fit, one row a design."""
    own = result[result["method"] == DEFAULT]
    lines = [f"| design | intervals | {' | '.join(QUANTITIES)} |", "|---|---|" + "---|" * len(QUANTITIES)]
    for design, group in own.groupby("design", sort=False):
        held = " | ".join(f"{c:.1f} ± {s:.1f}" for c, s in zip(group.coverage_pct, group.se_pct, strict=True))
        lines.append(f"| {design} | {group.intervals.iloc[0]} | {held} |")
    return "\n".join(lines)


def of_methods(result: pd.DataFrame) -> str:
    """Markdown: coverage and median half width of T at 10 kPa, one row a design, one column a method."""
    force = result[result["quantity"] == QUANTITIES[2]]
    names = list(dict.fromkeys(force["method"]))
    lines = [f"| design | {' | '.join(names)} |", "|---|" + "---|" * len(names)]
    for design, group in force.groupby("design", sort=False):
        by = group.set_index("method")
        cells = (f"{by.coverage_pct[m]:.1f} ({by.half_width_pct[m]:.0f})" if m in by.index else "" for m in names)
        lines.append(f"| {design} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--campaigns", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--design", action="append", choices=list(DESIGNS), help="default: all")
    parser.add_argument("--method", action="append", choices=list(methods()), help="default: all")
    parser.add_argument("--csv", help="write the figures to this file")
    options = parser.parse_args()
    results = []
    for name in options.design or DESIGNS:
        results.append(coverage(name, DESIGNS[name], options.campaigns, options.seed, options.method))
        print(show(results[-1]) if len(results) == 1 else show(results[-1]).split("\n", 2)[2], flush=True)
    everything = pd.concat(results)
    print(f"\nThe default fit\n\n{of_default(everything)}\n\nT at 10 kPa\n\n{of_methods(everything)}")
    if options.csv:
        everything.round(3).to_csv(options.csv, index=False)


if __name__ == "__main__":
    main()
