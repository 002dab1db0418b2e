"""Directional particle filter: particles off the course are not measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.trackers.condensation import Condensation
from simbench.trackers.parts.directional_gate import forward_mean, gate_weights

__all__ = ["Directional", "directional_22", "directional_45", "directional_90"]

CLOUD_OFFSET = 0.85  # standard deviations ahead; reproduces the published usage
MIN_SPEED_WIDTHS = 0.02  # per frame: below it, jitter determines the direction


@dataclass(kw_only=True, eq=False)
class Directional(Condensation):
    """Directional particle filter: condensation with a gate on the motion angle.

    Before the measurement, particles whose angle from the previous estimate deviates by
    more than T from the smoothed direction of motion are dropped; the others are
    measured, and their weights decrease linearly with that angle.

    Parameters
    ----------
    half_angle : float, rad, in (0, pi]
        T.
    particles, samples, sigma, surround, background, warm_up_noise, position_noise, \
    scale_noise, aspect_noise, drift, keep_cloud
        As for `Condensation`.

    Attributes
    ----------
    fallbacks : int
        Frames so far in which no particle passed, so all were measured.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section III, eqs. 6 to 10.

    Notes
    -----
    The gate alone moves the mean of the cloud ahead in every frame, and a filter that
    adds its speed to that would run ahead of the target. Drift and standard deviation
    are therefore chosen together: the cloud is `CLOUD_OFFSET` standard deviations ahead
    of the apex of the cone; the gate moves its mean to ``reach`` standard deviations,
    which is where the course predicts the target.

    The apex is the previous estimate, eq. 8, as long as the target moves at least
    ``reach`` times the position noise per frame. The paper does not cover a slower
    target, whose direction from one frame to the next is mostly noise. Here the apex
    is then behind the previous estimate by the missing distance, so that the cone
    covers the same share of the cloud at any speed.

    The gate is open while no direction is known and while the target is nearly
    stationary, since the direction is then that of the jitter of the estimate.
    """

    half_angle: float = math.pi / 4
    fallbacks: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        if not 0.0 < self.half_angle <= math.pi:
            raise TrackerError(f"half_angle must be in (0, pi], got {self.half_angle}")
        self._reach = forward_mean(CLOUD_OFFSET, self.half_angle)  # in std deviations

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self.fallbacks = 0
        self._apex_offset = 0.0  # px behind the previous estimate
        super().init(frame, box, rng)

    @property
    def _is_gated(self) -> bool:
        min_speed = MIN_SPEED_WIDTHS * 2.0 * float(self._mean[2])
        return self._course.is_known and self._course.speed >= min_speed

    def _advance(self, speed: float) -> tuple[float, float]:
        if not self._is_gated:
            return super()._advance(speed)
        spread = max(self.position_noise, speed / self._reach)
        self._apex_offset = self._reach * spread - speed
        return CLOUD_OFFSET * spread - self._apex_offset, spread

    def _gate(self) -> NDArray[np.float64]:
        if not self._is_gated:
            return super()._gate()
        theta = self._course.theta
        behind = self._apex_offset * np.array([math.cos(theta), math.sin(theta)])
        offsets = self._cloud[:, :2] - self._mean[:2] + behind
        factors = gate_weights(offsets, theta, self.half_angle)
        if not factors.any():
            self.fallbacks += 1
            return super()._gate()
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
