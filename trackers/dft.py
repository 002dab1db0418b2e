"""DFT: local search for a distribution field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.distribution_field import descend, distribution_field
from simbench.trackers.parts.parameter_checks import check_positive
from simbench.trackers.parts.search_window import SearchWindow

__all__ = ["Dft"]


@dataclass(kw_only=True, eq=False)
class Dft:
    """Local search for the distribution field of the target; box of fixed size.

    In each frame: start where the last motion leads, go down the distance to the
    coarse model, from there down the distance to the fine one, and average the field
    at the new place into both.

    Parameters
    ----------
    coarse, fine : float
        Standard deviations of the smoothing of the two models, in samples.
    rate : float, in [0, 1]
        Weight of the newest frame in the models.
    reach : int
        Greatest distance of the search from its start, in samples.
    least, most : float
        The search region is sampled so that the square root of the target's area is
        within these, in samples. The paper takes pixels.

    References
    ----------
    Sevilla-Lara and Learned-Miller, "Distribution fields for tracking", CVPR 2012,
    sections 2 and 3.

    Notes
    -----
    Levels, deviations, reach and rate (1 - 0.95) are those of the authors' code.
    Confidence is 1 less half the distance of the fine field to its model: 1 where both
    are equal, 0 where they have no level in common.
    """

    coarse: float = 2.0
    fine: float = 1.0
    rate: float = 0.05
    reach: int = 30
    least: float = 8.0
    most: float = 48.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        check_positive(self, "coarse", "fine", "least")
        if self.reach < 1:
            raise TrackerError(f"reach must be at least 1, got {self.reach}")
        if not self.most >= self.least:
            raise TrackerError(f"most must be at least {self.least}, got {self.most}")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._place = np.array(box.center)
        self._motion = np.zeros(2)
        self._size = (box.width, box.height)
        target = SearchWindow.around(box, 0.0, (self.least, self.most))
        rows, columns = (max(round(side), 1) for side in target.target)
        margin = 2 * self.reach
        self._target = (rows, columns)
        self._region = SearchWindow(
            (rows + margin, columns + margin), target.step, target.target
        )
        self._deviations = (self.coarse, self.fine)
        region = self._cut(frame.image, self._place)
        self._models = [
            self._at(distribution_field(region, deviation), self.reach, self.reach)
            for deviation in self._deviations
        ]
        descend(distribution_field(region, 1.0), self._models[0], 0, 0)  # compiles it

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        extent = np.array(frame.image.shape[1::-1], np.float64)
        start = np.clip(self._place + self._motion, 0.0, extent)
        region = self._cut(frame.image, start)
        fields = [distribution_field(region, each) for each in self._deviations]
        row = column = self.reach
        distance = 2.0
        for field, model in zip(fields, self._models, strict=True):
            row, column, distance = descend(field, model, row, column)
        rate = np.float32(self.rate)
        self._models = [
            model + rate * (self._at(field, row, column) - model)
            for field, model in zip(fields, self._models, strict=True)
        ]
        moved = np.array([column - self.reach, row - self.reach]) * self._region.step
        place = np.clip(start + moved, 0.0, extent)
        self._motion, self._place = place - self._place, place
        return Estimate(
            Box.from_center(float(place[0]), float(place[1]), *self._size),
            confidence=min(max(1.0 - distance / 2.0, 0.0), 1.0),
        )

    def _cut(
        self, image: NDArray[np.uint8], place: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        """Return the grey levels of the search region around a place, uint8."""
        grey = self._region.cut(image, float(place[0]), float(place[1]))
        return (grey + np.float32(0.5)).astype(np.uint8)

    def _at(
        self, field: NDArray[np.float32], row: int, column: int
    ) -> NDArray[np.float32]:
        """Return the part of a field under the target."""
        rows, columns = self._target
        return field[row : row + rows, column : column + columns].copy()
