"""What a diagnosis hands on: the verdict with everything it rests on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnose.search.naming import Named
from tribo.diagnose.search.screen import Screen
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.verdict import Verdict
from tribo.display import displayed
from tribo.records import FloatArray

if TYPE_CHECKING:
    import pandas as pd

    from tribo.diagnose.discovery.search import Discovery


@displayed(lambda s: ", ".join(s.mechanisms))
@dataclass(frozen=True)
class SimulatedExtension:
    """What the spring-block model itself gives with the named mechanisms in it.

    ``log_force`` (n, 2) is ln T of every test by the extended model with the simulated effect, ``change`` (n, 2) that
    effect and ``quick`` (n, 2) the effect by the laws. ``table`` has one row a pair of runs. ``ratio`` is the simulated
    over the quick effect, least squares over the pairs, with its standard error.
    """

    mechanisms: tuple[str, ...]
    log_force: FloatArray
    change: FloatArray
    quick: FloatArray
    table: pd.DataFrame
    ratio: float
    ratio_u: float

    @property
    def off_percent(self) -> float:
        """Root mean square of simulated less quick effect over the pairs, percent of T."""
        left = self.table[["simulated_static", "simulated_sliding"]].to_numpy()
        right = self.table[["quick_static", "quick_sliding"]].to_numpy()
        return float(100 * np.sqrt(np.mean((left - right) ** 2)))


@displayed(lambda s: ", ".join(s.mechanisms))
@dataclass(frozen=True)
class NotSimulated:
    """Named mechanisms that could not be simulated, and why."""

    mechanisms: tuple[str, ...]
    reason: str


@displayed()
@dataclass(frozen=True)
class Alone:
    """A verdict without the spring-block model: what friction varies with beside the law of each sample."""

    verdict: Verdict


@displayed(lambda d: d.verdict.verdict)
@dataclass(frozen=True)
class Diagnosis:
    """A verdict with what it rests on, for figures and tables.

    ``simulated`` is the extended model run in the simulator itself, where that was asked for and possible; ``laws`` is
    the search for the laws of what the causes leave, where something was left.
    """

    verdict: Verdict
    baseline: ModelFit
    screened: Screen
    named: Named | None
    simulated: SimulatedExtension | None = None
    laws: Discovery | None = None

    def without_columns(self) -> Diagnosis:
        """The same without the columns of the looks, which nothing needs once the verdict stands."""
        named = self.named and replace(self.named, left=self.named.left.without_columns())
        return replace(self, screened=self.screened.without_columns(), named=named)
