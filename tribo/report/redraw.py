"""The figures of a report drawn again from the numbers beside them: another width, other names of samples."""

from __future__ import annotations

import re
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import pandas as pd

from tribo.errors import CampaignError, Problem
from tribo.figures import style
from tribo.figures.catalogue import DIAGNOSIS_FIGURES, FIGURES, FRICTION_FIGURES
from tribo.files import found_in, text_of, write_bytes
from tribo.user_text import did_you_mean, from_spreadsheet

NARROWEST_MM, WIDEST_MM = 80.0, 400.0
OF_TEXT = {
    "sample", "specimen", "test_id", "regime", "mark", "axis", "y_axis", "title", "detail", "x_name", "row", "label",
    "covariate", "observable", "name", "mechanism", "choice", "status", "estimate", "reason", "model", "formula",
    "group", "parameter", "cavity", "variable", "way", "quantity",
}  # fmt: skip
_WHOLE = re.compile(r"-?\d+")


def redrawn(
    out: Path, width_mm: float = style.PAGE_MM, names: Mapping[str, str] | None = None
) -> dict[str, dict[str, bytes]]:
    """The figures of an output folder as SVG and PDF with text that can be edited, by their name and ending.

    Parameters
    ----------
    out : Path
        A folder that ``tribo report``, ``compare`` or ``diagnose`` has written; the numbers of each figure are read
        from ``figures/NAME.csv``.
    width_mm : float
        Width of the page in mm; letters keep their size.
    names : mapping, optional
        Other names for samples, by the name in the campaign.

    Raises
    ------
    CampaignError
        The folder holds no figures, a width of less than 80 or more than 400 mm, or a name that no sample has.
    """
    if not NARROWEST_MM <= width_mm <= WIDEST_MM:
        allowed = f"{NARROWEST_MM:g} to {WIDEST_MM:g} mm"
        raise CampaignError(Problem("bad_width", "not a width of a page", found=f"{width_mm:g} mm", allowed=allowed))
    known: dict[str, Any] = {**FIGURES, **FRICTION_FIGURES, **DIAGNOSIS_FIGURES}
    folder = out / "figures"
    paths = {path.stem: path for path in (found_in(folder, "*.csv") if folder.is_dir() else ()) if path.stem in known}
    texts = {name: text_of(paths[name]) for name in known if name in paths}
    numbers = {name: _numbers(text) for name, text in texts.items() if text.strip()}  # empty where it was not drawn
    if not numbers:
        what = "this folder holds no figures of tribo report, compare or diagnose"
        raise CampaignError(Problem("no_figures", what, file=str(out)))
    named = [table[column] for table in numbers.values() for column in ("sample", "row") if column in table]
    samples = {str(name) for column in named for name in column if name}
    unknown = [name for name in names or {} if name not in samples]
    if unknown:
        hint = did_you_mean(unknown[0], sorted(samples)) or ", ".join(sorted(samples))
        raise CampaignError(Problem("unknown_sample", "no figure shows this sample", found=unknown[0], allowed=hint))
    found = {}
    with style.page(width_mm, editable_text=True):
        for name, table in numbers.items():
            if table.empty:
                continue
            figure = known[name].draw(_renamed(table, names or {}))
            svg = style.as_svg(figure, {"Creator": "tribo", "Title": known[name].title})
            found[name] = {"svg": svg.encode(), "pdf": style.as_pdf(figure, {"Title": known[name].title})}
    return found


def write_redrawn(
    out: Path,
    to: Path,
    width_mm: float = style.PAGE_MM,
    names: Mapping[str, str] | None = None,
    force: bool = False,
) -> list[Path]:
    """Write the figures of :func:`redrawn` to the folder ``to``, as NAME.svg and NAME.pdf.

    Raises
    ------
    CampaignError
        As :func:`redrawn`; or a file of the same name is there already and ``force`` is not given.
    """
    folder = out / "figures"
    stems = [path.stem for path in (found_in(folder, "*.csv") if folder.is_dir() else ())]
    there = [path for stem in stems for path in (to / f"{stem}.svg", to / f"{stem}.pdf") if path.exists()]
    if there and not force:
        what, allowed = "a file of this name is there already", "a folder without figures, or --force"
        raise CampaignError(Problem("file_there", what, file=str(there[0]), allowed=allowed))
    contents = {
        to / f"{name}.{ending}": content
        for name, endings in redrawn(out, width_mm, names).items()
        for ending, content in endings.items()
    }
    return [write_bytes(path, content) for path, content in contents.items()]


def _numbers(text: str) -> pd.DataFrame:
    """The numbers of a figure as they were drawn: texts as texts, however much they look like numbers."""
    table = pd.read_csv(StringIO(text), dtype=str, keep_default_na=False)
    for name in table.columns:
        cells = table[name]
        if name in OF_TEXT:
            table[name] = [from_spreadsheet(cell) for cell in cells]
        elif set(cells) <= {"True", "False", ""}:
            table[name] = [cell == "True" for cell in cells] if cells.any() else float("nan")
        elif all(_WHOLE.fullmatch(cell) for cell in cells):
            table[name] = [int(cell) for cell in cells]
        else:
            table[name] = [float(cell) if cell else float("nan") for cell in cells]
    return table


def _renamed(table: pd.DataFrame, names: Mapping[str, str]) -> pd.DataFrame:
    """Samples under other names: whole cells, and the word after "Sample" in a title."""
    if not names:
        return table
    inside = re.compile(r"(?<=^Sample )(.+)$|(?<=\()([^()]+)(?=\)$)")
    columns = {}
    for name in set(table.columns) & {"sample", "row", "x_name", "title", "choice"}:
        cells = [names.get(cell, cell) for cell in table[name]]
        if name == "title":
            cells = [inside.sub(lambda m: names.get(m[0], m[0]), cell) for cell in cells]
        columns[name] = cells
    return table.assign(**columns)
