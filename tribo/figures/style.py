"""Common style of all figures: style sheet, palette, a marker for each sample, sizes for a journal page."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from importlib.resources import as_file, files
from typing import Any, Generic, ParamSpec, TypeVar

import numpy as np
import pandas as pd
from matplotlib import rcParams, style
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.textpath import TextPath
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator
from matplotlib.transforms import ScaledTranslation, Transform

from tribo.display import displayed
from tribo.records import Study

PAGE_MM = 190.0  # two columns of a journal
LEAST_PANEL_MM = 42.0
MM_PER_INCH = 25.4
DETAIL_POINTS = 7.5
LABELS_MM = 6.0  # beside a panel
LEGEND_ROW_MM = 4.4

# Okabe and Ito (2008), without the yellow, which is lost on white paper.
BLACK, VERMILLION, BLUE, GREEN = "#000000", "#D55E00", "#0072B2", "#009E73"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"
SAMPLE_COLOURS = (BLACK, VERMILLION, BLUE, GREEN, PURPLE, ORANGE, SKY)
SAMPLE_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", "*")

_PAGE: ContextVar[tuple[float, bool]] = ContextVar("page", default=(PAGE_MM, False))  # width in mm, text as text

P = ParamSpec("P")
R = TypeVar("R")


def sample_mark(sample_number: int) -> tuple[str, str]:
    """Colour and marker of a sample by its place in the campaign; 63 samples before a pair comes again."""
    return SAMPLE_COLOURS[sample_number % len(SAMPLE_COLOURS)], SAMPLE_MARKERS[sample_number % len(SAMPLE_MARKERS)]


class PageFigure(Figure):
    """A figure that keeps the house style wherever it is drawn, and shows itself in a notebook; no pyplot is needed."""

    def draw(self, renderer: RendererBase) -> None:
        """Draw in the house style: ticks are made when they are first drawn."""
        with house_style():
            super().draw(renderer)

    def _repr_svg_(self) -> str:
        return as_svg(self)


def as_svg(figure: Figure, about: Mapping[str, str] | None = None) -> str:
    """A figure as SVG without a date and without random names; ``about`` is written to its metadata."""
    buffer = io.StringIO()
    with house_style():  # the canvas is called directly: Figure.savefig draws every figure once more than it needs to
        settle(figure)
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None, **(about or {})})
    return buffer.getvalue()


def settle(figure: Figure) -> None:
    """Lay a figure out for good: drawing it again changes nothing."""
    engine = figure.get_layout_engine()
    if engine is not None:
        if figure.axes:
            engine.execute(figure)
        figure.set_layout_engine("none")


def as_pdf(figure: Figure, about: Mapping[str, str] | None = None) -> bytes:
    """A figure as PDF without a date; ``about`` is written to its metadata."""
    buffer = io.BytesIO()
    with house_style():
        settle(figure)
        FigureCanvasPdf(figure).print_pdf(buffer, metadata={"CreationDate": None, **(about or {})})
    return buffer.getvalue()


@contextmanager
def page(width_mm: float = PAGE_MM, editable_text: bool = False) -> Iterator[None]:
    """Figures are drawn ``width_mm`` wide within, letters in their usual size; text stays text if ``editable_text``."""
    token = _PAGE.set((width_mm, editable_text))
    try:
        yield
    finally:
        _PAGE.reset(token)


def page_mm() -> float:
    """How wide a page is here."""
    return _PAGE.get()[0]


def across(panels: int) -> int:
    """How many of these panels stand side by side on the page."""
    return max(1, min(panels, int(page_mm() // LEAST_PANEL_MM)))


@contextmanager
def house_style() -> Iterator[None]:
    """The style sheet for drawing and for rendering; matplotlib's own settings return afterwards."""
    text = {"svg.fonttype": "none", "pdf.fonttype": 42} if _PAGE.get()[1] else {}
    with as_file(files("tribo.figures") / "tribo.mplstyle") as sheet, style.context(["default", sheet, text]):
        yield


def in_house_style(draw: Callable[P, R]) -> Callable[P, R]:
    """Decorate a draw function so that it draws in the house style."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
        with house_style():
            return draw(*args, **kwargs)

    return drawn


def page_figure(height_mm: float, fixed: bool = False) -> PageFigure:
    """An empty figure as wide as the page; ``fixed`` leaves axes where they are put."""
    figure = PageFigure(figsize=(page_mm() / MM_PER_INCH, height_mm / MM_PER_INCH), layout="constrained")
    if fixed:
        figure.set_layout_engine("none")
    return figure


def panel_grid(
    n_panels: int, panel_height_mm: float, columns: int | None = None, **subplots: Any
) -> tuple[Figure, list[Axes]]:
    """A figure as wide as the page with ``n_panels`` axes in reading order; places left over stay empty."""
    columns = across(columns or {0: 1, 1: 1, 2: 2, 3: 3, 4: 2}.get(n_panels, 3 if n_panels <= 9 else 4))
    rows = -(-n_panels // columns)
    legend_mm = 12.0
    figure = page_figure(rows * panel_height_mm + legend_mm)
    axes = list(figure.subplots(rows, columns, squeeze=False, **subplots).flat)
    for empty in axes[n_panels:]:
        empty.remove()
    return figure, axes[:n_panels]


def panel_title(ax: Axes, name: str, detail: str = "") -> None:
    """The name in bold at the left of a panel's head; what belongs to it in plain type at the right, or below it."""
    # letters of DejaVu Sans bold are 0.7 of their size wide in the mean
    text_mm = 0.7 * MM_PER_INCH / 72 * (len(name) * 8.0 + len(detail) * DETAIL_POINTS)
    ax.set_title(name, loc="left", pad=None if text_mm < _width_mm(ax) else DETAIL_POINTS + 6)
    if text_mm < _width_mm(ax):
        ax.set_title(detail, loc="right", fontweight="normal", fontsize=DETAIL_POINTS)
    else:
        ax.annotate(detail, (1, 1), (0, 4), xycoords="axes fraction", textcoords="offset points", ha="right",
                    fontsize=DETAIL_POINTS)  # fmt: skip


def _width_mm(ax: Axes) -> float:
    """About how wide a panel is: its share of the page without the labels at its left; or its own width if fixed."""
    figure, spec = ax.get_figure(root=True), ax.get_subplotspec()
    page = figure.get_size_inches()[0] * MM_PER_INCH if figure is not None else page_mm()
    if spec is None or (figure is not None and figure.get_layout_engine() is None):
        return float(page * ax.get_position().width)
    return float(page / spec.get_gridspec().ncols) - LABELS_MM


def by_sample(numbers: pd.DataFrame) -> list[tuple[int, pd.DataFrame]]:
    """The numbers of each sample with its place in the campaign, in that order."""
    return [(int(str(number)), part) for number, part in numbers.groupby("sample_number")]


def is_leftmost(ax: Axes) -> bool:
    """True for the first panel of a row."""
    spec = ax.get_subplotspec()
    return spec is not None and spec.is_first_col()


def sample_panels(
    numbers: pd.DataFrame, height_mm: float, x_label: str, y_label: str, **subplots: Any
) -> tuple[Figure, list[tuple[Axes, pd.DataFrame]]]:
    """A figure with one panel per sample, each with its numbers; the axis of y is named at the first of every row."""
    groups = by_sample(numbers)
    figure, axes = panel_grid(len(groups), height_mm, **subplots)
    for ax in axes:
        ax.set_xlabel(x_label)
        ax.tick_params(labelbottom=True)
        if is_leftmost(ax):
            ax.set_ylabel(y_label)
    return figure, [(ax, sample) for ax, (_, sample) in zip(axes, groups, strict=True)]


def sample_handles(numbers: pd.DataFrame, **look: Any) -> list[Any]:
    """A handle for every sample, in the order of the campaign, in its colour and marker unless ``look`` differs."""
    found = numbers.dropna(subset="sample_number").drop_duplicates("sample_number").sort_values("sample_number")
    handles = []
    for number, name in zip(found["sample_number"], found["sample"], strict=True):
        colour, marker = sample_mark(int(number))
        handles.append(Line2D([], [], **{"color": colour, "marker": marker, "label": str(name), **look}))
    return handles


def error_bars(points: pd.DataFrame, value: str, low: str, high: str) -> np.ndarray:
    """Lengths of the bars below and above each value, (2, n)."""
    return np.abs(points[[low, high]].to_numpy(float) - points[[value]].to_numpy(float)).T


def moved_aside(ax: Axes, points: float) -> Transform:
    """Data coordinates shifted right on paper by so many points, for marks that would hide each other."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    return ax.transData + ScaledTranslation(points / 72, 0, figure.dpi_scale_trans)


def cover(ax: Axes, x: Any, low: Any, high: Any) -> None:
    """Let the axes reach over points that autoscaling does not see because they are moved aside on paper."""
    points = [(a, b) for a, b in zip([*x, *x], [*low, *high], strict=True) if np.isfinite(a) and np.isfinite(b)]
    if points:
        ax.update_datalim(points)
        ax.autoscale_view()


def plain_log_axis(axis: Axis, values: Any) -> None:
    """Plain numbers on a logarithmic axis: 1, 2 and 5 of each decade, or the values themselves where few."""
    distinct = np.unique([float(f"{v:.2g}") for v in values])
    few = len(distinct) <= 6 and (len(distinct) < 2 or np.diff(np.log10(distinct)).min() > 0.12)
    plain_ticks(axis, distinct.tolist() if few else ())


def plain_ticks(axis: Axis, values: Sequence[float] = ()) -> None:
    """Plain numbers at these values of an axis and nowhere else; without any, at 1, 2 and 5 of each decade."""
    axis.set_major_locator(FixedLocator(values) if len(values) else LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def as_table(ax: Axes) -> None:
    """Cells without grid, ticks and frame."""
    ax.grid(visible=False)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)


def legend_below(figure: Figure, handles: list[Any], columns: int = 6) -> None:
    """One legend for all panels, outside them at the foot, in up to so many columns as the page is wide enough for."""
    if handles:
        labels = [str(handle.get_label()) for handle in handles]
        fitting = _columns_that_fit(labels, min(columns, len(handles)), 72 * figure.get_figwidth())
        if page_mm() < PAGE_MM:  # the legend takes more rows than the page was made for
            rows = -(-len(handles) // fitting)
            figure.set_figheight(figure.get_figheight() + max(0, rows - 2) * LEGEND_ROW_MM / MM_PER_INCH)
        figure.legend(handles=handles, loc="outside lower center", ncols=fitting)


def _columns_that_fit(labels: list[str], most: int, width_points: float) -> int:
    """The most columns, each as wide as its longest label, its handle and the gaps beside it; the first are filled."""
    size = float(rcParams["legend.fontsize"])
    ems = rcParams["legend.handlelength"] + rcParams["legend.handletextpad"] + rcParams["legend.columnspacing"]
    gaps = size * float(ems)
    widths = [TextPath((0, 0), text, size=size).get_extents().width + gaps if text else gaps for text in labels]
    for columns in range(most, 1, -1):
        if sum(max(part) for part in np.array_split(widths, columns)) < width_points:
            return columns
    return 1


Of = TypeVar("Of")


@displayed()
@dataclass(frozen=True)
class FigureOf(Generic[Of]):
    """One figure of a record of type ``Of``.

    ``numbers(record)`` gives exactly what is plotted, one row per point, units in the column names; an empty
    frame where the record lacks what the figure needs. ``draw(numbers)`` has no other input, so a table
    written from the numbers holds exactly what the figure shows.
    """

    name: str
    title: str
    caption: str
    numbers: Callable[[Of], pd.DataFrame]
    draw: Callable[[pd.DataFrame], Figure]


StudyFigure = FigureOf[Study]
