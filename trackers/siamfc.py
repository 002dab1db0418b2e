"""SiamFC: search for the first appearance with a Siamese network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

import simbench.trackers.weights.siamfc
from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.parameter_checks import check_shares
from simbench.trackers.parts.response_peak import ResponsePeak, finer_response
from simbench.trackers.parts.siamese_network import SiameseNetwork
from simbench.trackers.parts.square_crops import (
    EXEMPLAR_SAMPLES,
    GROWTH_RANGE,
    MIN_SIDE_PX,
    SEARCH_SAMPLES,
    context_side,
    inside,
    square_crops,
)
from simbench.trackers.parts.weights_file import given_files, load_network

__all__ = ["SiamFc"]


@dataclass(kw_only=True, eq=False)
class SiamFc:
    """Search for the first appearance of the target with a Siamese network.

    In each frame: crop a square around the last place in three sizes, compare each
    with the first appearance, and move to the best response. Nothing is learnt on the
    way. The network was trained on generated films only.

    Parameters
    ----------
    scale_step : float
        Ratio of two sizes.
    scale_weight : float, in (0, 1]
        Factor on the response to a size other than the last.
    scale_rate : float, in [0, 1]
        Share of a change of size that is made in a frame.
    window : float, in [0, 1]
        Weight of a cosine window, which prefers small motions, in the response.
    weights : str
        Another file of weights, an .npz of ``simbench train siamfc``.

    References
    ----------
    Bertinetto, Valmadre, Henriques, Vedaldi, Torr, "Fully-convolutional Siamese
    networks for object tracking", ECCV workshops 2016, section 3.1.

    Notes
    -----
    Scales, their weight and their rate are those of the authors' code (SiamFC-3s); the
    window has a weight of 0.3 in place of 0.176. The network is smaller, and sees crops
    of 64 and 128 samples in place of 127 and 255. Confidence is the logistic function
    of the greatest response, which was trained as the log odds that the target is
    there.
    """

    scale_step: float = 1.0375
    scale_weight: float = 0.9745
    scale_rate: float = 0.59
    window: float = 0.3
    weights: str = ""

    def __post_init__(self) -> None:
        """Check the parameters, and read the weights."""
        if not self.scale_step > 1.0:
            raise TrackerError(f"scale_step must be above 1, got {self.scale_step}")
        if not 0.0 < self.scale_weight <= 1.0:
            raise TrackerError(
                f"scale_weight must be in (0, 1], got {self.scale_weight}"
            )
        check_shares(self, "scale_rate", "window")
        self._network = self._read_network()
        self.data_files = given_files(self.weights)
        self._peak = ResponsePeak(self.window)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._x, self._y = inside(frame.image, *box.center)
        self._size = (max(box.width, MIN_SIDE_PX), max(box.height, MIN_SIDE_PX))
        self._growth = 1.0
        self._side = context_side(*self._size)
        self._exemplar = self._appearance(frame)

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        scales = (1.0 / self.scale_step, 1.0, self.scale_step)
        side = self._span(SEARCH_SAMPLES)
        sides = [side * scale for scale in scales]
        crops = square_crops(frame.image, self._x, self._y, sides, SEARCH_SAMPLES)
        responses = self._network.responses(self._exemplar, crops)
        best = self._best_scale(responses)
        right, down = self._peak(responses[best])
        step = sides[best] / SEARCH_SAMPLES
        self._x, self._y = inside(
            frame.image, self._x + right * step, self._y + down * step
        )
        change = 1.0 + self.scale_rate * (scales[best] - 1.0)
        low, high = GROWTH_RANGE
        self._growth = min(max(self._growth * change, low), high)
        width, height = (self._growth * side for side in self._size)
        odds = float(responses[best].max())
        return Estimate(
            Box.from_center(self._x, self._y, width, height),
            confidence=float(expit(odds)),
        )

    def _read_network(self) -> SiameseNetwork:
        """Return the network of the weights."""
        return load_network(
            SiameseNetwork, self.weights, simbench.trackers.weights.siamfc
        )

    def _appearance(self, frame: Frame) -> NDArray[np.float32]:
        """Return what search regions are compared with, from the present place."""
        samples = self._network.exemplar_samples
        side = self._span(samples)
        crop = square_crops(frame.image, self._x, self._y, [side], samples)[0]
        return self._network.exemplar(crop)

    def _span(self, samples: int) -> float:
        """Return the side of so many samples at the present size, px."""
        return samples / EXEMPLAR_SAMPLES * self._side * self._growth

    def _best_scale(self, responses: NDArray[np.float32]) -> int:
        """Return the index of the scale with the best maximum, the last preferred."""
        highest = [float(finer_response(each).max()) for each in responses]
        for index in (0, 2):
            value, weight = highest[index], self.scale_weight
            highest[index] = value * weight if value > 0.0 else value / weight
        return int(np.argmax(highest))
