"""What the index page needs to compare any two campaigns of a site in the browser, without a server."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

if TYPE_CHECKING:
    from tribo.report.reported import Fitted, Reported


def comparable(current: Path, names: Iterable[str]) -> dict[str, Any]:
    """The campaigns whose reports can be compared, by name, and the titles of their figures; empty for fewer than two.

    ``current`` is the folder of the index page; links and figures are relative to it.
    """
    from tribo.errors import CampaignError
    from tribo.figures.catalogue import TITLES
    from tribo.report.reported import SHOWN, read_reported

    found = {}
    for name in names:
        try:
            found[name] = _told(read_reported(current / name))
        except CampaignError:  # the table of the page says what is wrong with it
            continue
    return {"campaigns": found, "titles": {name: TITLES[name] for name in SHOWN}} if len(found) > 1 else {}


def _told(report: Reported) -> dict[str, Any]:
    from tribo.report.reported import fitted

    folder = quote(report.folder.name)
    return {
        "title": report.title,
        "link": f"{folder}/report.html",
        "sentence": report.sentence(),
        "counts": report.counts(),
        "next_test": report.next_test(),
        "loads": _numbers(report.loads_N),
        "newton_per_kPa": _numbers([1e3 * report.area_m2])[0],
        "fits": [_fit(fitted(row)) for row in report.fits.to_dict("records")],
        "figures": {name: f"{folder}/figures/{name}.svg" for name in report.pictures()},
    }


def _fit(fit: Fitted) -> dict[str, Any]:
    return {
        "sample": fit.sample,
        "regime": fit.regime,
        "mu": _numbers([fit.mu, fit.mu_half]),
        "tau0": _numbers([fit.tau0_kPa, fit.tau0_half_kPa]),
        "variances": _numbers(fit.variances),
        "widening": _numbers([fit.widening])[0],
    }


def _numbers(values: Iterable[float]) -> list[float | None]:
    """More digits than any page shows; None where there is no number."""
    return [float(f"{value:.9g}") if math.isfinite(value) else None for value in values]
