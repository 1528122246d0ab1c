"""tribo design: patterns for a wanted friction; tribo map: a family of patterns as a chart."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from tribo.cli.console import UNUSABLE, Console, GivenPath, command_options, output_options
from tribo.errors import CampaignError, Problem


@click.command()
@click.argument("target", type=GivenPath(dir_okay=False))
@output_options()
@command_options
def design(console: Console, target: Path, out: Path, seed: int, jobs: int) -> int:
    """Find patterns for a wanted friction.

    TARGET.toml states the wanted friction, the families of patterns with their bounds and limits of making, and the
    material. OUT receives ranked designs with predictions and intervals, their masks, and the campaign that would
    disprove each. If the same command is started again, it computes only the missing runs. The exit status is 1 where
    the target cannot be had.
    """
    from tribo.cache.own_folder import only_writer_of
    from tribo.design.answer import design as find
    from tribo.design.answer_files import write_answer
    from tribo.design.target import read_target

    wanted = read_target(target)
    kept = _kept(out, console)
    with only_writer_of(out / "answer.json", console.wait_s):
        with console.progress() as progress:
            outcome, spaces = find(wanted, target.parent, kept, seed, jobs, progress)
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
    console.result(asdict(outcome) | {"out": str(out)}, "\n".join([*lines, *outcome.notes, f"written to {out}"]))
    return UNUSABLE if outcome.refusal else 0


PATTERNS = {
    "square": ("circle", "square"), "hexagonal": ("circle", "hexagonal"), "staggered": ("circle", "staggered"),
    "ridge": ("ridge", "square"), "squares": ("square", "square"),
}  # fmt: skip


@click.command("map")
@click.option("--pattern", type=click.Choice(list(PATTERNS)), required=True, help="Family of patterns.")
@click.option("--pillars", is_flag=True, help="The shapes touch, instead of being cavities.")
@click.option("--vary", default="diameter,pitch", show_default=True, help="The two lengths to vary.")
@click.option("--size", nargs=2, type=float, default=(5.0, 25.0), show_default=True, help="Bounds in um.")
@click.option("--pitch", nargs=2, type=float, default=(12.0, 40.0), show_default=True, help="Bounds in um.")
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
    from tribo.design.family_map import map_csv, map_png, mapped
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
