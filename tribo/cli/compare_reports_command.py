"""tribo compare-reports: two reports side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tribo.cli.console import Console, command_options
from tribo.cli.given_paths import GivenPath
from tribo.cli.output import Output, output_options
from tribo.cli.run_record import command_line, now


@click.command("compare-reports")
@click.argument("first", type=GivenPath(file_okay=False))
@click.argument("second", type=GivenPath(file_okay=False))
@output_options()
@command_options
def compare_reports(console: Console, first: Path, second: Path, out: Output, **_: Any) -> int:
    """Compare two reports: FIRST and SECOND are output folders of tribo report.

    Writes compare.html, with the findings and figures of both side by side, and compare.csv, with the difference of mu,
    tau0 and T of every sample that both have and its 95 % interval.
    """
    from tribo.report.provenance import provenance_of_comparison
    from tribo.report.reports_compared import write_comparison

    with out.taken(first, second) as folder:
        record = provenance_of_comparison((first, second), command_line(), now())
        table, said = write_comparison((first, second), folder, record)
    words = [*said, f"Written: {out.path / 'compare.html'}"]
    console.result({"sentences": said, "differences": table.to_dict("records")}, "\n".join(words))
    return 0
