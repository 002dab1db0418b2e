"""The scene's light as the shaders take it: what they must know, and the numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.gl.textures import MapTexture
from simbench.render.world.lamplight import LampMap
from simbench.render.world.scene import Scene

__all__ = ["Lighting"]

_LAMP_UNIT, _COVER_UNIT = 2, 3


class Lighting:
    """Light, lamps and tunnel of a scene on the graphics device.

    Attributes
    ----------
    defines : tuple of str
        What the scene's shaders must be compiled for.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        light, tunnel = scene.light, scene.tunnel
        self._lamps: LampMap | None = None
        self._lamp_texture: MapTexture | None = None
        self._cover: MapTexture | None = None
        defines = []
        if light.is_thick:
            defines.append("THICK_AIR")
        if light.is_wet:
            defines.append("WET")
        if light.beams > 0.0 or tunnel is not None:
            defines.append("LAMPLIT")
            self._lamps = LampMap(scene.lamps)
            texels = self._lamps.texels
            self._lamp_texture = MapTexture(texels, _LAMP_UNIT, edge=False)
        if tunnel is not None:
            defines.append("TUNNEL")
            self._cover = MapTexture(tunnel.cover, _COVER_UNIT, edge=True)
        self.defines = tuple(defines)

    def uniforms(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        gain: float,
    ) -> dict[str, Any]:
        """Return what the shaders need for one picture, and bind the maps.

        Parameters
        ----------
        camera : Camera
        poses : (V, 4, 4) float
            Vehicle frames to the road frame.
        present : (V,) bool
        gain : float
            Brightens all light.
        """
        light = self._scene.light
        if gain != 1.0:
            light = light.brightened(gain)
        given: dict[str, Any] = {
            "eye": camera.position,
            "to_sun": light.to_sun,
            "sun": light.sun,
            "ambient": light.ambient,
            "ground": light.ground,
            "zenith": light.zenith,
            "horizon": light.horizon,
            "glow": light.glow,
            "haze": light.haze_per_m,
            "lamps": light.lamps,
        }
        if self._lamps is not None and self._lamp_texture is not None:
            self._lamps.light(camera, self._beams(camera, poses, present))
            self._lamp_texture.write(self._lamps.texels)
            given |= {
                "lamp_map": _LAMP_UNIT,
                "to_lamp_map": self._lamps.to_map,
                "lamp_axis": self._lamps.axis,
                "beams": light.beams,
            }
        tunnel = self._scene.tunnel
        if tunnel is not None and self._cover is not None:
            self._cover.bind()
            eye_along = float(tunnel.at(camera.position[None])[0, 0])
            given |= {
                "cover_map": _COVER_UNIT,
                "to_cover": tunnel.to_map,
                "tunnel": np.array([tunnel.from_m, tunnel.to_m, eye_along]),
                "under": tunnel.under_m,
                "tunnel_lamps": light.factor,
            }
        return given

    def _beams(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        """Return place, heading and half length of all that has head lamps."""
        rows = [np.zeros((0, 4))]
        for number, lamps in enumerate(self._scene.lamps.of_bodies):
            if not len(lamps.places):
                continue
            here = poses[present & (self._scene.body_of == number)]
            heading = np.arctan2(here[:, 1, 0], here[:, 0, 0])
            half = np.full(len(here), np.abs(lamps.places[:, 0]).max())
            rows.append(np.column_stack([here[:, :2, 3], heading, half]))
        if self._scene.lamps.on_camera:
            look = camera.rotation[2]
            place = [*camera.position[:2], math.atan2(look[1], look[0]), 0.0]
            rows.append(np.array([place]))
        return np.concatenate(rows)

    def delete(self) -> None:
        """Free the maps."""
        for texture in (self._lamp_texture, self._cover):
            if texture is not None:
                texture.delete()
