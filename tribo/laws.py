"""The friction laws tribo fits, in one table. A new law: its two functions, a line in LAWS, an exact-value test."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tribo.display import displayed
from tribo.records import FloatArray


@displayed()
@dataclass(frozen=True)
class Parameter:
    """A parameter of a law. ``low`` and ``high`` are the physical limits, not bounds of a fit."""

    name: str
    symbol: str
    unit: str
    text: str
    low: float = -math.inf
    high: float = math.inf


@displayed()
@dataclass(frozen=True)
class Law:
    """One friction law T(conditions; parameters), T in newton.

    ``conditions`` are the names of the arguments under which it is evaluated, which end in their SI units.
    ``function(*conditions, *parameters)`` returns T; ``gradient`` takes the same arguments and returns
    dT/dparameter, one array per parameter in their order. Both are pure and broadcast. ``linear`` says that
    T is linear in all parameters, so that the gradient is the design matrix of a least-squares fit.
    """

    name: str
    formula: str
    function: Callable[..., Any]
    gradient: Callable[..., tuple[Any, ...]]
    conditions: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    linear: bool
    source: str

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    def force_N(self, conditions: tuple[Any, ...], values: FloatArray) -> FloatArray:
        """T under ``conditions`` (arrays that broadcast) with parameter ``values``, shape (k,)."""
        return np.asarray(self.function(*conditions, *values), float)

    def design_matrix(self, *conditions: Any, at: FloatArray | None = None) -> FloatArray:
        """dT/dparameter as columns, shape (n, k). A law that is not linear needs the values ``at``."""
        values = np.zeros(len(self.parameters)) if at is None else np.asarray(at, float)
        columns = np.broadcast_arrays(*conditions, *self.gradient(*conditions, *values))
        return np.column_stack([np.asarray(c, float) for c in columns[len(conditions) :]])


BERARDO = "Berardo et al., Materials & Design 181 (2019) 107930, doi:10.1016/j.matdes.2019.107930"


def amontons(normal_load_N: Any, mu: Any) -> Any:
    """T = mu N. N in newton, mu dimensionless; regular everywhere. Amontons (1699)."""
    return mu * normal_load_N


def amontons_gradient(normal_load_N: Any, mu: Any) -> tuple[Any]:
    """dT/dmu = N, in newton."""
    return (normal_load_N,)


def coulomb_intercept(normal_load_N: Any, mu: Any, T0_N: Any) -> Any:
    """T = mu N + T0. N and T0 in newton, mu dimensionless; regular everywhere.

    The law of :func:`coulomb_adhesion` where the nominal area is not known: T0 stands for tau0 A.
    """
    return mu * normal_load_N + T0_N


def coulomb_intercept_gradient(normal_load_N: Any, mu: Any, T0_N: Any) -> tuple[Any, Any]:
    """(dT/dmu, dT/dT0) = (N, 1), in newton and 1."""
    return normal_load_N, 1.0


def coulomb_adhesion(normal_load_N: Any, nominal_area_m2: Any, mu: Any, tau0_Pa: Any) -> Any:
    """T = mu N + tau0 A. N in newton, A nominal area in m2, mu dimensionless, tau0 in pascal.

    Divided by N it is the paper's T/N = mu + tau0/p, p = N/A; that form is singular at N = 0, this is not.
    Source: Berardo et al. 2019, text beside Fig. 4.
    """
    return mu * normal_load_N + tau0_Pa * nominal_area_m2


def coulomb_adhesion_gradient(
    normal_load_N: Any, nominal_area_m2: Any, mu: Any, tau0_Pa: Any
) -> tuple[Any, Any]:
    """(dT/dmu, dT/dtau0) = (N, A), in newton and m2."""
    return normal_load_N, nominal_area_m2


def three_term(
    normal_load_N: Any, nominal_area_m2: Any, area_fraction: Any, mu: Any, a_Pa: Any, b_Pa: Any
) -> Any:
    """T = mu N + (a AF + b) A. N in newton, A in m2, AF contact area fraction, a and b in pascal.

    With one area fraction only a AF + b can be determined, not a and b. Regular everywhere.
    Source: Berardo et al. 2019, end of the discussion; Vernes et al., Faraday Discuss. 156 (2012) 173.
    """
    return mu * normal_load_N + (a_Pa * area_fraction + b_Pa) * nominal_area_m2


def three_term_gradient(
    normal_load_N: Any, nominal_area_m2: Any, area_fraction: Any, mu: Any, a_Pa: Any, b_Pa: Any
) -> tuple[Any, Any, Any]:
    """(dT/dmu, dT/da, dT/db) = (N, AF A, A), in newton and m2."""
    return normal_load_N, area_fraction * nominal_area_m2, nominal_area_m2


_LOAD, _AREA, _AREA_FRACTION = "normal_load_N", "nominal_area_m2", "area_fraction"
_MU = Parameter("mu", "μ", "", "friction coefficient: slope of T against N", low=0.0)
_TAU0 = Parameter("tau0_Pa", "τ₀", "Pa", "adhesion per nominal area: T/A at no load, of either sign")

LAWS: dict[str, Law] = {
    law.name: law
    for law in (
        Law(
            "amontons", "T = μ N", amontons, amontons_gradient,
            (_LOAD,), (_MU,), True, "Amontons, Mémoires de l'Académie royale (1699)",
        ),
        Law(
            "coulomb_intercept", "T = μ N + T₀", coulomb_intercept, coulomb_intercept_gradient,
            (_LOAD,), (_MU, Parameter("T0_N", "T₀", "N", "force at no load, of either sign")), True, BERARDO,
        ),
        Law(
            "coulomb_adhesion", "T = μ N + τ₀ A", coulomb_adhesion, coulomb_adhesion_gradient,
            (_LOAD, _AREA), (_MU, _TAU0), True, BERARDO,
        ),
        Law(
            "three_term", "T = μ N + (a AF + b) A", three_term, three_term_gradient,
            (_LOAD, _AREA, _AREA_FRACTION),
            (
                _MU,
                Parameter("a_Pa", "a", "Pa", "adhesion per contact area"),
                Parameter("b_Pa", "b", "Pa", "adhesion per nominal area, whatever the contact"),
            ),
            True, BERARDO,
        ),
    )
}  # fmt: skip


def law_over_load(nominal_area_m2: float | None) -> Law:
    """T = mu N + tau0 A; T = mu N + T0 where no nominal area is known."""
    return LAWS["coulomb_intercept" if nominal_area_m2 is None else "coulomb_adhesion"]


def design_over_load(load_N: FloatArray, nominal_area_m2: float | None) -> FloatArray:
    """Design matrix (n, 2) of :func:`law_over_load` at loads (n,)."""
    law = law_over_load(nominal_area_m2)
    return law.design_matrix(load_N) if nominal_area_m2 is None else law.design_matrix(load_N, nominal_area_m2)
