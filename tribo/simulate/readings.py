"""Named readings of the text of Berardo et al. (2019): what each sets where the text leaves a choice.

"text" is the letter of the paper, with the choices of docs/concepts/model.md where it is silent. "berardo2019" is the
set that comes closest to the simulated column of its Table 2 (docs/results/table2-search.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

OPEN_CHOICES: dict[str, Any] = {
    "thickness_m": None,
    "block_mass": "layer",
    "shear_factor": 1.0,
    "normal_force": "redistributed",
    "edges": "free",
    "pattern_first": None,
    "restrengthening": 1.0,
    "sticking": "turned",
    "stick_interval_s": None,
}
"""What the text leaves open and changes a run, with the values of the reading "text"."""

READINGS: dict[str, dict[str, Any]] = {"text": {}, "berardo2019": {"thickness_m": 8.5e-6, "restrengthening": 0.3}}
"""Fields of :class:`tribo.simulate.SimConfig` that each reading sets; the rest is as in "text"."""

ANGLES: dict[str, str] = {"text": "midpoints", "berardo2019": "nominal"}
"""The law of the pull angle of each reading, as :func:`tribo.simulate.stratified_design` takes it."""


def reading_of(choices: Mapping[str, Any]) -> str:
    """The name of the reading with these values of the open choices, "own" where none has them."""
    for name, changes in READINGS.items():
        if all(choices[key] == value for key, value in (OPEN_CHOICES | changes).items()):
            return name
    return "own"
