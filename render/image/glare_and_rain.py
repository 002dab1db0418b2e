"""Effects of air and lens on a rendered image: glare of lamps, and falling rain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.image.glare import VisibleLamps, draw_glare
from simbench.render.image.rain import draw_rain
from simbench.render.world.scene import Scene
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = ["add_glare_and_rain"]

_STREET_LIGHT = np.array([0.75, 0.55, 0.33])
_STREET_SHARE, _TAIL_SHARE = 0.3, 0.4
_DAYLIGHT_SHARE = 0.35
"""Glare of lamps by day, in fog or rain, as a share of that at night."""


def add_glare_and_rain(
    stage: Stage,
    scene: Scene,
    rendered: RenderedFrame,
    poses: NDArray[np.float64],
    present: NDArray[np.bool_],
    frame: int,
    gain: float,
) -> NDArray[np.uint8]:
    """Return the image of a rendered frame with glare and rain, if the scene has any.

    Parameters
    ----------
    stage : Stage
    scene : Scene
        Of that stage.
    rendered : RenderedFrame
        Not written into.
    poses : (V, 4, 4) float
        Vehicle frames to the road frame.
    present : (V,) bool
    frame : int
        Index of the frame, which seeds its rain.
    gain : float
        With which the frame was rendered.

    Returns
    -------
    (H, W, 3) uint8, RGB
    """
    light, camera, image = scene.light, stage.cameras[frame], rendered.image
    if scene.tunnel is not None or light.beams > 0.0 or light.is_thick:
        ground_id = next(n for n, kind in scene.labels.items() if kind == "ground")
        image = draw_glare(
            image,
            rendered.ids,
            camera,
            _visible_lamps(scene, camera.position, poses, present, gain),
            haze_per_m=light.haze_per_m,
            wet_id=ground_id if light.is_wet else None,
        )
    settings = stage.scenario.light
    if settings.weather == "rain":
        rng = generator(stage.scenario, stage.seed, "weather", frame)
        velocity = _velocity(stage, frame)
        image = draw_rain(image, settings.rain_mm_per_h, camera, velocity, rng)
    return image


def _visible_lamps(
    scene: Scene,
    eye: NDArray[np.float64],
    poses: NDArray[np.float64],
    present: NDArray[np.bool_],
    gain: float,
) -> VisibleLamps:
    """Collect street and vehicle lamps with their light towards the eye."""
    street = scene.lamps.street
    positions, ids = [street], [scene.lamps.ids]
    road_z = [street[:, 2] - scene.lamps.heights]
    light = [np.tile(_STREET_SHARE * _STREET_LIGHT, (len(street), 1))]
    for number, lamps in enumerate(scene.lamps.by_body):
        cars = np.flatnonzero(present & (scene.body_of == number))
        if not len(cars):
            continue
        for position, colour, ahead in zip(
            lamps.positions, lamps.colours, lamps.ahead, strict=True
        ):
            points = poses[cars, :3, :3] @ position + poses[cars, :3, 3]
            away = eye - points
            away = away / np.linalg.norm(away, axis=1, keepdims=True)
            facing = np.clip(ahead * np.sum(away * poses[cars, :3, 0], axis=1), 0, 1)
            share = facing**4 if ahead > 0 else _TAIL_SHARE * facing
            positions.append(points)
            light.append(share[:, None] * colour)
            ids.append(scene.ids[cars])
            road_z.append(poses[cars, 2, 3])
    points = np.concatenate(positions)
    strength = _glare_strength(scene, points) * gain
    return VisibleLamps(
        points,
        np.concatenate(light) * strength[:, None],
        np.concatenate(ids),
        np.concatenate(road_z),
    )


def _glare_strength(scene: Scene, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the glare of lamps at (N, 3) points: at night and in tunnels full."""
    light = scene.light
    outside = max(light.beams, _DAYLIGHT_SHARE * light.lamps if light.is_thick else 0.0)
    if scene.tunnel is None:
        return np.full(len(points), outside)
    daylight = scene.tunnel.sample(points)[:, 1]
    inside = (1.0 - daylight) * light.factor
    strength: NDArray[np.float64] = daylight * outside + inside
    return strength


def _velocity(stage: Stage, frame: int) -> NDArray[np.float64]:
    """Return the camera's velocity [m/s] around a frame."""
    last = len(stage.cameras) - 1
    first, second = max(frame - 1, 0), min(frame + 1, last)
    elapsed = stage.trajectories.times[second] - stage.trajectories.times[first]
    if elapsed <= 0.0:
        return np.zeros(3)
    moved = stage.cameras[second].position - stage.cameras[first].position
    velocity: NDArray[np.float64] = moved / elapsed
    return velocity
