"""The record of a friction law."""

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
class Variable:
    """A condition under which a law is evaluated: its argument name and SI unit ("" where dimensionless)."""

    name: str
    unit: str


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

    ``function(*conditions, *parameters)`` returns T; ``gradient`` takes the same arguments and returns
    dT/dparameter, one array per parameter in their order. Both are pure and broadcast. ``linear`` says that
    T is linear in all parameters, so that the gradient is the design matrix of a least-squares fit.
    """

    name: str
    formula: str
    function: Callable[..., Any]
    gradient: Callable[..., tuple[Any, ...]]
    conditions: tuple[Variable, ...]
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
