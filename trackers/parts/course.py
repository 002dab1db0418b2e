"""Course: smoothed direction, speed and growth of a target in the image."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

__all__ = ["Course", "wrap"]

MEDIAN_STEP = math.radians(1.0)  # DPF, eq. 7: the median moves by one degree
SPEED_GAIN = 0.3  # weight of the newest step in the smoothed speed
GROWTH_GAIN = 0.06  # of the newest change of size, which has much more jitter
WARM_UP_FRAMES = 3  # a direction from fewer frames is mostly noise
ERROR_GAIN = 0.2  # of the newest squared prediction error
BIAS_GAIN = 0.25  # of the newest prediction error
DISAGREEMENT_GAIN = 0.15  # of the newest step
FIRST_DISAGREEMENT = 0.3  # a course is on trial at first
FIRST_AGREEMENT = 0.9  # mean cosine, that of a spread of 26 degrees
STEADY_BIAS = 0.4  # of the speed: with more, the target is braking or turning
STEADY_DISAGREEMENT = 0.4  # share of recent steps
FORGET_DISAGREEMENT = 0.8  # above it, at no speed, the course is forgotten


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
    jitter : float
        Net displacement above which a direction is known, in standard deviations of
        what the errors of the steps so far add up to; 0 leaves the test out.
    tolerance : float, rad
        Deviation of a step's direction above which it disagrees with the course.

    Attributes
    ----------
    theta : float, rad, in (-pi, pi]
        Smoothed direction in the image, x right and y down; NaN while unknown.
    speed : float, px per frame
        Smoothed speed along ``theta``, at least 0.
    growth : float, 1 per frame
        Smoothed change of the log of the size.
    error : float, px
        Root of the smoothed squared error of the predicted steps.
    disagreement : float, in [0, 1]
        Smoothed share of steps whose direction is more than ``tolerance`` off.
    spread : float, rad, at least 0
        Circular standard deviation of the steps' directions about ``theta``.

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
    jitter: float = 0.0
    tolerance: float = math.pi / 4
    theta: float = math.nan
    speed: float = 0.0
    growth: float = 0.0
    disagreement: float = 1.0
    _agreement: float = field(default=FIRST_AGREEMENT, init=False)  # mean cosine
    _squared_error: float = field(default=0.0, init=False)
    _bias: tuple[float, float] = field(default=(0.0, 0.0), init=False)
    _drift: tuple[float, float] = field(default=(0.0, 0.0), init=False)
    _last: tuple[float, float] = field(init=False)
    _frames: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Start from the first position."""
        self._last = (self.x, self.y)

    @property
    def is_known(self) -> bool:
        """Whether a direction is known."""
        return not math.isnan(self.theta)

    @property
    def error(self) -> float:
        """Root of the smoothed squared error of the predicted steps, px."""
        return math.sqrt(self._squared_error)

    @property
    def spread(self) -> float:
        """Circular standard deviation of the steps' directions about theta, rad.

        ``sqrt(-2 ln C)`` with C the smoothed mean cosine of the angle to ``theta``
        (Mardia and Jupp, "Directional statistics", 2000, eq. 2.3.14).
        """
        return math.sqrt(-2.0 * math.log(min(max(self._agreement, 1e-3), 1.0)))

    @property
    def is_steady(self) -> bool:
        """Whether recent steps agree with the course, so that it can be carried on.

        A target that brakes or turns is always behind its prediction, on the same side;
        vibration averages out.
        """
        bias = math.hypot(*self._bias)
        agrees = self.disagreement < STEADY_DISAGREEMENT
        return self.is_known and agrees and bias < STEADY_BIAS * self.speed

    def brake(self, factor: float) -> None:
        """Reduce the speed to a share of it."""
        self.speed *= factor

    def jump(self, x: float, y: float) -> None:
        """Move to a position, px, in a way that says nothing about the course."""
        if self.is_known:
            self.x, self.y = x, y
        else:
            self.x, self.y = self.x + x - self._last[0], self.y + y - self._last[1]
        self._last = (x, y)

    def advance(
        self, x: float, y: float, growth: float = 0.0, trust: float = 1.0
    ) -> None:
        """Update with the next position, px, and the change of the log of the size.

        ``trust`` in [0, 1] scales what is learned from it.
        """
        self.speed *= math.exp(2.0 * growth)
        self.growth *= math.exp(growth)
        self.growth += GROWTH_GAIN * trust * (growth - self.growth)
        dx, dy = x - self._last[0], y - self._last[1]
        self._last = (x, y)
        self._compare(dx, dy, trust)
        if not self.is_known:
            self._start(x, y)
            return
        forward = dx * math.cos(self.theta) + dy * math.sin(self.theta)
        gain = SPEED_GAIN * trust
        self.speed = max(0.0, self.speed + gain * (forward - self.speed))
        if math.hypot(dx, dy) >= self.still_px:
            self._turn(math.atan2(dy, dx), trust)
        self.x, self.y = x, y

    def _compare(self, dx: float, dy: float, trust: float) -> None:
        """Compare a step with its prediction."""
        ahead = self._drift
        if self.is_known:
            ahead = (
                self.speed * math.cos(self.theta),
                self.speed * math.sin(self.theta),
            )
        off = (dx - ahead[0], dy - ahead[1])
        squared = off[0] ** 2 + off[1] ** 2
        self._squared_error += ERROR_GAIN * trust * (squared - self._squared_error)
        gain = BIAS_GAIN * trust
        self._bias = _blend(self._bias, off, gain)
        self._drift = _blend(self._drift, (dx, dy), SPEED_GAIN * trust)

    def _start(self, x: float, y: float) -> None:
        """Set the course once the net displacement is well above the jitter."""
        self._frames += 1
        dx, dy = x - self.x, y - self.y
        net = math.hypot(dx, dy)
        noise = self.jitter * math.sqrt(self._squared_error * self._frames)
        if self._frames >= WARM_UP_FRAMES and net > max(self.start_px, noise):
            self.theta = math.atan2(dy, dx)
            self.speed = net / self._frames
            self.x, self.y = x, y
            self.disagreement = FIRST_DISAGREEMENT
            self._bias = (0.0, 0.0)
            self._agreement = FIRST_AGREEMENT

    def _turn(self, measured: float, trust: float) -> None:
        """Move theta by one step of the approximate median towards a measured angle."""
        turn = wrap(measured - self.theta)
        disagrees = 1.0 if abs(turn) > self.tolerance else 0.0
        gain = DISAGREEMENT_GAIN * trust
        self.disagreement += gain * (disagrees - self.disagreement)
        self._agreement += gain * (math.cos(turn) - self._agreement)
        step = MEDIAN_STEP * trust
        self.theta = wrap(self.theta + max(-step, min(step, turn)))

    def forget_if_wrong(self) -> None:
        """Make the course unknown where steps disagree with it and it has no speed."""
        if not self.is_known:
            return
        if self.speed < 1e-3 and self.disagreement > FORGET_DISAGREEMENT:
            self.theta = math.nan
            self._frames = 0


def _blend(
    old: tuple[float, float], new: tuple[float, float], share: float
) -> tuple[float, float]:
    return old[0] + share * (new[0] - old[0]), old[1] + share * (new[1] - old[1])
