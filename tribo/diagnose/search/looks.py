"""Every way the diagnosis looks at the residuals: by mechanism, covariate, shape, sample, specimen and period."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tribo.diagnose.statistics.courses import Course, added, course
from tribo.diagnose.statistics.model import Acting, Setup, StartChanges
from tribo.display import displayed
from tribo.records import FloatArray

OBSERVABLES = {"static": (1.0, 0.0), "sliding": (0.0, 1.0), "both": (1.0, 1.0), "drop": (1.0, -1.0)}
BINS = 6
TENTHS = 10
BENT = ", bend"  # what a look at the curve of a sample adds to its column
MOST_LEVELS = 200  # names of a text column: the work grows with their cube
CYCLES = 24  # periods down to a twenty-fourth of the series


@displayed()
@dataclass(frozen=True)
class Look:
    """One look: which observable against which covariate, and the columns it would follow: those of one course, or of
    two that add up, on different specimens."""

    kind: str  # mechanism, trend, shape, level, sample, specimen, period, block
    observable: str
    covariate: str
    sample: str
    courses: tuple[Course, ...]
    acting: Acting | None = None

    @property
    def columns(self) -> FloatArray:
        """(n, 2, d)."""
        return added(self.courses)

    def is_taken_up(self, flat: str) -> bool:
        """Whether calibrating on the sample ``flat`` removes this: the level of its force, and its slope with load."""
        return self.kind == "sample" and self.sample == flat and not self.covariate.endswith(BENT)

    @property
    def wholeness(self) -> float:
        """Precision with which its coefficient is known to be one: of a mechanism that is present as a whole."""
        sd = self.acting.mechanism.choosing.all_or_nothing_sd if self.acting is not None else None
        return 0.0 if sd is None else sd**-2.0

    @property
    def freedom(self) -> int:
        return self.courses[0].freedom


def all_looks(s: Setup, changes: StartChanges) -> list[Look]:
    """Every look that this design allows, ``changes`` being those of the candidates."""
    recorded = [*_covariates(s), *_levels(s), *_samples(s), *_specimens(s), *_periods(s), *_blocks(s)]
    looks = [*_mechanisms(s, changes), *recorded]
    return [look for look in looks if all(c.shows for c in look.courses)]


def _mechanisms(s: Setup, changes: StartChanges) -> Iterator[Look]:
    for acting, courses in zip(changes.acting, changes.courses, strict=True):
        yield Look("mechanism", "both", acting.name, "", courses, acting)
    yield Look("trend", "both", "tau0", "", _course(s, changes.adhesion[:, :, None]))


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


def _covariates(s: Setup) -> Iterator[Look]:
    for name, values in numeric_covariates(s).items():
        for observable in OBSERVABLES:
            yield Look("trend", observable, name, "", _course(s, _spread(values[:, None], observable)))
        bins = _bins(values)
        if bins.shape[1] > 1:
            for observable in ("static", "sliding", "both"):
                yield Look("shape", observable, name, "", _course(s, _spread(bins, observable)))


def _bins(values: FloatArray) -> FloatArray:
    """Indicator columns of up to BINS groups of alike size, less one."""
    distinct = np.unique(values)
    edges = distinct[1:] if len(distinct) <= BINS else np.unique(np.quantile(values, np.arange(1, BINS) / BINS))
    code = np.searchsorted(edges, values, side="right")
    return np.column_stack([code == k for k in range(1, len(edges) + 1)]).astype(float)


def _levels(s: Setup) -> Iterator[Look]:
    """Text columns: one gain per name."""
    for name, column in s.observations.conditions.columns.items():
        names = np.unique(column)
        if 1 < len(names) <= min(s.observations.n // 8, MOST_LEVELS):
            levels = np.column_stack([column == level for level in names[1:]]).astype(float)
            for observable in ("static", "sliding", "both"):
                yield Look("level", observable, name, "", _course(s, _spread(levels, observable)))


def _samples(s: Setup) -> Iterator[Look]:
    """Each sample's offset, its slope and its curve against ln p."""
    c, p = s.observations.conditions, s.log_pressure
    shapes = {"offset": np.ones_like(p), "slope": p, "curve": p**2 - np.mean(p**2)}
    for sample in np.unique(c.sample):
        here = (c.sample == sample).astype(float)
        for observable in OBSERVABLES:
            for name, shape in shapes.items():
                covariate = {"offset": "sample", "slope": "normal_load_N"}.get(name, f"normal_load_N{BENT}")
                columns = _spread((here * shape)[:, None], observable)
                yield Look("sample", observable, covariate, str(sample), _course(s, columns))


def _specimens(s: Setup) -> Iterator[Look]:
    """Each specimen's offset against its siblings, and its slope against ln p."""
    c = s.observations.conditions
    for number, tests in enumerate(s.random_effects.tests_of):
        name, where = f"specimen {c.specimen[tests[0]]}", "/".join(sorted(set(c.sample[tests])))
        ones, load = np.ones((len(tests), 1)), s.log_pressure[tests, None]
        seen = [(observable, name, ones) for observable in ("static", "sliding", "both")]
        for observable, covariate, shape in (*seen, ("both", f"{name} by load", load)):
            along = Course(s.observations.n, number, tests, _spread(shape, observable))
            yield Look("specimen", observable, covariate, where, (along,))


def _periods(s: Setup) -> Iterator[Look]:
    """Harmonics of the run order, and of the day."""
    c = s.observations.conditions
    if np.isfinite(c.run_order).all() and len(np.unique(c.run_order)) > 3 * BINS:
        rank = np.argsort(np.argsort(c.run_order)) / s.observations.n
        for k in range(1, min(CYCLES, s.observations.n // 4) + 1):
            period = f"run_order, period {s.observations.n / k:.3g}"
            yield Look("period", "both", period, "", _course(s, _spread(_wave(k * rank), "both")))
    hours = s.observations.clock_h
    if np.isfinite(hours).all() and np.ptp(hours) > 2:
        for k in (1, 2, 3):
            yield Look("period", "both", "time of day", "", _course(s, _spread(_wave(k * hours / 24.0), "both")))


def _blocks(s: Setup) -> Iterator[Look]:
    """Stretches of the series in which something else may have been mounted: runs of successive tenths, up to half."""
    order = s.observations.conditions.run_order
    if not np.isfinite(order).all() or s.observations.n < 3 * TENTHS:
        return
    rank = np.argsort(np.argsort(order))
    tenth = (rank * TENTHS) // s.observations.n
    for first in range(TENTHS):
        for last in range(first + 1, min(first + TENTHS // 2, TENTHS)):
            inside = ((tenth >= first) & (tenth <= last)).astype(float)
            where = f"run_order, from {order[inside > 0].min():.0f} to {order[inside > 0].max():.0f}"
            yield Look("block", "both", where, "", _course(s, _spread(inside[:, None], "both")))


def _wave(turns: FloatArray) -> FloatArray:
    return np.column_stack([np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)])
