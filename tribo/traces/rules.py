"""Named rules that determine static and sliding friction of a pull, as a plain table."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, TraceError
from tribo.traces.peak import Apex, Motion, rounded_apex
from tribo.traces.sliding import Window, slides_on_closed_track, transient_end
from tribo.user_text import did_you_mean

Parameters = Mapping[str, float]
DEFAULT_RULE = "first_peak"
OLD_NAMES = {"seed": "first_peak"}  # still taken from users, who are told the name of today


@displayed()
@dataclass(frozen=True)
class Rule:
    """A rule: how it defines static and sliding friction, as text and as functions, and its source.

    ``static(motion, parameters)`` returns the peak, ``sliding(motion, parameters)`` the range of samples to
    average. Lengths are in metres, shares dimensionless.
    """

    name: str
    static_part: str
    sliding_part: str
    source: str
    static: Callable[[Motion, Parameters], Apex]
    sliding: Callable[[Motion, Parameters], Window]
    parameters: Parameters = field(default_factory=dict)


def first_peak(motion: Motion, parameters: Parameters) -> Apex:
    """The first maximum of the force."""
    return motion.apex


def highest_in_skip(motion: Motion, parameters: Parameters) -> Apex:
    """The highest force in the skipped length after the onset: the first peak unless a later one tops it."""
    end = _after(motion, parameters["skip_m"], motion.onset_s)
    first = motion.sliding[0]
    later = motion.smooth_N[first:end]
    if later.size < 3 or float(later.max()) <= motion.apex.force_N + 3.0 * motion.noise_N:
        return motion.apex
    return rounded_apex(motion.time_s, motion.force_N, first + int(np.argmax(later)), 3, motion.noise_N)


def highest_before_stop(motion: Motion, parameters: Parameters) -> Apex:
    """The highest force up to the end of sliding: a later maximum where it tops the first."""
    first, end = motion.sliding
    later = motion.smooth_N[first:end]
    if later.size < 3 or float(later.max()) <= motion.apex.force_N:
        return motion.apex
    half = max(3, later.size // 100)
    return rounded_apex(motion.time_s, motion.force_N, first + int(np.argmax(later)), half, motion.noise_N)


def highest_early(motion: Motion, parameters: Parameters) -> Apex:
    """The highest force, impulses left out, in the first ``start_s`` of the record."""
    end = int(np.searchsorted(motion.time_s, motion.time_s[0] + parameters["start_s"], side="right"))
    at = int(np.argmax(motion.force_N[:end]))
    return Apex(float(motion.time_s[at]), 0.0, float(motion.force_N[at]), motion.noise_N, math.nan, "highest")


def once_stabilised(motion: Motion, parameters: Parameters) -> Window:
    """From when the force has stabilised (MSER-5) to the end of sliding; on a closed track, its second half."""
    first, end = motion.sliding
    if slides_on_closed_track(motion.travel_m, (first, end)):
        return first + (end - first) // 2, end
    return first + transient_end(motion.force_N[first:end]), end


def stabilised_length(motion: Motion, parameters: Parameters) -> Window:
    """From when the force has stabilised to ``length_m`` of travel after the static peak."""
    start, end = once_stabilised(motion, parameters)
    return start, min(end, _after(motion, parameters["length_m"], motion.apex.time_s))


def length_after_skip(motion: Motion, parameters: Parameters) -> Window:
    """``length_m`` of travel after ``skip_m`` of travel since the onset."""
    start = _after(motion, parameters["skip_m"], motion.onset_s)
    end = _after(motion, parameters["skip_m"] + parameters["length_m"], motion.onset_s)
    return max(start, motion.sliding[0]), min(end, motion.sliding[1])


def middle_share(motion: Motion, parameters: Parameters) -> Window:
    """The middle ``share`` of the stroke, which runs from the onset to the end of sliding."""
    onset = int(np.searchsorted(motion.time_s, motion.onset_s))
    end = motion.sliding[1]
    margin = int((end - onset) * (1.0 - parameters["share"]) / 2.0)
    return max(onset + margin, motion.sliding[0]), end - margin


def last_share(motion: Motion, parameters: Parameters) -> Window:
    """The last ``share`` of the record, a tail of unloading left out."""
    end = motion.sliding[1]
    return max(end - int(parameters["share"] * end), motion.sliding[0]), end


def _after(motion: Motion, length_m: float, since_s: float) -> int:
    """Index of the first sample ``length_m`` of travel after the time ``since_s``."""
    if motion.travel_m is None:
        what = "this rule needs the travel, but neither displacement nor speed is known"
        raise TraceError(Problem("no_displacement", what, allowed="a displacement column, or speed_mm_s in tests.csv"))
    start = float(np.interp(since_s, motion.time_s, motion.travel_m))
    beyond = motion.travel_m >= start + length_m
    return int(np.argmax(beyond)) if beyond.any() else int(motion.travel_m.size)


RULES: dict[str, Rule] = {
    rule.name: rule
    for rule in (
        Rule(
            "first_peak",
            "first maximum of the force",
            "mean from the time the force has stabilised (MSER-5) to the end of sliding; of a slide over more than "
            "10 m, the second half, so that running-in is left out",
            "Berardo et al. 2019, Materials & Design 107930; stabilised: White 1997, Simulation 69, 323",
            first_peak,
            once_stabilised,
        ),
        Rule(
            "astm_d1894",
            "initial maximum of the force",
            "mean during uniform sliding, up to 130 mm of travel",
            "ASTM D1894 (travel cited from memory, not checked against the standard)",
            first_peak,
            stabilised_length,
            {"length_m": 0.130},
        ),
        Rule(
            "iso_8295",
            "maximum at the start of motion",
            "mean over the first 60 mm, without the static peak and the transient after it",
            "ISO 8295 (travel cited from memory, not checked against the standard)",
            first_peak,
            stabilised_length,
            {"length_m": 0.060},
        ),
        Rule(
            "skip_length",
            "highest force in the skipped travel",
            "mean over a given travel after the skip",
            "as in ASTM D2534",
            highest_in_skip,
            length_after_skip,
            {"skip_m": 0.013, "length_m": 0.150},
        ),
        Rule(
            "highest",
            "highest force before the drive stops",
            "mean from the time the force has stabilised (MSER-5) to the end of sliding",
            "practice of ring shear testers: Schulze 1994; Schmid et al. 2020, quartz sand of the Univ. of Bern",
            highest_before_stop,
            once_stabilised,
        ),
        Rule(
            "middle_share",
            "maximum at the start of motion",
            "mean over the middle share of the stroke",
            "common practice on reciprocating rigs",
            first_peak,
            middle_share,
            {"share": 0.4},
        ),
        Rule(
            "last_share",
            "highest force in the first minute",
            "mean over the last share of the record",
            "common practice on rotary rigs with a long run-in",
            highest_early,
            last_share,
            {"start_s": 60.0, "share": 0.5},
        ),
    )
}


def rule_of_today(name: str) -> str:
    """The name of a rule; for an old name that of today, which a warning states."""
    if name in OLD_NAMES:
        warnings.warn(f"the rule {name} is now called {OLD_NAMES[name]}", FutureWarning, stacklevel=2)
    return OLD_NAMES.get(name, name)


def named_rule(name: str, parameters: Parameters | None = None) -> Rule:
    """The rule of a name, with its own parameters replaced by those given.

    Raises
    ------
    TraceError
        The rule or a parameter is unknown; what is allowed is listed.
    """
    name = rule_of_today(name)
    if name not in RULES:
        hint = "; ".join(filter(None, (", ".join(RULES), did_you_mean(name, RULES))))
        raise TraceError(Problem("unknown_rule", "unknown rule", found=name, allowed=hint))
    rule = RULES[name]
    if unknown := sorted(set(parameters or {}) - set(rule.parameters)):
        allowed = ", ".join(rule.parameters) or "none"
        raise TraceError(Problem("unknown_parameter", f"not in rule {name}", found=", ".join(unknown), allowed=allowed))
    return replace(rule, parameters={**rule.parameters, **(parameters or {})})
