"""Laws of earlier campaigns: law.toml, whether they hold in another one, and whether a design would show them."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from scipy.special import erfc, ndtri

from tribo.diagnostics.contrasts import FORM
from tribo.diagnostics.effect_sizes import NORMAL_90
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.inference import estimates, gain, recovered
from tribo.diagnostics.model import Acting, effect_of
from tribo.diagnostics.planning import PAPER_LAW, TYPICAL, expected_fit
from tribo.diagnostics.verdict import Estimate, Layer
from tribo.errors import CampaignError, Problem
from tribo.files import found_below, text_of
from tribo.input_files import toml_table
from tribo.lawsearch.grammar import ADHESION_TERM, AMPLITUDES, BOTH, LOAD_TERM, MOST_VALUES, UNITS, Shape, T, WrittenLaw
from tribo.lawsearch.model_choice import without_rivals
from tribo.mechanisms.record import Conditions
from tribo.records import REGIMES, Campaign

SCHEMA = "tribo.law/1"
MOST_KNOTS = 100  # of a curve
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class ShapeTable(_Strict):
    """[[shape]]: a function of one column."""

    kind: Literal[
        "linear",
        "log",
        "step",
        "soft step",
        "ramp",
        "optimum",
        "log optimum",
        "hump",
        "saturating",
        "window",
        "wave",
        "level",
        "levels",
        "curve",
        "surface",
    ]
    column: str
    low: Finite = 0.0
    high: Finite = 1.0
    place: Finite | None = None
    width: Finite | None = None
    level: str = ""
    values: list[Finite | str] = Field(default=[], max_length=MOST_KNOTS)
    heights: list[Finite] = Field(default=[], max_length=MOST_KNOTS**2)

    def shape(self) -> Shape:
        nan = float("nan")
        place = nan if self.place is None else self.place
        width = nan if self.width is None else self.width
        listed = tuple(self.values), tuple(self.heights)
        return Shape(self.kind, self.column, self.low, self.high, place, width, self.level, *listed)


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
        of_values = ("levels", "curve", "surface")
        if any((each.kind in of_values) != (len(each.values) > 1) for each in self.shape):
            raise ValueError("levels, curves and surfaces, and they alone, have two values or more")
        if shape.kind == "levels" and len(shape.values) > MOST_VALUES:
            raise ValueError(f"levels are at most {MOST_VALUES} values")
        if "surface" in (kinds := [each.kind for each in self.shape]) and kinds != ["surface", "surface"]:
            raise ValueError("a surface has two shapes, one for each of its columns")
        for each in self.shape:
            numbers = [v for v in each.values if isinstance(v, float)]
            if each.kind in ("curve", "surface") and (
                numbers != sorted(set(numbers)) or len(numbers) < len(each.values)
            ):
                raise ValueError("the values of a curve or surface are numbers, each larger than the one before")
            if len(each.heights) != (len(each.values) if each.kind == "curve" else 0) and each.kind != "surface":
                raise ValueError("a curve has a height at each of its values; no other shape has, but a surface")
        if shape.kind == "surface" and [len(each.heights) for each in self.shape] != [
            0, len(shape.values) * len(self.shape[1].values),
        ]:  # fmt: skip
            raise ValueError("the second shape of a surface has a height at every pair of values")
        wanted = 2 if shape.kind == "wave" else len(shape.values) - 1 if shape.kind == "levels" else 1
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
        lines += [f"heights = {json.dumps(list(s.heights))}"] if s.heights else []
    for name, e in parameters.items():
        lines += ["", f"[parameters.{name}]", f"value = {e.value!r}", f"low = {e.low!r}", f"high = {e.high!r}"]
        lines += [f"unit = {quoted(e.unit)}"]
    return "\n".join(lines) + "\n"


Answer = Literal["held", "not held", "cannot be told"]
# why a law cannot be tested, and the columns that this concerns
Untested = tuple[Literal["not recorded", "not varied", "no such sample", "no effect"], tuple[str, ...]]
SURE = 2.58  # standard errors: both decisions are at 1 %
SHOWS = 4.0  # standard errors that the effect must have for its absence to be certain


@dataclass(frozen=True)
class KnownLaw:
    """A law of an earlier campaign: the ``name`` of its file, the title of the campaign, and its parameters.

    Once it was tested on another campaign it has the ``answer``, its amplitudes ``found`` there by name, and why it
    could not be tested (``untested``).
    """

    name: str
    found_in: str
    law: WrittenLaw
    parameters: Mapping[str, Estimate]
    answer: Answer | None = None
    found: Mapping[str, Estimate] = field(default_factory=dict)
    untested: Untested | None = None


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


def validate_law(model: ModelFit, known: KnownLaw, tried: int = 1) -> KnownLaw:
    """The law with its answer: its amplitude fitted, its form as written, on a campaign that it was not made from.

    It held if the amplitude is beyond chance (1 % over all laws ``tried``) and differs from the earlier one by less
    than 2.58 standard errors of the difference; of a wave, both amplitudes. The form may be wrong by a share of the
    effect, which adds to this error: another design shows another part of it. Causes of the columns of the law are left
    out unless they explain the campaign clearly better than the law (:func:`without_rivals`). Nothing can be told where
    a column is missing or does not vary, or the effect is below four standard errors in this design.
    """
    c, law = model.setup.observations.conditions, known.law
    if (why := why_not_testable(c, law)) or not np.any(law.weight(c)):
        return replace(known, answer="cannot be told", untested=why or ("no such sample", ()))
    acting = Acting(law.mechanism())
    before = {p.name: known.parameters[p.name] for p in acting.mechanism.parameters}
    values = np.array([e.value for e in before.values()])
    if np.abs(effect_of(model.setup, model.law, acting, values)).max() < 1e-9:
        return replace(known, answer="cannot be told", untested=("no effect", ()))
    model, _ = without_rivals(model, law)
    after = fit(model.setup, (*model.acting, acting), start=model)
    here = [Estimate(*ends, known.parameters["a"].unit) for ends in recovered(after, len(after.acting) - 1)]
    known = replace(known, found=dict(zip(before, here, strict=True)))
    both = list(zip(here, before.values(), strict=True))
    beyond = max(np.sign(e0.value) * e.value / _error(e) for e, e0 in both)
    wrong_form = FORM * float(np.linalg.norm(values))
    alike = all(
        abs(e.value - e0.value) < SURE * np.linalg.norm([_error(e), _error(e0), wrong_form]) for e, e0 in both
    )
    by_chance = float(-ndtri(0.005 / tried))  # standard errors that one of the laws exceeds in 1 % (Bonferroni)
    if beyond > by_chance and alike:
        return replace(known, answer="held")
    shows = max(abs(e0.value) / _error(e) for e, e0 in both) >= SHOWS
    return replace(known, answer="not held" if shows else "cannot be told")


def _error(e: Estimate) -> float:
    return max((e.high - e.low) / (2 * NORMAL_90), 1e-12)


def why_not_testable(c: Conditions, law: WrittenLaw) -> Untested | None:
    """Why the columns of a law do not allow a test; None where they do."""
    for name in law.columns:
        if name not in UNITS and name not in c.columns:
            return "not recorded", (name,)
    course = law.course(c)[law.weight(c) != 0]
    return ("not varied", law.columns) if not len(course) or np.ptp(course) < 1e-9 else None


def read_laws(folder: Path) -> tuple[KnownLaw, ...]:
    """Every law in a folder and the folders in it, by the name of its file.

    Raises
    ------
    CampaignError
        A file is no law, or there is none: every fault of every file.
    """
    found: list[KnownLaw] = []
    problems: list[Problem] = []
    for path in found_below(folder, "law*.toml"):
        try:
            found.append(replace(read_law(path), name=str(path.relative_to(folder))))
        except CampaignError as why:
            problems += why.problems
    if not found and not problems:
        problems = [Problem("no_laws", "no law in this folder", file=str(folder), allowed="files such as law-1.toml")]
    if problems:
        raise CampaignError(problems)
    return tuple(found)


def validate_laws(
    model: ModelFit, known: Sequence[KnownLaw], rng: np.random.Generator
) -> tuple[ModelFit, tuple[KnownLaw, ...], tuple[Layer, ...], dict[str, float]]:
    """Test every law on a fitted campaign; those that held are added, the surest first, while they hold beside the
    others. A column has one law; a cause that explains the campaign as well stays in its place.

    Returns
    -------
    model, answers, layers, replaced
        The model with the laws that were added, each law with its answer, the layers of those added, and the causes of
        the same columns that explain the campaign less well, each with the log likelihood by which the law is better.
    """
    answers = tuple(validate_law(model, k, len(known)) for k in known)
    layers: list[Layer] = []
    replaced: dict[str, float] = {}
    taken: set[str] = set()

    def strength(k: KnownLaw) -> float:  # how surely it held, in half widths of its interval
        found = k.found.get("a")
        return abs(found.value) / max(found.high - found.low, 1e-12) if found is not None else 0.0

    for k in sorted(answers, key=strength, reverse=True):
        if k.answer != "held" or taken & set(k.law.columns):
            continue
        if layers and validate_law(model, k, len(known)).answer != "held":
            continue
        without, rivals = without_rivals(model, k.law)
        if any(by <= 0.0 for by in rivals.values()):
            continue
        after = fit(without.setup, (*without.acting, Acting(k.law.mechanism())), start=without)
        layers.append(_layer(k, without, after, rng))
        taken |= set(k.law.columns)
        replaced |= rivals
        model = after
    return model, answers, tuple(layers), replaced


def law_layer(
    law: WrittenLaw,
    model: ModelFit,
    parameters: Mapping[str, Estimate],
    effect_percent: tuple[float, float, float],
) -> Layer:
    """A law that ``model`` holds as a layer, without its evidence."""
    c = model.setup.observations.conditions
    samples = tuple(sorted({str(name) for name, w in zip(c.sample, law.weight(c), strict=True) if w != 0}))
    return Layer(
        kind="law", name=" and ".join(law.columns), samples=samples,
        regimes=tuple(REGIMES) if law.regime == BOTH else (law.regime,), p_adjusted=float("nan"),
        effect_percent=effect_percent[0], low=effect_percent[1], high=effect_percent[2], parameters=parameters,
        formula=law.formula(),
    )  # fmt: skip


def _layer(known: KnownLaw, model: ModelFit, after: ModelFit, rng: np.random.Generator) -> Layer:
    parameters = estimates(after, len(after.acting) - 1)
    effect = _percent(known.law, after.setup.observations.conditions, parameters)
    layer = law_layer(known.law, after, parameters, effect)
    error = max(parameters["a"].high - parameters["a"].low, 1e-12) / (2.0 * NORMAL_90)
    p = float(erfc(abs(parameters["a"].value) / error / np.sqrt(2.0)))
    return replace(layer, gain=gain(model, after, rng), p_adjusted=p, shows=known)


def _percent(law: WrittenLaw, c: Conditions, parameters: Mapping[str, Estimate]) -> tuple[float, float, float]:
    """Change of T (or of its term) from the least to the most of the course where the law acts fully."""
    here, a = law.weight(c) != 0, parameters["a"]
    if "b" in parameters:
        size = 2.0 * float(np.hypot(a.value, parameters["b"].value))
        half = a.high - a.low
        ends = (size, size - half, size + half)
    else:
        reach = float(np.ptp(law.course(c)[here])) * float(np.abs(law.weight(c)).max())
        ends = (a.value * reach, a.low * reach, a.high * reach)
    value, low, high = (100.0 * float(np.expm1(x)) for x in ends)
    return value, low, high


@dataclass(frozen=True)
class PlannedLaw:
    """The ``strength`` of a law in a design, in standard errors of its amplitude, and how many tests would suffice."""

    formula: str
    strength: float
    tests_needed: int
    n_tests: int = 0
    untested: Untested | None = None

    @property
    def shows(self) -> bool:
        """Whether the planned tests would show the law."""
        return self.strength >= SHOWS


def plan_law(campaign: Campaign, law: WrittenLaw, parameters: Mapping[str, Estimate]) -> PlannedLaw:
    """Whether the planned tests of a campaign would show a law at the size that was found, at typical noise."""
    f = expected_fit(campaign, TYPICAL, PAPER_LAW, None)
    c, formula, n = f.setup.observations.conditions, law.formula(), len(campaign.tests)
    if why := why_not_testable(c, law):
        return PlannedLaw(formula, 0.0, 0, n, why)
    acting = Acting(law.mechanism())
    values = np.array([parameters[p.name].value for p in acting.mechanism.parameters])
    left = f.cleared(effect_of(f.setup, f.law, acting, values)[:, :, None])[0]
    strength = float(np.sqrt(np.sum(left**2)))
    needed = int(np.ceil(n * (SHOWS / max(strength, 1e-6)) ** 2))
    return PlannedLaw(formula, strength, needed, n)
