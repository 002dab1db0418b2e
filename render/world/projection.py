"""Projections from the road frame to OpenGL's clip space, and depth from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera

__all__ = [
    "NEAR_M",
    "clip_matrix",
    "covering_window",
    "linear_depth",
    "part_of",
    "sky_directions",
]

NEAR_M, _FAR_M = 0.4, 2500.0


def clip_matrix(camera: Camera) -> NDArray[np.float64]:
    """Return the (4, 4) map from the road frame to clip space.

    Rows grow downwards in clip space as in the image: an image read back from the
    device needs no flip.
    """
    fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
    cx, cy = camera.matrix[0, 2], camera.matrix[1, 2]
    width, height = camera.width, camera.height
    depth = _FAR_M - NEAR_M
    projection = np.array(
        [
            [2 * fx / width, 0.0, 2 * cx / width - 1.0, 0.0],
            [0.0, 2 * fy / height, 2 * cy / height - 1.0, 0.0],
            [0.0, 0.0, (_FAR_M + NEAR_M) / depth, -2 * _FAR_M * NEAR_M / depth],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
    view = np.eye(4)
    view[:3, :3] = camera.rotation
    view[:3, 3] = camera.translation
    clip: NDArray[np.float64] = projection @ view
    return clip


def covering_window(
    clip: NDArray[np.float64], points: NDArray[np.float64], width: int, height: int
) -> tuple[int, int, int, int]:
    """Return a window of a picture with all that the convex hull of points may cover.

    Parameters
    ----------
    clip : (4, 4) float
        Road frame to clip space, see `clip_matrix`.
    points : (N, 3) float, m
    width, height : int
        Samples of the picture.

    Returns
    -------
    (left, top, right, bottom), the last two exclusive
        The whole picture where a point is not beyond the near plane; empty where no
        point is given or all are outside on the same side.
    """
    if not len(points):
        return 0, 0, 0, 0
    placed = points @ clip[[0, 1, 3], :3].T + clip[[0, 1, 3], 3]
    distance = placed[:, 2:]
    if distance.min() < NEAR_M:
        return 0, 0, width, height
    size = np.array([width, height])
    spots = (placed[:, :2] / distance + 1.0) / 2.0 * size
    # a sample more on each side: the device rounds positions
    low = np.clip(np.floor(spots.min(axis=0)) - 1.0, 0.0, size)
    high = np.clip(np.ceil(spots.max(axis=0)) + 1.0, low, size)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def part_of(
    clip: NDArray[np.float64],
    part: tuple[int, int, int, int],
    width: int,
    height: int,
) -> NDArray[np.float64]:
    """Return the (4, 4) map to a clip space that only holds a part of a picture.

    Parameters
    ----------
    clip : (4, 4) float
        Road frame to clip space of the whole picture.
    part : (left, top, right, bottom)
        In samples, the last two exclusive.
    width, height : int
        Samples of the picture.
    """
    left, top, right, bottom = part
    across, down = width / (right - left), height / (bottom - top)
    zoom = np.diag([across, down, 1.0, 1.0])
    zoom[0, 3] = across * (1.0 - (left + right) / width)
    zoom[1, 3] = down * (1.0 - (top + bottom) / height)
    narrow: NDArray[np.float64] = zoom @ clip
    return narrow


def sky_directions(clip: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Return the map from a clip-space corner at the far plane to a direction."""
    inverse = np.linalg.inv(clip)
    shift = np.eye(4)
    shift[:3, 3] = -camera.position
    # (inverse @ corner) is a point times w; shifting it by the eye times w keeps the
    # first three parts along the ray, and w is positive at the far plane.
    direction: NDArray[np.float64] = shift @ inverse
    return direction


def linear_depth(window: NDArray[np.float32]) -> NDArray[np.float32]:
    """Turn window depth in [0, 1] into metres along the axis; the far plane is inf."""
    ndc = 2.0 * window - 1.0
    span = (_FAR_M + NEAR_M) - ndc * (_FAR_M - NEAR_M)
    metres = (2.0 * NEAR_M * _FAR_M / span).astype(np.float32)
    return np.where(window >= 1.0, np.float32(np.inf), metres)
