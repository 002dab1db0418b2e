"""Things in the way: where the scenario's occluders stand in the road frame."""

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
    """An occluder and where it stands.

    Attributes
    ----------
    kind : str
        ``pole``, ``sign``, ``gantry``, ``tree`` or ``lamp``.
    base : (3,) float, m
        Foot in the road frame.
    heading : float, rad
        Which way it stands, counter-clockwise from x: along the road; a sign on the
        line of sight turns its back on the target, to be seen full face.
    width, height : float, m
        Of the part that hides: a pole's diameter, a sign's panel, a tree's crown, a
        gantry's beam (its depth), and the height of the whole.
    sight_height : float or None, m
        Height above the foot at which the line of sight passes; None where the
        occluder was placed on the map.
    panel, rise : float, m
        Height of a sign's panel, and how far its middle is from the line of sight,
        square to its long side.
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
    """Place a scenario's occluders, those on the map before those on the line of sight.

    Raises
    ------
    ScenarioError
        If a line of sight is asked for at a time outside the story, or farther from
        the camera than the target is then.
    """
    return tuple(
        _on_map(occluder, line)
        if occluder.hides_at_s is None
        else _on_sight(number, scenario, line, trajectories, cameras)
        for number, occluder in sorted(
            enumerate(scenario.occluders),
            key=lambda told: told[1].hides_at_s is not None,
        )
    )


def _on_map(occluder: Occluder, line: Line) -> PlacedOccluder:
    along, lateral = occluder.along_m or 0.0, occluder.lateral_m or 0.0
    heading = float(line.heading_at(along))
    base = line.point(along, lateral)
    return PlacedOccluder(
        occluder.kind,
        base,
        heading,
        occluder.width_m,
        occluder.height_m,
        None,
        _panel(occluder),
        0.0,
        occluder.tilt_rad,
    )


def _panel(occluder: Occluder) -> float:
    return 0.7 * occluder.width_m if occluder.panel_m is None else occluder.panel_m


def _on_sight(
    number: int,
    scenario: Scenario,
    line: Line,
    trajectories: Trajectories,
    cameras: tuple[Camera, ...],
) -> PlacedOccluder:
    occluder = scenario.occluders[number]
    at = occluder.hides_at_s or 0.0
    distance = occluder.distance_m or 0.0
    key = f"{scenario.name}: occluders.{number}"
    if at > trajectories.times[-1]:
        raise ScenarioError(
            f"{key}.hides_at_s must be at most {trajectories.times[-1]:.2f} s, the "
            f"last frame, got {at:g}"
        )
    frame = int(np.argmin(np.abs(trajectories.times - at)))
    vehicle = trajectories.vehicles[trajectories.target]
    body = trajectories.positions[frame, trajectories.target].copy()
    body[2] += vehicle.height / 2.0
    eye = cameras[frame].position
    reach = float(np.linalg.norm(body[:2] - eye[:2]))
    before = reach - float(np.hypot(vehicle.length, vehicle.width)) / 2.0
    if distance > before:
        raise ScenarioError(
            f"{key}.distance_m must be less than {before:.1f} m, where the target "
            f"is at {at:g} s, got {distance:g}"
        )
    sight = eye + (body - eye) * (distance / reach)
    along, lateral = line.locate(sight[None])[0]
    base = line.point(along, lateral)
    faces_camera = occluder.kind == "sign"
    view = math.atan2(body[1] - eye[1], body[0] - eye[0])
    return PlacedOccluder(
        occluder.kind,
        base,
        view if faces_camera else float(line.heading_at(along)),
        occluder.width_m,
        occluder.height_m,
        float(sight[2] - base[2]),
        _panel(occluder),
        occluder.rise_m,
        occluder.tilt_rad,
    )
