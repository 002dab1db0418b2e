"""Grey patches of a frame under affine states, and bounds of such states."""

from __future__ import annotations

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box

__all__ = [
    "bounded",
    "box_of",
    "grey_patches",
    "side_limits",
    "state_of",
]

MIN_SIDE_PX = 3.0
SCALE_RANGE = (0.1, 10.0)  # of the first box, each side
_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]])


def state_of(box: Box) -> NDArray[np.float64]:
    """Return the (2, 3) state, px, that maps the unit square to a box.

    The square is [-0.5, 0.5]^2. Sides are at least `MIN_SIDE_PX`.
    """
    x, y = box.center
    width, height = max(box.width, MIN_SIDE_PX), max(box.height, MIN_SIDE_PX)
    return np.array([[width, 0.0, x], [0.0, height, y]])


def box_of(state: NDArray[np.float64]) -> Box:
    """Return the upright box with the centre and the lengths of the sides of a state.

    Parameters
    ----------
    state : (2, 3) float, px
    """
    width, height = np.hypot(state[0, :2], state[1, :2]).tolist()
    return Box.from_center(float(state[0, 2]), float(state[1, 2]), width, height)


def side_limits(
    state: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the least and greatest sides, two (2,) px, of a target.

    Parameters
    ----------
    state : (2, 3) float, px
        Of its first box, upright.
    """
    sides = np.array([state[0, 0], state[1, 1]])
    return np.maximum(SCALE_RANGE[0] * sides, MIN_SIDE_PX), SCALE_RANGE[1] * sides


def bounded(
    states: NDArray[np.float64],
    sides: tuple[NDArray[np.float64], NDArray[np.float64]],
    extent: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return states with their centres in the image and their sides within bounds.

    Parameters
    ----------
    states : (N, 2, 3) float, px
    sides : two (2,) float, px
        Least and greatest lengths of the two sides.
    extent : (2,) float, px
        Width and height of the image.
    """
    lengths = np.maximum(np.hypot(states[:, 0, :2], states[:, 1, :2]), 1e-9)
    result = states.copy()
    result[:, :, :2] *= (np.clip(lengths, *sides) / lengths)[:, None, :]
    result[:, :, 2] = np.clip(states[:, :, 2], 0.0, extent)
    return result


def grey_patches(
    image: NDArray[np.uint8], states: NDArray[np.float64], shape: tuple[int, int]
) -> NDArray[np.float32]:
    """Return the grey patch of a frame at each of N states, bilinear.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    states : (N, 2, 3) float, px
        Each maps the unit square [-0.5, 0.5]^2 to the image.
    shape : (int, int)
        Rows and columns of a patch.

    Returns
    -------
    (N, rows * columns) float32
        Grey levels in [0, 255], row by row. Outside the image its border is repeated.

    Notes
    -----
    Where samples are pixels apart the frame is not reduced first, as in the code of
    the papers that use this: single pixels hold a place and a size better than means
    do, with which `ivt` loses Car4 after 100 frames.
    """
    corners = states[:, None, :, 2] + np.einsum(
        "nij,cj->nci", states[..., :2], _CORNERS
    )
    extent = np.array([image.shape[1], image.shape[0]])
    low = np.floor(corners.min(axis=(0, 1))).astype(int) - 2
    high = np.ceil(corners.max(axis=(0, 1))).astype(int) + 3
    low, high = np.clip(low, 0, extent - 1), np.clip(high, 1, extent)
    high = np.maximum(high, low + 1)
    grey = cv2.cvtColor(image[low[1] : high[1], low[0] : high[0]], cv2.COLOR_RGB2GRAY)
    placed = states - np.concatenate([np.zeros((2, 2)), low[:, None]], axis=1)
    result: NDArray[np.float32] = _sampled(
        np.pad(grey, ((0, 1), (0, 1)), mode="edge").astype(np.float32),
        placed,
        *shape,
    )
    return result


@numba.njit(cache=True)
def _sampled(grey, states, rows, columns):  # type: ignore[no-untyped-def]  # numba
    """Sample an image whose last row and column are there twice."""
    width = grey.shape[1]
    levels = grey.ravel()
    # Unsigned, or numba would test every index for being counted from the end.
    beside, below, corner = np.uint64(1), np.uint64(width), np.uint64(width + 1)
    last_x, last_y = np.float32(width - 2), np.float32(grey.shape[0] - 2)
    zero = np.float32(0.0)
    steps = np.empty(columns, np.float32)
    for c in range(columns):
        steps[c] = (c + 0.5) / columns - 0.5
    result = np.empty((states.shape[0], rows * columns), np.float32)
    for n in range(states.shape[0]):
        along_x, along_y = np.float32(states[n, 0, 0]), np.float32(states[n, 1, 0])
        for r in range(rows):
            v = (r + 0.5) / rows - 0.5
            start_x = np.float32(states[n, 0, 1] * v + states[n, 0, 2] - 0.5)
            start_y = np.float32(states[n, 1, 1] * v + states[n, 1, 2] - 0.5)
            line = result[n, r * columns : (r + 1) * columns]
            for c in range(columns):
                x = min(max(start_x + along_x * steps[c], zero), last_x)
                y = min(max(start_y + along_y * steps[c], zero), last_y)
                left, top = np.int32(x), np.int32(y)
                place = np.uint64(top * width + left)
                across, down = x - np.float32(left), y - np.float32(top)
                first, third = levels[place], levels[place + below]
                upper = first + across * (levels[place + beside] - first)
                lower = third + across * (levels[place + corner] - third)
                line[c] = upper + down * (lower - upper)
    return result
