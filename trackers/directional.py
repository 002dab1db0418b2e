"""Directional particle filter: particles off the course are not measured."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.condensation import MIN_NOISE_PX, PAPER, Condensation
from simbench.trackers.parts.course import STEADY_DISAGREEMENT, Course
from simbench.trackers.parts.directional_gate import forward_mean

__all__ = [
    "Directional",
    "directional_22",
    "directional_22_paper",
    "directional_45",
    "directional_45_paper",
    "directional_90",
    "directional_90_paper",
]

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
    particles, samples, sigma, surround, background, structure, learning, \
    warm_up_noise, position_noise, error_noise, scale_noise, aspect_noise, drift, \
    search, camera_motion, resampling, keep_cloud
        As for `Condensation`; the search also opens the gate, see Notes.

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
    stationary, since the direction is then that of the jitter of the estimate. With
    ``search`` it also opens where recent steps disagree with the course by more than T,
    and while the target is occluded or lost: the cone would cut, frame by frame, a
    cloud that nothing pulls back.
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
        super().init(frame, box, rng)

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        estimate = super().update(frame)
        self.fallbacks += self._filter.fallback
        return estimate

    def _first_course(self, x: float, y: float, width: float) -> Course:
        course = super()._first_course(x, y, width)
        course.tolerance = self.half_angle
        return course

    @property
    def _is_gated(self) -> bool:
        course = self._course
        if not course.is_known or course.speed < MIN_SPEED_WIDTHS * self._box[0]:
            return False
        if not self.search:
            return True
        agrees = course.disagreement < STEADY_DISAGREEMENT
        return agrees and self._confidence.lost == 0

    def _set_motion(self) -> None:
        self._filter.motion["half_angle"] = 0.0
        super()._set_motion()

    def _advance(self, course: Course) -> tuple[float, float, float]:
        if not self._is_gated:
            return super()._advance(course)
        width, height = self._box
        spread = max(
            MIN_NOISE_PX,
            self.position_noise * math.sqrt(width * height),
            course.speed / self._reach,
            self.error_noise * course.error,
        )
        behind = self._reach * spread - course.speed  # the apex, px
        x, y = self._filter.mean[:2].tolist()
        x, y = x + self._courses.shift[0], y + self._courses.shift[1]
        self._filter.motion.update(
            half_angle=self.half_angle,
            theta=course.theta,
            apex_x=x - behind * math.cos(course.theta),
            apex_y=y - behind * math.sin(course.theta),
        )
        return CLOUD_OFFSET * spread - behind, spread, 0.0


def directional_90(**parameters: Any) -> Directional:
    """Directional particle filter with T = pi/2; parameters as for `Directional`."""
    return Directional(**{"half_angle": math.pi / 2, **parameters})


def directional_45(**parameters: Any) -> Directional:
    """Directional particle filter with T = pi/4; parameters as for `Directional`."""
    return Directional(**{"half_angle": math.pi / 4, **parameters})


def directional_22(**parameters: Any) -> Directional:
    """Directional particle filter with T = pi/8; parameters as for `Directional`."""
    return Directional(**{"half_angle": math.pi / 8, **parameters})


def directional_90_paper(**parameters: Any) -> Directional:
    """Directional particle filter by the paper alone, T = pi/2; see there.

    As `condensation_paper`, but propagated along the direction of motion: only so do
    the published numbers of measured particles follow (77 to 85 of 100 at this T).
    """
    return directional_90(**{**PAPER, **parameters})


def directional_45_paper(**parameters: Any) -> Directional:
    """Directional particle filter by the paper alone, T = pi/4; see the one at pi/2."""
    return directional_45(**{**PAPER, **parameters})


def directional_22_paper(**parameters: Any) -> Directional:
    """Directional particle filter by the paper alone, T = pi/8; see the one at pi/2."""
    return directional_22(**{**PAPER, **parameters})
