"""Ground-truth optical flow from depth, ids, vehicle motion and camera motion.

The depth of a pixel gives its point on the road or on a vehicle; the vehicle's motion
and the next camera give the projection of that point into the next frame.

Depth and id are known at one sample of each pixel: the central one, or the next one to
the right and below if the number of samples along an axis is even, see `sample_offset`.
The flow is that of the point seen there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera

__all__ = ["Flow", "View", "forward_flow", "sample_offset"]

_TOLERANCE = 2e-3
"""Relative depth by which a point must be behind a surface to count as occluded."""


@dataclass(frozen=True, slots=True)
class View:
    """Camera, depth, ids and vehicle poses of one frame.

    Attributes
    ----------
    camera : Camera
    depth : (H, W) float32, m
        Along the optical axis at one sample in each pixel; infinite in the sky.
    ids : (H, W) int
        Instance id at the same samples.
    poses : (V, 4, 4) float
        Vehicle frames to the road frame; NaN for vehicles that are not on the road.
    """

    camera: Camera
    depth: NDArray[np.float32]
    ids: NDArray[np.uint16]
    poses: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Flow:
    """Optical flow from one frame to the next.

    Attributes
    ----------
    flow : (H, W, 2) float32, px
        Displacement to the right and down, possibly out of the image. NaN where the
        point has no projection into the next frame: it is behind the camera, or its
        vehicle has left the road.
    invalid : (H, W) bool
        The point is outside the next image, or has no projection.
    occlusions : (H, W) bool
        The point is inside the next image, but occluded. Within a pixel of the edge of
        the occluder, it counts as visible.
    """

    flow: NDArray[np.float32]
    invalid: NDArray[np.bool_]
    occlusions: NDArray[np.bool_]


def sample_offset(samples: int) -> float:
    """Return the position of the sample of depth and id, in px from a pixel's corner.

    Parameters
    ----------
    samples : int
        Samples a pixel along each axis.

    Examples
    --------
    >>> [sample_offset(samples) for samples in (1, 2, 3, 4)]
    [0.5, 0.75, 0.5, 0.625]
    """
    return (samples // 2 + 0.5) / samples


def forward_flow(before: View, after: View, first_id: int, offset: float) -> Flow:
    """Return the flow from one frame to the next.

    Parameters
    ----------
    before, after : View
        Of the same size and with the same vehicles.
    first_id : int
        Instance id of vehicle 0; vehicle ``v`` has ``first_id + v``, and objects with
        a lower id are static.
    offset : float, px
        See `sample_offset`.

    Returns
    -------
    Flow
        The sky is infinitely far: only the camera's rotation moves it.
    """
    height, width = before.depth.shape
    rows, columns = np.indices((height, width), dtype=np.float64)
    pixels = np.stack([columns, rows], axis=-1) + offset
    local = _moved(before, after, pixels, first_id)
    ahead = np.where(local[..., 2] > 0.0, local[..., 2], np.nan)
    camera = after.camera
    moved = camera.focal_px * local[..., :2] / ahead[..., None] + camera.matrix[:2, 2]
    with np.errstate(invalid="ignore"):  # NaN is outside
        inside = np.all((moved >= 0.0) & (moved < [width, height]), axis=-1)
    distance = np.where(np.isinf(before.depth), np.inf, ahead)
    corners = np.floor(np.where(inside[..., None], moved, 0.0) - offset)
    visible = _is_visible(after, corners.astype(np.int64), distance, before.ids)
    # Rounded to a millionth of a pixel: static points get a flow of exactly 0.
    flow = np.round(moved - pixels, 6) + 0.0
    return Flow(flow.astype(np.float32), ~inside, inside & ~visible)


def _moved(
    before: View, after: View, pixels: NDArray[np.float64], first_id: int
) -> NDArray[np.float64]:
    """Return the points seen at ``pixels`` in the next camera's frame, (H, W, 3) m."""
    first, second = before.camera, after.camera
    rays = np.ones((*pixels.shape[:2], 3))
    rays[..., :2] = (pixels - first.matrix[:2, 2]) / first.focal_px
    is_sky = np.isinf(before.depth)
    depth = np.where(is_sky, 1.0, before.depth.astype(np.float64))
    points = (depth[..., None] * rays - first.translation) @ first.rotation
    for number in np.unique(before.ids[before.ids >= first_id]).tolist():
        vehicle, mask = number - first_id, before.ids == number
        old, new = before.poses[vehicle], after.poses[vehicle]
        turn = new[:3, :3] @ old[:3, :3].T
        points[mask] = (points[mask] - old[:3, 3]) @ turn.T + new[:3, 3]
    local = second.to_camera(points)
    local[is_sky] = rays[is_sky] @ first.rotation @ second.rotation.T
    return local


def _is_visible(
    after: View,
    corners: NDArray[np.int64],
    distance: NDArray[np.float64],
    ids: NDArray[np.uint16],
) -> NDArray[np.bool_]:
    """Return whether one of four samples around a point shows its object, no nearer.

    The inverse of depth is linear over the image of a plane: a point of a plane is
    beyond all four samples around it only if something is in front.
    """
    height, width = ids.shape
    visible = np.zeros(ids.shape, dtype=np.bool_)
    for down in (0, 1):
        for right in (0, 1):
            row = np.clip(corners[..., 1] + down, 0, height - 1)
            column = np.clip(corners[..., 0] + right, 0, width - 1)
            is_same = after.ids[row, column] == ids
            limit = after.depth[row, column] * (1.0 + _TOLERANCE)
            visible |= is_same & (distance <= limit)
    return visible
