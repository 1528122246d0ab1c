"""The true area fraction of one pattern differs from the nominal one (moulding, etching)."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Choosing,
    Conditions,
    DirectMeasurement,
    Forces,
    InTable,
    Mechanism,
    OnTest,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """tau0 A of one pattern scales with its area fraction; ``values`` = [dAF], ``choice`` names the pattern."""
    here = conditions.pattern == choice
    scale = 1.0 + np.where(here, np.maximum(values[0] / conditions.area_fraction, -0.95), 0.0)
    load = conditions.normal_load_N
    return Forces(
        base.static_mu * load + base.static_adhesion_N * scale,
        base.sliding_mu * load + base.sliding_adhesion_N * scale,
    )


def patterns(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """Every pattern with cavities."""
    return tuple(sorted(set(conditions.pattern[conditions.area_fraction < 1.0].tolist())))


def on_test(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """None on other patterns."""
    return (values, "") if str(conditions.pattern[test]) == choice else None


def in_one_run(conditions: Conditions) -> str:
    """The pattern of the sample."""
    return str(conditions.pattern[0])


MECHANISM = Mechanism(
    name="pattern_geometry",
    kind="pattern",
    formula="tau0 A of one pattern scales by 1 + dAF / AF",
    parameters=(amplitude("dAF", "", -0.5, 0.5, 0.1, "true minus nominal area fraction"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="mask of one pattern",
    shows="one pattern differs at all loads, most at low load",
    confused_with="a batch of specimens",
    separates="measure the area fraction under a microscope",
    silenced_by=("measure the area fraction under a microscope",),
    needs=("area_fraction",),
    choices=patterns,
    plain="a wrong area fraction",
    meaning="the area fraction of one pattern differs from the stated one",
    choosing=Choosing(on_test=on_test, in_one_run=in_one_run, held_out="loads"),
    measurement=DirectMeasurement("Measure the area fraction of the pattern under a microscope.", 0.02, 1.0),
    in_table=InTable(
        barred="Fig. 1 of the paper shows the cavities as designed, and S would need an area fraction lower by 0.5"
    ),
)
