"""Condensation with as many particles as their spread needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from simbench.core.errors import TrackerError
from simbench.trackers.condensation import PAPER, Condensation
from simbench.trackers.parts.kld_sampling import KldSampling

__all__ = ["CondensationKld", "condensation_kld_paper"]


@dataclass(kw_only=True, eq=False)
class CondensationKld(Condensation):
    """Condensation whose number of particles adapts to their spread (KLD sampling).

    In each frame particles are drawn and propagated one by one, and counted into bins
    of place and size. When enough are drawn for the bins that they occupy, the drawing
    ends, and these are measured: few where the target is certain, many where it is not,
    as in the first frames, behind an occluder or in a search.

    Parameters
    ----------
    particles : int
        The most in a frame.
    least_particles : int
        The least in a frame.
    epsilon : float
        Bound on the Kullback-Leibler distance between the particles' distribution over
        the bins and the true one. Twice as large takes half as many particles.
    delta : float, in (0, 1)
        Probability with which the distance exceeds it.
    bin_boxes : float
        Side of a bin in x and y, in widths and heights of the estimated box.
    bin_growth : float
        Side of a bin in the log of the size.
    resampling : str
        ``multinomial``: the particles are drawn one by one.
    samples, sigma, surround, background, structure, learning, warm_up_noise, \
    position_noise, error_noise, scale_noise, aspect_noise, drift, search, \
    camera_motion, keep_cloud
        As for `Condensation`.

    References
    ----------
    Fox (2001), "KLD-sampling: adaptive particle filters", NIPS 14, table 1. The paper
    has bins of 50 cm by 50 cm by 10 degrees for a robot in a building, an epsilon of
    0.05 and a delta of 0.01. Bins in boxes make the number of particles independent of
    the target's size in pixels; epsilon is chosen so that about as many are used on a
    steady course as by `Condensation`.
    """

    particles: int = 500
    least_particles: int = 30
    epsilon: float = 0.15
    delta: float = 0.01
    bin_boxes: float = 0.1
    bin_growth: float = 0.1
    resampling: str = "multinomial"

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        if self.resampling != "multinomial":
            raise TrackerError(
                "resampling must be multinomial, since the particles are drawn one by "
                f"one, got {self.resampling!r}"
            )
        if self.least_particles > self.particles:
            raise TrackerError(
                f"least_particles must be at most particles, {self.particles}, "
                f"got {self.least_particles}"
            )
        self._sampling = KldSampling(
            least=self.least_particles,
            epsilon=self.epsilon,
            delta=self.delta,
            bin_boxes=self.bin_boxes,
            bin_growth=self.bin_growth,
        )

    @property
    def _kld(self) -> KldSampling:
        return self._sampling


def condensation_kld_paper(**parameters: Any) -> CondensationKld:
    """KLD sampling on the paper's condensation; parameters of `CondensationKld`.

    As `condensation_paper`, a random walk. Its cloud is so wide that Fox's epsilon of
    0.05 would always take the most particles; here it is that of `CondensationKld`.
    """
    return CondensationKld(**{**PAPER, "drift": False, **parameters})
