"""Online extreme learning machine: random hidden layer and ridge regression."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["ExtremeLearningMachine"]


class ExtremeLearningMachine:
    """Online regression with a random hidden layer and a least-squares output layer.

    Parameters
    ----------
    inputs, hidden : int
        Sizes of the input and of the hidden layer.
    ridge : float
        Penalty on the squared output weights.
    memory : float, in (0, 1]
        Factor on all earlier samples, at each `learn`.
    rng : numpy.random.Generator
        Source of the hidden layer.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 3.3; Huang, Zhu and Siew, "Extreme learning
    machine: theory and applications", Neurocomputing 70 (2006).
    """

    def __init__(
        self,
        inputs: int,
        *,
        hidden: int,
        ridge: float,
        memory: float,
        rng: np.random.Generator,
    ) -> None:
        self._weights = rng.standard_normal((inputs, hidden)).astype(np.float32)
        self._biases = rng.standard_normal(hidden).astype(np.float32)
        self._memory = memory
        self._ridge = ridge * np.eye(hidden)
        self._gram = np.zeros((hidden, hidden))
        self._moment = np.zeros(hidden)
        self._output: NDArray[np.float64] = np.zeros(hidden)

    def learn(self, inputs: NDArray[np.float32], targets: NDArray[np.float64]) -> None:
        """Add (M, inputs) samples with their (M,) targets, and solve again."""
        activations = self._activate(inputs).astype(np.float64)
        self._gram = self._memory * self._gram + activations.T @ activations
        self._moment = self._memory * self._moment + activations.T @ targets
        solution = np.linalg.solve(self._gram + self._ridge, self._moment)
        self._output = solution.astype(np.float64)

    def predict(self, inputs: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the (M,) outputs for (M, inputs) samples; 0 before `learn`."""
        return self._activate(inputs) @ self._output

    def _activate(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the (M, hidden) hidden layer, in (-1, 1)."""
        return np.asarray(np.tanh(inputs @ self._weights + self._biases), np.float32)
