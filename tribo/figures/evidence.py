"""Evidence for each mechanism, and the effects that the campaign could have detected."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from tribo.diagnostics.direct_evidence import stated_evidence
from tribo.figures import style
from tribo.figures.misfit import mechanism_label, pattern_differences
from tribo.records import FloatArray

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis


EVIDENCE_COLUMNS = ["mechanism", "choice", "status", "gain", "weight", "estimate", "reason"]
STATUS = {
    "cause": ("named", style.VERMILLION),
    "tied": ("not distinguishable from the best by this design", style.ORANGE),
    "rival": ("explains the data about as well", style.SKY),
    "lost": ("explains less", "0.7"),
    "out": ("not weighed", "0.5"),
}
ROW_MM = 4.4
EVIDENCE_FRAME_MM = 24.0
LEAST_SHOWN = -2.0
LETTERS_ACROSS = 100  # of the words beside the bars, over the width of the axis on a page of two columns
NAMES_MM = 50.0  # left of the axis


def evidence_numbers(d: Diagnosis) -> pd.DataFrame:
    """Every mechanism: log likelihood gained net of its freedom, share of the evidence, amplitude, or why it is out.

    With two causes the gains are those of the first step. Empty where nothing had to be explained.
    """
    from tribo.diagnostics import weighing_table

    if d.named is None or not d.named.weighed:
        return pd.DataFrame(columns=EVIDENCE_COLUMNS)
    status = _status(d)
    rows = []
    for row in weighing_table(d).to_dict("records"):
        known = status.get(row["mechanism"], "lost")
        amplitude = f"{row['parameter']} = {row['value']:.3g} {row['unit']}".rstrip()
        rows.append((row["mechanism"], row["choice"], known, row["gain"], row["weight"], amplitude, ""))
    weighed = {row[0] for row in rows}
    out = [e for e in (*d.verdict.excluded, *d.verdict.not_testable) if e.mechanism not in weighed]
    rows += [(e.mechanism, "", "out", float("nan"), float("nan"), "", e.reason) for e in out]
    return pd.DataFrame(rows, columns=EVIDENCE_COLUMNS)


def _status(d: Diagnosis) -> dict[str, str]:
    assert d.named is not None
    if d.verdict.verdict == "unknown":  # the best of them did not pass its check
        return {}
    found = {c.name: "rival" for c in d.named.rivals}
    for alike in d.named.causes:
        found |= {c.name: "tied" for c in alike[1:]} | {alike[0].name: "cause"}
    return found


@style.in_house_style
def draw_evidence(numbers: pd.DataFrame) -> Figure:
    """Bars for what was weighed, the best first; below, in words, what could not be."""
    height_mm = ROW_MM * len(numbers) + EVIDENCE_FRAME_MM
    figure = style.page_figure(height_mm)
    ax = figure.subplots()
    rows = numbers.reset_index(drop=True)
    weighed = rows[rows["status"] != "out"]
    words = [_words(row) for row in rows.to_dict("records")]
    reach = _reach(rows["gain"].fillna(0.0).to_numpy(float), words)
    for status, part in weighed.groupby("status"):
        ax.barh(part.index, part["gain"].clip(lower=LEAST_SHOWN), color=STATUS[str(status)][1], height=0.72)
    for k, row in enumerate(rows.to_dict("records")):
        out: dict[str, Any] = {"color": "0.35", "style": "italic"} if row["status"] == "out" else {}
        start = max(row["gain"], 0.0) if np.isfinite(row["gain"]) else 0.0
        ax.text(start + 0.008 * reach, k, words[k], va="center", fontsize=6.5, in_layout=False, **out)
    _frame(ax, rows, reach)
    shown = [s for s in STATUS if (weighed["status"] == s).any()]
    style.legend_below(figure, [Patch(color=STATUS[s][1], label=STATUS[s][0]) for s in shown])
    return figure


def _words(row: dict[Any, Any]) -> str:
    """What stands beside a bar, or in its place."""
    if row["status"] == "out":
        return _short(row["reason"], _letters() - 4)
    name = f"{row['estimate']}" + (f"  ({row['choice']})" if row["choice"] else "")
    weight = f"weight {row['weight']:.2f},  " if row["weight"] >= 0.005 else ""
    text = f"{row['gain'] + 0.0:.1f}   {weight}{name}".replace("-0.0 ", "0.0 ").replace("-", "−")
    return text if style.page_mm() >= style.PAGE_MM else _short(text, _letters() // 2)


def _letters() -> int:
    """How many letters stand side by side over the width of the axis."""
    return int(LETTERS_ACROSS * (style.page_mm() - NAMES_MM) / (style.PAGE_MM - NAMES_MM))


def _reach(gains: FloatArray, words: list[str]) -> float:
    """The right end of the axis, such that the words beside every bar fit on the page."""
    ends = [
        LEAST_SHOWN + (max(gain, 0.0) - LEAST_SHOWN) / max(1.0 - len(text) / _letters(), 0.1)
        for gain, text in zip(gains, words, strict=True)
    ]
    return max(*ends, 5.0)


def _frame(ax: Axes, rows: pd.DataFrame, reach: float) -> None:
    ax.axvline(0, color="0.4", lw=0.8)
    ax.set_yticks(np.arange(len(rows)), [mechanism_label(name) for name in rows["mechanism"]])
    for label, status in zip(ax.get_yticklabels(), rows["status"], strict=True):
        label.set_fontweight("bold" if status in ("cause", "tied") else "normal")
        label.set_color("0.45" if status == "out" else "black")
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_xlim(LEAST_SHOWN, reach)
    ax.grid(visible=False, axis="y")
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel(f"Increase in log likelihood over the{_break()}calibrated model, after penalty")


def _break() -> str:
    """Between two parts of a label: a new line on a page too narrow for both."""
    return "\n" if style.page_mm() < style.PAGE_MM else " "


def _short(reason: str, most: int) -> str:
    """The reason up to its first semicolon, in one line."""
    text = reason.split(";")[0].split(", and each")[0].replace(" +- ", " ± ")
    return text if len(text) <= most else f"{text[: most - 1]}…"


POWER_COLUMNS = ["mark", "name", "strength", "found_10_percent", "found_50_percent", "found_90_percent"]
LEVEL = 0.01  # chance of a misfit where nothing is hidden, as the diagnosis takes it by default
TENTH = 1.2816  # standard normal deviate exceeded one time in ten
SHOWN = 16
POWER_FRAME_MM = 26.0


def power_numbers(d: Diagnosis, level: float = LEVEL) -> pd.DataFrame:
    """Chance: the strongest deviation in each simulated campaign without effect. Observed: the strongest in this one.

    Answer: whether there is a misfit, as the verdict says. Means: by how many times its stated error the patterned
    samples differ from the model, where this is certain. Then one row per mechanism: the effect on T, in percent over
    the range of the variable, that is detected with 10, 50 and 90 % probability. The strength of a deviation is
    proportional to the effect and has a standard deviation of 1.
    """
    chance = [("chance", "", float(z), *[float("nan")] * 3) for z in d.screened.chance]
    best = int(np.argmax(d.screened.strength))
    level = level * d.share_of_level
    need = _needed(d, level) if len(chance) else 3.7
    contrast = d.screened.contrasts[best]
    seen, nothing = float(d.screened.strength[best]), [float("nan")] * 3
    rows = [*chance, ("need", f"level {level:g}", need, *nothing)]
    rows.append(("observed", f"{contrast.observable}, {contrast.title}", seen, *nothing))
    rows.append(("answer", _answer(d, level), float("nan"), *nothing))
    if pattern_differences(d):
        rows.append(("means", "means of the patterned samples", d.verdict.shows.excess[0], *nothing))
    for name, percent in sorted(d.verdict.smallest_effects.items(), key=lambda item: item[1])[:SHOWN]:
        low, high = (percent * (need + s * TENTH) / need for s in (-1, 1))
        rows.append(("mechanism", name, float("nan"), low, percent, high))
    return pd.DataFrame(rows, columns=POWER_COLUMNS)


def _needed(d: Diagnosis, level: float) -> float:
    """The strength at which a deviation is a misfit, by the p value of the verdict."""
    low, high = 0.0, float(d.screened.chance.max()) + 10.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (low, middle) if d.screened.p_adjusted(middle) < level else (middle, high)
    return high


def _answer(d: Diagnosis, level: float) -> str:
    """Whether a deviation of the picture is a misfit; before it, what else the verdict rests on."""
    strongest = "yes" if d.screened.p.min() < level else "no"
    of_traces = {stated.observable for stated in stated_evidence().values()}
    beside = {
        "means": bool(pattern_differences(d)),
        "traces": any(m.observable in of_traces for m in d.verdict.misfits),
        "law": any(layer.kind == "law" for layer in d.verdict.layers),
    }
    said = [f"{name}: yes" for name, there in beside.items() if there]
    return ", ".join([*said, f"else: {strongest}"]) if said else strongest


@style.in_house_style
def draw_power(numbers: pd.DataFrame) -> Figure:
    """Left the size of what was seen, right the power for what may be hidden."""
    rows = numbers[numbers["mark"] == "mechanism"].reset_index(drop=True)
    height_mm = max(ROW_MM * len(rows), 34.0) + POWER_FRAME_MM
    if style.page_mm() < style.PAGE_MM:  # one above the other
        figure = style.page_figure(height_mm + 45.0)
        left, right = figure.subplots(2, 1, height_ratios=(34.0, max(ROW_MM * len(rows), 34.0)))
    else:
        figure = style.page_figure(height_mm)
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.5))
    _chance(left, numbers)
    _sizes(right, rows)
    style.legend_below(
        figure,
        [
            Patch(color="0.75", label="simulated campaigns without any effect"),
            Line2D([], [], color="black", ls="--", lw=0.9, label="threshold of a misfit"),
            Line2D([], [], color=style.VERMILLION, lw=1.6, label="this campaign"),
            Line2D([], [], color=style.BLUE, lw=3, alpha=0.45, marker="o", ms=4, label="detected in 10, 50, 90 %"),
        ],
    )
    return figure


def _chance(ax: Axes, numbers: pd.DataFrame) -> None:
    chance = numbers.loc[numbers["mark"] == "chance", "strength"].to_numpy(float)
    observed = float(numbers.loc[numbers["mark"] == "observed", "strength"].iloc[0])
    need = float(numbers.loc[numbers["mark"] == "need", "strength"].iloc[0])
    if len(chance):
        edges = np.arange(np.floor(4 * chance.min()) / 4, chance.max() + 0.25, 0.25)
        ax.hist(chance, bins=edges.tolist(), color="0.75")
    ax.axvline(need, color="black", ls="--", lw=0.9)
    ax.axvline(observed, color=style.VERMILLION, lw=1.6)
    said = numbers.loc[numbers["mark"] == "answer", "name"].astype(str).tolist()  # none in tables of earlier versions
    answer = said[0] if said else "yes" if observed > need else "no"
    if style.page_mm() < style.PAGE_MM:  # part by part below each other
        ax.set_title("\n".join(["A misfit?", *answer.split(", ")]), loc="left")
    else:
        style.panel_title(ax, "A misfit?", answer)
    ax.set_xlabel(f"Strongest deviation{_break()}(standard deviations)")
    ax.set_ylabel("Campaigns")


def _sizes(ax: Axes, rows: pd.DataFrame) -> None:
    places = np.arange(len(rows))
    ax.hlines(places, rows["found_10_percent"], rows["found_90_percent"], color=style.BLUE, lw=3, alpha=0.45)
    ax.plot(rows["found_50_percent"], places, "o", color=style.BLUE, ms=4)
    ax.set_yticks(places, [mechanism_label(str(name)) for name in rows["name"]])
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)
    if rows.empty:
        style.panel_title(ax, "Detectable effects", "none that this design can test")
        return
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0,) if style.page_mm() < style.PAGE_MM else (1.0, 2.0, 5.0)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    style.panel_title(ax, "Detectable effects")
    narrow = style.page_mm() < style.PAGE_MM
    ax.set_xlabel("Change of T (%)" if narrow else "Change of T over the range of the variable (%)")


EVIDENCE = style.FigureOf(
    "evidence",
    "Evidence for each mechanism",
    "Increase in log likelihood over the calibrated model, minus a penalty for the free parameters of each "
    "mechanism, with its fitted size. Mechanisms that the design cannot distinguish from the best one are "
    "marked. Italics: reason why a mechanism was not evaluated. If two causes were found, the values are those "
    "of the first step.",
    evidence_numbers,
    draw_evidence,
)
POWER = style.FigureOf(
    "power",
    "Effects this campaign could have detected",
    "Left: the strongest deviation in this campaign, and in simulated campaigns of the calibrated model "
    "with the same design and noise; means of patterned samples that differ from the model by more than its stated "
    "error are judged apart. Right: change of T over the whole range of a variable, after the part "
    "that calibration on the flat sample absorbs, that would be detected in 10 %, 50 % and 90 % of such "
    "campaigns (bar: 10 to 90 %, dot: 50 %).",
    power_numbers,
    draw_power,
)
