"""What a design leaves behind: designs.csv, answer.json, a page, and for each design its masks and its campaign; and a
family of patterns as a chart of friction against two of its lengths."""

from __future__ import annotations

import base64
import csv
import html
import io
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from tribo.design.answer import NINETY, Answer, Outcome, Prediction
from tribo.design.rounds import MESHES, Lengths, Rounds, Say, tried
from tribo.design.target import Space, Target
from tribo.files import bytes_of, write_bytes
from tribo.records import FloatArray, Pattern
from tribo.springblock.config import SimConfig
from tribo.springblock.lattice import distance_of
from tribo.temporary import temporary_folder

CORNERS = 96  # of a circle: its area is within 0.1 % of the true one
PNG_PIXELS = 800
_UM = 1e-6


def repeat_um(pattern: Pattern) -> tuple[float, float]:
    """Width and height of one repeat, two rows of a staggered lattice."""
    assert pattern.pitch_m is not None
    px, py = pattern.pitch_m
    return px / _UM, (2 if pattern.staggered else 1) * py / _UM


def polygons_um(pattern: Pattern) -> list[FloatArray]:
    """The shapes of one repeat, each (corners, 2); those of a staggered row may reach beyond its side."""
    assert pattern.size_m is not None
    assert pattern.pitch_m is not None
    (a, b), (px, py) = 0.5 * np.array(pattern.size_m) / _UM, np.array(pattern.pitch_m) / _UM
    if pattern.cavity == "ridge":
        return [np.array([(px / 2 - a, 0), (px / 2 + a, 0), (px / 2 + a, py), (px / 2 - a, py)])]
    if pattern.cavity == "chevron":
        tips = [(2 * b, 0.0), (0.0, py / 2), (2 * b, py)]
        return [np.array([(px / 2 - a + x, y) for x, y in tips] + [(px / 2 + a + x, y) for x, y in tips[::-1]])]
    if pattern.cavity in ("circle", "ellipse"):
        turn = 2 * np.pi * (np.arange(CORNERS) + 0.5) / CORNERS
        one = np.column_stack([a * np.cos(turn), b * np.sin(turn)])
    else:
        one = np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    centres = [(px / 2, py / 2), (px, 1.5 * py)][: 2 if pattern.staggered else 1]
    return [one + centre for centre in centres]


def svg(pattern: Pattern, side_um: float = 400.0) -> str:
    """A square of the mask in um; black shapes are cavities, or what touches where the feature is a pillar."""
    width, height = repeat_um(pattern)
    paths = " ".join(
        "M" + " L".join(f"{x:.4f} {y:.4f}" for x, y in shape) + " Z"
        for polygon in polygons_um(pattern)
        for shape in (polygon, polygon - [width, 0])
        if shape[:, 0].max() > 0
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{side_um:g}um" height="{side_um:g}um" '
        f'viewBox="0 0 {side_um:g} {side_um:g}"><defs><pattern id="p" width="{width:.6f}" height="{height:.6f}" '
        f'patternUnits="userSpaceOnUse"><path d="{paths}"/></pattern></defs>'
        f'<rect width="{side_um:g}" height="{side_um:g}" fill="url(#p)"/></svg>\n'
    )


def png(pattern: Pattern, side_um: float = 200.0) -> bytes:
    """A square of the mask, black and white; white touches."""
    from matplotlib.image import imsave

    middle = (np.arange(PNG_PIXELS) + 0.5) * side_um * _UM / PNG_PIXELS
    within = distance_of(pattern)(middle[None, :], middle[:, None]) < 0.0
    data = io.BytesIO()
    imsave(data, within == (pattern.feature == "pillar"), cmap="gray", vmin=0, vmax=1, format="png", origin="lower")
    return data.getvalue()


def gds(pattern: Pattern, side_mm: float) -> bytes | None:
    """The whole mask as GDSII in um, layer 1 the shapes; None without the optional gdstk."""
    if find_spec("gdstk") is None:
        return None
    gdstk = import_module("gdstk")
    width, height = repeat_um(pattern)
    library = gdstk.Library(unit=1e-6, precision=1e-9)
    cell, top = library.new_cell("REPEAT"), library.new_cell("MASK")
    for polygon in polygons_um(pattern):
        cell.add(gdstk.Polygon([tuple(corner) for corner in polygon], layer=1))
    across, along = (max(1, int(1e3 * side_mm / length)) for length in (width, height))
    top.add(gdstk.Reference(cell, columns=across, rows=along, spacing=(width, height)))
    with temporary_folder() as folder:
        library.write_gds(folder / "mask.gds")
        return bytes_of(folder / "mask.gds")


REPEATS, SPECIMENS = 4, 3
SCATTER = 0.08  # of ln T from specimen to specimen, for the power that is stated
MODEL = (
    "The model contains dry friction of a flat surface with cavities: loads, directions, patterns. It does not contain "
    "heights of asperities, indentation, wetting, films over a pattern, or suction."
)


def write_answer(outcome: Outcome, spaces: Sequence[Space], target: Target, out: Path) -> list[Path]:
    """Write everything into OUT; the paths, best design first."""
    files: dict[str, str | bytes] = {
        "designs.csv": designs_csv(outcome.answers),
        "answer.json": json.dumps(asdict(outcome), indent=1) + "\n",
    }
    pictures = []
    for a in outcome.answers:
        pattern = spaces[a.space].pattern(a.lengths_um)
        folder = f"design-{a.rank}"
        pictures.append(png(pattern))
        files |= {f"{folder}/mask.svg": svg(pattern), f"{folder}/mask.png": pictures[-1]}
        whole = gds(pattern, math.sqrt(target.nominal_area_mm2))
        if whole is not None:
            files[f"{folder}/mask.gds"] = whole
        files |= {f"{folder}/campaign/{name}": text for name, text in campaign_of(a, spaces[a.space], target).items()}
    files["design.html"] = page(outcome, target, pictures)
    for name, content in files.items():
        path = out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content if isinstance(content, bytes) else content.encode())
    return [out / name for name in files]


def designs_csv(answers: Sequence[Answer]) -> str:
    """One row a design and wanted quantity."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(
        ["rank", "lengths_um", "area_fraction", "want", "goal", "value", "low_90", "high_90", "met", "off_percent"]
    )
    for a in answers:
        lengths = " ".join(f"{k}={v:g}" for k, v in a.lengths_um.items())
        for p in a.predictions:
            numbers = [f"{v:.5g}" for v in (p.value, p.low, p.high)]
            area, off = f"{a.area_fraction:.4f}", f"{p.off_percent:.2f}"
            rows.writerow([a.rank, lengths, area, p.want, p.goal, *numbers, p.met, off])
    return text.getvalue()


def campaign_of(a: Answer, space: Space, target: Target) -> dict[str, str]:
    """campaign.toml and tests.csv of the measurement that would disprove a design: its pattern beside a flat sample."""
    f = space.family
    u = a.lengths_um
    keys = [f'cavity = "{f.cavity}"', f'feature = "{f.feature}"', f'lattice = "{f.lattice}"']
    if f.cavity == "circle":
        keys.append(f"diameter_um = {u['diameter_um']:g}")
    elif "size_y_um" in u:
        keys.append(f"size_um = [{u['size_x_um']:g}, {u['size_y_um']:g}]")
    else:
        keys.append(f"size_um = {u['size_x_um']:g}")
    pitch = f"{u['pitch_um']:g}" if "pitch_um" in u else f"[{u['pitch_x_um']:g}, {u['pitch_y_um']:g}]"
    keys.append(f"pitch_um = {pitch}")
    power = power_of(a.predictions)
    toml = (
        f"# The measurement that would disprove this design. {power}\n[campaign]\ntitle = {json.dumps(target.title)}\n"
        'material = "as in the target"\ncounterface = "as in the target"\n'
        f"nominal_area_mm2 = {target.nominal_area_mm2:g}\nslider_mass_g = 0\npull_speed_mm_s = 0.2\n\n"
        '[patterns.F]\ncavity = "none"\n\n[patterns.P]\n' + "\n".join(keys) + "\n"
    )
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["test_id", "file", "sample", "specimen", "normal_load_N", "repeat"])
    directions = {d for w in target.target for d in (w.direction, w.over) if d}
    samples = ["F", *("P" if d == "all" else f"P{d}" for d in sorted(directions))]
    wanted_N = {1e-6 * target.nominal_area_mm2 * target.pressure_Pa(w) for w in target.target}
    loads = sorted({load * k for load in wanted_N for k in (0.5, 1.0, 2.0)})
    tests = [(s, n, load, r) for r in range(REPEATS) for n in range(SPECIMENS) for load in loads for s in samples]
    for k, (sample, specimen, load, repeat) in enumerate(tests, start=1):
        name = f"T{k:03d}"
        rows.writerow([name, f"raw/{name}.csv", sample, f"{sample[0]}{specimen + 1}", f"{load:.6g}", repeat + 1])
    return {"campaign.toml": toml, "tests.csv": text.getvalue()}


def power_of(predictions: Sequence[Prediction]) -> str:
    """How sure the measurement is to show that a friction outside the interval is outside it."""
    p = predictions[0]
    half = 0.5 * math.log(p.high / p.low)
    error = SCATTER * math.sqrt(2 / SPECIMENS)
    shown = 0.5 * (1 + math.erf((half - NINETY * error) / (error * math.sqrt(2))))
    return (
        f"With {SPECIMENS} specimens of each sample, {REPEATS} pulls at a load, and {100 * SCATTER:.0f} % scatter from "
        "specimen to specimen, a friction twice as far from the prediction as its 90 % interval reaches is told in "
        f"{100 * shown:.0f} % of cases."
    )


def page(outcome: Outcome, target: Target, pictures: Sequence[bytes]) -> str:
    """One file that works offline."""
    parts = [f"<h1>{html.escape(target.title)}</h1>", f"<p>{MODEL}</p>"]
    if outcome.refusal:
        said = "".join(f"<li>{html.escape(line)}</li>" for line in outcome.refusal)
        parts.append(f"<h2>This cannot be had</h2><ul>{said}</ul><p>The designs below are the nearest that can.</p>")
    for a, picture in zip(outcome.answers, pictures, strict=True):
        lengths = ", ".join(f"{k.removesuffix('_um').replace('_', ' ')} {v:g} µm" for k, v in a.lengths_um.items())
        rows = "".join(
            f"<tr><td>{html.escape(p.want)}</td><td>{html.escape(p.goal)}</td><td>{p.value:.3g}</td>"
            f"<td>{p.low:.3g} to {p.high:.3g}</td>"
            + "".join(f"<td>{100 * p.parts[part]:.1f}</td>" for part in ("runs", "mesh", "model", "making"))
            + f"<td>{'yes' if p.met else f'no, {p.off_percent:.0f} % off'}</td></tr>"
            for p in a.predictions
        )
        parts.append(
            f"<h2>Design {a.rank}: {html.escape(target.pattern[a.space].cavity)}, {html.escape(lengths)}</h2>"
            f'<img alt="Mask of design {a.rank}, 200 um wide; white touches" width="240" '
            f'src="data:image/png;base64,{base64.b64encode(picture).decode()}">'
            f"<p>Contact area fraction {a.area_fraction:.3f}. What moves it most: {html.escape(a.moves_most)}.</p>"
            "<table border=1 cellpadding=4><tr><th>wanted</th><th>goal</th><th>predicted</th><th>90 % interval</th>"
            "<th>runs, %</th><th>mesh, %</th><th>model, %</th><th>making, %</th><th>met</th></tr>" + rows + "</table>"
            f"<p>{html.escape(power_of(a.predictions))}</p>"
        )
    if outcome.learnt:
        said = "".join(f"<li>{html.escape(line)}</li>" for line in outcome.learnt)
        parts.append(f"<h2>What earlier designs taught</h2><ul>{said}</ul>")
    parts += [f"<p>{html.escape(note)}.</p>" for note in outcome.notes]
    style = "<style>body{font:15px sans-serif;max-width:60em;margin:2em auto}table{border-collapse:collapse}</style>"
    return f'<!doctype html><meta charset="utf-8"><title>{html.escape(target.title)}</title>{style}' + "".join(parts)


RUNS = 2


def mapped(
    all_rounds: Rounds, vary: Sequence[str], points: int, base: SimConfig, say: Say
) -> list[dict[str, float | str]]:
    """One row a pattern of a grid of two lengths: T/N, or why it cannot be made."""
    (space,), wanted = all_rounds.spaces, all_rounds.wanted
    grid = [np.linspace(*space.free[name], points) for name in vary]
    fixed = space.lengths_um(np.full(len(space.free), 0.5))
    every: list[Lengths] = [fixed | {vary[0]: float(a), vary[1]: float(b)} for b in grid[1] for a in grid[0]]
    rounded = [space.lengths_um(space.at(lengths)[:-1]) for lengths in every]
    can = [lengths for lengths in rounded if not space.fault(lengths)]
    n, spacing, dt = MESHES["coarse"]
    config = base.with_(blocks=(n, n), spacing_m=spacing, thickness_m=base.layer_m, dt_s=dt, rest_tolerance=1e-2)
    pairs = [(0, lengths) for lengths in dict.fromkeys(map(_frozen, can))]
    known = tried(
        all_rounds, "map", [(k, dict(lengths)) for k, lengths in pairs], config, RUNS, all_rounds.seed,
        lambda done, total: say("mapping", done, total),
    ) if pairs else []  # fmt: skip
    found = {_frozen(t.lengths_um): t for t in known}
    rows: list[dict[str, float | str]] = []
    for lengths in rounded:
        row: dict[str, float | str] = dict(lengths)
        row["area_fraction"] = space.pattern(lengths).area_fraction
        made = found.get(_frozen(lengths))
        row["static"], row["sliding"] = [
            float("nan") if made is None else float(np.exp(made.logs[response])) for response in wanted
        ]
        row["fault"] = space.fault(lengths)
        rows.append(row)
    return rows


def _frozen(lengths: Lengths) -> tuple[tuple[str, float], ...]:
    return tuple(lengths.items())


def map_csv(rows: Sequence[dict[str, float | str]]) -> str:
    """The dataset of a map."""
    text = io.StringIO()
    out = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    out.writeheader()
    out.writerows({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)
    return text.getvalue()


def map_png(rows: Sequence[dict[str, float | str]], vary: Sequence[str], title: str) -> bytes:
    """Static and sliding T/N as contours; what cannot be made stays white."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    x, y = (np.unique([float(row[name]) for row in rows]) for name in vary)
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    for k, regime in enumerate(("static", "sliding")):
        values = np.full((len(y), len(x)), np.nan)
        for row in rows:
            at = (np.searchsorted(y, float(row[vary[1]])), np.searchsorted(x, float(row[vary[0]])))
            values[at] = float(row[regime])
        axes = figure.add_subplot(1, 2, k + 1)
        shown = axes.contourf(x, y, np.ma.masked_invalid(values), levels=12)
        lines = axes.contour(x, y, np.ma.masked_invalid(values), levels=shown.levels, colors="k", linewidths=0.4)
        axes.clabel(lines, fontsize=6)
        axes.set(xlabel=f"{vary[0].removesuffix('_um')}, µm", ylabel=f"{vary[1].removesuffix('_um')}, µm")
        axes.set_title(f"{regime} T/N, {title}", fontsize=9)
        figure.colorbar(shown, ax=axes)
    data = io.BytesIO()
    figure.savefig(data, dpi=150, format="png")
    return data.getvalue()
