"""tribo discover: the missing law."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tribo.cli.console import Console, command_options
from tribo.cli.given_paths import GivenPath
from tribo.cli.output import Output, output_options
from tribo.cli.run_record import provenance_of_run


@click.command()
@click.argument("campaign", type=GivenPath())
@output_options()
@click.option(
    "--with", "law_file", type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="LAW.TOML",
    help="Test this law, found in another campaign, instead of searching.",
)
@click.option(
    "--rule", default="seed", show_default=True, help="Rule by which static and sliding force are determined."
)
@click.option("--flat", default="", metavar="SAMPLE", help="Flat sample for the calibration, as in tribo report.")
@command_options
def discover(
    console: Console, campaign: Path, out: Output, law_file: Path | None, **options: Any
) -> int:
    """Search for the law of what no mechanism explains.

    All laws of a small grammar are tried: a recorded column, the shape of its course, what it acts on, in which regime
    and on which samples, and products of two columns. A law is written only if it is beyond what the best of all laws
    reaches by chance. Writes law-1.toml and further laws, laws.csv and discovery.json.
    """
    from tribo import stages
    from tribo.campaign import open_campaign
    from tribo.diagnose.discovery.law_file import read_law
    from tribo.diagnose.discovery.on_campaign import discover_in, hold_law_against
    from tribo.report.discovery_files import write_discovery, write_held

    law = read_law(law_file) if law_file is not None else None
    with out.taken(campaign), open_campaign(campaign) as opened, console.progress() as progress:
        chosen = stages.StudyOptions(kept=out.kept, **options)
        study = stages.study(opened, chosen, until="ingest", progress=progress)
        record = provenance_of_run(study, campaign, chosen)
        with stages.naming_set_aside(study.ingested):
            if law is not None:
                written = write_held(hold_law_against(study.ingested, *law, seed=chosen.seed), out.path, record)
            else:
                found = discover_in(study.ingested, seed=chosen.seed, progress=progress)
                written = write_discovery(found, study.ingested.campaign.title, out.path, record)
    console.result(written.record, written.text)
    return console.status_after(study.ingested.set_aside)
