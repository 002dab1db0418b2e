"""From a scenario on a floor to trajectories: each seed rolls its balls its own way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simbench.errors import TrafficError
from simbench.scenarios.clock import frame_times
from simbench.scenarios.fleet import PAINTS
from simbench.scenarios.physics import Phase, motion
from simbench.scenarios.schema import Ball, Floor, Scenario
from simbench.scenarios.seeds import stream
from simbench.trajectories import Trajectories, Vehicle

__all__ = ["roll_balls", "varied"]

_DRAWS = 20


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


def roll_balls(scenario: Scenario, seed: int, *, skip: int = 0) -> Trajectories:
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
        its middle at the height of its underside.

    Raises
    ------
    TrafficError
        If balls fly over a wall, or touch in every draw.
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
        return replace(_filmed(paths, balls, times), redraws=attempt)
    raise TrafficError(f"{scenario.name}: {problem}")


def _require_apart(paths: list[list[Phase]], balls: list[Ball], until_s: float) -> None:
    times = np.arange(0.0, until_s + 0.01, 0.01)
    middles = [
        _sample(path, times)[0] + [0.0, 0.0, ball.diameter_m / 2.0]
        for path, ball in zip(paths, balls, strict=True)
    ]
    for one in range(len(balls)):
        for other in range(one):
            gap = np.linalg.norm(middles[one] - middles[other], axis=-1)
            close = gap < (balls[one].diameter_m + balls[other].diameter_m) / 2.0
            if close.any():
                raise TrafficError(
                    f"two balls touch after {times[close.argmax()]:.2f} s in every "
                    "draw, wanted them to pass each other"
                )


def _sample(
    path: list[Phase], times: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return places (T, 3) m, velocities (T, 3) m/s and headings (T,) rad."""
    starts = np.array([phase.start_s for phase in path])
    # The last of several events at one instant counts.
    owner = np.searchsorted(starts, times, side="right") - 1
    places, velocities = np.empty((len(times), 3)), np.empty((len(times), 3))
    for number in np.unique(owner):
        mine = owner == number
        places[mine], velocities[mine] = path[number].at(times[mine])
    headings = np.array([phase.heading for phase in path])[owner]
    return places, velocities, headings


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
        positions=np.stack([places for places, _, _ in sampled], axis=1),
        headings=np.stack([headings for _, _, headings in sampled], axis=1),
        pitches=np.zeros(shape),
        speeds=np.stack([np.linalg.norm(v, axis=-1) for _, v, _ in sampled], axis=1),
        lanes=np.zeros(shape, dtype=np.int64),
        target=0,
    )
