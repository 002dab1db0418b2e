"""Kinematics of a SUMO recording: road positions, headings and lane changes.

SUMO records a position along the road and a lane; position, heading, slope and speed
follow from the road's line, with lane changes smoothed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.trajectories import LaneChange, Trajectories, Vehicle
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.highway.fleet import FLEET, PAINTS, sample_paint
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.seeds import child_generator, generator
from simbench.scenarios.time_step import STEP_S

__all__ = ["gradient", "interpolate", "road_trajectories", "smooth_lane"]


def road_trajectories(
    recording: dict[str, NDArray[Any]],
    scenario: Scenario,
    line: RoadLine,
    seed: int,
    times: NDArray[np.float64],
    *,
    traffic_redraws: int,
) -> Trajectories:
    """Map a recording of SUMO's straight road onto the scenario's road.

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
        Traffic attempts rejected before this one.
    """
    steps = times / STEP_S
    shown = ~np.all(np.isnan(interpolate(recording["front"], steps)), axis=0)
    front, lane = recording["front"][:, shown], recording["lane"][:, shown]
    names: list[str] = recording["names"][shown].tolist()
    root = int(generator(scenario, seed, "looks").integers(2**63))
    vehicles = tuple(_vehicle(name, scenario, root) for name in names)
    changes = _lane_changes(lane, names, times[-1])
    lane = smooth_lane(lane)
    near = np.array([not name.startswith("far.") for name in names])
    forward = np.where(near, 1.0, -1.0)
    lengths = np.array([vehicle.length for vehicle in vehicles])
    along = front - lengths / 2.0 - line.road.before_m
    end = line.road.length_m - line.road.before_m
    along = np.where(near, along, end - line.road.before_m - along)
    lateral = line.lane_lateral(lane) * forward
    turn = np.where(near, 0.0, np.pi)
    heading = line.heading_at(along) + turn + _drift_angle(along, lateral, forward)
    all_positions = line.point(along, lateral)
    positions = interpolate(all_positions, steps)
    lanes = np.rint(np.nan_to_num(interpolate(lane, steps)))
    return Trajectories(
        times=times,
        vehicles=vehicles,
        positions=positions,
        headings=interpolate(heading, steps),
        pitches=interpolate(line.pitch_at(along) * forward, steps),
        speeds=np.linalg.norm(interpolate(gradient(all_positions), steps), axis=-1),
        lanes=np.where(np.isnan(positions[..., 0]), -1, lanes).astype(np.int64),
        target=names.index("target"),
        lane_changes=changes,
        traffic_redraws=traffic_redraws,
    )


def _vehicle(name: str, scenario: Scenario, root: int) -> Vehicle:
    """Return the vehicle behind a name in a recording, with its size and paint."""
    kind: Any
    if name == "target":
        kind, colour = scenario.target.vehicle_class, PAINTS[scenario.target.colour]
    elif name.startswith("stranger."):
        scripted = scenario.strangers[int(name.split(".")[1])]
        kind, colour = scripted.vehicle_class, PAINTS[scripted.colour]
    else:  # a generator for each name: one vehicle more or less repaints no other
        kind = name.rsplit(".", 1)[1]
        colour = sample_paint(kind, child_generator(root, name))
    size = FLEET[kind]
    return Vehicle(name, kind, size.length, size.width, size.height, colour)


def smooth_lane(lane: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smooth SUMO's linear lane-change ramps.

    SUMO moves a vehicle sideways at constant speed between lane centres. The
    fraction of the lane change is mapped through the minimum-jerk polynomial, so that
    lateral speed and acceleration vanish at both ends; no history is needed.

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


def _drift_angle(
    along: NDArray[np.float64],
    lateral: NDArray[np.float64],
    forward: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the angle [rad] between a vehicle's motion and its lane."""
    sideways, onward = gradient(lateral) * forward, gradient(along) * forward
    return np.where(onward > 1.0, np.arctan2(sideways, np.maximum(onward, 1.0)), 0.0)


def interpolate(
    values: NDArray[np.float64], steps: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Interpolate (T, ...) values linearly at fractional steps; NaN stays NaN."""
    low = np.minimum(np.floor(steps + 1e-9).astype(np.int64), len(values) - 2)
    part = np.clip(steps - low, 0.0, 1.0).reshape(-1, *[1] * (values.ndim - 1))
    mixed = values[low] + part * (values[low + 1] - values[low])
    interpolated: NDArray[np.float64] = np.where(part < 1e-9, values[low], mixed)
    return interpolated


def _lane_changes(
    lane: NDArray[np.float64], names: list[str], until_s: float
) -> tuple[LaneChange, ...]:
    """Return the lane changes that start by a time, in order of their starts."""
    changes = []
    for name, track in zip(names, lane.T, strict=True):
        moving = np.abs(track - np.rint(track)) > 1e-6
        edges = np.diff(moving.astype(np.int8), append=0)
        starts = np.flatnonzero(edges == 1)
        stops = np.minimum(np.flatnonzero(edges == -1) + 1, len(track) - 1)
        stops = stops[len(stops) - len(starts) :]  # a change under way has no start
        for start, stop in zip(starts, stops, strict=True):
            origin, goal = track[start], track[stop]
            if np.isnan(goal) or np.isnan(origin) or round(goal) == round(origin):
                continue
            start_s, stop_s = float(start * STEP_S), float(stop * STEP_S)
            if start_s <= until_s:
                lanes = round(float(origin)), round(float(goal))
                changes.append(LaneChange(name, start_s, stop_s, *lanes))
    return tuple(sorted(changes, key=lambda change: (change.start_s, change.vehicle)))
