"""Lighting of a scene for the shaders: their defines, uniforms and light maps."""

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
        Preprocessor names for which to compile the scene's shaders.
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
        if scene.is_lamplit:
            defines.append("LAMPLIT")
            self._lamps = LampMap(scene.lamps)
            texels = self._lamps.texels
            self._lamp_texture = MapTexture(texels, _LAMP_UNIT, edge=False)
        if tunnel is not None:
            defines.append("TUNNEL")
            self._cover = MapTexture(tunnel.cover, _COVER_UNIT, edge=True)
        self.defines = tuple(defines)

    @property
    def moves(self) -> bool:
        """Whether light moves with the vehicles: that of their lamps."""
        return self._lamps is not None

    def uniforms(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        gain: float,
    ) -> dict[str, Any]:
        """Return the uniforms of the shaders for one image, and bind the maps.

        Parameters
        ----------
        camera : Camera
        poses : (V, 4, 4) float
            Vehicle frames to the road frame.
        present : (V,) bool
        gain : float
            Factor on all light.
        """
        light = self._scene.light
        if gain != 1.0:
            light = light.brightened(gain)
        same_name = "to_sun sun ambient ground zenith horizon glow lamps".split()
        uniforms: dict[str, Any] = {name: getattr(light, name) for name in same_name}
        uniforms |= {"eye": camera.position, "haze": light.haze_per_m}
        if self._lamps is not None and self._lamp_texture is not None:
            self._lamps.update(camera, self._beams(camera, poses, present))
            self._lamp_texture.write(self._lamps.texels)
            uniforms |= {
                "lamp_map": _LAMP_UNIT,
                "to_lamp_map": self._lamps.to_map,
                "lamp_axis": self._lamps.axis,
                "beams": light.beams,
            }
        tunnel = self._scene.tunnel
        if tunnel is not None and self._cover is not None:
            self._cover.bind()
            eye_along = float(tunnel.sample(camera.position[None])[0, 0])
            uniforms |= {
                "cover_map": _COVER_UNIT,
                "to_cover": tunnel.to_map,
                "tunnel": np.array([tunnel.from_m, tunnel.to_m, eye_along]),
                "under": tunnel.roof_m,
                "tunnel_lamps": light.factor,
            }
        return uniforms

    def _beams(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        """Return position, heading and half length of all vehicles with head lamps."""
        rows = [np.zeros((0, 4))]
        for number, lamps in enumerate(self._scene.lamps.by_body):
            if not len(lamps.positions):
                continue
            chosen = poses[present & (self._scene.body_of == number)]
            heading = np.arctan2(chosen[:, 1, 0], chosen[:, 0, 0])
            half = np.full(len(chosen), np.abs(lamps.positions[:, 0]).max())
            rows.append(np.column_stack([chosen[:, :2, 3], heading, half]))
        if self._scene.lamps.on_camera:
            look = camera.rotation[2]
            heading = math.atan2(look[1], look[0])
            rows.append(np.array([[*camera.position[:2], heading, 0.0]]))
        return np.concatenate(rows)

    def delete(self) -> None:
        """Free the maps."""
        for texture in (self._lamp_texture, self._cover):
            if texture is not None:
                texture.delete()
