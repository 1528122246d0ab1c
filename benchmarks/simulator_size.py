"""How friction depends on the number of blocks and on the mesh, which the paper asserts in a sentence each.

    python benchmarks/simulator_size.py blocks docs/data/simulator-blocks.csv
    python benchmarks/simulator_size.py mesh docs/data/simulator-mesh.csv
    python benchmarks/simulator_size.py domain docs/data/simulator-domain.csv
    python benchmarks/simulator_size.py figures docs/data docs/figures

``blocks``: flat samples of 10 to 1000 blocks a side against the expected minimum of n Gaussian numbers. ``mesh``: the
paper's domain and layer at l = 5 um with square cavities, at 2.5 um with the same squares and with round ones, eight
runs a point at 3 and at 25 kPa over the same angles. ``domain``: the same points on square domains of 170 and of 340
blocks a side at l = 5 um; those of 85 are the first rows of ``mesh``. What a file holds already is not computed again.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from tribo.springblock import PAPER, SimConfig, simulate, stratified_design
from tribo.springblock.calibration import expected_minimum

SIDES = {10: 40, 20: 40, 43: 40, 85: 40, 170: 20, 340: 12, 680: 6, 1000: 4}  # blocks a side: seeds
MESHES = ((5.0, "square"), (2.5, "square"), (2.5, "round"))
MESH_PRESSURES_PA = (3e3, 25e3)
MESH_RUNS = 8
DOMAINS = (170, 340)  # blocks a side
WINDOW_END = 1.5  # peak times


def blocks(known: pd.DataFrame) -> Iterator[dict[str, object]]:
    """One row a run: the coefficient of the peak without the adhesion term."""
    for n, seeds in SIDES.items():
        config = SimConfig(blocks=(n, n), duration_peaks=1.001, window_start_peaks=1.0005)
        adhesion = PAPER.static_adhesion_Pa / config.pressure_Pa
        for seed in range(seeds):
            if not holds(known, blocks_a_side=n, seed=seed):
                run = simulate(config.with_(seed=seed, angle_deg=90.0 * (seed + 0.5) / seeds))
                yield {"blocks_a_side": n, "seed": seed, "mu_static": run.static_friction - adhesion}


def mesh(known: pd.DataFrame) -> Iterator[dict[str, object]]:
    """One row a run."""
    for sample in ("B", "A", "F", "C", "Sx", "Sy"):
        for spacing_um, shape in MESHES:
            if shape == "round" and sample in ("F", "A", "Sx", "Sy"):
                continue  # nothing round, or two blocks across, which is the square again
            n = round(425 / spacing_um)
            base = SimConfig(
                blocks=(n, n), spacing_m=spacing_um * 1e-6, thickness_m=5e-6, cavity_shape=shape,
                dt_s=2e-8 * spacing_um, rest_tolerance=1e-2, duration_peaks=WINDOW_END,
                pattern_first=same_place(sample, n),
            )  # fmt: skip
            for config in stratified_design([sample], MESH_PRESSURES_PA, MESH_RUNS, base=base):
                key = {"sample": sample, "spacing_um": spacing_um, "cavities": shape,
                       "pressure_kPa": config.pressure_Pa / 1e3, "angle_deg": round(config.angle_deg, 3)}  # fmt: skip
                if not holds(known, **key):
                    run = simulate(config)
                    yield key | {
                        "area_fraction": run.parameters["area_fraction"], "static": run.static_friction,
                        "sliding": run.sliding_friction,
                    }  # fmt: skip


def domain(known: pd.DataFrame) -> Iterator[dict[str, object]]:
    """One row a run."""
    for n in DOMAINS:
        base = SimConfig(blocks=(n, n), dt_s=1e-7, rest_tolerance=1e-2, duration_peaks=WINDOW_END)
        for config in stratified_design(("F", "A", "B", "C", "Sx", "Sy"), MESH_PRESSURES_PA, MESH_RUNS, base=base):
            key = {"sample": config.sample, "blocks_a_side": n, "pressure_kPa": config.pressure_Pa / 1e3,
                   "angle_deg": round(config.angle_deg, 3)}  # fmt: skip
            if not holds(known, **key):
                run = simulate(config)
                yield key | {
                    "area_fraction": run.parameters["area_fraction"], "static": run.static_friction,
                    "sliding": run.sliding_friction,
                }  # fmt: skip


def same_place(sample: str, n: int) -> tuple[int, int] | None:
    """First cavity of S where it lies on the paper's mesh; the others are centred on either mesh."""
    return (4 * n // 85, 11 * n // 85) if sample.startswith("S") else None


def holds(known: pd.DataFrame, **key: object) -> bool:
    return len(known) > 0 and bool(np.logical_and.reduce([known[name] == value for name, value in key.items()]).any())


def resumed(what: str, path: Path) -> None:
    known = pd.read_csv(path) if path.exists() else pd.DataFrame()
    rows = known.to_dict("records")
    for row in {"blocks": blocks, "mesh": mesh, "domain": domain}[what](known):
        rows.append(row)
        print(*row.values(), flush=True)
        pd.DataFrame(rows).to_csv(path, index=False, float_format="%.6g")


def by_size(runs: pd.DataFrame) -> pd.DataFrame:
    """Mean and standard error at every size, beside the expected minimum of that many Gaussian numbers."""
    table = runs.groupby("blocks_a_side")["mu_static"].agg(["size", "mean", "sem"]).reset_index()
    minimum = [expected_minimum(n * n) for n in table["blocks_a_side"]]
    return table.assign(expected=PAPER.mu_s + PAPER.mu_s_sd * np.array(minimum))


def by_mesh(runs: pd.DataFrame) -> pd.DataFrame:
    """Mean and standard error of every sample, mesh and pressure."""
    keys = ["sample", "pressure_kPa", "spacing_um", "cavities"]
    grouped = runs.groupby(keys, sort=False)
    columns = {"runs": grouped.size(), "area_fraction": grouped["area_fraction"].first()}
    for regime in ("static", "sliding"):
        columns |= {regime: grouped[regime].mean(), f"{regime}_se": grouped[regime].sem()}
    return pd.DataFrame(columns).reset_index()


def figures(data: Path, out: Path) -> None:
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    out.mkdir(parents=True, exist_ok=True)
    for name, draw in (("size", draw_sizes), ("mesh", draw_meshes)):
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        FigureCanvasSVG(figure)
        draw(figure, data)
        figure.savefig(out / f"simulator-{name}.svg", metadata={"Date": None})
        figure.savefig(out / f"simulator-{name}.png", dpi=150)


def draw_sizes(figure: object, data: Path) -> None:
    table = by_size(pd.read_csv(data / "simulator-blocks.csv"))
    axes = figure.add_subplot()
    n = np.geomspace(table["blocks_a_side"].min(), table["blocks_a_side"].max(), 60)
    axes.plot(n, [PAPER.mu_s + PAPER.mu_s_sd * expected_minimum(round(k * k)) for k in n], color="0.5",
              label="expected minimum of n Gaussian numbers")  # fmt: skip
    axes.errorbar(table["blocks_a_side"], table["mean"], 2 * table["sem"], fmt="o", ms=4, capsize=3,
                  label="simulated, mean and two standard errors")  # fmt: skip
    axes.set(xscale="log", xlabel="blocks a side", ylabel="static friction coefficient\nwithout adhesion")
    axes.legend(frameon=False)


def draw_meshes(figure: object, data: Path) -> None:
    table = by_mesh(pd.read_csv(data / "simulator-mesh.csv"))
    samples = [s for s in ("F", "A", "B", "C", "Sx", "Sy") if s in set(table["sample"])]
    looks = {(5.0, "square"): ("s", "C0", "5 um, square"), (2.5, "square"): ("s", "C1", "2.5 um, square"),
             (2.5, "round"): ("o", "C2", "2.5 um, round")}  # fmt: skip
    for k, regime in enumerate(("static", "sliding")):
        axes = figure.add_subplot(1, 2, k + 1)
        for (spacing, shape), (marker, colour, label) in looks.items():
            for pressure, filled in ((3.0, True), (25.0, False)):
                rows = table[(table["spacing_um"] == spacing) & (table["cavities"] == shape)]
                rows = rows[rows["pressure_kPa"] == pressure]
                x = [samples.index(s) + 0.2 * (list(looks).index((spacing, shape)) - 1) for s in rows["sample"]]
                axes.errorbar(x, rows[regime], 2 * rows[f"{regime}_se"], fmt=marker, color=colour, ms=5, capsize=2,
                              mfc=colour if filled else "white", label=f"{label}, {pressure:g} kPa")  # fmt: skip
        axes.set_xticks(range(len(samples)), samples)
        axes.set(ylabel=f"{regime} T/N", yscale="log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter("{x:g}")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)


if __name__ == "__main__":
    what, *paths = sys.argv[1:]
    if what == "figures":
        figures(*map(Path, paths))
    else:
        resumed(what, Path(paths[0]))
