"""What lies between scene and sensor: glare around lamps, and falling rain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl.pyrender_camera import RenderedFrame
from simbench.render.image.glare import Shining, draw_glare
from simbench.render.image.rain import draw_rain
from simbench.render.world.scene import Scene
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = ["see_through_air"]

_STREET_LIGHT = np.array([0.75, 0.55, 0.33])
_STREET_SHARE, _TAIL_SHARE = 0.3, 0.4
_BY_DAY = 0.35
"""How much lamps that burn in daylight, in fog or rain, dazzle compared with night."""


def see_through_air(
    stage: Stage,
    scene: Scene,
    shot: RenderedFrame,
    poses: NDArray[np.float64],
    present: NDArray[np.bool_],
    frame: int,
    gain: float,
) -> NDArray[np.uint8]:
    """Return a shot as it reaches the sensor; on a clear day, unchanged.

    Parameters
    ----------
    stage : Stage
    scene : Scene
        Of that stage.
    shot : RenderedFrame
        Its ids are read, never changed.
    poses : (V, 4, 4) float
        Vehicle frames to the road frame.
    present : (V,) bool
    frame : int
        Number of the shot: the source of its rain.
    gain : float
        With which the shot was taken.

    Returns
    -------
    (H, W, 3) uint8, RGB
    """
    light, camera, image = scene.light, stage.cameras[frame], shot.image
    if scene.tunnel is not None or light.beams > 0.0 or light.is_thick:
        image = draw_glare(
            image,
            shot.ids,
            camera,
            _shining(scene, camera.position, poses, present, gain),
            haze_per_m=light.haze_per_m,
            wet_id=_ground_id(scene) if light.is_wet else None,
        )
    told = stage.scenario.light
    if told.weather == "rain":
        rng = generator(stage.scenario, stage.seed, "weather", frame)
        velocity = _velocity(stage, frame)
        image = draw_rain(image, told.rain_mm_per_h, camera, velocity, rng)
    return image


def _ground_id(scene: Scene) -> int:
    return next(number for number, kind in scene.labels.items() if kind == "ground")


def _shining(
    scene: Scene,
    eye: NDArray[np.float64],
    poses: NDArray[np.float64],
    present: NDArray[np.bool_],
    gain: float,
) -> Shining:
    """Gather the lamps that shine towards the eye."""
    street = scene.lamps.street
    places, ids = [street], [scene.lamps.ids]
    road_z = [street[:, 2] - scene.lamps.heights]
    light = [np.tile(_STREET_SHARE * _STREET_LIGHT, (len(street), 1))]
    for number, lamps in enumerate(scene.lamps.of_bodies):
        cars = np.flatnonzero(present & (scene.body_of == number))
        for place, colour, ahead in zip(
            lamps.places, lamps.colours, lamps.ahead, strict=True
        ):
            spots = poses[cars, :3, :3] @ place + poses[cars, :3, 3]
            away = eye - spots
            away = away / np.linalg.norm(away, axis=1, keepdims=True)
            facing = np.clip(ahead * np.sum(away * poses[cars, :3, 0], axis=1), 0, 1)
            share = facing**4 if ahead > 0 else _TAIL_SHARE * facing
            places.append(spots)
            light.append(share[:, None] * colour)
            ids.append(scene.ids[cars])
            road_z.append(poses[cars, 2, 3])
    spots = np.concatenate(places)
    dazzle = _dazzle(scene, spots) * gain
    return Shining(
        spots,
        np.concatenate(light) * dazzle[:, None],
        np.concatenate(ids),
        np.concatenate(road_z),
    )


def _dazzle(scene: Scene, spots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much lamps dazzle where they are: by night and in tunnels fully."""
    light = scene.light
    outside = max(light.beams, _BY_DAY * light.lamps if light.is_thick else 0.0)
    if scene.tunnel is None:
        return np.full(len(spots), outside)
    daylight = scene.tunnel.at(spots)[:, 1]
    inside = (1.0 - daylight) * light.factor
    blend: NDArray[np.float64] = daylight * outside + inside
    return blend


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
