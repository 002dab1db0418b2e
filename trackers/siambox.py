"""SiamBox: SiamFC with a network that also tells the target's box."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

import simbench.trackers.weights.siambox
from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.response_peak import ResponsePeak
from simbench.trackers.parts.siamese_box import SiameseBoxNetwork
from simbench.trackers.parts.siamese_network import RESPONSE_SIDE, STRIDE
from simbench.trackers.parts.square_crops import (
    EXEMPLAR_SAMPLES,
    SEARCH_SAMPLES,
    context_side,
    square_crops,
)
from simbench.trackers.parts.weights_file import card_path, read_weights

__all__ = ["SiamBox"]

GROWTH_RANGE = (0.2, 8.0)  # of the first box
MIN_SIDE_PX = 2.0  # of the target


@dataclass(kw_only=True, eq=False)
class SiamBox:
    """Search for the first appearance with a Siamese network that also tells the box.

    In each frame: crop a square around the last place, compare it with the first
    appearance, and at the best response ask the network for the target's box. Nothing
    is learnt on the way. The network was trained on generated films only.

    Parameters
    ----------
    size_rate : float, in [0, 1]
        Share of a change of size, in its logarithm, that is made in a frame.
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

    size_rate: float = 0.3
    window: float = 0.3
    weights: str = ""

    def __post_init__(self) -> None:
        """Check the parameters, and read the weights."""
        for name in ("size_rate", "window"):
            if not 0.0 <= (value := getattr(self, name)) <= 1.0:
                raise TrackerError(f"{name} must be in [0, 1], got {value}")
        self._network = _network(self.weights)
        given = Path(self.weights)
        self.data_files = (given, card_path(given)) if self.weights else ()
        self._peak = ResponsePeak(self.window)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._place = _inside(frame, np.array(box.center))
        self._first = np.maximum([box.width, box.height], MIN_SIDE_PX)
        self._size = self._first
        x, y = self._place.tolist()
        side = context_side(*self._size.tolist())
        crop = square_crops(frame.image, x, y, [side], EXEMPLAR_SAMPLES)[0]
        self._exemplar = self._network.exemplar(crop)

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        side = SEARCH_SAMPLES / EXEMPLAR_SAMPLES * context_side(*self._size.tolist())
        x, y = self._place.tolist()
        crop = square_crops(frame.image, x, y, [side], SEARCH_SAMPLES)[0]
        response, found = self._network.search(self._exemplar, crop)
        right, down = self._peak(response)
        row, column = (_nearest(each) for each in (down, right))
        left, top, right_side, bottom = self._network.sides(
            self._exemplar, found, row, column
        ).tolist()
        step = side / SEARCH_SAMPLES
        middle = STRIDE * (np.array([column, row]) - RESPONSE_SIDE // 2)
        off = np.array([right_side - left, bottom - top]) / 2.0
        self._place = _inside(frame, self._place + step * (middle + off))
        size = step * np.array([left + right_side, top + bottom])
        size = self._size * (size / self._size) ** self.size_rate
        low, high = GROWTH_RANGE
        self._size = np.clip(size, low * self._first, high * self._first)
        return Estimate(
            Box.from_center(*self._place.tolist(), *self._size.tolist()),
            confidence=float(expit(response.max())),
        )


@cache
def _network(path: str) -> SiameseBoxNetwork:
    """Return the network of a file of weights; of an empty path, that which ships."""
    folder = Path(simbench.trackers.weights.siambox.__file__).parent
    return SiameseBoxNetwork(
        read_weights(Path(path) if path else folder / "weights.npz")
    )


def _nearest(offset: float) -> int:
    """Return the row or column of the response nearest to an offset, in samples."""
    nearest = round(offset / STRIDE) + RESPONSE_SIDE // 2
    return min(max(nearest, 0), RESPONSE_SIDE - 1)


def _inside(frame: Frame, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a place, (2,), moved into the picture, px."""
    height, width = frame.image.shape[:2]
    moved: NDArray[np.float64] = np.clip(place, 0.0, [width - 1.0, height - 1.0])
    return moved
