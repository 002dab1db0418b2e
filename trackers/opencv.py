"""OpenCV's own trackers, as far as the installed build has them, as a `Tracker`."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.opencv_build import WEIGHTS, canonical_name, creator

__all__ = ["OpenCvTracker", "opencv_factory"]

MIN_SIDE_PX = 16  # in a smaller box MIL never finishes placing its features
MARGIN_PX = 8  # MIL also samples negative examples beside the target


class OpenCvTracker:
    """A tracker of OpenCV by name, with its default parameters.

    Parameters
    ----------
    name : str
        As ``mil``, ``kcf`` or ``nano``, in any case; the prefix ``legacy.`` is
        optional where the main module has no tracker of that name.
    backbone, neckhead : str
        Of ``nano``: its weights, ONNX files.
    net : str
        Of ``vit``: the same.
    model, kernel_cls1, kernel_r1 : str
        Of ``dasiamrpn``: the same.

    Attributes
    ----------
    data_files : tuple of Path
        The weights, whose digests enter the key of results.

    Raises
    ------
    TrackerError
        If the installed build has no such tracker, or weights are missing or broken.

    Notes
    -----
    In a frame in which OpenCV reports a failure the last box is repeated with
    confidence 0. Otherwise confidence is the score of trackers on networks, and 1 of
    others, since that is all they say. Runs are reproducible for trackers that use
    OpenCV's generator or no randomness; MIL seeds its features from the clock, so that
    two runs of it may differ.
    """

    def __init__(self, name: str, **weights: str) -> None:
        self.name = canonical_name(name)
        self._create = creator(self.name, weights)
        vars(self).update(weights)  # parameters are stored under their names
        self.data_files = tuple(Path(path) for path in weights.values())

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        # OpenCV takes no generator, only this global seed.
        cv2.setRNGSeed(int(rng.integers(2**31)))
        self._box = box
        self._tracker = self._create()
        self._tracker.init(_to_bgr(frame), _inside(box, frame))

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        found, row = self._tracker.update(_to_bgr(frame))
        if found and np.all(np.isfinite(row)):
            self._box = Box.from_array(row)
            return Estimate(self._box, confidence=self._confidence())
        return Estimate(self._box, confidence=0.0)

    def _confidence(self) -> float:
        """Return the score of a tracker that has one, else 1."""
        if self.name not in WEIGHTS:
            return 1.0
        score = float(self._tracker.getTrackingScore())
        return min(max(score, 0.0), 1.0) if math.isfinite(score) else 0.0


def opencv_factory(name: str) -> Callable[..., OpenCvTracker]:
    """Return what makes a tracker of OpenCV; its signature names the weights."""

    def make(**weights: str) -> OpenCvTracker:
        return OpenCvTracker(name, **weights)

    files = WEIGHTS.get(canonical_name(name), {})
    make.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter(one, inspect.Parameter.KEYWORD_ONLY, default="")
            for one in files
        ]
    )
    return make


def _to_bgr(frame: Frame) -> Any:  # Any: OpenCV's stubs define their own arrays
    return cv2.cvtColor(frame.image, cv2.COLOR_RGB2BGR)


def _inside(box: Box, frame: Frame) -> tuple[int, int, int, int]:
    """Return a box in whole pixels, ``left, top, width, height``, to initialise on.

    It is inside the image with a margin of `MARGIN_PX`, has sides of at least
    `MIN_SIDE_PX`, and about the same centre.
    """
    height, width = frame.image.shape[:2]
    left, columns = _span(box.left, box.width, width)
    top, rows = _span(box.top, box.height, height)
    return left, top, columns, rows


def _span(start: float, extent: float, limit: int) -> tuple[int, int]:
    """Return the start and extent of one side in whole pixels within ``limit``."""
    length = min(max(round(extent), MIN_SIDE_PX), limit - 2 * MARGIN_PX)
    low = round(start + extent / 2.0 - length / 2.0)
    return min(max(low, MARGIN_PX), limit - MARGIN_PX - length), length
