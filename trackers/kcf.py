"""KCF: kernelised correlation filter on histograms of oriented gradients."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.fhog import fhog
from simbench.trackers.parts.kernel_filter import KernelFilter
from simbench.trackers.parts.parameter_checks import check_positive
from simbench.trackers.parts.search_window import (
    SearchWindow,
    gaussian_label,
    peak,
    taper,
)

__all__ = ["Kcf"]

GROWTH_RANGE = (0.1, 10.0)  # of the first box


@dataclass(kw_only=True, eq=False)
class Kcf:
    """Kernelised correlation filter on histograms of oriented gradients (HOG).

    In each frame: cut a window at the last place, move to the maximum of the response,
    and train on the window at the new place. The box keeps its size, unless several
    scales are asked for: then windows of other sizes are tried as well.

    Parameters
    ----------
    kernel : str
        ``gaussian``, or ``linear`` (the paper's dual correlation filter, DCF).
    scales : int
        Sizes tried in each frame, odd; 1, the paper's, keeps the size.
    scale_step : float
        Ratio of two sizes.
    scale_weight : float, in (0, 1]
        Factor on the response to a size other than the last.
    padding : float
        Size of the window over that of the target, less 1.
    cell : int
        Side of a HOG cell, in samples.
    label_deviation : float
        Standard deviation of the label, in square roots of the target's area.
    kernel_deviation : float
        Standard deviation of the Gaussian kernel.
    ridge : float
        Penalty lambda on the weights.
    rate : float, in [0, 1]
        Weight of the newest frame in the model.
    least, most : float
        The window is sampled so that the square root of the target's area is within
        these, in samples. The authors' code halves targets above 100.

    References
    ----------
    Henriques, Caseiro, Martins, Batista, "High-speed tracking with kernelized
    correlation filters", IEEE Trans. PAMI 37(3), 2015, section 8 and table 2; HOG by
    Felzenszwalb et al., of which the channel that is always 0 is left out.

    Notes
    -----
    Cell, padding, deviations, ridge and rate are the paper's. Chosen here: the maximum
    is refined by parabolas, since a cell is 4 samples; window sides are rounded to
    lengths that the FFT is fast for; the target's centre stays in the image; small
    targets are enlarged to ``least``, since fewer cells hold no gradients. Scales are
    not in the paper; they are searched as in later correlation filters, with a small
    preference for the last size. Confidence is the maximum of the response, clipped
    to [0, 1]: the regression's label is 1 on the target.
    """

    kernel: str = "gaussian"
    scales: int = 1
    scale_step: float = 1.03
    scale_weight: float = 0.99
    padding: float = 1.5
    cell: int = 4
    label_deviation: float = 0.1
    kernel_deviation: float = 0.5
    ridge: float = 1e-4
    rate: float = 0.02
    least: float = 16.0
    most: float = 64.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.kernel not in ("gaussian", "linear"):
            raise TrackerError(
                f"kernel must be gaussian or linear, got {self.kernel!r}"
            )
        if self.scales < 1 or self.scales % 2 == 0:
            raise TrackerError(f"scales must be odd and above 0, got {self.scales}")
        if self.cell < 1:
            raise TrackerError(f"cell must be at least 1, got {self.cell}")
        check_positive(self, "label_deviation", "kernel_deviation", "ridge", "least")
        if not self.scale_step > 1.0:
            raise TrackerError(f"scale_step must be above 1, got {self.scale_step}")
        if not self.most >= self.least:
            raise TrackerError(f"most must be at least {self.least}, got {self.most}")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._x, self._y = box.center
        self._size = (box.width, box.height)
        self._growth = 1.0
        sizes = (self.least, self.most)
        self._window = SearchWindow.around(box, self.padding, sizes, self.cell)
        rows, columns = self._window.shape
        cells = (rows // self.cell, columns // self.cell)
        self._taper = taper(cells)
        side = math.sqrt(math.prod(self._window.target)) / self.cell
        self._filter = KernelFilter(
            gaussian_label(cells, self.label_deviation * side),
            kernel_deviation=self.kernel_deviation if self.kernel != "linear" else 0.0,
            ridge=self.ridge,
            rate=self.rate,
        )
        self._filter.learn(self._features(frame.image, 1.0))

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        confidence = self._move(frame.image)
        self._filter.learn(self._features(frame.image, self._growth))
        width, height = (self._growth * side for side in self._size)
        return Estimate(
            Box.from_center(self._x, self._y, width, height),
            confidence=min(max(confidence, 0.0), 1.0),
        )

    def _move(self, image: NDArray[np.uint8]) -> float:
        """Move to the best response of all sizes, and return it."""
        best, confidence, place = -math.inf, 0.0, (0.0, 0.0, 1.0)
        reach = self.scales // 2
        for exponent in range(-reach, reach + 1):
            growth = self._growth * self.scale_step**exponent
            growth = min(max(growth, GROWTH_RANGE[0]), GROWTH_RANGE[1])
            response = self._filter.respond(self._features(image, growth))
            down, right, value = peak(response)
            weighed = value if exponent == 0 else self.scale_weight * value
            if weighed > best:
                best, confidence, place = weighed, value, (down, right, growth)
        down, right, self._growth = place
        step = self.cell * self._window.step * self._growth
        height, width = image.shape[:2]
        self._x = min(max(self._x + right * step, 0.0), float(width))
        self._y = min(max(self._y + down * step, 0.0), float(height))
        return confidence

    def _features(self, image: NDArray[np.uint8], growth: float) -> NDArray[np.float32]:
        """Return the tapered histograms at the current place, (31, rows, columns)."""
        grey = self._window.cut(image, self._x, self._y, growth)
        return fhog((grey + np.float32(0.5)).astype(np.uint8), self.cell) * self._taper
