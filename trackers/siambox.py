"""SiamBox: SiamFC with a network that also predicts the target's box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

import simbench.trackers.weights.siambox
from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.parameter_checks import check_shares
from simbench.trackers.parts.response_peak import ResponsePeak
from simbench.trackers.parts.siamese_box import SiameseBoxNetwork
from simbench.trackers.parts.siamese_network import RESPONSE_SIDE, STRIDE
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

__all__ = ["SiamBox"]


@dataclass(kw_only=True, eq=False)
class SiamBox:
    """Search for the first appearance with a Siamese network that predicts boxes, too.

    In each frame: crop a square around the last place, compare it with the first
    appearance, and at the best response ask the network for the target's box. Nothing
    is learnt on the way. The network was trained on generated films only.

    Parameters
    ----------
    size_rate : float, in [0, 1]
        Share of a change of size, in its logarithm, that is made in a frame.
    calibrate : bool
        Whether the network's error of the size in the first frame, where the box is
        known, is taken out of all others.
    window : float, in [0, 1]
        Weight of a cosine window, which prefers small motions, in the response.
    weights : str
        Another file of weights, an .npz of ``simbench train siambox``.

    References
    ----------
    Place: Bertinetto, Valmadre, Henriques, Vedaldi, Torr, "Fully-convolutional Siamese
    networks for object tracking", ECCV workshops 2016. Box: see
    `simbench.learning.siamese.network.box_sides`; no paper has this tracker.
    """

    size_rate: float = 0.15
    calibrate: bool = True
    window: float = 0.3
    weights: str = ""

    def __post_init__(self) -> None:
        """Check the parameters, and read the weights."""
        check_shares(self, "size_rate", "window")
        self._network = load_network(
            SiameseBoxNetwork, self.weights, simbench.trackers.weights.siambox
        )
        self.data_files = given_files(self.weights)
        self._peak = ResponsePeak(self.window)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._place = inside(frame.image, *box.center)
        self._first = np.maximum([box.width, box.height], MIN_SIDE_PX)
        self._size = self._first
        side = context_side(*self._size.tolist())
        crop = square_crops(frame.image, *self._place, [side], EXEMPLAR_SAMPLES)[0]
        self._exemplar = self._network.exemplar(crop)
        self._gain = self._size / self._predicted(frame)[1] if self.calibrate else 1.0

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        place, size, odds = self._predicted(frame)
        self._place = inside(frame.image, *place.tolist())
        change = self._gain * size / self._size
        low, high = GROWTH_RANGE
        self._size = np.clip(
            self._size * change**self.size_rate, low * self._first, high * self._first
        )
        return Estimate(
            Box.from_center(*self._place, *self._size.tolist()),
            confidence=float(expit(odds)),
        )

    def _predicted(
        self, frame: Frame
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Return place and size, px, of the predicted box, and its log odds."""
        side = SEARCH_SAMPLES / EXEMPLAR_SAMPLES * context_side(*self._size.tolist())
        crop = square_crops(frame.image, *self._place, [side], SEARCH_SAMPLES)[0]
        response, found = self._network.search(self._exemplar, crop)
        right, down = self._peak(response)
        row, column = (_nearest(each) for each in (down, right))
        left, top, right_side, bottom = self._network.sides(
            self._exemplar, found, row, column
        ).tolist()
        step = side / SEARCH_SAMPLES
        middle = STRIDE * (np.array([column, row]) - RESPONSE_SIDE // 2)
        off = np.array([right_side - left, bottom - top]) / 2.0
        place = np.array(self._place) + step * (middle + off)
        size = step * np.array([left + right_side, top + bottom])
        return place, size, float(response.max())


def _nearest(offset: float) -> int:
    """Return the row or column of the response nearest to an offset, in samples."""
    nearest = round(offset / STRIDE) + RESPONSE_SIDE // 2
    return min(max(nearest, 0), RESPONSE_SIDE - 1)
