"""Placement of the scenario's occluders in the road frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import ScenarioError
from simbench.core.trajectories import Trajectories
from simbench.scenarios.geometry.line import Line
from simbench.scenarios.schema import Occluder, Scenario

__all__ = ["PlacedOccluder", "place_occluders"]


@dataclass(frozen=True, slots=True)
class PlacedOccluder:
    """An occluder with its pose in the road frame.

    Attributes
    ----------
    kind : str
        ``pole``, ``sign``, ``gantry``, ``tree`` or ``lamp``.
    base : (3,) float, m
        Foot in the road frame.
    heading : float, rad
        Counter-clockwise from x: along the road; for a sign on the line of sight, from
        the camera to the target, so that the camera sees its full face.
    width, height : float, m
        Width of the occluding part: a pole's diameter, a sign's panel, a tree's crown,
        the depth of a gantry's beam; and height of the whole.
    sight_height : float or None, m
        Height of the line of sight above the foot; None if the occluder was placed in
        road coordinates.
    panel, rise : float, m
        Height of a sign's panel, and distance of its middle from the line of sight,
        perpendicular to its long side.
    tilt : float, rad
        Of a sign's panel, counter-clockwise as seen from behind it.
    """

    kind: str
    base: NDArray[np.float64]
    heading: float
    width: float
    height: float
    sight_height: float | None
    panel: float
    rise: float
    tilt: float


def place_occluders(
    scenario: Scenario,
    line: Line,
    trajectories: Trajectories,
    cameras: tuple[Camera, ...],
) -> tuple[PlacedOccluder, ...]:
    """Place a scenario's occluders, those in road coordinates first.

    Raises
    ------
    ScenarioError
        If the time of a line of sight is after the last frame, or the distance from
        the camera is more than the target's.
    """
    placed = [
        _on_road(occluder, line)
        for occluder in scenario.occluders
        if occluder.hides_at_s is None
    ]
    for number, occluder in enumerate(scenario.occluders):
        if occluder.hides_at_s is not None:
            key = f"{scenario.name}: occluders.{number}"
            placed.append(_on_sight(occluder, key, line, trajectories, cameras))
    return tuple(placed)


def _on_road(occluder: Occluder, line: Line) -> PlacedOccluder:
    along, lateral = occluder.along_m or 0.0, occluder.lateral_m or 0.0
    heading = float(line.heading_at(along))
    return _placed(occluder, line.point(along, lateral), heading, None)


def _on_sight(
    occluder: Occluder,
    key: str,
    line: Line,
    trajectories: Trajectories,
    cameras: tuple[Camera, ...],
) -> PlacedOccluder:
    time = occluder.hides_at_s or 0.0
    distance = occluder.distance_m or 0.0
    last = trajectories.times[-1]
    if time > last:
        raise ScenarioError(
            f"{key}.hides_at_s must be at most {last:.2f} s, the last frame, got "
            f"{time:g}"
        )
    frame = int(np.argmin(np.abs(trajectories.times - time)))
    vehicle = trajectories.vehicles[trajectories.target]
    body = trajectories.positions[frame, trajectories.target].copy()
    body[2] += vehicle.height / 2.0
    eye = cameras[frame].position
    reach = float(np.linalg.norm(body[:2] - eye[:2]))
    limit = reach - float(np.hypot(vehicle.length, vehicle.width)) / 2.0
    if distance > limit:
        raise ScenarioError(
            f"{key}.distance_m must be less than {limit:.1f} m, where the target is "
            f"at {time:g} s, got {distance:g}"
        )
    sight = eye + (body - eye) * (distance / reach)
    along, lateral = line.locate(sight[None])[0]
    base = line.point(along, lateral)
    heading = float(line.heading_at(along))
    if occluder.kind == "sign":
        heading = math.atan2(body[1] - eye[1], body[0] - eye[0])
    return _placed(occluder, base, heading, float(sight[2] - base[2]))


def _placed(
    occluder: Occluder,
    base: NDArray[np.float64],
    heading: float,
    sight_height: float | None,
) -> PlacedOccluder:
    panel = occluder.panel_m
    return PlacedOccluder(
        kind=occluder.kind,
        base=base,
        heading=heading,
        width=occluder.width_m,
        height=occluder.height_m,
        sight_height=sight_height,
        panel=0.7 * occluder.width_m if panel is None else panel,
        rise=occluder.rise_m,
        tilt=occluder.tilt_rad,
    )
