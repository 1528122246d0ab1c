"""Exports under the wrong test: the numbers of one test given twice, or a header that names another test."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping

import numpy as np

from tribo.errors import Problem
from tribo.records import Trace

_LABELLED = 0.9  # share of exports that name their own test from which on a header that names another one counts
_FEWEST = 5
_WORD = re.compile(r"[\w.+-]+")


def under_the_wrong_test(traces: Mapping[str, Trace], test_ids: Collection[str]) -> dict[str, Problem]:
    """The problem of each test whose trace belongs to another one; ``test_ids`` are all tests of the campaign.

    ``other_test``: its header names another test, where the headers of a campaign name their own. ``same_numbers``: its
    data are those of another test, and no header states to which test they belong; then none of them is used.
    """
    ids = frozenset(test_ids)
    named = {test_id: ids.intersection(_words(trace)) for test_id, trace in traces.items()}
    own = [test_id for test_id, words in named.items() if test_id in words]
    labelled = len(own) >= max(_FEWEST, _LABELLED * len(traces))
    found = {
        test_id: _other_test(test_id, traces[test_id], words)
        for test_id, words in named.items()
        if labelled and words and test_id not in words
    }
    for group in _same_samples(traces):
        doubtful = [test_id for test_id in group if test_id not in found]
        if len(doubtful) > 1:
            found |= {test_id: _same_numbers(test_id, traces[test_id], group) for test_id in doubtful}
    return found


def _words(trace: Trace) -> set[str]:
    return {word for pair in trace.metadata.items() for text in pair for word in _WORD.findall(text)}


def _same_samples(traces: Mapping[str, Trace]) -> list[list[str]]:
    """Tests that share every sample of time and force, in groups of two or more."""
    groups: dict[bytes, list[str]] = {}
    for test_id, trace in traces.items():
        samples = np.ascontiguousarray(np.concatenate((trace.time_s, trace.force_N)))
        groups.setdefault(hashlib.blake2b(samples.tobytes(), digest_size=16).digest(), []).append(test_id)
    return [group for group in groups.values() if len(group) > 1]


def _other_test(test_id: str, trace: Trace, words: Collection[str]) -> Problem:
    what = "the header of this export names a different test"
    return Problem("other_test", what, trace.file, found=", ".join(sorted(words)), allowed=test_id, test_id=test_id)


def _same_numbers(test_id: str, trace: Trace, group: Collection[str]) -> Problem:
    others = ", ".join(other for other in group if other != test_id)
    what = f"the data are identical to those of {others}; the correct test is not known, so none of them is used"
    return Problem("same_numbers", what, trace.file, allowed="one measurement per test", test_id=test_id)
