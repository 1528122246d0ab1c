"""What a published table of mu and tau0 says about the model, and what it leaves open."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from tribo.berardo2019.table_diagnosis import LEVEL, TableContrast, TableReading
from tribo.berardo2019.table_model import TableFit, estimate_of, upper_limit
from tribo.diagnostics.verdict import Gain, Misfit
from tribo.mechanisms import MECHANISMS
from tribo.vocabulary import OBSERVABLES
from tribo.wording.numerals import p_text, sentence_case

LEAST_ALIKE = 0.6  # correlations above this (less negative) no line over the range of the paper can have


def published_evidence(outlooks: Sequence[TableReading], gain: Gain) -> str:
    """What the numbers say of the explanations of the authors, and of the best extension."""
    return " ".join([*_guesses(outlooks), _extension(outlooks[0], outlooks[0].weighed[0], gain)])


def table_misfit_sentence(m: Misfit) -> str:
    """Whose friction differs from the calibrated model, by how much over the loads of the table and how surely."""
    (low, high), (first_kPa, last_kPa) = m.shows
    whose = m.sample or "the patterned samples together"
    off = f"from {-low:.0f} % below to {high:.0f} % above that"
    if high < 0:
        off = f"{-high:.0f} to {-low:.0f} % below that"
    elif low > 0:
        off = f"{low:.0f} to {high:.0f} % above that"
    return (
        f"{sentence_case(OBSERVABLES[m.observable])} of {whose} is {off} of the calibrated model at {first_kPa:g} to "
        f"{last_kPa:g} kPa (adjusted p {p_text(m.p_adjusted)})."
    )


def _contrast(contrast: TableContrast | str) -> str:
    if isinstance(contrast, str):
        return contrast
    observable, sample, along_load = contrast
    what = "friction" if observable == "both" else OBSERVABLES[observable]
    return f"{what} of {sample}{' against load' if along_load else ''}"


def published_sentence(outlooks: Sequence[TableReading]) -> str:
    """Whether the model of the paper fails, and on what that depends."""
    possible = [o for o in outlooks if o.correlation < -LEAST_ALIKE]
    free = [o for o in outlooks if o.correlation == 0.0 and o.specimens == 1]
    failing = sum(o.p_misfit < LEVEL for o in possible)
    main = outlooks[0]
    verb = "differs" if main.p_misfit < LEVEL else "does not differ"
    text = (
        f"The model calibrated on the flat sample {verb} from Table 2 beyond chance: adjusted p "
        f"{p_text(main.p_misfit)} for a correlation of mu and tau0 of {main.correlation:.2f}, "
        "which loads spread evenly over 3 to 25 "
        f"kPa would give. It differs beyond chance in {failing} of {len(possible)} readings with a correlation that is "
        "possible for a line fit over these loads."
    )
    if free and all(o.p_misfit >= LEVEL for o in free):
        text += (
            " If mu and tau0 were uncorrelated, nothing would be beyond chance: the result depends on their "
            "covariance, which the paper does not print."
        )
    return text


def _guesses(outlooks: Sequence[TableReading]) -> list[str]:
    """What the numbers say of each explanation that the authors propose, and of errors of the instrument instead."""
    possible = [o for o in outlooks if o.correlation < -LEAST_ALIKE]
    main, found = outlooks[0], []
    for name, m in MECHANISMS.items():
        if m.in_table.finding is None:
            continue
        weighed = [next(w for w in o.weighed if w.name == name) for o in possible]
        gains, sizes = [w.gain for w in weighed], [float(w.parameters[0][0]) for w in weighed]
        limit = partial(upper_limit, main.baseline, name)
        found.append(m.in_table.finding(gains, sizes, limit, _flat_traction_Pa(main)))
    return [*found, _adhesion_along_y(outlooks[0]), *_instrument_instead(possible)]


def _instrument_instead(outlooks: Sequence[TableReading]) -> list[str]:
    """In how many readings another mechanism explains more than the authors' explanations."""
    best = [o.weighed[0].mechanism for o in outlooks]
    ahead = [m.in_words for m in best if not m.in_table.guess]
    if not ahead:
        return []
    names = " or ".join(sorted(set(ahead)))
    return [f"In {len(ahead)} of these readings {names} explains more; nothing printed in the paper rules it out."]


def _adhesion_along_y(outlook: TableReading) -> str:
    """The adhesion of S across its long cavities, from the table itself."""
    table = outlook.baseline.table
    i = table.samples.index("Sy")
    measured = table.values.reshape(-1, 2, 2)[i, :, 1]
    sd = np.sqrt(np.diag(table.data_covariance)).reshape(-1, 2, 2)[i, :, 1]
    model = table.shares[i, [1, 3]] * table.values.reshape(-1, 4)[table.samples.index("F"), [1, 3]]
    return (
        f"Across its long cavities S shows hardly any adhesion: tau0 is {measured[0]:.1f} +- {sd[0]:.1f} kPa (static) "
        f"and {measured[1]:.1f} +- {sd[1]:.1f} kPa (sliding); the model gives {model[0]:.1f} and {model[1]:.1f} kPa."
    )


def _flat_traction_Pa(outlook: TableReading) -> float:
    """Static traction of the flat sample at 10 kPa by the calibrated law."""
    table = outlook.baseline.table
    law = table.values.reshape(-1, 4)[table.samples.index("F")]
    return float(law[0] * 10e3 + law[1] * 1e3)


def _extension(main: TableReading, best: TableFit, gain: Gain) -> str:
    """How much the best extended model explains, in the table and on samples left out, and what remains."""
    name, e = next(iter(estimate_of(best).items()))
    before, after = -2 * main.baseline.score, -2 * best.score
    clear = gain.difference > 2 * gain.se
    n = len(main.baseline.table.values)
    text = (
        f"The best extension is {best.mechanism.in_words}, {name} = {e.value:.2g} {e.unit}".rstrip()
        + f" (90 % interval {e.low:.2g} to {e.high:.2g}): chi-squared of the {n} numbers falls "
        f"from {before:.0f} to {after:.0f}. On whole samples left out of the fit its gain is {gain.difference:+.2f} +- "
        f"{gain.se:.2f} in log score per number, which {'is clear' if clear else 'may be chance'}."
    )
    strongest = min(main.contrasts_left, key=lambda contrast: main.contrasts_left[contrast])
    if main.p_left < LEVEL:
        text += (
            f" A misfit remains ({_contrast(strongest)}, adjusted p {p_text(main.p_left)}): no single law of the "
            "library is sufficient."
        )
    rivals = [w.mechanism.in_words for w in main.near if w is not best]
    if rivals:
        text += f" About as well explained by: {', '.join(rivals)}."
    return text
