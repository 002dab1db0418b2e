"""Which vehicles are drawn with few triangles: those that are small in the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.world.projection import NEAR_M

__all__ = ["SMALL_PX", "DetailLevels"]

SMALL_PX = 20.0
"""Height in the picture below which the simplified body is drawn."""
_HYSTERESIS = 0.1
"""A vehicle changes its body once its height is this share beyond the limit."""


class DetailLevels:
    """The level of detail of each vehicle over the frames of a film.

    A vehicle changes its level only when it has clearly left the range of the other,
    so that it does not flicker between them: its level follows from its own heights in
    the frames so far.

    Parameters
    ----------
    heights_m : (V,) float, m
        Of the vehicles.

    Attributes
    ----------
    is_simple : (V,) bool
        Which vehicles are drawn with their simplified bodies; none before the first
        frame.
    """

    def __init__(self, heights_m: NDArray[np.float64]) -> None:
        self._heights_m = heights_m
        self._is_seen = np.zeros(len(heights_m), np.bool_)
        self.is_simple = np.zeros(len(heights_m), np.bool_)

    def update(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
    ) -> None:
        """Set the levels for the next frame.

        Parameters
        ----------
        camera : Camera
        poses : (V, 4, 4) float
            Vehicle frames to the road frame.
        present : (V,) bool
            Which vehicles are on the road; the others keep their levels.
        """
        depth = camera.to_camera(poses[present, :3, 3])[:, 2]
        height_px = (
            camera.focal_px * self._heights_m[present] / np.maximum(depth, NEAR_M)
        )
        was_simple, is_seen = self.is_simple[present], self._is_seen[present]
        margin = np.where(is_seen, _HYSTERESIS * np.where(was_simple, 1.0, -1.0), 0.0)
        self.is_simple = self.is_simple.copy()
        self.is_simple[present] = height_px < SMALL_PX * (1.0 + margin)
        self._is_seen[present] = True
