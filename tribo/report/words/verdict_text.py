"""A verdict, and what a planned design can tell, in words for a terminal."""

from __future__ import annotations

from tribo.diagnose.plan import Plan
from tribo.diagnose.verdict import Verdict
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
    """What a design finds nine times in ten, mechanism by mechanism, and what it cannot part or show."""
    shown = [f for f in plan.findings if not f.why]
    lines = [f"{plan.n_tests} planned tests. Found nine times in ten, the easiest first:"]
    for f in shown:
        size = f"{f.amplitude:.3g} {f.unit}".rstrip()
        tie = f"; looks like {', '.join(f.confused_with)} here: {f.separates}" if f.confused_with else ""
        lines.append(f"  {f.mechanism}: from {size}, {f.effect_percent:.0f} % of T from end to end{tie}")
    lines += [f"  {f.mechanism}: cannot be told from this design ({f.why})" for f in plan.findings if f.why]
    return "\n".join(lines)
