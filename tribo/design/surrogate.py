"""A smooth stand-in for the model: Gaussian processes over the free lengths, with a trend in the area fraction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from tribo.records import FloatArray


@dataclass(frozen=True)
class Surrogate:
    """ln(T/N) of one response: a quadratic trend in the last input, and a Gaussian process on what it leaves.

    ``left_out`` is the root mean square error of each point predicted from all others.
    """

    inputs: FloatArray  # (n, d)
    trend: FloatArray
    scales: FloatArray
    weights: FloatArray
    left_out: float

    def __call__(self, x: FloatArray) -> FloatArray:
        """Predictions at points (m, d)."""
        return np.asarray(basis(x) @ self.trend + kernel(x, self.inputs, self.scales) @ self.weights)


def basis(x: FloatArray) -> FloatArray:
    return np.column_stack([np.ones(len(x)), x[:, -1], x[:, -1] ** 2])


def kernel(a: FloatArray, b: FloatArray, scales: FloatArray) -> FloatArray:
    """Matern 5/2 of unit variance."""
    r = np.sqrt(5.0 * (((a[:, None] - b[None]) / scales) ** 2).sum(-1))
    return np.asarray((1.0 + r + r * r / 3.0) * np.exp(-r))


def fitted(x: FloatArray, y: FloatArray, noise: float) -> Surrogate:
    """The surrogate of most likely lengths and noise for values y (n,) at x (n, d) in the unit cube."""
    trend = np.linalg.lstsq(basis(x), y, rcond=None)[0]
    left = y - basis(x) @ trend
    spread = max(float(left.std()), 1e-4)

    def covariance(logs: FloatArray) -> FloatArray:
        share = np.exp(2 * logs[-1]) + (noise / spread) ** 2
        return np.asarray(kernel(x, x, np.exp(logs[:-1])) + share * np.eye(len(x)))

    def cost(logs: FloatArray) -> float:
        try:
            c, low = cho_factor(covariance(logs))
        except np.linalg.LinAlgError:
            return 1e9
        z = left / spread
        return float(0.5 * z @ cho_solve((c, low), z) + np.log(np.diag(c)).sum() + 0.02 * (logs**2).sum())

    start = np.append(np.full(x.shape[1], np.log(0.7)), np.log(0.1))
    bounds = [(np.log(0.1), np.log(10.0))] * x.shape[1] + [(np.log(1e-3), 0.0)]
    best = minimize(cost, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 60}).x
    inverse = np.linalg.inv(covariance(best))
    weights = inverse @ left
    left_out = float(np.sqrt(np.mean((weights / np.diag(inverse)) ** 2)))
    return Surrogate(x, np.asarray(trend, float), np.exp(best[:-1]), weights, left_out)
