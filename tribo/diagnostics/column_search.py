"""Which recorded columns friction follows beside the law of every sample alone, against chance.

ln T of a test is the law of its sample, the gain of its specimen, and scatter. Each column is tested by the F
statistic of what it explains beyond the law. The strongest of all columns is compared with the strongest in campaigns
made from the fitted law, whose specimens are drawn and whose scatter is resampled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution, t as t_distribution

from tribo.diagnostics.contrasts import share_beyond
from tribo.diagnostics.gaps import enough_recorded
from tribo.diagnostics.verdict import TooLittle
from tribo.fitting.alternatives import is_one_level
from tribo.mechanisms.conditions import is_level
from tribo.mechanisms.record import StringArray
from tribo.records import REGIMES, FloatArray, Ingested, Pull, Regime, Test

FEWEST_TESTS = 12
SAME_LOAD = 0.02  # relative distance of loads that were meant to be one
MOST_NAMES = 12
BINS = 4
LOGARITHMIC = ("speed_mm_s", "hold_s")
NUMBERS = ("hold_s", "temperature_C", "humidity_pct", "run_order", "specimen_run", "repeat")
_LOAD_BY_ANOTHER_NAME = ("nominal_load_N",)
LEFT_OVER = 0.02  # share of a column's variance beyond the laws of the samples below which it cannot be told from load
REPLICATES = 200
MOST_FOUND = 6
ALIKE = 0.9  # share of the effect of a column that another one reproduces, from which on they cannot be told apart
TAIL = 8.0  # degrees of freedom of the scatter, whose outliers count less
_VARIANCES = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)  # of specimen gains over that of repeats
_ROUNDS = 4
_NOTHING_LEFT = 1e-9
UNSTATED_READING = 1e-3 / 3**0.5  # one in a thousand, evenly distributed: half of the last of three digits


@dataclass(frozen=True)
class Regressor:
    """One way to follow a recorded column: ``columns`` (n, d) beside the law, and where its values run from and to.

    ``kind`` is trend, course (groups of a number) or names. ``levels`` are the names of groups, the first being the
    reference. ``order`` (n,) holds the rank of each test among the values of a number, or the number of its name in
    order of appearance; -1 without a value.
    """

    name: str
    kind: str
    columns: FloatArray
    low: float = float("nan")
    high: float = float("nan")
    levels: tuple[str, ...] = ()
    order: tuple[int, ...] = ()


@dataclass(frozen=True)
class RegimeTests:
    """The tests of one regime with a positive force: ln T, (n,), and ``law`` (n, p), the law of every sample alone.

    The law of a sample is its mean at every load where loads are repeated, else a parabola of ln T in ln N as far as
    the loads determine it. ``same`` are the names of columns that are one and the same, of which ``columns`` has the
    first. ``reading`` is the relative standard uncertainty of each force, (n,).
    """

    regime: Regime
    sample: StringArray
    specimen: StringArray
    load_N: FloatArray
    log_force: FloatArray
    law: FloatArray
    columns: tuple[Regressor, ...]
    only_with_load: tuple[str, ...]
    same: tuple[tuple[str, ...], ...]
    reading: FloatArray

    @property
    def n(self) -> int:
        return len(self.log_force)

    @property
    def enough(self) -> bool:
        """Whether there are tests enough, and more than the laws take up."""
        return self.n >= FEWEST_TESTS and self.n >= 2 * self.law.shape[1]


def regime_tests(ingested: Ingested, regime: Regime) -> RegimeTests:
    """The tests of one regime, and the columns that vary within samples ``only_with_load``."""
    pairs = [
        (test, pull)
        for test in ingested.campaign.tests
        if (pull := ingested.pulls.get(test.test_id)) is not None
        and getattr(pull, f"{regime}_N") > 0 and test.normal_load_N > 0
    ]  # fmt: skip
    tests, pulls = [t for t, _ in pairs], [p for _, p in pairs]
    sample = np.array([t.sample for t in tests], str)
    load = np.array([t.normal_load_N for t in tests], float)
    law = _laws(sample, load)
    varying = [c for c in _columns(tests, pulls) if np.ptp(c.columns) > 0] if tests else []
    same = same_columns(varying)
    copies = {name for names in same for name in names[1:]}
    found = [c for c in varying if c.name not in copies]
    told = [c for c in found if _beyond(law, c.columns) > LEFT_OVER]
    samples = (sample[:, None] == np.unique(sample)[None]).astype(float)
    names = {c.name for c in told} | {c.name for c in found if _beyond(samples, c.columns) <= LEFT_OVER}
    return RegimeTests(
        regime, sample, np.array([t.specimen for t in tests], str), load,
        np.log([getattr(p, f"{regime}_N") for p in pulls]), law, tuple(told),
        tuple(dict.fromkeys(c.name for c in found if c.name not in names)), same, _readings(pulls, regime),
    )  # fmt: skip


def _readings(pulls: Sequence[Pull], regime: Regime) -> FloatArray:
    """Relative standard uncertainty of each force, (n,); of a force stated without one, that of three digits."""
    force, u = (np.array([getattr(p, f"{regime}_{part}") for p in pulls], float) for part in ("N", "u_N"))
    return np.where(np.isfinite(u) & (u > 0), u / np.maximum(force, 1e-300), UNSTATED_READING)


def same_columns(columns: Sequence[Regressor]) -> tuple[tuple[str, ...], ...]:
    """The names of recorded columns of which each follows from the other in every test, in the order of the columns.

    Two numbers are the same column if one rises, or falls, strictly with the other (a copy, another unit, a power);
    names, and a number beside names, if each value of one stands beside one value of the other.
    """
    groups: list[list[str]] = []
    place: dict[tuple[str, tuple[int, ...]], int] = {}  # the first group whose first column is so ordered
    seen: set[str] = set()
    for column in columns:
        if column.name in seen:
            continue
        seen.add(column.name)
        named, appearance = column.kind == "names", _appearance(column.order)
        highest = max(column.order)
        falling = tuple(highest - rank if rank >= 0 else rank for rank in column.order)
        own = ("names", appearance) if named else ("numbers", min(column.order, falling))
        alike = (("any", appearance),) if named else (own, ("names", appearance))
        there = [place[key] for key in alike if key in place]
        if there:
            groups[min(there)].append(column.name)
            continue
        for key in (own, ("any", appearance)):
            place.setdefault(key, len(groups))
        groups.append([column.name])
    return tuple(tuple(names) for names in groups if len(names) > 1)


def _appearance(order: Sequence[int]) -> tuple[int, ...]:
    """The same groups numbered as they appear."""
    places: dict[int, int] = {-1: -1}
    for rank in order:
        places.setdefault(rank, len(places) - 1)
    return tuple(places[rank] for rank in order)


def _laws(sample: StringArray, load_N: FloatArray) -> FloatArray:
    """Columns of the law of every sample, (n, p)."""
    found = []
    for name in np.unique(sample):
        here = sample == name
        level = load_levels(load_N[here])
        count = len(np.unique(level))
        if count > 1 and here.sum() >= 2 * count:
            shapes = [(level == k).astype(float) for k in range(count)]
        else:
            x = np.log(load_N[here])
            shapes = [(x - x.mean()) ** k for k in range(min(count, 3))]
        for shape in shapes:
            column = np.zeros(len(sample))
            column[here] = shape
            found.append(column)
    return np.column_stack(found) if found else np.zeros((len(sample), 0))


def load_levels(load_N: FloatArray) -> NDArray[np.int64]:
    """The number of the level of each load, (n,): neighbours closer than two percent are one level."""
    order = np.argsort(load_N)
    steps = np.diff(np.log(load_N[order])) > SAME_LOAD
    level = np.empty(len(load_N), int)
    level[order] = np.concatenate([[0], np.cumsum(steps)])
    return level


def _beyond(law: FloatArray, columns: FloatArray) -> float:
    """Share of the variance of columns that the laws do not take up."""
    centred = columns - columns.mean(axis=0)
    left = columns - law @ np.linalg.lstsq(law, columns, rcond=None)[0]
    return float(np.sum(left**2) / max(float(np.sum(centred**2)), 1e-300))


def _columns(tests: list[Test], pulls: list[Pull]) -> Iterator[Regressor]:
    speed = np.array([1e3 * t.speed_m_s if t.speed_m_s else np.nan for t in tests])
    if not is_one_level(speed):
        yield from _of_numbers("speed_mm_s", speed)
    for name in NUMBERS:
        values = np.array([np.nan if (v := getattr(t, name)) is None else float(v) for t in tests])
        yield from _of_numbers(name, values)
    yield from _of_names("operator", [t.operator for t in tests])
    strokes = [next((way for way in ("forward", "backward") if way in p.flags), "") for p in pulls]
    yield from _of_names("direction", [t.direction or way for t, way in zip(tests, strokes, strict=True)])
    yield from _of_names("date", [t.started_at[:10] for t in tests])
    for name in sorted({c for t in tests for c in t.covariates} - set(_LOAD_BY_ANOTHER_NAME)):
        cells = [str(t.covariates.get(name, "")) for t in tests]
        numbers = np.full(len(cells), np.nan)
        for k, cell in enumerate(cells):
            with suppress(ValueError):
                numbers[k] = float(cell.replace(",", "."))
        if np.isfinite(numbers).any():
            yield from _of_numbers(name, numbers)
        else:
            yield from _of_names(name, cells)


def _of_numbers(name: str, values: FloatArray) -> Iterator[Regressor]:
    """A trend, and the course over up to four groups; tests without a value lie at the mean of the others, and in each
    group by its share of them."""
    there = np.isfinite(values) & ((values > 0) | (name not in LOGARITHMIC))
    if not there.any() or not enough_recorded(int(there.sum()), len(values)):
        return
    if np.ptp(values[there]) <= 1e-9 * np.abs(values[there]).max():
        return
    low, high = float(values[there].min()), float(values[there].max())
    along = np.full(len(values), np.nan)
    along[there] = np.log(values[there]) if name in LOGARITHMIC else values[there]
    trend = np.where(there, (along - along[there].mean()) / np.ptp(along[there]), 0.0)
    ranks = np.full(len(values), -1)
    ranks[there] = np.unique(_rounded(values[there]), return_inverse=True)[1]
    order = tuple(int(rank) for rank in ranks)
    yield Regressor(name, "trend", trend[:, None], low, high, order=order)
    distinct = np.unique(values[there])
    edges = distinct[1:] if len(distinct) <= BINS else np.unique(np.quantile(values[there], np.arange(1, BINS) / BINS))
    code = np.searchsorted(edges, np.where(there, values, low), side="right")
    groups = [k for k in range(1, len(edges) + 1) if (there & (code == k)).any()]
    if len(groups) > 1:
        parts = [values[there & (code == k)] for k in (0, *groups)]
        levels = tuple(f"{x.min():.3g} to {x.max():.3g}" if np.ptp(x) else f"{x.min():.3g}" for x in parts)
        columns = np.column_stack([code == k for k in groups]).astype(float)
        columns[~there] = columns[there].mean(axis=0)
        yield Regressor(name, "course", columns, low, high, levels, order)


def _rounded(values: FloatArray) -> FloatArray:
    """Values to nine digits of the largest: another unit may move the last ones."""
    scale = float(np.abs(values).max()) or 1.0
    return np.asarray(np.round(values / scale, 9))


def _of_names(name: str, cells: list[str]) -> Iterator[Regressor]:
    names = sorted(set(cells) - {""})
    if 1 < len(names) <= min(MOST_NAMES, len(cells) // 3) and enough_recorded(sum(map(bool, cells)), len(cells)):
        column = np.array(cells, str)
        levels = np.column_stack([is_level(column, level) for level in names[1:]])
        order = tuple(names.index(cell) if cell else -1 for cell in cells)
        yield Regressor(name, "names", levels, levels=tuple(names), order=order)


@dataclass(frozen=True)
class ColumnEffect:
    """A column that friction follows: the change of T over its range with a 90 % interval, in percent.

    ``where`` says between which values. ``alike`` are columns that this design cannot tell from it, ``same`` those that
    are this very column by another name.
    """

    name: str
    kind: str
    regime: Regime
    p: float
    change_percent: float
    low_percent: float
    high_percent: float
    where: tuple[str, str]
    alike: tuple[str, ...] = ()
    same: tuple[str, ...] = ()


class Whitening:
    """One spread of the gains of specimens: how it whitens the tests, and the law's orthonormal ``basis`` (n, p).

    Parameters
    ----------
    design : array (n, p)
        The law and the columns beside it.
    groups : array (n, specimens)
        Which test is of which specimen.
    variance : float
        Of the gains of specimens over that of repeats.
    """

    def __init__(self, design: FloatArray, groups: FloatArray, variance: float) -> None:
        size = np.sum(groups**2, axis=0)
        self.groups = groups
        self.share = (1.0 - 1.0 / np.sqrt(1.0 + variance * size)) / size  # of the mean of a specimen, taken off
        u, s, _ = np.linalg.svd(self.white(design), full_matrices=False)
        kept = s > 1e-9 * s.max()
        self.basis: FloatArray = u[:, kept]
        self.log_det = float(np.sum(np.log1p(variance * size)) + 2.0 * np.sum(np.log(s[kept])))

    def white(self, values: FloatArray) -> FloatArray:
        """Values (n, ...) with a share of the mean of each specimen taken off."""
        if not self.share.any():
            return values
        means = self.groups.T @ values
        return np.asarray(values - self.groups @ (means * (self.share if values.ndim == 1 else self.share[:, None])))

    def left(self, values: FloatArray) -> FloatArray:
        """Whitened values (n, ...) less what the law takes up of them."""
        white = self.white(values)
        return np.asarray(white - self.basis @ (self.basis.T @ white))

    def score(self, square: FloatArray) -> FloatArray:
        """Restricted log likelihood of what is left, by its sum of squares."""
        dof = len(self.basis) - self.basis.shape[1]
        return np.asarray(-0.5 * (dof * np.log(np.maximum(square, 1e-300)) + self.log_det))


class ColumnFit:
    """The law of every sample with some columns, by restricted maximum likelihood in the spread of the specimens.

    Attributes
    ----------
    root : array (n,)
        Square roots of the weights of outlying tests, by what is left.
    whitenings : tuple of Whitening
        Of every spread of the specimens; ``at`` is the likeliest.
    left : array (n,)
        What is left with it, whitened; ``variance`` is its variance.
    """

    def __init__(self, tested: RegimeTests, taken: Sequence[Regressor]) -> None:
        self.tested = tested
        self.floor = max(float(np.mean(tested.reading**2)), _NOTHING_LEFT**2)
        self.design = design = np.column_stack([tested.law, *(c.columns for c in taken)])
        names = np.unique(tested.specimen)
        groups = (tested.specimen[:, None] == names[None]).astype(float)
        spreads = _VARIANCES if len(names) > len(np.unique(tested.sample)) else _VARIANCES[:1]
        root = np.ones(tested.n)
        for _ in range(_ROUNDS):
            self.whitenings = tuple(Whitening(design * root[:, None], groups * root[:, None], v) for v in spreads)
            lefts = [w.left(root * tested.log_force) for w in self.whitenings]
            self.at = int(np.argmax([w.score(left @ left) for w, left in zip(self.whitenings, lefts, strict=True)]))
            self.left = lefts[self.at]
            variance = float(self.left @ self.left) / max(self.dof, 1)
            self.variance = max(variance, self.floor)
            standard = (self.left / root) ** 2 / self.variance
            root = np.sqrt((TAIL + 1.0) / (TAIL + standard))
        self.root = root

    @property
    def dof(self) -> int:
        return self.tested.n - self.whitenings[self.at].basis.shape[1]

    def can_tell(self, c: Regressor) -> bool:
        """Whether enough of a column is left beside the laws and the columns taken: what little is left of a near copy
        would be extrapolated far beyond the values measured."""
        return _beyond(self.design, c.columns) > LEFT_OVER

    def basis(self, c: Regressor, at: int) -> FloatArray:
        """Orthonormal basis of a column beyond the law, (n, d); columns that the law takes up have none."""
        w, values = self.whitenings[at], c.columns * self.root[:, None]
        u, s, _ = np.linalg.svd(w.left(values), full_matrices=False)
        scale = float(np.sqrt(np.sum(w.white(values) ** 2)))
        return np.asarray(u[:, s > 1e-6 * max(scale, 1e-300)])


def search_columns(t: RegimeTests, regimes: int, level: float, rng: np.random.Generator) -> list[ColumnEffect]:
    """The columns that friction follows beyond chance, the strongest first, each beside the others.

    ``regimes`` is the number of regimes that are searched; p values are adjusted for it.
    """
    taken: list[Regressor] = []
    while len(taken) < MOST_FOUND:
        fitted = ColumnFit(t, taken)
        others = [c for c in t.columns if c.name not in {k.name for k in taken} and fitted.can_tell(c)]
        chances = _chances(fitted, others, rng)
        if not chances:
            break
        best = min(chances, key=lambda k: chances[k])
        if min(chances[best] * regimes, 1.0) >= level:
            break
        taken.append(others[best])
    found = []
    for column in taken:
        beside = ColumnFit(t, [c for c in taken if c is not column])
        if not beside.can_tell(column):
            continue
        rivals = [c for c in t.columns if c.name not in {k.name for k in taken}]
        p = min(_chances(beside, [column, *rivals], rng).get(0, 1.0) * regimes, 1.0)
        if p < level:
            found.append(_described(beside, _first_alike(beside, column), p))
    return found


def _chances(f: ColumnFit, columns: Sequence[Regressor], rng: np.random.Generator) -> dict[int, float]:
    """By place in the list: the chance that one of all columns is as strong as this one with nothing hidden.

    Columns that the law takes up are left out.
    """
    bases = {k: b for k, c in enumerate(columns) if (b := f.basis(c, f.at)).shape[1]}
    if not bases or f.dof < 3:
        return {}
    d = np.array([b.shape[1] for b in bases.values()])
    strength = _strengths(_ratios(f.left[:, None], list(bases.values()), f.dof, f.floor), d, f.dof)[:, 0]
    chance = _by_chance(f, [columns[k] for k in bases], rng)
    strongest_first = np.argsort(-strength, kind="stable")  # equal p values keep that order
    places = list(bases)
    return {places[k]: share_beyond(chance, float(strength[k])) for k in strongest_first}


def _ratios(left: FloatArray, bases: Sequence[FloatArray], dof: int, floor: float) -> FloatArray:
    """The F statistic of every column, (columns, replicates).

    The variance of the scatter is at least ``floor``.
    """
    total = np.sum(left**2, axis=0)
    found = []
    for base in bases:
        d = base.shape[1]
        explained = np.sum((base.T @ left) ** 2, axis=0)
        found.append((explained / d) / np.maximum((total - explained) / max(dof - d, 1), floor))
    return np.array(found)


def _strengths(ratios: FloatArray, d: NDArray[np.int64], dof: int) -> FloatArray:
    """Minus the log of the p value of F statistics (columns, replicates) with ``d`` (columns,) degrees of freedom."""
    d = d[:, None]
    return np.asarray(-f_distribution.logsf(ratios, d, np.maximum(dof - d, 1)))


def _by_chance(f: ColumnFit, columns: Sequence[Regressor], rng: np.random.Generator) -> FloatArray:
    """The strongest column in every campaign that the fitted law makes, (replicates,)."""
    n = f.tested.n
    drawn = f.left[rng.integers(0, n, (n, REPLICATES))] * np.sqrt(n / max(f.dof, 1))
    if (lacking := f.floor - float(f.left @ f.left) / max(f.dof, 1)) > 0:
        drawn = drawn + rng.normal(0.0, np.sqrt(lacking), drawn.shape)
    spread = np.sqrt(_VARIANCES[f.at] * f.variance)
    groups = f.whitenings[f.at].groups
    drawn = drawn + groups @ rng.normal(0.0, spread, (groups.shape[1], REPLICATES)) if spread else drawn
    lefts = [w.left(drawn) for w in f.whitenings]
    scores = [w.score(np.sum(left**2, axis=0)) for w, left in zip(f.whitenings, lefts, strict=True)]
    chosen = np.argmax(scores, axis=0)
    strongest = np.zeros(REPLICATES)
    for at in np.unique(chosen):
        bases = [b for c in columns if (b := f.basis(c, int(at))).shape[1]]
        ratios, d = _ratios(lefts[at][:, chosen == at], bases, f.dof, f.floor), np.array([b.shape[1] for b in bases])
        sizes = np.unique(d)
        highest = np.array([ratios[d == size].max(axis=0) for size in sizes])  # of equal size, the strongest
        strongest[chosen == at] = _strengths(highest, sizes, f.dof).max(axis=0)
    return strongest


def _described(f: ColumnFit, column: Regressor, p: float) -> ColumnEffect:
    """The size of a column's effect with its interval, and what reproduces it."""
    white = f.whitenings[f.at].left(column.columns * f.root[:, None])
    inverse = np.linalg.pinv(white.T @ white)
    size = inverse @ (white.T @ f.left)
    dof = max(f.dof - len(size), 1)
    variance = max(float(np.sum((f.left - white @ size) ** 2)) / dof, f.floor)
    first, last, where = _ends(column, size)
    contrast = last - first
    value = float(contrast @ size)
    half = float(t_distribution.ppf(0.95, dof) * np.sqrt(variance * contrast @ inverse @ contrast))
    low, middle, high = (100.0 * float(np.expm1(value + k * half)) for k in (-1, 0, 1))
    effect = white @ size
    alike: list[str] = []
    length = float(effect @ effect)
    for other in f.tested.columns:
        if other.name == column.name or length == 0.0:
            continue
        if float(np.sum((f.basis(other, f.at).T @ effect) ** 2)) > ALIKE * length:
            alike.append(other.name)
    names = tuple(dict.fromkeys(alike))
    same = next((group for group in f.tested.same if column.name in group), (column.name,))[1:]
    return ColumnEffect(column.name, column.kind, f.tested.regime, p, middle, low, high, where, names, same)


def _first_alike(f: ColumnFit, column: Regressor) -> Regressor:
    """Of the columns that this design cannot tell apart, the first: the same one in both regimes."""
    alike = {column.name, *_described(f, column, 1.0).alike}
    first = next(c.name for c in f.tested.columns if c.name in alike)
    same = [c for c in f.tested.columns if c.name == first and c.kind == column.kind]
    return same[0] if same else column


def _ends(column: Regressor, size: FloatArray) -> tuple[FloatArray, FloatArray, tuple[str, str]]:
    """Between which levels the change is stated: the ends of a trend, else the lowest and the highest level."""
    if column.kind == "trend":
        return np.zeros(1), np.ones(1), (f"{column.low:.3g}", f"{column.high:.3g}")
    levels = np.vstack([np.zeros(len(size)), np.eye(len(size))])
    heights = levels @ size
    first, last = int(np.argmin(heights)), int(np.argmax(heights))
    return levels[first], levels[last], (column.levels[first], column.levels[last])


def with_repeats(lack: TooLittle, ingested: Ingested) -> TooLittle:
    """The same with the repeats that scatter most: tests of one sample at one load and equal settings.

    Settings are speed, hold, stiffness, and further columns in which several tests share each of the values.
    """
    tests = [t for t in ingested.used_tests if t.normal_load_N > 0]
    further = {name: [t.covariates.get(name, "") for t in tests] for name in tests[0].covariates} if tests else {}
    set_on_purpose = [name for name, values in further.items() if 2 * len(set(values)) <= len(values)]
    found = []
    for sample in dict.fromkeys(t.sample for t in tests):
        of_sample = [t for t in tests if t.sample == sample]
        levels = load_levels(np.array([t.normal_load_N for t in of_sample]))
        kinds = [
            (int(level), t.speed_m_s, t.hold_s, t.stiffness_N_per_m, *map(t.covariates.get, set_on_purpose))
            for level, t in zip(levels, of_sample, strict=True)
        ]
        for kind in dict.fromkeys(kinds):
            repeats = [t for t, own in zip(of_sample, kinds, strict=True) if own == kind]
            load = float(np.median([t.normal_load_N for t in repeats]))
            for regime in REGIMES:
                forces = np.array([getattr(ingested.pulls[t.test_id], f"{regime}_N") for t in repeats], float)
                forces = forces[forces > 0]
                if forces.size > 1:
                    factor = float(forces.max() / forces.min())
                    found.append(replace(lack, repeated=(regime, sample, load), repeats=forces.size, factor=factor))
    return max(found, key=lambda repeated: repeated.factor, default=lack)
