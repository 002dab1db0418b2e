"""Camera path: position and orientation of the camera in every frame."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import ScenarioError
from simbench.core.trajectories import Trajectories
from simbench.scenarios.geometry.line import Line
from simbench.scenarios.schema import CameraSettings, Place, Scenario

__all__ = ["camera_path", "place_points"]


def camera_path(
    scenario: Scenario,
    line: Line,
    trajectories: Trajectories,
    rng: np.random.Generator,
) -> tuple[Camera, ...]:
    """Return the camera of every frame, of those of a scenario the one that films.

    Parameters
    ----------
    scenario : Scenario
    line : Line
    trajectories : Trajectories
        Of the same scenario; a camera that follows or pans depends on its target.
    rng : numpy.random.Generator
        Source of the vibration, and of the phase of the wander.

    Returns
    -------
    tuple of T Camera
    """
    view = scenario.view
    eye_shift, aim_shift = _shifts(view, line, trajectories)
    eyes = place_points(line, view.position, eye_shift)
    aims = place_points(line, view.look_at, aim_shift)
    if np.any(np.linalg.norm(eyes - aims, axis=-1) < 0.1):
        number = scenario.filmed_by
        key = f"cameras.{number - 1}" if number else "camera"
        raise ScenarioError(
            f"{scenario.name}: {key}.look_at must differ from {key}.position"
        )
    # wander first: its phase must not depend on the number of frames
    wander = _wander(view, trajectories.times, rng)
    shake = _shake(scenario, trajectories.times, rng)
    shake[:, :2] += wander
    imaging = scenario.imaging
    cameras = []
    for eye, aim, (right, down, roll) in zip(eyes, aims, shake, strict=True):
        steady = Camera.look_at(
            eye,
            aim,
            fov_rad=view.fov_rad,
            width=imaging.width_px,
            height=imaging.height_px,
            roll_rad=roll,
        )
        turn = _small_rotation(down / steady.focal_px, -right / steady.focal_px)
        rotation = turn @ steady.rotation
        cameras.append(replace(steady, rotation=rotation, translation=-rotation @ eye))
    return tuple(cameras)


def _shifts(
    view: CameraSettings, line: Line, trajectories: Trajectories
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the displacements of camera and aim along the road, (T,) m each."""
    times = trajectories.times
    if view.motion in ("still", "drive"):
        driven = (view.speed_mps or 0.0) * times
        return driven, driven
    target = line.locate(trajectories.positions[:, trajectories.target])[:, 0]
    if view.motion == "pan":
        return np.zeros(len(times)), target
    phase = 2.0 * math.pi * times / view.sway_period_s
    follower = target - view.sway_m * np.sin(phase)
    return follower, follower


def place_points(
    line: Line, place: Place, shift: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return a place, (T, 3) m, displaced along the line by (T,) metres."""
    if place.x_m is not None and place.y_m is not None:
        point = line.map_point(place.x_m, place.y_m, place.height_m)
        return np.tile(point, (len(shift), 1))
    return line.point(place.along_m + shift, place.lateral_m, place.height_m)


def _shake(
    scenario: Scenario, times: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Sample the vibration of the picture: right and down [px], roll [rad], (T, 3).

    A first-order autoregressive process with the correlation time of the vibration,
    sampled at the frames: at low frame rates successive frames are independent.
    """
    view = scenario.view
    noise = rng.standard_normal((len(times), 3))
    keeps = np.exp(-np.diff(times) * view.vibration_hz)
    shake = np.empty_like(noise)
    shake[0] = noise[0]
    for index, keep in enumerate(keeps, start=1):
        fresh = math.sqrt(1.0 - keep**2) * noise[index]
        shake[index] = keep * shake[index - 1] + fresh
    scale = view.vibration_px * _is_shaken(view, times)[:, None]
    # the roll moves a corner by a quarter of the displacement of the middle
    corner = math.hypot(scenario.imaging.width_px, scenario.imaging.height_px) / 2.0
    return scale * shake * [1.0, 1.0, 1.0 / 4.0 / corner]


def _is_shaken(view: CameraSettings, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 1 at the times at which the camera vibrates, else 0; (T,)."""
    if not view.vibration_bursts:
        return np.ones(len(times))
    inside = [
        (times >= one.at_s) & (times <= one.at_s + one.lasts_s)
        for one in view.vibration_bursts
    ]
    shaken: NDArray[np.float64] = np.any(inside, axis=0).astype(np.float64)
    return shaken


def _wander(
    view: CameraSettings, times: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the displacement of the picture by wander: right and down [px], (T, 2).

    The aim moves on an ellipse, so that every frame displaces the picture.
    """
    if view.wander_px == 0:
        return np.zeros((len(times), 2))
    start = rng.uniform(0.0, 2.0 * math.pi)
    phase = start + 2.0 * math.pi * times / view.wander_period_s
    ellipse = np.stack([np.cos(phase), view.wander_shape * np.sin(phase)], axis=-1)
    displacement: NDArray[np.float64] = view.wander_px * ellipse
    return displacement


def _small_rotation(about_x: float, about_y: float) -> NDArray[np.float64]:
    """Return the rotation about the camera's x axis, then its y axis."""
    cx, sx = math.cos(about_x), math.sin(about_x)
    cy, sy = math.cos(about_y), math.sin(about_y)
    first = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    second = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    product: NDArray[np.float64] = second @ first
    return product
