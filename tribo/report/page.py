"""report.html: one file that works offline, on a phone and on paper, light and dark, and without scripts too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import sha256
from typing import Any

from markupsafe import Markup, escape

from tribo import __version__
from tribo.figures.catalogue import TITLES
from tribo.report.content import figure_numbers, figure_places
from tribo.report.drawings import Drawn, inline_svg
from tribo.report.pulls import on_pages, trace_data
from tribo.report.shell import STYLE, WORKING, environment, script_json, style_and_script
from tribo.wording.study_sentences import flags_in_words

PAGE = "report.html"


def pages_of(said: Mapping[str, Any], figures: Mapping[str, Drawn]) -> dict[str, str]:
    """The page by its file name, and further pages of pulls where there are more than one page holds.

    ``said`` is the content (:func:`tribo.report.content.content`), ``figures`` are those drawn, by name. The pages are
    the same bytes for the same content and figures.
    """
    numbers = figure_numbers(list(figures))
    places = {k: [_shown(figures[n], numbers[n]) for n in names] for k, names in figure_places(list(figures)).items()}
    each = on_pages(said["cards"])
    campaign = said["campaign"]  # tells this report from others, for what a browser remembers of it
    told = [campaign.title, *sorted(campaign.inputs.values()), *sorted(card["test_id"] for card in said["cards"])]
    report_key = sha256("\0".join(told).encode("utf-8", errors="backslashreplace")).hexdigest()[:16]
    names = [PAGE, *(f"pulls-{k}.html" for k in range(2, len(each) + 1))]
    pages = {}
    for number, (name, cards) in enumerate(zip(names, each, strict=True), start=1):
        shown = figures if number == 1 else {}
        parts = {"lead": places["lead"], "figures": places["figures"], "diagnosis_figures": places}
        pages[name] = (
            environment()
            .get_template("report.html" if number == 1 else "further_pulls.html")
            .render(
                **{**said, "cards": cards},
                **parts,
                filters=_filters(cards),
                pages=names,
                number=number,
                pulls=len(said["cards"]),
                report_key=report_key,
                figure_data=script_json({n: figure.series for n, figure in shown.items()}),
                trace_data=trace_data(said["study"], [card["test_id"] for card in cards]),
                **style_and_script(environment(), [STYLE], [*WORKING, "pulls.js"]),
            )
        )
    return pages


def compared_page(columns: Sequence[Any], rows: Sequence[Any], said: Sequence[str], shown: Sequence[str]) -> str:
    """compare.html: two reports side by side, as :mod:`tribo.report.compare_reports` found them."""
    return (
        environment()
        .get_template("compared.html")
        .render(columns=columns, rows=rows, said=said, shown=shown, titles=TITLES, version=__version__,
                **style_and_script(environment(), [STYLE], WORKING))
    )  # fmt: skip


def _filters(cards: list[dict[str, Any]]) -> list[tuple[str, str, list[tuple[str, str]]]]:
    """What pulls can be filtered by: attribute of a card, label, and values with their texts."""
    flags = sorted({flag for card in cards for flag in card["flags"]})
    specimens = sorted({card["specimen"] for card in cards})
    samples = sorted({card["sample"] for card in cards})
    loads = sorted({card["load"] for card in cards}, key=float)
    return [
        ("sample", "Sample", [(s, s) for s in samples]),
        ("load", "Load", [(load, f"{load} N") for load in loads]),
        ("specimen", "Specimen", [(s, s) for s in specimens]),
        ("flags", "Flag", [(flag, flags_in_words([flag])) for flag in flags]),
        ("state", "State", [("used", "used"), ("moved", "moved by hand"), ("excluded", "excluded by hand")]),
    ]


def _shown(figure: Drawn, number: int) -> dict[str, Any]:
    """A figure as the page shows it."""
    picture = Markup(inline_svg(figure.svg, figure.name, str(escape(f"{figure.title}. {figure.caption}"))))
    return {
        "number": number, "name": figure.name, "title": figure.title, "caption": figure.caption, "svg": picture,
    }  # fmt: skip
