"""The velocity of a target: smooth, or the last displacement where that is better."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["BestVelocity"]

GROWTH_GAIN = 0.05  # weight of the newest change of size in the velocity
COAST_DECAY = 0.97  # of the velocity, by frame in which nothing is measured
ERROR_GAIN = 0.1  # weight of the newest squared error of a prediction
QUICK_ERROR = 0.5  # of the smooth velocity's squared error: below it the quick leads


class BestVelocity:
    """Displacement by frame in the Lie algebra: the better of two predictions.

    A smooth velocity carries a target on behind what hides it, and lags behind one that
    turns or that a camera swings past by ``1 / smoothing`` frames. The last
    displacement lags by one frame, with all the noise of two estimates. Whichever has
    predicted better of late leads; in doubt the smooth one does.

    Parameters
    ----------
    smoothing : float, in (0, 1]
        Weight of the last displacement in the smooth velocity.
    is_quick : bool
        Whether the last displacement may lead.

    Attributes
    ----------
    leading : (6,) float, or None
        Growth and translation by frame; the other modes are 0. None before the first
        displacement.

    Examples
    --------
    >>> velocity = BestVelocity(smoothing=0.1, is_quick=True)
    >>> steps = np.zeros((9, 6))
    >>> steps[:, 4] = np.arange(9)  # it speeds up
    >>> _ = velocity.start(steps[0], trust=1.0)
    >>> [float(velocity.follow(step, trust=1.0)[4]) for step in steps[1:]][-3:]
    [6.0, 7.0, 8.0]
    """

    def __init__(self, *, smoothing: float, is_quick: bool) -> None:
        self._gains = np.array([GROWTH_GAIN, 0.0, 0.0, 0.0, smoothing, smoothing])
        self._is_quick = is_quick
        self._smooth = self._quick = np.zeros(6)
        self.leading: NDArray[np.float64] | None = None
        self._errors = np.zeros(2)  # squared, in boxes: of the smooth and the quick

    def start(self, moved: NDArray[np.float64], trust: float) -> NDArray[np.float64]:
        """Take the first displacement, (6,), as far as it is trusted; return it."""
        first = np.zeros(6)
        first[4:] = trust * moved[4:]
        return self.restart(first)

    def follow(self, moved: NDArray[np.float64], trust: float) -> NDArray[np.float64]:
        """Take a displacement (6,) and what it is worth, in [0, 1]; return the best."""
        off = np.array([moved - self._smooth, moved - self._quick])[:, 4:]
        squared = (off**2).sum(axis=1)
        self._errors += ERROR_GAIN * trust * (squared - self._errors)
        self._smooth = self._smooth + self._gains * (moved - self._smooth)
        self._quick = self._smooth.copy()
        self._quick[4:] = moved[4:]
        if trust == 0.0:
            self._smooth = COAST_DECAY * self._smooth
        quick, smooth = self._errors[1], self._errors[0]
        leads = self._is_quick and trust == 1.0 and quick < QUICK_ERROR * smooth
        best: NDArray[np.float64] = self._quick if leads else self._smooth
        self.leading = best
        return best

    def restart(self, velocity: NDArray[np.float64]) -> NDArray[np.float64]:
        """Set the velocity, (6,), of a target that was found again, and return it."""
        self._smooth = self._quick = self.leading = velocity
        return velocity
