"""Logistic regression with a penalty, fitted by Newton's method."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["LogisticLayer"]

_STEPS = 8  # of Newton's method, at most
_CONVERGED = 1e-4


class LogisticLayer:
    """One logistic unit on features, the classifier of DLT.

    Parameters
    ----------
    inputs : int
        Number of features.
    ridge : float
        Penalty on the squared weights; the bias has none.

    References
    ----------
    Wang and Yeung, "Learning a deep compact image representation for visual tracking",
    NIPS 2013 (DLT), section 3.2: a logistic layer on top of the encoder.
    """

    def __init__(self, inputs: int, *, ridge: float) -> None:
        self._weights = np.zeros(inputs + 1)
        self._penalty = np.diag([*np.full(inputs, ridge), 1e-6])

    def fit(self, features: NDArray[np.float32], labels: NDArray[np.float64]) -> None:
        """Fit to (M, inputs) samples of (M,) labels, 0 or 1, from the last weights.

        Both classes weigh the same in all.
        """
        inputs = np.column_stack([features, np.ones(len(features))]).astype(np.float64)
        positive = labels > 0.5
        share = np.where(positive, positive.mean(), 1.0 - positive.mean())
        importance = 0.5 / np.maximum(share, 1.0 / len(labels))
        for _ in range(_STEPS):
            found = _sigmoid(inputs @ self._weights)
            slope = inputs.T @ (importance * (found - labels))
            slope += self._penalty @ self._weights
            curvature = importance * np.maximum(found * (1.0 - found), 1e-4)
            hessian = (inputs.T * curvature) @ inputs + self._penalty
            step = np.linalg.solve(hessian, slope)
            self._weights = self._weights - step
            if np.abs(step).max() < _CONVERGED:
                break

    def predict(self, features: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the (M,) probabilities of (M, inputs) samples; 0.5 before `fit`."""
        return _sigmoid(features @ self._weights[:-1] + self._weights[-1])


def _sigmoid(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(0.5 + 0.5 * np.tanh(0.5 * values))
