"""Whether the figures of a diagnosis say the opposite of its verdict, by the numbers that they are drawn from."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pandas as pd

from tribo.diagnostics import Diagnosis
from tribo.diagnostics.verdict import Misfit
from tribo.figures import evidence, misfit, residuals
from tribo.mechanisms.record import TraceEvidence

LEVEL = 0.01


def contradictions(d: Diagnosis) -> list[str]:
    """One sentence for every cell, point or word of a figure that says the opposite of the verdict."""
    return [*_of_chance(d), *_of_cells(d), *_of_residuals(d), *_of_the_finding(d), *_of_evidence(d)]


def _of_chance(d: Diagnosis) -> Iterator[str]:
    """The word beside the picture of chance, and on which side of the threshold this campaign lies."""
    rows = evidence.power_numbers(d)
    shown = evidence.draw_power(rows).axes[0].get_title("right")
    if (d.verdict.verdict == "no_misfit") != (shown == "no"):
        yield f"the verdict is {d.verdict.verdict}, the picture of chance says {shown}"
    marks = rows.set_index("mark")["strength"]
    beyond, last = marks["observed"] > marks["need"], shown.rpartition(" ")[2]
    if beyond != (last == "yes"):
        yield f"the line of this campaign is {'beyond' if beyond else 'before'} the threshold, the word is {last}"


def _of_cells(d: Diagnosis) -> Iterator[str]:
    """Cells of the table of misfits: none is strong without a misfit, and each misfit has a strong one of its sign."""
    cells = misfit.misfit_numbers(d)
    cells = cells[cells["observable"] != "trace"]
    strong = cells[cells["p_adjusted"] < LEVEL * d.share_of_level]
    if d.verdict.verdict == "no_misfit" and len(strong):
        yield f"no misfit, and {len(strong)} cells are marked: {strong.iloc[0].to_dict()}"
    for m in d.verdict.misfits:
        if m.covariate != "sample" or m.observable not in ("static", "sliding"):
            continue
        cell = cells[
            (cells["row"] == m.sample) & (cells["covariate"] == "mean") & (cells["observable"] == m.observable)
        ]
        if not len(cell):
            yield f"no cell for the mean of {m.sample}"
            continue
        seen = cell.iloc[0]
        if not seen["mark"]:
            yield f"{m.observable} friction of {m.sample} is a misfit, and its cell is not marked"
        value = float(seen["effect_percent"])
        if np.sign(value) != np.sign(m.effect_percent) or not _near(value, m):
            yield f"{m.observable} friction of {m.sample}: {m.effect_percent:+.1f} %, its cell {value:+.1f} %"


def _near(value: float, m: Misfit) -> bool:
    """Within the interval of the sentence, which also counts the error of the flat law, widened by half of it."""
    half = (m.high - m.low) / 2
    return m.low - half <= value <= m.high + half


def _of_residuals(d: Diagnosis) -> Iterator[str]:
    """p printed over points: not small without a misfit, and not large over points that lie far outside their band."""
    rows = residuals.residual_numbers(d)
    for _, part in rows.groupby("panel"):
        p = float(re.sub(r"p [<=] ", "", str(part["detail"].iloc[0])))
        if d.verdict.verdict == "no_misfit" and p < LEVEL * d.share_of_level:
            yield f"no misfit, and p {p} over {part['title'].iloc[0]}"
        means, bands = (part[part["mark"] == mark].set_index("x") for mark in ("mean", "band"))
        beyond = np.maximum(means["y"] - bands["y_high"], bands["y_low"] - means["y"])
        half = (bands["y_high"] - bands["y_low"]) / 2
        if p > 0.05 and d.verdict.verdict == "no_misfit" and float((beyond / half).max()) > 1.5:
            yield f"p {p} over a mean {float((beyond / half).max()):.1f} bands outside: {part['title'].iloc[0]}"


def _of_the_finding(d: Diagnosis) -> Iterator[str]:
    """The picture of the card: its means have the sign and the size that the sentence says."""
    v, rows = d.verdict, residuals.finding_numbers(d)
    means = rows[rows["mark"] == "mean"]
    for m in v.misfits[:1] if v.verdict == "unknown" else ():
        if m.covariate == "sample" and m.observable in ("static", "sliding"):
            mean = means[(means["x_name"] == m.sample) & (means["regime"] == m.observable)]
            value = float(mean["y"].iloc[0]) if len(mean) else m.effect_percent
            if not _near(value, m):
                yield f"the sentence says {m.effect_percent:+.0f} % of {m.sample}, the picture {value:+.0f} %"
    laws = [layer.shows.law for layer in v.layers if layer.kind == "law" and hasattr(layer.shows, "law")]
    if v.verdict == "unknown" and laws and (rows["axis"] == "Sample").any():
        yield f"the sentence speaks of {' and '.join(laws[0].columns)}, the picture of samples"
    if v.verdict == "unknown" and laws and means["group"].nunique() != min(len(laws[0].columns), 2):
        yield f"the sentence speaks of {' and '.join(laws[0].columns)}, the picture of one of them"
    causes = [layer for layer in v.layers if layer.kind == "cause" and layer.over is not None]
    first = max(causes, key=lambda layer: abs(layer.effect_percent), default=None)
    biggest = max((x for x in v.layers if x.kind == "cause"), key=lambda x: abs(x.effect_percent), default=None)
    if first is None or first is not biggest or v.verdict == "unknown" or (means["x_name"] != "").any():
        return
    for regime in first.regimes:
        part = means[means["regime"] == regime].sort_values("x")
        if len(part) >= 2 and first.over is not None:
            rise = float(part["y"].iloc[-1] - part["y"].iloc[0])
            error = float(np.hypot(*((part["y_high"] - part["y_low"]) / 4).iloc[[0, -1]]))
            if rise * first.over["percent"] < 0 and abs(rise) > 3 * error:
                yield f"{regime}: the sentence says {first.over['percent']:+.0f} %, the picture {rise:+.0f} %"


def _of_evidence(d: Diagnosis) -> Iterator[str]:
    """Bars called named are causes of the verdict, and each weighed cause has one."""
    rows: pd.DataFrame = evidence.evidence_numbers(d)
    named = set(rows.loc[rows["status"].isin(["cause", "tied", "rival"]), "mechanism"])
    v = d.verdict
    causes = {c.mechanism for c in v.causes if not isinstance(c.shows, TraceEvidence)}
    causes |= {name for names in v.equivalent for name in names}
    if extra := named - causes:
        yield f"the bars name {sorted(extra)}, the verdict does not"
    if len(rows) and (missing := (causes & set(rows["mechanism"])) - named):
        yield f"the verdict names {sorted(missing)}, their bars do not"
