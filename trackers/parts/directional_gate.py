"""Directional gate: the cone of directions in which particles are measured."""

from __future__ import annotations

import functools
import math
from typing import Final

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["WEIGHTINGS", "angle_factor", "forward_mean", "gate_weights", "reach"]

WEIGHTINGS: Final = ("linear", "cosine", "gaussian", "none")
"""How the weight falls with the angle psi, within T: as ``1 - psi / T`` (DPF, eq. 10),
``cos(pi psi / 2 T)``, ``exp(-2 (psi / T)^2)``, or not at all, which is a hard gate."""
LINEAR, COSINE, GAUSSIAN, NONE = range(4)

CLOUD_OFFSET: Final = 0.85
"""Standard deviations ahead of the apex; reproduces the published usage."""


@numba.njit(cache=True)
def angle_factor(psi, half_angle, weighting):  # type: ignore[no-untyped-def]
    """Return the factor on the weight at an angle psi >= 0 to the direction, rad.

    ``weighting`` is a place in `WEIGHTINGS`; the factor is 0 beyond the half angle.
    """
    if weighting == LINEAR:
        return max(1.0 - psi / half_angle, 0.0)
    if psi > half_angle:
        return 0.0
    if weighting == COSINE:
        return math.cos(0.5 * math.pi * psi / half_angle)
    if weighting == GAUSSIAN:
        return math.exp(-2.0 * (psi / half_angle) ** 2)
    return 1.0


@numba.njit(cache=True)
def _factors(psi, half_angle, weighting):  # type: ignore[no-untyped-def]
    result = np.empty(psi.shape[0])
    for n in range(psi.shape[0]):
        result[n] = angle_factor(psi[n], half_angle, weighting)
    return result


def gate_weights(
    offsets: NDArray[np.float64],
    theta: float,
    half_angle: float,
    weighting: str = "linear",
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
    weighting : str
        One of `WEIGHTINGS`.

    Returns
    -------
    (N,) float, in [0, 1]
        By default ``1 - psi / T``; 0 where the angle psi to ``theta`` exceeds T.

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
    return np.asarray(_factors(psi, half_angle, WEIGHTINGS.index(weighting)))


def forward_mean(offset: float, half_angle: float, weighting: str = "linear") -> float:
    """Return the mean advance of a unit cloud under the gate's weights.

    The gate moves the mean of a cloud forward even if the likelihood is uniform. The
    cloud is normal with unit standard deviation and its centre ``offset`` ahead.

    Parameters
    ----------
    offset : float
        Distance of the cloud's centre ahead of the apex, in standard deviations.
    half_angle : float, rad
        T.
    weighting : str
        One of `WEIGHTINGS`.

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
    cone = _factors(np.abs(psi), half_angle, WEIGHTINGS.index(weighting))
    mass = (density * radius[:, None]).sum(axis=0) @ cone
    advance = (density * radius[:, None] ** 2).sum(axis=0) @ (cone * np.cos(psi))
    return float(advance / mass)


def reach(half_angle: float, weighting: str) -> float:
    """Return `forward_mean` of a cloud at `CLOUD_OFFSET`, from a table made once."""
    angles, means = _reaches(weighting)
    return float(np.interp(half_angle, angles, means))


@functools.cache
def _reaches(weighting: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    angles = np.linspace(math.pi / 32, math.pi, 63)
    means = [forward_mean(CLOUD_OFFSET, each, weighting) for each in angles.tolist()]
    return angles, np.array(means)
