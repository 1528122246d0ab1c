"""tribo simulate --slider: a rigid slider on a machine, once or as an ensemble."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from tribo.cli.console import ExportPath

if TYPE_CHECKING:
    from tribo.cli.console import Console
    from tribo.errors import Problem
    from tribo.slider import Drive, SliderConfig

_NUMBERS = {
    "mass_kg": ("--mass", "KG", "Mass of the slider in kg."),
    "stiffness_N_per_m": ("--stiffness", "N_PER_M", "Stiffness between drive and slider in N/m."),
    "damping_N_s_per_m": ("--damping", "N_S_PER_M", "Damping beside the spring in N s/m.  [default: 0]"),
    "normal_load_N": ("--normal-load", "N", "Normal load in N.  [default: weight of the mass]"),
    "speed_mm_s": ("--speed", "MM_S", "Constant speed of the drive in mm/s."),
}
_REST = (
    click.option("--slider", is_flag=True, help="Simulate a rigid slider on a machine, not the spring-block model."),
    click.option("--law", metavar="LAW", help="With --slider: file LAW.toml with the friction law, or its name."),
    click.option(
        "--steps", metavar="S:MM_S,...", help="With --slider: steps of speed, such as 0:0.001,20:0.01 (time:speed)."
    ),
    click.option(
        "--hold", "holds", metavar="S,...", help="With --slider and --speed: slide-hold-slide, such as 10,100,1000; "
        "the drive slides for --slide seconds before and after each hold.",
    ),
    click.option("--slide", "slide_s", type=float, metavar="S", help="With --hold: seconds of sliding.  [default: 10]"),
    click.option(
        "--sinusoid", metavar="MM,HZ", help="With --slider: amplitude and frequency of the drive, such as 2.5,0.5."
    ),
    click.option(
        "--displacement", type=ExportPath(dir_okay=False),
        help="With --slider: export with the displacement that the drive follows.",
    ),
)  # fmt: skip
OWN = ("slider", "law", "steps", "holds", "slide_s", "sinusoid", "displacement", *_NUMBERS)


def slider_options(command: Any) -> Any:
    """Add the options of a slider to a command."""
    for name, (flag, metavar, text) in reversed(_NUMBERS.items()):
        command = click.option(flag, name, type=float, metavar=metavar, help=f"With --slider: {text}")(command)
    for option in reversed(_REST):
        command = option(command)
    return command


def simulate_sliders(
    console: Console, given: Mapping[str, Any], design: Path | None, out: Path, seed: int, jobs: int,
    scheduler: str | None,
) -> None:  # fmt: skip
    """Run the slider that the options describe, or the design, and write FILE.nc."""
    from tribo.cache.own_folder import check_file, only_writer_of
    from tribo.slider import simulate_slider, write_slider_run
    from tribo.slider.slider_files import (
        SLIDER_ENSEMBLE,
        SLIDER_RUN,
        read_slider_design,
        runs_of,
        slider_file_kind,
        write_slider_ensemble,
    )

    base, parameters = _described(given, seed)
    runs = read_slider_design(design, base) if design is not None else runs_of(base, parameters)
    one = design is None and len(runs) == 1
    check_file(out, SLIDER_RUN if one else SLIDER_ENSEMBLE, slider_file_kind, console.force)
    with only_writer_of(out, console.wait_s):
        if one:
            run = simulate_slider(runs[0])
            write_slider_run(run, out)
            start, end = run.window_s
            record = {
                "out": str(out), "static_friction": run.static_friction, "sliding_friction": run.sliding_friction,
                "window_s": run.window_s, "slips": int(run.starts_s.size), "stuck_share": float(run.stuck.mean()),
            }  # fmt: skip
            console.result(
                record,
                f"{runs[0].law}, {runs[0].drive.label}: static T/N {run.static_friction:.4f}, sliding T/N "
                f"{run.sliding_friction:.4f} (mean from {start:.4g} to {end:.4g} s), {run.starts_s.size} slips, "
                f"written to {out}",
            )
            return
        rows = _rows(console, runs, jobs, scheduler)
        write_slider_ensemble(runs, rows, out)
    friction = [row["sliding_friction"] for row in rows]
    console.result(
        {"out": str(out), "runs": len(runs)},
        f"{len(runs)} runs in {out}; sliding T/N from {min(friction):.4f} to {max(friction):.4f}",
    )


def _rows(
    console: Console, runs: list[SliderConfig], jobs: int, scheduler: str | None
) -> list[Mapping[str, Any]]:
    """What is kept of every run, on the scheduler that makes the runs of blocks."""
    from tribo.slider.slider_files import SLIDER_WORK
    from tribo.springblock.ensemble import finished_runs

    rows: list[Mapping[str, Any]] = [{}] * len(runs)
    with console.progress() as progress:
        for done, (k, row) in enumerate(finished_runs(cast(Any, runs), jobs, scheduler, SLIDER_WORK), 1):
            rows[k] = row
            progress("simulating", done, len(runs))
    return rows


def _described(given: Mapping[str, Any], seed: int) -> tuple[SliderConfig, dict[str, Any]]:
    """The run that the options describe, and the parameters set by name; SimulationError with all that is wrong."""
    from tribo.errors import SimulationError
    from tribo.slider import SliderConfig, read_slider_law
    from tribo.springblock.design_file import setting

    problems: list[Problem] = []
    base = SliderConfig(seed=seed)
    parts: tuple[Callable[[], Any], ...] = (partial(_drive, given), lambda: _law(given, read_slider_law))
    found: list[Any] = []
    for part in parts:
        try:
            found.append(part())
        except SimulationError as refused:
            problems += refused.problems
    if problems:
        raise SimulationError(problems)
    drive, (law, values) = found
    changes: dict[str, Any] = {
        name: given[name] for name in _NUMBERS if name != "speed_mm_s" and given.get(name) is not None
    }
    if "mass_kg" in changes and "normal_load_N" not in changes:
        changes["normal_load_N"] = changes["mass_kg"] * STANDARD_GRAVITY
    if given.get("duration_ms") is not None:
        changes["duration_s"] = 1e-3 * given["duration_ms"]
    if drive is not None:
        changes["drive"] = drive
    parameters = {name: _as_numbers(value) for name, value in map(setting, given.get("settings", ()))}
    return base.with_(**changes, law=law, values=values), parameters


def _as_numbers(value: Any) -> Any:
    """Numbers such as .3, which are no JSON, as numbers; everything else as it is."""
    if isinstance(value, list):
        return [_as_numbers(part) for part in value]
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value


STANDARD_GRAVITY = 9.80665  # m/s2, BIPM SI brochure


def _law(given: Mapping[str, Any], read: Callable[[Path], tuple[str, dict[str, Any]]]) -> tuple[str, dict[str, Any]]:
    named = given.get("law")
    if named is None:
        return "coulomb", {}
    return read(Path(named)) if str(named).endswith(".toml") else (named, {})


def _drive(given: Mapping[str, Any]) -> Drive | None:
    """The drive that the options name; None where none does."""
    from tribo.readers import read_export
    from tribo.slider import constant_speed, recorded_displacement, sinusoid, slide_hold_slide, speed_steps

    speed = None if given.get("speed_mm_s") is None else 1e-3 * given["speed_mm_s"]
    named = [name for name in ("steps", "sinusoid", "displacement") if given.get(name) is not None]
    if len(named) + (speed is not None) > 1:
        raise click.UsageError("give one drive: --speed, --speed with --hold, --steps, --sinusoid or --displacement")
    if given.get("holds") is not None and speed is None:
        raise click.UsageError("--hold needs --speed")
    if given.get("holds") is not None:
        slide = 10.0 if given.get("slide_s") is None else given["slide_s"]
        return slide_hold_slide(speed or 0.0, slide, _numbers("--hold", given["holds"]))
    if given.get("steps") is not None:
        pairs = [_numbers("--steps", part, ":") for part in given["steps"].split(",")]
        if any(len(pair) != 2 for pair in pairs):
            raise click.UsageError("--steps takes pairs TIME:SPEED, such as 0:0.001,20:0.01")
        return speed_steps([t for t, _ in pairs], [1e-3 * v for _, v in pairs])
    if given.get("sinusoid") is not None:
        wave = _numbers("--sinusoid", given["sinusoid"])
        if len(wave) != 2:
            raise click.UsageError("--sinusoid takes an amplitude in mm and a frequency in Hz, such as 2.5,0.5")
        return sinusoid(1e-3 * wave[0], wave[1])
    if given.get("displacement") is not None:
        trace = read_export(given["displacement"])
        if trace.displacement_m is None:
            raise click.UsageError(f"{given['displacement']} has no displacement")
        return recorded_displacement(trace.time_s, trace.displacement_m)
    return None if speed is None else constant_speed(speed)


def _numbers(option: str, text: str, between: str = ",") -> list[float]:
    try:
        return [float(part) for part in text.split(between)]
    except ValueError as why:
        raise click.UsageError(f"{option}: {text!r} are not numbers") from why
