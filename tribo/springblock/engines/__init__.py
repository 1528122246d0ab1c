"""The engines of the spring-block model, by name. A new one is a module beside this and a line in the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tribo.springblock.config import SimConfig
    from tribo.springblock.engines.state import Thresholds, Trajectory
    from tribo.springblock.lattice import Lattice

    Integrate = Callable[[SimConfig, Lattice, Thresholds, int], Trajectory]
    """One run on at most so many threads, from the first failure to its end; SimulationError where a force is no longer
    finite."""


@dataclass(frozen=True)
class Engine:
    """What an engine can do, and where its ``integrate`` stands; that module is imported at its first run.

    Parameters
    ----------
    module
        Has a function ``integrate(config, lattice, thresholds, threads)`` that returns a Trajectory.
    finite_rotation, friction_terms, sticking_rules, elastic_contact
        Whether it has springs that turn with their ends, friction that changes during a run, rules of sticking
        other than the default, and contact of finite stiffness.
    """

    module: str
    finite_rotation: bool = False
    friction_terms: bool = False
    sticking_rules: bool = False
    elastic_contact: bool = False

    @property
    def integrate(self) -> Integrate:
        function: Integrate = import_module(self.module).integrate
        return function


ENGINES: dict[str, Engine] = {
    "fast": Engine("tribo.springblock.engines.fast", friction_terms=True, elastic_contact=True),
    "reference": Engine(
        "tribo.springblock.engines.reference", finite_rotation=True, sticking_rules=True, elastic_contact=True
    ),
}


def engines_with(ability: str) -> str:
    """The names of the engines that have an ability, for a sentence."""
    return " or ".join(name for name, engine in ENGINES.items() if getattr(engine, ability))
