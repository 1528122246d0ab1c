"""Two written reports side by side: their cards, and the difference of every number that both have, with its interval.

A report is read from its folder of results: its card, its fits with their intervals, its loads and its figures.
"""

from __future__ import annotations

import base64
import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from tribo.display import displayed
from tribo.errors import CampaignError, Problem, failed_by_system
from tribo.files import bytes_of, intact_hdf5, text_of
from tribo.outputs import product
from tribo.report.provenance import Provenance, write_results
from tribo.wording.numerals import significant, true_minus

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
        with h5py.File(intact_hdf5(folder / "campaign.nc")) as file:
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


def fit_numbers(fit: Mapping[Any, Any]) -> dict[str, Any]:
    """mu and tau0_kPa of a row of fits.csv, each with the half width of its 95 % interval by the combined uncertainty;
    NaN where the row has no number.

    ``variances`` are those of mu, of both, and of tau0; ``widening`` is the half width over the standard uncertainty.
    Reports of earlier versions hold the combined uncertainty in columns of their own.
    """

    def cell(name: str) -> float:
        value = fit.get(name)
        return float(value) if isinstance(value, int | float) else math.nan

    last = "_combined" if math.isfinite(cell("mu_u_combined")) else ""
    mu_half = (cell(f"mu{last}_high") - cell(f"mu{last}_low")) / 2
    tau0_half = (cell(f"tau0{last}_high_kPa") - cell(f"tau0{last}_low_kPa")) / 2
    mu_u, tau0_u = cell(f"mu_u{last}"), cell(f"tau0_u{last}_kPa")
    return {
        "sample": str(fit["sample"]), "regime": str(fit["regime"]), "mu": (cell("mu"), mu_half),
        "tau0_kPa": (cell("tau0_kPa"), tau0_half), "variances": (mu_u**2, cell(f"cov{last}"), tau0_u**2),
        "widening": mu_half / mu_u if mu_u > 0 else math.nan,
    }  # fmt: skip


def _force_N(fit: Mapping[str, Any], load_N: float, area_m2: float) -> tuple[float, float]:
    """T of a fit at a load, and the half width of its 95 % interval."""
    per_kPa = 1e3 * area_m2
    of_mu, of_both, of_tau0 = fit["variances"]
    variance = load_N**2 * of_mu + 2 * load_N * per_kPa * of_both + per_kPa**2 * of_tau0
    u = math.sqrt(max(variance, 0.0)) if math.isfinite(variance) else math.nan
    return fit["mu"][0] * load_N + fit["tau0_kPa"][0] * per_kPa, fit["widening"] * u


QUANTITIES = {"mu": ("μ", "1"), "tau0_kPa": ("τ₀", "kPa"), "T_N": ("T", "N")}


def common_load_N(first: Reported, second: Reported) -> float:
    """The middle, on a logarithmic scale, of the loads that both cover; NaN where they share none."""
    low = max(first.loads_N[0], second.loads_N[0])
    high = min(first.loads_N[1], second.loads_N[1])
    return math.sqrt(low * high) if 0 < low <= high else math.nan


def differences(first: Reported, second: Reported) -> pd.DataFrame:
    """mu, tau0 (kPa) and T (N, at the common load) of every sample and regime in both, with 95 % intervals.

    The interval of a difference combines the two half widths in quadrature. Errors that both campaigns share, such as
    the gain of the same load cell, are counted twice: the intervals are then too wide, never too narrow.
    """
    load = common_load_N(first, second)
    rows = []
    for one in first.fits.to_dict("records"):
        for other in second.fits.to_dict("records"):
            if (one["sample"], one["regime"]) == (other["sample"], other["regime"]):
                rows += list(_rows(one, other, load, (first.area_m2, second.area_m2)))
    return pd.DataFrame(rows, columns=product("compare.csv").column_names)


def _rows(one: dict[Any, Any], other: dict[Any, Any], load_N: float, areas: tuple[float, float]) -> Iterator[Any]:
    fits = [fit_numbers(fit) for fit in (one, other)]
    fits = [fit | {"T_N": _force_N(fit, load_N, area)} for fit, area in zip(fits, areas, strict=True)]
    for quantity, (_, unit) in QUANTITIES.items():
        a, b = (fit[quantity] for fit in fits)
        half = math.hypot(a[1], b[1])
        difference = b[0] - a[0]
        if not (math.isfinite(difference) and math.isfinite(half)):
            continue
        yield (
            one["sample"], one["regime"], quantity, unit, a[0], a[0] - a[1], a[0] + a[1], b[0], b[0] - b[1],
            b[0] + b[1], difference, difference - half, difference + half,
            100 * difference / a[0] if a[0] > 0 else math.nan, abs(difference) > half,
        )  # fmt: skip


def sentences(table: pd.DataFrame, load_N: float) -> list[str]:
    """What differs, in words: T first, since mu and tau0 of a fit are correlated."""
    if table.empty:
        return ["The two reports have no fitted sample of the same name, so no number is compared."]
    forces = table[table["quantity"] == "T_N"]
    if forces.empty:
        return ["The loads of the two campaigns do not overlap, so T is not compared."]
    distinct = forces[forces["distinct"]]
    told = [
        f"T at N = {significant(load_N)} N is compared for {len(forces)} combinations of sample and regime. It differs "
        f"beyond the 95 % interval in {len(distinct)}. If nothing differed, about one in 20 would do so by chance."
    ]
    for row in distinct.to_dict("records"):
        size = f"{significant(abs(row['difference_percent']), 2)} %"
        word = "higher" if row["difference"] > 0 else "lower"
        told.append(f"{row['regime'].capitalize()} T of {row['sample']} is {size} {word} in the second campaign.")
    return told


def write_comparison(folders: tuple[Path, Path], out: Path, provenance: Provenance) -> tuple[pd.DataFrame, list[str]]:
    """Write out/compare.html and compare.csv, and provenance.json; returns the table and its sentences."""
    first, second = (read_reported(folder) for folder in folders)
    table, load = differences(first, second), common_load_N(first, second)
    said = sentences(table, load)
    page = _page((first, second), table, said, out)
    write_results({"compare.csv": table, "compare.html": page}, out, provenance, "compare-reports")
    return table, said


def _page(both: tuple[Reported, Reported], table: pd.DataFrame, said: list[str], out: Path) -> str:
    from tribo.report.page import compared_page

    columns = [_column(report, out) for report in both]
    shown = [name for name in SHOWN if any(name in column["figures"] for column in columns)]
    return compared_page(columns, [_cells(row) for row in table.to_dict("records")], said, shown)


def _column(report: Reported, out: Path) -> dict[str, Any]:
    """What the page shows of one report. Its figures are pictures: nothing in them can run."""
    return {
        "title": report.title,
        "link": quote(Path(os.path.relpath(report.folder / "report.html", out)).as_posix()),
        "sentence": report.sentence(),
        "counts": report.counts(),
        "next_test": report.next_test(),
        "figures": {n: base64.b64encode(bytes_of(p)).decode("ascii") for n, p in report.pictures().items()},
    }


def _cells(row: dict[Any, Any]) -> dict[str, Any]:
    def between(name: str) -> str:
        return f"{significant(row[name])} ({significant(row[f'{name}_low'])} to {significant(row[f'{name}_high'])})"

    symbol, unit = QUANTITIES[row["quantity"]]
    percent = row["difference_percent"]
    return {
        "sample": row["sample"], "regime": row["regime"], "quantity": f"{symbol} ({unit})" if unit != "1" else symbol,
        "first": between("first"), "second": between("second"), "difference": between("difference"),
        "percent": true_minus(f"{percent:+.1f}") if math.isfinite(percent) else "–", "distinct": row["distinct"],
    }  # fmt: skip
