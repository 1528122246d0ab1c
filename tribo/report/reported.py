"""A written report as another one sees it: its card, its fits with their intervals, its loads and its figures."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tribo.display import displayed
from tribo.errors import CampaignError, Problem, failed_by_system
from tribo.file_contents import text_of

SHOWN = ("finding", "agreement", "fig4", "fig6", "fig7", "fig8", "misfit", "evidence", "dependence")
READ = ("fits.csv", "tests.csv")


@displayed(lambda r: r.title)
@dataclass(frozen=True)
class Reported:
    """A folder of results: its title, card and verdict, the fits and the loads of its tests."""

    folder: Path
    title: str
    area_m2: float
    card: dict[str, Any]
    verdict: dict[str, Any]
    fits: pd.DataFrame
    loads_N: tuple[float, float]

    def sentence(self) -> str:
        """What the report says first."""
        return str(self.card.get("sentence") or self.verdict.get("text") or "No diagnosis was made for this report.")

    def counts(self) -> str:
        """Its tests, specimens, samples and loads; empty where it has no card."""
        return str(self.card.get("counts") or "")

    def next_test(self) -> str:
        """The recommended next test; empty where there is none."""
        step = self.card.get("next_test")
        return str(step.get("what") or "") if isinstance(step, dict) else ""

    def pictures(self) -> dict[str, Path]:
        """The figures to compare that it has, by name."""
        found = {name: self.folder / "figures" / f"{name}.svg" for name in SHOWN}
        return {name: path for name, path in found.items() if path.is_file()}


def read_reported(folder: Path) -> Reported:
    """A folder that ``tribo report`` has written.

    Raises
    ------
    CampaignError
        It holds no report, or its tables are damaged.
    OSError
        The system cannot read them.
    """
    import h5py

    try:
        fits, tests = (pd.read_csv(StringIO(text_of(folder / name)), dtype={"sample": str}) for name in READ)
        with h5py.File(folder / "campaign.nc") as file:
            title, area = str(file.attrs["title"]), float(np.ravel(file.attrs["nominal_area_m2"])[0])
        loads = pd.to_numeric(tests["normal_load_N"], errors="coerce")
        card, verdict = (_json(folder / name) for name in ("card.json", "verdict.json"))
        fits[["sample", "regime", "mu", "tau0_kPa"]]
    except (OSError, KeyError, ValueError, RuntimeError) as why:
        if failed_by_system(why):
            raise
        reason = " ".join(str(why).split())[:150]
        problem = Problem("no_report", f"this is no folder of results of tribo report ({reason})", file=str(folder),
                          allowed="an output folder with fits.csv, tests.csv and campaign.nc")  # fmt: skip
        raise CampaignError(problem) from why
    return Reported(folder, title, area, card, verdict, fits, (float(loads.min()), float(loads.max())))


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    found = json.loads(text_of(path))
    return found if isinstance(found, dict) else {}


@displayed(lambda f: f"{f.sample}, {f.regime} friction")
@dataclass(frozen=True)
class Fitted:
    """One fit: mu and tau0 (kPa) with the half widths of their 95 % intervals, by the combined uncertainty if known.

    ``variances`` are those of mu, of both, and of tau0; ``widening`` is the half width over the standard uncertainty.
    """

    sample: str
    regime: str
    mu: float
    mu_half: float
    tau0_kPa: float
    tau0_half_kPa: float
    variances: tuple[float, float, float]
    widening: float

    def force_N(self, load_N: float, area_m2: float) -> tuple[float, float]:
        """T at a load, and the half width of its 95 % interval."""
        per_kPa = 1e3 * area_m2
        of_mu, of_both, of_tau0 = self.variances
        variance = load_N**2 * of_mu + 2 * load_N * per_kPa * of_both + per_kPa**2 * of_tau0
        u = math.sqrt(max(variance, 0.0)) if math.isfinite(variance) else math.nan
        return self.mu * load_N + self.tau0_kPa * per_kPa, self.widening * u


def fitted(fit: dict[Any, Any]) -> Fitted:
    """A row of fits.csv; NaN where it has no number."""

    def cell(name: str) -> float:
        value = fit.get(name)
        return float(value) if isinstance(value, int | float) else math.nan

    last = "_combined" if math.isfinite(cell("mu_u_combined")) else ""
    mu_half = (cell(f"mu{last}_high") - cell(f"mu{last}_low")) / 2
    tau0_half = (cell(f"tau0{last}_high_kPa") - cell(f"tau0{last}_low_kPa")) / 2
    mu_u, tau0_u = cell(f"mu_u{last}"), cell(f"tau0_u{last}_kPa")
    return Fitted(
        str(fit["sample"]),
        str(fit["regime"]),
        cell("mu"),
        mu_half,
        cell("tau0_kPa"),
        tau0_half,
        variances=(mu_u**2, cell(f"cov{last}"), tau0_u**2),
        widening=mu_half / mu_u if mu_u > 0 else math.nan,
    )
