"""Trajectories of the balls of a scenario on a floor, varied by the seed."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.core.trajectories import Trajectories, Vehicle
from simbench.scenarios.ball.physics import Phase, motion
from simbench.scenarios.highway.fleet import PAINTS
from simbench.scenarios.schema import Ball, Floor, Scenario
from simbench.scenarios.schema.frame_times import frame_times
from simbench.scenarios.schema.seeds import stream_seed

__all__ = ["simulate_balls", "vary"]

_ATTEMPTS = 20
_ROUNDING_M = 1e-9


def vary(ball: Ball, rng: np.random.Generator) -> Ball:
    """Sample a variation of a ball within its ``spread``."""
    speed, direction, bounce, *kicks = rng.uniform(-1.0, 1.0, 3 + len(ball.kicks))
    spread = ball.spread
    return ball.model_copy(
        update={
            "speed_mps": ball.speed_mps * (1.0 + spread * speed),
            "up_mps": ball.up_mps * (1.0 + spread * speed),
            "direction_rad": ball.direction_rad + spread * direction,
            "restitution": min(0.98, ball.restitution * (1.0 + spread * bounce)),
            "kicks": tuple(
                kick.model_copy(update={"turn_rad": kick.turn_rad + spread * turn})
                for kick, turn in zip(ball.kicks, kicks, strict=True)
            ),
        }
    )


def simulate_balls(scenario: Scenario, seed: int, *, skip: int = 0) -> Trajectories:
    """Simulate the balls of a scenario.

    Parameters
    ----------
    scenario : Scenario
        On a floor. Balls do not collide with each other: attempts in which two would
        touch are rejected.
    seed : int
        Seed of the run; the traffic's stream varies the balls.
    skip : int
        Attempts to skip because they were rejected later.

    Returns
    -------
    Trajectories
        In the floor's frame: x along, y lateral. A ball's position is the point below
        its middle at the height of its underside. Balls do not spin: their heading
        is always 0, so that no point of them turns when their direction does.

    Raises
    ------
    TrafficError
        If a wall is too low for a ball, or balls touch in every attempt.
    """
    if not isinstance(scenario.road, Floor) or scenario.target.ball is None:
        raise TrafficError(
            f"{scenario.name}: expected a floor (road.floor) and a ball (target.ball)"
        )
    times = frame_times(scenario, seed)
    problem: TrafficError | None = None
    for attempt in range(skip, skip + _ATTEMPTS):
        rng = np.random.default_rng(stream_seed(scenario, seed, "traffic", attempt))
        balls = [
            vary(ball, rng) for ball in (scenario.target.ball, *scenario.traffic.balls)
        ]
        try:
            paths = [motion(ball, scenario.road.floor, times[-1]) for ball in balls]
            _require_apart(paths, balls, times[-1])
        except TrafficError as error:
            problem = error
            continue
        return _trajectories(paths, balls, times, attempt)
    raise TrafficError(f"{scenario.name}: {problem}")


def _require_apart(paths: list[list[Phase]], balls: list[Ball], until_s: float) -> None:
    for one, other in combinations(zip(paths, balls, strict=True), 2):
        time_s = _first_touch((one[0], other[0]), (one[1], other[1]), until_s)
        if time_s is not None:
            raise TrafficError(
                f"two balls touch after {time_s:.2f} s in every attempt, expected them "
                "to pass each other"
            )


def _first_touch(
    paths: tuple[list[Phase], list[Phase]], balls: tuple[Ball, Ball], until_s: float
) -> float | None:
    """Return when two balls first touch, or None; exact at any speed.

    Between two events of either ball, their offset is a quadratic in time, and the
    square of their distance a quartic: contact is at a root.
    """
    events = {phase.start_s for path in paths for phase in path} | {until_s}
    times = np.array(sorted(events))
    start, length = times[:-1], np.diff(times)
    first, middle, last = (
        _offset(paths, balls, start + share * length) for share in (0.0, 0.5, 1.0)
    )
    # The parabola through three offsets, for times from 0 to 1 in each interval.
    quadratic = 2.0 * (first - 2.0 * middle + last)
    quadratic[np.abs(quadratic) < _ROUNDING_M] = 0.0
    linear = last - first - quadratic
    reach = (balls[0].diameter_m + balls[1].diameter_m) / 2.0
    way = np.linalg.norm(linear, axis=1) + np.linalg.norm(quadratic, axis=1)
    for number in np.flatnonzero(np.linalg.norm(first, axis=1) - way < reach):
        a, b, c = quadratic[number], linear[number], first[number]
        gap = [a @ a, 2.0 * a @ b, b @ b + 2.0 * a @ c, 2.0 * b @ c, c @ c - reach**2]
        roots = np.roots(gap)
        shares = roots[np.isreal(roots)].real
        touching = shares[(shares >= 0.0) & (shares <= 1.0)].tolist()
        if gap[-1] < 0.0 or touching:
            share = 0.0 if gap[-1] < 0.0 else min(touching)
            return float(start[number] + share * length[number])
    return None


def _offset(
    paths: tuple[list[Phase], list[Phase]],
    balls: tuple[Ball, Ball],
    times: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the offset from the first ball's middle to the second's, (T, 3) m."""
    (one, _), (other, _) = (_evaluate(path, times) for path in paths)
    up = (balls[1].diameter_m - balls[0].diameter_m) / 2.0
    offset: NDArray[np.float64] = other - one + np.array([0.0, 0.0, up])
    return offset


def _evaluate(
    path: list[Phase], times: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return positions (T, 3) m and velocities (T, 3) m/s."""
    starts = np.array([phase.start_s for phase in path])
    # The last of several events at one instant counts.
    owner = np.searchsorted(starts, times, side="right") - 1
    positions, velocities = np.empty((2, len(times), 3))
    for number in np.unique(owner):
        rows = owner == number
        positions[rows], velocities[rows] = path[number].at(times[rows])
    return positions, velocities


def _trajectories(
    paths: list[list[Phase]],
    balls: list[Ball],
    times: NDArray[np.float64],
    traffic_redraws: int,
) -> Trajectories:
    motions = [_evaluate(path, times) for path in paths]
    names = ["target", *(f"ball.{number}" for number in range(1, len(balls)))]
    shape = (len(times), len(balls))
    return Trajectories(
        times=times,
        vehicles=tuple(
            Vehicle(name, "ball", size, size, size, PAINTS[ball.colour])
            for name, ball in zip(names, balls, strict=True)
            for size in [ball.diameter_m]
        ),
        positions=np.stack([positions for positions, _ in motions], axis=1),
        headings=np.zeros(shape),
        pitches=np.zeros(shape),
        speeds=np.stack([np.linalg.norm(v, axis=-1) for _, v in motions], axis=1),
        lanes=np.zeros(shape, dtype=np.int64),
        target=0,
        traffic_redraws=traffic_redraws,
    )
