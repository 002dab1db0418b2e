"""Neural Bayesian resampling filter: a network corrects what few particles leave."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.trackers.parts.nbrf_inputs import (
    estimate_inputs,
    motion_inputs,
    probe_offsets,
)
from simbench.trackers.parts.parameter_checks import check_choice
from simbench.trackers.parts.rbf_network import Network
from simbench.trackers.parts.sir_step import Spread
from simbench.trackers.parts.weights_file import read_weights, shipped_weights
from simbench.trackers.sirbf import PAPER, Sirbf
from simbench.trackers.weights import nbrf as weights

__all__ = ["CORRECTORS", "SETTINGS", "WEIGHTS", "Nbrf", "nbrf_paper"]

CORRECTORS: Final = ("network", "linear", "none")
SETTINGS: Final = ("ours", "paper")
WEIGHTS: Final = shipped_weights(weights)
MOST_RADII = 5.0  # of a correction


@dataclass(kw_only=True, eq=False)
class Nbrf(Sirbf):
    """Neural Bayesian resampling filter: `Sirbf` with a network that corrects it.

    ``X* = X_hat + dX`` (eq. 4), where dX comes from networks of Gaussian units. One
    predicts the displacement into the next frame, and shifts the particles before they
    are measured; the other corrects the estimate, and shifts the particles after it.

    Parameters
    ----------
    corrector : str
        ``network``; ``linear``: linear maps of the same inputs, fitted to the same
        samples; ``none``: none at all.
    predict : bool
        Whether the first network shifts the particles.
    refine : bool
        Whether the second one corrects the estimate.
    forget_below : float, in [0, 1]
        Where the mean similarity of the particles is below it, the target is lost: the
        path so far is forgotten. Tuned.
    setting : str
        Filter that the networks were trained with: ``ours`` or ``paper``.
    particles, samples, sigma, surround, background, position_noise, noise_px, \
    step_noise, first_noise, far_share, far_noise, scale_noise, aspect_noise, \
    threshold, resampling, estimate, keep_cloud
        As for `Sirbf`.

    Attributes
    ----------
    motion_network, estimate_network : Network or None
    first_spread : float
        Standard deviation of the displacement where none is known before, in sides.
    motion_read, estimate_read : (D,) float
        What the networks read in the last frame.
    uncorrected : (2,) float, px
        Centre of the estimate in it before the correction.

    Notes
    -----
    The paper does not say how its network is trained. These are trained offline, by
    ``simbench train nbrf``, on films of ``ball-low-rate``, ``ball-both`` and
    ``ball-bounce`` of seeds from 10,000 on and their truth, which is not read while
    tracking:

    - the motion network reads the last two displacements, place and size; it learns
      the displacement from the estimate to the next true place. Far from all that it
      has seen, its units are silent, and the particles stay where they are. While
      displacements are unknown (in the first frame, and once the target is lost) it
      knows least: the cloud is then at least as wide as its errors were in training;
    - the estimate network reads what figure 3 of the paper draws, estimate, innovation
      and gain (the spread of the cloud), and the similarity at 25 places around the
      estimate; it learns the offset to the true place. Its answer is taken only where
      the similarity does not fall.

    Both learn from runs of the filter itself: a first one without them, and one with
    them (DAgger). In each frame 26 places are measured beside the particles.

    References
    ----------
    Zhong, Peng, Zhong, "Severe-dynamic tracking problems based on lower particles
    resampling", TELKOMNIKA 12(6), 2014 (NBRF), eqs. 4 to 7, figure 3. Ross, Gordon,
    Bagnell, "A reduction of imitation learning and structured prediction to no-regret
    online learning", AISTATS 2011 (DAgger).
    """

    corrector: str = "network"
    predict: bool = True
    refine: bool = True
    forget_below: float = 0.4
    setting: str = "ours"

    def __post_init__(self) -> None:
        """Check the parameters, and read the weights."""
        super().__post_init__()
        check_choice("corrector", self.corrector, CORRECTORS)
        check_choice("setting", self.setting, SETTINGS)
        self.motion_network: Network | None = None
        self.estimate_network: Network | None = None
        self.first_spread = 0.0
        if self.corrector != "none":
            self._read_networks()

    def _read_networks(self) -> None:
        arrays = read_weights(WEIGHTS)
        prefix = f"{self.setting}.{self.corrector}"
        if self.predict:
            self.motion_network = Network.from_arrays(arrays, f"{prefix}.motion")
            self.first_spread = float(arrays[f"{self.setting}.first_spread"][0])
        if self.refine:
            self.estimate_network = Network.from_arrays(arrays, f"{prefix}.estimate")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        super().init(frame, box, rng)
        height, width = frame.image.shape[:2]
        self._extent = (width, height)
        self._path = [self._filter.mean[:2].copy()]
        self._offsets = probe_offsets()
        self.uncorrected = self._path[0]
        self.motion_read = self.estimate_read = np.empty(0)

    def _shift(self) -> tuple[float, float]:
        """Return the displacement that the motion network expects, px."""
        if self.motion_network is None and self.corrector != "none":
            return 0.0, 0.0
        side = 2.0 * self.radius
        self.motion_read = motion_inputs(self._path, side, self._extent)
        if self.motion_network is None:
            return 0.0, 0.0
        x, y = (side * self.motion_network.predict(self.motion_read)).tolist()
        return x, y

    def _spread(self) -> Spread:
        """Return the standard deviations of the next step."""
        spread = super()._spread()
        if len(self._path) > 1:
            return spread
        least = 2.0 * self.radius * self.first_spread
        return replace(spread, x=max(spread.x, least), y=max(spread.y, least))

    def _correct(self, frame: Frame) -> None:
        """Correct estimate and particles by what the estimate network answers."""
        state = self._filter
        if self.estimate_network is not None or self.corrector == "none":
            self._refine(frame.image)
        kept = [] if state.similarity < self.forget_below else self._path[-2:]
        self._path = [*kept, state.mean[:2].copy()]

    def _refine(self, image: NDArray[np.uint8]) -> None:
        state, radius = self._filter, self.radius
        self.uncorrected = state.mean[:2].copy()
        probes = np.tile(state.mean, (len(self._offsets), 1))
        probes[:, :2] += radius * self._offsets
        similarities = self._likelihood.similarities(image, probes)
        self.estimate_read = estimate_inputs(
            state.mean[:2],
            self._path[-1] + self.shift,
            self._path,
            state.cloud[state.similarities.argmax(), :2],
            np.sqrt(state.weights @ (state.cloud[:, :2] - state.mean[:2]) ** 2),
            similarities,
            radius,
        )
        if self.estimate_network is None:
            return
        most = MOST_RADII * radius
        answer = radius * self.estimate_network.predict(self.estimate_read)
        answer = np.clip(answer, -most, most)
        corrected = state.mean.copy()
        corrected[:2] += answer
        found = self._likelihood.similarities(image, corrected[None])
        if found[0] >= similarities[0]:
            state.move(answer)

    def restart_at(self, place: NDArray[np.float64]) -> None:
        """Put the particles on a place, (2,) px, and forget the path: to train with."""
        self._filter.move(place - self._filter.mean[:2])
        self._path = [self._filter.mean[:2].copy()]

    @property
    def center(self) -> NDArray[np.float64]:
        """The estimated centre in the last frame, (2,) px."""
        return self._path[-1]

    @property
    def radius(self) -> float:
        """Half the side of a square as large as the box, px."""
        return math.sqrt(self._filter.mean[2] * self._filter.mean[3])


def nbrf_paper(**parameters: Any) -> Nbrf:
    """Filter by the paper alone, as `sirbf_paper`, with networks; see `Nbrf`."""
    return Nbrf(**{**PAPER, "setting": "paper", **parameters})
