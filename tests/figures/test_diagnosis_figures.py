"""The figures of a diagnosis show what it found, and mark no more than chance allows."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from diagnose.examined import Once, examined
from matplotlib.figure import Figure
from matplotlib.text import Text
from support import first_quick

from figures.against_verdict import contradictions
from figures.test_figures import collisions
from tribo.diagnostics import Diagnosis
from tribo.diagnostics.fit import fit, residual_on_flat
from tribo.diagnostics.model import OF_PATTERNS
from tribo.diagnostics.verdict import Layer, Misfit
from tribo.figures import evidence, extended_model, misfit, residuals, style
from tribo.figures.catalogue import DIAGNOSIS_FIGURES
from tribo.figures.misfit import misfit_numbers
from tribo.figures.residuals import draw_finding, finding_numbers
from tribo.figures.style import house_style
from tribo.lawsearch.grammar import Shape, WrittenLaw

NAMES = list(DIAGNOSIS_FIGURES)


@pytest.fixture(scope="module")
def temperature(once: Once) -> Diagnosis:
    return examined("temperature", once)


@pytest.fixture(scope="module")
def nothing(once: Once) -> Diagnosis:
    return examined("nothing", once)


@pytest.fixture(scope="module")
def patterns_off(once: Once) -> Diagnosis:
    """Patterns six times as far from the model as its stated error, and nothing else hidden."""
    return examined("patterns_off", once)


def shown_points(figure: Figure) -> set[tuple[float, float]]:
    lines = [np.asarray(line.get_xydata(), float) for ax in figure.axes for line in ax.lines]
    xy = np.concatenate([line for line in lines if len(line)])
    return {(float(f"{x:.6g}"), float(f"{y:.6g}")) for x, y in xy[np.isfinite(xy).all(axis=1)]}


def test_the_heat_map_marks_the_column_that_was_hidden_and_its_sign(temperature: Diagnosis) -> None:
    cells = misfit.misfit_numbers(temperature)
    hit = cells.query("row == @misfit.ALL and observable == 'both' and covariate == 'temperature_C'")
    assert hit["mark"].item() == "**"
    assert hit["effect_percent"].item() < -10
    assert cells[cells["mark"] != ""]["covariate"].value_counts().idxmax() == "temperature_C"


def test_the_heat_map_of_a_campaign_without_effect_marks_nothing(nothing: Diagnosis) -> None:
    cells = misfit.misfit_numbers(nothing)
    assert (cells["mark"] == "").all()
    assert set(cells["observable"]) >= {"both", "static", "sliding", "drop"}


def test_tests_without_a_time_do_not_count_in_the_cells_of_time(temperature: Diagnosis) -> None:
    f = temperature.baseline
    o = f.setup.observations
    gone = np.arange(o.n) % 3 == 0
    times = replace(o.conditions, elapsed_s=np.where(gone, np.nan, o.conditions.elapsed_s))
    f = replace(f, setup=replace(f.setup, observations=replace(o, conditions=times)))
    cells = misfit.misfit_numbers(replace(temperature, baseline=f)).query("row == @misfit.ALL and observable == 'both'")
    assert np.isfinite(cells["effect_percent"]).all()
    told = cells[cells["covariate"] == "started_at"]["effect_percent"].item()
    y, x = residual_on_flat(f)[~gone].mean(axis=1), times.elapsed_s[~gone]
    line = np.polyfit(x, y, 1)[0] * np.subtract(*np.quantile(x, [0.95, 0.05]))
    assert told == pytest.approx(100 * np.expm1(line), rel=1e-6)


def test_the_heat_map_marks_the_samples_that_the_verdict_says_differ_and_no_other_mean(patterns_off: Diagnosis) -> None:
    cells = misfit.misfit_numbers(patterns_off)
    means = cells[(cells["covariate"] == "mean") & cells["observable"].isin(["static", "sliding"])]
    marked = means[means["p_adjusted"] < 0.01]
    said = {(m.sample, m.observable) for m in patterns_off.verdict.misfits if m.covariate == "sample"}
    assert said
    assert set(zip(marked["row"], marked["observable"], strict=True)) == said
    assert misfit.draw_misfit(cells).axes[-2].get_xticklabels()[0].get_text() == "mean"


def test_samples_that_differ_come_first_among_the_residuals_and_points_outside_their_band_have_a_small_p(
    patterns_off: Diagnosis,
) -> None:
    rows = residuals.residual_numbers(patterns_off)
    outside = {}
    for panel, part in rows.groupby("panel"):
        means, bands = (part[part["mark"] == mark].set_index("x") for mark in ("mean", "band"))
        beyond = (means["y"] < bands["y_low"]) | (means["y"] > bands["y_high"])
        outside[part["detail"].iloc[0]] = beyond.mean()
        assert (panel == 0) == (part["axis"].iloc[0] == "Sample")
    assert rows[rows["x"] == 0.0]["x_name"].iloc[0] == "F"  # the flat sample first
    assert all((share > 0.3) == (detail == "p < 0.001") for detail, share in outside.items()), outside
    assert outside["p < 0.001"] > 0.3


def test_the_picture_of_chance_does_not_deny_a_misfit_of_the_samples(
    patterns_off: Diagnosis, nothing: Diagnosis
) -> None:
    def answer(d: Diagnosis) -> str:
        return evidence.draw_power(evidence.power_numbers(d)).axes[0].get_title("right")

    assert answer(nothing) == "no"
    assert answer(patterns_off) == "means: yes, else: no"


def test_no_figure_says_the_opposite_of_its_verdict(
    temperature: Diagnosis, nothing: Diagnosis, patterns_off: Diagnosis
) -> None:
    """Forty campaigns of all kinds are checked by benchmarks/next_tests.py."""
    assert [contradictions(d) for d in (temperature, nothing, patterns_off)] == [[], [], []]


def test_a_figure_that_says_the_opposite_is_noticed(
    temperature: Diagnosis, nothing: Diagnosis, patterns_off: Diagnosis
) -> None:
    """Each figure beside the verdict of another campaign, or of the same one with the opposite sign."""
    first, *others = patterns_off.verdict.misfits
    turned = replace(first, effect_percent=-first.effect_percent, low=-first.high, high=-first.low)
    wrong = {
        "picture of chance says yes": replace(temperature, verdict=nothing.verdict),
        "bars name": replace(temperature, verdict=nothing.verdict),
        "cells are marked": replace(temperature, verdict=nothing.verdict),
        "picture of chance says no": replace(nothing, verdict=temperature.verdict),
        "its cell": replace(patterns_off, verdict=replace(patterns_off.verdict, misfits=(turned, *others))),
    }
    for said, d in wrong.items():
        assert any(said in text for text in contradictions(d)), said
    assert any("no misfit, and p" in text for text in contradictions(wrong["bars name"]))


def test_the_heat_map_marks_a_mean_that_the_verdict_tells_beside_its_causes(nothing: Diagnosis) -> None:
    """The mean of the flat sample too, which the calibration takes up as long as no cause is at work."""
    left = tuple(Misfit("sliding", sample, "sample", size, 0.003) for sample, size in (("F", -8.1), ("B", 23.2)))
    cells = misfit_numbers(replace(nothing, verdict=replace(nothing.verdict, verdict="partly", misfits=left)))
    marked = cells[(cells["covariate"] == "mean") & (cells["mark"] != "")].set_index(["row", "observable"])
    assert dict(marked["effect_percent"]) == pytest.approx({("F", "sliding"): -8.1, ("B", "sliding"): 23.2})


def with_law_of(d: Diagnosis, *columns: str) -> Diagnosis:
    """The same campaign with a verdict that rests on a law of these columns."""
    law = WrittenLaw(tuple(Shape("linear", name) for name in columns), "T", "static")
    layer = Layer(
        kind="law", name=" and ".join(columns), samples=(), regimes=("static",), p_adjusted=1e-6, effect_percent=20.0,
        low=15.0, high=25.0, shows=SimpleNamespace(law=law),
    )  # fmt: skip
    return replace(d, verdict=replace(d.verdict, verdict="unknown", misfits=(), causes=(), layers=(layer,)))


def test_the_picture_of_the_card_shows_the_columns_of_the_law_that_the_finding_tells(nothing: Diagnosis) -> None:
    """One of two columns at the lowest and at the highest third of the other."""
    one = finding_numbers(with_law_of(nothing, "humidity_pct"))
    assert set(one["axis"]) == {"Relative humidity (%)"}
    assert set(one["group"]) == {""}
    two = finding_numbers(with_law_of(nothing, "temperature_C", "humidity_pct"))
    assert set(two["axis"]) == {"Temperature (°C)"}
    low, high = sorted(set(two.loc[two["mark"] == "mean", "group"]), reverse=True)
    assert low.startswith("humidity up to")
    assert high.startswith("humidity from")
    c = nothing.baseline.setup.observations.conditions
    assert float(low.split()[-2]) == pytest.approx(np.quantile(c.humidity_pct, 1 / 3), rel=0.02)
    labels = [t.get_text() for t in draw_finding(two).legends[0].get_texts()]
    assert labels[:2] == [low, high]


def test_the_mean_of_a_pattern_that_rubs_more_is_that_much_higher_and_no_other_is(nothing: Diagnosis) -> None:
    """The model is calibrated on the flat sample, so what C does changes neither it nor the cells of A and B."""
    s = nothing.baseline.setup
    o = s.observations
    raised = o.log_force + np.log(1.2) * (o.conditions.sample == "C")[:, None]
    louder = fit(replace(s, observations=replace(o, log_force=raised)))
    means = [mean_cells(d) for d in (nothing, replace(nothing, baseline=louder))]
    assert "F" not in means[0].index
    factor = (1 + means[1] / 100) / (1 + means[0] / 100)
    assert factor.to_dict() == pytest.approx({s: 1.2 if s == "C" else 1.0 for s in means[0].index}, abs=0.005)


def mean_cells(d: Diagnosis) -> pd.Series:
    cells = misfit.misfit_numbers(d)
    return cells[(cells["covariate"] == "mean") & (cells["observable"] == "static")].set_index("row")["effect_percent"]


def test_the_strongest_contrast_comes_first_with_the_curve_of_the_named_mechanism(temperature: Diagnosis) -> None:
    rows = residuals.residual_numbers(temperature)
    first = rows[rows["panel"] == 0]
    assert first["axis"].iloc[0].startswith("Temperature")
    curve = first[first["mark"] == "curve"].sort_values("x")
    assert (curve["y"].diff(2).dropna() < 0).all()  # neighbouring bins hold tests at different loads
    assert (first["mark"] == "test").sum() == temperature.baseline.setup.observations.n


def test_the_grey_band_is_that_of_the_means_beside_it(nothing: Diagnosis) -> None:
    rows = residuals.residual_numbers(nothing).reset_index()
    means = rows[rows["mark"] == "mean"].merge(rows[rows["mark"] == "band"], on=["panel", "x"], suffixes=("", "_band"))
    inside = ((means["y"] > means["y_low_band"]) & (means["y"] < means["y_high_band"])).mean()
    assert inside > 0.9
    weight, every = np.array([1.0, 0.0]), np.arange(nothing.baseline.setup.observations.n)
    single = np.mean([residuals.variance_of_mean(nothing, weight, every[k : k + 1], stated=False) for k in every])
    assert residuals.variance_of_mean(nothing, weight, every, stated=False) < single / 3


def test_what_is_expected_of_a_right_model_does_not_grow_with_how_wrong_the_campaign_shows_it_to_be(
    nothing: Diagnosis,
) -> None:
    f = nothing.baseline
    patterned = f.setup.of_patterns
    sample = np.flatnonzero(f.setup.observations.conditions.area_fraction < 1.0)
    found = []
    for factor in (1.0, 10.0):
        precision = np.where(patterned, factor**-2.0, f.precision)
        sizes = f.noise.sizes.copy()
        sizes[list(OF_PATTERNS)] = factor
        wrong = replace(f, noise=replace(f.noise, sizes=sizes), precision=precision)
        wrong_in = replace(nothing, baseline=wrong)
        found.append(residuals.variance_of_mean(wrong_in, np.array([1.0, 0.0]), sample, stated=True))
    assert found[1] == pytest.approx(found[0])


def test_a_point_of_a_residual_is_measured_over_model_less_one(temperature: Diagnosis) -> None:
    rows = residuals.residual_numbers(temperature)
    static = rows[(rows["mark"] == "test") & rows["y_axis"].str.startswith("Static friction")]
    both = rows[(rows["mark"] == "test") & rows["y_axis"].str.startswith("Static and sliding")]
    shown = static if len(static) else both
    ratio = np.exp(residual_on_flat(temperature.baseline))
    expected = 100 * ((ratio[:, 0] if len(static) else np.sqrt(ratio.prod(axis=1))) - 1)
    by_test = dict(zip(temperature.baseline.setup.observations.test_ids, expected, strict=True))
    first = shown[shown["panel"] == shown["panel"].iloc[0]]
    assert first["y"].to_numpy() == pytest.approx([by_test[t] for t in first["test_id"]])


def test_the_caption_names_columns_that_the_heat_map_has(nothing: Diagnosis) -> None:
    caption = DIAGNOSIS_FIGURES["misfit"].caption
    named = re.findall(r"[Cc]olumn “([^”]*)”", caption)
    assert len(named) == 2
    assert set(named) <= set(misfit.misfit_numbers(nothing)["label"])


def test_the_extended_model_has_the_smaller_residuals(temperature: Diagnosis, nothing: Diagnosis) -> None:
    rows = extended_model.extended_numbers(temperature)
    rms = rows.groupby("model")["rms_percent"].mean()
    assert rms["after"] < rms["before"]
    assert extended_model.extended_numbers(nothing).empty


def test_power_grows_with_the_effect_around_half(nothing: Diagnosis) -> None:
    rows = evidence.power_numbers(nothing)
    sizes = rows[rows["mark"] == "mechanism"]
    assert (sizes["found_10_percent"] < sizes["found_50_percent"]).all()
    assert (sizes["found_50_percent"] < sizes["found_90_percent"]).all()
    halves = dict(zip(sizes["name"], sizes["found_50_percent"], strict=True))
    assert halves.items() <= nothing.verdict.smallest_effects.items()


@pytest.mark.parametrize("name", ["residuals", "extended", "power"])
def test_what_is_drawn_is_what_the_table_says(name: str, temperature: Diagnosis) -> None:
    rows = DIAGNOSIS_FIGURES[name].numbers(temperature)
    mark, x, y = {
        "residuals": ("mean", "x", "y"), "extended": ("", "normal_load_N", "residual_percent"),
        "power": ("mechanism", "found_50_percent", ""),
    }[name]  # fmt: skip
    part = rows[rows["mark"] == mark] if mark else rows
    drawn = shown_points(DIAGNOSIS_FIGURES[name].draw(rows))
    if not y:
        assert {across for across, _ in drawn} >= {float(f"{v:.6g}") for v in part[x]}
        return
    assert {(float(f"{a:.6g}"), float(f"{b:.6g}")) for a, b in part[[x, y]].to_numpy(float)} <= drawn


@pytest.mark.parametrize("name", [n for n in NAMES if n != "law"])  # a known cause leaves no law; see test_discovery
def test_no_label_lies_outside_the_figure_or_on_another(name: str, temperature: Diagnosis) -> None:
    rows = DIAGNOSIS_FIGURES[name].numbers(temperature)
    assert isinstance(rows, pd.DataFrame)
    assert not rows.empty
    figure = DIAGNOSIS_FIGURES[name].draw(rows)
    with house_style():
        figure.draw_without_rendering()
    page = figure.bbox
    texts = [
        t
        for ax in figure.axes
        for t in (
            *(t for t in (*ax.get_xticklabels(), *ax.get_yticklabels())), ax.xaxis.label, ax.yaxis.label,
            *(c for c in ax.get_children() if isinstance(c, Text)),
        )
        if t.get_text() and t.get_visible() and _inside(ax, t)
    ]  # fmt: skip
    texts += [t for legend in figure.legends for t in legend.get_texts()]
    boxes = [(t.get_text(), t.get_window_extent()) for t in texts]
    outside = [s for s, b in boxes if b.x0 < page.x0 or b.x1 > page.x1 or b.y0 < page.y0 or b.y1 > page.y1]
    assert not outside
    upright = [(t.get_text(), t.get_window_extent()) for t in texts if t.get_rotation() in (0, 90)]
    assert not [(s, u) for k, (s, a) in enumerate(upright) for u, b in upright[k + 1 :] if a.overlaps(b)]


@pytest.mark.parametrize("n", first_quick([12, 2, 5, 8]))
def test_before_and_after_of_any_number_of_samples_have_no_label_on_another(temperature: Diagnosis, n: int) -> None:
    rows = extended_model.extended_numbers(temperature)
    one = rows[rows["sample"] == rows["sample"].iloc[0]]
    names = ("F", "A", "Sx", "S 20/40 dry", "K5", "Kx", "Ky", "holes 7", "B", "C", "D", "E")[:n]
    many = pd.concat([one.assign(sample=name, sample_number=k) for k, name in enumerate(names)], ignore_index=True)
    figure = extended_model.draw_extended(many)
    assert collisions(figure) == []
    assert len(figure.axes) == 2 * n


def test_long_words_beside_a_long_bar_stay_on_the_page(temperature: Diagnosis) -> None:
    rows = DIAGNOSIS_FIGURES["evidence"].numbers(temperature)
    rows.loc[0, ["choice", "gain"]] = ["Sx2 of Sx swapped with B3 of B, a long choice", 500.0]
    reason = "what this design does not vary cannot be told " * 2
    rows.loc[1, ["status", "reason", "gain"]] = ["out", reason, float("nan")]
    figure = DIAGNOSIS_FIGURES["evidence"].draw(rows)
    with house_style():
        figure.draw_without_rendering()
    assert all(t.get_window_extent().x1 <= figure.bbox.x1 for t in figure.axes[0].texts)


def _inside(ax: object, text: Text) -> bool:
    """Tick labels beyond the limits are not drawn."""
    (x0, x1), (y0, y1) = sorted(ax.get_xlim()), sorted(ax.get_ylim())  # type: ignore[attr-defined]
    if text in ax.get_xticklabels():  # type: ignore[attr-defined]
        return bool(x0 <= text.get_position()[0] <= x1) and bool(text.get_window_extent().height > 0)
    if text in ax.get_yticklabels():  # type: ignore[attr-defined]
        return bool(y0 <= text.get_position()[1] <= y1)
    return True


@pytest.mark.parametrize("name", ["power", "residuals", "finding"])
def test_at_one_column_no_label_is_cut_off_and_no_title_or_tick_lies_on_another(
    name: str, patterns_off: Diagnosis
) -> None:
    """With samples called as a manuscript may call them."""
    with style.page(90.0):
        rows = DIAGNOSIS_FIGURES[name].numbers(patterns_off)
        for column in rows.columns.intersection(["sample", "x_name", "title"]):
            rows[column] = rows[column].replace({"A": "across", "Sample A": "Sample across", "C": "along"})
        figure = DIAGNOSIS_FIGURES[name].draw(rows)
        figure.draw_without_rendering()
        labels = [label for ax in figure.axes for label in (ax.xaxis.label, ax.yaxis.label) if label.get_text()]
        boxes = [(label.get_text(), label.get_window_extent()) for label in labels]
        assert [text for text, b in boxes if b.x0 < figure.bbox.x0 - 1 or b.x1 > figure.bbox.x1 + 1] == []
        assert collisions(figure) == []
