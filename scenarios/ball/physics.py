"""Balls that roll, bounce and are kicked: solved from event to event, in closed form.

Between two events (a bounce, a wall, a kick, coming to rest) a ball either rolls in a
straight line and slows evenly, or flies along a parabola. Each event's time is a root
of that motion, so nothing depends on a step size, and the place at any time is exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.scenarios.schema import Ball, FloorPlan, Kick

__all__ = ["GRAVITY", "Phase", "motion"]

GRAVITY = 9.81
"""Acceleration of free fall in m/s^2."""

_SETTLED_MPS = 0.05  # a slower bounce rises 0.1 mm: the ball rolls on
_STOPPED_MPS = 1e-9  # less is rounding
_ROUNDING_M = 1e-9


@dataclass(frozen=True, slots=True)
class Phase:
    """The motion of a ball between two events.

    Attributes
    ----------
    start_s : float, s
    place : (3,) float, m
        Of the ball's lowest point at the start: along, lateral, height.
    velocity : (3,) float, m/s
    slowing : float, m/s^2
        How fast a rolling ball loses speed; 0 in flight.
    rolls : bool
        Whether it is on the floor; otherwise it flies.
    heading : float, rad
        Direction of its motion along the floor; at rest, the last it had.
    """

    start_s: float
    place: NDArray[np.float64]
    velocity: NDArray[np.float64]
    slowing: float
    rolls: bool
    heading: float

    def at(
        self, times: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return places and velocities, (T, 3) each, at times [s] of this phase."""
        since = (times - self.start_s)[:, None]
        if not self.rolls:
            pull = np.array([0.0, 0.0, -GRAVITY])
            velocity = self.velocity + pull * since
            return self.place + (self.velocity + velocity) / 2.0 * since, velocity
        speed = float(np.linalg.norm(self.velocity))
        if speed == 0.0:
            still = np.zeros((len(times), 3))
            return self.place + still, still
        if self.slowing > 0.0:
            since = np.minimum(since, speed / self.slowing)
        share = 1.0 - self.slowing * since / speed
        return self.place + self.velocity * since * (1.0 + share) / 2.0, (
            self.velocity * share
        )


def motion(ball: Ball, plan: FloorPlan, until_s: float) -> list[Phase]:
    """Follow one ball from event to event.

    Parameters
    ----------
    ball : Ball
    plan : FloorPlan
        Its walls throw balls back; without walls they roll off the floor.
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
        wall_s, axis = _wall(now, ball, plan)
        floor_s = _landing(now)
        rest_s = _rest(now)
        next_s = min(kick_s, wall_s, floor_s, rest_s)
        if next_s > until_s:
            return phases
        places, velocities = now.at(np.array([next_s]))
        place, velocity = places[0], velocities[0]
        if next_s == kick_s:
            now = _kicked(now, kicks.pop(0), place, ball)
        elif next_s == wall_s:
            _require_below_wall(now, next_s, place, ball, plan)
            velocity[axis] *= -ball.restitution
            place[axis] = _inside(place, axis, ball, plan)
            now = _phase(next_s, place, velocity, now.rolls, ball, now.heading)
        elif next_s == floor_s:
            place[2] = 0.0
            velocity[2] *= -ball.restitution
            rolls = bool(velocity[2] < _SETTLED_MPS)
            now = _phase(next_s, place, velocity, rolls, ball, now.heading)
        else:
            now = _phase(next_s, place, np.zeros(3), True, ball, now.heading)
        phases.append(now)


def _start(ball: Ball) -> Phase:
    direction = np.array([math.cos(ball.direction_rad), math.sin(ball.direction_rad)])
    velocity = np.array([*(ball.speed_mps * direction), ball.up_mps])
    place = np.array([ball.along_m, ball.lateral_m, ball.height_m])
    rolls = ball.height_m == 0.0 and ball.up_mps == 0.0
    return _phase(0.0, place, velocity, rolls, ball, ball.direction_rad)


def _phase(
    start_s: float,
    place: NDArray[np.float64],
    velocity: NDArray[np.float64],
    rolls: bool,
    ball: Ball,
    heading: float,
) -> Phase:
    onward = math.hypot(velocity[0], velocity[1])
    if rolls:
        place = place * [1.0, 1.0, 0.0]
        velocity = velocity * [1.0, 1.0, 0.0] * (onward > _STOPPED_MPS)
    if onward > _STOPPED_MPS:
        heading = math.atan2(velocity[1], velocity[0])
    slowing = ball.friction * GRAVITY if rolls else 0.0
    return Phase(start_s, place, velocity, slowing, rolls, heading)


def _kicked(now: Phase, kick: Kick, place: NDArray[np.float64], ball: Ball) -> Phase:
    heading = now.heading + kick.turn_rad
    onward = kick.speed_mps * np.array([math.cos(heading), math.sin(heading)])
    velocity = np.array([*onward, kick.up_mps])
    rolls = kick.up_mps == 0.0 and place[2] <= _ROUNDING_M
    return _phase(kick.at_s, place, velocity, rolls, ball, heading)


def _rest(now: Phase) -> float:
    """Return when a rolling ball stops."""
    speed = float(np.linalg.norm(now.velocity))
    if not now.rolls or speed == 0.0 or now.slowing == 0.0:
        return math.inf
    return now.start_s + speed / now.slowing


def _landing(now: Phase) -> float:
    """Return when a flying ball touches the floor."""
    if now.rolls:
        return math.inf
    up, height = float(now.velocity[2]), max(float(now.place[2]), 0.0)
    return now.start_s + (up + math.sqrt(up**2 + 2.0 * GRAVITY * height)) / GRAVITY


def _wall(now: Phase, ball: Ball, plan: FloorPlan) -> tuple[float, int]:
    """Return when the ball touches a wall, and across which axis that stands."""
    hits = [(_reach(now, axis, ball, plan), axis) for axis in (0, 1)]
    return min(hits) if plan.wall_m > 0 else (math.inf, 0)


def _reach(now: Phase, axis: int, ball: Ball, plan: FloorPlan) -> float:
    speed = float(now.velocity[axis])
    if speed == 0.0:
        return math.inf
    low, high = _bounds(axis, ball, plan)
    place = float(now.place[axis])
    gap = max(0.0, high - place if speed > 0 else place - low)
    slowing = now.slowing * abs(speed) / math.hypot(*now.velocity[:2])
    left = speed**2 - 2.0 * slowing * gap
    if left <= 0.0:
        return math.inf  # it stops before
    # The smaller root of gap = |v| t - a t^2 / 2, in the form that holds for a = 0.
    return now.start_s + 2.0 * gap / (abs(speed) + math.sqrt(left))


def _bounds(axis: int, ball: Ball, plan: FloorPlan) -> tuple[float, float]:
    """Return how far the ball's middle may go along an axis."""
    radius = ball.diameter_m / 2.0
    low = 0.0 if axis == 0 else -plan.width_m / 2.0
    high = plan.length_m if axis == 0 else plan.width_m / 2.0
    return low + radius, high - radius


def _inside(
    place: NDArray[np.float64], axis: int, ball: Ball, plan: FloorPlan
) -> float:
    """Return the coordinate on the wall itself, free of rounding."""
    low, high = _bounds(axis, ball, plan)
    return low if abs(place[axis] - low) < abs(place[axis] - high) else high


def _require_below_wall(
    now: Phase,
    time_s: float,
    place: NDArray[np.float64],
    ball: Ball,
    plan: FloorPlan,
) -> None:
    radius = ball.diameter_m / 2.0
    middle = float(place[2]) + radius
    if middle <= plan.wall_m:
        return
    if now.rolls:
        raise TrafficError(
            f"a ball rolls over the wall after {time_s:.2f} s: wanted a wall at least "
            f"as high as the ball's radius, {radius:g} m, found road.floor.wall_m = "
            f"{plan.wall_m:g} m: raise the wall or let a smaller ball roll"
        )
    raise TrafficError(
        f"a ball flies over the wall after {time_s:.2f} s: wanted its middle below "
        f"road.floor.wall_m = {plan.wall_m:g} m there, found {middle:.3f} m: raise the "
        "wall or slow the ball"
    )
