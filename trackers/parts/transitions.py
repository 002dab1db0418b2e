"""Transitions of particle filters on the affine group: how states move on by a frame.

Deviations are (6,): those of uniform scale, aspect, rotation and shear (E1 to E4), and
of x and y in sides of the target (E5, E6), see `simbench.trackers.parts.affine_group`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp

__all__ = [
    "GrowingAlpha",
    "autoregressive",
    "brownian",
    "graded_noise",
    "mode_noise",
    "parameter_walk",
]


def mode_noise(
    count: int, deviations: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return (count, 6) noise ``dW = sum of eps_i E_i``, one Gaussian for each mode.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), eq. 3.
    """
    return rng.standard_normal((count, 6)) * deviations


def graded_noise(
    count: int,
    deviations: NDArray[np.float64],
    least: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return (count, 6) noise as `mode_noise`, its deviation rising from row to row.

    Row 0 is no noise, row 1 has about the share ``least`` of the deviations, and the
    last one has all: a cloud that is dense in its middle. With 1 all have the same.
    """
    noise = mode_noise(count, deviations, rng)
    if least < 1.0:
        noise *= np.geomspace(least, 1.0, count)[:, None]
        noise[0] = 0.0
    return noise


def brownian(
    states: NDArray[np.float64],
    deviations: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return ``X exp(dW)``: Brownian motion on the group (GDPF-Brow).

    Parameters
    ----------
    states : (N, 2, 3) float, px
    deviations : (6,) float
    rng : numpy.random.Generator

    Returns
    -------
    (N, 2, 3) float, px

    References
    ----------
    DSP, eqs. 3 and 4 with ``A = 0``; Kwon and Park, "Visual tracking via particle
    filtering on the affine group", Int. J. Robotics Research 29 (2010).
    """
    return compose(states, exp(mode_noise(len(states), deviations, rng)))


def autoregressive(
    states: NDArray[np.float64],
    velocity: NDArray[np.float64],
    alpha: float,
    noise: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return ``X exp(A dt + dW)`` with ``A = alpha V`` (GDPF-Fix, GDPF-Inc).

    Parameters
    ----------
    states : (N, 2, 3) float, px
    velocity : (6,) float
        ``V = log(X_{t-1}^-1 X_t)``, displacement by frame in the Lie algebra.
    alpha : float
        Share of the velocity that is kept.
    noise : (N, 6) float
        ``dW``, see `mode_noise`.

    Returns
    -------
    (N, 2, 3) float, px

    References
    ----------
    DSP, eqs. 1, 2 and 4.
    """
    return compose(states, exp(alpha * velocity + noise))


@dataclass(slots=True)
class GrowingAlpha:
    """Share of the velocity that grows by a step with each frame (GDPF-Inc).

    The paper says no more than that alpha grows step by step. Read here as: trust in
    the velocity grows with the frames it is known for, from ``first`` to ``last``.

    Examples
    --------
    >>> alpha = GrowingAlpha(first=0.5, step=0.25, last=1.0)
    >>> [alpha.next() for _ in range(4)]
    [0.5, 0.75, 1.0, 1.0]
    """

    first: float
    step: float
    last: float
    frames: int = 0

    def next(self) -> float:
        """Return the share for the next frame."""
        alpha = min(self.first + self.step * self.frames, self.last)
        self.frames += 1
        return alpha


def parameter_walk(
    states: NDArray[np.float64],
    deviations: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return states after a random walk on their affine parameters (DLT).

    The parameters are x and y in the image, the log of the scale, half the log of the
    aspect, the angle, and the shear of ``R(angle) [[w, shear h], [0, h]]``; each gets
    noise of its own. Unlike `brownian`, x and y do not turn with the target.

    Parameters
    ----------
    states : (N, 2, 3) float, px
    deviations : (6,) float
    rng : numpy.random.Generator

    Returns
    -------
    (N, 2, 3) float, px

    References
    ----------
    Wang and Yeung, "Learning a deep compact image representation for visual tracking",
    NIPS 2013 (DLT), section 3.2, which takes it from Ross et al., "Incremental learning
    for robust visual tracking", Int. J. Computer Vision 77 (2008), section 3.3; scale
    and aspect by their logs here, so that they stay above 0.
    """
    noise = mode_noise(len(states), deviations, rng)
    a, c = states[:, 0, 0], states[:, 1, 0]
    width, angle = np.hypot(a, c), np.arctan2(c, a)
    cosine, sine = np.cos(angle), np.sin(angle)
    height = cosine * states[:, 1, 1] - sine * states[:, 0, 1]
    shear = (cosine * states[:, 0, 1] + sine * states[:, 1, 1]) / height
    x = states[:, 0, 2] + width * noise[:, 4]
    y = states[:, 1, 2] + height * noise[:, 5]
    width = width * np.exp(noise[:, 0] + noise[:, 1])
    height = height * np.exp(noise[:, 0] - noise[:, 1])
    angle, shear = angle + noise[:, 2], (shear + noise[:, 3]) * height
    cosine, sine = np.cos(angle), np.sin(angle)
    first = [cosine * width, cosine * shear - sine * height, x]
    second = [sine * width, sine * shear + cosine * height, y]
    return np.stack([np.stack(first, axis=-1), np.stack(second, axis=-1)], axis=1)
