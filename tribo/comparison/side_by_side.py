"""Measurement and prediction side by side: the forces of both at every measured load."""

from __future__ import annotations

import numpy as np

from tribo.comparison.prediction import Prediction
from tribo.records import REGIMES, Comparison, ComparisonRow, Ingested, Regime


def put_side_by_side(ingested: Ingested, prediction: Prediction) -> Comparison:
    """The fits of the model, and the forces of both at each load that was measured."""
    rows = [
        ComparisonRow(sample, regime, load, mean, u, *prediction.force_N(sample, regime, load))
        for regime in REGIMES
        for sample in prediction.samples
        for load, mean, u in load_means(ingested, sample, regime)
    ]
    return Comparison(prediction.fits, tuple(rows), prediction.calibration, prediction.flat)


def load_means(ingested: Ingested, sample: str, regime: Regime) -> list[tuple[float, float, float]]:
    """(normal load, mean force, its standard uncertainty) of a sample at each load, in newton.

    Specimens are averaged first, so that the uncertainty is that of the mean over specimens; with one
    specimen at a load it is that of the mean over its repeats, with one pull that of the reading.
    """
    table = ingested.table()
    rows = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"])]
    means = []
    for load, cell in rows.groupby("normal_load_N", sort=True):
        by_specimen = cell.groupby("specimen")[f"{regime}_N"].mean().to_numpy()
        values = by_specimen if by_specimen.size > 1 else cell[f"{regime}_N"].to_numpy()
        spread = float(values.std(ddof=1) / np.sqrt(values.size)) if values.size > 1 else float("nan")
        alone = float(cell[f"{regime}_u_N"].iloc[0])
        means.append((float(load), float(by_specimen.mean()), spread if values.size > 1 else alone))
    return means
