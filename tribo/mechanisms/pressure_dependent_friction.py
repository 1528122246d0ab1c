"""The friction coefficient falls with the contact pressure."""

from __future__ import annotations

from tribo.mechanisms.record import REFERENCE_PRESSURE_PA, Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """mu(p_c) = mu_0 (p_c / p_0)^-n with p_c = p / AF and p_0 = 10 kPa; ``values`` = [n], dimensionless."""
    gain = (conditions.contact_pressure_Pa / REFERENCE_PRESSURE_PA) ** (-values[0])
    return base.forces(conditions.normal_load_N * gain)


MECHANISM = Mechanism(
    name="pressure_dependent_friction",
    kind="interface",
    formula="mu = mu_0 (p_c / 10 kPa)^-n, p_c = p / AF",
    parameters=(amplitude("n", "", 0.0, 0.8, 0.2, "exponent; 1/3 for Hertz-like contact"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="friction coefficients of the blocks, by the pressure on each",
    shows="T(N) is curved, for static and sliding friction, on the flat sample too",
    confused_with="loss of contact area, or tilt of the sled",
    separates="measure at more loads over a wider range",
    silenced_by=("widen the load range to lower loads",),
    needs=("normal_load_N",),
    plain="pressure-dependent friction",
    meaning="the friction coefficient falls as the contact pressure rises",
)
