"""Where a target would be, had it gone on as it went while it was clearly seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp, log_between

__all__ = ["DeadReckoning"]

CLEAR = 0.9  # of the usual confidence: from there the target counts as clearly seen
VELOCITY_GAIN = 0.1  # weight of the newest displacement in the velocity
DECAY = 0.98  # of the velocity, by frame not clearly seen
USUAL_GAIN, LOST_GAIN = 0.04, 0.005  # weight of a new confidence in the usual one
FIRST_FRAMES = 8  # seen clearly in any case: what is usual is not known yet
KEPT = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 1.0])  # growth and translation


class DeadReckoning:
    """The last clear sight of a target, moved on at its velocity of that time.

    A target that passes behind something is seen less and less, and a tracker that
    follows the part it sees slows down with it and stays behind. The velocity here is
    learnt in clear sight only, and is what the target comes out with.

    Parameters
    ----------
    state : (2, 3) float, px
        The target in the first frame.

    Attributes
    ----------
    state : (2, 3) float, px
        Where the target would be now.
    velocity : (6,) float
        Its displacement by frame, in the Lie algebra.
    usual : float, in [0, 1]
        Running mean of the confidence; 0 before the first one.
    frames_lost : int
        Frames since the target was lost; 0 while it is not.
    """

    def __init__(self, state: NDArray[np.float64]) -> None:
        self.state = state
        self.velocity: NDArray[np.float64] | None = None
        self.usual = 0.0
        self.frames_lost = 0
        self._frames = self._frames_unclear = 0

    def follow(
        self,
        state: NDArray[np.float64],
        velocity: NDArray[np.float64],
        confidence: float,
        *,
        is_lost: bool,
    ) -> None:
        """Take the tracker's estimate of a frame, with its confidence in [0, 1].

        In clear sight it is where the target is; else the target moves on. The
        tracker's own velocity, (6,), is taken in its first frame only.
        """
        self.usual = self.usual or confidence
        if self.velocity is None:
            self.velocity = velocity * KEPT
        self._frames += 1
        if confidence >= CLEAR * self.usual or self._frames <= FIRST_FRAMES:
            if self._frames_unclear == 0:
                moved = log_between(self.state[None], state[None])[0] * KEPT
                self.velocity = self.velocity + VELOCITY_GAIN * (moved - self.velocity)
            self.state, self._frames_unclear = state, 0
        else:
            self.state = compose(self.state, exp(self.velocity))
            self.velocity = DECAY * self.velocity
            self._frames_unclear += 1
        gain = LOST_GAIN if is_lost else max(USUAL_GAIN, 1.0 / self._frames)
        self.usual += gain * (confidence - self.usual)
