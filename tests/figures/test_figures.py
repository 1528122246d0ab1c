"""Every figure shows exactly its numbers, and its numbers say what the study holds."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.textpath import TextPath
from report.synthetic import AREA_M2, make_study
from support import first_quick

from tribo.comparison import findings
from tribo.figures import measured_friction
from tribo.figures.catalogue import FIGURES
from tribo.figures.style import (
    SAMPLE_COLOURS,
    SAMPLE_MARKERS,
    house_style,
    legend_below,
    page_figure,
    sample_mark,
    settle,
)
from tribo.records import Study

NAMES = list(FIGURES)


def drawn_points(figure: Figure) -> set[tuple[float, float]]:
    """Every finite point of every line in the figure, rounded."""
    points = [line.get_xydata() for ax in figure.axes for line in ax.lines]
    xy = np.concatenate([np.asarray(p, float) for p in points if len(p)])
    return {(float(f"{x:.6g}"), float(f"{y:.6g}")) for x, y in xy[np.isfinite(xy).all(axis=1)]}


@pytest.mark.parametrize("name", NAMES)
def test_the_numbers_of_a_figure_are_what_it_draws(name: str, study: Study) -> None:
    numbers = FIGURES[name].numbers(study)
    x, y = {
        "agreement": ("normal_load_N", "ratio"),
        "fig3": ("time_s", "T_over_peak"),
        "fig4": ("pressure_kPa", "T_over_N"),
        "fig5": ("time_ms", "T_over_N"),
        "fig6": ("normal_load_N", "T_N"),
        "fig7": ("normal_load_N", "T_N"),
        "fig8": ("area_fraction", "value"),
        "traces": ("way_mm", "force_N"),
    }[name]
    points = numbers[[x, y]].dropna().to_numpy(float)
    expected = {(float(f"{a:.6g}"), float(f"{b:.6g}")) for a, b in points}
    assert expected <= drawn_points(FIGURES[name].draw(numbers))


@pytest.mark.parametrize("name", NAMES)
def test_a_study_of_other_samples_is_drawn_too(name: str) -> None:
    study = make_study(samples=("flat", "grid"), n_specimens=2, n_samples=60)
    numbers = FIGURES[name].numbers(study)
    assert set(numbers["sample"].dropna()) == {"flat", "grid"}
    assert FIGURES[name].draw(numbers).axes


@pytest.mark.parametrize("name", ["agreement", "fig5"])
def test_a_study_without_a_model_has_no_numbers_for_the_model(name: str, study: Study) -> None:
    assert FIGURES[name].numbers(replace(study, comparison=None, example_runs=())).empty


@pytest.mark.parametrize("name", ["fig3", "fig4", "fig6", "fig7", "fig8"])
def test_a_study_without_a_model_still_shows_the_measurement(name: str, of_two: Study) -> None:
    numbers = FIGURES[name].numbers(replace(of_two, comparison=None, simulated=None, example_runs=()))
    assert not numbers.empty
    assert "simulated" not in set(numbers["mark"])
    assert FIGURES[name].draw(numbers).axes


def labels(figure: Figure) -> list[tuple[str, Any]]:
    """Every text of a figure with its place on paper, as it is laid out."""
    with house_style():  # the number of ticks depends on their size, which the style sets
        settle(figure)
        figure.draw_without_rendering()
        texts = [
            text
            for ax in figure.axes
            for text in (
                *(t for t in ax.get_xticklabels() if ax.get_xlim()[0] <= t.get_position()[0] <= ax.get_xlim()[1]),
                *(t for t in ax.get_yticklabels() if min(ax.get_ylim()) <= t.get_position()[1] <= max(ax.get_ylim())),
                ax.xaxis.label, ax.yaxis.label, *(c for c in ax.get_children() if isinstance(c, Text)),
            )
        ]  # fmt: skip
        texts += [text for legend in figure.legends for text in legend.get_texts()]
        return [(t.get_text(), t.get_window_extent()) for t in texts if t.get_text() and t.get_visible()]


def collisions(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of labels that lie on each other, and labels that lie outside the page."""
    found, page = labels(figure), figure.bbox
    out = [(text, "the page") for text, b in found if not page.frozen().padded(0.5).contains(b.x0, b.y0)
           or not page.frozen().padded(0.5).contains(b.x1, b.y1)]  # fmt: skip
    pairs = [(a, b) for k, (a, here) in enumerate(found) for b, there in found[k + 1 :] if here.overlaps(there)]
    return out + pairs


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_no_label_lies_outside_the_figure_or_on_another(name: str, study: Study) -> None:
    assert collisions(FIGURES[name].draw(FIGURES[name].numbers(study))) == []


@pytest.fixture(scope="module", params=first_quick([12, 2]), ids="{} samples".format)
def other_study(request: pytest.FixtureRequest) -> Study:
    names = ("F", "A", "Sx", "S 20/40 dry", "K5", "Kx", "Ky", "holes 7", "B", "C", "D", "E")
    return make_study(samples=names[: request.param], n_samples=60)


@pytest.mark.parametrize("name", NAMES)
def test_no_label_lies_on_another_with_two_or_twelve_samples(name: str, other_study: Study) -> None:
    assert collisions(FIGURES[name].draw(FIGURES[name].numbers(other_study))) == []


def test_labels_on_each_other_are_seen() -> None:
    figure = Figure()
    figure.subplots().set_title("title")
    figure.axes[0].text(0.4, 1.01, "on the title", transform=figure.axes[0].transAxes)
    figure.axes[0].text(3.0, 0.5, "outside")
    assert collisions(figure) == [("outside", "the page"), ("on the title", "title")]


@house_style()
def test_a_legend_that_is_too_wide_for_the_page_takes_more_rows() -> None:
    figure = page_figure(60)
    figure.subplots()
    names = [*"FABC", "Sx", "Sy", "mean ± 2 SE", "± 2 SD of a mean, expected", "contribution of the named mechanism"]
    legend_below(figure, [Line2D([], [], label=name) for name in names], columns=12)
    assert collisions(figure) == []
    assert [text.get_text() for text in figure.legends[0].get_texts()] == names


@house_style()
def test_text_is_laid_out_as_wide_as_it_is_drawn() -> None:
    figure, words = page_figure(60), "pressure-dependent friction"
    laid_out = figure.text(0, 0, words, fontsize=7.5, fontweight="bold").get_window_extent().width * 72 / figure.dpi
    drawn = TextPath((0, 0), words, size=7.5, prop=FontProperties(weight="bold")).get_extents().width
    assert laid_out == pytest.approx(drawn, rel=0.02)


@pytest.mark.parametrize(
    ("laws", "labels"), [(["T = 0.50 N", "T = 0.51 N", "T = 0.52 N", "T = 0.53 N"], 4), (["T = μ N"] * 4, 1)]
)
def test_the_laws_of_samples_that_rub_alike_are_told_apart_and_one_law_of_all_is_named_once(
    laws: list[str], labels: int
) -> None:
    loads = np.linspace(1.0, 2.0, 5)
    frames = [
        pd.DataFrame({"sample_number": k, "sample": f"S{k}", "regime": "sliding", "mark": mark, "normal_load_N": loads,
                      "T_N": 0.5 * loads})
        for k, law in enumerate(laws) for mark in ("measured", law)
    ]  # fmt: skip
    figure = measured_friction.draw_forces(pd.concat(frames, ignore_index=True))
    assert len(figure.axes[0].texts) == labels
    assert collisions(figure) == []


@pytest.mark.parametrize("name", ["fig6", "fig7"])
def test_no_band_is_clipped_and_every_specimen_has_a_mark_of_its_own(name: str, study: Study) -> None:
    numbers = FIGURES[name].numbers(study)
    figure = FIGURES[name].draw(numbers)
    low, high = figure.axes[0].get_ylim()
    assert low <= numbers["T_low_N"].min()
    assert numbers["T_high_N"].max() <= high
    of_a = next(ax for ax in figure.axes if ax.get_title(loc="left") == "A")
    marks = {str(line.get_label()): line.get_marker() for line in of_a.lines if "specimen" in str(line.get_label())}
    assert sorted(marks) == ["specimen A1", "specimen A2", "specimen A3"]
    assert len(set(marks.values())) == 3


def test_a_band_too_wide_to_draw_says_how_far_it_reaches(study: Study) -> None:
    wide = tuple(replace(f, covariance=f.covariance * 1e6) if f.sample == "B" else f for f in study.fits)
    numbers = FIGURES["fig6"].numbers(replace(study, fits=wide))
    figure = FIGURES["fig6"].draw(numbers)
    said = [t.get_text() for ax in figure.axes for t in ax.texts if "95 % band" in t.get_text()]
    part = numbers[numbers["sample"] == "B"]
    assert said == [f"95 % band from −{-part['T_low_N'].min():.3g} to {part['T_high_N'].max():.3g} N"]
    assert figure.axes[0].get_ylim()[1] < 10 * numbers[numbers["mark"] == "measured"]["T_N"].max()


def test_fig5_draws_the_model_and_every_pattern_at_scale(study: Study) -> None:
    figure = FIGURES["fig5"].draw(FIGURES["fig5"].numbers(study))
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles[:2] == ["Mesh, from above", "Side view, not to scale"]
    assert titles[2:8] == list(study.ingested.campaign.samples)
    panels = dict(zip(titles, figure.axes, strict=True))
    mark = panels["B"].lines[0]  # circles of 10 µm at a pitch of 15 µm
    on_paper = panels["B"].get_window_extent().width / figure.dpi * 72 / 425
    assert mark.get_markersize() == pytest.approx(10 * on_paper)
    x, y = mark.get_xydata().T
    assert sorted(set(np.diff(sorted(set(x.round(6)))))) == pytest.approx([15.0])
    assert {len(set(x.round(6))), len(set(y.round(6)))} <= {29, 30, 31}
    slots = panels["Sx"].collections[0].get_paths()[0].vertices
    assert np.ptp(slots, axis=0) == pytest.approx([200, 40])


def test_fig4_means_have_the_standard_deviation_of_the_mean(study: Study) -> None:
    numbers = FIGURES["fig4"].numbers(study)
    table = study.ingested.table()
    load = table["normal_load_N"].min()
    cell = table[(table["sample"] == "B") & (table["normal_load_N"] == load)]
    ratio = cell["static_N"] / cell["normal_load_N"]
    row = numbers[(numbers["sample"] == "B") & (numbers["regime"] == "static") & (numbers["mark"] == "mean")].iloc[0]
    assert row["pressure_kPa"] == pytest.approx(load / AREA_M2 / 1e3)
    assert row["T_over_N"] == pytest.approx(ratio.mean())
    assert row["T_over_N_u"] == pytest.approx(ratio.std(ddof=1) / np.sqrt(len(ratio)))
    assert row["n_pulls"] == len(cell)


def test_fig4_curve_is_mu_plus_tau0_over_p(study: Study) -> None:
    numbers = FIGURES["fig4"].numbers(study)
    fit = findings.fit_of(study.fits, "C", "sliding")
    assert fit is not None
    curve = numbers[(numbers["sample"] == "C") & (numbers["regime"] == "sliding") & (numbers["mark"] == "fit")]
    expected = fit.value("mu") + fit.value("tau0_Pa") / 1e3 / curve["pressure_kPa"]
    assert curve["T_over_N"].to_numpy(float) == pytest.approx(expected.to_numpy(float))


def test_the_area_prediction_is_the_flat_force_times_the_area_fraction(study: Study) -> None:
    numbers = FIGURES["fig6"].numbers(study)
    flat = findings.fit_of(study.fits, "F", "static")
    assert flat is not None
    line = numbers[(numbers["sample"] == "C") & (numbers["mark"] == "AF prediction")]
    expected = flat.force_N(line["normal_load_N"].to_numpy(float)) * study.ingested.campaign.area_fraction("C")
    assert line["T_N"].to_numpy(float) == pytest.approx(expected)


def test_the_line_in_area_fraction_recovers_a_linear_law(study: Study) -> None:
    fits = tuple(
        replace(f, values=np.array([1 + 2 * af, 1e3 * (3 + 4 * af)]))
        for f in study.fits
        if (af := study.ingested.campaign.area_fraction(f.sample))
    )
    numbers = FIGURES["fig8"].numbers(replace(study, fits=fits))
    line = numbers[(numbers["mark"] == "fit") & (numbers["regime"] == "static")]
    for parameter, intercept, slope in (("mu", 1, 2), ("tau0_kPa", 3, 4)):
        part = line[line["parameter"] == parameter]
        assert part["value"].to_numpy() == pytest.approx(intercept + slope * part["area_fraction"].to_numpy())


def test_the_example_pull_is_one_without_flags_at_a_middle_load(study: Study) -> None:
    numbers = FIGURES["fig3"].numbers(study)
    loads = sorted({t.normal_load_N for t in study.ingested.campaign.tests})
    for test_id, pull in numbers.groupby("test_id"):
        assert pull["normal_load_N"].iloc[0] in loads[2:4]
        assert not study.ingested.pulls[str(test_id)].flags


def test_the_ratio_interval_without_model_error_is_the_t_interval_of_the_measurement(study: Study) -> None:
    from scipy.stats import t

    assert study.comparison is not None
    row = replace(study.comparison.rows[0], simulated_u_N=0.0)
    numbers = FIGURES["agreement"].numbers(replace(study, comparison=replace(study.comparison, rows=(row,))))
    half = t.ppf(0.975, 2) * row.measured_u_N / row.measured_N
    assert np.log(numbers["ratio_high"].iloc[0] / numbers["ratio"].iloc[0]) == pytest.approx(half)
    assert np.log(numbers["ratio_low"].iloc[0] / numbers["ratio"].iloc[0]) == pytest.approx(-half)


def test_samples_are_told_apart_by_marker_and_by_colour() -> None:
    n = len(SAMPLE_COLOURS) * len(SAMPLE_MARKERS)
    marks = [sample_mark(k) for k in range(n)]
    assert len(set(marks)) == n
    assert all(a[0] != b[0] and a[1] != b[1] for a, b in pairwise(marks))


def test_a_sample_keeps_its_colour_where_others_are_missing(study: Study) -> None:
    fewer = replace(study, example_runs=tuple(r for r in study.example_runs if r.sample != "A"))
    numbers = FIGURES["fig5"].numbers(fewer)
    assert dict(zip(numbers["sample"], numbers["sample_number"], strict=True))["B"] == 2


def test_drawing_leaves_the_settings_of_matplotlib_as_they_were(of_two: Study) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    FIGURES["fig8"].draw(FIGURES["fig8"].numbers(of_two))
    assert dict(matplotlib.rcParams) == before


def test_numbers_name_their_units(study: Study) -> None:
    unitless = {
        "sample_number", "sample", "regime", "group", "mark", "test_id", "n_pulls", "seed", "parameter", "value",
        "value_u", "area_fraction", "ratio", "ratio_low", "ratio_high", "T_over_N", "T_over_N_u", "T_over_peak",
        "specimen", "specimen_number", "cavity", "staggered", "source",
    }  # fmt: skip
    for figure in FIGURES.values():
        for column in set(figure.numbers(study).columns) - unitless:
            unit = re.search(r"_(N_per_mm|N|s|ms|kPa|deg|mm|um)$", column)
            assert unit, (figure.name, column)


def test_an_empty_campaign_has_empty_numbers(study: Study) -> None:
    nothing = replace(study.ingested, pulls={}, traces={})
    empty = replace(study, ingested=nothing, fits=(), comparison=None, example_runs=())
    for name in ("fig3", "fig4", "fig6"):
        assert isinstance(FIGURES[name].numbers(empty), pd.DataFrame)
        assert FIGURES[name].numbers(empty).empty


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_that_could_not_be_fitted_does_not_stop_the_others(name: str, of_two: Study) -> None:
    nan = np.full(2, np.nan)
    broken = tuple(
        replace(f, values=nan, covariance=np.full((2, 2), np.nan), dof=0.0) if f.sample == "B" else f
        for f in of_two.fits
    )
    figure = FIGURES[name]
    assert figure.draw(figure.numbers(replace(of_two, fits=broken))).axes
