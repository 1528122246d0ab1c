"""Laws of earlier campaigns: read from a folder, tested on a campaign, and added to it where they hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.special import erfc

from tribo.diagnose.discovery.contested import without_rivals
from tribo.diagnose.discovery.held import Held, holds
from tribo.diagnose.discovery.law_file import read_law, read_title
from tribo.diagnose.discovery.law_words import law_layer, size_sentence
from tribo.diagnose.discovery.written_law import WrittenLaw
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.gain import gain
from tribo.diagnose.statistics.interval import NORMAL_90, estimates
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting
from tribo.diagnose.verdict import Estimate, Layer
from tribo.errors import CampaignError, Problem
from tribo.file_contents import found_below
from tribo.mechanisms.record import Conditions


@dataclass(frozen=True)
class KnownLaw:
    """A law of an earlier campaign: the ``name`` of its file, the title of the campaign, and its parameters."""

    name: str
    found_in: str
    law: WrittenLaw
    parameters: Mapping[str, Estimate]


@dataclass(frozen=True)
class Tested:
    """The answers of a campaign about known laws, the layers of those that held, and the model with these.

    ``replaced`` are causes of the same columns that explain the campaign less well, each with the log likelihood by
    which the law is better.
    """

    model: ModelFit
    answers: tuple[tuple[KnownLaw, Held], ...]
    layers: tuple[Layer, ...]
    replaced: Mapping[str, float]

    @property
    def text(self) -> str:
        """How many held, and what those say."""
        if not self.answers:
            return ""
        n = sum(held.answer == "held" for _, held in self.answers)
        return " ".join([f"{n} of {len(self.answers)} known laws held.", *(layer.text for layer in self.layers)])

    @property
    def columns(self) -> set[str]:
        return {name for known, held in self.answers if held.answer == "held" for name in known.law.columns}


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
            law, parameters = read_law(path)
        except CampaignError as why:
            problems += why.problems
            continue
        found.append(KnownLaw(str(path.relative_to(folder)), read_title(path), law, parameters))
    if not found and not problems:
        problems = [Problem("no_laws", "no law in this folder", file=str(folder), allowed="files such as law-1.toml")]
    if problems:
        raise CampaignError(problems)
    return tuple(found)


def try_laws(model: ModelFit, known: Sequence[KnownLaw], rng: np.random.Generator) -> Tested:
    """Test every law on a fitted campaign; those that held are added, the surest first, while they hold beside the
    others. A column has one law; a cause that explains the campaign as well stays in its place."""
    answers = {k.name: holds(model, k.law, k.parameters, len(known)) for k in known}
    layers: list[Layer] = []
    replaced: dict[str, float] = {}
    taken: set[str] = set()
    for k in sorted(known, key=lambda k: -_strength(answers[k.name])):
        if answers[k.name].answer != "held" or taken & set(k.law.columns):
            continue
        if layers and holds(model, k.law, k.parameters, len(known)).answer != "held":
            continue
        without, rivals = without_rivals(model, k.law)
        if any(by <= 0.0 for by in rivals.values()):
            continue
        after = fit(without.setup, (*without.acting, Acting(k.law.mechanism())), start=without)
        layers.append(_layer(k, without, after, rng))
        taken |= set(k.law.columns)
        replaced |= rivals
        model = after
    return Tested(model, tuple((k, answers[k.name]) for k in known), tuple(layers), replaced)


def _strength(held: Held) -> float:
    """How surely it held, in half widths of its interval."""
    if held.found is None:
        return 0.0
    return abs(held.found.value) / max(held.found.high - held.found.low, 1e-12)


def _layer(known: KnownLaw, model: ModelFit, after: ModelFit, rng: np.random.Generator) -> Layer:
    parameters = estimates(after, len(after.acting) - 1)
    effect = _percent(known.law, after.setup.observations.conditions, parameters)
    said = size_sentence(known.law, {**known.parameters, **parameters}, effect)
    text = f"The law of {known.found_in or known.name} held: {said}."
    layer = law_layer(known.law, after, parameters, effect, text)
    error = max(parameters["a"].high - parameters["a"].low, 1e-12) / (2.0 * NORMAL_90)
    p = float(erfc(abs(parameters["a"].value) / error / np.sqrt(2.0)))
    return replace(layer, gain=gain(model, after, rng), p_adjusted=p)


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
