"""A verdict, and what a planned design can tell, in words for a terminal."""

from __future__ import annotations

from tribo.diagnose.plan import Plan
from tribo.diagnose.verdict import Cause, Verdict
from tribo.report.numerals import significant


def verdict_text(verdict: Verdict) -> str:
    """The verdict, its causes with intervals, what else was excluded or tied, the gain and the next test."""
    lines = [f"{verdict.verdict.upper()}: {verdict.text}"]
    lines += [f"  misfit: {m.text}" for m in verdict.misfits]
    lines += [f"  cause: {_cause_line(c)}" for c in verdict.causes]
    lines += [f"  cannot be parted by this design: {', '.join(names)}" for names in verdict.equivalent]
    if verdict.gain is not None:
        gain = verdict.gain
        lines.append(
            f"  gain on {gain.held_out} not seen: {gain.difference:.2f} +- {gain.se:.2f} in log score a test, "
            f"RMSE {gain.rmse_percent_before:.1f} % before, {gain.rmse_percent_after:.1f} % after"
        )
    if verdict.next_test is not None:
        lines.append(f"  next test: {verdict.next_test.text}")
    return "\n".join(lines)


def _cause_line(cause: Cause) -> str:
    values = ", ".join(
        f"{name} = {significant(e.value)} ({significant(e.low)} to {significant(e.high)}) {e.unit}".rstrip()
        for name, e in cause.parameters.items()
    )
    return f"{cause.text} [{cause.mechanism}, weight {cause.weight:.2f}; 90 %: {values}]"


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
