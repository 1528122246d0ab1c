"""The verdict: what a diagnosis hands on, and its JSON form (schema tribo.verdict/2)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from tribo.display import displayed
from tribo.records import SetAside

SCHEMA = "tribo.verdict/2"
Outcome = Literal["no_misfit", "named", "undetermined", "partly", "unknown"]
LayerKind = Literal["pattern_correction", "cause", "law", "remainder", "baseline"]
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
    text: str
    low: float = math.nan
    high: float = math.nan


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
    """A mechanism that explains the misfit. ``weight`` is its share among all that were weighed."""

    mechanism: str
    weight: float
    parameters: Mapping[str, Estimate]
    text: str


@displayed()
@dataclass(frozen=True)
class Excluded:
    """A mechanism that was left out of the weighing or lost, and why."""

    mechanism: str
    reason: str


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
    cause, with a 90 % interval from ``low`` to ``high``; of a remainder it is the peak-to-peak effect. ``tied_with``
    are mechanisms that the design cannot distinguish from it, ``gain`` what the layer gains on tests left out, ``at``
    the sample, regime and load at which a cause acts most, ``choice`` the specimen, pattern or value it concerns.
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


@displayed()
@dataclass(frozen=True)
class NextTest:
    """The test that best distinguishes mechanisms that explain a campaign about equally."""

    text: str
    separates: tuple[str, ...]
    design: Mapping[str, Any]
    expected_bits: float


@displayed()
@dataclass(frozen=True)
class Verdict:
    """The outcome of a diagnosis."""

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

    def as_dict(self) -> dict[str, Any]:
        """The verdict as plain types, in the order of the schema; numbers that do not exist are null."""
        plain = {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "text": self.text,
            "misfits": [asdict(m) for m in self.misfits],
            "causes": [asdict(c) for c in self.causes],
            "equivalent": [list(names) for names in self.equivalent],
            "excluded": [asdict(e) for e in self.excluded],
            "not_testable": [asdict(e) for e in self.not_testable],
            "layers": [asdict(layer) for layer in self.layers],
            "gain": asdict(self.gain) if self.gain else None,
            "set_aside": [{"test_id": s.test_id, "reason": s.reason} for s in self.set_aside],
            "next_test": asdict(self.next_test) if self.next_test else None,
            "smallest_effects_percent": dict(self.smallest_effects),
            "model": dict(self.model),
        }
        clean: dict[str, Any] = _finite(plain)
        return clean

    def to_json(self) -> str:
        """verdict.json."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, str | bool) or value is None:
        return value
    number = float(value)
    return number if math.isfinite(number) else None
