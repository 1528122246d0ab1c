"""tribo simulate: one run of the spring-block model or an ensemble of runs, described by options or by a file."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.cli.console import FORCE, WAIT, Console, GivenPath, command_options
from tribo.cli.slider_command import OWN, simulate_sliders, slider_options

if TYPE_CHECKING:
    import pandas as pd

    from tribo.lawsearch.grammar import WrittenLaw
    from tribo.records import Run
    from tribo.springblock import SimConfig


# options that describe the runs; a design file may replace them
_RUNS = (
    click.option("--sample", "samples", multiple=True, help="Sample of the paper: F, A, B, C, Sx or Sy (repeatable)."),
    click.option(
        "--pressure", "pressures_kPa", multiple=True, type=float, help="Nominal pressure in kPa (repeatable).",
    ),
    click.option(
        "--angle", "angles_deg", multiple=True, type=float,
        help="Angle between pull direction and x in degrees (repeatable). Default: for a single run, the direction in "
        "the name of the sample; for an ensemble, angles spread evenly.",
    ),
    click.option(
        "--repeats", type=int, help="Runs per sample and pressure, with new random local friction.  [default: 4]",
    ),
    click.option(
        "--set", "settings", multiple=True, metavar="NAME=VALUE[,VALUE...]",
        help="Set a parameter of the model, in SI units (repeatable). Several values: run every combination.",
    ),
    click.option("--blocks", type=int, help="Number of blocks along each side.  [default: 85]"),
    click.option("--dt", "dt_s", type=float, help="Time step in s.  [default: 5e-8]"),
    click.option(
        "--duration", "duration_ms", type=float, help="Duration of a run in ms.  [default: 3 x time of the peak]",
    ),
    click.option("--engine", help="Engine: fast or reference.  [default: fast]"),
    click.option(
        "--reading", type=click.Choice(["text", "berardo2019"]),
        help="Reading of the paper where its text leaves a choice: text, its letter; berardo2019, the one closest to "
        "its simulated column of Table 2.  [default: text]",
    ),
)  # fmt: skip


def _described(command: Any) -> Any:
    for option in reversed(_RUNS):
        command = option(command)
    return command


@click.command()
@_described
@slider_options
@click.option(
    "--design",
    type=GivenPath(dir_okay=False),
    help="TOML or JSON file that describes the runs: samples, pressures_kPa, angles_deg, repeats, seed, "
    "[parameters], [patterns.NAME].",
)
@click.option(
    "--table2",
    is_flag=True,
    help="Recompute the simulated column of Table 2 of the paper: 6 samples, 8 pressures, 20 runs each.",
)
@click.option(
    "--with", "mechanisms", default="", metavar="TEXT",
    help="Mechanism to add to the model: MECHANISM:PARAM=VALUE,...; or a law that was found: LAW.TOML.",
)
@click.option("--given", default="", help="Test conditions for --with, such as hold_s=100,temperature_C=25.")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a dask scheduler; its workers run the ensemble.")
@click.option(
    "-o", "--out", type=click.Path(dir_okay=False, path_type=Path), required=True, help="File to write, FILE.nc."
)
@FORCE
@WAIT
@command_options
def simulate(
    console: Console, design: Path | None, table2: bool, mechanisms: str, given: str, out: Path, **options: Any
) -> None:
    """Run the spring-block model.

    Parameters not given have the values of the paper. One --sample and one --pressure without --repeats give a single
    run; FILE.nc then holds force against time. Several samples or pressures, --repeats, --design or --table2 give an
    ensemble; FILE.nc then holds one entry per run. If the same command is started again, it computes only the missing
    runs.

    With --slider, a rigid slider is pulled through a spring instead, under the friction law of --law; FILE.nc then
    holds force, position and speed over time. Several values of a parameter (--set) or --design give an ensemble.
    """
    own = {name: options.pop(name) for name in OWN}
    if own.pop("slider"):
        _slider(console, own, design, table2, mechanisms, out, options)
        return
    if named := [name for name, value in own.items() if value is not None]:
        raise click.UsageError(f"{', '.join(named)}: only with --slider")
    from tribo.cache.own_folder import check_file, only_writer_of
    from tribo.display import exact_text
    from tribo.mechanisms_in_model import columns_from, parse_given, parse_with
    from tribo.springblock.design_file import asked_runs, described_by_options, read_design, together
    from tribo.springblock.ensemble import FRICTION, Work
    from tribo.springblock.kept_runs import ENSEMBLE, ONE_RUN, fault_of, kind_of, run_stored
    from tribo.springblock.run import simulate as run_model

    if options["engine"] == "dense":
        console.say("the dense engine is no longer part of tribo; the fast engine runs and gives the same results")
        options["engine"] = "fast"
    scheduler, seed, jobs = (options.pop(name) for name in ("scheduler", "seed", "jobs"))
    if design and (table2 or any(value not in (None, ()) for value in options.values())):
        raise click.UsageError(
            "--design describes all runs; it cannot be combined with other options that describe runs"
        )
    if not (design or table2 or (options["samples"] and options["pressures_kPa"])):
        raise click.UsageError("give --sample and --pressure, or --design, or --table2")
    one, table = (False, {}) if design else described_by_options(options, seed, table2)
    laws, mechanisms = _laws_in(mechanisms)
    given, columns = columns_from(given, [name for law, _ in laws for name in law.columns])
    runs, acting, conditions = together(
        lambda: read_design(design, seed) if design else asked_runs(table, seed if one else None),
        lambda: parse_with(mechanisms),
        lambda: parse_given(given),
    )
    changed = partial(pulled, acting=acting, conditions=conditions, laws=laws, columns=columns)
    check_file(out, ONE_RUN if one else ENSEMBLE, kind_of, console.force)
    if one:
        with only_writer_of(out, console.wait_s):
            run = changed(runs[0]) if acting or laws else run_model(runs[0], jobs)
            _one_run(console, run, out)
    else:
        label = exact_text((acting, conditions)) + (exact_text((laws, columns)) if laws else "")
        work = Work(changed, label=label) if acting or laws else FRICTION
        if console.force and out.exists() and fault_of(runs, out, work) is not None:
            out.unlink()
        with console.progress() as progress:
            ran = run_stored(
                runs, out, jobs, scheduler, partial(progress, "simulating"), work, console.wait_s
            )  # fmt: skip
        _say_ensemble(console, ran, out, table2)


def _slider(
    console: Console, own: dict[str, Any], design: Path | None, table2: bool, mechanisms: str, out: Path,
    options: dict[str, Any],
) -> None:  # fmt: skip
    """The run of a slider; options that describe blocks are wrong usage."""
    scheduler, seed, jobs = (options.pop(name) for name in ("scheduler", "seed", "jobs"))
    own |= {name: options.pop(name) for name in ("settings", "duration_ms")}
    if table2 or mechanisms or any(value not in (None, ()) for value in options.values()):
        raise click.UsageError("--slider cannot be combined with options of the spring-block model")
    simulate_sliders(console, own, design, out, seed, jobs, scheduler)


def pulled(
    config: SimConfig,
    acting: Mapping[str, Any],
    conditions: Mapping[str, float],
    laws: tuple[tuple[WrittenLaw, tuple[float, ...]], ...],
    columns: Mapping[str, str],
) -> Run:
    """One run with laws and mechanisms in the model; at module level so that workers can import it.

    ``laws`` hold their values; ``columns`` are the recorded columns that they stand for, ``conditions`` those of the
    test.
    """
    import numpy as np

    from tribo.mechanisms_in_model import simulate_with, with_law

    for law, values in laws:
        config = with_law(config, (law.mechanism(), np.array(values)), conditions, columns)
    return simulate_with(config, acting, **conditions)


def _laws_in(text: str) -> tuple[tuple[tuple[WrittenLaw, tuple[float, ...]], ...], str]:
    """The laws whose files a text names, with their amplitudes, and the rest of the text."""
    from tribo.lawsearch.known_laws import read_law

    items = text.split(",")
    files = [Path(item.strip()) for item in items if item.strip().endswith(".toml")]
    laws = []
    for file in files:
        known = read_law(file)
        values = tuple(known.parameters[p.name].value for p in known.law.mechanism().parameters)
        laws.append((known.law, values))
    return tuple(laws), ",".join(item for item in items if not item.strip().endswith(".toml"))


def _one_run(console: Console, run: Run, out: Path) -> None:
    from tribo.springblock import write_run

    write_run(run, out)
    record = {
        "out": str(out),
        "static_friction": run.static_friction,
        "sliding_friction": run.sliding_friction,
        "window_s": run.window_s,
    }
    start, end = (1e3 * t for t in run.window_s)
    console.result(
        record,
        f"{run.sample} at {run.pressure_Pa / 1e3:g} kPa: static T/N {run.static_friction:.4f}, sliding T/N "
        f"{run.sliding_friction:.4f} (mean from {start:.2f} to {end:.2f} ms), written to {out}",
    )


def _say_ensemble(console: Console, table: pd.DataFrame, out: Path, table2: bool) -> None:
    """The ensemble in words and as a record: beside the published column, or means and laws."""
    from tribo.berardo2019.published_tables import beside, load_table2, table2_text
    from tribo.springblock.calibration import described, fitted

    record: dict[str, Any] = {"out": str(out), "runs": len(table)}
    if table2:
        found = beside(fitted(table), load_table2())
        record["table2"], words = found.to_dict("records"), table2_text(found)
    else:
        means, laws, words = described(table)
        record |= {"means": means.to_dict("records"), "fits": laws.to_dict("records")}
    console.result(record, f"{words}\n\n{len(table)} runs in {out}")
