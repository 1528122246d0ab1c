"""``tribo diagnose --published berardo2019``: the diagnosis of a printed table, in every reading of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribo.diagnose.discovery.across_patterns import AcrossPatterns, across_patterns
from tribo.diagnose.from_table.table_across import table_deviations
from tribo.diagnose.from_table.table_diagnosis import gain_on_samples, look_at, readings
from tribo.diagnose.from_table.table_observations import read_table
from tribo.diagnose.from_table.table_outlook import Outlook
from tribo.diagnose.from_table.table_sentences import verdict_of
from tribo.diagnose.verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class PublishedDiagnosis:
    """The verdict on a printed table, with every reading of it; the first is the one the verdict speaks of."""

    source: str
    verdict: Verdict
    outlooks: tuple[Outlook, ...]

    @property
    def main(self) -> Outlook:
        return self.outlooks[0]


def diagnose_published(
    table2: pd.DataFrame,
    own: pd.DataFrame,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> PublishedDiagnosis:
    """The diagnosis of Table 2 of Berardo et al. (2019) in every reading.

    Parameters
    ----------
    table2 : as :func:`tribo.published.load_table2` gives it
    own : the same table simulated anew: sample, regime, mu, tau0_kPa
    seed : of the simulated tables that stand for chance
    """
    measured = table2[table2["source"] == "experiment"]
    models = {"paper": table2[table2["source"] == "simulation"], "tribo": own}
    found = []
    for k, reading in enumerate(readings()):
        if progress is not None:
            progress("reading the table", k, len(readings()))
        table = read_table(measured, models[reading.model], reading.correlation, reading.specimens)
        found.append(look_at(table, reading, np.random.default_rng(seed)))
    rng = np.random.default_rng(seed)
    gain = gain_on_samples(found[0].baseline, found[0].weighed[0], rng)
    return PublishedDiagnosis("berardo2019", verdict_of(found, gain), tuple(found))


def across_published(d: PublishedDiagnosis, *, seed: int = 0) -> AcrossPatterns:
    """Laws of up to three terms across the patterns of the table, in the main reading.

    Readings differ in the correlation and the number of specimens, which this search does not use, and in the model.
    """
    found = across_patterns(table_deviations(d.main.table), most_terms=3, seed=seed)
    if found is None:
        raise ValueError("a law across patterns needs at least four patterns")
    return found
