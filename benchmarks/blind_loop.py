"""The next test that a verdict proposes, made on the virtual tribometer, and the diagnosis again, up to three times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from blind_cases import Case, true_parameter

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
import pandas as pd  # isort: skip
from blind.direct import ingested  # isort: skip
from blind.tribometer import Bench, hide, with_further  # isort: skip

if TYPE_CHECKING:
    from tribo.diagnostics.verdict import Verdict
    from tribo.records import Ingested

MOST_TESTS = 3


def closed_loop(case: Case) -> dict[str, Any]:
    """Diagnose, make the proposed test, diagnose again, until one answer stands; the tests made are in ``steps``."""
    from tribo.diagnostics.diagnosis import examine

    bench, measured = hide(case.seed, list(case.effects), case.design), dict[str, tuple[float, float]]()
    steps: list[dict[str, Any]] = []
    v = examine(campaign(bench, measured, case.seed), seed=case.seed).verdict
    first = said(v)
    while undecided(v) and v.next_test is not None and len(steps) < MOST_TESTS:
        design = v.next_test.design
        if "measure" in design:
            measured[design["measure"]] = measurement(case, design, len(steps))
        else:
            bench = with_pulls(bench, case, design)
        pulls = int(design.get("pulls", 0))
        steps.append({"how": how(design), "pulls": pulls, "hours": round(float(design["hours"]), 2)})
        v = examine(campaign(bench, measured, case.seed), seed=case.seed).verdict
    return {"cell": case.cell, "seed": case.seed, "effects": case.effects, "first": first, "steps": steps, **said(v)}


def campaign(bench: Bench, measured: Mapping[str, tuple[float, float]], seed: int) -> Ingested:
    """The campaign as it stands, with what was measured directly."""
    whole = ingested(bench, seed)
    return replace(whole, campaign=replace(whole.campaign, measured=measured))


def said(v: Verdict) -> dict[str, Any]:
    tied = [sorted(names) for names in v.equivalent]
    alone = [[c.mechanism] for c in v.causes if not any(c.mechanism in names for names in tied)]
    return {"verdict": v.verdict, "causes": sorted([*tied, *alone])}


def undecided(v: Verdict) -> bool:
    return bool(v.equivalent) or v.verdict == "undetermined"


def measurement(case: Case, design: Mapping[str, Any], number: int) -> tuple[float, float]:
    """The amplitude as a direct measurement gives it: the hidden one, or none, with the stated uncertainty."""
    from tribo.mechanisms import MECHANISMS

    name = design["measure"].partition(":")[0]
    size = dict(case.effects).get(name)
    truth = MECHANISMS[name].amplitude.zero if size is None else true_parameter(name, size)[design["parameter"]]
    spread = float(design["uncertainty"])
    return truth + spread * float(np.random.default_rng([case.seed, 77, number]).normal()), spread


def with_pulls(bench: Bench, case: Case, design: Mapping[str, Any]) -> Bench:
    """The bench with the pulls that a design asks for: of samples at loads in turn, or tests again without a cause."""
    tests = bench.tests
    if "without" in design:
        rows = tests.set_index("test_id").loc[design["repeat_tests"]].reset_index().assign(without=design["without"])
    else:
        samples = design["samples"] if "samples" in design else [design["sample"]]
        loads = design["normal_loads_N"] if "normal_loads_N" in design else [design["normal_load_N"]]
        each = [tests[tests["sample"] == name] for name in samples]
        pairs = [(k, load) for load in loads for k in range(len(each))]  # every sample at every load, in turn
        turns = [pairs[number % len(pairs)] for number in range(design["pulls"])]
        rows = pd.DataFrame([each[k].iloc[number // len(each) % len(each[k])] for number, (k, _) in enumerate(turns)])
        rows = rows.assign(N=[load for _, load in turns])
    return with_further(bench, rows, case.seed, list(case.effects), case.design)


def how(design: Mapping[str, Any]) -> str:
    """What kind of test it is."""
    if "measure" in design:
        return f"{design['measure']} measured"
    return f"without {design['without']}" if "without" in design else "another load"
