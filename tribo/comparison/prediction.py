"""The calibrated model's prediction of every sample of a campaign, without refitting.

Its runs are made in cells of one sample at one pressure, each kept in a file named after everything the runs are made
from, sources included: a file that is there is valid, and one finished run is never computed twice. Cells can be run by
different processes, or machines, at once.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import numpy as np

from tribo.errors import CampaignError, FitError, Problem, SimulationError, failed_by_system, naming
from tribo.files import found_in, intact_hdf5
from tribo.kept_results import (
    FOREIGN,
    DamagedResultWarning,
    fault_of_kept,
    kept_or_made,
    signature,
    sources,
)
from tribo.records import (
    REGIMES,
    Campaign,
    Comparison,
    ComparisonRow,
    FloatArray,
    Ingested,
    LawFit,
    Pattern,
    Regime,
    Run,
    StudyOptions,
)

if TYPE_CHECKING:
    import pandas as pd

    from tribo.springblock import LocalFriction, SimConfig


SOURCES = ("springblock", "laws", "records")  # packages whose sources decide a run
SUFFIX = ".nc"
WAIT_S = 86400.0  # for another process that runs the same cell: its runs are then there


@dataclass(frozen=True)
class Cell:
    """The runs of one sample at one nominal pressure."""

    sample: str
    pressure_Pa: float
    configs: tuple[SimConfig, ...]

    @property
    def name(self) -> str:
        """Sample and pressure, fit for a file name: "Sx@18180Pa"."""
        return cell_name(self.sample, self.pressure_Pa)

    def path(self, kept: Path) -> Path:
        """Where the results of exactly these runs are kept."""
        made_from = "\n".join([sources(*SOURCES), *map(repr, self.configs)])
        return kept / f"{self.name}-{hashlib.sha256(made_from.encode()).hexdigest()[:16]}{SUFFIX}"


def cell_name(sample: str, pressure_Pa: float) -> str:
    """Sample and nominal pressure as one word without a space or a slash."""
    return f"{sample_as_word(sample)}@{pressure_Pa:.0f}Pa"


def sample_as_word(sample: str) -> str:
    """The name of a sample as part of a file name and of a step of a build."""
    return quote(sample, safe="")


def cells_of(design: Iterable[SimConfig]) -> tuple[Cell, ...]:
    """A design by sample and pressure, in its own order."""
    found: dict[tuple[str, float], list[SimConfig]] = {}
    for config in design:
        found.setdefault((config.sample, config.pressure_Pa), []).append(config)
    return tuple(Cell(sample, pressure, tuple(configs)) for (sample, pressure), configs in found.items())


def run_cells(
    cells: Sequence[Cell], options: StudyOptions, progress: Callable[[int, int], None] = lambda done, total: None
) -> pd.DataFrame:
    """All runs of the cells as one table, one row per run; those that the folder ``kept`` holds are taken from there.

    Raises
    ------
    SimulationError
        An impossible configuration, or no dask where a scheduler is given.
    """
    import pandas as pd

    from tribo.springblock import run_ensemble
    from tribo.springblock.kept_runs import fault_of, run_all_stored

    kept, jobs = options.kept, options.jobs
    if kept is None:
        return run_ensemble([config for cell in cells for config in cell.configs], jobs, progress)
    kept.mkdir(parents=True, exist_ok=True)
    stores = [(cell.configs, cell.path(kept)) for cell in cells]
    for configs, path in stores:
        if path.exists() and (fault := fault_of(configs, path)) is not None:
            warnings.warn(f"{path}: {fault.what}; these simulations are made again", DamagedResultWarning, stacklevel=2)
            path.unlink(missing_ok=True)
    return pd.concat(run_all_stored(stores, jobs, options.scheduler, progress, wait_s=WAIT_S), ignore_index=True)


def kept_runs(kept: Path, patterns: Mapping[str, Pattern]) -> pd.DataFrame | None:
    """Finished runs of the baseline in ``kept`` that the current sources would reproduce, one row per run, or None.

    A file counts where its name is the one that its own runs would be given.

    Raises
    ------
    OSError
        A file is there and cannot be read.
    """
    import pandas as pd

    from tribo.springblock import read_stored
    from tribo.springblock.kept_runs import UNREADABLE, fault_of

    found = []
    for path in found_in(kept, f"*@*{SUFFIX}"):
        try:
            table = read_stored(path)
            cell = _cell_of(path, table, patterns)
        except (SimulationError, *UNREADABLE) as why:
            cause = why.__cause__ or why
            if failed_by_system(cause):  # the runs may be whole, and without them the result would be another one
                with naming(path):
                    raise cause from None
            warnings.warn(f"{path}: these simulations are not used: {why}", DamagedResultWarning, stacklevel=2)
            continue
        if cell is not None and cell.path(kept) == path and table["done"].all():
            if (fault := fault_of(cell.configs, path)) is not None:
                said = f"{path}: these simulations are not used: {fault.what}"
                warnings.warn(said, DamagedResultWarning, stacklevel=2)
                continue
            found.append(table)
    return pd.concat(found, ignore_index=True) if found else None


def kept_faults(kept: Path) -> dict[str, str]:
    """Every file of a folder of kept results by its name, with why it is not believed, as the end of a sentence.

    The reason is empty where this user has made the file on this machine and it is intact. Runs that this version
    would not make count as believed here: they are left out where they would be used.

    Raises
    ------
    OSError
        The folder cannot be listed.
    """
    import h5py

    from tribo.springblock.kept_runs import UNREADABLE, checksum_of

    found = {path.name: fault_of_kept(path) for path in found_in(kept, "*.json")}
    for path in found_in(kept, f"*{SUFFIX}"):
        try:
            with h5py.File(intact_hdf5(path)) as file:
                checksum, signed = checksum_of(file), str(file.attrs.get("signed", ""))
                damaged = checksum != str(file.attrs.get("checksum", ""))
        except UNREADABLE as why:
            found[path.name] = f"cannot be read as HDF5: {why}"
            continue
        foreign = "" if signed == signature(checksum.encode()) else FOREIGN
        found[path.name] = "differs from its checksum" if damaged else foreign
    return found


def _cell_of(path: Path, table: pd.DataFrame, patterns: Mapping[str, Pattern]) -> Cell | None:
    """The cell that a kept file says it holds, its runs those of the baseline with the file's local friction."""
    import h5py

    from tribo.springblock import LocalFriction, SimConfig

    sample = str(table["sample"].iloc[0])
    if sample not in patterns:
        return None
    with h5py.File(intact_hdf5(path)) as file:
        friction = LocalFriction(**{f.name: float(file.attrs[f"friction_{f.name}"]) for f in fields(LocalFriction)})
    configs = tuple(
        SimConfig(
            sample=sample, pattern=patterns[sample], pressure_Pa=float(row["pressure_Pa"]),
            angle_deg=float(row["angle_deg"]), seed=int(row["seed"]), friction=friction,
        )
        for row in table.to_dict("records")
    )  # fmt: skip
    return Cell(sample, configs[0].pressure_Pa, configs)


def example_run(cells: Sequence[Cell], kept: Path | None = None) -> Run:
    """One run of a sample with its whole force trace, at a middle load and a middle angle."""
    from tribo.springblock import simulate

    config = example_config(cells)
    name = f"example-{quote(config.sample, safe='')}"
    return kept_or_made(kept, name, config, partial(simulate, config), SOURCES)


def example_config(cells: Sequence[Cell]) -> SimConfig:
    """The middle one of all runs of the cells."""
    configs = [config for cell in cells for config in cell.configs]
    return configs[len(configs) // 2]


def remove_other_runs(cells: Iterable[Cell], kept: Path) -> None:
    """Delete kept runs that belong to none of the cells: other samples, loads, laws or sources."""
    ours = {cell.path(kept) for cell in cells}
    for path in found_in(kept, f"*@*{SUFFIX}"):
        if path not in ours:
            path.unlink(missing_ok=True)


Progress = Callable[[str, int, int], None]
MOST_LOADS = 8  # T(N) of the model is close to a straight line: more loads are interpolated


def loads_to_simulate(campaign: Campaign) -> FloatArray:
    """The campaign's own loads in N, ascending; where there are more than MOST_LOADS, a spread over their range."""
    loads = np.unique([test.normal_load_N for test in campaign.tests if np.isfinite(test.normal_load_N)])
    if loads.size <= MOST_LOADS:
        return loads
    return np.geomspace(loads[0], loads[-1], MOST_LOADS)


def predict(
    ingested: Ingested,
    fits: tuple[LawFit, ...],
    flat: str,
    calibrated: tuple[LocalFriction, tuple[Cell, ...]],
    options: StudyOptions,
    progress: Progress = lambda stage, done, total: None,
) -> tuple[Comparison, pd.DataFrame, tuple[Run, ...]]:
    """Simulate every measured sample at the campaign's loads by the model as calibrated on the flat sample.

    Returns the fits of the model beside the measurement, one row per run, and an example run of each sample.

    Parameters
    ----------
    fits : laws measured on the samples, the flat one among them
    calibrated : local friction and the runs to make, from :func:`calibrated_cells`
    options : number of runs, seed, where the model is run, and the weights of the fits to the simulated forces

    Raises
    ------
    FitError
        The flat sample has no fitted law, static and sliding.
    SimulationError
        A pattern that the lattice cannot hold.
    """
    from tribo.springblock import SimConfig

    campaign = ingested.campaign
    friction, cells = calibrated
    table = run_cells(cells, options, lambda done, total: progress("simulating the samples", done, total))
    table = _as_forces(table, campaign)
    samples, base = dict.fromkeys(cell.sample for cell in cells), SimConfig()
    simulated = _simulated_fits(table, campaign.area_m2, options.weights)
    calibration = {**asdict(friction), "blocks_x": base.blocks[0], "blocks_y": base.blocks[1], "dt_s": base.dt_s}
    rows = _side_by_side(ingested, table, _flat_laws(fits, flat))
    examples = tuple(example_run([c for c in cells if c.sample == sample], options.kept) for sample in samples)
    return Comparison(simulated, rows, calibration, flat), table, examples


def _side_by_side(
    ingested: Ingested, table: pd.DataFrame, measured_flat: Mapping[Regime, LawFit]
) -> tuple[ComparisonRow, ...]:
    """The forces of measurement and model at each load that was measured."""
    return tuple(
        ComparisonRow(
            sample, regime, load, mean, u, *_simulated_force_N(table, sample, regime, load, measured_flat[regime])
        )
        for regime in REGIMES
        for sample in dict.fromkeys(table["sample"])
        for load, mean, u in load_means(ingested, sample, regime)
    )


def _simulated_force_N(
    table: pd.DataFrame, sample: str, regime: Regime, normal_load_N: float, flat: LawFit
) -> tuple[float, float]:
    """Predicted force and its standard uncertainty, in N.

    Mean over runs, linear between simulated loads. The uncertainty joins the scatter of the runs with
    that of the measured flat sample at this load, which calibrated the model.
    """
    rows = table[table["sample"] == sample]
    cells = rows.groupby("normal_load_N")[f"{regime}_N"].agg(["mean", "sem"])
    loads = cells.index.to_numpy()
    force = float(np.interp(normal_load_N, loads, cells["mean"]))
    scatter = float(np.interp(normal_load_N, loads, cells["sem"]))
    relative = float(flat.force_u_N(normal_load_N) / flat.force_N(normal_load_N))
    return force, float(np.hypot(scatter, force * relative))


def load_means(ingested: Ingested, sample: str, regime: Regime) -> list[tuple[float, float, float]]:
    """(normal load, mean force, its standard uncertainty) of a sample at each load, in newton.

    Specimens are averaged first, so that the uncertainty is that of the mean over specimens; with one
    specimen at a load it is that of the mean over its repeats, with one pull that of the reading.
    """
    table = ingested.table()
    rows = table[(table["sample"] == sample) & np.isfinite(table[f"{regime}_N"])]
    means = []
    for load, cell in rows.groupby("normal_load_N", sort=True):
        by_specimen = cell.groupby("specimen")[f"{regime}_N"].mean().to_numpy()
        values = by_specimen if by_specimen.size > 1 else cell[f"{regime}_N"].to_numpy()
        spread = float(values.std(ddof=1) / np.sqrt(values.size)) if values.size > 1 else float("nan")
        alone = float(cell[f"{regime}_u_N"].iloc[0])
        means.append((float(load), float(by_specimen.mean()), spread if values.size > 1 else alone))
    return means


def calibrated_cells(
    campaign: Campaign,
    fits: tuple[LawFit, ...],
    flat: str,
    options: StudyOptions,
    progress: Progress = lambda stage, done, total: None,
) -> tuple[LocalFriction, tuple[Cell, ...]]:
    """Local friction from the flat sample alone, and the runs that predict every sample, by sample and load.

    Kept runs of other samples, loads, laws or sources are deleted, so that what is kept is of this calibration.

    Raises
    ------
    FitError
        The flat sample has no fitted law, static and sliding.
    SimulationError
        A pattern that the lattice cannot hold.
    """
    from tribo.springblock import CalibrationRuns, SimConfig, calibrate, stratified_design

    laws = _flat_laws(fits, flat)
    pressures = [campaign.nominal_pressure_Pa(load) for load in loads_to_simulate(campaign)]
    static, sliding = ((laws[regime].value("mu"), laws[regime].value("tau0_Pa")) for regime in REGIMES)
    calibration = partial(
        calibrate, static, sliding, runs=CalibrationRuns(pressures, seed=options.seed), jobs=options.jobs,
        progress=lambda done, total: progress("calibrating on the flat sample", done, total),
    )  # fmt: skip
    made_from = (static, sliding), pressures, options.seed
    friction = kept_or_made(options.kept, "calibration", made_from, calibration, SOURCES)
    measured = {test.sample for test in campaign.tests}
    samples = {name: pattern for name, pattern in campaign.samples.items() if name in measured}
    design = stratified_design(samples, pressures, options.runs, options.seed, SimConfig(friction=friction))
    cells = cells_of(design)
    if options.kept is not None:
        remove_other_runs(cells, options.kept)
    return friction, cells


def run_named_cells(
    campaign: Campaign,
    fits: tuple[LawFit, ...],
    flat: str,
    options: StudyOptions,
    only: str = "",
    progress: Progress = lambda stage, done, total: None,
) -> tuple[Cell, ...]:
    """Calibrate the model and run the cells that ``only`` names; returns those that ran.

    Raises
    ------
    CampaignError
        ``only`` names nothing this campaign measured.
    """
    _, cells = calibrated_cells(campaign, fits, flat, options, progress)
    chosen = tuple(c for c in cells if only in ("", c.sample, sample_as_word(c.sample), c.name))
    if not chosen and only != "calibration":
        allowed = ", ".join(["calibration", *dict.fromkeys(c.sample for c in cells), *(c.name for c in cells)])
        raise CampaignError(Problem("no_such_cell", "no simulation has this name", found=only, allowed=allowed))
    if chosen:
        run_cells(chosen, options, lambda done, total: progress("simulating the samples", done, total))
    for sample in dict.fromkeys(c.sample for c in chosen):
        own = [c for c in cells if c.sample == sample]
        if any(example_config(own) in c.configs for c in chosen):
            example_run(own, options.kept)
    return chosen


def _flat_laws(fits: tuple[LawFit, ...], flat: str) -> dict[Regime, LawFit]:
    laws = {f.regime: f for f in fits if f.sample == flat and np.isfinite(f.values).all()}
    if len(laws) < len(REGIMES):
        notes = "; ".join(note for f in fits if f.sample == flat for note in f.notes)
        raise FitError(
            Problem("no_flat_law", f"calibration needs both laws of the flat sample {flat}", found=notes or "none")
        )
    return laws


def _as_forces(table: pd.DataFrame, campaign: Campaign) -> pd.DataFrame:
    """The ensemble in the campaign's own loads: N = p A and T = (T/N) N, and ``stratum``, its turn at the load."""
    load = table["pressure_Pa"] * campaign.area_m2
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
