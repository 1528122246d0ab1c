"""Commands on one campaign, and on two reports: each runs the stages and writes their results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.cli.console import (
    UNUSABLE,
    Console,
    GivenPath,
    command_line,
    command_options,
    dry_run_text,
    now,
    output_options,
    provenance_of_run,
    set_aside_record,
    status_of,
)
from tribo.cli.study_options import (
    CAMPAIGN,
    DRY_RUN,
    FLAT,
    LAWS,
    NO_MODEL,
    OUT,
    OVERRIDES,
    RULE,
    RUNS,
    SCHEDULER,
    ZEROS,
    fit_options,
    model_options,
    reading_options,
    with_reading_options,
)
from tribo.errors import FitError, SimulationError, TriboError, unexpected
from tribo.forked import beside
from tribo.own_folder import KEPT, check_folder

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis
    from tribo.diagnostics.diagnosis import DiagnosisWithoutModel
    from tribo.diagnostics.verdict import Verdict
    from tribo.dry_run import Until as DryUntil
    from tribo.records import Campaign, Study
    from tribo.stages import Progress, StudyOptions, Until
    from tribo.wording.card import Card

_TRACE_LAWS = (
    "auto", "coulomb", "ageing", "dieterich", "ruina", "driven", "driven_backlash", "driven_directions",
    "driven_springy_backlash", "constant", "viscous", "logarithmic", "stribeck",
)  # fmt: skip


@click.command()
@CAMPAIGN
@OUT
@DRY_RUN
@fit_options
@command_options
def ingest(console: Console, campaign: Path, out: Path, dry_run: bool, **options: Any) -> int:
    """Read the exports of CAMPAIGN.

    Determines the static peak and the mean sliding force of each pull. Writes tests.csv and campaign.nc.
    """
    return _run_stages(console, campaign, out, "ingest", dry_run, **options)


@click.command()
@CAMPAIGN
@OUT
@DRY_RUN
@click.option(
    "--trace-law", type=click.Choice(_TRACE_LAWS), metavar="LAW",
    help="Read a law and the machine from whole records with stick-slip (coulomb, ageing), steps of speed "
    "(dieterich, ruina), strokes to and fro (driven, driven_backlash, driven_directions, driven_springy_backlash), "
    "or several speeds (constant, viscous, logarithmic, stribeck), with intervals; auto: the law that fits. Writes "
    "tracelaws.csv.",
)
@fit_options
@command_options
def fit(console: Console, campaign: Path, out: Path, dry_run: bool, **options: Any) -> int:
    """Fit mu and tau0 of every sample.

    The law is T = mu N + tau0 A: friction force T, normal load N, nominal contact area A. Writes
    fits.csv, with the uncertainties of both parameters, in addition to the files of tribo ingest.
    """
    return _run_stages(console, campaign, out, "fit", dry_run, **options)


@click.command()
@CAMPAIGN
@OUT
@click.option(
    "--only",
    default="",
    help="Run only this part: calibration, the name of a sample, or SAMPLE@PRESSUREPa (named as in OUT/kept). "
    "Default: all parts.",
)
@fit_options
@FLAT
@click.option("--no-model", is_flag=True, hidden=True)  # still taken; it changes nothing here
@RUNS
@SCHEDULER
@command_options
def predict(console: Console, campaign: Path, out: Path, only: str, columns: str, **options: Any) -> int:
    """Run the simulations of CAMPAIGN only.

    Calibrates the model on the flat sample, runs it for every sample and stores the results in OUT/kept, where
    tribo compare and tribo report find them.
    """
    from tribo import stages
    from tribo.campaign import open_campaign

    stated = options.pop("stated")
    chosen = stages.StudyOptions(kept=out / KEPT, **options)
    with (
        console.taken(out, campaign, shared=True),
        open_campaign(campaign) as described,
        console.progress() as progress,
    ):
        stated_so = with_reading_options(described, columns, stated)
        ingested = stages.study(stated_so, chosen, until="ingest", progress=progress).ingested
        with stages.naming_set_aside(ingested):
            fits = stages.fit(ingested, weights=chosen.weights)
            cells = stages.simulate_cells(ingested, fits, chosen, only, progress)
    names = [cell.name for cell in cells]
    set_aside = ingested.set_aside
    record = {"out": str(out), "cells": names, "set_aside": set_aside_record(set_aside)}
    console.result(record, f"model calibrated; simulations run: {', '.join(names) or 'none'}")
    return console.status_after(set_aside)


@click.command()
@CAMPAIGN
@OUT
@DRY_RUN
@fit_options
@model_options
@command_options
def compare(console: Console, campaign: Path, out: Path, dry_run: bool, **options: Any) -> int:
    """Compare the measurements with the model.

    The model is calibrated on the flat sample alone. Writes comparison.csv and the figures in addition to the files
    of tribo fit.
    """
    return _run_stages(console, campaign, out, "compare", dry_run, **options)


@click.command()
@click.argument("campaign", required=False, type=GivenPath())
@OUT
@click.option("--published", type=click.Choice(["berardo2019"]), help="Diagnose a published table instead of CAMPAIGN.")
@RULE
@FLAT
@LAWS
@NO_MODEL
@reading_options
@ZEROS[0]
@ZEROS[1]
@OVERRIDES
@DRY_RUN
@command_options
def diagnose(
    console: Console,
    campaign: Path | None,
    out: Path,
    published: str | None,
    dry_run: bool,
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
    from tribo.report.write import Drawing
    from tribo.wording.card import card_of, card_text, verdict_text

    chosen = stages.StudyOptions(kept=out / KEPT, **options)
    if dry_run:
        return _checked(console, campaign, out, "diagnose", chosen, lambda c: with_reading_options(c, columns, stated))
    with console.taken(out, campaign), open_campaign(campaign) as opened, console.progress() as progress:
        stated_so = with_reading_options(opened, columns, stated)
        until: Until = "compare" if stages.without_model(stated_so, chosen) else "ingest"
        study = stages.study(stated_so, chosen, until=until, progress=progress)
        with stages.naming_set_aside(study.ingested):
            found = _diagnosis(study, chosen, progress)
        drawing = Drawing(progress, chosen.jobs, chosen.kept)
        verdict = found.verdict
        card = card_of(stages.with_fits(study), verdict)
        write_until(study, out, "ingest", drawing, provenance_of_run(study, campaign, chosen), found, card)
    console.result(verdict.as_dict() | {"card": asdict(card)}, f"{card_text(card)}\n\n{verdict_text(verdict)}")
    console.list_doubts(study.doubts)
    return console.status_after(study.ingested.set_aside)


def _diagnose_published(console: Console, out: Path, seed: int) -> int:
    """The verdict on Table 2 of Berardo et al. (2019), for every interpretation of what it leaves open."""
    from dataclasses import replace

    from tribo.berardo2019.published_tables import BERARDO2019, load_table2, load_table2_simulated_anew
    from tribo.berardo2019.table_diagnosis import across_published, diagnose_published
    from tribo.files import data_dir
    from tribo.report.provenance import provenance_of_table
    from tribo.report.without_study import write_published
    from tribo.wording.card import verdict_text
    from tribo.wording.law_sentences import across_record, across_sentence
    from tribo.wording.verdict_sentences import worded

    folder, tables = data_dir() / BERARDO2019, ("table2.csv", "table2_tribo.csv")
    with console.taken(out, folder), console.progress() as progress:
        found = diagnose_published(load_table2(), load_table2_simulated_anew(), seed=seed, progress=progress)
        found = replace(found, verdict=worded(found.verdict))
        across = across_published(found, seed=seed)
        write_published(found, across, out, provenance_of_table(folder, tables, command_line(), seed, now()))
    record = {**found.verdict.as_dict(), "across_patterns": across_record(across)}
    next_test = found.verdict.next_test.text if found.verdict.next_test is not None else ""
    lines = [found.verdict.sentence, verdict_text(found.verdict), f"  next test: {next_test}", across_sentence(across)]
    console.result(record, "\n".join(lines))
    return 0


@click.command()
@CAMPAIGN
@OUT
@DRY_RUN
@fit_options
@model_options
@LAWS
@command_options
def report(console: Console, campaign: Path, out: Path, dry_run: bool, **options: Any) -> int:
    """Run every stage and write the report.

    Runs ingest, fit, compare and diagnose on CAMPAIGN. Writes their files, report.html, report.pdf and
    ro-crate-metadata.json.
    """
    return _run_stages(console, campaign, out, "report", dry_run, **options)


@click.command(context_settings={"default_map": {"runs": 3}})  # both reports in two minutes on two cores
@output_options("out/demo")
@fit_options
@model_options
@command_options
def demo(console: Console, out: Path, **options: Any) -> int:
    """Write the reports on the two bundled examples.

    The samples of the first obey the laws that Berardo et al. measured: the known physics does not explain all of it
    (OUT/report.html). In the exports of the second a cause is hidden, and found (OUT/cause-found/report.html).
    OUT/index.html leads to both.
    """
    from tribo.files import data_dir
    from tribo.report.without_study import SECOND, write_demo_page
    from tribo.wording.card import card_text

    def reported(
        name: str, folder: Path, console: Console, meanwhile: AbstractContextManager[None] | None = None
    ) -> tuple[int, Card]:
        cards: list[Card] = []

        def conclude(console: Console, study: Study, folder: Path, verdict: Verdict | None, card: Card | None) -> int:
            assert card is not None
            cards.append(card)
            return console.status_after(study.ingested.set_aside)

        status = _run_stages(
            console, data_dir() / name, folder, "report", False, conclude=conclude, meanwhile=meanwhile, **options
        )
        return status, cards[0]

    seconds: list[tuple[int, Card]] = []

    @contextmanager
    def second_beside() -> Iterator[None]:
        quiet = replace(console, verbosity=min(console.verbosity, -1))
        with beside(lambda: reported("second_example", out / SECOND, quiet)) as result:
            console.say(f"the report on the second example, {out / SECOND}, is written at the same time")
            yield
            seconds.append(result())

    both = {out: reported("example", out, console, second_beside())}
    both[out / SECOND] = seconds[0]
    page = write_demo_page(out)
    reports = {folder / "report.html": card for folder, (_, card) in both.items()}
    record = {"out": str(out), "page": str(page), "cards": {str(r): asdict(card) for r, card in reports.items()}}
    console.result(record, "\n\n".join(f"{path}\n{card_text(card)}" for path, card in reports.items()))
    console.say(f"open {page}")
    return max(status for status, _ in both.values())


def _run_stages(
    console: Console, path: Path, out: Path, until: Until, dry_run: bool, columns: str,
    conclude: Callable[[Console, Study, Path, Verdict | None, Card | None], int] | None = None,
    meanwhile: AbstractContextManager[None] | None = None, **options: Any,
) -> int:  # fmt: skip
    """Run the stages up to ``until`` on one campaign, write their results and tell of them: by ``conclude``, or all.

    ``meanwhile`` begins when the folder is held, and ends when all is written.
    """
    from tribo import stages
    from tribo.campaign import open_campaign
    from tribo.report import write_until
    from tribo.report.write import Drawing

    stated = options.pop("stated")
    chosen = stages.StudyOptions(kept=out / KEPT, **options)
    if dry_run:
        return _checked(console, path, out, until, chosen, lambda c: with_reading_options(c, columns, stated))
    with (
        console.taken(out, path), meanwhile or nullcontext(), open_campaign(path) as described,
        console.progress() as progress,
    ):  # fmt: skip
        study = stages.study(with_reading_options(described, columns, stated), chosen, until=until, progress=progress)
        study, found = _diagnosed(study, chosen, progress) if until == "report" else (study, None)
        drawing = Drawing(progress, chosen.jobs, chosen.kept)
        verdict, card = found.verdict if found else None, None
        if until == "report":
            from tribo.wording.card import card_of

            card = card_of(study, verdict)
        write_until(study, out, until, drawing, provenance_of_run(study, path, chosen), found, card)
    return (conclude or _conclude)(console, study, out, verdict, card)


def _diagnosed(
    study: Study, chosen: StudyOptions, progress: Progress
) -> tuple[Study, Diagnosis | DiagnosisWithoutModel | None]:
    """The diagnosis of a study; a note instead where there is too little to diagnose."""
    try:
        return study, _diagnosis(study, chosen, progress)
    except FitError as why:
        return replace(study, notes=(*study.notes, f"no diagnosis: {why}"), undiagnosed=str(why)), None
    except SimulationError:
        if study.comparison is not None:
            raise
        from tribo.stages import diagnosis_without_model  # the model cannot be run, as the study says

        return study, diagnosis_without_model(study, seed=chosen.seed, kept=chosen.kept)
    except (TriboError, OSError):
        raise
    except Exception as why:  # the other results stand without it
        problem = unexpected(why, "the diagnosis stopped")
        return replace(study, notes=(*study.notes, f"no diagnosis: {problem}"), undiagnosed=str(problem)), None


def _diagnosis(study: Study, chosen: StudyOptions, progress: Progress) -> Diagnosis | DiagnosisWithoutModel:
    """With the spring-block model, or, where a study was made without it, without."""
    from tribo.stages import diagnose as diagnosis_with_model, diagnosis_without_model, without_model

    if without_model(study.ingested.campaign, chosen):
        return diagnosis_without_model(study, seed=chosen.seed, kept=chosen.kept)
    return diagnosis_with_model(
        study.ingested, seed=chosen.seed, jobs=chosen.jobs, kept=chosen.kept, laws=chosen.laws, progress=progress
    )


def _conclude(
    console: Console, study: Study, out: Path, verdict: Verdict | None = None, card: Card | None = None
) -> int:
    """Print the results and the tests set aside; return the exit status."""
    from tribo.wording.card import card_text, summary_text, table2_text, verdict_text

    set_aside = study.ingested.set_aside
    doubts = study.ingested.doubts()
    fits = study.fits.table().astype(object)
    record = {
        "out": str(out),
        "tests": len(study.ingested.pulls),
        "set_aside": set_aside_record(set_aside),
        "used_with_doubts": set_aside_record(doubts),
        "problems": [asdict(p) for p in study.ingested.campaign.problems],
        "notes": list(study.notes),
        "doubts": [asdict(doubt) for doubt in study.doubts],
        "fits": fits.where(fits.notna(), None).to_dict("records"),
        "power": list(study.power),
        "outlying": list(study.outlying),
        "differences": [] if study.differences is None else study.differences.to_dict("records"),
        "verdict": verdict.verdict if verdict else None,
        "card": asdict(card) if card else None,
    }
    words = [
        card_text(card) if card else "", table2_text(study) if study.fits else "", summary_text(study),
        verdict_text(verdict) if verdict else "", "\n".join(study.power), "\n".join(study.outlying),
    ]  # fmt: skip
    console.result(record, "\n\n".join(filter(None, words)))
    console.list_doubts(study.doubts)
    for note in study.notes:
        console.say(f"note: {note}", level=-1)
    console.list_tests("used with doubts", doubts)
    return console.status_after(set_aside)


def _checked(
    console: Console, path: Path, out: Path, until: DryUntil, chosen: StudyOptions,
    prepared: Callable[[Campaign], Campaign],
) -> int:  # fmt: skip
    """Print everything that a study of a campaign would meet, and the status it would end with."""
    from tribo.dry_run import check

    with console.progress() as progress:
        found = check(path, chosen, until, prepared, progress)
    try:
        check_folder(out, (path,), console.force)
    except TriboError as why:
        found = replace(found, faults=(*why.problems, *found.faults))
    console.result(found.as_record(), dry_run_text(found, out, all_of_them=console.verbosity > 0))
    console.list_problems(found.faults)
    return UNUSABLE if found.faults else status_of(found.set_aside)


@click.command()
@click.argument("campaign", type=GivenPath())
@output_options()
@click.option(
    "--with", "law_file", type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="LAW.TOML",
    help="Test this law, found in another campaign, instead of searching.",
)
@RULE
@FLAT
@command_options
def discover(
    console: Console, campaign: Path, out: Path, law_file: Path | None, **options: Any
) -> int:
    """Search for the law of what no mechanism explains.

    All laws of a small grammar are tried: a recorded column, the shape of its effect, what it acts on, in which regime
    and on which samples, and products of two columns. A law is written only if it is beyond what the best of all laws
    reaches by chance. Writes law-1.toml and further laws, laws.csv and discovery.json.
    """
    from tribo import stages
    from tribo.campaign import open_campaign
    from tribo.lawsearch.diagnosis_with_laws import discover_on_campaign, validate_on_campaign
    from tribo.lawsearch.known_laws import read_law
    from tribo.report.without_study import write_discovery, write_validation

    law = read_law(law_file) if law_file is not None else None
    with console.taken(out, campaign), open_campaign(campaign) as opened, console.progress() as progress:
        chosen = stages.StudyOptions(kept=out / KEPT, **options)
        study = stages.study(opened, chosen, until="ingest", progress=progress)
        record = provenance_of_run(study, campaign, chosen)
        with stages.naming_set_aside(study.ingested):
            if law is not None:
                held = validate_on_campaign(study.ingested, law, seed=chosen.seed)
                said, text = write_validation(held, out, record)
            else:
                found = discover_on_campaign(study.ingested, seed=chosen.seed, progress=progress)
                said, text = write_discovery(found, study.ingested.campaign.title, out, record)
    console.result(said, text)
    return console.status_after(study.ingested.set_aside)


@click.command("compare-reports")
@click.argument("first", type=GivenPath(file_okay=False))
@click.argument("second", type=GivenPath(file_okay=False))
@output_options()
@command_options
def compare_reports(console: Console, first: Path, second: Path, out: Path, **_: Any) -> int:
    """Compare two reports.

    FIRST and SECOND are output folders of tribo report. Writes compare.html, with the findings and figures of both
    side by side, and compare.csv, with the difference of mu, tau0 and T of every sample that both have and its 95 %
    interval.
    """
    from tribo.report.compare_reports import write_comparison
    from tribo.report.provenance import provenance_of_comparison

    with console.taken(out, first, second) as folder:
        record = provenance_of_comparison((first, second), command_line(), now())
        table, said = write_comparison((first, second), folder, record)
    words = [*said, f"Written: {out / 'compare.html'}"]
    console.result({"sentences": said, "differences": table.to_dict("records")}, "\n".join(words))
    return 0
