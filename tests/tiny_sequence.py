"""A tiny hand-checkable sequence with every part of the ground truth filled in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.frame import Frame
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence, Truth, VehicleTruth
from simbench.core.trajectories import LaneChange, Vehicle

WIDTH, HEIGHT = 32, 24
LEFT, TOP, SIDE, STEP = 4, 6, 8, 2
"""Position of the block in frame 0, its side and its step per frame, all in px."""


def tiny_sequence(frames: int = 8, *, name: str = "tiny", seed: int = 3) -> Sequence:
    """Return ``frames`` images of a red block on grey that moves right."""
    lefts = LEFT + STEP * np.arange(frames)
    boxes = np.stack(
        [lefts, np.full(frames, TOP), *np.full((2, frames), SIDE)], axis=1
    ).astype(np.float64)
    images = [_image(left) for left in lefts.tolist()]
    times = np.arange(frames) / 25.0
    displacement = np.full(frames, float(STEP))
    displacement[0] = np.nan
    absent = np.zeros(frames, dtype=np.bool_)
    return Sequence(
        name=name,
        frames=[
            Frame(p, float(t), i)
            for i, (p, t) in enumerate(zip(images, times, strict=True))
        ],
        truth=Truth(
            boxes=boxes,
            visible_boxes=boxes.copy(),
            visible_fraction=np.ones(frames),
            absent=absent,
            cut_by_image=boxes[:, 0] + SIDE > WIDTH,
            displacement_px=displacement,
            occluders=("pole", *[""] * (frames - 1)),
            vehicles=_vehicles(boxes, images),
        ),
        width=WIDTH,
        height=HEIGHT,
        seed=seed,
        cameras=tuple(_camera(0.1 * i) for i in range(frames)),
        lane_changes=(LaneChange("target", 0.1, 0.2, 0, 1),),
        requested={"displacement_px": 2.0},
        achieved={"displacement_px": 2.0, "hidden": float("nan")},
        scenario={"name": name, "frames": frames, "dials": {"displacement_px": 2.0}},
        digest="ab" * 32,
        traffic_redraws=1,
        digests={"truth": "cd" * 32},
        made_with={"opengl": "by hand"},
    )


def _camera(sway: float) -> Camera:
    eye, target = (0.0, sway, 6.0), (30.0, 0.0, 0.0)
    return Camera.look_at(eye, target, fov_rad=0.6, width=WIDTH, height=HEIGHT)


def _image(left: int) -> NDArray[np.uint8]:
    rng = np.random.default_rng(left)
    image = rng.integers(110, 130, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    image[TOP : TOP + SIDE, left : left + SIDE] = (200, 20, 10)
    image.flags.writeable = False
    return image


def _vehicles(
    boxes: NDArray[np.float64],
    images: list[NDArray[np.uint8]],
) -> VehicleTruth:
    count = len(boxes)
    amodal = np.stack([boxes, np.full((count, 4), np.nan)], axis=1)
    steps = np.arange(count, dtype=np.float64)
    return VehicleTruth(
        vehicles=(
            Vehicle("target", "car", 4.5, 1.8, 1.5, (200, 20, 10)),
            Vehicle("other", "truck", 7.1, 2.4, 2.4, (0, 0, 255)),
        ),
        ids=np.array([1, 2]),
        boxes=amodal,
        visible_boxes=amodal.copy(),
        visible_px=np.stack([np.full(count, 64.0), np.zeros(count)], axis=1),
        depths=np.stack([20.0 + steps, 40.0 + steps], axis=1),
        positions=np.stack([np.stack([steps, 0 * steps, 0 * steps], 1)] * 2, axis=1),
        headings=np.zeros((count, 2)),
        masks=tuple({1: Mask.from_array(p[..., 0] == 200)} for p in images),
        speeds=np.full((count, 2), 25.0),
    )
