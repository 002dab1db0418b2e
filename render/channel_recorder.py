"""Depth and optical flow of a sequence, recorded while it is rendered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.flow import View, forward_flow, sample_offset
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.world.scene import FIRST_VEHICLE_ID

__all__ = ["ChannelRecorder"]


@dataclass(slots=True)
class ChannelRecorder:
    """Computes the requested channels frame by frame, holding one frame at most.

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
        frame: RenderedFrame,
        camera: Camera,
        poses: NDArray[np.float64],
        samples: int,
    ) -> None:
        """Add the next frame; frame 0 starts a new sequence.

        Parameters
        ----------
        index : int
        frame : RenderedFrame
            With depth.
        camera : Camera
        poses : (V, 4, 4) float
        samples : int
            Samples a pixel along each axis of the frame.
        """
        if frame.depth is None:
            raise ValueError("channels: expected a frame with depth, got one without")
        if "depth" in self.channels:
            self.keep("depth", index, frame.depth)
        if "flow" not in self.channels:
            return
        middle = slice(samples // 2, None, samples)  # the sample of the depth
        view = View(camera, frame.depth, frame.ids[middle, middle], poses)
        if index > 0 and self._last is not None:
            offset = sample_offset(samples)
            flow = forward_flow(self._last, view, FIRST_VEHICLE_ID, offset)
            for name in ("flow", "occlusions", "invalid"):
                self.keep(name, index - 1, getattr(flow, name))
        self._last = view
