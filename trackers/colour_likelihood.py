"""How likely places in a frame are, given the colours of the target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.colour_histogram import (
    BINS,
    bin_table,
    disc_samples,
    histogram,
    ring_samples,
    similarities,
)

__all__ = ["ColourLikelihood"]

REFERENCE_SAMPLES = 4096  # the first frame is read once, so as good as every pixel
RING = (1.1, 1.5)  # of the half axes: just outside, where a car is no more


class ColourLikelihood:
    """Likelihood of ellipses under the colour histogram of the first frame.

    It counts what it evaluates: a tracker's particle usage is the difference of
    `evaluations` over a frame, not what the tracker believes it asked for.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        First frame.
    ellipse : (4,) float, px
        The target there: centre x, y and half axes Hx, Hy.
    samples : int
        Places read in an ellipse.
    sigma : float
        Spread of the distance d, eq. 4.
    surround : float
        Penalty on target colours in a ring just outside the ellipse, above what that
        ring showed in the first frame; 0 is the likelihood of the paper.

    Attributes
    ----------
    evaluations : int
        Ellipses evaluated so far.
    reference : (BINS,) float
        Shares of the target's colours in the first frame.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section II, eqs. 2 to 5. The paper gives neither sigma nor the
    kernel; the kernel here is uniform.

    Notes
    -----
    The surround departs from the paper. A histogram over an ellipse hardly changes
    when the ellipse shrinks inside a car of one colour, so that the size drifts down
    by half within a hundred frames and takes the overlap with it. A car cut too
    small leaves its own colours in the ring, which is what the penalty sees. Taken
    relative to the first frame it leaves the optimum where the first box put it.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
        *,
        samples: int,
        sigma: float,
        surround: float,
    ) -> None:
        self.evaluations = 0
        self._sigma = sigma
        self._surround = surround
        self._samples = disc_samples(samples)
        self._ring = ring_samples(max(samples // 2, 1), *RING)
        self._table = bin_table()
        counts = np.zeros(BINS, np.int64)
        histogram(image, self._table, ellipse, disc_samples(REFERENCE_SAMPLES), counts)
        self.reference = counts / max(int(counts.sum()), 1)
        self._first_around = float(self._compare(image, ellipse[None], self._ring)[0])

    def similarities(
        self, image: NDArray[np.uint8], ellipses: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return how like the target ellipses look, and count them.

        Parameters
        ----------
        image : (H, W, 3) uint8, RGB
        ellipses : (N, 4) float, px
            Centre x, y and half axes Hx, Hy.

        Returns
        -------
        (N,) float, at most 1
            Bhattacharyya coefficient, eq. 2, less the penalty on the surround.
        """
        self.evaluations += len(ellipses)
        rho = self._compare(image, ellipses, self._samples)
        if self._surround > 0.0:
            around = self._compare(image, ellipses, self._ring)
            rho -= self._surround * np.maximum(around - self._first_around, 0.0)
        return rho

    def log_weights(self, rho: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return unnormalised log weights, eq. 4 with ``d^2 = 1 - rho`` (eq. 3).

        Parameters
        ----------
        rho : (N,) float, at most 1
            From `similarities`; N at least 1.

        Returns
        -------
        (N,) float
            ``(rho - max rho) / (2 sigma^2)``: eq. 4 up to a factor that normalising
            takes away, with which the best particle cannot underflow.
        """
        scaled: NDArray[np.float64] = (rho - rho.max()) / (2.0 * self._sigma**2)
        return scaled

    def _compare(
        self,
        image: NDArray[np.uint8],
        ellipses: NDArray[np.float64],
        places: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        rho: NDArray[np.float64] = similarities(
            image, self._table, ellipses, places, self.reference
        )
        return rho
