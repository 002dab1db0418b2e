"""The directional particle filter: particles off the course are never measured."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.box import Box
from simbench.errors import TrackerError
from simbench.frame import Frame
from simbench.trackers.condensation import Condensation
from simbench.trackers.directional_gate import (
    forward_mean,
    forward_offset,
    gate_weights,
)

__all__ = ["Directional", "directional_22", "directional_45", "directional_90"]

CLOUD_OFFSET = 0.85  # spreads ahead at which the published usage comes about
SLOW_PX = 1.0  # a direction means nothing below a pixel a frame
SLOW_WIDTHS = 0.06  # nor below what the estimate jitters, in widths a frame


class Directional(Condensation):
    """Directional particle filter: condensation with a gate on the motion angle.

    Before anything is measured, particles whose angle from the previous estimate is
    further than T from the smoothed direction of motion are dropped; the others are
    measured, and weighted down linearly with that angle.

    Parameters
    ----------
    half_angle : float, rad, in (0, pi]
        T.
    particles, samples, sigma, surround, warm_up_noise, position_noise, scale_noise, \
    aspect_noise, drift, keep_cloud
        As for `Condensation`.

    Attributes
    ----------
    fallbacks : int
        Frames so far in which no particle passed, so that all were measured.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section III, eqs. 6 to 10.

    Notes
    -----
    The gate alone pushes the cloud ahead, frame after frame, and a filter that adds
    its speed to that runs off along its course. Drift and noise are therefore chosen
    together, so that drift *and* gate advance the cloud by the smoothed speed. The
    gate is open while no direction is known and while the target all but stands.
    """

    def __init__(
        self,
        *,
        half_angle: float = math.pi / 4,
        particles: int = 100,
        samples: int = 128,
        sigma: float = 0.12,
        surround: float = 1.0,
        warm_up_noise: float = 0.15,
        position_noise: float = 1.5,
        scale_noise: float = 0.04,
        aspect_noise: float = 0.005,
        drift: bool = True,
        keep_cloud: bool = False,
    ) -> None:
        super().__init__(
            particles=particles,
            samples=samples,
            sigma=sigma,
            surround=surround,
            warm_up_noise=warm_up_noise,
            position_noise=position_noise,
            scale_noise=scale_noise,
            aspect_noise=aspect_noise,
            drift=drift,
            keep_cloud=keep_cloud,
        )
        if not 0.0 < half_angle <= math.pi:
            raise TrackerError(f"half_angle must be in (0, pi], got {half_angle}")
        self.half_angle = half_angle
        self.fallbacks = 0
        self._full_advance = forward_mean(CLOUD_OFFSET, half_angle)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Start on a frame in which ``box`` (px) bounds the target."""
        forward_offset(1.0, self.half_angle)  # makes its table
        self.fallbacks = 0
        super().init(frame, box, rng)

    @property
    def _is_gated(self) -> bool:
        course = self._course
        slow = max(SLOW_PX, SLOW_WIDTHS * 2.0 * float(self._mean[2]))
        return course.is_known and course.speed >= slow

    def _advance(self, speed: float) -> tuple[float, float]:
        if not self._is_gated:
            return super()._advance(speed)
        spread = max(self.position_noise, speed / self._full_advance)
        return spread * forward_offset(speed / spread, self.half_angle), spread

    def _gate(self) -> NDArray[np.float64] | None:
        if not self._is_gated:
            return None
        offsets = self._cloud[:, :2] - self._mean[:2]
        factors = gate_weights(offsets, self._course.theta, self.half_angle)
        if not factors.any():
            self.fallbacks += 1
            return None
        return factors


def directional_90(**parameters: Any) -> Directional:
    """Directional particle filter with T = pi/2; parameters as for `Directional`."""
    return Directional(**{"half_angle": math.pi / 2, **parameters})


def directional_45(**parameters: Any) -> Directional:
    """Directional particle filter with T = pi/4; parameters as for `Directional`."""
    return Directional(**{"half_angle": math.pi / 4, **parameters})


def directional_22(**parameters: Any) -> Directional:
    """Directional particle filter with T = pi/8; parameters as for `Directional`."""
    return Directional(**{"half_angle": math.pi / 8, **parameters})
