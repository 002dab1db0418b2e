"""The floor under every score: a tracker that never moves."""

from __future__ import annotations

import numpy as np

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate

__all__ = ["Still"]


class Still:
    """Never moves: repeats the first box, the floor that every score must beat."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Remember ``box`` (px)."""
        self._estimate = Estimate(box)

    def update(self, frame: Frame) -> Estimate:
        """Return the first box again."""
        return self._estimate
