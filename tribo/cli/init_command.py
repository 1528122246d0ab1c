"""tribo init: a campaign to fill in, or one drafted from the exports at hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.cli.console import Console, command_options
from tribo.cli.reading_options import corrected, reading_options
from tribo.errors import Problem

if TYPE_CHECKING:
    from tribo.ingestion.draft import Draft, Stated

_TABLE = "--table sample=COLUMN,normal_load_N=COLUMN,coefficient=COLUMN"


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--from", "raw", type=click.Path(exists=True, path_type=Path),
    help="Folder (or one file, or a .zip) of exports: campaign.toml and tests.csv are written from them.",
)  # fmt: skip
@click.option(
    "--names", multiple=True, metavar="PATTERN",
    help="What the names of files say, such as {sample}_{normal_load_N}N_{speed_rpm}RPM_{repeat}; [N] is text that may "
    "be missing. Can be repeated: the first that fits is used. [default: a pattern is proposed]",
)  # fmt: skip
@click.option(
    "--records", default="", metavar="PATTERN",
    help="What the heads of records within one export say, such as {normal_stress_Pa}.",
)  # fmt: skip
@click.option(
    "--table", default="", metavar="COLUMN=NAME,...",
    help="The file given by --from is a table of evaluated forces, one row a test: its column for each column of "
    "tests.csv, such as sample=Material,normal_load_mN=Load,coefficient=CoF. [default: proposed where the file is no "
    "export]",
)  # fmt: skip
@click.option(
    "--fill", default="", metavar="COLUMN=VALUE,...",
    help="Columns of tests.csv with one value for all tests that do not say otherwise, such as mass_g=30.7.",
)  # fmt: skip
@click.option("--area-mm2", type=click.FloatRange(min=0, min_open=True), help="Nominal contact area.")
@click.option("--dry-run", is_flag=True, help="Show both files without writing anything.")
@reading_options
@command_options
def init(console: Console, folder: Path, raw: Path | None, dry_run: bool, **options: Any) -> int:
    """Create a campaign in FOLDER.

    Without --from, a template to fill in. With --from, the exports are read, campaign.toml and tests.csv are written
    from their names, headers and columns, and everything that could not be found is listed. Existing files are never
    overwritten.
    """
    if raw is None:
        return _template(console, folder)
    from tribo.ingestion.draft_files import texts, write_draft

    stated = _stated(options)
    draft = _from_table(raw, options["table"]) if options["table"] else _from_exports(raw, stated)
    contents = texts(folder, draft, stated, options["area_mm2"])
    if not dry_run:
        write_draft(folder, contents, raw if draft.of_exports else None)
    record = {
        "folder": str(folder), "rows": draft.rows, "found": draft.found, "missing": draft.missing,
        "not_read": draft.not_read, "files": {path.name: text for path, text in contents.items()},
    }  # fmt: skip
    shown = "\n".join(f"--- {path}\n{text}" for path, text in contents.items()) if dry_run else ""
    console.result(record, shown + _words(draft, folder, dry_run))
    return 0


def _template(console: Console, folder: Path) -> int:
    from tribo.campaign import write_template

    write_template(folder)
    words = f"{folder}: fill in campaign.toml and tests.csv, and copy the exports into raw/"
    console.result({"folder": str(folder)}, words)
    return 0


def _from_table(path: Path, mapping: str) -> Draft:
    from tribo.ingestion.draft_table import draft_from_table
    from tribo.readers import columns_from_text

    return draft_from_table(path, columns_from_text(mapping))


def _from_exports(raw: Path, stated: Stated) -> Draft:
    """The draft of a folder of exports; of one table of evaluated forces where the columns say that it is one."""
    from tribo.errors import CampaignError
    from tribo.ingestion.draft import draft_campaign, exports_in
    from tribo.ingestion.draft_table import draft_from_table, is_table_of_forces

    (file, *more) = exports_in(raw).values()
    if not more and is_table_of_forces(file):
        return draft_from_table(file, {})
    try:
        return draft_campaign(raw, stated)
    except CampaignError as why:
        what = "a table of forces that were evaluated elsewhere is read with --table"
        hints = [] if more else [Problem("no_export", what, allowed=_TABLE)]
        raise CampaignError([*why.problems, *hints]) from None


def _stated(options: dict[str, Any]) -> Stated:
    from tribo.ingestion.draft import Stated
    from tribo.ingestion.file_names import name_pattern
    from tribo.readers import columns_from_text
    from tribo.records import UNCORRECTED

    return Stated(
        patterns=tuple(name_pattern(text) for text in options["names"]),
        records=name_pattern(options["records"]) if options["records"] else None,
        columns=columns_from_text(options["columns"]) if options["columns"] else {},
        correction=corrected(UNCORRECTED, options["stated"]),
        filled=columns_from_text(options["fill"]) if options["fill"] else {},
    )


def _words(draft: Draft, folder: Path, dry_run: bool) -> str:
    """What was written, found, not found and not read."""
    files = {row["file"].partition("#")[0] for row in draft.rows if "file" in row}
    verb = "would be written" if dry_run else "written"
    lines = [f"{verb}: {len(draft.rows)} rows for {len(files)} exports, samples {', '.join(draft.samples)}"]
    lines += [f"found: {text}" for text in draft.found]
    lines += [f"to fill in: {text}" for text in draft.missing]
    lines += [f"not listed in tests.csv: {text}" for text in draft.not_read]
    lines.append(f"then: tribo ingest {folder} -o out")
    return "\n".join(lines)
