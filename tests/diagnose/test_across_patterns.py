"""One law over all patterns: found where there is one, judged by patterns left out, and by chance."""

from __future__ import annotations

from functools import cache
from itertools import combinations

import numpy as np
import pytest
from blind.direct import ingested
from blind.tribometer import Design, hide

from tribo.berardo2019.published_tables import load_table2
from tribo.berardo2019.table_diagnosis import readings, table_deviations
from tribo.berardo2019.table_model import read_table
from tribo.lawsearch.across_patterns import (
    Deviations,
    across_patterns,
    column,
    deviations_of,
    formula,
    geometry_of,
    grammar,
    left_out_errors,
    predicted,
    table_of,
)
from tribo.wording.law_sentences import across_sentence

from .known import baseline

PRESSURE_PA = np.array([2e3, 6e3, 18e3])


def deviations(seed: int, noise: float = 0.05, slope: float = -1.4, n: int = 8) -> Deviations:
    """Patterns of random geometry whose friction is exp(slope (1 - AF)) times the model's, give or take ``noise``."""
    rng = np.random.default_rng(seed)
    area, rim = rng.uniform(0.5, 0.95, n), rng.uniform(2e4, 2e5, n)
    geometry = geometry_of(area, rim, rng.uniform(5e-6, 6e-5, n), rng.choice([-1.0, 0.0, 1.0], n))
    ratio = slope * (1.0 - area)[:, None, None] + noise * rng.standard_normal((n, 2, 3))
    share = rng.uniform(0.1, 0.9, (n, 2, 1)) * np.array([1.0, 0.6, 0.3])
    return Deviations(tuple("ABCDEFGHIJ"[:n]), geometry, PRESSURE_PA, ratio, share)


@cache
def published() -> Deviations:
    table = load_table2()
    measured, simulated = (table[table["source"] == which] for which in ("experiment", "simulation"))
    return table_deviations(read_table(measured, simulated, readings()[0][1]))


def test_a_law_of_the_cavity_share_is_found_beyond_chance_and_predicts_patterns_left_out() -> None:
    found = across_patterns(deviations(0), most_terms=1)
    (search,) = found
    assert search.best.terms == (("1 - AF", "T", "both"),)
    assert search.best.coefficients == pytest.approx((-1.4,), abs=0.1)
    assert search.p < 0.01
    assert search.best.error == pytest.approx(0.05, abs=0.02)
    assert search.nested < 0.1 < search.deviations.size
    assert "One law across the patterns predicts" in across_sentence(found)


def test_where_geometry_says_nothing_no_law_is_beyond_chance() -> None:
    """A true hypothesis gives p values that are spread over the unit interval."""
    p = []
    for seed in range(12):
        found = across_patterns(deviations(seed, noise=0.3, slope=0.0, n=5), most_terms=1)
        p.append(found[0].p)
    assert min(p) >= 0.01
    assert 0.2 < float(np.mean(p)) < 0.8


def test_the_error_of_a_pattern_left_out_is_that_of_a_fit_without_it() -> None:
    d = deviations(3)
    terms = grammar(d)
    columns = np.array([column(t, d) for t in terms])
    laws = np.array(list(combinations(range(len(terms)), 2)))[::400]
    for law, error in zip(laws, left_out_errors(columns, d.log_ratio, laws), strict=True):
        squares = []
        for out in range(8):
            kept = [i for i in range(8) if i != out]
            design = columns[law][:, kept].reshape(2, -1).T
            fitted = np.linalg.lstsq(design, d.log_ratio[kept].ravel(), rcond=None)[0]
            squares.append((d.log_ratio[out] - np.tensordot(fitted, columns[law][:, out], axes=1)) ** 2)
        assert error == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-3)


def test_a_term_acts_in_its_regime_and_by_the_share_of_what_it_acts_on() -> None:
    d = deviations(1)
    for acts_on, share in (("T", 1.0), ("load term", 1 - d.adhesion_share), ("adhesion term", d.adhesion_share)):
        values = column(("1 - AF", acts_on, "sliding"), d)
        assert not values[:, 0].any()
        expected = d.geometry["1 - AF"][:, None, None] * share * np.ones((8, 2, 3))
        assert values[:, 1] == pytest.approx(expected[:, 1])
    bent = column(("1", "T, in proportion to ln p", "both"), d)
    assert bent[0, 0] == pytest.approx(np.log([1 / 3, 1.0, 3.0]))


def test_the_law_of_all_patterns_is_the_sum_of_its_terms() -> None:
    d = deviations(2, n=5)
    found = across_patterns(d, most_terms=2)
    best = found[1].best
    parts = [c * column(t, d) for c, t in zip(best.coefficients, best.terms, strict=True)]
    assert predicted(best, d) == pytest.approx(parts[0] + parts[1])
    assert formula(best).startswith("ln(T measured / T model) = ")


def test_three_patterns_are_too_few() -> None:
    assert across_patterns(deviations(0, n=3)) == ()


def test_the_deviations_of_table_2_are_those_of_its_printed_lines() -> None:
    """Sliding friction of C at 25 kPa: measured 1.9 + 1.5/25 and so on, over the model on the flat sample's line."""
    d = published()
    assert d.patterns == ("A", "B", "C", "Sx", "Sy")
    table = load_table2().set_index(["source", "sample", "regime"])
    at = {key: table.loc[key, "mu"] + table.loc[key, "tau0_kPa"] / 25.0 for key in table.index}
    for k, sample in enumerate(d.patterns):
        for r, regime in enumerate(("static", "sliding")):
            flat, model = table.loc[("experiment", "F", regime)], table.loc[("simulation", sample, regime)]
            own = table.loc[("simulation", "F", regime)]
            line = flat["mu"] * model["mu"] / own["mu"] + flat["tau0_kPa"] * model["tau0_kPa"] / own["tau0_kPa"] / 25.0
            assert d.log_ratio[k, r, -1] == pytest.approx(np.log(at["experiment", sample, regime] / line))


def test_with_five_patterns_the_best_law_of_table_2_is_not_beyond_chance() -> None:
    found = across_patterns(published(), most_terms=1)
    assert found[0].best.error < 0.65 * found[0].deviations.size
    assert found[0].p > 0.05
    assert "No law across the patterns is beyond chance" in across_sentence(found)
    assert len(table_of(found)) == len(grammar(published()))


def test_the_deviations_of_a_campaign_are_its_mean_logarithms_over_the_model() -> None:
    quiet = Design(
        samples=("F", "A", "B", "C", "Sx"), masses_g=(5.0, 25.0, 90.0), repeat_sd=(1e-6, 1e-6), specimen_sd=1e-9
    )
    f = baseline(ingested(hide(905, [], quiet), 905))
    d = deviations_of(f)
    c = f.setup.observations.conditions
    assert d.patterns == ("A", "B", "C", "Sx")
    assert d.log_ratio.shape == (4, 2, 3)
    for k, sample in enumerate(d.patterns):
        heaviest = (c.sample == sample) & (c.normal_load_N > 0.85)
        assert d.log_ratio[k, :, 2] == pytest.approx(f.residual[heaviest].mean(axis=0), abs=1e-6)
        assert d.geometry["1 - AF"][k] == pytest.approx(1 - c.area_fraction[c.sample == sample][0])
