"""How far vehicles and their shadows reach, in the scene and in a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.gl.ground_height import GroundHeight
from simbench.render.gl.shadow_fit import ShadowFit
from simbench.render.gl.still_view import shadow_ends, windows_around
from simbench.render.world.scene import Scene

__all__ = ["VehicleBounds"]

_SIDES = np.indices((2, 2, 2)).reshape(3, 8).T  # the corners of a box


class VehicleBounds:
    """Boxes and spheres around the vehicles of a scene.

    Attributes
    ----------
    reach : (V,) float, m
        Radius of the sphere around each vehicle's origin.
    """

    def __init__(self, scene: Scene) -> None:
        self._to_sun = scene.light.to_sun
        self._has_shadows = scene.light.shadows
        self._ground = GroundHeight(scene.ground)
        reach = [np.linalg.norm(mesh.positions, axis=1).max() for mesh in scene.bodies]
        self.reach = np.array(reach, dtype=np.float64)[scene.body_of]
        ends = [
            (m.positions.min(axis=0), m.positions.max(axis=0)) for m in scene.bodies
        ]
        corners = np.asarray(ends, np.float64)[:, _SIDES, np.arange(3)]
        self._corners = corners[scene.body_of]
        self._tops = self._corners[..., 2].max(axis=1)

    def ground_m(self, camera: Camera) -> float:
        """Return about the height of the ground below a camera, in m."""
        return self._ground.at(camera.position)

    def corners(
        self,
        poses: NDArray[np.float64],
        which: NDArray[np.int64],
        room_m: NDArray[np.float64] | float = 0.0,
    ) -> NDArray[np.float64]:
        """Return corners of the boxes of N vehicles, (N, 8, 3) m, in the road frame.

        Parameters
        ----------
        poses : (V, 4, 4) float
        which : (N,) int
        room_m : (N,) float or float, m
            By which the boxes are larger on every side.
        """
        room = np.reshape(room_m, (-1, 1, 1)) * (2.0 * _SIDES - 1.0)
        corners = self._corners[which] + room
        placed: NDArray[np.float64] = corners @ poses[which, :3, :3].transpose(0, 2, 1)
        placed += poses[which, None, :3, 3]
        return placed

    def windows_and_casters(
        self,
        camera: Camera,
        clip: NDArray[np.float64],
        size: tuple[int, int],
        fit: ShadowFit,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
    ) -> tuple[NDArray[np.int64], list[NDArray[np.bool_]]]:
        """Return the vehicles' windows, and which cast shadows in each map.

        The windows, (V, 4), hold all samples of a picture, of ``size`` columns and
        rows, that vehicles and their shadows change; those that change none cast no
        shadow.
        """
        casts = self._casts(camera, fit, poses, present)
        which = np.flatnonzero(present)
        coarse, fine = fit.texels_m[-1], fit.texels_m[0]
        room = 3.0 * np.where(casts[-1], coarse, fine)[which] + 0.02  # for soft edges
        points = self.corners(poses, which, room)
        if self._has_shadows:
            reach, slope = self.reach[which] + room, self._to_sun[2] / self._flat
            middles = poses[which, :3, 3]
            lowest = self._ground.below_shadows(middles, reach, slope)
            ends = shadow_ends(points, self._to_sun, lowest)
            points = np.concatenate([points, ends], axis=1)
        windows = np.zeros((len(poses), 4), np.int64)
        windows[which] = windows_around(clip, points, *size)
        return windows, [each & (windows[:, 2] > 0) for each in casts]

    def _casts(
        self,
        camera: Camera,
        fit: ShadowFit,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
    ) -> list[NDArray[np.bool_]]:
        """Return which vehicles may cast shadows into the distances of each map."""
        away = np.linalg.norm(poses[:, :3, 3] - camera.position, axis=1)
        reach = self.reach + 1.5 * self._tops * self._flat / self._to_sun[2]
        if not fit.near_m:
            return [present]
        is_near = away - reach < fit.near_m
        return [present & is_near, present & (away + reach > fit.near_m)]

    @property
    def _flat(self) -> float:
        """Length of the horizontal part of the vector to the sun."""
        return float(np.hypot(self._to_sun[0], self._to_sun[1]))
