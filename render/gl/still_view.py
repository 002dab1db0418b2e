"""What changes in the picture of a camera that stands still: where vehicles move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl.windows import Window, merged_windows
from simbench.render.world.projection import NEAR_M

__all__ = ["StillView", "shadow_ends", "windows_around"]

_PART_SAMPLES = 12_000
"""Samples that take as long to shade as one more part takes to begin."""


@dataclass(frozen=True, slots=True)
class _Frame:
    view: bytes
    poses: NDArray[np.float64]
    present: NDArray[np.bool_]
    windows: NDArray[np.int64]


class StillView:
    """Finds the parts of a picture that differ from the one before.

    Parameters
    ----------
    step : int
        Samples a pixel along each axis: parts consist of whole pixels.
    """

    def __init__(self, step: int) -> None:
        self._step = step
        self._last: _Frame | None = None

    def forget(self) -> None:
        """Take all of the next picture as changed."""
        self._last = None

    def changed(
        self,
        view: bytes,
        windows: NDArray[np.int64],
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
    ) -> list[Window] | None:
        """Return the parts that may have changed since the last call; None for all.

        Parameters
        ----------
        view : bytes
            Equal only if all that does not move looks the same.
        windows : (V, 4) int
            Around each vehicle and its shadow; of zeros where neither is seen.
        poses : (V, 4, 4) float
        present : (V,) bool
        """
        last, self._last = self._last, _Frame(view, poses, present, windows)
        if last is None or last.view != view:
            return None
        moved = present != last.present
        moved |= present & np.any(poses != last.poses, axis=(1, 2))
        parts = _united(last.windows[moved], windows[moved])
        parts[:, :2] -= parts[:, :2] % self._step
        parts[:, 2:] += -parts[:, 2:] % self._step
        return merged_windows(parts, _PART_SAMPLES)


def shadow_ends(
    corners: NDArray[np.float64],
    to_sun: NDArray[np.float64],
    lowest: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return where the shadows of corners, (N, P, 3) m, end: at heights, (N,) m."""
    above = np.maximum(corners[..., 2] - lowest[:, None], 0.0)
    ends: NDArray[np.float64] = corners - (above / to_sun[2])[..., None] * to_sun
    return ends


def windows_around(
    clip: NDArray[np.float64], points: NDArray[np.float64], width: int, height: int
) -> NDArray[np.int64]:
    """Return windows of a picture with all that convex hulls of points may cover.

    Parameters
    ----------
    clip : (4, 4) float
        Road frame to clip space.
    points : (N, P, 3) float, m
        P points of each of N hulls.
    width, height : int
        Samples of the picture.

    Returns
    -------
    (N, 4) int
        Left, top, right and bottom, the last two exclusive; empty windows are zero.
    """
    placed = points @ clip[[0, 1, 3], :3].T + clip[[0, 1, 3], 3]
    depth = placed[..., 2]
    size = np.array([width, height])
    low, high = np.zeros((2, len(points), 2))
    is_ahead = np.all(depth >= NEAR_M, axis=1)
    spots = placed[is_ahead, :, :2] / depth[is_ahead, :, None]
    low[is_ahead], high[is_ahead] = spots.min(axis=1), spots.max(axis=1)
    for index in np.flatnonzero(~is_ahead & np.any(depth >= NEAR_M, axis=1)):
        spots = _beyond_near_plane(placed[index])
        low[index], high[index] = spots.min(axis=0), spots.max(axis=0)
    # a sample more on each side: the device rounds positions
    first = np.clip(np.floor((low + 1.0) / 2.0 * size) - 1.0, 0.0, size)
    last = np.clip(np.ceil((high + 1.0) / 2.0 * size) + 1.0, 0.0, size)
    windows = np.hstack([first, last]).astype(np.int64)
    is_empty = np.any(last <= first, axis=1) | np.all(depth < NEAR_M, axis=1)
    windows[is_empty] = 0
    return windows


def _beyond_near_plane(placed: NDArray[np.float64]) -> NDArray[np.float64]:
    """Project that part of a hull of (P, 3) points that is beyond the near plane."""
    ahead = placed[:, 2] >= NEAR_M
    ours, theirs = placed[ahead][:, None], placed[~ahead][None]
    share = (ours[..., 2:] - NEAR_M) / (ours[..., 2:] - theirs[..., 2:])
    crossing = ours + share * (theirs - ours)
    points = np.concatenate([placed[ahead], crossing.reshape(-1, 3)])
    spots: NDArray[np.float64] = points[:, :2] / points[:, 2:]
    return spots


def _united(first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return windows around pairs of windows; empty ones, of zeros, are left out."""
    low = np.minimum(first[:, :2], second[:, :2])
    high = np.maximum(first[:, 2:], second[:, 2:])
    both = np.hstack([low, high])
    has_first, has_second = first[:, 2] > 0, second[:, 2] > 0
    both = np.where(has_first[:, None], both, second)
    both = np.where(has_second[:, None], both, first)
    return both[has_first | has_second]
