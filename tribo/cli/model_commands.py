"""The commands that need no measurement: runs of the model and of a slider, designs of patterns, maps of families."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from tribo.cli.console import FORCE, UNUSABLE, WAIT, Console, ExportPath, GivenPath, command_options, output_options
from tribo.errors import CampaignError, Problem

if TYPE_CHECKING:
    import pandas as pd

    from tribo.design.answer import Measured
    from tribo.lawsearch.grammar import WrittenLaw
    from tribo.records import Run
    from tribo.slider import Drive, SliderConfig
    from tribo.springblock import SimConfig


_SLIDER_NUMBERS = {
    "mass_kg": ("--mass", "KG", "mass of the slider in kg."),
    "stiffness_N_per_m": ("--stiffness", "N_PER_M", "stiffness between drive and slider in N/m."),
    "damping_N_s_per_m": ("--damping", "N_S_PER_M", "damping beside the spring in N s/m.  [default: 0]"),
    "normal_load_N": ("--normal-load", "N", "normal load in N.  [default: weight of the mass]"),
    "speed_mm_s": ("--speed", "MM_S", "constant speed of the drive in mm/s."),
}
_SLIDER_REST = (
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
OWN = ("slider", "law", "steps", "holds", "slide_s", "sinusoid", "displacement", *_SLIDER_NUMBERS)


def slider_options(command: Any) -> Any:
    """Add the options of a slider to a command."""
    for name, (flag, metavar, text) in reversed(_SLIDER_NUMBERS.items()):
        command = click.option(flag, name, type=float, metavar=metavar, help=f"With --slider: {text}")(command)
    for option in reversed(_SLIDER_REST):
        command = option(command)
    return command


def simulate_sliders(
    console: Console, given: Mapping[str, Any], design: Path | None, out: Path, seed: int, jobs: int,
    scheduler: str | None,
) -> None:  # fmt: skip
    """Run the slider that the options describe, or the design, and write FILE.nc."""
    from tribo.own_folder import check_file, only_writer_of
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
    from tribo.slider import SliderConfig, read_slider_law
    from tribo.springblock.design_file import setting, together

    base = SliderConfig(seed=seed)
    drive, (law, values) = together(partial(_drive, given), lambda: _law(given, read_slider_law))
    changes: dict[str, Any] = {
        name: given[name] for name in _SLIDER_NUMBERS if name != "speed_mm_s" and given.get(name) is not None
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
        help="How the paper is understood where its text leaves a choice: text, as it is written; berardo2019, as it "
        "comes closest to its simulated column of Table 2.  [default: text]",
    ),
)  # fmt: skip


def _model_options(command: Any) -> Any:
    for option in reversed(_RUNS):
        command = option(command)
    return command


@click.command()
@_model_options
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
    from tribo.display import exact_text
    from tribo.mechanisms_in_model import columns_from, parse_given, parse_with
    from tribo.own_folder import check_file, only_writer_of
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


@click.command()
@click.argument("target", type=GivenPath(dir_okay=False))
@click.option(
    "--measured", type=GivenPath(), multiple=True, metavar="CAMPAIGN",
    help="Campaign on an earlier design, as DESIGN-N/campaign is written, with its exports. Can be repeated.",
)  # fmt: skip
@output_options()
@command_options
def design(console: Console, target: Path, measured: tuple[Path, ...], out: Path, seed: int, jobs: int) -> int:
    """Find patterns for a wanted friction.

    TARGET.toml states the wanted friction, the families of patterns with their bounds and limits of making, and the
    material. OUT receives ranked designs with predictions and intervals, their masks, and the campaign that would
    disprove each. If the same command is started again, it computes only the missing runs. With --measured, what the
    model missed on designs that were measured corrects the prediction of new ones. The exit status is 1 where the
    target cannot be had.
    """
    from tribo.design.answer import design as find
    from tribo.design.answer_files import write_answer
    from tribo.design.target import read_target
    from tribo.own_folder import only_writer_of, place_problems

    wanted = read_target(target)
    if inside := place_problems(out, measured):
        raise CampaignError(inside)
    earlier = [sample for path in measured for sample in _measured(console, path, jobs)]
    kept = _kept(out, console)
    with only_writer_of(out / "answer.json", console.wait_s):
        with console.progress() as progress:
            outcome, spaces = find(wanted, target.parent, kept, seed, jobs, progress, earlier)
        write_answer(outcome, spaces, wanted, out)
    lines = [
        f"{a.rank}. " + ", ".join(f"{k} {v:g}" for k, v in a.lengths_um.items()) + "".join(
            f"\n   {p.want}: {p.value:.3g} (90 % interval {p.low:.3g} to {p.high:.3g}), wanted {p.goal}: "
            f"{'met' if p.met else f'{p.off_percent:.0f} % off'}"
            for p in a.predictions
        )
        for a in outcome.answers
    ]  # fmt: skip
    if outcome.refusal:
        lines = ["This cannot be had. " + "; ".join(outcome.refusal), "The nearest that can:", *lines]
    lines += outcome.learnt
    console.result(asdict(outcome) | {"out": str(out)}, "\n".join([*lines, *outcome.notes, f"written to {out}"]))
    return UNUSABLE if outcome.refusal else 0


def _measured(console: Console, path: Path, jobs: int) -> list[Measured]:
    """The samples of a campaign with their laws; tests that are set aside are listed."""
    from tribo.campaign import open_campaign
    from tribo.design.answer import measured_of
    from tribo.stages import StudyOptions, study

    with open_campaign(path) as opened, console.progress() as progress:
        found = study(opened, StudyOptions(jobs=jobs), until="fit", progress=progress)
    console.status_after(found.ingested.set_aside)
    return measured_of(found.ingested.campaign, found.fits, path.name if path.name != "campaign" else str(path))


PATTERNS = {
    "square": ("circle", "square"), "hexagonal": ("circle", "hexagonal"), "staggered": ("circle", "staggered"),
    "ridge": ("ridge", "square"), "squares": ("square", "square"),
}  # fmt: skip


@click.command("map")
@click.option("--pattern", type=click.Choice(list(PATTERNS)), required=True, help="Family of patterns.")
@click.option("--pillars", is_flag=True, help="The shapes touch, instead of being cavities.")
@click.option("--vary", default="diameter,pitch", show_default=True, help="The two lengths to vary.")
@click.option(
    "--size", nargs=2, type=float, default=(5.0, 25.0), show_default=True,
    help="Least and largest size of a shape in um.",
)  # fmt: skip
@click.option(
    "--pitch", nargs=2, type=float, default=(12.0, 40.0), show_default=True,
    help="Least and largest distance between the centres of neighbouring shapes in um.",
)  # fmt: skip
@click.option("--pressure", "pressure_kPa", type=float, default=10.0, show_default=True, help="Pressure in kPa.")
@click.option("--points", type=click.IntRange(3, 40), default=10, show_default=True, help="Values of each length.")
@click.option("--smallest-wall", type=float, default=2.0, show_default=True, help="Smallest wall in um.")
@output_options()
@command_options
def map_family(
    console: Console, pattern: str, pillars: bool, vary: str, size: tuple[float, float], pitch: tuple[float, float],
    pressure_kPa: float, points: int, smallest_wall: float, out: Path, seed: int, jobs: int,
) -> None:  # fmt: skip
    """Show what friction a family of patterns can have.

    Writes map.csv and map.png with static and sliding friction against two lengths; patterns that cannot be made stay
    white. If the same command is started again, it computes only the missing runs.
    """
    from tribo.design.answer_files import map_csv, map_png, mapped
    from tribo.design.rounds import Rounds
    from tribo.design.target import Family, Space
    from tribo.files import write_bytes, write_text
    from tribo.springblock.config import SimConfig

    cavity, lattice = PATTERNS[pattern]
    first = "diameter_um" if cavity == "circle" else "size_x_um"
    if sorted(vary.replace(" ", "").split(",")) not in (["diameter", "pitch"], ["pitch", "size"]):
        raise click.UsageError("--vary diameter,pitch is what these families have")
    family = Family.model_validate({
        "cavity": cavity, "lattice": lattice, "feature": "pillar" if pillars else "hole", first: list(size),
        "pitch_um": list(pitch), "smallest_wall_um": smallest_wall,
    })  # fmt: skip
    kept = _kept(out, console)
    with console.progress() as progress:
        wanted = [("static", 1e3 * pressure_kPa, "all"), ("sliding", 1e3 * pressure_kPa, "all")]
        all_rounds = Rounds([Space(family, 0)], wanted, kept, seed, jobs)
        base = SimConfig(duration_peaks=2.0, cavity_shape="exact")
        rows = mapped(all_rounds, (first, "pitch_um"), points, base, progress)
    made = [row for row in rows if not row["fault"]]
    if not made:
        raise CampaignError(Problem("cannot_be_made", f"no pattern of this map can be made: {rows[0]['fault']}"))
    write_text(out / "map.csv", map_csv(rows))
    title = f"{'pillars' if pillars else 'holes'}, {pattern}, {pressure_kPa:g} kPa"
    write_bytes(out / "map.png", map_png(rows, (first, "pitch_um"), title))
    spans = {
        regime: (min(float(r[regime]) for r in made), max(float(r[regime]) for r in made))
        for regime in ("static", "sliding")
    }
    words = ", ".join(f"{regime} T/N {low:.3g} to {high:.3g}" for regime, (low, high) in spans.items())
    console.result(
        {"out": str(out), "patterns": len(made), **{k: list(v) for k, v in spans.items()}},
        f"{len(made)} of {len(rows)} patterns can be made: {words}; written to {out}",
    )


def _kept(out: Path, console: Console) -> Path:
    """Where the runs of a command are kept, in an empty folder or one of an earlier start."""
    kept = out / "kept"
    if out.exists() and any(out.iterdir()) and not (kept.is_dir() or console.force):
        allowed = "an empty folder, or one of an earlier start of this command"
        raise CampaignError(Problem("not_own", "this folder holds files of others", file=str(out), allowed=allowed))
    kept.mkdir(parents=True, exist_ok=True)
    return kept
