"""Effect on Table 2 of the choices that the text of the paper leaves open.

Some choices change the runs; each is a :class:`Variant`. Others only change what is read off a run and how it is
fitted: which peak is static friction, which stretch is sliding, how the loads are weighted. Those are read off every
run at once (:data:`READINGS`) and compared without new runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.records import FloatArray, Run
from tribo.springblock.calibration import WEIGHTS, resampled_laws
from tribo.springblock.config import PAPER_SAMPLES, SimConfig
from tribo.springblock.ensemble import Angles, Progress, Work, stratified_design
from tribo.springblock.kept_runs import run_stored

if TYPE_CHECKING:
    import pandas as pd


STUDY_PRESSURES_PA = (3e3, 10e3, 25e3)
WHOLE_PERIODS = {"Sx": (88, 96), "Sy": (88, 96)}  # two cavities by four rows of S; 84 suits pitches of 3 and of 4
PEAK_DROPS = {"highest peak": None, "first fall of 1 %": 0.01, "first fall of 5 %": 0.05}
WINDOWS = {"1.05 to 3 peak times": (1.05, 3.0), "1.05 to 2": (1.05, 2.0), "1.5 to 3": (1.5, 3.0), "2 to 3": (2.0, 3.0)}


@dataclass(frozen=True)
class Variant:
    """One reading of the text that changes the runs: fields of the configuration, and the angle law by sample."""

    changes: Mapping[str, Any] = field(default_factory=dict)
    angles: Angles | Mapping[str, Angles] = "midpoints"

    def design(
        self, samples: Sequence[str], pressures_Pa: Sequence[float], repeats: int, base: SimConfig
    ) -> list[SimConfig]:
        """Its runs; equal seeds in all variants, so that they can be compared in pairs."""
        runs = []
        for sample in samples:
            changed = base.with_(**self.changes)
            if changed.edges == "periodic":
                changed = changed.with_(blocks=WHOLE_PERIODS.get(sample, (84, 84)))
            angles = self.angles[sample] if isinstance(self.angles, Mapping) else self.angles
            each = repeats if isinstance(angles, str) else repeats // len(angles)
            runs += stratified_design([sample], pressures_Pa, each, base=changed, angles=angles)
        return runs


NOMINAL_DEG: dict[str, Angles] = {s: (90.0,) if s == "Sy" else (0.0,) for s in PAPER_SAMPLES}
DIAGONAL_DEG: dict[str, Angles] = {s: (45.0,) if s in "ABC" else NOMINAL_DEG[s] for s in PAPER_SAMPLES}
VARIANTS: dict[str, Variant] = {
    "baseline": Variant(),
    "K_s halved": Variant({"shear_factor": 0.5}),
    "cavities touch the edge": Variant({"pattern_first": (0, 0)}),
    "K_s halved, cavities touch the edge": Variant({"shear_factor": 0.5, "pattern_first": (0, 0)}),
    "periodic edges": Variant({"edges": "periodic"}),
    "periodic edges, K_s halved": Variant({"edges": "periodic", "shear_factor": 0.5}),
    "p l2 on every block": Variant({"normal_force": "uniform"}),
    "all pulls at 0 deg (Sy 90)": Variant(angles=NOMINAL_DEG),
    "A, B, C at 45 deg": Variant(angles=DIAGONAL_DEG),
}
"""The readings of the text that change the runs. By symmetry 0 to 45 deg is the law of 0 to 90 deg for A, B, C."""


def peak_of(time_s: FloatArray, force_N: FloatArray, drop: float | None) -> tuple[float, float]:
    """Force and time of the highest peak, or of the largest force before the first fall by the share ``drop``."""
    if drop is not None:
        fallen = np.flatnonzero(force_N < (1.0 - drop) * np.maximum.accumulate(force_N))
        force_N = force_N[: fallen[0]] if fallen.size else force_N
    k = int(force_N.argmax())
    return float(force_N[k]), float(time_s[k])


def mean_between(time_s: FloatArray, force_N: FloatArray, start_s: float, end_s: float) -> float:
    """Mean force between two times; between samples the force is a straight line."""
    from scipy.integrate import trapezoid

    inside = (time_s > start_s) & (time_s < end_s)
    time = np.concatenate([[start_s], time_s[inside], [end_s]])
    return float(trapezoid(np.interp(time, time_s, force_N), time) / (end_s - start_s))


def readings(run: Run) -> dict[str, float]:
    """T/N of a run under every peak rule and window; the windows count in times of the highest peak."""
    time, force = run.time_s, run.force_N / run.normal_load_N
    found = {rule: peak_of(time, force, drop)[0] for rule, drop in PEAK_DROPS.items()}
    peak_s = peak_of(time, force, None)[1]
    for name, (start, end) in WINDOWS.items():
        found[name] = mean_between(time, force, start * peak_s, min(end * peak_s, float(time[-1])))
    return found


def studied(run: Run) -> dict[str, float]:
    """What the store of the study keeps of a run."""
    return {"area_fraction": run.parameters["area_fraction"], "peak_s": run.peak_s, **readings(run)}


UNITS = {"area_fraction": "1", "peak_s": "s", **dict.fromkeys((*PEAK_DROPS, *WINDOWS), "1")}
READINGS = Work(read=studied, units=UNITS)


def study_designs(
    base: SimConfig | None = None,
    repeats: int = 4,
    pressures_Pa: Sequence[float] = STUDY_PRESSURES_PA,
    samples: Sequence[str] = PAPER_SAMPLES,
    variants: Mapping[str, Variant] = VARIANTS,
) -> dict[str, list[SimConfig]]:
    """The runs of every variant, by its name."""
    return {name: v.design(samples, pressures_Pa, repeats, base or SimConfig()) for name, v in variants.items()}


def run_study(
    folder: str | Path,
    designs: Mapping[str, list[SimConfig]],
    *,
    jobs: int = 2,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> dict[str, pd.DataFrame]:
    """The runs of every variant with all readings, one store per variant in ``folder``; a stopped study continues."""
    total, before, tables = sum(map(len, designs.values())), 0, {}
    for k, (name, design) in enumerate(designs.items()):

        def report(done: int, _: int, before: int = before) -> None:
            if progress is not None:
                progress(before + done, total)

        tables[name] = run_stored(design, Path(folder) / f"variant-{k:02d}.h5", jobs, scheduler, report, READINGS)
        before += len(design)
    return tables


def combinations(
    tables: Mapping[str, pd.DataFrame], published: pd.DataFrame, resamples: int = 200
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Every variant under every reading and weight against the published simulation.

    Returns
    -------
    fits : DataFrame with variant, regime, reading, weights, sample, mu, tau0_kPa, their standard errors and
        deviations in percent, and ``deviation_percent`` of T/N over the pressures of the runs (mean)
    distances : DataFrame with variant, regime, reading, weights, ``rms_percent`` (of the deviation of T/N over all
        samples and pressures), ``se``, and the difference to the first variant of the same reading with its
        standard error over the same resampled runs
    """
    import pandas as pd

    fits, distances = [], []
    for regime, rules in (("static", PEAK_DROPS), ("sliding", WINDOWS)):
        paper = published[(published["source"] == "simulation") & (published["regime"] == regime)].set_index("sample")
        for reading, weights in product(rules, WEIGHTS):
            first: FloatArray | None = None
            for variant, runs in tables.items():
                of = {"variant": variant, "regime": regime, "reading": reading, "weights": weights}
                rows, rms = _against(runs, reading, weights, paper, resamples)
                first = rms if first is None else first
                fits += [of | row for row in rows]
                distances.append(
                    of
                    | {"rms_percent": rms[0], "se": rms[1:].std(ddof=1)}
                    | {"change": rms[0] - first[0], "change_se": (rms - first)[1:].std(ddof=1)}
                )
    return pd.DataFrame(fits), pd.DataFrame(distances)


def _against(
    runs: pd.DataFrame, reading: str, weights: str, paper: pd.DataFrame, resamples: int
) -> tuple[list[dict[str, Any]], FloatArray]:
    """Fits of every sample, and the rms deviation of T/N: of the runs themselves first, then of each resampling."""
    rng = np.random.default_rng(0)
    rows, squares = [], []
    for sample, group in runs.groupby("sample", sort=False):
        pressure, friction = group["pressure_Pa"].to_numpy(float), group[reading].to_numpy(float)
        levels = np.unique(pressure)
        laws = resampled_laws(pressure, friction, weights, rng, resamples)
        printed = paper.loc[[sample], ["mu", "tau0_kPa"]].to_numpy(float)[0] * (1.0, 1e3)
        deviation = 100.0 * ((laws[:, :1] + laws[:, 1:] / levels) / (printed[0] + printed[1] / levels) - 1.0)
        se = laws[1:].std(axis=0, ddof=1)
        mu_off, tau0_off = 100.0 * (laws[0] / printed - 1.0)
        rows.append(
            {
                "sample": sample, "runs": len(group), "mu": laws[0, 0], "mu_se": se[0], "tau0_kPa": laws[0, 1] / 1e3,
                "tau0_kPa_se": se[1] / 1e3, "mu_deviation_percent": mu_off, "tau0_deviation_percent": tau0_off,
                "deviation_percent": deviation[0].mean(), "deviation_se": deviation[1:].mean(axis=1).std(ddof=1),
            }
        )  # fmt: skip
        squares.append((deviation**2).mean(axis=1))
    return rows, np.sqrt(np.mean(squares, axis=0))
