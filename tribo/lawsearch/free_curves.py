"""Laws as curves and surfaces: how friction follows one column or two with no formula in mind, by a Gaussian process,
with its band.

A curve is held at knots along the column. It is uncertain by what the campaign leaves open, averaged over how large,
how smooth and how fast it may be (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and
5). The band of a formula is that of the curve of its column: the formula was chosen among many once the data had been
seen, the curve was not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.gaps import enough_recorded
from tribo.diagnostics.inference import gain_on_groups
from tribo.lawsearch.grammar import (
    MOST_VALUES,
    PRESSURES,
    UNITS,
    Shape,
    WrittenLaw,
    column_values,
    logarithmic,
    recorded_values,
)
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

KNOTS = 25
ALONG = 13  # knots of a surface along each column
LENGTHS = (0.07, 0.15, 0.3, 0.6)  # over which a curve changes, in shares of the range of the column
SIZES = np.geomspace(0.005, 0.5, 9)  # standard deviation of a curve, in ln T
FLAT_BELOW = 1e-7  # of the largest variance of a curve along its principal directions, below which one is left out
FOLDS = 5  # of whole specimens that are left out
AS_GOOD = 1.0  # standard errors by which tests left out may favour a curve over the formula that stays


def curve_of(column: str, c: Conditions) -> Shape | None:
    """The curve of a column of numbers, zero everywhere, with its knots: evenly spaced, or in the logarithm where the
    column spans much; None where it has few values, or where the flat law follows it."""
    if column in PRESSURES or column == "clock_h":
        return None
    x = recorded_values(c, column)
    if len(np.unique(x)) <= MOST_VALUES:
        return None
    low, high = float(x.min()), float(x.max())
    spaced = np.geomspace if logarithmic(low, high) else np.linspace
    places = tuple(float(p) for p in spaced(low, high, KNOTS))
    return Shape("curve", column, low, high, values=(low, *places[1:-1], high), heights=(0.0,) * KNOTS)


def knots_of(column: str, c: Conditions) -> Shape | None:
    """The knots of a surface along a column of numbers: its values where it has few, else evenly spaced, or in the
    logarithm where the column spans much; None where a column does not vary, or where the flat law follows it."""
    if column in PRESSURES or not (column in UNITS or np.isfinite(column_values(c, column)).any()):
        return None
    x = recorded_values(c, column)
    values = np.unique(x)
    if len(values) < 2 or not enough_recorded(len(x), len(c.sample)):
        return None
    low, high = float(values[0]), float(values[-1])
    spaced = np.geomspace if logarithmic(low, high) else np.linspace
    places = values if len(values) <= ALONG else spaced(low, high, ALONG)
    return Shape("surface", column, low, high, values=(low, *(float(p) for p in places[1:-1]), high))


def kernels(shape: Shape) -> list[FloatArray]:
    """Covariances between the knots of a column, smooth and rough, for each of the lengths."""
    at = np.array(shape.values, float)
    place = np.log(at) if logarithmic(shape.low, shape.high) else at
    place = (place - place[0]) / (place[-1] - place[0])
    apart = np.abs(place[:, None] - place)
    found = []
    for length in LENGTHS:
        near = apart / length
        found += [np.exp(-0.5 * near**2), (1.0 + np.sqrt(3.0) * near) * np.exp(-np.sqrt(3.0) * near)]
    return found


@dataclass(frozen=True)
class FreeCurve:
    """A curve in one scope of laws, known from a campaign.

    ``columns`` (n, 2, knots) of ln T are those of the curve at each knot; ``heights`` (knots,) are what the campaign
    tells of ln T there, where the law acts fully, about a mean of zero over its tests, with their ``covariance``.
    ``prior`` (knots, r) spans the curves that are likely, and ``evidence`` is the log of the marginal likelihood over
    none.
    """

    law: WrittenLaw
    columns: FloatArray
    heights: FloatArray
    covariance: FloatArray
    prior: FloatArray
    evidence: float


def at_knots(shapes: Sequence[Shape], c: Conditions) -> FloatArray:
    """The courses (n, knots) that a curve or a surface is made of, each one at its knot and zero at the others."""
    first, *second = (replace(shape, kind="surface", heights=()).of(c) for shape in shapes)
    for other in second:
        first = (first[:, :, None] * other[:, None, :]).reshape(len(first), -1)
    return first


def likely(shapes: Sequence[Shape]) -> list[FloatArray]:
    """Covariances between the knots of a curve or a surface, of a standard deviation of one along each column."""
    each = [kernels(shape) for shape in shapes]
    if len(each) == 1:
        return each[0]
    alike = (pair for k in (0, 1) for pair in product(each[0][2 + k :: 2], each[1][2 + k :: 2]))
    return [np.asarray(np.kron(1.0 + one, 1.0 + other) - 1.0, float) for one, other in alike]


def fitted_curve(without: ModelFit, scope: tuple[WrittenLaw, FloatArray], informed: float) -> FreeCurve:
    """The curve or surface that a campaign tells of, ``without`` being its fit without the law.

    Parameters
    ----------
    without : ModelFit
        With the noise at which it is told, and the residual.
    scope : (WrittenLaw, array (n, 2))
        The law, with the shape of :func:`curve_of` or two of :func:`knots_of`, and by how much it changes ln T of
        every test.
    informed : float
        Of the information in the weighted normal equations, what a pull really tells.
    """
    law, effects = scope
    c = without.setup.observations.conditions
    courses = at_knots(law.shapes, c)
    acts = np.abs(law.weight(c))
    courses = courses - acts @ courses / acts.sum()
    columns = courses[:, None, :] * effects[:, :, None]
    rows, residual = without.cleared(columns)
    information, pull = rows.T @ rows, rows.T @ residual
    found = []
    for kernel in likely(law.shapes):
        variance, directions = np.linalg.eigh(kernel)
        kept = variance > FLAT_BELOW * variance[-1]
        root = directions[:, kept] * np.sqrt(variance[kept])
        sizes = SIZES if len(law.shapes) == 1 else SIZES[2::2]
        found += [_member(information, pull, size * root, informed) for size in sizes]
    evidence = np.array([member[0] for member in found])
    share = np.exp(evidence - evidence.max())
    share = share / share.sum()
    heights = np.sum([w * member[1] for w, member in zip(share, found, strict=True)], axis=0)
    covariance = sum(
        w * (own + np.outer(value - heights, value - heights))
        for w, (_, value, own, _) in zip(share, found, strict=True)
    )
    prior = sum(w * member[3] @ member[3].T for w, member in zip(share, found, strict=True))
    variance, directions = np.linalg.eigh(prior)
    kept = variance > FLAT_BELOW * variance[-1]
    prior = directions[:, kept] * np.sqrt(variance[kept])
    mean = float(evidence.max() + np.log(np.mean(np.exp(evidence - evidence.max()))))
    return FreeCurve(law, columns, heights, np.asarray(covariance), prior, mean)


def _member(
    information: FloatArray, pull: FloatArray, root: FloatArray, informed: float
) -> tuple[float, FloatArray, FloatArray, FloatArray]:
    """Log marginal likelihood, heights and their covariance for curves spanned by ``root`` (knots, r); and the root."""
    own, towards = root.T @ information @ root, root.T @ pull
    within = np.eye(len(own)) + own
    evidence = 0.5 * float(towards @ np.linalg.solve(within, towards)) - 0.5 * float(np.linalg.slogdet(within)[1])
    posterior = root @ np.linalg.inv(np.eye(len(own)) + informed * own) @ root.T
    return evidence, posterior @ (informed * pull), posterior, root


def better_left_out(model: ModelFit, with_formula: ModelFit, curve: FreeCurve, least: float = AS_GOOD) -> bool:
    """Whether a curve predicts tests that were left out better than a formula does, by more than the ``least`` number
    of standard errors of the difference; whole specimens are left out, or tests where there are few.

    ``model`` is the campaign without the law.
    """
    along = curve.columns @ curve.prior
    wider = model.setup.with_effects(along, np.ones(along.shape[2]))
    free = fit(wider, model.acting, start=replace(model, noise=with_formula.noise))
    specimen = model.setup.specimen
    fold = (specimen if model.setup.specimens > 2 else np.arange(len(specimen))) % FOLDS
    gained, se = gain_on_groups(with_formula, free, fold)
    return bool(gained > least * se)
