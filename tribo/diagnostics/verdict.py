"""The verdict: what a diagnosis hands on, and its JSON form (schema tribo.verdict/2).

A diagnosis fills in numbers and enumerations. Every ``text`` is empty until ``worded`` of the room wording writes it,
from the fields beside it and from ``shows``, the record of the statistic that is spoken of.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from typing import Any, Literal

from tribo.display import displayed
from tribo.records import SetAside

SCHEMA = "tribo.verdict/2"
Outcome = Literal["no_misfit", "named", "undetermined", "partly", "unknown", "cannot_tell"]
LayerKind = Literal["pattern_correction", "cause", "law", "remainder", "nuisance", "baseline"]
Nuisance = Literal["days", "drift", "specimen_drift"]
# why a mechanism is not among the causes
Why = Literal[
    "corrected", "absorbed", "hidden", "not varied", "not certain", "only in traces", "wrong sign",
    "explains less", "a law explains more", "not printed", "contradicted", "only with the load", "vary together",
    "recorded in part", "nothing left beside a law",
]  # fmt: skip
UNTESTED: frozenset[Why] = frozenset(
    {"absorbed", "hidden", "not varied", "only in traces", "not printed", "only with the load", "vary together",
     "recorded in part"}
)
# what a further test does
NextKind = Literal[
    "measure", "remove", "confirm", "pull further", "pull more", "vary one column", "vary what was fixed", "part laws",
    "part columns", "factorial", "part from load", "at the bench", "measure more",
]  # fmt: skip
CERTAIN_CAUSES: tuple[Outcome, ...] = ("named", "undetermined", "partly")  # verdicts that hold causes


@displayed()
@dataclass(frozen=True)
class Misfit:
    """Where the model fails: which observable follows which covariate, the size, and the adjusted p value.

    ``effect_percent`` is 100 (measured / model - 1), or the change of measured / model from one end of the covariate to
    the other, as ``text`` says, with its 90 % interval.
    """

    observable: str
    sample: str
    covariate: str
    effect_percent: float
    p_adjusted: float
    text: str = ""
    low: float = math.nan
    high: float = math.nan
    shows: Any = field(default=None, compare=False, repr=False)


@displayed()
@dataclass(frozen=True)
class Estimate:
    """A recovered parameter with its 90 % interval."""

    value: float
    low: float
    high: float
    unit: str


@displayed()
@dataclass(frozen=True)
class Cause:
    """A mechanism that explains the misfit. ``weight`` is its share among all that were weighed.

    ``choice`` is the specimen, pattern or value it concerns, ``changes`` the least and the largest change of T
    (percent) that it adds to the calibrated model.
    """

    mechanism: str
    weight: float
    parameters: Mapping[str, Estimate]
    text: str = ""
    choice: str = ""
    changes: tuple[float, float] | None = None
    shows: Any = field(default=None, compare=False, repr=False)


@displayed()
@dataclass(frozen=True)
class Excluded:
    """A mechanism that was left out of the weighing or lost, and ``why``; ``by`` is the log likelihood it lost by."""

    mechanism: str
    why: Why
    by: float = math.nan
    reason: str = ""
    shows: Any = field(default=None, compare=False, repr=False)


@displayed()
@dataclass(frozen=True)
class Gain:
    """What the extended model gains on tests it has not seen: log scores per test, and the root mean square of
    100 (measured / predicted - 1)."""

    held_out: str
    log_score_baseline: float
    log_score_extended: float
    difference: float
    se: float
    rmse_percent_before: float
    rmse_percent_after: float


@displayed()
@dataclass(frozen=True)
class Layer:
    """One part of what explains a campaign, with its evidence beside all other layers.

    ``effect_percent`` is 100 (measured / model - 1) of a pattern correction, and the largest signed change of T by a
    cause, with a 90 % interval from ``low`` to ``high``; of a remainder it is the peak-to-peak effect, of a nuisance
    the root mean square over the tests. ``tied_with``
    are mechanisms that the design cannot distinguish from it, ``gain`` what the layer gains on tests left out, ``at``
    the sample, regime and load at which a cause acts most, ``choice`` the specimen, pattern or value it concerns.
    ``over`` says, of a cause that follows a recorded column, by how much T changes from its lowest to its highest
    recorded values: the ``column``, the values ``from`` and ``to``, and the change in ``percent`` from ``low`` to
    ``high``. ``levels`` are the values of a column of few, each with the change of T there relative to its mean over
    them (percent); of a law that is a curve, places along it, relative to its mean over the tests.
    """

    kind: LayerKind
    name: str
    samples: tuple[str, ...]
    regimes: tuple[str, ...]
    p_adjusted: float
    effect_percent: float
    low: float
    high: float
    parameters: Mapping[str, Estimate] = field(default_factory=dict)
    formula: str = ""
    tied_with: tuple[str, ...] = ()
    gain: Gain | None = None
    text: str = ""
    at: str = ""
    choice: str = ""
    most: tuple[str, str, float] | None = None  # regime, sample and load (N) of ``at``
    over: Mapping[str, Any] | None = None
    levels: Mapping[str, Estimate] = field(default_factory=dict)
    shows: Any = field(default=None, compare=False, repr=False)


@displayed()
@dataclass(frozen=True)
class NextTest:
    """The test that best distinguishes mechanisms that explain a campaign about equally."""

    kind: NextKind
    separates: tuple[str, ...]
    design: Mapping[str, Any]
    expected_bits: float = math.nan
    text: str = ""
    shows: Any = field(default=None, compare=False, repr=False)


@displayed()
@dataclass(frozen=True)
class AgainstModel:
    """What a verdict on the spring-block model rests on beside its parts.

    ``samples`` were measured and the model was calibrated on ``flat``. ``excess`` says how many times its stated error
    the patterned samples differ from the model, and the chance of that; ``wrong_in_form`` are mechanisms that left a
    misfit in the column they depend on. Of the law search: the ``known`` laws with their answers (KnownLaw), whether
    what its laws leave is ``within_chance`` (None without laws), and the searches ``across``
    patterns (LawsAcross). ``in_part`` are the columns that are recorded for some tests only (RecordedInPart).
    """

    samples: tuple[str, ...] = ()
    flat: str = ""
    excess: tuple[float, float] | None = None
    wrong_in_form: tuple[str, ...] = ()
    known: tuple[Any, ...] = ()
    within_chance: bool | None = None
    across: tuple[Any, ...] = ()
    in_part: tuple[Any, ...] = ()


@displayed()
@dataclass(frozen=True)
class TooLittle:
    """Why a campaign cannot be tested: the usable tests, their loads and samples, with the fewest that are needed.

    Of the repeats that scatter most, ``repeated`` says the regime, the sample and the load (N), ``repeats`` their
    number and ``factor`` the largest force over the smallest; nothing where nothing was repeated.
    """

    tests: int
    loads: int
    samples: int
    fewest_tests: int
    fewest_loads: int
    fewest_samples: int
    repeated: tuple[str, str, float] | None = None
    repeats: int = 0
    factor: float = math.nan


@displayed()
@dataclass(frozen=True)
class Verdict:
    """The outcome of a diagnosis.

    ``sentence`` is the finding in one sentence, ``evidence`` what it rests on, ``text`` both.
    """

    verdict: Outcome
    misfits: tuple[Misfit, ...] = ()
    causes: tuple[Cause, ...] = ()
    equivalent: tuple[tuple[str, ...], ...] = ()
    excluded: tuple[Excluded, ...] = ()
    not_testable: tuple[Excluded, ...] = ()
    layers: tuple[Layer, ...] = ()
    gain: Gain | None = None
    set_aside: tuple[SetAside, ...] = ()
    next_test: NextTest | None = None
    text: str = ""
    smallest_effects: Mapping[str, float] = field(default_factory=dict)
    model: Mapping[str, Any] = field(default_factory=dict)  # source of the predictions, and the simulation
    sentence: str = ""
    evidence: str = ""
    shows: Any = field(default=None, compare=False, repr=False)

    def as_dict(self) -> dict[str, Any]:
        """The verdict as plain types, in the order of the schema; numbers that do not exist are null."""
        fields_of_schema = {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "text": self.text,
            "misfits": [plain(m) for m in self.misfits],
            "causes": [plain(c) for c in self.causes],
            "equivalent": [list(names) for names in self.equivalent],
            "excluded": [plain(e) for e in self.excluded],
            "not_testable": [plain(e) for e in self.not_testable],
            "layers": [plain(layer) for layer in self.layers],
            "gain": asdict(self.gain) if self.gain else None,
            "set_aside": [{"test_id": s.test_id, "reason": s.reason} for s in self.set_aside],
            "next_test": plain(self.next_test) if self.next_test else None,
            "smallest_effects_percent": dict(self.smallest_effects),
            "model": dict(self.model),
        }
        clean: dict[str, Any] = _finite(fields_of_schema)
        return clean

    def to_json(self) -> str:
        """verdict.json."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False, allow_nan=False)


KEPT = {  # fields of the records in verdict.json, in the order of its schema
    Misfit: ("observable", "sample", "covariate", "effect_percent", "p_adjusted", "text", "low", "high"),
    Cause: ("mechanism", "weight", "parameters", "text"),
    Excluded: ("mechanism", "reason"),
    Layer: (
        "kind", "name", "samples", "regimes", "p_adjusted", "effect_percent", "low", "high", "parameters", "formula",
        "tied_with", "gain", "text", "at", "choice", "over", "levels",
    ),
    NextTest: ("text", "separates", "design", "expected_bits"),
}  # fmt: skip


def plain(record: Any) -> Any:
    """A record by the names of its fields in verdict.json, with all that is in it."""
    if is_dataclass(record):
        names = KEPT.get(type(record)) or [f.name for f in fields(record)]
        return {name: plain(getattr(record, name)) for name in names}
    if isinstance(record, Mapping):
        return {name: plain(value) for name, value in record.items()}
    return record


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, str | bool) or value is None:
        return value
    number = float(value)
    return number if math.isfinite(number) else None
