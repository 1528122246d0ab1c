"""Which pull stands for the others in a figure."""

from __future__ import annotations

from dataclasses import replace

from tribo.records import Ingested


def with_peaks(ingested: Ingested, peaks: dict[str, float]) -> Ingested:
    pulls = {k: replace(p, static_N=peaks.get(k, p.static_N), flags=()) for k, p in ingested.pulls.items()}
    return replace(ingested, pulls=pulls)


def test_of_two_pulls_as_near_to_the_median_the_first_is_shown_whatever_the_last_digits(example: Ingested) -> None:
    """With an even number of pulls two are always equally near, and rounding differs between processors."""
    tests = example.campaign.tests[:4]
    ids = [t.test_id for t in tests]
    for last_digits in (-3e-14, 0.0, 3e-14):
        peaks = dict(zip(ids, (1.0, 2.0 + last_digits, 3.0, 9.0), strict=True))
        assert with_peaks(example, peaks).typical(tests).test_id == ids[1]
        assert with_peaks(example, peaks).typical(tests[::-1]).test_id == ids[1]


def test_a_pull_with_a_flag_stands_for_the_others_only_where_all_have_flags(example: Ingested) -> None:
    tests = example.campaign.tests[:3]
    ids = [t.test_id for t in tests]
    peaks = with_peaks(example, dict(zip(ids, (1.0, 2.0, 3.0), strict=True)))
    flagged = replace(peaks, pulls={**peaks.pulls, ids[1]: replace(peaks.pulls[ids[1]], flags=("no_drop",))})
    assert peaks.typical(tests).test_id == ids[1]
    assert flagged.typical(tests).test_id == ids[0]
