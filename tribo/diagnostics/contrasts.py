"""Contrasts of the residuals, by mechanism, covariate, shape, sample, specimen and period, and their screen: how
strongly each is followed, and how strongly by chance, the maximum over all contrasts being simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.gaps import enough_recorded
from tribo.diagnostics.model import (
    MOST_PAIRS,
    Acting,
    EffectCourse,
    Setup,
    added,
    course,
    log_forces,
    predict,
    start_changes,
    with_form_error,
)
from tribo.diagnostics.replicates import Replicates, as_measured, drawn_residuals, refit
from tribo.diagnostics.score_statistics import Terms, scores, terms_of
from tribo.display import displayed
from tribo.mechanisms.conditions import is_level, levels_of
from tribo.records import FloatArray

Progress = Callable[[str, int, int], None]
AT_ONCE = 20  # replicates, after which it is asked whether they suffice
FEWEST = 40
FORM = 0.12  # by how much of its own effect a law may be wrong in form, sample by sample
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
    courses: tuple[EffectCourse, ...]
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


def all_contrasts(
    s: Setup, law: FloatArray, acting: Sequence[Acting], courses: Sequence[tuple[EffectCourse, ...]]
) -> list[Contrast]:
    """Every contrast that this design allows: the candidates with their ``courses``, the share of adhesion in T by the
    flat law ``law``, and those of what was recorded."""
    mechanisms = zip(acting, courses, strict=True)
    contrasts = [Contrast("mechanism", "both", a.name, "", along, a) for a, along in mechanisms]
    adhesion = np.exp(log_forces(s.base(law).forces(np.zeros(s.observations.n))) - predict(s, law, (), ()))
    contrasts.append(Contrast("trend", "both", "tau0", "", (course(adhesion[:, :, None], s),)))
    contrasts += [*_of_columns(s), *_of_samples(s), *_of_specimens(s), *_of_series(s)]
    return [contrast for contrast in contrasts if all(c.shows for c in contrast.courses)]


def numeric_covariates(s: Setup) -> dict[str, FloatArray]:
    """Recorded numbers a residual may follow, standardised, those that vary and have values enough; a test without a
    value, and without an estimate of it, lies at the mean."""
    return {name: values for name, (values, _) in _numbers_with_gaps(s).items()}


def _numbers_with_gaps(s: Setup) -> dict[str, tuple[FloatArray, NDArray[np.bool_]]]:
    """The same, each with the tests (n,) whose value was not recorded."""

    def log(values: FloatArray) -> FloatArray:
        return np.log(np.where(values > 0, values, np.nan))

    c = s.observations.conditions
    numbers = {
        "run_order": c.run_order,
        "specimen_run": c.specimen_run,
        "started_at": c.elapsed_s,
        "time of day": s.observations.clock_h,
        "temperature_C": c.temperature_C,
        "humidity_pct": c.humidity_pct,
        "speed_mm_s": log(c.speed_m_s),
        "hold_s": log(c.hold_s),
    }
    for name, column in c.columns.items():
        with suppress(ValueError):
            numbers.setdefault(name, np.asarray(column, float))
    found = {}
    for name, values in numbers.items():
        here = np.isfinite(values)
        known = values[here]
        if len(known) and enough_recorded(len(known), len(values)) and known.std() > 1e-9:
            gap = c.gaps.get("speed_m_s" if name == "speed_mm_s" else name)
            missing = ~here if gap is None else gap.missing | ~here
            found[name] = np.where(here, (values - known.mean()) / known.std(), 0.0), missing
    return found


def _contrast(
    s: Setup, kind: str, observable: str, covariate: str, values: FloatArray, sample: str = "", detail: str = ""
) -> Contrast:
    """The contrast of an observable along columns (n, d) of all tests."""
    along = course(_in_regimes(values, observable), s)
    return Contrast(kind, observable, covariate, sample, (along,), detail=detail)


def _in_regimes(values: FloatArray, observable: str) -> FloatArray:
    """Columns (n, d) onto the two regimes, (n, 2, d)."""
    return values[:, None, :] * np.array(OBSERVABLES[observable])[None, :, None]


def _of_columns(s: Setup) -> Iterator[Contrast]:
    """Trends and groups of every recorded number, up to BINS of alike size; of text columns one gain per name."""
    for name, (values, missing) in _numbers_with_gaps(s).items():
        for observable in OBSERVABLES:
            yield _contrast(s, "trend", observable, name, values[:, None])
        known = values[~missing]
        distinct = np.unique(known)
        edges = distinct[1:] if len(distinct) <= BINS else np.unique(np.quantile(known, np.arange(1, BINS) / BINS))
        code = np.searchsorted(edges, values, side="right")
        groups = np.column_stack([code == k for k in range(1, len(edges) + 1)]).astype(float)  # the first is zero
        groups[missing] = groups[~missing].mean(axis=0)
        for observable in ("static", "sliding", "both") if len(edges) > 1 else ():
            yield _contrast(s, "shape", observable, name, groups)
    for name, column in s.observations.conditions.columns.items():
        names = levels_of(column)
        if 1 < len(names) <= min(s.observations.n // 8, MOST_LEVELS):
            levels = np.column_stack([is_level(column, level) for level in names[1:]])
            for observable in ("static", "sliding", "both"):
                yield _contrast(s, "level", observable, name, levels)


def _of_samples(s: Setup) -> Iterator[Contrast]:
    """Each sample's offset, its slope and its curve against ln p."""
    c, p = s.observations.conditions, s.log_pressure
    shapes = (("sample", "", np.ones_like(p)), ("normal_load_N", "", p), ("normal_load_N", BEND, p**2 - np.mean(p**2)))
    for sample in np.unique(c.sample):
        here = (c.sample == sample).astype(float)
        for observable in OBSERVABLES:
            for covariate, detail, shape in shapes:
                yield _contrast(s, "sample", observable, covariate, (here * shape)[:, None], str(sample), detail)


def _of_specimens(s: Setup) -> Iterator[Contrast]:
    """Each specimen's offset against its siblings, and its slope against ln p."""
    c = s.observations.conditions
    for number, tests in enumerate(s.tests_of):
        name, where = f"specimen {c.specimen[tests[0]]}", "/".join(sorted(set(c.sample[tests])))
        ones, load = np.ones((len(tests), 1)), s.log_pressure[tests, None]
        offsets = [(observable, "", ones) for observable in ("static", "sliding", "both")]
        for observable, detail, shape in (*offsets, ("both", BY_LOAD, load)):
            along = EffectCourse(s.observations.n, number, tests, _in_regimes(shape, observable))
            yield Contrast("specimen", observable, name, where, (along,), detail=detail)


def _of_series(s: Setup) -> Iterator[Contrast]:
    """Harmonics of the run order and of the day, and stretches of the series in which something else may have been
    mounted: runs of successive tenths, up to half."""
    n, order, hours = s.observations.n, s.observations.conditions.run_order, s.observations.clock_h
    ordered = bool(np.isfinite(order).all())
    rank = np.argsort(np.argsort(order))
    waves = []
    if ordered and len(np.unique(order)) > 3 * BINS:
        turns = rank / n
        waves += [("run_order", f"period {n / k:.3g}", k * turns) for k in range(1, min(CYCLES, n // 4) + 1)]
    if np.isfinite(hours).all() and np.ptp(hours) > 2:
        waves += [("time of day", "", k * hours / 24.0) for k in (1, 2, 3)]
    for covariate, detail, turns in waves:
        wave = np.column_stack([np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)])
        yield _contrast(s, "period", "both", covariate, wave, detail=detail)
    tenth = (rank * TENTHS) // n
    for first in range(TENTHS) if ordered and n >= 3 * TENTHS else ():
        for last in range(first + 1, min(first + TENTHS // 2, TENTHS)):
            inside = ((tenth >= first) & (tenth <= last)).astype(float)
            where = f"from {order[inside > 0].min():.0f} to {order[inside > 0].max():.0f}"
            yield _contrast(s, "block", "both", "run_order", inside[:, None], detail=where)


# Where so many replicates leave the chance of the strongest contrast in this range, about one percent, more are made.
MANY, MOST_REPLICATES, UNCERTAIN = 100, 1000, (0.003, 0.03)


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

    def alone(self, k: int) -> Screen:
        """The same of one contrast."""
        one = slice(k, k + 1)
        return replace(
            self, contrasts=self.contrasts[one], strength=self.strength[one], size=self.size[one],
            coefficients=self.coefficients[one], p=self.p[one],
        )  # fmt: skip

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


def share_beyond(chance: FloatArray, value: float, least_scale: float = 1e-3) -> float:
    """Share of replicates (r,) at or above a value, beyond the last one by a fitted Gumbel tail of a scale that is not
    below ``least_scale``; NaN without any."""
    if not len(chance):
        return float("nan")
    counted = (1 + np.sum(chance >= value)) / (1 + len(chance))
    if counted > 5.0 / len(chance):
        return float(counted)
    scale = max(float(np.std(chance)) * np.sqrt(6) / np.pi, least_scale)
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
    about_one = np.array([contrast.about_one for contrast in contrasts])
    terms = terms_of([contrast.courses for contrast in contrasts], about_one, f.setup.observations.n)
    strengths, each = strengths_of(as_measured(f), terms)
    strength, coefficients = strengths[0], [c[0] for c in each]
    library = np.array([contrast.kind == "mechanism" for contrast in contrasts])
    chance = np.zeros((0, 2))
    while len(chance) < replicates:
        drawn = drawn_residuals(f, rng, min(AT_ONCE, replicates - len(chance)))
        strengths, _ = strengths_of(refit(f, drawn), terms)
        chance = np.concatenate([chance, _strongest(strengths, library)])
        if progress is not None:
            progress("diagnose", len(chance), replicates)
        if decided(chance[:, 0], float(strength.max())):
            break
        near = UNCERTAIN[0] < share_beyond(chance[:, 0], float(strength.max())) < UNCERTAIN[1]
        if len(chance) >= replicates >= MANY and near:
            replicates = min(replicates + AT_ONCE, MOST_REPLICATES)
    pairs = [k for k, contrast in enumerate(contrasts) if len(contrast.courses) > 1]
    weaker = set(sorted(pairs, key=lambda k: -strength[k])[MOST_PAIRS:])  # chance counts them, nothing shows them
    shown = [k for k in range(len(contrasts)) if k not in weaker]
    contrasts, strength, coefficients = [contrasts[k] for k in shown], strength[shown], [coefficients[k] for k in shown]
    size = f.size_beyond_law(
        added(contrast.courses) @ c for contrast, c in zip(contrasts, coefficients, strict=True)
    )
    p = np.array([share_beyond(chance[:, 0], float(value)) for value in strength])
    return Screen(tuple(contrasts), strength, size, tuple(coefficients), chance[:, 0], chance[:, 1], p)


def allowed_wrong_form(model: ModelFit, allowed: int = 0) -> ModelFit:
    """The model with its laws allowed to be wrong in form by a share of their own effect; the first ``allowed`` of them
    are already. Where there are no others, it is the model itself."""
    acting, values = model.acting[allowed:], model.values[allowed:]
    if not acting:
        return model
    wider = with_form_error(model.setup, model.law, acting, values, FORM)
    return fit(wider, model.acting, start=model, iterations=10)


def screen_left(
    model: ModelFit, *, replicates: int, rng: np.random.Generator, progress: Progress | None = None, allowed: int = 0
) -> Screen:
    """What is left after a model, its laws allowed to be wrong in form (:func:`allowed_wrong_form`)."""
    widened = allowed_wrong_form(model, allowed)
    acting, courses, _ = start_changes(widened.setup, widened.law)
    contrasts = all_contrasts(widened.setup, widened.law, acting, courses)
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
