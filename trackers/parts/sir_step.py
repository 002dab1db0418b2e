"""Sequential importance resampling: the particles of a filter, and a step of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts import sir_kernel
from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.resampling import SCHEMES

__all__ = ["SirStep", "Spread"]


@dataclass(frozen=True, slots=True)
class Spread:
    """Standard deviations of one step of the particles.

    Attributes
    ----------
    x, y : float, px
    size, aspect : float
        Of the log of the size, and of that of the aspect ratio's square root.
    far_share : float, in [0, 1]
        Share of particles that are propagated far.
    far_x, far_y : float, px
        Of these.
    """

    x: float
    y: float
    size: float
    aspect: float
    far_share: float
    far_x: float
    far_y: float


class SirStep:
    """Particles with weights: sampled, weighted, normalised, resampled, averaged.

    Parameters
    ----------
    ellipse : (4,) float, px
        The target in the first frame: centre x, y and half axes Hx, Hy.
    limits : (6,) float, px
        Width and height of the image, lower half axes, upper half axes.
    particles : int
        N.
    likelihood : ColourLikelihood
        Of the target; it counts the particles that are measured here.
    sigma : float
        Standard deviation of the Bhattacharyya distance.
    threshold : float, in [0, 1]
        Share of N: with fewer effective particles, they are resampled.
    resampling : str
        One of `SCHEMES`.

    Attributes
    ----------
    cloud : (N, 4) float, px
        Centre x, y and half axes Hx, Hy.
    weights : (N,) float
        Normalised.
    mean : (4,) float, px
        Weighted mean of the cloud.
    similarities : (N,) float, at most 1
        Of the particles in the last frame.
    similarity : float, at most 1
        Their mean under the weights.
    effective : float, in [1, N]
        Effective number of particles before the last step.

    References
    ----------
    Zhong, Peng, Zhong, "Severe-dynamic tracking problems based on lower particles
    resampling", TELKOMNIKA 12(6), 2014 (NBRF), eqs. 1 and 2, algorithm 1.
    """

    def __init__(
        self,
        ellipse: NDArray[np.float64],
        limits: NDArray[np.float64],
        *,
        particles: int,
        likelihood: ColourLikelihood,
        sigma: float,
        threshold: float,
        resampling: str,
    ) -> None:
        self._likelihood = likelihood
        self._limits = limits
        self._precision = 1.0 / (2.0 * sigma**2)
        self._least = threshold * particles
        self._scheme = list(SCHEMES).index(resampling)
        self.mean = ellipse.copy()
        self.cloud = np.tile(ellipse, (particles, 1))
        self.weights = np.full(particles, 1.0 / particles)
        self.similarities = np.zeros(particles)
        self.similarity = 0.0
        self.effective = float(particles)
        self._next = np.empty((particles, 4))
        self._prior = np.empty(particles)
        self._ancestors = np.empty(particles, np.intp)
        self._uniforms = np.empty(particles + 1)
        self._noise = np.empty((particles, 4))

    def advance(
        self,
        image: NDArray[np.uint8],
        shift: tuple[float, float],
        spread: Spread,
        rng: np.random.Generator,
    ) -> None:
        """Make a step into a frame.

        Parameters
        ----------
        image : (H, W, 3) uint8, RGB
        shift : (2,) float, px
            Expected displacement along x and y.
        spread : Spread
        rng : numpy.random.Generator
        """
        rng.random(out=self._uniforms)
        rng.standard_normal(out=self._noise)
        s = spread
        far = (s.far_share, s.far_x, s.far_y)
        moved = self._next
        self.effective = sir_kernel.propagate(
            self.cloud,
            self.weights,
            self._uniforms,
            self._noise,
            np.array([*shift, s.x, s.y, s.size, s.aspect, *far]),
            self._limits,
            self._scheme,
            self._least,
            self._ancestors,
            moved,
            self._prior,
        )
        self.cloud, self._next = moved, self.cloud
        self.similarities = self._likelihood.similarities(image, moved)
        self.similarity = sir_kernel.weigh(
            moved,
            self._prior,
            self.similarities,
            self._precision,
            self.weights,
            self.mean,
        )

    def move(self, offset: NDArray[np.float64]) -> None:
        """Shift the particles and their mean by (2,) px."""
        width, height = self._limits[:2].tolist()
        self.mean[:2] += offset
        places = self.cloud[:, :2]
        places += offset
        np.clip(places, 0.0, (width, height), out=places)
