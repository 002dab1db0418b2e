"""Depth and optical flow of a film, recorded beside the pictures for who asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.flow import View, forward_flow, sample_place
from simbench.render.gl.pyrender_camera import RenderedFrame
from simbench.render.world.scene import FIRST_VEHICLE_ID

__all__ = ["ChannelRecorder"]


@dataclass(slots=True)
class ChannelRecorder:
    """Turns shots into the channels asked for, holding one frame at most.

    Attributes
    ----------
    channels : tuple of str
        ``depth``, ``flow``.
    keep : callable of (name, index, array)
        Takes each finished array: ``depth`` (H, W) float32 in m; and, for all frames
        but the last, ``flow`` (H, W, 2) float32 in px, ``occlusions`` and ``invalid``
        (H, W) bool, see `simbench.render.flow.Flow`.
    """

    channels: tuple[str, ...]
    keep: Callable[[str, int, NDArray[Any]], None]
    _last: View | None = field(default=None, init=False)

    def add(
        self,
        index: int,
        shot: RenderedFrame,
        camera: Camera,
        poses: NDArray[np.float64],
        samples: int,
    ) -> None:
        """Take in the next frame; frame 0 begins anew.

        Parameters
        ----------
        index : int
        shot : RenderedFrame
            Taken with depth.
        camera : Camera
        poses : (V, 4, 4) float
        samples : int
            Samples a pixel along each axis of the shot.
        """
        if shot.depth is None:
            raise ValueError("channels need a shot with depth")
        if "depth" in self.channels:
            self.keep("depth", index, shot.depth)
        if "flow" not in self.channels:
            return
        middle = slice(samples // 2, None, samples)  # the sample that depth is read at
        view = View(camera, shot.depth, shot.ids[middle, middle], poses)
        if index > 0 and self._last is not None:
            place = sample_place(samples)
            found = forward_flow(self._last, view, FIRST_VEHICLE_ID, place)
            for name in ("flow", "occlusions", "invalid"):
                self.keep(name, index - 1, getattr(found, name))
        self._last = view
