"""Tests whose forces were evaluated elsewhere: they have no trace, and their forces are taken as they stand."""

from __future__ import annotations

import math

from tribo.records import Pull, Test

RULE = "given"
FLAG = "evaluated_elsewhere"


def evaluated_pull(test: Test) -> Pull | None:
    """The forces of a row of tests.csv without an export as a pull; None for a test with an export."""
    forces = test.evaluated
    if forces is None:
        return None
    nothing = math.nan
    return Pull(
        test_id=test.test_id,
        rule=RULE,
        static_N=forces.static_N,
        static_u_N=forces.static_u_N,
        sliding_N=forces.sliding_N,
        sliding_u_N=forces.sliding_u_N,
        zero_N=0.0,
        zero_u_N=0.0,
        onset_s=nothing,
        peak_s=nothing,
        window_s=(nothing, nothing),
        flags=(FLAG, "no_static") if math.isnan(forces.static_N) else (FLAG,),
    )
