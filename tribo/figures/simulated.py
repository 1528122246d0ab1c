"""Fig. 5 of Berardo et al. (2019): the model and its patterns, and its friction coefficient against time."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tribo.comparison import findings
from tribo.figures import style
from tribo.figures.one_pull import thin_trace
from tribo.records import FloatArray, Run, Study
from tribo.user_text import plain
from tribo.wording.numerals import true_minus

PATTERN_COLUMNS = [
    "cavity", "size_x_um", "size_y_um", "pitch_x_um", "pitch_y_um", "staggered", "domain_x_um", "domain_y_um",
    "area_fraction",
]  # fmt: skip
CAVITY_COLOUR = "0.60"
BLOCK, GAP = 0.46, 1.0  # side of a block and distance of two blocks in the schematics
TEETH = 5  # of a drawn spring


def pattern_row(run: Run) -> dict[str, Any]:
    """The pattern of a run and the part of the sample that is simulated, lengths in micrometres."""
    given = run.parameters
    cavity = str(given.get("cavity", "none"))
    size, pitch = given.get("cavity_size_m"), given.get("cavity_pitch_m")
    size, pitch = (_micrometres(pair) if cavity != "none" and pair else (np.nan, np.nan) for pair in (size, pitch))
    domain = _micrometres([n * given.get("spacing_m", np.nan) for n in given.get("blocks", (np.nan, np.nan))])
    staggered, fraction = bool(given.get("cavity_staggered", False)), float(given.get("area_fraction", np.nan))
    return dict(zip(PATTERN_COLUMNS, (cavity, *size, *pitch, staggered, *domain, fraction), strict=True))


def _micrometres(lengths_m: Any) -> tuple[float, float]:
    x, y = (float(f"{1e6 * float(v):.6g}") for v in lengths_m)
    return x, y


def draw_pattern(ax: Axes, pattern: pd.Series, name: str, angle_deg: float) -> None:
    """The simulated part of a sample at scale: cavities grey, an arrow along the pull."""
    width, height = float(pattern["domain_x_um"]), float(pattern["domain_y_um"])
    width, height = (w if np.isfinite(w) else 1.0 for w in (width, height))
    ax.set_xlim(0, width)
    ax.set_ylim(0, height)
    if pattern["cavity"] not in ("none", ""):
        _add_cavities(ax, pattern, width, height)
    middle, reach = np.array([width, height]) / 2, 0.33 * min(width, height)
    step = reach * np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])
    _arrow(ax, middle - step, middle + step)
    _as_drawing(ax)
    ax.spines[:].set_visible(True)
    ax.spines[:].set_linewidth(0.6)
    fraction = float(pattern["area_fraction"])
    style.panel_title(ax, name, f"AF = {fraction:.2f}" if np.isfinite(fraction) else "")


def _add_cavities(ax: Axes, pattern: pd.Series, width: float, height: float) -> None:
    size = np.array([pattern["size_x_um"], pattern["size_y_um"]], float)
    centres = _centres(pattern, width, height)
    if pattern["cavity"] == "circle":  # as marks, which an SVG holds once; the panel keeps its size on paper
        figure = ax.get_figure(root=True)
        assert figure is not None
        points = 72 * figure.get_size_inches()[0] * ax.get_position().width / width
        ax.plot(*centres.T, "o", ms=float(points * size.mean()), color=CAVITY_COLOUR, mew=0)
        return
    corners = 0.5 * size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    rectangles = PolyCollection(centres[:, None, :] + corners, facecolors=CAVITY_COLOUR, edgecolors="none")
    ax.add_collection(rectangles, autolim=False)


def _centres(pattern: pd.Series, width: float, height: float) -> FloatArray:
    """Centres of all cavities (n, 2) that reach into the drawn part; every other row is shifted if staggered."""
    px, py = float(pattern["pitch_x_um"]), float(pattern["pitch_y_um"])
    rows = np.arange(-1, int(height / py) + 2)
    columns = np.arange(-1, int(width / px) + 2)
    x, y = np.meshgrid((columns + 0.5) * px, (rows + 0.5) * py)
    if pattern["staggered"]:
        x = x + 0.5 * px * (rows[:, None] % 2)
    return np.column_stack([x.ravel(), y.ravel()])


def draw_mesh(ax: Axes) -> None:
    """Blocks on a square lattice, each joined by springs to its eight neighbours."""
    nx, ny = 4, 3
    springs: list[FloatArray] = []
    links: list[FloatArray] = []
    for x in range(nx):
        for y in range(ny):
            here = np.array([x, y]) * GAP
            for step, found in (((1, 0), springs), ((0, 1), springs), ((1, 1), links), ((1, -1), links)):
                if 0 <= x + step[0] < nx and 0 <= y + step[1] < ny:
                    there = here + GAP * np.array(step)
                    found.append(_spring(here, there) if found is springs else np.array([here, there]))
    ax.add_collection(LineCollection(links, colors="0.45", linewidths=0.5), autolim=False)
    ax.add_collection(LineCollection(springs, colors="black", linewidths=0.7), autolim=False)
    _add_blocks(ax, [(x * GAP, y * GAP) for x in range(nx) for y in range(ny)], "0.70")
    right = (nx - 1) * GAP + 0.5
    ax.text(right, 1.5 * GAP, "springs of stiffness $K_{int}$,\nalong the diagonals half of it", va="center",
            fontsize=7, parse_math=True)  # fmt: skip
    ax.text(right, 0.35 * GAP, "block: its friction\ndrawn at random", va="center", fontsize=7)
    ax.set_xlim(-0.4, right + 4.4)
    ax.set_ylim(-0.4, (ny - 1) * GAP + 0.4)
    _as_drawing(ax)
    ax.set_title("Mesh, from above", loc="left")


def draw_side_view(ax: Axes) -> None:
    """The slider at constant velocity pulls every block by a spring; a block over a cavity touches nothing."""
    n, lid = 6, 1.75
    over_cavity = (2, 3)
    places = [(x * GAP, 0.32 if x in over_cavity else 0.0) for x in range(n)]
    slanted = [_spring(np.array([x, y + BLOCK / 2]), np.array([x + 0.55, lid])) for x, y in places]
    between = [_spring(np.array(a), np.array(b)) for a, b in pairwise(places)]
    ax.add_collection(LineCollection([*slanted, *between], colors="black", linewidths=0.7), autolim=False)
    _add_blocks(ax, [p for k, p in enumerate(places) if k not in over_cavity], "0.70")
    _add_blocks(ax, [places[k] for k in over_cavity], "white")
    ax.fill_between([-0.6, n * GAP + 0.2], lid, lid + 0.34, color="0.70", lw=0)
    ax.plot([-0.6, n * GAP - 0.3], [-BLOCK / 2, -BLOCK / 2], color="black", lw=1.2)
    _arrow(ax, np.array([n * GAP + 0.3, lid + 0.17]), np.array([n * GAP + 1.4, lid + 0.17]))
    ax.text(n * GAP + 1.5, lid + 0.17, "slider, speed v", va="center", fontsize=7)
    ax.text(n * GAP - 0.1, 0.95, "shear springs, stiffness $K_s$", va="center", fontsize=7, parse_math=True)
    ax.text(n * GAP - 0.1, 0.05, "blocks in contact carry\nthe normal force", va="center", fontsize=7)
    ax.text(2.5 * GAP, -0.34, "cavity", ha="center", va="top", fontsize=7)
    ax.set_xlim(-0.7, n * GAP + 5.0)
    ax.set_ylim(-0.85, lid + 0.45)
    _as_drawing(ax)
    ax.set_title("Side view, not to scale", loc="left")


def _arrow(ax: Axes, start: FloatArray, end: FloatArray) -> None:
    ax.annotate("", tuple(end), tuple(start), arrowprops={"arrowstyle": "-|>", "color": style.VERMILLION, "lw": 1.4})


def _add_blocks(ax: Axes, centres: list[tuple[float, float]], colour: str) -> None:
    corners = 0.5 * BLOCK * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    squares = np.array(centres)[:, None, :] + corners
    blocks = PolyCollection(list(squares), facecolors=colour, edgecolors="black", linewidths=0.7, zorder=3)
    ax.add_collection(blocks, autolim=False)


def _spring(start: FloatArray, end: FloatArray) -> FloatArray:
    """A zigzag between two points, straight at its ends (k, 2)."""
    along = np.r_[0.0, 0.28, np.linspace(0.32, 0.68, 2 * TEETH - 1), 0.72, 1.0]
    across = np.r_[0.0, 0.0, np.where(np.arange(2 * TEETH - 1) % 2, 1.0, -1.0), 0.0, 0.0] * 0.07
    step = end - start
    normal = np.array([-step[1], step[0]]) / np.hypot(*step)
    return np.asarray(start + along[:, None] * step + across[:, None] * normal)


def _as_drawing(ax: Axes) -> None:
    """No axes, ticks or grid; one length is the same along both."""
    ax.set_aspect("equal", anchor="W")
    ax.set_xticks([])
    ax.set_yticks([])
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)


RUNS_COLUMNS = [
    "sample_number", "sample", "pressure_kPa", "angle_deg", "seed", "mark", "time_ms", "T_over_N",
    *PATTERN_COLUMNS,
]  # fmt: skip
MODEL_MM, PATTERN_MM, TRACES_MM, HEAD_MM, FOOT_MM, LEGEND_ROW_MM = 31.0, 36.5, 80.0, 8.5, 12.0, 4.4
PATTERNS_ACROSS, SIDE_MM, LEGEND_COLUMNS = 6, 27.0, 6


def runs_numbers(study: Study) -> pd.DataFrame:
    """T/N against time (ms) of the example runs, thinned for the page, with peak, sliding window and pattern."""
    order = findings.sample_numbers(study)
    first_runs = {run.sample: run for run in reversed(study.example_runs)}
    known = sorted(first_runs, key=lambda s: order.get(s, len(order)))
    frames = [run_numbers(first_runs[s], order.get(s, len(order) + k)) for k, s in enumerate(known)]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=RUNS_COLUMNS)


def run_numbers(run: Run, number: int = 0) -> pd.DataFrame:
    """The numbers of one run, drawn as sample ``number`` of the campaign."""
    time_s, ratio = thin_trace(run.time_s, run.force_N / run.normal_load_N)
    marks: list[dict[str, Any]] = [{"mark": "pattern", **pattern_row(run)}]
    points = [("trace", t, f) for t, f in zip(time_s, ratio, strict=True)]
    points.append(("peak", run.peak_s, run.static_friction))
    points += [("window", t, run.sliding_friction) for t in run.window_s]
    marks += [{"mark": mark, "time_ms": t * 1e3, "T_over_N": f} for mark, t, f in points]
    about = {"pressure_kPa": run.pressure_Pa / 1e3, "angle_deg": run.angle_deg, "seed": run.seed}
    return pd.DataFrame(marks).assign(sample_number=number, sample=run.sample, **about)[RUNS_COLUMNS]


@style.in_house_style
def draw_runs(numbers: pd.DataFrame) -> Figure:
    """The model, the patterns, and all samples in one panel: peak and sliding mean carry the sample's marker."""
    runs = style.by_sample(numbers)
    wide = style.page_mm() >= style.PAGE_MM
    across = PATTERNS_ACROSS if wide else max(1, int((style.page_mm() - 9.0) // 30.3))
    legend_columns = LEGEND_COLUMNS if wide else across
    model_mm = MODEL_MM if wide else 2 * MODEL_MM
    rows, legend_rows = -(-len(runs) // across), -(-len(runs) // legend_columns)
    height = model_mm + rows * PATTERN_MM + TRACES_MM + FOOT_MM + LEGEND_ROW_MM * legend_rows
    figure = style.page_figure(height, fixed=True)
    draw_mesh(_axes(figure, 0, 5, min(84, style.page_mm()), MODEL_MM - 6))
    left, top = (88.0, 5.0) if wide else (0.0, 5.0 + MODEL_MM)
    draw_side_view(_axes(figure, left, top, min(102, style.page_mm()), MODEL_MM - 6))
    for k, (_, run) in enumerate(runs):
        row, column = divmod(k, across)
        pattern = run[run["mark"] == "pattern"].iloc[0]
        left, top = 9.0 + 30.3 * column, model_mm + row * PATTERN_MM + HEAD_MM
        ax = _axes(figure, left, top, SIDE_MM, SIDE_MM)
        draw_pattern(ax, pattern, str(pattern["sample"]), float(pattern["angle_deg"]))
        if k == 0 and np.isfinite(pattern["domain_x_um"]):
            ax.set_ylabel(f"{pattern['domain_y_um']:.4g} µm", fontsize=7)
    top = model_mm + rows * PATTERN_MM + HEAD_MM
    traces = _axes(figure, 13, top, style.page_mm() - 15, TRACES_MM - HEAD_MM)
    handles = _draw_traces(traces, runs, numbers)
    figure.legend(handles=handles, loc="lower center", ncols=legend_columns)
    return figure


def _axes(figure: Figure, left_mm: float, top_mm: float, width_mm: float, height_mm: float) -> Axes:
    """Axes at a place on paper, counted from the top left."""
    width, height = figure.get_size_inches() * style.MM_PER_INCH
    return figure.add_axes(
        (left_mm / width, 1 - (top_mm + height_mm) / height, width_mm / width, height_mm / height)
    )


def _draw_traces(ax: Axes, runs: list[tuple[int, pd.DataFrame]], numbers: pd.DataFrame) -> list[Any]:
    handles = []
    for number, run in runs:
        colour, marker = style.sample_mark(number)
        angle = true_minus(f"{run['angle_deg'].iloc[0]:.3g}°")
        trace, peak, window = (run[run["mark"] == m] for m in ("trace", "peak", "window"))
        ax.plot(trace["time_ms"], trace["T_over_N"], color=colour, lw=0.8, label=f"{run['sample'].iloc[0]}")
        ax.plot(peak["time_ms"], peak["T_over_N"], marker, color=colour, ms=5)
        handles += ax.plot(
            window["time_ms"], window["T_over_N"], ls=":", marker=marker, mfc="white", color=colour,
            label=f"{run['sample'].iloc[0]} ({angle})",
        )  # fmt: skip
    pressures = " and ".join(f"{p:.3g}" for p in sorted(numbers["pressure_kPa"].unique()))
    style.panel_title(ax, "Simulated friction", f"p = {pressures} kPa, pull angle in the legend")
    ax.set_xlabel("Time (ms)")
    ax.set_ylabel("Simulated T / N")
    ax.set_ylim(bottom=0)
    ax.set_xlim(left=0)
    return handles


SIMULATED_PULLS = style.StudyFigure(
    "fig5",
    "Model, patterns and simulated friction",
    "Top: the spring-block model. Blocks on a square lattice are joined by springs to their eight neighbours "
    "and by shear springs to a slider that moves at a constant speed. Middle: the simulated part of each "
    "sample at scale, cavities grey, with the direction of the pull. Bottom: friction force divided by load in "
    "one run for each sample. Filled marker: static peak. Dotted line: mean over the sliding window.",
    runs_numbers,
    draw_runs,
)

COMPARED_COLUMNS = [
    "sample_number", "sample", "test_id", "normal_load_N", "source", "way_mm", "force_N", "rise_N_per_mm", "drop_N",
    "decay_um",
]  # fmt: skip
COMPARED = {  # column: (feature, factor, words)
    "rise_N_per_mm": ("rise_stiffness_N_per_m", 1e-3, "rise {} / {} N/mm"),
    "drop_N": ("static_drop_N", 1.0, "drop {} / {} N"),
    "decay_um": ("decay_length_um", 1.0, "decay {} / {} µm"),
}
_BEFORE, _AFTER = 0.15, 3.0  # of the way from onset to peak: how much is drawn before the rise, and after the peak


def compared_numbers(study: Study) -> pd.DataFrame:
    """Force (N) over the way of the drive (mm) from the onset of the rise: a pull and the run beside it."""
    ingested, order = study.ingested, findings.sample_numbers(study)
    tests = {test.test_id: test for test in ingested.campaign.tests}
    frames = []
    for test_id, (run, read, features) in study.recorded_runs.items():
        test, pull = tests[test_id], ingested.pulls[test_id]
        speed = test.speed_m_s or np.nan  # a test without one has no run beside it
        both = {
            "measured": (ingested.traces[test_id], pull, ingested.features.get(test_id, {})),
            "simulated": (run, read, features),
        }
        rise_s = pull.peak_s - pull.onset_s
        for source, (trace, one, found) in both.items():
            since = trace.time_s - one.onset_s
            shown = (since > -_BEFORE * rise_s) & (since < (1.0 + _AFTER) * rise_s)
            way, force = thin_trace(1e3 * speed * since[shown], trace.force_N[shown] - one.zero_N, 600)
            values = {
                column: factor * found[name].value if name in found else np.nan
                for column, (name, factor, _) in COMPARED.items()
            }
            about: dict[str, Any] = {"sample": test.sample, "test_id": test_id, "source": source}
            frame = pd.DataFrame({"way_mm": way, "force_N": force})
            about |= {"sample_number": order.get(test.sample, 0), "normal_load_N": test.normal_load_N, **values}
            frames.append(frame.assign(**about)[COMPARED_COLUMNS])
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=COMPARED_COLUMNS)


@style.in_house_style
def draw_compared(numbers: pd.DataFrame) -> Figure:
    """One panel per sample: the measured trace, the simulated one, and in numbers what differs."""
    figure, panels = style.sample_panels(numbers, 52, "Displacement (mm)", "Friction force T (N)")
    for ax, rows in panels:
        measured, simulated = (rows[rows["source"] == source] for source in ("measured", "simulated"))
        ax.plot(measured["way_mm"], measured["force_N"], color=style.BLUE, lw=0.9)
        ax.plot(simulated["way_mm"], simulated["force_N"], color=style.VERMILLION, lw=0.9)
        first, second = measured.iloc[0], simulated.iloc[0]
        said = [
            words.format(*(f"{row[column]:.3g}" if np.isfinite(row[column]) else "–" for row in (first, second)))
            for column, (_, _, words) in COMPARED.items()
        ]
        ax.text(0.98, 0.96, "\n".join(said), transform=ax.transAxes, ha="right", va="top", fontsize="x-small")
        ax.set_ylim(top=1.25 * float(rows["force_N"].max()))
        style.panel_title(ax, first["sample"], f"N = {plain(first['normal_load_N'])} N, test {first['test_id']}")
    style.legend_below(
        figure,
        [
            Line2D([], [], color=style.BLUE, lw=0.9, label="measured, zero subtracted"),
            Line2D([], [], color=style.VERMILLION, lw=0.9, label="model, as the machine would record it"),
        ],
    )
    return figure


COMPARED_TRACES = style.StudyFigure(
    "traces",
    "Measured and simulated traces",
    "Friction force over the way of the drive, aligned at the onset of the rise: a typical pull of each sample and the "
    "model, calibrated on the flat sample, as the machine of the campaign would record it, with its stiffness, speed, "
    "rate and noise. After the short run of the model its mean sliding force goes on. In numbers, measured / "
    "simulated: slope of the rise, drop from static peak to sliding, length of the decay after the peak; – where it "
    "is not resolved.",
    compared_numbers,
    draw_compared,
)
