"""The stages of a study of one campaign: ingest, fit, compare, diagnose. They compute on records and write no files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribo.campaign.load import required_flat_sample, with_flat_sample, with_zeros
from tribo.errors import FitError, SimulationError
from tribo.kept_results import kept_or_made
from tribo.records import (
    Campaign,
    Doubt,
    Feature,
    Fits,
    Ingested,
    LawFit,
    Pull,
    Run,
    Study,
    StudyOptions as StudyOptions,
    Trace,
    Weights,
)
from tribo.zeroing import DEFAULT as AUTOMATIC_ZERO

if TYPE_CHECKING:
    from tribo.comparison.prediction import Cell
    from tribo.diagnostics import Diagnosis
    from tribo.diagnostics.diagnosis import DiagnosisWithoutModel
    from tribo.diagnostics.predictor import Predictor

Progress = Callable[[str, int, int], None]
Until = Literal["ingest", "fit", "compare", "report"]
DIAGNOSED_BY = (
    "diagnostics", "lawsearch", "mechanisms", "mechanisms_in_model", "fitting", "laws", "springblock", "records",
    "fits",
)  # fmt: skip
ASSESSED_BY = ("fitting", "laws", "records", "fits", "vocabulary")


def _silent(stage: str, done: int, total: int) -> None:
    """Report nothing."""


DEFAULTS = StudyOptions()


def ingest(
    campaign: Campaign,
    *,
    rule: str = "first_peak",
    jobs: int = 1,
    overrides: Path | None = None,
    progress: Progress = _silent,
) -> Ingested:
    """Read every usable test of a campaign into a trace and a pull.

    A test that cannot be read is set aside with its problems; the other tests are read. A row that names several pulls
    of its export becomes one test per pull.

    Parameters
    ----------
    campaign : Campaign
        From :func:`load_campaign`.
    rule : str
        How static and sliding friction are read from a trace, a name in ``tribo.traces.RULES``.
    jobs : int
        Processes that read at once, where that pays; the result does not depend on it.
    overrides : Path, optional
        Table of decisions made by hand about single pulls (:mod:`tribo.ingestion.overrides`).
    progress : callable, optional
        Called with a stage, the steps done and the steps there are.

    Returns
    -------
    Ingested
        ``pulls`` and ``traces`` by the id of the test, ``set_aside`` with reasons; ``table()`` has one row per pull.

    Raises
    ------
    CampaignError
        No test could be read, or the overrides have errors.

    Examples
    --------
    >>> ingested = tribo.ingest(tribo.load_campaign(tribo.data_dir() / "example"))
    >>> print(f"{ingested.pulls['T001'].static_N:.2f} N of {len(ingested.pulls)} pulls")
    2.22 N of 144 pulls
    """
    from tribo.ingestion.exports import ingest_campaign, with_readings
    from tribo.ingestion.overrides import apply_overrides
    from tribo.traces.rules import rule_of_today

    rule = rule_of_today(rule)
    ingested = ingest_campaign(campaign, rule, jobs, progress)
    return with_readings(ingested if overrides is None else apply_overrides(ingested, overrides, rule))


def fit(ingested: Ingested, *, weights: Weights = "relative") -> Fits:
    """mu and tau0 of every sample, static and sliding, with their combined uncertainty.

    Parameters
    ----------
    ingested : Ingested
        The campaign with its pulls, from :func:`ingest`.
    weights : "relative", "ratio", "force" or "repeats"
        Which scatter is taken as constant over the loads; see :mod:`tribo.fitting.linear`.

    Returns
    -------
    Fits
        One :class:`tribo.records.LawFit` for every sample and regime that a pull shows: ``fits[0]``,
        ``fits["A", "static"]``, ``fits["A"]`` for both regimes; ``fits.table()`` is fits.csv. mu has no unit, tau0 is
        in Pa (without a nominal area T0 in N). Uncertainties are combined standard uncertainties (k = 1): specimens
        and repeats, partly pooled over the samples, and the instrument. ``mu_type_a_u`` is that of the specimens and
        repeats of the sample alone.

    Raises
    ------
    FitError
        No sample has enough loads for the law.

    Examples
    --------
    >>> ingested = tribo.ingest(tribo.load_campaign(tribo.data_dir() / "example"))
    >>> fits = tribo.fit(ingested)
    >>> print(f"{fits['F', 'static'].mu:.1f}")
    4.7
    """
    from tribo.fitting.budget import combined_fits
    from tribo.fitting.samples import fit_regimes

    alone = fit_regimes(ingested.table(), ingested.campaign.nominal_area_m2, weights=weights)
    return combined_fits(ingested, alone, weights=weights)


def _alone(fits: Iterable[LawFit]) -> tuple[LawFit, ...]:
    """The fits by the tests of each sample alone: model and measurement are compared by them.

    What all pulls share moves every sample of a campaign, and with it the model that is calibrated on one of them.
    """
    return tuple(fit.by_itself for fit in fits)


def simulate_cells(
    ingested: Ingested, fits: Fits, options: StudyOptions, only: str = "", progress: Progress = _silent
) -> tuple[Cell, ...]:
    """Calibrate the model, run the simulations that :func:`compare` needs and keep them; returns their cells.

    ``only`` is the name of a cell ("Sx@18180Pa"), a sample, "calibration", or empty for all.

    Raises
    ------
    CampaignError
        No flat sample to calibrate on, or ``only`` names nothing that this campaign measured.
    """
    from tribo.comparison.prediction import run_named_cells

    campaign = with_flat_sample(ingested.campaign, options.flat)
    flat = required_flat_sample(campaign)
    return run_named_cells(campaign, _alone(fits), flat, options, only, progress)


def compare(
    ingested: Ingested, fits: Fits, options: StudyOptions = DEFAULTS, *, progress: Progress = _silent
) -> Study:
    """Calibrate the model on the flat sample, predict every sample at its loads, and compare.

    Parameters
    ----------
    ingested : Ingested
        The campaign with its pulls.
    fits : Fits
        From :func:`fit`. The model is calibrated and judged by the tests of each sample alone (type A), since what all
        pulls share moves every sample.
    options : StudyOptions, optional
        Number of runs, seed, processes, the folder of finished simulations, the flat sample.
    progress : callable, optional
        Called with a stage, the steps done and the steps there are.

    Returns
    -------
    Study
        ``comparison.rows`` holds the measured and the simulated force in N at each load, with standard uncertainties;
        ``simulated`` one row per run.

    Raises
    ------
    CampaignError
        No flat sample to calibrate on, or no nominal area.
    FitError, SimulationError
        The flat sample gives no law, or the model cannot be run for a pattern.

    Examples
    --------
    >>> from dataclasses import replace
    >>> campaign = tribo.load_campaign(tribo.data_dir() / "example")
    >>> few = tuple(test for test in campaign.tests if test.sample in "FA" and test.normal_load_N > 0.4)
    >>> ingested = tribo.ingest(replace(campaign, tests=few))
    >>> study = tribo.compare(ingested, tribo.fit(ingested), tribo.StudyOptions(runs=2))
    >>> for row in study.comparison.rows:
    ...     if row.sample == "A" and row.regime == "static":
    ...         print(f"{row.normal_load_N:.2f} N: {row.measured_N:.1f} N, of the model {row.simulated_N:.1f} N")
    0.51 N: 3.7 N, of the model 3.3 N
    1.37 N: 8.8 N, of the model 7.0 N
    """
    from tribo.comparison.prediction import calibrated_cells, predict

    campaign = with_flat_sample(ingested.campaign, options.flat)
    ingested = replace(ingested, campaign=campaign)
    flat = required_flat_sample(campaign)
    alone = _alone(fits)
    calibrated = calibrated_cells(campaign, alone, flat, options, progress)
    comparison, simulated, example_runs = predict(ingested, alone, flat, calibrated, options, progress)
    return Study(
        ingested, fits, comparison=comparison, simulated=simulated, example_runs=example_runs,
        recorded_runs=_as_recorded(ingested, example_runs, flat, options.rule),
    )  # fmt: skip


def _as_recorded(
    ingested: Ingested, runs: Iterable[Run], flat: str, rule: str
) -> dict[str, tuple[Trace, Pull, Mapping[str, Feature]]]:
    """The example run of each sample as recorded by the machine of the campaign, by the test that it lies beside.

    That test is of the load nearest to the run. The stiffness of the machine is the one stated, else that of the rise
    of the flat sample; a test without a speed or a rise has no run beside it.
    """
    from tribo.errors import TraceError
    from tribo.mechanisms_in_model import Recorder, as_recorded
    from tribo.traces import PullOptions, evaluate, features_of

    area = ingested.campaign.area_m2
    found: dict[str, tuple[Trace, Pull, Mapping[str, Feature]]] = {}
    rises: dict[str, list[float]] = {}
    for test in ingested.campaign.tests:
        if (rise := ingested.features.get(test.test_id, {}).get("rise_stiffness_N_per_m")) is not None:
            rises.setdefault(test.sample, []).append(rise.value)
    for run in runs:
        load = area * run.pressure_Pa
        tests = [t for t in ingested.campaign.tests if t.sample == run.sample and t.test_id in ingested.traces]
        tests = [t for t in tests if t.test_id in ingested.pulls and np.isfinite(ingested.pulls[t.test_id].static_N)]
        tests = [t for t in tests if t.speed_m_s]
        if not tests or flat not in rises:
            continue
        nearest = min(abs(np.log(t.normal_load_N / load)) for t in tests)
        beside = [t for t in tests if abs(np.log(t.normal_load_N / load)) <= nearest + 1e-6]
        test = ingested.typical(beside)
        pull, trace = ingested.pulls[test.test_id], ingested.traces[test.test_id]
        rate = 1.0 / float(np.median(np.diff(trace.time_s)))
        speed = float(test.speed_m_s or np.nan)
        stiffness = test.stiffness_N_per_m or float(np.median(rises[flat]))
        way = speed * float(trace.time_s[-1] - (pull.peak_s if np.isfinite(pull.peak_s) else trace.time_s[0]))
        noise = pull.noise_N if np.isfinite(pull.noise_N) else 0.0
        shown = as_recorded(
            run, Recorder(rate, noise), speed_m_s=speed, stiffness_N_per_m=stiffness, nominal_area_m2=area,
            slides_m=max(way, 0.0),
        )  # fmt: skip
        try:
            read = evaluate(shown, PullOptions(rule, test=replace(test, normal_load_N=load, zero=AUTOMATIC_ZERO)))
        except TraceError:
            continue  # a recorder too slow for the run
        found[test.test_id] = shown, read, features_of(shown, read, speed)
    return found


def study(
    campaign: Campaign, options: StudyOptions = DEFAULTS, *, until: Until = "report", progress: Progress = _silent
) -> Study:
    """Run the stages up to ``until`` on one campaign.

    Without a pattern, a flat sample or a nominal area, or by choice, the spring-block model is left out; a note says
    why.

    Parameters
    ----------
    campaign : Campaign
        From :func:`load_campaign`.
    options : StudyOptions, optional
        Options of every stage.
    until : "ingest", "fit", "compare" or "report"
        The last stage; "fit" takes seconds, the model minutes.
    progress : callable, optional
        Called with a stage, the steps done and the steps there are.

    Returns
    -------
    Study
        What the stages gave; ``fits``, ``residuals()`` and ``ingested.table()`` are tables and records of the results.

    Raises
    ------
    CampaignError
        No test could be read.
    FitError, SimulationError
        No sample gives a law that the model needs, or the model cannot be run for a pattern.

    Examples
    --------
    >>> study = tribo.study(tribo.load_campaign(tribo.data_dir() / "example"), until="fit")
    >>> print(f"{study.fits['B', 'static'].mu:.2f} ± {study.fits['B', 'static'].mu_u:.2f}")
    2.16 ± 0.09
    """
    chosen = with_zeros(with_flat_sample(campaign, options.flat), options.zero, options.load_zero)
    ingested = ingest(chosen, rule=options.rule, jobs=options.jobs, overrides=options.overrides, progress=progress)
    if until == "ingest":
        return with_doubts(Study(ingested))
    with naming_set_aside(ingested):
        without = without_model(ingested.campaign, options) if until != "fit" else ""
        fits = Fits()
        no_law = ""
        if options.trace_law:
            from tribo.tracelaws import trace_laws_of

            read = trace_laws_of(ingested, options.trace_law)
        else:
            read = ()
        try:
            fits = fit(ingested, weights=options.weights)
        except FitError as why:
            if not without and not read:
                raise
            no_law = f"No friction law over load was fitted: {why}."
        if until == "fit" or without:
            fitted = Study(ingested, fits, notes=tuple(filter(None, (without, no_law))))
        else:
            try:
                fitted = compare(ingested, fits, options, progress=progress)
            except SimulationError as why:
                if any(problem.file or problem.column == "scheduler" for problem in why.problems):
                    raise  # of a file or a cluster, not of the law of the flat sample
                without = f"The spring-block model cannot be run with the friction law of the flat sample: {why}."
                fitted = Study(ingested, fits, notes=(without,))
        return assess(with_doubts(replace(fitted, trace_laws=read)), options)


@contextmanager
def naming_set_aside(ingested: Ingested) -> Iterator[None]:
    """Add to an error for want of usable tests why tests were set aside."""
    try:
        yield
    except FitError as why:
        problems = [p.at(test_id=s.test_id) for s in ingested.set_aside for p in s.problems]
        raise FitError((*why.problems, *problems)) from why


def with_doubts(study: Study) -> Study:
    """The study with the numbers that lie outside their broad physical bounds, or far from those of their siblings."""
    fits = study.fits
    with suppress(FitError):
        fits = fits or fit(study.ingested)
    return replace(study, doubts=all_doubts(study.ingested, _alone(fits)))


def all_doubts(ingested: Ingested, fits: Sequence[LawFit]) -> tuple[Doubt, ...]:
    """Doubts of stated columns that explain others, of pulls by their siblings, of signals, and of what is fitted."""
    from tribo.fitting.siblings import sibling_doubts
    from tribo.plausibility import bound_of, doubts_of, mixed_units

    ratio = bound_of("friction_ratio", ingested.campaign)
    causes = tuple(mixed_units(ingested.campaign))
    loads_in_two_units = any(doubt.quantity in ("mass_g", "normal_load_N") for doubt in causes)
    siblings = () if loads_in_two_units else sibling_doubts(ingested, plausible=(ratio.low, ratio.high))
    others = (d for d in doubts_of(ingested.campaign, ingested, fits) if d not in causes)
    return (*causes, *siblings, *others)


def without_model(campaign: Campaign, options: StudyOptions) -> str:
    """Why the spring-block model is not run, as a sentence; empty where it is."""
    if options.no_model:
        return "The spring-block model was not run, as requested."
    patterns = [campaign.samples[test.sample] for test in campaign.tests]
    if all(pattern.is_flat for pattern in patterns):
        return "No sample has a pattern, so the spring-block model has nothing to predict. It was not run."
    if not campaign.flat_samples:
        return "No flat sample was measured, so the spring-block model cannot be calibrated. It was not run."
    if not campaign.has_area:
        return "The nominal area is not given, so the spring-block model has no pressure to start from. It was not run."
    return ""


def assess(study: Study, options: StudyOptions = DEFAULTS) -> Study:
    """Add to a study: fits with other weights and laws, uncertainty budget, power and outlying pulls.

    Parameters
    ----------
    study : Study
        A study with its fits, from :func:`compare` or ``study(campaign, until="fit")``.
    options : StudyOptions, optional
        ``weights`` of the fits, and the folder ``kept`` of finished results.

    Returns
    -------
    Study
        The same with ``other_fits``, ``budget``, ``power``, ``outlying``, ``laws``, ``dependence`` and ``differences``.

    Examples
    --------
    >>> ingested = tribo.ingest(tribo.load_campaign(tribo.data_dir() / "example"))
    >>> study = tribo.assess(tribo.Study(ingested, tribo.fit(ingested)))
    >>> sorted(study.budget["type"].unique())
    ['', 'A', 'B']
    """
    from tribo.fitting.assessment import assessment

    made_from = (study.ingested, study.fits, options.weights)
    found = kept_or_made(options.kept, "assessment", made_from, lambda: assessment(*made_from), ASSESSED_BY)
    return replace(study, **found)


def with_fits(read: Study, weights: Weights = "relative") -> Study:
    """The study with its fits; as it is where no law can be fitted."""
    with suppress(FitError):
        return replace(read, fits=fit(read.ingested, weights=weights))
    return read


def diagnose(
    ingested: Ingested,
    *,
    seed: int = 0,
    jobs: int = 2,
    kept: Path | None = None,
    laws: Path | None = None,
    progress: Progress = _silent,
) -> Diagnosis | DiagnosisWithoutModel:
    """Where the calibrated model fails on a campaign and why, with the evidence.

    The model's prediction for each pattern comes from the simulations of the campaign if ``kept`` holds them, else from
    tabulated ones. What no mechanism explains is searched for its law. A mechanism that is named is then simulated as
    part of the spring-block model.

    Parameters
    ----------
    ingested : Ingested
        A campaign with its exports read.
    seed : int
        Of the simulated campaigns that stand for chance, and of the simulated pulls.
    jobs : int
        How many simulations run at once.
    kept : Path, optional
        Folder of finished results; a diagnosis made of the same inputs is taken from it.
    laws : Path, optional
        Folder with laws of other campaigns (``law-*.toml``), which are tested on this one.
    progress : callable, optional
        Called with a stage, the steps done and the steps there are.

    Returns
    -------
    Diagnosis
        ``verdict`` is the record behind verdict.json; ``baseline``, ``screened`` and ``named`` are what it rests on.
        Of fewer than twelve usable tests, of one load or of one sample a DiagnosisWithoutModel, whose verdict is
        "cannot_tell".

    Raises
    ------
    FitError
        The name of a mechanism that there is not.

    Examples
    --------
    >>> found = tribo.diagnose(tribo.ingest(tribo.load_campaign("data/example")))
    >>> found.verdict.verdict in ("no_misfit", "named", "undetermined", "partly", "unknown", "cannot_tell")
    True
    """
    from tribo.diagnostics import examine, predictor as pattern_table, with_simulation
    from tribo.diagnostics.conclusion import cannot_tell
    from tribo.diagnostics.diagnosis import DiagnosisWithoutModel
    from tribo.lawsearch.diagnosis_with_laws import with_law_across, with_laws
    from tribo.lawsearch.known_laws import read_laws
    from tribo.wording.verdict_sentences import worded

    predictor = own_predictor(ingested.campaign, kept)
    title = ingested.campaign.title
    known = tuple(law for law in (read_laws(laws) if laws is not None else ()) if law.found_in != title)

    def found() -> Diagnosis:
        examined = examine(ingested, seed=seed, predictor=predictor, progress=progress)
        examined = with_law_across(with_laws(examined, known, seed=seed, progress=progress), seed=seed)
        return with_simulation(examined, seed=seed, jobs=jobs, progress=progress).without_columns()

    if (untold := cannot_tell(ingested)) is not None:
        return DiagnosisWithoutModel(worded(untold))
    made_from = (ingested, seed, predictor, pattern_table.record(), known)
    diagnosed: Diagnosis = kept_or_made(kept, "diagnosis", made_from, found, DIAGNOSED_BY)
    return replace(diagnosed, verdict=worded(diagnosed.verdict))


def diagnosis(ingested: Ingested, **options: Any) -> Diagnosis | DiagnosisWithoutModel:
    """The old name of :func:`tribo.diagnose`."""
    warnings.warn("tribo.diagnosis is called tribo.diagnose now", FutureWarning, stacklevel=2)
    return diagnose(ingested, **options)


def diagnosis_without_model(study: Study, *, seed: int = 0, kept: Path | None = None) -> DiagnosisWithoutModel:
    """What friction varies with beyond the law of each sample over load; taken from ``kept`` if it is there.

    ``study`` holds the laws of its samples (:func:`assess`), as that of :func:`study` does where the spring-block model
    was not run.
    """
    from tribo.diagnostics.diagnosis import DiagnosisWithoutModel
    from tribo.diagnostics.without_model import diagnose_without_model
    from tribo.wording.verdict_sentences import worded

    made_from = (study.ingested, study.laws, seed)

    def diagnosed() -> DiagnosisWithoutModel:
        return DiagnosisWithoutModel(diagnose_without_model(study, seed=seed))

    found: DiagnosisWithoutModel = kept_or_made(kept, "alone", made_from, diagnosed, DIAGNOSED_BY)
    return DiagnosisWithoutModel(worded(found.verdict))


def own_predictor(campaign: Campaign, kept: Path | None) -> Predictor | None:
    """The predictor from simulations of this campaign, where ``kept`` holds them for the flat sample at least."""
    from tribo.comparison.prediction import kept_runs
    from tribo.diagnostics import simulated_predictor

    runs = kept_runs(kept, campaign.samples) if kept is not None else None
    if runs is None:
        return None
    load = runs["pressure_Pa"] * campaign.area_m2
    forces = runs.assign(
        normal_load_N=load, static_N=runs["static_friction"] * load, sliding_N=runs["sliding_friction"] * load
    )
    flat = campaign.flat_sample
    if flat not in set(forces["sample"]):
        return None
    return simulated_predictor(campaign.samples, forces, flat, campaign.area_m2)
