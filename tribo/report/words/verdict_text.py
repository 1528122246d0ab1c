"""Terminal output of a verdict and of the assessment of a planned design."""

from __future__ import annotations

from tribo.diagnostics.planning import Plan
from tribo.diagnostics.terms import name_in_words
from tribo.diagnostics.verdict import Verdict
from tribo.report.verdict_file import verdict_in_words


def verdict_text(verdict: Verdict) -> str:
    """The verdict as the report words it: outcome, misfits, causes with intervals, ties, gain and next test."""
    words = verdict_in_words(verdict.as_dict())
    lines = [f"{words['outcome']} {words['text']}"]
    lines += [f"  misfit: {misfit['text']}" for misfit in words["misfits"]]
    lines += [f"  cause, weight {c['weight']}: {c['text']}" for c in words["causes"]]
    lines += [f"  {tie}" for tie in words["equivalent"]]
    lines += [f"  {words['gain']}"] if words["gain"] else []
    lines += [f"  next test: {words['next_test']}"] if words["next_test"] else []
    return "\n".join(lines)


def plan_text(plan: Plan) -> str:
    """The effect of each mechanism that a design detects with 90 % probability, and what it cannot distinguish."""
    shown = [f for f in plan.findings if not f.why]
    lines = [f"{plan.n_tests} planned tests. Smallest effects detected with 90 % probability, easiest first:"]
    for f in shown:
        name, size = name_in_words(f.mechanism), f"{f.amplitude:.3g} {f.unit}".rstrip()
        names = ", ".join(name_in_words(name) for name in f.confused_with)
        tie = f"; not distinguishable from {names}; to separate them: {f.separates}" if names else ""
        lines.append(f"  {name}: {size} or more (changes T by {f.effect_percent:.0f} % over the design){tie}")
    lines += [
        f"  {name_in_words(f.mechanism)}: not detectable with this design ({f.why})" for f in plan.findings if f.why
    ]
    return "\n".join(lines)
