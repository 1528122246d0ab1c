"""A fitted model, and the same linear about its parameters: what its own columns can absorb of others."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tribo.diagnose.statistics.model import Acting, Setup
from tribo.diagnose.statistics.scatter import Noise, whitened
from tribo.records import FloatArray


@dataclass(frozen=True)
class Linear:
    """A fitted model linear about its parameters, with the noise at which it was fitted.

    ``jacobian`` (n, 2, p) is the derivative of ln T by law and mechanisms and ``random`` (n, 2, q) the design of the
    random effects, whose ``precision`` is (q,). ``residual`` (n, 2) is that of the fit; ``factor`` (n, 2, 2) whitens
    a test without its robust ``weight`` (n,).
    """

    jacobian: FloatArray = field(repr=False)
    random: FloatArray = field(repr=False)
    residual: FloatArray = field(repr=False)
    factor: FloatArray = field(repr=False)
    precision: FloatArray = field(repr=False)
    weight: FloatArray = field(repr=False)

    def cleared(self, stacked: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns (n, 2, k) and the residual, whitened, with law, mechanisms and random effects taken out.

        Their inner products are scores and informations of the marginal model: taking out penalised columns is
        an ordinary projection once the penalty is written as further rows.
        """
        model = np.concatenate([self.jacobian, self.random], axis=2)
        factor = self.factor * np.sqrt(self.weight)[:, None, None]
        white = whitened(factor, np.concatenate([model, stacked, self.residual[:, :, None]], axis=2))
        q, n_random = model.shape[2], self.random.shape[2]
        penalty = np.sqrt(np.concatenate([np.full(q - n_random, 1e-9), self.precision]))
        rows = np.zeros((q, white.shape[1]))
        rows[:, :q] = np.diag(penalty)
        full = np.concatenate([white, rows])
        scale = 1.0 / np.sqrt(np.sum(full[:, :q] ** 2, axis=0) + 1e-300)
        columns, others = full[:, :q] * scale, full[:, q:]
        normal = columns.T @ columns + 1e-9 * np.eye(q)
        others = others - columns @ np.linalg.solve(normal, columns.T @ others)
        return others[:, :-1], others[:, -1]

    def beyond_law(self, columns: FloatArray) -> FloatArray:
        """Columns (n, 2, k) less what the law and the mechanisms of the fit can absorb."""
        flat = self.jacobian.reshape(-1, self.jacobian.shape[2])
        q = np.linalg.qr(flat / np.maximum(np.linalg.norm(flat, axis=0), 1e-300))[0]
        rows = columns.reshape(-1, columns.shape[2])
        return np.asarray((rows - q @ (q.T @ rows)).reshape(columns.shape))


@dataclass(frozen=True)
class ModelFit:
    """A fitted model. ``residual`` (n, 2) is ln T measured minus the law without random effects.

    ``score`` is the log of the marginal likelihood (Laplace), ``covariance`` that of law, mechanism
    parameters and random effects together, ``effects`` (q,) the predicted random effects, ``linear`` the model
    linear about these parameters.
    """

    setup: Setup
    acting: tuple[Acting, ...]
    law: FloatArray
    values: tuple[FloatArray, ...]
    noise: Noise
    effects: FloatArray
    residual: FloatArray
    score: float
    covariance: FloatArray = field(repr=False)
    linear: Linear = field(repr=False)

    @property
    def weight(self) -> FloatArray:
        """How much each test counts, (n,)."""
        return self.linear.weight

    @property
    def predicted(self) -> FloatArray:
        return self.setup.observations.log_force - self.residual
