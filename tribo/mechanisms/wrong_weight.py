"""One of the weights is not what it says: all pulls under it have another load."""

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
    StringArray,
    Values,
    amplitude,
)

# Of three loads any one may be wrong: what is not on the line through the other two is the same for all of them.
FEWEST_LOADS, MOST_LOADS = 4, 12


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """N -> N + e W in both regimes for the tests of one weight W; ``values`` = [e], ``choice`` is "mass 50 g"."""
    off = values[0] * conditions.weight_N * (steps(conditions) == choice)
    return base.forces(np.maximum(conditions.normal_load_N + off, 0.0))


def steps(conditions: Conditions) -> StringArray:
    """The step of the load of every test: the mass on the slider where it is stated, else the normal load."""
    if len(conditions.mass_kg) and np.isfinite(conditions.mass_kg).all():
        return np.array([f"mass {1e3 * mass:.6g} g" for mass in conditions.mass_kg])
    return np.array([f"load {load:.4g} N" for load in conditions.normal_load_N])


def choices(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """Every step of the load, where there are four to twelve."""
    _, first = np.unique(conditions.normal_load_N.round(9), return_index=True)
    found = dict.fromkeys(steps(conditions)[first].tolist())
    return tuple(found) if FEWEST_LOADS <= len(found) <= MOST_LOADS else ()


def on_test(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """The share of the whole load that is missing or added; None at the other steps."""
    if steps(conditions)[test] != choice:
        return None
    return np.array([values[0] * conditions.weight_N[test] / conditions.normal_load_N[test]]), ""


def in_one_run(conditions: Conditions) -> str:
    """The only load."""
    return str(steps(conditions)[0])


def remedy(choice: str) -> str:
    """What to weigh."""
    quantity, _, size = choice.partition(" ")
    return f"Weigh the {size} weight." if quantity == "mass" else f"Weigh all that makes the load of {size}."


MECHANISM = Mechanism(
    name="wrong_weight",
    kind="bookkeeping",
    formula="N -> N + e W at one step of the load, W its weight",
    parameters=(amplitude("e", "", -0.9, 2.0, 0.1, "share of the weight that was not counted"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="normal force of the blocks, at one step of the load",
    shows="all samples differ at one step of the load alone, in both regimes as under another load",
    confused_with="a friction law that bends at this load",
    separates="weigh every weight, and repeat this step with another one",
    silenced_by=("weigh every weight",),
    choices=choices,
    plain="a wrong weight",
    meaning="one of the weights is not what it says",
    choosing=Choosing(column="normal_load_N", on_test=on_test, in_one_run=in_one_run, remedy=remedy),
    measurement=DirectMeasurement("Weigh every weight.", 0.002, 0.25),
    in_table=InTable(missing="no single weights are printed"),
)
