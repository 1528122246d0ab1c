"""The command line. Each command reads its options, runs the stages and passes their records to the report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo import __version__
from tribo.cli.build_commands import build, schedule
from tribo.cli.console import Console, command_options, set_aside_record, status_of
from tribo.cli.discover_command import discover
from tribo.cli.given_paths import GivenPath
from tribo.cli.init_command import init
from tribo.cli.output import Output, output_options
from tribo.cli.reading_options import corrected, reading_options, with_reading_options
from tribo.cli.run_record import command_line, now, provenance_of_run
from tribo.cli.simulate_command import simulate

if TYPE_CHECKING:
    from tribo.diagnose import Diagnosis
    from tribo.diagnose.verdict import Verdict
    from tribo.records import Study
    from tribo.report.card import Card
    from tribo.stages import Progress, StudyOptions, Until

CAMPAIGN = click.argument("campaign", type=GivenPath())
OUT = output_options()
SCHEDULER = click.option("--scheduler", help="Address of a dask scheduler; its workers run the simulations.")
DRY_RUN = click.option("--dry-run", is_flag=True, help="List the steps without running them.")


FLAT = click.option(
    "--flat", default="", metavar="SAMPLE",
    help="Flat sample on which the model is calibrated. [default: F, or the only flat sample]",
)  # fmt: skip


def _a_zero(context: click.Context, parameter: click.Parameter, given: str) -> str:
    """The text of a zero as given, checked.

    Raises click.BadParameter.
    """
    from tribo.zeroing import zero_choice

    try:
        zero_choice(given)
    except ValueError as why:
        raise click.BadParameter(str(why)) from None
    return given


ZEROS = (
    click.option(
        "--zero", default="", metavar="ZERO", callback=_a_zero,
        help='Zero of the force for tests without their own: "before contact", "at rest", "none", a number of newtons, '
        "or [from, to] in seconds.",
    ),
    click.option(
        "--load-zero", default="", metavar="ZERO", callback=_a_zero,
        help="Zero of the recorded normal load, in the same form.",
    ),
)  # fmt: skip

OVERRIDES = click.option(
    "--overrides",
    type=GivenPath(dir_okay=False),
    help="overrides.csv as saved from the report page: pulls excluded by hand, static peaks and windows moved by hand.",
)


NO_MODEL = click.option(
    "--no-model", is_flag=True,
    help="Report without the spring-block model: friction, its laws and what it varies with.",
)  # fmt: skip


def _fit_options(function: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        reading_options,
        *ZEROS,
        OVERRIDES,
        click.option(
            "--rule", default="seed", show_default=True, help="Rule by which static and sliding force are determined."
        ),
        click.option(
            "--weights",
            type=click.Choice(["relative", "ratio", "force", "repeats"]),
            default="relative",
            show_default=True,
            help="Scatter assumed equal at all loads: of T in percent (relative), of T/N (ratio) or of T (force); or "
            "estimated from repeated tests (repeats).",
        ),
    ):
        function = option(function)
    return function


def _model_options(function: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        FLAT,
        NO_MODEL,
        click.option("--runs", type=click.IntRange(min=2), default=4, show_default=True, help="Simulations per load."),
        SCHEDULER,
    ):
        function = option(function)
    return function


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="tribo")
def main() -> None:
    """Analyse sled friction tests: fit mu and tau0, compare with a spring-block model.

    \b
    Start with:  tribo demo -o out
                 tribo init my-campaign
                 tribo report my-campaign -o out
    """


main.add_command(build)
main.add_command(init)
main.add_command(schedule)
main.add_command(simulate)
main.add_command(discover)


@main.command()
@CAMPAIGN
@OUT
@DRY_RUN
@_fit_options
@command_options
def ingest(console: Console, campaign: Path, out: Output, dry_run: bool, **options: Any) -> int:
    """Read the exports of CAMPAIGN.

    Determines the static peak and the mean sliding force of each pull. Writes tests.csv and campaign.nc.
    """
    return _walk(console, campaign, out, "ingest", dry_run, **options)


@main.command()
@CAMPAIGN
@OUT
@DRY_RUN
@_fit_options
@command_options
def fit(console: Console, campaign: Path, out: Output, dry_run: bool, **options: Any) -> int:
    """Fit mu and tau0 of every sample.

    Writes fits.csv, with the uncertainties of both parameters, in addition to the files of tribo ingest.
    """
    return _walk(console, campaign, out, "fit", dry_run, **options)


@main.command()
@CAMPAIGN
@OUT
@click.option(
    "--only",
    default="",
    help="Run only this part: calibration, the name of a sample, or SAMPLE@PRESSUREPa (named as in OUT/kept). "
    "Default: all parts.",
)
@_fit_options
@_model_options
@command_options
def predict(console: Console, campaign: Path, out: Output, only: str, columns: str, **options: Any) -> int:
    """Run the simulations of CAMPAIGN only.

    Calibrates the model on the flat sample, runs it for every sample and stores the results in OUT/kept, where
    tribo compare and tribo report find them.
    """
    from tribo import stages
    from tribo.campaign import open_campaign

    stated = options.pop("stated")
    chosen = stages.StudyOptions(kept=out.kept, **options)
    with (
        out.taken(campaign, shared=True),
        open_campaign(campaign) as described,
        console.progress() as progress,
    ):
        stated_so = with_reading_options(described, columns, stated)
        ingested = stages.study(stated_so, chosen, until="ingest", progress=progress).ingested
        cells = stages.simulate_cells(ingested, stages.fit(ingested, weights=chosen.weights), chosen, only, progress)
    names = [cell.name for cell in cells]
    console.result(
        {"out": str(out.path), "cells": names}, f"model calibrated; simulations run: {', '.join(names) or 'none'}"
    )
    return status_of(ingested.set_aside)


@main.command()
@CAMPAIGN
@OUT
@DRY_RUN
@_fit_options
@_model_options
@command_options
def compare(console: Console, campaign: Path, out: Output, dry_run: bool, **options: Any) -> int:
    """Compare the measurements with the model.

    The model is calibrated on the flat sample alone. Writes comparison.csv and the figures in addition to the files
    of tribo fit.
    """
    return _walk(console, campaign, out, "compare", dry_run, **options)


@main.command()
@click.argument("campaign", required=False, type=GivenPath())
@OUT
@click.option("--published", type=click.Choice(["berardo2019"]), help="Diagnose a published table instead of CAMPAIGN.")
@click.option(
    "--rule", default="seed", show_default=True, help="Rule by which static and sliding force are determined."
)
@FLAT
@reading_options
@ZEROS[0]
@ZEROS[1]
@OVERRIDES
@command_options
def diagnose(
    console: Console,
    campaign: Path | None,
    out: Output,
    published: str | None,
    columns: str,
    stated: dict[str, float],
    **options: Any,
) -> int:
    """Find where the model fails, and the likely cause.

    Writes verdict.json and the figures of the diagnosis. Where the data do not allow a conclusion, the verdict says
    so.
    """
    if (campaign is None) == (published is None):
        raise click.UsageError("give either a CAMPAIGN or --published with the name of a table")
    if campaign is None:
        return _diagnose_published(console, out, options["seed"])
    from tribo import stages
    from tribo.campaign import open_campaign
    from tribo.report import write_until
    from tribo.report.card import card_of
    from tribo.report.drawings import Drawing
    from tribo.report.words.card_text import card_text
    from tribo.report.words.verdict_text import verdict_text
    from tribo.store.kept_results import Shelf

    with out.taken(campaign), open_campaign(campaign) as opened, console.progress() as progress:
        chosen = stages.StudyOptions(kept=out.kept, **options)
        study = stages.study(with_reading_options(opened, columns, stated), chosen, until="ingest", progress=progress)
        found = _diagnosis(study, chosen, progress)
        drawing = Drawing(progress, chosen.jobs, Shelf(chosen.kept).take)
        verdict = found.verdict
        card = card_of(stages.with_laws(study), verdict.as_dict())
        write_until(study, out.path, "ingest", drawing, provenance_of_run(study, campaign, chosen), found, card)
    console.result(verdict.as_dict() | {"card": card.as_dict()}, f"{card_text(card)}\n\n{verdict_text(verdict)}")
    console.list_tests("set aside", study.ingested.set_aside, level=-1)
    return status_of(study.ingested.set_aside)


def _diagnose_published(console: Console, out: Output, seed: int) -> int:
    """The verdict on Table 2 of Berardo et al. (2019), for every interpretation of what it leaves open."""
    from tribo.diagnose.from_table.published_diagnosis import diagnose_published
    from tribo.published import BERARDO2019, data_dir, load_table2, load_table2_simulated_anew
    from tribo.report.provenance import provenance_of_table
    from tribo.report.table_report import write_published
    from tribo.report.words.verdict_text import verdict_text

    folder, tables = data_dir() / BERARDO2019, ("table2.csv", "table2_tribo.csv")
    with out.taken(folder), console.progress() as progress:
        found = diagnose_published(load_table2(), load_table2_simulated_anew(), seed=seed, progress=progress)
        write_published(found, out.path, provenance_of_table(folder, tables, command_line(), seed, now()))
    console.result(found.verdict.as_dict(), verdict_text(found.verdict))
    return 0


@main.command()
@CAMPAIGN
@OUT
@DRY_RUN
@_fit_options
@_model_options
@command_options
def report(console: Console, campaign: Path, out: Output, dry_run: bool, **options: Any) -> int:
    """Run every stage and write the report.

    Runs ingest, fit, compare and diagnose on CAMPAIGN. Writes their files, report.html, report.pdf and
    ro-crate-metadata.json.
    """
    return _walk(console, campaign, out, "report", dry_run, **options)


@main.command()
@click.argument("out", type=GivenPath(file_okay=False))
@click.option(
    "--campaign", type=GivenPath(), help="The campaign, if it has been moved since."
)
@command_options
def verify(console: Console, out: Path, campaign: Path | None, **_: Any) -> int:
    """Check the inputs and outputs of a report.

    Lists the files that have changed, are missing or have been added since the files in OUT were written. Exit status
    1: there is at least one such file.
    """
    from tribo.report import verify as compared

    found = compared(out, campaign)
    console.result(found.as_record(), found.in_words())
    return 0 if found.unchanged else 1


@main.command()
@CAMPAIGN
@command_options
def plan(console: Console, campaign: Path, **_: Any) -> None:
    """Assess a test plan before measuring.

    States which effects the tests listed in CAMPAIGN could detect and which they could not distinguish. The exports
    need not exist yet.
    """
    from dataclasses import asdict

    from tribo.campaign import open_campaign
    from tribo.diagnose import plan_design
    from tribo.report.words.verdict_text import plan_text

    with open_campaign(campaign, measured=False) as opened:
        planned = plan_design(opened)
    record = {"tests": planned.n_tests, "findings": [asdict(f) for f in planned.findings], "tied": planned.tied}
    console.result(record, plan_text(planned))


@main.command()
@output_options("out/demo")
@_fit_options
@_model_options
@command_options
def demo(console: Console, out: Output, **options: Any) -> int:
    """Write the report on the bundled example."""
    from tribo.published import data_dir

    status = _walk(console, data_dir() / "example", out, "report", False, **options)
    console.say(f"open {out.path / 'report.html'}")
    return status


@main.command()
@click.argument("files", nargs=-1, required=True, type=GivenPath(dir_okay=False))
@reading_options
@command_options
def inspect(console: Console, files: tuple[Path, ...], columns: str, stated: dict[str, float], **_: Any) -> int:
    """Show how an export file is read.

    Lists its format, encoding, columns, units, time base and pulls, and anything doubtful.
    """
    from tribo.ingestion.exports import inspect_file
    from tribo.readers import columns_from_text
    from tribo.records import UNCORRECTED

    given = columns_from_text(columns) if columns else None
    found = [inspect_file(file, given, corrected(UNCORRECTED, stated)) for file in files]
    console.result({"files": [f.record() for f in found]}, "\n\n".join(f.in_words() for f in found))
    return 1 if all(f.refused for f in found) else 0


@main.command()
@click.option(
    "--campaign",
    type=GivenPath(),
    help="Campaign whose exports are read.  [default: the bundled example]",
)
@click.option("--large", is_flag=True, help="Also time a lattice of 1000 x 1000 blocks; takes several minutes.")
@command_options
def bench(console: Console, campaign: Path | None, large: bool, jobs: int, **_: Any) -> None:
    """Measure the speed of tribo on this machine.

    Times are compared with those of reference programs, measured alternately in the same run.
    """
    from tribo.cli.reading_speed import against_pandas, in_words, timing_in_words
    from tribo.published import data_dir
    from tribo.simulate.engine_speed import simulator_benchmarks

    with console.progress() as progress:
        ratios = against_pandas(campaign or data_dir() / "example", jobs)
        timings = simulator_benchmarks(lambda done, total: progress("timing the simulator", done, total), large=large)
    record = {"reading": [vars(r) for r in ratios], "simulator": [t.record() for t in timings]}
    console.result(record, "\n".join([*map(in_words, ratios), *map(timing_in_words, timings)]))


@main.command()
@command_options
def doctor(console: Console, **_: Any) -> int:
    """Check this installation.

    Lists versions, processor cores and the optional packages found or missing.
    """
    from tribo.cli.doctor import examine, in_words

    found = examine()
    console.result(found, in_words(found))
    return 0 if found["healthy"] else 1


def _walk(console: Console, path: Path, out: Output, until: Until, dry_run: bool, columns: str, **options: Any) -> int:
    """Run the stages up to ``until`` on one campaign and write their results."""
    from tribo import stages
    from tribo.campaign import open_campaign
    from tribo.report import write_until
    from tribo.report.drawings import Drawing
    from tribo.store.kept_results import Shelf

    stated = options.pop("stated")
    chosen = stages.StudyOptions(kept=out.kept, **options)
    if dry_run:
        out.check(path)
        with open_campaign(path) as described:
            planned = stages.plan(with_reading_options(described, columns, stated), chosen, until)
            console.result(planned, _plan_text(planned, out.path))
            return status_of(described.set_aside)
    with out.taken(path), open_campaign(path) as described, console.progress() as progress:
        study = stages.study(with_reading_options(described, columns, stated), chosen, until=until, progress=progress)
        compared = until == "report" and study.comparison is not None
        study, found = _diagnosed(study, chosen, progress) if compared else (study, None)
        drawing = Drawing(progress, chosen.jobs, Shelf(chosen.kept).take)
        card = _card(study, found) if until == "report" else None
        write_until(study, out.path, until, drawing, provenance_of_run(study, path, chosen), found, card)
    return _conclude(console, study, out.path, found.verdict if found else None, card)


def _card(study: Study, found: Diagnosis | None) -> Card:
    from tribo.report.card import card_of

    return card_of(study, found.verdict.as_dict() if found is not None else None)




def _diagnosed(study: Study, chosen: StudyOptions, progress: Progress) -> tuple[Study, Diagnosis | None]:
    """The diagnosis of a study; a note instead where there is too little to diagnose."""
    from dataclasses import replace

    from tribo.errors import FitError, TriboError, unexpected

    try:
        return study, _diagnosis(study, chosen, progress)
    except FitError as why:
        return replace(study, notes=(*study.notes, f"no diagnosis: {why}")), None
    except (TriboError, OSError):
        raise
    except Exception as why:  # the other results stand without it
        problem = unexpected(why, "the diagnosis stopped")
        return replace(study, notes=(*study.notes, f"no diagnosis: {problem}")), None


def _diagnosis(study: Study, chosen: StudyOptions, progress: Progress) -> Diagnosis:
    from tribo.stages import diagnosis

    return diagnosis(study.ingested, seed=chosen.seed, jobs=chosen.jobs, kept=chosen.kept, progress=progress)


def _conclude(
    console: Console, study: Study, out: Path, verdict: Verdict | None = None, card: Card | None = None
) -> int:
    """Print the results and the tests set aside; return the exit status."""
    from dataclasses import asdict

    from tribo.report import summary_text, table2_text
    from tribo.report.result_tables import fits_table
    from tribo.report.words.card_text import card_text
    from tribo.report.words.verdict_text import verdict_text

    set_aside = study.ingested.set_aside
    doubts = study.ingested.doubts()
    fits = fits_table(study.fits, study.combined).astype(object)
    record = {
        "out": str(out),
        "tests": len(study.ingested.pulls),
        "set_aside": set_aside_record(set_aside),
        "used_with_doubts": set_aside_record(doubts),
        "problems": [asdict(p) for p in study.ingested.campaign.problems],
        "notes": list(study.notes),
        "fits": fits.where(fits.notna(), None).to_dict("records"),
        "power": list(study.power),
        "outlying": list(study.outlying),
        "differences": [] if study.differences is None else study.differences.to_dict("records"),
        "verdict": verdict.verdict if verdict else None,
        "card": card.as_dict() if card else None,
    }
    words = [card_text(card)] if card else []
    words += [table2_text(study)] if study.fits else []
    looks = ["\n".join(lines) for lines in (study.power, study.outlying) if lines]
    said = [verdict_text(verdict)] if verdict else []
    console.result(record, "\n\n".join([*words, summary_text(study), *said, *looks]))
    for note in study.notes:
        console.say(f"note: {note}", level=-1)
    console.list_tests("set aside", set_aside, level=-1)
    console.list_tests("used with doubts", doubts)
    return status_of(set_aside)


def _plan_text(planned: dict[str, Any], out: Path) -> str:
    lines = [f"would {step}" for step in planned["steps"]]
    return "\n".join([*lines, f"would write into {out}", *(f"set aside: {s}" for s in planned["set_aside"])])
