"""Every usable test of a campaign as a trace and a pull; what cannot be used is set aside with its reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tribo.errors import CampaignError, Problem
from tribo.ingestion.exports import read_all
from tribo.records import Campaign, Ingested, Pull, SetAside, Test, Trace

Progress = Callable[[str, int, int], None]


def ingest_campaign(campaign: Campaign, rule: str, jobs: int, progress: Progress) -> Ingested:
    """Read every usable test of a campaign on ``jobs`` processes where that pays; the result does not depend on them.

    Raises
    ------
    CampaignError
        No test could be read.
    """
    from tribo.traces.copies import under_the_wrong_test

    traces: dict[str, Trace] = {}
    pulls: dict[str, Pull] = {}
    set_aside = list(campaign.set_aside)
    tests: list[Test] = []
    inputs = dict(campaign.inputs)
    for done, row in enumerate(read_all(campaign, rule, jobs), start=1):
        inputs |= row.hashes
        for test, outcome in row.outcomes:
            tests.append(test)
            if isinstance(outcome, SetAside):
                set_aside.append(outcome)
            else:
                trace, pulls[test.test_id] = outcome
                if trace is not None:
                    traces[test.test_id] = trace
        progress("reading exports", done, len(campaign.tests))
    ids = {test.test_id for test in tests} | {fault.test_id for fault in set_aside}
    for test_id, problem in under_the_wrong_test(traces, ids).items():
        del traces[test_id], pulls[test_id]
        set_aside.append(SetAside(test_id, str(problem), (problem,)))
    if not pulls:
        raise CampaignError(
            [p for fault in set_aside for p in fault.problems]
            or [Problem("no_usable_test", "no test of this campaign is usable", file=str(campaign.root))]
        )
    return Ingested(replace(campaign, tests=tuple(tests), inputs=inputs), traces, pulls, tuple(set_aside))
