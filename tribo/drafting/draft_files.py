"""campaign.toml and tests.csv of a drafted campaign, written where nothing is replaced."""

from __future__ import annotations

import csv
import io
import json
import shutil
from collections.abc import Mapping
from pathlib import Path

from tribo.campaign.table import KNOWN, LOADS, RAW, TABLES, TOML
from tribo.drafting.draft import Draft, Stated
from tribo.errors import CampaignError, Problem
from tribo.files import found_below, write_new
from tribo.records import UNCORRECTED

_TOML = """\
# Written by tribo init from the exports in raw/. Lines that begin with "# FILL IN" hold what the exports do not say.

[campaign]
title = {title}
# FILL IN material = ""
# FILL IN counterface = ""
{area}
{stated}
{columns}
# One table for each sample. cavity = "none" is a surface without a pattern of cavities.
{patterns}"""


def texts(folder: Path, draft: Draft, stated: Stated, area_mm2: float | None) -> dict[Path, str]:
    """The two files of a campaign by their paths."""
    return {
        folder / TOML: _campaign_toml(folder.resolve().name, draft, stated, area_mm2),
        folder / TABLES[0]: _tests_csv(draft),
    }


def _campaign_toml(name: str, draft: Draft, stated: Stated, area_mm2: float | None) -> str:
    area = (
        "# FILL IN nominal_area_mm2 =   # area of the sample face"
        if area_mm2 is None
        else f"nominal_area_mm2 = {area_mm2:g}"
    )
    return _TOML.format(
        title=json.dumps(name, ensure_ascii=False),
        area=area,
        stated="".join(f"{key} = {value:g}\n" for key, value in _corrections(draft, stated).items())
        + (f"zero = {json.dumps(draft.zero)}\n" if draft.zero else ""),
        columns=_columns(stated),
        patterns="\n".join(f'[patterns.{json.dumps(s, ensure_ascii=False)}]\ncavity = "none"\n' for s in draft.samples),
    )


def _corrections(draft: Draft, stated: Stated) -> dict[str, float]:
    given, found = stated.correction, {}
    if draft.negative or given.sign < 0:
        found["sign"] = given.sign * (-1.0 if draft.negative else 1.0)
    if given.gain != UNCORRECTED.gain:
        found["gain"] = given.gain
    if given.lever_arm_m is not None:
        found["lever_arm_mm"] = given.lever_arm_m * 1e3
    if given.sampling_rate_Hz is not None:
        found["sampling_rate_Hz"] = given.sampling_rate_Hz
    if given.speed_m_s is not None:
        found["pull_speed_mm_s"] = given.speed_m_s * 1e3
    return found


def _columns(stated: Stated) -> str:
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in stated.columns.items()]
    return "[columns]\n" + "".join(lines) if lines else ""


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
    copies = {} if raw is None else _copies(folder / RAW, raw)
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


def _copies(target: Path, raw: Path) -> dict[Path, Path]:
    """Where each export is copied to; nothing where they are in raw/ of the campaign already."""
    base = raw if raw.is_dir() else raw.parent
    files = [p for p in found_below(raw) if p.is_file()] if raw.is_dir() else [raw]
    inside = target.resolve() in (base.resolve(), *base.resolve().parents)
    return {} if inside else {target / p.relative_to(base): p for p in files}
