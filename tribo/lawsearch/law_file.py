"""law.toml: a law that was found, written down so that it can be tested on another campaign."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from tribo.diagnostics.verdict import Estimate
from tribo.errors import CampaignError, Problem
from tribo.files import text_of
from tribo.input_files import toml_table
from tribo.lawsearch.grammar import ADHESION_TERM, AMPLITUDES, BOTH, LOAD_TERM, MOST_VALUES, Shape, T, WrittenLaw

SCHEMA = "tribo.law/1"
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class ShapeTable(_Strict):
    """[[shape]]: a function of one column."""

    kind: Literal[
        "linear", "log", "step", "soft step", "ramp", "optimum", "log optimum", "hump", "saturating", "window", "wave",
        "level", "levels",
    ]
    column: str
    low: Finite = 0.0
    high: Finite = 1.0
    place: Finite | None = None
    width: Finite | None = None
    level: str = ""
    values: list[Finite | str] = Field(default=[], max_length=MOST_VALUES)

    def shape(self) -> Shape:
        nan = float("nan")
        place = nan if self.place is None else self.place
        width = nan if self.width is None else self.width
        return Shape(self.kind, self.column, self.low, self.high, place, width, self.level, tuple(self.values))


class ParameterTable(_Strict):
    """[parameters.a]: the value found, with its 90 % interval."""

    value: Finite
    low: Finite
    high: Finite
    unit: str = ""


class LawTable(_Strict):
    """The whole file."""

    schema_name: Literal["tribo.law/1"] = Field(alias="schema")
    acts_on: Literal["T", "load term", "adhesion term"]
    regime: Literal["static", "sliding", "both"]
    where: str
    where_scale: Finite = 1.0
    formula: str = ""
    found_in: str = ""
    shape: list[ShapeTable] = Field(min_length=1, max_length=2)
    parameters: dict[str, ParameterTable]

    @model_validator(mode="after")
    def _has_amplitudes(self) -> LawTable:
        shape = self.shape[0]
        if (shape.kind == "levels") != (len(shape.values) > 1):
            raise ValueError("levels, and they alone, have two values or more")
        wanted = 2 if shape.kind == "wave" else max(len(shape.values) - 1, 1)
        if missing := [name for name in AMPLITUDES[:wanted] if name not in self.parameters]:
            raise ValueError(f"[parameters.{missing[0]}] is missing")
        return self


assert {T, LOAD_TERM, ADHESION_TERM, BOTH} == {"T", "load term", "adhesion term", "both"}


def law_text(law: WrittenLaw, parameters: Mapping[str, Estimate], found_in: str) -> str:
    """law.toml of a law with its parameters, found in the campaign of this title."""
    quoted = partial(json.dumps, ensure_ascii=True)  # escapes of JSON are escapes of TOML
    lines = [
        f"schema = {quoted(SCHEMA)}", f"formula = {quoted(law.formula())}", f"found_in = {quoted(found_in)}",
        f"acts_on = {quoted(law.acts_on)}", f"regime = {quoted(law.regime)}", f"where = {quoted(law.where)}",
        f"where_scale = {law.where_scale!r}",
    ]  # fmt: skip
    for s in law.shapes:
        lines += ["", "[[shape]]", f"kind = {quoted(s.kind)}", f"column = {quoted(s.column)}"]
        lines += [f"low = {s.low!r}", f"high = {s.high!r}"]
        lines += [f"{name} = {value!r}" for name, value in (("place", s.place), ("width", s.width)) if value == value]
        lines += [f"level = {quoted(s.level)}"] if s.level else []
        lines += [f"values = {json.dumps(list(s.values))}"] if s.values else []
    for name, e in parameters.items():
        lines += ["", f"[parameters.{name}]", f"value = {e.value!r}", f"low = {e.low!r}", f"high = {e.high!r}"]
        lines += [f"unit = {quoted(e.unit)}"]
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class KnownLaw:
    """A law of an earlier campaign: the ``name`` of its file, the title of the campaign, and its parameters."""

    name: str
    found_in: str
    law: WrittenLaw
    parameters: Mapping[str, Estimate]


def read_law(path: Path) -> KnownLaw:
    """The law of a law.toml.

    Raises
    ------
    CampaignError
        The file is no law, with every fault of it.
    """
    try:
        table = LawTable.model_validate(toml_table(text_of(path)))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as why:
        raise CampaignError(Problem("bad_toml", f"not a TOML file: {why}", file=path.name)) from None
    except RecursionError:
        raise CampaignError(Problem("bad_toml", "tables nested too deeply", file=path.name)) from None
    except ValidationError as why:
        raise CampaignError(
            Problem("bad_law", e["msg"], file=path.name, column=".".join(map(str, e["loc"]))) for e in why.errors()
        ) from None
    shapes = tuple(s.shape() for s in table.shape)
    law = WrittenLaw(shapes, table.acts_on, table.regime, table.where, table.where_scale)
    parameters = {name: Estimate(p.value, p.low, p.high, p.unit) for name, p in table.parameters.items()}
    return KnownLaw(path.name, table.found_in, law, parameters)
