"""Directional gate: the cone of directions in which particles are measured."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["forward_mean", "gate_weights"]


def gate_weights(
    offsets: NDArray[np.float64], theta: float, half_angle: float
) -> NDArray[np.float64]:
    """Return the factor of the directional gate on each particle's weight.

    Parameters
    ----------
    offsets : (N, 2) float, px
        Particles' centres minus the apex of the cone.
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
    """Return the mean advance of a unit cloud under the gate's weights.

    The gate moves the mean of a cloud forward even if the likelihood is uniform. The
    cloud is normal with unit standard deviation and its centre ``offset`` ahead.

    Parameters
    ----------
    offset : float
        Distance of the cloud's centre ahead of the apex, in standard deviations.
    half_angle : float, rad
        T.

    Returns
    -------
    float
        Mean advance, in standard deviations.

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
