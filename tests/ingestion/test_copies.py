"""Exports under the wrong test are found by what their headers and their numbers say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribo.ingestion.exports import under_the_wrong_test
from tribo.records import Trace

IDS = [f"T{k:02d}" for k in range(1, 11)]


def traces(labels: list[str], key: str = "Specimen label") -> dict[str, Trace]:
    """Ten traces of their own noise, each with a header."""
    rng = np.random.default_rng(0)
    time = np.arange(50) / 10
    return {
        test_id: Trace(test_id, time, rng.standard_normal(50), metadata={key: label}, file=f"raw/{test_id}.csv")
        for test_id, label in zip(IDS, labels, strict=True)
    }


def test_headers_that_name_their_own_tests_are_fine() -> None:
    assert under_the_wrong_test(traces(IDS), IDS) == {}
    assert under_the_wrong_test(traces([f"Data Acquisition: {i} (Timed)" for i in IDS]), IDS) == {}


def test_a_header_that_names_another_test_is_found_and_that_test_stays() -> None:
    given = traces(["T05", *IDS[1:]])
    (problem,) = under_the_wrong_test({**given, "T01": replace(given["T05"], file="raw/T01.csv")}, IDS).values()
    assert (problem.kind, problem.test_id, problem.file, problem.found) == ("other_test", "T01", "raw/T01.csv", "T05")


def test_headers_that_never_name_their_own_test_say_nothing() -> None:
    """A machine that calls every specimen 1, and a campaign that calls its tests 1 to 10."""
    numbered = dict(zip(["1", "2", "3", "4", "5", "6", "7", "8", "9", "10"], traces(["1"] * 10).values(), strict=True))
    assert under_the_wrong_test(numbered, list(numbered)) == {}


def test_the_same_numbers_under_two_tests_are_used_for_none() -> None:
    given = traces([""] * 10)
    given["T03"] = replace(given["T07"], file="raw/T03.csv")
    found = under_the_wrong_test(given, IDS)
    assert {test_id: p.kind for test_id, p in found.items()} == {"T03": "same_numbers", "T07": "same_numbers"}
    assert "T07" in found["T03"].what


def test_one_sample_that_differs_makes_another_measurement() -> None:
    given = traces([""] * 10)
    force = given["T07"].force_N.copy()
    force[3] += 1e-9
    given["T03"] = replace(given["T07"], force_N=force)
    assert under_the_wrong_test(given, IDS) == {}
