"""Laws that are curves: told where no formula predicts as well, with a band that holds; a right formula stays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind.tribometer import Design
from support import first_quick

from tribo.diagnostics.diagnosis import examine
from tribo.diagnostics.model import Setup
from tribo.display import exact_text
from tribo.errors import CampaignError
from tribo.lawsearch.diagnosis_with_laws import with_laws
from tribo.lawsearch.free_curves import KNOTS
from tribo.lawsearch.known_laws import law_text, read_law, validate_law
from tribo.lawsearch.model_choice import FoundLaw, centred
from tribo.lawsearch.scoring import terms_of
from tribo.lawsearch.search import discover_laws
from tribo.wording.law_sentences import law_sentence
from tribo.wording.verdict_sentences import worded

from .known import baseline, made

DESIGN = Design(samples=("F", "A", "B", "Sx"), repeats=3)


def two_humps(s: Setup) -> np.ndarray:
    """Sliding friction is lower at 22 and at 24 degrees than between and beside them."""
    t = s.observations.conditions.temperature_C
    course = -np.exp(-(((t - 22.0) / 0.5) ** 2)) - 0.7 * np.exp(-(((t - 24.3) / 0.4) ** 2))
    return np.column_stack([np.zeros(len(t)), 0.2 * course])


def on_two_samples(s: Setup) -> np.ndarray:
    c = s.observations.conditions
    return (np.isin(c.sample, ["A", "Sx"]) * 0.12 * np.clip(c.temperature_C - 23.0, -2, 2))[:, None] * np.ones(2)


@pytest.fixture(scope="module")
def curve() -> FoundLaw:
    (law,) = discover_laws(baseline(made(two_humps, seed=2, design=DESIGN)), replicates=20).laws
    return law


def test_what_no_formula_tells_is_a_curve_of_its_column_and_regime(curve: FoundLaw) -> None:
    assert curve.law.columns == ("temperature_C",)
    assert (curve.law.regime, curve.law.where) == ("sliding", "all")
    assert curve.law.shapes[0].kind == "curve"
    assert curve.ties == ()


def test_the_band_of_a_curve_holds_the_hidden_change(curve: FoundLaw) -> None:
    s = curve.model.setup
    true = centred(two_humps(s), s.observations.conditions, terms_of(curve.model)["load term"])[:, 1]
    held = (curve.band[1, :, 1] <= true) & (true <= curve.band[2, :, 1])
    assert held.mean() > 0.75
    assert np.ptp(curve.band[2, :, 1] - curve.band[0, :, 1]) < np.ptp(true)


def test_a_curve_is_told_at_places_of_its_column_and_said_to_be_one(curve: FoundLaw) -> None:
    said = law_sentence(curve)
    assert said.startswith("Sliding friction follows the temperature along a curve: ")
    assert "relative to the mean over the tests" in said
    assert len(curve.levels) == said.count("°C") == 7


@pytest.mark.parametrize("seed", first_quick([2, 5]))
def test_a_formula_that_is_right_stays(seed: int) -> None:
    def warm(s: Setup) -> np.ndarray:
        t = s.observations.conditions.temperature_C
        return np.column_stack([np.zeros(len(t)), -0.03 * (t - 23.0) ** 2])

    (law,) = discover_laws(baseline(made(warm, seed=seed, design=DESIGN)), replicates=20).laws
    assert law.law.shapes[0].kind in ("optimum", "hump")


@pytest.mark.slow
def test_a_law_of_two_of_four_samples_is_said_of_these() -> None:
    (law,) = discover_laws(baseline(made(on_two_samples, seed=2, design=DESIGN)), replicates=20).laws
    assert law.law.where == "samples A + Sx"
    assert law_sentence(law).startswith("Friction of samples A, Sx ")


def test_a_curve_is_written_and_read_again_and_holds_where_it_is_at_work(curve: FoundLaw, tmp_path: Path) -> None:
    (tmp_path / "law.toml").write_text(law_text(curve.law, curve.parameters, "two humps"), encoding="utf-8")
    again = read_law(tmp_path / "law.toml")
    assert exact_text(again.law) == exact_text(curve.law)
    assert len(again.law.shapes[0].heights) == KNOTS
    there = baseline(made(two_humps, seed=8, design=DESIGN))
    assert validate_law(there, again).answer == "held"
    absent = baseline(made(lambda s: 0.0 * two_humps(s), seed=8, design=DESIGN))
    assert validate_law(absent, again).answer == "not held"


def test_a_curve_without_a_height_at_each_value_or_out_of_order_is_refused(curve: FoundLaw, tmp_path: Path) -> None:
    shape = curve.law.shapes[0]
    for wrong in (replace(shape, heights=shape.heights[1:]), replace(shape, values=shape.values[::-1])):
        law = replace(curve.law, shapes=(wrong,))
        (tmp_path / "law.toml").write_text(law_text(law, curve.parameters, ""), encoding="utf-8")
        with pytest.raises(CampaignError, match="curve"):
            read_law(tmp_path / "law.toml")


def hump_of_static_friction(s: Setup) -> np.ndarray:
    """Static friction is higher near a nominal pressure of 9 kPa, on all samples."""
    p = s.observations.conditions.pressure_Pa
    return np.column_stack([0.35 * np.exp(-0.5 * (np.log(p / 9e3) / 0.25) ** 2), np.zeros(len(p))])


@pytest.mark.slow
def test_a_mechanism_to_which_a_law_leaves_nothing_is_no_cause_beside_it() -> None:
    design = Design(samples=("F", "A", "B", "Sx"), masses_g=(12.0, 25.0, 50.0, 75.0, 100.0, 138.5))
    d = with_laws(examine(made(hump_of_static_friction, seed=1, design=design), replicates=(60, 40)))
    v = worded(d.verdict)
    assert d.laws is not None
    assert d.laws.laws
    assert v.causes == ()


@pytest.mark.slow
def test_a_law_takes_the_place_of_the_misfit_of_its_column() -> None:
    d = with_laws(examine(made(two_humps, seed=2, design=DESIGN), replicates=(40, 40)))
    of_column = [m for m in d.verdict.misfits if "temperature" in m.covariate]
    assert [m.shows for m in of_column] == list(d.laws.laws)


def warm_and_humid(s: Setup) -> np.ndarray:
    """Friction is higher where it is warm and humid or cold and dry: neither column alone tells much."""
    c = s.observations.conditions
    return (0.3 * np.sin((c.temperature_C - 23.0) / 1.5) * np.sin((c.humidity_pct - 49.0) / 6.0))[:, None] * np.ones(2)


@pytest.fixture(scope="module")
def surface() -> FoundLaw:
    (law,) = discover_laws(baseline(made(warm_and_humid, seed=2, design=DESIGN)), replicates=20).laws
    return law


def test_what_two_columns_do_only_together_is_a_surface(surface: FoundLaw) -> None:
    assert set(surface.law.columns) == {"temperature_C", "humidity_pct"}
    assert (surface.law.regime, surface.law.where) == ("both", "all")
    assert [shape.kind for shape in surface.law.shapes] == ["surface", "surface"]
    said = law_sentence(surface)
    assert said.startswith("Friction follows the temperature and the humidity together: ")
    assert len(surface.levels) == said.count(" %) at ") == 9


def test_the_band_of_a_surface_holds_a_hidden_change_without_jumps(surface: FoundLaw) -> None:
    s = surface.model.setup
    true = centred(warm_and_humid(s), s.observations.conditions, terms_of(surface.model)["load term"])
    assert ((surface.band[1] <= true) & (true <= surface.band[2])).mean() > 0.75
    assert np.median(surface.band[2] - surface.band[1]) < 0.5 * np.ptp(true)


def warm_beside_humid(s: Setup) -> np.ndarray:
    """Above 23 degrees friction rises with the temperature, the more the more humid it is."""
    c = s.observations.conditions
    return (0.08 * np.maximum(c.temperature_C - 23.0, 0.0) * (c.humidity_pct - 49.0) / 6.0)[:, None] * np.ones(2)


def test_the_band_of_a_product_of_two_columns_holds_a_hidden_change_that_bends() -> None:
    model = baseline(made(warm_beside_humid, seed=2, design=DESIGN))
    (law,) = discover_laws(model, replicates=20).laws
    assert [shape.kind for shape in law.law.shapes] == ["linear", "linear"]
    s = law.model.setup
    true = centred(warm_beside_humid(s), s.observations.conditions, terms_of(law.model)["load term"])
    assert ((law.band[1] <= true) & (true <= law.band[2])).mean() > 0.65  # 0.47 by the product alone


def broken_line(s: Setup) -> np.ndarray:
    """Sliding friction rises and falls with the temperature along straight lines."""
    t = s.observations.conditions.temperature_C
    course = 0.12 * np.interp(t, [20, 22, 22.7, 24.2, 26], [0.2, 0.0, 1.0, -0.4, 0.3])
    return np.column_stack([np.zeros(len(t)), course])


def uneven_wave(s: Setup) -> np.ndarray:
    h = s.observations.conditions.humidity_pct
    return np.column_stack([np.zeros(len(h)), 0.05 * np.sin(h / 3.0) * (1 + 0.8 * np.sin(h / 5.0))])


def test_the_band_of_a_formula_holds_what_the_formula_does_not_follow() -> None:
    held = []
    for hidden in (broken_line, uneven_wave):
        (law,) = discover_laws(baseline(made(hidden, seed=2, design=DESIGN)), replicates=20).laws
        assert law.law.shapes[0].kind != "curve"
        s = law.model.setup
        true = centred(hidden(s), s.observations.conditions, terms_of(law.model)["load term"])[:, 1]
        held.append(((law.band[1, :, 1] <= true) & (true <= law.band[2, :, 1])).mean())
    assert np.mean(held) > 0.85  # 0.78 for what the formula leaves alone


def seven_turns(s: Setup) -> np.ndarray:
    order = s.observations.conditions.run_order
    return 0.08 * np.sin(2.0 * np.pi * 7.0 * order / order.max())[:, None] * np.ones(2)


def test_the_band_of_a_wave_over_the_series_holds_it_although_drift_could_take_it_up() -> None:
    (law,) = discover_laws(baseline(made(seven_turns, seed=3, design=DESIGN)), replicates=20).laws
    assert set(law.law.columns) <= {"run_order", "elapsed_s"}
    s = law.model.setup
    true = centred(seven_turns(s), s.observations.conditions, terms_of(law.model)["load term"])
    assert ((law.band[1] <= true) & (true <= law.band[2])).mean() > 0.75
    assert np.median(law.band[2] - law.band[1]) < 0.5 * np.ptp(true)


def test_a_surface_is_written_and_read_again_and_holds_where_it_is_at_work(surface: FoundLaw, tmp_path: Path) -> None:
    (tmp_path / "law.toml").write_text(law_text(surface.law, surface.parameters, "two columns"), encoding="utf-8")
    again = read_law(tmp_path / "law.toml")
    assert exact_text(again.law) == exact_text(surface.law)
    there = baseline(made(warm_and_humid, seed=8, design=DESIGN))
    assert validate_law(there, again).answer == "held"


def test_a_surface_without_a_height_at_every_pair_is_refused(surface: FoundLaw, tmp_path: Path) -> None:
    one, other = surface.law.shapes
    for shapes in ((one,), (one, replace(other, heights=other.heights[1:]))):
        law = replace(surface.law, shapes=shapes)
        (tmp_path / "law.toml").write_text(law_text(law, surface.parameters, ""), encoding="utf-8")
        with pytest.raises(CampaignError, match="surface"):
            read_law(tmp_path / "law.toml")
