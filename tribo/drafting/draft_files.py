"""campaign.toml and tests.csv of a drafted campaign, written where nothing is replaced."""

from __future__ import annotations

import csv
import io
import json
import shutil
from collections.abc import Mapping
from pathlib import Path

from tribo.campaign.rows import Columns
from tribo.campaign.table import KNOWN, LOADS, RAW, TABLES, TOML
from tribo.drafting.draft import Draft
from tribo.errors import CampaignError, Problem
from tribo.files import found_below, write_new
from tribo.records import UNCORRECTED, Correction

_TOML = """\
# Written by tribo init from the exports in raw/. Lines that begin with "# FILL IN" hold what the exports do not say.

[campaign]
title = {title}
# FILL IN material = ""
# FILL IN counterface = ""
{area}
{not_used}{stated}
{columns}
# One table for each sample. cavity = "none" is a surface without a pattern of cavities.
{patterns}"""
_AREA = "nominal_area_mm2 = {:g}"
_NO_AREA = "# FILL IN nominal_area_mm2 =   # area of the sample face"


def texts(
    folder: Path, draft: Draft, stated_columns: Columns, given: Correction, area_mm2: float | None
) -> dict[Path, str]:
    """The two files of a campaign by their paths."""
    keys = {}
    if draft.negative or given.sign < 0:
        keys["sign"] = f"{given.sign * (-1.0 if draft.negative else 1.0):g}"
    if given.gain != UNCORRECTED.gain:
        keys["gain"] = f"{given.gain:g}"
    if given.lever_arm_m is not None:
        keys["lever_arm_mm"] = f"{given.lever_arm_m * 1e3:g}"
    if given.sampling_rate_Hz is not None:
        keys["sampling_rate_Hz"] = f"{given.sampling_rate_Hz:g}"
    if given.speed_m_s is not None:
        keys["pull_speed_mm_s"] = f"{given.speed_m_s * 1e3:g}"
    if draft.zero:
        keys["zero"] = json.dumps(draft.zero)
    keys |= {key: f"{value:g}   # FILL IN; 1 stands in for it" for key, value in draft.stands_in.items()}
    columns = [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in stated_columns.items()]
    samples = [json.dumps(sample, ensure_ascii=False) for sample in draft.samples]
    toml = _TOML.format(
        title=json.dumps(folder.resolve().name, ensure_ascii=False),
        area="" if "nominal_area_mm2" in draft.stands_in else _NO_AREA if area_mm2 is None else _AREA.format(area_mm2),
        not_used="".join(
            f"# names of files not used: {json.dumps(text, ensure_ascii=False)}\n" for text in draft.not_used
        ),
        stated="".join(f"{key} = {text}\n" for key, text in keys.items()),
        columns="".join(["[columns]\n", *columns]) if columns else "",
        patterns="\n".join(f'[patterns.{sample}]\ncavity = "none"\n' for sample in samples),
    )
    return {folder / TOML: toml, folder / TABLES[0]: _tests_csv(draft)}


def _tests_csv(draft: Draft) -> str:
    """Rows under the columns that any of them has: the known ones first, in the order of the reference."""
    present = {column for row in draft.rows for column in row}
    if not present & set(LOADS):
        present.add("normal_load_N")
    columns = [c for c in KNOWN if c in present] + sorted(present - set(KNOWN))
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(draft.rows)
    return out.getvalue()


def write_draft(folder: Path, contents: Mapping[Path, str], raw: Path | None) -> tuple[Path, ...]:
    """Write the files, and copy the exports (where there are any) into raw/ unless they are there; what was written.

    Raises
    ------
    CampaignError
        A file of the campaign, or one in raw/ of the same name as an export, already exists. Nothing is written.
    """
    from tribo.readers.source import archive_of

    copies: dict[Path, Path] = {}  # where each export goes, unless they are in raw/ already
    if raw is not None:
        raw = archive_of(raw) or raw
        base, target = raw if raw.is_dir() else raw.parent, folder / RAW
        files = [p for p in found_below(raw) if p.is_file()] if raw.is_dir() else [raw]
        if target.resolve() not in (base.resolve(), *base.resolve().parents):
            copies = {target / p.relative_to(base): p for p in files}
    there = [path for path in (*contents, *copies) if path.exists()]
    if there:
        what = "this file already exists and is not overwritten"
        raise CampaignError(Problem("exists", what, file=str(path)) for path in there)
    for to, source in copies.items():
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, to)
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in contents.items():
        write_new(path, text)
    return (*contents, *copies)
