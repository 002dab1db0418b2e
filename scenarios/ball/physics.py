"""Event-driven motion of balls that roll, bounce and are kicked, in closed form.

Between two events (a bounce, a wall, a kick, coming to rest) a ball either rolls in a
straight line with constant deceleration, or flies along a parabola. Each event's time
is a root of that motion, so the position at any time is exact at any frame rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.scenarios.schema import Ball, FloorPlan

__all__ = ["GRAVITY", "Phase", "motion"]

GRAVITY = 9.81
"""Acceleration of free fall in m/s^2."""

_SETTLED_MPS = 0.05  # a slower bounce rises 0.1 mm: the ball rolls on
_STOPPED_MPS = 1e-9  # less is rounding error
_ROUNDING_M = 1e-9


@dataclass(frozen=True, slots=True)
class Phase:
    """The motion of a ball between two events.

    Attributes
    ----------
    start_s : float, s
    position : (3,) float, m
        Of the ball's lowest point at the start: along, lateral, height.
    velocity : (3,) float, m/s
    deceleration : float, m/s^2
        Of a rolling ball; 0 in flight.
    rolls : bool
        Whether it is on the floor; otherwise it flies.
    heading : float, rad
        Direction of its motion along the floor; at rest, its last direction.
    """

    start_s: float
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    deceleration: float
    rolls: bool
    heading: float

    def at(
        self, times: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return positions and velocities, (T, 3) each, at times [s] of this phase."""
        since = (times - self.start_s)[:, None]
        if not self.rolls:
            velocity = self.velocity + np.array([0.0, 0.0, -GRAVITY]) * since
            return self.position + (self.velocity + velocity) / 2.0 * since, velocity
        speed = float(np.linalg.norm(self.velocity))
        if speed == 0.0:
            zero = np.zeros((len(times), 3))
            return self.position + zero, zero
        if self.deceleration > 0.0:
            since = np.minimum(since, speed / self.deceleration)
        share = 1.0 - self.deceleration * since / speed
        moved = self.velocity * since * (1.0 + share) / 2.0
        return self.position + moved, self.velocity * share


def motion(ball: Ball, plan: FloorPlan, until_s: float) -> list[Phase]:
    """Compute the phases of one ball's motion from event to event.

    Parameters
    ----------
    ball : Ball
    plan : FloorPlan
        Balls bounce off its walls; without walls they roll off the floor.
    until_s : float, s

    Returns
    -------
    list of Phase
        In order; each holds until the next one starts.

    Raises
    ------
    TrafficError
        If a wall is lower than the ball's middle where the ball meets it.
    """
    now = _start(ball)
    phases = [now]
    kicks = sorted(ball.kicks, key=lambda kick: kick.at_s)
    while True:
        kick_s = kicks[0].at_s if kicks else math.inf
        wall_s, axis, limit = _next_wall(now, ball, plan)
        next_s = min(kick_s, wall_s, _next_landing_or_rest(now))
        if next_s > until_s:
            return phases
        (position,), (velocity,) = now.at(np.array([next_s]))
        rolls, heading = now.rolls, now.heading
        if next_s == kick_s:
            kick = kicks.pop(0)
            heading += kick.turn_rad
            velocity = _velocity(kick.speed_mps, heading, kick.up_mps)
            rolls = kick.up_mps == 0.0 and bool(position[2] <= _ROUNDING_M)
        elif next_s == wall_s:
            _require_below_wall(now, next_s, position, ball, plan)
            velocity[axis] *= -ball.restitution
            position[axis] = limit  # free of rounding errors
        elif rolls:
            velocity = np.zeros(3)
        else:
            position[2] = 0.0
            velocity[2] *= -ball.restitution
            rolls = bool(velocity[2] < _SETTLED_MPS)
        now = _phase(next_s, position, velocity, rolls, ball, heading)
        phases.append(now)


def _velocity(speed: float, heading: float, up: float) -> NDArray[np.float64]:
    along_floor = speed * np.array([math.cos(heading), math.sin(heading)])
    return np.array([*along_floor, up])


def _start(ball: Ball) -> Phase:
    velocity = _velocity(ball.speed_mps, ball.direction_rad, ball.up_mps)
    position = np.array([ball.along_m, ball.lateral_m, ball.height_m])
    rolls = ball.height_m == 0.0 and ball.up_mps == 0.0
    return _phase(0.0, position, velocity, rolls, ball, ball.direction_rad)


def _phase(
    start_s: float,
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    rolls: bool,
    ball: Ball,
    heading: float,
) -> Phase:
    speed = math.hypot(velocity[0], velocity[1])
    if rolls:
        position = position * [1.0, 1.0, 0.0]
        velocity = velocity * [1.0, 1.0, 0.0] * (speed > _STOPPED_MPS)
    if speed > _STOPPED_MPS:
        heading = math.atan2(velocity[1], velocity[0])
    deceleration = ball.friction * GRAVITY if rolls else 0.0
    return Phase(start_s, position, velocity, deceleration, rolls, heading)


def _next_landing_or_rest(now: Phase) -> float:
    """Return when a flying ball touches the floor, or a rolling one stops."""
    if not now.rolls:
        up, height = float(now.velocity[2]), max(float(now.position[2]), 0.0)
        return now.start_s + (up + math.sqrt(up**2 + 2.0 * GRAVITY * height)) / GRAVITY
    speed = float(np.linalg.norm(now.velocity))
    if speed == 0.0 or now.deceleration == 0.0:
        return math.inf
    return now.start_s + speed / now.deceleration


def _next_wall(now: Phase, ball: Ball, plan: FloorPlan) -> tuple[float, int, float]:
    """Return when a ball touches a wall, on which axis, and its coordinate there."""
    if plan.wall_m <= 0:
        return math.inf, 0, 0.0
    return min(_wall_contact(now, axis, ball, plan) for axis in (0, 1))


def _wall_contact(
    now: Phase, axis: int, ball: Ball, plan: FloorPlan
) -> tuple[float, int, float]:
    speed = float(now.velocity[axis])
    if speed == 0.0:
        return math.inf, axis, 0.0
    low, high = [(0.0, plan.length_m), (-plan.width_m / 2.0, plan.width_m / 2.0)][axis]
    radius = ball.diameter_m / 2.0
    limit = high - radius if speed > 0 else low + radius
    gap = max(0.0, math.copysign(1.0, speed) * (limit - float(now.position[axis])))
    deceleration = now.deceleration * abs(speed) / math.hypot(*now.velocity[:2])
    left = speed**2 - 2.0 * deceleration * gap
    if left <= 0.0:
        return math.inf, axis, limit  # it stops before
    # The smaller root of gap = |v| t - a t^2 / 2, in the form that holds for a = 0.
    return now.start_s + 2.0 * gap / (abs(speed) + math.sqrt(left)), axis, limit


def _require_below_wall(
    now: Phase,
    time_s: float,
    position: NDArray[np.float64],
    ball: Ball,
    plan: FloorPlan,
) -> None:
    radius = ball.diameter_m / 2.0
    middle = float(position[2]) + radius
    if middle <= plan.wall_m:
        return
    if now.rolls:
        raise TrafficError(
            f"a ball rolls over the wall after {time_s:.2f} s: expected a wall at "
            f"least as high as the ball's radius, {radius:g} m, got road.floor.wall_m "
            f"= {plan.wall_m:g} m: raise the wall or use a smaller ball"
        )
    raise TrafficError(
        f"a ball flies over the wall after {time_s:.2f} s: expected its middle below "
        f"road.floor.wall_m = {plan.wall_m:g} m, got {middle:.3f} m: raise the wall or "
        "slow the ball"
    )
