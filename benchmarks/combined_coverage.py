"""How often do combined 95 % intervals hold the law, with instruments that are off by their stated sizes?

    python benchmarks/combined_coverage.py [--campaigns 300] [--seed 1] [--sweep] [--csv FILE]

Campaigns are those of interval_coverage.py: six samples of known law, whose specimens and pulls scatter. Each campaign
has one load cell with a gain and a zero error, one balance, one nominal area and one wire angle, all drawn from the
sizes that its instrument states. "alike by luck" are the samples, one in ten, whose three specimens agree best.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parent))
from interval_coverage import AREA_M2, STANDARD, Design, campaign, laws

from tribo.fitting import fit_samples, uncertainty_budget
from tribo.fitting.budget import DEFAULTS, PRESSURE_PA, PRIOR_DOF, partly_pooled
from tribo.fitting.linear import sample_rows
from tribo.records import STANDARD_GRAVITY, LawFit

NUMBERS = ("mu", "tau0_kPa", "T_N")
LUCKY = 0.1
INSTRUMENTS: dict[str, dict[str, float]] = {
    "defaults": {name: value for name, (value, _) in DEFAULTS.items()} | {"load_cell_u_N": 0.005},
    "precise": {
        "load_cell_u_percent": 0.1, "load_cell_u_N": 0.001, "mass_u_g": 0.003, "normal_load_u_percent": 0.1,
        "area_u_percent": 0.3, "wire_angle_u_deg": 0.05,
    },
    "poor": {
        "load_cell_u_percent": 3.0, "load_cell_u_N": 0.03, "mass_u_g": 0.3, "normal_load_u_percent": 2.0,
        "area_u_percent": 5.0, "wire_angle_u_deg": 1.0,
    },
}  # fmt: skip
DESIGNS: dict[str, Design] = {
    "standard": STANDARD,
    "alike specimens": replace(STANDARD, specimen_cv=(0.0, 0.0)),
    "unlike specimens": replace(STANDARD, specimen_cv=(0.2, 0.3)),
    "heavy tails": replace(STANDARD, heavy_tails=True),
    "one unlike sample": replace(STANDARD, unlike_sample="B"),
    "five specimens": replace(STANDARD, specimens=5),
    "two specimens": replace(STANDARD, specimens=2),
}


@dataclass(frozen=True)
class Errors:
    """What one instrument does to every pull of a campaign."""

    gain: float
    zero_N: float
    load_N: float
    load_gain: float
    area: float
    angle_rad: float

    def read(self, load_N: np.ndarray, mu: float, tau0_Pa: float, force_N: np.ndarray) -> np.ndarray:
        """The recorded force where an instrument without errors would record ``force_N`` at the stated loads."""
        true_load = (load_N + self.load_N) * (1 + self.load_gain)
        ideal = mu * load_N + tau0_Pa * AREA_M2
        true = mu * true_load + tau0_Pa * AREA_M2 * (1 + self.area)
        pulled = true / (np.cos(self.angle_rad) + mu * np.sin(self.angle_rad))
        return np.asarray(force_N * pulled / ideal * (1 + self.gain) + self.zero_N)


def drawn(instrument: Mapping[str, float], rng: np.random.Generator) -> Errors:
    """Errors of the stated standard uncertainties; that of the load cell and of the balance are rectangular."""
    rectangle = np.sqrt(3) * rng.uniform(-1, 1, 2)
    normal = rng.standard_normal(4)
    return Errors(
        gain=instrument["load_cell_u_percent"] / 100 * rectangle[0],
        zero_N=instrument["load_cell_u_N"] * normal[0],
        load_N=instrument["mass_u_g"] * 1e-3 * STANDARD_GRAVITY * rectangle[1],
        load_gain=instrument["normal_load_u_percent"] / 100 * normal[1],
        area=instrument["area_u_percent"] / 100 * normal[2],
        angle_rad=np.radians(instrument["wire_angle_u_deg"]) * normal[3],
    )


def measured(design: Design, instrument: Mapping[str, float], rng: np.random.Generator) -> pd.DataFrame:
    """One campaign as its instrument records it."""
    table, errors, true = campaign(design, rng), drawn(instrument, rng), laws(design.laws)
    for sample, (mu, tau0_Pa) in true.items():
        own = table["sample"] == sample
        load, force = (table.loc[own, name].to_numpy(float) for name in ("normal_load_N", "static_N"))
        table.loc[own, "static_N"] = errors.read(load, mu, tau0_Pa, force)
    return table


def budgets(table: pd.DataFrame, instrument: Mapping[str, float], prior_dof: float) -> list[LawFit]:
    """The combined fits of one campaign; ``prior_dof`` of zero leaves every sample its own scatter."""
    fits = fit_samples(table, "static", AREA_M2)
    if prior_dof:
        fits = partly_pooled(fits, {r.sample: r for r in sample_rows(table, "static")}, prior_dof)
    return [uncertainty_budget(table, fit, dict(instrument))[0] for fit in fits]


def truth(law: tuple[float, float]) -> np.ndarray:
    """mu, tau0 in kPa, and T in newton at PRESSURE_PA on the nominal area."""
    mu, tau0_Pa = law
    return np.array([mu, tau0_Pa / 1e3, (mu * PRESSURE_PA + tau0_Pa) * AREA_M2])


def judged(fit: LawFit, law: tuple[float, float]) -> dict[str, np.ndarray | float]:
    """Whether the combined interval, and that of the fit alone, hold the law; the scatter of T over the specimens."""
    load_N = PRESSURE_PA * AREA_M2
    found, true = np.array([fit.mu, fit.tau0_Pa / 1e3, float(fit.force_N(load_N))]), truth(law)
    half, alone = (
        np.array([np.diff(f.interval("mu"))[0] / 2, np.diff(f.interval("tau0_Pa"))[0] / 2e3,
                  float(f.force_half_width_N(load_N)[0])])
        for f in (fit, fit.by_itself)
    )  # fmt: skip
    forces = [(v[0] * PRESSURE_PA + v[1]) * AREA_M2 for v in fit.specimens.values()]
    return {
        "combined": np.abs(found - true) <= half, "type A": np.abs(found - true) <= alone,
        "half": half / true, "scatter": float(np.std(forces, ddof=1) / true[2]),
    }  # fmt: skip


def coverage(design: str, instrument: str, campaigns: int, seed: int, prior_dof: float = PRIOR_DOF) -> pd.DataFrame:
    """One row per class of samples and interval: share (percent) that holds mu, tau0 and T."""
    d, stated = DESIGNS[design], INSTRUMENTS[instrument]
    rng, true = np.random.default_rng([seed, *design.encode(), *instrument.encode()]), laws(DESIGNS[design].laws)
    found = [judged(b, true[b.sample]) | {"sample": b.sample} for _ in range(campaigns)
             for b in budgets(measured(d, stated, rng), stated, prior_dof)]  # fmt: skip
    scatter = np.array([f["scatter"] for f in found])
    classes = {"all": np.ones(len(found), bool), "alike by luck": scatter <= np.quantile(scatter, LUCKY)}
    if d.unlike_sample:
        classes["the unlike sample"] = np.array([f["sample"] == d.unlike_sample for f in found])
    rows = []
    for name, here in classes.items():
        for kind in ("type A", "combined"):
            held = np.array([f[kind] for f in found])[here]
            half = np.median(np.array([f["half"] for f in found])[here], axis=0)
            rows.append(
                {"design": design, "instrument": instrument, "prior_dof": prior_dof, "samples": name, "interval": kind,
                 "intervals": len(held), **dict(zip(NUMBERS, 100 * held.mean(axis=0), strict=True)),
                 "half_width_pct_T": 100 * half[2]}
            )  # fmt: skip
    return pd.DataFrame(rows)


def show(result: pd.DataFrame) -> str:
    """A Markdown table."""
    lines = ["| design | instrument | prior dof | samples | interval | n | mu | tau0 | T |", "|" + "---|" * 9]
    for r in result.itertuples():
        shares = " | ".join(f"{v:.1f}" for v in (r.mu, r.tau0_kPa, r.T_N))
        head = f"{r.design} | {r.instrument} | {r.prior_dof:g} | {r.samples} | {r.interval}"
        lines.append(f"| {head} | {r.intervals} | {shares} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--campaigns", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sweep", action="store_true", help="other weights of the scatter of all samples as well")
    parser.add_argument("--csv", help="write the figures to this file")
    options = parser.parse_args()
    cases = [(d, i, PRIOR_DOF) for d in DESIGNS for i in (INSTRUMENTS if d == "standard" else ("defaults",))]
    if options.sweep:
        swept = ("standard", "alike specimens", "one unlike sample", "heavy tails")
        cases = [(d, "precise", dof) for d in swept for dof in (0.0, 2.0, 4.0, 8.0, 1e6)]
    results = []
    for design, instrument, dof in cases:
        results.append(coverage(design, instrument, options.campaigns, options.seed, dof))
        print(show(results[-1]), flush=True)
    if options.csv:
        pd.concat(results).round(3).to_csv(options.csv, index=False)


if __name__ == "__main__":
    main()
