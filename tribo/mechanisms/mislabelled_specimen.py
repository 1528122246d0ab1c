"""A specimen is not the sample its label says, or two specimens were swapped."""

from __future__ import annotations

from itertools import combinations

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
    Placement,
    Values,
    amplitude,
)
from tribo.records import FloatArray

BEHAVES = " behaves as "
SWAPPED = " swapped with "
AND = " and "  # a specimen that is pulled in two directions has two labels
LEAST_N = 1e-9


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """The tests of one specimen follow another sample, or those of two specimens each other's.

    ``choice`` is "S2 of Sx behaves as Sy", "S2 of Sx and Sy behaves as B" or "B2 of B swapped with C1 of C";
    ``values`` = [share] moves ln T from the label (0) to the other sample (1).
    """
    before = base.forces(conditions.normal_load_N)
    static, sliding = before.static_N, before.sliding_N
    for specimen, label, other in moves(choice):
        after = base.as_sample(other).forces(conditions.normal_load_N)
        share = np.where((conditions.specimen == specimen) & (conditions.sample == label), values[0], 0.0)
        static = static * _ratio(after.static_N, before.static_N) ** share
        sliding = sliding * _ratio(after.sliding_N, before.sliding_N) ** share
    return Forces(static, sliding)


def _ratio(after_N: FloatArray, before_N: FloatArray) -> FloatArray:
    return np.maximum(after_N, LEAST_N) / np.maximum(before_N, LEAST_N)


def moves(choice: str) -> tuple[tuple[str, str, str], ...]:
    """(specimen, its label, what it behaves as) for each specimen and label in a choice.

    Of a specimen with two labels that was swapped, the other one takes the first.
    """
    if BEHAVES in choice:
        who, other = choice.split(BEHAVES)
        specimen, labels = _who(who)
        return tuple((specimen, label, other) for label in labels)
    (first, a), (second, b) = (_who(who) for who in choice.split(SWAPPED))
    return (*((first, label, b[0]) for label in a), *((second, label, a[0]) for label in b))


def _who(text: str) -> tuple[str, list[str]]:
    specimen, labels = text.split(" of ")
    return specimen, labels.split(AND)


def choices(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """Every specimen under every other label of the campaign, and every swap of two specimens."""
    made = sorted(set(zip(conditions.specimen.tolist(), conditions.sample.tolist(), strict=True)))
    labels = sorted({label for _, label in made})
    whole = _whole(made)
    alone = [f"{p} of {a}{BEHAVES}{other}" for p, a in made for other in labels if other != a]
    alone += [
        f"{p} of {AND.join(a)}{BEHAVES}{other}" for p, a in whole if len(a) > 1 for other in labels if other not in a
    ]
    swaps = [f"{p} of {a}{SWAPPED}{q} of {b}" for (p, a), (q, b) in combinations(made, 2) if a != b]
    several = [
        f"{p} of {AND.join(turned)}{SWAPPED}{q} of {AND.join(b)}"
        for (p, a), (q, b) in combinations(whole, 2)
        if len(a) + len(b) > 2 and not set(a) & set(b)
        for turned in ((a, a[::-1]) if len(a) > 1 else (a,))
    ]
    return (*alone, *swaps, *several)


def _whole(made: list[tuple[str, str]]) -> list[tuple[str, list[str]]]:
    """Specimens with all their labels, those of several labels first."""
    labels: dict[str, list[str]] = {}
    for specimen, label in made:
        labels.setdefault(specimen, []).append(label)
    return sorted(labels.items(), key=lambda item: (-len(item[1]), item[0]))


def parts(choice: str) -> tuple[str, ...]:
    """Of two specimens that were swapped, what each of them behaves as; two labels of one specimen stay together."""
    if BEHAVES in choice:
        return (choice,)
    (first, a), (second, b) = (_who(who) for who in choice.split(SWAPPED))
    if first == second:
        return (choice,)
    return (f"{first} of {AND.join(sorted(a))}{BEHAVES}{b[0]}", f"{second} of {AND.join(sorted(b))}{BEHAVES}{a[0]}")


def on_test(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """The sample that the specimen of a test really is; None where its label is right."""
    here = (str(conditions.specimen[test]), str(conditions.sample[test]))
    other = next((other for specimen, label, other in moves(choice) if (specimen, label) == here), None)
    return None if other is None else (values, other)


MECHANISM = Mechanism(
    name="mislabelled_specimen",
    kind="bookkeeping",
    formula="ln T of a specimen moves to that of another sample",
    parameters=(amplitude("share", "", 0.0, 1.5, 1.0, "0 as labelled, 1 as the other sample"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="mask of one specimen",
    shows="one specimen differs from the others of its sample and agrees with another label",
    confused_with="a specimen from a different batch",
    separates="look at the specimen under a microscope",
    silenced_by=("look at the specimen under a microscope",),
    choices=choices,
    plain="a mislabelled specimen",
    meaning="a specimen rubs like another sample than the one on its label",
    choosing=Choosing(column="specimen", on_test=on_test, held_out="loads", parts=parts, all_or_nothing_sd=0.15),
    placement=Placement(other_sample=True),
    measurement=DirectMeasurement("Look at the specimens under a microscope.", 0.1, 0.5),
    in_table=InTable(missing="no specimens are printed"),
)
