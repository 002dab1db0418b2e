"""Course: smoothed direction, speed and growth of a target in the image."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

__all__ = ["Course", "wrap"]

MEDIAN_STEP = math.radians(1.0)  # DPF, eq. 7: the median moves by one degree
SPEED_GAIN = 0.3  # weight of the newest step in the smoothed speed
GROWTH_GAIN = 0.03  # of the newest change of size, which has much more jitter
WARM_UP_FRAMES = 3  # a direction from fewer frames is mostly noise


def wrap(angle: float) -> float:
    """Return an angle in rad wrapped to (-pi, pi].

    Examples
    --------
    >>> round(wrap(math.radians(350.0) - math.radians(10.0)), 4) == -0.3491
    True
    """
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


@dataclass(slots=True)
class Course:
    """Smoothed direction and speed of the estimates so far.

    The course is unknown until the target has moved by ``start_px`` from its first
    position, over at least three frames: displacements before that are mostly the
    jitter of the estimate.

    Parameters
    ----------
    x, y : float, px
        First position.
    start_px : float, px
        Net displacement above which a direction is known.
    still_px : float, px
        Steps shorter than this do not change the direction.

    Attributes
    ----------
    theta : float, rad, in (-pi, pi]
        Smoothed direction in the image, x right and y down; NaN while unknown.
    speed : float, px per frame
        Smoothed speed along ``theta``, at least 0.
    growth : float, 1 per frame
        Smoothed change of the log of the size.

    Notes
    -----
    A target at constant velocity in the world moves in the image at a speed
    proportional to the square of its size, and its log size changes at a rate
    proportional to its size: with ``x = f (X + U t) / (Z + W t)``,
    ``dx/dt = f (U Z - X W) / Z^2``, whose bracket is constant, and
    ``d log(1 / Z) / dt = -W / Z``. Both are propagated in this way from frame to frame,
    also while the target is occluded.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), eqs. 6 and 7. The paper does not smooth a speed and does
    not define when the direction starts.
    """

    x: float
    y: float
    start_px: float
    still_px: float
    theta: float = math.nan
    speed: float = 0.0
    growth: float = 0.0
    _frames: int = field(default=0, init=False)

    @property
    def is_known(self) -> bool:
        """Whether a direction is known."""
        return not math.isnan(self.theta)

    def advance(self, x: float, y: float, growth: float = 0.0) -> None:
        """Update with the next position, px, and the change of the log of the size."""
        self.speed *= math.exp(2.0 * growth)
        self.growth *= math.exp(growth)
        self.growth += GROWTH_GAIN * (growth - self.growth)
        dx, dy = x - self.x, y - self.y
        if not self.is_known:
            self._frames += 1
            net = math.hypot(dx, dy)
            if self._frames >= WARM_UP_FRAMES and net > self.start_px:
                self.theta = math.atan2(dy, dx)
                self.speed = net / self._frames
                self.x, self.y = x, y
            return
        forward = dx * math.cos(self.theta) + dy * math.sin(self.theta)
        self.speed = max(0.0, self.speed + SPEED_GAIN * (forward - self.speed))
        if math.hypot(dx, dy) >= self.still_px:
            self._turn(math.atan2(dy, dx))
        self.x, self.y = x, y

    def _turn(self, measured: float) -> None:
        """Move theta by one step of the approximate median towards a measured angle."""
        turn = wrap(measured - self.theta)
        self.theta = wrap(self.theta + max(-MEDIAN_STEP, min(MEDIAN_STEP, turn)))
