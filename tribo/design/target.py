"""TARGET.toml: what friction is wanted, of which patterns, of which material; everything wrong with it at once.

The free lengths of a family are points in a unit cube. Its patterns lie on the grid of the mask; some cannot be made.
"""

from __future__ import annotations

import csv
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from scipy.stats import qmc

from tribo.campaign.geometry import Making, faults_of_making, smallest_feature_m, smallest_wall_m
from tribo.errors import Problem, SimulationError
from tribo.files import text_of
from tribo.input_files import LARGEST_DESCRIPTION_BYTES, read_input
from tribo.records import FloatArray, Pattern

Positive = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]
Span = Annotated[list[Positive], Field(min_length=2, max_length=2)]
Direction = Literal["x", "y", "all"]


class Want(BaseModel):
    """One [[target]]: T/N, a ratio of two directions, or static over sliding."""

    model_config = ConfigDict(extra="forbid")

    friction: Literal["static", "sliding", "static over sliding"]
    pressure_kPa: Positive | None = None
    normal_load_N: Positive | None = None
    direction: Direction = "all"
    over: Direction | None = None
    value: Positive | None = None
    value_N: Positive | None = None
    tolerance_percent: Annotated[float, Field(gt=0, le=50)] = 5.0
    at_least: Positive | None = None
    at_most: Positive | None = None
    best: Literal["largest", "smallest"] | None = None

    @model_validator(mode="after")
    def _one_goal(self) -> Want:
        goals = [k for k in ("value", "value_N", "best") if getattr(self, k) is not None]
        bounds = self.at_least is not None or self.at_most is not None
        if len(goals) + bounds != 1:
            raise ValueError("state one of: value, value_N, best, or at_least and at_most")
        if (self.pressure_kPa is None) == (self.normal_load_N is None):
            raise ValueError("state pressure_kPa or normal_load_N")
        if self.value_N is not None and (self.normal_load_N is None or self.over or "over" in self.friction):
            raise ValueError("value_N is a force at a normal_load_N; ratios have a value")
        if self.at_least and self.at_most and self.at_least >= self.at_most:
            raise ValueError("at_least lies below at_most")
        return self

    def text(self) -> str:
        what = f"{self.friction} friction" + (f" along {self.direction}" if self.direction != "all" else "")
        what += f" over {self.over}" if self.over else ""
        at = f" at {self.pressure_kPa:g} kPa" if self.pressure_kPa else f" at {self.normal_load_N:g} N"
        return what + at


class Family(BaseModel):
    """One [[pattern]]: a family with fixed lengths, and free ones as [lowest, highest]."""

    model_config = ConfigDict(extra="forbid")

    cavity: Literal["circle", "square", "rectangle", "ellipse", "ridge", "chevron"]
    feature: Literal["hole", "pillar"] = "hole"
    lattice: Literal["square", "staggered", "hexagonal"] = "square"
    diameter_um: Positive | Span | None = None
    size_x_um: Positive | Span | None = None
    size_y_um: Positive | Span | None = None
    pitch_um: Positive | Span | None = None
    pitch_x_um: Positive | Span | None = None
    pitch_y_um: Positive | Span | None = None
    smallest_feature_um: Positive = 1.0
    smallest_wall_um: Positive = 1.0
    mask_grid_um: Positive = 0.5
    tolerance_um: Positive = 0.25

    @property
    def lengths(self) -> tuple[str, ...]:
        if self.cavity == "circle":
            return ("diameter_um", "pitch_um")
        if self.cavity in ("square", "ridge"):
            return ("size_x_um", "pitch_um")
        return ("size_x_um", "size_y_um", "pitch_x_um", "pitch_y_um")

    @model_validator(mode="after")
    def _has_its_lengths(self) -> Family:
        known = ("diameter_um", "size_x_um", "size_y_um", "pitch_um", "pitch_x_um", "pitch_y_um")
        given = {name for name in known if getattr(self, name) is not None}
        if given != set(self.lengths):
            raise ValueError(f"cavity = {self.cavity} has the lengths {', '.join(self.lengths)}")
        for name in given:
            if isinstance(span := getattr(self, name), list) and span[0] >= span[1]:
                raise ValueError(f"{name} is [lowest, highest]")
        return self


class Material(BaseModel):
    """[material]: the paper's local friction, two laws of a flat sample, or a finished report that has them."""

    model_config = ConfigDict(extra="forbid")

    static: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None  # mu, tau0 in kPa
    sliding: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    report: str | None = None
    flat: str = "F"
    model_error_percent: Annotated[float, Field(ge=0, le=200)] | None = None


class Target(BaseModel):
    """The whole of TARGET.toml."""

    model_config = ConfigDict(extra="forbid")

    title: str = "A pattern for a wanted friction"
    nominal_area_mm2: Positive = 100.0
    needs: list[str] = []
    target: Annotated[list[Want], Field(min_length=1)]
    pattern: Annotated[list[Family], Field(min_length=1)]
    material: Material = Material()
    parameters: dict[str, Any] = {}
    designs: Annotated[int, Field(ge=1, le=10)] = 3

    def pressure_Pa(self, want: Want) -> float:
        if want.pressure_kPa is not None:
            return 1e3 * want.pressure_kPa
        assert want.normal_load_N is not None
        return want.normal_load_N / (1e-6 * self.nominal_area_mm2)

    def goal(self, want: Want) -> float | None:
        """The wanted T/N or ratio; None for a bound or a best value."""
        if want.value_N is not None:
            return want.value_N / (1e-6 * self.nominal_area_mm2 * self.pressure_Pa(want))
        return want.value


def read_target(path: Path) -> Target:
    """The checked target; SimulationError with every fault, and with what the model does not contain."""
    file = str(path)
    try:
        table = tomllib.loads(read_input(path, LARGEST_DESCRIPTION_BYTES).decode("utf-8-sig"))
    except (OSError, ValueError) as why:
        raise SimulationError(Problem("unreadable", f"cannot be read as TOML: {why}", file=file)) from why
    try:
        found = Target.model_validate(table)
    except ValidationError as why:
        raise SimulationError(
            [
                Problem(
                    "wrong_value", error["msg"].removeprefix("Value error, "), file=file,
                    column=".".join(str(part) for part in error["loc"]) or None,
                    found=None if isinstance(error["input"], dict | list) else str(error["input"])[:80],
                )
                for error in why.errors()
            ]
        ) from why  # fmt: skip
    missing = [
        Problem(
            "not_in_model", "the model does not contain this; no pattern can be designed for it", file=file,
            column="needs", found=need, allowed="dry friction of a flat patterned surface: loads, directions, patterns",
        )
        for need in found.needs
    ]  # fmt: skip
    if missing:
        raise SimulationError(missing)
    return found


def laws_of_report(folder: Path, flat: str) -> dict[str, tuple[float, float]]:
    """mu and tau0 (Pa) of the flat sample in the fits.csv of a report, by regime."""
    try:
        rows = list(csv.DictReader(text_of(folder / "fits.csv").splitlines()))
        found = {r["regime"]: (float(r["mu"]), 1e3 * float(r["tau0_kPa"])) for r in rows if r["sample"] == flat}
    except (OSError, KeyError, ValueError) as why:
        raise SimulationError(Problem("no_laws", f"no laws in this report: {why}", file=str(folder))) from why
    if set(found) != {"static", "sliding"}:
        raise SimulationError(
            Problem("no_laws", "this report has no static and sliding law of the flat sample", file=str(folder),
                    column="material.flat", found=flat)
        )  # fmt: skip
    return found


def corrections_of_report(folder: Path, flat: str) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of ln(measured over simulated) of the patterned samples of a report, by regime."""
    try:
        rows = list(csv.DictReader(text_of(folder / "comparison.csv").splitlines()))
    except OSError:
        return {}
    found = {}
    for regime in ("static", "sliding"):
        by_sample: dict[str, list[float]] = {}
        for row in rows:
            if row["regime"] == regime and row["sample"] != flat and row["measured_N"] and row["simulated_N"]:
                ratio = float(row["measured_N"]) / float(row["simulated_N"])
                by_sample.setdefault(row["sample"], []).append(math.log(ratio))
        means = [float(np.mean(v)) for v in by_sample.values()]
        if means:
            spread = float(np.std(means, ddof=1)) if len(means) > 2 else 0.1
            found[regime] = (float(np.mean(means)), spread * math.sqrt(1 + 1 / len(means)))
    return found


_UM = 1e-6
NEAR = 0.1  # of the span of every length: how far a search looks beside a good design


@dataclass(frozen=True)
class Space:
    """One family; its free lengths and their bounds in um."""

    family: Family
    number: int

    @property
    def free(self) -> dict[str, tuple[float, float]]:
        spans = {name: getattr(self.family, name) for name in self.family.lengths}
        return {name: (s[0], s[1]) for name, s in spans.items() if isinstance(s, list)}

    @property
    def making(self) -> Making:
        f = self.family
        return Making(f.smallest_feature_um * _UM, f.smallest_wall_um * _UM, f.mask_grid_um * _UM)

    def lengths_um(self, x: FloatArray) -> dict[str, float]:
        """All lengths at a point of the cube, free ones on the grid of the mask."""
        grid = self.family.mask_grid_um
        found = {name: getattr(self.family, name) for name in self.family.lengths}
        for share, (name, (low, high)) in zip(x, self.free.items(), strict=True):
            steps = round((low + float(share) * (high - low)) / grid)
            found[name] = min(max(steps, math.ceil(low / grid - 1e-9)), math.floor(high / grid + 1e-9)) * grid
        return found

    def pattern(self, lengths_um: dict[str, float], name: str = "P") -> Pattern:
        """The pattern with these lengths."""
        f, um = self.family, {k: v * _UM for k, v in lengths_um.items()}
        a = um.get("diameter_um", um.get("size_x_um", 0.0))
        px = um.get("pitch_um", um.get("pitch_x_um", 0.0))
        py = px * 3**0.5 / 2 if f.lattice == "hexagonal" else um.get("pitch_y_um", px)
        hexagonal = "hexagonal" if f.lattice == "hexagonal" else "rows"
        size, staggered = (a, um.get("size_y_um", a)), f.lattice != "square"
        return Pattern(name, f.cavity, size, (px, py), staggered, None, f.feature, hexagonal)

    def fault(self, lengths_um: dict[str, float]) -> str:
        """Why these lengths cannot be made, or not be simulated; empty where they can."""
        pattern = self.pattern(lengths_um)
        if (axis := pattern.too_wide_along[:1]) and pattern.size_m and pattern.pitch_m:
            k = "xy".index(axis)
            size, pitch = pattern.size_m[k] / _UM, pattern.pitch_m[k] / _UM
            return f"the cavities are {size:g} um wide and {pitch:g} um apart along {axis}"
        return next(faults_of_making(pattern, self.making), "")

    def at(self, lengths_um: dict[str, float]) -> FloatArray:
        """The point of the cube of these lengths, and their area fraction: the inputs of a surrogate."""
        shares = [(lengths_um[name] - low) / (high - low) for name, (low, high) in self.free.items()]
        return np.array([*shares, self.pattern(lengths_um).area_fraction])

    def candidates(self, n: int, seed: int) -> list[dict[str, float]]:
        """Up to n different patterns that can be made, spread evenly."""
        return self.candidates_between(np.zeros(len(self.free)), np.ones(len(self.free)), n, seed)

    def candidates_near(self, lengths_um: dict[str, float], n: int, seed: int) -> list[dict[str, float]]:
        """The same, every length within NEAR of its span from those of a pattern."""
        middle = self.at(lengths_um)[:-1]
        return self.candidates_between(np.maximum(middle - NEAR, 0.0), np.minimum(middle + NEAR, 1.0), n, seed)

    def candidates_between(self, low: FloatArray, high: FloatArray, n: int, seed: int) -> list[dict[str, float]]:
        """The same between two corners of the cube of the lengths."""
        if not self.free:
            fixed = self.lengths_um(np.zeros(0))
            return [] if self.fault(fixed) else [fixed]
        points = qmc.Sobol(len(self.free), seed=seed).random_base2(max(3, math.ceil(math.log2(2 * n))))
        points = low + (high - low) * points
        found: dict[tuple[float, ...], dict[str, float]] = {}
        for x in points:
            lengths = self.lengths_um(x)
            if len(found) < n and not self.fault(lengths):
                found.setdefault(tuple(lengths.values()), lengths)
        return list(found.values())

    def limits_at(self, lengths_um: dict[str, float]) -> list[str]:
        """Bounds and limits of making that lie within a grid step of these lengths."""
        grid, f, pattern = self.family.mask_grid_um, self.family, self.pattern(lengths_um)
        found = [
            f"{name} = {value:g} um is its {what} bound"
            for name, (low, high) in self.free.items()
            for value in [lengths_um[name]]
            for what, bound in (("lower", low), ("upper", high))
            if abs(value - bound) < 1.01 * grid
        ]
        if smallest_wall_m(pattern) / _UM - f.smallest_wall_um < 2.01 * grid:
            found.append(f"the smallest wall that can be made is {f.smallest_wall_um:g} um")
        if smallest_feature_m(pattern) / _UM - f.smallest_feature_um < 1.01 * grid:
            found.append(f"the smallest feature that can be made is {f.smallest_feature_um:g} um")
        return found
