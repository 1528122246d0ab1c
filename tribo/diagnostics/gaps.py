"""Recorded columns with gaps: what stands in a cell that was not recorded, and how far the true value may lie from it.

Each gap of a column of numbers is filled once, before anything is fitted, with the expectation of the column given the
other columns (ridge regression) and its neighbours in time on the same day. The friction takes no part in this: the
effect of a column whose gaps are filled so is neither larger nor smaller on average (regression calibration: Carroll,
Ruppert, Stefanski and Crainiceanu, Measurement Error in Nonlinear Models, 2nd ed. 2006, chapter 4).

A gap in a column of names is filled where the tests around it leave no doubt: a lot belongs to a specimen, an operator
works for hours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tribo.mechanisms.conditions import Conditions, Gaps, numbers_in
from tribo.mechanisms.record import StringArray
from tribo.records import FloatArray

FEWEST_RECORDED, LEAST_RECORDED = 8, 0.2  # values, and share of the tests, from which on gaps are filled
DRAWS = 7  # values for a gap, equally likely
NEIGHBOURS = (4, 8, 16)  # in time on the same day; the number that predicts recorded values best
PENALTIES = np.geomspace(0.1, 1e4, 11)  # of the ridge regression on standardised columns, in tests
CERTAIN = 0.95  # share of recorded names that a rule has to find for gaps to be filled by it
FILLED = ("temperature_C", "humidity_pct", "speed_m_s", "hold_s")
LOGARITHM, FROM_LOGARITHM = {"speed_m_s": np.log, "hold_s": np.log1p}, {"speed_m_s": np.exp, "hold_s": np.expm1}


def with_gaps_filled(c: Conditions, day: StringArray) -> Conditions:
    """The same conditions with every gap of a column of numbers filled, and what is known of it in ``gaps``; and with
    the names that the tests around a gap tell, the tests concerned in ``told_names``.

    A column with too few values for that keeps its gaps, as do the times and the order of the tests. ``day`` (n,) is
    the date of every test, empty where it is not known.
    """
    of_conditions = {name: getattr(c, name) for name in FILLED}
    further = {name: n for name, column in c.columns.items() if (n := numbers_in(column)) is not None}
    to_fill = {name: values for name, values in {**of_conditions, **further}.items() if is_to_be_filled(values)}
    when = c.elapsed_s if np.isfinite(c.elapsed_s).any() else c.run_order
    names = {name: column for name, column in c.columns.items() if name not in further and (column == "").any()}
    told = {name: told_names(column, c.specimen, when, day) for name, column in names.items()}
    c = replace(
        c, columns={**c.columns, **told},
        told_names={name: (names[name] == "") & (column != "") for name, column in told.items()},
    )  # fmt: skip
    if not to_fill:
        return c
    alongside = {**of_conditions, **further, "normal_load_N": c.normal_load_N}  # no time: a trend is not for long gaps
    gaps = {name: gaps_of(name, alongside, when, day) for name in to_fill}
    filled = {name: np.where(gap.missing, gap.expected, to_fill[name]) for name, gap in gaps.items()}
    columns = {name: filled[name].astype(str) if name in filled else column for name, column in c.columns.items()}
    own = {name: filled.get(name, values) for name, values in of_conditions.items()}
    return replace(
        c, temperature_C=own["temperature_C"], humidity_pct=own["humidity_pct"], speed_m_s=own["speed_m_s"],
        hold_s=own["hold_s"], columns=columns, gaps=gaps,
    )  # fmt: skip


def told_names(column: StringArray, specimen: StringArray, when: FloatArray, day: StringArray) -> StringArray:
    """A column of names (n,), its gaps filled where the tests around them tell the name.

    Two rules, each only where it finds at least CERTAIN of the recorded names, of FEWEST_RECORDED or more, without
    them: all others of the specimen have one name; the tests of the same day that were recorded last before and first
    after it have the same.
    """
    found = column.copy()
    for rule in (_of_specimen(column, specimen), _of_tests_around(column, when, day)):
        tried = (column != "") & (rule != "")
        if tried.sum() >= FEWEST_RECORDED and np.mean(rule[tried] == column[tried]) >= CERTAIN:
            found = np.where(found == "", rule, found)
    return found


def _of_specimen(column: StringArray, specimen: StringArray) -> StringArray:
    """The one name of the other tests of each specimen; empty where they have several or none."""
    found = np.zeros_like(column)
    for test, name in enumerate(specimen):
        others = column[(specimen == name) & (column != "") & (np.arange(len(column)) != test)]
        found[test] = others[0] if len(others) and (others == others[0]).all() else ""
    return found


def _of_tests_around(column: StringArray, when: FloatArray, day: StringArray) -> StringArray:
    """The name of the recorded tests of the same day just before and after each; empty where they differ."""
    found = np.zeros_like(column)
    known = np.flatnonzero((column != "") & np.isfinite(when) & (day != ""))
    for test in np.flatnonzero(np.isfinite(when) & (day != "")):
        there = known[(day[known] == day[test]) & (known != test)]
        before, after = there[when[there] <= when[test]], there[when[there] >= when[test]]
        if len(before) and len(after):
            last, first = column[before[np.argmax(when[before])]], column[after[np.argmin(when[after])]]
            found[test] = last if last == first else ""
    return found


def is_to_be_filled(values: FloatArray) -> bool:
    """Whether numbers (n,) have gaps, NaN, and values enough to say what may stand there."""
    known = values[np.isfinite(values)]
    return bool(len(known) < len(values) and enough_recorded(len(known), len(values)) and np.ptp(known) > 0)


def enough_recorded(known: int, tests: int) -> bool:
    """Whether a column with so many values, of so many tests, takes part."""
    return known == tests or known >= max(FEWEST_RECORDED, LEAST_RECORDED * tests)


def gaps_of(name: str, alongside: Mapping[str, FloatArray], when: FloatArray, day: StringArray) -> Gaps:
    """What is known of the gaps of one of several columns.

    Parameters
    ----------
    name : str
        The column, one of ``alongside``.
    alongside : mapping of str to array (n,)
        Columns of numbers, NaN where a value is missing.
    when : array (n,)
        Time or order of the tests, NaN where it is not known.
    day : array (n,) of str
        The day, within which neighbours in time are looked for.
    """
    to, back = LOGARITHM.get(name, np.asarray), FROM_LOGARITHM.get(name, np.asarray)
    column = to(np.where(alongside[name] > 0, alongside[name], np.nan)) if name == "speed_m_s" else to(alongside[name])
    known = np.isfinite(column)
    others = _standardised([values for other, values in alongside.items() if other != name], len(column))
    expected, unexplained = _regressed(column, others)
    local, error, has_neighbours = _followed_in_time(unexplained, when, day)
    expected = expected + local
    far = float(np.sqrt(np.mean(unexplained[known] ** 2)))
    near = float(np.sqrt(np.mean(error[known & has_neighbours] ** 2))) if has_neighbours.any() else far
    steps = np.quantile(error[known] - error[known].mean(), (np.arange(DRAWS) + 0.5) / DRAWS)
    steps = (steps - steps.mean()) / max(float(steps.std()), 1e-300)
    draws = back(expected[:, None] + np.where(has_neighbours, near, far)[:, None] * steps)
    least, most = np.nanmin(alongside[name]), np.nanmax(alongside[name])
    recorded = np.where(known, alongside[name], 0.0)[:, None]
    draws = np.where(known[:, None], recorded, np.clip(draws, least, most))
    return Gaps(~known, np.clip(back(expected), least, most), draws)


def _standardised(columns: list[FloatArray], n: int) -> FloatArray:
    """Columns (n, k) of mean zero and standard deviation one, missing values at the mean; without constant ones."""
    found = []
    for values in columns:
        known = np.isfinite(values)
        if known.sum() > 1 and np.std(values[known]) > 1e-9 * max(1.0, float(np.abs(values[known]).max())):
            found.append(np.where(known, (values - values[known].mean()) / values[known].std(), 0.0))
    return np.column_stack(found) if found else np.zeros((n, 0))


def _regressed(column: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The ridge regression of a column on others at every test, and what it leaves of each recorded value where that
    value takes no part in it (NaN elsewhere), (n,) each; the penalty is the one that leaves least."""
    known = np.isfinite(column)
    centre = others[known].mean(axis=0)
    y, mean = column[known] - column[known].mean(), float(column[known].mean())
    u, s, vt = np.linalg.svd(others[known] - centre, full_matrices=False)
    best = None
    for penalty in PENALTIES:
        shrunk = s**2 / (s**2 + penalty)
        leverage = 1.0 / len(y) + np.sum(u**2 * shrunk, axis=1)
        left = (y - u @ (shrunk * (u.T @ y))) / np.maximum(1.0 - leverage, 1e-3)
        if best is None or left @ left < best[0]:
            best = float(left @ left), left, vt.T @ ((s / (s**2 + penalty)) * (u.T @ y))
    assert best is not None
    error = np.full(len(column), np.nan)
    error[known] = best[1]
    return mean + (others - centre) @ best[2], error


def _followed_in_time(
    error: FloatArray, when: FloatArray, day: StringArray
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """What the neighbours of a test in time say of it, (n,), what that leaves of ``error``, and which tests have any.

    The mean over the nearest recorded ones of the same day, shrunk by as much as it predicts recorded ones.
    """
    known = np.flatnonzero(np.isfinite(error) & np.isfinite(when))
    nothing = np.zeros(len(error)), error, np.zeros(len(error), bool)
    best = float(np.nansum(error**2)), *nothing
    for most in NEIGHBOURS:
        mean, has = np.zeros(len(error)), np.zeros(len(error), bool)
        for test in np.flatnonzero(np.isfinite(when)):
            there = known[(day[known] == day[test]) & (known != test)]
            if len(there):
                nearest = there[np.argsort(np.abs(when[there] - when[test]), kind="stable")[:most]]
                mean[test], has[test] = error[nearest].mean(), True
        square = float(np.sum(mean[known] ** 2))
        share = float(np.clip(error[known] @ mean[known] / square, 0.0, 1.0)) if square > 0 else 0.0
        left = error - share * mean
        if share > 0 and float(np.nansum(left**2)) < best[0]:
            best = float(np.nansum(left**2)), share * mean, left, has
    return best[1:]
