"""Forces far from those of their siblings: the other pulls of the same sample, load and specimen.

A number that was typed or read wrongly lies far outside of the scatter of its siblings, also where there is one repeat
and there are three specimens. It is a doubt, never removed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tribo.fits import REGIMES
from tribo.fitting.linear import SAME_LOAD, levels_of
from tribo.records import Campaign, Doubt, FloatArray, Ingested
from tribo.user_text import plain

BoolArray = NDArray[np.bool_]

CHANCE = 0.005  # of naming any pull of one regime in a campaign whose repeats scatter with the tails below
TAILS = 6.0  # degrees of freedom of Student's t for the scatter of repeats: one in a thousand is 6 deviations off
SPREADS = 400  # simulated campaigns of the same design
LEAST_RATIO = 1.15  # less is not a slip, whatever the scatter
SPLIT = 5.0  # ratio between equal pulls that no scatter of repeats or specimens gives, and a wrong unit exceeds
FEWEST_SPLIT, LEAST_SPLIT = 3, 0.25  # cells, and the share of all, that a slip of many exports splits
LOADS_APART = 0.1  # by which two loads differ, as ln, at the least: the line of loads that are alike leads anywhere
FEWEST_LEVELS = 3  # of load, beyond which a power is told from a line
FEWEST_MOVED, MOVED_LEFT = 4, 0.4  # tests in a block of moved loads, and the share that is left when put back
MOST_NAMED = 3
MOST_ALONE = 5  # single pulls of one sample that are off the same way; more are told together
NEARLY_ALL, HARDLY_ANY = 0.9, 0.1  # shares of the tests that are off, and of the others, with one value of a column
FEWEST_COPIED, COPIED_SHARE, COPIED_DIGITS = 3, 0.25, 3  # pairs of forces with so many digits, equal by chance hardly
FACTORS = {10.0: "ten", 100.0: "a hundred", 1000.0: "a thousand"}
AS_MUCH = 0.1  # by which two corrections of a group differ in what they leave, at the most, if neither is better
NEAR = 0.25  # by which a factor may differ from that of a slip, as ln


# pulls of one regime, each (n,): test_id, sample, specimen, load_N, log_force; and the numbers of the level of load, of
# the cell (one sample at one load) and of the body (one specimen in one sample) that a pull belongs to
Pulls = Mapping[str, np.ndarray]


def sibling_doubts(
    ingested: Ingested, *, plausible: tuple[float, float] = (0.0, math.inf), seed: int = 0
) -> tuple[Doubt, ...]:
    """A doubt for every pull, and for every group of pulls, whose forces are far from those of its siblings.

    Parameters
    ----------
    ingested : Ingested
        Pulls with their tests.
    plausible : tuple of float
        The least and the largest T/N: where half of the pulls differ from the others by a factor, those are wrong
        without which the samples are within them.
    seed : int
        Draws the campaigns of the same design from which it is known how far chance goes.
    """
    campaign, table = ingested.campaign, ingested.table()
    found: dict[str, dict[str, tuple[float, float, float]]] = {}
    doubts: list[Doubt] = []
    if len(table) and (moved := _moved(campaign, table)):
        doubts, table = [moved[0]], moved[1]
    groups: list[tuple[set[str], float, list[str]]] = []
    for regime in REGIMES if len(table) else ():
        pulls = _pulls_of(table, regime)
        if len(pulls["log_force"]) < 6:
            continue
        apart, log_factor = _split(pulls, plausible)
        if apart.any():
            names = set(pulls["test_id"][apart].tolist())
            same = [group for group in groups if abs(group[1] - log_factor) < NEAR and group[0] & names]
            if same:
                same[0][0].update(names)
                same[0][2].append(regime)
            else:
                groups.append((names, log_factor, [regime]))
        mended = pulls["log_force"] - np.where(apart, log_factor, 0.0)
        for k, deviation, reach in _far(pulls, mended, seed):
            if not apart[k]:
                expected = float(np.exp(pulls["log_force"][k] - deviation))
                found.setdefault(str(pulls["test_id"][k]), {})[regime] = (deviation, expected, reach)
    for names, log_factor, regimes in groups:
        doubts.append(_of_group(campaign, sorted(names), log_factor, regimes, len(table)))
    doubts += _copied(table)
    return (*doubts, *_of_pulls(ingested, found))


def _moved(campaign: Campaign, table: pd.DataFrame) -> tuple[Doubt, pd.DataFrame] | None:
    """The doubt that a block of rows has the loads of the rows beside them, and the table with the loads put back.

    By the laws of the samples, the block that gains most where each of its tests has the load of the next row, or of
    the one before. The load that is left over is that of the other end of the block, where it fits there.
    """
    stated = [t.test_id for t in campaign.tests]
    loads = pd.Series([t.normal_load_N for t in campaign.tests], stated)
    best: tuple[float, int, int, int] = (0.0, 0, 0, 0)
    next_N, before_N = loads.shift(-1), loads.shift(1)
    off, with_next, with_before = _beside_laws(table, next_N, before_N)
    for step, theirs, beside in ((1, next_N, with_next), (-1, before_N, with_before)):
        changed = (~np.isclose(loads, theirs, rtol=SAME_LOAD)) & np.isfinite(theirs.to_numpy())
        total = np.concatenate([[0.0], np.cumsum(np.where(changed, np.nan_to_num(off - beside), 0.0))])
        last = int(np.argmax(total - np.minimum.accumulate(total)))
        first = int(np.argmin(total[: last + 1]))
        rows = first + np.flatnonzero(changed[first:last] & np.isfinite(off[first:last]))
        fits = beside[rows].sum() < MOVED_LEFT * off[rows].sum()
        if len(rows) >= FEWEST_MOVED and fits and total[last] - total[first] > best[0]:
            best = (float(total[last] - total[first]), step, first, last)
    won, step, first, last = best
    if not won:
        return None
    low, high = (first, last + 1) if step > 0 else (first - 1, last)
    block = stated[low:high]
    back = pd.Series(np.roll(loads.iloc[low:high].to_numpy(), -step), block)
    end = block[-1] if step > 0 else block[0]
    off, beside = _beside_laws(table, pd.Series(back[end], stated))
    if not beside[stated.index(end)] < off[stated.index(end)]:
        back[end] = loads[end]
    mended = table.assign(normal_load_N=table["test_id"].map(back).fillna(table["normal_load_N"]))
    column = "mass_g" if any(t.load_from == "mass_g" for t in campaign.tests) else "normal_load_N"
    moved = tuple(i for i in block if not math.isclose(back[i], loads[i], rel_tol=SAME_LOAD))
    doubt = Doubt(
        "siblings", f"{column} from test {moved[0]} to {moved[-1]}",
        f"by the forces that of the {'next row' if step > 0 else 'row before'}", "that of its own test",
        f"tests.csv, column {column}",
        f"a cell was put in or taken out: move {column} {'up' if step > 0 else 'down'} by one row there?", tests=moved,
    )  # fmt: skip
    return doubt, mended


def _beside_laws(table: pd.DataFrame, *others_N: pd.Series) -> FloatArray:
    """How far ln T of each test lies from the line of its sample, at its own load and at k ``others_N``, (1 + k, n).

    The larger of both regimes; nan where there is no force.
    """
    index = others_N[0].index
    found = np.full((1 + len(others_N), len(index)), np.nan)
    for regime in REGIMES:
        pulls = _pulls_of(table, regime)
        names = pulls["test_id"]
        if len(names) < 6:
            continue
        at, known = index.get_indexer(pd.Index(names)), np.ones(len(names), bool)
        loads = np.array([other[names].to_numpy(float) for other in others_N])
        for _ in range(2):  # once more without those that the first laws find far off
            left = np.abs(_beside_line_at(pulls, loads, known))
            known = left[0] < max(3.0 * float(np.median(left[0])), math.log(LEAST_RATIO))
        found[:, at] = np.fmax(found[:, at], left)
    return found


def _beside_line_at(pulls: Pulls, others_N: FloatArray, known: BoolArray) -> FloatArray:
    """ln T less that of the line of its sample through the ``known`` pulls, at its own load and at others, (1 + k, n).

    ``others_N`` are k loads of each pull, (k, n).
    """
    left = np.empty((1 + len(others_N), len(known)))
    for rows, use in _of_each_sample(pulls, known):
        load, force = pulls["load_N"][rows], np.exp(pulls["log_force"][rows])
        others = others_N[:, rows]
        every = np.concatenate([load, np.where(others > 0, others, load).ravel()])
        ratio = np.tile(force / load, len(left))
        fitted = np.concatenate([use, np.zeros(others.size, bool)])
        line = _median_line(1.0 / every, ratio, every, fitted) * every
        line = np.log(np.maximum(line, 1e-3 * float(np.median(force))))
        left[:, rows] = np.log(force) - line.reshape(len(left), -1)
    return left


def _copied(table: pd.DataFrame) -> Iterator[Doubt]:
    """Samples whose forces are those of another sample at the same loads, digit by digit."""
    if not len(table):
        return
    forces = table[["static_N", "sliding_N"]].to_numpy(float)
    told = np.isfinite(forces).any(axis=1) & (table["normal_load_N"] > 0).to_numpy()
    rows = table[told]
    keys = pd.Series([tuple(pair) for pair in np.nan_to_num(forces[told], nan=0.0)], index=rows.index)
    digits = [max(len(f"{x:.9g}".strip("-0.").replace(".", "")) for x in pair) for pair in keys]
    samples = rows["sample"].to_numpy(str)
    for sample in sorted(set(samples)):
        own = keys[(samples == sample) & (np.array(digits) >= COPIED_DIGITS)]
        for other in sorted(set(samples)):
            theirs = set(keys[samples == other])
            same = [key for key in own if key in theirs] if other > sample else []
            if len(same) >= max(FEWEST_COPIED, COPIED_SHARE * len(own)):
                found = f"{len(same)} of {len(own)} pairs of forces are those of sample {other}, digit by digit"
                slip = "copied from one to the other?"
                name = f"friction of sample {sample}"
                both = tuple(rows["test_id"][[key in set(same) for key in keys]].astype(str))
                where = "tests.csv, static_N and sliding_N, or the records"
                yield Doubt("siblings", name, found, "numbers of its own", where, slip, tests=both)


def _pulls_of(table: pd.DataFrame, regime: str) -> Pulls:
    rows = table[(table[f"{regime}_N"] > 0) & (table["normal_load_N"] > 0)]
    load = rows["normal_load_N"].to_numpy(float)
    sample, specimen = rows["sample"].to_numpy(str), rows["specimen"].to_numpy(str)
    level = pd.factorize(levels_of(load))[0]
    cell, body = (pd.factorize(pd.MultiIndex.from_arrays([sample, kind]))[0] for kind in (level, specimen))
    return {
        "test_id": rows["test_id"].to_numpy(str), "sample": sample, "specimen": specimen, "load_N": load,
        "log_force": np.log(rows[f"{regime}_N"].to_numpy(float)), "level": level, "cell": cell, "body": body,
    }  # fmt: skip


def _split(pulls: Pulls, plausible: tuple[float, float]) -> tuple[np.ndarray, float]:
    """The wrong part of the pulls, (n,) of bool, where many cells fall into two parts, and ln of its factor.

    Wrong is the part without which T/N is plausible; where both or none are, the one whose correction leaves less
    beside the laws of the samples, and the smaller one where both leave as much, as where every cell is split.
    """
    low, high = np.zeros((2, len(pulls["log_force"])), bool)
    factors, several = [], 0
    for cell in range(pulls["cell"].max() + 1):
        rows = np.flatnonzero(pulls["cell"] == cell)
        several += len(rows) > 1
        order = rows[np.argsort(pulls["log_force"][rows])]
        steps = np.diff(pulls["log_force"][order])
        if len(rows) > 1 and steps.max() > math.log(SPLIT):
            at = int(np.argmax(steps)) + 1
            low[order[:at]], high[order[at:]] = True, True
            factors.append(pulls["log_force"][order[at:]].mean() - pulls["log_force"][order[:at]].mean())
    if len(factors) < max(FEWEST_SPLIT, LEAST_SPLIT * several):
        return np.zeros(len(low), bool), 0.0
    factor = float(np.median(factors))
    either = []
    for part, log_factor in ((low, -factor), (high, factor)):
        beside = _beside_line(pulls, pulls["log_force"] - np.where(part, log_factor, 0.0))
        wrong = part | (np.abs(beside - log_factor) < NEAR)
        log_ratio = pulls["log_force"] - np.where(wrong, log_factor, 0.0) - np.log(pulls["load_N"])
        samples = pulls["sample"]
        usual = [float(np.exp(np.median(log_ratio[samples == sample]))) for sample in np.unique(samples)]
        odd = not all(plausible[0] <= ratio <= plausible[1] for ratio in usual)
        left = float(np.abs(_beside_law(pulls, pulls["log_force"] - np.where(wrong, log_factor, 0.0))).mean())
        either.append((odd, left, int(wrong.sum()), wrong, log_factor))
    (odd, left, *_), (other_odd, other_left, *_) = either
    by = 0 if odd != other_odd else 1 if abs(left - other_left) > AS_MUCH * max(left, other_left) else 2
    *_, wrong, log_factor = min(either, key=lambda found: found[by])
    return wrong, log_factor


def _far(pulls: Pulls, log_force: FloatArray, seed: int) -> Iterator[tuple[int, float, float]]:
    """Place, deviation of ln T from the siblings, and the deviation that chance reaches, of each pull beyond it.

    Siblings that are far themselves are no measure: those that are far are judged once more, by the others.
    """
    left = _from_siblings(pulls, _beside_law(pulls, log_force)[:, None])[:, 0]
    rng = np.random.default_rng(seed)
    drawn = _from_siblings(pulls, rng.standard_t(TAILS, (len(left), SPREADS)))
    spread = _spread(pulls, left[:, None])[:, 0]
    if not (spread > 0).any():
        return
    limit = float(np.quantile((np.abs(drawn) / _spread(pulls, drawn)).max(axis=0), 1.0 - CHANCE))
    reach = np.maximum(limit * spread, math.log(LEAST_RATIO))
    far = np.abs(left) > reach
    if far.any():
        left = _from_siblings(pulls, _beside_law(pulls, log_force, ~far)[:, None], ~far)[:, 0]
        for k in np.flatnonzero(far & (np.abs(left) > reach)):
            yield int(k), float(left[k]), float(limit * spread[k])


def _beside_line(pulls: Pulls, log_force: FloatArray, known: BoolArray | None = None) -> FloatArray:
    """ln T less that of a straight line T = mu N + T0 of its sample, shape (n,), through the ``known`` of the pulls."""
    left = np.empty_like(log_force)
    for rows, use in _of_each_sample(pulls, known):
        load, own = pulls["load_N"][rows], log_force[rows]
        line = _median_line(1.0 / load, np.exp(own) / load, load, use) * load
        left[rows] = own - (np.log(line) if (line > 0).all() else np.median(own[use]))
    return left


def _beside_law(pulls: Pulls, log_force: FloatArray, known: BoolArray | None = None) -> FloatArray:
    """The same, or less T = a N^b of a sample of which that leaves less."""
    left = _beside_line(pulls, log_force, known)
    for rows, use in _of_each_sample(pulls, known):
        load, own = pulls["load_N"][rows], log_force[rows]
        if len(np.unique(pulls["level"][rows][use])) > FEWEST_LEVELS:
            power = own - _median_line(np.log(load), own, load, use)
            left[rows] = min(left[rows], power, key=lambda off: float(np.abs(off[use]).sum()))
    return left


def _of_each_sample(pulls: Pulls, known: BoolArray | None) -> Iterator[tuple[np.ndarray, BoolArray]]:
    """The rows of each sample, and which of them are known: all where none is or nothing is said."""
    for sample in np.unique(pulls["sample"]):
        rows = np.flatnonzero(pulls["sample"] == sample)
        use = np.ones(len(rows), bool) if known is None else known[rows]
        yield rows, use if use.any() else ~use


def _median_line(x: FloatArray, y: FloatArray, load_N: FloatArray, use: BoolArray) -> FloatArray:
    """A straight line at x, through (x, y) in ``use`` by repeated medians (Siegel 1982), of loads that are apart."""
    log_load, at, value = np.log(load_N[use]), x[use], y[use]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.where(
            np.abs(log_load[:, None] - log_load[None, :]) > LOADS_APART,
            (value[:, None] - value[None, :]) / (at[:, None] - at[None, :]), np.nan,
        )  # fmt: skip
    told = np.isfinite(slopes).any(axis=1)
    slope = float(np.median(np.nanmedian(slopes[told], axis=1))) if told.any() else 0.0
    return np.asarray(slope * x + np.median(value - slope * at))


def _from_siblings(pulls: Pulls, values: FloatArray, known: BoolArray | None = None) -> FloatArray:
    """Values, shape (n, m), less the medians of their cells and specimens of three pulls or more (Tukey's polish).

    The medians are those of the ``known`` pulls, all where nothing is said.
    """
    use = np.ones(len(values), bool) if known is None else known
    left = values - np.median(values[use], axis=0)
    for _ in range(3):
        for kinds in (pulls["cell"], pulls["body"]):
            for kind in range(kinds.max() + 1):
                rows = kinds == kind
                if (rows & use).sum() > 2:
                    left[rows] -= np.median(left[rows & use], axis=0)
    return left


def _spread(pulls: Pulls, left: FloatArray) -> FloatArray:
    """Robust standard deviation at each pull, shape (n, m): of the whole campaign, or of its load where that is larger.

    The smaller half of what a polish leaves is near zero: the 75 % quantile of the absolute values is taken.
    """
    size = np.abs(left)
    quantile = 1.15  # of a normal deviate, that three quarters of the absolute values are below
    spread = np.broadcast_to(np.quantile(size, 0.75, axis=0) / quantile, size.shape).copy()
    for level in range(pulls["level"].max() + 1):
        rows = np.flatnonzero(pulls["level"] == level)
        if len(rows) >= 6:
            spread[rows] = np.maximum(spread[rows], np.quantile(size[rows], 0.75, axis=0) / quantile)
    return spread


def _times(log_factor: float) -> str:
    """ "a hundred times" or "1.6 times"."""
    factor = math.exp(abs(log_factor))
    plain = f"{factor:.2g}" if factor < 100.0 else f"{float(f'{factor:.2g}'):.0f}"
    near = next((words for f, words in FACTORS.items() if abs(math.log(factor / f)) < NEAR), plain)
    return f"{near} times"


def _slip(log_factor: float, *, group: bool) -> str:
    factor = math.exp(abs(log_factor))
    smaller = log_factor < 0
    if abs(math.log(factor / 1000.0)) < NEAR:
        return "the forces are in " + ("kilonewtons" if smaller else "millinewtons") + ": state the unit in [columns]?"
    if group and abs(math.log(factor / 9.80665)) < NEAR / 5:
        unit = "kilogram-force" if smaller else "another unit"
        return f"the forces are in {unit}: state the unit in [columns]?"
    if abs(math.log(factor / 101.97)) < NEAR and not smaller:
        return "the forces are in gram-force: state the unit in [columns]?"
    if any(abs(math.log(factor / f)) < NEAR for f in (10.0, 100.0)):
        return "a decimal point in the load or in the force, or another range of the load cell?"
    return "another load, another specimen or another sample than stated, or a damaged record?"


def _of_pulls(
    ingested: Ingested, found: Mapping[str, Mapping[str, tuple[float, float, float]]]
) -> Iterator[Doubt]:
    """Doubts about single pulls, the furthest first; of many of one sample that are off the same way, one doubt."""
    tests = {t.test_id: t for t in ingested.campaign.tests}
    farther = {name: max(own, key=lambda regime: abs(own[regime][0])) for name, own in found.items()}
    order = sorted(found, key=lambda name: -abs(found[name][farther[name]][0]))
    kinds: dict[tuple[str, bool], list[str]] = {}
    for name in order:
        kinds.setdefault((tests[name].sample, found[name][farther[name]][0] > 0), []).append(name)
    for name in order:
        (deviation, expected, reach), test = found[name][farther[name]], tests[name]
        way = "above" if deviation > 0 else "below"
        together = kinds[test.sample, deviation > 0]
        if len(together) <= MOST_ALONE:
            low, high = expected * math.exp(-reach), expected * math.exp(reach)
            also = "" if len(found[name]) == 1 else ", and the other force as well"
            yield Doubt(
                "siblings", f"{farther[name]} friction of test {name} ({test.sample} at {plain(test.normal_load_N)} N)",
                f"{plain(expected * math.exp(deviation))} N, {_far_off(deviation)} {way} its siblings{also}",
                f"{plain(low)} to {plain(high)} N", f"tests.csv, {test.file}".removesuffix(", "),
                _slip(deviation, group=False), tests=(name,),
            )  # fmt: skip
        elif name == together[0]:
            least = _far_off(found[together[-1]][farther[together[-1]]][0])
            regimes = [regime for regime in REGIMES if any(regime in found[other] for other in together)]
            yield Doubt(
                "siblings", f"{' and '.join(regimes)} friction of {len(together)} tests of {test.sample}",
                f"between {least} and {_far_off(deviation)} {way} that of siblings", "no more than the others scatter",
                f"tests {_some_of(together)}{_in_common(ingested.campaign, together)}",
                "another load, another specimen or another sample than stated, the beginning of a series, or damaged "
                "records?", tests=tuple(together),
            )  # fmt: skip


def _far_off(deviation: float) -> str:
    """ "18 %" or "a factor of 410", of a deviation of ln T."""
    factor = _times(deviation).removesuffix(" times")
    return f"{100 * abs(math.expm1(deviation)):.0f} %" if abs(deviation) < math.log(3) else f"a factor of {factor}"


def _some_of(test_ids: Sequence[str]) -> str:
    more = f" and {len(test_ids) - MOST_NAMED} more" if len(test_ids) > MOST_NAMED else ""
    return f"{', '.join(test_ids[:MOST_NAMED])}{more}"


def _of_group(
    campaign: Campaign, test_ids: Sequence[str], log_factor: float, regimes: Sequence[str], tests: int
) -> Doubt:
    """The doubt about many pulls that are off by one factor, with what they have in common."""
    way = "larger" if log_factor > 0 else "smaller"
    return Doubt(
        "siblings", f"{' and '.join(regimes)} friction of {len(test_ids)} of {tests} tests",
        f"about {_times(log_factor)} {way} than that of equal tests", "one unit and one range for all exports",
        f"tests {_some_of(test_ids)}{_in_common(campaign, test_ids)}", _slip(log_factor, group=True),
        tests=tuple(test_ids),
    )  # fmt: skip


def _in_common(campaign: Campaign, test_ids: Sequence[str]) -> str:
    """ ", all of day 2026-03-04": the value of a column that (nearly) all of these tests have and hardly any other."""
    chosen = set(test_ids)
    stated = ("started_at", "operator", "specimen", "sample", "repeat")
    recorded = dict.fromkeys(name for t in campaign.tests for name in t.covariates)
    for name in (*stated, *recorded):
        end = 10 if name == "started_at" else None
        values = [
            (t.test_id in chosen, str((t.covariates if name in recorded else vars(t)).get(name) or "")[:end])
            for t in campaign.tests
        ]
        inside, outside = ([v for own, v in values if own == side] for side in (True, False))
        words = {"started_at": "day"}.get(name, name)
        if not set(inside) & set(outside) and "" not in inside and len(set(inside)) <= MOST_NAMED:
            return f", all of {words} {', '.join(sorted(set(inside)))}"
        usual = max(inside, key=inside.count, default="")
        share, elsewhere = inside.count(usual) / max(len(inside), 1), outside.count(usual) / max(len(outside), 1)
        if usual and share >= NEARLY_ALL and elsewhere <= HARDLY_ANY:
            return f", {'all' if share == 1.0 else f'{inside.count(usual)} of them'} of {words} {usual}"
    return ""
