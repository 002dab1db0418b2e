"""Search windows of correlation filters: sampling, tapering, labels and peaks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from simbench.core.box import Box

__all__ = ["SearchWindow", "gaussian_label", "peak", "taper"]

MIN_SIDE_PX = 2.0  # of a target
MAX_ASPECT = 16.0  # of a window: longer ones are cut


@dataclass(frozen=True, slots=True)
class SearchWindow:
    """A grid of samples around the target, of fixed shape.

    Attributes
    ----------
    shape : (int, int)
        Rows and columns of the grid: lengths that the FFT is fast for, times the cell.
    step : float, px
        Distance of two samples in the image.
    target : (float, float)
        Height and width of the target, in samples.

    Examples
    --------
    >>> window = SearchWindow.around(Box(0.0, 0.0, 40.0, 30.0), 1.0, (8.0, 100.0))
    >>> window.shape, window.step, window.target
    ((60, 80), 1.0, (30.0, 40.0))
    """

    shape: tuple[int, int]
    step: float
    target: tuple[float, float]

    @classmethod
    def around(
        cls, box: Box, padding: float, size_range: tuple[float, float], cell: int = 1
    ) -> SearchWindow:
        """Make the window of a target.

        Parameters
        ----------
        box : Box, px
            The target; sides below `MIN_SIDE_PX` count as that.
        padding : float
            Size of the window over that of the target, less 1.
        size_range : (float, float)
            Least and greatest target in samples, as the square root of its area:
            smaller ones are enlarged, larger ones reduced.
        cell : int
            Sides of the window are multiples of it, in samples.
        """
        sides = np.maximum([box.height, box.width], MIN_SIDE_PX)
        sides = np.maximum(sides, sides.max() / MAX_ASPECT)
        size = math.sqrt(float(np.prod(sides)))
        step = size / min(max(size, size_range[0]), size_range[1])
        target = sides / step
        cells = np.maximum(np.round(target * (1.0 + padding) / cell), 4).astype(int)
        rows, columns = (cell * next_fast_len(int(each), real=True) for each in cells)
        return cls((rows, columns), step, (float(target[0]), float(target[1])))

    def cut(
        self, image: NDArray[np.uint8], x: float, y: float, growth: float = 1.0
    ) -> NDArray[np.float32]:
        """Return the grey levels of the grid around a point, bilinear.

        Parameters
        ----------
        image : (H, W, 3) uint8, RGB
        x, y : float, px
            Centre of the grid. Outside the image its border is repeated.
        growth : float
            Factor on the step.

        Returns
        -------
        (rows, columns) float32
            In [0, 255].
        """
        step = self.step * growth
        rows, columns = self.shape
        height, width = max(round(rows * step), 1), max(round(columns * step), 1)
        left = min(max(math.floor(x - width / 2.0) - 2, 0), image.shape[1] - 1)
        top = min(max(math.floor(y - height / 2.0) - 2, 0), image.shape[0] - 1)
        right = min(max(math.ceil(x + width / 2.0) + 2, left + 1), image.shape[1])
        bottom = min(max(math.ceil(y + height / 2.0) + 2, top + 1), image.shape[0])
        grey = cv2.cvtColor(image[top:bottom, left:right], cv2.COLOR_RGB2GRAY)
        # Here pixel c spans [c, c + 1]; for OpenCV its centre is at c.
        middle = (x - left - 0.5, y - top - 0.5)
        cut = cv2.getRectSubPix(grey, (width, height), middle, patchType=cv2.CV_32F)
        if (height, width) != self.shape:
            how = cv2.INTER_AREA if step > 1.0 else cv2.INTER_LINEAR
            cut = cv2.resize(cut, (columns, rows), interpolation=how)
        return np.asarray(cut, np.float32)


def taper(shape: tuple[int, int]) -> NDArray[np.float32]:
    """Return the cosine (Hann) window of a shape, (rows, columns) float32 in [0, 1].

    It is never 0 within the grid, and its maximum is 1 for odd sides.
    """
    rows, columns = (np.hanning(length + 2)[1:-1] for length in shape)
    return np.outer(rows, columns).astype(np.float32)


def gaussian_label(shape: tuple[int, int], deviation: float) -> NDArray[np.float32]:
    """Return a Gaussian of maximum 1 at sample (0, 0), periodic in both directions.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns.
    deviation : float
        Standard deviation in samples.

    Returns
    -------
    (rows, columns) float32
    """
    rows, columns = (np.fft.fftfreq(length, 1.0 / length) for length in shape)
    square = rows[:, None] ** 2 + columns[None, :] ** 2
    return np.exp(-0.5 / deviation**2 * square).astype(np.float32)


def peak(response: NDArray[np.float32]) -> tuple[float, float, float]:
    """Return the place and value of the maximum of a periodic response.

    Parameters
    ----------
    response : (rows, columns) float

    Returns
    -------
    down, right : float
        Displacement from sample (0, 0), at most half the sides, refined to the vertex
        of the parabola through the maximum and its two neighbours in each direction.
    value : float
        The maximum itself.
    """
    rows, columns = response.shape
    row, column = divmod(int(response.argmax()), columns)
    value = float(response[row, column])
    above, below = response[row - 1, column], response[(row + 1) % rows, column]
    before, after = response[row, column - 1], response[row, (column + 1) % columns]
    down = row + _vertex(float(above), value, float(below))
    right = column + _vertex(float(before), value, float(after))
    down = down - rows if down > rows / 2 else down
    right = right - columns if right > columns / 2 else right
    return down, right, value


def _vertex(before: float, middle: float, after: float) -> float:
    """Return the place of the maximum of a parabola, in [-0.5, 0.5] samples."""
    curvature = before - 2.0 * middle + after
    return 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
