"""The rows a fit may use, checked once, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribo.errors import FitError, Problem
from tribo.records import FloatArray, Regime

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Rows:
    """Normal load, friction force, its reading uncertainty and the specimen of n tests; arrays (n,)."""

    sample: str
    load_N: FloatArray
    force_N: FloatArray
    u_N: FloatArray
    specimen: NDArray[np.str_]
    test_id: NDArray[np.str_]
    n_missing: int = 0

    def __len__(self) -> int:
        return len(self.load_N)

    @property
    def specimens(self) -> tuple[str, ...]:
        return tuple(str(s) for s in np.unique(self.specimen))

    def take(self, keep: NDArray[np.bool_]) -> Rows:
        """The rows where ``keep`` is true."""
        return Rows(
            self.sample, self.load_N[keep], self.force_N[keep], self.u_N[keep],
            self.specimen[keep], self.test_id[keep],
        )  # fmt: skip


def sample_rows(table: pd.DataFrame, regime: Regime) -> tuple[Rows, ...]:
    """One :class:`Rows` a sample, samples in alphabetical order.

    ``table`` is that of ``Ingested.table()``. Tests without a force in ``regime`` are left out. Tests whose
    specimen is not named count as one specimen.

    Raises
    ------
    FitError
        A column is missing, or a normal load is negative or not a number (each row listed).
    """
    needed = ["sample", "specimen", "normal_load_N", f"{regime}_N"]
    if absent := [name for name in needed if name not in table.columns]:
        allowed = ", ".join(needed)
        what = "a required column is missing from the table"
        raise FitError([Problem("missing_column", what, column=c, allowed=allowed) for c in absent])
    load = table["normal_load_N"].to_numpy(float)
    ids = (table["test_id"] if "test_id" in table else table.index.to_series()).astype(str).to_numpy(str)
    if len(bad := np.flatnonzero(~np.isfinite(load) | (load < 0))):
        raise FitError([_bad_load(str(ids[k]), float(load[k])) for k in bad])
    force = table[f"{regime}_N"].to_numpy(float)
    u_name = f"{regime}_u_N"
    u = table[u_name].to_numpy(float) if u_name in table else np.full(len(table), np.nan)
    sample = table["sample"].astype(str).to_numpy(str)
    everything = Rows("", load, force, u, table["specimen"].fillna("").astype(str).to_numpy(str), ids)
    return tuple(_one_sample(everything, sample == name, str(name)) for name in np.unique(sample))


def _one_sample(everything: Rows, own: NDArray[np.bool_], name: str) -> Rows:
    found = np.isfinite(everything.force_N)
    kept = everything.take(own & found)
    return replace(kept, sample=name, n_missing=int((own & ~found).sum()))


def _bad_load(test_id: str, found: float) -> Problem:
    return Problem(
        "bad_load", "not a possible normal load", column="normal_load_N",
        found=f"{found:g}", allowed="0 N or more", test_id=test_id,
    )  # fmt: skip
