"""Commands around an analysis: tribo init, the state of an installation (doctor), speed as ratios (bench)."""

from __future__ import annotations

import os
import platform
import re
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.cli.console import Console, ExportPath, command_options
from tribo.cli.study_options import corrected, reading_options
from tribo.errors import Problem

if TYPE_CHECKING:
    from tribo.drafting.draft import Draft
    from tribo.springblock.engine_speed import Timing


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--from", "raw", type=ExportPath(),
    help="Folder (or one file, or a .zip) of exports: campaign.toml and tests.csv are written from them.",
)  # fmt: skip
@click.option(
    "--names", multiple=True, metavar="PATTERN",
    help="Pattern of the names of files, such as {sample}_{normal_load_N}N_{speed_rpm}RPM_{repeat}; [N] is text that "
    "may be missing. Can be repeated: the first that fits is used. [default: a pattern is proposed]",
)  # fmt: skip
@click.option(
    "--records", default="", metavar="PATTERN",
    help="Pattern of the headings of records within one export, such as {normal_stress_Pa}.",
)  # fmt: skip
@click.option(
    "--table", default="", metavar="COLUMN=NAME,...",
    help="The file given by --from is a table of evaluated forces, one row a test: its column for each column of "
    "tests.csv, such as sample=Material,normal_load_mN=Load,coefficient=CoF. [default: proposed where the file is no "
    "export]",
)  # fmt: skip
@click.option(
    "--fill", default="", metavar="COLUMN=VALUE,...",
    help="Columns of tests.csv with one value for all tests that state no other, such as mass_g=30.7.",
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
    from tribo.drafting.draft import draft_from_table, texts, write_draft
    from tribo.readers import columns_from_text
    from tribo.records import UNCORRECTED

    columns = columns_from_text(options["columns"]) if options["columns"] else {}
    stated = options["stated"]
    area_mm2 = options["area_mm2"] or stated.get("nominal_area_mm2")
    correction = corrected(UNCORRECTED, stated | ({"nominal_area_mm2": area_mm2} if area_mm2 else {}))
    filled = columns_from_text(options["fill"]) if options["fill"] else {}
    if "normal_load_N" in stated:
        filled.setdefault("normal_load_N", f"{stated['normal_load_N']:g}")
    if options["table"]:
        draft = draft_from_table(raw, columns_from_text(options["table"]))
    else:
        draft = _from_exports(
            raw, patterns=tuple(options["names"]), records=options["records"], columns=columns, correction=correction,
            filled=filled,
        )  # fmt: skip
    contents = texts(folder, draft, columns, correction, area_mm2)
    if not dry_run:
        write_draft(folder, contents, raw if draft.of_exports else None)
    record = {
        "folder": str(folder), "rows": draft.rows, "found": draft.found, "missing": draft.missing,
        "not_read": draft.not_read, "not_used": draft.not_used,
        "files": {path.name: text for path, text in contents.items()},
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


def _from_exports(raw: Path, **stated: Any) -> Draft:
    """The draft of a folder of exports; of one table of evaluated forces where the columns say that it is one."""
    from tribo.drafting.draft import draft_campaign, draft_from_table, exports_in, is_table_of_forces
    from tribo.errors import CampaignError
    from tribo.readers.columns import TABLE_OPTION

    (file, *more) = exports_in(raw).values()
    if not more and is_table_of_forces(file):
        return draft_from_table(file, {})
    try:
        return draft_campaign(raw, **stated)
    except CampaignError as why:
        what = "a table of forces that were evaluated elsewhere is read with --table"
        hints = [] if more else [Problem("no_export", what, allowed=TABLE_OPTION)]
        raise CampaignError([*why.problems, *hints]) from None


def _words(draft: Draft, folder: Path, dry_run: bool) -> str:
    """What was written, found, not found and not read."""
    files = {row["file"].partition("#")[0] for row in draft.rows if "file" in row}
    verb = "would be written" if dry_run else "written"
    lines = [f"{verb}: {len(draft.rows)} rows for {len(files)} exports, samples {', '.join(draft.samples)}"]
    lines += [f"found: {text}" for text in draft.found]
    lines += [f"to fill in: {text}" for text in draft.missing]
    lines += [f"names not used: {text}" for text in draft.not_used]
    lines += [f"not listed in tests.csv: {text}" for text in draft.not_read]
    lines.append(f"then: tribo ingest {folder} -o out")
    return "\n".join(lines)


OPTIONAL = {
    "distributed": "simulations on a dask cluster (--scheduler)",
    "snakemake": "building a folder of campaigns (tribo build)",
}


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def needed() -> list[str]:
    """The packages that tribo requires according to its metadata, without those of its extras."""
    asked = [line for line in metadata.requires("tribo") or [] if "extra ==" not in line]
    return [re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in asked]


def examine() -> dict[str, Any]:
    """Versions of required and optional packages; ``healthy`` is False if something required is missing."""
    from tribo import __version__
    from tribo.files import data_dir

    versions = {p: _version(p) for p in needed()}
    example = (data_dir() / "example" / "campaign.toml").is_file()
    return {
        "tribo": __version__,
        "python": platform.python_version(),
        "executable": sys.executable,
        "system": platform.platform(),
        "cores": os.cpu_count(),
        "needed": versions,
        "optional": {p: _version(p) for p in OPTIONAL},
        "bundled_example": example,
        "healthy": example and bool(versions) and all(versions.values()),
    }


def in_words(found: dict[str, Any]) -> str:
    """The result of :func:`examine` as lines of text."""
    lines = [f"tribo {found['tribo']}, Python {found['python']}, {found['cores']} cores, {found['system']}"]
    lines += [f"  {p:<20} {v or 'MISSING: pip install ' + p}" for p, v in found["needed"].items()]
    lines += [f"  {p:<20} {v or 'not installed; needed only for ' + OPTIONAL[p]}" for p, v in found["optional"].items()]
    lines.append(f"  {'bundled example':<20} {'found' if found['bundled_example'] else 'MISSING'}")
    return "\n".join(lines)


Work = Callable[[], Any]


def compare_in_turns(
    name: str, ours: tuple[str, Work], other: tuple[str, Work], wanted: str, rounds: int = 5
) -> dict[str, Any]:
    """Seconds of two ways to do the same, timed alternately after one round of each that is not counted.

    ``ratio`` is the median of ours over the other's, between ``lowest`` and ``highest``.
    """
    ours[1](), other[1]()
    seconds = [(_timed(ours[1]), _timed(other[1])) for _ in range(rounds)]
    ratios = [a / b for a, b in seconds]
    return {
        "name": name, "ours": ours[0], "other": other[0], "ours_s": statistics.median(a for a, _ in seconds),
        "other_s": statistics.median(b for _, b in seconds), "ratio": statistics.median(ratios),
        "lowest": min(ratios), "highest": max(ratios), "wanted": wanted, "rounds": rounds,
    }  # fmt: skip


def _timed(work: Work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def against_pandas(path: Path, jobs: int = 1) -> list[dict[str, Any]]:
    """Time of reading a campaign, and of reducing it to pulls, relative to pandas.read_csv with known file layouts."""
    import pandas as pd

    from tribo.campaign import open_campaign
    from tribo.readers import read_export
    from tribo.stages import ingest

    with open_campaign(path) as campaign:
        known = [
            (campaign.root / trace.file, trace.source)
            for trace in ingest(campaign).traces.values()
            if trace.source is not None
        ]

        def load_all() -> None:
            for file, form in known:
                pd.read_csv(
                    file, sep=form.delimiter, decimal=form.decimal, encoding=form.encoding, skiprows=form.header_rows,
                    header=None,
                )  # fmt: skip

        def read_all() -> None:
            for file, _ in known:
                read_export(file)

        pandas = ("pandas.read_csv of the same files", load_all)
        return [
            compare_in_turns(f"read {len(known)} exports", ("tribo reads", read_all), pandas, "at most 2"),
            compare_in_turns(
                f"ingest {len(known)} exports, {jobs} processes",
                ("tribo reads and reduces to pulls", lambda: ingest(campaign, jobs=jobs)),
                pandas,
                "under 3",
            ),
        ]


def ratio_in_words(ratio: Mapping[str, Any]) -> str:
    """One ratio as a line."""
    return (
        "{name}: {ours} {ours_s:.3g} s, {other} {other_s:.3g} s, ratio {ratio:.2f} "
        "({lowest:.2f} to {highest:.2f} in {rounds} rounds; target {wanted})"
    ).format(**ratio)


def timing_in_words(timing: Timing) -> str:
    """One figure of the simulator as a line."""
    bound = "at least" if timing.better == "higher" else "at most"
    aim = "" if timing.aim is None else f", target {bound} {timing.aim:g}"
    note = f" ({timing.note})" if timing.note else ""
    return f"{timing.name}: {timing.value:.4g} {timing.unit}{aim}{note}"
