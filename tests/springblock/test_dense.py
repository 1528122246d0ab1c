"""The compiled steps: against a plain one, on vector units, and stopped by numbers that are not finite."""

from __future__ import annotations

import platform
import re

import numpy as np
import pytest
from numba import njit, typeof, types
from support import dense_engine as dense, first_quick

from tribo.errors import SimulationError
from tribo.records import FloatArray
from tribo.springblock import FrictionTerms, SimConfig
from tribo.springblock.engines import ENGINES, state as k, strips
from tribo.springblock.engines.active import advance
from tribo.springblock.engines.fast import active_set, at_rest, integrate as run_fast, put_back, refuse_not_finite
from tribo.springblock.engines.jit import VECTOR_OPTIONS
from tribo.springblock.engines.state import (
    SliderDrive,
    Thresholds,
    drive_of,
    lattice_of,
    sliding_threshold,
    static_threshold,
    thresholds_of,
)
from tribo.springblock.lattice import Lattice

STEPS = 14


def samples(n: int) -> k.Samples:
    return k.Samples(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n, np.int64))


def friction_of_block(cell: FloatArray, drive: FloatArray, t: float, c: k.Numerics) -> tuple[FloatArray, bool]:
    """Velocity of a contact block after friction, and whether it comes to rest in this step."""
    before, size = np.hypot(*cell[k.VX : k.VY + 1]), np.hypot(*drive)
    sliding = c.dt / c.mass * sliding_threshold(cell[k.FD], before, c.law)
    if before == 0.0:
        begins = size > c.dt / c.mass * static_threshold(cell[k.FS], t - cell[k.SINCE], c.law) and size > sliding
        return (0.5 * (1.0 - sliding / size) * drive if begins else 0.0 * drive), False
    if size > sliding:
        return (1.0 - sliding / size) * drive, False
    return drive * strips.last_stretch(before, size, sliding), True


def plain_steps(cells: FloatArray, steps: int, lattice: Lattice, drive_: SliderDrive, c: k.Numerics) -> float:
    """The model block by block, counted from the quasi-static motion; returns the friction work."""
    work = 0.0
    drag = -c.mass * c.damping * drive_.follow
    for step in range(steps):
        t = c.start + step * c.dt
        springs = c.stiffness * lattice.spring_forces(cells[:, k.QX : k.QY + 1])
        force = springs + drag + drive_.rate * t
        stopped = []
        for i, cell in enumerate(cells):
            drive = (1.0 - c.damping * c.dt) * cell[k.VX : k.VY + 1] + c.dt / c.mass * force[i]
            if lattice.contact[i]:
                sliding = sliding_threshold(cell[k.FD], np.hypot(*cell[k.VX : k.VY + 1]), c.law)
                drive, stops = friction_of_block(cell, drive, t, c)
                work += sliding * c.dt * np.hypot(*drive)
                if stops:
                    stopped.append(i)
            cell[k.VX : k.VY + 1] = drive
        cells[:, k.QX : k.QY + 1] += c.dt * cells[:, k.VX : k.VY + 1]
        cells[stopped, k.VX : k.VY + 1] = 0.0
        cells[stopped, k.SINCE] = t
    return work


@pytest.mark.parametrize("terms", [FrictionTerms(), FrictionTerms(ageing_b=0.05, ageing_t0_s=1e-6, speed_a=0.02)])
@pytest.mark.parametrize(("sample", "edges"), [("F", "free"), ("C", "free"), ("B", "periodic")])
@pytest.mark.parametrize("engine", first_quick(["fast", "dense"]))
def test_a_compiled_step_is_the_plain_step(engine: str, sample: str, edges: str, terms: FrictionTerms):
    """Blocks that start, slide and stop, with and without friction terms: the same to rounding."""
    config = SimConfig(
        sample=sample, edges=edges, blocks=(15, 12), angle_deg=25.0, seed=1, engine=engine, terms=terms,
        rest_tolerance=1e-12,
    )  # fmt: skip
    lattice = lattice_of(config)
    thresholds, drive = thresholds_of(config, lattice), drive_of(config, lattice)
    state, numerics = at_rest(config, lattice, thresholds, drive, 3e-3)
    rng = np.random.default_rng(3)
    cells = state.cells
    moves = rng.random(len(cells)) < 0.5
    cells[:, k.VX : k.VY + 1] = rng.normal(0.0, 5.0, (len(cells), 2)) * moves[:, None]
    cells[:, k.QX : k.QY + 1] += rng.normal(0.0, 3e-7, (len(cells), 2))
    twin = cells.copy()
    moved = cells[:, k.QX : k.QY + 1] @ drive.velocity / config.speed_m_s
    before = float(moved.sum())
    state.totals[k.ALONG] = before
    if engine == "dense":
        dense.advance_dense(state, samples(80), numerics, STEPS, lattice, drive.follow)
    else:
        active = active_set(state, numerics, lattice, drive, config)
        advance(active, state, samples(80), numerics, STEPS)
        put_back(active, state, numerics)
    work = plain_steps(twin, STEPS, lattice, drive, numerics)
    rests = (twin[lattice.contact, k.VX] == 0.0).mean()
    assert 0.05 < rests < 0.95
    for columns in (slice(k.QX, k.QY + 1), slice(k.VX, k.VY + 1), slice(k.SINCE, k.SINCE + 1)):
        if columns.start == k.SINCE and (engine == "fast" or not terms.active):
            continue  # only ageing asks when a block stopped, and only the step of all blocks hands it back
        assert np.allclose(cells[:, columns], twin[:, columns], rtol=1e-9, atol=1e-9 * np.abs(twin[:, columns]).max())
    along = float((twin[:, k.QX : k.QY + 1] @ drive.velocity).sum()) / config.speed_m_s
    assert state.totals[k.ALONG] == pytest.approx(along, rel=1e-9)
    assert state.totals[k.FRICTION_WORK] == pytest.approx(work, rel=1e-9)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 instructions")
@pytest.mark.parametrize("loop", [dense.pushed, dense.rubbed])
def test_loops_over_all_blocks_use_vector_instructions(loop):
    """Were sums not allowed to be reordered, or a branch to creep in, one block would be done at a time."""
    array, number = types.float64[::1], types.float64
    arrays = 8 if loop is dense.pushed else 10
    rest = (number,) * 5 if loop is dense.pushed else (number, number, number, types.none, types.none)
    fresh = njit(error_model="numpy", **VECTOR_OPTIONS)(loop)
    fresh.compile((array,) * arrays + rest)
    assembly = next(iter(fresh.inspect_asm().values()))
    wanted = r"sqrtpd" if loop is dense.rubbed else r"v?(fn?madd\w*|mul)pd\s.*%[yz]mm|mulpd\s"
    assert re.search(wanted, assembly)


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 instructions")
def test_loops_over_strips_use_vector_instructions():
    """Forces and gliding without a square root, sliding with it; each compiled by itself."""
    config = SimConfig(blocks=(12, 12))
    lattice = lattice_of(config)
    drive = drive_of(config, lattice)
    state, numerics = at_rest(config, lattice, thresholds_of(config, lattice), drive, 3e-3)
    a = active_set(state, numerics, lattice, drive, config)
    sums = strips.Sums(*(rows[0] for rows in a.sums))
    given = {
        strips.forces: (a.planes, a.lists.strips[0], a.starts, numerics, 0.0),
        strips.glides: (a.planes, a.lists.strips[0], a.calm, numerics, sums),
        strips.slides: (a.planes, a.lists.strips[0], a.moving, numerics, 0, sums),
    }
    for loop, arguments in given.items():
        fresh = njit(error_model="numpy", **VECTOR_OPTIONS)(loop)
        fresh.compile(tuple(typeof(value) for value in arguments))
        assembly = next(iter(fresh.inspect_asm().values()))
        assert re.search(r"sqrtpd" if loop is strips.slides else r"v?fn?madd\w*pd\s.*%[yz]mm|mulpd\s", assembly), loop


@pytest.mark.parametrize("engine", ["fast", "dense"])
@pytest.mark.parametrize("sample", ["F", "C"])
def test_an_unstable_step_stops_the_run_and_names_a_block(engine: str, sample: str):
    """On both paths of the fast engine; the step is far beyond stability."""
    config = SimConfig(sample=sample, blocks=(17, 17), dt_s=4e-7, engine=engine)
    lattice = lattice_of(config)
    with pytest.raises(SimulationError, match=r"no longer finite at t = .*x = \d+, y = \d+"):
        ENGINES[engine].integrate(config, lattice, thresholds_of(config, lattice), 1)


def test_a_block_without_velocity_is_named_in_the_step_it_appears():
    """On both paths: one block turns NaN, and the very next step ends the run with its place."""
    for engine in ("fast", "dense"):
        config = SimConfig(blocks=(20, 15), engine=engine, seed=2)
        lattice = lattice_of(config)
        thresholds, drive = thresholds_of(config, lattice), drive_of(config, lattice)
        state, numerics = at_rest(config, lattice, thresholds, drive, 3e-3)
        state.cells[7 * 20 + 4, k.VX] = np.nan
        if engine == "dense":
            dense.advance_dense(state, samples(80), numerics, 60, lattice, drive.follow)
        else:
            active = active_set(state, numerics, lattice, drive, config)
            advance(active, state, samples(80), numerics, 60)
            put_back(active, state, numerics)
        with pytest.raises(SimulationError, match=r"t = 0\.00300005 s; found '1 blocks, the first at x = 4, y = 7'"):
            refuse_not_finite(state, numerics)


def test_thresholds_that_are_not_numbers_are_refused():
    """NaN or infinite friction of a block is found before the run."""
    config = SimConfig(blocks=(20, 20))
    lattice = lattice_of(config)
    drawn = thresholds_of(config, lattice)
    for bad in (np.nan, np.inf, -1.0):
        sliding = drawn.sliding_N.copy()
        sliding[45] = bad
        with pytest.raises(SimulationError, match="x = 5, y = 2"):
            run_fast(config, lattice, Thresholds(drawn.static_N, sliding))
