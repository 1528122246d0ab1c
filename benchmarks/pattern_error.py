"""How wrong the model may be about a pattern: the maker of the error sizes that a diagnosis assumes.

A case is one admissible way to compute the model's friction of a pattern: a reading of the paper's text, a mesh, a
domain. It gives shares of the flat law of its own, and these another force than the table's,

    d(p) = ln [m mu_F p + a tau0_F] - ln [m' mu_F p + a' tau0_F],

with the shares m, a of the case, m', a' of the table's way under the same runs, and the flat law of the table: a
campaign fits the flat law itself, so a change of the flat sample's own friction is no error. d is split over 3 to
25 kPa, evenly in ln p, into an offset, a slope and a curve as a diagnosis has them. Which case describes a real sample
is not known. Each case of a source, the table's own among them, is taken as equally likely, so the size of an error is
the root of the mean square of d's parts, first over the cases of a sample, then over the samples. Sources are
independent of each other, and their squares add.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.diagnostics.predictor import Known, interpolated_shares
from tribo.records import REGIMES, FloatArray
from tribo.springblock.calibration import simulated_law
from tribo.springblock.config import PAPER_PRESSURES_PA

if TYPE_CHECKING:
    import pandas as pd


FLAT = "F"
SHAPES = ("offset", "slope", "curve")
LEVELS_PA = np.geomspace(PAPER_PRESSURES_PA[0], PAPER_PRESSURES_PA[-1], 12)
OWN_READING = {"static": ("baseline", "highest peak"), "sliding": ("baseline", "1.05 to 3 peak times")}
NOT_ADMITTED = {
    "p l2 on every block": "blocks under cavities would carry load, and those in contact less than the load applied",
}
"""Variants of the study that are no reading of the text, with the reason."""
SOURCES = {
    "readings": "docs/data/table2-study.csv",
    "mesh": "docs/data/simulator-mesh.csv",
    "number of blocks": "docs/data/simulator-domain.csv, docs/data/simulator-mesh.csv",
    "form of the law": "data/pattern_shares/runs.csv",
    "interpolation": "data/pattern_shares/laws.csv",
}
Case = dict[str, Any]


def split(change: FloatArray) -> FloatArray:
    """Offset, slope per e-fold and curve per squared e-fold of a change of ln T at LEVELS_PA."""
    x = np.log(LEVELS_PA) - np.log(LEVELS_PA).mean()
    columns = np.column_stack([np.ones_like(x), x, x**2 - np.mean(x**2)])
    return np.asarray(np.linalg.lstsq(columns, change, rcond=None)[0])


def change_of_force(shares: FloatArray, own: FloatArray, flat: FloatArray) -> FloatArray:
    """ln T at LEVELS_PA by the shares of a case less that by the table's own: each (mu, tau0), ``flat`` in Pa."""
    force, own_force = (s[0] * flat[0] * LEVELS_PA + s[1] * flat[1] for s in (shares, own))
    return np.asarray(np.log(force / own_force))


def of_readings(study: pd.DataFrame) -> Iterator[Case]:
    """Cases of ``benchmarks/simulator_table2.py study``: variants by peak rules (static) or windows (sliding)."""
    rows = study[(study["weights"] == "ratio") & ~study["variant"].isin(list(NOT_ADMITTED))]
    for regime in REGIMES:
        laws = {key: _laws(part) for key, part in rows[rows["regime"] == regime].groupby(["variant", "reading"])}
        yield from _cases("readings", regime, laws, OWN_READING[regime])


def of_mesh(mesh: pd.DataFrame) -> Iterator[Case]:
    """Cases of ``benchmarks/simulator_size.py mesh``: 5 um, 2.5 um, and 2.5 um with round cavities."""
    keys = ["spacing_um", "cavities"]
    for regime in REGIMES:
        laws = {key: _laws_of_runs(part, regime) for key, part in mesh.groupby(keys)}
        flat = {spacing: laws[spacing, "square"][FLAT] for spacing, _ in laws}
        with_flat = {key: law | {FLAT: flat[key[0]]} for key, law in laws.items()}
        yield from _cases("mesh", regime, with_flat, (5.0, "square"))


def of_domain(domain: pd.DataFrame, mesh: pd.DataFrame) -> Iterator[Case]:
    """Cases of ``benchmarks/simulator_size.py domain`` beside the paper's 85 x 85 blocks, which ``mesh`` holds."""
    own = mesh[(mesh["spacing_um"] == 5.0) & (mesh["cavities"] == "square")]
    for regime in REGIMES:
        laws = {key: _laws_of_runs(part, regime) for key, part in domain.groupby("blocks_a_side")}
        yield from _cases("number of blocks", regime, laws | {85: _laws_of_runs(own, regime)}, 85)


def of_form(runs: pd.DataFrame) -> Iterator[Case]:
    """What the runs of the table leave of its own law: their mean T/N at each pressure over mu + tau0/p."""
    for regime in REGIMES:
        for sample, part in runs[runs["sample"] != FLAT].groupby("sample"):
            mu, tau0_Pa = simulated_law(part["pressure_Pa"].to_numpy(float), part[f"{regime}_friction"].to_numpy(float))
            mean = part.groupby("pressure_Pa")[f"{regime}_friction"].mean()
            p = mean.index.to_numpy(float)
            left = np.log(mean.to_numpy(float) / (mu + tau0_Pa / p))
            parts = split(np.interp(np.log(LEVELS_PA), np.log(p), left))
            yield _case("form of the law", regime, "runs over law", str(sample), parts)


def of_interpolation(patterns: Mapping[str, Known], flat: FloatArray) -> Iterator[Case]:
    """Every pattern of the table predicted from the others; both directions of one pattern are left out together."""
    for sample, (left_out, own_shares) in patterns.items():
        known = [(pattern, shares) for pattern, shares in patterns.values() if pattern.name != left_out.name]
        shares = np.array(interpolated_shares(left_out.area_fraction, known))
        own = np.array(own_shares)
        for k, regime in enumerate(REGIMES):
            at = slice(2 * k, 2 * k + 2)
            parts = split(change_of_force(shares[at], own[at], flat[at] * (1.0, 1e3)))
            yield _case("interpolation", regime, "left out", sample, parts)


def sizes(cases: Iterable[Case]) -> pd.DataFrame:
    """One row a source and regime: offset, slope, curve, the number of cases, and the file they were made from.

    "total" is the sum of all sources but the interpolation.
    """
    import pandas as pd

    table = pd.DataFrame(list(cases))
    squares = table.assign(**{name: table[name] ** 2 for name in SHAPES})
    by_sample = squares.groupby(["source", "regime", "sample"], sort=False)[list(SHAPES)].mean()
    by_source = by_sample.groupby(["source", "regime"], sort=False).mean()
    by_source["cases"] = table.groupby(["source", "regime"], sort=False).size()
    total = by_source.drop(index="interpolation", level="source").groupby("regime", sort=False).sum()
    found = pd.concat([by_source.reset_index(), total.assign(source="total").reset_index()], ignore_index=True)
    found[list(SHAPES)] = np.sqrt(found[list(SHAPES)])
    made_from = found["source"].map({**SOURCES, "total": "the sources above without interpolation"})
    return found[["source", "regime", *SHAPES, "cases"]].assign(made_from=made_from)


def _case(source: str, regime: str, case: str, sample: str, parts: FloatArray) -> Case:
    named = dict(zip(SHAPES, map(float, parts), strict=True))
    return {"source": source, "regime": regime, "case": case, "sample": sample, **named}


def _cases(source: str, regime: str, laws: Mapping[Any, Mapping[str, FloatArray]], own: Any) -> Iterator[Case]:
    """Every law of a source against that of the case ``own``; a case may lack samples."""
    flat = laws[own][FLAT]
    for key, of_samples in laws.items():
        name = ", ".join(map(str, key)) if isinstance(key, tuple) else str(key)
        for sample, law in of_samples.items():
            if sample != FLAT:
                change = change_of_force(law / of_samples[FLAT], laws[own][sample] / flat, flat)
                yield _case(source, regime, name, sample, split(change))


def _laws(fits: pd.DataFrame) -> dict[str, FloatArray]:
    """(mu, tau0 in Pa) by sample of a table of fits."""
    columns = fits["sample"], fits["mu"], 1e3 * fits["tau0_kPa"]
    return {str(sample): np.array([mu, tau0_Pa]) for sample, mu, tau0_Pa in zip(*columns, strict=True)}


def _laws_of_runs(runs: pd.DataFrame, regime: str) -> dict[str, FloatArray]:
    """(mu, tau0 in Pa) by sample of a table of runs with columns pressure_kPa and the regime's T/N."""
    return {
        str(sample): simulated_law(1e3 * part["pressure_kPa"].to_numpy(float), part[regime].to_numpy(float))
        for sample, part in runs.groupby("sample", sort=False)
    }
