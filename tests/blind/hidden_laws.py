"""Laws outside the library that a virtual tribometer can hide: 27 forms with places drawn anew for every campaign.

A form changes ln T of every test by a course of recorded columns. The strength of a hidden law is the length of its
change in units of the scatter of repeats, its mean over every specimen taken out; the default is about three times what
is needed to see anything at all. Formulas and numbers are this file's own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from tribo.records import Ingested

from .bench import Bench, Design
from .direct import ingested
from .patterns import open_share
from .tribometer import hide

STRENGTH = 12.0
SPEEDS, HOLDS = (0.07, 0.13, 0.2, 0.41, 0.77), (4.0, 17.0, 90.0, 480.0)
SETS = (("F", "A", "B", "C"), ("F", "B", "C", "Sx", "Sy"), ("F", "A", "C", "Sy"))
SERIES = frozenset({"run_order", "elapsed_s"})  # one pull every seven minutes: the same but for the nights
STATIC, SLIDING, BOTH = (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)


Course = Callable[[pd.DataFrame, np.ndarray, pd.DataFrame], np.ndarray]


@dataclass(frozen=True)
class Truth:
    """What is right to say of a hidden law: sets of columns that are the same, regimes, samples and kinds of shape."""

    columns: tuple[frozenset[str], ...]
    regimes: tuple[float, float]
    samples: frozenset[str]
    kinds: frozenset[str]


@dataclass(frozen=True)
class Hidden:
    """A campaign with a law hidden in it: the ``bench``, the ``change`` (n, 2) of ln T, what is right to say, and the
    ``strength`` in this campaign."""

    bench: Bench
    change: np.ndarray
    truth: Truth
    strength: float


@dataclass(frozen=True)
class Form:
    """A family of laws: the ``course`` of a table and of numbers in (0, 1) that place it, and how it is to be named."""

    columns: tuple[frozenset[str] | str, ...]
    kinds: frozenset[str]
    course: Course
    regimes: tuple[float, float] = BOTH
    where: str = "all"  # all, patterned, share (of the cavities), one
    term: str = ""  # mu or tau where a part of T alone changes


def _x(name: str) -> Callable[[pd.DataFrame], np.ndarray]:
    return lambda t: t[name].to_numpy(float)


def _x_of(name: str) -> Course:
    return lambda t, u, r: _x(name)(t)


def _place(x: np.ndarray, u: float) -> float:
    """Between the 30th and the 70th percentile."""
    return float(np.quantile(x, 0.3 + 0.4 * u))


def _over(name: str) -> Course:
    return lambda t, u, r: (_x(name)(t) > _place(_x(name)(r), u[0])) * 1.0


def _soft(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    return np.tanh((_x("film_um")(t) - _place(_x("film_um")(r), u[0])) / 0.23)


def _hinge(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    return np.clip(_x("humidity_pct")(t) - _place(_x("humidity_pct")(r), u[0]), 0.0, None)


def _best(name: str) -> Course:
    return lambda t, u, r: -((_x(name)(t) - _place(_x(name)(r), u[0])) ** 2)


def _tent(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    return -np.abs(_x("film_um")(t) - _place(_x("film_um")(r), u[0]))


def _bell(name: str) -> Course:
    def course(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
        known = _x(name)(r)
        return np.exp(-(((_x(name)(t) - _place(known, u[0])) / (0.19 * np.ptp(known))) ** 2))

    return course


def _fading(name: str, reach: float) -> Course:
    def course(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
        known = _x(name)(r)
        return np.exp(-(_x(name)(t) - known.min()) / (reach * (0.8 + 0.4 * u[0]) * np.ptp(known)))

    return course


def _rest_under_load(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    return np.log1p(_x("hold_s")(t) / 2.3) * _x("N")(t) ** (0.5 + 0.4 * u[0])


def _warm_and_damp(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    names, low = ("temperature_C", "humidity_pct"), 0.1 + 0.1 * u[0]
    warm, damp = (_x(name)(t) - np.quantile(_x(name)(r), low) for name in names)
    return np.clip(warm, 0.0, None) * np.clip(damp, 0.0, None)


def _film_and_speed(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    return _x("film_um")(t) * np.log(_x("speed_mm_s")(t) / 0.05)


def _from_to(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    x = _x("run_order")(t) / len(r)
    begin = 0.15 + 0.4 * u[0]
    return ((x > begin) & (x < begin + 0.19 + 0.12 * u[1])) * 1.0


def _after_change(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    x = _x("run_order")(t)
    return (x > len(r) * (0.25 + 0.5 * u[0])) * 1.0


def _swing(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    turns = 2.3 + 5.1 * u[0]
    return np.sin(2 * np.pi * (turns * _x("run_order")(t) / len(r) + u[1]))


def _middle_speed(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    return -(np.log(_x("speed_mm_s")(t) / (0.16 + 0.1 * u[0])) ** 2)


def _named(t: pd.DataFrame, u: np.ndarray, r: pd.DataFrame) -> np.ndarray:
    return (t["lot"] == "q7").to_numpy() * 1.0


STEP, RAMP = frozenset({"step", "soft step"}), frozenset({"ramp"})
PEAK, LINE = frozenset({"optimum", "hump"}), frozenset({"linear"})
POWER, FADE = frozenset({"log"}), frozenset({"saturating", "log"})
TIMES, STRETCH = frozenset({"product"}), frozenset({"window", "hump"})
FORMS: dict[str, Form] = {
    "threshold of temperature": Form(("temperature_C",), STEP, _over("temperature_C")),
    "threshold of humidity, static": Form(("humidity_pct",), STEP, _over("humidity_pct"), STATIC),
    "soft threshold of film": Form(("film_um",), STEP | {"ramp"}, _soft),
    "hinge of humidity, sliding": Form(("humidity_pct",), RAMP, _hinge, SLIDING),
    "optimum of temperature, sliding": Form(("temperature_C",), PEAK, _best("temperature_C"), SLIDING),
    "tent of film": Form(("film_um",), PEAK, _tent),
    "bell of humidity, static": Form(("humidity_pct",), PEAK, _bell("humidity_pct"), STATIC),
    "line of film, static": Form(("film_um",), LINE, _x_of("film_um"), STATIC),
    "power of film, sliding": Form(("film_um",), FADE, lambda t, u, r: np.log(_x("film_um")(t)), SLIDING),
    "decay with film": Form(("film_um",), FADE, _fading("film_um", 0.2)),
    "hold times pressure, static": Form(("hold_s", frozenset({"pressure_Pa", "contact_pressure_Pa"})), TIMES,
                                        _rest_under_load, STATIC),
    "temperature times humidity": Form(("temperature_C", "humidity_pct"), TIMES, _warm_and_damp),
    "film times speed, sliding": Form(("film_um", "speed_m_s"), TIMES, _film_and_speed, SLIDING),
    "start of the series": Form((SERIES,), FADE, _fading("run_order", 0.17)),
    "change in the series": Form((SERIES,), STEP | {"window"}, _after_change),
    "stretch of the series": Form((SERIES,), STRETCH, _from_to),
    "wave over the series": Form((SERIES,), frozenset({"wave"}), _swing),
    "line of temperature, one sample": Form(("temperature_C",), LINE, _x_of("temperature_C"), where="one"),
    "threshold of film, one sample, static": Form(("film_um",), STEP, _over("film_um"), STATIC, "one"),
    "bell of humidity, patterned": Form(("humidity_pct",), PEAK, _bell("humidity_pct"), where="patterned"),
    "power of hold, sliding": Form(("hold_s",), POWER, lambda t, u, r: np.log(_x("hold_s")(t)), SLIDING),
    "optimum of speed": Form(("speed_m_s",), PEAK, _middle_speed),
    "line of film, by cavities": Form(("film_um",), LINE, _x_of("film_um"), where="share"),
    "lot, patterned": Form(("lot",), frozenset({"level"}), _named, where="patterned"),
    "line of film, adhesion": Form(("film_um",), LINE, _x_of("film_um"), term="tau"),
    "optimum of temperature, load": Form(("temperature_C",), PEAK, _best("temperature_C"), term="mu"),
    "run-in of one sample": Form(("specimen_run",), FADE, _fading("specimen_run", 0.2), where="one"),
}  # fmt: skip


def law_design(seed: int) -> Design:
    """Three specimens, six loads, three repeats (of which benchmarks keep one for judging); errors at random."""
    rng = np.random.default_rng([seed, 71])
    scale = rng.uniform(0.5, 1.2)
    return Design(
        samples=SETS[rng.integers(len(SETS))], repeats=3, speeds_mm_s=SPEEDS, holds_s=HOLDS,
        repeat_sd=(0.09 * scale, 0.07 * scale), specimen_sd=float(rng.uniform(0.02, 0.06)),
        specimen_slope=float(rng.uniform(0.0, 0.04)), pattern_error=float(rng.uniform(0.5, 1.5)),
    )  # fmt: skip


def hide_law(seed: int, form: str, law: int | None = None, strength: float = STRENGTH) -> Hidden:
    """A campaign from ``seed`` with a law of this form. An empty form hides nothing; the columns are the same.

    Places and amplitude are those of the campaign ``law`` where one is given: the same law in another campaign, whose
    samples are those of the first.
    """
    design = law_design(seed) if law is None else replace(law_design(seed), samples=law_design(law).samples)
    bench = _bench(seed, design)
    if not form:
        nothing = Truth((), (0.0, 0.0), frozenset(), frozenset())
        return Hidden(bench, np.zeros((len(bench.tests), 2)), nothing, 0.0)
    first = bench if law is None else _bench(law, law_design(law))
    number = seed if law is None else law
    size = strength / _strength(_change(first, first.tests, FORMS[form], number)[0], first, law_design(number))
    change, truth = _change(bench, first.tests, FORMS[form], number)
    change = size * change
    bench.static, bench.sliding = bench.static * np.exp(change[:, 0]), bench.sliding * np.exp(change[:, 1])
    return Hidden(bench, change, truth, _strength(change, bench, design))


def _bench(seed: int, design: Design) -> Bench:
    """A campaign without any effect, with further columns that nothing follows."""
    bench = hide(seed, [], design)
    rng = np.random.default_rng([seed, 72])
    bench.tests["film_um"] = rng.uniform(0.7, 6.4, len(bench.tests)).round(2)
    bench.tests["lot"] = rng.choice(["q3", "q5", "q7"], len(bench.tests))
    bench.tests["wear_um"] = rng.normal(12.0, 3.1, len(bench.tests)).round(1)
    return bench


def _change(bench: Bench, first: pd.DataFrame, form: Form, law: int) -> tuple[np.ndarray, Truth]:
    """The change of ln T (n, 2) by the law at size one, its places from the table of the ``first`` campaign."""
    rng = np.random.default_rng([law, 73])
    places, up = rng.uniform(size=2), rng.choice([-1.0, 1.0])
    samples = sorted(set(bench.column("sample")))
    patterned = [s for s in samples if s != "F"]
    chosen = {"all": samples, "one": [str(rng.choice(patterned))]}.get(form.where, patterned)
    weight = bench.of_sample(open_share) if form.where == "share" else np.isin(bench.column("sample"), chosen) * 1.0
    course = form.course(bench.tests, places, first)
    change = (up * (course - form.course(first, places, first).mean()) * weight)[:, None] * np.array(form.regimes)
    columns = tuple(c if isinstance(c, frozenset) else frozenset({c}) for c in form.columns)
    truth = Truth(columns, form.regimes, frozenset(chosen), form.kinds)
    if form.term:
        share = bench.adhesion_N() / np.column_stack([bench.static, bench.sliding])
        change = change * np.clip(share if form.term == "tau" else 1.0 - share, 0.0, 1.0)
    return change, truth


def _strength(change: np.ndarray, bench: Bench, design: Design) -> float:
    """Length of a change in units of the repeats, the mean of every specimen taken out."""
    left = pd.DataFrame(change).groupby(bench.column("specimen")).transform(lambda v: v - v.mean()).to_numpy()
    kept = left[bench.column("repeat") < design.repeats]
    return float(np.sqrt(np.sum((kept / design.repeat_sd) ** 2)))


def as_ingested(bench: Bench, seed: int, keep: np.ndarray) -> Ingested:
    """The tests that ``keep`` marks, with their further columns."""
    whole = ingested(bench, seed)
    further = [{"film_um": str(r.film_um), "lot": r.lot, "wear_um": str(r.wear_um)} for r in bench.tests.itertuples()]
    tests = tuple(
        replace(t, covariates=columns)
        for t, columns, kept in zip(whole.campaign.tests, further, keep, strict=True)
        if kept
    )
    return replace(whole, campaign=replace(whole.campaign, tests=tests, root=Path("hidden")))
