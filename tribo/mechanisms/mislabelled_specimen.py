"""A specimen is not the sample its label says, or two specimens were swapped."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude

BEHAVES = " behaves as "
SWAPPED = " swapped with "


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """The tests of one specimen follow another sample, or those of two specimens each other's.

    ``choice`` is "S2 of Sx behaves as Sy" or "B2 of B swapped with C1 of C"; ``values`` = [share] moves ln T
    from the label (0) to the other sample (1).
    """
    before = base.forces(conditions.normal_load_N)
    static, sliding = before.static_N, before.sliding_N
    for specimen, label, other in moves(choice):
        after = base.as_sample(other).forces(conditions.normal_load_N)
        share = np.where((conditions.specimen == specimen) & (conditions.sample == label), values[0], 0.0)
        static = static * (after.static_N / before.static_N) ** share
        sliding = sliding * (after.sliding_N / before.sliding_N) ** share
    return Forces(static, sliding)


def moves(choice: str) -> tuple[tuple[str, str, str], ...]:
    """(specimen, its label, what it behaves as) for each specimen a choice speaks of."""
    if BEHAVES in choice:
        who, other = choice.split(BEHAVES)
        specimen, label = who.split(" of ")
        return ((specimen, label, other),)
    (first, a), (second, b) = (who.split(" of ") for who in choice.split(SWAPPED))
    return (first, a, b), (second, b, a)


def choices(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """Every specimen under every other label of the campaign, and every swap of two specimens."""
    made = sorted(set(zip(conditions.specimen.tolist(), conditions.sample.tolist(), strict=True)))
    labels = sorted({label for _, label in made})
    alone = [
        f"{specimen} of {label}{BEHAVES}{other}" for specimen, label in made for other in labels if other != label
    ]
    swaps = [f"{p} of {a}{SWAPPED}{q} of {b}" for (p, a), (q, b) in combinations(made, 2) if a != b]
    return (*alone, *swaps)


MECHANISM = Mechanism(
    name="mislabelled_specimen",
    kind="bookkeeping",
    formula="ln T of a specimen moves to that of another sample",
    parameters=(amplitude("share", "", 0.0, 1.5, 1.0, "0 as labelled, 1 as the other sample"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="the mask of one specimen",
    shows="one specimen against its siblings, fits another label",
    confused_with="a batch of specimens",
    separates="look at the specimen under a microscope",
    silenced_by=("look at the specimen under a microscope",),
    choices=choices,
)
