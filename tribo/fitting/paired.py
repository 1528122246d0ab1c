"""Difference between two samples measured on the same specimens, such as one pattern pulled along x and along y.

Properties of a specimen (thickness, cut, glue) affect both of its laws and cancel in their difference. The mean of the
differences is therefore known better than the difference of two independent means. The scatter of the differences over
G specimens gives its interval by t(G-1).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from tribo.display import displayed
from tribo.fitting.budget import NUMBERS, PRESSURE_PA, label, sensitivities
from tribo.records import LawFit, Regime

if TYPE_CHECKING:
    import pandas as pd

_FEWEST = 2
_LEVEL = 0.95
_UNITS = {"mu": "", "tau0_kPa": " kPa", "T_N": " N"}


@displayed()
@dataclass(frozen=True)
class PairedDifference:
    """One number ("mu", "tau0_kPa", "T_N" at ``pressure_Pa``) of ``sample`` minus that of ``other``, same specimens.

    ``u`` is its standard uncertainty, ``unpaired_u`` what it would be with different specimens for each sample,
    ``low`` to ``high`` its 95 % interval by t(``dof``), ``p`` the probability of so large a difference by chance.
    """

    sample: str
    other: str
    regime: Regime
    number: str
    pressure_Pa: float
    difference: float
    u: float
    unpaired_u: float
    dof: float
    low: float
    high: float
    p: float
    specimens: tuple[str, ...]

    def text(self) -> str:
        """One sentence."""
        unit, name = _UNITS[self.number], label(self.number, self.pressure_Pa)
        verdict = "differ significantly" if self.p < 1 - _LEVEL else "do not differ significantly"
        return (
            f"{self.sample} and {self.other} {verdict} in {self.regime} {name}: {self.difference:+.3g}{unit} "
            f"[{self.low:.3g}, {self.high:.3g}] ({len(self.specimens)} specimens measured as both samples)"
        )


def paired_differences(fits: Iterable[LawFit], *, pressure_Pa: float = PRESSURE_PA) -> tuple[PairedDifference, ...]:
    """Differences between every two samples that share two specimens or more, by regime and number.

    Specimens are the same if their names in tests.csv are. Type B uncertainties that all pulls share (load cell,
    area) change both samples alike; they scale the difference and are not in its interval.
    """
    usable = [fit for fit in fits if len(fit.specimens) >= _FEWEST and fit.parameters == ("mu", "tau0_Pa")]
    return tuple(
        _difference(one, other, number, pressure_Pa)
        for one, other in combinations(usable, 2)
        if one.regime == other.regime and one.sample != other.sample and len(_shared(one, other)) >= _FEWEST
        for number in NUMBERS
    )


def _shared(one: LawFit, other: LawFit) -> tuple[str, ...]:
    return tuple(name for name in one.specimens if name in other.specimens)


def _difference(one: LawFit, other: LawFit, number: str, pressure_Pa: float) -> PairedDifference:
    from scipy.stats import t

    shared = _shared(one, other)
    row = sensitivities(one, pressure_Pa)[number]
    first, second = (np.array([row @ fit.specimens[name] for name in shared]) for fit in (one, other))
    apart = first - second
    mean, dof = float(apart.mean()), float(len(shared) - 1)
    u = float(apart.std(ddof=1) / np.sqrt(len(shared)))
    unpaired = float(np.hypot(first.std(ddof=1), second.std(ddof=1)) / np.sqrt(len(shared)))
    half = float(t.ppf(0.5 + _LEVEL / 2, dof)) * u
    p = float(2 * t.sf(abs(mean) / u, dof)) if u > 0 else float("nan")
    return PairedDifference(
        one.sample, other.sample, one.regime, number, pressure_Pa, mean, u, unpaired, dof, mean - half, mean + half, p,
        shared,
    )  # fmt: skip


def differences_table(differences: Iterable[PairedDifference]) -> pd.DataFrame:
    """One row per difference; the specimens in one cell."""
    import pandas as pd

    columns = [name for name in PairedDifference.__dataclass_fields__ if name != "specimens"]
    rows = [{**{c: getattr(d, c) for c in columns}, "specimens": ";".join(d.specimens)} for d in differences]
    return pd.DataFrame(rows, columns=[*columns, "specimens"])
