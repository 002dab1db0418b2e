"""GDPF: particle filters on the affine group that differ in their transition only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.trackers.parts.affine_filter import PAPER, AffineFilter
from simbench.trackers.parts.affine_group import compose, exp
from simbench.trackers.parts.parameter_checks import check_positive
from simbench.trackers.parts.resampling import systematic
from simbench.trackers.parts.swarm import Swarm
from simbench.trackers.parts.transitions import GrowingAlpha, autoregressive

__all__ = [
    "Gdpf",
    "gdpf_brow",
    "gdpf_brow_paper",
    "gdpf_fix",
    "gdpf_fix_paper",
    "gdpf_inc",
    "gdpf_inc_paper",
]

TRANSITIONS = ("brownian", "constant", "growing")


@dataclass(kw_only=True, eq=False)
class Gdpf(AffineFilter):
    """Particle filter on the affine group, with resampling and no swarm, N = 50.

    In each frame particles are resampled by the weights of the last frame, moved by the
    transition, and measured once; the estimate is their weighted mean.

    Parameters
    ----------
    transition : {"brownian", "constant", "growing"}
        GDPF-Brow, ``X exp(dW)``; GDPF-Fix, ``X exp(A dt + dW)`` with a constant alpha;
        GDPF-Inc, the same with an alpha that grows by ``alpha_step`` with each frame
        up to ``alpha``.
    alpha : float
        Share of the velocity kept from frame to frame: all of the time, or at last.
    alpha_step : float
        By which alpha grows, from its first value, which is ``alpha_step`` too.
    mean_width : float, above 0
        Width, in confidence, of the weights: those of the mean that is the estimate,
        and of resampling.
    particles, position_noise, first_position_noise, scale_noise, least_noise, \
    appearance, weights, hidden, structure, balance, first_share, template_gain, \
    colour_gain, background_gain, size_prior, aspect_prior, motion_prior, trust_none, \
    trust_all, size_gain, smoothing, quick, lost_below, found_above, learn_from, \
    background_from, keep_cloud
        As for `AffineFilter`.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 3, eqs. 1 to 4, whose baselines these are.

    Notes
    -----
    Appearance, noise and thresholds are those of `DynamicSwarmParticle`, so that what
    differs is the transition and the swarm. Chosen here, where the DSP paper only names
    the filters: the velocity is that of successive estimates, one for all particles,
    with translation and growth only, as there; weights are ``exp((c - max c) /
    mean_width)`` of the confidences c; systematic resampling in each frame; in the
    first update, where no velocity is known, the best N of 4 N particles. What
    `AffineFilter` adds to the paper, ``least_noise`` to ``background_from``, is
    switched off in the papers' settings, where alpha is 0.5 and ``mean_width`` 0.1. All
    defaults were tuned on the scenario library, seeds 1000 and above.
    """

    transition: str = "constant"
    alpha_step: float = 0.1
    mean_width: float = 0.05

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        if self.transition not in TRANSITIONS:
            raise TrackerError(
                "transition must be brownian, constant or growing, got "
                f"{self.transition}"
            )
        check_positive(self, "alpha_step", "mean_width")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        super().init(frame, box, rng)
        self._cloud: Swarm | None = None
        self._growing = GrowingAlpha(self.alpha_step, self.alpha_step, self.alpha)

    def _sample(self) -> Swarm:
        """Resample the particles, move them by the transition, and measure them."""
        velocity = self._velocity.leading
        if self._cloud is None or velocity is None:
            return self._sample_first()
        weights = self._cloud.weights(self.mean_width)
        states = self._cloud.states[systematic(weights, self._rng)]
        alpha = self._alpha()
        self._predicted = compose(self._state, exp(alpha * velocity))
        noise = self._noise(self.particles, self.position_noise)
        moved = autoregressive(states, velocity, alpha, noise)
        states = self._bounded(moved)
        return Swarm.start(states, self._confidences(states))

    def _alpha(self) -> float:
        """Return the share of the velocity that the next transition keeps."""
        if self.transition == "brownian":
            return 0.0
        return self.alpha if self.transition == "constant" else self._growing.next()

    def _refine(self, swarm: Swarm) -> None:
        """Do nothing: each particle is measured once."""

    def _advance(self, swarm: Swarm, is_found: bool) -> NDArray[np.float64]:
        self._cloud = swarm
        return super()._advance(swarm, is_found)


PAPER_ALPHA, PAPER_WIDTH = 0.5, 0.1
"""Of the papers' settings, whose velocity is the last displacement, with its noise."""
_PAPER = {**PAPER, "alpha": PAPER_ALPHA, "mean_width": PAPER_WIDTH}


def gdpf_brow(**parameters: Any) -> Gdpf:
    """Particle filter on the affine group with Brownian motion, as ours.

    Parameters as for `Gdpf`.
    """
    return Gdpf(**{"transition": "brownian", **parameters})


def gdpf_fix(**parameters: Any) -> Gdpf:
    """Particle filter on the affine group with a constant share of velocity, as ours.

    Parameters as for `Gdpf`.
    """
    return Gdpf(**{"transition": "constant", **parameters})


def gdpf_inc(**parameters: Any) -> Gdpf:
    """Particle filter on the affine group with a growing share of velocity, as ours.

    Parameters as for `Gdpf`.
    """
    return Gdpf(**{"transition": "growing", **parameters})


def gdpf_brow_paper(**parameters: Any) -> Gdpf:
    """Particle filter on the affine group with Brownian motion, as in the DSP paper.

    Parameters as for `Gdpf`.
    """
    return gdpf_brow(**{**_PAPER, **parameters})


def gdpf_fix_paper(**parameters: Any) -> Gdpf:
    """Particle filter on the affine group with constant alpha, as in the DSP paper.

    Parameters as for `Gdpf`.
    """
    return gdpf_fix(**{**_PAPER, **parameters})


def gdpf_inc_paper(**parameters: Any) -> Gdpf:
    """Particle filter on the affine group with growing alpha, as in the DSP paper.

    Parameters as for `Gdpf`.
    """
    return gdpf_inc(**{**_PAPER, **parameters})
