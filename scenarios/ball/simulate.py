"""From a scenario on a floor to trajectories: each seed rolls its balls its own way."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.core.trajectories import Trajectories, Vehicle
from simbench.scenarios.ball.physics import Phase, motion
from simbench.scenarios.highway.fleet import PAINTS
from simbench.scenarios.schema import Ball, Floor, Scenario
from simbench.scenarios.schema.frame_times import frame_times
from simbench.scenarios.schema.seeds import stream

__all__ = ["simulate_balls", "varied"]

_DRAWS = 20
_ROUNDING_M = 1e-9


def varied(ball: Ball, rng: np.random.Generator) -> Ball:
    """Return the ball as one seed has it, see ``Ball.spread``."""
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
    """Let the balls of a scenario roll.

    Parameters
    ----------
    scenario : Scenario
        On a floor. Balls do not feel each other, so draws in which two would touch
        are thrown away.
    seed : int
        Seed of the run; the traffic's stream varies the balls.
    skip : int
        Draws to pass over because they were found unfit later.

    Returns
    -------
    Trajectories
        In the floor's frame: x along, y lateral. A ball's position is the point below
        its middle at the height of its underside. Balls do not spin: their heading
        is 0 whichever way they go, so that no point of them turns when they do.

    Raises
    ------
    TrafficError
        If a wall is too low for a ball, or balls touch in every draw.
    """
    if not isinstance(scenario.road, Floor) or scenario.target.ball is None:
        raise TrafficError(f"{scenario.name}: balls need a floor and a ball to follow")
    told = [scenario.target.ball, *scenario.traffic.balls]
    times = frame_times(scenario, seed)
    problem: TrafficError | None = None
    for attempt in range(skip, skip + _DRAWS):
        rng = np.random.default_rng(stream(scenario, seed, "traffic", attempt))
        balls = [varied(ball, rng) for ball in told]
        try:
            paths = [motion(one, scenario.road.floor, times[-1]) for one in balls]
            _require_apart(paths, balls, times[-1])
        except TrafficError as error:
            problem = error
            continue
        return replace(_filmed(paths, balls, times), traffic_redraws=attempt)
    raise TrafficError(f"{scenario.name}: {problem}")


def _require_apart(paths: list[list[Phase]], balls: list[Ball], until_s: float) -> None:
    for one, other in combinations(range(len(balls)), 2):
        time_s = _first_touch(
            (paths[one], paths[other]), (balls[one], balls[other]), until_s
        )
        if time_s is not None:
            raise TrafficError(
                f"two balls touch after {time_s:.2f} s in every draw, wanted them to "
                "pass each other"
            )


def _first_touch(
    paths: tuple[list[Phase], list[Phase]], balls: tuple[Ball, Ball], until_s: float
) -> float | None:
    """Return when two balls first touch, or None: exact, however fast they are.

    Between two events of either ball, the way from one to the other is a quadratic in
    time, and the square of their distance a quartic: contact is at a root.
    """
    events = {phase.start_s for path in paths for phase in path} | {until_s}
    times = np.array(sorted(events))
    start, length = times[:-1], np.diff(times)
    first, middle, last = (
        _between(paths, balls, start + share * length) for share in (0.0, 0.5, 1.0)
    )
    # The parabola through three places, for times from 0 to 1 in each interval.
    bend = 2.0 * (first - 2.0 * middle + last)
    bend[np.abs(bend) < _ROUNDING_M] = 0.0
    slope = last - first - bend
    reach = (balls[0].diameter_m + balls[1].diameter_m) / 2.0
    way = np.linalg.norm(slope, axis=1) + np.linalg.norm(bend, axis=1)
    for number in np.flatnonzero(np.linalg.norm(first, axis=1) - way < reach):
        a, b, c = bend[number], slope[number], first[number]
        gap = [a @ a, 2.0 * a @ b, b @ b + 2.0 * a @ c, 2.0 * b @ c, c @ c - reach**2]
        roots = np.roots(gap)
        shares = roots[np.isreal(roots)].real
        touching = shares[(shares >= 0.0) & (shares <= 1.0)].tolist()
        if gap[-1] < 0.0 or touching:
            share = 0.0 if gap[-1] < 0.0 else min(touching)
            return float(start[number] + share * length[number])
    return None


def _between(
    paths: tuple[list[Phase], list[Phase]],
    balls: tuple[Ball, Ball],
    times: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the way from the first ball's middle to the second's, (T, 3) m."""
    (one, _), (other, _) = (_sample(path, times) for path in paths)
    up = (balls[1].diameter_m - balls[0].diameter_m) / 2.0
    way: NDArray[np.float64] = other - one + np.array([0.0, 0.0, up])
    return way


def _sample(
    path: list[Phase], times: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places (T, 3) m and velocities (T, 3) m/s."""
    starts = np.array([phase.start_s for phase in path])
    # The last of several events at one instant counts.
    owner = np.searchsorted(starts, times, side="right") - 1
    places, velocities = np.empty((len(times), 3)), np.empty((len(times), 3))
    for number in np.unique(owner):
        mine = owner == number
        places[mine], velocities[mine] = path[number].at(times[mine])
    return places, velocities


def _filmed(
    paths: list[list[Phase]], balls: list[Ball], times: NDArray[np.float64]
) -> Trajectories:
    sampled = [_sample(path, times) for path in paths]
    vehicles = tuple(
        Vehicle(
            f"ball.{number}" if number else "target",
            "ball",
            ball.diameter_m,
            ball.diameter_m,
            ball.diameter_m,
            PAINTS[ball.colour],
        )
        for number, ball in enumerate(balls)
    )
    shape = (len(times), len(balls))
    return Trajectories(
        times=times,
        vehicles=vehicles,
        positions=np.stack([places for places, _ in sampled], axis=1),
        headings=np.zeros(shape),
        pitches=np.zeros(shape),
        speeds=np.stack([np.linalg.norm(v, axis=-1) for _, v in sampled], axis=1),
        lanes=np.zeros(shape, dtype=np.int64),
        target=0,
    )
