"""The table of pattern shares and its maker: the law of every tabulated pattern over that of the flat sample.

The thresholds of all blocks scale together, so what the spring-block model makes of a pattern is four numbers: the
shares of mu and of tau0 of the flat sample, static and sliding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribo.files import write_text
from tribo.springblock.calibration import fitted
from tribo.springblock.config import SimConfig
from tribo.springblock.ensemble import angle_range_deg
from tribo.springblock.kept_runs import versions
from tribo.springblock.lattice import UM, pattern_of

if TYPE_CHECKING:
    import pandas as pd


FLAT = "F"
KEPT = ("sample", "pressure_Pa", "angle_deg", "seed", "static_friction", "sliding_friction")
PARAMETERS = {"mu": "mu", "tau0_kPa": "tau0"}  # column of a law: what its share is called


def pattern_laws(runs: pd.DataFrame) -> pd.DataFrame:
    """Law and shares of every sample of an ensemble, one row a sample and regime.

    Parameters
    ----------
    runs : one row a run of the paper's samples, the flat one among them, with the columns of
        :func:`tribo.springblock.run_ensemble`

    Returns
    -------
    DataFrame with sample, regime, the geometry of the pattern (lengths in um, direction of the pull), runs, mu and
    tau0_kPa with standard errors (``_se``, from resampling the runs at each pressure), and their shares of those of the
    flat sample, mu_share and tau0_share, with standard errors too.
    """
    import numpy as np
    import pandas as pd

    laws = fitted(runs)
    flat = laws[laws["sample"] == FLAT].set_index("regime").loc[laws["regime"]].reset_index()
    columns: dict[str, Any] = {}
    for name, short in PARAMETERS.items():
        value, of_flat = laws[name], flat[name]
        relative = np.hypot(laws[f"{name}_se"] / value, flat[f"{name}_se"] / of_flat)
        is_flat = laws["sample"] == FLAT
        columns |= {name: value, f"{name}_se": laws[f"{name}_se"], f"{short}_share": value / of_flat}
        columns |= {f"{short}_share_se": (value / of_flat * relative).mask(is_flat, 0.0)}
    geometry = pd.DataFrame([_geometry(sample) for sample in laws["sample"]])
    return pd.concat([laws[["sample", "regime"]], geometry, laws[["runs"]], pd.DataFrame(columns)], axis=1)


def _geometry(sample: str) -> dict[str, Any]:
    pattern = pattern_of(sample)
    assert pattern is not None, sample
    direction = sample.removeprefix(pattern.name)
    known: dict[str, Any] = {"cavity": pattern.cavity, "direction": direction}
    for name, lengths_m in (("size", pattern.size_m), ("pitch", pattern.pitch_m)):
        for axis, k in (("x", 0), ("y", 1)):
            known[f"{name}_{axis}_um"] = None if lengths_m is None else round(lengths_m[k] / UM, 6)
    return known | {"staggered": int(pattern.staggered)}


def origin(design: Sequence[SimConfig], seed: int, sources: str) -> dict[str, str]:
    """How an ensemble was made, in words: what a file says of itself in its first lines.

    Parameters
    ----------
    sources : digest of the simulator's sources and of the libraries it computes with
    """
    first = design[0]
    pressures = sorted({c.pressure_Pa for c in design})
    ranges = {c.sample: angle_range_deg(c.sample, c.pattern) for c in design}
    per_point = len(design) // (len(pressures) * len(ranges))
    angles = ", ".join(f"{s} {low:g} to {high:g}" for s, (low, high) in ranges.items())
    return {
        "runs": f"{len(design)}, {per_point} at each pressure for each sample",
        "seed": str(seed),
        "reading of the paper": first.reading,
        "time step": f"{first.dt_s:g} s, cavity blocks rest below {first.rest_tolerance:g} of the sliding threshold",
        "blocks": f"{first.blocks[0]} x {first.blocks[1]}, {first.spacing_m / UM:g} um apart",
        "pressures": ", ".join(f"{p / 1e3:g}" for p in pressures) + " kPa",
        "pull angles": f"middles of {per_point} equal strata of the range in degrees: {angles}",
        "static friction": f"the {first.peak_rule} force of the run",
        "sliding friction": f"mean force from {first.window_start_peaks:g} to {first.duration_peaks:g} peak times",
        "fit": "T/N = mu + tau0/p, least squares over all runs of a sample",
        "versions": ", ".join(f"{name.removeprefix('version_')} {v}" for name, v in versions().items()),
        "sources": f"sha256 {sources}",
    }


def write_table(table: pd.DataFrame, path: Path, said: Mapping[str, str], digits: str = "%.6g") -> Path:
    """Write a table as CSV behind comment lines ``# name: what is said``; the file appears whole or not at all."""
    head = "".join(f"# {name}: {words}\n" for name, words in said.items())
    return write_text(path, head + table.to_csv(index=False, float_format=digits, lineterminator="\n"))
