"""index.html of a site: every campaign with its verdict and state, mu and tau0 of each sample over time, two compared.

``python -m tribo.site.index_page SITE MARKER`` writes it, and MARKER for the workflow (``-`` for none).

A change point splits the campaigns of a series, in the order in which they were measured, in two runs of different
mean. Each split is judged by the two-sample t test. The smallest p over all splits and all series accounts for the
number of comparisons. It is compared with the smallest p under random orders of the campaigns (the same order for
all series, since a campaign moves all of them at once): the single-step method of Westfall and Young (1993) with
permutations, which needs neither normal scatter nor independent series. Each part found this way is searched for
further changes.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import median
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import quote

import numpy as np

from tribo import __version__
from tribo.errors import unexpected
from tribo.files import bytes_of
from tribo.records import FloatArray
from tribo.site.history import CampaignRow, Interval, Key, answers_of, history, laws_csv, laws_in_words
from tribo.site.steps import INDEX, Step, noted, read_record
from tribo.user_text import for_spreadsheet
from tribo.wording.numerals import p_text, true_minus

if TYPE_CHECKING:
    from tribo.report.compare_reports import Reported


def comparable(current: Path, names: Iterable[str]) -> dict[str, Any]:
    """The campaigns whose reports can be compared, by name, and the titles of their figures; empty for fewer than two.

    ``current`` is the folder of the index page; links and figures are relative to it.
    """
    from tribo.errors import CampaignError
    from tribo.figures.catalogue import TITLES
    from tribo.report.compare_reports import SHOWN, read_reported

    found = {}
    for name in names:
        try:
            found[name] = _told(read_reported(current / name))
        except CampaignError:  # the table of the page says what is wrong with it
            continue
    return {"campaigns": found, "titles": {name: TITLES[name] for name in SHOWN}} if len(found) > 1 else {}


def _told(report: Reported) -> dict[str, Any]:
    from tribo.report.compare_reports import fit_numbers

    folder = quote(report.folder.name)
    return {
        "title": report.title,
        "link": f"{folder}/report.html",
        "sentence": report.sentence(),
        "counts": report.counts(),
        "next_test": report.next_test(),
        "loads": _numbers(report.loads_N),
        "newton_per_kPa": _numbers([1e3 * report.area_m2])[0],
        "fits": [_fit(fit_numbers(row)) for row in report.fits.to_dict("records")],
        "figures": {name: f"{folder}/figures/{name}.svg" for name in report.pictures()},
    }


def _fit(fit: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "sample": fit["sample"], "regime": fit["regime"], "mu": _numbers(fit["mu"]),
        "tau0": _numbers(fit["tau0_kPa"]), "variances": _numbers(fit["variances"]),
        "widening": _numbers([fit["widening"]])[0],
    }  # fmt: skip


def _numbers(values: Iterable[float]) -> list[float | None]:
    """More digits than any page shows; None where there is no number."""
    return [float(f"{value:.9g}") if math.isfinite(value) else None for value in values]


FEWEST = 8  # campaigns in a series; with fewer, no order of them is rare enough to speak of a change
SHORTEST = 3  # campaigns on either side of a change, so that one odd campaign makes none
LEVEL = 0.05
PERMUTATIONS = 2000
Name = TypeVar("Name")


Change = tuple[int, float, float, float]  # campaign before which a series changes, mean before, mean after, p


def change_points(
    series: Mapping[Name, Sequence[float]], *, level: float = LEVEL, seed: int = 0, permutations: int = PERMUTATIONS
) -> dict[Name, list[Change]]:
    """Changes of several series over the same campaigns, in order.

    Parameters
    ----------
    series : name -> one value per campaign, NaN where the campaign has none
    level : chance of a false alarm in the first round, over all series together

    Returns
    -------
    dict
        The changes of each series that has any, by its name: the campaign before which it changes (an index into the
        series), the means before and after, and p, adjusted for all splits and series examined.
    """
    values = {name: np.asarray(v, float) for name, v in series.items()}
    if not values:
        return {}
    rng = np.random.default_rng(seed)
    keys = rng.random((permutations, len(next(iter(values.values())))))
    found: dict[Name, list[Change]] = {name: [] for name in values}
    spans = [(name, np.flatnonzero(np.isfinite(v))) for name, v in values.items()]
    while spans := [(name, places) for name, places in spans if places.size >= FEWEST]:
        next_spans = []
        for (name, places), (cut, p) in zip(spans, _adjusted(values, spans, keys), strict=True):
            if p <= level:
                y = values[name]
                left, right = places[:cut], places[cut:]
                found[name].append((int(right[0]), float(y[left].mean()), float(y[right].mean()), p))
                next_spans += [(name, left), (name, right)]
        spans = next_spans
    return {name: sorted(changes) for name, changes in found.items() if changes}


def _adjusted(
    values: Mapping[Name, FloatArray], spans: Sequence[tuple[Name, np.ndarray]], keys: FloatArray
) -> list[tuple[int, float]]:
    """For each span its best split and the adjusted p of that split."""
    smallest = np.ones(len(keys))
    best = []
    for name, places in spans:
        y = values[name][places]
        p = split_p(y[None, :])[0]
        best.append((int(np.argmin(p)) + SHORTEST, float(p.min())))
        shuffled = y[np.argsort(keys[:, places], axis=1)]
        smallest = np.minimum(smallest, split_p(shuffled).min(axis=1))
    return [(cut, float((1 + np.sum(smallest <= p * (1 + 1e-9))) / (1 + len(keys)))) for cut, p in best]


def split_p(y: FloatArray) -> FloatArray:
    """p of the two-sample t test (common variance) of each split of each row, shape (rows, n - 2 SHORTEST + 1)."""
    from scipy.special import stdtr

    n = y.shape[1]
    y = y - y.mean(axis=1, keepdims=True)
    left_n = np.arange(SHORTEST, n - SHORTEST + 1)
    sums, squares = np.cumsum(y, axis=1), np.cumsum(y**2, axis=1)
    left, total = sums[:, left_n - 1], squares[:, -1:]
    between = left**2 / left_n + left**2 / (n - left_n)  # the two sums are opposite, since the mean is out
    within = np.maximum(total - between, 1e-12 * total)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.sqrt(between * (n - 2) / within)
    t = np.where(total > 0, t, 0.0)
    return np.asarray(2 * stdtr(n - 2, -t))


STATES = {
    "done": "done", "some set aside": "done, some tests set aside", "unusable": "input not usable",
    "failed": "failed", "waiting": "postponed to the next build", "gone": "no longer in the folder",
}  # fmt: skip
VERDICTS = {
    "no_misfit": "no misfit", "named": "cause identified", "undetermined": "several possible causes",
    "partly": "cause identified, misfit left", "unknown": "misfit of unknown cause",
    "cannot_tell": "? cannot tell", "": "–",
}  # fmt: skip
SYMBOLS = {"mu": ("μ", ""), "tau0": ("τ₀", "kPa")}
WIDE = 6.0  # times the median arm of the intervals: a wider one is cut off, so that the others stay readable
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 300.0, 136.0, 44.0, 8.0, 16.0, 18.0


def write_index(site: Path) -> str:
    """Write SITE/current/index.html, trend.csv and laws.csv where they differ from what is there; their SHA-256."""
    from tribo.files import write_text

    rows = history(site)
    changes = change_points(series(rows))
    digest = hashlib.sha256()
    current = site / "current"
    answers = answers_of(current)
    compared = comparable(current, [row.name for row in reversed(rows) if row.has_report])
    texts = {"index.html": page(rows, changes, laws_in_words(answers), compared), "trend.csv": trend_csv(rows)}
    if answers:
        texts["laws.csv"] = laws_csv(answers)
    for name, text in texts.items():
        path = current / name
        if not path.is_file() or bytes_of(path) != text.encode("utf-8"):
            write_text(path, text)
        digest.update(text.encode())
    return digest.hexdigest()


def series(rows: Sequence[CampaignRow]) -> dict[Key, list[float]]:
    """Values of each parameter of each sample, one a campaign, NaN where it has none."""
    keys = sorted({key for row in rows for key in row.laws}, key=lambda k: (k[0], k[1] != "static", k[2]))
    return {key: [row.laws[key][0] if key in row.laws else math.nan for row in rows] for key in keys}


def trend_csv(rows: Sequence[CampaignRow]) -> str:
    """The plotted numbers: one row per campaign, sample, regime and parameter."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["campaign", "measured", "sample", "regime", "parameter", "value", "low", "high"])
    for row in rows:
        for key, interval in row.laws.items():
            numbers = ["" if math.isnan(v) else f"{v:.8g}" for v in interval]
            words = map(for_spreadsheet, (row.name, row.measured, *key))
            writer.writerow([*words, *numbers])
    return text.getvalue()


def page(
    rows: Sequence[CampaignRow],
    changes: Mapping[Key, Sequence[Change]],
    laws: Sequence[str] = (),
    compared: Mapping[str, Any] = MappingProxyType({}),
) -> str:
    """The page as text: the same bytes for the same campaigns. ``compared`` is that of :func:`comparable`."""
    from tribo.report.shell import STYLE, WORKING, environment, script_json, style_and_script

    templates = environment("tribo.site")
    by_sample: dict[str, list[dict[str, Any]]] = {}
    for key in series(rows):
        by_sample.setdefault(key[0], []).append(panel(key, rows, changes.get(key, ())))
    longest = max((sum(map(math.isfinite, v)) for v in series(rows).values()), default=0)
    return templates.get_template("index.html").render(
        rows=list(reversed(rows)), states=STATES, verdicts=VERDICTS, link=report_link, panels=by_sample,
        sentences=[change_sentence(key, change, rows) for key, found in changes.items() for change in found],
        looked=longest >= FEWEST, fewest=FEWEST, shortest=SHORTEST, level=LEVEL, width=WIDTH, height=HEIGHT,
        left=LEFT, right=RIGHT, top=TOP, bottom=BOTTOM,
        version=__version__, laws=laws, comparable=set(compared.get("campaigns", ())),
        compared=script_json(dict(compared)),
        **style_and_script(templates, [STYLE, "index.css"], [*WORKING, "index.js"]),
    )  # fmt: skip


def report_link(name: str) -> str:
    """Where the report of a campaign lies, from the index page."""
    return f"{quote(name)}/report.html"


def panel(key: Key, rows: Sequence[CampaignRow], changes: Sequence[Change]) -> dict[str, Any]:
    """One parameter of one sample over the campaigns, laid out in WIDTH by HEIGHT, as the template takes it.

    Points have a place, the ends of their interval, a text and a link; ticks are (y, text), changes (x, text).
    """
    sample, regime, parameter = key
    symbol, unit = SYMBOLS[parameter]
    fitted = [k for k, row in enumerate(rows) if row.laws]
    place = {k: at for at, k in enumerate(fitted)}  # campaigns without a fit take no room
    placed = [(k, row, row.laws[key]) for k, row in enumerate(rows) if key in row.laws]
    low, high = _range([interval for _, _, interval in placed])
    step = (WIDTH - LEFT - RIGHT) / len(fitted)

    def x(k: int, aside: float = 0.0) -> float:
        return round(LEFT + step * (place[k] + 0.5 + aside), 1)

    def y(value: float) -> float:
        share = min(max((value - low) / (high - low), 0.0), 1.0)
        return round(HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM), 1)

    points: list[dict[str, Any]] = []
    for k, row, (value, *ends) in placed:
        y_low, y_high = (y(end if math.isfinite(end) else value) for end in ends)
        interval = f" ({_short(ends[0])} to {_short(ends[1])})" if math.isfinite(ends[0]) else ""
        text = f"{row.name}: {_short(value)}{interval}{f' {unit}' if unit else ''}"
        link = report_link(row.name) if row.has_report else ""
        points.append({"x": x(k), "y": y(value), "y_low": y_low, "y_high": y_high, "text": text, "link": link})
    return {
        "title": f"{regime} {symbol}{f' in {unit}' if unit else ''}",
        "label": f"{regime} {symbol} of {sample} in {len(points)} campaigns: " + "; ".join(p["text"] for p in points),
        "points": points,
        "ticks": [(y(v), text) for v, text in ticks(low, high)],
        "dates": (rows[fitted[0]].measured, rows[fitted[-1]].measured) if len(fitted) > 1 else ("", ""),
        "changes": [(x(at, -0.5), f"{_short(before)} to {_short(after)}") for at, before, after, _ in changes],
    }


def _range(intervals: Sequence[Interval]) -> tuple[float, float]:
    """Lowest and highest number shown: all values, and every interval but those far wider than most."""
    values = [value for value, _, _ in intervals]
    arms = [(end, abs(end - value)) for value, *ends in intervals for end in ends if math.isfinite(end)]
    widest = WIDE * median(arm for _, arm in arms) if arms else 0.0
    ends = [end for end, arm in arms if arm <= widest]
    low, high = min(values + ends), max(values + ends)
    return (low, high) if high > low else (low - 1.0, high + 1.0)


def ticks(low: float, high: float) -> tuple[tuple[float, str], ...]:
    """Values and labels at the foot, the middle and the head of an axis, with as many decimals as part them."""
    decimals = max(0, 1 - math.floor(math.log10((high - low) / 2)))
    return tuple((v, true_minus(f"{v:.{decimals}f}")) for v in (low, (low + high) / 2, high))


def _short(value: float) -> str:
    return true_minus(f"{value:.3g}")


def change_sentence(key: Key, change: Change, rows: Sequence[CampaignRow]) -> str:
    """A change in words."""
    (sample, regime, parameter), (at, before, after, p) = key, change
    symbol, unit = SYMBOLS[parameter]
    return (
        f"{regime.capitalize()} {symbol} of {sample} {'rises' if after > before else 'falls'} from {_short(before)} to "
        f"{_short(after)}{f' {unit}' if unit else ''} at {rows[at].name} (adjusted p {p_text(p)})."
    )


def main(arguments: Sequence[str]) -> int:
    """Write the index of a site, and the record of this step of the workflow unless it is "-"."""
    site, marker = arguments
    if marker == "-":
        return _written(Path(site), None)
    return noted(Path(marker).parent, Step(INDEX), lambda: _written(Path(site), Path(marker)))


def _written(site: Path, record: Path | None) -> int:
    """Exit status of writing the index, and its record where one is wanted."""
    from tribo.files import write_text

    try:
        digest = write_index(site)
        if record is not None:
            listed = read_record(record.parent / "build.json", "digest") or {}
            write_text(record, json.dumps({"index": digest, "digest": listed.get("digest", "")}) + "\n")
    except OSError as why:
        print(unexpected(why, "the index of the site cannot be written"), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
