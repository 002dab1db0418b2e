"""How likely places in a frame are, given the colours of the target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.colour_histogram import (
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
TINY = 1e-12  # an empty bin is nobody's
AROUND = (1.1, 2.0)  # of the half axes: what the first box may have cut in


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
    background : float
        How strongly the reference disowns colours that also lie around the target; 0
        is the likelihood of the paper.

    Attributes
    ----------
    evaluations : int
        Ellipses evaluated so far.
    reference : (BINS,) float
        Shares of the target's colours in the first frame, summing to 1.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section II, eqs. 2 to 5. The paper gives neither sigma nor the
    kernel; the kernel here is uniform.

    Notes
    -----
    Surround and background depart from the paper, whose plain histogram loses a car
    that recedes. On the scenario ``poles``, seeds 1000 to 1005, a background of 1
    alone took directional-45 from 0.73 to 0.94 in precision and from 0.33 to 0.64 in
    success.

    The ellipse in the first box holds road and shadow beside the car, and a plain
    histogram follows them as readily. Of a colour that makes up a share q inside and
    o around, ``q / (q + background * o)`` is how far it can be told to be the
    target's; the reference holds q times that.

    A histogram over an ellipse hardly changes when the ellipse shrinks inside a car
    of one colour, so that the size drifts down by half within a hundred frames and
    takes the overlap with it. A car cut too small leaves its own colours in the ring,
    which is what the surround sees. Taken relative to the first frame it leaves the
    optimum where the first box put it.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
        *,
        samples: int,
        sigma: float,
        surround: float,
        background: float = 0.0,
    ) -> None:
        self.evaluations = 0
        self._sigma = sigma
        self._surround = surround
        self._background = background
        self._samples = disc_samples(samples)
        self._ring = ring_samples(max(samples // 4, 1), *RING)
        self._table = bin_table()
        self.reference = self._own(image, ellipse)
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

    def learn(
        self, image: NDArray[np.uint8], ellipse: NDArray[np.float64], share: float
    ) -> None:
        """Mix what an ellipse shows now into the reference, by a share in [0, 1]."""
        self.reference += share * (self._own(image, ellipse) - self.reference)

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

    def _own(
        self,
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return the (BINS,) shares of the colours that are the target's own."""
        inside = self._shares(image, ellipse, disc_samples(REFERENCE_SAMPLES))
        around = self._shares(image, ellipse, ring_samples(REFERENCE_SAMPLES, *AROUND))
        own = inside / np.maximum(inside + self._background * around, TINY)
        return np.asarray(inside * own / max(float(inside @ own), TINY))

    def _shares(
        self,
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
        places: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return the (BINS,) shares of colours at places about one ellipse."""
        counts = np.zeros(BINS, np.int64)
        histogram(image, self._table, ellipse, places, counts)
        return np.asarray(counts / max(int(counts.sum()), 1))

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
