"""KLD sampling: as many particles as the spread of their distribution needs.

The particles are drawn one by one and counted into bins of the state space; with k bins
occupied so far, enough are drawn when the maximum-likelihood estimate of the
distribution over the bins is within a Kullback-Leibler distance of ``epsilon`` with
probability ``1 - delta``.

References
----------
Fox (2001), "KLD-sampling: adaptive particle filters", NIPS 14, eq. 7 and table 1; Fox
(2003), "Adapting the sample size in particle filters through KLD-sampling", Int. J.
Robotics Research 22(12).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numba

from simbench.core.errors import TrackerError
from simbench.trackers.parts.parameter_checks import check_positive

__all__ = ["EMPTY", "KldSampling", "claim", "particles_needed"]

EMPTY = -(1 << 62)  # no column of any bin


@dataclass(frozen=True, slots=True, kw_only=True)
class KldSampling:
    """How finely, and how surely, the particles must cover their distribution.

    Attributes
    ----------
    least : int
        Particles that are drawn in any case, at least 1.
    epsilon : float
        Bound on the Kullback-Leibler distance, above 0.
    delta : float, in (0, 1)
        Probability that the distance exceeds it.
    bin_boxes : float
        Side of a bin in x and y, in widths and heights of the estimated box.
    bin_growth : float
        Side of a bin in the log of the size.
    """

    least: int
    epsilon: float
    delta: float
    bin_boxes: float
    bin_growth: float

    def __post_init__(self) -> None:
        """Check the values."""
        if self.least < 1:
            raise TrackerError(f"least_particles must be at least 1, got {self.least}")
        check_positive(self, "epsilon", "bin_boxes", "bin_growth")
        if not 0.0 < self.delta < 1.0:
            raise TrackerError(f"delta must be in (0, 1), got {self.delta}")

    @property
    def quantile(self) -> float:
        """The ``1 - delta`` quantile of the standard normal distribution."""
        return NormalDist().inv_cdf(1.0 - self.delta)


@numba.njit(cache=True)
def particles_needed(bins, epsilon, quantile):  # type: ignore[no-untyped-def]
    """Return how many particles k occupied bins need, as a float; 1 for one bin.

    Half the ``1 - delta`` quantile of the chi-squared distribution with k - 1 degrees
    of freedom over epsilon, by Wilson and Hilferty's approximation; ``quantile`` is the
    ``1 - delta`` quantile of the standard normal distribution (Fox, eq. 7).
    """
    if bins < 2:
        return 1.0
    spread = 2.0 / (9.0 * (bins - 1))
    root = 1.0 - spread + math.sqrt(spread) * quantile
    return (bins - 1) / (2.0 * epsilon) * root**3


@numba.njit(cache=True)
def claim(column, row, layer, occupied):  # type: ignore[no-untyped-def]
    """Mark a bin (column, row, layer) as occupied; return whether it was empty.

    ``occupied`` (P, 3) int64 is a hash table, P a power of 2 and at least twice the
    number of bins; its first column holds `EMPTY` where a place is free.
    """
    mask = occupied.shape[0] - 1
    k = (column * 73856093 ^ row * 19349663 ^ layer * 83492791) & mask
    while occupied[k, 0] != EMPTY:
        entry = occupied[k]
        if entry[0] == column and entry[1] == row and entry[2] == layer:
            return False
        k = (k + 1) & mask
    occupied[k, 0], occupied[k, 1], occupied[k, 2] = column, row, layer
    return True
