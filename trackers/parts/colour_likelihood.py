"""Similarity of places in a frame to the colour histogram of the target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.colour_histogram import (
    bin_table,
    disc_samples,
    histogram,
    ring_samples,
    similarities,
)

__all__ = ["ColourLikelihood"]

REFERENCE_SAMPLES = 4096  # used rarely, so dense enough to cover every pixel
RING = (1.1, 1.5)  # of the half axes: just outside the target
AROUND = (1.1, 2.0)  # of the half axes: background that the first box may include
TINY = 1e-12  # avoids division by zero


class ColourLikelihood:
    """Likelihood of ellipses under the colour histogram of the first frame.

    It counts its own evaluations: a tracker's particle usage is the difference of
    `evaluations` over a frame, not a number that the tracker declares.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        First frame.
    ellipse : (4,) float, px
        The target in it: centre x, y and half axes Hx, Hy.
    samples : int
        Sample points in an ellipse.
    surround : float
        Penalty on target colours in a ring just outside the ellipse, relative to that
        ring in the first frame; 0 is the likelihood of the paper.
    background : float
        How strongly colours that also surround the target are reduced in the
        reference; 0 is the likelihood of the paper.

    Attributes
    ----------
    evaluations : int
        Ellipses evaluated so far.
    reference : (BINS,) float
        Shares of the target's colours in the first frame, summing to 1.
    table, samples, ring, surround, first_around
        For a compiled filter: `bin_table`, the points in an ellipse and in the ring,
        the parameter, and the similarity of the ring in the first frame.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section II, eq. 2. The paper does not give the kernel; here it
    is uniform.

    Notes
    -----
    Surround and background depart from the paper, whose plain histogram loses a
    receding car. On the scenario ``poles``, seeds 1000 to 1005, a background of 1
    alone took directional-45 from 0.73 to 0.94 in precision and from 0.33 to 0.64 in
    success.

    The ellipse in the first box includes road and shadow beside the car, and a plain
    histogram follows them as well. For a colour with share q inside and o around,
    ``q / (q + background * o)`` is the degree to which it belongs to the target; the
    reference is q times that, normalised.

    A histogram over an ellipse hardly changes when the ellipse shrinks inside a car
    of one colour, so that the estimated size falls by half within a hundred frames,
    and with it the overlap. An ellipse that is too small leaves the car's colours in
    the ring, which the surround penalises. Since the penalty is relative to the first
    frame, its optimum is the size of the first box.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
        *,
        samples: int,
        surround: float,
        background: float = 0.0,
    ) -> None:
        self.evaluations = 0
        self.surround = surround
        self._background = background
        self.samples = disc_samples(samples)
        self.ring = ring_samples(max(samples // 4, 1), *RING)
        self.table = bin_table()
        self.reference = self._target_shares(image, ellipse)
        self.first_around = float(self._compare(image, ellipse[None], self.ring)[0])

    def similarities(
        self, image: NDArray[np.uint8], ellipses: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the similarity of ellipses to the target, and count them.

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
        rho = self._compare(image, ellipses, self.samples)
        if self.surround > 0.0:
            around = self._compare(image, ellipses, self.ring)
            rho -= self.surround * np.maximum(around - self.first_around, 0.0)
        return rho

    def _target_shares(
        self, image: NDArray[np.uint8], ellipse: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the (BINS,) colour shares of the target without its background."""
        inside = self._shares(image, ellipse, disc_samples(REFERENCE_SAMPLES))
        around = self._shares(image, ellipse, ring_samples(REFERENCE_SAMPLES, *AROUND))
        own = inside / np.maximum(inside + self._background * around, TINY)
        return np.asarray(inside * own / max(float(inside @ own), TINY))

    def _shares(
        self,
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
        points: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return the (BINS,) colour shares at points relative to one ellipse."""
        counts = histogram(image, self.table, ellipse, points)
        return np.asarray(counts / max(int(counts.sum()), 1))

    def _compare(
        self,
        image: NDArray[np.uint8],
        ellipses: NDArray[np.float64],
        points: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        return np.asarray(
            similarities(image, self.table, ellipses, points, self.reference)
        )
