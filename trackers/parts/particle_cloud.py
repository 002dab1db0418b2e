"""The particles of a filter after a frame, with weights and angles, to look at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ParticleCloud"]


@dataclass(frozen=True, slots=True)
class ParticleCloud:
    """Particles, weights and angles of one frame; arrays are copies.

    Attributes
    ----------
    states : (N, 4) float, px
        Centre x, y and half axes Hx, Hy of each particle.
    weights : (N,) float
        Normalised, after the gate. Before the first frame, and before the measurement
        of any frame, all are 1 / N: the filter resamples in every frame.
    similarities : (N,) float
        Of each particle to the target; NaN where it was not measured.
    factors : (N,) float, in [0, 1]
        What the gate multiplied each weight by: 1 without a gate, 0 where a particle
        was dropped, and a small share for scouts.
    apex : (2,) float, px
        Where the angles are seen from: the previous estimate (DPF, eq. 8), or the apex
        of the gate behind it, see `Directional`.
    theta : float, rad, in (-pi, pi]
        Smoothed direction of motion that the frame was searched with (DPF, eq. 7), x
        right and y down; NaN while unknown.
    half_angle : float, rad
        T of the gate in this frame; NaN where it was open.
    """

    states: NDArray[np.float64]
    weights: NDArray[np.float64]
    similarities: NDArray[np.float64]
    factors: NDArray[np.float64]
    apex: NDArray[np.float64]
    theta: float
    half_angle: float

    @property
    def angles(self) -> NDArray[np.float64]:
        """Direction of each particle from the apex, (N,) rad (DPF, eq. 8)."""
        offsets = self.states[:, :2] - self.apex
        return np.arctan2(offsets[:, 1], offsets[:, 0])

    @property
    def deviations(self) -> NDArray[np.float64]:
        """Angle psi of each to ``theta``, (N,) rad in [0, pi] (DPF, eq. 9); or NaN."""
        turn = np.abs(self.angles - self.theta) % (2.0 * np.pi)
        return np.minimum(turn, 2.0 * np.pi - turn)
