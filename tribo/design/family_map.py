"""A family of patterns as a chart: static and sliding friction against two of its lengths."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from tribo.design.rounds import MESHES, Lengths, Rounds, Say, tried
from tribo.springblock.config import SimConfig

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
