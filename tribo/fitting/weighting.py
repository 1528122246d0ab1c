"""Weights of the least-squares fit, from an assumption about the scatter of repeats.

The law is always T = mu N + tau0 A. The choices differ in the scatter that is assumed constant over the loads:

"relative"  the coefficient of variation of T: weights 1/T^2, with T from the fit itself (the default)
"ratio"     the scatter of T/N: weights 1/N^2, the fit T/N = mu + tau0/p of the paper's Fig. 4
"force"     the scatter of T: equal weights, the fit T = mu N + tau0 A of the paper's Figs. 6 and 7
"repeats"   nothing: a constant and a share of T, both estimated from the repeats of the sample
"""

from __future__ import annotations

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.linear import least_squares
from tribo.fitting.repeats import repeat_scatter
from tribo.fitting.rows import Rows
from tribo.laws.table import LAWS
from tribo.records import FloatArray

WEIGHTS: dict[str, str] = {
    "relative": "constant relative scatter of T",
    "ratio": "constant scatter of T/N",
    "force": "constant scatter of T",
    "repeats": "scatter of T estimated from repeats",
}
_ROUNDS = 4  # the weights move the fit by less than its error, and the fit moves the weights by far less
_SMALLEST_SHARE = 0.05  # of the median force: where the fitted force nears zero its weight must not diverge


def weights_of(rows: Rows, nominal_area_m2: float, weights: str) -> FloatArray:
    """Weights (n,) in 1/N^2, shared by all specimens of a sample so that none gets its own.

    Raises
    ------
    FitError
        An unknown name; "ratio" with a load of zero, where T/N is singular.
    """
    if weights == "force":
        return np.ones(len(rows))
    if weights == "ratio":
        if not rows.load_N.all():
            what, allowed = "T/N is not defined at zero load", "weights relative or force"
            raise FitError(Problem("zero_load", what, column="normal_load_N", allowed=allowed))
        return rows.load_N**-2.0
    if weights == "relative":
        return expected_force_N(rows, nominal_area_m2) ** -2.0
    if weights == "repeats":
        expected = expected_force_N(rows, nominal_area_m2)
        scatter = repeat_scatter((rows,))
        return expected**-2.0 if scatter is None else 1 / scatter.variance(expected)
    allowed = ", ".join(WEIGHTS)
    raise FitError(Problem("unknown_weights", "unknown weights", found=weights, allowed=allowed))


def expected_force_N(rows: Rows, nominal_area_m2: float) -> FloatArray:
    """Force (n,) of the sample's line at each load, kept above a share of the median force."""
    design = LAWS["coulomb_adhesion"].design_matrix(rows.load_N, nominal_area_m2)
    floor = _SMALLEST_SHARE * float(np.median(np.abs(rows.force_N))) or 1.0
    expected = np.full(len(rows), floor)
    for _ in range(_ROUNDS):
        fit = least_squares(design, rows.force_N, expected**-2.0)
        expected = np.maximum(np.abs(design @ fit.values), floor)
    return expected
