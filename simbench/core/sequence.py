"""A filmed sequence: frames and the truth about them, whatever they came from."""

from __future__ import annotations

import collections.abc
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.frame import Frame
from simbench.core.mask import Mask
from simbench.core.trajectories import LaneChange, Vehicle

__all__ = ["Sequence", "Truth", "VehicleTruth"]


@dataclass(frozen=True, slots=True)
class VehicleTruth:
    """Ground truth for all V vehicles over T frames.

    Attributes
    ----------
    vehicles : tuple of V Vehicle
    ids : (V,) int
        Value of the vehicle in instance-id images; unique, above 0, constant over
        the sequence.
    boxes : (T, V, 4) float, px
        Amodal boxes, ``left, top, width, height``, not clipped to the image. NaN where
        the vehicle does not project into the image.
    visible_boxes : (T, V, 4) float, px
        Box around the visible pixels. NaN where none is visible.
    visible_px : (T, V) float, px
        Visible area in pixels of the frame (a multiple of 1 / samples per pixel).
    depths : (T, V) float, m
        Distance of the body's centre along the optical axis. NaN while off the road.
    positions : (T, V, 3) float, m
        Centre of the footprint in the road frame. NaN while off the road.
    headings : (T, V) float, rad
    masks : tuple of T mapping from id to Mask
        Visible instance masks by frame; empty where they were not kept.
    pitches : (T, V) float or None, rad
        Slope of the road under the vehicle, nose up positive; NaN while off the road.
        None where unknown, as are the next two.
    speeds : (T, V) float or None, m/s
        NaN while off the road.
    visible_fraction : (T, V) float or None, in [0, 1]
        As `Truth.visible_fraction`, for every vehicle. 0 where it does not project
        into the image.
    """

    vehicles: tuple[Vehicle, ...]
    ids: NDArray[np.int64]
    boxes: NDArray[np.float64]
    visible_boxes: NDArray[np.float64]
    visible_px: NDArray[np.float64]
    depths: NDArray[np.float64]
    positions: NDArray[np.float64]
    headings: NDArray[np.float64]
    masks: tuple[Mapping[int, Mask], ...] = field(default=(), repr=False)
    pitches: NDArray[np.float64] | None = None
    speeds: NDArray[np.float64] | None = None
    visible_fraction: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth for one target over a sequence of T frames.

    Attributes
    ----------
    boxes : (T, 4) float, px
        Amodal ``left, top, width, height``: the box around the whole target as it
        projects, hidden or not, not clipped to the image. NaN where ``absent``.
    visible_boxes : (T, 4) float, px
        Box around the visible pixels. NaN where no pixel is visible.
    visible_fraction : (T,) float, in [0, 1]
        Visible samples over the samples the target alone would cover inside the
        image, both taken at the same places. 0 where absent. NaN where unknown.
    absent : (T,) bool
        No part of the target projects into the image.
    cut_by_image : (T,) bool
        Part of the target projects outside the image.
    displacement_px : (T,) float, px
        Distance between the centres of this and the previous amodal box. NaN in
        frame 0 and next to absent frames.
    occluders : tuple of T str
        What hides most of the target (``pole``, ``tree``, ``gantry``, ``vehicle``,
        ...); empty where nothing does.
    vehicles : VehicleTruth or None
        The same for every vehicle; None for data sets that lack it.
    """

    boxes: NDArray[np.float64]
    visible_boxes: NDArray[np.float64]
    visible_fraction: NDArray[np.float64]
    absent: NDArray[np.bool_]
    cut_by_image: NDArray[np.bool_]
    displacement_px: NDArray[np.float64]
    occluders: tuple[str, ...]
    vehicles: VehicleTruth | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True)
class Sequence:
    """Frames of one target and the truth about them.

    Attributes
    ----------
    name : str
        Scenario name, or the name in the data set it was read from.
    frames : sequence of T Frame
        Lazy: a frame is read when it is asked for and not kept.
    truth : Truth
    width, height : int, px
        Size of every frame.
    seed : int or None
        Seed it was generated from; None for recorded data.
    cameras : tuple of T Camera
        Empty where unknown.
    lane_changes : tuple of LaneChange
        Empty where unknown.
    requested, achieved : mapping from str to float
        Dials asked for and what the pictures show.
    scenario : mapping or None
        The validated scenario, as plain data, that made it; None for recorded data.
    digest : str
        SHA-256, as hex, over the scenario and seed that made it; empty for recorded
        data.
    traffic_redraws : int
        Traffic draws thrown away before this one.
    digests : mapping from str to str
        SHA-256, as hex, of its ``trajectories``, ``truth``, ``ids`` and ``frames`` as
        they were made, see `simbench.generation.digests`; empty where unknown.
    made_with : mapping from str to str
        Versions and devices that made it; empty where unknown.
    channels : mapping from str to sequence of arrays
        What was recorded beside the pictures, lazy as they are: ``depth`` (H, W)
        float32, m along the optical axis, inf in the sky; ``flow`` (H, W, 2) float32,
        px to the next frame, with the bool masks ``occlusions`` and ``invalid``, all
        three one shorter than the frames. See `simbench.datasets.channels`.
    """

    name: str
    frames: collections.abc.Sequence[Frame]
    truth: Truth
    width: int
    height: int
    seed: int | None = None
    cameras: tuple[Camera, ...] = ()
    lane_changes: tuple[LaneChange, ...] = ()
    requested: Mapping[str, float] = field(default_factory=dict)
    achieved: Mapping[str, float] = field(default_factory=dict)
    scenario: Mapping[str, Any] | None = None
    digest: str = ""
    traffic_redraws: int = 0
    digests: Mapping[str, str] = field(default_factory=dict)
    made_with: Mapping[str, str] = field(default_factory=dict)
    channels: Mapping[str, collections.abc.Sequence[NDArray[Any]]] = field(
        default_factory=dict
    )

    @property
    def variant(self) -> str:
        """Which of several scenarios of one name made it; empty where there is one."""
        return str((self.scenario or {}).get("variant", ""))

    def __len__(self) -> int:
        """Return the number of frames T."""
        return len(self.frames)
