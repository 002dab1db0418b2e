"""Sequences of frames with ground truth, generated or recorded."""

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
        Visible instance masks by frame; empty where they were not recorded.
    pitches : (T, V) float or None, rad
        Slope of the road under the vehicle, nose up positive; NaN while off the road.
        None where unknown, as for the next two.
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
        Amodal ``left, top, width, height``: the box around the projection of the whole
        target, occluded parts included, not clipped to the image. NaN where ``absent``,
        and where recorded data do not tell it.
    visible_boxes : (T, 4) float, px
        Box around the visible pixels. NaN where no pixel is visible, or unknown.
    visible_fraction : (T,) float, in [0, 1]
        Visible samples over the samples that the unoccluded target would cover inside
        the image, both at the same sample positions. 0 where absent. NaN where unknown.
    absent : (T,) bool
        No part of the target projects into the image; false where unknown.
    cut_by_image : (T,) bool
        Part of the target projects outside the image.
    displacement_px : (T,) float, px
        Distance between the centres of this and the previous amodal box. NaN in
        frame 0 and next to absent frames.
    occluders : tuple of T str
        Kind of object that occludes most of the target (``pole``, ``tree``, ``gantry``,
        ``vehicle``, ...); empty where none does, ``unknown`` in recorded data.
    vehicles : VehicleTruth or None
        Ground truth for every vehicle; None for data sets that lack it.

    Examples
    --------
    >>> import numpy as np
    >>> from simbench import Truth
    >>> boxes = np.array([[10.0, 20.0, 30.0, 40.0], [13.0, 24.0, 30.0, 40.0]])
    >>> truth = Truth(
    ...     boxes=boxes,
    ...     visible_boxes=boxes,
    ...     visible_fraction=np.array([1.0, 0.5]),
    ...     absent=np.array([False, False]),
    ...     cut_by_image=np.array([False, False]),
    ...     displacement_px=np.array([np.nan, 5.0]),
    ...     occluders=("", "pole"),
    ... )
    >>> truth.visible_fraction.min()
    np.float64(0.5)
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
    """Frames of one target with their ground truth.

    Attributes
    ----------
    name : str
        Scenario name, or the name in the data set it was read from.
    frames : sequence of T Frame
        Lazy: a frame is read on access and not kept.
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
        Dial values requested, and those measured on the images.
    scenario : mapping or None
        The validated scenario it was generated from, as plain data; None for recorded
        data.
    digest : str
        SHA-256, as hex, over the scenario and seed it was generated from, or over the
        files of an evaluated clip; empty where unknown.
    traffic_redraws : int
        Traffic samples rejected before this one.
    digests : mapping from str to str
        SHA-256, as hex, of its ``trajectories``, ``truth``, ``ids`` and ``frames`` as
        generated, see `simbench.generation.digests`; empty where unknown.
    made_with : mapping from str to str
        Versions and devices it was generated with; empty where unknown.
    channels : mapping from str to sequence of arrays
        Arrays recorded beside the images, lazy as well: ``depth`` (H, W) float32, m
        along the optical axis, inf in the sky; ``flow`` (H, W, 2) float32, px to the
        next frame, with the bool masks ``occlusions`` and ``invalid``, all three one
        shorter than the frames. See `simbench.datasets.channels`.
    attributes : mapping from str to (T,) float
        Difficulties of recorded data by frame, such as ``fast_motion``: 1 where it is
        present, 0 where not, NaN where unknown. See `simbench.datasets.attributes`.

    Examples
    --------
    >>> import simbench
    >>> scenario = simbench.load_scenario("smoke").shortened(2)
    >>> sequence = simbench.generate(scenario, seed=0)
    >>> len(sequence), sequence.frames[1].image.shape, sequence.truth.boxes.shape
    (2, (120, 160, 3), (2, 4))
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
    attributes: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def variant(self) -> str:
        """Variant of the scenario it was generated from; empty where it has none."""
        return str((self.scenario or {}).get("variant", ""))

    def __len__(self) -> int:
        """Return the number of frames T."""
        return len(self.frames)
