"""Other fits of the same tests: the law that held-out loads choose, the three-term law, a mixed model; and what T/N
varies with: load, speed, distance, cycle, temperature and every other number recorded for the tests."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribo.errors import FitError, Problem
from tribo.fitting.linear import (
    WEIGHTS,
    LinearFit,
    Rows,
    least_squares,
    levels_of,
    meant_to_be_one,
    sample_rows,
    weights_of,
)
from tribo.laws import LAWS, design_over_load, law_over_load
from tribo.records import REGIMES, FloatArray, Ingested, LawFit, Regime, Test
from tribo.vocabulary import label_with_unit

if TYPE_CHECKING:
    import pandas as pd


HERTZ = 2.0 / 3.0  # exponent of a single elastic contact: T = tau A with A as N^(2/3)
_FEWEST_LEVELS = 4
_ROUNDS = 4
_CONFIDENT = 1.96  # standard uncertainties of a 95 % interval
_AGREEMENT = 0.3  # standard uncertainties, and log-likelihood, by which two optimisers of a mixed model may differ
_SMALLEST_SHARE = 0.05  # of the median force, below which no fitted force sets a weight or a ratio
LAW_COLUMNS = ["sample", "regime", "law", "formula", "parameters", "a", "a_u", "b", "b_u", "held_out_percent",
               "se_percent", "loads", "chosen"]  # fmt: skip


@dataclass(frozen=True)
class Candidate:
    """A law T(N) with at most two ``parameters``, each with its unit; ``powers`` are the exponents of N its linear
    terms have. The power law has none: it is a line in logarithms.
    """

    name: str
    formula: str
    parameters: tuple[tuple[str, str], ...]
    powers: tuple[float, ...]


CANDIDATES = {
    law.name: law
    for law in (
        Candidate("constant", "T = T₀", (("T0", "N"),), (0.0,)),
        Candidate("proportional", "T = μ N", (("mu", ""),), (1.0,)),
        Candidate("hertz", "T = a N^(2/3)", (("a", ""),), (HERTZ,)),
        Candidate("linear", "T = μ N + T₀", (("mu", ""), ("T0", "N")), (1.0, 0.0)),
        Candidate("power", "T = a N^b", (("a", ""), ("b", "")), ()),
    )
}


def force_N(law: str, a: float, b: float, load_N: FloatArray) -> FloatArray:
    """T of a candidate by its name and parameters, N; loads (n,) in N."""
    if law == "power":
        return np.asarray(a * load_N**b)
    terms = zip((a, b), CANDIDATES[law].powers, strict=False)
    return np.asarray(sum(value * load_N**power for value, power in terms))


Fitted = tuple[FloatArray, FloatArray, Callable[[FloatArray], FloatArray]]


def fit_candidate(law: Candidate, load_N: FloatArray, force_N: FloatArray) -> Fitted:
    """Values and standard uncertainties of the parameters of a candidate, and its force at loads.

    Least squares of the relative deviations (constant relative scatter of T).
    """
    if not law.powers:
        return _power(load_N, force_N)
    design = np.column_stack([load_N**power for power in law.powers])
    expected = np.abs(force_N)
    floor = _SMALLEST_SHARE * float(np.median(expected))
    for _ in range(_ROUNDS):
        scale = np.maximum(expected, floor)
        values, u = _least_squares(design / scale[:, None], force_N / scale)
        expected = np.abs(design @ values)
    powers = np.array(law.powers)
    return values, u, lambda load: (load[:, None] ** powers) @ values


def _power(load_N: FloatArray, force_N: FloatArray) -> Fitted:
    there = force_N > 0
    design = np.column_stack([np.ones(there.sum()), np.log(load_N[there])])
    (log_a, b), (log_a_u, b_u) = _least_squares(design, np.log(force_N[there]))
    a = math.exp(log_a)
    return np.array([a, b]), np.array([a * log_a_u, b_u]), lambda load: a * load**b


def _least_squares(design: FloatArray, response: FloatArray) -> tuple[FloatArray, FloatArray]:
    values, *_ = np.linalg.lstsq(design, response, rcond=None)
    away = response - design @ values
    dof = max(len(response) - design.shape[1], 1)
    covariance = np.linalg.pinv(design.T @ design) * float(away @ away) / dof
    return np.asarray(values, float), np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)), float)


def compared_laws(table: pd.DataFrame) -> pd.DataFrame:
    """Every candidate of every sample and regime that was measured at four load levels or more, the chosen one marked.

    ``table`` is that of ``Ingested.table()``. The laws are fitted to the median force of each level, so that single
    odd tests do not decide. ``held_out_percent`` is the root mean square of ln T predicted over measured for the
    levels left out one after another, ``se_percent`` its standard error over the levels. Chosen is the law with the
    fewest parameters that is worse than the best by no more than one standard error (after Breiman et al. 1984,
    Classification and Regression Trees, section 3.4.3; here that of the difference, level by level); of equally many
    parameters, the one that deviates less. A law that is a special case of the best one (an exponent of 2/3, no
    intercept) is not chosen where the best one's own parameter excludes it with 95 % confidence.
    """
    import pandas as pd

    found = [row for regime in REGIMES for rows in sample_rows(table, regime) for row in _compared(rows, regime)]
    return pd.DataFrame(found, columns=LAW_COLUMNS)


def _compared(rows: Rows, regime: Regime) -> list[dict[str, object]]:
    rows = rows.take((rows.load_N > 0) & (rows.force_N > 0))
    load, force = _medians(rows)
    if load.size < _FEWEST_LEVELS or meant_to_be_one(load):
        return []
    squares = {name: _held_out(law, load, force) for name, law in CANDIDATES.items()}
    excluded = {name for name in squares if _rejected(name, _best(squares), load, force)}
    chosen = choose({name: found for name, found in squares.items() if name not in excluded})
    found = []
    for law in CANDIDATES.values():
        values, u, _ = fit_candidate(law, load, force)
        a, b = (*values, math.nan)[:2]
        a_u, b_u = (*u, math.nan)[:2]
        share, se = _root(squares[law.name])
        found.append(
            {"sample": rows.sample, "regime": regime, "law": law.name, "formula": law.formula,
             "parameters": len(law.parameters), "a": a, "a_u": a_u, "b": b, "b_u": b_u, "held_out_percent": 100 * share,
             "se_percent": 100 * se, "loads": load.size, "chosen": law.name == chosen}
        )  # fmt: skip
    return found


def _medians(rows: Rows) -> tuple[FloatArray, FloatArray]:
    """Each load level with the median of the forces measured there."""
    level = levels_of(rows.load_N) if len(rows) else rows.load_N
    loads = np.unique(level)
    return loads, np.array([float(np.median(rows.force_N[level == load])) for load in loads])


def _held_out(law: Candidate, load_N: FloatArray, force_N: FloatArray) -> FloatArray:
    """Square of ln T predicted over measured for each load, the law fitted to the other loads."""
    squares = []
    for k in range(load_N.size):
        others = np.arange(load_N.size) != k
        _, _, force_at = fit_candidate(law, load_N[others], force_N[others])
        predicted = float(force_at(load_N[k : k + 1])[0])
        squares.append(math.log(max(predicted / force_N[k], _SMALLEST_SHARE)) ** 2)
    return np.array(squares)


def _root(squares: FloatArray) -> tuple[float, float]:
    """Root of the mean of squares, and its standard error."""
    root = math.sqrt(float(np.mean(squares)))
    spread = float(np.std(squares, ddof=1)) / math.sqrt(len(squares))
    return root, spread / (2.0 * root) if root > 0 else 0.0


def _best(squares: dict[str, FloatArray]) -> str:
    return min(squares, key=lambda name: float(squares[name].mean()))


def _rejected(name: str, best: str, load_N: FloatArray, force_N: FloatArray) -> bool:
    """Whether a law is the best one with a parameter at a value that the best one excludes with 95 % confidence."""
    fixed = {("power", "constant"): (1, 0.0), ("power", "proportional"): (1, 1.0), ("power", "hertz"): (1, HERTZ),
             ("linear", "proportional"): (1, 0.0), ("linear", "constant"): (0, 0.0)}.get((best, name))  # fmt: skip
    if fixed is None:
        return False
    place, value = fixed
    values, u, _ = fit_candidate(CANDIDATES[best], load_N, force_N)
    return abs(float(values[place]) - value) > _CONFIDENT * float(u[place])


def choose(squares: dict[str, FloatArray]) -> str:
    """The simplest law that predicts the loads left out no worse than the best by one standard error.

    The standard error is that of the mean difference to the best law, level by level.
    """
    best = _best(squares)

    def no_worse(name: str) -> bool:
        away = squares[name] - squares[best]
        return float(away.mean()) <= float(away.std(ddof=1)) / math.sqrt(away.size)

    within = [name for name in squares if no_worse(name)]
    return min(within, key=lambda name: (len(CANDIDATES[name].parameters), float(squares[name].mean())))


THREE_TERM = LAWS["three_term"]


def fit_three_term(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float | None,
    area_fractions: Mapping[str, float],
    *,
    weights: str = "relative",
) -> LawFit:
    """T = mu N + (a AF + b) A, one mu, a and b for all samples; ``sample`` of the result is "all".

    A specimen has one area fraction, so that a and b cannot be separated; all pulls are fitted at once and the
    covariance comes from leaving out one specimen after the other (jackknife over specimens, dof = G minus 3
    parameters). A specimen name that occurs in several samples (pattern S pulled along x and along y) is one
    specimen. ``area_fractions`` maps each sample to its AF; samples it lacks take no part, with a note.
    ``chi2_red`` is the scatter of samples about the law over that of specimens about their samples.

    Raises
    ------
    FitError
        No nominal area, fewer than two area fractions or four specimens, or tests that cannot fix the law.
    """
    if nominal_area_m2 is None:
        raise FitError(Problem("no_area", "a and b are adhesion per area, and no nominal area is known"))
    samples = sample_rows(table, regime)
    used = [rows for rows in samples if rows.sample in area_fractions and len(rows)]
    unknown = [rows.sample for rows in samples if rows.sample not in area_fractions]
    notes = tuple(f"sample {sample} left out: area fraction not known" for sample in unknown)
    if len({area_fractions[rows.sample] for rows in used}) < 2:
        what = "a and b cannot be separated with one area fraction"
        raise FitError(Problem("too_few_samples", what, allowed="two or more area fractions"))
    design, force, weight, specimen = _stack(used, nominal_area_m2, area_fractions, weights)
    names = np.unique(specimen)
    if len(names) <= len(THREE_TERM.parameters):
        found, allowed = str(len(names)), f"more than {len(THREE_TERM.parameters)}"
        raise FitError(Problem("too_few_specimens", "too few specimens", found=found, allowed=allowed))
    if weights == "relative":
        weight = _relative_to_the_law(design, force, weight)
    whole = least_squares(design, force, weight)
    without = np.array([_without(design, force, weight, specimen == name).values for name in names])
    spread = without - without.mean(axis=0)
    return LawFit(
        "all", regime, THREE_TERM.name, THREE_TERM.parameter_names, whole.values,
        spread.T @ spread * (len(names) - 1) / len(names), float(len(names) - len(THREE_TERM.parameters)),
        len(names), len(force),
        f"all samples at once, jackknife over {len(names)} specimens; "
        f"weighted least squares, {WEIGHTS[weights]}",
        _misfit_of_samples(used, whole, specimen), nominal_area_m2, notes=notes,
    )  # fmt: skip


def _stack(
    used: list[Rows], area: float, area_fractions: Mapping[str, float], weights: str
) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray]:
    design = [THREE_TERM.design_matrix(rows.load_N, area, area_fractions[rows.sample]) for rows in used]
    weight = [weights_of(rows, area, weights) for rows in used]
    return (
        np.concatenate(design),
        np.concatenate([rows.force_N for rows in used]),
        np.concatenate(weight),
        np.concatenate([rows.specimen for rows in used]),
    )


def _relative_to_the_law(design: FloatArray, force: FloatArray, weight: FloatArray) -> FloatArray:
    """Weights 1/T^2 with T of the common law: a sample's own T would weigh lucky specimens less."""
    floor = _SMALLEST_SHARE * float(np.median(np.abs(force)))
    for _ in range(_ROUNDS):
        weight = np.maximum(np.abs(design @ least_squares(design, force, weight).values), floor) ** -2.0
    return weight


def _without(design: FloatArray, force: FloatArray, weight: FloatArray, out: np.ndarray) -> LinearFit:
    return least_squares(design[~out], force[~out], weight[~out])


def _misfit_of_samples(used: list[Rows], whole: LinearFit, specimen: np.ndarray) -> float:
    """F ratio of sample means to specimen means of the weighted residuals; NaN with one specimen per sample."""
    sample = np.concatenate([np.full(len(rows), k) for k, rows in enumerate(used)])
    own = np.array([f"{k}/{name}" for k, name in zip(sample, specimen, strict=True)])
    cells, index = np.unique(own, return_inverse=True)
    count = np.bincount(index)
    mean = np.bincount(index, whole.residuals) / count
    of_sample = np.bincount(index, sample).astype(int) // count
    total = np.bincount(of_sample, count * mean) / np.bincount(of_sample, count)
    dof_sample, dof_specimen = len(used) - 2, len(cells) - len(used)
    if dof_sample < 1 or dof_specimen < 1:
        return float("nan")
    between = float((np.bincount(of_sample, count) * total**2).sum()) / dof_sample
    within = float((count * (mean - total[of_sample]) ** 2).sum()) / dof_specimen
    return between / within if within > 0 else float("nan")


def mixed_model(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float | None,
    *,
    weights: str = "relative",
) -> LawFit | None:
    """One sample's T = mu N + tau0 A with random mu and tau0 per specimen (statsmodels MixedLM, REML).

    ``table`` holds the rows of one sample. None where the fit does not converge, as with two or three
    specimens it often does not. Its intervals are those of statsmodels, normal (dof infinite): with few
    specimens they are too narrow (docs/results/interval-coverage.md), so this fit is not the default.
    What statsmodels warned of is in ``notes``.

    Raises
    ------
    FitError
        More than one sample, missing columns or impossible loads.
    """
    samples = sample_rows(table, regime)
    if len(samples) != 1:
        what = "a mixed model can be fitted to one sample only"
        raise FitError(Problem("one_sample", what, found=f"{len(samples)} samples"))
    rows = samples[0]
    if len(rows.specimens) < 2 or len(np.unique(rows.load_N)) < 2:
        return None
    root = np.sqrt(weights_of(rows, nominal_area_m2, weights))
    scale = np.array([1.0, 1e3])  # tau0 in kPa keeps the random effects of comparable size
    design = design_over_load(rows.load_N, nominal_area_m2) * scale * root[:, None]
    found = _reml(rows.force_N * root, design, rows.specimen)
    if found is None:
        return None
    values, covariance, warned = found
    law = law_over_load(nominal_area_m2)
    return LawFit(
        rows.sample, regime, law.name, law.parameter_names, values * scale,
        covariance * np.outer(scale, scale), float("inf"), len(rows.specimens), len(rows),
        f"MixedLM, random mu and tau0 per specimen, REML; {WEIGHTS[weights]}",
        float("nan"), nominal_area_m2, notes=warned,
    )  # fmt: skip


def _reml(
    response: np.ndarray, design: np.ndarray, specimen: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]] | None:
    """Values, covariance and warnings of a fit that two optimisers agree on; None where they do not.

    Whether one optimiser reports that it converged depends on the last bits, and with them on the processor. That two
    agree does not: they differ by far more or far less than :data:`_AGREEMENT`.
    """
    from statsmodels.regression.mixed_linear_model import MixedLM

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            model = MixedLM(response, design, specimen, exog_re=design)
            result = model.fit(reml=True, method=["bfgs"])
            warned = [str(w.message) for w in caught]
            other = model.fit(reml=True, method=["lbfgs"])
        except (np.linalg.LinAlgError, ValueError):
            return None
    covariance = np.asarray(result.cov_params())[:2, :2]
    if not np.isfinite(covariance).all() or (np.diag(covariance) <= 0).any():
        return None
    apart = np.abs(np.asarray(result.fe_params) - np.asarray(other.fe_params)) / np.sqrt(np.diag(covariance))
    if not (apart < _AGREEMENT).all() or not abs(result.llf - other.llf) < _AGREEMENT:
        return None
    warned = [text for text in warned if "optimization failed" not in text and "etrying" not in text]
    return np.asarray(result.fe_params), covariance, tuple(dict.fromkeys(warned))


VARIABLES = (
    "normal_load_N", "speed_mm_s", "hold_s", "run_order", "specimen_run", "repeat", "temperature_C", "humidity_pct",
)  # fmt: skip
SPEED = "speed_mm_s"
DEPENDENCE_COLUMNS = ["sample", "regime", "variable", "label", "n", "low", "high", "change_percent",
                      "change_u_percent", "rank", "p", "p_adjusted", "inseparable_from"]  # fmt: skip
NOMINAL_LOAD = "nominal_load_N"  # the load by another name, beside the one that was recorded
SAME_COLUMN = 0.95  # rank correlation of two variables from which on their effects cannot be separated
ONE_SPEED = 1.05  # largest over smallest speed up to which tests were made at one
_FEWEST = 5
_FEWEST_VALUES = 2
_ROUNDING = 1e-9  # of a correlation of ranks: that of nine pairs may be 0.95 exactly


def test_values(test: Test) -> dict[str, float]:
    """Every number recorded for a test, by name."""
    found = {name: getattr(test, name) for name in VARIABLES if name != SPEED}
    found[SPEED] = None if test.speed_m_s is None else 1e3 * test.speed_m_s
    for name, cell in test.covariates.items():
        if name == NOMINAL_LOAD:
            continue
        try:
            found[name] = float(str(cell).replace(",", "."))
        except ValueError:
            continue
    return {name: float(value) for name, value in found.items() if value is not None and np.isfinite(value)}


def measured_points(ingested: Ingested) -> pd.DataFrame:
    """T/N of every test and regime with all numbers recorded for it, one row each."""
    import pandas as pd

    rows = []
    for test in ingested.campaign.tests:
        pull = ingested.pulls.get(test.test_id)
        if pull is None or not test.normal_load_N > 0:
            continue
        for regime in REGIMES:
            force, u = getattr(pull, f"{regime}_N"), getattr(pull, f"{regime}_u_N")
            if np.isfinite(force):
                known = {"test_id": test.test_id, "sample": test.sample, "regime": regime}
                ratio = {"T_over_N": force / test.normal_load_N, "T_over_N_u": u / test.normal_load_N, "T_N": force}
                rows.append({**test_values(test), **known, **ratio})
    return pd.DataFrame(rows)


def variables_of(points: pd.DataFrame) -> list[str]:
    """The recorded variables that take more than one value, load first."""
    said = ("test_id", "sample", "regime", "T_over_N", "T_over_N_u", "T_N")
    return [
        name for name in (*VARIABLES, *(c for c in points.columns if c not in VARIABLES and c not in said))
        if name in points.columns and points[name].nunique() >= _FEWEST_VALUES
        and not (name == SPEED and is_one_level(points[name].to_numpy(float)))
    ]  # fmt: skip


def is_one_level(speeds: FloatArray) -> bool:
    """Whether recorded speeds are those of one drive that was set once: a tachometer is no better than that."""
    known = speeds[np.isfinite(speeds) & (speeds > 0)]
    return bool(known.size and known.max() <= ONE_SPEED * known.min())


def dependence(ingested: Ingested) -> pd.DataFrame:
    """Change of T/N over the range of each variable (percent, straight line in ln T/N), and its rank correlation.

    ``p_adjusted`` is Holm's adjustment over all rows. ``inseparable_from`` names variables whose rank correlation with
    this one, over the same tests, is 0.95 or more: their effects cannot be separated by these data.
    """
    import pandas as pd

    points = measured_points(ingested)
    found = []
    of_tests: dict[tuple[str, ...], NDArray[np.bool_]] = {}  # the same in both regimes
    for (sample, regime), part in points.groupby(["sample", "regime"], sort=False) if len(points) else ():
        names, tests = variables_of(part), tuple(part["test_id"])
        if (together := of_tests.get(tests)) is None:
            together = of_tests[tests] = _together(part[names].to_numpy(float))
        for name, with_others in zip(names, together, strict=True):
            row = _one(part, name)
            if row:
                others = tuple(o for o, same in zip(names, with_others, strict=True) if same)
                found.append({"sample": sample, "regime": regime, **row, "inseparable_from": others})
    table = pd.DataFrame(found, columns=DEPENDENCE_COLUMNS)
    return table.assign(p_adjusted=_holm(table["p"].to_numpy(float)))


def _one(part: pd.DataFrame, name: str) -> dict[str, object]:
    from scipy.stats import linregress, spearmanr

    known = part[np.isfinite(part[name]) & (part["T_over_N"] > 0)]
    if len(known) < _FEWEST or known[name].nunique() < _FEWEST_VALUES or known["T_over_N"].nunique() < _FEWEST_VALUES:
        return {}
    x, y = known[name].to_numpy(float), np.log(known["T_over_N"].to_numpy(float))
    line, rank = linregress(x, y), spearmanr(x, y)
    span = float(np.ptp(x))
    return {
        "variable": name, "label": label_with_unit(name), "n": len(known), "low": float(x.min()),
        "high": float(x.max()), "change_percent": 100 * float(np.expm1(line.slope * span)),
        "change_u_percent": 100 * float(line.stderr * span), "rank": float(rank.statistic), "p": float(rank.pvalue),
    }  # fmt: skip


def _together(values: FloatArray) -> NDArray[np.bool_]:
    """Which columns of ``values`` (n, k) cannot be separated, (k, k): by their ranks where both are known."""
    from scipy.stats import rankdata

    known = np.isfinite(values)
    masks, mask_of = np.unique(known, axis=1, return_inverse=True)
    mask_of = mask_of.reshape(-1)
    together = np.zeros((values.shape[1],) * 2, bool)
    for one, other in combinations_with_replacement(range(masks.shape[1]), 2):
        both = masks[:, one] & masks[:, other]
        if both.sum() < _FEWEST:
            continue
        columns = np.flatnonzero((mask_of == one) | (mask_of == other))
        ranks = rankdata(values[np.ix_(both, columns)], axis=0)
        ranks -= ranks.mean(axis=0)
        length = np.sqrt(np.sum(ranks**2, axis=0))
        there = length > 0
        columns, unit = columns[there], ranks[:, there] / length[there]
        alike = np.abs(unit.T @ unit) >= SAME_COLUMN - _ROUNDING
        first, second = mask_of[columns] == one, mask_of[columns] == other
        pairs = np.outer(first, second) | np.outer(second, first)
        together[np.ix_(columns, columns)] |= alike & pairs
    np.fill_diagonal(together, False)
    return together


def _holm(p: FloatArray) -> FloatArray:
    """Holm's adjusted p values (Scand. J. Stat. 6 (1979) 65)."""
    order = np.argsort(p)
    steps = np.maximum.accumulate(p[order] * (len(p) - np.arange(len(p))))
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(steps, 1.0)
    return adjusted
