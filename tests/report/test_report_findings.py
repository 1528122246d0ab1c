"""What the report says in words follows from the intervals, and says no more."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from tribo.comparison import findings
from tribo.comparison.findings import Agreement, LoadRatio, Ranking
from tribo.records import REGIMES, LawFit, Study
from tribo.wording import study_sentences as wording
from tribo.wording.card import summary_text, table2_text
from tribo.wording.numerals import loads_in_words, percent, significant, span, with_uncertainty


def ratio(value: float, low: float, high: float, load: float = 1.0) -> LoadRatio:
    return LoadRatio(load, value, low, high)


@pytest.mark.parametrize(
    ("load", "verdict"),
    [
        (ratio(1.02, 0.95, 1.09), "agrees"),
        (ratio(0.8, 0.7, 0.9), "model too high"),
        (ratio(1.3, 1.1, 1.5), "model too low"),
        (ratio(0.9, 0.5, 1.6), "inconclusive"),
        (ratio(1.0, float("nan"), float("nan")), "inconclusive"),
    ],
)
def test_an_interval_has_one_verdict(load: LoadRatio, verdict: str) -> None:
    assert load.verdict == verdict


def test_a_measurement_of_half_the_model_deviates_by_minus_fifty_percent() -> None:
    assert ratio(0.5, 0.4, 0.6).deviation == pytest.approx(-0.5)
    agreement = Agreement("C", "static", (ratio(0.5, 0.4, 0.6, 1), ratio(0.4, 0.3, 0.5, 2)), False)
    assert agreement.verdict == "model too high"
    assert agreement.mean_deviation == pytest.approx((0.5 * 0.4) ** 0.5 - 1)
    assert agreement.worst.normal_load_N == 2


def test_loads_off_on_both_sides_are_mixed() -> None:
    agreement = Agreement("C", "static", (ratio(0.5, 0.4, 0.6), ratio(2, 1.8, 2.2)), False)
    assert agreement.verdict == "mixed"
    assert "too high at some loads and too low at others for C" in wording.in_short([agreement], "F")[0]


def test_an_inconclusive_load_is_not_counted_as_agreement() -> None:
    """Two loads agree, one is too wide to tell, one is too low: the model agrees at two of four."""
    loads = (ratio(1.0, 0.9, 1.1, 1), ratio(1.0, 0.9, 1.1, 2), ratio(1.1, 0.5, 2.4, 3), ratio(1.3, 1.2, 1.4, 4))
    agreement = Agreement("A", "static", loads, False)
    said = wording.in_short([agreement], "F")[0]
    assert "agrees with the measurement for A (at 2 of 4 loads; inconclusive at 1)" in said


def test_one_load_of_six_outside_is_agreement_with_an_exception() -> None:
    loads = (*(ratio(1.0, 0.9, 1.1, k) for k in range(5)), ratio(0.8, 0.7, 0.9, 6))
    agreement = Agreement("B", "static", loads, False)
    assert agreement.verdict == "agrees"
    assert "agrees with the measurement for B (at 5 of 6 loads)" in wording.in_short([agreement], "F")[0]


def test_wide_intervals_are_inconclusive() -> None:
    agreement = Agreement("C", "static", (ratio(1.1, 0.5, 2.4), ratio(1, 0.5, 2)), False)
    assert agreement.verdict == "inconclusive"
    assert "too wide" in wording.in_short([agreement], "F")[0]
    assert "inconclusive at all loads" in wording.agreement_sentence(agreement)


def test_the_sentence_counts_loads_and_names_the_worst() -> None:
    loads = (ratio(1.0, 0.9, 1.1, 1), ratio(0.8, 0.7, 0.9, 2), ratio(0.5, 0.4, 0.6, 3))
    sentence = wording.agreement_sentence(Agreement("B", "sliding", loads, False))
    assert "agrees within the 95 % interval at 1 of 3 loads" in sentence
    assert "too high at 2 of 3 loads" in sentence
    assert "by −26 %; the largest difference is −50 %, at 3.00 N" in sentence


def test_the_calibrated_sample_is_no_evidence(study: Study) -> None:
    agreements = findings.agreements(study)
    assert {a.sample for a in agreements if a.calibrated} == {"F"}
    predicted = [sentence.split("on F alone, ", 1)[1] for sentence in wording.in_short(agreements, "F")]
    assert len(predicted) == 2  # static and sliding
    assert not any(re.search(r"\bF\b", text) for text in predicted)
    flat = next(a for a in agreements if a.calibrated)
    assert "agreement here does not test the model" in wording.agreement_sentence(flat)


def test_the_synthetic_model_is_found_where_it_was_put(study: Study) -> None:
    from report.synthetic import MODEL_FACTOR

    agreements = findings.agreements(study)
    found = {(a.sample, a.regime): 1 / (1 + a.mean_deviation) for a in agreements}
    put = {(sample, regime): factor for sample, factor in MODEL_FACTOR.items() for regime in ("static", "sliding")}
    assert found == pytest.approx(put, rel=0.06)
    verdicts = {(a.sample, a.regime): a.verdict for a in agreements}
    assert verdicts["C", "static"] == verdicts["Sy", "sliding"] == "model too high"


def fit(sample: str, mu: float, mu_u: float, dof: float = 20.0) -> LawFit:
    return LawFit(
        sample, "static", "mu_tau0", ("mu", "tau0_Pa"), np.array([mu, 0.0]), np.diag([mu_u**2, 1e-6]), dof, 3, 9,
        "specimens", 1.0, 1e-4,
    )  # fmt: skip


def order(measured: list[LawFit], simulated: list[LawFit]) -> Ranking:
    return findings._ranking(measured, simulated, "static", 1.0)


def test_only_pairs_the_measurement_can_part_judge_the_order() -> None:
    measured = [fit("A", 3.0, 0.01), fit("B", 2.0, 0.01), fit("C", 2.001, 0.5)]
    found = order(measured, [fit("A", 1, 0.1), fit("B", 2, 0.1), fit("C", 0.5, 0.1)])
    assert found.told_apart == (("A", "B"),)
    assert found.reversed == (("A", "B"),)
    assert "reverses A > B" in wording.ranking_sentence(found)


def test_samples_that_cannot_be_parted_judge_nothing() -> None:
    found = order([fit("A", 3.0, 5.0), fit("B", 2.0, 5.0)], [fit("A", 1, 0.1), fit("B", 2, 0.1)])
    assert "No two samples differ significantly" in wording.ranking_sentence(found)


def test_the_direction_ratio_is_that_of_the_fitted_forces(study: Study) -> None:
    ratios = findings.direction_ratios(study)
    assert {(r.pattern, r.x, r.y) for r in ratios.itertuples()} == {("S", "Sx", "Sy")}
    assert len(ratios) == 3 * len(REGIMES)
    x, y = (next(f for f in study.fits if f.sample == s and f.regime == "static") for s in ("Sx", "Sy"))
    first = ratios.iloc[0]
    assert first.measured == pytest.approx(float(x.force_N(first.normal_load_N) / y.force_N(first.normal_load_N)))
    assert first.low < first.measured < first.high
    sentence = wording.direction_sentences(ratios)[0]
    assert sentence.startswith("Ratio of static friction Sx / Sy")
    assert "outside the 95 % interval of the measurement at 3 of them" in sentence


def test_a_campaign_without_directions_says_nothing_of_them(study: Study) -> None:
    campaign = study.ingested.campaign
    samples = {s: p for s, p in campaign.samples.items() if s != "Sy"}
    without = replace(study, ingested=replace(study.ingested, campaign=replace(campaign, samples=samples)))
    assert findings.direction_ratios(without).empty


def test_the_correlation_of_mu_and_tau0_is_that_of_the_covariance(study: Study) -> None:
    expected = [f.covariance[0, 1] / np.sqrt(f.covariance[0, 0] * f.covariance[1, 1]) for f in study.fits]
    assert findings.parameter_correlations(study.fits) == pytest.approx(expected)
    assert "are correlated" in wording.correlation_note(study)


def test_what_was_measured_counts_pulls_specimens_samples_and_loads(study: Study) -> None:
    sentence = wording.what_was_measured(study)
    assert "107 pulls of 18 specimens of 6 samples (F, A, B, C, Sx and Sy) at 6 loads" in sentence
    assert "2 tests were set aside" in sentence


def test_the_terminal_table_has_every_sample_twice_and_is_aligned(study: Study) -> None:
    lines = table2_text(study).splitlines()
    assert [line.split()[0] for line in lines if line].count("Sy") == 2
    static = lines[1:8]
    assert len({len(line) for line in static}) == 1
    assert "specimens" in lines[1]


def test_the_summary_says_what_was_measured_and_what_agrees(study: Study) -> None:
    assert len(summary_text(study).splitlines()) >= 5


@pytest.mark.parametrize(
    ("value", "u", "text"),
    [
        (4.7612, 0.73, "4.76 ± 0.73"),
        (-0.5, 0.01234, "−0.500 ± 0.012"),
        (1234.5, 56.7, "1234 ± 57"),
        (2.409781, 0.0009, "2.4098 ± 0.0009"),
        (2.409781, 1e-6, "2.4098 ± <0.0001"),
        (2.0, 0.0, "2.00"),
    ],
)
def test_an_uncertainty_has_two_digits_and_its_value_the_same_place(value: float, u: float, text: str) -> None:
    assert with_uncertainty(value, u) == text


def test_numbers_as_people_write_them() -> None:
    assert significant(0.0637432) == "0.0637"
    assert significant(float("nan")) == "–"
    assert span([0.55, 0.581]) == "0.55 to 0.58"
    assert span([0.55, 0.551]) == "0.55"
    assert percent(0.0123) == "1.2 %"
    assert percent(-0.345) == "−34 %"


@pytest.mark.parametrize(
    ("levels", "words"), [([0.3009], "1 load of 0.301 N"), ([0.1, 0.2, 1.5], "3 loads from 0.100 to 1.50 N")]
)
def test_one_load_is_told_once(levels: list[float], words: str) -> None:
    assert loads_in_words(levels) == words
