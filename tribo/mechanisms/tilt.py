"""The moment of the friction force lifts the trailing edge."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    DirectMeasurement,
    Forces,
    Mechanism,
    Placement,
    Values,
    amplitude,
)
from tribo.records import FloatArray

HEIGHTS = (0.01, 0.02, 0.04, 0.08)
LIFTED_SHARE = 1e-6  # left on a block that the tilt has lifted, so that it keeps a threshold
MOST_ECCENTRIC = 0.49  # lengths; at half a length the sample stands on its edge


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """The wire at height h over a sled of length L moves the load by e = (T / N) h / L of the length.

    Beyond e = 1/6 only the share 3 (1/2 - e) of the length stays in contact and adheres:
    T = mu N + tau0 A min(1, 3 (1/2 - e)), solved for T. ``values`` = [h / L].
    """
    load = conditions.normal_load_N
    return Forces(
        _tilted(values[0], base.static_mu * load, base.static_adhesion_N, load),
        _tilted(values[0], base.sliding_mu * load, base.sliding_adhesion_N, load),
    )


def _tilted(height: float, friction_N: FloatArray, adhesion_N: FloatArray, load_N: FloatArray) -> FloatArray:
    upright = friction_N + adhesion_N
    part = (friction_N + 1.5 * adhesion_N) / (1.0 + 3.0 * adhesion_N * height / load_N)
    lifted = upright * height / load_N > 1.0 / 6.0
    return np.where(lifted, np.clip(part, friction_N, upright), upright)


def along(values: Values, ratio: float, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Load and adhesion of blocks at ``place`` along the pull, for T/N = ``ratio``."""
    return uneven(float(values[0]) * ratio, place)


def uneven(eccentricity: float, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Load linear along the pull, its resultant off the middle by so many lengths of the sample, and the adhesion.

    Beyond a sixth the trailing edge lifts: it carries nothing and no longer adheres.
    """
    if eccentricity <= 1.0 / 6.0:
        return 1.0 + 12.0 * eccentricity * place, np.ones_like(place)
    start = 0.5 - 3.0 * (0.5 - min(eccentricity, MOST_ECCENTRIC))
    return np.maximum(place - start, LIFTED_SHARE), (place > start).astype(float)


MECHANISM = Mechanism(
    name="tilt",
    kind="instrument",
    formula="tau0 A -> tau0 A min(1, 3 (1/2 - (T / N) h / L))",
    parameters=(  # nothing happens below e = 1/6, so that a fit has to start from several heights
        amplitude("h_over_L", "", 0.0, 0.3, 0.02, "height of the wire over length of the sled", HEIGHTS),
    ),
    law=law,
    sign=-1,
    regimes=("static", "sliding"),
    enters="normal force of the blocks, linear along the pull",
    quick_error=0.4,  # the light edge also slips first, which the law leaves out: static friction is 14 to 35 % lower
    shows="lower T, most at small load and large T/N",
    confused_with="pressure-dependent friction",
    separates="lower the wire to the height of the interface",
    silenced_by=("lower the wire to the height of the interface",),
    removed_by="lower the wire to the height of the interface",
    needs=("normal_load_N",),
    plain="a tilt of the sled",
    meaning="the pull tips the sled, which relieves its trailing edge",
    placement=Placement(along=along, own_friction=True),
    measurement=DirectMeasurement("Measure the height of the wire over the interface.", 0.002, 0.25),
)
