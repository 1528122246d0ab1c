"""The percentages and counts of a written report, recomputed from its CSV files.

Every check takes away what it has recomputed from the text of the page; whatever percentage is left over has no check.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd

from tribo.comparison.findings import load_levels
from tribo.fitting import outlying_pulls, outlying_specimens, power_of_campaign
from tribo.fitting.assessment import outlying_sentences, power_sentences
from tribo.records import REGIMES
from tribo.wording.study_sentences import FLAGS

WORDS = {"p", "li", "td", "th", "dt", "dd", "h3", "caption"}
VOID = {"br", "meta", "input"}
SIGNED = r"([+−]?\d+)"
CONSTANT = (
    r"95 % interval", r"90 % interval", r"with (their )?95 % intervals?", r"one interval in twenty", r"95 %: ",
    r"−20 % means that the measured force is 20 % below", r"in percent", r"Detecting 10 % requires",
    r"as good in \d+ % of the cases",  # a probability, which stands in verdict.json
    r"default \w+ = .*", r"humidity.*%", r"1 %, rectangular", r"RH = .*", r"h = .*1/%.*",
)  # fmt: skip


@dataclass
class Page(HTMLParser):
    """The text of a page, element by element: (tag, text, the class and id of the test of its card)."""

    path: Path
    texts: list[tuple[str, str]] = field(default_factory=list)
    cards: list[tuple[str, str]] = field(default_factory=list)
    _open: list[list[str]] = field(default_factory=list)
    _hidden: int = 0

    def __post_init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.feed(self.path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if self._hidden or tag in ("script", "style", "svg", "dialog"):
            self._hidden += tag not in VOID
        elif tag in WORDS or tag == "figcaption":
            self._open.append([tag, str(found.get("data-id") or ""), ""])
        elif tag == "br" and self._open:
            self._open[-1][2] += " "

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        if self._hidden:
            self._hidden -= 1
        elif self._open and tag == self._open[-1][0]:
            name, card, text = self._open.pop()
            text = re.sub(r"\s+", " ", text.replace("\u00a0", " ")).strip()
            if card:
                self.cards.append((card, text))
            elif name != "figcaption":
                self.texts.append((name, text))

    def handle_data(self, data: str) -> None:
        if not self._hidden and self._open:
            self._open[-1][2] += data


@dataclass
class Written:
    """A report: its folder, its page and its tables."""

    out: Path
    flat: str
    area_m2: float
    patterns: dict[str, str]  # of each sample
    wrong: list[str] = field(default_factory=list)
    checked: int = 0

    def table(self, name: str) -> pd.DataFrame:
        path = self.out / f"{name}.csv"
        return pd.read_csv(path, keep_default_na=False, na_values=[""]) if path.is_file() else pd.DataFrame()

    @cached_property
    def page(self) -> Page:
        return Page(self.out / "report.html")

    @cached_property
    def tests(self) -> pd.DataFrame:
        return self.table("tests")

    @cached_property
    def used(self) -> pd.DataFrame:
        return self.tests[self.tests["set_aside"].isna()]

    @cached_property
    def layers(self) -> pd.DataFrame:
        return self.table("layers")

    @cached_property
    def ratios(self) -> pd.DataFrame:
        found = self.table("comparison")
        return found.dropna(subset=["ratio"]) if len(found) else found

    def equal(self, what: str, printed: str, expected: str) -> str:
        """Note a printed number that differs from the recomputed one; nothing is left of the text that was checked."""
        self.checked += 1
        if printed != expected:
            self.wrong.append(f"{what}: printed {printed}, recomputed {expected}")
        return ""


def signed(value: float) -> str:
    return f"{value:+.0f}".replace("-", "−")


def percent(value: float) -> str:
    """Whole percent, one decimal below 3 %, as the report prints ratios."""
    text = f"{100 * value:.1f} %" if abs(100 * value) < 2.95 else f"{100 * value:.0f} %"
    return ("+" if value > 0 else "") + text.replace("-", "−")


def counts(w: Written) -> None:
    """Tests, specimens, samples, loads, flags and reasons."""
    tests = w.used
    specimens = {(w.patterns.get(s, s), str(p)) for s, p in zip(tests["sample"], tests["specimen"], strict=True)}
    aside = len(w.tests) - len(tests)
    levels = len(np.unique(load_levels(tests["normal_load_N"].to_numpy(float))))
    words = " ".join(text for _, text in w.page.texts)
    for pattern in (
        r"(\d+) tests? used, (\d+|no) tests? set aside; (\d+) specimens?, (\d+) samples? \(.*?\); (\d+) loads?",
        r"(?P<u>\d+) pulls? of (?P<s>\d+) specimens? of (?P<n>\d+) samples? .*? at (?P<l>\d+) loads? .*?\. "
        r"(?P<a>\d+|No) tests? w",
    ):
        found = re.search(pattern, words)
        assert found, pattern
        g = found.groupdict()
        printed = (g["u"], g["a"], g["s"], g["n"], g["l"]) if g else found.groups()
        expected = (len(tests), aside or "no", len(specimens), tests["sample"].nunique(), levels)
        for name, a, b in zip(("used", "set aside", "specimens", "samples", "loads"), printed, expected, strict=True):
            w.equal(name, a.lower(), str(b))
    aside_by = next((text for _, text in w.page.texts if text.startswith("Tests set aside: ")), "")
    for number, reason in re.findall(r"(\d+) × ([^;.]+)", aside_by):
        hits = w.tests["set_aside"].fillna("").str.contains(reason.strip(), regex=False).sum()
        w.equal(f"set aside: {reason}", number, str(hits))
    _flags(w)


def _flags(w: Written) -> None:
    flags = w.used["flags"].dropna().str.split(";").explode().value_counts()
    cells = [text for tag, text in w.page.texts if tag in ("th", "td")]
    for flag, number in flags.items():
        if flag and flag not in ("peak_by_hand", "window_by_hand"):
            name = FLAGS.get(str(flag), str(flag).replace("_", " "))
            w.equal(f"flag {name}", cells[cells.index(name) + 1], str(number))


def agreement(w: Written, text: str, context: dict[str, str]) -> str:
    """Measured over simulated, less one: of a sample over its loads."""
    regime = context["regime"] if not re.match(r"(Static|Sliding) friction: ", text) else text.split()[0].lower()

    def of(sample: str) -> pd.DataFrame:
        return w.ratios[(w.ratios["sample"] == sample) & (w.ratios["regime"] == regime)]

    def short(found: re.Match[str]) -> str:
        part = of(found[1])
        outside = ((part["ratio_low"] > 1) | (part["ratio_high"] < 1)).sum()
        w.equal(f"{regime} {found[1]}", found[2], percent(np.exp(np.log(part["ratio"]).mean()) - 1))
        at = "all loads" if outside == len(part) > 1 else f"{outside} of {len(part)} loads"
        return w.equal(f"{regime} {found[1]}, loads", found[3], "the only load" if len(part) == 1 else at)

    at = r"(all loads|the only load|\d+ of \d+ loads)"
    text = re.sub(rf"(\S+) \(([+−]?[\d.]+ %)(?: on average)?, at {at}\)", short, text)

    def mean(found: re.Match[str]) -> str:
        part = of(context["sample"])["ratio"] - 1
        w.equal(f"{regime} {context['sample']}, mean", found[1], percent(np.exp(np.log1p(part).mean()) - 1))
        worst = part.iloc[part.abs().to_numpy().argmax()]
        return w.equal(f"{regime} {context['sample']}, largest", found[2], percent(worst))

    pattern = r"differs from simulated T by ([+−]?[\d.]+ %); the largest difference is ([+−]?[\d.]+ %)"
    return re.sub(pattern, mean, text)


def of_layers(w: Written, text: str, context: dict[str, str]) -> str:
    """A percentage with its 90 % interval: a row of layers.csv."""
    rows = w.layers[["effect_percent", "low", "high"]].dropna() if len(w.layers) else pd.DataFrame()
    known = {tuple(signed(v) for v in row) for row in rows.to_numpy(float)}

    def triple(found: re.Match[str]) -> str:
        printed = tuple(found[k].replace("-", "−") for k in (1, 2, 3))
        return w.equal(f"in “{text[:60]}…”", str(printed), str(printed if printed in known else "no row of layers.csv"))

    text = text.replace("-", "−")
    for inside in (rf"geometric mean over its tests; 90 % interval {SIGNED}", rf"90 % interval {SIGNED}", SIGNED):
        text = re.sub(rf"{SIGNED} % \({inside} to {SIGNED} %", triple, text)
    return text


def of_models(w: Written, text: str, context: dict[str, str]) -> str:
    """Root mean squares over all tests, the gain on tests left out, and the range of a cause."""
    table = w.table("diagnosis")

    def rms(found: re.Match[str]) -> str:
        simulated = 100 * (table["measured_N"] / table["simulated_N"] - 1)
        parts = (table["residual_percent"], simulated, table["residual_extended_percent"])
        for printed, part in zip(found.groups(), parts, strict=True):
            w.equal("root mean square", printed, f"{np.sqrt((part**2).mean()):.1f}")
        return ""

    text = re.sub(
        r"by ([\d.]+) %, from the model with the simulated effect by ([\d.]+) % and with the formula by ([\d.]+) %",
        rms, text,
    )  # fmt: skip

    def gain(found: re.Match[str]) -> str:
        rows = w.layers[["rmse_percent_before", "rmse_percent_after"]].dropna().to_numpy(float)
        known = {tuple(significant(v, 2) for v in row) for row in rows}
        printed = (found[1], found[2])
        return w.equal("RMSE", str(printed), str(printed if printed in known else "no row of layers.csv"))

    text = re.sub(r"the RMSE changes from ([\d.]+) % to ([\d.]+) %", gain, text)

    def moved(found: re.Match[str]) -> str:
        change = 100 * (table["extended_N"] / table["baseline_N"] - 1)
        w.equal("lowest change", found[1].replace("-", "−"), signed(change.min()))
        return w.equal("highest change", found[2].replace("-", "−"), signed(change.max()))

    alone = (w.layers["kind"] == "cause").sum() == 1 if len(w.layers) else False
    text = re.sub(r"changes the calibrated model by ([+−-]\d+) to ([+−-]\d+) %", moved if alone else "", text)

    def narrowed(found: re.Match[str]) -> str:
        verdict = json.loads((w.out / "verdict.json").read_text(encoding="utf-8"))
        return w.equal("width", found[1], f"{100 * verdict['next_test']['design']['share_of_width']:.0f}")

    return re.sub(r"narrows to about (\d+) % of its width", narrowed, text)


def significant(value: float, digits: int) -> str:
    decimals = max(0, digits - 1 - int(np.floor(np.log10(abs(value))))) if value else 0
    return f"{value:.{decimals}f}"


def budget(w: Written, text: str, context: dict[str, str]) -> str:
    """Shares of the variance of mu and tau0 beside the laws of the card."""
    table = w.table("budget")

    def share(found: re.Match[str]) -> str:
        here = (table["sample"].astype(str) == context["row"]) & (table["regime"] == context["cell"])
        name = found[2].removesuffix(", assumed")
        row = table[here & (table["component"] == name)]
        assumed = str(row["origin"].iloc[0]).startswith("default")
        w.equal(f"{context['row']}, part of the uncertainty", found[2], f"{name}, assumed" if assumed else name)
        mu, tau0 = (float(row[f"share_pct_{n}"].iloc[0]) for n in ("mu", "tau0_kPa"))
        if found[1]:
            expected = f"{mu if found[1] == 'μ: ' else tau0:.0f}"
        else:
            low, high = sorted((round(mu), round(tau0)))
            expected = str(low) if low == high else f"{low} to {high}"
        return w.equal(f"share of {found[2]}, {context['row']} {context['cell']}", found[3], expected)

    return re.sub(r"(μ: |[τT][₀]: )?([a-z][a-z, ]*[a-z]) \(((?:\d+ to )?\d+) %\)", share, text)


def detectable(w: Written, text: str, context: dict[str, str]) -> str:
    """Smallest effects of the verdict, and smallest differences between samples."""
    found = w.table("figures/power")
    sizes = {f"{v:.0f}" for v in found.loc[found["mark"] == "mechanism", "found_50_percent"]} if len(found) else set()
    if "with a probability of one half" in text:
        head, tail = text.split("with a probability of one half", 1)
        sizes_here = re.findall(r"(\d+) %(?=[,.])", tail)
        for printed in sizes_here:
            w.equal("smallest effect", printed, printed if printed in sizes else "none of power.csv")
        text = head + re.sub(r"\d+ %(?=[,.])", "", tail)
    power = [
        said
        for regime in REGIMES
        for said in power_sentences(power_of_campaign(w.used, regime, w.area_m2))  # type: ignore[arg-type]
    ]
    if "would be detected with probability" in text:
        w.equal("power", text, text if text in power else "another sentence")
        return ""
    outlying = [
        said
        for regime in REGIMES
        for search in (outlying_pulls, outlying_specimens)
        for said in outlying_sentences(search(w.used, regime, w.area_m2))
    ]
    if text and text in outlying:
        return w.equal("outlying", text, text)
    return text


def odd_pulls(w: Written) -> None:
    """How far single pulls are from the geometric middle of their siblings."""
    pattern = r"(Static|Sliding) force ([\d.]+ %) (above|below) the median of the (\d+) other pulls"
    for test_id, text in w.page.cards:
        for regime, printed, side, siblings in re.findall(pattern, text):
            column = f"{regime.lower()}_N"
            rows = w.tests[np.isfinite(w.tests[column].astype(float)) & (w.tests[column].astype(float) > 0)]
            level = pd.Series(load_levels(rows["normal_load_N"].to_numpy(float)), index=rows.index)
            own = rows[rows["test_id"].astype(str) == test_id].iloc[0]
            others = rows[(rows["sample"] == own["sample"]) & (level == level[own.name]) & (rows.index != own.name)]
            ratio = float(np.exp(np.log(own[column]) - np.median(np.log(others[column].astype(float)))) - 1)
            sign = "+" if side == "above" else "−"
            w.equal(f"{test_id} against its siblings", sign + printed, percent(ratio))
            w.equal(f"siblings of {test_id}", siblings, str(len(others)))


def figures(w: Written) -> None:
    """The heat map and the picture of the card hold the percentages of diagnosis.csv."""
    table, cells, points = w.table("diagnosis"), w.table("figures/misfit"), w.table("figures/finding")
    if not len(table):
        return
    ratios = np.log1p(table["residual_calibrated_percent"] / 100)
    means = 100 * np.expm1(ratios.groupby([table["regime"], table["sample"]]).mean())
    layers, told = w.table("layers"), {}
    page = (w.out / "report.html").read_text(encoding="utf-8")
    if "times its stated error" in page:  # then the cells are those of the verdict
        for layer in layers[layers["kind"] == "pattern_correction"].itertuples():
            told[layer.regimes, layer.name] = layer.effect_percent
    for cell in cells[(cells["covariate"] == "mean") & cells["observable"].isin(["static", "sliding"])].itertuples():
        expected = told.get((cell.observable, cell.row), means[cell.observable, cell.row])
        alike = abs(cell.effect_percent - expected) <= 1e-4  # the table of the figure has six digits
        expected = cell.effect_percent if alike else expected
        w.equal(f"heat map {cell.row}", f"{cell.effect_percent:.4f}", f"{expected:.4f}")
    by_test = table.set_index([table["regime"], table["test_id"].astype(str)])["residual_calibrated_percent"]
    for point in points[points["mark"] == "test"].itertuples():
        w.equal(f"picture {point.test_id}", f"{point.y:.4f}", f"{by_test[point.regime, str(point.test_id)]:.4f}")


def of_laws(w: Written, text: str, context: dict[str, str]) -> str:
    """Laws against load, compared by loads left out, and T/N from end to end of a recorded variable."""
    laws, dependence = w.table("laws"), w.table("dependence")

    def law(found: re.Match[str]) -> str:
        row = laws[(laws["formula"] == found[1].strip()) & (laws["sample"] == context["of"])]
        row = row[row["regime"] == context["in"]]
        expected = significant(float(row["held_out_percent"].iloc[0]), 2)
        return w.equal(f"{found[1]} of {context['of']}", found[2], expected)

    best = r"(Static|Sliding) friction of (\S+) is described best by (T = .*?) with .* within (\S+) %"
    if found := re.match(best, text):
        context |= {"in": found[1].lower(), "of": found[2]}
        law(re.match(r"(.*)\|(.*)", f"{found[3]}|{found[4]}") or found)
        others = text.partition("The other laws: ")[2].partition(". Chosen")[0]
        return re.sub(r"(T = .*?) ([\d.]+) %(?:, | and |$)", law, others)
    if found := re.match(r"(Static|Sliding) T/N of (\S+) varies with (.*?): ([+−]?[\d.]+ %) from", text):
        here = (dependence["sample"].astype(str) == found[2]) & (dependence["regime"] == found[1].lower())
        row = dependence[here & (dependence["label"] == found[3])]
        expected = percent(float(row["change_percent"].iloc[0]) / 100).lstrip("+")
        w.equal(f"T/N of {found[2]} with {found[3]}", found[4], expected)
        return text.replace(found[4], "")
    return text


def humidity(w: Written, text: str, context: dict[str, str]) -> str:
    """The range of the recorded humidity."""
    recorded = w.tests["humidity_pct"].astype(float).dropna()
    if recorded.empty or not re.fullmatch(r"[\d.]+( to [\d.]+)? %", text):
        return text
    ends = [float(v) for v in re.findall(r"[\d.]+", text)]
    low, high = recorded.min(), recorded.max()
    near = abs(ends[0] - low) <= 0.05 and abs(ends[-1] - high) <= 0.05
    return w.equal("humidity", text, text if near else f"{low:g} to {high:g} %")


def missed_peaks(w: Written, text: str, context: dict[str, str]) -> str:
    """How far the highest data point lies below the peak: the median over the tests."""
    found = re.search(r"the highest data point lies ([\d.]+) % below the peak on average", text)
    if found is None:
        return text
    features = w.table("features")
    missed = features[features["feature"] == "missed_peak_N"].set_index("test_id")["value"].astype(float)
    static = w.used.set_index("test_id")["static_N"].astype(float)
    return w.equal("missed peaks", found[1], f"{100 * (missed / static).median():.1f}")


CHECKS: tuple[Callable[[Written, str, dict[str, str]], str], ...] = (
    agreement, of_layers, of_models, detectable, budget, of_laws, humidity, missed_peaks,
)  # fmt: skip


def unchecked(w: Written) -> list[str]:
    """Run every check; returns the texts that hold a percentage which nothing has recomputed."""
    counts(w)
    odd_pulls(w)
    figures(w)
    left, context = [], {"regime": "", "sample": "", "row": "", "cell": ""}
    for tag, text in w.page.texts:
        if tag == "h3" and text.split()[0] in ("Static", "Sliding"):
            context["regime"] = text.split()[0].lower()
        context |= {"dt": {"sample": text}, "th": {"row": text}}.get(tag, {})
        if tag == "td" and text in ("static", "sliding"):
            context["cell"] = text
        remaining = text
        for check in CHECKS:
            if "%" in remaining:
                remaining = check(w, remaining, context)
        for constant in CONSTANT:
            remaining = re.sub(constant, "", remaining)
        if "%" in remaining:
            left.append(f"{tag}: {remaining}")
    return left
