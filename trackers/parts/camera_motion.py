"""Camera motion: how the background around a target moved between two frames."""

from __future__ import annotations

import math

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.colour_histogram import ring_samples

__all__ = ["CameraMotion"]

RING = (1.4, 3.0)  # of the half axes: background that moves as that of the target
POINTS = 160  # in the ring, looked at for the test
FLOW_POINTS = 24  # the strongest of them, followed
STRONG = 20.0  # grey levels over two pixels: a gradient, not noise
STILL_PX = 0.3  # of a point along its gradient, and of all by least squares
STILL_SHARE = 0.6  # of the strong points
STILL_RATIO = 1.6  # change of strong points to that of weak ones, which is noise
STILL_LEVELS = 2.0  # added to it
REGION_PX = 96  # longest side of the region in which points are followed
WINDOW = (9, 9)
AGREED_PX = 1.0  # in the region; plus a tenth of the motion, for a zoom
AGREED_SHARE = 0.4
MIN_AGREED = 5


@numba.njit(cache=True, error_model="numpy")
def strong_points(  # type: ignore[no-untyped-def]  # numba infers the types
    before, image, ellipse, ring, points, strengths
):
    """Find points with strong gradients in a ring, and whether they stood still.

    Parameters
    ----------
    before, image : (H, W, 3) uint8
        Two successive frames.
    ellipse : (4,) float, px
        Centre x, y and half axes Hx, Hy in the first.
    ring : (K, 2) float
        Points relative to the ellipse.
    points : (K, 2) float, px
        Set to the strong points, in the first rows.
    strengths : (K,) float
        Set to their gradients, grey levels over two pixels.

    Returns
    -------
    strong : int
    still : bool
        Whether most strong points changed less than a small shift would change them;
        or, in noise, hardly more than the weak ones, and with hardly any shift by least
        squares.
    """
    height, width = image.shape[0], image.shape[1]
    strong, weak, unmoved = 0, 0, 0
    strong_change, weak_change = 0.0, 0.0
    xx, xy, yy, xt, yt = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(ring.shape[0]):
        x = math.floor(ellipse[0] + ring[k, 0] * ellipse[2])
        y = math.floor(ellipse[1] + ring[k, 1] * ellipse[3])
        if not (1 <= x < width - 1 and 1 <= y < height - 1):
            continue
        across = float(before[y, x + 1, 1]) - float(before[y, x - 1, 1])
        along = float(before[y + 1, x, 1]) - float(before[y - 1, x, 1])
        squared = across * across + along * along
        change = float(image[y, x, 1]) - float(before[y, x, 1])
        if squared < STRONG * STRONG:
            weak += 1
            weak_change += abs(change)
            continue
        gradient = math.sqrt(squared)
        strong_change += abs(change)
        if abs(change) < 0.5 * STILL_PX * gradient:
            unmoved += 1
        xx += 0.25 * across * across
        xy += 0.25 * across * along
        yy += 0.25 * along * along
        xt += 0.5 * across * change
        yt += 0.5 * along * change
        points[strong, 0] = x + 0.5
        points[strong, 1] = y + 0.5
        strengths[strong] = gradient
        strong += 1
    if unmoved >= STILL_SHARE * strong:
        return strong, True
    bound = STILL_LEVELS
    if weak > 0:
        bound += STILL_RATIO * weak_change / weak
    ridge = 1.0 + 0.01 * (xx + yy)
    xx, yy = xx + ridge, yy + ridge
    determinant = xx * yy - xy * xy
    shift_x = (yy * xt - xy * yt) / determinant
    shift_y = (xx * yt - xy * xt) / determinant
    still = strong_change / strong < bound
    return strong, still and math.hypot(shift_x, shift_y) < STILL_PX


class CameraMotion:
    """Motion of the background in a ring around a target, from frame to frame.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        First frame.

    Attributes
    ----------
    measured : int
        Frames so far in which the camera was found to move, so that flow was measured.

    Notes
    -----
    A cheap test comes first, since most roadside cameras stand still: the points of the
    ring with a strong gradient then hardly change, or not more than those without.
    Otherwise the strongest points are followed by sparse optical flow (Lucas-Kanade) in
    a region of at most 128 px, and the median of those that agree is the motion.
    Vehicles that pass in the ring disagree with it.
    """

    def __init__(self, image: NDArray[np.uint8]) -> None:
        self.measured = 0
        self._before = image
        self._ring = ring_samples(POINTS, *RING)
        self._points = np.empty((POINTS, 2))
        self._strengths = np.empty(POINTS)

    def shift(
        self, image: NDArray[np.uint8], ellipse: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Return the (2,) shift of the background in px since the frame before.

        None where it moves but is too plain, or too much at odds, to tell how.

        Parameters
        ----------
        image : (H, W, 3) uint8, RGB
            Frame after the one of the last call.
        ellipse : (4,) float, px
            The target in the frame before: centre x, y and half axes Hx, Hy.
        """
        before, self._before = self._before, image
        strong, still = strong_points(
            before, image, ellipse, self._ring, self._points, self._strengths
        )
        if still or strong < MIN_AGREED:
            return np.zeros(2)
        self.measured += 1
        order = np.argsort(self._strengths[:strong])[-FLOW_POINTS:]
        return self._flow(before, image, ellipse, self._points[order])

    def _flow(
        self,
        before: NDArray[np.uint8],
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
        points: NDArray[np.float64],
    ) -> NDArray[np.float64] | None:
        """Return the median motion of points that agree, (2,) px."""
        reach = RING[1] * ellipse[2:] + 8.0
        low = np.maximum(ellipse[:2] - reach, 0.0).astype(int)
        high = np.minimum(ellipse[:2] + reach, image.shape[1::-1]).astype(int)
        size = high - low
        scale = min(1.0, REGION_PX / float(size.max()))
        small = tuple(np.maximum((size * scale).round(), 16).astype(int).tolist())
        window = np.s_[low[1] : high[1], low[0] : high[0]]
        method = cv2.INTER_LINEAR if scale > 0.5 else cv2.INTER_AREA  # slow if not due
        first, second = (
            cv2.resize(
                cv2.cvtColor(frame[window], cv2.COLOR_RGB2GRAY),
                small,
                interpolation=method,
            )
            for frame in (before, image)
        )
        factor = np.array(small) / size
        start = ((points - low) * factor - 0.5).astype(np.float32)
        end, status, _ = cv2.calcOpticalFlowPyrLK(
            first,
            second,
            start,
            start.copy(),
            winSize=WINDOW,
            maxLevel=2,
            criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 10, 0.05),
            minEigThreshold=1e-3,
        )
        moved = (end - start)[status.ravel() > 0].astype(np.float64)
        if len(moved) < MIN_AGREED:
            return None
        median = np.median(moved, axis=0)
        bound = AGREED_PX + 0.1 * float(np.abs(median).max())
        agreed = moved[np.abs(moved - median).max(axis=1) < bound]
        if len(agreed) < max(MIN_AGREED, AGREED_SHARE * len(moved)):
            return None
        return np.asarray(agreed.mean(axis=0) / factor)
