"""What the law of a mechanism is given: the baseline and the conditions of every test."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tribo.display import displayed
from tribo.records import STANDARD_GRAVITY, FloatArray
from tribo.user_text import are_numbers, is_number

StringArray = NDArray[np.str_]
Values = FloatArray  # the parameters of one mechanism, in the order of its record
REFERENCE_SPEED_M_S = 2e-4  # the pull speed of the paper
REFERENCE_HOLD_S = 1.0
REFERENCE_PRESSURE_PA = 1e4


@displayed()
@dataclass(frozen=True)
class Forces:
    """Static and sliding friction force of every test, N, shape (n,)."""

    static_N: FloatArray
    sliding_N: FloatArray


@displayed()
@dataclass(frozen=True)
class Base:
    """The baseline law of every test, T = mu N + tau0 A, as arrays of shape (n,).

    ``by_sample`` holds the same four numbers (static mu, static tau0 A, sliding mu, sliding tau0 A) for each
    sample of the campaign: what a test would follow if its specimen were another sample; ``flat`` names the
    flat sample among them.
    """

    static_mu: FloatArray
    static_adhesion_N: FloatArray
    sliding_mu: FloatArray
    sliding_adhesion_N: FloatArray
    by_sample: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    flat: str = "F"

    def forces(self, normal_load_N: FloatArray) -> Forces:
        """Both forces under a normal load of shape (n,)."""
        return Forces(
            self.static_mu * normal_load_N + self.static_adhesion_N,
            self.sliding_mu * normal_load_N + self.sliding_adhesion_N,
        )

    def as_sample(self, sample: str) -> Base:
        """The same tests, had they all been made on ``sample``."""
        filled = [np.full_like(self.static_mu, value) for value in self.by_sample[sample]]
        return replace(
            self,
            static_mu=filled[0],
            static_adhesion_N=filled[1],
            sliding_mu=filled[2],
            sliding_adhesion_N=filled[3],
        )


@displayed()
@dataclass(frozen=True)
class Gaps:
    """The cells of a column of numbers that were not recorded, and what is known of them.

    Parameters
    ----------
    missing : array (n,) of bool
        The tests without a value.
    expected : array (n,)
        What stands there: the expectation given the other columns and the neighbours in time. Unit of the column.
    draws : array (n, m)
        Equally likely values of every test, those of a recorded one all the same.
    """

    missing: NDArray[np.bool_]
    expected: FloatArray
    draws: FloatArray

    def mean_of(self, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """The mean over the draws of a function of numbers (n,), of any shape."""
        return np.asarray(np.mean([function(draw) for draw in self.draws.T], axis=0))


def numbers_in(column: StringArray) -> FloatArray | None:
    """A column of text as numbers, NaN where a cell has none; None where most cells hold something else."""
    if not are_numbers(column.tolist()):
        return None
    return np.array([number if is_number(cell) and np.isfinite(number := float(cell)) else np.nan for cell in column])


def is_level(column: StringArray, level: str) -> FloatArray:
    """1 where a column of names has this one, 0 where it has another, (n,); where it has none, the share of this one
    among the names that were recorded."""
    here, recorded = column == level, column != ""
    share = float(here[recorded].mean()) if recorded.any() else 0.0
    return np.where(recorded, here * 1.0, share)


def levels_of(column: StringArray) -> list[str]:
    """The names in a column, gaps left out, in alphabetical order."""
    return [str(name) for name in np.unique(column) if name]


def names_in(cell: str) -> list[str]:
    """The names in a cell that may hold several, separated by semicolons."""
    return [name.strip() for name in cell.split(";") if name.strip()]


@displayed()
@dataclass(frozen=True)
class Conditions:
    """What is recorded about every test, arrays of shape (n,); NaN where a column is not recorded.

    ``rim_per_m`` is rim length per nominal area, ``cavity_width_m`` the smaller cavity size (0 on a flat sample),
    ``elongation`` ln(long/short) of the cavity, positive when pulled along its long side and negative across it,
    ``specimen_run`` counts the pulls of a specimen from 1, ``elapsed_s`` the time since the first pull, ``clock_h`` the
    time of day (empty where no time was recorded), ``clip_N`` = k v / (2 f_s), the mean loss of a peak between two
    samples of the recorder.
    ``columns`` holds every further recorded column as text, names that were not recorded being empty. ``gaps`` are the
    cells of columns of numbers that were filled, by the name of the field or column; ``told_names`` marks the tests
    (n,) whose name was not recorded and follows from other tests, by column. ``pattern`` names the pattern of
    each test: ``Sx`` and ``Sy`` may be S along x and y, or patterns of these names. ``without`` names the mechanisms
    that were removed for a test, separated by semicolons; it is empty where none was removed for any test.
    ``mass_kg`` is what was put on the slider; it is empty where no test states it.
    """

    normal_load_N: FloatArray
    nominal_area_m2: float
    area_fraction: FloatArray
    rim_per_m: FloatArray
    cavity_width_m: FloatArray
    elongation: FloatArray
    sample: StringArray
    pattern: StringArray
    specimen: StringArray
    speed_m_s: FloatArray
    hold_s: FloatArray
    specimen_run: FloatArray
    run_order: FloatArray
    elapsed_s: FloatArray
    temperature_C: FloatArray
    humidity_pct: FloatArray
    clip_N: FloatArray
    columns: Mapping[str, StringArray] = field(default_factory=dict)
    without: StringArray = field(default_factory=lambda: np.array([], str))
    gaps: Mapping[str, Gaps] = field(default_factory=dict)
    told_names: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    mass_kg: FloatArray = field(default_factory=lambda: np.array([]))
    clock_h: FloatArray = field(default_factory=lambda: np.array([]))

    def recorded(self, name: str) -> FloatArray:
        """A column of numbers by the name of its field, (n,), NaN where none was recorded."""
        values = np.asarray(getattr(self, name), float)
        return np.where(self.not_recorded(name), np.nan, values)

    def not_recorded(self, name: str) -> NDArray[np.bool_]:
        """The tests (n,) without a recorded value of a column, whatever stands in its place; of a column that is always
        there none."""
        if name in self.gaps:
            return self.gaps[name].missing
        if name in self.columns:
            return (self.columns[name] == "") | self.told_names.get(name, False)
        return np.zeros(len(self.normal_load_N), bool)

    def present(self, mechanism: str) -> NDArray[np.bool_]:
        """Tests for which this mechanism was not removed, (n,)."""
        if not len(self.without):
            return np.ones(len(self.normal_load_N), bool)
        return np.array([mechanism not in names_in(cell) for cell in self.without])

    @property
    def weight_N(self) -> FloatArray:
        """Weight of what was put on the slider, (n,); the whole normal load where no mass is stated."""
        if not len(self.mass_kg):
            return self.normal_load_N
        return np.where(np.isfinite(self.mass_kg), self.mass_kg * STANDARD_GRAVITY, self.normal_load_N)

    @property
    def pressure_Pa(self) -> FloatArray:
        """Nominal pressure p = N / A."""
        return self.normal_load_N / self.nominal_area_m2

    @property
    def contact_pressure_Pa(self) -> FloatArray:
        """Pressure on the contact area, p / AF."""
        return self.pressure_Pa / self.area_fraction
