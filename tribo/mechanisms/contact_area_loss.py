"""Real contact shrinks under shear (Sahli et al., PNAS 2018)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    Forces,
    InTable,
    Mechanism,
    Placement,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = T_b A_r / A_r0 with A_r = A_r0 (1 - c (T / A_r0)^2) and A_r0 = AF A, solved for T at the peak.

    ``values`` = [c] in 1/Pa2. Contact lost on the way to the peak does not heal while the sled slides, so the
    sliding force carries the same share of lost area.
    """
    before = base.forces(conditions.normal_load_N)
    traction_Pa = before.static_N / (conditions.area_fraction * conditions.nominal_area_m2)
    kept = 2.0 / (1.0 + np.sqrt(1.0 + 4.0 * values[0] * traction_Pa**2))
    return Forces(before.static_N * kept, before.sliding_N * kept)


def area_left(values: Values, pulled: tuple[float, float], traction_Pa: float) -> tuple[float, float]:
    """Share of the contact left at the traction of the peak, 1 - c (T / (AF A))^2, in both regimes."""
    left = float(np.clip(1.0 - values[0] * traction_Pa**2, 0.05, 1.0))
    return left, left


def finding(
    gains: Sequence[float], sizes: Sequence[float], limit: Callable[[], float], flat_traction_Pa: float
) -> str:
    """What the table says about a loss of contact area."""
    lost = 100 * limit() * flat_traction_Pa**2
    return (
        f"A contact area that shrinks with traction is {'not supported' if max(gains) < 3.0 else 'possible'}: "
        f"it would lower the flat sample too, earns at most {max(gains):.1f} units of log likelihood and "
        f"takes at most {lost:.0f} % of the flat contact at 10 kPa (95 %)."
    )


MECHANISM = Mechanism(
    name="contact_area_loss",
    kind="interface",
    formula="T = T_b (1 - c (T / (AF A))^2)",
    parameters=(amplitude("c", "1/Pa2", 0.0, 3e-10, 2e-11, "area lost per squared traction"),),
    law=law,
    sign=-1,
    regimes=("static", "sliding"),
    enters="block thresholds, scaled by the contact that is left at the traction of the peak",
    shows="lower T at high traction, so more on patterns and at high load; T(N) bends",
    confused_with="pressure-dependent friction",
    separates="measure at more low loads, or image the contact",
    silenced_by=("image the contact area under load and shear",),
    needs=("normal_load_N",),
    plain="loss of contact area under shear",
    meaning="the contact shrinks as the shear stress on it grows, so that friction rises less than the load",
    placement=Placement(thresholds=area_left, own_friction=True),
    in_table=InTable(guess="changed contact area", finding=finding),
)
