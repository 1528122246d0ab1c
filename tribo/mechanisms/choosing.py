"""What a mechanism needs besides numbers: which specimen, which pattern, which column."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from tribo.display import displayed
from tribo.mechanisms.conditions import Base, Conditions, Values


@displayed()
@dataclass(frozen=True)
class OnTest:
    """How a mechanism acts on one test: its values there, and the sample that takes the place of the labelled one."""

    values: Values
    other_sample: str = ""


def no_choice(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """A mechanism without variants."""
    return ("",)


def same_on_every_test(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """The values of the campaign."""
    return OnTest(values)


def nothing_to_choose(conditions: Conditions) -> str:
    """In one run there is no choice."""
    return ""


def unnamed(choice: str) -> str:
    """A verdict calls the mechanism by its name alone."""
    return ""


def one_part(choice: str) -> tuple[str, ...]:
    """A choice stands for itself."""
    return (choice,)


@displayed()
@dataclass(frozen=True)
class Choosing:
    """What the choices of a mechanism mean.

    Parameters
    ----------
    label
        What a verdict appends to the name, as in ``covariate:operator``.
    column
        The recorded column that the mechanism follows; empty: the choice itself, or the columns it needs.
    level
        The one name of a column of several that a choice concerns; empty: the whole column.
    on_test
        How it acts on the test of an index; None where the choice does not concern that test.
    in_one_run
        The choice in a single run of the simulator.
    held_out
        What cross-validation leaves out. "samples": whole samples, or specimens where there are fewer than four
        samples. "loads": whole loads, for a choice that cannot be learned from other samples or specimens.
    parts
        The choices whose changes of ln T, each on tests of its own, add up to that of a choice; the choice itself by
        default.
    all_or_nothing_sd
        Standard deviation of the amplitude around its start value, where the effect is present as a whole or absent.
    """

    label: Callable[[str], str] = unnamed
    column: str = ""
    level: Callable[[str], str] = unnamed
    on_test: Callable[[Values, str, Conditions, int], OnTest | None] = same_on_every_test
    in_one_run: Callable[[Conditions], str] = nothing_to_choose
    held_out: Literal["samples", "loads"] = "samples"
    parts: Callable[[str], tuple[str, ...]] = one_part
    all_or_nothing_sd: float | None = None


NO_CHOICE = Choosing()
