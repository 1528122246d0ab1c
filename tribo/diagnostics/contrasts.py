"""Contrasts of the residuals: by mechanism, covariate, shape, sample, specimen and period.

How strongly each contrast is followed, and how strongly by chance: the maximum over all contrasts, simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.model import (
    MOST_PAIRS,
    Acting,
    Course,
    Setup,
    StartChanges,
    added,
    course,
    start_changes,
    with_form_error,
)
from tribo.diagnostics.replicates import Replicates, as_measured, drawn_residuals, refit
from tribo.diagnostics.score_statistics import Terms, scores, terms_of
from tribo.display import displayed
from tribo.records import FloatArray

OBSERVABLES = {"static": (1.0, 0.0), "sliding": (0.0, 1.0), "both": (1.0, 1.0), "drop": (1.0, -1.0)}
BINS = 6
TENTHS = 10
BEND, BY_LOAD = "bend", "by load"  # details of the curve of a sample, the slope of a specimen
MOST_LEVELS = 200  # names of a text column: the work grows with their cube
CYCLES = 24  # periods down to a twenty-fourth of the series


@displayed()
@dataclass(frozen=True)
class Contrast:
    """One contrast: an observable against a covariate, and the columns it would follow: those of one course, or of
    two that add up, on different specimens.

    ``detail`` is the part of the covariate: BEND, BY_LOAD, "period 12.5" or "from 20 to 40".
    """

    kind: str  # mechanism, trend, shape, level, sample, specimen, period, block
    observable: str
    covariate: str
    sample: str
    courses: tuple[Course, ...]
    acting: Acting | None = None
    detail: str = ""

    @property
    def title(self) -> str:
        """The covariate with its detail."""
        between = " " if self.detail == BY_LOAD else ", "
        return f"{self.covariate}{between}{self.detail}" if self.detail else self.covariate

    @property
    def column(self) -> str:
        """The column that it follows; of a mechanism the columns it needs."""
        if self.acting is not None:
            return self.acting.mechanism.column(self.acting.choice)
        return self.title if self.kind == "specimen" else self.covariate

    @property
    def columns(self) -> FloatArray:
        """(n, 2, d)."""
        return added(self.courses)

    def is_taken_up(self, flat: str) -> bool:
        """Whether calibrating on the sample ``flat`` removes this: the level of its force, and its slope with load."""
        return self.kind == "sample" and self.sample == flat and self.detail != BEND

    @property
    def about_one(self) -> float:
        """Precision with which its coefficient is known to be one: of a mechanism that is present as a whole."""
        sd = self.acting.mechanism.choosing.all_or_nothing_sd if self.acting is not None else None
        return 0.0 if sd is None else sd**-2.0

    @property
    def freedom(self) -> int:
        return self.courses[0].freedom


def all_contrasts(s: Setup, changes: StartChanges) -> list[Contrast]:
    """Every contrast that this design allows, ``changes`` being those of the candidates."""
    recorded = [*_covariates(s), *_levels(s), *_samples(s), *_specimens(s), *_periods(s), *_blocks(s)]
    contrasts = [*_mechanisms(s, changes), *recorded]
    return [contrast for contrast in contrasts if all(c.shows for c in contrast.courses)]


def _mechanisms(s: Setup, changes: StartChanges) -> Iterator[Contrast]:
    for acting, courses in zip(changes.acting, changes.courses, strict=True):
        yield Contrast("mechanism", "both", acting.name, "", courses, acting)
    yield Contrast("trend", "both", "tau0", "", _course(s, changes.adhesion[:, :, None]))


def _course(s: Setup, columns: FloatArray) -> tuple[Course]:
    return (course(columns, s.random_effects),)


def numeric_covariates(s: Setup) -> dict[str, FloatArray]:
    """Recorded numbers a residual may follow, standardised; only those that vary and are complete."""
    c = s.observations.conditions
    numbers = {
        "run_order": c.run_order,
        "specimen_run": c.specimen_run,
        "started_at": c.elapsed_s,
        "time of day": s.observations.clock_h,
        "temperature_C": c.temperature_C,
        "humidity_pct": c.humidity_pct,
        "speed_mm_s": _log(c.speed_m_s),
        "hold_s": _log(c.hold_s),
    }
    for name, column in c.columns.items():
        numbers.setdefault(name, _maybe_numbers(column))
    return {n: (v - v.mean()) / v.std() for n, v in numbers.items() if np.isfinite(v).all() and v.std() > 1e-9}


def _log(values: FloatArray) -> FloatArray:
    return np.log(np.where(values > 0, values, np.nan))


def _maybe_numbers(column: np.ndarray) -> FloatArray:
    try:
        return np.asarray(column, float)
    except ValueError:
        return np.full(len(column), np.nan)


def _spread(values: FloatArray, observable: str) -> FloatArray:
    """Columns (n, d) onto the two regimes, (n, 2, d)."""
    return values[:, None, :] * np.array(OBSERVABLES[observable])[None, :, None]


def _covariates(s: Setup) -> Iterator[Contrast]:
    for name, values in numeric_covariates(s).items():
        for observable in OBSERVABLES:
            yield Contrast("trend", observable, name, "", _course(s, _spread(values[:, None], observable)))
        bins = _bins(values)
        if bins.shape[1] > 1:
            for observable in ("static", "sliding", "both"):
                yield Contrast("shape", observable, name, "", _course(s, _spread(bins, observable)))


def _bins(values: FloatArray) -> FloatArray:
    """Indicator columns of up to BINS groups of alike size, less one."""
    distinct = np.unique(values)
    edges = distinct[1:] if len(distinct) <= BINS else np.unique(np.quantile(values, np.arange(1, BINS) / BINS))
    code = np.searchsorted(edges, values, side="right")
    return np.column_stack([code == k for k in range(1, len(edges) + 1)]).astype(float)


def _levels(s: Setup) -> Iterator[Contrast]:
    """Text columns: one gain per name."""
    for name, column in s.observations.conditions.columns.items():
        names = np.unique(column)
        if 1 < len(names) <= min(s.observations.n // 8, MOST_LEVELS):
            levels = np.column_stack([column == level for level in names[1:]]).astype(float)
            for observable in ("static", "sliding", "both"):
                yield Contrast("level", observable, name, "", _course(s, _spread(levels, observable)))


def _samples(s: Setup) -> Iterator[Contrast]:
    """Each sample's offset, its slope and its curve against ln p."""
    c, p = s.observations.conditions, s.log_pressure
    shapes = {"offset": np.ones_like(p), "slope": p, "curve": p**2 - np.mean(p**2)}
    for sample in np.unique(c.sample):
        here = (c.sample == sample).astype(float)
        for observable in OBSERVABLES:
            for name, shape in shapes.items():
                covariate, detail = "sample" if name == "offset" else "normal_load_N", BEND if name == "curve" else ""
                columns = _spread((here * shape)[:, None], observable)
                yield Contrast("sample", observable, covariate, str(sample), _course(s, columns), detail=detail)


def _specimens(s: Setup) -> Iterator[Contrast]:
    """Each specimen's offset against its siblings, and its slope against ln p."""
    c = s.observations.conditions
    for number, tests in enumerate(s.random_effects.tests_of):
        name, where = f"specimen {c.specimen[tests[0]]}", "/".join(sorted(set(c.sample[tests])))
        ones, load = np.ones((len(tests), 1)), s.log_pressure[tests, None]
        seen = [(observable, "", ones) for observable in ("static", "sliding", "both")]
        for observable, detail, shape in (*seen, ("both", BY_LOAD, load)):
            along = Course(s.observations.n, number, tests, _spread(shape, observable))
            yield Contrast("specimen", observable, name, where, (along,), detail=detail)


def _periods(s: Setup) -> Iterator[Contrast]:
    """Harmonics of the run order, and of the day."""
    c = s.observations.conditions
    if np.isfinite(c.run_order).all() and len(np.unique(c.run_order)) > 3 * BINS:
        rank = np.argsort(np.argsort(c.run_order)) / s.observations.n
        for k in range(1, min(CYCLES, s.observations.n // 4) + 1):
            wave = _course(s, _spread(_wave(k * rank), "both"))
            yield Contrast("period", "both", "run_order", "", wave, detail=f"period {s.observations.n / k:.3g}")
    hours = s.observations.clock_h
    if np.isfinite(hours).all() and np.ptp(hours) > 2:
        for k in (1, 2, 3):
            yield Contrast("period", "both", "time of day", "", _course(s, _spread(_wave(k * hours / 24.0), "both")))


def _blocks(s: Setup) -> Iterator[Contrast]:
    """Stretches of the series in which something else may have been mounted: runs of successive tenths, up to half."""
    order = s.observations.conditions.run_order
    if not np.isfinite(order).all() or s.observations.n < 3 * TENTHS:
        return
    rank = np.argsort(np.argsort(order))
    tenth = (rank * TENTHS) // s.observations.n
    for first in range(TENTHS):
        for last in range(first + 1, min(first + TENTHS // 2, TENTHS)):
            inside = ((tenth >= first) & (tenth <= last)).astype(float)
            where = f"from {order[inside > 0].min():.0f} to {order[inside > 0].max():.0f}"
            along = _course(s, _spread(inside[:, None], "both"))
            yield Contrast("block", "both", "run_order", "", along, detail=where)


def _wave(turns: FloatArray) -> FloatArray:
    return np.column_stack([np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)])


Progress = Callable[[str, int, int], None]
AT_ONCE = 20  # replicates, after which it is asked whether they suffice
FEWEST = 40
FORM = 0.12  # by how much of its own effect a law may be wrong in form, sample by sample


@displayed()
@dataclass(frozen=True)
class Screen:
    """Strength of every contrast as a standard normal deviate, and what chance gives.

    ``p`` (contrasts,) is the adjusted p value of each. ``chance`` (replicates,) is the strongest contrast in each
    simulated campaign of the fitted model, ``chance_library`` the strongest of the mechanisms alone. ``size``
    (contrasts,) is the peak-to-peak effect in ln T that the calibration does not absorb, ``coefficients`` those of
    each contrast's columns.
    """

    contrasts: tuple[Contrast, ...]
    strength: FloatArray
    size: FloatArray
    coefficients: tuple[FloatArray, ...]
    chance: FloatArray
    chance_library: FloatArray
    p: FloatArray

    def without_columns(self) -> Screen:
        """The same without the columns of the contrasts, which are large."""
        return replace(self, contrasts=tuple(replace(contrast, courses=()) for contrast in self.contrasts))

    def p_adjusted(self, strength: float | None = None) -> float:
        """Chance that some contrast is at least this strong (default: the strongest) with nothing hidden."""
        value = float(self.strength.max()) if strength is None else strength
        return share_beyond(self.chance, value)

    def p_library(self, strength: float) -> float:
        """Chance that some mechanism is at least this strong with nothing hidden."""
        return share_beyond(self.chance_library, strength)


def share_beyond(chance: FloatArray, value: float) -> float:
    """Share of replicates (r,) at or above a value, beyond the last one by a fitted Gumbel tail; NaN without any."""
    if not len(chance):
        return float("nan")
    counted = (1 + np.sum(chance >= value)) / (1 + len(chance))
    if counted > 5.0 / len(chance):
        return float(counted)
    scale = max(float(np.std(chance)) * np.sqrt(6) / np.pi, 1e-3)
    above_mode = (value - float(np.mean(chance))) / scale + np.euler_gamma
    fitted = float(-np.expm1(-np.exp(-above_mode)))
    return min(float(counted), max(fitted, 1e-12))


def screen(
    f: ModelFit,
    contrasts: Sequence[Contrast],
    *,
    replicates: int,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Screen:
    """Test every contrast on a fitted model, then do the same with up to ``replicates`` campaigns it makes itself.

    Replicates end once the strongest contrast is clearly within chance, or clearly beyond it.
    """
    whole = np.array([contrast.about_one for contrast in contrasts])
    ready = terms_of([contrast.courses for contrast in contrasts], whole, f.setup.observations.n)
    strengths, found = strengths_of(as_measured(f), ready)
    strength, coefficients = strengths[0], [c[0] for c in found]
    library = np.array([contrast.kind == "mechanism" for contrast in contrasts])
    chance = np.zeros((0, 2))
    while len(chance) < replicates:
        drawn = drawn_residuals(f, rng, min(AT_ONCE, replicates - len(chance)))
        made = refit(f, drawn)
        strengths, _ = strengths_of(made, ready)
        chance = np.concatenate([chance, _strongest(strengths, library)])
        if progress is not None:
            progress("diagnose", len(chance), replicates)
        if decided(chance[:, 0], float(strength.max())):
            break
    shown = _shown(contrasts, strength)
    contrasts, strength, coefficients = [contrasts[k] for k in shown], strength[shown], [coefficients[k] for k in shown]
    size = f.linear.size_beyond_law(
        added(contrast.courses) @ c for contrast, c in zip(contrasts, coefficients, strict=True)
    )
    p = np.array([share_beyond(chance[:, 0], float(value)) for value in strength])
    return Screen(tuple(contrasts), strength, size, tuple(coefficients), chance[:, 0], chance[:, 1], p)


def _shown(contrasts: Sequence[Contrast], strength: FloatArray) -> list[int]:
    """Which contrasts are shown: of those of two specimens the MOST_PAIRS strongest, and all others."""
    pairs = [k for k, contrast in enumerate(contrasts) if len(contrast.courses) > 1]
    if len(pairs) <= MOST_PAIRS:
        return list(range(len(contrasts)))
    weaker = set(sorted(pairs, key=lambda k: -strength[k])[MOST_PAIRS:])
    return [k for k in range(len(contrasts)) if k not in weaker]


def allowed_wrong_form(model: ModelFit, allowed: int = 0) -> ModelFit:
    """The model with its laws allowed to be wrong in form by a share of their own effect; the first ``allowed`` of them
    are already."""
    acting, values = model.acting[allowed:], model.values[allowed:]
    wider = with_form_error(model.setup, model.law, acting, values, FORM)
    return fit(wider, model.acting, start=model, iterations=10)


def screen_left(
    model: ModelFit, *, replicates: int, rng: np.random.Generator, progress: Progress | None = None, allowed: int = 0
) -> Screen:
    """What is left after a model, its laws allowed to be wrong in form (:func:`allowed_wrong_form`)."""
    widened = allowed_wrong_form(model, allowed)
    contrasts = all_contrasts(widened.setup, start_changes(widened.setup, widened.law))
    return screen(widened, contrasts, replicates=replicates, rng=rng, progress=progress)


def _strongest(strengths: FloatArray, library: NDArray[np.bool_]) -> FloatArray:
    """The strongest contrast of every replicate, and the strongest of the library's alone, (r, 2)."""
    alone = strengths[:, library].max(axis=1) if library.any() else np.full(len(strengths), -np.inf)
    return np.column_stack([strengths.max(axis=1), alone])


def decided(chance: FloatArray, strongest: float, fewest: int = FEWEST) -> bool:
    """Whether further replicates could not change the decision at one percent: a sequential Monte Carlo test.

    Ten replicates as strong say "within chance" (Besag and Clifford 1991); ten standard deviations beyond
    their mean say the opposite.
    """
    if len(chance) < fewest:
        return False
    beyond = strongest > float(np.mean(chance) + 10.0 * np.std(chance))
    return bool(np.sum(chance >= strongest) >= 10 or beyond)


def strengths_of(fitted: Replicates, contrasts: Terms) -> tuple[FloatArray, list[FloatArray]]:
    """Strength of every contrast as a standard normal deviate, (r, contrasts), and the coefficients of each, (r, d)."""
    chi2, coefficients = scores(fitted, contrasts)
    return deviate(chi2, contrasts.freedom), coefficients


def deviate(chi2: FloatArray, freedom: FloatArray | NDArray[np.int64]) -> FloatArray:
    """The standard normal deviates as rare, two-sided, as chi-squared values; beyond 1e-14 by asymptotics."""
    chi2 = np.maximum(chi2, 0.0)
    p = chdtrc(freedom, chi2)
    far = np.sqrt(chi2) - 0.5 * np.sqrt(np.maximum(freedom - 1.0, 0.0))
    near = np.maximum(-ndtri(np.maximum(0.5 * p, 1e-300)), 0.0)
    return np.where(freedom == 1, np.sqrt(chi2), np.where(p > 1e-14, near, far))
