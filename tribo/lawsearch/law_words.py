"""Laws in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.sentences import p_text
from tribo.diagnostics.terms import in_words
from tribo.diagnostics.verdict import Estimate, Layer, Misfit
from tribo.lawsearch.grammar import (
    ALL,
    BOTH,
    CAVITY_SHARE,
    ELONGATION,
    FLAT,
    PATTERNED,
    RIM,
    UNITS,
    Shape,
    T,
    WrittenLaw,
)
from tribo.lawsearch.search import Discovery, FoundLaw
from tribo.records import REGIMES

READABLE = {
    "elapsed_s": (1 / 3600, "h"), "speed_m_s": (1e3, "mm/s"), "pressure_Pa": (1e-3, "kPa"),
    "contact_pressure_Pa": (1e-3, "kPa"),
}  # fmt: skip
NAMED = 3  # tied laws that are written out in a sentence
WHERE = {
    ALL: "", PATTERNED: " of the patterned samples", FLAT: " of the flat sample",
    CAVITY_SHARE: ", in proportion to the share of cavities,", RIM: ", in proportion to the rim length,",
    ELONGATION: ", in proportion to the elongation along the pull,",
}  # fmt: skip


def law_sentence(found: FoundLaw) -> str:
    """What follows what, where, in which regime and by how much."""
    said = size_sentence(found.law, found.parameters, found.effect_percent)
    return f"{said} (adjusted p {p_text(found.p)})."


def size_sentence(
    law: WrittenLaw, parameters: Mapping[str, Estimate], effect_percent: tuple[float, float, float]
) -> str:
    """The same of any law with these parameters, without evidence and full stop."""
    value, low, high = effect_percent
    size = f"{value:+.0f} %, 90 % interval {low:+.0f} to {high:+.0f} %"
    if law.shapes[0].kind == "wave":
        return f"{subject(law)} {_wave(law.shapes[0])}; highest relative to lowest: {size}"
    return f"{subject(law)} {'is higher' if value > 0 else 'is lower'} ({size}) {_where(law, parameters)}"


def subject(law: WrittenLaw) -> str:
    """The observable and the samples."""
    regime = "Friction" if law.regime == BOTH else f"{law.regime.capitalize()} friction"
    what = regime if law.acts_on == T else f"The {law.acts_on} of {regime.lower()}"
    of = WHERE.get(law.where, f" of {law.where}")
    return f"{what}{of}"


def _where(law: WrittenLaw, parameters: Mapping[str, Estimate]) -> str:
    if len(law.shapes) > 1:
        names = " and ".join(_name(s) for s in law.shapes)
        return f"where {names} are both at their highest than where one of them is at its lowest"
    s = law.shapes[0]
    if s.kind == "window":
        return f"for {_name(s)} from {_value(s, s.place)} to {_value(s, s.place + s.width)} than elsewhere"
    if s.kind == "ramp":
        side = "above" if s.high > s.place else "below"
        return f"at {_name(s)} = {_value(s, s.high)}, growing {side} {_value(s, s.place)}"
    if s.kind == "level":
        return f"where {_name(s)} is {s.level}"
    if s.kind in ("step", "soft step"):
        return f"where {_name(s)} is above {_value(s, s.place)}"
    if s.kind in ("optimum", "hump"):
        place = parameters["place"]
        factor, _ = _readable(s)
        near = f"{_value(s, place.value)} (90 % interval {factor * place.low:.4g} to {factor * place.high:.4g})"
        return f"near {_name(s)} = {near} than far from it"
    how = {"log": ", in proportion to its logarithm", "saturating": ", approaching a limit"}.get(s.kind, "")
    return f"at {_name(s)} = {_value(s, s.high)} than at {_value(s, s.low)}{how}"


def _wave(s: Shape) -> str:
    return f"varies periodically with {_name(s)}, period {_value(s, s.width)}"


def _name(s: Shape) -> str:
    return in_words(s.column)


def _value(s: Shape, x: float) -> str:
    factor, unit = _readable(s)
    return f"{factor * x:.4g} {unit}".rstrip()


def _readable(s: Shape) -> tuple[float, str]:
    """The factor and the unit in which a column stands in a sentence."""
    return READABLE.get(s.column, (1.0, UNITS.get(s.column, "")))


def discovery_text(d: Discovery) -> str:
    """What was found, or that nothing was."""
    if not d.laws:
        return f"None of the {d.searched} laws that were tried explains more than chance does."
    return f"{laws_text(d)} {d.searched} laws were tried."


def laws_text(d: Discovery, said: str = "") -> str:
    """The laws that are not ``said`` already, each with those that the design cannot distinguish from it."""
    each = [("" if law_sentence(f) in said else law_sentence(f)) + tied_text(f.ties) for f in d.laws]
    return " ".join(filter(None, map(str.strip, each)))


def law_misfit(f: FoundLaw) -> Misfit:
    """A law as the misfit that it describes, for where nothing else showed one."""
    value, low, high = f.effect_percent
    sample = f.law.where.removeprefix("sample ") if f.law.where.startswith("sample ") else ""
    return Misfit(f.law.regime, sample, " and ".join(f.law.columns), value, f.p, law_sentence(f), low, high)


def tied_text(ties: Sequence[WrittenLaw]) -> str:
    """The laws that the design cannot distinguish from one, as a sentence; nothing without any."""
    if not ties:
        return ""
    names = "; ".join(f"{tie.formula()} ({subject(tie)})" for tie in ties[:NAMED])
    more = f"; and {len(ties) - NAMED} more" if len(ties) > NAMED else ""
    return f" This design cannot distinguish it from: {names}{more}."


def law_layers(d: Discovery) -> list[Layer]:
    """The laws as layers of a verdict."""
    return [
        replace(
            law_layer(f.law, f.model, f.parameters, f.effect_percent, law_sentence(f)), p_adjusted=f.p,
            tied_with=tuple(t.formula() for t in f.ties), gain=f.gain,
        )
        for f in d.laws
    ]  # fmt: skip


def law_layer(
    law: WrittenLaw,
    model: ModelFit,
    parameters: Mapping[str, Estimate],
    effect_percent: tuple[float, float, float],
    text: str,
) -> Layer:
    """A law that ``model`` holds as a layer, without its evidence."""
    c = model.setup.observations.conditions
    samples = tuple(sorted({str(name) for name, w in zip(c.sample, law.weight(c), strict=True) if w != 0}))
    return Layer(
        kind="law", name=" and ".join(law.columns), samples=samples,
        regimes=tuple(REGIMES) if law.regime == BOTH else (law.regime,), p_adjusted=float("nan"),
        effect_percent=effect_percent[0], low=effect_percent[1], high=effect_percent[2], parameters=parameters,
        formula=law.formula(), text=text,
    )  # fmt: skip
