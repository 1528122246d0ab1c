"""Figures to files: SVG, PDF, PNG and the plotted numbers as CSV, the same bytes for the same study.

The PDF and the PNG are set by typst with the fonts it brings along, so that they are the same everywhere. Each figure
also has the positions of its points, so that the page can show their values on hovering. The figures of a report are
drawn again from the numbers beside them: another width, other names of samples.
"""

from __future__ import annotations

import base64
import logging
import re
import struct
import textwrap
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import metadata
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tribo.errors import CampaignError, Problem, unexpected
from tribo.figures import style
from tribo.figures.catalogue import DIAGNOSIS_FIGURES, FIGURES, FRICTION_FIGURES
from tribo.figures.style import FigureOf, as_svg, house_style
from tribo.files import found_in, text_of, write_bytes, write_text
from tribo.forked import each
from tribo.kept_results import kept_or_made
from tribo.outputs import csv_text, write
from tribo.records import FloatArray, Study
from tribo.temporary import temporary_folder
from tribo.user_text import did_you_mean, from_spreadsheet, printable

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis


OF_STRAIGHT_LINES = ("fig4", "fig6", "fig7", "fig8")  # without the model, "forces" shows the law chosen by the data
STAGE = "drawing figures"
DRAWN_BY = ("figures", "vocabulary", "report/drawings")
SET_BY = ("report/drawings",)
PNG_DPI = 300.0
FIGURE_PAGE = """#set page(width: auto, height: auto, margin: 0pt, fill: white)
#set document(title: sys.inputs.title, description: sys.inputs.origin, date: none)
#image("figure.svg")
"""
POINTS_PER_INCH = 72.0
MOST_POINTS = 60  # of a line without marks: it is read off by eye, not point by point
MARKS = frozenset("os^DvPX<>*hpd.")  # the caps of error bars are marks too, but no points
THEME = {
    "#ffffff": "var(--paper)",
    "#000000": "currentColor",
    "#0072b2": "var(--blue)",
    r"#([2-8][0-9a-f])\2\2": "var(--soft)",  # greys of lettering
    r"#([c-e][0-9a-f])\2\2": "var(--line)",
}
# Points of one shape and style, one after the other, and the place of each.
_ALIKE = re.compile(
    r'<use xlink:href="([^"]+)" x="[^"]*" y="[^"]*" style="([^"]*)"/>'
    r'(?:\s*<use xlink:href="\1" x="[^"]*" y="[^"]*" style="\2"/>)+'
)
_PLACE = re.compile(r' x="([^"]*)" y="([^"]*)" style="[^"]*"/>\s*')


Numbers = pd.DataFrame | Problem
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Drawn:
    """A figure as drawn: its words, its files by ending, and its points for hovering (:func:`points_of`)."""

    name: str
    title: str
    caption: str
    files: dict[str, bytes]
    series: list[dict[str, Any]] = field(default_factory=list)

    @property
    def svg(self) -> str:
        return self.files["svg"].decode("utf-8")


def write_figures(
    study: Study | None,
    out: Path,
    diagnosis: Diagnosis | None = None,
    origin: str = "",
    progress: Progress | None = None,
    jobs: int = 1,
    kept: Path | None = None,
) -> dict[str, Drawn]:
    """Write out/figures/NAME.svg, .pdf, .png and .csv of every figure there are numbers for, and return them.

    Parameters as of :func:`draw_all`.
    """
    drawn = draw_all(study, diagnosis, origin, progress, jobs, kept)
    for figure in drawn.values():
        for ending, content in figure.files.items():
            write(out, f"figures/{figure.name}.{ending}", content)
    return drawn


def draw_all(
    study: Study | None,
    diagnosis: Diagnosis | None = None,
    origin: str = "",
    progress: Progress | None = None,
    jobs: int = 1,
    kept: Path | None = None,
) -> dict[str, Drawn]:
    """Every figure there are numbers for, by name, those of the study before those of the diagnosis; no files.

    Parameters
    ----------
    origin : written to the metadata of every file; states its source
    progress : told of every figure
    jobs : number of processes that draw
    kept : folder of kept results, where a figure whose numbers have not changed is taken from
    """
    todo = list(_with_numbers(study, diagnosis))
    found = {}
    for done, figure in enumerate(each(partial(_drawn_or_said, origin, kept), todo, jobs), start=1):
        # not in the other processes: typst keeps threads of its own, which do not survive a fork
        made_from = (figure.svg, figure.title, origin, metadata.version("typst"))
        rest = partial(_other_files, figure, origin)
        texts = kept_or_made(kept, f"figure-{figure.name}-files", made_from, rest, SET_BY)
        files = {ending: base64.b64decode(text) for ending, text in texts.items()}
        found[figure.name] = replace(figure, files={**figure.files, **files})
        if progress is not None:
            progress(STAGE, done, len(todo))
    return found


def _with_numbers(study: Study | None, diagnosis: Diagnosis | None) -> Iterator[tuple[str, Numbers]]:
    made_of: list[tuple[Mapping[str, FigureOf[Any]], Any]] = [
        (FIGURES, study), (FRICTION_FIGURES, study), (DIAGNOSIS_FIGURES, diagnosis),
    ]  # fmt: skip
    left_out = OF_STRAIGHT_LINES if study is not None and study.comparison is None and study.laws is not None else ()
    for figures, results in made_of:
        for name, figure in figures.items() if results is not None else ():
            if name in left_out:
                continue
            try:
                numbers = figure.numbers(results)
            except Exception as why:  # one figure must not cost the others
                yield name, unexpected(why, "the numbers of this figure cannot be computed", name)
                continue
            if not numbers.empty:
                yield name, numbers


def _drawn_or_said(origin: str, kept: Path | None, todo: tuple[str, Numbers]) -> Drawn:
    """A figure, or in its place the sentence that says why it is not there."""
    name, numbers = todo
    record = next(table[name] for table in (FIGURES, FRICTION_FIGURES, DIAGNOSIS_FIGURES) if name in table)
    if isinstance(numbers, Problem):
        return _said_instead(record, numbers, pd.DataFrame(), origin)
    made_from = (numbers, record.title, origin, matplotlib.__version__)
    try:
        svg, series = kept_or_made(
            kept, f"figure-{name}", made_from, lambda: _svg_and_points(record, numbers, origin), DRAWN_BY
        )
    except OSError:
        raise
    except Exception as why:  # one figure must not cost the others
        return _said_instead(record, unexpected(why, "this figure cannot be drawn", name), numbers, origin)
    csv = csv_text(numbers).encode("utf-8")
    return Drawn(name, record.title, record.caption, {"csv": csv, "svg": svg.encode("utf-8")}, series)


def _said_instead(record: FigureOf[Any], why: Problem, numbers: pd.DataFrame, origin: str) -> Drawn:
    logging.getLogger("tribo").error("%s", printable(str(why)))
    with house_style():
        figure = Figure(figsize=(5.0, 1.0))
        figure.text(0.02, 0.5, "\n".join(textwrap.wrap(str(why), 90)), va="center")
    svg = svg_text(figure, record.title, origin).encode("utf-8")
    return Drawn(record.name, record.title, str(why), {"csv": csv_text(numbers).encode("utf-8"), "svg": svg})


def _svg_and_points(record: FigureOf[Any], numbers: pd.DataFrame, origin: str) -> tuple[str, list[dict[str, Any]]]:
    figure = record.draw(numbers)
    svg = svg_text(figure, record.title, origin)  # settles the layout
    return svg, points_of(figure)


def svg_text(figure: Figure, title: str = "", origin: str = "") -> str:
    """A figure as SVG without a date and without random names; its layout is settled on the way."""
    about = {"Creator": "tribo", "Title": title, "Description": origin}
    return as_svg(figure, {name: text for name, text in about.items() if text})


def points_of(figure: Figure) -> list[dict[str, Any]]:
    """The points of every line and scatter of a settled figure: its name, the labels of its axes, the places of the
    points on the page in points from the top left (x, y, x, y, ...), and their values in the units of the axes."""
    height = figure.get_size_inches()[1] * POINTS_PER_INCH
    scale = POINTS_PER_INCH / figure.dpi
    labels: dict[str, str] = {}
    found = []
    for ax in figure.axes:
        x, y = ax.get_xlabel() or labels.get("x", "x"), ax.get_ylabel() or labels.get("y", "y")
        labels |= {"x": x, "y": y}
        for name, xy, transform in _points(ax):
            finite = np.isfinite(xy).all(axis=1)
            if finite.any():
                place = transform.transform(xy[finite]) * scale
                place[:, 1] = height - place[:, 1]
                parts = (ax.get_title(loc="left"), "" if name.startswith("_") else name)
                found.append({
                    "name": ", ".join(part for part in parts if part), "x": x, "y": y,
                    "place": [float(f"{v:.1f}") for v in place.ravel()],
                    "value": [float(f"{v:.4g}") for v in xy[finite].ravel()],
                })  # fmt: skip
    return found


def _points(ax: Axes) -> Iterator[tuple[str, FloatArray, Any]]:
    for line in ax.lines:
        xy = np.asarray(line.get_xydata(), float)
        marked = str(line.get_marker()) in MARKS
        if len(xy) and (marked or (line.get_linestyle() == "-" and len(xy) > 2)):
            step = 1 if marked else max(1, len(xy) // MOST_POINTS)
            yield str(line.get_label()), xy[::step], line.get_transform()
    for scatter in ax.collections:
        offsets: FloatArray = np.ma.filled(np.ma.asarray(scatter.get_offsets(), float), np.nan)
        if len(offsets) > 1:
            yield str(scatter.get_label()), offsets, scatter.get_offset_transform()


def _other_files(figure: Drawn, origin: str) -> dict[str, str]:
    """The PDF and the PNG of a figure as text, which is what can be kept."""
    files = figure_files(figure.files["svg"], figure.title, origin)
    return {ending: base64.b64encode(content).decode("ascii") for ending, content in files.items()}


def figure_files(svg: bytes, title: str, origin: str) -> dict[str, bytes]:
    """A figure given as SVG, as PDF (vectors, lettering as outlines) and as PNG of 300 dots per inch."""
    import typst

    with temporary_folder() as folder:
        write_bytes(folder / "figure.svg", svg)
        write_text(folder / "page.typ", FIGURE_PAGE)
        compiler: Any = typst.Compiler(root=folder, ignore_system_fonts=True)
        inputs = {"title": title, "origin": origin}
        pdf = compiler.compile(folder / "page.typ", format="pdf", sys_inputs=inputs)
        png = compiler.compile(folder / "page.typ", format="png", ppi=PNG_DPI, sys_inputs=inputs)
    return {"pdf": bytes(pdf), "png": with_text(bytes(png), {"Title": title, "Description": origin})}


def with_text(png: bytes, texts: Mapping[str, str]) -> bytes:
    """A PNG with lines of text in it (iTXt, PNG specification 11.3.3.4), put before its picture data."""
    at = png.index(b"IDAT") - 4
    chunks = b"".join(
        _chunk(b"iTXt", key.encode("latin-1") + b"\0\0\0\0\0" + text.encode("utf-8"))
        for key, text in texts.items()
        if text
    )
    return png[:at] + chunks + png[at:]


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def inline_svg(svg: str, name: str, label: str) -> str:
    """An SVG to stand inside an HTML page: names unique to it, a label for screen readers, theme colours.

    White paper becomes transparent and black ink the colour of the text, so that it reads on light and dark; a figure
    with a colour scale keeps its white paper, since its ink was chosen for the colours under it. A style sheet of its
    own would hold for the whole page, so it is taken out. Points that look alike share one group, which halves the size
    of a figure of thousands of them.
    """
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<(metadata|style)\b.*?</\1>\s*|<title>.*?</title>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", body)
    has_colour_scale = "<image" in body
    for colour, theme in () if has_colour_scale else THEME.items():
        body = re.sub(rf"\b(fill|stroke): {colour}\b", rf"\1: {theme}", body)
    body = re.sub(r'<svg([^>]*?) (width|height)="[^"]*"', r"<svg\1", body, count=1)
    body = re.sub(r'<svg([^>]*?) (width|height)="[^"]*"', r"<svg\1", body, count=1)
    body = _ALIKE.sub(_in_one_group, body)
    paper = ' class="on-paper"' if has_colour_scale else ""
    body = body.replace("<svg", f'<svg{paper} role="img" aria-label="{label}"', 1)
    return "\n".join(line.rstrip() for line in body.splitlines())


def _in_one_group(alike: re.Match[str]) -> str:
    """Points of one shape and style, one after the other: the style said once, places to a hundredth of a point."""
    points = _PLACE.sub(lambda at: f' x="{float(at[1]):.2f}" y="{float(at[2]):.2f}"/>\n', alike[0])
    return f'<g style="{alike[2]}">\n{points}</g>'


NARROWEST_MM, WIDEST_MM = 80.0, 400.0
OF_TEXT = {
    "sample", "specimen", "test_id", "regime", "mark", "axis", "y_axis", "title", "detail", "x_name", "row", "label",
    "covariate", "observable", "name", "mechanism", "choice", "status", "estimate", "reason", "model", "formula",
    "group", "parameter", "cavity", "variable", "way", "quantity", "source",
}  # fmt: skip
_WHOLE = re.compile(r"-?\d+")


def redrawn(
    out: Path, width_mm: float = style.PAGE_MM, names: Mapping[str, str] | None = None
) -> tuple[dict[str, dict[str, bytes]], list[Problem]]:
    """The figures of an output folder as SVG and PDF with text that can be edited, by their name and ending; and why
    others of them could not be drawn.

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
    numbers, failed = {}, []
    for name, text in texts.items():
        if text.strip():  # empty where it was not drawn
            try:
                numbers[name] = _numbers(text)
            except ValueError as why:
                failed.append(_not_drawn(paths[name], why))
    if not numbers and not failed:
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
            try:
                figure = known[name].draw(_renamed(table, names or {}))
                svg = style.as_svg(figure, {"Creator": "tribo", "Title": known[name].title})
                pdf = style.as_pdf(figure, {"Title": known[name].title})
            except (ArithmeticError, LookupError, TypeError, ValueError) as why:
                failed.append(_not_drawn(paths[name], why))
                continue
            found[name] = {"svg": svg.encode(), "pdf": pdf}
    return found, failed


def _not_drawn(path: Path, why: Exception) -> Problem:
    """Numbers of a figure that a user changed so that it cannot be drawn."""
    found = f"{type(why).__name__}: {why}"
    return Problem("not_drawn", "this figure cannot be drawn from its numbers", file=str(path), found=found,
                   allowed="the numbers that tribo wrote; make the report again")  # fmt: skip


def write_redrawn(
    out: Path,
    to: Path,
    width_mm: float = style.PAGE_MM,
    names: Mapping[str, str] | None = None,
    force: bool = False,
) -> tuple[list[Path], list[Problem]]:
    """Write the figures of :func:`redrawn` to the folder ``to``, as NAME.svg and NAME.pdf; and why others could not be
    drawn.

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
    found, failed = redrawn(out, width_mm, names)
    contents = {to / f"{name}.{end}": content for name, ends in found.items() for end, content in ends.items()}
    return [write_bytes(path, content) for path, content in contents.items()], failed


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
