"""Laws as curves: how friction follows a column with no formula in mind, by a Gaussian process, with its band.

A curve is held at knots along the column. It is uncertain by what the campaign leaves open, averaged over how large,
how smooth and how fast it may be (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and
5). A formula that is only nearly right has such a curve beside it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.inference import gain_on_groups
from tribo.lawsearch.grammar import MOST_VALUES, PRESSURES, WIDE, Shape, WrittenLaw, recorded_values
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

KNOTS = 25
LENGTHS = (0.07, 0.15, 0.3, 0.6)  # over which a curve changes, in shares of the range of the column
SIZES = np.geomspace(0.005, 0.5, 9)  # standard deviation of a curve, in ln T
FREE = 3.0  # standard deviation of the amplitude of a formula
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
    spaced = np.geomspace if low > 0 and high / low > WIDE else np.linspace
    places = tuple(float(p) for p in spaced(low, high, KNOTS))
    return Shape("curve", column, low, high, values=(low, *places[1:-1], high), heights=(0.0,) * KNOTS)


@dataclass(frozen=True)
class FreeCurve:
    """A curve in one scope of laws, known from a campaign.

    ``columns`` (n, 2, k) of ln T are those of a formula, if there is one beside it, and of the curve at each knot;
    ``value`` (k,) and ``covariance`` (k, k) are what the campaign tells of their coefficients, ``prior`` (knots, r)
    spans the curves that are likely, and ``evidence`` is the log of the marginal likelihood over none.
    """

    law: WrittenLaw
    columns: FloatArray
    value: FloatArray
    covariance: FloatArray
    prior: FloatArray
    evidence: float

    @property
    def heights(self) -> FloatArray:
        """ln T at the knots where the law acts fully, about a mean of zero over its tests, without the formula."""
        return self.value[-KNOTS:]


def at_knots(shape: Shape, c: Conditions) -> FloatArray:
    """The courses (n, knots) that a curve is made of, each one at its knot and zero at the others."""
    each = np.eye(KNOTS)
    return np.column_stack([replace(shape, heights=tuple(row)).of(c)[:, 0] for row in each])


def fitted_curve(
    without: ModelFit, scope: tuple[WrittenLaw, FloatArray], shape: Shape, informed: float, formula: Shape | None = None
) -> FreeCurve:
    """The curve that a campaign tells of, ``without`` being its fit without the law.

    Parameters
    ----------
    without : ModelFit
        With the noise at which it is told, and the residual.
    scope : (WrittenLaw, array (n, 2))
        What it acts on, and by how much it changes ln T of every test there.
    shape : Shape
        From :func:`curve_of`.
    informed : float
        Of the information in the weighted normal equations, what a pull really tells.
    formula : Shape, optional
        The course that the curve is added to.
    """
    law, effects = scope
    c = without.setup.observations.conditions
    courses = at_knots(shape, c)
    acts = np.abs(law.weight(c))
    courses = courses - acts @ courses / acts.sum()
    if formula is not None:
        courses = np.column_stack([formula.of(c), courses])
    columns = courses[:, None, :] * effects[:, :, None]
    rows, residual = without.cleared(columns)
    information, pull = rows.T @ rows, rows.T @ residual
    place = np.linspace(0.0, 1.0, KNOTS)
    apart = np.abs(place[:, None] - place)
    found = []
    for length in LENGTHS:
        near = apart / length
        for kernel in (np.exp(-0.5 * near**2), (1.0 + np.sqrt(3.0) * near) * np.exp(-np.sqrt(3.0) * near)):
            variance, directions = np.linalg.eigh(kernel)
            kept = variance > FLAT_BELOW * variance[-1]
            root = directions[:, kept] * np.sqrt(variance[kept])
            found += [_member(information, pull, size * root, informed) for size in SIZES]
    evidence = np.array([member[0] for member in found])
    share = np.exp(evidence - evidence.max())
    share = share / share.sum()
    value = np.sum([w * member[1] for w, member in zip(share, found, strict=True)], axis=0)
    spread = sum(
        w * (member[2] + np.outer(member[1] - value, member[1] - value)) for w, member in zip(share, found, strict=True)
    )
    likely = sum(w * member[3] @ member[3].T for w, member in zip(share, found, strict=True))
    variance, directions = np.linalg.eigh(likely)
    kept = variance > FLAT_BELOW * variance[-1]
    prior = directions[:, kept] * np.sqrt(variance[kept])
    mean = float(evidence.max() + np.log(np.mean(np.exp(evidence - evidence.max()))))
    return FreeCurve(law, columns, value, np.asarray(spread), prior, mean)


def _member(
    information: FloatArray, pull: FloatArray, root: FloatArray, informed: float
) -> tuple[float, FloatArray, FloatArray, FloatArray]:
    """Log marginal likelihood, coefficients and their covariance for curves spanned by ``root`` (knots, r); and the
    root."""
    k = len(information) - len(root)
    basis = np.zeros((len(information), k + root.shape[1]))
    basis[:k, :k] = FREE * np.eye(k)
    basis[k:, k:] = root
    own, towards = basis.T @ information @ basis, basis.T @ pull
    within = np.eye(len(own)) + own
    evidence = 0.5 * float(towards @ np.linalg.solve(within, towards)) - 0.5 * float(np.linalg.slogdet(within)[1])
    posterior = basis @ np.linalg.inv(np.eye(len(own)) + informed * own) @ basis.T
    return evidence, posterior @ (informed * pull), posterior, root


def better_left_out(model: ModelFit, with_formula: ModelFit, curve: FreeCurve) -> bool:
    """Whether a curve predicts tests that were left out better than a formula does, beyond the error of the difference;
    whole specimens are left out, or tests where there are few.

    ``model`` is the campaign without the law.
    """
    along = curve.columns @ curve.prior
    wider = model.setup.with_effects(along, np.ones(along.shape[2]))
    free = fit(wider, model.acting, start=replace(model, noise=with_formula.noise))
    specimen = model.setup.specimen
    fold = (specimen if model.setup.specimens > 2 else np.arange(len(specimen))) % FOLDS
    gained, se = gain_on_groups(with_formula, free, fold)
    return bool(gained > AS_GOOD * se)
