"""index.html of tribo demo: both bundled examples side by side, each with its answer, its figure and its report."""

from __future__ import annotations

import json
from pathlib import Path

from markupsafe import Markup

from tribo import __version__
from tribo.files import text_of, write_text
from tribo.report.drawings import inline_svg
from tribo.report.shell import STYLE, WORKING, environment, style_and_script

SECOND = "cause-found"


def write_demo_page(out: Path) -> Path:
    """Write OUT/index.html from the finished reports in OUT and OUT/cause-found; the same bytes for the same reports.

    Parameters
    ----------
    out : Path
        The folder of results of the first example; that of the second lies in it.

    Returns
    -------
    Path
        The page.
    """
    campaigns = []
    for name, folder in (("first", ""), ("second", f"{SECOND}/")):
        figure = text_of(out / folder / "figures" / "finding.svg")
        campaigns.append(
            {
                "folder": folder,
                "card": json.loads(text_of(out / folder / "card.json")),
                "verdict": json.loads(text_of(out / folder / "verdict.json")),
                "figure": Markup(inline_svg(figure, name, "measured over modelled friction, less one, in percent")),
            }
        )
    templates = environment()
    text = templates.get_template("demo.html").render(
        campaigns=campaigns, version=__version__, **style_and_script(templates, [STYLE], WORKING)
    )
    return write_text(out / "index.html", text)

