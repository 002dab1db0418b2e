"""OpenCV's own trackers, as far as the installed build has them, as a `Tracker`."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate

__all__ = ["OpenCvTracker", "opencv_tracker_names"]

MIN_SIDE_PX = 16  # in a smaller box MIL never finishes placing its features
MARGIN_PX = 8  # MIL also samples negative examples beside the target
# Trackers that need a network file cannot be made from their name alone.
_NEED_MODELS = {"DaSiamRPN", "GOTURN", "Nano", "Vit"}


def opencv_tracker_names() -> list[str]:
    """Return the names of the trackers in this build of OpenCV, sorted.

    Returns
    -------
    list of str
        As ``MIL``; those of the legacy module as ``legacy.MOSSE``, where the main
        module lacks them. The plain wheel has ``MIL`` alone; ``KCF``, ``CSRT`` and the
        legacy ones come with opencv-contrib.
    """
    names = _names_in(cv2) - _NEED_MODELS
    legacy = _names_in(getattr(cv2, "legacy", None))
    return sorted(names) + sorted(f"legacy.{name}" for name in legacy - names)


class OpenCvTracker:
    """A tracker of OpenCV by name, with its default parameters.

    Parameters
    ----------
    name : str
        One of `opencv_tracker_names`, the prefix ``legacy.`` optional where the main
        module has no tracker of that name.

    Raises
    ------
    TrackerError
        If the installed build has no such tracker.

    Notes
    -----
    In a frame in which OpenCV reports a failure the last box is repeated with
    confidence 0; otherwise confidence is 1, since that is all they say. Runs are
    reproducible for trackers that use OpenCV's generator or no randomness; MIL seeds
    its features from the clock, so that two runs of it may differ.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._create = _creator(name)

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
            return Estimate(self._box, confidence=1.0)
        return Estimate(self._box, confidence=0.0)


def _names_in(module: Any) -> set[str]:
    """Return X for every class TrackerX of a module that can be created."""
    return {
        name.removeprefix("Tracker")
        for name in dir(module)
        if name.startswith("Tracker") and hasattr(getattr(module, name), "create")
    }


def _creator(name: str) -> Any:  # Any: OpenCV's stubs lack the legacy module
    plain = name.removeprefix("legacy.")
    modules = [getattr(cv2, "legacy", None)]
    if plain == name:
        modules.insert(0, cv2)
    for module in modules:
        create = getattr(getattr(module, f"Tracker{plain}", None), "create", None)
        if create is not None and plain not in _NEED_MODELS:
            return create
    known = ", ".join(opencv_tracker_names()) or "none"
    raise TrackerError(
        f"OpenCV {cv2.__version__} as installed has no tracker {plain!r}; it has: "
        f"{known} (KCF, CSRT and others come with opencv-contrib-python-headless)"
    )


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
