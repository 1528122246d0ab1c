"""The first pulls of a specimen differ: wear-in, transfer films."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import (
    ALONG_RECORDS,
    Base,
    Conditions,
    Forces,
    InTable,
    Mechanism,
    MechanismParameter,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = T_b (1 + c exp(-n / n_0)), n the pulls the specimen has already made; ``values`` = [c, n_0]."""
    before = base.forces(conditions.normal_load_N)
    gain = 1.0 + values[0] * np.exp(-(conditions.specimen_run - 1.0) / values[1])
    return Forces(before.static_N * gain, before.sliding_N * gain)


MECHANISM = Mechanism(
    name="run_in",
    kind="interface",
    formula="T = T_b (1 + c exp(-n / n_0))",
    parameters=(
        amplitude("c", "", -0.8, 3.0, 0.2, "excess of the first pull"),
        MechanismParameter("n0", "pulls", 0.5, 40.0, 6.0, "pulls over which it fades", tries=(2.0, 20.0)),
    ),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="block thresholds, by the number of the pull on this specimen",
    shows="T follows the order of the pulls of a specimen, the same on all samples",
    confused_with="drift of the load cell",
    separates="use a fresh specimen in the middle of the series",
    silenced_by=("use a fresh specimen in the middle of the series",),
    needs=("specimen_run",),
    plain="run-in",
    meaning="the first pulls of a specimen differ from the later ones",
    in_table=InTable(missing="the order of the pulls is not printed"),
    without_model=("specimen_run", ALONG_RECORDS),
)
