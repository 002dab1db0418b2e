"""CSK: correlation filter on raw pixels with a Gaussian kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.kernel_filter import KernelFilter
from simbench.trackers.parts.parameter_checks import check_positive
from simbench.trackers.parts.search_window import (
    SearchWindow,
    gaussian_label,
    peak,
    taper,
)

__all__ = ["Csk"]


@dataclass(kw_only=True, eq=False)
class Csk:
    """Correlation filter on raw grey pixels with a Gaussian kernel; box of fixed size.

    In each frame: cut a window at the last place, move to the maximum of the response,
    and train on the window at the new place.

    Parameters
    ----------
    padding : float
        Size of the window over that of the target, less 1.
    label_deviation : float
        Standard deviation of the label, in square roots of the target's area.
    kernel_deviation : float
        Standard deviation of the kernel, for grey levels in [-0.5, 0.5].
    ridge : float
        Penalty lambda on the weights.
    rate : float, in [0, 1]
        Weight of the newest frame in the model.
    least, most : float
        The window is sampled so that the square root of the target's area is within
        these, in samples. The paper halves larger images.

    References
    ----------
    Henriques, Caseiro, Martins, Batista, "Exploiting the circulant structure of
    tracking-by-detection with kernels", ECCV 2012, algorithm 1 and section 5.

    Notes
    -----
    Padding, deviations, ridge and rate are the paper's. Chosen here: the maximum is
    refined by parabolas, since the places of a reduced window are coarse; window sides
    are rounded up to lengths that the FFT is fast for; the target's centre stays in
    the image. Confidence is the maximum of the response, clipped to [0, 1]: the
    regression's label is 1 on the target.
    """

    padding: float = 1.0
    label_deviation: float = 1.0 / 16.0
    kernel_deviation: float = 0.2
    ridge: float = 1e-2
    rate: float = 0.075
    least: float = 8.0
    most: float = 64.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        check_positive(self, "label_deviation", "kernel_deviation", "ridge", "least")
        if not self.most >= self.least:
            raise TrackerError(f"most must be at least {self.least}, got {self.most}")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._x, self._y = box.center
        self._size = (box.width, box.height)
        self._window = SearchWindow.around(box, self.padding, (self.least, self.most))
        self._taper = taper(self._window.shape)
        deviation = self.label_deviation * math.sqrt(math.prod(self._window.target))
        self._filter = KernelFilter(
            gaussian_label(self._window.shape, deviation),
            kernel_deviation=self.kernel_deviation,
            ridge=self.ridge,
            rate=self.rate,
        )
        self._filter.learn(self._features(frame.image))

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        down, right, value = peak(self._filter.respond(self._features(frame.image)))
        height, width = frame.image.shape[:2]
        self._x = min(max(self._x + right * self._window.step, 0.0), float(width))
        self._y = min(max(self._y + down * self._window.step, 0.0), float(height))
        self._filter.learn(self._features(frame.image))
        return Estimate(
            Box.from_center(self._x, self._y, *self._size),
            confidence=min(max(value, 0.0), 1.0),
        )

    def _features(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the tapered window at the current place, (1, rows, columns)."""
        grey = self._window.cut(image, self._x, self._y)
        return ((grey / np.float32(255.0) - np.float32(0.5)) * self._taper)[None]
