"""A declarative design of simulations: samples x pressures x angles x repeats x parameters, from a file or options.

A design is a table, in TOML or JSON::

    samples = ["F", "B", "G"]
    pressures_kPa = [3, 10, 25]
    angles_deg = "midpoints"          # or "random" within strata, "nominal", or a list of degrees
    repeats = 4
    seed = 0
    reading = "text"                  # of the paper, or "berardo2019", the one closest to its Table 2

    [parameters]                      # any field of SimConfig, LocalFriction or FrictionTerms, in SI units
    dt_s = 5e-8
    shear_factor = [0.5, 1.0]         # a list is one more dimension of the design

    [patterns.G]                      # as in campaign.toml, for samples the paper does not have
    cavity = "circle"
    diameter_um = 10
    pitch_um = 20
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator

from tribo.campaign.description import PatternTable
from tribo.errors import Problem, SimulationError, system_problem
from tribo.input_files import (
    DEEPEST_NESTING,
    LARGEST_DESCRIPTION_BYTES,
    MOST_RUNS,
    nests_too_deeply,
    read_input,
    toml_table,
)
from tribo.records import Pattern
from tribo.springblock.config import ANGLES, PAPER_PRESSURES_PA, PAPER_SAMPLES, FrictionTerms, LocalFriction, SimConfig
from tribo.springblock.ensemble import AngleRule, angle_range_deg, check_all, middle_deg, stratified_design
from tribo.user_text import did_you_mean

DESIGNED = {"sample", "pattern", "pressure_Pa", "angle_deg", "seed", "friction", "terms"}
PAIRS = {"blocks", "pattern_first"}  # two numbers are one value


class DesignTable(BaseModel):
    """The keys of a design; their descriptions state the allowed values."""

    model_config = ConfigDict(extra="forbid")

    samples: Annotated[list[str], Field(min_length=1, description="a list of names, at least one")]
    pressures_kPa: Annotated[list[float], Field(min_length=1, description="a list of numbers in kPa, at least one")]
    angles_deg: Annotated[
        list[float] | str | None,
        Field(description="midpoints, random, nominal, or a list of degrees", union_mode="left_to_right"),
    ] = None
    repeats: Annotated[int, Field(ge=1, description="a whole number, 1 or more")] = 4
    seed: Annotated[int, Field(ge=0, lt=2**63, description="a whole number, 0 or more, below 2^63")] = 0
    reading: Annotated[Literal["text", "berardo2019"], Field(description="text or berardo2019")] = "text"
    parameters: Annotated[dict[str, Any], Field(description="a table of parameters")] = {}
    patterns: Annotated[dict[str, PatternTable], Field(description="tables as in campaign.toml")] = {}

    @field_validator("angles_deg")
    @classmethod
    def _known_rule(cls, angles: list[float] | str | None) -> list[float] | str | None:
        if angles not in (*get_args(AngleRule), None) and (isinstance(angles, str) or not angles):
            raise ValueError("unknown rule for the angles")
        return angles


def read_design(path: str | Path, seed: int = 0) -> list[SimConfig]:
    """The runs of a design file (.json, else TOML); ``seed`` is for one that names none.

    Raises
    ------
    SimulationError
        The file cannot be read, or the design is impossible: every fault at once.
    """
    path = Path(path)
    try:
        text = read_input(path, LARGEST_DESCRIPTION_BYTES).decode("utf-8-sig")
        table = json.loads(text) if path.suffix.lower() == ".json" else toml_table(text)
    except OSError as why:
        raise SimulationError(system_problem(why, str(path))) from why
    except ValueError as why:
        kind = "JSON" if path.suffix.lower() == ".json" else "TOML"
        raise SimulationError(Problem("unreadable", f"cannot be read as {kind}: {why}", file=str(path))) from why
    except RecursionError as why:
        raise SimulationError(_too_deep(path)) from why
    if nests_too_deeply(table):
        raise SimulationError(_too_deep(path))
    if not isinstance(table, dict):
        raise SimulationError(Problem("wrong_value", "must be a table", file=str(path), found=type(table).__name__))
    return runs_of_design({"seed": seed, **table}, file=str(path))


def _too_deep(path: Path) -> Problem:
    allowed = f"at most {DEEPEST_NESTING} levels"
    return Problem("too_deep", "tables and arrays nested too deeply", file=str(path), allowed=allowed)


def runs_of_design(table: Mapping[str, Any], file: str | None = None) -> list[SimConfig]:
    """The runs of a design, in an order that depends on the design alone.

    Every combination of parameters meets the same random numbers, so that combinations are compared in pairs.

    Raises
    ------
    SimulationError
        Unknown keys, wrong types, unknown samples and impossible configurations, all at once.
    """
    problems: list[Problem] = []
    design = _checked(table, problems)
    axes = _axes(design.parameters, problems)
    if too_many := _too_many(design, axes):
        raise SimulationError([p.at(file=file) for p in (*problems, too_many)])
    patterns = {}
    for name, described in design.patterns.items():
        try:
            patterns[name] = described.pattern(name, Path(file).parent if file else None)
        except (OSError, ValueError) as why:
            raise SimulationError(Problem("mask", str(why), file=file, column=f"patterns.{name}")) from why
    runs = [
        run
        for combination in product(*axes.values())
        for run in stratified_design(
            {sample: _pattern_of(sample, patterns) for sample in design.samples},
            [1e3 * p for p in design.pressures_kPa],
            design.repeats,
            design.seed,
            with_parameters(SimConfig().of_reading(design.reading), dict(zip(axes, combination, strict=True))),
            design.angles_deg or ANGLES[design.reading],  # type: ignore[arg-type]
        )
    ]
    try:
        check_all(runs)
    except SimulationError as refused:
        problems += refused.problems
    if problems:
        raise SimulationError([p.at(file=file) for p in problems])
    return runs


def _too_many(design: DesignTable, axes: Mapping[str, Sequence[Any]]) -> Problem | None:
    """The number of runs as a problem where it is beyond the limit; nothing is laid out before."""
    runs = design.repeats * len(design.samples) * len(design.pressures_kPa)
    runs *= math.prod(len(values) for values in axes.values())
    runs *= len(design.angles_deg) if isinstance(design.angles_deg, list) else 1
    if runs <= MOST_RUNS:
        return None
    found = f"{runs} runs" if runs < 10**15 else f"about 10^{len(str(runs)) - 1} runs"
    return Problem("too_many_runs", "this design has too many runs", found=found, allowed=f"at most {MOST_RUNS} runs")


def described_by_options(options: Mapping[str, Any], seed: int, table2: bool) -> tuple[bool, dict[str, Any]]:
    """The design that the options of ``tribo simulate`` describe, and whether it is one single run."""
    samples = list(options["samples"]) or (list(PAPER_SAMPLES) if table2 else [])
    pressures = list(options["pressures_kPa"]) or ([p / 1e3 for p in PAPER_PRESSURES_PA] if table2 else [])
    given = {name: options[name] for name in ("blocks", "dt_s", "engine") if options[name] is not None}
    parameters = given | dict(setting(text) for text in options["settings"])
    if options["duration_ms"] is not None:
        parameters["duration_s"] = 1e-3 * options["duration_ms"]
    lists = [samples, pressures, options["angles_deg"], *(v for n, v in parameters.items() if is_axis(n, v))]
    one = not table2 and options["repeats"] is None and all(len(values) <= 1 for values in lists)
    angles = list(options["angles_deg"]) or ([middle_deg(angle_range_deg(samples[0]))] if one else None)
    repeats = (1 if one else 20 if table2 else 4) if options["repeats"] is None else options["repeats"]
    return one, {
        "samples": samples, "pressures_kPa": pressures, "angles_deg": angles, "repeats": repeats, "seed": seed,
        "parameters": parameters, "reading": options.get("reading") or "text",
    }  # fmt: skip


def asked_runs(described: Mapping[str, Any], own_seed: int | None) -> list[SimConfig]:
    """The runs of a described design; a single run has the given seed itself, not one derived from it."""
    runs = runs_of_design(described)
    return runs if own_seed is None else [run.with_(seed=own_seed) for run in runs]


def together(*parts: Callable[[], Any]) -> tuple[Any, ...]:
    """The results of all parts, or SimulationError with the faults of all of them."""
    results: list[Any] = []
    problems: list[Problem] = []
    for part in parts:
        try:
            results.append(part())
        except SimulationError as refused:
            problems += refused.problems
    if problems:
        raise SimulationError(problems)
    return tuple(results)


def is_axis(name: str, value: Any) -> bool:
    """Whether a parameter is given a list of values; two numbers are one value of those that are pairs."""
    return isinstance(value, list) and (name not in PAIRS or any(isinstance(part, list) for part in value))


def setting(text: str) -> tuple[str, Any]:
    """NAME=VALUE[,VALUE...] as a parameter of a design; values as in JSON, else text."""
    name, _, value = text.partition("=")
    values = [value] if value.startswith("[") else value.split(",")
    parsed = [_number_or_text(v) for v in values]
    return name.strip(), parsed[0] if len(parsed) == 1 else parsed


def _number_or_text(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text.strip()


def _checked(table: Mapping[str, Any], problems: list[Problem]) -> DesignTable:
    """The table without its faulty keys, so that the rest is checked as well; the faults go to ``problems``."""
    try:
        return DesignTable.model_validate(table)
    except ValidationError as why:
        errors = {error["loc"][0]: error for error in reversed(why.errors())}
    problems += [_problem(error) for error in reversed(errors.values())]
    stand_in = {"samples": ["F"], "pressures_kPa": [10.0]}
    return DesignTable.model_validate(stand_in | {k: v for k, v in table.items() if k not in errors})


def _problem(error: Any) -> Problem:
    key, keys = str(error["loc"][0]), list(DesignTable.model_fields)
    column = ".".join(str(part) for part in error["loc"] if not str(part).startswith(("list[", "str")))
    if error["type"] == "missing":
        return Problem("missing_key", "this required key is missing", column=column)
    if error["type"] == "extra_forbidden" and key not in keys:
        return Problem("unknown_key", "unknown key", column=key, found=key, allowed=_nearest(key, keys))
    allowed = DesignTable.model_fields[key].description
    what = error["msg"].removeprefix("Value error, ")
    what = what[:1].lower() + what[1:]
    return Problem("wrong_value", what, column=column, found=str(error["input"]), allowed=allowed)


def _nearest(name: str, allowed: Sequence[str]) -> str:
    return did_you_mean(name, allowed) or ", ".join(allowed)


def _types() -> dict[str, Any]:
    """Type of every parameter a design may set."""
    parts = (SimConfig, LocalFriction, FrictionTerms)
    hints = {name: hint for part in parts for name, hint in get_type_hints(part).items()}
    return {name: hint for name, hint in hints.items() if name not in DESIGNED}


def _axes(parameters: Mapping[str, Any], problems: list[Problem]) -> dict[str, list[Any]]:
    """Values of every parameter, one or more; unknown names and wrong types go to ``problems``."""
    types = _types()
    axes = {}
    for name, given in parameters.items():
        if name not in types:
            problems.append(
                Problem("unknown_key", "unknown parameter", column=f"parameters.{name}", found=name,
                        allowed=_nearest(name, list(types)))
            )  # fmt: skip
            continue
        axes[name] = list(_values(name, given, types[name], problems))
    return {name: values for name, values in axes.items() if values}  # the rest is checked without them


def _values(name: str, given: Any, hint: Any, problems: list[Problem]) -> Iterator[Any]:
    """The values of one parameter as the configuration takes them."""
    for value in given if is_axis(name, given) else [given]:
        if name == "blocks" and isinstance(value, int):
            value = [value, value]
        try:
            yield TypeAdapter(hint).validate_python(value)
        except ValidationError as why:
            expected = why.errors()[0]["msg"].removeprefix("Input should be ")
            problems.append(Problem("wrong_value", "wrong type of value", column=f"parameters.{name}",
                                    found=str(value), allowed=expected))  # fmt: skip


def _pattern_of(sample: str, patterns: Mapping[str, Pattern]) -> Pattern | None:
    """The pattern a design gives a sample: its own, or that of which it is a direction ("Gx" is G along x)."""
    return patterns.get(sample) or (patterns.get(sample[:-1]) if sample[-1:] in ("x", "y") else None)


def with_parameters(base: SimConfig, values: Mapping[str, Any]) -> SimConfig:
    def of(part: type) -> dict[str, Any]:
        return {f.name: values[f.name] for f in fields(part) if f.name in values}

    friction = replace(base.friction, **of(LocalFriction))
    return base.with_(**of(SimConfig), friction=friction, terms=replace(base.terms, **of(FrictionTerms)))
