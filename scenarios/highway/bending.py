"""From SUMO's straight lanes onto the real road, smoothly.

SUMO tells place along the road and lane; position, heading, slope and speed follow from
the road's line, with lane changes rounded off.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.trajectories import LaneChange, Trajectories, Vehicle
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.highway.fleet import FLEET, PAINTS, sample_paint
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.seeds import generator, offspring

__all__ = ["STEP_S", "bend", "gradient", "sample", "smooth_lane"]

STEP_S = 0.04
"""Time between rows of a recording in seconds; SUMO counts whole milliseconds."""


def bend(
    recording: dict[str, NDArray[Any]],
    scenario: Scenario,
    line: RoadLine,
    seed: int,
    times: NDArray[np.float64],
    *,
    traffic_redraws: int,
) -> Trajectories:
    """Put a recording of SUMO's straight road onto the scenario's road.

    Parameters
    ----------
    recording : dict
        ``names`` (V,) str, ``front`` (T, V) m along SUMO's road and ``lane`` (T, V), a
        lane coordinate whose whole numbers are lane centres; NaN while off the road.
        One row every `STEP_S`.
    scenario : Scenario
    line : RoadLine
    seed : int
        Seed of the run, for the paints.
    times : (T,) float, s
        Of the kept frames.
    traffic_redraws : int
        Draws thrown away before this one.
    """
    at = times / STEP_S
    shown = ~np.all(np.isnan(sample(recording["front"], at)), axis=0)
    front, lane = recording["front"][:, shown], recording["lane"][:, shown]
    names: list[str] = recording["names"][shown].tolist()
    kinds = [_kind(name, scenario) for name in names]
    near = np.array([not name.startswith("far.") for name in names])
    lengths = np.array([FLEET[kind].length for kind in kinds])
    changes = _lane_changes(lane, names, times[-1])
    lane = smooth_lane(lane)
    along = front - lengths / 2.0 - line.road.before_m
    end = line.road.length_m - line.road.before_m
    along = np.where(near, along, end - line.road.before_m - along)
    lateral = line.lane_lateral(lane) * np.where(near, 1.0, -1.0)
    places = line.point(along, lateral)
    turn = np.where(near, 0.0, np.pi)
    heading = line.heading_at(along) + turn + _drift(along, lateral, near)
    pitch = line.pitch_at(along) * np.where(near, 1.0, -1.0)
    velocity = gradient(places)
    looks = generator(scenario, seed, "looks")
    sampled = sample(places, at)
    present = ~np.isnan(sampled[..., 0])
    lanes = np.where(present, np.rint(np.nan_to_num(sample(lane, at))), -1)
    return Trajectories(
        times=times,
        vehicles=_vehicles(names, kinds, scenario, looks),
        positions=sampled,
        headings=sample(heading, at),
        pitches=sample(pitch, at),
        speeds=np.linalg.norm(sample(velocity, at), axis=-1),
        lanes=lanes.astype(np.int64),
        target=names.index("target"),
        lane_changes=changes,
        traffic_redraws=traffic_redraws,
    )


def _kind(name: str, scenario: Scenario) -> Any:
    if name == "target":
        return scenario.target.vehicle_class
    if name.startswith("stranger."):
        return scenario.strangers[int(name.split(".")[1])].vehicle_class
    return name.rsplit(".", 1)[1]


def _vehicles(
    names: list[str], kinds: list[Any], scenario: Scenario, looks: np.random.Generator
) -> tuple[Vehicle, ...]:
    root, vehicles = int(looks.integers(2**63)), []
    for name, kind in zip(names, kinds, strict=True):
        build = FLEET[kind]
        if name == "target":
            colour = PAINTS[scenario.target.colour]
        elif name.startswith("stranger."):
            colour = PAINTS[scenario.strangers[int(name.split(".")[1])].colour]
        else:  # by its name: one vehicle more or less paints no other
            colour = sample_paint(kind, offspring(root, name))
        vehicles.append(
            Vehicle(name, kind, build.length, build.width, build.height, colour)
        )
    return tuple(vehicles)


def smooth_lane(lane: NDArray[np.float64]) -> NDArray[np.float64]:
    """Round off SUMO's straight lane-change ramps.

    SUMO moves a vehicle sideways at constant speed between lane centres. The
    fraction of the way is mapped through the minimum-jerk polynomial, so that lateral
    speed and acceleration vanish at both ends; no history is needed.

    Parameters
    ----------
    lane : (...) float
        Lane coordinate: whole numbers are lane centres.

    Returns
    -------
    (...) float

    References
    ----------
    Flash and Hogan (1985), "The coordination of arm movements", J. Neuroscience 5(7).

    Examples
    --------
    >>> smooth_lane(np.array([1.0, 1.25, 1.5, 2.0])).round(3).tolist()
    [1.0, 1.104, 1.5, 2.0]
    """
    whole = np.floor(lane + 1e-9)
    part = np.clip(lane - whole, 0.0, 1.0)
    eased: NDArray[np.float64] = whole + part**3 * (10.0 + part * (-15.0 + 6.0 * part))
    return eased


def gradient(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rate of change along axis 0 per second; one-sided next to NaN."""
    step = np.diff(values, axis=0) / STEP_S
    pad = np.full((1, *values.shape[1:]), np.nan)
    before = np.concatenate([pad, step])
    after = np.concatenate([step, pad])
    before = np.where(np.isnan(before), after, before)
    after = np.where(np.isnan(after), before, after)
    mean: NDArray[np.float64] = (before + after) / 2.0
    return mean


def _drift(
    along: NDArray[np.float64], lateral: NDArray[np.float64], near: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the angle [rad] between a vehicle's motion and its lane."""
    forward = np.where(near, 1.0, -1.0)
    sideways, onward = gradient(lateral) * forward, gradient(along) * forward
    return np.where(onward > 1.0, np.arctan2(sideways, np.maximum(onward, 1.0)), 0.0)


def sample(values: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate (T, ...) values linearly at fractional steps; NaN stays NaN."""
    low = np.minimum(np.floor(at + 1e-9).astype(np.int64), len(values) - 2)
    part = np.clip(at - low, 0.0, 1.0).reshape(-1, *[1] * (values.ndim - 1))
    mixed = values[low] + part * (values[low + 1] - values[low])
    sampled: NDArray[np.float64] = np.where(part < 1e-9, values[low], mixed)
    return sampled


def _lane_changes(
    lane: NDArray[np.float64], names: list[str], until_s: float
) -> tuple[LaneChange, ...]:
    changes = []
    for column, name in enumerate(names):
        track = lane[:, column]
        moving = np.abs(track - np.rint(track)) > 1e-6
        edges = np.flatnonzero(np.diff(moving.astype(np.int8)))
        starts = [edge for edge in edges if moving[edge + 1]]
        for start in starts:
            later = edges[edges > start]
            stop = int(later[0]) + 1 if len(later) else len(track) - 1
            origin, goal = track[start], track[stop]
            if np.isnan(goal) or np.isnan(origin) or round(goal) == round(origin):
                continue
            if start * STEP_S <= until_s:
                changes.append(
                    LaneChange(
                        name,
                        float(start * STEP_S),
                        float(stop * STEP_S),
                        round(float(origin)),
                        round(float(goal)),
                    )
                )
    return tuple(sorted(changes, key=lambda change: (change.start_s, change.vehicle)))
