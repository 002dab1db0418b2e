"""Which way and how fast a target is heading, from one estimate to the next."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

__all__ = ["Course", "wrap"]

MEDIAN_STEP = math.radians(1.0)  # DPF, eq. 7: the median moves by one degree
SPEED_GAIN = 0.3  # share of the newest step in the smoothed speed
GROWTH_GAIN = 0.03  # of the newest change of size: a box's size jitters much more
WARM_UP_FRAMES = 3  # a direction from fewer frames is mostly noise


def wrap(angle: float) -> float:
    """Return an angle in rad brought into (-pi, pi].

    Examples
    --------
    >>> round(wrap(math.radians(350.0) - math.radians(10.0)), 4) == -0.3491
    True
    """
    turned = math.remainder(angle, math.tau)
    return math.pi if turned == -math.pi else turned


@dataclass(slots=True)
class Course:
    """Smoothed direction and speed of the estimates so far.

    The course is unknown until the target has moved a share of its own width away
    from where it was first seen, over at least three frames: what it does before that
    is mostly the jitter of the estimate.

    Parameters
    ----------
    x, y : float, px
        First position.
    start_px : float, px
        Net displacement from which a direction is known.
    still_px : float, px
        Steps shorter than this say nothing about direction.

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
    What moves at constant velocity in the world moves in the picture at a speed that
    goes as the square of its size, and shrinks or grows at a rate that goes as its
    size: with ``x = f (X + U t) / (Z + W t)`` one has ``dx/dt = f (U Z - X W) / Z^2``,
    whose bracket is constant, and ``d log(1 / Z) / dt = -W / Z``. Both are carried on
    like this from frame to frame, hidden or not.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), eqs. 6 and 7. The paper does not smooth a speed and does not
    say when the direction starts.
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
        """Whether a direction has been seen."""
        return not math.isnan(self.theta)

    def advance(self, x: float, y: float, growth: float = 0.0) -> None:
        """Take in the next position, px, and how much the log of the size grew."""
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
        """Move theta one step of the approximate median towards a measured angle."""
        turn = wrap(measured - self.theta)
        self.theta = wrap(self.theta + max(-MEDIAN_STEP, min(MEDIAN_STEP, turn)))
