"""Every file that tribo writes into a folder of results: stated once, here, and written through :func:`write` alone.

The tables of a study, campaign.nc, the protection of a user's own files (:mod:`tribo.own_folder`),
:mod:`tribo.report.provenance` and the page docs/reference/files.md read this registry.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribo.files import write_bytes
from tribo.user_text import for_spreadsheet

if TYPE_CHECKING:
    import pandas as pd

FLOAT_FORMAT = "%.8g"
# How the end of a column name says its unit; the longest ending wins.
UNIT_ENDINGS = {
    "_N_per_s": "N/s", "_N_per_m": "N/m", "_m_s": "m/s", "_mm_s": "mm/s", "_u_kPa": "kPa", "_kPa": "kPa", "_Pa": "Pa",
    "_N": "N", "_m2": "m2", "_N_m": "N/m", "_N_s_per_m": "N s/m", "_Pa_per_m": "Pa/m", "_kg_m3": "kg/m3",
    "_per_s": "1/s", "_N_per_decade": "N", "_per_m": "1/m", "_J": "J",
    "_u_N": "N", "_s": "s", "_m": "m", "_kg": "kg", "_deg": "degree", "_C": "degC", "_um": "um", "_Hz": "Hz",
    "_pct": "percent", "_percent": "percent",
}  # fmt: skip
UNITLESS = {
    "mu": "1", "mu_u": "1", "ratio": "1", "ratio_low": "1", "ratio_high": "1", "cov": "kPa", "mu_s": "1",
    "friction_mu_s": "1",
}  # fmt: skip


def unit_of(column: str) -> str | None:
    """Unit of a column by the house rule that the unit ends the name; None where it has none."""
    if column in UNITLESS:
        return UNITLESS[column]
    endings = [e for e in UNIT_ENDINGS if column.endswith(e)]
    return UNIT_ENDINGS[max(endings, key=len)] if endings else None


def end_of(column: str, end: str) -> str:
    """Name of the column that holds an ``end`` of the interval of another: force_N and low make force_low_N."""
    endings = [e for e in UNIT_ENDINGS if column.endswith(e)]
    unit = max(endings, key=len) if endings else ""
    return f"{column.removesuffix(unit)}_{end}{unit}"


@dataclass(frozen=True)
class Product:
    """One file of results, or several whose names fit one pattern.

    ``stage`` is the stage of a study, or the command, that makes it; ``text`` says what it holds. Tables state their
    ``columns`` in order, each with what it holds; the unit ends the name (:func:`unit_of`). Those of ``optional`` may
    be absent, and where ``open_ended`` is set a user's own columns follow. The ``writer`` of a table of a study is the
    function of the study and its diagnosis (None where there is none) that makes it, or None where there is nothing to
    write; other files are given to :func:`write` by the stage. ``group`` is the group of campaign.nc that holds the
    same table, one entry of the dimension ``row`` for each row. ``origin_in`` are the endings of files that state the
    origin of their numbers, which ``tribo verify`` reads.
    """

    name: str
    stage: str
    text: str
    columns: Mapping[str, str] = field(default_factory=dict)
    writer: str = ""
    group: str = ""
    row: str = ""
    optional: tuple[str, ...] = ()
    open_ended: bool = False
    origin_in: tuple[str, ...] = ()

    @property
    def column_names(self) -> list[str]:
        return list(self.columns)

    def table(self, study: Any, diagnosis: Any = None) -> pd.DataFrame | None:
        """What its writer makes of a study."""
        module, _, function = self.writer.partition(":")
        made: pd.DataFrame | None = getattr(import_module(module), function)(study, diagnosis)
        return made


TESTS = {
    "test_id": "the test",
    "static_N": "static friction force",
    "static_u_N": "its standard uncertainty from the reading",
    "sliding_N": "mean sliding friction force",
    "sliding_u_N": "its standard uncertainty from the reading",
    "rule": "rule by which both were read",
    "window": "sliding window, from:to in seconds",
    "zero_N": "zero that was subtracted from every force",
    "flags": "what is doubtful about the pull; see the [flags](../howto/read-your-report.md)",
    "set_aside": "why the test takes no part; empty if it does",
    "sample": "sample",
    "specimen": "specimen",
    "normal_load_N": "normal load",
    "peak_s": "time of the static peak",
    "onset_s": "time at which the force begins to rise",
    "window_start_s": "start of the sliding window",
    "window_end_s": "end of the sliding window",
    "zero_u_N": "standard uncertainty of the zero",
    "rise_N_per_s": "slope of the force before the peak",
    "rise_stiffness_N_per_m": "the same slope against the displacement",
    "stick_slip_amplitude_N": "amplitude of stick-slip in the window",
    "stick_slip_period_s": "period of stick-slip in the window",
    "noise_N": "standard deviation of the noise",
    "drift_N_per_s": "drift of the sliding force",
    "direction": "direction of the pull",
    "speed_m_s": "pull speed",
    "hold_s": "time at rest under load before the pull",
    "repeat": "number of the repeat",
    "run_order": "place in the order of all tests",
    "specimen_run": "place in the order of the tests of the specimen",
    "started_at": "date and time",
    "temperature_C": "temperature",
    "humidity_pct": "relative humidity",
    "operator": "operator",
    "file": "the export",
    "doubts": "numbers outside their physical bounds, and what may explain them",
    "zero_rule": "where the zero was taken",
    "first_maximum_N": "static force read at the first maximum",
    "highest_N": "static force read at the highest point before sliding",
    "first_drop_N": "static force read before the first drop",
    "recorded_load_N": "mean of the recorded normal force",
    "recorded_load_u_N": "its standard uncertainty",
    "regime": "how the force varies while sliding: steady, stick-slip, inertial oscillation or irregular",
    "cycles": "number of stick-slip cycles",
    "stick_peak_N": "force at the end of a stick, median over the cycles",
    "stick_peak_u_N": "its standard uncertainty",
    "stick_trough_N": "force after the slip, median over the cycles",
    "stick_trough_u_N": "its standard uncertainty",
    "stick_drop_N": "force lost in a slip, median over the cycles",
    "stick_drop_u_N": "its standard uncertainty",
    "stick_period_s": "period of the cycles",
    "stick_period_u_s": "its standard uncertainty",
    "loading_N_per_s": "slope of the force while it rises in a cycle",
    "loading_u_N_per_s": "its standard uncertainty",
    "stuck_share": "share of the time spent stuck",
    "stuck_share_u": "its standard uncertainty",
    "restarts": "number of restarts after a stop of the drive",
    "restart_N": "static force of the first restart",
    "restart_u_N": "its standard uncertainty",
    "restart_hold_s": "time of the hold before it",
}
RESTARTS = {
    "test_id": "the test",
    "sample": "sample",
    "specimen": "specimen",
    "normal_load_N": "normal load",
    "restart": "number of the restart in the test",
    "hold_s": "time that the drive stood still",
    "stop_s": "time at which it stopped",
    "peak_s": "time of the static peak",
    "static_N": "static force of the restart",
    "static_u_N": "its standard uncertainty",
    "sliding_N": "mean sliding force after it",
    "sliding_u_N": "its standard uncertainty",
}
PHASES = {
    "test_id": "the test",
    "phase": "what the rig did; see [how a record is read](../concepts/records.md)",
    "start_s": "start of the phase on the clock of the record",
    "end_s": "its end, which is the start of the next phase",
    "speed_mm_s": "speed of the drive in it, as recorded",
    "normal_load_N": "normal load in it, as recorded",
    "cycle": "number of the cycle that a stroke belongs to; 0 for everything else",
    "force_N": "mean force above the zero of the test",
    "u_N": "its standard uncertainty",
    "evidence": "what tells of its beginning",
    "doubt": "what is doubtful about it",
}
EVENTS = {
    "test_id": "the test",
    "event": "number of the slip in the test",
    "start_s": "start of its loading: the end of the slip before, or the onset of a pull from rest",
    "fail_s": "its failure: the time of the highest force",
    "end_s": "its end: the time of the lowest force",
    "stiffness_N_per_m": "slope of its loading against the way of the drive, from 20 to 65 % of the loading",
    "points": "number of data points of that slope",
    "drop_N": "force lost from failure to end",
    "slip_um": "way of the slider from failure to end in um",
    "duration_s": "time from failure to end; empty below four data points",
    "peak_velocity_mm_s": "highest velocity of the slider; empty below four data points",
    "precursory_slip_um": "creep before the failure in um: what the force lacks from its loading line, over the "
    "stiffness",
    "recurrence_s": "time since the failure before",
    "hold_s": "time at rest before the failure: since the end of the slip before, or while the drive stood still",
}
FEATURES = {
    "test_id": "the test",
    "sample": "sample",
    "feature": "name of the feature; see [features of a trace](features.md)",
    "value": "its value",
    "u": "its standard uncertainty",
    "low": "lower end of its 95 % interval",
    "high": "upper end",
    "count": "number of slips or data points that it rests on",
    "unit": "unit of value, u, low and high",
}
RECORD_READINGS = {
    "test_id": "the test, or the record whose strokes are tests of their own",
    "sample": "sample",
    "reading": "plateau, step of speed, step of load, cycle, running-in, hold or healing",
    "start_s": "start on the clock of the record",
    "end_s": "end",
    "speed_mm_s": "speed of the drive",
    "normal_load_N": "normal load",
    "way": "up or down: the way of a ladder by which the level was reached",
    "cycle": "number of the cycle; 0 for everything else",
    "hold_s": "time that the drive stood still",
    "state": "of running-in: steady, still drifts, or cannot tell",
    "force_N": "friction force: mean of a plateau, of both directions of a cycle, of the steady level after a step or "
    "running-in, or static force of a restart",
    "force_low_N": "lower end of its 95 % interval",
    "force_high_N": "upper end",
    "coefficient": "the same over the normal load",
    "coefficient_low": "lower end of its 95 % interval",
    "coefficient_high": "upper end",
    "hersey_per_m": "Hersey number: viscosity times speed over normal load",
    "direct_change_N": "change of force at once after a step of speed",
    "direct_change_low_N": "lower end of its 95 % interval",
    "direct_change_high_N": "upper end",
    "total_change_N": "change of force from one plateau to the next",
    "total_change_low_N": "lower end of its 95 % interval",
    "total_change_high_N": "upper end",
    "asymmetry_N": "half the sum of the forces of both directions of a cycle, as recorded less a measured or stated "
    "zero",
    "asymmetry_low_N": "lower end of its 95 % interval",
    "asymmetry_high_N": "upper end",
    "energy_J": "friction work of a cycle",
    "energy_low_J": "lower end of its 95 % interval",
    "energy_high_J": "upper end",
    "run_in_s": "time from the beginning of the slide until a tenth of the whole change is left",
    "run_in_low_s": "lower end of its 95 % interval",
    "run_in_high_s": "upper end",
    "run_in_m": "the same as a distance",
    "run_in_low_m": "lower end of its 95 % interval",
    "run_in_high_m": "upper end",
    "healing_N_per_decade": "growth of the static force over that of sliding, per tenfold time of the hold",
    "healing_low_N_per_decade": "lower end of its 95 % interval",
    "healing_high_N_per_decade": "upper end",
}
FITS = {
    "sample": "sample",
    "regime": "static or sliding",
    "mu": "friction coefficient",
    "mu_u": "its combined standard uncertainty, which the report states",
    "tau0_kPa": "friction per area at zero load; empty without a nominal area",
    "tau0_u_kPa": "its combined standard uncertainty",
    "cov": "covariance of mu and tau0",
    "n_specimens": "number of specimens",
    "n_tests": "number of tests",
    "method": "how the law was fitted",
    "chi2_red": "reduced chi squared",
    "law": "the law",
    "mu_low": "lower end of the 95 % interval of mu",
    "mu_high": "upper end",
    "tau0_low_kPa": "lower end of the 95 % interval of tau0",
    "tau0_high_kPa": "upper end",
    "notes": "what else to know about the fit",
    "T0_N": "friction force at zero load",
    "T0_u_N": "its combined standard uncertainty",
    "largest_mu": "the component that dominates the uncertainty of mu",
    "largest_tau0": "the component that dominates the uncertainty of tau0",
    "mu_type_a_u": "standard uncertainty of mu from the specimens and repeats of the sample alone",
    "tau0_type_a_u_kPa": "the same of tau0",
    "cov_type_a": "covariance of mu and tau0 from them alone, in kPa",
    "dof_type_a": "degrees of freedom of the fit alone",
    "mu_type_a_low": "lower end of the 95 % interval of mu from them alone",
    "mu_type_a_high": "upper end",
    "tau0_type_a_low_kPa": "lower end of the 95 % interval of tau0 from them alone",
    "tau0_type_a_high_kPa": "upper end",
    "T0_type_a_u_N": "standard uncertainty of T0 from them alone",
}
OTHER_FITS = {
    "source": "measured or simulated",
    "sample": "sample",
    "regime": "static or sliding",
    "law": "the law",
    "method": "how it was fitted",
    "parameter": "the parameter; values in SI units",
    "value": "its value",
    "u": "its standard uncertainty",
    "low": "lower end of its 95 % interval",
    "high": "upper end",
    "dof": "degrees of freedom",
    "n_specimens": "number of specimens",
    "n_tests": "number of tests",
    "chi2_red": "reduced chi squared",
}
LAWS_OF_LOAD = {
    "sample": "sample",
    "regime": "static or sliding",
    "law": "the law",
    "formula": "its formula",
    "parameters": "number of its parameters",
    "a": "first parameter, SI units",
    "a_u": "its standard uncertainty",
    "b": "second parameter, SI units",
    "b_u": "its standard uncertainty",
    "held_out_percent": "root mean square error at loads left out of the fit",
    "se_percent": "standard error of its excess over the best law",
    "loads": "number of loads",
    "chosen": "whether it is the law chosen by the data",
}
DEPENDENCE = {
    "sample": "sample",
    "regime": "static or sliding",
    "variable": "the recorded variable",
    "label": "the same in words",
    "n": "number of tests",
    "low": "smallest value of the variable",
    "high": "largest value",
    "change_percent": "change of T/N over this range",
    "change_u_percent": "its standard uncertainty",
    "rank": "rank correlation of T/N with the variable",
    "p": "probability of so large a correlation by chance",
    "p_adjusted": "the same, adjusted for the number of variables",
    "inseparable_from": "variables that change together with it",
}
BUDGET = {
    "component": "source of uncertainty; combined is the sum",
    "type": "A, from scatter, or B, from what is known of the instrument",
    "u_mu": "what it adds to the standard uncertainty of mu",
    "u_tau0_kPa": "of tau0",
    "u_T_N": "of the force at the middle load",
    "share_pct_mu": "share of the variance of mu in percent",
    "share_pct_tau0_kPa": "of tau0",
    "share_pct_T_N": "of the force",
    "dof": "degrees of freedom",
    "origin": "what its size rests on",
    "sample": "sample",
    "regime": "static or sliding",
}
DIFFERENCES = {
    "sample": "one sample",
    "other": "the other sample, measured on the same specimens",
    "regime": "static or sliding",
    "number": "mu, tau0_kPa or T_N",
    "pressure_Pa": "pressure at which T is compared",
    "difference": "the number of the sample less that of the other",
    "u": "its standard uncertainty",
    "unpaired_u": "what it would be with different specimens",
    "dof": "degrees of freedom",
    "low": "lower end of its 95 % interval",
    "high": "upper end",
    "p": "probability of so large a difference by chance",
    "specimens": "the specimens",
}
COMPARISON = {
    "sample": "sample",
    "regime": "static or sliding",
    "normal_load_N": "normal load",
    "measured_N": "measured force",
    "measured_u_N": "its standard uncertainty",
    "simulated_N": "simulated force",
    "simulated_u_N": "its standard uncertainty",
    "ratio": "measured over simulated force",
    "ratio_low": "lower end of its 95 % interval",
    "ratio_high": "upper end",
}
TRACE_LAWS = {
    "test_id": "the test, the record of which it is a level, or sample and load of a law of several records",
    "law": "name of the law, as for `--trace-law`; laws that are tied are all listed",
    "parameter": "parameter of the law or the machine, with its unit at the end of the name",
    "value": "best value, in `unit`",
    "low": "lower end of its 95 % interval",
    "high": "upper end",
    "unit": "SI unit",
    "told": "yes, or cannot be told: the record does not hold this parameter",
}
RESIDUALS = {
    "test_id": "the test",
    "sample": "sample",
    "specimen": "specimen",
    "regime": "static or sliding",
    "normal_load_N": "normal load",
    "run_order": "place in the order of all tests",
    "specimen_run": "place in the order of the tests of the specimen",
    "temperature_C": "temperature",
    "humidity_pct": "relative humidity",
    "speed_m_s": "pull speed",
    "hold_s": "time at rest under load before the pull",
    "measured_N": "measured force",
    "baseline_N": "force of the model fitted to all samples",
    "calibrated_N": "force of the model calibrated on the flat sample alone",
    "extended_N": "force of the model with the mechanisms that were named",
    "residual_percent": "100 (measured / baseline - 1)",
    "residual_calibrated_percent": "100 (measured / calibrated - 1)",
    "residual_extended_percent": "100 (measured / extended - 1)",
    "simulated_N": "force of the extended model where it was run in the simulator itself",
}
LAYERS = {
    "kind": "pattern correction, cause, law, remainder, nuisance, misfit, gain or rms",
    "name": "its name",
    "samples": "where it acts",
    "regimes": "static, sliding or both",
    "effect_percent": "its size as 100 (measured / model - 1)",
    "low": "lower end of its 95 % interval",
    "high": "upper end",
    "p_adjusted": "adjusted probability of so large an effect by chance",
    "at": "where its size is stated",
    "tied_with": "what this campaign cannot tell apart from it",
    "formula": "its formula",
    "log_score_gain": "gain of the log score per test left out of the fit",
    "log_score_gain_se": "its standard error",
    "rmse_percent_before": "root mean square error of tests left out, without it",
    "rmse_percent_after": "the same with it",
}
TWO_REPORTS = {
    "sample": "sample",
    "regime": "static or sliding",
    "quantity": "mu, tau0_kPa or T_N",
    "unit": "its unit",
    "first": "its value in the first report",
    "first_low": "lower end of its 95 % interval",
    "first_high": "upper end",
    "second": "its value in the second report",
    "second_low": "lower end of its 95 % interval",
    "second_high": "upper end",
    "difference": "second less first",
    "difference_low": "lower end of its 95 % interval",
    "difference_high": "upper end",
    "difference_percent": "difference over the first value",
    "distinct": "whether the difference exceeds its interval",
}
LAWS_TRIED = {
    "formula": "formula of the law",
    "regime": "static, sliding or both",
    "where": "on which samples it acts",
    "log_likelihood_gain": "gain of the log likelihood",
    "net_of_choosing": "the same less what the choice among all laws gains by chance",
    "acts_on": "the quantity that follows it",
}
ACROSS_PATTERNS = {
    "terms": "number of terms of the law",
    "formula": "formula of the law",
    "left_out_error": "error at a pattern left out of the fit, rms of ln T",
    "model_error": "the same of the model alone",
    "best_of_chance_error": "the same of the best law of shuffled patterns",
    "p_of_the_best": "probability of so good a law by chance",
    "nested_error": "error with the choice of the law left out as well",
    "laws_tried": "number of laws tried",
}
PRODUCTS = (
    Product(
        "tests.csv", "ingest",
        "one row per test: static and sliding force with their uncertainties, rule, window, zero, flags, and the "
        "reason if it was set aside; columns of your tests.csv that tribo does not know come last, as they are.",
        TESTS, "tribo.report.tables:tests_table", "tests", "test", open_ended=True,
    ),
    Product(
        "restarts.csv", "ingest",
        "one row per restart after a stop of the drive: time of the hold, static force, sliding force (only if there "
        "are any).",
        RESTARTS, "tribo.report.tables:restarts_table",
    ),
    Product(
        "phases.csv", "ingest",
        "one row per phase of a record, in the order of time: rests, rises, slides, strokes, holds and steps.",
        PHASES, "tribo.report.tables:phases_table", "phases", "phase_row",
    ),
    Product(
        "events.csv", "ingest",
        "one row per slip of every record, from rest and in stick-slip; a cell is empty where the record does not "
        "resolve it; see [stick-slip](../howto/stick-slip.md).",
        EVENTS, "tribo.report.tables:events_table", "events", "event_row",
    ),
    Product(
        "features.csv", "ingest",
        "one row per feature of every trace: rise, peak and decay, stick-slip, drift and spectrum, each with its "
        "uncertainty; see [features of a trace](features.md).",
        FEATURES, "tribo.report.tables:features_table", "features", "feature_row",
    ),
    Product(
        "readings.csv", "ingest",
        "one row per reading of a record that is more than one pull from rest: plateaus, steps, cycles, running-in and "
        "holds, with 95 % intervals; see [how a record is read](../concepts/records.md).",
        RECORD_READINGS, "tribo.report.tables:readings_table", "readings", "reading_row",
    ),
    Product(
        "fits.csv", "fit",
        "mu and tau0 of every sample and regime, with covariance and 95 % intervals: `mu_u`, `cov`, `mu_low` and so on "
        "by the combined uncertainty, which is what the report states and `tribo.fit` returns; `mu_type_a_u`, "
        "`cov_type_a`, `mu_type_a_low` and so on of the specimens and repeats of the sample alone, with `dof_type_a`; "
        "`largest_mu`, `largest_tau0` the component that dominates. Without a nominal area the columns of tau0 are "
        "empty; `T0_N` is the force at no load.",
        FITS, "tribo.report.tables:fits_of_study", "fits", "fit",
    ),
    Product(
        "other_fits.csv", "fit", "the same with other weights and laws, and the fits of the model.",
        OTHER_FITS, "tribo.report.tables:other_fits_table", "other_fits", "parameter_row",
    ),
    Product(
        "tracelaws.csv", "fit",
        "friction law and machine read from records with stick-slip, strokes or several speeds; with `--trace-law`.",
        TRACE_LAWS, "tribo.report.tables:trace_laws_table",
    ),
    Product(
        "laws.csv", "fit",
        "five laws of T against N for every sample and regime, compared by loads left out of the fit; the chosen one "
        "is marked.",
        LAWS_OF_LOAD, "tribo.report.tables:laws_table",
    ),
    Product(
        "dependence.csv", "fit",
        "change and rank correlation of T/N with every recorded variable, and the variables that it cannot be told "
        "apart from.",
        DEPENDENCE, "tribo.report.tables:dependence_table",
    ),
    Product(
        "budget.csv", "fit", "the uncertainty budget of every fitted number.",
        BUDGET, "tribo.report.tables:budget_table", "budget", "budget_row",
    ),
    Product(
        "differences.csv", "fit", "differences between samples that were measured on the same specimens.",
        DIFFERENCES, "tribo.report.tables:differences_table",
    ),
    Product(
        "comparison.csv", "compare", "measured and simulated force at each load.",
        COMPARISON, "tribo.report.tables:comparison_table", "comparison", "comparison_row",
    ),
    Product(
        "campaign.nc", "ingest",
        "all of the tables above but restarts, laws, dependence and differences, and the traces: HDF5 with units, "
        "readable by h5py and xarray. `xr.open_dataset(\"campaign.nc\")` gives the table of tests; "
        "`xr.open_datatree(\"campaign.nc\")` also gives the groups `phases`, `events`, `features`, `fits`, "
        "`comparison`, `simulated`, `budget` and `traces`. In `traces`, the samples of all traces follow each other: "
        "those of trace k begin at `row_start[k]` and are `row_size[k]` in number.",
        origin_in=(".nc",),
    ),
    Product(
        "verdict.json", "diagnose",
        "the result of the diagnosis (schema `tribo.verdict/2`); every percentage in it is 100 (measured / model − 1), "
        "with its sign, or the change of that ratio; see [the diagnosis](../concepts/diagnosis.md).",
    ),
    Product(
        "law-*.toml", "diagnose",
        "`law-1.toml` and so on: a law that was found, for `tribo discover --law` on another campaign.",
    ),
    Product(
        "diagnosis.csv", "diagnose",
        "every test and regime beside the models of the diagnosis, with 100 (measured / model − 1) of each.",
        RESIDUALS, "tribo.report.tables:residuals_table", "residuals", "residual_row", optional=("simulated_N",),
    ),
    Product(
        "layers.csv", "diagnose",
        "every pattern correction, cause, law, remainder and misfit with its percentage, interval and adjusted p.",
        LAYERS, "tribo.report.tables:layers_table",
    ),
    Product(
        "figures/*", "compare", "every figure as SVG, PDF and PNG, with its numbers as .csv beside it.",
        origin_in=(".svg",),
    ),
    Product(
        "card.json", "report",
        "the card on top of the report: the answer in one sentence, tests used and set aside, mu and tau0 with "
        "combined uncertainties, what else to know, the next test with its reason and its hours.",
    ),
    Product("report.html", "report", "the report; see [read your report](../howto/read-your-report.md)."),
    Product(
        "pulls-*.html", "report",
        "`pulls-2.html` and so on: further pulls of a campaign with more than 2000. `report.html` shows those with the "
        "highest outlier score and those with a decision by hand.",
    ),
    Product("report.pdf", "report", "the same report on A4."),
    Product("ro-crate-metadata.json", "report", "the study described for machines (RO-Crate)."),
    Product(
        "provenance.json", "ingest",
        "the origin of everything: command, options, versions and hashes. `tribo verify OUT` checks it.",
    ),
    Product(
        "law.svg", "discover", "of `tribo discover`: the law with the largest effect, and the tests it was found in."
    ),
    Product("law.csv", "discover", "the numbers of that figure."),
    Product("laws.csv", "discover", "of `tribo discover`: the best of all laws that were tried.", LAWS_TRIED),
    Product(
        "discovery.json", "discover", "of `tribo discover`: the laws found, or the outcome of the test of one law."
    ),
    Product(
        "across-patterns.csv", "published",
        "of `tribo diagnose --published`: laws across patterns that explain the misfit of a published table.",
        ACROSS_PATTERNS,
    ),
    Product("compare.html", "compare-reports", "of [`tribo compare-reports`](commands.md): two reports side by side."),
    Product(
        "compare.csv", "compare-reports",
        "mu, tau0 and T of every sample and regime that both reports have, at the load in the middle of the loads that "
        "both cover, with 95 % intervals. The interval of a difference combines both intervals in quadrature.",
        TWO_REPORTS,
    ),
)  # fmt: skip
FIGURES = "figures"


def product(name: str, stage: str = "") -> Product:
    """The product that a file is, by its path in the folder of results.

    Parameters
    ----------
    name : path of the file in the folder, with "/" between its parts
    stage : the stage or command that writes it, where two write files of one name

    Raises
    ------
    LookupError
        No product of this name is stated in this module.
    """
    found = [p for p in PRODUCTS if fnmatchcase(name, p.name)]
    found = [p for p in found if p.stage == stage] or found
    if not found:
        raise LookupError(f"{name} is no product of tribo: state it in tribo/outputs.py")
    return found[0]


def is_product(name: str) -> bool:
    """Whether a file of this name, by its path in the folder of results, is one that tribo writes."""
    return any(fnmatchcase(name, p.name) for p in PRODUCTS)


def write(out: Path, name: str, content: Any, stage: str = "") -> Path:
    """Write one product into a folder of results, whole or not at all.

    Parameters
    ----------
    out : the folder of results
    name : path of the file in it
    content : the text, bytes, table or record of JSON, or a function that writes the file at the path it is given
    stage : as for :func:`product`

    Raises
    ------
    LookupError
        No product of this name is stated in this module.
    ValueError
        A table has other columns than are stated.
    """
    stated, path = product(name, stage), out / name
    if callable(content):
        content(path)
        return path
    if isinstance(content, Mapping):
        content = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    elif hasattr(content, "to_csv"):
        _check_columns(stated, list(content.columns))
        content = csv_text(content)
    return write_bytes(path, content.encode("utf-8") if isinstance(content, str) else content)


def _check_columns(stated: Product, columns: list[str]) -> None:
    expected = [name for name in stated.column_names if name in columns or name not in stated.optional]
    given = columns[: len(expected)] if stated.open_ended else columns
    if stated.columns and given != expected:
        raise ValueError(f"{stated.name} has the columns {given}, and tribo/outputs.py states {expected}")


def csv_text(table: pd.DataFrame) -> str:
    """CSV text, the same for the same table on every machine; texts that a spreadsheet would take for formulas escaped.

    See :func:`tribo.user_text.for_spreadsheet`.
    """
    import numpy as np

    table = table.rename(columns=lambda name: for_spreadsheet(str(name)))
    for name in table.select_dtypes(exclude="number"):
        table[name] = [for_spreadsheet(cell) if isinstance(cell, str) else cell for cell in table[name]]
    for name in table.select_dtypes("float"):
        table[name] = table[name].replace(-0.0, 0.0).where(np.isfinite(table[name]) | table[name].isna(), np.nan)
    return str(table.to_csv(index=False, float_format=FLOAT_FORMAT, lineterminator="\n"))
