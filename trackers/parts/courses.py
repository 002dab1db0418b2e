"""A target's course in the image, and that before a moving background."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.course import Course

__all__ = ["Courses"]

BACKGROUND_ERROR = 0.8  # of the course's in the image: below it the background leads
UNKNOWN_GAIN = 0.1  # of the newest frame whose shift is unknown
UNKNOWN_SHARE = 0.15  # of the frames, smoothed: above it the background does not lead


class Courses:
    """The same target's course in two frames of reference, and the better of them.

    A camera that shakes moves every target with the background, so that a course before
    the background predicts better. One that follows its target moves the background
    only, and a course in the image predicts better.

    Parameters
    ----------
    course : Course
        In the image; the one before the background is the same until that moves.

    Attributes
    ----------
    leading : Course
        The one that has predicted better of late.
    shift : tuple of float, px
        Of the frame of reference of ``leading`` since the last frame.
    """

    def __init__(self, course: Course) -> None:
        self.leading = course
        self.shift = (0.0, 0.0)
        self._image = self._background = course
        self._travel = (0.0, 0.0)  # of the background so far
        self._is_shift_known = True
        self._unknown = 0.0  # smoothed share of frames in which it was not

    def choose(self, shift: NDArray[np.float64] | None) -> None:
        """Choose the leading course after a shift (2,) of the background, px, or None.

        None says that the background moved in an unknown way.
        """
        dx, dy = (0.0, 0.0) if shift is None else shift.tolist()
        self.leading, self.shift = self._image, (0.0, 0.0)
        self._is_shift_known = shift is not None
        self._unknown += UNKNOWN_GAIN * ((shift is None) - self._unknown)
        self._travel = (self._travel[0] + dx, self._travel[1] + dy)
        if self._background is self._image:
            if dx == dy == 0.0:
                return
            self._background = copy.copy(self._image)
            self._travel = (dx, dy)
        predicts = self._background.error < BACKGROUND_ERROR * self._image.error
        if predicts and self._is_shift_known and self._unknown < UNKNOWN_SHARE:
            self.leading, self.shift = self._background, (dx, dy)

    def places(
        self, x: float, y: float, trust: float
    ) -> Iterator[tuple[Course, float, float, float]]:
        """Iterate over the courses, a position in the image as each sees it, and trust.

        A position before a background whose shift is unknown is not to be trusted.
        """
        yield self._image, x, y, trust
        if self._background is not self._image:
            known = trust if self._is_shift_known else 0.0
            yield self._background, x - self._travel[0], y - self._travel[1], known
