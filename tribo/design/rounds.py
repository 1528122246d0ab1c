"""The search: runs of few blocks over the whole family, a surrogate, more runs where it matters, and fine runs last.

Every design meets the same random numbers, so that differences between designs are sharper than their values. All runs
go through the one scheduler into files of their own; what they hold is not made again, and what is run next follows
from them alone. A search that was stopped therefore ends with the same answer. The surrogate is a smooth stand-in for
the model: Gaussian processes over the free lengths, with a trend in the area fraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from tribo.design.target import Space, Target, Want
from tribo.records import FloatArray, Pattern
from tribo.springblock.config import SimConfig
from tribo.springblock.ensemble import run_seed
from tribo.springblock.kept_runs import run_stored

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Surrogate:
    """ln(T/N) of one response: a quadratic trend in the last input, and a Gaussian process on what it leaves.

    ``left_out`` is the root mean square error of each point predicted from all others.
    """

    inputs: FloatArray  # (n, d)
    trend: FloatArray
    scales: FloatArray
    weights: FloatArray
    left_out: float

    def __call__(self, x: FloatArray) -> FloatArray:
        """Predictions at points (m, d)."""
        return np.asarray(basis(x) @ self.trend + kernel(x, self.inputs, self.scales) @ self.weights)


def basis(x: FloatArray) -> FloatArray:
    return np.column_stack([np.ones(len(x)), x[:, -1], x[:, -1] ** 2])


def kernel(a: FloatArray, b: FloatArray, scales: FloatArray) -> FloatArray:
    """Matern 5/2 of unit variance."""
    r = np.sqrt(5.0 * (((a[:, None] - b[None]) / scales) ** 2).sum(-1))
    return np.asarray((1.0 + r + r * r / 3.0) * np.exp(-r))


def fitted(x: FloatArray, y: FloatArray, noise: float) -> Surrogate:
    """The surrogate of most likely lengths and noise for values y (n,) at x (n, d) in the unit cube."""
    trend = np.linalg.lstsq(basis(x), y, rcond=None)[0]
    left = y - basis(x) @ trend
    spread = max(float(left.std()), 1e-4)

    def covariance(logs: FloatArray) -> FloatArray:
        share = np.exp(2 * logs[-1]) + (noise / spread) ** 2
        return np.asarray(kernel(x, x, np.exp(logs[:-1])) + share * np.eye(len(x)))

    def cost(logs: FloatArray) -> float:
        try:
            c, low = cho_factor(covariance(logs))
        except np.linalg.LinAlgError:
            return 1e9
        z = left / spread
        return float(0.5 * z @ cho_solve((c, low), z) + np.log(np.diag(c)).sum() + 0.02 * (logs**2).sum())

    start = np.append(np.full(x.shape[1], np.log(0.7)), np.log(0.1))
    bounds = [(np.log(0.1), np.log(10.0))] * x.shape[1] + [(np.log(1e-3), 0.0)]
    best = minimize(cost, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 60}).x
    inverse = np.linalg.inv(covariance(best))
    weights = inverse @ left
    left_out = float(np.sqrt(np.mean((weights / np.diag(inverse)) ** 2)))
    return Surrogate(x, np.asarray(trend, float), np.exp(best[:-1]), weights, left_out)


COARSE_RUNS, FINE_RUNS = 2, 4
FIRST, ROUNDS, BATCH, FINAL = 14, 3, 5, 6
FEW = 2  # free lengths of a family, along which friction is smooth enough for few designs and coarse runs
FURTHER = 2.7  # times as many first designs for every length beyond these: 38 and 102
ROUNDS_OF_MANY, BATCH_OF_MANY, CLIMBED, BESIDE = 6, 8, 3, 128  # of many lengths: also designs beside the best few
CANDIDATES = 2048
APART = 0.05  # of the span of a length or of the area fraction, between two designs of a round
# blocks a side, their spacing in m, time step in s: of the search, of its answers, and of the mesh error on one patch
MESHES = {
    "coarse": (40, 5e-6, 1e-7), "fine": (80, 2.5e-6, 5e-8), "patch": (48, 2.5e-6, 5e-8),
    "halved": (96, 1.25e-6, 2.5e-8),
}  # fmt: skip
SPREAD_DEG = 10.0
FINE_SEED = 100  # added to the seed for fine runs, of what was measured too: both meet the same random numbers
CLOSE = 0.25  # tolerances; finer differences of a prediction are within the scatter of its runs (5 % and 1 to 2 %)
BEYOND = 100.0  # a tenth of a standard deviation beyond counts as much as e times the doubt
Response = tuple[str, float, str]  # regime, pressure in Pa, direction
Lengths = dict[str, float]
Sds = Mapping[Response, FloatArray]  # standard deviations of ln(T/N)
Missed = Callable[[int, Sequence[Lengths]], Mapping[Response, tuple[FloatArray, FloatArray]]]
Say = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Rounds:
    """What all rounds of runs share: families, what is wanted of each design, and where and how runs are made."""

    spaces: Sequence[Space]
    wanted: Sequence[Response]
    folder: Path
    seed: int
    jobs: int


@dataclass(frozen=True)
class Tried:
    """One design: its family, lengths, and ln(T/N) of every response with its standard error."""

    space: int
    lengths_um: Lengths
    logs: dict[Response, float]
    errors: dict[Response, float]


Surrogates = dict[int, dict[Response, Surrogate]]  # of each family and response


def responses(target: Target) -> list[Response]:
    """What has to be simulated: each regime, pressure and direction once."""
    found: dict[Response, None] = {}
    for want in target.target:
        for direction in (want.direction, want.over):
            if direction is not None:
                regimes = ("static", "sliding") if want.friction == "static over sliding" else (want.friction,)
                found.update({(regime, target.pressure_Pa(want), direction): None for regime in regimes})
    return list(found)


def reached(want: Want, target: Target, logs: dict[Response, float] | dict[Response, FloatArray]) -> FloatArray:
    """ln of the wanted quantity, from ln(T/N) of the responses."""
    p = target.pressure_Pa(want)
    if want.friction == "static over sliding":
        value = np.asarray(logs[("static", p, want.direction)]) - np.asarray(logs[("sliding", p, want.direction)])
    else:
        value = np.asarray(logs[(want.friction, p, want.direction)])
    if want.over is not None:
        value = value - np.asarray(logs[(want.friction, p, want.over)])
    return value


def misses(want: Want, target: Target, logs: dict[Response, float] | dict[Response, FloatArray]) -> FloatArray:
    """By how many tolerances the wanted quantity is missed, zero within bounds; for a best value, its own measure."""
    value = reached(want, target, logs)
    tolerance = math.log1p(want.tolerance_percent / 100)
    if want.best is not None:
        return np.asarray((-value if want.best == "largest" else value) / tolerance)
    goal = target.goal(want)
    if goal is not None:
        return np.asarray(np.abs(value - math.log(goal)) / tolerance)
    low = math.log(want.at_least) if want.at_least else -math.inf
    high = math.log(want.at_most) if want.at_most else math.inf
    return np.asarray(np.maximum(np.maximum(low - value, value - high), 0.0) / tolerance)


def cost(target: Target, logs: dict[Response, float] | dict[Response, FloatArray]) -> FloatArray:
    """What a search makes small: misses beyond bounds and values squared, best values as they are."""
    return np.asarray(sum(
        misses(w, target, logs) if w.best else misses(w, target, logs) ** 2 for w in target.target
    ))  # fmt: skip


def involved(want: Want, target: Target) -> list[Response]:
    """The responses that a wanted quantity is made of."""
    regimes = ("static", "sliding") if want.friction == "static over sliding" else (want.friction,)
    directions = [d for d in (want.direction, want.over) if d is not None]
    return [(regime, target.pressure_Pa(want), d) for regime in regimes for d in directions]


def model_sd(want: Want, target: Target, sds: Sds) -> FloatArray:
    """Standard deviation of ln of a wanted quantity from that of the model in its responses.

    A ratio of one sample shares most of the model's error; half of it is kept.
    """
    parts = np.array([sds[r] for r in involved(want, target)])
    return np.asarray(parts.max(axis=0) * (0.5 if len(parts) > 1 else 1.0))


def cost_once_measured(target: Target, logs: dict[Response, FloatArray], sds: Sds) -> FloatArray:
    """What a search makes small once something was measured: of designs that are predicted within ``CLOSE`` of the
    tolerance, the one of which the model is surest comes first; the others follow by their misses over that doubt.

    The chance to meet the target is no measure to go by: it prefers a design beside the measured one, which is sure to
    miss by little, to the step that would meet. Where nothing is predicted close, it is the doubt that leaves a chance.
    """
    total = np.zeros(())
    for want in target.target:
        if want.best is not None:
            total = total + misses(want, target, logs)
            continue
        tolerance = math.log1p(want.tolerance_percent / 100)
        close = CLOSE if target.goal(want) is not None else 0.0
        beyond = tolerance * np.maximum(misses(want, target, logs) - close, 0.0)
        doubt = np.hypot(model_sd(want, target, sds), CLOSE * tolerance)
        total = total + BEYOND * (beyond / doubt) ** 2 + np.log(doubt)
    return np.asarray(total)


@dataclass(frozen=True)
class Aim:
    """What every choice of a search goes by: what is wanted of which families, and what the model misses on them.

    ``missed`` gives, for designs of a family, ln(measured over predicted) of every response with its standard
    deviation. Where nothing was ``measured`` that is the same for all designs, and the plain cost decides.
    """

    target: Target
    spaces: Sequence[Space]
    missed: Missed
    measured: bool = False

    def corrected(
        self, number: int, lengths: Sequence[Lengths], logs: Mapping[Response, FloatArray]
    ) -> tuple[dict[Response, FloatArray], Sds]:
        """ln(T/N) of designs of a family with what the model misses added, and the standard deviation of that."""
        missed = self.missed(number, lengths)
        return {r: logs[r] + missed[r][0] for r in logs}, {r: missed[r][1] for r in logs}

    def costs(self, number: int, lengths: Sequence[Lengths], logs: Mapping[Response, FloatArray]) -> FloatArray:
        """What a search makes small, of designs of a family with ln(T/N) as the model predicts them."""
        corrected, sds = self.corrected(number, lengths, logs)
        return cost_once_measured(self.target, corrected, sds) if self.measured else cost(self.target, corrected)

    def corrected_design(self, t: Tried) -> dict[Response, float]:
        """ln(T/N) of one design that was run, with what the model misses added."""
        missed = self.missed(t.space, [t.lengths_um])
        return {r: v + float(missed[r][0][0]) for r, v in t.logs.items()}

    def cost_of(self, t: Tried) -> float:
        """What a search makes small, of one design that was run."""
        return float(self.costs(t.space, [t.lengths_um], {r: np.array([v]) for r, v in t.logs.items()})[0])


SMALLEST_PATCH = 0.7  # of the blocks of a mesh along each side


def in_whole_periods(pattern: Pattern, base: SimConfig) -> tuple[int, int]:
    """Blocks of a mesh, or fewer, such that the patch holds whole periods of a pattern as nearly as its spacing allows:
    its area fraction is then that of the sample. All where one period is longer than the patch."""
    if pattern.pitch_m is None:
        return base.blocks
    found = []
    for most, pitch in zip(base.blocks, pattern.pitch_m, strict=True):
        n = np.arange(most, math.ceil(SMALLEST_PATCH * most) - 1, -1)
        periods = n * base.spacing_m / pitch
        found.append(int(n[np.argmin(np.abs(periods - np.maximum(np.round(periods), 1.0)) / periods)]))
    return found[0], found[1]


def designed(
    patterns: Sequence[Pattern], wanted: Sequence[Response], base: SimConfig, runs: int, seed: int
) -> list[SimConfig]:
    """The runs of some patterns: each pressure and direction, the same seeds and angles for every pattern."""
    points = list(dict.fromkeys((p, d) for _, p, d in wanted))
    found = []
    for pattern in patterns:
        blocks = in_whole_periods(pattern, base)
        for pressure, direction in points:
            low, high = (0.0, 90.0) if direction == "all" else (-SPREAD_DEG, SPREAD_DEG)
            middle = 90.0 if direction == "y" else 0.0
            for k in range(runs):
                angle = middle + low + (high - low) * (k + 0.5) / runs
                found.append(base.with_(
                    sample="P", pattern=pattern, blocks=blocks, pressure_Pa=pressure, angle_deg=angle,
                    seed=run_seed(seed, direction, pressure, k),
                ))  # fmt: skip
    return found


def tried(
    all_rounds: Rounds, name: str, chosen: Sequence[tuple[int, Lengths]], base: SimConfig, runs: int, seed: int,
    progress: Callable[[int, int], None] | None,
) -> list[Tried]:  # fmt: skip
    """Run some designs, or read their runs, and return their means."""
    patterns = [all_rounds.spaces[number].pattern(lengths) for number, lengths in chosen]
    configs = designed(patterns, all_rounds.wanted, base, runs, seed)
    table = run_stored(configs, all_rounds.folder / f"{name}.h5", all_rounds.jobs, progress=progress)
    means = friction_of(table, all_rounds.wanted, runs)
    return [Tried(*design, *mean) for design, mean in zip(chosen, means, strict=True)]


def friction_of(
    table: pd.DataFrame, wanted: Sequence[Response], runs: int
) -> list[tuple[dict[Response, float], dict[Response, float]]]:
    """ln(T/N) of every response and its standard error, of each pattern whose runs :func:`designed` made."""
    points = list(dict.fromkeys((p, d) for _, p, d in wanted))
    values = {
        regime: np.log(table[f"{regime}_friction"].to_numpy(float)).reshape(-1, len(points), runs)
        for regime in ("static", "sliding")
    }
    found = []
    for k in range(len(table) // (len(points) * runs)):
        cells = {r: values[r[0]][k, points.index(r[1:])] for r in wanted}
        found.append((
            {r: float(np.log(np.exp(v).mean())) for r, v in cells.items()},
            {r: float(v.std(ddof=1) / math.sqrt(runs)) if runs > 1 else 0.05 for r, v in cells.items()},
        ))  # fmt: skip
    return found


def surrogates_of(spaces: Sequence[Space], known: Sequence[Tried]) -> Surrogates:
    """One surrogate for each family and response."""
    found: Surrogates = {}
    for number, space in enumerate(spaces):
        own = [t for t in known if t.space == number]
        if len(own) < 4:
            continue
        x = np.array([space.at(t.lengths_um) for t in own])
        found[number] = {
            r: fitted(x, np.array([t.logs[r] for t in own]), 0.3 * float(np.mean([t.errors[r] for t in own])))
            for r in own[0].logs
        }
    return found


def promising(
    aim: Aim, known: Sequence[Tried], surrogates: Surrogates, shift: dict[Response, float], n: int, seed: int
) -> list[tuple[int, Lengths]]:
    """The n designs of least expected cost that lie apart from each other and are not known yet."""
    pool: list[tuple[float, int, Lengths, FloatArray]] = []
    for number, space in enumerate(aim.spaces):
        candidates = space.candidates(CANDIDATES, seed)
        if not candidates or number not in surrogates:
            continue
        if has_many_lengths([space]):
            best = sorted((t for t in known if t.space == number), key=aim.cost_of)[:CLIMBED]
            candidates += [each for t in best for each in space.candidates_near(t.lengths_um, BESIDE, seed)]
        x = np.array([space.at(lengths) for lengths in candidates])
        logs = {r: s(x) + shift.get(r, 0.0) for r, s in surrogates[number].items()}
        costs = aim.costs(number, candidates, logs).tolist()
        pool += [(c, number, lengths, at) for c, lengths, at in zip(costs, candidates, x, strict=True)]
    seen = {(t.space, tuple(t.lengths_um.values())) for t in known}
    chosen: list[tuple[int, Lengths]] = []
    places: list[tuple[int, FloatArray]] = []
    for _, number, lengths, at in sorted(pool, key=lambda item: item[0]):
        far = all(number != k or np.abs(at - other).max() >= APART for k, other in places)
        if far and (number, tuple(lengths.values())) not in seen:
            chosen.append((number, lengths))
            places.append((number, at))
        if len(chosen) == n:
            break
    return chosen


def on_mesh(base: SimConfig, name: str) -> SimConfig:
    """The model on a mesh of ``MESHES``."""
    n, spacing, dt = MESHES[name]
    return base.with_(blocks=(n, n), spacing_m=spacing, thickness_m=base.layer_m, dt_s=dt, rest_tolerance=1e-2)


def first_designs(space: Space) -> int:
    """How many designs of a family are run before a surrogate chooses."""
    return round(FIRST * FURTHER ** max(len(space.free) - FEW, 0))


def has_many_lengths(spaces: Sequence[Space]) -> bool:
    """Whether coarse runs order the designs of a family too poorly to search with them."""
    return any(len(space.free) > FEW for space in spaces)


def rounds_of(spaces: Sequence[Space]) -> tuple[int, int]:
    """How many rounds follow, and how many designs each has."""
    return (ROUNDS_OF_MANY, BATCH_OF_MANY) if has_many_lengths(spaces) else (ROUNDS, BATCH)


def search(
    all_rounds: Rounds, aim: Aim, base: SimConfig, say: Say
) -> tuple[list[Tried], list[Tried], list[Tried], Surrogates]:
    """Coarse runs over each family, rounds of more where the surrogate expects the target, then fine ones.

    Families of many lengths have fine runs from the start, as coarse ones order their designs poorly
    (docs/results/design.md).

    Returns all coarse designs, the fine ones, best first, the best one on the patch of the fine mesh and of half of
    it, and the surrogates.
    """
    spaces, wanted, seed = all_rounds.spaces, all_rounds.wanted, all_rounds.seed
    coarse, fine, patch, halved = (on_mesh(base, name) for name in MESHES)
    points = len({r[1:] for r in wanted})
    # a fine run takes about as long as twelve coarse ones
    searched, weight = (fine, 12) if has_many_lengths(spaces) else (coarse, 1)
    turns, batch_size = rounds_of(spaces)
    steps = (sum(first_designs(space) for space in spaces) + turns * batch_size) * COARSE_RUNS * points * weight
    total, done = steps + 2 * FINAL * FINE_RUNS * points * 12, 0

    def made(
        name: str, chosen: Sequence[tuple[int, Lengths]], config: SimConfig, runs: int, own: int, weight: int
    ) -> list[Tried]:
        nonlocal done
        before = done
        found = tried(
            all_rounds, name, chosen, config, runs, own,
            lambda k, n: say("designing", min(before + k * weight, total), total),
        )  # fmt: skip
        done += len(chosen) * runs * points * weight
        return found

    first = [(k, lengths) for k, space in enumerate(spaces) for lengths in space.candidates(first_designs(space), seed)]
    known = made("first", first, searched, COARSE_RUNS, seed, weight)
    for turn in range(turns):
        batch = promising(aim, known, surrogates_of(spaces, known), {}, batch_size, seed + 1 + turn)
        if batch:
            known += made(f"round-{turn + 1}", batch, searched, COARSE_RUNS, seed, weight)
    surrogates = surrogates_of(spaces, known)
    best = sorted(known, key=aim.cost_of)[: FINAL // 2]
    chosen = [(t.space, t.lengths_um) for t in best]
    fine_first = made("fine-1", chosen, fine, FINE_RUNS, seed + FINE_SEED, 12)
    # what the finer mesh changes is nearly the same for neighbours: aim again with it taken into account
    shift = {r: float(np.mean([f.logs[r] - c.logs[r] for f, c in zip(fine_first, best, strict=True)])) for r in wanted}
    again = promising(aim, fine_first, surrogates, shift, FINAL - len(fine_first), seed + 50)
    fine_all = fine_first + (made("fine-2", again, fine, FINE_RUNS, seed + FINE_SEED, 12) if again else [])
    # a few runs of one design tell little of their scatter, which is much alike for all
    scatter = {r: math.sqrt(np.mean([t.errors[r] ** 2 for t in fine_all])) for r in wanted}
    fine_all = [replace(t, errors=scatter) for t in fine_all]
    fine_all.sort(key=aim.cost_of)
    distinct: list[Tried] = []
    for t in fine_all:
        x = spaces[t.space].at(t.lengths_um)
        near = any(t.space == o.space and np.abs(x - spaces[o.space].at(o.lengths_um)).max() < 0.04 for o in distinct)
        if not near and len(distinct) < aim.target.designs:
            distinct.append(t)
    pairs = [(t.space, t.lengths_um) for t in distinct[:1]]
    finer = made("mesh-2", pairs, patch, 2, seed + 200, 6) + made("mesh-1", pairs, halved, 2, seed + 200, 40)
    return known, distinct, finer, surrogates
