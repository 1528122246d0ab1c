"""The laws of the contact of a slider, in one table. A new law: its function and a record in SLIDER_LAWS.

A law turns its parameters and the normal load into a contact. There are three kinds: a friction force that depends on
the slip since the slider last stuck (:class:`SlipContact`, whose motion has a closed form), on the speed
(:class:`SpeedContact`), and on speed and state (:class:`StateContact`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem
from tribo.laws import Parameter
from tribo.records import FloatArray
from tribo.user_text import did_you_mean

Values = Mapping[str, Any]


@dataclass(frozen=True)
class SlipContact:
    """Friction that is piecewise linear in the slip s since the slider last stuck, and constant beyond the last point.

    ``slip_m`` and ``sliding_N`` (n,) are the points; the first slip is 0. A slider that has been stuck for a time t
    starts to slide at ``static_N + growth_N ln(1 + t / growth_time_s)``. ``viscous_N_s_per_m`` times the speed adds to
    sliding friction.
    """

    static_N: float
    slip_m: tuple[float, ...]
    sliding_N: tuple[float, ...]
    growth_N: float = 0.0
    growth_time_s: float = 1.0
    viscous_N_s_per_m: float = 0.0

    def threshold_N(self, stuck_s: Any) -> Any:
        """Friction force at which a slider stuck for ``stuck_s`` begins to slide, in N."""
        return self.static_N + self.growth_N * np.log1p(stuck_s / self.growth_time_s)

    def threshold_rate_N_per_s(self, stuck_s: Any) -> Any:
        """Growth of the threshold with the time stuck, in N/s."""
        return self.growth_N / (self.growth_time_s + stuck_s)

    def friction_N(self, slip_m: Any, speed_m_s: Any) -> Any:
        """Friction force at a slip and a speed, both counted in the direction of sliding."""
        return np.interp(slip_m, self.slip_m, self.sliding_N) + self.viscous_N_s_per_m * speed_m_s


@dataclass(frozen=True)
class SpeedContact:
    """Friction that depends on the sliding speed: ``sliding_N(speed)``; it begins to slide at ``static_N``."""

    static_N: float
    sliding_N: Callable[[Any], Any]
    slip_m: tuple[float, ...] = (0.0,)

    def threshold_N(self, stuck_s: Any) -> Any:
        return self.static_N + 0.0 * stuck_s

    def threshold_rate_N_per_s(self, stuck_s: Any) -> Any:
        return 0.0 * stuck_s

    def friction_N(self, slip_m: Any, speed_m_s: Any) -> Any:
        return self.sliding_N(speed_m_s)


@dataclass(frozen=True)
class StateContact:
    """Rate and state: mu = mu0 + a ln(v / v0) + sum_i b_i ln(v0 theta_i / Dc_i), with one state for every pair (b, Dc).

    ``ageing``: dtheta/dt = 1 - v theta / Dc (Dieterich); otherwise dtheta/dt = -(v theta / Dc) ln(v theta / Dc)
    (Ruina).
    """

    normal_load_N: float
    mu0: float
    v0_m_s: float
    a: float
    b: tuple[float, ...]
    Dc_m: tuple[float, ...]
    ageing: bool


Contact = SlipContact | SpeedContact | StateContact


@displayed(lambda law: f"{law.name}: {law.formula}")
@dataclass(frozen=True)
class SliderLaw:
    """One friction law of a slider.

    Parameters
    ----------
    name : str
        Its name in LAW.toml.
    formula : str
        The law in symbols.
    parameters : tuple of tribo.laws.Parameter
        Names, symbols, units and physical limits. Those in ``points`` take lists of equal length.
    defaults : mapping of str to float
        Values of the parameters that a law file may leave out.
    contact : function
        ``contact(values, normal_load_N)`` gives the contact that the motion needs.
    source : str
        Where the law stands.
    points : tuple of str
        Parameters that are lists.
    """

    name: str
    formula: str
    parameters: tuple[Parameter, ...]
    contact: Callable[[Values, float], Contact]
    source: str
    defaults: Mapping[str, float] = field(default_factory=dict)
    points: tuple[str, ...] = ()

    @property
    def units(self) -> dict[str, str]:
        """Unit of every parameter by name, "1" where it has none."""
        return {p.name: p.unit or "1" for p in self.parameters}

    def checked(self, given: Values) -> tuple[dict[str, Any], list[Problem]]:
        """The values with defaults filled in, and everything that is wrong with them."""
        known = {p.name: p for p in self.parameters}
        problems = [
            Problem("unknown_key", f"{self.name} has no such parameter", column=name, found=name,
                    allowed=did_you_mean(name, list(known)) or ", ".join(known))
            for name in given if name not in known
        ]  # fmt: skip
        values: dict[str, Any] = {}
        for name, parameter in known.items():
            value = given.get(name, self.defaults.get(name))
            if value is None:
                problems.append(Problem("missing_key", f"{self.name} needs this parameter", column=name))
                continue
            many = isinstance(value, list | tuple)
            parts = list(value) if many else [value]
            if many != (name in self.points) or not parts or not all(_is_number(part) for part in parts):
                wanted = "a list of numbers" if name in self.points else "a number"
                problems.append(Problem("wrong_value", "wrong type of value", column=name, found=str(value),
                                        allowed=wanted))  # fmt: skip
                continue
            if not all(parameter.low <= part <= parameter.high for part in parts):
                problems.append(
                    Problem("out_of_range", "outside its physical limits", column=name, found=str(value),
                            allowed=_limits(parameter))
                )  # fmt: skip
            values[name] = tuple(map(float, parts)) if many else float(value)
        if not problems and self.points:
            problems += _faults_of_points(self.points, values)
        return values, problems


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.floating) and not isinstance(value, bool) and math.isfinite(value)


def _limits(parameter: Parameter) -> str:
    unit = f" {parameter.unit}" if parameter.unit else ""
    if math.isinf(parameter.high):
        return f"at least {parameter.low:g}{unit}"
    return f"{parameter.low:g} to {parameter.high:g}{unit}"


def _faults_of_points(names: tuple[str, ...], values: Values) -> list[Problem]:
    """Points that are no function: lists of different lengths, or a first list that does not rise from zero."""
    slips = values[names[0]]
    if any(len(values[name]) != len(slips) for name in names):
        lengths = ", ".join(f"{name} {len(values[name])}" for name in names)
        return [Problem("wrong_value", "these lists must have the same length", column=names[0], found=lengths)]
    if slips[0] != 0.0 or not all(low < high for low, high in pairwise(slips)):
        return [Problem("wrong_value", "slips must begin with 0 and rise", column=names[0], found=str(slips))]
    return []


def coulomb(values: Values, normal_load_N: float) -> SlipContact:
    """T <= mu_s N at rest, T = mu_d N + eta v while sliding. Coulomb (1785)."""
    return SlipContact(
        values["mu_s"] * normal_load_N, (0.0,), (values["mu_d"] * normal_load_N,),
        viscous_N_s_per_m=values["viscous_N_s_per_m"],
    )  # fmt: skip


def ageing(values: Values, normal_load_N: float) -> SlipContact:
    """T <= (mu_s + b ln(1 + t / t0)) N after a time t at rest, T = mu_d N + eta v while sliding. Dieterich (1972)."""
    sliding = coulomb(values, normal_load_N)
    return SlipContact(
        sliding.static_N, sliding.slip_m, sliding.sliding_N, values["b"] * normal_load_N, values["t0_s"],
        sliding.viscous_N_s_per_m,
    )  # fmt: skip


def adhesion(values: Values, normal_load_N: float) -> SlipContact:
    """T <= mu_s N + tau0_s A at rest, T = mu_d N + tau0_d A + eta v while sliding. Berardo et al. (2019)."""
    area = values["nominal_area_m2"]
    return SlipContact(
        values["mu_s"] * normal_load_N + values["tau0_s_Pa"] * area, (0.0,),
        (values["mu_d"] * normal_load_N + values["tau0_d_Pa"] * area,), viscous_N_s_per_m=values["viscous_N_s_per_m"],
    )  # fmt: skip


def slip_weakening(values: Values, normal_load_N: float) -> SlipContact:
    """T = mu(s) N + eta v, mu piecewise linear in the slip s since the last rest. Bolotskaya and Hager (2022)."""
    sliding = tuple(mu * normal_load_N for mu in values["mu"])
    return SlipContact(sliding[0], values["slip_m"], sliding, viscous_N_s_per_m=values["viscous_N_s_per_m"])


def viscous(values: Values, normal_load_N: float) -> SlipContact:
    """T = eta v, whatever the load; there is no force at rest."""
    return SlipContact(0.0, (0.0,), (0.0,), viscous_N_s_per_m=values["viscous_N_s_per_m"])


def stribeck(values: Values, normal_load_N: float) -> SpeedContact:
    """T = (mu_d + (mu_s - mu_d) exp(-(v / v_s)^n)) N + eta v; mu_s N at rest. Bo and Pavelescu (1982)."""
    mu_s, mu_d, v_s, n = (values[name] for name in ("mu_s", "mu_d", "v_s_m_s", "exponent"))
    eta = values["viscous_N_s_per_m"]

    def sliding_N(speed_m_s: Any) -> Any:
        fast = np.maximum(speed_m_s, 0.0)
        return (mu_d + (mu_s - mu_d) * np.exp(-((fast / v_s) ** n))) * normal_load_N + eta * speed_m_s

    return SpeedContact(mu_s * normal_load_N, sliding_N)


def _rate_and_state(values: Values, normal_load_N: float, ageing: bool) -> StateContact:
    second = values["b2"] != 0.0
    return StateContact(
        normal_load_N, values["mu0"], values["v0_m_s"], values["a"],
        (values["b"], values["b2"]) if second else (values["b"],),
        (values["Dc_m"], values["Dc2_m"]) if second else (values["Dc_m"],), ageing,
    )  # fmt: skip


def dieterich(values: Values, normal_load_N: float) -> StateContact:
    """mu = mu0 + a ln(v/v0) + b ln(v0 theta/Dc), dtheta/dt = 1 - v theta/Dc. Dieterich (1979), Ruina (1983)."""
    return _rate_and_state(values, normal_load_N, ageing=True)


def ruina(values: Values, normal_load_N: float) -> StateContact:
    """mu = mu0 + a ln(v/v0) + b ln(v0 theta/Dc), dtheta/dt = -(v theta/Dc) ln(v theta/Dc). Ruina (1983)."""
    return _rate_and_state(values, normal_load_N, ageing=False)


_SMALLEST = 1e-12
_MU_S = Parameter("mu_s", "μ_s", "", "static friction coefficient", low=0.0)
_MU_D = Parameter("mu_d", "μ_d", "", "sliding friction coefficient", low=0.0)
_VISCOUS = Parameter("viscous_N_s_per_m", "η", "N s/m", "viscous friction: force per sliding speed", low=0.0)
_NOT_VISCOUS = {"viscous_N_s_per_m": 0.0}
_STATE = (
    Parameter("mu0", "μ₀", "", "friction coefficient of steady sliding at v0", low=0.0),
    Parameter("v0_m_s", "v₀", "m/s", "reference speed", low=_SMALLEST),
    Parameter("a", "a", "", "direct effect of speed", low=_SMALLEST),
    Parameter("b", "b", "", "effect of the state"),
    Parameter("Dc_m", "D_c", "m", "slip over which the state changes", low=_SMALLEST),
    Parameter("b2", "b₂", "", "effect of a second state; 0, there is none"),
    Parameter("Dc2_m", "D_c2", "m", "slip over which the second state changes", low=_SMALLEST),
)
_ONE_STATE = {"b2": 0.0, "Dc2_m": 1e-5}
BOLOTSKAYA = "Bolotskaya and Hager, Bull. Seismol. Soc. Am. (2022), doi:10.1785/0120220052"
RUINA = "Ruina, J. Geophys. Res. 88 (1983) 10359, doi:10.1029/JB088iB12p10359"

SLIDER_LAWS: dict[str, SliderLaw] = {
    law.name: law
    for law in (
        SliderLaw(
            "coulomb", "T ≤ μ_s N at rest; T = μ_d N + η v", (_MU_S, _MU_D, _VISCOUS), coulomb,
            "Coulomb, Théorie des machines simples (1785)", _NOT_VISCOUS,
        ),
        SliderLaw(
            "ageing", "T ≤ (μ_s + b ln(1 + t/t₀)) N after a time t at rest; T = μ_d N + η v",
            (
                _MU_S, _MU_D, Parameter("b", "b", "", "growth of static friction per e-fold of the time at rest", 0.0),
                Parameter("t0_s", "t₀", "s", "time at rest from which on static friction grows", _SMALLEST), _VISCOUS,
            ),
            ageing, "Dieterich, J. Geophys. Res. 77 (1972) 3690, doi:10.1029/JB077i020p03690", _NOT_VISCOUS,
        ),
        SliderLaw(
            "slip_weakening", "T = μ(s) N + η v, μ piecewise linear in the slip s since the last rest",
            (
                Parameter("slip_m", "s", "m", "slips at which the slope changes, from 0", low=0.0),
                Parameter("mu", "μ", "", "friction coefficient at these slips; the last holds beyond", 0.0), _VISCOUS,
            ),
            slip_weakening, BOLOTSKAYA, _NOT_VISCOUS, ("slip_m", "mu"),
        ),
        SliderLaw(
            "stribeck", "T ≤ μ_s N at rest; T = (μ_d + (μ_s − μ_d) exp(−(v/v_s)ⁿ)) N + η v",
            (
                _MU_S, _MU_D, Parameter("v_s_m_s", "v_s", "m/s", "speed over which friction changes", _SMALLEST),
                Parameter("exponent", "n", "", "sharpness of the change", low=0.1, high=10.0), _VISCOUS,
            ),
            stribeck, "Bo and Pavelescu, Wear 82 (1982) 277, doi:10.1016/0043-1648(82)90223-X",
            {**_NOT_VISCOUS, "exponent": 1.0},
        ),
        SliderLaw(
            "viscous", "T = η v", (_VISCOUS,), viscous, "Newton, Principia, book II (1687)",
        ),
        SliderLaw(
            "adhesion", "T ≤ μ_s N + τ_s A at rest; T = μ_d N + τ_d A + η v",
            (
                _MU_S, _MU_D, Parameter("tau0_s_Pa", "τ_s", "Pa", "adhesion per nominal area at rest", low=0.0),
                Parameter("tau0_d_Pa", "τ_d", "Pa", "adhesion per nominal area while sliding", low=0.0),
                Parameter("nominal_area_m2", "A", "m^2", "nominal area", low=0.0), _VISCOUS,
            ),
            adhesion, "Berardo et al., Materials & Design 181 (2019) 107930, doi:10.1016/j.matdes.2019.107930",
            _NOT_VISCOUS,
        ),
        SliderLaw(
            "dieterich", "T/N = μ₀ + a ln(v/v₀) + b ln(v₀θ/D_c), dθ/dt = 1 − vθ/D_c", _STATE, dieterich,
            f"Dieterich, J. Geophys. Res. 84 (1979) 2161, doi:10.1029/JB084iB05p02161; {RUINA}", _ONE_STATE,
        ),
        SliderLaw(
            "ruina", "T/N = μ₀ + a ln(v/v₀) + b ln(v₀θ/D_c), dθ/dt = −(vθ/D_c) ln(vθ/D_c)", _STATE, ruina, RUINA,
            _ONE_STATE,
        ),
    )
}  # fmt: skip
"""Every law of a slider by name."""


def steady_friction(contact: StateContact, speed_m_s: FloatArray | float) -> Any:
    """Friction coefficient of steady sliding, mu0 + (a - sum b) ln(v / v0)."""
    return contact.mu0 + (contact.a - sum(contact.b)) * np.log(np.asarray(speed_m_s) / contact.v0_m_s)
