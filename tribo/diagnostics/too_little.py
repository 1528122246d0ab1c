"""A campaign too small to be tested: the verdict that it cannot tell, with how far its repeats scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribo.diagnostics.column_search import load_levels
from tribo.diagnostics.observations import observe, too_little
from tribo.diagnostics.verdict import NextTest, RepeatScatter, TooLittle, Verdict
from tribo.records import REGIMES, Ingested


def cannot_tell(ingested: Ingested) -> Verdict | None:
    """The verdict on a campaign that is too small to be compared with the model; None where it is not."""
    lack = too_little(observe(ingested))
    if lack is None:
        return None
    lack = replace(lack, scatter=most_scattered(ingested))
    return Verdict("cannot_tell", set_aside=ingested.set_aside, next_test=more_tests(lack), shows=lack)


def more_tests(lack: TooLittle) -> NextTest:
    """The fewest tests, loads and samples that can be tested."""
    design = {"pulls": lack.fewest_tests, "loads": lack.fewest_loads, "samples": lack.fewest_samples}
    return NextTest("measure more", (), design)


def most_scattered(ingested: Ingested) -> RepeatScatter | None:
    """The repeats that scatter most: tests of one sample at one load, speed and hold; None where nothing was repeated.
    """
    tests = [t for t in ingested.campaign.tests if t.test_id in ingested.pulls and t.normal_load_N > 0]
    found = []
    for sample in dict.fromkeys(t.sample for t in tests):
        of_sample = [t for t in tests if t.sample == sample]
        levels = load_levels(np.array([t.normal_load_N for t in of_sample]))
        kinds = [(int(level), t.speed_m_s, t.hold_s) for level, t in zip(levels, of_sample, strict=True)]
        for kind in dict.fromkeys(kinds):
            repeats = [t for t, own in zip(of_sample, kinds, strict=True) if own == kind]
            load = float(np.median([t.normal_load_N for t in repeats]))
            for regime in REGIMES:
                forces = np.array([getattr(ingested.pulls[t.test_id], f"{regime}_N") for t in repeats], float)
                forces = forces[forces > 0]
                if forces.size > 1:
                    factor = float(forces.max() / forces.min())
                    found.append(RepeatScatter(sample, regime, load, forces.size, factor))
    return max(found, key=lambda scatter: scatter.factor, default=None)
