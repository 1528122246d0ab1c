"""Where a mechanism acts in the spring-block model, as data and functions of arrays.

The module :mod:`tribo.mechanisms_in_model` carries the placement out; it needs nothing else of a mechanism.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tribo.display import displayed
from tribo.mechanisms.conditions import Conditions, Values
from tribo.records import FloatArray


@displayed()
@dataclass(frozen=True)
class Contact:
    """The sample in the model: pressure and area fraction, and its own T/N so far, static and sliding."""

    pressure_Pa: float
    area_fraction: float
    static: float = 0.0
    sliding: float = 0.0


Gains = Callable[[Values, Contact], tuple[float, float]]  # static and sliding
Profile = Callable[[Values, float, FloatArray], tuple[FloatArray, FloatArray]]


@displayed()
@dataclass(frozen=True)
class Placement:
    """What a mechanism changes in the model; a field that is not given changes nothing. Gains are 1 at zero amplitude.

    Parameters
    ----------
    by_law
        Every contact block follows the law of the mechanism, with the pressure and the area of the contact.
    thresholds, load
        Gains of the thresholds, and of the normal force, of every block, (static, sliding).
    springs
        Gain of the elastic modulus.
    floors
        Share of the cavity floors that touch down.
    rims
        Static adhesion per rim length, N/m, and the share of it left while sliding; it acts on blocks beside a cavity.
    along
        Normal force and adhesion of every block over their mean, given T/N and the place of the block along the
        pull, from -1/2 (trailing edge) to 1/2, both (n,).
    chain
        Fields of :class:`tribo.virtual_tribometer.measuring_chain.MeasuringChain`, given the recorded conditions.
        Where several mechanisms set the same field, their values add.
    other_sample
        The sample is another one, named in brackets behind the mechanism; the amplitude moves ln T towards it.
    own_friction
        ``load``, ``thresholds`` or ``along`` depend on the friction that they change: runs are repeated until the
        friction stays the same.
    """

    by_law: bool = False
    thresholds: Gains | None = None
    load: Gains | None = None
    springs: Callable[[Values, Conditions], float] | None = None
    floors: Callable[[Values, Conditions], float] | None = None
    rims: Callable[[Values], tuple[float, float]] | None = None
    along: Profile | None = None
    chain: Callable[[Values, Mapping[str, float]], Mapping[str, float]] | None = None
    other_sample: bool = False
    own_friction: bool = False

    @property
    def on_single_blocks(self) -> bool:
        """Whether the position of a block matters."""
        return any(part is not None for part in (self.floors, self.rims, self.along))


BY_LAW = Placement(by_law=True)
