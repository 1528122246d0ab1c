"""A study without its results: every export is opened and evaluated, and every fault and doubt is found at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from tribo import stages
from tribo.campaign import open_campaign
from tribo.campaign.load import required_flat_sample, with_flat_sample, with_zeros
from tribo.errors import Problem, TraceError, TriboError
from tribo.records import Campaign, Doubt, Ingested, LawFit, SetAside
from tribo.stages import DEFAULTS, Progress, StudyOptions

Until = Literal["ingest", "fit", "compare", "diagnose", "report"]
COMPARED = ("compare", "report")
T = TypeVar("T")


@dataclass(frozen=True)
class Checked:
    """What a dry run found: the steps that a study would take, and everything that stands in its way.

    ``faults`` make the study impossible; ``set_aside`` are the tests it would leave out, ``used_with_doubts`` those it
    would use although something is odd, ``doubts`` the numbers outside their physical bounds, ``notes`` what else is
    said of the campaign. ``tests`` counts the tests that can be used.
    """

    steps: tuple[str, ...] = ()
    faults: tuple[Problem, ...] = ()
    set_aside: tuple[SetAside, ...] = ()
    used_with_doubts: tuple[SetAside, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[Problem, ...] = ()
    tests: int = 0

    def as_record(self) -> dict[str, Any]:
        """The same as plain types."""
        return {
            "steps": list(self.steps), "tests": self.tests, "faults": [asdict(p) for p in self.faults],
            "set_aside": [f"{s.test_id}: {s.reason}" for s in self.set_aside],
            "used_with_doubts": [f"{s.test_id}: {s.reason}" for s in self.used_with_doubts],
            "doubts": [asdict(d) for d in self.doubts], "problems": [asdict(p) for p in (*self.faults, *self.notes)],
        }  # fmt: skip


def check(
    path: Path,
    options: StudyOptions,
    until: Until,
    prepared: Callable[[Campaign], Campaign] = lambda campaign: campaign,
    progress: Progress = lambda stage, done, total: None,
) -> Checked:
    """Open a campaign and all of its exports, evaluate and fit them, and collect every fault and doubt.

    ``prepared`` adds to the campaign what the command line states about its exports. Nothing is raised for faults of
    the input; nothing is written.
    """
    faults: list[Problem] = []
    options = _with_known_rule(options, faults)
    try:
        with open_campaign(path) as described:
            return _checked(prepared(described), options, until, faults, progress)
    except TriboError as why:
        return Checked(faults=(*faults, *why.problems))


def _with_known_rule(options: StudyOptions, faults: list[Problem]) -> StudyOptions:
    """The options; with the usual rule, and a fault, where the rule is not known."""
    from tribo.traces.rules import named_rule

    try:
        named_rule(options.rule)
    except TraceError as why:
        faults += [replace(p, file="--rule") for p in why.problems]
        return replace(options, rule=DEFAULTS.rule)
    return options


def _checked(
    campaign: Campaign, options: StudyOptions, until: Until, faults: list[Problem], progress: Progress
) -> Checked:
    from tribo.plausibility import doubts_of

    campaign = with_zeros(campaign, options.zero, options.load_zero)
    campaign = _collecting(faults, lambda: with_flat_sample(campaign, options.flat)) or campaign
    read = _collecting(
        faults, lambda: stages.ingest(campaign, rule=options.rule, jobs=options.jobs, progress=progress)
    )
    if read is None:
        return Checked(
            _steps(campaign, options, until, faults), tuple(faults), campaign.set_aside, (), doubts_of(campaign),
            _notes(campaign),
        )  # fmt: skip
    ingested = _collecting(faults, lambda: _by_hand(read, options)) or read
    fits = _fits(ingested, options, until, faults)
    return Checked(
        _steps(campaign, options, until, faults),
        tuple(dict.fromkeys(faults)),
        ingested.set_aside,
        ingested.doubts(),
        stages.all_doubts(ingested, fits),
        _notes(campaign),
        len(ingested.pulls),
    )


def _collecting(faults: list[Problem], step: Callable[[], T]) -> T | None:
    """The result of a step; None with its problems among the faults where it ends with an error of the input."""
    try:
        return step()
    except TriboError as why:
        faults += why.problems
        return None


def _by_hand(ingested: Ingested, options: StudyOptions) -> Ingested:
    from tribo.ingestion.overrides import apply_overrides

    return ingested if options.overrides is None else apply_overrides(ingested, options.overrides, options.rule)


def _fits(ingested: Ingested, options: StudyOptions, until: Until, faults: list[Problem]) -> tuple[LawFit, ...]:
    """The laws, as far as they can be fitted; a fault where the study needs them, or enough tests for a diagnosis."""
    alone = until in COMPARED and stages.without_model(ingested.campaign, options)
    optional = alone or until in ("ingest", "diagnose")
    fits = _collecting([] if optional else faults, lambda: stages.fit(ingested, weights=options.weights))
    if until == "diagnose":
        from tribo.diagnostics.observations import enough, observe

        _collecting(faults, lambda: enough(observe(ingested)))
    return fits or ()


def _notes(campaign: Campaign) -> tuple[Problem, ...]:
    """What is said of the campaign, without the faults of tests that are set aside and listed."""
    listed = {p for test in campaign.set_aside for p in test.problems}
    return tuple(p for p in campaign.problems if p not in listed)


def _steps(campaign: Campaign, options: StudyOptions, until: Until, faults: list[Problem]) -> tuple[str, ...]:
    """The steps of the study in words."""
    from tribo.comparison.prediction import loads_to_simulate

    steps = [f"read {len(campaign.tests)} exports of {campaign.root} with rule {options.rule}"]
    samples = sorted({t.sample for t in campaign.tests})
    if unknown := sum(np.isnan(t.normal_load_N) for t in campaign.tests):
        steps.append(f"take the normal load of {unknown} tests from their exports")
    if until not in ("ingest", "diagnose"):
        steps.append(f"fit mu and tau0 of {len(samples)} samples ({', '.join(samples)}) with weights {options.weights}")
    if until in COMPARED and (why := stages.without_model(campaign, options)):
        steps.append(f"report without the spring-block model. {why}")
    elif until in COMPARED and (flat := _collecting(faults, lambda: required_flat_sample(campaign))):
        loads = loads_to_simulate(campaign)
        runs = len(samples) * len(loads) * options.runs
        steps.append(f"calibrate the model on sample {flat} and run it {runs} times at {len(loads)} loads")
    if until in ("diagnose", "report"):
        steps.append("diagnose where the model fails")
    return tuple(steps)
