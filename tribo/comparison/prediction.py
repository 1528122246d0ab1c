"""The calibrated model's prediction of every sample of a campaign, without refitting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribo.comparison.prediction_runs import (
    SOURCES,
    Cell,
    ModelRuns,
    cells_of,
    example_config,
    example_run,
    remove_strangers,
    run_cells,
    sample_as_word,
)
from tribo.errors import CampaignError, FitError, Problem
from tribo.records import REGIMES, Campaign, FloatArray, LawFit, Regime, Run
from tribo.store.kept_results import Shelf

if TYPE_CHECKING:
    import pandas as pd

    from tribo.simulate import LocalFriction, SimConfig

Progress = Callable[[str, int, int], None]
MODEL_RUNS = ModelRuns()
MOST_LOADS = 8  # T(N) of the model is close to a straight line: more loads are interpolated


def loads_to_simulate(campaign: Campaign) -> FloatArray:
    """The campaign's own loads in N, ascending; where there are more than MOST_LOADS, a spread over their range."""
    loads = np.unique([test.normal_load_N for test in campaign.tests if np.isfinite(test.normal_load_N)])
    if loads.size <= MOST_LOADS:
        return loads
    return np.geomspace(loads[0], loads[-1], MOST_LOADS)


@dataclass(frozen=True)
class Prediction:
    """Predictions of the model for a campaign: the runs, the laws fitted to them, and the force at any load."""

    table: pd.DataFrame
    fits: tuple[LawFit, ...]
    measured_flat: dict[Regime, LawFit]
    calibration: dict[str, float]
    example_runs: tuple[Run, ...]
    flat: str
    notes: tuple[str, ...] = ()

    @property
    def samples(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(self.table["sample"]))

    def force_N(self, sample: str, regime: Regime, normal_load_N: float) -> tuple[float, float]:
        """Predicted force and its standard uncertainty, in N.

        Mean over runs, linear between simulated loads. The uncertainty joins the scatter of the runs with
        that of the measured flat sample at this load, which calibrated the model.
        """
        rows = self.table[self.table["sample"] == sample]
        cells = rows.groupby("normal_load_N")[f"{regime}_N"].agg(["mean", "sem"])
        loads = cells.index.to_numpy()
        force = float(np.interp(normal_load_N, loads, cells["mean"]))
        scatter = float(np.interp(normal_load_N, loads, cells["sem"]))
        flat = self.measured_flat[regime]
        relative = float(flat.force_u_N(normal_load_N) / flat.force_N(normal_load_N))
        return force, float(np.hypot(scatter, force * relative))


def predict(
    campaign: Campaign,
    fits: tuple[LawFit, ...],
    flat: str,
    model: ModelRuns = MODEL_RUNS,
    *,
    weights: str = "relative",
    progress: Progress = lambda stage, done, total: None,
) -> Prediction:
    """Calibrate the model on the measured flat sample and simulate every measured sample at the campaign's loads.

    Parameters
    ----------
    fits : laws measured on the samples, the flat one among them
    model : number of runs, seed, and where the model is run
    weights : of the fits to the simulated forces

    Raises
    ------
    FitError
        The flat sample has no fitted law, static and sliding.
    SimulationError
        A pattern that the lattice cannot hold.
    """
    from tribo.simulate import SimConfig

    friction, cells = calibrated_cells(campaign, fits, flat, model, progress)
    if model.kept is not None:
        remove_strangers(cells, model.kept)
    table = run_cells(
        cells, model.kept, model.jobs, model.scheduler,
        lambda done, total: progress("simulating the samples", done, total),
    )  # fmt: skip
    table = _as_forces(table, campaign)
    return Prediction(
        table,
        _simulated_fits(table, campaign.nominal_area_m2, weights),
        _flat_laws(fits, flat),
        _calibration(friction, SimConfig()),
        tuple(example_run(own, model.kept) for own in _by_sample(cells).values()),
        flat,
    )


def calibrated_cells(
    campaign: Campaign,
    fits: tuple[LawFit, ...],
    flat: str,
    model: ModelRuns = MODEL_RUNS,
    progress: Progress = lambda stage, done, total: None,
) -> tuple[LocalFriction, tuple[Cell, ...]]:
    """Local friction from the flat sample alone, and the runs that predict every sample, by sample and load.

    Parameters and exceptions are those of :func:`predict`.
    """
    from tribo.simulate import CalibrationRuns, SimConfig, calibrate, stratified_design

    laws = _flat_laws(fits, flat)
    loads = loads_to_simulate(campaign)
    pressures = [campaign.nominal_pressure_Pa(load) for load in loads]
    wanted = (_law(laws["static"]), _law(laws["sliding"]))

    def calibration() -> LocalFriction:
        return calibrate(
            *wanted, runs=CalibrationRuns(pressures, seed=model.seed), jobs=model.jobs,
            progress=lambda done, total: progress("calibrating on the flat sample", done, total),
        )  # fmt: skip

    friction = Shelf(model.kept).take("calibration", (wanted, pressures, model.seed), calibration, SOURCES)
    samples = {s: campaign.samples[s] for s in _measured_samples(campaign)}
    design = stratified_design(samples, pressures, model.runs, model.seed, SimConfig(friction=friction))
    return friction, cells_of(design)


def run_named_cells(
    campaign: Campaign,
    fits: tuple[LawFit, ...],
    flat: str,
    model: ModelRuns,
    only: str = "",
    progress: Progress = lambda stage, done, total: None,
) -> tuple[Cell, ...]:
    """Calibrate the model and run the cells that ``only`` names; returns those that ran.

    Raises
    ------
    CampaignError
        ``only`` names nothing this campaign measured.
    """
    _, cells = calibrated_cells(campaign, fits, flat, model, progress)
    if model.kept is not None:
        remove_strangers(cells, model.kept)  # what a diagnosis finds kept is then of this calibration
    chosen = tuple(c for c in cells if only in ("", c.sample, sample_as_word(c.sample), c.name))
    if not chosen and only != "calibration":
        allowed = ", ".join(["calibration", *dict.fromkeys(c.sample for c in cells), *(c.name for c in cells)])
        raise CampaignError(Problem("no_such_cell", "no simulation has this name", found=only, allowed=allowed))
    if chosen:
        run_cells(
            chosen, model.kept, model.jobs, model.scheduler,
            lambda done, total: progress("simulating the samples", done, total),
        )  # fmt: skip
    for sample in dict.fromkeys(c.sample for c in chosen):
        own = [c for c in cells if c.sample == sample]
        if any(example_config(own) in c.configs for c in chosen):
            example_run(own, model.kept)
    return chosen


def _by_sample(cells: tuple[Cell, ...]) -> dict[str, list[Cell]]:
    found: dict[str, list[Cell]] = {}
    for cell in cells:
        found.setdefault(cell.sample, []).append(cell)
    return found


def _flat_laws(fits: tuple[LawFit, ...], flat: str) -> dict[Regime, LawFit]:
    laws = {f.regime: f for f in fits if f.sample == flat and np.isfinite(f.values).all()}
    if len(laws) < len(REGIMES):
        notes = "; ".join(note for f in fits if f.sample == flat for note in f.notes)
        raise FitError(
            Problem("no_flat_law", f"calibration needs both laws of the flat sample {flat}", found=notes or "none")
        )
    return laws


def _law(fit: LawFit) -> tuple[float, float]:
    return fit.value("mu"), fit.value("tau0_Pa")


def _measured_samples(campaign: Campaign) -> list[str]:
    measured = {test.sample for test in campaign.tests}
    return [s for s in campaign.samples if s in measured]


def _as_forces(table: pd.DataFrame, campaign: Campaign) -> pd.DataFrame:
    """The ensemble in the campaign's own loads: N = p A and T = (T/N) N, and ``stratum``, its turn at the load."""
    load = table["pressure_Pa"] * campaign.nominal_area_m2
    return table.assign(
        normal_load_N=load.round(12),
        static_N=table["static_friction"] * load,
        sliding_N=table["sliding_friction"] * load,
        stratum=table.groupby(["sample", "pressure_Pa"]).cumcount(),
    )


def _simulated_fits(table: pd.DataFrame, nominal_area_m2: float, weights: str) -> tuple[LawFit, ...]:
    """The same fits as for the measurement; runs of one angle stratum take the place of a specimen."""
    from tribo.fitting import fit_samples

    rows = table.assign(
        test_id=table.index.astype(str), specimen=table["stratum"].astype(str), static_u_N=0.0, sliding_u_N=0.0
    )
    return tuple(f for regime in REGIMES for f in fit_samples(rows, regime, nominal_area_m2, weights=weights))


def _calibration(friction: LocalFriction, base: SimConfig) -> dict[str, float]:
    return {**asdict(friction), "blocks_x": base.blocks[0], "blocks_y": base.blocks[1], "dt_s": base.dt_s}
