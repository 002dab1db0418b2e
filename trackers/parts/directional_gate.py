"""The cone of directions that a particle must lie in to be measured at all."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["forward_mean", "gate_weights"]


def gate_weights(
    offsets: NDArray[np.float64], theta: float, half_angle: float
) -> NDArray[np.float64]:
    """Return how much of each particle's weight the direction leaves.

    Parameters
    ----------
    offsets : (N, 2) float, px
        Particles' centres less the previous estimate.
    theta : float, rad
        Direction of motion.
    half_angle : float, rad
        T, half the opening of the cone.

    Returns
    -------
    (N,) float, in [0, 1]
        ``1 - psi / T``, and 0 where the angle psi to ``theta`` exceeds T.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), eqs. 8 to 10.

    Examples
    --------
    >>> ahead, aside, behind = [[2.0, 0.0], [1.0, 1.0], [-1.0, 0.0]]
    >>> gate_weights(np.array([ahead, aside, behind]), 0.0, math.pi / 2).tolist()
    [1.0, 0.5, 0.0]
    """
    beta = np.arctan2(offsets[:, 1], offsets[:, 0])
    turn = np.abs(beta - theta) % math.tau
    psi = np.minimum(turn, math.tau - turn)
    return np.maximum(1.0 - psi / half_angle, 0.0)


def forward_mean(offset: float, half_angle: float) -> float:
    """Return the mean advance of a unit cloud once the gate has weighed it.

    The cone pushes a cloud forward even where the picture says nothing. For a normal
    cloud of unit spread whose centre lies ``offset`` ahead, this is the mean of the
    advance under the gate's weights.

    Parameters
    ----------
    offset : float
        Centre of the cloud ahead of the previous estimate, in units of its spread.
    half_angle : float, rad
        T.

    Returns
    -------
    float
        Mean advance, in units of the spread.

    Notes
    -----
    In polar coordinates, with s = offset cos psi, the radial integrals are those of
    r exp(-(r - s)^2 / 2) and r^2 exp(-(r - s)^2 / 2) over r > 0.
    """
    psi = np.linspace(-half_angle, half_angle, 181)
    along = offset * np.cos(psi)
    radius = np.linspace(0.0, max(offset, 0.0) + 8.0, 201)
    density = np.exp(-0.5 * (radius[:, None] - along) ** 2 + 0.5 * along**2)
    cone = 1.0 - np.abs(psi) / half_angle
    mass = (density * radius[:, None]).sum(axis=0) @ cone
    advance = (density * radius[:, None] ** 2).sum(axis=0) @ (cone * np.cos(psi))
    return float(advance / mass)
