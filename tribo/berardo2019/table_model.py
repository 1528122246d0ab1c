"""The diagnosis of a published table: mu and tau0 with their standard deviations, and nothing else.

A line T/N = mu + tau0/p was fitted by the authors; its two numbers trade off, and their covariance is not printed. So
the table is read as T at loads over the range of the paper, under a stated correlation of mu and tau0, and every
statement is repeated for others. The model is that of :mod:`tribo.diagnostics.model` on means instead of pulls:

    (mu, tau0) of a sample = line through [m mu_F p + a tau0_F] x mechanism x error of the simulation + error of the fit

with the flat law free (four numbers), the shares m and a from a simulated table, the errors normal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnostics.contrasts import FORM
from tribo.diagnostics.model import Acting
from tribo.diagnostics.predictor import error_sizes
from tribo.diagnostics.verdict import Estimate
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Base, Conditions, Mechanism
from tribo.records import REGIMES, FloatArray
from tribo.springblock.lattice import PAPER_PATTERNS

if TYPE_CHECKING:
    import pandas as pd


RANGE_PA = (3e3, 25e3)  # Berardo 2019, Model parameters
N_LOADS = 12
NOMINAL_AREA_M2 = 55e-6  # 140 g make 25 kPa
NORMAL_90 = 1.645


@dataclass(frozen=True)
class PublishedTable:
    """A published table as the diagnosis uses it: rows are samples, then regimes; (mu, tau0 in kPa) of each.

    ``values`` and the covariance have 2 x regimes x samples entries in the order sample, regime, (mu, tau0);
    ``shares`` (samples, 4) are those of a simulated table over its own flat sample; ``conditions`` holds every
    sample at every load; ``line`` (2, loads) makes (mu, tau0) of T/N at the loads.
    """

    samples: tuple[str, ...]
    pressures_Pa: FloatArray
    conditions: Conditions
    shares: FloatArray
    values: FloatArray
    data_covariance: FloatArray
    line: FloatArray

    @property
    def pressures_kPa(self) -> FloatArray:
        return self.pressures_Pa / 1e3

    def friction(self, values: FloatArray) -> FloatArray:
        """T/N of lines (samples, regimes, 2) at the loads, shape (samples, regimes, loads)."""
        lines = values.reshape(-1, len(REGIMES), 2)
        return np.asarray(lines[..., :1] + lines[..., 1:] / self.pressures_kPa)


@dataclass(frozen=True)
class TableFit:
    """A model fitted to a table. ``law`` = (mu, tau0 kPa) static, then sliding, of the flat sample.

    ``gain`` is the log likelihood that its mechanism earns over the fit without any, net of its freedom.
    """

    table: PublishedTable
    acting: tuple[Acting, ...]
    law: FloatArray
    parameters: tuple[FloatArray, ...]
    covariance: FloatArray  # of law and parameters
    root: FloatArray  # lower Cholesky factor of the covariance of the values
    predicted: FloatArray
    gain: float = 0.0

    @property
    def mechanism(self) -> Mechanism:
        """The first that acts."""
        return self.acting[0].mechanism

    @property
    def name(self) -> str:
        return self.mechanism.name

    @property
    def residual(self) -> FloatArray:
        """Whitened."""
        return np.asarray(np.linalg.solve(self.root, self.table.values - self.predicted), float)

    @property
    def score(self) -> float:
        """Log likelihood up to a constant."""
        return float(-0.5 * self.residual @ self.residual)


def design_correlation(pressures_Pa: FloatArray) -> float:
    """Correlation of mu and tau0 of an unweighted line T/N = mu + tau0/p: minus the mean of 1/p over its rms."""
    x = 1.0 / np.asarray(pressures_Pa, float)
    return float(-x.mean() / np.sqrt(np.mean(x**2)))


def even_loads() -> FloatArray:
    """Loads evenly over the range of the paper, which does not list its own, Pa."""
    return np.linspace(*RANGE_PA, N_LOADS)


def read_table(
    measured: pd.DataFrame, simulated: pd.DataFrame, correlation: float, specimens: int = 1
) -> PublishedTable:
    """The table of a paper against a simulated one.

    Parameters
    ----------
    measured : columns sample, regime, mu, mu_sd, tau0_kPa, tau0_sd_kPa
    simulated : the same without standard deviations; the samples of the paper, F among them
    correlation : of the errors of mu and tau0 of one fit
    specimens : the printed standard deviations are those of the mean (1), or of so many specimens
    """
    samples = tuple(dict.fromkeys(measured["sample"]))
    rows = measured.set_index(["sample", "regime"])
    order = [(s, r) for s in samples for r in REGIMES]
    covariance = np.zeros((2 * len(order), 2 * len(order)))
    for k, key in enumerate(order):
        a, b = float(rows.loc[key, "mu_sd"]), float(rows.loc[key, "tau0_sd_kPa"])
        block = np.array([[a * a, correlation * a * b], [correlation * a * b, b * b]]) / specimens
        covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = block
    loads = even_loads()
    model = simulated.set_index(["sample", "regime"])[["mu", "tau0_kPa"]]
    laws = np.array([[model.loc[(s, r)].to_numpy(float) for r in REGIMES] for s in samples]).reshape(-1, 4)
    design = np.column_stack([np.ones(N_LOADS), 1e3 / loads])
    return PublishedTable(
        samples, loads, _conditions(samples, loads), laws / laws[samples.index("F")],
        np.array([rows.loc[key, ["mu", "tau0_kPa"]].to_numpy(float) for key in order]).ravel(),
        covariance, np.linalg.pinv(design),
    )  # fmt: skip


def _conditions(samples: Sequence[str], loads_Pa: FloatArray) -> Conditions:
    """Every sample at every load, samples first; speed, hold and environment are the same."""
    patterns = [PAPER_PATTERNS[s if s in PAPER_PATTERNS else s[:-1]] for s in samples]
    n, m = len(samples), len(loads_Pa)

    def each(values: list[float]) -> FloatArray:
        return np.repeat(np.array(values, float), m)

    unknown = np.full(n * m, np.nan)
    long = [np.log(p.size_m[0] / p.size_m[1]) * {"x": 1, "y": -1}.get(s[-1], 0) if p.size_m else 0.0
            for s, p in zip(samples, patterns, strict=True)]  # fmt: skip
    return Conditions(
        normal_load_N=np.tile(loads_Pa, n) * NOMINAL_AREA_M2, nominal_area_m2=NOMINAL_AREA_M2,
        area_fraction=each([p.area_fraction for p in patterns]), rim_per_m=each([p.rim_per_m for p in patterns]),
        cavity_width_m=each([min(p.size_m) if p.size_m else 0.0 for p in patterns]), elongation=each(long),
        sample=np.repeat(np.array(samples, str), m), specimen=np.repeat(np.array(samples, str), m),
        speed_m_s=np.full(n * m, 2e-4), hold_s=unknown, specimen_run=unknown, run_order=unknown, elapsed_s=unknown,
        temperature_C=unknown, humidity_pct=unknown, clip_N=np.zeros(n * m),
        pattern=np.repeat(np.array([p.name for p in patterns], str), m),
    )  # fmt: skip


def predict_table(
    table: PublishedTable, law: FloatArray, acting: Sequence[Acting] = (), parameters: Sequence[FloatArray] = ()
) -> FloatArray:
    """(mu, tau0) of every sample and regime: the line through the model's T/N at the loads."""
    return np.asarray(friction_at(table, law, acting, parameters) @ table.line.T).ravel()


def friction_at(
    table: PublishedTable, law: FloatArray, acting: Sequence[Acting] = (), parameters: Sequence[FloatArray] = ()
) -> FloatArray:
    """T/N of the model, (samples, regimes, loads). Several mechanisms multiply their changes."""
    c = table.conditions
    base = _base(table, law)
    before = base.forces(c.normal_load_N)
    plain = np.stack([before.static_N, before.sliding_N])
    total = plain.copy()
    for a, v in zip(acting, parameters, strict=True):
        after = a.mechanism.law(v, base, c, a.choice)
        total = total * np.stack([after.static_N, after.sliding_N]) / plain
    shaped = (total / c.normal_load_N).reshape(len(REGIMES), len(table.samples), -1)
    return np.asarray(np.swapaxes(shaped, 0, 1))


def _base(table: PublishedTable, law: FloatArray) -> Base:
    flat = np.array([law[0], law[1] * 1e3 * NOMINAL_AREA_M2, law[2], law[3] * 1e3 * NOMINAL_AREA_M2])
    rows = table.shares * flat
    by_sample = {
        s: (float(r[0]), float(r[1]), float(r[2]), float(r[3])) for s, r in zip(table.samples, rows, strict=True)
    }
    spread = np.repeat(rows, len(table.pressures_Pa), axis=0)
    return Base(spread[:, 0], spread[:, 1], spread[:, 2], spread[:, 3], by_sample=by_sample, flat="F")


def model_covariance(table: PublishedTable, friction: FloatArray, change: FloatArray | None = None) -> FloatArray:
    """Covariance of (mu, tau0) by the simulation's own error: offset and slope in ln T of each pattern and regime.

    ``change`` (samples, regimes, loads), the change of ln T by mechanisms, adds their error of form.
    """
    log_p = np.log(table.pressures_Pa / np.sqrt(np.prod(RANGE_PA)))
    size = len(table.values)
    error = error_sizes()["total"]
    total = np.zeros((size, size))
    for i, sample in enumerate(table.samples):
        for r in range(len(REGIMES)):
            shapes = [] if sample == "F" else [np.full_like(log_p, error.offset[r]), error.slope[r] * log_p]
            if change is not None:
                shapes += [FORM * change[i, r], FORM * change[i, r] * log_p]
            at = slice(2 * (2 * i + r), 2 * (2 * i + r) + 2)
            for shape in shapes:
                moved = table.line @ (friction[i, r] * shape)
                total[at, at] += np.outer(moved, moved)
    return total


def fit_table(
    table: PublishedTable, acting: Sequence[Acting] = (), root: FloatArray | None = None, keep: np.ndarray | None = None
) -> TableFit:
    """Flat law and mechanisms by least squares in units of the errors; ``keep`` picks the values that count."""
    from scipy.optimize import least_squares

    law0 = table.values.reshape(-1, 4)[table.samples.index("F")]
    own = model_covariance(table, friction_at(table, law0))
    factor = np.linalg.cholesky(table.data_covariance + own) if root is None else root
    kept = np.ones(len(table.values), bool) if keep is None else keep
    part = np.linalg.cholesky((factor @ factor.T)[np.ix_(kept, kept)])
    sizes = [len(a.mechanism.parameters) for a in acting]
    low = np.concatenate([np.array([0.01, -50.0] * 2), *(a.mechanism.bounds()[0] for a in acting)])
    high = np.concatenate([np.array([50.0, 200.0] * 2), *(a.mechanism.bounds()[1] for a in acting)])

    def whitened(x: FloatArray) -> FloatArray:
        left = table.values - predict_table(table, x[:4], acting, _split(x, sizes))
        return np.asarray(np.linalg.solve(part, left[kept]))

    inside = 1e-6 * (high - low)
    starts = [np.clip(np.concatenate([law0, *start]), low + inside, high - inside) for start in _starts(acting)]
    found = [least_squares(whitened, x, bounds=(low, high), x_scale=np.abs(x)) for x in starts]
    best = min(found, key=lambda f: float(f.cost))
    x, inverse = best.x, np.linalg.pinv(best.jac.T @ best.jac, rcond=1e-14)
    predicted = predict_table(table, x[:4], acting, _split(x, sizes))
    root = np.asarray(factor, float)
    return TableFit(table, tuple(acting), x[:4], tuple(_split(x, sizes)), inverse, root, predicted)


def _starts(acting: Sequence[Acting]) -> list[list[FloatArray]]:
    """A small and a clear effect of every mechanism, in both signs where both occur."""
    each = []
    for a in acting:
        values = a.mechanism.start()
        factors = (0.1, 1.0, -0.5) if a.mechanism.amplitude.low < 0 else (0.1, 1.0)
        tries = [values * np.array([f, *np.ones(len(values) - 1)]) for f in factors]
        further = a.mechanism.parameters[1].tries if len(values) > 1 else ()
        tries += [np.array([values[0], p, *values[2:]]) for p in further]
        each.append(tries)
    return [list(values) for values in product(*each)]


def _split(x: FloatArray, sizes: Sequence[int]) -> list[FloatArray]:
    return list(np.split(x[4:], np.cumsum(sizes)[:-1])) if sizes else []


def candidates_of(table: PublishedTable) -> list[Acting]:
    """Every mechanism and choice that could show in a table of means."""
    base = _base(table, table.values.reshape(-1, 4)[table.samples.index("F")])
    found = []
    for m in MECHANISMS.values():
        if m.in_table.missing or m.in_table.barred or not m.changes_forces or not m.applies(table.conditions):
            continue
        found += [Acting(m, str(choice)) for choice in m.choices(base, table.conditions)]
    return found


def estimate_of(f: TableFit) -> dict[str, Estimate]:
    """Parameters with 90 % intervals, kept inside their bounds."""
    found = {}
    for k, p in enumerate(f.mechanism.parameters):
        half = NORMAL_90 * float(np.sqrt(max(f.covariance[4 + k, 4 + k], 0.0)))
        value = float(f.parameters[0][k])
        found[p.name] = Estimate(value, max(value - half, p.low), min(value + half, p.high), p.unit)
    return found


def upper_limit(baseline: TableFit, name: str, drop: float = 1.353) -> float:
    """Largest amplitude within ``drop`` of the best log likelihood (95 % one-sided), the flat law fitted anew and
    further parameters at their start."""
    from scipy.optimize import brentq, least_squares

    table, acting = baseline.table, Acting(MECHANISMS[name])
    p = acting.mechanism.amplitude
    best = fit_table(table, (acting,), baseline.root)

    def excess(value: float) -> float:
        values = acting.mechanism.start()
        values[0] = value

        def whitened(x: FloatArray) -> FloatArray:
            left = table.values - predict_table(table, x, (acting,), (values,))
            return np.asarray(np.linalg.solve(baseline.root, left))

        left = whitened(least_squares(whitened, baseline.law).x)
        return best.score - float(-0.5 * left @ left) - drop

    start = float(best.parameters[0][0])
    return p.high if excess(p.high) < 0 else float(brentq(excess, start, p.high, xtol=1e-4 * p.start))
