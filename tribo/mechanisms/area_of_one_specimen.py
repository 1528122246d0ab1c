"""One specimen has another contact area than the others of its sample: chipped, cut larger, badly cast."""

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
    """tau0 A -> tau0 A (1 + a) in both regimes on one specimen; ``values`` = [a]."""
    gain = 1.0 + values[0] * (conditions.specimen == choice)
    return Forces(
        base.static_mu * conditions.normal_load_N + base.static_adhesion_N * gain,
        base.sliding_mu * conditions.normal_load_N + base.sliding_adhesion_N * gain,
    )


def choices(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """Every specimen, where there are several."""
    names = np.unique(conditions.specimen)
    return tuple(map(str, names)) if len(names) > 1 else ()


def on_test(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """The same values on the tests of the specimen; None on others."""
    return (values, "") if conditions.specimen[test] == choice else None


def in_one_run(conditions: Conditions) -> str:
    """The only specimen."""
    return str(conditions.specimen[0])


def remedy(choice: str) -> str:
    """What to measure."""
    return f"Measure the contact area of specimen {choice}, and look at its edges."


MECHANISM = Mechanism(
    name="area_of_one_specimen",
    kind="bookkeeping",
    formula="tau0 A -> tau0 A (1 + a) on one specimen",
    parameters=(amplitude("a", "", -0.95, 2.0, 0.2, "relative change of the area that adheres"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="adhesion of the blocks of one specimen",
    shows="one specimen differs from the others of its sample at small loads, and agrees with them at large ones",
    confused_with="a specimen from a different batch",
    separates="measure the area of each specimen",
    silenced_by=("measure the area of each specimen",),
    choices=choices,
    plain="another contact area of one specimen",
    meaning="one specimen is larger or smaller than the others of its sample",
    choosing=Choosing(column="specimen", on_test=on_test, in_one_run=in_one_run, held_out="loads", remedy=remedy),
    measurement=DirectMeasurement("Measure the area of each specimen under a microscope.", 0.02, 0.5),
    in_table=InTable(missing="no specimens are printed"),
)
