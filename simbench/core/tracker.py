"""The contract between the bench and a tracker, and what one run of it yields."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.frame import Frame

__all__ = ["Estimate", "Failure", "FailureKind", "Track", "Tracker"]

FailureKind = Literal["exception", "timeout", "not-a-number"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """Where a tracker believes the target is in one frame.

    Attributes
    ----------
    box : Box, px
        Finite; may reach outside the image.
    confidence : float, in [0, 1]
        The tracker's own belief; 1 for trackers that state none.
    particles : int
        Likelihood evaluations spent on this frame, counted by the likelihood itself;
        0 for trackers without particles.
    cloud : (N, 3) float or None
        Optional particle cloud for display: centre x, y [px] and normalised weight.
    """

    box: Box
    confidence: float = 1.0
    particles: int = 0
    cloud: NDArray[np.float64] | None = None


@runtime_checkable
class Tracker(Protocol):
    """A single-object tracker.

    The bench calls `init` once with the first frame and the true box, then `update`
    once a frame in order. A tracker never writes into ``frame.image`` and draws
    random numbers only from the generator it was given.
    """

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Start on a frame in which ``box`` (px) bounds the target."""
        ...

    def update(self, frame: Frame) -> Estimate:
        """Return where the target is in the next frame."""
        ...


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a run ended before its sequence did.

    Attributes
    ----------
    frame : int
        0-based frame at which it happened.
    kind : {"exception", "timeout", "not-a-number"}
        What happened.
    message : str
        One line for the user.
    """

    frame: int
    kind: FailureKind
    message: str


@dataclass(frozen=True, slots=True)
class Track:
    """What one tracker said over a sequence of T frames.

    Attributes
    ----------
    boxes : (T, 4) float, px
        ``left, top, width, height``; row 0 is the given box. NaN from the frame of a
        failure on.
    confidence : (T,) float, in [0, 1]
        Row 0 is 1. NaN from a failure on.
    particles : (T,) int
        Likelihood evaluations by frame; row 0 (initialisation) is 0.
    seconds : (T,) float, s
        Wall time of `init` (row 0) and of each `update`, image reading excluded. NaN
        from a failure on.
    seed : int
        Seed of the generator handed to the tracker.
    failures : tuple of Failure
        Empty for a run that reached the end.
    clouds : tuple of ((N, 3) float array or None)
        Particle clouds by frame where kept, else empty.
    """

    boxes: NDArray[np.float64]
    confidence: NDArray[np.float64]
    particles: NDArray[np.int64]
    seconds: NDArray[np.float64]
    seed: int
    failures: tuple[Failure, ...] = ()
    clouds: tuple[NDArray[np.float64] | None, ...] = field(default=(), repr=False)
