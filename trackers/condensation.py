"""Condensation: the conventional particle filter on colour histograms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.course import Course
from simbench.trackers.parts.resampling import systematic

__all__ = ["Condensation"]

SCALE_RANGE = (0.1, 10.0)  # of the first box: cars shrink fourfold on a long road
MIN_HALF_AXIS_PX = 1.5  # below this an ellipse covers fewer than ten pixels


@dataclass(kw_only=True, eq=False)
class Condensation:
    """Conventional particle filter: colour histogram in an ellipse, 100 particles.

    State: ellipse centre x, y and half axes Hx, Hy in pixels, inscribed in the box.
    In each frame: resample, propagate, measure, and return the weighted mean.

    Parameters
    ----------
    particles : int
        N; 100 in the paper.
    samples : int
        Sample points in an ellipse; a quarter as many in the ring. Tuned.
    sigma : float
        Standard deviation of the Bhattacharyya distance in the weights. Tuned: above
        0.1 the likelihood no longer keeps the directional filters on the target.
    surround : float
        Penalty on target colours just outside the ellipse, which keeps the size;
        0 is the likelihood of the paper. Tuned.
    background : float
        How strongly colours that also surround the target are reduced in the
        reference; 0 is the likelihood of the paper. Tuned.
    warm_up_noise : float
        Standard deviation of the position noise before a course is known, in box
        widths and heights.
    position_noise : float, px
        Minimum standard deviation of the position noise once it is known. Tuned.
    scale_noise : float
        Standard deviation of the log of the change of size, common to both axes.
        Tuned: with more, the size of an occluded target diverges.
    aspect_noise : float
        The same, opposite for the two axes. Tuned: with more, the box of a nearly
        stationary car shrinks onto its most distinctive half within 500 frames.
    drift : bool
        Whether particles are propagated by the smoothed course and growth of the
        estimates; otherwise by a random walk.
    keep_cloud : bool
        Whether estimates carry the particle cloud.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section II, eqs. 1 to 5. The paper gives N and the histogram;
    system model, noise, sigma and resampling are chosen here: systematic resampling
    in every frame, drift along the smoothed course with noise proportional to speed.
    "Tuned" means tuned on the scenario library, seeds 1000 to 1005.
    """

    particles: int = 100
    samples: int = 192
    sigma: float = 0.09
    surround: float = 0.75
    background: float = 8.0
    warm_up_noise: float = 0.15
    position_noise: float = 1.0
    scale_noise: float = 0.015
    aspect_noise: float = 0.002
    drift: bool = True
    keep_cloud: bool = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name in ("particles", "samples"):
            if (value := getattr(self, name)) < 1:
                raise TrackerError(f"{name} must be at least 1, got {value}")
        if not self.sigma > 0.0:
            raise TrackerError(f"sigma must be above 0, got {self.sigma}")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        x, y = box.center
        axes = np.maximum([box.width / 2.0, box.height / 2.0], MIN_HALF_AXIS_PX)
        self._mean = np.array([x, y, *axes])
        self._extent = np.array(frame.image.shape[1::-1], np.float64)
        self._axes_low = np.maximum(axes * SCALE_RANGE[0], MIN_HALF_AXIS_PX)
        self._axes_high = axes * SCALE_RANGE[1]
        self._cloud = np.tile(self._mean, (self.particles, 1))
        self._weights = np.full(self.particles, 1.0 / self.particles)
        self._course = Course(x, y, start_px=0.25 * 2.0 * axes[0], still_px=0.5)
        self._likelihood = ColourLikelihood(
            frame.image,
            self._mean,
            samples=self.samples,
            sigma=self.sigma,
            surround=self.surround,
            background=self.background,
        )
        self._rng = rng
        self._likelihood.similarities(frame.image, self._cloud)  # compiles the kernel

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        before = self._likelihood.evaluations
        self._cloud = self._cloud[systematic(self._weights, self._rng)]
        self._propagate()
        rho = self._measure(frame.image)
        area = float(self._mean[2] * self._mean[3])
        self._mean = self._weights @ self._cloud
        x, y, half_width, half_height = self._mean.tolist()
        growth = 0.5 * math.log(half_width * half_height / area)
        self._course.advance(x, y, growth)
        cloud = np.column_stack([self._cloud[:, :2], self._weights])
        return Estimate(
            box=Box.from_center(x, y, 2.0 * half_width, 2.0 * half_height),
            confidence=min(max(rho, 0.0), 1.0),
            particles=self._likelihood.evaluations - before,
            cloud=cloud if self.keep_cloud else None,
        )

    def _propagate(self) -> None:
        """Propagate the cloud by the system model, clipped to the image."""
        drift, spread = self._motion()
        noise = self._rng.standard_normal((self.particles, 4))
        positions = self._cloud[:, :2] + drift + noise[:, :2] * spread
        self._cloud[:, :2] = np.clip(positions, 0.0, self._extent)
        size = self.scale_noise * noise[:, 2]
        if self.drift:
            size += self._course.growth
        aspect = self.aspect_noise * noise[:, 3]
        growth = np.exp(np.column_stack([size + aspect, size - aspect]))
        axes = self._cloud[:, 2:] * growth
        self._cloud[:, 2:] = np.clip(axes, self._axes_low, self._axes_high)

    def _motion(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return drift and standard deviation of the position, each (2,) in px."""
        course = self._course
        if not (self.drift and course.is_known):
            return np.zeros(2), self.warm_up_noise * 2.0 * self._mean[2:]
        ahead = np.array([math.cos(course.theta), math.sin(course.theta)])
        advance, spread = self._advance(course.speed)
        return advance * ahead, np.full(2, spread)

    def _advance(self, speed: float) -> tuple[float, float]:
        """Return drift along the course and standard deviation, px, for a speed."""
        return speed, max(self.position_noise, speed / 1.5)

    def _gate(self) -> NDArray[np.float64]:
        """Return (N,) factors on the weights; particles with 0 are not measured."""
        return np.ones(self.particles)

    def _measure(self, image: NDArray[np.uint8]) -> float:
        """Weight the cloud; return the weighted mean similarity, at most 1."""
        factors = self._gate()
        passed = factors > 0.0
        rho, weights = np.zeros((2, self.particles))
        rho[passed] = self._likelihood.similarities(image, self._cloud[passed])
        likelihood = np.exp(self._likelihood.log_weights(rho[passed]))
        weights[passed] = factors[passed] * likelihood
        self._weights = weights / weights.sum()
        return float(self._weights @ rho)
