"""Two reports side by side: their cards, and the difference of every number that both have, with its interval."""

from __future__ import annotations

import base64
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from tribo.file_contents import bytes_of
from tribo.report.provenance import Provenance, read_record, settle_outputs, write_provenance
from tribo.report.reported import SHOWN, Fitted, Reported, fitted, read_reported
from tribo.report.result_tables import to_csv
from tribo.report.words.numerals import significant
from tribo.store.whole_files import write_text

COLUMNS = [
    "sample", "regime", "quantity", "unit", "first", "first_low", "first_high", "second", "second_low", "second_high",
    "difference", "difference_low", "difference_high", "difference_percent", "distinct",
]  # fmt: skip
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
    return pd.DataFrame(rows, columns=COLUMNS)


def _rows(one: dict[Any, Any], other: dict[Any, Any], load_N: float, areas: tuple[float, float]) -> Iterator[Any]:
    fits = fitted(one), fitted(other)
    for quantity, (_, unit) in QUANTITIES.items():
        a, b = (_value(fit, quantity, load_N, area) for fit, area in zip(fits, areas, strict=True))
        half = math.hypot(a[1], b[1])
        difference = b[0] - a[0]
        if not (math.isfinite(difference) and math.isfinite(half)):
            continue
        yield (
            one["sample"], one["regime"], quantity, unit, a[0], a[0] - a[1], a[0] + a[1], b[0], b[0] - b[1],
            b[0] + b[1], difference, difference - half, difference + half,
            100 * difference / a[0] if a[0] > 0 else math.nan, abs(difference) > half,
        )  # fmt: skip


def _value(fit: Fitted, quantity: str, load_N: float, area_m2: float) -> tuple[float, float]:
    """A number of a fit and the half width of its 95 % interval."""
    if quantity == "mu":
        return fit.mu, fit.mu_half
    return (fit.tau0_kPa, fit.tau0_half_kPa) if quantity == "tau0_kPa" else fit.force_N(load_N, area_m2)


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
    before = read_record(out)
    first, second = (read_reported(folder) for folder in folders)
    table, load = differences(first, second), common_load_N(first, second)
    said = sentences(table, load)
    page = _page((first, second), table, said, out)
    written = [write_text(out / "compare.csv", to_csv(table)), write_text(out / "compare.html", page)]
    write_provenance(provenance, out, settle_outputs(out, before, provenance, written, complete=True))
    return table, said


def _page(both: tuple[Reported, Reported], table: pd.DataFrame, said: list[str], out: Path) -> str:
    from tribo.report.html.page import compared_page

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
        "percent": f"{percent:+.1f}".replace("-", "−") if math.isfinite(percent) else "–", "distinct": row["distinct"],
    }  # fmt: skip
