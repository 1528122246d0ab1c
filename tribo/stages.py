"""The street, walked by one campaign: ingest, fit, compare. Pure computing on records; nothing is written."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from tribo.campaign.flat_sample import required_flat_sample, with_flat_sample
from tribo.errors import CampaignError, FitError, Problem
from tribo.records import (
    REGIMES,
    Campaign,
    Comparison,
    ComparisonRow,
    Ingested,
    LawFit,
    Pull,
    Regime,
    SetAside,
    Study,
    Test,
    Trace,
)
from tribo.store.kept_results import Shelf

if TYPE_CHECKING:
    from tribo.comparison.prediction_runs import Cell
    from tribo.diagnose import Diagnosis
    from tribo.diagnose.statistics.predictor import Predictor

Progress = Callable[[str, int, int], None]
Weights = Literal["relative", "ratio", "force", "repeats"]
Until = Literal["ingest", "fit", "compare", "report"]
DIAGNOSED_BY = (
    "diagnose", "mechanisms", "mechanisms_in_model", "virtual_tribometer", "fitting", "laws", "simulate", "records",
)  # fmt: skip
ASSESSED_BY = ("stages", "fitting", "laws", "records")


def _silent(stage: str, done: int, total: int) -> None:
    """Report nothing."""


@dataclass(frozen=True)
class StudyOptions:
    """What a user may choose; every choice is written into the results."""

    rule: str = "seed"
    weights: Weights = "relative"
    flat: str = ""  # the sample that calibrates the model; empty: F, or the only flat sample
    runs: int = 4
    seed: int = 0
    jobs: int = 2
    overrides: Path | None = None  # table of what a person decided about single pulls
    kept: Path | None = None  # folder of finished simulations and diagnosis: the next start goes on from there
    scheduler: str | None = None  # address of a dask scheduler that runs the simulations

    def as_words(self) -> dict[str, str]:
        """What was chosen, for the provenance."""
        return {"rule": self.rule, "weights": self.weights, "flat": self.flat, "runs": str(self.runs)}


DEFAULTS = StudyOptions()


def ingest(
    campaign: Campaign,
    *,
    rule: str = "seed",
    jobs: int = 1,
    overrides: Path | None = None,
    progress: Progress = _silent,
) -> Ingested:
    """Read every usable test of a campaign into a trace and a pull, on ``jobs`` processes where that pays.

    A test that cannot be read is set aside with its problems; the rest goes on. A row that names many pulls within
    its export is a test for each of them. ``overrides`` is a table of what a person decided about single pulls
    (:mod:`tribo.ingestion.overrides`). The result does not depend on ``jobs``.

    Raises
    ------
    CampaignError
        Not one test could be read, or the overrides have faults.
    """
    from tribo.ingestion.exports import read_all
    from tribo.traces.copies import under_the_wrong_test

    traces: dict[str, Trace] = {}
    pulls: dict[str, Pull] = {}
    set_aside = list(campaign.set_aside)
    tests: list[Test] = []
    for done, outcomes in enumerate(read_all(campaign, rule, jobs), start=1):
        for test, outcome in outcomes:
            tests.append(test)
            if isinstance(outcome, SetAside):
                set_aside.append(outcome)
            else:
                traces[test.test_id], pulls[test.test_id] = outcome
        progress("reading exports", done, len(campaign.tests))
    ids = {test.test_id for test in tests} | {fault.test_id for fault in set_aside}
    for test_id, problem in under_the_wrong_test(traces, ids).items():
        del traces[test_id], pulls[test_id]
        set_aside.append(SetAside(test_id, str(problem), (problem,)))
    if not pulls:
        raise CampaignError(
            [p for fault in set_aside for p in fault.problems]
            or [Problem("no_usable_test", "no test of this campaign can be used", file=str(campaign.root))]
        )
    ingested = Ingested(replace(campaign, tests=tuple(tests)), traces, pulls, tuple(set_aside))
    if overrides is None:
        return ingested
    from tribo.ingestion.overrides import apply_overrides

    return apply_overrides(ingested, overrides, rule)


def fit(ingested: Ingested, *, weights: Weights = "relative") -> tuple[LawFit, ...]:
    """mu and tau0 of every sample, static and sliding: specimens first, then combined.

    A regime that no pull shows has no fits.

    Raises
    ------
    FitError
        No sample has enough loads for the law.
    """
    from tribo.fitting import fit_samples

    table = ingested.table()
    area = ingested.campaign.nominal_area_m2
    found: list[LawFit] = []
    problems: list[Problem] = []
    for regime in REGIMES:
        try:
            found += fit_samples(table, regime, area, weights=weights)
        except FitError as why:
            if np.isfinite(table[f"{regime}_N"]).any():
                raise
            problems += why.problems  # a log of steps while sliding has no static peaks, and a law all the same
    if not found:
        raise FitError(problems)
    return tuple(found)


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


def simulate_cells(
    ingested: Ingested, fits: tuple[LawFit, ...], options: StudyOptions, only: str = "", progress: Progress = _silent
) -> tuple[Cell, ...]:
    """Calibrate the model and run what :func:`compare` will need, into ``options.kept``; returns the cells that ran.

    ``only`` is the name of a cell ("Sx@18180Pa"), a sample, "calibration", or empty for all.

    Raises
    ------
    CampaignError
        No flat sample to calibrate on, or ``only`` names nothing this campaign measured.
    """
    from tribo.comparison.prediction import calibrated_cells
    from tribo.comparison.prediction_runs import example_config, example_run, remove_strangers, run_cells

    campaign = with_flat_sample(ingested.campaign, options.flat)
    flat = required_flat_sample(campaign)
    _, cells = calibrated_cells(
        campaign, fits, flat, runs=options.runs, seed=options.seed, jobs=options.jobs, kept=options.kept,
        progress=progress,
    )  # fmt: skip
    if options.kept is not None:
        remove_strangers(cells, options.kept)  # what a diagnosis finds kept is then of this calibration
    chosen = tuple(c for c in cells if only in ("", c.sample, c.name))
    if not chosen and only != "calibration":
        allowed = ", ".join(["calibration", *dict.fromkeys(c.sample for c in cells), *(c.name for c in cells)])
        raise CampaignError(Problem("no_such_cell", "nothing of this name to simulate", found=only, allowed=allowed))
    if chosen:
        run_cells(
            chosen, options.kept, options.jobs, options.scheduler,
            lambda done, total: progress("simulating the samples", done, total),
        )  # fmt: skip
    for sample in dict.fromkeys(c.sample for c in chosen):
        own = [c for c in cells if c.sample == sample]
        if any(example_config(own) in c.configs for c in chosen):
            example_run(own, options.kept)
    return chosen


def compare(
    ingested: Ingested, fits: tuple[LawFit, ...], options: StudyOptions = DEFAULTS, *, progress: Progress = _silent
) -> Study:
    """Calibrate the model on the flat sample, predict every sample at its loads, and put both side by side.

    Raises
    ------
    CampaignError
        No flat sample to calibrate on.
    FitError, SimulationError
        The flat sample gives no law, or the model cannot be run for a pattern.
    """
    from tribo.comparison.prediction import predict

    campaign = with_flat_sample(ingested.campaign, options.flat)
    flat = required_flat_sample(campaign)
    ingested = replace(ingested, campaign=campaign)
    prediction = predict(
        campaign, fits, flat, weights=options.weights, runs=options.runs, seed=options.seed, jobs=options.jobs,
        kept=options.kept, scheduler=options.scheduler, progress=progress,
    )  # fmt: skip
    rows = [
        ComparisonRow(sample, regime, load, mean, u, *prediction.force_N(sample, regime, load))
        for regime in REGIMES
        for sample in prediction.samples
        for load, mean, u in load_means(ingested, sample, regime)
    ]
    comparison = Comparison(
        campaign.title,
        campaign.nominal_area_m2,
        {s: campaign.area_fraction(s) for s in prediction.samples},
        fits,
        prediction.fits,
        tuple(rows),
        prediction.calibration,
        flat,
    )
    return Study(
        ingested, fits, (), comparison, prediction.table, prediction.example_runs, notes=prediction.notes
    )


def study(
    campaign: Campaign, options: StudyOptions = DEFAULTS, *, until: Until = "report", progress: Progress = _silent
) -> Study:
    """Walk the street with one campaign as far as ``until``."""
    chosen = with_flat_sample(campaign, options.flat)
    ingested = ingest(chosen, rule=options.rule, jobs=options.jobs, overrides=options.overrides, progress=progress)
    if until == "ingest":
        return Study(ingested)
    fits = fit(ingested, weights=options.weights)
    walked = Study(ingested, fits) if until == "fit" else compare(ingested, fits, options, progress=progress)
    return assess(walked, options)


def assess(walked: Study, options: StudyOptions = DEFAULTS) -> Study:
    """The fits of a study looked at from other sides: other weights and laws, budget, power, outlying pulls."""
    made_from = (walked.ingested, walked.fits, options.weights)
    looks = Shelf(options.kept).take("assessment", made_from, lambda: _looks(walked, options), ASSESSED_BY)
    return replace(walked, **looks)


def _looks(walked: Study, options: StudyOptions) -> dict[str, Any]:
    """What :func:`assess` adds to a study, by the name of its field."""
    import pandas as pd

    from tribo.fitting import campaign_budgets, outlying_pulls, outlying_specimens, power_of_campaign
    from tribo.fitting.paired import differences_table, paired_differences

    ingested = walked.ingested
    table, area = ingested.table(), ingested.campaign.nominal_area_m2
    budgets = campaign_budgets(ingested, walked.fits, weights=options.weights)
    parts = [b.table().assign(sample=b.fit.sample, regime=b.fit.regime) for b in budgets]
    power: list[str] = []
    outlying: list[str] = []
    for regime in REGIMES:
        with suppress(FitError):
            power += [p.text() for p in power_of_campaign(table, regime, area, weights=options.weights)]
        for look in (outlying_pulls, outlying_specimens):
            with suppress(FitError):
                outlying += [found.text() for found in look(table, regime, area)]
    return {
        "other_fits": _other_fits(ingested, options),
        "budget": pd.concat(parts, ignore_index=True) if parts else None,
        "power": tuple(power),
        "outlying": tuple(outlying),
        "differences": differences_table(paired) if (paired := paired_differences(walked.fits)) else None,
    }


def diagnosis(
    ingested: Ingested, *, seed: int = 0, jobs: int = 2, kept: Path | None = None, progress: Progress = _silent
) -> Diagnosis:
    """What the calibrated model gets wrong and why, with all it rests on; taken from ``kept`` where it is there.

    What the model makes of each pattern comes from the campaign's own simulations where ``kept`` holds them, else
    from the tabulated ones; a named mechanism is then put into the simulator itself.

    Raises
    ------
    FitError
        Fewer than twelve usable tests.
    """
    from tribo.diagnose import examine, with_simulation

    predictor = own_predictor(ingested.campaign, kept)

    def found() -> Diagnosis:
        examined = examine(ingested, seed=seed, predictor=predictor, progress=progress)
        return with_simulation(examined, seed=seed, jobs=jobs, progress=progress)

    return Shelf(kept).take("diagnosis", (ingested, seed, predictor), found, DIAGNOSED_BY)


def own_predictor(campaign: Campaign, kept: Path | None) -> Predictor | None:
    """The predictor from simulations of this campaign, where ``kept`` holds them for the flat sample at least."""
    from tribo.comparison.prediction_runs import kept_runs
    from tribo.diagnose import simulated_predictor

    runs = kept_runs(kept, campaign.samples) if kept is not None else None
    if runs is None:
        return None
    load = runs["pressure_Pa"] * campaign.nominal_area_m2
    forces = runs.assign(
        normal_load_N=load, static_N=runs["static_friction"] * load, sliding_N=runs["sliding_friction"] * load
    )
    flat = campaign.flat_sample
    if flat not in set(forces["sample"]):
        return None
    return simulated_predictor(campaign.samples, forces, flat, campaign.nominal_area_m2)


def _other_fits(ingested: Ingested, options: StudyOptions) -> tuple[LawFit, ...]:
    """The same law under the other weights, mixed models where they converge, and the three-term law."""
    from tribo.fitting import fit_samples, fit_three_term, mixed_model

    table, area = ingested.table(), ingested.campaign.nominal_area_m2
    fractions = {s: ingested.campaign.area_fraction(s) for s in sorted(set(table["sample"]))}
    found: list[LawFit] = []
    for regime in REGIMES:
        for weights in get_args(Weights):
            if weights != options.weights:
                with suppress(FitError):  # "repeats" needs repeats, "ratio" loads above zero
                    found += fit_samples(table, regime, area, weights=weights)
        mixed = (mixed_model(rows, regime, area) for _, rows in table.groupby("sample"))
        found += [fit for fit in mixed if fit is not None]
        with suppress(FitError):
            found.append(fit_three_term(table, regime, area, fractions))
    return tuple(found)


def plan(campaign: Campaign, options: StudyOptions, until: Until) -> dict[str, Any]:
    """What a walk would do, without doing it: ``steps`` in words, ``set_aside``, and the faults in full."""
    from tribo.comparison.prediction import loads_to_simulate

    steps = [f"read {len(campaign.tests)} exports of {campaign.root} by rule {options.rule}"]
    campaign = with_flat_sample(campaign, options.flat)
    samples = sorted({t.sample for t in campaign.tests})
    if unknown := sum(np.isnan(t.normal_load_N) for t in campaign.tests):
        steps.append(f"take the load of {unknown} tests from their exports")
    if until != "ingest":
        steps.append(f"fit mu and tau0 of {len(samples)} samples ({', '.join(samples)}), weights {options.weights}")
    if until in ("compare", "report"):
        loads = loads_to_simulate(campaign)
        flat = required_flat_sample(campaign)
        runs = len(samples) * len(loads) * options.runs
        steps.append(f"calibrate the model on sample {flat} and run it {runs} times at {len(loads)} loads")
    return {
        "steps": steps,
        "set_aside": [f"{s.test_id}: {s.reason}" for s in campaign.set_aside],
        "problems": [asdict(p) for p in campaign.problems],
    }
