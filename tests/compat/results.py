"""Tracks to feed back to the toolkits: the truth itself, and the truth moved aside."""

from __future__ import annotations

import numpy as np
from got10k.trackers import Tracker
from numpy.typing import NDArray
from PIL import Image

from simbench.core.sequence import Sequence


def told(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return boxes as the layouts tell them: a box without area where absent."""
    return np.nan_to_num(boxes, nan=0.0)


def aside(sequence: Sequence) -> NDArray[np.float64]:
    """Return the true boxes moved right by a third of their width, but for the first.

    Two thirds of 4/3 widths are shared: an overlap of a half.
    """
    boxes = sequence.truth.boxes.copy()
    boxes[1:, 0] += boxes[1:, 2] / 3.0
    return boxes


class Replay(Tracker):  # type: ignore[misc]  # the toolkit has no types
    """Answers with tracks known beforehand, sequence after sequence."""

    def __init__(self, name: str, tracks: list[NDArray[np.float64]]) -> None:
        super().__init__(name, is_deterministic=True)
        self._waiting = list(tracks)

    def init(self, image: Image.Image, box: NDArray[np.float64]) -> None:
        self._rest = list(self._waiting.pop(0)[1:])

    def update(self, image: Image.Image) -> NDArray[np.float64]:
        answer: NDArray[np.float64] = self._rest.pop(0)
        return answer
