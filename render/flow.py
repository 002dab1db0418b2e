"""Optical flow from geometry: where every point of one picture is in the next.

Nothing is estimated. A pixel's depth gives its point on the road or on a vehicle; the
vehicle's motion and the next camera say where that point goes.

Depth and id are known at one sample in each pixel: that in its middle, or right below
and beside it where the number of samples an axis is even, see `sample_place`. The flow
is that of the point seen there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera

__all__ = ["Flow", "View", "forward_flow", "sample_place"]

_TOLERANCE = 2e-3
"""Relative depth by which a point must lie behind what is drawn to count as hidden."""


@dataclass(frozen=True, slots=True)
class View:
    """One frame, as far as the flow needs it.

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
    """Where the points of one frame are in the next.

    Attributes
    ----------
    flow : (H, W, 2) float32, px
        Move to the right and down. It may lead out of the image. NaN where the point
        has no place in the next picture: it is behind the camera, or its vehicle has
        left the road.
    invalid : (H, W) bool
        The point lies outside the next image, or has no place there.
    occlusions : (H, W) bool
        The point lies inside the next image, but something hides it there. Within a
        pixel of the edge of what hides it, it counts as seen.
    """

    flow: NDArray[np.float32]
    invalid: NDArray[np.bool_]
    occlusions: NDArray[np.bool_]


def sample_place(samples: int) -> float:
    """Return where in a pixel depth and id are taken, in px from its top-left corner.

    Parameters
    ----------
    samples : int
        Samples a pixel along each axis.

    Examples
    --------
    >>> [sample_place(samples) for samples in (1, 2, 3, 4)]
    [0.5, 0.75, 0.5, 0.625]
    """
    return (samples // 2 + 0.5) / samples


def forward_flow(before: View, after: View, first_id: int, place: float) -> Flow:
    """Return the flow from one frame to the next.

    Parameters
    ----------
    before, after : View
        Of the same size and with the same vehicles.
    first_id : int
        Instance id of vehicle 0; vehicle ``v`` has ``first_id + v``, and whatever has
        a lower id stands still.
    place : float, px
        See `sample_place`.

    Returns
    -------
    Flow
        The sky is infinitely far: only the camera's rotation moves it.
    """
    height, width = before.depth.shape
    rows, columns = np.indices((height, width), dtype=np.float64)
    pixels = np.stack([columns, rows], axis=-1) + place
    local = _moved(before, after, pixels, first_id)
    ahead = np.where(local[..., 2] > 0.0, local[..., 2], np.nan)
    camera = after.camera
    there = camera.focal_px * local[..., :2] / ahead[..., None] + camera.matrix[:2, 2]
    with np.errstate(invalid="ignore"):  # NaN is outside
        inside = np.all((there >= 0.0) & (there < [width, height]), axis=-1)
    is_sky = np.isinf(before.depth)
    distance = np.where(is_sky, np.inf, ahead)
    hidden = inside & ~_is_seen(after, there, distance, before.ids, inside, place)
    # A millionth of a pixel is beyond what is known: what stands still is at 0.
    flow = np.round(there - pixels, 6) + 0.0
    return Flow(flow.astype(np.float32), ~inside, hidden)


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
        vehicle, mine = number - first_id, before.ids == number
        old, new = before.poses[vehicle], after.poses[vehicle]
        turn = new[:3, :3] @ old[:3, :3].T
        points[mine] = (points[mine] - old[:3, 3]) @ turn.T + new[:3, 3]
    local = second.to_camera(points)
    local[is_sky] = rays[is_sky] @ first.rotation @ second.rotation.T
    return local


def _is_seen(
    after: View,
    there: NDArray[np.float64],
    distance: NDArray[np.float64],
    ids: NDArray[np.uint16],
    inside: NDArray[np.bool_],
    place: float,
) -> NDArray[np.bool_]:
    """Whether one of the four samples around a point shows its thing no nearer than it.

    The inverse of depth is linear over a plane's picture, so that a point of a plane is
    never beyond all four samples around it unless something is in front.
    """
    height, width = ids.shape
    corner = np.floor(np.where(inside[..., None], there, 0.0) - place).astype(np.int64)
    seen = np.zeros(ids.shape, dtype=np.bool_)
    for down in (0, 1):
        for right in (0, 1):
            row = np.clip(corner[..., 1] + down, 0, height - 1)
            column = np.clip(corner[..., 0] + right, 0, width - 1)
            is_same = after.ids[row, column] == ids
            reach = after.depth[row, column] * (1.0 + _TOLERANCE)
            seen |= is_same & (distance <= reach)
    return seen
