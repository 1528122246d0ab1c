"""Builds of which every process is forked from one that has tribo and Snakemake loaded, on small lattices.

    python quick_starts.py FOLDER      serves until its standard input ends; FOLDER/python then stands in for Python

What a build writes and in what order it runs is that of a build whose steps each start Python and simulate 85 x 85
blocks; see benchmarks/forked_starts.py. Linux only.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OF_A_BUILD = (
    "snakemake.cli", "snakemake.executors.local", "tribo.cli", "tribo.cli.workflow_step", "tribo.site.index_page",
    "tribo.site.build", "tribo.report.write", "tribo.report.page", "tribo.report.pdf", "tribo.stages",
    "tribo.comparison.findings", "tribo.fitting.assessment", "tribo.diagnostics", "tribo.springblock.ensemble",
    "matplotlib.figure", "matplotlib.backends.backend_svg", "scipy.stats", "statsmodels.api", "xarray", "h5netcdf",
    "typst", "psutil",
)  # fmt: skip


@contextmanager
def quick_starts(folder: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """What is started in place of Python, and the environment that it needs; Python itself where this is not Linux."""
    if sys.platform != "linux":
        yield sys.executable, dict(os.environ)
        return
    path = os.pathsep.join(str(ROOT / place) for place in (".", "tests", "benchmarks"))
    with subprocess.Popen(
        [sys.executable, __file__, str(folder)], env={**os.environ, "PYTHONPATH": path}, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as serving:  # fmt: skip
        assert serving.stdin is not None
        assert serving.stdout is not None
        name, _, place = serving.stdout.readline().strip().partition("=")
        try:
            yield str(folder / "python"), {**os.environ, name: place}
        finally:
            serving.stdin.close()


def main(folder: Path) -> None:
    """Load what a build needs, serve, and end when nobody needs it any more."""
    from faults.commands import small_lattice
    from forked_starts import STARTER, stand_in_for_python, start_here

    from tribo.units import unit_factor

    for module in OF_A_BUILD:
        import_module(module)
    unit_factor("kN", "friction force")  # loads the table of units
    small_lattice()
    script = stand_in_for_python(folder)
    sys.executable = str(script)  # of the forks too
    starter = start_here(script, folder / "socket")
    print(f"{STARTER}={folder / 'socket'}", flush=True)
    sys.stdin.read()
    os.kill(starter, signal.SIGKILL)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
