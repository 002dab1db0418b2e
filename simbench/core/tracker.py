"""The interface a tracker implements, and the result of one run of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Final, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame

__all__ = [
    "NO_BOX",
    "Diagnostics",
    "Estimate",
    "Failure",
    "FailureKind",
    "Phase",
    "Track",
    "Tracker",
]

FailureKind = Literal["exception", "timeout", "not-a-number", "memory", "crash"]
"""It raised, took too long, returned an invalid number, ran out of its memory limit, or
ended its process."""
Phase = Literal["construction", "init", "update"]

NO_BOX: Final = Box(math.nan, math.nan, math.nan, math.nan)
"""The box of a frame in which the tracker says that the target is absent."""


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """What the particles of a filter tell of one frame; NaN is "not stated".

    Attributes
    ----------
    effective_sample_size : float
        ``1 / sum w^2`` of the N normalised weights, in [1, N].
    weight_entropy : float, nats
        ``-sum w log w``, in [0, log N].
    share_gated : float, in [0, 1]
        Share of the particles that a gate dropped, so that were not measured.

    Raises
    ------
    TrackerError
        If one is infinite or no number.

    Examples
    --------
    >>> from simbench import Box, Diagnostics, Estimate
    >>> stated = Diagnostics(effective_sample_size=37.5, share_gated=0.4)
    >>> Estimate(Box(10.0, 20.0, 30.0, 40.0), diagnostics=stated).diagnostics
    Diagnostics(effective_sample_size=37.5, weight_entropy=nan, share_gated=0.4)
    """

    effective_sample_size: float = math.nan
    weight_entropy: float = math.nan
    share_gated: float = math.nan

    def __post_init__(self) -> None:
        """Check that all are numbers."""
        for one in fields(self):
            value = getattr(self, one.name)
            if not isinstance(value, int | float | np.number) or math.isinf(value):
                shown = repr(value)[:200]
                raise TrackerError(f"{one.name} must be a number or NaN, got {shown}")


@dataclass(frozen=True, slots=True)
class Estimate:
    """A tracker's estimate of the target in one frame.

    Attributes
    ----------
    box : Box, px
        Finite; may reach outside the image. Left out, or of no meaning, where the
        tracker says that the target is absent.
    confidence : float, in [0, 1], or None
        The tracker's own confidence that the box is on the target. None, the default,
        is "not stated": no measure of confidence is computed then.
    particles : int
        Likelihood evaluations spent on this frame, counted by the likelihood itself;
        0 for trackers without particles.
    cloud : (N, 3) float or None
        Optional particle cloud for display: centre x, y [px] and normalised weight.
    absent : bool
        The tracker says that the target is not in the image, or wholly hidden: the
        frame then has no box (NaN in tables).
    diagnostics : Diagnostics or None
        Optional numbers of the particles, which become columns of the frame table.

    Examples
    --------
    >>> from simbench import Box, Estimate
    >>> Estimate(Box(10.0, 20.0, 30.0, 40.0), confidence=0.9, particles=100).particles
    100
    >>> Estimate(absent=True).box.is_finite
    False
    """

    box: Box = NO_BOX
    confidence: float | None = None
    particles: int = 0
    cloud: NDArray[np.float64] | None = None
    absent: bool = False
    diagnostics: Diagnostics | None = None


@runtime_checkable
class Tracker(Protocol):
    """A single-object tracker.

    The benchmark calls `init` once with the first frame and the true box, then
    `update` once a frame in order. A tracker never writes into ``frame.image`` and
    takes random numbers only from the generator it was given.

    Examples
    --------
    >>> from simbench import Estimate, Tracker
    >>> class Fixed:
    ...     def init(self, frame, box, rng):
    ...         self.box = box
    ...     def update(self, frame):
    ...         return Estimate(self.box)
    >>> isinstance(Fixed(), Tracker)
    True
    """

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        ...

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        ...


@dataclass(frozen=True, slots=True)
class Failure:
    """The failure that ended a run before the end of its sequence.

    Attributes
    ----------
    frame : int
        0-based frame at which it happened.
    kind : {"exception", "timeout", "not-a-number", "memory", "crash"}
        Kind of failure.
    message : str
        One line for the user.
    phase : {"construction", "init", "update"}
        What the tracker was doing.
    """

    frame: int
    kind: FailureKind
    message: str
    phase: Phase = "update"

    def __str__(self) -> str:
        """Return the failure as one line."""
        where = f"frame {self.frame}" if self.phase == "update" else self.phase
        return f"{where}: {self.kind}: {self.message}"


@dataclass(frozen=True, slots=True)
class Track:
    """The estimates of one tracker over a sequence of T frames.

    Attributes
    ----------
    boxes : (T, 4) float, px
        ``left, top, width, height``; row 0 is the given box. NaN where the tracker says
        that the target is absent, and from the frame of a failure on.
    confidence : (T,) float, in [0, 1]
        Row 0 is 1. NaN where the tracker states none, and from a failure on.
    particles : (T,) int
        Likelihood evaluations by frame; row 0 (initialisation) is 0.
    seconds : (T,) float, s
        Wall time of `init` (row 0) and of each `update`, image reading excluded. NaN
        from a failure on.
    seed : int
        Seed of the generator passed to the tracker.
    failures : tuple of Failure
        Empty for a run that reached the end.
    tracker : str
        Label of the tracker, in tables and plots.
    repetition : int
        Index of the run among several of the tracker on the same sequence.
    clouds : tuple of ((N, 3) float array or None)
        Particle clouds by frame where kept, else empty.
    diagnostics : mapping from str to (T,) float array
        The fields of `Diagnostics` by frame, NaN where not stated; empty where the
        tracker states none in any frame.

    Examples
    --------
    >>> import numpy as np
    >>> from simbench import Track
    >>> Track(
    ...     boxes=np.array([[10.0, 20.0, 30.0, 40.0], [12.0, 20.0, 30.0, 40.0]]),
    ...     confidence=np.ones(2),
    ...     particles=np.array([0, 100]),
    ...     seconds=np.array([0.01, 0.002]),
    ...     seed=0,
    ...     tracker="mine",
    ... ).tracker
    'mine'
    """

    boxes: NDArray[np.float64]
    confidence: NDArray[np.float64]
    particles: NDArray[np.int64]
    seconds: NDArray[np.float64]
    seed: int
    failures: tuple[Failure, ...] = ()
    tracker: str = ""
    repetition: int = 0
    clouds: tuple[NDArray[np.float64] | None, ...] = field(default=(), repr=False)
    diagnostics: Mapping[str, NDArray[np.float64]] = field(
        default_factory=dict, repr=False
    )

    @property
    def absent(self) -> NDArray[np.bool_]:
        """Where the tracker says that the target is absent, (T,) bool."""
        has_no_box = ~np.isfinite(self.boxes).all(axis=1)
        ends = min((one.frame for one in self.failures), default=len(self.boxes))
        return has_no_box & (np.arange(len(self.boxes)) < ends)
