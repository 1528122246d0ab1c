"""Cavity blocks without mass: what it would gain to let them follow the contact blocks statically, and what it costs.

    python benchmarks/simulator_cavities.py docs/data/simulator-cavities.csv

A prototype beside the engine, on the same thresholds: the cavities are eliminated from the stiffness matrix, the
contact blocks that remain are coupled through them, and only those that move hand on their change of force. One line a
run: sample, seed, static and sliding friction of the engine and of the prototype, processor seconds of both, block
updates of the engine (all and contact blocks) and of the prototype, and entries of its matrix a block.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray
from tribo.springblock import SimConfig
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.jit import compiled
from tribo.springblock.engines.state import drive_of, first_failure_s, lattice_of, thresholds_of
from tribo.springblock.engines.strips import last_stretch
from tribo.springblock.lattice import Lattice
from tribo.springblock.run import run_of

CASES = (("A", 20.0), ("C", 20.0))


@compiled
def integrate(
    pointer: NDArray[np.int64], column: NDArray[np.int64], stiffness: FloatArray, rate: FloatArray,
    weight: FloatArray, fs: FloatArray, fd: FloatArray, first_s: float, dt: float, mass: float, damping: float,
    force_rate: float, shear: float, force: FloatArray,
) -> int:  # fmt: skip
    """Steps as in the engine; ``force`` receives the slider force of each. Returns the number of block updates."""
    n = len(fs)
    g, v = np.zeros(2 * n), np.zeros(2 * n)
    gain, keep, along, updates = dt / mass, 1.0 - damping * dt, 0.0, 0
    for step in range(len(force)):
        t = first_s + step * dt
        for i in range(n):
            fx, fy = g[i] + rate[i] * t, g[n + i] + rate[n + i] * t
            speed = math.sqrt(v[i] * v[i] + v[n + i] * v[n + i])
            if speed == 0.0 and fx * fx + fy * fy <= fs[i] * fs[i]:
                continue
            updates += 1
            vx, vy = keep * v[i] + gain * fx, keep * v[n + i] + gain * fy
            drive, sliding = math.sqrt(vx * vx + vy * vy), gain * fd[i]
            share = 1.0 - sliding / drive if drive > sliding else 0.0
            stops = share == 0.0 and speed > 0.0
            if stops:
                share = last_stretch(speed, drive, sliding)
            elif speed == 0.0:
                share *= 0.5
            v[i], v[n + i] = share * vx, share * vy
            if stops:
                v[i], v[n + i] = v[i] + 1e3, v[n + i]  # marked: moves once more, then rests
        for i in range(n):
            if v[i] == 0.0 and v[n + i] == 0.0:
                continue
            stops = v[i] > 500.0
            dx, dy = dt * (v[i] - 1e3 if stops else v[i]), dt * v[n + i]
            along += weight[i] * dx + weight[n + i] * dy
            for e in range(pointer[i], pointer[i + 1]):
                g[column[e]] -= stiffness[e] * dx
            for e in range(pointer[n + i], pointer[n + i + 1]):
                g[column[e]] -= stiffness[e] * dy
            if stops:
                v[i], v[n + i] = 0.0, 0.0
        force[step] = force_rate * (t + dt) - shear * along
    return updates


def stiffness_matrix(lattice: Lattice) -> FloatArray:
    """Of all blocks, x components first, per unit K_int; dense (2 n, 2 n)."""
    n = lattice.contact.size
    matrix = np.empty((2 * n, 2 * n))
    for k in range(2 * n):
        unit = np.zeros((n, 2))
        unit[k % n, k // n] = 1.0
        matrix[:, k] = -lattice.spring_forces(unit).T.ravel()
    return matrix


def condensed(lattice: Lattice) -> tuple[FloatArray, FloatArray]:
    """Stiffness between contact blocks, and how the cavities follow them (2 cavities, 2 contacts)."""
    matrix = stiffness_matrix(lattice)
    held = np.tile(lattice.contact, 2)
    follow = -np.linalg.solve(matrix[np.ix_(~held, ~held)], matrix[np.ix_(~held, held)])
    return matrix[np.ix_(held, held)] + matrix[np.ix_(held, ~held)] @ follow, follow


def line(config: SimConfig, lattice: Lattice, matrix: FloatArray, follow: FloatArray) -> list[object]:
    """One seed on both."""
    from scipy.sparse import csc_array

    thresholds, drive = thresholds_of(config, lattice), drive_of(config, lattice)
    run_fast(config.with_(duration_s=1e-6), lattice, thresholds)
    began = time.process_time()
    whole = run_fast(config, lattice, thresholds)
    engine_s = time.process_time() - began
    found = run_of(config, whole, lattice.area_fraction)
    held, n = lattice.contact, int(lattice.contact.sum())
    sparse = csc_array(np.where(np.abs(matrix) > 1e-9, config.stiffness_N_m * matrix, 0.0))
    direction = drive.velocity / config.speed_m_s
    weight = np.repeat(direction, n) + np.repeat(direction, len(held) - n) @ follow
    first = first_failure_s(lattice, thresholds, drive, config.stiffness_N_m) - 2 * config.dt_s
    force = np.zeros(int((whole.end_s - first) / config.dt_s))
    arguments = (
        sparse.indptr.astype(np.int64), sparse.indices.astype(np.int64), sparse.data, drive.rate[held].T.ravel(),
        weight, thresholds.static_N[held], thresholds.sliding_N[held], first, config.dt_s, config.mass_kg,
        config.damping_per_s,
        drive.force_rate, config.shear_stiffness_N_m,
    )  # fmt: skip
    integrate(*arguments, force[:10])
    began = time.process_time()
    updates = integrate(*arguments, force)
    static_s = time.process_time() - began
    times = first + config.dt_s * np.arange(1, len(force) + 1)
    peak = int(np.argmax(force))
    window = (times > config.window_start_peaks * times[peak]) & (times <= config.duration_peaks * times[peak])
    load = config.normal_load_N
    moving = float(np.mean(whole.moving[2:])) * (whole.end_s - first) / config.dt_s
    return [
        config.sample, config.seed, f"{found.static_friction:.5f}", f"{found.sliding_friction:.5f}",
        f"{force[peak] / load:.5f}", f"{force[window].mean() / load:.5f}", f"{engine_s:.3f}", f"{static_s:.3f}",
        whole.active_block_steps, round(moving), updates, round(sparse.nnz / 2 / n),
    ]  # fmt: skip


def main(path: Path, seeds: int = 10, blocks: int = 36) -> None:
    with path.open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(
            ["sample", "seed", "static", "sliding", "static_followed", "sliding_followed", "engine_s", "followed_s",
             "updates", "contact_updates", "followed_updates", "entries_a_component"]
        )  # fmt: skip
        for sample, angle_deg in CASES:
            config = SimConfig(sample=sample, angle_deg=angle_deg, blocks=(blocks, blocks), duration_peaks=1.6)
            lattice = lattice_of(config)
            matrix, follow = condensed(lattice)
            rows = [line(config.with_(seed=seed), lattice, matrix, follow) for seed in range(seeds)]
            out.writerows(rows)
            file.flush()
            numbers = np.array([[float(v) for v in row[2:]] for row in rows])
            for k, name in enumerate(("static", "sliding")):
                change = 100 * (numbers[:, k + 2] / numbers[:, k] - 1)
                error = change.std(ddof=1) / math.sqrt(seeds)
                print(f"{sample} {name}: {change.mean():+.2f} % ({error:.2f}), single to {np.abs(change).max():.1f} %")
            times, updates = numbers[:, 4:6].sum(axis=0), numbers[:, [6, 8]].sum(axis=0)
            ratios = f"time {times[0] / times[1]:.2f}, updates {updates[0] / updates[1]:.1f}"
            print(f"{sample} engine over prototype: {ratios}")
            print(f"{sample} entries of the matrix a block {numbers[0, 9]:.0f}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *(int(v) for v in sys.argv[2:]))
