"""The diagnosis of Table 2 of the paper: what its numbers say, and what they leave open."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tribo.berardo2019.published_tables import load_table2, load_table2_simulated_anew
from tribo.berardo2019.table_diagnosis import (
    LEAST_CORRELATION,
    PublishedDiagnosis,
    diagnose_published,
    diagnose_reading,
    readings,
)
from tribo.berardo2019.table_model import (
    design_correlation,
    even_loads,
    fit_table,
    predict_table,
    read_table,
    upper_limit,
)
from tribo.figures.catalogue import PUBLISHED_FIGURES
from tribo.mechanisms import MECHANISMS
from tribo.wording.verdict_sentences import worded


def published(source: str) -> pd.DataFrame:
    table = load_table2()
    return table[table["source"] == source]


@pytest.fixture(scope="module")
def whole() -> PublishedDiagnosis:
    return diagnose_published(load_table2(), load_table2_simulated_anew())


def test_a_line_over_the_loads_of_the_paper_has_at_least_the_stated_correlation() -> None:
    """Kantorovich: whatever the loads and their weights, mean over rms of 1/p is bounded by the ends of the range."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        x = 1 / rng.uniform(3e3, 25e3, 6)
        weights = rng.dirichlet(np.ones(6))
        assert -(weights @ x) / np.sqrt(weights @ x**2) < LEAST_CORRELATION
    assert design_correlation(np.array([3e3] * 3 + [25e3] * 25)) == pytest.approx(LEAST_CORRELATION, abs=1e-3)


def test_the_correlation_of_a_line_fit_is_that_of_its_covariance_matrix() -> None:
    loads = even_loads()
    x = np.column_stack([np.ones_like(loads), 1 / loads])
    c = np.linalg.inv(x.T @ x)
    assert design_correlation(loads) == pytest.approx(c[0, 1] / np.sqrt(c[0, 0] * c[1, 1]))


def test_without_mechanisms_the_model_is_the_simulated_table_scaled_to_the_flat_sample() -> None:
    table = read_table(published("experiment"), published("simulation"), -0.8)
    law = np.array([4.78, 23.44, 2.879, 11.89])
    expected = published("simulation").set_index(["sample", "regime"])
    found = predict_table(table, law).reshape(-1, 2, 2)
    for i, sample in enumerate(table.samples):
        for r, regime in enumerate(("static", "sliding")):
            assert found[i, r] == pytest.approx(expected.loc[(sample, regime), ["mu", "tau0_kPa"]].to_numpy(float))


def test_a_table_made_by_the_model_itself_shows_no_misfit() -> None:
    made = published("experiment").merge(published("simulation"), on=["sample", "regime"], suffixes=("_old", ""))
    made = made[["sample", "regime", "mu", "tau0_kPa"]].assign(
        mu_sd=published("experiment")["mu_sd"].to_numpy(), tau0_sd_kPa=published("experiment")["tau0_sd_kPa"].to_numpy()
    )
    table = read_table(made, published("simulation"), design_correlation(even_loads()))
    assert diagnose_reading(table, readings()[0], np.random.default_rng(0)).outcome == "no_misfit"


@pytest.mark.parametrize("name", ["suction", "contact_area_loss", "cavity_shear_deformation"])
def test_a_mechanism_put_into_the_table_is_found_again_with_its_size(name: str) -> None:
    from tribo.diagnostics.model import Acting

    exact = published("experiment").assign(mu_sd=0.05, tau0_sd_kPa=0.4)
    table = read_table(exact, published("simulation"), -0.79)
    law, m = np.array([4.78, 23.44, 2.879, 11.89]), MECHANISMS[name]
    values = predict_table(table, law, (Acting(m),), (m.start(),))
    made = exact.assign(mu=values.reshape(-1, 2, 2)[..., 0].ravel(), tau0_kPa=values.reshape(-1, 2, 2)[..., 1].ravel())
    order = [(s, r) for s in table.samples for r in ("static", "sliding")]
    made = made.set_index(["sample", "regime"])
    made.loc[order, ["mu", "tau0_kPa"]] = values.reshape(-1, 2)
    again = read_table(made.reset_index(), published("simulation"), -0.79)
    f = fit_table(again, (Acting(m),))
    assert f.parameters[0][0] == pytest.approx(m.start()[0], rel=0.02)
    assert f.score > fit_table(again).score + 2


@pytest.mark.slow
def test_whether_the_papers_model_fails_hangs_on_the_correlation_and_on_what_the_deviations_are_of(
    whole: PublishedDiagnosis,
) -> None:
    """Deviations of three specimens: it fails in every reading. Of the mean: only with a close correlation."""
    possible = [o for o in whole.results if o.correlation <= LEAST_CORRELATION]
    assert all(o.p_misfit < 0.01 for o in possible if o.specimens == 3)
    of_mean = {(o.model, o.correlation): o.p_misfit for o in whole.results if o.specimens == 1}
    for model in ("paper", "tribo"):
        assert of_mean[model, -0.95] < 0.01
        assert of_mean[model, LEAST_CORRELATION] > 0.01
        assert of_mean[model, 0.0] > 0.01


@pytest.mark.slow
def test_suction_is_excluded_in_every_reading_and_deformed_patterns_are_not(whole: PublishedDiagnosis) -> None:
    for o in whole.results:
        gains = {w.name: w.gain for w in o.weighed}
        assert gains["suction"] < 0.1
        assert gains["cavity_shear_deformation"] > max(gains["suction"], gains["contact_area_loss"]) - 1
    suction = next(e for e in whole.verdict.excluded if e.mechanism == "suction")
    assert suction.why == "wrong sign"
    assert 0.0 < suction.shows < 2000.0
    assert upper_limit(whole.main.baseline, "suction") < 2000.0


@pytest.mark.slow
def test_the_verdict_says_what_holds_of_each_guess_and_accounts_for_every_mechanism(whole: PublishedDiagnosis) -> None:
    v = worded(whole.verdict)
    assert all(word in v.text for word in ("Deformed patterns", "contact area", "Suction cups", "covariance"))
    named = {c.mechanism for c in v.causes} | {e.mechanism for e in v.excluded} | {whole.main.weighed[0].name}
    assert named == set(MECHANISMS)
    assert whole.main.p_misfit > 0.01
    assert (v.verdict, v.gain, v.misfits) == ("no_misfit", None, ())
    told = v.as_dict()["model"]["readings"]
    assert [r["outcome"] for r in told] == [o.outcome for o in whole.results]


@pytest.mark.slow
@pytest.mark.parametrize("name", list(PUBLISHED_FIGURES))
def test_the_figures_of_the_table_are_drawn_from_their_numbers(name: str, whole: PublishedDiagnosis) -> None:
    numbers = PUBLISHED_FIGURES[name].numbers(whole)
    assert not numbers.empty
    assert PUBLISHED_FIGURES[name].draw(numbers).axes


def test_the_table_simulated_anew_is_the_one_in_the_docs() -> None:
    from pathlib import Path

    docs = Path(__file__).parents[2] / "docs" / "data" / "table2.csv"
    own = load_table2_simulated_anew()
    assert own.equals(pd.read_csv(docs)[list(own.columns)])
