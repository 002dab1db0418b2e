"""The baseline for every score: a tracker whose box never moves."""

from __future__ import annotations

import numpy as np

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate

__all__ = ["Still"]


class Still:
    """Baseline that repeats the first box in every frame."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Keep ``box`` (px)."""
        self._estimate = Estimate(box)

    def update(self, frame: Frame) -> Estimate:
        """Return the first box."""
        return self._estimate
