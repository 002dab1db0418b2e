"""The directional particle filter: particles off the course are never measured."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.trackers.condensation import Condensation
from simbench.trackers.parts.directional_gate import forward_mean, gate_weights

__all__ = ["Directional", "directional_22", "directional_45", "directional_90"]

CLOUD_OFFSET = 0.85  # spreads ahead at which the published usage comes about
SLOW_WIDTHS = 0.02  # a frame: slower, the direction is that of the jitter


class Directional(Condensation):
    """Directional particle filter: condensation with a gate on the motion angle.

    Before anything is measured, particles whose angle from the previous estimate is
    further than T from the smoothed direction of motion are dropped; the others are
    measured, and weighted down linearly with that angle.

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
        Frames so far in which no particle passed, so that all were measured.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section III, eqs. 6 to 10.

    Notes
    -----
    The gate alone pushes the cloud ahead, frame after frame, and a filter that adds
    its speed to that runs off along its course. Drift and spread are therefore chosen
    together: the cloud lies `CLOUD_OFFSET` spreads ahead of the apex of the cone, from
    where the gate carries its mean to ``reach`` spreads, and that is where the course
    expects the target.

    The apex is the previous estimate, eq. 8, as long as the target moves ``reach``
    times the position noise a frame. The paper does not say what to do with a slower
    one, whose direction from one frame to the next is mostly noise. Here the apex
    then lies as far behind the previous estimate as the speed falls short, so that
    the cone takes in the same share of the cloud at any speed.

    The gate is open while no direction is known and while the target all but stands:
    what then points somewhere is the jitter of the estimate.
    """

    def __init__(
        self,
        *,
        half_angle: float = math.pi / 4,
        particles: int = 100,
        samples: int = 192,
        sigma: float = 0.09,
        surround: float = 0.75,
        background: float = 8.0,
        warm_up_noise: float = 0.15,
        position_noise: float = 1.0,
        scale_noise: float = 0.015,
        aspect_noise: float = 0.002,
        drift: bool = True,
        keep_cloud: bool = False,
    ) -> None:
        super().__init__(
            particles=particles,
            samples=samples,
            sigma=sigma,
            surround=surround,
            background=background,
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
        self._reach = forward_mean(CLOUD_OFFSET, half_angle)  # in spreads

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Start on a frame in which ``box`` (px) bounds the target."""
        self.fallbacks = 0
        self._back = 0.0
        super().init(frame, box, rng)

    @property
    def _is_gated(self) -> bool:
        slow = SLOW_WIDTHS * 2.0 * float(self._mean[2])
        return self._course.is_known and self._course.speed >= slow

    def _advance(self, speed: float) -> tuple[float, float]:
        if not self._is_gated:
            return super()._advance(speed)
        spread = max(self.position_noise, speed / self._reach)
        self._back = self._reach * spread - speed
        return CLOUD_OFFSET * spread - self._back, spread

    def _gate(self) -> NDArray[np.float64] | None:
        theta = self._course.theta
        if not self._is_gated:
            return None
        behind = self._back * np.array([math.cos(theta), math.sin(theta)])
        offsets = self._cloud[:, :2] - self._mean[:2] + behind
        factors = gate_weights(offsets, theta, self.half_angle)
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
