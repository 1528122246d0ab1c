"""Evidence for each mechanism: increase in log likelihood over the calibrated model, or why it was ruled out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tribo.figures import style
from tribo.figures.covariates import mechanism_label
from tribo.records import FloatArray

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis

COLUMNS = ["mechanism", "choice", "status", "gain", "weight", "estimate", "reason"]
STATUS = {
    "cause": ("named", style.VERMILLION),
    "tied": ("not distinguishable from the best by this design", style.ORANGE),
    "rival": ("explains the data about as well", style.SKY),
    "lost": ("explains less", "0.7"),
    "out": ("not weighed", "0.5"),
}
ROW_MM, FRAME_MM = 4.4, 24.0
LEAST_SHOWN = -2.0
LETTERS_ACROSS = 100  # of the words beside the bars, over the width of the axis


def numbers(d: Diagnosis) -> pd.DataFrame:
    """Every mechanism: log likelihood gained net of its freedom, share of the evidence, amplitude, or why it is out.

    With two causes the gains are those of the first step. Empty where nothing had to be explained.
    """
    from tribo.diagnostics import weighing_table

    if d.named is None or not d.named.weighed:
        return pd.DataFrame(columns=COLUMNS)
    status = _status(d)
    rows = []
    for row in weighing_table(d).to_dict("records"):
        known = status.get(row["mechanism"], "lost")
        amplitude = f"{row['parameter']} = {row['value']:.3g} {row['unit']}".rstrip()
        rows.append((row["mechanism"], row["choice"], known, row["gain"], row["weight"], amplitude, ""))
    weighed = {row[0] for row in rows}
    out = [e for e in (*d.verdict.excluded, *d.verdict.not_testable) if e.mechanism not in weighed]
    rows += [(e.mechanism, "", "out", float("nan"), float("nan"), "", e.reason) for e in out]
    return pd.DataFrame(rows, columns=COLUMNS)


def _status(d: Diagnosis) -> dict[str, str]:
    assert d.named is not None
    if d.verdict.verdict == "unknown":  # the best of them did not pass its check
        return {}
    found = {c.name: "rival" for c in d.named.rivals}
    for alike in d.named.causes:
        found |= {c.name: "tied" for c in alike[1:]} | {alike[0].name: "cause"}
    return found


@style.in_house_style
def draw(numbers: pd.DataFrame) -> Figure:
    """Bars for what was weighed, the best first; below, in words, what could not be."""
    height_mm = ROW_MM * len(numbers) + FRAME_MM
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
        return _short(row["reason"])
    name = f"{row['estimate']}" + (f"  ({row['choice']})" if row["choice"] else "")
    weight = f"weight {row['weight']:.2f},  " if row["weight"] >= 0.005 else ""
    return f"{row['gain'] + 0.0:.1f}   {weight}{name}".replace("-0.0 ", "0.0 ").replace("-", "−")


def _reach(gains: FloatArray, words: list[str]) -> float:
    """The right end of the axis, such that the words beside every bar fit on the page."""
    ends = [
        LEAST_SHOWN + (max(gain, 0.0) - LEAST_SHOWN) / max(1.0 - len(text) / LETTERS_ACROSS, 0.1)
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
    ax.set_xlabel("Increase in log likelihood over the calibrated model, after penalty")


def _short(reason: str, most: int = 96) -> str:
    """The reason up to its first semicolon, in one line."""
    text = reason.split(";")[0].split(", and each")[0].replace(" +- ", " ± ")
    return text if len(text) <= most else f"{text[: most - 1]}…"
