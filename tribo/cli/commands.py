"""The command line. Each command reads its options, runs the stages and passes their records to the report."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from tribo import __version__
from tribo.cli.build_commands import build, schedule
from tribo.cli.console import Console, ExportPath, GivenPath, command_options, open_streams
from tribo.cli.model_commands import design, map_family, simulate
from tribo.cli.setup_commands import init
from tribo.cli.study_commands import compare, compare_reports, demo, diagnose, discover, fit, ingest, predict, report
from tribo.cli.study_options import CAMPAIGN, corrected, reading_options
from tribo.errors import CampaignError
from tribo.user_text import did_you_mean


class Commands(click.Group):
    """A group that asks what was meant where a command is not known, and runs without streams or /proc as well."""

    def main(self, *given: Any, **named: Any) -> Any:
        open_streams()
        if sys.platform == "linux" and not Path("/proc/self").exists():
            sys.modules.setdefault("dask", None)  # type: ignore[arg-type]  # pint imports it, and it asks /proc
        return super().main(*given, **named)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        given = args[0]
        hint = did_you_mean(given, self.list_commands(ctx))
        if hint and self.get_command(ctx, given) is None and not given.startswith("-"):
            ctx.fail(f"No such command {given!r}; {hint}")
        return super().resolve_command(ctx, args)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="tribo")
def main() -> None:
    """Evaluate friction tests: read the records of any tribometer or tensile machine, fit friction laws, compare with a
    spring-block model, and find what explains the difference.

    \b
    Start with:  tribo demo -o out
                 tribo init my-campaign
                 tribo report my-campaign -o out
    """


for command in (
    build, init, schedule, simulate, design, discover, compare_reports, ingest, fit, predict, compare, diagnose, report,
    demo, map_family,
):  # fmt: skip
    main.add_command(command)


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
@click.argument("out", type=GivenPath(file_okay=False))
@click.option("--width", "width_mm", default=190.0, show_default=True, help="Page width in mm; 90 is one column.")
@click.option(
    "--names", multiple=True, metavar="SAMPLE=NAME", help='Other names of samples, for example "Sx=across,Sy=along".'
)
@click.option(
    "-o", "--out", "to", required=True, type=click.Path(file_okay=False, path_type=Path), help="Folder for the figures."
)
@click.option("--force", is_flag=True, help="Replace figures of the same name.")
@command_options
def figures(
    console: Console, out: Path, width_mm: float, names: tuple[str, ...], to: Path, **_: Any
) -> None:
    """Draw the figures of a report again.

    Draws every figure of OUT from the numbers beside it, as SVG and PDF whose text can be edited. Letters keep their
    size at any width.
    """
    from tribo.report.drawings import write_redrawn

    pairs = [name.partition("=") for given in names for name in given.split(",")]
    if wrong := next((old for old, sign, new in pairs if not (old and sign and new)), None):
        raise click.BadParameter(f"{wrong!r} is not of the form SAMPLE=NAME", param_hint="--names")
    renamed = {old.strip(): new.strip() for old, _, new in pairs}
    written, failed = write_redrawn(out, to, width_mm, renamed, console.force)
    listed = "\n".join(path.name for path in written)
    console.result({"to": str(to), "files": [path.name for path in written]}, f"{listed}\n{len(written)} files in {to}")
    if failed:
        raise CampaignError(failed)


@main.command()
@CAMPAIGN
@click.option(
    "--with", "law_file", type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="LAW.TOML",
    help="State whether the design would show this law of an earlier campaign.",
)
@command_options
def plan(console: Console, campaign: Path, law_file: Path | None, **_: Any) -> None:
    """Assess a test plan before measuring.

    States which effects the tests listed in CAMPAIGN could detect and which they could not distinguish. The exports
    need not exist yet.
    """
    from dataclasses import asdict

    from tribo.campaign import open_campaign
    from tribo.diagnostics import plan_design
    from tribo.lawsearch.known_laws import plan_law, read_law
    from tribo.wording.card import plan_text, why_not_found
    from tribo.wording.law_sentences import planned_law_sentence

    law = read_law(law_file) if law_file is not None else None
    with open_campaign(campaign, measured=False) as opened:
        planned = plan_design(opened)
        shown = plan_law(opened, law.law, law.parameters) if law is not None else None
    findings = [asdict(f) | {"why": why_not_found(f)} for f in planned.findings]
    record = {"tests": planned.n_tests, "findings": findings, "tied": planned.tied}
    if shown is not None:
        text = planned_law_sentence(shown)
        own = {"formula": shown.formula, "strength": shown.strength, "tests_needed": shown.tests_needed, "text": text}
        console.result(record | {"law": own}, f"{text}\n{plan_text(planned)}")
    else:
        console.result(record, plan_text(planned))


@main.command()
@click.argument("files", nargs=-1, required=True, type=ExportPath(dir_okay=False))
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
    from tribo.cli.setup_commands import against_pandas, ratio_in_words, timing_in_words
    from tribo.files import data_dir
    from tribo.springblock.engine_speed import simulator_benchmarks

    with console.progress() as progress:
        ratios = against_pandas(campaign or data_dir() / "example", jobs)
        timings = simulator_benchmarks(lambda done, total: progress("timing the simulator", done, total), large=large)
    record = {"reading": ratios, "simulator": [t.record() for t in timings]}
    console.result(record, "\n".join([*map(ratio_in_words, ratios), *map(timing_in_words, timings)]))


@main.command()
@command_options
def doctor(console: Console, **_: Any) -> int:
    """Check this installation.

    Lists versions, processor cores and the optional packages found or missing.
    """
    from tribo.cli.setup_commands import examine, in_words

    found = examine()
    console.result(found, in_words(found))
    return 0 if found["healthy"] else 1
