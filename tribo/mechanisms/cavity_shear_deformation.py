"""Long cavities close or open under shear, so that friction depends on the pull direction."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    Forces,
    InTable,
    Mechanism,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = T_b exp(d e), e = ln(long / short), positive along the long side; ``values`` = [d]."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(values[0] * conditions.elongation)
    return Forces(before.static_N * gain, before.sliding_N * gain)


def finding(
    gains: Sequence[float], sizes: Sequence[float], limit: Callable[[], float], flat_traction_Pa: float
) -> str:
    """What the table says about a difference between the pull directions."""
    low, high = min(gains), max(gains)
    return (
        f"Deformed patterns are {'supported' if low > 3.0 else 'possible'}: friction that differs along and across the "
        f"long cavities of S earns {low:.1f} to {high:.1f} units of log likelihood over these readings."
    )


MECHANISM = Mechanism(
    name="cavity_shear_deformation",
    kind="pattern",
    formula="T = T_b exp(d e), e = +-ln(long / short)",
    parameters=(amplitude("d", "", -0.6, 0.6, 0.1, "relative change per e-fold of elongation"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="mask: cavity width, by the traction and its direction",
    shows="static and sliding friction differ between Sx and Sy",
    confused_with="a wrong area fraction, or a misaligned pull",
    separates="reverse the pull, and pull at 45 degrees",
    silenced_by=("pull the long cavities at 45 degrees and in reverse",),
    needs=("elongation",),
    plain="deformation of the cavities under shear",
    meaning="long cavities open or close under shear, so that friction depends on the direction of the pull",
    in_table=InTable(
        guess="deformed patterns",
        finding=finding,
        next_test="Pull S along x, along y, in reverse and at 45 degrees, each at three loads: 72 pulls.",
        separates=("cavity_shear_deformation", "pull_angle", "load_cell_offset"),
        design={
            "sample": "S", "direction_deg": [0, 45, 90, 180], "pressure_kPa": [3, 9, 25], "pulls": 72, "hours": 8.4,
        },
    ),
)
